"""Fewer samples per second where only low frequencies matter, without touching their amplitude."""

from __future__ import annotations

import numpy as np
from scipy.signal import firwin, upfirdn

from rotordrop.arrays import Array
from rotordrop.spectrum.waterfall import PlanarSignal

TAPS_PER_FACTOR = 40
BLOCK = 1024
"""Samples that remain of what is read at a time [1]: the signal may lie in a file, or be made while read."""
PASSED = 0.75
"""Share of the band up to half the new rate that is left [1]: white noise is white below it only."""
STOP_BAND = 100.0
"""Attenuation of what would fold back [dB]."""


def reduce_rate(
    displacement: PlanarSignal,
    sampling_rate: float,
    highest_frequency: float,
    *,
    samples_per_turn: float = 3.6,
) -> tuple[Array, float]:
    """Thin out a displacement to what its highest frequency of interest needs.

    Frequencies up to the highest keep their amplitude within 2e-5; what lies beyond half the new rate is gone
    (100 dB). The first sample keeps its time. A signal that cannot be thinned out is returned as it is.

    The displacement has shape (N, 2) [m], the thinned one (M, 2); the new rate comes with it. So many samples
    per period of the highest frequency remain [1].
    """
    factor = int(sampling_rate // (samples_per_turn * highest_frequency))
    if factor < 2:
        return np.asarray(displacement[0 : displacement.shape[0]], dtype=np.float64), sampling_rate
    beta = 0.1102 * (STOP_BAND - 8.7)
    half = TAPS_PER_FACTOR // 2
    taps = firwin(2 * half * factor + 1, PASSED / factor, window=("kaiser", beta))
    samples = displacement.shape[0]
    thin = np.empty((-(-samples // factor), displacement.shape[1]))
    for first in range(0, len(thin), BLOCK):
        last = min(first + BLOCK, len(thin))
        read = _extended(displacement, (first - half) * factor, (last - 1 + half) * factor + 1)
        thin[first:last] = upfirdn(taps, read, 1, factor, axis=0)[2 * half : 2 * half + last - first]
    return thin, sampling_rate / factor


def _extended(displacement: PlanarSignal, first: int, last: int) -> Array:
    """Samples of a stretch; beyond the ends, the straight line through the first sample and the last one."""
    samples = displacement.shape[0]
    ends = [np.asarray(displacement[k : k + 1], dtype=np.float64) for k in (0, samples - 1)]
    slope = (ends[1] - ends[0]) / max(samples - 1, 1)
    before, after = np.arange(first, 0)[:, None], np.arange(1, last - samples + 1)[:, None]
    inside = np.asarray(displacement[max(first, 0) : min(last, samples)], dtype=np.float64)
    return np.concatenate([ends[0] + slope * before, inside, ends[1] + slope * after])
