"""The gate: every fault is named with channel, time and remedy, and a sound record passes without a word."""

import re
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.events import Beginning, beginning_of, find_fall
from rotordrop.evidence.evidence import Evidence
from rotordrop.evidence.free_rotor import free_rotor
from rotordrop.evidence.levitated import fit_levitated
from rotordrop.evidence.quality import (
    NO_CHECK_SEES,
    Finding,
    Kind,
    check_record,
    gate,
    not_seen,
    refuse_unusable,
    standing,
)
from rotordrop.evidence.quality import fall as quality_fall
from rotordrop.evidence.quality.arrangement import check_planes
from rotordrop.evidence.quality.fall import fell_as_described
from rotordrop.evidence.quality.motion import check_rotation_line, check_units, first_motion
from rotordrop.evidence.quality.recorder import check_clock
from rotordrop.known import Known
from rotordrop.record.axes import sensor_planes
from rotordrop_bench import hidden_machine, synthesize_drop

HZ = 2 * np.pi


def findings(record, machine, tail=None, kind=None):
    return [found for found in check_record(record, machine, tail) if kind is None or found.kind == kind]


def only(record, machine, tail=None, *, severity="stop", without=""):
    """The one finding of this severity, but for those of another kind."""
    found = [
        one for one in check_record(record, machine, tail) if one.severity == severity and one.kind != without
    ]
    assert len(found) == 1, [str(one) for one in found]
    return found[0]


def scaled(edited, record, factor, channels=slice(None)):
    def change(signals):
        signals[:, channels] *= factor

    return edited(record, change)


def reordered(edited, record, order):
    return edited(record, lambda signals: signals[:, order].copy())


def test_a_sound_record_passes_without_a_word(whole_drop, tail, machine):
    assert check_record(whole_drop, machine, tail) == ()


def test_another_sound_record_only_lacks_length_and_standstill(fast_drop, machine):
    kinds = {(found.kind, found.severity) for found in check_record(fast_drop, machine)}
    assert kinds == {("short record", "warning"), ("record ends before standstill", "warning")}


def test_a_record_that_ends_before_standstill_wants_a_tail(whole_drop, machine):
    found = only(whole_drop, machine, severity="warning")
    assert found.kind == "record ends before standstill"
    assert "47.7 Hz (2860 rpm) at 2 s" in found.message
    assert "settled tail" in found.remedy
    assert found.time == pytest.approx(2.0)


def _block_exchanged(signals):
    """Two blocks of eight samples of a channel while the rotor floats."""
    signals[1000:1016, 1] = np.roll(signals[1000:1016, 1].copy(), 8)


UNSEEN_FAULTS = {
    "in the tail ends exchanged": lambda edited, drop, tail: (drop, reordered(edited, tail, [2, 3, 0, 1])),
    ", axes exchanged": lambda edited, drop, tail: (drop, reordered(edited, tail, [1, 0, 3, 2])),
    "all gains off by 20 %": lambda edited, drop, tail: (
        scaled(edited, drop, 1.2),
        scaled(edited, tail, 1.2),
    ),
    "blocks exchanged": lambda edited, drop, tail: (edited(drop, _block_exchanged), tail),
}


@pytest.mark.parametrize("words", UNSEEN_FAULTS)
def test_what_the_gate_cannot_see_of_this_record_is_said_and_passes_it(
    words, whole_drop, tail, machine, edited
):
    spoiled, other = UNSEEN_FAULTS[words](edited, whole_drop, tail)
    assert check_record(spoiled, machine, other) == ()
    said = not_seen(Evidence(record=spoiled, machine=machine, tail=other))
    assert said.startswith(NO_CHECK_SEES) and words in said
    assert len(said) <= 185  # two lines of a terminal, so that the first screen of an estimate keeps it


def test_what_the_gate_sees_of_this_record_is_not_said_to_pass(whole_drop, tail, machine, edited):
    def moved(signals):
        signals[:, 0] += 4e-5

    assert "zeros off" not in not_seen(Evidence(record=whole_drop, machine=machine, tail=tail))
    assert only(whole_drop, machine, edited(tail, moved), severity="warning").kind == "tail offset"
    assert "tail" not in not_seen(Evidence(record=whole_drop, machine=machine))


