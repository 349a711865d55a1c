"""The first touches of shaft and touchdown bearings: by the air gap, and by the forces behind them.

Until the first touch the rotor follows the fitted fall; what deviates from it afterwards is the answer of the
free rotor to forces at its touchdown bearings. These forces are found by regularised least squares without
any contact model. Where the air gap is known, the times at which the rotor crosses it say how stiff the
contact is (Neisi 2020, section 5.1, Table 3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError, RecordError

if TYPE_CHECKING:
    from rotordrop.evidence.events import DropInstant
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

_KNOTS = 1e-4
"""Spacing of the knots between which a force runs straight [s] (chosen): a tenth of a short contact."""

_SPAN = 6e-3
"""Time from the end of the free fall on in which forces are sought [s]: errors of the fall grow with it."""

_BEND = 0.5
"""Standard deviation of the change of slope at a knot over the weight of the rotor [1 per knot]: about a half
sine of seven times the weight in 1 ms."""

_SIZE = 8.5
"""Standard deviation of a force over the weight of the rotor [1]; chosen, not measured."""

_LEAST_SHARE = 0.15
"""A contact force counts from this share of the largest, and from three standard errors (chosen)."""


@dataclass(frozen=True, kw_only=True)
class EarlyForces:
    """Forces on the rotor at its touchdown bearings during the first contacts."""

    time: Array
    """Record time [s], shape (K,)."""
    force: Array
    """Force on the rotor, x and y [N]; straight lines between the times, shape (K, B, 2)."""
    error: Array
    """Standard error of a component from noise and regularisation [N]; the rotor model counts as exact, shape
    (K, B)."""
    bearings: tuple[str, ...]
    """Names of the touchdown bearings."""


@dataclass(frozen=True, kw_only=True)
class FirstForce:
    """First force at a touchdown bearing."""

    bearing: str
    """Name of the touchdown bearing."""
    start: float
    """When the force sets in, in record time [s]."""
    end: float | None
    """When it has gone; None when it lasts beyond the forces known [s]."""
    peak_force: float
    peak_error: float
    """Largest force and its standard error [N]."""
    azimuth: float
    """Direction of the push at the peak [rad], counter-clockwise from +x."""


def early_forces(record: Record, machine: Machine, drop: DropInstant) -> EarlyForces:
    """Find the bearing forces from the end of the free fall on.

    Parameters
    ----------
    record : Record
        The record.
    machine : Machine
        The machine; its rotor model must be right, sensor positions included.
    drop : DropInstant
        The drop with its fitted fall.

    Raises
    ------
    RecordError
        When the fall was fitted without a rotor model, or the sensors are too few for the bearings.
    """
    if len({amb.node for amb in machine.ambs}) < 2:
        raise RecordError(
            f"{record.name}: the first contact forces need a fall fitted by the rotor model, and the machine "
            "has "
            f"{len(machine.ambs)} AMB planes; give the AMB nodes in the machine file"
        )
    from rotordrop.evidence.free_rotor import GRID, rotor_pushed_at_bearings

    rotor = rotor_pushed_at_bearings(machine, record.planes)
    if len(record.planes) < len(rotor.force_rows):
        raise RecordError(
            f"{len(record.planes)} sensor planes cannot tell the forces of {len(rotor.force_rows)} touchdown "
            "bearings apart"
        )
    begin = drop.fall.end - 2 * _KNOTS
    keep = (record.time >= begin) & (record.time <= begin + _SPAN)
    time = record.time[keep]
    knots = np.arange(begin, min(begin + _SPAN, float(time[-1])), _KNOTS)
    deviation = (record.signals[keep] - drop.fall.predicted(time)) * record.gains
    table = rotor.table(2 * np.pi * drop.levitated.frequency, 0.0, _SPAN + 2 * _KNOTS)
    ramp = np.concatenate(
        [np.zeros_like(table[:1]), np.cumsum(0.5 * GRID * (table[1:] + table[:-1]), axis=0)]
    )
    columns = _columns(ramp, time, knots, record)
    weight = rotor.mass * float(machine.gravity)
    force, error = _regularised(
        columns, deviation, drop.levitated.noise * record.gains, weight, (len(knots), len(rotor.force_rows))
    )
    names = tuple(bearing.name for bearing in machine.touchdown_bearings)
    return EarlyForces(time=knots, force=force, error=error, bearings=names)


def _columns(ramp: np.ndarray, time: Array, knots: Array, record: Record) -> Array:
    """Displacement along the sensors per force at bearing and knot, x then y: shape (T · S, 2 · B · K)."""
    from rotordrop.evidence.free_rotor import response_at

    seen = record.directions[:, 0] - 1j * record.directions[:, 1]
    parts = []
    for knot in knots:
        since = time - knot
        # a force that rises and falls along straight lines is the second difference of a ramp
        hat = (
            response_at(ramp, since + _KNOTS)
            - 2 * response_at(ramp, since)
            + response_at(ramp, since - _KNOTS)
        )
        parts.append(hat[:, record.plane_of, :] * seen[None, :, None] / _KNOTS)
    stacked = np.stack(parts, axis=-1)
    both = np.concatenate([stacked.real, -stacked.imag], axis=2)
    return both.reshape(len(time) * len(seen), -1)


def _regularised(
    columns: Array, deviation: Array, noise: Array, weight: float, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Forces, shape (K, B, 2), with little change of slope, and their standard error, shape (K, B).

    Two integrations lie between a force and a reading, so fast changes of a force hardly show in it; without
    a prior on them they would be all noise. The weight [N] of the rotor sets their size.
    """
    knots, bearings = shape
    accuracy = np.tile(1.0 / noise, len(deviation))
    weighted = columns * accuracy[:, None]
    bend = np.diff(np.eye(knots), 2, axis=0) / (_BEND * weight)
    prior = np.kron(np.eye(2 * bearings), bend.T @ bend + np.eye(knots) / (_SIZE * weight) ** 2)
    normal = np.linalg.inv(weighted.T @ weighted + prior)
    solution = normal @ (weighted.T @ (deviation.reshape(-1) * accuracy))
    error = np.sqrt(np.diag(normal)).reshape(2, bearings, knots)
    force = solution.reshape(2, bearings, knots).transpose(2, 1, 0)
    return force, np.max(error, axis=0).T


