"""The first contact of shaft and touchdown bearing, by the times at which the rotor crosses the air gap.

They say how stiff the contact is (Neisi 2020, section 5.1, Table 3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError, RecordError

CLEAR = 6e-3
"""How far the rotor must come out of the air gap circle to count as out, over the gap [1], against noise
(chosen)."""

APPROACH = 1.5e-3
"""Stretch before the contact from which the impact speed is taken [s] (chosen)."""


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
    """First contact of every bearing from displacements (N, B, 2) [m] at times from power-off (N,) [s].

    Gaps (B,) [m] and static load shares (B,) [N] are those of the bearings, gravity is in m/s², noise in m.

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
    masses = loads / gravity
    return tuple(
        _first_contact(time, radius[:, b], float(gaps[b]), float(masses[b]), gravity, noise)
        for b in range(len(gaps))
    )


def contact_intervals(time: Array, radius: Array, gap: float) -> Array:
    """Times at which the rotor leaves the air gap circle outwards and comes back [s], shape (K, 2).

    By times (N,) [s] and distances from the bearing centre (N,) [m]; against noise a contact begins a share
    `CLEAR` beyond the gap [m] and ends as far inside.
    """
    level = radius - gap
    outside = np.flatnonzero(radius > (1.0 + CLEAR) * gap)
    inside = np.flatnonzero(radius < (1.0 - CLEAR) * gap)
    intervals: list[tuple[float, float]] = []
    at = 0
    while (begins := int(np.searchsorted(outside, at))) < len(outside):
        first = int(outside[begins])
        back = int(np.searchsorted(inside, first))
        if back == len(inside):
            intervals.append((_crossing(time, level, first), float(time[-1])))
            break
        at = int(inside[back])
        intervals.append((_crossing(time, level, first), _crossing(time, -level, at)))
    return np.array(intervals).reshape(-1, 2)


def _first_contact(
    time: Array, radius: Array, gap: float, mass: float, gravity: float, noise: float
) -> TimedContact:
    falling = time > 0.0
    contacts = contact_intervals(time[falling], radius[falling], gap)
    if not len(contacts):
        raise IdentificationError(
            f"the rotor comes to {1e6 * float(radius.max()):.4g} µm from the bearing centre at most and "
            f"never reaches the air gap of {1e6 * gap:.4g} µm. Check the settled tail and the gain of the "
            "sensors."
        )
    start, end = contacts[0].tolist()
    if end == time[-1] and radius[-1] >= (1.0 - CLEAR) * gap:
        raise IdentificationError(
            f"the rotor stays beyond the air gap of {1e6 * gap:.4g} µm from "
            f"{1e3 * float(time[time >= start][0]):.4g} ms to the end of the record. Check the settled tail: "
            "its radius must be that of the resting rotor."
        )
    # radial speed by a parabola through the samples before the contact
    before = (time > start - APPROACH) & (time < start)
    speed = 0.0
    if int(before.sum()) >= 5:
        slope = local_polynomial(time[before], radius[before], start, width=2.1 * APPROACH)[1]
        speed = float(slope)
    step = float(time[1] - time[0])
    timing = math.hypot(step / math.sqrt(12.0), noise / max(abs(speed), 1e-6))
    duration = max(end - start, step)
    stiffness = equivalent_stiffness(duration, mass)
    return TimedContact(
        start=start,
        end=end,
        timing_error=timing,
        impact_speed=speed,
        mass=mass,
        equivalent_stiffness=stiffness,
        corrected_stiffness=corrected_stiffness(duration, mass, speed, gravity),
        standard_error=2.0 * math.sqrt(2.0) * stiffness * timing / duration,
        indentation=float(radius[(time >= start) & (time <= end)].max() - gap),
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


def local_polynomial(
    time: Array, values: Array, at: float, *, width: float = 2e-3, order: int = 2
) -> tuple[Array, Array]:
    """Displacement and velocity at one instant from a polynomial through the samples on both sides.

    Parameters
    ----------
    time : array, shape (N,)
        Time [s].
    values : array, shape (N, ...)
        Displacement [m].
    at : float
        The instant [s].
    width : float
        Samples up to half of this away are used [s].
    order : int
        Order of the polynomial.

    Returns
    -------
    value, slope : array
        Displacement [m] and velocity [m/s], shape of one sample.
    """
    near = np.abs(time - at) <= width / 2
    if int(near.sum()) <= order + 1:
        raise RecordError(
            f"{int(near.sum())} samples within {width / 2:g} s of {at:.6g} s; a polynomial of order {order} "
            "needs "
            f"at least {order + 2}: widen the window"
        )
    scaled = (time[near] - at) / (width / 2)
    design = np.vander(scaled, order + 1, increasing=True)
    flat = values[near].reshape(int(near.sum()), -1)
    solution = np.linalg.lstsq(design, flat, rcond=None)[0]
    shape = values.shape[1:]
    return solution[0].reshape(shape), (solution[1] / (width / 2)).reshape(shape)
