"""Amplitude and phase of 1X against the mark: on circles that are known, and through a file with pulses."""

import json

import numpy as np
import pytest

from rotordrop import example_machine, example_record_path
from rotordrop.cli.app import run
from rotordrop.errors import RecordError
from rotordrop.evidence.synchronous import angle_since_mark, synchronous_motion
from rotordrop.record.profile import Profile, SpeedSource
from rotordrop.record.record import read_record, record_of, save_record
from rotordrop.record.recording import Channel, Recording

RATE = 20_000.0
RADIUS, PHASE = 3.2e-6, 2.0


def circle(seed, noise=0.4e-6, seconds=0.25, speed=60.0, backward=1.0e-6):
    """A forward circle whose high spot stands `PHASE` from +y when the mark passes, and a backward one."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / RATE)
    angle = 2.0 * np.pi * speed * time + 0.7
    forward = RADIUS * np.exp(1j * (angle + PHASE + 0.5 * np.pi))
    path = forward + backward * np.exp(-1j * angle) + 5e-6 + 2e-6j
    marks = (2.0 * np.pi * np.arange(1, seconds * speed + 2) - 0.7) / (2.0 * np.pi * speed)
    position = np.column_stack([path.real, path.imag]) + rng.normal(0.0, noise, (len(time), 2))
    return time, position, marks[marks < seconds]


def test_amplitude_and_phase_are_those_of_the_circle_and_their_intervals_hold():
    covered = []
    for seed in range(60):
        found = synchronous_motion("NDE", *circle(seed), until=0.24)
        assert found is not None
        assert found.amplitude == pytest.approx(RADIUS, abs=0.1e-6)
        assert found.phase == pytest.approx(PHASE, abs=0.03)
        low, high = found.amplitude_interval_90
        early, late = found.phase_interval_90
        covered += [low <= RADIUS <= high, early <= PHASE <= late]
    assert 0.8 <= np.mean(covered) <= 0.98
    assert found.turns == 13


def test_noise_and_few_turns_have_no_phase():
    time, position, marks = circle(1)
    rng = np.random.default_rng(8)
    found = synchronous_motion("NDE", time, rng.normal(0.0, 1e-6, position.shape), marks, until=0.24)
    assert found is not None
    assert found.amplitude < 0.15e-6
    assert found.phase_interval_90[1] - found.phase_interval_90[0] > 1.0
    time, position, marks = circle(1)
    assert synchronous_motion("NDE", time, position, marks, until=0.05) is None


def with_pulses(folder, missing=False):
    """The bundled recording as text, with a keyphasor in place of its speed."""
    record = read_record(example_record_path("lp400_drop_060"), example_machine("lp400"))
    kept = record.time < 0.4
    time = record.time[kept]
    angle = 1.1 + np.concatenate([[0.0], np.cumsum(record.speed[kept][:-1] * np.diff(time))])
    volts = np.where(angle / (2.0 * np.pi) % 1.0 < 0.05, 5.0, 0.0)
    if missing:
        first = np.flatnonzero((time > 0.1) & (volts > 1.0))[0]
        volts[first - 100 : first + 100] = 0.0
    columns = [time, *(1e6 * record.signals[kept].T), volts]
    names = ["Time [s]", *(f"{name} [um]" for name in record.channel_names), "KPH [V]"]
    path = folder / "keyphasor.csv"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    return path, record, angle, time


def test_a_file_with_pulses_gives_speed_marks_and_phase(tmp_path, capsys):
    path, record, angle, time = with_pulses(tmp_path)
    rules = Profile(speed=SpeedSource(pulses="KPH"))
    machine = example_machine("lp400")
    read = read_record(path, machine, profile=rules)
    at_marks = np.interp(read.marks, time, angle) / (2.0 * np.pi)
    assert np.max(np.abs(at_marks - np.rint(at_marks))) < 60.0 / record.sampling_rate
    before = read.speed_time < 0.0
    true = np.mean(record.speed_readings[record.speed_time < 0.0])
    assert np.mean(read.speed_readings[before]) == pytest.approx(true, rel=1e-3)
    save_record(read, tmp_path / "saved.h5")
    again = read_record(tmp_path / "saved.h5", machine)
    assert np.array_equal(again.marks, read.marks)
    assert np.allclose(again.speed_readings, read.speed_readings, rtol=1e-12)
    profile = tmp_path / "recorder.toml"
    call = ["profile", str(path), "--pulses", "KPH", "-o", str(profile)]
    assert run([*call, *(f"--map={name}={name}" for name in record.channel_names)]) == 0
    capsys.readouterr()
    assert run(["look", str(path), "--profile", str(profile), "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)["synchronous"]
    assert len(found) == 2
    assert all(one["turns"] >= 10 for one in found)
    assert all(one["amplitude_interval_90_m"][0] < one["amplitude_m"] for one in found)


def test_pulses_that_are_missing_are_told_with_the_way_out(tmp_path):
    path, *_ = with_pulses(tmp_path, missing=True)
    read = read_record(path, example_machine("lp400"), profile=Profile(speed=SpeedSource(pulses="KPH")))
    assert any("pulses missing after" in warning for warning in read.warnings)
    path, *_ = with_pulses(tmp_path)
    with pytest.raises(RecordError, match=r"no channel of pulses 'Key'; it has .*KPH"):
        read_record(path, example_machine("lp400"), profile=Profile(speed=SpeedSource(pulses="Key")))
    time = np.arange(0.0, 0.1, 1e-4)
    names = ("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")
    channels = [Channel(name=n, label=n, unit="um", values=0.0 * time, time=time) for n in names]
    tacho = Channel(name="Tacho", label="Tacho", unit="V", values=0.0 * time, time=time)
    with pytest.raises(RecordError, match='pulses = "Tacho"'):
        record_of(Recording(channels=(*channels, tacho)), example_machine("lp400").sensors)


class TestAngleSinceMark:
    @pytest.mark.parametrize("slowing", [0.0, 0.004])
    def test_it_is_that_of_the_shaft(self, slowing):
        # marks of a shaft that slows evenly, each read 5 us off at random
        rng = np.random.default_rng(3)
        turns = np.arange(40.0)
        passed = turns / 60.0 * (1.0 + slowing * turns / 60.0) + rng.normal(0.0, 5e-6, 40)
        when = 39.4 / 60.0 * (1.0 + slowing * 39.4 / 60.0)
        found = angle_since_mark(passed, when)
        assert found is not None
        assert found.angle == pytest.approx(0.4 * 2.0 * np.pi, abs=4.0 * max(found.error, 1e-4))
        assert found.error < 0.01

    def test_its_error_is_that_of_the_passages(self):
        rng = np.random.default_rng(7)
        wrong, errors = [], []
        for _ in range(200):
            passed = np.arange(12.0) / 60.0 + rng.normal(0.0, 5e-5, 12)
            found = angle_since_mark(passed, 11.5 / 60.0)
            assert found is not None
            wrong.append(np.remainder(found.angle - np.pi + 0.5, 2.0 * np.pi) - 0.5)
            errors.append(found.error)
        assert np.std(wrong) == pytest.approx(np.median(errors), rel=0.25)

    def test_a_missing_pulse_is_no_missing_turn(self):
        passed = np.delete(np.arange(20.0) / 50.0, [4, 5, 11])
        found = angle_since_mark(passed, 19.25 / 50.0)
        assert found is not None
        assert found.angle == pytest.approx(0.5 * np.pi, abs=1e-9)

    def test_nothing_is_told_far_from_the_last_passage_or_of_two(self):
        passed = np.arange(20.0) / 50.0
        assert angle_since_mark(passed, 19.0 / 50.0 + 0.1) is None
        assert angle_since_mark(passed[:2], 0.03) is None

    def test_what_comes_after_is_not_asked(self):
        passed = np.arange(20.0) / 50.0
        slowed = np.concatenate([passed, passed[-1] + np.array([0.05, 0.12])])
        assert angle_since_mark(slowed, passed[-1] + 0.01) == angle_since_mark(passed, passed[-1] + 0.01)