def test_what_a_stopped_gate_did_not_ask_is_said_to_pass(whole_drop, machine, edited):
    """Without a speed no check looks at wiring; the sentence named neither ends nor axes."""
    slow = replace(whole_drop, speed_time=None, speed_readings=None)
    passed = gate(Evidence(record=slow, machine=machine))
    said = not_seen(Evidence(record=slow, machine=machine), passed=passed)
    assert "as the checks end with 'speed missing', axes exchanged or reversed, ends exchanged" in said
    turned = reordered(edited, slow, [1, 0, 3, 2])
    assert [one.kind for one in gate(Evidence(record=turned, machine=machine)).findings] == ["speed missing"]
    whole = Evidence(record=whole_drop, machine=machine)
    assert not_seen(whole, passed=gate(whole)) == not_seen(whole)


class TestSingleChannels:
    def test_missing_samples(self, drop, machine, edited):
        def change(signals):
            signals[5200, 2] = np.nan
            signals[5300, 2] = np.inf

        found = only(edited(drop, change), machine)
        assert (found.kind, found.channel) == ("missing samples", "S_DE_A")
        assert found.time == pytest.approx(0.01)
        assert "2 of 11001 samples are NaN or infinite, the first at 0.01 s" in found.message

    @pytest.mark.parametrize("value", [7.5e229, 1e-208, -1e-310], ids=str)
    def test_bytes_that_are_no_reading(self, drop, machine, edited, value):
        """Exchanged or zeroed bytes of a file read as numbers that no sensor gives; they went unnoticed."""

        def change(signals):
            signals[5200, 2] = value

        found = only(edited(drop, change), machine)
        assert (found.kind, found.channel) == ("damaged block", "S_DE_A")
        assert "1 of 11001 samples are no readings, the first," in found.message
        assert "at 0.01 s: bytes of the file have changed" in found.message

    def test_clipping(self, drop, machine, edited):
        found = check_record(edited(drop, lambda signals: np.clip(signals, -220e-6, None)), machine)
        assert {one.kind for one in found if one.severity == "stop"} == {"clipping"}
        assert {one.channel for one in found} >= {"S_NDE_B", "S_DE_B"}
        assert "stays at its lower limit -220 µm for up to" in found[0].message

    def test_a_dead_channel(self, drop, machine, edited):
        def change(signals):
            signals[:, 1] = 3e-6 + 1e-7 * np.random.default_rng(1).normal(size=len(signals))

        found = only(edited(drop, change), machine)
        assert (found.kind, found.channel) == ("dead channel", "S_NDE_B")
        assert "around 3.0" in found.message

    def test_a_constant_channel_is_dead_too(self, drop, machine, edited):
        def change(signals):
            signals[:, 3] = 0.0

        found = only(edited(drop, change), machine)
        assert (found.kind, found.channel) == ("dead channel", "S_DE_B")
        assert "moves by 0 m around 0 m" in found.message

    def test_a_stuck_channel(self, drop, machine, edited):
        def change(signals):
            signals[6000:6500, 0] = signals[6000, 0]

        found = only(edited(drop, change), machine)
        assert (found.kind, found.channel) == ("stuck channel", "S_NDE_A")
        assert found.time == pytest.approx(0.05)
        assert "(25 ms) read exactly" in found.message

    def test_a_short_hold_is_stuck_too_and_gone_on_without(self, drop, tail, machine, edited):
        def change(signals):
            signals[6000:6012, 0] = signals[6000, 0]

        found = only(edited(drop, change), machine, tail, severity="warning")
        assert (found.kind, found.channel) == ("stuck channel", "S_NDE_A")
        assert "12 samples (0.6 ms)" in found.message
        assert "the tracked twin goes on without these samples" in found.remedy

    def test_a_hold_of_all_channels_is_no_dropped_block(self, drop, tail, machine, edited):
        """2 ms were refused as a record to be made again, which a drop that happened cannot be."""

        def change(signals):
            signals[6000:6040] = signals[6000]

        found = check_record(edited(drop, change), machine, tail)
        assert not [one for one in found if one.severity == "stop"]
        held = [one for one in found if one.kind == "stuck channel"]
        assert [one.channel for one in held] == list(drop.channel_names)

    def test_what_is_damaged_is_marked_sample_by_sample(self, drop, machine, edited):
        def change(signals):
            signals[6000:6040] = signals[6000]
            signals[9000, 2] += 60e-6

        bad = Evidence(record=edited(drop, change), machine=machine).damaged
        assert np.flatnonzero(bad.all(axis=1)).tolist() == list(range(6001, 6040))
        assert np.argwhere(bad[6040:]).tolist() == [[9000 - 6040, 2]]
        assert not Evidence(record=drop, machine=machine).damaged.any()

    def test_a_damaged_block(self, drop, tail, machine, edited):
        def change(signals):
            signals[9000:9006, 3] = 0.0

        found = only(edited(drop, change), machine, tail, severity="warning")
        assert (found.kind, found.channel) == ("spikes", "S_DE_B")
        assert "2 steps of up to" in found.message

    def test_spikes(self, drop, tail, machine, edited):
        def change(signals):
            signals[9000, 2] += 60e-6

        found = only(edited(drop, change), machine, tail, severity="warning")
        assert (found.kind, found.channel) == ("spikes", "S_DE_A")
        assert found.time == pytest.approx(0.2)
        assert "1 single samples stand out by up to" in found.message

    def test_coarse_quantisation_is_no_clipping(self, drop, machine, edited):
        found = check_record(edited(drop, lambda signals: np.round(signals / 2e-6) * 2e-6), machine)
        assert {one.kind for one in found if one.channel} == {"coarse quantisation"}
        assert "steps of 2.00 µm" in found[0].message

    def test_hum(self, drop, tail, machine):
        loud = replace(drop, signals=drop.signals + 6e-6 * np.cos(HZ * 50 * drop.time)[:, None])
        found = findings(loud, machine, tail, "hum")
        assert [one.channel for one in found] == list(drop.channel_names)
        assert all("50 Hz with 6." in one.message or "50 Hz with 5." in one.message for one in found)

    def test_hum_above_the_line_of_the_rotor_is_no_wrong_speed(self, drop, machine):
        loud = replace(drop, signals=drop.signals + 25e-6 * np.cos(HZ * 50 * drop.time)[:, None])
        stops = {one.kind for one in check_record(loud, machine) if one.severity == "stop"}
        assert not stops & {"wrong speed", "wrong sampling rate", "wrong speed unit"}
        assert len(findings(loud, machine, None, "hum")) == len(drop.channel_names)

    def test_steps_of_a_coarse_converter_are_no_spikes(self, drop, machine, edited):
        found = check_record(edited(drop, lambda signals: np.round(signals / 7e-6) * 7e-6), machine)
        assert "coarse quantisation" in {one.kind for one in found}
        assert "spikes" not in {one.kind for one in found}

    def test_noise(self, drop, tail, machine):
        rng = np.random.default_rng(2)
        noisy = drop.signals.copy()
        noisy[:, 1] += 5e-6 * rng.normal(size=len(noisy))
        found = findings(replace(drop, signals=noisy), machine, tail, "noise")
        assert [one.channel for one in found] == ["S_NDE_B"]


