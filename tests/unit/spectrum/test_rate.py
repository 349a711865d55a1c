"""Thinning out block by block, as scipy does it in one piece."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import firwin, resample_poly

from rotordrop.spectrum import rate
from rotordrop.spectrum.rate import STOP_BAND, TAPS_PER_FACTOR, reduce_rate


@pytest.mark.parametrize("samples", [40, 700, 20_001])
@pytest.mark.parametrize("block", [37, 8192])
def test_blocks_give_what_one_piece_gives(samples, block, monkeypatch):
    monkeypatch.setattr(rate, "BLOCK", block)
    signal = 3.0 + np.random.default_rng(1).standard_normal((samples, 2)).cumsum(axis=0)
    thin, reduced = reduce_rate(signal, 20e3, 180.0, samples_per_turn=8.0)
    factor, beta = 13, 0.1102 * (STOP_BAND - 8.7)
    taps = firwin(2 * (TAPS_PER_FACTOR // 2) * factor + 1, 0.75 / factor, window=("kaiser", beta))
    whole = [resample_poly(signal[:, k], 1, factor, window=taps, padtype="line") for k in range(2)]
    assert reduced == pytest.approx(20e3 / factor)
    assert thin == pytest.approx(np.column_stack(whole), rel=1e-12, abs=1e-12)
