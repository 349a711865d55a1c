"""When the magnetic bearings let the rotor go, from the readings: the first guess and the instant."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.table import parameter
from rotordrop.errors import NoDropError, RecordError
from rotordrop.evidence.ends import falling
from rotordrop.evidence.levitated import LevitatedModel, fit_levitated
from rotordrop.evidence.measured_speed import require_speed
from rotordrop.known import NINETY
from rotordrop.record.axes import Plane, along_sensors, planar_of
from rotordrop.series import curvature
from rotordrop.units import fall_time, format_quantity, percent

if TYPE_CHECKING:
    from rotordrop.elements.touchdown_bearing import TouchdownBearing
    from rotordrop.evidence.fall import Fall
    from rotordrop.evidence.free_rotor import FreeRotor
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

FALLEN_SHARE = 0.35
"""A rotor that sank by this share of the air gap has been dropped [1] (chosen)."""

NEAREST_CONTACT = 0.6
"""A rotor closer than this to where it levitated, in nominal air gaps, touches nothing: what shakes it there
is its own bending after the release (chosen)."""

MODEL_ERROR = 1.5e-5
"""Standard uncertainty of the drop instant by what the release model leaves out [s]."""

AFTER_FALL = 2.0
"""How long after the fall a record is looked at for its first contact [s], before all of it is (chosen)."""

_BLOCK = 65536
"""Samples that are looked at in one piece [1] (chosen): a megabyte or two of memory."""
_CONTACT_FILTER = 1e-3
"""Window of the curvature by which a contact is seen [s] (chosen)."""

_THROWN = 1.0
"""Range over the air gap that no levitated rotor has [1]: that of the limit C/D of ISO 14839-2."""

_UNSURE = 3e-3
"""How far the first guess of the drop may be off [s] (chosen): a lift that remains delays the fall."""


@dataclass(frozen=True, kw_only=True)
class PowerOff:
    """When the magnetic bearings let the rotor go."""

    value: float
    """Power-off, in record time [s]."""
    standard_error: float
    """Its standard uncertainty, noise and model together [s]."""
    contact: float
    """End of the free fall [s]."""
    method: str
    """How it was found."""
    notes: tuple[str, ...] = ()
    """What to know about this value."""

    def __float__(self) -> float:
        return self.value

    @property
    def interval_90(self) -> tuple[float, float]:
        """Interval that holds it with 90 % probability [s]."""
        half = NINETY * self.standard_error
        return self.value - half, self.value + half


@dataclass(frozen=True, kw_only=True)
class DropInstant(PowerOff):
    """The same where the record shows the levitated rotor before."""

    fall: Fall
    """The fit behind it, with remanent lift and misfit."""
    levitated: LevitatedModel
    """Readings of all sensors before the drop."""


@dataclass(frozen=True, kw_only=True)
class CoarseDrop:
    """Where the rotor sinks, found without any model."""

    instant: float
    """Drop to within some milliseconds [s]."""
    sunk: float
    """When the fastest plane had sunk by `FALLEN_SHARE` of its gap [s]."""
    contact: float
    """First sudden acceleration after that, or the end of the record [s]."""
    speed: float
    """Shaft speed before the drop [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Beginning:
    """First guess of the drop, and what all sensors read before it."""

    coarse: CoarseDrop
    levitated: LevitatedModel


def find_fall(record: Record, rotor: FreeRotor, begun: Beginning, *, until: float | None = None) -> Fall:
    """Fit the fall by a released rotor, in the planes whose sensors give x and y.

    The window ends where the readings leave the free fall, or at `until` [s] whether they fit or not.
    """
    from rotordrop.evidence.fall import fit_fall

    coarse = begun.coarse
    window = (coarse.instant, coarse.sunk, coarse.contact)
    if until is not None:
        window = (coarse.instant, until, until)
    return fit_fall(record.whole, rotor, of_whole(begun.levitated, record), window)


def of_whole(levitated: LevitatedModel, record: Record) -> LevitatedModel:
    """The levitated motion of a record in the planes whose sensors give x and y."""
    return of_part(levitated, record, record.whole)


def of_part(levitated: LevitatedModel, record: Record, part: Record) -> LevitatedModel:
    """The levitated motion of a record in the channels of a part of it."""
    if len(part.sensors) == len(record.sensors):
        return levitated
    return levitated.of_channels([record.sensors.index(sensor) for sensor in part.sensors])


def instant_of(fall: Fall, levitated: LevitatedModel, record: Record) -> DropInstant:
    """Power-off by a fitted fall, with what the release model leaves out."""
    error = float(np.hypot(fall.standard_error, MODEL_ERROR))
    notes = []
    if fall.misfit > 2.0:
        notes.append(
            f"the fall deviates from the released rotor by {fall.misfit**0.5:.1f} × the noise: the drop "
            "instant is less certain than stated"
        )
    return DropInstant(
        value=fall.instant,
        standard_error=error,
        contact=fall.end,
        method=f"{fall.rotor.description}; {error * record.sampling_rate:.2g} of a sample",
        fall=fall,
        levitated=levitated,
        notes=tuple(notes),
    )


def coarse_drop(record: Record, machine: Machine) -> CoarseDrop:
    """Find where the rotor sinks by a share of the air gap, and the first sudden acceleration after it.

    Raises
    ------
    RecordError
        When it never does, or has done so from the beginning.
    """
    gaps, gravity = nominal_gaps(machine, record), float(machine.gravity)
    turn = 2 * np.pi / max(abs(float(require_speed(record)[1][0])), 1.0)
    first = max(int(min(turn, 0.02) * record.sampling_rate), 8)
    early = until_fallen(record, gaps, first)
    found = _coarse_drop(early, gravity, gaps, first)
    if early is not record and found.contact > early.time[-1] - 2.0 * _CONTACT_FILTER:
        return _coarse_drop(record, gravity, gaps, first)
    return found


def until_fallen(record: Record, gaps: Array, first: int) -> Record:
    """A record until shortly after all planes are low; all of it where they never are.

    A coast-down goes on for a minute after its fall of some milliseconds: what is asked of the fall must not
    hold that minute in memory several times over.
    """

    def height(part: slice) -> Array:
        return planar_of(along_sensors(record.signals[part], record.sensors), record.planes)[:, :, 1]

    start = np.mean(height(slice(first)), axis=0)
    for begin in range(0, len(record.time), _BLOCK):
        fallen = (start - height(slice(begin, begin + _BLOCK)) > FALLEN_SHARE * gaps).all(axis=1)
        if fallen.any():
            end = begin + int(np.argmax(fallen)) + round(AFTER_FALL * record.sampling_rate)
            return record if end >= len(record.time) else record.window(-np.inf, float(record.time[end]))
    return record


def beginning_of(record: Record, machine: Machine) -> Beginning:
    """First guess of the drop, and what all sensors read before it.

    Where one end touches and is thrown up again before the other has sunk, both are low long after the
    release; what the rotor did before shows as soon as the levitated motion is known.

    Raises
    ------
    RecordError
        When the rotor does not fall in the record, or the record does not begin before the fall.
    """
    fell = falling(record, machine)
    coarse = coarse_drop(fell, machine)
    levitated = fit_levitated(record, coarse.instant - _UNSURE, speed=coarse.speed)
    if levitated.end <= coarse.instant - _UNSURE - 2.0 / record.sampling_rate:
        coarse = _sooner(fell, machine, of_part(levitated, record, fell), coarse)
        levitated = fit_levitated(record, coarse.instant - _UNSURE, speed=coarse.speed)
    return Beginning(coarse=coarse, levitated=levitated)


def _sooner(record: Record, machine: Machine, levitated: LevitatedModel, coarse: CoarseDrop) -> CoarseDrop:
    """The first guess of a drop by the way from the levitated motion, whatever its direction."""
    gaps, gravity = nominal_gaps(machine, record), float(machine.gravity)
    near = record.window(-np.inf, coarse.contact)
    away = planar_of(along_sensors(near.signals - levitated.readings(near.time), near.sensors), near.planes)
    way = np.hypot(away[:, :, 0], away[:, :, 1])
    gone = (way > FALLEN_SHARE * gaps).any(axis=1) & (near.time > levitated.end)
    if not gone.any():
        return coarse
    sunk = int(np.argmax(gone))
    # the unbalance throws a widely circling plane further than it falls, but not before it was let go
    fallen = float(near.time[sunk]) - fall_time(np.max(way[sunk]), gravity)
    instant = max(fallen, levitated.end)
    contact = first_sudden(near, gravity, instant, max(sunk, first_sample(way > NEAREST_CONTACT * gaps)))
    return replace(coarse, instant=instant, sunk=float(near.time[sunk]), contact=contact)


def _coarse_drop(record: Record, gravity: float, gaps: Array, first: int) -> CoarseDrop:
    speed_time, readings = require_speed(record)
    height = record.motion[:, :, 1]
    start = np.mean(height[:first], axis=0)
    low = start - height > FALLEN_SHARE * gaps
    if not low.all(axis=1).any():
        _refuse_without_drop(record, start, gaps)
    sunk = sinking(low)
    fastest = float(np.max(start - height[sunk]))
    instant = record.time[sunk] - fall_time(fastest, gravity)
    if instant < record.time[0] or record.time[sunk] - record.time[0] < first / record.sampling_rate:
        raise NoDropError(
            record.name,
            f"the rotor has sunk by {format_quantity(fastest, 'length')} at {record.time[sunk]:.6g} s, "
            f"{(record.time[sunk] - record.time[0]) * 1e3:.3g} ms after the record begins: "
            "the levitated part before the drop is missing",
            "give a recording with pre-trigger",
            begins_late=True,
        )
    before = speed_time < instant
    speed = float(np.median(readings[before])) if before.any() else float(readings[0])
    away = record.motion - np.mean(record.motion[:first], axis=0)
    far = np.hypot(*np.moveaxis(away, -1, 0)) > NEAREST_CONTACT * gaps
    contact = first_sudden(record, gravity, instant, max(sunk, first_sample(far)))
    return CoarseDrop(instant=float(instant), sunk=float(record.time[sunk]), contact=contact, speed=speed)


def sinking(low: NDArray[np.bool_]) -> int:
    """First sample of the fall in which all planes (N, P) come to be low, at which any of them is.

    A plane that circles widely while levitated, such as one between the bearings near a bending critical
    speed, is low once a turn; what it did before all were low does not count.
    """
    both = int(np.argmax(low.all(axis=1)))
    high = ~low[: both + 1]
    return int(np.min(np.where(high.any(axis=0), both + 1 - np.argmax(high[::-1], axis=0), 0)))


def fall_accelerations(away: Array, reach: float, rate: float) -> Array:
    """Accelerations of a plane from a tenth of its way to `FALLEN_SHARE` of it [m/s²], one for each time.

    A falling rotor has up to that of gravity; a swing along the race goes slower, by its amplitude over the
    air gap. No machine, unit or direction need be known; a wrong clock shows by its square. The first way is
    the fall, unless the record begins while the rotor is still being lifted; later ones are rebounds too.

    Parameters
    ----------
    away : array, shape (N,)
        Distance from where the plane was first [m].
    reach : float
        How far it goes in all [m].
    rate : float
        Samples per second [Hz].
    """
    beyond = away > FALLEN_SHARE * reach
    begins = np.flatnonzero(beyond & ~np.append(False, beyond[:-1]))
    near = np.flatnonzero(away < 0.1 * reach)
    before = np.searchsorted(near, begins) - 1
    if not len(begins) or before[0] < 0:
        return np.array([np.inf])  # it circled as wide as this before the fall
    took = (begins - near[before]) / rate
    found: Array = 2.0 * reach * (np.sqrt(FALLEN_SHARE) - np.sqrt(0.1)) ** 2 / took**2
    return found


def first_sample(far: NDArray[np.bool_]) -> int:
    """First sample at which any plane (N, P) is far, or the last one."""
    at = np.flatnonzero(far.any(axis=1))
    return int(at[0]) if len(at) else len(far) - 1


def nominal_gaps(machine: Machine, record: Record) -> Array:
    """Nominal air gaps [m], shape (P,), of the touchdown bearings nearest to the sensor planes."""
    return np.array([float(_bearing_at(machine, plane).air_gap) for plane in record.planes])


def planes_at_bearings(machine: Machine, record: Record) -> set[int]:
    """Numbers of the planes nearest to their touchdown bearings; between them the rotor bends more."""
    place = machine.rotor.node_positions
    nearest: dict[str, tuple[float, int]] = {}
    for number, plane in enumerate(record.planes):
        away = abs(place[_bearing_at(machine, plane).node - 1] - place[plane.node - 1])
        nearest[plane.bearing] = min((away, number), nearest.get(plane.bearing, (np.inf, 0)))
    return {number for _, number in nearest.values()}


def expected_gap(machine: Machine, plane: Plane) -> tuple[float, float]:
    """Air gap that a machine file expects at a sensor plane, and its standard error [m]."""
    from rotordrop.rotor.unknowns import prior

    gap = _bearing_at(machine, plane).air_gap
    expected = prior(parameter("air_gap", "bearing"), gap, scale=float(gap))
    return expected.mean, expected.sigma


def _bearing_at(machine: Machine, plane: Plane) -> TouchdownBearing:
    named = [b for b in machine.touchdown_bearings if b.name == plane.bearing]
    position = machine.rotor.node_positions
    return min(
        named or machine.touchdown_bearings,
        key=lambda b: abs(position[b.node - 1] - position[plane.node - 1]),
    )


def _refuse_without_drop(record: Record, start: Array, gaps: Array) -> None:
    path, height = record.motion, record.motion[:, :, 1]
    deepest = float(np.max((start - np.min(height, axis=0)) / gaps))
    ranges = ", ".join(format_quantity(float(r), "length") for r in np.ptp(height, axis=0))
    sunk_now = start < -FALLEN_SHARE * gaps
    thrown = np.ptp(path, axis=0).max() > _THROWN * float(np.min(gaps))
    if thrown or (sunk_now.any() and deepest < FALLEN_SHARE):
        raise NoDropError(
            record.name,
            f"no drop in the record: it begins with the rotor at "
            f"{format_quantity(float(np.min(start)), 'length')} and moving by up to "
            f"{format_quantity(float(np.ptp(path, axis=0).max()), 'length')}, as one that was dropped before",
            "give the recording of the drop, with pre-trigger; readings at standstill are its settled tail",
            begins_late=True,
        )
    raise NoDropError(
        record.name,
        f"the vertical displacement spans {ranges} in its planes and sinks by "
        f"{percent(deepest)} of the nominal air gap at most, a dropped rotor by more than "
        f"{percent(FALLEN_SHARE)} in all planes",
        "give a recording that holds the drop; if this one does, correct polarity or unit",
        begins_late=False,
    )


def first_sudden(record: Record, gravity: float, instant: float, sunk: int) -> float:
    """First time after sinking at which the acceleration cannot be that of a free rotor [s]."""
    samples = max(round(_CONTACT_FILTER * record.sampling_rate) // 2 * 2 + 1, 5)
    turned = curvature(record.motion, record.sampling_rate, samples)
    size = np.max(np.hypot(turned[:, :, 0], turned[:, :, 1] + gravity), axis=1)
    levitated = record.time < instant - _UNSURE
    usual = float(np.max(size[levitated])) if levitated.any() else 0.0
    limit = gravity + max(1.5 * gravity, 2.0 * usual)
    after = np.flatnonzero(size[sunk:] > limit)
    return float(record.time[sunk + after[0]]) if len(after) else float(record.time[-1])


RINGING_ERROR = 4e-4
"""Standard uncertainty [s] by the velocity of the orbit and of the released sag at power-off."""

RINGING = 5e-6
"""Ringing of the released sag [m] (chosen); it lasts as long as the fall."""

INDEPENDENT = 4.0
"""Readings of a plane during the fall, or stretches of a swing, that count as independent: their errors are
alike [1] (chosen)."""

MARGIN = 4e-4
"""Time before the first contact that the parabola keeps away from [s] (chosen): it is seen in smoothed
readings."""

FEWEST = 20
"""Samples that a parabola needs (chosen)."""

EARLIEST = 5e-3
"""Power-off may lie at most this long before the record begins [s] (chosen)."""


def begins_with_fall(record: Record, machine: Machine) -> bool:
    """Whether the rotor has fallen by a share of its gap before it could have levitated for 5 ms."""
    fell = falling(record, machine)
    gaps = nominal_gaps(machine, fell)
    height = until_fallen(fell, gaps, first=1).motion[:, :, 1]
    sunk = height[:1] - height > FALLEN_SHARE * gaps
    if not sunk.all(axis=1).any():
        return False
    fallen = float(record.time[sinking(sunk)] - record.time[0])
    needed = fall_time(FALLEN_SHARE * float(np.max(gaps)), float(machine.gravity))
    return fallen < needed + EARLIEST


def power_off_of_fall(record: Record, machine: Machine) -> PowerOff:
    """Fit one fall with remanent lift to all planes up to the first contact.

    Raises
    ------
    RecordError
        When too little of the fall is recorded.

    Notes
    -----
    The rotor is taken to be at rest vertically at power-off, so the time at which the fall has no velocity is
    power-off, whether it is in the record or not.
    """
    fell = falling(record, machine)
    gravity, height = float(machine.gravity), fell.motion[:, :, 1]
    low = height[0] - height > FALLEN_SHARE * nominal_gaps(machine, fell)
    start = float(record.time[0])
    contact = first_sudden(fell, gravity, start, sinking(low))
    chosen = record.time < contact - MARGIN
    count = int(np.count_nonzero(chosen))
    if count < FEWEST:
        raise RecordError(
            f"{record.name}: the record begins {1e3 * (contact - start):.2f} ms before the first contact, "
            f"{count} samples of the fall are left; at least {FEWEST} are needed. Record with pre-trigger"
        )
    value, error = _released(record.time[chosen] - start, height[chosen], gravity)
    if value < -EARLIEST:
        raise RecordError(
            f"{record.name}: power-off lies {-1e3 * value:.2f} ms before the record begins, at most "
            f"{1e3 * EARLIEST:g} ms can be bridged. Record with pre-trigger"
        )
    return PowerOff(
        value=start + value,
        standard_error=error,
        contact=contact,
        method="fall with remanent lift, the rotor at rest vertically when it began",
        notes=(
            f"the record has no levitated part: power-off is known to {1e6 * error:.0f} µs only, and orbit, "
            "noise and hum before the drop not at all; record with pre-trigger",
        ),
    )


def _released(since: Array, height: Array, gravity: float) -> tuple[float, float]:
    """Release [s] after the first sample and its standard uncertainty, from heights (N, P) [m] of a fall.

    Unknown are the height of each plane, the release, and the share of the lift that remained, which has a
    prior; what ringing and orbit add counts as noise of the size that is left over, correlated over the fall.
    """
    # Height and velocity at the first sample are unknown, but a rotor at rest has a release with no velocity:
    # the linear term of the parabola is gravity times the time of it, so the fall dates its own beginning.
    # Lift that remains delays the fall like a later release would; only its prior tells the two apart.
    count, planes = height.shape
    from rotordrop.evidence.fall import REMANENT_SHARE, REMANENT_TIME

    expected, doubt = REMANENT_SHARE
    tau, value = REMANENT_TIME[0], 0.0
    sigma, found, covariance = RINGING, np.zeros(planes + 2), np.eye(planes + 2)
    for _ in range(5):
        fallen_for = np.maximum(since - value, 0.0)
        lifted = gravity * tau * (fallen_for - tau * (1.0 - np.exp(-fallen_for / tau)))
        design = np.column_stack(
            [
                np.tile(np.eye(planes), (count, 1)),
                np.repeat(gravity * since, planes),
                np.repeat(lifted, planes),
            ]
        )
        wanted = (height + 0.5 * gravity * since[:, None] ** 2).ravel()
        weight = 1.0 / (sigma * np.sqrt(count / INDEPENDENT))
        rows = np.vstack([weight * design, [0.0] * (planes + 1) + [1.0 / doubt]])
        values = np.append(weight * wanted, expected / doubt)
        found, *_ = np.linalg.lstsq(rows, values, rcond=None)
        covariance = np.linalg.inv(rows.T @ rows)
        value = float(found[planes])
        sigma = max(float(np.std(wanted - design @ found)), RINGING)
    return value, float(np.hypot(np.sqrt(covariance[planes, planes]), RINGING_ERROR))
