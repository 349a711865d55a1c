"""The verbs synthesize and score: files, sentences, refusals."""

import json

import pytest

from rotordrop.machine import example_path
from rotordrop_bench.cli.app import run
from rotordrop_bench.cli.scores import percent

LP400 = str(example_path("lp400"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("synthetic")
    arguments = ["--speed", "60 Hz", "--speed", "60 Hz", "--duration", "210 ms", "--seed", "3"]
    assert run(["synthesize", LP400, *arguments, "--output", str(path)]) == 0
    return path


def test_names_count(folder, tmp_path):
    names = sorted(file.name for file in (folder / "drops").iterdir())
    assert names == [file.stem for file in sorted((folder / "truth").iterdir())]
    assert names == ["synthetic_060Hz_1", "synthetic_060Hz_2"]
    arguments = ["--speed", "60 Hz", "--duration", "10 ms", "--json", str(tmp_path / "j")]
    assert run(["synthesize", LP400, *arguments, "--output", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "j").read_text())["origin"] == "simulated, not measured"


def test_a_violation_is_told_in_the_truth(tmp_path):
    (tmp_path / "case.toml").write_text("[contact]\nexponent = 1.5")
    case = str(tmp_path / "case.toml")
    arguments = ["--speed", "100 Hz", "--duration", "10 ms", "--violation", case]
    assert run(["synthesize", LP400, *arguments, "--output", str(tmp_path)]) == 0
    truth = json.loads((tmp_path / "truth" / "synthetic_100Hz.json").read_text())
    assert truth["violations"]["contact"]["exponent"] == 1.5
    assert truth["contact.exponent"]["NDE"] == 1.5


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--violation", "moon"], "cannot read the case file moon"),
        (["--duration", "10"], "'10' has no unit"),
    ],
)
def test_wrong_choices_name_the_right_ones(option, message, tmp_path, capsys):
    assert run(["synthesize", LP400, "--speed", "60 Hz", "--output", str(tmp_path), *option]) == 64
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_score_is_a_table(folder, tmp_path, capsys):
    truth = json.loads((folder / "truth" / "synthetic_060Hz_1.json").read_text())
    peak = truth["peak_force_N"]["NDE"]
    fields = {"peak_force_N": {"value": 1.02 * peak, "interval_90": [0.9 * peak, 1.1 * peak]}}
    estimate = tmp_path / "estimate.json"
    estimate.write_text(json.dumps({"speed_Hz": 60.0, "bearings": {"NDE": fields}}))
    assert run(["score", str(estimate), str(folder / "truth" / "synthetic_060Hz_1.json")]) == 0
    out = capsys.readouterr().out
    assert "2.0 %" in out and "100 %" in out and "10 %" in out


@pytest.mark.parametrize(
    ("share", "text"), [(1.53, "153 %"), (0.0231, "2.3 %"), (-25.4, "-2540 %"), (0.0, "0 %"), (None, "")]
)
def test_a_percentage_is_a_plain_number(share, text):
    assert percent(share) == text


def test_errors_name_program_and_files(capsys, folder, tmp_path):
    assert run(["score", "nowhere.json", "nowhere.json"]) != 0
    assert capsys.readouterr().err.startswith("rotordrop-bench: ")
    assert run(["frobnicate"]) == 64
    assert capsys.readouterr().err == (
        "rotordrop-bench: there is no command 'frobnicate'; try 'rotordrop-bench --help'\n"
    )
    wrong = tmp_path / "wrong.json"
    wrong.write_text("{}")
    assert run(["score", str(wrong), str(folder / "truth" / "synthetic_060Hz_1.json")]) == 64
    assert "expected the JSON of 'rotordrop estimate'" in capsys.readouterr().err
    assert run(["score", str(wrong), str(wrong)]) == 64
    assert "is no truth file: it has no 'air_gap_m'" in capsys.readouterr().err
