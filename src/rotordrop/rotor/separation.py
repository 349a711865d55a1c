"""Amplification factors and separation margins of critical speeds, by the convention of API 617."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.rotor.campbell import CampbellDiagram, Crossing

Array = NDArray[np.float64]

LEAST_FACTOR = 2.5
"""Amplification factor below which a mode counts as critically damped and needs no margin [1]."""
HALF_POWER = 0.5 * math.sqrt(2.0)


def amplification_factor(damping_ratio: float) -> float:
    """Amplification factor of a mode [1], 1/(2ζ), for light damping. Source: API RP 684."""
    return math.inf if damping_ratio <= 0.0 else 0.5 / damping_ratio


def required_margin(factor: float, *, above: bool) -> float:
    """Separation margin required of a critical speed, as a share of the operating speed [1].

    ``above``: the critical speed lies above the operating range, else below it.
    Source: API 617 (8th edition, part 1), ``17 (1 − 1/(AF − 1.5))`` % below, 10 % more above; none up to an
    amplification factor of 2.5.
    """
    if factor < LEAST_FACTOR:
        return 0.0
    share = 0.17 * (1.0 - 1.0 / (factor - 1.5))
    return share + 0.10 if above else share


@dataclass(frozen=True, kw_only=True)
class Separation:
    """A critical speed set against a range of operating speeds."""

    crossing: Crossing
    """The critical speed."""
    factor: float
    """Amplification factor [1]."""
    margin: float
    """Distance from the nearer end of the range, as a share of that speed [1]; zero within the range."""
    required: float
    """Margin that API 617 asks for [1]."""

    @property
    def met(self) -> bool:
        """Whether the margin is as large as required."""
        return self.margin >= self.required

    @property
    def verdict(self) -> str:
        """What follows, in words."""
        if self.factor < LEAST_FACTOR:
            return "critically damped"
        return "met" if self.met else "not met"


def separations(diagram: CampbellDiagram, lowest: float, highest: float) -> tuple[Separation, ...]:
    """Set every forward or mixed critical speed of a diagram against operating speeds [rad/s].

    Critical speeds beyond the last speed of the diagram are not seen.
    Differs from the convention: the factor is that of the damped mode, not measured at half power of a
    response, which light damping makes the same.
    """
    found = []
    for crossing in diagram.crossings:
        if crossing.direction == "backward":
            continue
        factor = amplification_factor(crossing.damping_ratio)
        above = crossing.speed > highest
        edge = highest if above else lowest
        inside = lowest <= crossing.speed <= highest
        margin = 0.0 if inside else abs(crossing.speed - edge) / edge
        required = required_margin(factor, above=above)
        found.append(Separation(crossing=crossing, factor=factor, margin=margin, required=required))
    return tuple(found)


@dataclass(frozen=True, kw_only=True)
class ResponsePeak:
    """A peak of an unbalance response: speed [rad/s], amplitude [m], amplification factor [1]."""

    speed: float
    amplitude: float
    factor: float


def response_peaks(speed: Array, amplitude: Array) -> tuple[ResponsePeak, ...]:
    """Peaks of an amplitude [m], shape (S,), over the speed [rad/s], with ``N_c / (N_2 − N_1)``.

    N_1 and N_2 are the speeds at which the amplitude is 0.707 of the peak; where one of them is not reached,
    twice the other half width counts, and NaN stands where neither is. Source: API 617, figure of the
    amplification factor.
    """
    inner = (amplitude[1:-1] > amplitude[:-2]) & (amplitude[1:-1] >= amplitude[2:])
    return tuple(_peak(speed, amplitude, int(k) + 1) for k in np.flatnonzero(inner))


def _peak(speed: Array, amplitude: Array, k: int) -> ResponsePeak:
    level = HALF_POWER * amplitude[k]
    below, above = np.flatnonzero(amplitude[:k] <= level), np.flatnonzero(amplitude[k:] <= level)
    halves = []
    if len(below):
        halves.append(speed[k] - _between(speed, amplitude, int(below[-1]), level))
    if len(above):
        halves.append(_between(speed, amplitude, k + int(above[0]) - 1, level) - speed[k])
    width = 2.0 * float(np.mean(halves)) if halves else math.nan
    return ResponsePeak(
        speed=float(speed[k]),
        amplitude=float(amplitude[k]),
        factor=float(speed[k]) / width if halves else width,
    )


def _between(speed: Array, amplitude: Array, k: int, level: float) -> float:
    """Speed between samples k and k + 1 at which the amplitude crosses a level."""
    share = (level - amplitude[k]) / (amplitude[k + 1] - amplitude[k])
    return float(speed[k] + share * (speed[k + 1] - speed[k]))
