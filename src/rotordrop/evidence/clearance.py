"""The lift check: a shaft pushed round its touchdown bearings at standstill shows their air gaps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.elements.touchdown_bearing import AIR_GAP
from rotordrop.errors import RecordError
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.finding import refuse_unusable
from rotordrop.evidence.quality.recorder import check_clock
from rotordrop.evidence.rest import PUSH, of_few, sag_under, stay
from rotordrop.known import NINETY, Known
from rotordrop.record.profile import Profile, rules_of
from rotordrop.record.record import Record, open_record
from rotordrop.require import require
from rotordrop.series import SIGMA_OF_MEDIAN, noise_by_differences

if TYPE_CHECKING:
    from rotordrop.machine import Machine

BLOCK = 0.02
"""Readings are averaged over this long: the shaft is moved by hand [s] (chosen)."""

_PLACE = math.radians(10.0)
"""Readings at the wall within this angle are one place [rad] (chosen): a hand trembles by less."""

_LEAST_PLACES = 5
_WIDEST_OPENING = 150.0
"""Directions without a reading at the wall may span this much [deg] (chosen): beyond it the places at the
edges fix the radius alone, and one that is off moves it several times as far."""

_APART = 3.0
"""A place this many standard deviations off the circle was not at the wall [1] (chosen)."""

_OUTSIDE = 3.0
"""Weight of a place outside a circle over that of one inside [1] (chosen): no shaft goes through a wall."""

_TOUCHING = 4.0
"""Readings at the wall lie within this many standard deviations of the outermost of them [1] (chosen)."""

_ROUND = 1.5e-6
"""How far places at a sound wall lie off a circle [m] (chosen): a ground bore."""

_AT_WALL = 2e-6
"""Places this close to the circle are at the wall however round it is [m] (chosen)."""

_SHARED = 0.15e-6
"""Standard uncertainty that all places share, by averaging over a shaft that moves [m] (chosen)."""

_LEAST_SCATTER = 0.5e-6
"""Roundness and blocks of readings are never better than this [m] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Clearance:
    """The hole in which the shaft moves, in one plane."""

    bearing: str
    """Touchdown bearing, or sensor plane where no machine is known."""
    radius: float
    """Radius of the circle through the places at the wall [m]."""
    radius_error: float
    """Its standard error by noise and roundness, widened as the places are few [m]."""
    sag: float = 0.0
    """What contact, race and support give way under the push [m]; zero where no machine is known."""
    sag_sigma: float = 0.0
    gain_sigma: float = 0.0
    """Standard deviations of the gap by the push and by the gain of the sensors [m], of a known machine."""
    centre: Array
    """Centre of the circle from the origin of the readings [m], shape (2,)."""
    polygon: Array
    """Places at the wall, round the circle [m], shape (K, 2)."""
    out_of_round: float
    """Largest deviation of a place at the wall from the circle [m]."""

    @property
    def gap(self) -> float:
        """Air gap [m]."""
        return self.radius - self.sag

    @property
    def standard_error(self) -> float:
        """Standard error of the air gap [m]; without a machine the gain of the sensors comes on top."""
        return math.hypot(self.radius_error, self.sag_sigma, self.gain_sigma)

    @property
    def interval_90(self) -> tuple[float, float]:
        """Interval that holds the air gap with 90 % probability [m]."""
        reach = NINETY * self.standard_error
        return self.gap - reach, self.gap + reach

    def as_json(self) -> dict[str, Any]:
        """Give everything in SI units, ready for JSON."""
        return stated(
            self,
            "bearing air_gap_m=gap standard_error_m interval_90_m radius_m sag_m centre_m polygon_m "
            "out_of_round_m",
        )

    def sentence(self) -> str:
        """The gap, where its centre lies, and how round it is."""
        low, high = (1e6 * limit for limit in self.interval_90)
        x, y = 1e6 * self.centre
        sag = f", the shaft goes {1e6 * self.sag:.1f} µm beyond it" if self.sag else ""
        return (
            f"{self.bearing}: air gap {1e6 * self.gap:.1f} µm (90 %: {low:.1f} to {high:.1f} µm){sag}, "
            f"centre at x = {x:+.1f} µm, y = {y:+.1f} µm, {len(self.polygon)} directions, "
            f"out of round by {1e6 * self.out_of_round:.1f} µm"
        )


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
        return stated(self, "bearing growth_m interval_90_m centre_moved_m=moved")

    def sentence(self) -> str:
        """The growth, and whether it is one."""
        low, high = (1e6 * limit for limit in self.interval_90)
        said = "" if low <= 0.0 <= high else "; it has worn" if self.growth > 0 else "; it has shrunk"
        return (
            f"{self.bearing}: grown by {1e6 * self.growth:+.1f} µm (90 %: {low:+.1f} to {high:+.1f} µm){said}"
        )


