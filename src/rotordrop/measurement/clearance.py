"""The lift check: a shaft pushed round its touchdown bearings at standstill shows their air gaps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.estimated import NINETY
from rotordrop.measurement.axes import along_sensors, planar_of, sensor_planes
from rotordrop.measurement.look.planes import arrangement_of
from rotordrop.measurement.profile import Profile, load_profile
from rotordrop.measurement.quality.channels import check_channels
from rotordrop.measurement.quality.clock import check_clock
from rotordrop.measurement.quality.finding import refuse_unusable
from rotordrop.measurement.readers import read_recording
from rotordrop.measurement.record import Record, record_of, sha256_of
from rotordrop.measurement.recording import Array

if TYPE_CHECKING:
    from rotordrop.machine import Machine

BLOCK = 0.02
"""Readings are averaged over this long: the shaft is moved by hand [s]."""

SECTORS = 72
"""Directions told apart; the outermost place in each counts."""

_LEAST_SECTORS = 5
_WIDEST_OPENING = 150.0
"""Directions without a reading at the wall may span this much [deg]."""

_INWARD = 3.0
"""A place this many standard deviations inside the circle was not at the wall."""

_AT_WALL = 2e-6
"""Places this close to the circle are at the wall however round it is [m]."""

_SHARED = 0.15e-6
"""Standard uncertainty that all places share, by averaging over a shaft that moves [m]."""

_LEAST_SCATTER = 0.5e-6
"""Roundness and blocks of readings are never better than this [m]."""


@dataclass(frozen=True, kw_only=True)
class Clearance:
    """The hole in which the shaft moves, in one plane.

    Attributes
    ----------
    bearing : str
        Touchdown bearing, or sensor plane where no machine is known.
    gap : float
        Radius of the circle through the places at the wall [m].
    standard_error : float
        Its standard error from noise and roundness [m]; the gain of the sensors comes on top.
    interval_90 : tuple of float
        Interval that holds the radius with 90 % probability [m].
    centre : array, shape (2,)
        Centre of the circle from the origin of the readings [m].
    polygon : array, shape (K, 2)
        Places at the wall, round the circle [m].
    out_of_round : float
        Largest deviation of a place at the wall from the circle [m].
    """

    bearing: str
    gap: float
    standard_error: float
    interval_90: tuple[float, float]
    centre: Array
    polygon: Array
    out_of_round: float

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
    """How a gap has grown between two lift checks.

    Attributes
    ----------
    bearing : str
        Touchdown bearing.
    growth : float
        Difference of the radii [m].
    interval_90 : tuple of float
        Interval that holds it with 90 % probability [m].
    moved : array, shape (2,)
        How the centre has moved [m].
    """

    bearing: str
    growth: float
    interval_90: tuple[float, float]
    moved: Array

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
        Planes with channels and angles, ``"NDE: X1 0 deg, Y1 90 deg"``, where there is no machine.
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
    read = record if isinstance(record, Record) else _read(Path(record), machine, mapping, profile)
    refuse_unusable([*check_clock(read, drop=False), *check_channels(read)], read.name)
    planes = sensor_planes(read.sensors)
    path = _averaged(planar_of(along_sensors(read.signals, read.sensors), planes), read.sampling_rate)
    names = [plane.bearing for plane in planes]
    if machine is not None and len(planes) > 1:
        path = np.einsum("bp,npc->nbc", _carried(machine, [plane.node for plane in planes]), path)
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


def _read(
    path: Path, machine: Machine | None, mapping: Sequence[str], profile: Profile | str | Path | None
) -> Record:
    rules = profile if isinstance(profile, Profile) else load_profile(profile) if profile else Profile()
    recording = read_recording(path, rules)
    sensors = machine.sensors if machine is not None else arrangement_of(recording, mapping).sensors
    return record_of(recording, sensors, profile=rules, path=path, sha256=sha256_of(path))


def _averaged(path: Array, rate: float) -> Array:
    """Means of blocks of readings, shape (K, P, 2)."""
    block = max(int(BLOCK * rate), 1)
    count = len(path) // block
    if count < 2 * _LEAST_SECTORS:
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
    centre, radius = 0.5 * (path.min(axis=0) + path.max(axis=0)), 0.25 * float(np.sum(np.ptp(path, axis=0)))
    wall, scatter = path, _LEAST_SCATTER
    for _ in range(12):
        wall = _outermost(path, centre)
        wall = wall[np.hypot(*(wall - centre).T) > 0.7 * radius]
        for _ in range(12):
            _refuse_open(wall, centre, name, record)
            centre, radius, scatter = _circle(wall)
            inside = np.hypot(*(wall - centre).T) - radius
            keep = inside > -_INWARD * scatter
            if keep.all():
                break
            wall = wall[keep]
    # the outermost of many readings lies outside by their noise: the mean of those at the wall does not
    distance = np.hypot(*(path - centre).T)
    wall = _mean_places(path[np.abs(distance - radius) < max(_INWARD * scatter, _AT_WALL)], centre)
    _refuse_open(wall, centre, name, record)
    return _found(wall, *_circle(wall), name)


def _mean_places(path: Array, centre: Array) -> Array:
    """Mean place in every direction that was visited."""
    sector = _sectors(path - centre)
    return np.array([path[sector == number].mean(axis=0) for number in np.unique(sector)])


def _sectors(offset: Array) -> Array:
    turns = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) + 0.5
    return np.asarray(np.floor(turns * SECTORS))


def _outermost(path: Array, centre: Array) -> Array:
    """The place furthest from the centre in every direction that was visited."""
    offset = path - centre
    sector = _sectors(offset)
    distance = np.hypot(*offset.T)
    order = np.lexsort((distance, sector))
    last = np.append(np.diff(sector[order]) > 0, True)
    return np.asarray(path[order[last]])


def _refuse_open(wall: Array, centre: Array, name: str, record: str) -> None:
    angle = np.sort(np.degrees(np.arctan2(*(wall - centre).T[::-1])))
    gaps = np.diff(np.append(angle, angle[0] + 360.0)) if len(angle) else np.array([360.0])
    if len(wall) >= _LEAST_SECTORS and float(np.max(gaps)) <= _WIDEST_OPENING:
        return
    at = int(np.argmax(gaps))
    where = f"between {angle[at]:.0f}° and {angle[at] + gaps[at]:.0f}°" if len(angle) else "anywhere"
    raise RecordError(
        f"{record}, {name}: the shaft was at the wall in {len(wall)} directions and not {where}; push it "
        f"round the whole bearing, at least {_LEAST_SECTORS} directions with none of {_WIDEST_OPENING:.0f}° "
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
