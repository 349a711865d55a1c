"""The verb check: numbers on the screen, in JSON and on a page, and nothing when the file is bad."""

from __future__ import annotations

import json

import pytest

from rotordrop.cli.app import run
from rotordrop.cli.machine import rotor_lines
from rotordrop.machine import example_machine, example_path

PAPER = str(example_path("paper"))


def test_the_summary_names_the_numbers(capsys):
    assert run(["check", PAPER, "--all"]) == 0
    text = capsys.readouterr().out
    for expected in (
        "59.50 kg",
        "621.3 mm",
        "0.08752 kg m²",
        "187.3",
        "134.0",
        "mode 1 [Hz]",
        "174.6 N",
        "Defaults in use",
    ):
        assert expected in text
    assert "at 550 Hz (33000 rpm)" in text
    assert "\x1b" not in text


def test_without_all_it_is_one_screen_with_the_verdict_first(capsys):
    assert run(["check", PAPER]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 50
    verdicts = [line for line in lines if line.startswith(("good:", "warning:", "bad:"))]
    assert verdicts == ["good: The machine can be worked with; 3 things to know below."]
    text = "\n".join(lines)
    assert "ball centrifugal force (NDE, DE)" in text
    assert "defaults in use" in text


def test_a_value_that_looks_wrong_comes_first_and_in_full(tmp_path, capsys):
    odd = tmp_path / "odd.toml"
    text = example_path("paper").read_text(encoding="utf-8")
    odd.write_text(text.replace("[speed]", "[speed]\n# a slip: Hz for rpm", 1).replace("550 Hz", "33000 Hz"))
    assert run(["check", str(odd)]) == 0
    lines = capsys.readouterr().out.splitlines()
    first = next(line for line in lines if line.startswith("warning:"))
    assert "one value looks wrong: nominal speed (machine)" in first
    assert any("a surface speed of" in line and "check the unit (Hz or rpm)" in line for line in lines)


def test_the_speed_of_the_drop_decides_the_warnings(capsys):
    assert run(["check", PAPER, "--all", "--speed", "3600 rpm"]) == 0
    text = capsys.readouterr().out
    assert "each ball is thrown outwards" not in text
    assert "the support by itself resonates" in text


def test_json_on_standard_output_is_json_and_nothing_else(capsys):
    assert run(["check", PAPER, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["mass_kg"] == pytest.approx(59.49996, rel=1e-6)
    assert found["bearings"]["DE"]["load_N"] == pytest.approx(409.08, rel=1e-4)
    assert len(found["levitated_sag_m"]) == 36
    assert found["defaults"]


def test_json_and_page_are_files(tmp_path, capsys):
    assert (
        run(["check", PAPER, "--json", str(tmp_path / "m.json"), "--report", str(tmp_path / "m.html")]) == 0
    )
    assert json.loads((tmp_path / "m.json").read_text())["machine"] == example_machine("paper").name
    page = (tmp_path / "m.html").read_text()
    assert "touchdown bearing" in page
    assert "59.50" in page
    assert f"JSON: {tmp_path / 'm.json'}" in capsys.readouterr().out


def test_a_bad_file_leaves_no_output_and_says_where(tmp_path, capsys):
    bad = tmp_path / "bad.toml"
    bad.write_text(example_path("paper").read_text(encoding="utf-8").replace('name = "', 'nmae = "', 1))
    assert (
        run(["check", str(bad), "--json", str(tmp_path / "m.json"), "--report", str(tmp_path / "m.html")])
        == 2
    )
    out, err = capsys.readouterr()
    assert out == ""
    assert "bad.toml:" in err
    assert "nmae" in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.toml"]


def test_a_speed_without_unit_is_a_wrong_call(capsys):
    assert run(["check", PAPER, "--speed", "60"]) == 64
    assert "'60' has no unit; a speed needs one, for example '60 Hz'" in capsys.readouterr().err


def test_the_drawing_has_each_bearing_amb_and_sensor_at_its_place():
    machine = example_machine("paper")
    lines = rotor_lines(machine, width=100)
    assert lines[3].count("┃") == len({disc.node for disc in machine.rotor.discs})
    bearings = next(line for line in lines if "▲" in line and "shaft" not in line)
    nodes = machine.rotor.node_positions
    expected = [int(100 * nodes[bearing.node - 1] / nodes[-1]) for bearing in machine.touchdown_bearings]
    assert [i for i, mark in enumerate(bearings) if mark == "▲"] == expected
    filled = [len(line.replace(" ", "")) for line in lines[:7]]
    assert filled[3] == max(filled) > min(filled) > 0
    assert filled == filled[::-1]
