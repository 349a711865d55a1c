"""Values of one bearing that follow from its identified parameters, and how severe the drop was for it.

Safety, impulse, energy, indices and fatigue, with intervals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.elements.bearing_numbers import Ratings, numbers_of
from rotordrop.elements.table import following, parameter, published
from rotordrop.errors import SimulationError
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.evidence.look import INDEX_WINDOW
from rotordrop.known import NINETY, Known, Status
from rotordrop.machine import Machine
from rotordrop.severity.fatigue import fatigue_share


def bearing_values(
    machine: Machine, b: int, load: float, found: Sequence[FittedParameter]
) -> dict[str, Known]:
    """Values of one bearing under its static load [N], by the field names of the published document."""
    bearing = machine.touchdown_bearings[b]
    own = {one.row.field: one.estimate for one in found if one.owner == bearing.name}
    values = {field: own[field] for field in published() if field in own}
    for row, path, by in following():  # a bearing described without friction has none to find
        if (of := parameter(path).field) in values:
            values[row.field] = by(bearing, values[of])
    support, preload = values["support.stiffness_N_per_m"], values.get("preload_N")
    values["equivalent_stiffness_N_per_m"] = equivalent_stiffness(machine, b, load, support, preload)
    return values


def equivalent_stiffness(
    machine: Machine, b: int, load: float, support: Known, preload: Known | None
) -> Known:
    """Support and bearing in series [N/m], the bearing by its tangent at its static load [N].

    What holds the balls is not well known, the preload from the record or a clearance from the machine file,
    and the interval holds it beside that of the support.
    """
    bearing = machine.touchdown_bearings[b]
    path = "preload" if preload is not None else "clearance"
    held = preload if preload is not None else getattr(bearing.bearing, path, None)

    def races(value: float) -> float:
        changed = machine.with_values({f"{bearing.name}.bearing.{path}": value})
        return numbers_of(changed.touchdown_bearings[b]).tangent_stiffness(load)

    within = (held.interval_90 or getattr(held, "range", None)) if held is not None else None
    own = numbers_of(bearing).tangent_stiffness(load) if held is None else races(float(held))
    softer, stiffer = (own, own) if within is None else sorted(map(races, within))
    value = _series(support.value, own)
    low, high = support.interval_90 or (support.value, support.value)
    # two springs in series: their errors count as independent, each by the ends of its own interval
    down = math.hypot(value - _series(low, own), value - _series(support.value, softer))
    up = math.hypot(_series(high, own) - value, _series(support.value, stiffer) - value)
    return replace(
        support,
        value=value,
        interval_90=(value - down, value + up),
        standard_error=(down + up) / (2.0 * NINETY),
        start=None,
    )


def _series(one: float, other: float) -> float:
    return one * other / (one + other)


if TYPE_CHECKING:
    from rotordrop.estimate.estimate import Estimate, FittedParameter

Factor = Callable[[float], float]


FATIGUE = "severity.fatigue_by_16281"
NOT_BORNE = "the balls bear no such force"


def with_severity(estimate: Estimate, bearing: BearingDrop) -> BearingDrop:
    """The bearing with its severity among its values, by the fields of `severity.numbers.SEVERITY`.

    Intervals follow from those of the peaks and impacts. Impulse and energy add the errors of all impacts as
    if they were one, because they rest on the same contact and the same machine.
    """
    values, missing = {**bearing.values, **dict(_values(estimate, bearing))}, bearing.missing
    if bearing.force_vector is not None and bearing.impacts:
        own = numbers_of(estimate.machine.bearing(bearing.name))
        try:
            loads = own.element_loads_under(bearing.force_vector)
            values[FATIGUE] = _fatigue(bearing, own.ratings(), loads, estimate.speed)
        except SimulationError:  # no reason to lose the rest
            missing = {**missing, FATIGUE: NOT_BORNE}
    return replace(bearing, values=values, missing=missing)


def _values(estimate: Estimate, bearing: BearingDrop) -> Iterator[tuple[str, Known]]:
    stress, force = bearing.peak_stress, bearing.peak_force
    if stress.value > 0.0:
        yield "severity.static_safety", _falling(stress.known, static_safety_of_stress)
    ratings = numbers_of(estimate.machine.bearing(bearing.name)).ratings()
    if force.value > 0.0:
        # ISO 76: C0 / P0 where no axial force acts from outside; the preload counts in the stress alone
        yield "severity.static_safety_of_rating", _falling(force.known, lambda load: ratings.static / load)
    if "impacts" not in bearing.missing:
        yield "severity.impulse_N_s", _sum([one.impulse for one in bearing.impacts], "N s")
        yield "severity.skid_energy_J", _sum([one.dissipated_energy for one in bearing.impacts], "J")
    yield from _indices(estimate, bearing)


def static_safety_of_stress(stress: float) -> float:
    """Static safety factor s0 of a largest Hertz stress [Pa], ``(4200 MPa / σ)³`` [1].

    Source: ISO 76, which defines the static load rating of ball bearings by that stress at the most loaded
    ball; its load goes with the cube of the stress.
    """
    return (STATIC_STRESS / stress) ** 3


def _falling(known: Known, factor: Factor) -> Known:
    """A factor that falls where what it is of rises: a load, or an air gap."""
    interval = None
    if known.interval_90 is not None and known.interval_90[0] > 0.0:
        interval = (factor(known.interval_90[1]), factor(known.interval_90[0]))
    return Known(value=factor(known.value), status=known.status, interval_90=interval, unit="1")


def _sum(parts: list[Known], unit: str) -> Known:
    ends = [one.interval_90 for one in parts if one.interval_90 is not None]
    interval = (
        (sum(low for low, _ in ends), sum(high for _, high in ends)) if len(ends) == len(parts) else None
    )
    value = sum(one.value for one in parts)
    doubted: list[Status] = [one.status for one in parts if one.status != "determined"]
    return Known(value=value, status=[*doubted, "determined"][0], interval_90=interval, unit=unit)


def _indices(estimate: Estimate, bearing: BearingDrop) -> Iterator[tuple[str, Known]]:
    """Position and velocity index of the motion, as `rotordrop.look` has them; intervals from the air gap."""
    motion, gap = bearing.motions[-1], bearing.values.get("air_gap_m")
    if gap is None or not gap.value > 0.0 or len(motion.time) < 3:
        return
    during = (motion.time >= 0.0) & (motion.time <= INDEX_WINDOW)
    time, path = motion.time[during], motion.displacement[during]
    if not np.isfinite(path).all():  # of a model that lost the record
        return
    velocity = np.gradient(path, time, axis=0)
    mean = float(np.mean(np.hypot(*path.T)))
    yield "severity.position_index", _falling(gap, lambda value: mean / value)
    if estimate.speed > 0.0:
        rms = float(np.sqrt(np.mean(np.sum(velocity**2, axis=1))))
        yield "severity.velocity_index", _falling(gap, lambda value: rms / estimate.speed / value)


def _fatigue(bearing: BearingDrop, ratings: Ratings, loads: Array, speed: float) -> Known:
    """Share of the rating life as if the race turned with the rotor from the first impact on.

    It turns slower, so that the number is an upper end; the lower one is nothing.
    """
    time = bearing.force.time
    spin = np.where(time >= bearing.impacts[0].start, speed, 0.0)
    _, high = bearing.peak_force.interval_90 or (0.0, bearing.peak_force.value)
    share = fatigue_share(ratings, time, loads, spin)
    most = (high / bearing.peak_force.value) ** 3 * share  # as the life goes with the load
    return Known(value=share, status=bearing.peak_force.known.status, interval_90=(0.0, most), unit="1")
