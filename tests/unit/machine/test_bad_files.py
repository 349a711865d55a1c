"""Every refusal of a machine file says where, what was found and what to do."""

import os
import re

import pytest

from rotordrop.document import read_toml
from rotordrop.errors import MachineFileError, RotordropError
from rotordrop.machine import load_machine, loads_machine
from rotordrop.machine.ross_files import read_ross
from rotordrop.record.profile import load_profile

GAP, NAME, HEAVY = 'air_gap = "250 um"', 'name = "small"', 'preload = "heavy"'
FIRST = 'bearing = { designation = "XCB71914-E" }'
SEAL = '[[clearances]]\nname = "seal"\nnode = {}\ngap = "{} mm"\n[[sensors]]'
COMMA = r"0,25 has a decimal comma; write 0\.25"

BAD = [
    # syntax and decimal commas
    (GAP, "air_gap = 0,25", f"{COMMA}, in quotes with its unit", "0,25"),
    (GAP, 'air_gap = "0,25 mm"', r"'0,25 mm' has a decimal comma; use 0\.25 mm", '"0,25'),
    (GAP, "air_gap = { guess = 0,25 }", COMMA, "0,25"),
    (GAP, "air_gap = 250 um", r'a value with a unit is a text: write "250 um" in quotes', "um"),
    (GAP, 'air_gap = "250 um', "not valid TOML: a text has no quote at its end", "air_gap"),
    (NAME, "name = small", 'a text stands in quotes: write "small"', "small"),
    (NAME, f'{NAME}\nname = "other"', "name stands here for the second time; keep one", 'name = "other"'),
    # keys
    (NAME, f"{NAME}\ngravity = [0.0, -9.81]", "gravity as a direction is reserved", "gravity"),
    (NAME, f'{NAME}\nside_force = "5 N"', "'5 N' has a unit; side_force is .* over the weight", "5 N"),
    (GAP, 'airgap = "250 um"', "unknown key 'airgap'; did you mean 'air_gap'", "airgap"),
    (GAP, f'{GAP}\nkind = "planetary"', "is reserved for bearings of .*; there are .*sleeve", "kind"),
    (GAP, f'{GAP}\nmount = "soft"', "'soft' is no mount; write a list .*kind = .stop", "mount"),
    ("[[rotor.discs]]", "[[rotor.disks]]", "unknown key 'disks'; did you mean 'discs'", "rotor.disks"),
    ("[speed]", "[sped]", "unknown key 'sped'; did you mean 'speed'", "sped"),
    ("elements = 2", "elements = 2\nshaft_tabel = 1", "'shaft_tabel'; known here are", "shaft_tabel"),
    ("[rotor]", '[rotor]\nshaft_tabel = "x"', "'shaft_tabel'; did you mean 'shaft_table'", "shaft_t"),
    (GAP, "", "'air_gap' is missing; add it, for example air_gap = \"280 um\"", "touchdown_bearings]]"),
    (NAME, "", "'name' is missing; add it", None),
    # whole numbers
    ("elements = 2", f"elements = {'9' * 400}", "9{9}... has 400 digits; TOML holds whole numbers", "9999"),
    # units and dimensions
    (GAP, "air_gap = 250", "250 has no unit; a length needs one, for example '280 um'", "250"),
    (GAP, 'air_gap = "250"', "'250' has no unit", '"250"'),
    (GAP, 'air_gap = "250 g"', "'250 g' is not a length", '"250 g"'),
    ('"5 kg"', "5", "5 has no unit; a mass needs one", "5"),
    # nodes and positions
    ("node = 2", "node = 10", "node 10 is outside the rotor, whose nodes are 1 to 9", "10"),
    ("node = 2", "node = 0", "node 0 is outside the rotor; nodes count from 1", "0"),
    ("node = 2", "node = -1", "node -1 is outside the rotor", "-1"),
    ("node = 2", 'node = "2"', "'2' is not a node; write its number", '"2"'),
    ("node = 5", "node = 50", "node 50 is outside the rotor, whose nodes are 1 to 9", "50"),
    ('"0.7 m"', '"0.9 m"', r"900 mm is outside the rotor, which reaches from 0 m to 800 mm", '"0.9 m"'),
    ('"0.7 m"', '"0.72 m"', "there is no node at 720 mm; the nearest is node 8 at 700 mm", '"0.72 m"'),
    ('position = "0.7 m"', "", "needs either 'node' .* or 'position'", "touchdown_bearings]]"),
    # diameters, layers, materials
    ('"60 mm"', '"0 mm"', "0 m is not allowed here; a length must be positive", '"0 mm"'),
    ('"60 mm"', '"-60 mm"', r"-60\.0 mm is not allowed here; a length must be positive", '"-60 mm"'),
    ('"20 mm"', '"90 mm"', r"inner diameter 90\.0 mm must be smaller than .*, 80\.0 mm", '"90 mm"'),
    ('"20 mm"', '"-1 mm"', r"-1\.00 mm is not allowed here; it must not be negative", '"-1 mm"'),
    ("elements = 4", 'elements = 4\nlayer_diameter = "90 mm"', "a layer needs both", "rotor.sections]]"),
    (
        "elements = 4",
        'elements = 4\nlayer_diameter = "70 mm"\nlayer_density = "7650 kg/m^3"',
        r"layer reaches to 70\.0 mm and must reach beyond the outer diameter 80\.0 mm",
        '"70 mm"',
    ),
    ("[rotor]", '[rotor]\nmaterial = "titan"', r"material 'titan'; .*\[rotor\.materials\.titan\]", "mat"),
    ("elements = 2", "elements = 0", "0 does not fit; expected greater than or equal to 1", "0"),
    ("elements = 2", "elements = 2.5", r"2\.5 does not fit; expected a valid integer", "2.5"),
    ("elements = 2", "nodes = [1, 3]", "a section has either 'length' or 'nodes', not both", "length"),
    ('length = "0.4 m"\nelements = 4', "nodes = [3, 7]", "some .* 'length' and others 'nodes'", "rotor"),
    ("0.02 kg", "0.2 kg", r"polar_inertia 0\.2 kg m² is more than twice diametral_inertia", '"0.2 kg'),
    # touchdown bearings
    ('"30.25 mm"', '"60.5 mm"', r"bore radius 60\.5 mm is larger than that of XCB71914E.*, 35 mm", '"60.5'),
    (GAP, 'air_gap = "31 mm"', "the air gap 31 mm must be smaller than the bore radius", '"31 mm"'),
    ("XCB71914-E", "XCB71915-X", "no bearing 'XCB71915-X'; did you mean", '"XCB71915-X"'),
    ("XCB71914-E", "30206", "no bearing '30206'", '"30206"'),
    ('"heavy"', '"hevy"', "'hevy' is no preload class; did you mean 'heavy'", '"hevy"'),
    (HEAVY, "ball_count = 40", r"40 balls of 9\.525 mm do not fit on .* 85 mm; at most 28", "40"),
    (HEAVY, "ball_count = 2", "2 does not fit; expected greater than or equal to 3", "2"),
    (HEAVY, 'arrangement = "Y"', "'Y' does not fit; expected 'X', 'O', 'tandem' or 'single'", '"Y"'),
    (HEAVY, "conformity = 0.5", r"0\.500 is not allowed here; the number must be greater", "0.5"),
    ('designation = "XCB71914-E"', 'preload = "1 N"', "no 'ball_diameter', 'ball_count', 'pitch_diam", None),
    ('name = "DE"', 'name = "NDE"', "the name 'NDE' is used twice", '"NDE"'),
    ('name = "DE"', 'name = "D E"', "'D E' is not a name; write one word without dots", '"D E"'),
    ('name = "DE"', 'name = "speed"', "a touchdown bearing cannot be called 'speed'", '"speed"'),
    ('position = "0.7 m"', "node = 2", "DE sits at node 2, where NDE sits already; give it another", "2"),
    # clearances beside the touchdown bearings
    ("[[sensors]]", SEAL.format(3, 0), r"0 m is not allowed here; a length must be positive", '"0 mm"'),
    (
        "[[sensors]]",
        SEAL.format(3, 0.2),
        r"'seal' .* at node 3 is used up before .* there; widen",
        '"0.2 mm"',
    ),
    ("[[sensors]]", SEAL.format(99, 2), "node 99 is outside the rotor", "99"),
    # clearance
    (HEAVY, 'clearance = "C7"', "'C7' is neither a length nor a clearance class", '"C7"'),
    (HEAVY, f'clearance = "C3", {HEAVY}', "has a preload .* or a clearance .* not both", None),
    (HEAVY, 'clearance = "190 um"', "is more than the .* that these grooves leave at 25°", '"190 um"'),
    (HEAVY, 'clearance = "9 um", rows = 1', "say the same of rows that face one way", '"9 um"'),
    (HEAVY, "rows = 3", "rows = 3 is neither 1 nor 2", "3"),
    (HEAVY, 'rows = 1, arrangement = "O"', "rows = 1 does not go with arrangement = 'O'", "1"),
    (
        'designation = "XCB71914-E", preload = "heavy"',
        'ball_diameter = "8 mm", ball_count = 12, pitch_diameter = "85 mm", clearance = "C3"',
        "depends on the bore of the bearing; add for example bore_diameter",
        '"C3"',
    ),
    # magnitudes no arithmetic survives
    ('"60 mm"', '"1e-300 mm"', "'1e-300 mm' is no length that a machine has; write for ex", '"1e-300 mm"'),
    ('"60 mm"', '"6e-5 mm"', "0.0600 µm is no diameter of a rotor, which has 100 µm to 100 m", '"6e-5 mm"'),
    ('"60 mm"', '"6e8 mm"', "is no diameter of a rotor, which has 100 µm to 100 m; ch", '"6e8 mm"'),
    ('"60 mm"', '"1e300 mm"', "'1e300 mm' is no length that a machine has; write for ex", '"1e300 mm"'),
    ('"5 kg"', '"1e300 kg"', "'1e300 kg' is no mass that a machine has", '"1e300 kg"'),
    (HEAVY, 'first_ball_angle = "1e20 deg"', "is not allowed here; at most", '"1e20 deg"'),
    # sensors
    ('"135 deg"', '"45 deg"', "resolve only 3 of the 4 rigid motions: in the plane at 100 mm", '"45 deg"'),
    ('"135 deg"', '"225 deg"', "resolve only 3 of the 4 rigid motions", '"225 deg"'),
    ('angle = "135 deg"', 'angle = "135 deg"\npolarity = 0', "0 does not fit; expected 1 or -1", "0"),
    ('name = "B"', 'name = "A"', "the name 'A' is used twice", '"A"'),
    ('name = "B"', 'name = "B"\nbearing = "XE"', "belongs to touchdown bearing 'XE', .* DE, NDE", '"XE"'),
    # what may be known of a value, and nesting
    (GAP, 'air_gap = {guess = "0.2 mm", range = ["0.2 mm", "0.2 mm"]}', "has no width", "guess"),
    (GAP, 'air_gap = {guess = "0.2 mm", range = ["-1 mm", "1 mm"]}', "range reaches to -1", "guess"),
    (
        GAP,
        'air_gap = {value = "0.2 mm", interval = ["0.3 mm", "0.4 mm"]}',
        "outside its own interval, 300 µm to 400 µm",
        "interval",
    ),
    (GAP, 'air_gap = {value = "0.2 mm", standard_error = "-1 um"}', "must be zero or positi", "value"),
    (
        GAP,
        'air_gap = {value = "0.2 mm", lower = "0.3 mm", upper = "0.1 mm"}',
        "300 µm lies above upper = 100 µm",
        "lower",
    ),
    (GAP, 'air_gap = "1e-300 mm"', "'1e-300 mm' is no length that a machine has", '"1e-300 mm"'),
    (GAP, 'air_gap = "0.2 m**9**9**9**9"', "is not a unit known here", '"0.2 m'),
    (GAP, "air_gap = " + 5000 * "9", "this cannot be a value of a machine", "9999"),
]


