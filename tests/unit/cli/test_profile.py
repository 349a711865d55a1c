"""A profile is made from one file of the recorder; everything missing is asked for at once."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from rotordrop import example_record_path, read_record
from rotordrop.cli.app import run
from rotordrop.errors import RecordError, UsageError
from rotordrop.machine import example_machine, example_path
from rotordrop.machine.simple import EXAMPLES
from rotordrop.record.profile import load_profile, profile_of

LP400 = str(example_path("lp400"))
RECORD = str(example_record_path("lp400_drop_060"))
SENSORS = ("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")


@pytest.fixture
def strange(tmp_path):
    """A recording whose channels have other names, no unit and no speed."""
    time = np.arange(50) * 5e-5
    rows = [f"{t:.5f};" + ";".join(f"{k + 100 * t:.3f}" for k in range(4)) for t in time]
    (tmp_path / "drop.csv").write_text("\n".join(["Time [s];X1;Y1;X2;Y2", *rows]) + "\n")
    return tmp_path / "drop.csv"


def test_everything_missing_is_asked_for_at_once(strange, tmp_path, capsys):
    profile = tmp_path / "recorder.toml"
    call = ["profile", str(strange), "--machine", LP400, "-o", str(profile)]
    assert run(call) == 3
    told = capsys.readouterr()
    asked = (
        'channels of S_NDE_A, S_NDE_B, S_DE_A, S_DE_B: likeliest --map "NDE: X1 45 deg, Y1 135 deg" '
        '--map "DE: X2 45 deg, Y2 135 deg"'
    )
    assert asked in told.err
    assert "channel X1: 50 samples at 20000 Hz, 0 to 0.245 (no unit)" in told.out
    assert not profile.exists()
    labels = zip(SENSORS, ("X1", "Y1", "X2", "Y2"), strict=True)
    call += [*(f"--map={name}={label}" for name, label in labels), "--speed", "60 Hz"]
    assert run(call) == 3
    assert "the unit of X1, Y1, X2, Y2: --unit um" in capsys.readouterr().err
    assert run([*call, "--unit", "um"]) == 0
    record = read_record(strange, example_machine("lp400"), profile=profile)
    np.testing.assert_allclose(record.signals[0], np.arange(4) * 1e-6, atol=1e-15)
    assert load_profile(profile).speed.constant == "60 Hz"


def test_the_likeliest_channels_are_taken_where_that_is_said(strange):
    rules = profile_of({"unit": "um", "speed": {"constant": "60 Hz"}}, "rules")
    record = read_record(strange, example_machine("lp400"), profile=rules, mapping=["likely"])
    np.testing.assert_allclose(record.signals[0], [1e-6, 0.0, 3e-6, 2e-6], atol=1e-15)  # Y1, X1, Y2, X2


def test_a_profile_for_looks_needs_no_speed(strange, tmp_path):
    profile = tmp_path / "recorder.toml"
    assert run(["profile", str(strange), "--unit", "um", "-o", str(profile)]) == 0
    assert load_profile(profile).planes == {"1": "X1, Y1", "2": "X2, Y2"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("chanels = 3", r"chanels = 3 is not known in a profile; did you mean 'channels'\?"),
        ('[speed]\nchanel = "n"', r"\[speed\] chanel = 'n' is not known in .*; did you mean 'channel'"),
        ('[time]\nstep = "5"', r"\[time\] step = '5' does not fit: '5' has no unit; a time needs one"),
        ('[text]\nseparator = ";;"', r"\[text\] separator = ';;' does not fit: expected one sign"),
        ('channels = "X1"', r"channels = 'X1' does not fit: expected a table, \[channels\] S_NDE_A"),
        ("[speed]\nconstant = '60 m'", r"\[speed\] constant = '60 m'.*is not a speed"),
        ("[text]\ndecimal = ';'", r"\[text\] decimal = ';'"),
        ("a =", "is not a TOML file"),
        ("a = 1\nb = 2", r"a = 1 is not known.*\n  also: b = 2 is not known"),
    ],
)
def test_errors_of_a_profile_are_words(text, told, tmp_path):
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(RecordError, match=told):
        load_profile(tmp_path / "p.toml")


def test_a_wrong_entry_is_named_as_it_was_given(capsys):
    assert run(["profile", RECORD, "-o", "p.toml", "--sensitivity", "8", "--speed", "60"]) == 3
    said = capsys.readouterr().err
    assert "--sensitivity '8' does" in said and "--speed '60' does" in said and "[" not in said


def test_the_examples_of_the_documentation_are_profiles():
    page = (Path(__file__).parents[3] / "docs" / "recorders.md").read_text(encoding="utf-8")
    examples = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    for example in examples:
        profile_of(tomllib.loads(example), "example")


@pytest.mark.parametrize(
    "command",
    [
        "look {record} {machine}",
        "estimate {machine} {record}",
        "calibrate {machine} {record} -o made.toml",
        "waterfall {machine} {record}",
        "clearance {record} --machine {machine}",
        "look {record} {machine} --split parts",
        "profile {record} --machine {machine} -o made.toml",
    ],
)
def test_every_command_that_reads_a_record_takes_a_map(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    call = command.format(record=RECORD, machine=LP400).split()
    assert run([*call, "--map", "middle: S_NDE_A, S_NDE_B"]) == UsageError.exit_code
    assert "'middle' names 2 channels; the machine has the planes NDE, DE" in capsys.readouterr().err
    if command.startswith("profile"):  # without a machine the map makes the planes
        assert run(["profile", RECORD, "--map", "middle: S_NDE_A, S_NDE_B", "-o", "made.toml"]) == 0
        assert load_profile("made.toml").planes == {"middle": "S_NDE_A, S_NDE_B"}
        Path("made.toml").unlink()
    assert list(tmp_path.iterdir()) == []


def test_twelve_numbers_fit_the_recorder_and_the_next_command_is_printed(tmp_path, monkeypatch, capsys):
    """The sensors of twelve numbers are called NDE_A, those of the recorder S_NDE_A."""
    monkeypatch.chdir(tmp_path)
    given = [f"--set={name}={value}" for name, value in EXAMPLES.items() if name != "preload"]
    assert run(["init", "--simple", *given, "twelve.toml"]) == 0
    said = capsys.readouterr().err
    (following,) = re.findall(r"next: rotordrop (.*?)\. ", said)
    assert following == "look twelve.toml RECORD"
    assert run(following.replace("RECORD", RECORD).split()) == 0
    assert run(["profile", RECORD, "--machine", "twelve.toml", "-o", "recorder.toml"]) == 0
    profile = load_profile("recorder.toml")
    assert {label.split("/")[-1] for label in profile.channels.values()} == set(SENSORS)
