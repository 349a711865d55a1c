"""A machine of twelve numbers; shaft sections from tables, as other programs call their columns."""

import io
import math
import re

import pytest
from tests.scaled_machines import TWELVE_NUMBERS

from rotordrop.cli.app import run
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.machine import load_machine, loads_machine
from rotordrop.machine.ross_files import read_rotor
from rotordrop.machine.saving import machine_text
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.rotor.assembly import free_free_modes, rotor_fe
from rotordrop.rotor.machine_summary import summarise_machine
from rotordrop_bench.rotors import ROTORS, bench_rotor


def test_mass_and_centre_of_mass_are_those_given_and_planes_are_nodes():
    machine = simple_machine(SimpleMachine(**TWELVE_NUMBERS))
    assert machine.rotor.mass == pytest.approx(60.0)
    assert machine.rotor.centre_of_gravity == pytest.approx(0.52)
    nodes = machine.rotor.node_positions
    assert [nodes[b.node - 1] for b in machine.touchdown_bearings] == pytest.approx([0.11, 0.98])
    assert [nodes[s.node - 1] for s in machine.sensors] == pytest.approx([0.18, 0.18, 0.9, 0.9])
    assert [math.degrees(s.angle.value) for s in machine.sensors[:2]] == pytest.approx([135.0, 45.0])
    assert machine.touchdown_bearings[0].air_gap.range == pytest.approx((0.25e-3 / 1.2, 0.3e-3), rel=1e-5)
    loads = [bearing.load for bearing in summarise_machine(machine).bearings]
    weight = 60.0 * 9.81
    assert loads == pytest.approx([weight * 0.46 / 0.87, weight * 0.41 / 0.87], rel=1e-6)


def test_a_simple_rotor_bends_as_the_beam_and_reads_back():
    """Uniform free-free beam, first bending (4.730)² √(EI/ρA)/(2π L²), less what shear takes."""
    guessed = simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"centre": "550 mm"})))
    machine = guessed.with_values({"rotor.stiffness_factor": 1.0, "rotor.mass_to_ends": 0.0})
    assert guessed.rotor.stiffness_factor.range == (0.16, 1.0)
    d = machine.rotor.elements[0].outer_diameter
    area = math.pi / 4 * d * d
    slender = 4.730041**2 / (2 * math.pi * 1.1**2) * math.sqrt(206e9 * math.pi / 64 * d**4 / (7850.0 * area))
    found = summarise_machine(machine).free_free[0]
    assert 0.96 * slender < found < slender
    machine = simple_machine(SimpleMachine(**TWELVE_NUMBERS))
    assert simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"mass": 60}))) == machine
    assert loads_machine(machine_text(machine)) == machine


@pytest.mark.parametrize("rotor", ROTORS)
def test_the_ranges_of_the_beam_hold_the_rotors_at_hand(rotor):
    """Bending and inertia of every rotor of the bench over those of the cylinder of its mass and length."""
    described = bench_rotor(rotor).rotor
    length = described.node_positions[-1]
    places = {"bearings": (0.1 * length, 0.9 * length), "sensors": (0.2 * length, 0.8 * length)}
    numbers = {"mass": described.mass, "length": length, "centre": described.centre_of_gravity} | places
    beam = simple_machine(SimpleMachine(**(TWELVE_NUMBERS | numbers)))
    cylinder = beam.with_values({"rotor.stiffness_factor": 1.0, "rotor.mass_to_ends": 0.0})
    true, plain = rotor_fe(described), rotor_fe(cylinder.rotor)
    softer = (free_free_modes(true, 3).frequency[2] / free_free_modes(plain, 3).frequency[2]) ** 2
    assert 0.16 <= softer <= 1.0
    assert 0.8 <= true.diametral_inertia / plain.diametral_inertia <= 1.5


