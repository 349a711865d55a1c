"""The verb simulate: every start, every output, and messages that name what was written."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from tests.unit.simulate.looped import looped_machine

from rotordrop import __version__, load_result, save_machine
from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.examples import example_record_path
from rotordrop.files import digest_of_file
from rotordrop.machine import example_machine, example_path
from rotordrop.simulate.case import MagnetEvent

PAPER = str(example_path("paper"))
SHORT = ["simulate", PAPER, "--speed", "60 Hz", "--duration", "12 ms", "--reduction", "quick"]


@pytest.mark.parametrize("verb", ["check", "look", "simulate"])
def test_every_report_says_when_how_and_from_which_files_it_was_made(verb, tmp_path, monkeypatch):
    machine, page = tmp_path / "m.toml", tmp_path / "p.html"
    save_machine(example_machine("lp400").model_copy(update={"serial_number": "4711"}), machine)
    read = [machine, *([example_record_path("lp400_drop_060")] if verb == "look" else [])]
    command = [verb, *map(str, read), *(SHORT[2:] if verb == "simulate" else []), "--report", str(page)]
    monkeypatch.setattr(sys, "argv", ["rotordrop", *command])
    assert run(command) == 0
    told = page.read_text(encoding="utf-8").partition("<h2>How this was made</h2>")[2]
    said = [f"by rotordrop {__version__}", f"rotordrop {verb} {read[0]}", *map(digest_of_file, read)]
    assert all(told.count(one) == 1 for one in said), said
    assert "<dt>serial number</dt><dd>4711</dd>" in told


def test_a_drop_from_the_centre_reaches_every_output(tmp_path):
    drop, page, told = (tmp_path / f"drop.{suffix}" for suffix in ("h5", "html", "json"))
    assert run([*SHORT, "-o", str(drop), "--report", str(page), "--json", str(told)]) == 0
    numbers, result = json.loads(told.read_text()), load_result(drop)
    assert numbers["speed_Hz"] == pytest.approx(60.0)
    assert list(numbers["bearings"]) == ["NDE", "DE"]
    for index, name in enumerate(result.bearing_names):
        found = numbers["bearings"][name]
        peak, largest = found["peak_force_N"]["value"], result.bearing_force_magnitude[:, index].max()
        assert largest <= peak == pytest.approx(largest, rel=1e-3)
        stress = found["stress_statistics_Pa"]["maximum"]
        assert stress == pytest.approx(found["peak_stress_Pa"]["value"], rel=1e-3)
        assert "mean_force_0p15_0p2_N" not in found


def test_the_summary_names_the_file_it_wrote(tmp_path, capsys):
    assert run([*SHORT, "-o", str(tmp_path / "drop.h5")]) == 0
    assert f"Written: {tmp_path}/drop.h5".replace(" ", "") in "".join(capsys.readouterr().out.split())


def test_the_first_contact_is_that_of_free_fall(capsys):
    """From the centre 275 µm take 7.49 ms and 285 µm 7.62 ms."""
    assert run([*SHORT, "--json", "-"]) == 0
    bearings = json.loads(capsys.readouterr().out)["bearings"]
    for name, gap in (("NDE", 275e-6), ("DE", 285e-6)):
        assert bearings[name]["impacts"][0]["start_s"] == pytest.approx(np.sqrt(2 * gap / 9.81), rel=0.01)


def test_a_drop_of_millions_of_steps_says_so_first_and_stops_on_ctrl_c(tmp_path):
    machine = tmp_path / "stiff.toml"
    save_machine(example_machine("paper").with_values({"NDE.support.mass": 1e-9}), machine)
    command = [sys.executable, "-m", "rotordrop", "simulate", str(machine), "--speed", "60 Hz"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
        assert running.stderr is not None
        running.stderr.readline()
        time.sleep(1.0)
        running.send_signal(signal.SIGINT)
        out, rest = running.communicate(timeout=600.0)
    assert running.returncode == 130
    assert "Traceback" not in rest
    assert out == ""


@pytest.mark.slow
def test_a_lift_stands_in_json(tmp_path):
    save_machine(looped_machine(), tmp_path / "machine.toml")
    arguments = ["simulate", str(tmp_path / "machine.toml"), "--speed", "60 Hz", "--duration", "0.11 s"]
    arguments += ["--levitated", "--magnets=5 ms: off", "--magnets=60 ms: levitate", "--output-step=0.1 ms"]
    assert run([*arguments, "--json", str(tmp_path / "drop.json")]) == 0
    told = json.loads((tmp_path / "drop.json").read_text())["magnets"]
    assert [event["time_s"] for event in told["events"]] == [0.005, 0.06]
    assert told["lift"]["succeeded"]
    assert 4.0 < told["largest_current_A"]["DE"] <= 8.0


def test_events_of_magnets_are_read_and_bad_ones_refused():
    events = [*map(MagnetEvent.read, ("speed 50 Hz: levitate", "rest: bias decays", "0 s: lost NDE x"))]
    assert [str(event) for event in events] == ["levitate", "bias decays", "lost NDE x"]
    assert events[0].below_speed == pytest.approx(314.159265)
    for text in ("20 ms: lift", "20 ms", "20 ms: lost NDE DE x"):
        with pytest.raises(UsageError, match="is not 'WHEN: ACTION"):
            MagnetEvent.read(text)


def test_where_a_magnet_stays_on_nothing_falls(capsys):
    assert run([*SHORT, "--levitated", "--stays-on", "NDE", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)["bearings"]
    assert found["NDE"]["peak_force_N"]["value"] == pytest.approx(0.0, abs=1e-3)
