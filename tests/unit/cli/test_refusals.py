"""Wrong calls of every verb: a sentence that names the way out, an exit code of its kind, nothing written."""

import io
import json
import re
import shlex

import pytest
from tests.published import bearing, published, value

from rotordrop import example_record_path
from rotordrop.cli.app import run
from rotordrop.machine import example_path

LP400, PAPER = example_path("lp400"), example_path("paper")
STUDY = f'machine = "{LP400}"\ndrops = 2\nduration = "2 ms"\nspeed = "60 Hz"\n'
PEAKS = {"peak_force_N": value(3300.0), "peak_stress_Pa": value(1.5e9)}
FILES = {
    "notes.txt": b"mine",
    "rotor.pdf": b"x",
    "lp400/drop_060.h5": b"mine",
    "drop.csv": "Zeit;µm\n".encode("latin-1"),
    "tail.csv": "Zeit;µm\n".encode("latin-1"),
    "study.toml": STUDY.encode(),
    "bad.toml": PAPER.read_bytes().replace(b'name = "', b'nmae = "', 1),
    "estimate.json": json.dumps(published(bearings={"DE": bearing(PEAKS)}).as_json()).encode(),
}
SIMPLE = r"--simple needs centre, bearings, sensors, sensor_angle, designation.*the input is no terminal"
DRAG = "coast-down {lp400} --speed 60Hz"

REFUSED = [
    ("--no-such-option", 64, r"^rotordrop: No such option: --no-such-option See 'rotordrop --help'\.$"),
    ("frobnicate", 64, "^rotordrop: there is no command 'frobnicate'; try 'rotordrop --help'$"),
    ("look a.h5 b.toml --split x --json y", 64, "--split does not go with --json"),
    ("look a.h5 --split x", 64, "--split needs the machine file too"),
    ("look drop.csv tail.csv", 64, "are two records"),
    ("look r.h5 m.toml --split notes.txt", 64, "notes.txt' is a file"),
    ("estimate {lp400} {record} --quick", 64, "--quick needs a calibrated machine"),
    ("compare a.json b --changes --report x", 64, "--changes does not go with --report"),
    ("compare a.json --changes", 64, "--changes compares two estimates, and 1 are given"),
    ("restart {lp400} drop.csv", 64, r"is not JSON \(it is no UTF-8 text\)"),
    ("check bad.toml --json m.json --report m.html", 2, r"bad\.toml:.*nmae"),
    ("convert a.toml --to ross --gap 1mm", 64, "--to ross does not go with --gap"),
    ("convert rotor.pdf", 2, "'.pdf' is no format of a rotor"),
    ("init m.toml --set 'mass=60 kg'", 64, "numbers of a machine belong to --simple"),
    ("init --simple --set 'mass=60 kg' --set 'length=1.1 m'", 64, SIMPLE),
    (
        "init --simple --set 'sensor_angle=0 deg, 90 deg'",
        64,
        "sensor_angle, such as '135 deg': '0 deg, 90 deg' are several values",
    ),
    ("init --example lp500", 64, "example machine is 'lp500'; expected one of paper, lp400"),
    ("init --example lp400", 6, r"drop_060\.h5 exists already; name another folder or add --force"),
    ("waterfall {lp400} nowhere.h5", 3, r"nowhere\.h5"),
    ("waterfall {lp400} {lp400}", 3, r"lp400\.toml"),
    ("critical-speeds {lp400} --held strings", 64, "strings"),
    (f"{DRAG} --until -1s", 5, "-1"),
    (f"{DRAG} --until 0.1s", 5, "no aerodynamic drag"),
    (f"{DRAG} --until 'for ever'", 64, "for ever"),
    (f"{DRAG} --until 0.2s --resume", 64, "--resume needs the --output"),
    (f"{DRAG} --drag-from no.h5", 3, "no.h5"),
    ("log show l.db", 64, "is not there; 'rotordrop log add' makes a log"),
    ("log add l.db", 64, "nothing to add"),
    ("log add l.db l.db", 64, r"cannot be read \(No such file or directory\)\. Give a file"),
    ("log add l.db estimate.json --recorded 14.3.2026", 64, r"'14\.3\.2026' is not a date"),
    ("log remove l.db first", 64, "'first' is not the number of a drop"),
    ("log allow l.db --drops 3 --source x", 64, "name it with --machine"),
    ("study show .", 64, "is not a study folder"),
    ("study run . --folder x", 64, "leave out --folder"),
    ("study repeat {lp400} --folder x", 64, "neither an estimate nor a speed"),
    *(
        (f"simulate {{paper}} --speed 60Hz --duration 12ms --reduction quick --json d.json {more}", *said)
        for more, *said in [
            ("--speed 60", 64, "'60' has no unit; a speed needs one, for example '60 Hz'"),
            ("--duration '-1 s'", 5, r"duration is -1\.0; expected a positive, finite number"),
            ("--reduction fast", 64, "'fast' is not one of"),
            ("--levitated --stays-on A", 64, "no AMB 'A' that could stay on"),
            ("--levitated --stays-on NDE --magnets '60 ms: levitate'", 64, "--stays-on"),
        ]
    ),
]


@pytest.mark.parametrize(("call", "code", "words"), REFUSED, ids=[words[:40] for *_, words in REFUSED])
def test_a_wrong_call_names_the_way_out_and_writes_nothing(call, code, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    (tmp_path / "lp400").mkdir()
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    record = example_record_path("lp400_drop_060")
    assert run(shlex.split(call.format(lp400=LP400, paper=PAPER, record=record))) == code
    told = capsys.readouterr()
    said = " ".join(told.err.split())
    assert told.out == "" and re.search(words, said) and "Traceback" not in said, said
    left = {str(f.relative_to(tmp_path)): f.read_bytes() for f in tmp_path.rglob("*") if f.is_file()}
    assert left == FILES


def test_who_answers_no_question_reads_what_is_missing(tmp_path, monkeypatch, capsys):
    rows = [f"{i * 5e-5:.5f};0.001;0.001;0.001;0.001" for i in range(50)]
    record = tmp_path / "drop.csv"
    record.write_text("\n".join(["Time [s];VE-1X [mm];VE-1Y [mm];VE-2X [mm];VE-2Y [mm]", *rows]) + "\n")
    ended = io.StringIO("")
    ended.isatty = lambda: True
    monkeypatch.setattr("sys.stdin", ended)
    assert run(["look", str(record), str(LP400)]) == 3
    told = capsys.readouterr().err
    assert "has no channel" in told and told.rstrip().endswith("Use the likeliest? [Y/n]:")
