"""Waterfall, and the speed of a coast-down: frames, amplitudes, fits with intervals, standstill."""

import numpy as np
import pytest
from scipy.signal import ShortTimeFFT, firwin, resample_poly
from scipy.signal.windows import hann

from rotordrop.errors import RecordError, UsageError
from rotordrop.spectrum import waterfall
from rotordrop.spectrum.coast_down import WaterfallChoice
from rotordrop.spectrum.speed import (
    exact_speed_profile,
    find_standstill,
    fit_drag,
    fit_exponential,
    fit_speed_profile,
)
from rotordrop.spectrum.waterfall import (
    PAPER_POINTS,
    STOP_BAND,
    TAPS_PER_FACTOR,
    points_for,
    reduce_rate,
    waterfalls,
)

FS = 20000.0
SMALL = 2048


def tone(frequency, samples=8192, amplitude=1.0):
    phase = 2.0 * np.pi * frequency * np.arange(samples) / FS
    return amplitude * np.column_stack([np.cos(phase), np.sin(phase)])


def test_same_amplitudes_as_scipys_short_time_transform():
    rng = np.random.default_rng(1)
    xy = rng.standard_normal((10000, 2))
    (ours,) = waterfalls(xy, FS, components=("x",), points=SMALL)
    transform = ShortTimeFFT(
        hann(2048, sym=False), hop=1024, fs=FS, scale_to="magnitude", fft_mode="onesided"
    )
    theirs = 2.0 * np.abs(transform.stft(xy[:, 0], p0=1, p1=1 + len(ours.time), k_offset=0)).T
    theirs[:, [0, -1]] /= 2.0
    # the mean of each frame, which is subtracted, stands in the first two lines
    assert ours.amplitude[:, 2:] == pytest.approx(theirs[:, 2:], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("component", ["x", "y", "full"])
def test_a_tone_on_a_line_reads_its_amplitude(component):
    (found,) = waterfalls(tone(50 * FS / 2048, amplitude=3e-6), FS, components=(component,), points=SMALL)
    line = np.argmin(np.abs(found.frequency - 50 * FS / 2048))
    assert found.amplitude[:, line] == pytest.approx(np.full(len(found.time), 3e-6), rel=1e-12)
    assert found.amplitude.sum(axis=1) == pytest.approx(np.full(len(found.time), 6e-6), rel=1e-9)


def test_peak_to_peak_offset_and_direction_stand_where_they_belong():
    xy = tone(50 * FS / 2048)
    (single,) = waterfalls(xy, FS, points=SMALL)
    (double,) = waterfalls(xy, FS, points=SMALL, amplitude_kind="peak-to-peak")
    assert double.amplitude == pytest.approx(2.0 * single.amplitude)
    assert (single.amplitude_kind, double.amplitude_kind) == ("zero-to-peak", "peak-to-peak")
    xy = np.tile([2e-6, -285e-6], (4096, 1))
    assert waterfalls(xy, FS, points=SMALL)[0].amplitude.max() < 1e-15
    (found,) = waterfalls(tone(50 * FS / 2048) * [1.0, -1.0], FS, components=("full",), points=SMALL)
    (backward,) = waterfalls(tone(-50 * FS / 2048), FS, components=("full",), points=SMALL)
    at = backward.frequency[np.argmax(backward.amplitude[0])]
    assert at == pytest.approx(-50 * FS / 2048)
    assert found.frequency[np.argmax(found.amplitude[0])] == pytest.approx(-50 * FS / 2048)


def test_frames_are_read_one_at_a_time():
    class Counting:
        shape = (100_000, 2)
        largest = 0

        def __getitem__(self, key):
            self.largest = max(self.largest, key.stop - key.start)
            return np.zeros((key.stop - key.start, 2))

    signal = Counting()
    assert waterfalls(signal, FS, points=SMALL)[0].amplitude.shape[0] == 96
    assert signal.largest == 2048


def test_frames_have_a_speed_smear_with_its_change_and_limits():
    speed = np.linspace(377.0, 300.0, 8192)
    (found,) = waterfalls(tone(100.0), FS, speed=speed, points=SMALL)
    assert found.speed == pytest.approx(np.interp(found.time * FS - 0.5, np.arange(8192), speed), rel=1e-9)
    assert found.speed_change == pytest.approx(np.full(7, 77.0 * 2047 / 8191), rel=1e-9)
    # 60 Hz falling with a time constant of 5.9 s reads 41 % of its amplitude in the paper's first frame.
    t = np.arange(PAPER_POINTS) / FS
    angle = 2.0 * np.pi * 60.0 * 5.9 * (1.0 - np.exp(-t / 5.9))
    (found,) = waterfalls(np.column_stack([np.cos(angle), np.sin(angle)]), FS)
    assert found.amplitude.max() == pytest.approx(0.41, abs=0.01)
    with pytest.raises(RecordError, match="100 samples, one frame needs 32768"):
        waterfalls(np.zeros((100, 2)), FS)
    with pytest.raises(UsageError, match=r"overlap is 1\.0; expected a finite number of at least 0 up to 0"):
        WaterfallChoice(overlap=1.0)
    with pytest.raises(
        RecordError, match=r"speed has shape \(5,\), expected one value per sample, \(4096,\)"
    ):
        waterfalls(np.zeros((4096, 2)), FS, points=SMALL, speed=np.zeros(5))


@pytest.mark.parametrize(
    ("samples", "points"),
    [(1_140_000, 32768), (212_992, 32768), (212_991, 16384), (45_000, 4096), (3000, 1024)],
)
def test_a_short_signal_has_a_dozen_frames_as_long_as_that_allows(samples, points):
    assert points_for(samples) == points


@pytest.mark.parametrize("samples", [40, 700, 20_001])
@pytest.mark.parametrize("block", [37, 8192])
def test_blocks_give_what_one_piece_gives(samples, block, monkeypatch):
    monkeypatch.setattr(waterfall, "BLOCK", block)
    signal = 3.0 + np.random.default_rng(1).standard_normal((samples, 2)).cumsum(axis=0)
    thin, reduced = reduce_rate(signal, 20e3, 180.0, samples_per_turn=8.0)
    factor, beta = 13, 0.1102 * (STOP_BAND - 8.7)
    taps = firwin(2 * (TAPS_PER_FACTOR // 2) * factor + 1, 0.75 / factor, window=("kaiser", beta))
    whole = [resample_poly(signal[:, k], 1, factor, window=taps, padtype="line") for k in range(2)]
    assert reduced == pytest.approx(20e3 / factor)
    assert thin == pytest.approx(np.column_stack(whole), rel=1e-12, abs=1e-12)


TURN = 2.0 * np.pi
TIME = np.arange(0.0, 57.0, 0.05)


def drag_speed(time, first=60.0 * TURN, dry=0.16, linear=0.11, quadratic=0.0):
    """Integrated with very small steps, independent of the fit's own integrator."""
    fine = np.linspace(0.0, float(time[-1]), 200_001)
    step = fine[1]
    speed = np.empty(fine.size)
    speed[0] = omega = first
    for k in range(1, fine.size):
        slope = dry + linear * omega + quadratic * omega**2
        middle = max(omega - 0.5 * step * slope, 0.0)
        omega = max(omega - step * (dry + linear * middle + quadratic * middle**2), 0.0)
        speed[k] = omega
    return np.interp(time, fine, speed)


@pytest.mark.parametrize("step", [0.0, 1.0 / 60.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_profile_is_far_better_than_the_recording(seed, step):
    rng = np.random.default_rng(seed)
    truth = 58.5 * np.exp(-TIME / 8.0) + 1.5 * np.exp(-TIME / 0.2)
    recorded = truth + 0.05 * rng.standard_normal(TIME.size)
    if step:
        recorded = np.round(recorded / step) * step
    profile = fit_speed_profile(TIME, TURN * recorded)
    error = profile.speed_at(TIME) / TURN - truth
    later = TIME > 1.0
    assert np.sqrt(np.mean(error[later] ** 2)) < 0.02
    assert profile.noise / TURN == pytest.approx(np.hypot(0.05, step / np.sqrt(12.0)), rel=0.2)


def test_angle_is_the_integral_of_the_speed():
    omega = TURN * 60.0 * np.exp(-TIME / 5.9)
    profile = exact_speed_profile(TIME, omega)
    expected = TURN * 60.0 * 5.9 * (1.0 - np.exp(-TIME / 5.9))
    assert profile.angle_at(TIME) == pytest.approx(expected, abs=1e-4)
    assert profile.change_at(10.0) == pytest.approx(-TURN * 60.0 / 5.9 * np.exp(-10.0 / 5.9), rel=1e-4)
    beyond = profile.angle_at(TIME[-1] + 2.0) - profile.angle_at(TIME[-1])
    assert beyond == pytest.approx(2.0 * omega[-1])


def test_speed_before_power_off_is_constant_and_double_tacho_pulses_are_left_out():
    time = np.arange(-1.0, 10.0, 0.05)
    omega = TURN * np.where(time < 0.0, 60.0, 60.0 * np.exp(-np.maximum(time, 0.0) / 8.0))
    noisy = omega + TURN * 0.05 * np.random.default_rng(0).standard_normal(time.size)
    profile = fit_speed_profile(time, noisy, power_off=0.0)
    assert profile.speed_at([-0.9, -0.5]) / TURN == pytest.approx([60.0, 60.0], abs=0.05)
    omega = TURN * 60.0 * np.exp(-TIME / 8.0)
    omega = omega + TURN * 0.02 * np.random.default_rng(0).standard_normal(TIME.size)
    omega[200] *= 2.0
    omega[400] *= 0.5
    profile = fit_speed_profile(TIME, omega)
    assert profile.rejected == 2
    assert profile.speed_at(TIME[200]) / TURN == pytest.approx(60.0 * np.exp(-TIME[200] / 8.0), abs=0.03)


def test_exponential_fit_returns_its_law_and_knows_another():
    rng = np.random.default_rng(2)
    recorded = TURN * (60.0 * np.exp(-TIME / 5.9) + 0.05 * rng.standard_normal(TIME.size))
    fit = fit_exponential(TIME, recorded, start=0.0)
    low, high = fit.time_constant.interval_90
    assert low < 5.9 < high and high - low < 0.02
    other = fit_exponential(TIME, drag_speed(TIME, quadratic=2e-4), start=0.0)
    exact = fit_exponential(TIME, TURN * 60.0 * np.exp(-TIME / 5.9), start=0.0)
    assert exact.residual_rms < 1e-4 * TURN * 60.0
    assert other.residual_rms > 5.0 * other.noise


def test_drag_fit_returns_all_three_parts():
    truth = drag_speed(TIME, dry=0.16, linear=0.08, quadratic=1.5e-4)
    inside = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        fit = fit_drag(TIME, truth + TURN * 0.05 * rng.standard_normal(TIME.size), start=1.0)
        assert fit.linear.value == pytest.approx(0.08, rel=0.02)
        assert fit.quadratic.value == pytest.approx(1.5e-4, rel=0.02)
        assert fit.residual_rms == pytest.approx(TURN * 0.05, rel=0.1)
        for value, true in ((fit.constant, 0.16), (fit.linear, 0.08), (fit.quadratic, 1.5e-4)):
            inside += value.interval_90[0] < true < value.interval_90[1]
    assert 27 <= inside <= 36  # 32.4 of 36 expected


def test_drag_that_is_not_there_and_a_standstill_beyond_the_record_are_not_determined():
    recorded = drag_speed(TIME) + TURN * 0.05 * np.random.default_rng(0).standard_normal(TIME.size)
    fit = fit_drag(TIME, recorded, start=1.0)
    assert fit.quadratic.status in ("at its bound", "the record does not determine it")
    assert fit.quadratic.interval_90[1] < 2e-5
    assert fit.linear.status == "determined"
    assert fit.speed_at([5.0, 20.0]) == pytest.approx(drag_speed(TIME)[[100, 400]], abs=0.05 * TURN)
    early = TIME < 15.0
    found = find_standstill(TIME[early], drag_speed(TIME)[early])
    assert found.status == "the record does not determine it"
    assert found.lower == pytest.approx(TIME[early][-1], abs=0.1)


@pytest.mark.parametrize("seed", range(5))
def test_standstill_is_found_within_its_interval(seed):
    truth = drag_speed(TIME, dry=0.25)
    stop = TIME[np.flatnonzero(truth <= 0.0)[0]]
    noisy = truth + TURN * 0.05 * np.random.default_rng(seed).standard_normal(TIME.size)
    cut = find_standstill(TIME, np.maximum(noisy, 0.0))
    assert cut.status == "determined"
    assert cut.value == pytest.approx(stop, abs=4.0 * cut.standard_error + 0.1)
    assert cut.standard_error < 1.0
    assert cut.lower < stop


def test_the_interval_of_a_standstill_holds_the_time_until_which_the_rotor_is_seen_to_move():
    truth = drag_speed(TIME, dry=0.25)
    stop = int(np.flatnonzero(truth <= 0.0)[0])
    truth[stop + 60] = TURN * 0.5  # it rocks once more, and a tacho does not say which way
    noisy = truth + TURN * 0.05 * np.random.default_rng(0).standard_normal(TIME.size)
    found = find_standstill(TIME, np.maximum(noisy, 0.0))
    assert found.status == "determined" and found.lower == TIME[stop + 60]
    assert found.low < TIME[stop] < found.value + 1.0 < found.lower < found.high < found.lower + 1.0


def test_wrong_records_are_refused():
    with pytest.raises(RecordError, match=r"time does not rise at value 5 \(4\.000000 s, then 3\.000000 s\)"):
        fit_speed_profile([0, 1, 2, 3, 4, 3, 6, 7, 8], np.ones(9))
    with pytest.raises(RecordError, match="3 valid recorded speeds"):
        fit_speed_profile([0.0, 1.0, 2.0], np.ones(3))
    with pytest.raises(RecordError, match=r"0 recorded speeds between 100 s and the end"):
        fit_drag(TIME, np.ones(TIME.size), start=100.0)