class TestClock:
    def test_backward(self, drop, machine):
        time = drop.time.copy()
        time[5000] = time[4990]
        found = only(replace(drop, time=time), machine)
        assert found.kind == "non-monotonic time"
        assert "sample 5001 is at -0.0005 s after sample 5000 at -5e-05 s" in found.message

    def test_repeated(self, drop, machine):
        time = drop.time.copy()
        time[100] = time[99]
        assert only(replace(drop, time=time), machine).kind == "non-monotonic time"

    def test_a_gap_in_the_clock(self, drop, machine):
        keep = np.r_[0:5600, 5660 : len(drop.time)]
        cut = replace(drop, time=drop.time[keep], signals=drop.signals[keep], speed=drop.speed[keep])
        found = only(cut, machine)
        assert (found.kind, found.time) == ("dropped block", pytest.approx(0.02995))
        assert "60 samples are missing after 0.02995 s" in found.message

    def test_a_gap_the_clock_hides(self, drop, machine):
        keep = np.r_[0:5600, 5660 : len(drop.time)]
        count = len(keep)
        cut = replace(drop, time=drop.time[:count], signals=drop.signals[keep], speed=drop.speed[:count])
        found = only(cut, machine)
        assert (found.kind, found.time) == ("dropped block", pytest.approx(0.02995))
        assert "1 jump(s) of most channels at once" in found.message

    def test_a_block_that_is_there_twice(self, drop, machine):
        keep = np.r_[0:5600, 5500 : len(drop.time) - 100]
        found = only(replace(drop, signals=drop.signals[keep]), machine)
        assert (found.kind, found.time) == ("duplicate block", pytest.approx(0.03))
        assert "100 samples from 0.03 s on repeat those from 0.025 s" in found.message

    def test_jitter(self, drop):
        jitter = 4e-6 * np.random.default_rng(0).normal(size=len(drop.time))
        found = check_clock(replace(drop, time=drop.time + jitter))
        assert [one.kind for one in found] == ["jittered clock"]
        assert "µs scatters by 11" in found[0].message

    def test_a_clock_that_scatters_everywhere_drops_no_block(self, drop):
        late = 0.4 * 5e-5 * np.random.default_rng(0).uniform(-1.0, 1.0, len(drop.time))
        assert [one.kind for one in check_clock(replace(drop, time=drop.time + late))] == ["jittered clock"]

    def test_a_rate_that_contradicts_the_header(self, drop):
        found = check_clock(replace(drop, metadata={"fs [Hz]": "25000"}))
        assert [one.kind for one in found] == ["wrong sampling rate"]
        assert "header says 25000 Hz, the time column 20000 Hz" in found[0].message

    @pytest.mark.parametrize("rate", [float("nan"), 0.0, float("inf")])
    def test_a_rate_that_is_none(self, drop, machine, rate):
        found = check_record(replace(drop, sampling_rate=rate), machine)
        assert [finding.kind for finding in found] == ["wrong sampling rate"]
        assert f"the sampling rate is {rate:g} Hz" in found[0].message

    def test_slow_sampling(self, drop):
        slow = replace(drop, time=drop.time * 20, sampling_rate=1000.0)
        assert [one.kind for one in check_clock(slow)] == ["slow sampling"]
        assert check_clock(slow, drop=False) == []

    def test_a_rate_that_contradicts_the_speed(self, drop, machine):
        slow = replace(drop, time=drop.time * 2, sampling_rate=10000.0, speed_time=drop.speed_time * 2)
        found = only(slow, machine)
        assert found.kind == "wrong sampling rate"
        assert "a factor 0.49" in found.message or "a factor 0.50" in found.message
        assert "at 60 Hz by the speed channel" in found.message


