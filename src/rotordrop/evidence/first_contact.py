"""First contact in the record and the stiffness it implies (Neisi 2020, section 5.1, Table 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError
from rotordrop.evidence.preprocess import local_polynomial

Array = NDArray[np.float64]

CLEAR = 6e-3
"""How far the rotor must come out of the air gap circle to count as out, over the gap [1], against noise."""

APPROACH = 1.5e-3
"""Stretch before the contact from which the impact speed is taken [s]."""


@dataclass(frozen=True, kw_only=True)
class TimedContact:
    """First contact of one bearing by the times at which the rotor crosses the air gap."""

    start: float
    end: float
    """t1 and t2: the rotor crosses the air gap outwards and comes back [s from power-off]."""
    timing_error: float
    """Standard error of either time [s]."""
    impact_speed: float
    """Radial speed at t1 [m/s]."""
    mass: float
    """Share of the rotor mass at this bearing [kg]."""
    equivalent_stiffness: float
    """``M (π/T)²`` [N/m], with T = t2 − t1 as half a period (the paper's Table 3)."""
    corrected_stiffness: float
    """The same from ``T = (2/ω)(π − atan(ω v0/g))``, which allows for gravity during the contact [N/m]."""
    standard_error: float
    """Standard error of ``equivalent_stiffness`` by the timing [N/m]."""
    indentation: float
    """Largest distance beyond the air gap during the contact, support included [m]."""

    @property
    def duration(self) -> float:
        """Impact duration T = t2 − t1 [s]."""
        return self.end - self.start


def identify_first_contacts(
    time: Array, place: Array, gaps: Array, loads: Array, gravity: float, noise: float
) -> tuple[TimedContact, ...]:
    """First contact of every bearing from the measured displacement.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    place : ndarray, shape (N, B, 2)
        Displacement at the bearings [m].
    gaps, loads : ndarray, shape (B,)
        Air gap [m] and static load share [N] of each bearing.
    gravity : float
        [m/s²].
    noise : float
        Noise of the displacement [m].

    Raises
    ------
    IdentificationError
        If the rotor does not reach the air gap of a bearing, or does not come back in the record.

    Notes
    -----
    Source: Neisi 2020, eq. (17). The printed formula takes the contact as half a period; gravity makes it
    longer, and a first contact may be two impacts in a row, so the value serves as a comparison and not as an
    estimate.
    """
    radius = np.hypot(place[..., 0], place[..., 1])
    return tuple(
        _first_contact(time, radius[:, b], float(gaps[b]), float(loads[b]) / gravity, gravity, noise)
        for b in range(len(gaps))
    )


def contact_intervals(time: Array, radius: Array, gap: float) -> Array:
    """Times at which the rotor leaves the air gap circle outwards and comes back [s], shape (K, 2).

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    radius : ndarray, shape (N,)
        Distance of the rotor from the bearing centre [m].
    gap : float
        Air gap [m]; a contact begins a share `CLEAR` beyond it and ends as far inside, against noise.
    """
    intervals = []
    k, outside = 0, radius > (1.0 + CLEAR) * gap
    while k < len(time):
        begins = np.flatnonzero(outside[k:])
        if not len(begins):
            break
        first = k + int(begins[0])
        back = np.flatnonzero(radius[first:] < (1.0 - CLEAR) * gap)
        if not len(back):
            intervals.append((_crossing(time, radius - gap, first), float(time[-1])))
            break
        last = first + int(back[0])
        intervals.append((_crossing(time, radius - gap, first), _crossing(time, gap - radius, last)))
        k = last
    return np.array(intervals).reshape(-1, 2)


def _first_contact(
    time: Array, radius: Array, gap: float, mass: float, gravity: float, noise: float
) -> TimedContact:
    outside = (radius > (1.0 + CLEAR) * gap) & (time > 0.0)
    if not outside.any():
        raise IdentificationError(
            f"the rotor comes to {1e6 * float(radius.max()):.4g} µm from the bearing centre at most and "
            "never reaches "
            f"the air gap of {1e6 * gap:.4g} µm. Check the settled tail and the gain of the sensors."
        )
    first = int(np.argmax(outside))
    back = np.flatnonzero(radius[first:] < (1.0 - CLEAR) * gap)
    if not len(back):
        raise IdentificationError(
            f"the rotor stays beyond the air gap of {1e6 * gap:.4g} µm from {1e3 * time[first]:.4g} ms to "
            "the end of the record. Check the settled tail: its radius must be that of the resting rotor."
        )
    start = _crossing(time, radius - gap, first)
    end = _crossing(time, gap - radius, first + int(back[0]))
    speed = _approach(time, radius, start)
    step = float(time[1] - time[0])
    timing = math.hypot(step / math.sqrt(12.0), noise / max(abs(speed), 1e-6))
    duration = max(end - start, step)
    stiffness = equivalent_stiffness(duration, mass)
    inside = slice(first, first + int(back[0]))
    return TimedContact(
        start=start,
        end=end,
        timing_error=timing,
        impact_speed=speed,
        mass=mass,
        equivalent_stiffness=stiffness,
        corrected_stiffness=corrected_stiffness(duration, mass, speed, gravity),
        standard_error=2.0 * math.sqrt(2.0) * stiffness * timing / duration,
        indentation=float(radius[inside].max() - gap),
    )


def _crossing(time: Array, level: Array, at: int) -> float:
    """Time at which a level crosses zero upwards, at or before a sample where it is positive [s]."""
    k = at
    while k > 0 and level[k - 1] > 0.0:
        k -= 1
    if k == 0:
        return float(time[0])
    low, high = float(level[k - 1]), float(level[k])
    return float(time[k - 1] + (time[k] - time[k - 1]) * low / (low - high))


def _approach(time: Array, radius: Array, start: float) -> float:
    """Radial speed at the contact from a parabola through the samples before it [m/s]."""
    before = (time > start - APPROACH) & (time < start)
    if int(before.sum()) < 5:
        return 0.0
    _, slope, _ = local_polynomial(time[before], radius[before], start, width=2.1 * APPROACH, order=2)
    return float(slope)


def equivalent_stiffness(duration: float, mass: float) -> float:
    """Stiffness [N/m] of a mass [kg] whose contact lasts half a period: ``M (π/T)²``, T the duration [s].

    Source: Neisi 2020, eq. (17).
    """
    return mass * (math.pi / duration) ** 2


def corrected_stiffness(duration: float, mass: float, speed: float, gravity: float) -> float:
    """Stiffness [N/m] from the contact duration with gravity: ``T = (2/ω)(π − atan(ω v0/g))``.

    Source: motion of a mass that hits a spring with v0 [m/s] under its weight; tends to eq. (17) of Neisi
    2020 for ω v0 ≫ g. A mass that is not seen to approach, for noise, counts as laid down (v0 = 0).
    """
    from scipy.optimize import brentq

    def excess(omega: float) -> float:
        return (2.0 / omega) * (math.pi - math.atan(omega * max(speed, 0.0) / gravity)) - duration

    omega = brentq(excess, 0.9 * math.pi / duration, 2.1 * math.pi / duration)
    return float(mass * omega**2)