def with_measured_gaps(machine: Machine, found: Sequence[Clearance], source: str) -> Machine:
    """The machine with the gaps of a lift check, and where they come from."""
    gaps = {
        AIR_GAP.path_of(one.bearing): Known(
            value=one.gap,
            status="estimated",
            interval_90=one.interval_90,
            standard_error=one.standard_error,
            source=source,
            unit="m",
        )
        for one in found
    }
    return machine.with_values(gaps)


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
        Carries the motion along the straight line through the sensor planes to the touchdown bearings, and
        says how far these give way to the push, and how well the sensors are known.
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
    The push is not measured: it is taken as the weight on the bearing, within the limits of
    `rotordrop.evidence.rest.PUSH`. Not validated: the weight bends and tilts the shaft between the pushes,
    which is left out.
    """
    require(record, "record", str, Path, Record)
    if machine is not None:
        from rotordrop.machine import Machine as Described  # takes a while to load

        require(machine, "machine", Described)
    rules = rules_of(profile, mapping)
    read = record if isinstance(record, Record) else open_record(record, machine, profile=rules)[0]
    refuse_unusable([*check_clock(read, drop=False), *check_channels(read)], read.name)
    block = max(int(BLOCK * read.sampling_rate), 1)
    count = len(read.motion) // block
    if count < 2 * _LEAST_PLACES:
        raise RecordError(
            f"{len(read.motion) / read.sampling_rate:.3g} s are too short for a lift check; record while the "
            "shaft is pushed round"
        )
    path = read.motion[: count * block].reshape(count, block, -1, 2).mean(axis=1)
    names = [plane.bearing for plane in read.planes]
    if machine is None or len(names) < 2:
        return tuple(_clearance(path[:, i], name, read.name) for i, name in enumerate(names))
    # both bring the rotor model, which a lift check without a machine does not need
    from rotordrop.evidence.sensing import sensor_sigmas
    from rotordrop.rotor.unknowns import smallest_gap

    # the straight line through the sensor planes, as weights (B, P) of every plane at every bearing
    position, bearings = np.asarray(machine.rotor.node_positions), machine.touchdown_bearings
    sensed, wanted = (
        np.column_stack([np.ones(len(parts)), position[[part.node - 1 for part in parts]]])
        for parts in (read.planes, bearings)
    )
    weights = wanted @ np.linalg.pinv(sensed)
    path = np.einsum("bp,npc->nbc", weights, path)
    found = [_clearance(path[:, b], bearing.name, read.name) for b, bearing in enumerate(bearings)]
    sag, *limits = (sag_under(machine, share).total for share in (1.0, *PUSH))
    # the radius follows the mean gain of the sensors of a plane
    gains = np.square(sensor_sigmas("gain", read.sensors, smallest_gap(machine)))
    of_plane = [
        np.sqrt(np.sum(gains[read.plane_of == p])) / np.sum(read.plane_of == p) for p in range(len(names))
    ]
    gain = np.hypot.reduce(weights * of_plane, axis=1)
    return tuple(
        replace(
            one,
            sag=float(sag[b]),
            sag_sigma=float(limits[1][b] - limits[0][b]) / (2.0 * NINETY),
            gain_sigma=float(gain[b]) * one.radius,
        )
        for b, one in enumerate(found)
    )


def wear_between(before: Sequence[Clearance], after: Sequence[Clearance]) -> tuple[Wear, ...]:
    """Compare two lift checks, bearing by bearing, the shaft pushed alike in both."""
    earlier = {clearance.bearing: clearance for clearance in before}
    missing = [clearance.bearing for clearance in after if clearance.bearing not in earlier]
    if missing:
        raise RecordError(
            f"{missing[0]!r} is in the later lift check only; the earlier one has {', '.join(earlier)}"
        )
    found = []
    for later in after:
        first = earlier[later.bearing]
        growth = later.radius - first.radius
        reach = NINETY * math.hypot(first.radius_error, later.radius_error)
        found.append(
            Wear(
                bearing=later.bearing,
                growth=growth,
                interval_90=(growth - reach, growth + reach),
                moved=later.centre - first.centre,
            )
        )
    return tuple(found)


def _clearance(path: Array, name: str, record: str) -> Clearance:
    from scipy.spatial import ConvexHull, QhullError

    # corners of the convex hull: on its straight way from place to place a shaft is inside
    try:
        corners = np.asarray(path[ConvexHull(path).vertices])
    except QhullError as error:
        raise RecordError(
            f"{record}, {name}: the shaft did not move, or along a line only; push it round the whole bearing"
        ) from error
    wall = _agreeing(_stays(corners, np.mean(corners, axis=0)))
    _refuse_open(wall, np.mean(corners, axis=0) if len(wall) < 3 else _circle(wall)[0], name, record)
    centre, radius, scatter = _circle(wall)
    # corners lie outside by the noise of the readings: the mean of those at the wall does not
    distance = np.hypot(*(path - centre).T)
    near = path[np.abs(distance - radius) < max(_APART * scatter, _AT_WALL)]
    aside = np.angle(np.exp(1j * (_direction(near, centre)[:, None] - _direction(wall, centre))))
    at_wall = near[np.min(np.abs(aside), axis=1) < 0.5 * _PLACE]
    places = _stays(at_wall, centre, _TOUCHING * noise_by_differences(path, 3))
    _refuse_open(places, centre, name, record)
    centre, radius, scatter = _circle(places)
    offset = places - centre
    distance = np.hypot(*offset.T)
    jacobian = np.column_stack([offset / distance[:, None], np.ones(len(places))])
    of_radius = scatter * math.sqrt(float(np.linalg.inv(jacobian.T @ jacobian)[2, 2]))
    return Clearance(
        bearing=name,
        radius=radius,
        radius_error=math.hypot(of_few(of_radius, max(len(places) - 3, 1)), _SHARED),
        centre=np.asarray(centre),
        polygon=places[np.argsort(_direction(places, centre))],
        out_of_round=float(np.max(np.abs(distance - radius))),
    )


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


def _direction(places: Array, centre: Array) -> Array:
    return np.asarray(np.arctan2(*(places - centre).T[::-1]))


def _stays(path: Array, centre: Array, depth: float = math.inf) -> Array:
    """Where the shaft stayed in every direction that was visited; one push is one place however it trembles.

    What lies deeper [m] than the outermost of a place was on its way to the wall and does not count.
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
    places = []
    for group in np.split(path[np.roll(order, -first)], starts[1:]):
        reach = np.hypot(*(group - centre).T)
        distance, direction = stay(group[reach > np.max(reach) - depth], centre)
        places.append(centre + distance * direction)
    return np.array(places)


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
        scale = max(SIGMA_OF_MEDIAN * float(np.median(np.abs(rest))), 0.2e-6)
        weights = np.minimum(1.0, 1.5 * scale / np.maximum(np.abs(rest), 1e-12))
        step = np.linalg.lstsq(jacobian * weights[:, None], rest * weights, rcond=None)[0]
        centre, radius = centre + step[:2], radius + float(step[2])
        if float(np.max(np.abs(step))) < 1e-10:
            break
    free = max(len(wall) - 3, 1)
    scatter = math.sqrt(float(np.sum((weights * rest) ** 2)) / free)
    return centre, radius, max(scatter, _LEAST_SCATTER)