def test_the_fall_has_begun_when_half_of_the_channels_went_a_quarter_of_their_way(drop):
    """Whatever units and polarities: one channel in volts, one inverted, one dead, one late."""
    way = np.clip((np.arange(len(drop.time)) - 1000) / 800.0, 0.0, 1.0)
    late = np.clip((np.arange(len(drop.time)) - 1400) / 800.0, 0.0, 1.0)
    signals = np.column_stack([0.3 + 5.0 * way, -2e-4 * way, np.zeros_like(way), 1e-4 * late])
    sample, level = first_motion(replace(drop, signals=signals))
    assert level == pytest.approx([0.3, 0.0, 0.0, 0.0])
    assert sample == 1401  # the median of four lies between the second and the third: 0 and a half of its way


class TestSpeed:
    def test_missing(self, drop, machine):
        silent = replace(drop, speed=None, speed_time=None, speed_readings=None)
        found = only(silent, machine)
        assert found.kind == "speed missing"
        assert '[speed] constant = "60 Hz"' in found.remedy

    def test_rpm_taken_for_hertz(self, drop, machine):
        wrong = replace(drop, speed=60 * drop.speed, speed_readings=60 * drop.speed_readings)
        found = only(wrong, machine)
        assert found.kind == "wrong speed unit"
        assert "3600 Hz by the speed channel" in found.message
        assert "rpm taken for Hz" in found.message

    def test_hertz_taken_for_rpm(self, drop, machine):
        slow = replace(drop, speed=drop.speed / 60.0, speed_readings=drop.speed_readings / 60.0)
        found = only(slow, machine)
        assert found.kind == "wrong speed unit"
        assert "at 1 Hz by the speed channel" in found.message and "Hz taken for rpm" in found.message

    def test_the_direction_of_rotation_is_no_fault(self, drop):
        for way in (-1.0, 1.0):
            assert check_rotation_line(drop, -0.01, way * 60.0 * HZ) == []
            (found,) = check_rotation_line(drop, -0.01, way * 3600.0 * HZ)
            assert "rpm taken for Hz" in found.message

    @pytest.mark.parametrize(("size", "seen"), [(0.0, False), (0.6, True), (3.0, True)])
    def test_a_line_counts_from_50_times_the_power_beside_it(self, drop, size, seen):
        """Amplitude against the noise; 0.24 s at 20 kHz gather 800 times the square of it in one line."""
        dice = np.random.default_rng(3)
        line = size * np.cos(60.0 * HZ * drop.time)[:, None]
        levitated = replace(drop, signals=1e-6 * (dice.standard_normal(drop.signals.shape) + line))
        assert [one.kind for one in check_rotation_line(levitated, -0.01, 41.0 * HZ)] == (
            ["wrong sampling rate"] if seen else []
        )

    def test_double_pulses(self, drop, tail, machine):
        readings = drop.speed_readings.copy()
        readings[30] *= 2
        found = only(replace(drop, speed_readings=readings), machine, tail, severity="warning")
        assert found.kind == "speed readings"
        assert "1 readings jump, the first to 1" in found.message

    def test_readings_that_are_not_finite(self, drop, machine):
        readings = drop.speed_readings.copy()
        readings[7] = np.nan
        assert (
            only(replace(drop, speed_readings=readings), machine).message == "1 speed readings are not finite"
        )