def test_a_support_goes_with_the_size_of_the_rotor_and_is_known_better_for_each_end():
    small, large = (
        simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"mass": mass})))
        .touchdown_bearings[0]
        .support.stiffness
        for mass in ("7.5 kg", "60 kg")
    )
    assert float(large) == pytest.approx(2.0 * float(small), rel=1e-5)
    assert large.range == pytest.approx((2e8 / 7.0, 1.4e9), rel=1e-5)

    def ranges(support):
        machine = simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"support": support})))
        return [bearing.support.stiffness.range for bearing in machine.touchdown_bearings]

    assert ranges("1e8 N/m") == [pytest.approx((2e7, 5e8))] * 2
    assert ranges("8e7 N/m, 5e8 N/m") == [pytest.approx((4e7, 1.6e8)), pytest.approx((2.5e8, 1e9))]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"support": "1e8 N/m, 1e8 N/m, 1e8 N/m"}, r"has 3 values; give one, or one for each of 2 ends"),
        ({"bearings": ("980 mm", "110 mm")}, r"bearings: 980 mm and 110 mm are no two planes .* 1\.10 m"),
        ({"sensors": ("100 mm", "1.2 m")}, r"sensors: 100 mm and 1\.20 m are no two planes"),
        ({"centre": "900 mm"}, r"centre of mass at 900 mm is too far from the middle of a rotor of 1\.10 m"),
        ({"mass": "60"}, "'60' has no unit"),
        ({"support": "firm"}, "'firm' does not begin with a number"),
        ({"designation": "hello"}, "no bearing 'hello'"),
    ],
)
def test_numbers_that_do_not_fit_are_named(change, message):
    with pytest.raises(UsageError, match=message):
        simple_machine(SimpleMachine(**(TWELVE_NUMBERS | change)))


class Terminal(io.StringIO):
    """What somebody types at a terminal."""

    def isatty(self):
        return True


def test_what_no_option_gives_is_asked_for_until_it_can_be_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    typed = "1.1 m\n35 mm, 965 mm\n900 mm\n520 mm\n110 mm\n110 mm, 980 mm\n180 mm, 900 mm\n0 deg, 90 deg\n"
    typed += "135 deg\nhello\n7014 ACD/HCP4A\n0.2\n0.25 mm\n9000 rpm\nfine\nG 2.5\nfirm\nsoft\n"
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    assert run(["init", "--simple", "--set", "mass=60 kg"]) == 0
    asked = capsys.readouterr().err
    wrong = re.findall(r"Error: (\w+), such as .*?: (.*)", asked)
    assert [
        name for name, _ in wrong
    ] == "centre centre bearings sensor_angle designation gap grade support".split()
    assert "'0.2' has no unit" in wrong[5][1]
    made = load_machine("machine.toml")
    assert made.rotor.centre_of_gravity == pytest.approx(0.52)
    assert made.rotor.mass == pytest.approx(60.0, rel=1e-3)
    stiffness = made.touchdown_bearings[0].support.stiffness
    assert stiffness.range == pytest.approx((1e7 / 7.0, 7e7), rel=1e-5)


DYROBES = "Ele,L,OD,ID,Mass OD,Material\n,mm,mm,mm,mm,\n1,100,60,0,60,\n2,300,80,20,100,\n3,100,60,0,60,\n"


def test_shaft_tables_as_programs_print_them_and_as_spreadsheets(tmp_path):
    path = tmp_path / "shaft.csv"
    path.write_text(DYROBES, encoding="utf-8")
    rotor = read_rotor(path).rotor
    middle = rotor.elements[1]
    assert rotor.node_positions == pytest.approx((0.0, 0.1, 0.4, 0.5))
    assert (middle.outer_diameter, middle.inner_diameter, middle.layer_diameter) == pytest.approx(
        (0.08, 0.02, 0.1)
    )
    assert middle.layer_density == 7850.0
    assert rotor.elements[0].layer_diameter is None
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for line in DYROBES.splitlines():
        book.active.append([float(cell) if cell.isdigit() else cell or None for cell in line.split(",")])
    book.save(tmp_path / "shaft.xlsx")
    (tmp_path / "shaft.csv").write_text(DYROBES, encoding="utf-8")
    assert read_rotor(tmp_path / "shaft.xlsx").rotor == read_rotor(tmp_path / "shaft.csv").rotor


BY_POSITION = """part;position [mm];outer diameter [mm];layer diameter [mm];layer density [kg/m^3]
# a remark
end;0;60;;
end;100;60;;
stack;200;80;100;7650
end;700;60;;
;800;;;
"""

BY_LENGTH = """Length [m],Elements,Outer diameter [mm],Inner diameter (mm),Part
0.2,2,60,,end
0.4,4,80,20,"core, hollow"
0.2,2,60,,end
"""


