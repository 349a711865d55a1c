"""The verbs coast-down, waterfall and critical-speeds: screen, JSON, page, file."""

import json
import math
import re
from dataclasses import replace
from importlib.resources import files

import h5py
import numpy as np
import pytest
from tests.unit.simulate.short_drop import Killed, killed_after

from rotordrop import build_drop_model, read_record, save_machine, simulate_coast_down
from rotordrop.cli.app import run
from rotordrop.errors import RecordError, SimulationError
from rotordrop.estimate.coast_down import recorded_coast_down, simulated_coast_down, with_recorded_drag
from rotordrop.files import digest_of_file, new_hdf5
from rotordrop.machine import example_machine, example_path, load_machine
from rotordrop.simulate import coast_down
from rotordrop.simulate.case import CentredStart, CoastDownCase
from rotordrop.simulate.coast_down_file import load_coast_down, open_samples, work_folder
from rotordrop.spectrum.coast_down import analyse_coast_down

PAPER = str(example_path("paper"))


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    path = tmp_path_factory.mktemp("machine") / "lp400.toml"
    save_machine(example_machine("lp400").with_values({"speed.aero_time_constant": 9.0}), path)
    return str(path)


def recorded(path, *, seconds, rate=1000.0, speed=True, unit="um", before=0.3):
    """A plain recording: floating, fallen by 0.28 mm at 0 s, and a speed that falls with 5 s."""
    time = np.arange(-before, seconds, 1.0 / rate)
    dice = np.random.default_rng(4)
    columns = {"time [s]": time}
    down = -270.0 * np.clip(time / 8e-3, 0.0, 1.0) ** 2
    for sensor in example_machine("lp400").sensors:
        noise = 0.3 * dice.standard_normal(time.size)
        columns[f"{sensor.name} [{unit}]"] = down * np.sin(sensor.angle.value) + noise
    if speed:
        columns["speed [Hz]"] = 60.0 * np.exp(-0.2 * np.clip(time, 0.0, None))
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.6f")
    return path


@pytest.fixture(scope="module")
def signal(tmp_path_factory):
    """Such a recording of 5 s as a coast-down."""
    machine = example_machine("lp400")
    path = recorded(tmp_path_factory.mktemp("signal") / "r.csv", seconds=5.0)
    return recorded_coast_down(machine, read_record(path, machine))


@pytest.fixture(scope="module")
def coast(machine, tmp_path_factory):
    """A coast-down of 2.5 s: its samples and its JSON."""
    folder = tmp_path_factory.mktemp("coast")
    files = folder / "c.h5", folder / "c.json"
    arguments = ["coast-down", machine, "--speed", "60 Hz", "--until", "2.5 s", "--output", str(files[0])]
    assert run([*arguments, "--json", str(files[1])]) == 0
    return files


def test_a_coast_down_says_whether_the_first_window_held_the_maximum(coast):
    found = json.loads(coast[1].read_text())
    assert found["end_time_s"] == pytest.approx(2.5)
    assert found["standstill_time_s"] is None
    assert len(found["maxima"]) == 6
    assert all(maximum["within_first_0.2_s"] for maximum in found["maxima"])
    assert found["windows"]["end"] == pytest.approx([0.2, 1.0, 2.0, 2.5])
    assert found["contacts"]["NDE"] > 3


