"""Waterfall: the paper's frames, true amplitudes, directions, and the smear of a falling speed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from rotordrop.errors import RecordError, UsageError
from rotordrop.spectrum.waterfall import (
    PAPER_SETTINGS,
    WaterfallSettings,
    settings_for,
    smear_factor,
    waterfalls,
)

FS = 20000.0
SMALL = WaterfallSettings(points=2048)


def tone(frequency: float, samples: int = 8192, amplitude: float = 1.0) -> np.ndarray:
    phase = 2.0 * np.pi * frequency * np.arange(samples) / FS
    return amplitude * np.column_stack([np.cos(phase), np.sin(phase)])


def test_same_amplitudes_as_scipys_short_time_transform():
    rng = np.random.default_rng(1)
    xy = rng.standard_normal((10000, 2))
    (ours,) = waterfalls(
        xy, FS, components=("x",), settings=WaterfallSettings(points=2048, remove_mean=False)
    )
    transform = ShortTimeFFT(
        hann(2048, sym=False), hop=1024, fs=FS, scale_to="magnitude", fft_mode="onesided"
    )
    theirs = 2.0 * np.abs(transform.stft(xy[:, 0], p0=1, p1=1 + len(ours.time), k_offset=0)).T
    theirs[:, [0, -1]] /= 2.0
    assert ours.amplitude == pytest.approx(theirs, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("component", ["x", "y", "full"])
def test_a_tone_on_a_line_reads_its_amplitude(component):
    (found,) = waterfalls(tone(50 * FS / 2048, amplitude=3e-6), FS, components=(component,), settings=SMALL)
    line = np.argmin(np.abs(found.frequency - 50 * FS / 2048))
    assert found.amplitude[:, line] == pytest.approx(np.full(len(found.time), 3e-6), rel=1e-12)
    assert found.amplitude.sum(axis=1) == pytest.approx(np.full(len(found.time), 6e-6), rel=1e-9)


def test_peak_to_peak_is_twice_and_says_so():
    xy = tone(50 * FS / 2048)
    (single,) = waterfalls(xy, FS, settings=SMALL)
    (double,) = waterfalls(xy, FS, settings=SMALL, amplitude_kind="peak-to-peak")
    assert double.amplitude == pytest.approx(2.0 * single.amplitude)
    assert (single.amplitude_kind, double.amplitude_kind) == ("zero-to-peak", "peak-to-peak")


def test_backward_motion_stands_at_negative_frequency():
    (found,) = waterfalls(tone(50 * FS / 2048) * [1.0, -1.0], FS, components=("full",), settings=SMALL)
    (backward,) = waterfalls(tone(-50 * FS / 2048), FS, components=("full",), settings=SMALL)
    at = backward.frequency[np.argmax(backward.amplitude[0])]
    assert at == pytest.approx(-50 * FS / 2048)
    assert found.frequency[np.argmax(found.amplitude[0])] == pytest.approx(-50 * FS / 2048)


def test_an_offset_stays_within_one_line_of_zero():
    xy = np.tile([2e-6, -285e-6], (4096, 1))
    (kept,) = waterfalls(xy, FS, settings=WaterfallSettings(points=2048, remove_mean=False))
    near = np.abs(kept.frequency) < 1.5 * kept.resolution
    assert kept.amplitude[:, ~near].max() < 1e-15
    assert waterfalls(xy, FS, settings=SMALL)[0].amplitude.max() < 1e-15


def test_frames_are_read_one_at_a_time():
    class Counting:
        shape = (100_000, 2)
        largest = 0

        def __getitem__(self, key: slice) -> np.ndarray:
            self.largest = max(self.largest, key.stop - key.start)
            return np.zeros((key.stop - key.start, 2))

    signal = Counting()
    assert waterfalls(signal, FS, settings=SMALL)[0].amplitude.shape[0] == 96
    assert signal.largest == 2048


def test_speed_of_a_frame_and_its_change():
    speed = np.linspace(377.0, 300.0, 8192)
    (found,) = waterfalls(tone(100.0), FS, speed=speed, settings=SMALL)
    assert found.speed == pytest.approx(np.interp(found.time * FS - 0.5, np.arange(8192), speed), rel=1e-9)
    assert found.speed_change == pytest.approx(np.full(7, 77.0 * 2047 / 8191), rel=1e-9)


def test_smear_of_the_papers_first_frame():
    """60 Hz falling with a time constant of 5.9 s reads 41 % of its amplitude in the paper's first frame."""
    t = np.arange(PAPER_SETTINGS.points) / FS
    angle = 2.0 * np.pi * 60.0 * 5.9 * (1.0 - np.exp(-t / 5.9))
    (found,) = waterfalls(np.column_stack([np.cos(angle), np.sin(angle)]), FS)
    assert found.amplitude.max() == pytest.approx(0.41, abs=0.01)
    middle_rate = 60.0 / 5.9 * np.exp(-0.5 * t[-1] / 5.9)
    assert smear_factor(middle_rate, FS) == pytest.approx(found.amplitude.max(), abs=0.01)


@pytest.mark.parametrize("rate", [0.0, 0.3, 2.0, 10.0])
def test_smear_factor_is_what_frames_of_a_linear_sweep_show(rate):
    """Up to the scalloping of a tone between two lines, so the tone is swept about a line."""
    t = (np.arange(PAPER_SETTINGS.points) - PAPER_SETTINGS.points / 2) / FS
    phase = 2.0 * np.pi * (200 * PAPER_SETTINGS.resolution(FS) * t + 0.5 * rate * t**2)
    found = waterfalls(np.column_stack([np.cos(phase), np.sin(phase)]), FS)[0].amplitude.max()
    assert smear_factor(rate, FS) == pytest.approx(found, rel=5e-3)


def test_wrong_calls_are_refused():
    with pytest.raises(RecordError, match="100 samples, one frame needs 32768"):
        waterfalls(np.zeros((100, 2)), FS)
    with pytest.raises(UsageError, match=r"overlap 1\.0 given"):
        WaterfallSettings(overlap=1.0)
    with pytest.raises(
        RecordError, match=r"speed has shape \(5,\), expected one value per sample, \(4096,\)"
    ):
        waterfalls(np.zeros((4096, 2)), FS, settings=SMALL, speed=np.zeros(5))


@pytest.mark.parametrize(
    ("samples", "points"),
    [(1_140_000, 32768), (212_992, 32768), (212_991, 16384), (45_000, 4096), (3000, 1024)],
)
def test_a_short_signal_has_a_dozen_frames_as_long_as_that_allows(samples, points):
    assert settings_for(samples).points == points
