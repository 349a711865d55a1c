"""Noise of the sensors that is not white: how its power falls with the frequency in the levitated readings.

What the levitated readings hold beside level, orbit, runout and hum is noise of the sensors and what is left
of the rotor's own motion. As many sensors as rigid motions cannot tell them apart: all of it counts as
noise, which is the most that the sensors may have.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from rotordrop.arrays import Array, Integers, Mask

APART = 2.0
"""Decades between the corners of two parts, at most [1]. In 60 records of 1/f noise of 0.25 s at 20 kHz, with
corners 1.7 apart, the median power found is that within 20 % from 100 Hz on and 1.9 times as large at 20 to
50 Hz, on the safe side. With 1.1 apart it is within 11 % throughout, for one state more of every sensor."""

_TONE = 2.5
"""Width on each side of a tone that was fitted and taken off, in cycles over the stretch [1]: what a tapered
periodogram lets it spread, and half a cycle."""

_BY_CHANCE = 1e-3
"""Chance that noise has a line which is not counted as noise with a smooth spectrum (chosen)."""

_AT_REST, _MOST_STEPS = 1e-4, 1000
"""Gain in log likelihood of a step below which a search is at rest, and its steps at most [1] (chosen)."""

_ROOM = 256
"""Samples by which a whitening grows [1] (chosen): one serves many windows."""

_LIKELIER = math.log(1e4)
"""Gain in log likelihood from which on noise is not white [1]: two numbers more gain as much by chance in one
channel of 10,000 (Wilks)."""


@dataclass(frozen=True, kw_only=True)
class SlowNoise:
    """M parts of the noise that outlast a sample, first-order Gauss–Markov; none where all of it is white."""

    channel: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Channel of each part, shape (M,)."""
    frequency: Array = field(default_factory=lambda: np.zeros(0))
    """Corner above which its power falls with the square of the frequency [Hz], shape (M,)."""
    variance: Array = field(default_factory=lambda: np.zeros(0))
    """Variance of each part [m²], shape (M,)."""
    white: Array = field(default_factory=lambda: np.zeros(0))
    """Variance of the white noise beside it [m²], shape (M,)."""

    def of_channels(self, columns: Sequence[int]) -> SlowNoise:
        """The same for some of the channels, numbered anew."""
        chosen = [(m, columns.index(c)) for m, c in enumerate(self.channel.tolist()) if c in columns]
        parts = [m for m, _ in chosen]
        return SlowNoise(
            channel=np.array([c for _, c in chosen], dtype=np.int64),
            frequency=self.frequency[parts],
            variance=self.variance[parts],
            white=self.white[parts],
        )

    def over_noise(self, values: Array, noise: Array, gains: Array, dt: float) -> Array:
        """Values (T, S, ...) [m], readings times their gains (S,) [1], over the noise [1].

        White noise has the standard deviation ``noise`` (S,) [m]. Of one that outlasts a sample, what each
        sample brings anew is left, over its own.
        """
        weighed: Array = values * (1.0 / noise).reshape(-1, *[1] * (values.ndim - 2))
        for c in np.unique(self.channel):
            parts = self.channel == c
            slow = tuple(zip(decay(self.frequency[parts], dt).tolist(), self.variance[parts], strict=True))
            root = _whitening(-(-len(values) // _ROOM) * _ROOM, float(self.white[parts][0]), slow)
            weighed[:, c] = np.tensordot(root[: len(values), : len(values)], values[:, c] / gains[c], 1)
        return weighed

    def variances(self, white: Array) -> Array:
        """Variance of the whole noise by channel [m²], from that of channels whose noise is white, (S,)."""
        whole = white.copy()
        whole[self.channel] = self.white
        np.add.at(whole, self.channel, self.variance)
        return whole


def slow_noise(left: Array, rate: float, tones: Sequence[float]) -> SlowNoise:
    """Slow parts of the noise of every channel whose levitated readings are not white.

    Variances of white noise and of parts with fixed corners make the periodogram likeliest (Whittle). They
    are taken where white noise alone is far less likely; everywhere else the noise stays white.

    Parameters
    ----------
    left : ndarray, shape (N, S)
        Levitated readings without level and tones [m]; NaN where missing.
    rate : float
        Sampling rate [Hz].
    tones : sequence of float
        Frequencies that were taken off [Hz].

    Notes
    -----
    Source: P. Whittle, "Estimation and information in stationary time series", Arkiv för Matematik 2 (1953).
    """
    count = len(left)
    # A taper keeps a line where it is. Of its periodogram every second value is new.
    taper = np.hanning(count)[:, None]
    line = np.asarray(np.fft.rfftfreq(count, 1.0 / rate), dtype=np.float64)
    kept = (line > 0.0) & (line < 0.5 * rate)
    for tone in tones:
        kept &= np.abs(line - tone) * count > _TONE * rate
    kept[1::2] = False
    decades = math.log10(0.5 * count)
    parts = max(math.ceil(decades / APART), 1)
    corners = rate / count * 10.0 ** (decades * (np.arange(parts) + 0.5) / parts)
    shapes = _shapes(corners, line[kept], rate)
    found = SlowNoise()
    known = np.isfinite(left)
    powers = np.abs(np.fft.rfft(_without_drift(left, known) * taper, axis=0)[kept]) ** 2
    weight = np.sum(known * taper**2, axis=0)
    for c in np.flatnonzero(weight > 0.0):
        variances = _variances(powers[:, c] / weight[c], shapes, 4.0 / count)
        if variances is not None:
            found = SlowNoise(
                channel=np.append(found.channel, np.full(parts, c)),
                frequency=np.append(found.frequency, corners),
                variance=np.append(found.variance, variances[1:]),
                white=np.append(found.white, np.full(parts, variances[0])),
            )
    return found


def _without_drift(left: Array, known: Mask) -> Array:
    """Readings without their line of regression, zero where missing: a channel that drifts is no noise."""
    at = np.linspace(-1.0, 1.0, len(left))[:, None]
    values, count = np.where(known, left, 0.0), np.maximum(known.sum(axis=0), 1)
    middle, level = (known * at).sum(axis=0) / count, values.sum(axis=0) / count
    about, rest = known * (at - middle), known * (values - level)
    return np.asarray(rest - about * (about * rest).sum(axis=0) / np.maximum((about**2).sum(axis=0), 1e-300))


def decay(frequency: Array, dt: float) -> Array:
    """What a sample [s] leaves of first-order noise with these corners [Hz], shape (M,) [1]."""
    return np.asarray(np.exp(-2.0 * np.pi * frequency * dt))


@lru_cache(maxsize=16)
def _whitening(count: int, white: float, slow: tuple[tuple[float, float], ...]) -> Array:
    """Inverse of the Cholesky factor of the covariance of ``count`` samples [1/m].

    ``slow`` holds what a sample leaves of each part, and its variance [m²]. The leading block is that of
    fewer samples.
    """
    from scipy.linalg import cholesky, solve_triangular, toeplitz

    apart = np.arange(count)
    column = sum((variance * left**apart for left, variance in slow), np.zeros(count))
    column[0] += white
    lower = cholesky(toeplitz(column), lower=True)
    return np.asarray(solve_triangular(lower, np.eye(count), lower=True))


def _shapes(corners: Array, line: Array, rate: float) -> Array:
    """Power of white noise and of each part by the frequency, of variance 1, shape (K + 1, F)."""
    a = decay(corners, 1.0 / rate)[:, None]
    slow = (1.0 - a * a) / (1.0 - 2.0 * a * np.cos(2.0 * np.pi * line / rate) + a * a)
    return np.vstack([np.ones(len(line)), slow])


def _variances(power: Array, shapes: Array, share: float) -> Array | None:
    """Likeliest variances of white noise and parts (K + 1,); None where white noise alone will do.

    A line that stands out is none of them: its variance, roughly ``share`` of its power, counts as white.
    """
    smooth = np.ones(len(power), dtype=np.bool_)
    while True:
        count = int(np.count_nonzero(smooth))
        if count <= 2 * len(shapes):
            return None
        variances = _likeliest(power[smooth], shapes[:, smooth])
        spectrum = variances @ shapes
        still = smooth & (power < math.log(count / _BY_CHANCE) * spectrum)
        if still.sum() == count:
            break
        smooth = still
    cost = float(np.sum(power[smooth] / spectrum[smooth] + np.log(spectrum[smooth])))
    white = count * (1.0 + math.log(float(np.mean(power[smooth]))))
    if white - cost < _LIKELIER:
        return None
    variances[0] += share * float(np.sum((power - spectrum)[~smooth]))
    return variances


def _likeliest(power: Array, shapes: Array) -> Array:
    """Variances that make a periodogram likeliest, shape (K + 1,).

    Each step multiplies a variance by what the periodogram has of its shape over what the spectrum has, and
    none lowers the likelihood. A search by gradients had jumped to noise that walks, with no white one.

    Notes
    -----
    Source: C. Févotte, N. Bertin and J.-L. Durrieu, "Nonnegative matrix factorization with the Itakura–Saito
    divergence", Neural Computation 21 (2009), with given shapes.
    """
    variances, before = np.full(len(shapes), float(np.mean(power)) / len(shapes)), math.inf
    for _ in range(_MOST_STEPS):
        spectrum = variances @ shapes
        cost = float(np.sum(power / spectrum + np.log(spectrum)))
        if before - cost < _AT_REST:
            break
        before = cost
        variances = variances * (shapes @ (power / spectrum**2)) / (shapes @ (1.0 / spectrum))
    return np.asarray(variances)