def test_every_number_of_a_coast_down_is_that_of_its_samples(coast):
    """Windows against the samples of the file, the largest values and the energies against the windows."""
    found, result = json.loads(coast[1].read_text()), load_coast_down(coast[0])
    samples = open_samples(coast[0])
    count = len(samples.speed)
    time = np.arange(count) / samples.sampling_rate
    assert 1.0 / found["output_step_s"] == pytest.approx(samples.sampling_rate)
    assert found["initial_speed_rad_s"] == pytest.approx(2.0 * np.pi * 60.0)
    windows = found["windows"]
    peaks = np.array(windows["peak"])  # window, bearing, quantity
    late = np.array(windows["start"]) > 0.19
    assert len(found["maxima"]) == peaks[0].size
    for maximum in found["maxima"]:
        b = found["bearings"].index(maximum["bearing"])
        of_windows = peaks[:, b, found["quantities"].index(maximum["quantity"])]
        for value, peak in ((maximum["value"], of_windows), (maximum["largest_later"], of_windows[late])):
            assert value == pytest.approx(peak.max(), rel=1e-2)  # a peak lies between two samples
        at = int(np.argmax(of_windows))
        assert windows["start"][at] <= maximum["time_s"] <= windows["end"][at]
        if maximum["quantity"] == "indentation":  # into the race, which gives way: the rotor went further
            radius = np.hypot(*np.asarray(samples.planes[maximum["bearing"]][0:count]).T)
            beyond = radius[time <= 0.2].max() - samples.air_gap[maximum["bearing"]]
            assert 0.0 < maximum["value"] < beyond < 10.0 * maximum["value"]
            assert maximum["time_s"] == pytest.approx(time[int(np.argmax(radius))], abs=5e-4)
    for end, speed in zip(windows["end"], windows["speed"], strict=True):
        assert speed == pytest.approx(np.interp(end, time, np.abs(samples.speed)), rel=1e-4)
    for b, name in enumerate(found["bearings"]):
        assert sum(window[b] for window in windows["contacts"]) == found["contacts"][name]
        assert found["contact_energy_J"][name] == pytest.approx(result.contact_energy[b])
    assert sum(windows["dissipated"]) == pytest.approx(found["dissipated_J"], rel=1e-6)
    assert sum(found["contact_energy_J"].values()) < found["dissipated_J"]
    assert abs(found["energy_residual_J"]) < 1e-3 * found["energy_scale_J"]


def test_a_coast_down_that_gives_up_is_written_and_ends_as_a_drop_that_does(machine, tmp_path, monkeypatch):
    """Its exit code was 0, and its JSON could not be written."""
    monkeypatch.setattr(coast_down, "MOST_STEPS_PER_WINDOW", 300)
    file = tmp_path / "c.json"
    arguments = ["coast-down", machine, "--speed", "60 Hz", "--certify", "--json", str(file)]
    assert run(arguments) == SimulationError.exit_code
    found = json.loads(file.read_text())
    assert "300 steps were not enough" in found["outcome"]
    assert (found["finished"], found["standstill_time_s"], found.get("certificate")) == (False, None, None)


def test_drag_from_a_recorded_coast_down_stops_the_rotor_as_recorded(tmp_path, capsys):
    """Dry and linear drag known: the fitted drag, handed over, gives the recorded fall of speed again."""
    record = recorded(tmp_path / "record.csv", seconds=12.0)
    numbers = tmp_path / "c.json"
    arguments = ["coast-down", str(example_path("lp400")), "--speed", "60 Hz", "--until", "3 s"]
    assert run([*arguments, "--drag-from", str(record), "--json", str(numbers)]) == 0
    speed = json.loads(numbers.read_text())["windows"]["speed"]
    # The rotor first spins up the races; from 1 s to 3 s both fall together.
    assert speed[-1] / speed[1] == pytest.approx(np.exp(-0.2 * 2.0), rel=0.01)


