"""The verbs coast-down, waterfall and critical-speeds: screen, JSON, page, file."""

from __future__ import annotations

import json
from importlib.resources import files

import pytest

from rotordrop.cli.app import run
from rotordrop.machine import example_machine, example_path, save_machine

PAPER = str(example_path("paper"))


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    path = tmp_path_factory.mktemp("machine") / "lp400.toml"
    save_machine(example_machine("lp400").with_values({"speed.aero_linear": 0.11}), path)
    return str(path)


@pytest.fixture(scope="module")
def coast(machine, tmp_path_factory):
    folder = tmp_path_factory.mktemp("coast")
    files = {"h5": folder / "c.h5", "json": folder / "c.json", "html": folder / "c.html"}
    arguments = ["coast-down", machine, "--speed", "60 Hz", "--until", "2.5 s", "--output", str(files["h5"])]
    assert run([*arguments, "--json", str(files["json"])]) == 0
    return files


def test_a_coast_down_says_whether_the_first_window_held_the_maximum(coast, capsys):
    found = json.loads(coast["json"].read_text())
    assert found["end_time_s"] == pytest.approx(2.5)
    assert found["standstill_time_s"] is None
    assert len(found["maxima"]) == 6
    assert all(maximum["within_first_0.2_s"] for maximum in found["maxima"])
    assert found["windows"]["end"] == pytest.approx([0.2, 1.0, 2.0, 2.5])
    assert found["contacts"]["NDE"] > 3


def test_an_unfinished_run_is_not_taken_for_another(coast, machine, capsys):
    arguments = ["coast-down", machine, "--speed", "60 Hz", "--until", "0.2 s"]
    assert run([*arguments, "--resume"]) == 64
    assert "--resume needs the --output" in capsys.readouterr().err
    assert run([*arguments, "--until", "for ever"]) == 64
    assert "for ever" in capsys.readouterr().err


def test_a_machine_without_drag_is_told_the_way_out(capsys):
    lp400 = str(example_path("lp400"))
    assert run(["coast-down", lp400, "--speed", "60 Hz", "--until", "0.1 s"]) == 5
    assert "no aerodynamic drag" in capsys.readouterr().err


def test_waterfall_reads_a_simulated_coast_down(coast, machine, tmp_path, capsys):
    arguments = ["waterfall", machine, str(coast["h5"]), "--points", "8192", "--component", "x"]
    files = {"json": tmp_path / "w.json", "page": tmp_path / "w.html"}
    assert run([*arguments, "--json", str(files["json"]), "--report", str(files["page"])]) == 0
    found = json.loads(files["json"].read_text())
    assert set(found["planes"]) == {"NDE", "DE"}
    assert not found["recorded"]
    fall = found["planes"]["DE"]["waterfalls"]
    assert [item["component"] for item in fall] == ["x"]
    assert fall[0]["amplitude_kind"] == "zero-to-peak"
    assert fall[0]["resolution_hz"] == pytest.approx(20000 / 8192)
    assert "zero-to-peak" in files["page"].read_text()
    assert "held the maximum" in capsys.readouterr().out


def test_critical_speeds_of_the_paper(tmp_path, capsys):
    files = {"json": tmp_path / "c.json", "page": tmp_path / "c.html"}
    arguments = ["critical-speeds", PAPER, "--top-speed", "100 Hz", "--held", "touchdown bearings"]
    assert run([*arguments, "--json", str(files["json"]), "--report", str(files["page"])]) == 0
    found = json.loads(files["json"].read_text())
    settled = found["maps"]["standstill"]["at_the_machine_Hz"]
    assert settled["tangent"][:2] == pytest.approx([134.0, 235.0], rel=5e-3)
    assert settled["with support mass"][1] == pytest.approx(206.4, rel=5e-3)
    assert set(found["maps"]) == {"standstill", "forward", "backward"}
    assert list(found["campbell"]) == ["touchdown bearings"]
    assert len(found["campbell"]["touchdown bearings"]["shapes_at_lowest_speed"]["real"][0]) == 36
    text = capsys.readouterr().out
    assert "134.0, 235.0" in text and "132.9, 206.4" in text
    assert "Critical speed map" in files["page"].read_text()


def test_the_page_of_a_coast_down_states_maxima_and_certificate(machine, tmp_path, capsys):
    page, numbers = tmp_path / "c.html", tmp_path / "c.json"
    arguments = ["coast-down", machine, "--speed", "60 Hz", "--until", "0.3 s", "--certify"]
    assert run([*arguments, "--report", str(page), "--json", str(numbers)]) == 0
    text = page.read_text()
    for expected in (
        "Does 0.2 s hold the maximum?",
        "Second by second",
        "Largest Hertz stress",
        "Friction law",
    ):
        assert expected in text
    certificate = json.loads(numbers.read_text())["certificate"]
    assert certificate["tighter_tolerance"] == pytest.approx(1e-7)
    assert max(max(row) for row in certificate["peak_change"]) < 0.05
    assert "At a tolerance of 1e-07" in capsys.readouterr().out


def test_waterfall_of_the_bundled_record(tmp_path, capsys):
    lp400 = str(example_path("lp400"))
    record = files("rotordrop") / "examples" / "lp400" / "drop_060.h5"
    numbers = tmp_path / "w.json"
    arguments = ["waterfall", lp400, str(record), "--points", "8192", "--amplitude", "peak-to-peak"]
    assert run([*arguments, "--component", "y", "--json", str(numbers)]) == 0
    found = json.loads(numbers.read_text())
    assert found["recorded"]
    assert found["speed_law"] is None
    for plane in found["planes"].values():
        assert plane["first_0.2_s_held_the_maximum"]
        assert plane["largest_displacement_time_s"] < 0.05
        assert plane["waterfalls"][0]["amplitude_kind"] == "peak-to-peak"
    assert any(line["label"].startswith("pendulum") for line in found["lines"])
    assert "simulated" in capsys.readouterr().out