def test_a_machine_without_touchdown_bearings_is_refused(small_text):
    head, _, rest = small_text.partition("[[touchdown_bearings]]")
    sensors = rest[rest.index("[[sensors]]") :]
    with pytest.raises(MachineFileError, match="a list does not fit; at least one entry is needed"):
        loads_machine("touchdown_bearings = []\n" + head + sensors)


@pytest.mark.parametrize(("old", "new", "told", "at"), BAD, ids=[new[:40] for _, new, _, _ in BAD])
def test_refusals_say_where_what_and_the_way_out(tmp_path, changed, old, new, told, at):
    text = changed((old, new))
    file = tmp_path / "machine.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(MachineFileError, match=told) as caught:
        load_machine(file)
    error = caught.value
    assert error.file == str(file)
    assert str(error).startswith(f"{file}:{error.line}:{error.column}: ")
    if at is not None:
        assert at in text.split("\n")[error.line - 1], error.column


COLUMNS = [
    (GAP, '  air_gap   =   "250 g"   # a remark', r"air_gap: '250 g' is not a length", '"250 g"'),
    (FIRST, 'bearing = { "designation" = "µµµ", ball_cout = 3 }', "did you mean 'ball_count'", "ball_cout"),
]


@pytest.mark.parametrize(("old", "new", "told", "at"), COLUMNS)
def test_a_column_points_at_the_value_itself_in_characters(changed, old, new, told, at):
    text = changed((old, new))
    with pytest.raises(MachineFileError, match=told) as caught:
        loads_machine(text)
    line = text.split("\n")[caught.value.line - 1]
    assert line[caught.value.column - 1 :].startswith(at)
    assert "at least one entry is needed" not in str(caught.value)