def test_waterfall_reads_a_simulated_coast_down(coast, machine, tmp_path, capsys):
    told, page, findings = tmp_path / "w.json", tmp_path / "w.html", tmp_path / "w.h5"
    arguments = ["waterfall", machine, str(coast[0]), "--points", "8192", "--component", "x"]
    arguments += ["--against", "speed", "--output", str(findings)]
    assert run([*arguments, "--json", str(told), "--report", str(page)]) == 0
    found = json.loads(told.read_text())
    assert set(found["planes"]) == {"NDE", "DE"} and not found["recorded"]
    (fall,) = found["planes"]["DE"]["waterfalls"]
    assert (fall["component"], fall["amplitude_kind"]) == ("x", "zero-to-peak")
    assert fall["resolution_hz"] == pytest.approx(20000 / 8192)
    shown = capsys.readouterr().out
    kinds = [(entry["bearing"], entry["quantity"]) for entry in found["force_and_stress"]]
    assert ("DE", "bearing force") in kinds and len(kinds) == 6
    for line in found["lines"]:
        seen = line["last_seen_s"] - line["first_seen_s"]
        known = line["frequency_error_hz"]  # null where it is open
        assert known is None or known >= 0.288 / seen, "no line is known better than the time it was seen"
        turns = seen * line["frequency_hz"] / (line["order"] or 1.0)
        assert line["order_error"] is None or line["order_error"] >= 0.288 / turns
    assert found["lines"] and not re.search(r"±\s\S*e-", shown)
    with h5py.File(findings) as file:
        plane = file["planes/DE"]
        amplitude = plane["waterfall_x/amplitude"]
        assert amplitude.attrs["units"] == "m" and amplitude.attrs["amplitude_kind"] == "zero-to-peak"
        mean_square = np.sqrt(np.mean(amplitude[()] ** 2, axis=0))
        assert mean_square == pytest.approx(fall["rms_over_frames_m"], rel=1e-9)
        peak = found["planes"]["DE"]["largest_displacement_m"]
        assert np.max(plane["displacement/largest"]) == pytest.approx(peak, rel=1e-12)
        assert file["speed/speed"][0] == pytest.approx(2.0 * math.pi * 60.0, rel=1e-6)


def test_a_simulated_coast_down_knows_when_it_stopped(coast, tmp_path):
    assert simulated_coast_down(coast[0]).standstill is None
    path = tmp_path / "stopped.h5"
    with h5py.File(coast[0]) as old, new_hdf5(path) as file:
        for name in old:
            old.copy(name, file)
        file.attrs.update({**old.attrs, "standstill_time": 2.34})
    assert simulated_coast_down(path).standstill == 2.34


def test_orders_of_a_simulation_are_those_a_sensor_would_show(signal):
    still = {name: np.zeros(np.shape(plane)) for name, plane in signal.planes.items()}
    found = analyse_coast_down(replace(signal, planes=still, recorded=False), ())
    typical = np.median(found.planes["DE"].track.major_axis)
    assert 1e-9 < typical < 4e-7, "the noise of the sensor, spread over all orders"


def test_critical_speeds_of_the_paper(tmp_path, capsys):
    told, page = tmp_path / "c.json", tmp_path / "c.html"
    arguments = ["critical-speeds", PAPER, "--top-speed", "100 Hz", "--held", "touchdown bearings"]
    assert run([*arguments, "--json", str(told), "--report", str(page)]) == 0
    assert f"<dd>paper.toml, SHA-256 {digest_of_file(PAPER)}</dd>" in page.read_text(encoding="utf-8")
    found = json.loads(told.read_text())
    settled = found["maps"]["standstill"]["at_the_machine_Hz"]
    assert settled["tangent"][:2] == pytest.approx([134.0, 235.0], rel=5e-3)
    assert settled["with support mass"][1] == pytest.approx(206.4, rel=5e-3)
    assert set(found["maps"]) == {"standstill", "forward", "backward"}
    assert list(found["campbell"]) == ["touchdown bearings"]
    assert len(found["campbell"]["touchdown bearings"]["shapes_at_lowest_speed"]["real"][0]) == 36
    text = capsys.readouterr().out
    assert "134.0, 235.0" in text and "132.9, 206.4" in text


def test_the_certificate_of_a_coast_down_changes_its_maxima_by_little(machine, tmp_path):
    numbers = tmp_path / "c.json"
    arguments = ["coast-down", machine, "--speed", "60 Hz", "--until", "0.3 s", "--certify"]
    assert run([*arguments, "--json", str(numbers)]) == 0
    certificate = json.loads(numbers.read_text())["certificate"]
    assert certificate["tighter_tolerance"] == pytest.approx(1e-7)
    assert max(max(row) for row in certificate["peak_change"]) < 0.05


