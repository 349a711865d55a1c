"""Resonances passed on the way down: where an order's amplitude rises, and which mode that is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, peak_widths

from rotordrop.spectrum.candidates import Candidate
from rotordrop.spectrum.naming import LineEvidence, Name, name_line
from rotordrop.spectrum.orders import OrderTrack

Array = NDArray[np.float64]
TURN = 2.0 * math.pi


@dataclass(frozen=True, kw_only=True)
class PassedResonance:
    """One rise of an order's amplitude on the way down.

    Attributes
    ----------
    order : float
        The order that rises [1].
    plane : str
        Where it was seen.
    time : float
        When it was highest [s].
    speed : float
        Rotor speed then [rad/s].
    frequency : float
        Order times rotor speed then [Hz]: what was excited.
    frequency_error : float
        Half the distance over which the rise is within a tenth of its top [Hz].
    width : float
        Full width of the rise at half of its height [Hz].
    amplitude : float
        Longest half axis of the orbit [m], zero-to-peak.
    rise : float
        Amplitude over that beside the rise [1].
    certain : bool
        False where a steady line at the same frequency may have made part of the rise.
    name : Name
        The mode, if one is known there.
    """

    order: float
    plane: str
    time: float
    speed: float
    frequency: float
    frequency_error: float
    width: float
    amplitude: float
    rise: float
    certain: bool
    name: Name

    def as_json(self) -> dict[str, Any]:
        """Everything known about the resonance, ready for JSON; amplitudes are zero-to-peak in m."""
        return {
            "order": self.order,
            "plane": self.plane,
            "time_s": self.time,
            "speed_hz": self.speed / TURN,
            "frequency_hz": self.frequency,
            "frequency_error_hz": self.frequency_error,
            "width_hz": self.width,
            "amplitude_zero_to_peak_m": self.amplitude,
            "rise": self.rise,
            "certain": self.certain,
            "mode": self.name.label,
            "named": self.name.named,
            "confidence": self.name.confidence,
            "reason": self.name.reason,
        }


def find_resonances(
    track: OrderTrack,
    plane: str,
    *,
    candidates: Sequence[Candidate] = (),
    least_rise: float = 1.5,
    lowest_frequency: float = 5.0,
    band: float = 1000.0,
) -> tuple[PassedResonance, ...]:
    """Find where the amplitude of each tracked order rises and falls again while the speed falls.

    A rise counts when it stands ``least_rise`` times above the level on both sides and five standard errors
    clear of it. Where an order crosses a steady line (a pendulum swing, hum) the amplitude may hold some of
    it: such a rise is reported as uncertain.

    Parameters
    ----------
    track : OrderTrack
    plane : str
        Its name.
    candidates : sequence of Candidate
        Modes; those of kind "steady" are compared.
    least_rise : float
        [1].
    lowest_frequency : float
        Excitation below it [Hz] is left out.
    band : float
        Width of the band in which modes may lie [Hz].

    Returns
    -------
    tuple of PassedResonance
        In the order of time.
    """
    modes = [c for c in candidates if c.kind == "steady" and c.family != "mains"]
    found: list[PassedResonance] = []
    for column, order in enumerate(track.orders.tolist()):
        frequency = order * track.speed / TURN
        usable = frequency >= lowest_frequency
        if usable.sum() >= 5:
            found += [
                _resonance(track, column, plane, peak, usable, modes, band)
                for peak in _peaks(track, column, usable, least_rise)
            ]
    return tuple(sorted(found, key=lambda resonance: resonance.time))


@dataclass(frozen=True)
class _Rise:
    at: int
    base: float
    left: float
    right: float


def _peaks(track: OrderTrack, column: int, usable: NDArray[np.bool_], least_rise: float) -> list[_Rise]:
    amplitude = track.major_axis[usable, column]
    error = np.linalg.norm(track.standard_error[usable, column], axis=1)
    peaks, facts = find_peaks(amplitude, prominence=1e-12)
    base = amplitude[peaks] - facts["prominences"]
    clear = (amplitude[peaks] >= least_rise * base) & (facts["prominences"] >= 5.0 * error[peaks])
    _, _, left, right = peak_widths(amplitude, peaks[clear], rel_height=0.5)
    return [
        _Rise(int(at), float(low), float(start), float(end))
        for at, low, start, end in zip(peaks[clear], base[clear], left, right, strict=True)
    ]


def _resonance(
    track: OrderTrack,
    column: int,
    plane: str,
    rise: _Rise,
    usable: NDArray[np.bool_],
    modes: Sequence[Candidate],
    band: float,
) -> PassedResonance:
    order = float(track.orders[column])
    speed = track.speed[usable]
    frequency = order * speed / TURN
    place = np.arange(speed.size)
    start, end = np.interp([rise.left, rise.right], place, frequency)
    width = abs(float(start - end))
    top = float(frequency[rise.at])
    # The amplitude is taken over a window, in which the frequency moves: no rise is placed better than that.
    sweep = abs(float(np.gradient(frequency)[rise.at])) / float(np.median(np.diff(track.time)))
    error = max(0.16 * width, 0.15 * sweep * float(track.window[usable][rise.at]))
    rows = slice(math.floor(rise.left), math.ceil(rise.right) + 1)
    certain = bool(track.separable[usable, column][rows].all())
    amplitude = float(track.major_axis[usable, column][rise.at])
    evidence = LineEvidence(
        kind="steady",
        frequency=top,
        frequency_error=error,
        order=order,
        order_error=0.0,
        roundness=0.0,
        radius=amplitude,
        plane=plane,
        band=band,
        order_band=band,
    )
    return PassedResonance(
        order=order,
        plane=plane,
        time=float(track.time[usable][rise.at]),
        speed=float(speed[rise.at]),
        frequency=top,
        frequency_error=error,
        width=width,
        amplitude=amplitude,
        rise=amplitude / max(rise.base, 1e-300),
        certain=certain,
        name=name_line(evidence, modes),
    )