def test_all_that_is_wrong_is_told_at_once(changed, small_text):
    text = changed((GAP, 'air_gap = "250 g"'), ("300 Hz", "300 s"), ("elements = 4", "elements = 0"))
    with pytest.raises(MachineFileError) as caught:
        loads_machine(text)
    told = str(caught.value).split("\n")
    assert len(told) == 3
    assert [re.match(r"\d+:\d+: ", line) is not None for line in told] == [True] * 3
    assert "'300 s' is not a speed" in told[0]
    # Three planes turned against each other, four sensors in all, determine four rigid motions.
    text = small_text.replace("node = 8", "node = 2")
    with pytest.raises(MachineFileError, match=r"4 sensors sit in 1 plane \(100 mm\) and cannot tell a tilt"):
        loads_machine(text)
    text = changed(('name = "B"\nnode = 2', 'name = "B"\nnode = 5'))
    assert len(loads_machine(text).sensors) == 4
    assert loads_machine(small_text[: small_text.index("[[sensors]]")]).sensors == ()


def test_files_are_there_in_utf_8_with_a_mark_or_without(tmp_path, small_text):
    with pytest.raises(MachineFileError, match="cannot read the machine file: No such file"):
        load_machine(tmp_path / "nowhere.toml")
    file = tmp_path / "machine.toml"
    file.write_bytes(small_text.replace("small", "größe").encode("latin-1"))
    with pytest.raises(MachineFileError, match=r"toml:2:11: the byte 0xf6 is not UTF-8 text; save the mach"):
        load_machine(file)
    with pytest.raises(MachineFileError, match=r"more than 16777216 bytes are no machine file"):
        load_machine("/dev/zero")
    file.write_bytes(b"\xef\xbb\xbf" + small_text.encode())
    assert load_machine(file) == loads_machine(small_text)