def first_forces(record: Record, machine: Machine, drop: DropInstant) -> tuple[FirstForce, ...]:
    """Find the first force at every touchdown bearing from the forces of `early_forces`.

    Bearings not touched in their time are left out. Touches less than 0.3 ms apart count as one.
    """
    forces = early_forces(record, machine, drop)
    found = (_first(forces, index) for index in range(len(forces.bearings)))
    return tuple(contact for contact in found if contact is not None)


def _first(forces: EarlyForces, index: int) -> FirstForce | None:
    size = np.hypot(*forces.force[:, index].T)
    sigma = forces.error[:, index]
    largest = float(np.max(np.hypot(forces.force[..., 0], forces.force[..., 1])[2:-3]))
    limit = np.maximum(_LEAST_SHARE * largest, 3.0 * sigma)
    above = size > limit
    above[[0, 1, -1, -2, -3]] = False  # the last knots are hardly seen by the samples
    if not above.any():
        return None
    first = int(np.argmax(above))
    below = np.flatnonzero(~above[first:])
    last = first + int(below[0]) - 1
    peak = first + int(np.argmax(size[first : last + 1]))
    ended = last < len(size) - 4
    return FirstForce(
        bearing=forces.bearings[index],
        start=_zero_crossing(forces.time, size, first, peak),
        end=_zero_crossing(forces.time, size, last, peak) if ended else None,
        peak_force=float(size[peak]),
        peak_error=float(sigma[peak]),
        azimuth=float(np.arctan2(forces.force[peak, index, 1], forces.force[peak, index, 0])),
    )


def _zero_crossing(time: Array, size: Array, edge: int, peak: int) -> float:
    """Where the flank of a force through its outermost knots meets zero [s]."""
    inward = 1 if peak > edge else -1
    inner = edge + inward if peak != edge else edge
    rise = size[inner] - size[edge]
    reach = size[edge] / rise if rise > 0 else 1.0
    return float(time[edge] - inward * _KNOTS * min(reach, 1.0))


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
