"""What a recorder does to a good record is found under its own name, and a good record is left alone."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from rotordrop.evidence.levitated import fit_levitated
from rotordrop.evidence.quality import check_record
from rotordrop.evidence.quality.arrangement import check_ends_named
from rotordrop.evidence.quality.continuity import check_continuity, check_orbit
from rotordrop.evidence.quality.recorder import check_blocks, check_filters
from rotordrop.evidence.quality.tail import check_rest_in_record
from rotordrop.machine import example_machine
from rotordrop.record.record import Record
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.sensor_chain import PERFECT


def filtered(signals, rate, corner, kind):
    sections = butter(2 if kind == "low" else 1, corner, btype=kind, fs=rate, output="sos")
    level = np.mean(signals[: int(0.2 * rate)], axis=0)
    return level + sosfilt(sections, signals - level, axis=0)


def first_stop(record, machine):
    return next((finding for finding in check_record(record, machine) if finding.severity == "stop"), None)


def first_warning(record, machine, tail):
    return next(iter(check_record(record, machine, tail)), None)


@pytest.mark.parametrize("corner", [50.0, 100.0, 200.0])
def test_a_low_pass_in_the_recorder(corner, whole_drop, machine):
    smooth = replace(whole_drop, signals=filtered(whole_drop.signals, 20e3, corner, "low"))
    found = first_stop(smooth, machine)
    assert found.kind == "recorder low-pass"
    assert "record without the low-pass" in found.remedy


@pytest.mark.parametrize("corner", [0.3, 1.0])
def test_ac_coupling(corner, whole_drop, machine):
    found = first_stop(
        replace(whole_drop, signals=filtered(whole_drop.signals, 20e3, corner, "high")), machine
    )
    assert found.kind == "AC coupling"
    assert "cannot rise" in found.message


@pytest.mark.parametrize("size", [0.15, 1.0, 4.0])
def test_filters_are_found_whatever_the_size_of_the_air_gap(size, whole_drop):
    """A reading at rest of less than 50 µm was not looked at: a machine with a small gap passed."""
    for kind, corner in (("AC coupling", 1.0), ("recorder low-pass", 100.0)):
        signals = size * filtered(whole_drop.signals, 20e3, corner, "high" if corner == 1.0 else "low")
        assert [finding.kind for finding in filters_of(replace(whole_drop, signals=signals))] == [kind]
    assert filters_of(replace(whole_drop, signals=size * whole_drop.signals)) == []


def filters_of(record):
    levitated = fit_levitated(record, -5e-3, speed=float(record.speed_readings[0]))
    return check_filters(record, levitated, 0.0, bounces=460.0)


@pytest.mark.parametrize("span", [2e-3, 20e-3, 50e-3])
def test_a_gap_bridged_by_a_straight_line(span, whole_drop, machine):
    signals = whole_drop.signals.copy()
    start, count = 6400, int(span * 20e3)
    line = np.linspace(signals[start, 2], signals[start + count, 2], count + 1)
    signals[start : start + count + 1, 2] = np.round(line, 9)
    found = first_stop(replace(whole_drop, signals=signals), machine)
    assert (found.kind, found.channel) == ("bridged gap", whole_drop.channel_names[2])
    assert found.time == pytest.approx(float(whole_drop.time[start]), abs=2e-4)


def test_a_second_drop(whole_drop, machine):
    once = whole_drop.window(-0.25, 0.6)
    rng = np.random.default_rng(0)
    again = once.signals + rng.normal(0.0, 0.3e-6, once.signals.shape)
    ramp = np.linspace(0.0, 1.0, 400)[:, None]
    lift = once.signals[-1] * (1 - ramp) + again[0] * ramp
    lift += rng.normal(0.0, 0.5e-6, lift.shape)
    signals = np.vstack([once.signals, lift, again])
    time = once.time[0] + np.arange(len(signals)) / 20e3
    speed = np.full(len(time), float(once.speed_readings[0]))
    changes = {"speed": speed, "speed_time": time[[0, -1]], "speed_readings": speed[:2]}
    twice = replace(once, time=time, signals=signals, **changes)
    found = first_stop(twice, machine)
    assert found.kind == "second drop"
    assert found.time == pytest.approx(0.87, abs=5e-3)


@pytest.mark.parametrize(("factor", "after", "kind"), [(0.0, -1.0, "dead speed"), (0.0, 0.0, "dead speed")])
def test_a_dead_speed(factor, after, kind, whole_drop, machine):
    dead = np.where(whole_drop.speed_time > after, factor, 1.0) * whole_drop.speed_readings
    found = first_stop(replace(whole_drop, speed_readings=dead), machine)
    assert (found.kind, found.channel) == (kind, "speed")


def test_a_negative_speed_is_told(whole_drop, tail, machine):
    found = check_record(replace(whole_drop, speed_readings=-whole_drop.speed_readings), machine, tail)
    assert "negative speed" in [finding.kind for finding in found]


def test_a_good_record_is_left_alone(whole_drop, fast_drop, tail, machine):
    assert check_record(whole_drop, machine, tail) == ()
    mine = {"recorder low-pass", "AC coupling", "bridged gap", "clipping", "second drop", "dead speed"}
    assert not mine & {finding.kind for finding in check_record(fast_drop, machine)}


def late(record, channel, delay):
    signals = record.signals.copy()
    moved = np.interp(record.time - delay, record.time, signals[:, channel])
    signals[:, channel] = np.where(record.time - delay < record.time[0], signals[:, channel], moved)
    return replace(record, signals=signals)


@pytest.mark.parametrize(("channel", "delay"), [(1, 5e-4), (2, 1e-3), (3, 2e-3)])
def test_a_late_channel(channel, delay, drop, tail, machine):
    """A delay between the channels was called a wrong gain, or nothing at all."""
    found = first_warning(late(drop, channel, delay), machine, tail)
    assert (found.kind, found.channel) == ("late channel", drop.channel_names[channel])
    if delay < 7e-4:
        assert f"{drop.channel_names[channel]} about 0.4 ms late" in found.message


def bent(records, level):
    limit = level * float(np.max(np.abs(records[0].signals)))
    return [replace(one, signals=limit * np.tanh(one.signals / limit)) for one in records]


def test_sensors_that_saturate_softly(drop, tail, machine):
    record, rest = bent((drop, tail), 1.2)
    found = first_warning(record, machine, rest)
    assert found.kind == "soft saturation"
    assert set(found.channel.split(", ")) == set(drop.channel_names)


def test_sensors_as_straight_as_calibrated_ones_do_not_saturate(drop, tail, machine):
    """At 3.2 × the largest reading they miss 3 % of it; API 670 allows 5 %."""
    record, rest = bent((drop, tail), 3.2)
    assert [one for one in check_record(record, machine, rest) if one.severity != "note"] == []


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_clock_that_is_wrong_by_two(factor, drop, machine):
    """A doubled rate puts 1X where 2X may be: only the fall, four times as fast, tells."""
    start = drop.time[0]
    changes = {
        "time": start + (drop.time - start) / factor,
        "sampling_rate": factor * drop.sampling_rate,
        "speed_time": start + (drop.speed_time - start) / factor,
    }
    found = first_stop(replace(drop, **changes), machine)
    assert found.kind == "wrong sampling rate"
    assert "so the clock is wrong" in found.message


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_speed_that_is_wrong_by_two(factor, drop, machine):
    found = first_stop(replace(drop, speed_readings=factor * drop.speed_readings), machine)
    assert (found.kind, found.channel) == ("wrong speed", "speed")
    assert "so the speed is wrong" in found.message


def test_sensors_without_noise_are_not_judged_finer_than_the_model_is(machine):
    hidden = hidden_machine(machine, 3)
    made = synthesize_drop(hidden, 2 * np.pi * 90.0, 3, sensor_chain=PERFECT, duration=0.1, tolerance=1e-6)
    kinds = {found.kind for found in check_record(made.record, machine, made.tail)}
    assert not kinds & {"late channel", "wrong gain", "soft saturation", "turned sensors"}


@pytest.mark.parametrize("gain", [0.9, 1.1])
def test_a_tenth_in_all_gains_shows_in_no_fall(gain, drop, tail, machine):
    """Less lift that remains fits as well: the record does not say it, and nothing is invented."""
    wrong = [replace(one, signals=gain * one.signals) for one in (drop, tail)]
    assert "wrong gain" not in {finding.kind for finding in check_record(*wrong[:1], machine, wrong[1])}


def test_hum_on_the_tail_is_no_exchanged_channel(whole_drop, tail, machine):
    """Mains hum moves all channels alike, at an angle to the race that looked like a crossed channel."""
    humming = tail.signals + 20e-6 * np.sin(2 * np.pi * 50.0 * tail.time)[:, None]
    kinds = {found.kind for found in check_record(whole_drop, machine, replace(tail, signals=humming))}
    assert "swapped channels" not in kinds


def test_a_single_run_of_equal_readings_is_stuck(drop, machine):
    """A recorder of many bits repeats no reading: the one run was compared with itself and passed."""
    rng = np.random.default_rng(5)
    signals = drop.signals + rng.normal(0.0, 1e-9, drop.signals.shape)
    signals[6000:6014, 2] = signals[6000, 2]
    (found,) = (
        one for one in check_record(replace(drop, signals=signals), machine) if one.kind == "stuck channel"
    )
    assert found.channel == drop.channel_names[2]
    assert "14 samples (0.7 ms)" in found.message


def worst(record, machine, tail=None):
    return next(iter(check_record(record, machine, tail)), None)


def with_signals(record, change):
    signals = record.signals.copy()
    change(signals)
    return replace(record, signals=signals)


def test_times_in_ms_taken_for_seconds_are_refused_by_name(drop, machine):
    """It ended in an IndexError: the levitated part had more stretches of a millisecond than samples."""
    slow = replace(
        drop,
        time=1e3 * drop.time,
        speed_time=1e3 * drop.speed_time,
        sampling_rate=1e-3 * drop.sampling_rate,
        metadata={},
    )
    found = worst(slow, machine)
    assert (found.kind, found.severity) == ("wrong sampling rate", "stop")
    assert "the clock gives 20 Hz over" in found.message and "make it 20000 Hz over" in found.message
    assert '[time] unit = "ms"' in found.remedy


def test_the_levitated_part_of_a_slow_clock_is_fitted(drop):
    slow = replace(drop, time=1e3 * drop.time, sampling_rate=20.0)
    assert fit_levitated(slow, -10.0, speed=2.0 * np.pi * 0.06).end <= -10.0


def test_a_clock_that_is_two_per_cent_off(drop, tail, machine):
    fast = replace(
        drop,
        time=drop.time / 1.02,
        speed_time=drop.speed_time / 1.02,
        sampling_rate=1.02 * drop.sampling_rate,
        metadata={},
    )
    found = worst(fast, machine, tail)
    assert (found.kind, found.severity) == ("wrong sampling rate", "warning")
    assert "of the speed channel, +2.0 % or more" in found.message


def test_six_samples_stuck(drop, machine):
    def hold(signals):
        signals[6000:6006, 1] = signals[6000, 1]

    found = worst(with_signals(drop, hold), machine)
    assert (found.kind, found.channel) == ("stuck channel", drop.channel_names[1])
    assert found.message.startswith("6 samples (0.3 ms)")


@pytest.mark.parametrize("count", [16, 32])
def test_neighbouring_blocks_exchanged_in_one_channel(count, drop, machine):
    """No step is larger than those of the motion: only its course shows it."""

    def exchange(signals):
        first = signals[6000 : 6000 + count, 1].copy()
        signals[6000 : 6000 + count, 1] = signals[6000 + count : 6000 + 2 * count, 1]
        signals[6000 + count : 6000 + 2 * count, 1] = first

    found = worst(with_signals(drop, exchange), machine)
    assert (found.kind, found.channel) == ("damaged block", drop.channel_names[1])
    assert found.time == pytest.approx(drop.time[6000 + count], abs=1.01 * count * 5e-5)


@pytest.mark.parametrize("every", [False, True])
def test_blocks_whose_jumps_are_small_show_by_vanishing_together(every):
    """At most 4 µm at 0.5 µm of noise: no jump by itself is beyond what the readings leave room for."""
    random = np.random.default_rng(26)
    time = np.arange(4000) / 20e3
    wave = 25e-6 * np.cos(2.0 * np.pi * 60.0 * time[:, None] + np.arange(4))
    clean = wave + 0.5e-6 * random.standard_normal((4000, 4))
    sensors = example_machine("lp400").sensors
    record = Record(time=time, signals=clean, sensors=sensors, sampling_rate=20e3)
    assert not check_blocks(record)
    torn = clean.copy()
    which = slice(None) if every else [2]
    torn[2000:2016, which] = np.roll(clean[2000:2016], 8, axis=0)[:, which]
    (found,) = check_blocks(replace(record, signals=torn))
    assert (found.kind, found.severity) == ("damaged block", "warning")
    assert found.channel == (None if every else sensors[2].name)
    assert found.time == pytest.approx(0.1, abs=1.01 / 20e3)
    assert "the 8 samples from here on change places with the 8 after them" in found.message


def test_twenty_lost_samples_under_a_running_clock(fast_drop, machine):
    at = int(np.searchsorted(fast_drop.time, 0.05))
    keep = np.delete(np.arange(len(fast_drop.time)), np.arange(at, at + 20))
    count = len(keep)
    cut = replace(
        fast_drop,
        time=fast_drop.time[:count],
        signals=fast_drop.signals[keep],
        speed=fast_drop.speed[:count],
    )
    found = worst(cut, machine)
    assert (found.kind, found.time) == ("dropped block", pytest.approx(0.05, abs=2e-3))


def test_drift_is_no_noise(drop, tail, machine):
    def wander(signals):
        signals[:, 0] += 300e-6 * np.linspace(0.0, 1.0, len(signals))

    found = worst(with_signals(drop, wander), machine, tail)
    assert (found.kind, found.channel) == ("drift", drop.channel_names[0])


def test_hum_that_hides_the_drop_is_no_missing_pre_trigger(drop, machine):
    wave = 100e-6 * np.sin(2.0 * np.pi * 60.0 * drop.time)[:, None]
    found = worst(replace(drop, signals=drop.signals + wave), machine)
    assert (found.kind, found.severity) == ("hum", "stop")
    assert "mains hum of 60 Hz" in found.message


def without(record, at, count):
    """The record with samples lost at a time under a clock that runs on."""
    first, left = int(np.searchsorted(record.time, at)), len(record.time) - count
    signals = np.delete(record.signals, np.s_[first : first + count], axis=0)
    return replace(record, time=record.time[:left], signals=signals, speed=record.speed[:left])


def levitated(record):
    return fit_levitated(record, -0.02, speed=float(record.speed_readings[0]))


@pytest.mark.parametrize("count", [2, 5])
def test_lost_samples_in_the_fall(count, drop):
    assert check_continuity(drop) == []
    (found,) = check_continuity(without(drop, 5e-3, count))
    assert (found.kind, found.severity) == ("dropped block", "stop")
    assert found.time == pytest.approx(5e-3, abs=1.1e-3)
    missing = float(re.search(r"what they do in ([\d.]+) samples", found.message)[1])
    assert missing == pytest.approx(count, abs=0.5)


def test_samples_lost_before_the_drop_turn_the_orbit(fast_drop):
    assert check_orbit(levitated(fast_drop), fast_drop) == []
    cut = without(fast_drop, -0.12, 20)
    (found,) = check_orbit(levitated(cut), cut)
    assert (found.kind, found.severity) == ("dropped block", "warning")
    assert found.time == pytest.approx(-0.12, abs=0.02)
    ahead = 360.0 * 20 / fast_drop.sampling_rate * levitated(fast_drop).frequency
    seen = float(re.search(r"jumps by about ([+-][\d.]+)°", found.message)[1])
    assert seen == pytest.approx(ahead, rel=0.2)


def test_readings_taken_early_and_late_under_an_even_clock(drop):
    random = np.random.default_rng(26)
    when = drop.time + 0.3 / drop.sampling_rate * random.normal(0.0, 1.0, len(drop.time))
    signals = np.column_stack([np.interp(when, drop.time, column) for column in drop.signals.T])
    (found,) = check_continuity(replace(drop, signals=signals))
    assert (found.kind, found.severity) == ("jittered clock", "warning")
    early = float(re.search(r"\((\d+) % of an interval", found.message)[1])
    assert early == pytest.approx(30.0, abs=10.0)


def test_a_tail_whose_zero_moved_rests_beside_the_path_of_the_rotor(whole_drop, tail, machine):
    floating = levitated(whole_drop).mean
    assert check_rest_in_record(tail, whole_drop, machine, floating, sag=1e-6) == []
    moved = replace(tail, signals=tail.signals + 40e-6 * np.eye(4)[2])
    (found,) = check_rest_in_record(moved, whole_drop, machine, floating, sag=1e-6)
    assert (found.kind, found.severity) == ("tail offset", "warning")
    off = float(re.search(r"rests ([\d.]+) µm higher at node 25", found.message)[1])
    assert off == pytest.approx(40.0 / np.sqrt(2.0), abs=3.0)
    assert found.channel == ", ".join(whole_drop.channel_names[2:])


def test_magnetic_bearings_at_the_nodes_of_each_other(machine):
    assert check_ends_named(machine) == []
    first, second = machine.ambs
    exchanged = machine.changed(ambs=(first.changed(node=second.node), second.changed(node=first.node)))
    (found,) = check_ends_named(exchanged)
    assert (found.kind, found.severity) == ("machine file", "warning")
    assert f"AMB {first.name} at node {second.node} next to touchdown bearing {second.name}" in found.message
