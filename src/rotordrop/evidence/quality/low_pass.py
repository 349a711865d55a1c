"""A low-pass before the recorder: the impacts lack what those of the described machine have.

No law of contact is needed to see it: the motion after a drop has a spectrum that hardly depends on how the
rotor began to fall, and the same drop, simulated, says what it must hold.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RotordropError
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import DropModel

_WINDOW = 0.2
"""Time after the drop that is compared [s]."""

_LOWEST, _BANDS = 50.0, 3
"""Lower end of the lowest band [Hz], and bands an octave."""

_SEEN = 10.0
"""Power of the simulated drop over that of the levitated readings from which a band tells [1]."""

_LACKS = 8.0
"""What the highest two bands that tell must lack [dB]. In 212 drops of the corpus, some of machines other
than described, they lack 6 at most; behind one of 300 Hz of second order those of a 60 kg rotor lack 11."""

_IMPACTS = 0.95
"""Part of the power of the velocity, which impacts change, up to which a band tells of them [1]."""

_CORNER = 6.0
"""What all bands above the corner of a filter lack [dB]."""


def check_low_pass(record: Record, model: DropModel, speed: float, drop: float) -> list[Finding]:
    """Find a low-pass by the drop of the described machine from a speed [rad/s]; ``drop`` is its time [s]."""
    after = (record.time >= drop) & (record.time < drop + _WINDOW)
    before = record.time < drop - 5e-3
    count = 1 << int(np.log2(min(0.05 * record.sampling_rate, 0.5 * after.sum(), before.sum()) + 1.0))
    edges = _LOWEST * 2.0 ** np.arange(
        0.0, np.log2(max(0.4 * record.sampling_rate / _LOWEST, 1.0)), 1.0 / _BANDS
    )
    live = np.isfinite(record.along).all(axis=0)  # a channel that lacks readings tells nothing here
    described = _described(record, model, speed, int(after.sum())) if count > 1 and live.any() else None
    if described is None:
        return []
    shown, floor, expected = (
        _powers(along[:, live], record.sampling_rate, count, edges)
        for along in (record.along[after], record.along[before], described)
    )
    velocity = np.nan_to_num(np.median(expected, axis=1)) * np.diff(edges**3)
    below = np.cumsum(velocity) - velocity < _IMPACTS * velocity.sum()
    tells = (expected > _SEEN * floor) & below[:, None]
    bands = np.flatnonzero(tells.sum(axis=1) > 0.5 * tells.shape[1])
    if len(bands) < 3:
        return []
    lack = 10.0 * np.log10(expected / np.maximum(shown - floor, 1e-3 * shown))
    lack = np.nanmedian(np.where(tells, lack, np.nan)[bands], axis=1)
    if lack[-2:].mean() < _LACKS:
        return []
    first = max(np.flatnonzero(lack[:-2] < _CORNER), default=-1) + 1
    corner = edges[bands[first]]
    return [found("low-pass", corner=corner, lacks=lack[-2:].mean(), above=2.0 * edges[bands[-1] + 1])]


def _described(record: Record, model: DropModel, speed: float, count: int) -> Array | None:
    """The described machine along the sensors after a drop [m], shape (count, S); None if it cannot drop."""
    from rotordrop.simulate.case import DropCase
    from rotordrop.simulate.drop import simulate_drop

    step = 1.0 / record.sampling_rate
    try:
        case = DropCase(speed=speed, duration=count * step, output_step=step, most_steps=1_000_000)
        moved = simulate_drop(model, case).at_nodes([sensor.node for sensor in record.sensors])
    except RotordropError:
        return None
    along: Array = np.sum(moved[:count] * record.directions, axis=-1)
    return along if len(along) == count else None


def _powers(along: Array, rate: float, count: int, edges: Array) -> Array:
    """Mean power of segments of ``count`` samples in bands [m²], shape (bands, S)."""
    whole = along[: len(along) // count * count].reshape(-1, count, along.shape[1])
    segments = (whole - whole.mean(axis=1, keepdims=True)) * np.hanning(count)[:, None]
    power = np.mean(np.abs(np.fft.rfft(segments, axis=1)) ** 2, axis=0)
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    inside = [(frequency >= low) & (frequency < high) for low, high in pairwise(edges)]
    return np.array(
        [power[one].mean(axis=0) if one.any() else np.full(power.shape[1], np.nan) for one in inside]
    )