class TestUnits:
    @pytest.mark.parametrize(
        ("factor", "words"),
        [
            (1e3, "unit factor of 1000"),
            (1e-3, "unit factor of 0.001"),
            (25.4, "mil and µm mixed up"),
            (1 / 25.4, "mil and µm"),
        ],
    )
    def test_wrong_in_all_channels(self, factor, words, drop, machine, edited):
        found = only(scaled(edited, drop, factor), machine)
        assert found.kind == "wrong unit factor"
        assert found.channel == "S_NDE_A, S_NDE_B, S_DE_A, S_DE_B"
        assert words in found.message

    def test_wrong_in_one_channel(self, drop, machine, edited):
        found = only(scaled(edited, drop, 1 / 25.4, 2), machine)
        assert (found.kind, found.channel) == ("wrong unit factor", "S_DE_A")

    def test_a_gain_of_two_shows_in_the_fall(self, drop, tail, machine, edited):
        found = only(scaled(edited, drop, 2.0, 2), machine, tail, severity="warning")
        assert (found.kind, found.channel) == ("wrong gain", "S_DE_A")
        assert "S_DE_A reading about 1.6 × what it should" in found.message

    def test_a_gain_within_the_tolerance_of_sensors_is_not_named(self, drop, machine, monkeypatch):
        """A score test of small noise sees a gain of a few per cent, which any sensor may have."""
        for size, named in ((0.03, 0), (-0.04, 0), (0.3, 1)):

            def gained(fault, *_, size=size):
                return (1e4, size) if fault.kind == "wrong gain" and len(fault.channels) == 1 else (0.0, 0.0)

            monkeypatch.setattr(quality_fall, "_gain", gained)
            assert len(findings(drop, machine, kind="wrong gain")) == named

    def test_a_tail_without_its_level_is_coupled_and_not_in_another_unit(self, drop, tail, machine, edited):
        level = np.mean(drop.signals[drop.time < -0.02], axis=0)
        found = check_record(
            drop, machine, edited(tail, lambda signals: signals - np.mean(signals, axis=0) + level)
        )
        assert [(one.kind, one.severity) for one in found] == [("AC coupling", "stop")]
        small = edited(tail, lambda signals: 0.02 * (signals - level) + level)
        assert {one.kind for one in check_record(drop, machine, small)} == {"wrong unit factor"}

    def test_a_tail_in_another_unit(self, drop, tail, machine, edited):
        found = check_record(drop, machine, scaled(edited, tail, 2.0))
        assert [one.kind for one in found] == ["wrong unit factor", "wrong unit factor"]
        assert (
            "tail: the rotor rests 565 µm from its levitated position, 2.26 × the nominal air gap"
            in found[0].message
        )


