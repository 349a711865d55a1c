"""Fewer samples per second where only low frequencies matter, without touching their amplitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, resample_poly

from rotordrop.spectrum.waterfall import PlanarSignal

Array = NDArray[np.float64]

TAPS_PER_FACTOR = 40
STOP_BAND = 100.0
"""Attenuation of what would fold back [dB]."""


def reduce_rate(
    displacement: PlanarSignal,
    sampling_rate: float,
    highest_frequency: float,
    *,
    samples_per_turn: float = 8.0,
) -> tuple[Array, float]:
    """Thin out a displacement to what its highest frequency of interest needs.

    Frequencies up to the highest keep their amplitude within 2e-5; what lies beyond half the new rate is gone
    (100 dB). The first sample keeps its time. A signal that cannot be thinned out is returned as it is.

    Parameters
    ----------
    displacement : shape (N, 2)
        Displacement (x, y) [m].
    sampling_rate : float
        [Hz].
    highest_frequency : float
        [Hz].
    samples_per_turn : float
        Samples per period of the highest frequency that must remain [1].

    Returns
    -------
    displacement : shape (M, 2)
        [m].
    sampling_rate : float
        [Hz].
    """
    values = np.asarray(displacement[0 : displacement.shape[0]], dtype=np.float64)
    factor = int(sampling_rate // (samples_per_turn * highest_frequency))
    if factor < 2:
        return values, sampling_rate
    beta = 0.1102 * (STOP_BAND - 8.7)
    taps = firwin(2 * (TAPS_PER_FACTOR // 2) * factor + 1, 0.75 / factor, window=("kaiser", beta))
    thin = [
        resample_poly(values[:, k], 1, factor, window=taps, padtype="line") for k in range(values.shape[1])
    ]
    return np.column_stack(thin), sampling_rate / factor