@pytest.fixture
def load(tmp_path, small_text):
    def loaded(table, extra=""):
        (tmp_path / "shaft.csv").write_text(table, encoding="utf-8")
        head, tail = small_text.index("[[rotor.sections]]"), small_text.index("[[touchdown_bearings]]")
        text = small_text[:head] + 'shaft_table = "shaft.csv"\n' + extra + small_text[tail:]
        return loads_machine(
            text.replace("node = 8", "node = 5").replace('position = "0.7 m"', "node = 5"), tmp_path
        )

    return loaded


def test_a_table_has_positions_or_lengths(load):
    rotor = load(BY_POSITION).rotor
    assert rotor.node_positions == pytest.approx((0.0, 0.1, 0.2, 0.7, 0.8))
    assert [e.part for e in rotor.elements] == ["end", "end", "stack", "end"]
    assert rotor.elements[2].layer_diameter == pytest.approx(0.1)
    assert rotor.elements[2].layer_density == 7650.0
    assert rotor.elements[0].layer_diameter is None
    rotor = load(BY_LENGTH).rotor
    assert len(rotor.elements) == 8
    assert rotor.node_positions == pytest.approx([0.1 * k for k in range(9)])
    assert rotor.elements[3].inner_diameter == pytest.approx(0.02)
    assert rotor.elements[3].part == "core, hollow"


@pytest.mark.parametrize("separator", [";", ",", "\t"])
def test_any_usual_separator_will_do_and_commas_in_numbers_where_they_separate_nothing(load, separator):
    assert load(BY_POSITION.replace(";", separator)).rotor == load(BY_POSITION).rotor
    if separator != ",":
        table = BY_POSITION.replace("100;60", "100,5;60,25")
        assert load(table.replace(";", separator)).rotor == load(table.replace(",", ".")).rotor


@pytest.mark.parametrize(
    ("old", "new", "told", "line"),
    [
        ("outer diameter", "outer diametr", "'outer_diametr'; did you mean 'outer_diameter'", 1),
        ("position [mm]", "position", "'position' has no unit; write for example 'position \\[mm\\]'", 1),
        ("position [mm]", "inner diameter [mm]", "needs a column 'position \\[mm\\]' or 'length", 1),
        ("100;60", "100;60,500", "outer diameter: '60,500 mm' has a decimal comma; use 60.500", 4),
        ("100;60", "100;sixty", "outer diameter: 'sixty mm' does not begin with a number", 4),
        ("100;60", "100;", "the row has no outer diameter", 4),
        ("100;60", "100;0", "outer_diameter: 0 m is not allowed here; a length must be positive", 4),
        ("100;60", ";60", "the row has no position", 4),
        ("60;;\n;800;;;", "60;;\n;800;60;;", "the last row must hold the end of the shaft only", 7),
        ("end;100;60;;", "end;100;60;;;;", "the row has 7 columns, the heading 5", 4),
        ("700;60;;", "700;60;90;", "a layer needs both 'layer_diameter' and 'layer_density'", 6),
    ],
)
def test_a_refusal_names_the_line_of_the_table(load, old, new, told, line):
    assert old in BY_POSITION
    with pytest.raises(MachineFileError, match=told) as caught:
        load(BY_POSITION.replace(old, new, 1))
    assert caught.value.file.endswith("shaft.csv")
    assert caught.value.line == line


def test_a_table_must_be_there_once_in_order_and_hold_sections(load, tmp_path, small_text):
    with pytest.raises(MachineFileError, match="node 3 at 50 mm does not lie beyond node 2 at 100 mm"):
        load(BY_POSITION.replace("stack;200", "stack;50"))
    text = small_text.replace("[rotor]", '[rotor]\nshaft_table = "nowhere.csv"', 1)
    head, tail = text.index("[[rotor.sections]]"), text.index("[[rotor.discs]]")
    with pytest.raises(MachineFileError, match=r"'nowhere\.csv': cannot read the shaft table: No such file"):
        loads_machine(text[:head] + text[tail:], tmp_path)
    with pytest.raises(
        MachineFileError, match="given by 'shaft_table' and by 'sections'; keep one"
    ) as caught:
        loads_machine(small_text.replace("[rotor]", '[rotor]\nshaft_table = "shaft.csv"', 1))
    assert (caught.value.line, caught.value.column) == (8, 15)
    with pytest.raises(MachineFileError, match="the shaft table holds no sections"):
        load("part;position [mm]\n")