class TestArrangement:
    @pytest.mark.parametrize("channel", range(4))
    def test_one_inverted_sensor(self, channel, drop, machine, edited):
        found = only(scaled(edited, drop, -1.0, channel), machine)
        name = drop.channel_names[channel]
        assert (found.kind, found.channel) == ("inverted polarity", name)
        assert f"it fits with {name} inverted" in found.message

    def test_all_inverted(self, drop, machine, edited):
        found = check_record(scaled(edited, drop, -1.0), machine)
        assert [one.kind for one in found] == ["inverted polarity"] * 2
        assert [one.channel for one in found] == ["S_NDE_A, S_NDE_B", "S_DE_A, S_DE_B"]

    def test_axes_swapped_in_one_plane(self, drop, fast_drop, machine, edited):
        for record in (drop, fast_drop):
            found = only(reordered(edited, record, [1, 0, 2, 3]), machine)
            assert (found.kind, found.channel) == ("swapped axes", "S_NDE_A, S_NDE_B")
            assert (
                "orbit at NDE runs against the spin; it fits with S_NDE_A and S_NDE_B exchanged"
                in found.message
            )

    def test_axes_swapped_in_all_planes_may_be_the_spin(self, drop, machine, edited):
        found = only(reordered(edited, drop, [1, 0, 3, 2]), machine)
        assert found.kind == "swapped axes"
        assert "either the shaft turns clockwise" in found.remedy

    def test_sensors_turned_by_a_quarter(self, drop, machine, edited):
        """The fall alone cannot tell this from one inverted sensor; the sense of the orbit does."""

        def change(signals):
            return np.column_stack([-signals[:, 1], signals[:, 0], signals[:, 2], signals[:, 3]])

        found = only(edited(drop, change), machine)
        assert found.kind == "swapped axes"
        assert "S_NDE_A and S_NDE_B exchanged, S_NDE_A inverted" in found.message or (
            "S_NDE_A and S_NDE_B exchanged, S_NDE_B inverted" in found.message
        )

    def test_sensors_at_other_angles_than_described(self, drop, machine, edited):
        """Turned by 45°: no exchange explains it, and the rotor falls aside before it touches anything."""

        def change(signals):
            c, s = np.cos(np.radians(45.0)), np.sin(np.radians(45.0))
            a, b = signals[:, 0], signals[:, 1]
            return np.column_stack([c * a + s * b, c * b - s * a, signals[:, 2], signals[:, 3]])

        found = only(edited(drop, change), machine)
        assert (found.kind, found.severity) == ("leaning fall", "stop")
        assert "leans 38° from straight down; no exchange or inversion explains it" in found.message
        aside = only(
            edited(drop, change), machine, severity="warning", without="record ends before standstill"
        )
        assert (aside.kind, aside.channel) == ("turned sensors", "S_NDE_A, S_NDE_B")
        assert re.search(r"S_NDE_A and S_NDE_B turned by about [+-](3\d|4\d)°", aside.message)

    def test_a_fall_that_strong_friction_turns_aside_is_no_wiring_fault(self, machine):
        """Friction 0.28 at 200 Hz was refused as swapped axes: the most dangerous drops got no number."""
        rough = {f"{name}.friction.{kind}": 0.28 for name in ("NDE", "DE") for kind in ("dynamic", "static")}
        hidden = hidden_machine(machine.with_values(rough), 1, drawn=False)
        made = synthesize_drop(hidden, 200.0 * HZ, 1, duration=0.1, name="rough")
        found = check_record(made.record, machine, made.tail)
        assert "stop" not in {one.severity for one in found}
        assert any("leans" in one.message and one.severity == "note" for one in found)

    def test_a_lean_that_an_exchange_explains_is_none_after_a_fall_as_described(self, drop):
        """Friction of 0.12 drove the DE up the side of a rotor of 400 kg: refused as swapped axes."""
        planes = sensor_planes(drop.sensors)
        aside = np.array([-20.0, -20.0, -32.5, 12.7]) * 1e-6
        forward = 5e-6 * np.exp(-1j * np.array([float(sensor.angle) for sensor in drop.sensors]))
        (wired,) = check_planes(planes, aside, forward)
        assert (wired.kind, wired.severity) == ("swapped axes", "stop")
        (driven,) = check_planes(planes, aside, forward, fell_straight=True)
        assert (driven.kind, driven.severity) == ("leaning fall", "warning")
        assert "leans 66° from straight down, but before the first contact the rotor falls" in driven.message
        # an orbit against the spin is no matter of the fall
        backward = check_planes(planes, aside, forward.conj(), fell_straight=True)
        assert {one.severity for one in backward} == {"stop"}

    @pytest.mark.parametrize(
        ("signs", "order", "told"),
        [
            ((1, 1, 1, 1), (0, 1, 2, 3), True),
            ((1, 1, -1, 1), (0, 1, 3, 2), False),
            ((1, 1, -1, 1), (0, 1, 2, 3), False),
            ((1, 1, -1, -1), (0, 1, 2, 3), False),
        ],
    )
    def test_the_fall_before_the_first_contact_shows_where_the_sensors_look(
        self, signs, order, told, drop, machine
    ):
        coarse = beginning_of(drop, machine).coarse
        record = replace(drop, signals=drop.signals[:, list(order)] * np.array(signs))
        levitated = fit_levitated(record, coarse.instant - 3e-3, speed=coarse.speed)
        rotor = free_rotor(machine, record.planes)
        fall = find_fall(record, rotor, Beginning(coarse=coarse, levitated=levitated))
        assert fell_as_described(record, machine, fall) is told

    def test_ends_swapped(self, drop, fast_drop, machine, edited):
        for record in (drop, fast_drop):
            found = only(reordered(edited, record, [2, 3, 0, 1]), machine)
            assert found.kind == "swapped ends"
            assert "S_NDE_A and S_DE_A exchanged and S_NDE_B and S_DE_B exchanged" in found.message

    @pytest.mark.parametrize(
        ("order", "pair"), [([2, 1, 0, 3], "S_NDE_A, S_DE_A"), ([3, 1, 2, 0], "S_NDE_A, S_DE_B")]
    )
    def test_channels_crossed_between_the_ends(self, order, pair, fast_drop, machine, edited):
        found = only(reordered(edited, fast_drop, order), machine)
        assert (found.kind, found.channel) == ("swapped channels", pair)

    def test_nothing_is_refused_for_the_fall_of_a_beam(self, fast_drop, machine, edited):
        """A beam in place of the rotor bends otherwise: what its fall seems to say is a warning."""
        beam = machine.changed(rotor=machine.rotor.changed(mass_to_ends=0.0))
        every = check_record(reordered(edited, fast_drop, [2, 1, 0, 3]), beam)
        (found,) = (one for one in every if one.kind == "swapped channels")
        assert (found.severity, found.channel) == ("warning", "S_NDE_A, S_DE_A")
        assert "a beam stands for the rotor" in found.message

    def test_crossed_channels_show_in_the_swing_of_the_tail(self, drop, tail, machine, edited):
        found = check_record(drop, machine, reordered(edited, tail, [2, 1, 0, 3]))
        stops = [one for one in found if one.severity == "stop"]
        assert {one.kind for one in stops} == {"swapped channels"}
        assert "tail: at node 5 the rotor swings by 21.9 µm at 53° to the level" in stops[0].message

    def test_a_tail_with_an_inverted_sensor(self, drop, tail, machine, edited):
        found = check_record(drop, machine, scaled(edited, tail, -1.0, 1))
        assert found[0].kind == "swapped axes"
        assert "tail: the rotor rests at x = +286" in found[0].message

    def test_ends_cannot_be_decided_without_the_amb_planes(self, drop, tail, machine):
        found = only(drop, machine.changed(ambs=()), tail, severity="note")
        assert "cannot be decided: it takes two AMB planes" in found.message

    def test_a_tiny_orbit_cannot_show_its_sense(self, drop, tail, machine, edited):
        """Without an orbit before the drop the exchange of A and B stays open, and this is said."""
        from rotordrop.evidence.levitated import fit_levitated

        model = fit_levitated(drop, -0.004, speed=60 * HZ)
        wave = np.outer(np.exp(2j * np.pi * model.frequency * drop.time), model.amplitudes[0]).real
        still = replace(drop, signals=drop.signals - wave)
        found = findings(still, machine, tail, "sense of the orbit")
        assert [one.severity for one in found] == ["note", "note"]
        assert "whether S_NDE_A and S_NDE_B are exchanged cannot be decided" in found[0].message