@pytest.mark.parametrize("table", ["a\\u0000b", "/dev/zero", "pipe"])
def test_a_shaft_table_that_is_no_file_is_refused_with_the_line(tmp_path, small_text, table):
    if table == "pipe":
        os.mkfifo(tmp_path / "pipe")
    text = small_text.replace("[rotor]", f'[rotor]\nshaft_table = "{table}"', 1)
    head, tail = text.index("[[rotor.sections]]"), text.index("[[rotor.discs]]")
    file = tmp_path / "machine.toml"
    file.write_text(text[:head] + text[tail:], encoding="utf-8")
    with pytest.raises(MachineFileError, match=r"shaft table") as caught:
        load_machine(file)
    assert "shaft_table" in file.read_text().splitlines()[caught.value.line - 1]


NESTED = {
    "lists": "a = " + 5000 * "[",
    "lists, one in a line": "a = " + 5000 * "[\n",
    "tables": "a = " + 3000 * "{a=",
    "parts of a key": 20_000 * "a." + "a = 1",
    "quoted parts of a key": 20_000 * '"a".' + "a = 1",
    "parts of a key in a table": "b = { " + 20_000 * "'a' . " + "a = 1 }",
}


@pytest.mark.parametrize("content", NESTED.values(), ids=NESTED)
@pytest.mark.parametrize(
    "read", [load_machine, load_profile, read_ross, lambda file: read_toml(file, "study")]
)
def test_a_file_of_any_kind_that_is_nested_without_end_is_refused_at_once(tmp_path, read, content):
    """Brackets ended in a traceback of profiles and files of ROSS, a key of 40 kB needed 1.6 GB."""
    file = tmp_path / "file.toml"
    file.write_text(content)
    with pytest.raises(RotordropError, match="inside one another"):
        read(file)
