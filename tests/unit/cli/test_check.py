"""The verb check: numbers on the screen, in JSON and on a page, and nothing when the file is bad."""

import json

import pytest

from rotordrop.cli.app import run
from rotordrop.machine import example_machine, example_path

PAPER = str(example_path("paper"))


def test_the_summary_names_the_numbers(tmp_path, capsys):
    files = [tmp_path / "m.json", tmp_path / "m.html"]
    assert run(["check", PAPER, "--all", "--json", str(files[0]), "--report", str(files[1])]) == 0
    text = capsys.readouterr().out
    for expected in ("59.50 kg", "621.3 mm", "0.08752 kg m²", "187.3", "134.0", "mode 1 [Hz]", "174.6 N"):
        assert expected in text
    assert json.loads(files[0].read_text())["machine"] == example_machine("paper").name
    assert "touchdown bearing" in files[1].read_text() and "59.50" in files[1].read_text()


def test_json_on_standard_output_is_json_and_nothing_else(capsys):
    assert run(["check", PAPER, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["mass_kg"] == pytest.approx(59.49996, rel=1e-6)
    assert found["bearings"]["DE"]["load_N"] == pytest.approx(409.08, rel=1e-4)
    assert len(found["levitated_sag_m"]) == 36
    assert found["defaults"]
