"""The lift check: a shaft pushed round its touchdown bearings at standstill shows their air gaps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.finding import refuse_unusable
from rotordrop.evidence.quality.recorder import check_clock
from rotordrop.known import NINETY
from rotordrop.record.profile import Profile, rules_of
from rotordrop.record.record import Record, open_record
from rotordrop.record.recording import Array
from rotordrop.series import noise_by_differences

if TYPE_CHECKING:
    from rotordrop.machine import Machine

BLOCK = 0.02
"""Readings are averaged over this long: the shaft is moved by hand [s]."""

_PLACE = math.radians(10.0)
"""Readings at the wall within this angle are one place [rad]."""

_LEAST_PLACES = 5
_WIDEST_OPENING = 150.0
"""Directions without a reading at the wall may span this much [deg]."""

_APART = 3.0
"""A place this many standard deviations off the circle was not at the wall [1]."""

_OUTSIDE = 3.0
"""Weight of a place outside a circle over that of one inside [1]: no shaft goes through a wall."""

_TOUCHING = 4.0
"""Readings at the wall lie within this many standard deviations of the outermost of them [1]."""

_ROUND = 1.5e-6
"""How far places at a sound wall lie off a circle [m]."""

_AT_WALL = 2e-6
"""Places this close to the circle are at the wall however round it is [m]."""

_SHARED = 0.15e-6
"""Standard uncertainty that all places share, by averaging over a shaft that moves [m]."""

_LEAST_SCATTER = 0.5e-6
"""Roundness and blocks of readings are never better than this [m]."""


@dataclass(frozen=True, kw_only=True)
class Clearance:
    """The hole in which the shaft moves, in one plane."""

    bearing: str
    """Touchdown bearing, or sensor plane where no machine is known."""
    gap: float
    """Radius of the circle through the places at the wall [m]."""
    standard_error: float
    """Its standard error from noise and roundness [m]; the gain of the sensors comes on top."""
    interval_90: tuple[float, float]
    """Interval that holds the radius with 90 % probability [m]."""
    centre: Array
    """Centre of the circle from the origin of the readings [m], shape (2,)."""
    polygon: Array
    """Places at the wall, round the circle [m], shape (K, 2)."""
    out_of_round: float
    """Largest deviation of a place at the wall from the circle [m]."""

    def as_json(self) -> dict[str, Any]:
        """Give everything in SI units, ready for JSON."""
        return {
            "bearing": self.bearing,
            "air_gap_m": self.gap,
            "standard_error_m": self.standard_error,
            "interval_90_m": list(self.interval_90),
            "centre_m": self.centre.tolist(),
            "polygon_m": self.polygon.tolist(),
            "out_of_round_m": self.out_of_round,
        }


@dataclass(frozen=True, kw_only=True)
class Wear:
    """How a gap has grown between two lift checks."""

    bearing: str
    """Touchdown bearing."""
    growth: float
    """Difference of the radii [m]."""
    interval_90: tuple[float, float]
    """Interval that holds it with 90 % probability [m]."""
    moved: Array
    """How the centre has moved [m], shape (2,)."""

    def as_json(self) -> dict[str, Any]:
        """Give everything in SI units, ready for JSON."""
        return {
            "bearing": self.bearing,
            "growth_m": self.growth,
            "interval_90_m": list(self.interval_90),
            "centre_moved_m": self.moved.tolist(),
        }


def measure_clearance(
    record: str | Path | Record,
    *,
    machine: Machine | None = None,
    mapping: Sequence[str] = (),
    profile: Profile | str | Path | None = None,
) -> tuple[Clearance, ...]:
    """Find the clearance circle in every plane from a shaft pushed round its touchdown bearings.

    Parameters
    ----------
    record : path-like or Record
        Readings at standstill. A few pushes in different directions do, a whole round is better.
    machine : Machine, optional
        Carries the motion along the straight line through the sensor planes to the touchdown bearings.
    mapping : sequence of str
        Planes with channels and angles, ``"NDE: X1 0 deg, Y1 90 deg"``, or sensors, ``"S_NDE_A = X1"``.
    profile : Profile or path-like, optional
        Reading rules of the recorder.

    Raises
    ------
    RecordError
        When the shaft was not pushed in enough directions; says which are missing.

    Notes
    -----
    Not validated: the weight bends and tilts the shaft between the pushes, which is left out.
    """
    rules = rules_of(profile, mapping)
    read = record if isinstance(record, Record) else open_record(record, machine, profile=rules)[0]
    refuse_unusable([*check_clock(read, drop=False), *check_channels(read)], read.name)
    path = _averaged(read.motion, read.sampling_rate)
    names = [plane.bearing for plane in read.planes]
    if machine is not None and len(names) > 1:
        path = np.einsum("bp,npc->nbc", _carried(machine, [plane.node for plane in read.planes]), path)
        names = [bearing.name for bearing in machine.touchdown_bearings]
    return tuple(_clearance(path[:, i], name, read.name) for i, name in enumerate(names))


def wear_between(before: Sequence[Clearance], after: Sequence[Clearance]) -> tuple[Wear, ...]:
    """Compare two lift checks, bearing by bearing."""
    earlier = {clearance.bearing: clearance for clearance in before}
    missing = [clearance.bearing for clearance in after if clearance.bearing not in earlier]
    if missing:
        raise RecordError(
            f"{missing[0]!r} is in the later lift check only; the earlier one has {', '.join(earlier)}"
        )
    return tuple(_wear(earlier[clearance.bearing], clearance) for clearance in after)


def _wear(before: Clearance, after: Clearance) -> Wear:
    growth = after.gap - before.gap
    halves = [0.5 * (c.interval_90[1] - c.interval_90[0]) for c in (before, after)]
    reach = math.hypot(*halves)
    return Wear(
        bearing=after.bearing,
        growth=growth,
        interval_90=(growth - reach, growth + reach),
        moved=after.centre - before.centre,
    )


def _averaged(path: Array, rate: float) -> Array:
    """Means of blocks of readings, shape (K, P, 2)."""
    block = max(int(BLOCK * rate), 1)
    count = len(path) // block
    if count < 2 * _LEAST_PLACES:
        raise RecordError(
            f"{len(path) / rate:.3g} s are too short for a lift check; record while the shaft is pushed round"
        )
    return np.asarray(path[: count * block].reshape(count, block, *path.shape[1:]).mean(axis=1))


def _carried(machine: Machine, nodes: list[int]) -> Array:
    """Weight (B, P) of every sensor plane in the straight line at every touchdown bearing."""
    place = np.asarray(machine.rotor.node_positions)
    sensed = np.column_stack([np.ones(len(nodes)), place[np.array(nodes) - 1]])
    wanted = place[np.array([bearing.node for bearing in machine.touchdown_bearings]) - 1]
    return np.asarray(np.column_stack([np.ones(len(wanted)), wanted]) @ np.linalg.pinv(sensed))


def _clearance(path: Array, name: str, record: str) -> Clearance:
    corners = _corners(path, name, record)
    wall = _agreeing(_mean_places(corners, np.mean(corners, axis=0)))
    _refuse_open(wall, np.mean(corners, axis=0) if len(wall) < 3 else _circle(wall)[0], name, record)
    centre, radius, scatter = _circle(wall)
    # corners lie outside by the noise of the readings: the mean of those at the wall does not
    distance = np.hypot(*(path - centre).T)
    near = path[np.abs(distance - radius) < max(_APART * scatter, _AT_WALL)]
    aside = np.angle(np.exp(1j * (_direction(near, centre)[:, None] - _direction(wall, centre))))
    at_wall = near[np.min(np.abs(aside), axis=1) < 0.5 * _PLACE]
    places = _mean_places(at_wall, centre, _TOUCHING * noise_by_differences(path, 3))
    _refuse_open(places, centre, name, record)
    return _found(places, *_circle(places), name)


def _agreeing(places: Array) -> Array:
    """The places on the circle that most of them share; all of them where no half of them shares one.

    A push that fell short, a stretch where the shaft was lifted off, dirt and a groove lie off that circle.
    Every circle through three places is tried, and places off it count alike however far they are; those
    outside count more, since a shaft that is lifted off for a quarter of the round shows a smaller circle.
    """
    trios = np.array(list(combinations(range(len(places)), 3)))
    if not len(trios):
        return places
    a, b, c = (places[trios[:, k]] for k in range(3))
    sides = np.stack([b - a, c - a], axis=1)
    flat = np.abs(np.linalg.det(sides)) < 1e-3 * np.sum(sides**2, axis=(1, 2))
    sides[flat] = np.eye(2)
    centres = a + np.linalg.solve(sides, 0.5 * np.sum(sides**2, axis=2)[..., None])[..., 0]
    radii = np.hypot(*(a - centres).T)
    rest = np.hypot(*(places - centres[:, None]).transpose(2, 0, 1)) - radii[:, None]
    off = np.minimum(np.abs(rest) / _ROUND, _APART) ** 2
    cost = np.sum(np.where(rest > 0.0, _OUTSIDE * off, off), axis=1)
    cost[flat] = np.inf
    shared = np.abs(rest[int(np.argmin(cost))]) < _APART * _ROUND
    return places[shared] if 2 * np.count_nonzero(shared) > len(places) else places


def _corners(path: Array, name: str, record: str) -> Array:
    """Corners of the convex hull of the path: on its straight way from place to place a shaft is inside."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(path[ConvexHull(path).vertices])
    except QhullError as error:
        raise RecordError(
            f"{record}, {name}: the shaft did not move, or along a line only; push it round the whole bearing"
        ) from error


