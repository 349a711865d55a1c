"""The command: what its verbs write and print, and what they refuse."""

import json

import pytest

from rotordrop.machine import example_path
from rotordrop_bench.cli.app import run
from rotordrop_bench.cli.scores import percent

LP400 = str(example_path("lp400"))
DRAW = ["synthesize", LP400, "--speed", "60 Hz", "--output", "out"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("synthetic")
    (path / "case.toml").write_text("[contact]\nexponent = 1.5")
    options = ["--duration", "30 ms", "--seed", "3", "--violation", str(path / "case.toml")]
    where = ["--output", str(path), "--json", str(path / "said.json")]
    assert run(["synthesize", LP400, "--speed", "60 Hz", "--speed", "60 Hz", *options, *where]) == 0
    return path


def test_drawn_drops_are_numbered_and_their_violation_is_told_in_the_truth(folder):
    names = sorted(file.name for file in (folder / "drops").iterdir())
    assert names == [file.stem for file in sorted((folder / "truth").iterdir())]
    assert names == ["synthetic_060Hz_1", "synthetic_060Hz_2"]
    said = json.loads((folder / "said.json").read_text())
    assert said["origin"] == "simulated, not measured"
    assert [one["name"] for one in said["drops"]] == names
    truth = json.loads((folder / "truth" / "synthetic_060Hz_1.json").read_text())
    assert truth["violations"]["contact"]["exponent"] == truth["contact.exponent"]["NDE"] == 1.5


def test_a_score_is_a_table_and_a_list_names_departures(folder, tmp_path, capsys):
    truth = folder / "truth" / "synthetic_060Hz_1.json"
    peak = json.loads(truth.read_text())["peak_force_N"]["NDE"]
    fields = {"peak_force_N": {"value": 1.02 * peak, "interval_90": [0.9 * peak, 1.1 * peak]}}
    estimate = tmp_path / "synthetic_060Hz_1.json"
    estimate.write_text(json.dumps({"speed_Hz": 60.0, "bearings": {"NDE": fields}}))
    for given in ([estimate, truth], [tmp_path, folder / "truth"]):
        assert run(["score", *map(str, given), "--json", str(folder / "scores.json")]) == 0
        out = capsys.readouterr().out
        assert "2.0 %" in out and "100 %" in out and "10 %" in out
        departures = 1 if given[0] == estimate else 2  # of one violation in either drop, none named
        assert f"of {departures} departures 0 were named, and 0 estimates name one" in " ".join(out.split())
        assert ("there is no synthetic_060Hz_2.json" in out) == (given[0] == tmp_path)
        assert "synthetic_060Hz_1" in json.loads((folder / "scores.json").read_text())["drops"]
    assert run(["list", "--only", "two departures"]) == 0
    assert capsys.readouterr().out.count("two departures: ") == 6


@pytest.mark.parametrize(
    ("share", "text"), [(1.53, "153 %"), (0.0231, "2.3 %"), (-25.4, "-2540 %"), (0.0, "0 %"), (None, "")]
)
def test_a_percentage_is_a_plain_number(share, text):
    assert percent(share) == text


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (["frobnicate"], "there is no command 'frobnicate'; try 'rotordrop-bench --help'"),
        (["make"], "Missing argument 'FOLDER'"),
        (
            ["make", "out", "--only", "drop_999"],
            "no drop 'drop_999'; name one of drop_001 to drop_208, a rotor",
        ),
        (["score", "x"], "Missing argument 'TRUTH'"),
        (["score", "x", "x"], "x holds no truth; make some with 'rotordrop-bench make'"),
        (["score", "y", "x"], "y is no folder; give the one with the estimates"),
        (["score", "empty.json", "empty.json"], "is no truth file: it has no 'air_gap_m'"),
        ([*DRAW, "--violation", "moon"], "cannot read the case file moon"),
        ([*DRAW, "--duration", "10"], "'10' has no unit"),
    ],
)
def test_a_wrong_call_names_the_right_one(call, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x").mkdir()
    (tmp_path / "empty.json").write_text("{}")
    assert run(call) == 64
    assert message in capsys.readouterr().err.replace("\n", " ")
    assert not (tmp_path / "out").exists()