class TestLength:
    def test_no_drop(self, drop, machine):
        found = only(drop.window(-0.25, -0.01), machine)
        assert found.kind == "no drop in the record"
        assert "spans 26.5 µm, 20.5 µm in its planes and sinks by 5 % of the nominal air gap" in found.message

    @pytest.mark.parametrize("start", [0.002, -0.01])
    def test_missing_pre_trigger(self, start, drop, machine):
        found = only(drop.window(start, 0.3), machine)
        assert found.kind == "missing pre-trigger"
        assert "pre-trigger" in found.remedy

    def test_a_rotor_that_is_thrown_about_from_the_beginning_was_dropped_before(self, whole_drop, machine):
        late = whole_drop.window(0.035, 0.6)
        found = only(late, machine)
        assert found.kind == "missing pre-trigger", found.message

    def test_a_short_record(self, drop, tail, machine):
        found = only(drop.window(-0.25, 0.1), machine, tail, severity="warning")
        assert found.kind == "short record"
        assert "ends 100." in found.message

    def test_a_tail_that_still_moves(self, whole_drop, machine):
        found = only(whole_drop, machine, whole_drop.window(1.5, 2.0))
        assert found.kind == "not settled"
        assert "the shaft still turns at 47.7 Hz" in found.message


def test_damage_worked_around_on_reading_is_passed_on(drop, tail, machine):
    found = only(replace(drop, warnings=("the file ends within line 7",)), machine, tail, severity="warning")
    assert (found.kind, found.message) == ("damage on reading", "the file ends within line 7")