def _direction(places: Array, centre: Array) -> Array:
    return np.asarray(np.arctan2(*(places - centre).T[::-1]))


def _mean_places(path: Array, centre: Array, depth: float = math.inf) -> Array:
    """Mean place of every direction that was visited; one push is one place however it trembles.

    What lies deeper [m] than the outermost of a place was on its way to the wall and does not count. Distance
    and direction are averaged: the mean of points along an arc would lie inside it.
    """
    order = np.argsort(_direction(path, centre))
    angle = _direction(path, centre)[order]
    opening = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    first = int(np.argmax(opening)) + 1
    turned = np.mod(np.roll(angle, -first) - angle[first % len(angle)], 2.0 * np.pi)
    starts = [0]
    for k in range(1, len(turned)):
        if turned[k] - turned[starts[-1]] > _PLACE:
            starts.append(k)
    means = []
    for group in np.split(path[np.roll(order, -first)], starts[1:]):
        distance = np.hypot(*(group - centre).T)
        touching = distance > np.max(distance) - depth
        along = group[touching].mean(axis=0) - centre
        means.append(centre + along * float(np.mean(distance[touching])) / math.hypot(*along))
    return np.array(means)


def _refuse_open(wall: Array, centre: Array, name: str, record: str) -> None:
    angle = np.sort(np.degrees(np.arctan2(*(wall - centre).T[::-1])))
    gaps = np.diff(np.append(angle, angle[0] + 360.0)) if len(angle) else np.array([360.0])
    if len(wall) >= _LEAST_PLACES and float(np.max(gaps)) <= _WIDEST_OPENING:
        return
    at = int(np.argmax(gaps))
    where = f"between {angle[at]:.0f}° and {angle[at] + gaps[at]:.0f}°" if len(angle) else "anywhere"
    raise RecordError(
        f"{record}, {name}: the shaft was at the wall in {len(wall)} directions and not {where}; push it "
        f"round the whole bearing, at least {_LEAST_PLACES} directions with none of {_WIDEST_OPENING:.0f}° "
        "left out"
    )