def test_waterfall_of_the_bundled_record(tmp_path):
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


LP400 = str(example_path("lp400"))


def test_a_record_without_speed_says_what_is_missing(tmp_path, capsys):
    record = str(recorded(tmp_path / "r.csv", seconds=3.0, speed=False))
    short = ["--points", "1024", "--component", "y"]
    assert run(["waterfall", LP400, record, *short]) == 3
    assert 'constant = "60 Hz"' in capsys.readouterr().err
    by_hand = tmp_path / "by_hand.toml"
    by_hand.write_text('[speed]\nconstant = "60 Hz"\n')
    short += ["--profile", str(by_hand)]
    assert run(["waterfall", LP400, record, *short]) == 0
    assert run(["waterfall", LP400, record, *short, "--against", "speed"]) == 64
    assert "has no rotor speed; use --against time" in capsys.readouterr().err
    with pytest.raises(RecordError, match="so it shows no drag; give a record with a speed channel"):
        lp400 = example_machine("lp400")
        with_recorded_drag(lp400, recorded_coast_down(lp400, read_record(record, lp400, profile=by_hand)))


def test_a_record_too_short_for_a_turn_is_refused(tmp_path, capsys):
    record = str(recorded(tmp_path / "r.csv", seconds=1.5))
    assert run(["waterfall", LP400, record]) == 0
    capsys.readouterr()
    short = str(recorded(tmp_path / "s.csv", seconds=0.04))  # it ends while the rotor bounces
    assert run(["waterfall", LP400, short]) != 0
    assert "the signal of 0.04 s holds no whole window of 4 turns" in capsys.readouterr().err
    assert run(["coast-down", LP400, "--speed", "60 Hz", "--drag-from", record]) == 3
    assert re.search(r"recorded for 1\.\d+ s after power-off; at least 4 s", capsys.readouterr().err)


def test_a_run_is_resumed_with_its_own_machine_only(machine, tmp_path, capsys):
    """Killed runs of another machine are refused by name; the right one ends as if never stopped."""
    output, other, told = tmp_path / "c.h5", tmp_path / "other.toml", tmp_path / "c.json"
    described = load_machine(machine)
    save_machine(described.with_values({"DE.support.stiffness": 3e8}), other)
    case = CoastDownCase(speed=2.0 * math.pi * 60.0, duration=0.4, start=CentredStart())
    model = build_drop_model(described, "quick")
    with pytest.raises(Killed):
        simulate_coast_down(model, case, output=output, progress=killed_after(1))
    again = ["--speed", "60 Hz", "--until", "0.4 s", "--output", str(output)]
    ending = ["coast-down", machine, *again, "--resume", "--json", str(told)]

    def refused(code, words, of, *more):
        assert run(["coast-down", str(of), *again, *more]) == code
        assert words in capsys.readouterr().err

    refused(6, "add --resume to go on with it", machine)
    refused(5, "belongs to another run", other, "--resume")
    assert run(ending) == 0
    assert output.exists() and not work_folder(output).exists()
    refused(6, "nothing to resume", other, "--resume")
    # killed between its samples and its JSON, or while the parts were removed: what had ended is read again
    whole = told.read_text(), output.read_bytes()
    told.unlink()
    work_folder(output).mkdir()
    assert run(ending) == 0
    assert (told.read_text(), output.read_bytes()) == whole
    assert not work_folder(output).exists()


def test_a_coast_down_runs_on_the_machine_that_init_writes(tmp_path):
    target = str(tmp_path / "machine.toml")
    assert run(["init", target]) == 0
    assert run(["coast-down", target, "--speed", "60 Hz", "--until", "0.02 s"]) == 0
