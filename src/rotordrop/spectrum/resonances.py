"""Resonances passed on the way down: where an order's amplitude rises, and which mode that is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.signal import find_peaks, peak_widths

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.spectrum.candidates import Candidate
from rotordrop.spectrum.naming import LineEvidence, Name, name_line
from rotordrop.spectrum.orders import OrderTrack

LEAST_RISE = 1.5
"""Amplitude over the level on both sides [1] from which it is a rise (chosen)."""
LOWEST_FREQUENCY, BAND = 5.0, 1000.0
"""Frequency [Hz] from which excitation is looked at, and width of the band in which modes may lie [Hz]."""


@dataclass(frozen=True, kw_only=True)
class PassedResonance:
    """One rise of an order's amplitude on the way down."""

    order: float
    """The order that rises [1]."""
    plane: str
    """Where it was seen."""
    time: float
    """When it was highest [s]."""
    speed: float
    """Rotor speed then [rad/s]."""
    frequency: float
    """Order times rotor speed then [Hz]: what was excited."""
    frequency_error: float
    """Half the distance over which the rise is within a tenth of its top [Hz]."""
    width: float
    """Full width of the rise at half of its height [Hz]."""
    amplitude: float
    """Longest half axis of the orbit [m], zero-to-peak; at least, where the rise is not certain."""
    rise: float
    """Amplitude over that beside the rise [1]."""
    certain: bool
    """False where the top is hidden under a steady line at the same frequency."""
    name: Name
    """The mode, if one is known there."""

    def as_json(self) -> dict[str, Any]:
        """Everything known about the resonance, ready for JSON; amplitudes are zero-to-peak in m."""
        return stated(
            self,
            "order plane time_s speed_hz frequency_hz frequency_error_hz width_hz "
            "amplitude_zero_to_peak_m=amplitude rise certain mode=name.label named=name.named "
            "confidence=name.confidence reason=name.reason",
            speed_hz=self.speed / math.tau,
        )


def find_resonances(
    track: OrderTrack,
    plane: str,
    candidates: Sequence[Candidate],
) -> tuple[PassedResonance, ...]:
    """Find where the amplitude of each tracked order rises and falls again while the speed falls.

    A rise counts when it stands `LEAST_RISE` times above the level on both sides and five standard errors
    clear of it. Where an order crosses a steady line (a pendulum swing, hum) its amplitude is unknown: there
    it is taken to be no higher than on the better known side, and a rise found so is reported as uncertain,
    with the least amplitude it must have had.

    Of the candidates those of kind "steady" are compared, mains hum left out. The result is in the order of
    time.
    """
    modes = [c for c in candidates if c.kind == "steady" and not c.family.startswith("mains")]
    found: list[PassedResonance] = []
    for column, order in enumerate(track.orders.tolist()):
        curve = _curve(track, column, order)
        if curve is not None:
            found += [_resonance(track, curve, order, plane, peak, modes) for peak in _peaks(curve)]
    return tuple(sorted(found, key=lambda resonance: resonance.time))


@dataclass(frozen=True)
class _Curve:
    """Amplitude of one order over time, with what is hidden under steady lines levelled off."""

    rows: NDArray[np.intp]
    frequency: Array
    amplitude: Array
    error: Array
    known: NDArray[np.bool_]


@dataclass(frozen=True)
class _Rise:
    at: int
    first: int
    last: int
    base: float
    left: float
    right: float


def _curve(track: OrderTrack, column: int, order: float) -> _Curve | None:
    frequency = order * track.speed / math.tau
    known = track.separable[:, column]
    # Hidden ends say nothing about a rise: begin and end with amplitudes that are known.
    usable = np.flatnonzero(known & (frequency >= LOWEST_FREQUENCY))
    if usable.size < 5:
        return None
    rows = np.arange(usable[0], usable[-1] + 1)
    rows = rows[frequency[rows] >= LOWEST_FREQUENCY]
    amplitude = track.major_axis[rows, column].copy()
    known = known[rows]
    gaps, count = label(~known)
    for gap in range(1, count + 1):
        hidden = np.flatnonzero(gaps == gap)
        amplitude[hidden] = max(amplitude[hidden[0] - 1], amplitude[hidden[-1] + 1])
    error = np.linalg.norm(track.standard_error[rows, column], axis=1)
    return _Curve(rows, frequency[rows], amplitude, np.where(known, error, 0.0), known)


def _peaks(curve: _Curve) -> list[_Rise]:
    amplitude = curve.amplitude
    peaks, facts = find_peaks(amplitude, prominence=1e-12, plateau_size=1)
    base = amplitude[peaks] - facts["prominences"]
    clear = amplitude[peaks] >= LEAST_RISE * base
    noise = [curve.error[first : last + 1].max() for first, last in _edges(facts)]
    clear &= facts["prominences"] >= 5.0 * np.asarray(noise, dtype=np.float64)
    _, _, left, right = peak_widths(amplitude, peaks[clear], rel_height=0.5)
    edges = [edge for edge, good in zip(_edges(facts), clear, strict=True) if good]
    return [
        _Rise(int(at), *edge, float(low), float(start), float(end))
        for at, edge, low, start, end in zip(peaks[clear], edges, base[clear], left, right, strict=True)
    ]


def _edges(facts: Mapping[str, NDArray[np.intp]]) -> list[tuple[int, int]]:
    return [(int(a), int(b)) for a, b in zip(facts["left_edges"], facts["right_edges"], strict=True)]


def _resonance(
    track: OrderTrack,
    curve: _Curve,
    order: float,
    plane: str,
    rise: _Rise,
    modes: Sequence[Candidate],
) -> PassedResonance:
    row = int(curve.rows[rise.at])
    start, end = np.interp([rise.left, rise.right], np.arange(curve.rows.size), curve.frequency)
    width = abs(float(start - end))
    top = float(curve.frequency[rise.at])
    # The amplitude is taken over a window, in which the frequency moves: no rise is placed better than that;
    # nor better than the stretch in which it is hidden.
    sweep = abs(float(np.gradient(curve.frequency)[rise.at])) / float(np.median(np.diff(track.time)))
    hidden = 0.5 * abs(float(curve.frequency[rise.first] - curve.frequency[rise.last]))
    error = max(0.16 * width, 0.15 * sweep * float(track.window[row]), hidden)
    amplitude = float(curve.amplitude[rise.at])
    evidence = LineEvidence(
        kind="steady",
        frequency=top,
        frequency_error=error,
        order=order,
        order_error=0.0,
        roundness=0.0,
        radius=amplitude,
        plane=plane,
        band=BAND,
        order_band=BAND,
    )
    return PassedResonance(
        order=order,
        plane=plane,
        time=float(track.time[row]),
        speed=float(track.speed[row]),
        frequency=top,
        frequency_error=error,
        width=width,
        amplitude=amplitude,
        rise=amplitude / max(rise.base, 1e-300),
        certain=bool(curve.known[rise.first : rise.last + 1].all()),
        name=name_line(evidence, modes),
    )