def _circle(wall: Array) -> tuple[Array, float, float]:
    """Circle through places by least squares of the distance: centre [m], radius [m], robust scatter [m]."""
    design = np.column_stack([2.0 * wall, np.ones(len(wall))])
    found = np.linalg.lstsq(design, np.sum(wall**2, axis=1), rcond=None)[0]
    centre, radius = found[:2], math.sqrt(max(float(found[2] + found[:2] @ found[:2]), 0.0))
    weights = np.ones(len(wall))
    rest = np.zeros(len(wall))
    for _ in range(30):
        offset = wall - centre
        distance = np.hypot(*offset.T)
        jacobian = np.column_stack([offset / distance[:, None], np.ones(len(wall))])
        rest = distance - radius
        scale = max(1.4826 * float(np.median(np.abs(rest))), 0.2e-6)
        weights = np.minimum(1.0, 1.5 * scale / np.maximum(np.abs(rest), 1e-12))
        step = np.linalg.lstsq(jacobian * weights[:, None], rest * weights, rcond=None)[0]
        centre, radius = centre + step[:2], radius + float(step[2])
        if float(np.max(np.abs(step))) < 1e-10:
            break
    free = max(len(wall) - 3, 1)
    scatter = math.sqrt(float(np.sum((weights * rest) ** 2)) / free)
    return centre, radius, max(scatter, _LEAST_SCATTER)


def _found(wall: Array, centre: Array, radius: float, scatter: float, name: str) -> Clearance:
    from scipy.special import stdtrit

    offset = wall - centre
    distance = np.hypot(*offset.T)
    jacobian = np.column_stack([offset / distance[:, None], np.ones(len(wall))])
    error = scatter * math.sqrt(float(np.linalg.inv(jacobian.T @ jacobian)[2, 2]))
    reach = math.hypot(error * float(stdtrit(max(len(wall) - 3, 1), 0.95)), NINETY * _SHARED)
    order = np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))
    return Clearance(
        bearing=name,
        gap=radius,
        standard_error=math.hypot(error, _SHARED),
        interval_90=(radius - reach, radius + reach),
        centre=np.asarray(centre),
        polygon=wall[order],
        out_of_round=float(np.max(np.abs(distance - radius))),
    )