def test_unusable_records_are_refused_with_all_faults(drop, machine, edited):
    found = check_record(scaled(edited, drop, -1.0), machine)
    with pytest.raises(
        RecordError,
        match=r"the record cannot be used \(2 faults\): inverted polarity S_NDE_A, .*\n  also: inverted",
    ):
        refuse_unusable(found)
    refuse_unusable(one for one in found if one.severity != "stop")


def test_an_estimated_air_gap_that_cannot_be_is_named_before_the_unit(drop, machine):
    """A calibration that went astray: it is not the recorder that is wrong."""
    gap = Known(
        value=34e-6, status="estimated", interval_90=(0.0, 73e-6), source="calibrated on drop_060", unit="m"
    )
    values = {f"{bearing.name}.air_gap": gap for bearing in machine.touchdown_bearings}
    found = check_record(drop, machine.with_values(values))[0]
    assert (found.kind, found.severity) == ("wrong air gap", "stop")
    assert "× the air gap of 34 µm in lp400.toml (calibrated on drop_060)" in found.message
    assert found.remedy.startswith("use the machine file from before that estimate")


@pytest.mark.parametrize(
    ("share", "kind", "guess"),
    [
        (1 / 4, "wrong air gap", "no unit factor explains it"),
        (1 / 25.4, "wrong unit factor", "a unit factor of 25.4"),
    ],
)
def test_readings_and_a_gap_that_contradict_each_other_are_both_named(drop, machine, share, kind, guess):
    """A small machine was refused for a wrong unit factor though the owner's gap was a quarter of its own."""
    values = {
        f"{bearing.name}.air_gap": replace(bearing.air_gap, value=share * float(bearing.air_gap), range=None)
        for bearing in machine.touchdown_bearings
    }
    found = check_units(drop, machine.with_values(values))[0]
    assert (found.kind, found.severity) == (kind, "stop")
    stated = f"{1e6 * share * float(machine.touchdown_bearings[0].air_gap):.0f} µm"
    assert re.match(
        rf"the readings of drop_060 span \d+\.?\d* µm, .* of {stated} in lp400\.toml", found.message
    )
    assert guess in found.message and found.message.endswith("a wrong air gap in lp400.toml would too")
    assert "or its air_gap" in found.remedy


def test_a_single_sensor_is_refused_in_words(drop, machine):
    alone = replace(drop, signals=drop.signals[:, :1].copy(), sensors=drop.sensors[:1])
    with pytest.raises(RecordError, match=r"has one sensor \(S_NDE_A at"):
        check_record(alone, machine.model_copy(update={"sensors": machine.sensors[:1]}))


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("recorded", ["alone", "with its tail"])
def test_a_gap_of_the_machine_file_that_the_record_contradicts_is_named(
    drop, tail, machine, factor, recorded
):
    """Half and double of the gap lie within what units leave open; the range of the guess goes with it."""

    def other(gap):
        return replace(gap, value=factor * float(gap), range=tuple(factor * end for end in gap.range))

    values = {f"{bearing.name}.air_gap": other(bearing.air_gap) for bearing in machine.touchdown_bearings}
    wrong = machine.with_values(values)
    found = check_record(drop, wrong, tail if recorded == "with its tail" else None)
    assert {one.kind for one in found if "air gap" in one.message} == {"wrong air gap"}
    message = next(one.message for one in found if one.message.startswith("where the rotor turns back"))
    shown, low, high, stated = map(
        float, re.findall(r"(\d+) µm \((\d+) to (\d+)\).*? says (\d+) µm", message)[0]
    )
    true = float(machine.touchdown_bearings[0].air_gap)
    assert low < 1e6 * true < high
    assert abs(shown - 1e6 * true) < abs(stated - 1e6 * true)


@pytest.mark.parametrize(("kind", "severity"), [("turned sensors", "stop"), ("ends", "warning")])
def test_a_fall_that_leans_stops_only_where_sensors_look_elsewhere(kind, severity):
    """A free fall that deviates from the rotor model by itself refuses no drop that friction drove aside."""
    leaning = Finding(kind=Kind.LEANING, message="leans 34°", remedy="", severity="warning")
    other = Finding(kind=Kind(kind), message="deviates", remedy="", severity="note")
    first, second = standing({"wiring": [leaning], "fall": [other], "flights": []}, gains_right=False)
    assert (first.kind, first.severity) == (Kind.LEANING, severity)
    assert second == other
