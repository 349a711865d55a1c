"""Shaft speed: readings in a held signal, speed at the drop, smoothing; pulses of a tacho."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.measured_speed import speed_at_drop
from rotordrop.record.tacho import passages, readings_of_held_signal

HZ = 2 * np.pi


@pytest.mark.parametrize("fourth", [59.8, 60.1])
def test_readings_are_found_in_a_held_signal_equal_ones_too(fourth):
    readings = [60.0, 59.9, 60.1, fourth, 59.7]
    values = np.repeat(readings, [37, 200, 200, 200, 200])
    when, what = readings_of_held_signal(np.arange(len(values)) * 5e-5, values)
    np.testing.assert_array_equal(what, readings)
    np.testing.assert_allclose(when[1:], (37 + 200 * np.arange(4)) * 5e-5)


def test_a_continuous_signal_comes_back_as_it_is():
    time = np.arange(500) * 1e-3
    values = 60.0 * np.exp(-time / 6.0)
    when, what = readings_of_held_signal(time, values)
    np.testing.assert_array_equal(what, values)
    np.testing.assert_array_equal(when, time)


def slowing(drop, outliers=()):
    """Readings every 10 ms: 60 Hz before the drop, then exponential fall, with noise of 0.02 Hz."""
    time = np.arange(-0.25, 2.0, 0.01)
    hertz = 60.0 * np.exp(-np.maximum(time - 0.003, 0.0) / 9.0)
    hertz = hertz + 0.02 * np.random.default_rng(3).normal(size=len(time))
    hertz[list(outliers)] *= 2.0
    return replace(drop, speed_time=time, speed_readings=HZ * hertz)


@pytest.mark.parametrize("outliers", [(), (10, 30)])
def test_speed_at_the_drop(drop, outliers):
    found = speed_at_drop(slowing(drop, outliers), 0.003)
    assert found.value == pytest.approx(60.0 * HZ, abs=4 * found.standard_error)
    assert found.standard_error < 0.01 * HZ


def test_a_speed_must_be_there_near_the_drop(whole_drop, drop):
    found = speed_at_drop(whole_drop, -0.00025)
    assert found.value == pytest.approx(60.0 * HZ, rel=3e-4)
    with pytest.raises(RecordError, match=r"0 speed readings within 0.5 s of the drop at 9 s"):
        speed_at_drop(drop, 9.0)


RATE = 20_000.0


def pulses(angle, per_turn=1, width=0.06, uneven=0.0):
    """High for a share of every mark's pitch, beginning where the angle is a whole number of pitches."""
    turn = angle / (2.0 * np.pi) * per_turn
    shift = uneven * np.sin(2.0 * np.pi * np.floor(turn) / per_turn)
    return np.where((turn - shift) % 1.0 < width, 4.8, 0.2)


def shaft(seconds=1.0, start=60.0, end=55.0, rate=RATE, phase=1.0):
    time = np.arange(round(seconds * rate)) / rate
    slope = 2.0 * np.pi * (end - start) / seconds
    return (
        time,
        phase + 2.0 * np.pi * start * time + 0.5 * slope * time**2,
        2.0 * np.pi * start + slope * time,
    )


@pytest.mark.parametrize(("start", "end"), [(60.0, 55.0), (550.0, 500.0), (10.0, 4.0)])
@pytest.mark.parametrize("rate", [10_000.0, 100_000.0])
def test_the_speed_is_that_of_the_shaft_over_each_turn(start, end, rate):
    time, angle, speed = shaft(2.0, start, end, rate)
    found = passages(time, pulses(angle, width=0.2))
    true = np.interp(found.time, time, speed)
    assert np.max(np.abs(found.speed / true - 1.0)) < 2.5e-3
    assert abs(np.mean(found.speed / true) - 1.0) < 1e-4


def test_marks_are_whole_turns_whatever_edge_noise_or_spacing():
    time, angle, _ = shaft()
    found = passages(time, pulses(angle))
    at_marks = np.interp(found.marks, time, angle) / (2.0 * np.pi)
    off = np.abs(at_marks - np.rint(at_marks))
    assert np.max(off) < 60.0 / RATE
    assert len(found.marks) == len(np.unique(np.rint(at_marks)))
    time, angle, speed = shaft(1.0, 60.0, 60.0)
    found = passages(time, pulses(angle, per_turn=8, width=0.4, uneven=0.2), per_turn=8)
    assert np.max(np.abs(found.speed / speed[0] - 1.0)) < 1.5 * 60.0 / RATE
    assert found.marks.size == 0
    time, angle, _ = shaft(0.5, 60.0, 60.0)
    rising = passages(time, pulses(angle, width=0.25))
    falling = passages(time, pulses(angle, width=0.25), edge="falling")
    later = falling.marks[falling.marks > rising.marks[0]][0] - rising.marks[0]
    assert later == pytest.approx(0.25 / 60.0, abs=1.0 / RATE)
    time, angle, speed = shaft()
    values = pulses(angle) + np.random.default_rng(3).normal(0.0, 0.1, len(time)) + 0.8 * np.sin(314.0 * time)
    found = passages(time, values)
    assert found.warnings == ()
    assert np.max(np.abs(found.speed / np.interp(found.time, time, speed) - 1.0)) < 0.01


def test_missing_and_spare_pulses_are_said():
    time, angle, speed = shaft()
    values = pulses(angle)
    whole = passages(time, values)
    gone = values.copy()
    k = np.searchsorted(time, whole.marks[20])
    gone[k - 20 : k + 40] = 0.2
    found = passages(time, gone)
    assert f"1 pulses missing after {whole.marks[19]:.4g} s" in found.warnings[0]
    assert np.min(found.speed) > 0.9 * speed[-1]
    assert len(found.marks) == len(whole.marks) - 1
    values = pulses(angle)
    k = np.searchsorted(time, passages(time, values).marks[20]) + 150
    values[k : k + 8] = 4.8
    found = passages(time, values)
    assert "1 pulses too many" in found.warnings[0]
    assert np.max(found.speed) < 1.05 * speed[0]


REFUSED = {
    "constant": (lambda angle: np.zeros(len(angle)), 1, "0 pulses"),
    "two pulses": (lambda angle: pulses(np.minimum(angle, 4.0 * np.pi + 1.0)), 1, "pulses; a speed needs"),
    "random": (lambda angle: np.random.default_rng(1).normal(size=len(angle)), 1, "do not fit|too few"),
    "wrong number": (lambda angle: pulses(angle, per_turn=200, width=0.5), 200, "too few for 200 pulses"),
}


@pytest.mark.parametrize(("signal", "per_turn", "told"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_row_of_pulses_is_refused(signal, per_turn, told):
    time, angle, _ = shaft()
    with pytest.raises(RecordError, match=told):
        passages(time, signal(angle), per_turn=per_turn)
