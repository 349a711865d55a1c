"""Where the rotor rests in its touchdown bearings: in a tail, at the end of a record, in a lift check.

A rotor at rest lies on a circle about the centre of its bearing. The radius of the circle is the air gap plus
what contact, race and support give way under the load there (Neisi 2020, section 5). Along the circle the
rotor swings, or is held aside. A vertical zero error of the sensors reads exactly like a larger or smaller
gap: the rest at the bottom cannot separate them, stays all round the circle can.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError, UnsettledError
from rotordrop.known import NINETY
from rotordrop.units import format_quantity, percent

if TYPE_CHECKING:
    from rotordrop.evidence.sensing import Sensing
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record
    from rotordrop.rotor.parameters import DropModel, StaticSag

STANDSTILL = 2 * np.pi * 0.5
"""Slower than this counts as standstill [rad/s] (chosen): speed channels read some 0.1 Hz at rest."""

MOST_SWING = 0.5
"""Peak-to-peak motion at rest, in nominal air gaps (chosen)."""

_QUIET = 0.1
"""Length of the blocks by which the end of a record is looked at for its rest [s]: three swings."""

SHORTEST_TAIL = 0.2
"""Length of settled record needed at least [s]: some five swings."""

BLOCK = 0.5
"""Length of the blocks whose means give limits and standard error [s]: some fifteen swings."""

LARGEST_SWAY = 0.25
"""Largest swing of a rotor that counts as settled, as a share of its radius [1] (chosen)."""

LARGEST_SWING = 0.7
"""The same where only centre and radius are asked, which a swing along the race does not move."""

MOST_SPREAD = 0.05
"""Scatter of the radius of a rotor that lies in its bearings, as a share of it [1] (chosen)."""

END = 1.0
"""Length of the end of a record that shows where the rotor lies [s]: some thirty swings."""

PUSH = (0.5, 2.0)
"""Loads at the wall in a lift check over the weight there, between which nine of ten lie (chosen, not
measured): half the weight lifts no shaft to the upper half, and nobody needs much more than all of it."""


def stay(path: Array, centre: Array) -> tuple[Array, Array]:
    """Mean distance (...) of places (N, ..., 2) from a centre [m], and their mean direction [1], (..., 2).

    Each is averaged by itself: the mean of places along an arc lies inside it.
    """
    away = path - centre
    mean = away.mean(axis=0)
    direction = mean / np.hypot(mean[..., 0], mean[..., 1])[..., None]
    return np.hypot(away[..., 0], away[..., 1]).mean(axis=0), direction


def of_few(error: Array | float, free: int) -> Array:
    """Standard error of a mean of few values, widened by Student's t so that `NINETY` of it hold 90 %."""
    from scipy.special import stdtrit

    return np.asarray(error * float(stdtrit(free, 0.95)) / NINETY)


def sag_under(machine: Machine, share: float = 1.0) -> StaticSag:
    """What gives way at every bearing under a share of the static load there."""
    from rotordrop.rotor.parameters import bearing_row, race_sag, static_sag
    from rotordrop.rotor.statics import bearing_load_shares

    bearings, loads = machine.touchdown_bearings, share * np.asarray(bearing_load_shares(machine))
    rows = np.array([bearing_row(bearing, load) for bearing, load in zip(bearings, loads, strict=True)])
    return static_sag(rows, race_sag(bearings, loads), loads)


def standstill_of(record: Record) -> float | None:
    """When the shaft came to rest by its speed readings [s]; None where it did not or nothing tells."""
    turning = _turning(record)
    if turning is None or record.speed_time is None or turning + 1 == len(record.speed_time):
        return None
    return float(record.speed_time[turning + 1])


def _turning(record: Record) -> int | None:
    """Index of the last speed reading above standstill."""
    if record.measured_speed is None:
        return None
    turning = np.flatnonzero(np.abs(record.measured_speed[1]) > STANDSTILL)
    return int(turning[-1]) if len(turning) else None


@dataclass(frozen=True, kw_only=True)
class SettledTail:
    """The part of a record in which the rotor rests on its touchdown bearings."""

    start: float
    end: float
    """Where it is, in record time [s]."""
    mean: Array
    """Mean readings [m]; a mean over a swing lies above the lowest point, shape (S,)."""
    swing: Array
    """Peak-to-peak motion in x and y per sensor plane [m], shape (P, 2)."""


def settled_tail(record: Record, machine: Machine) -> SettledTail:
    """Find the last part of a record in which the shaft stands still and only swings.

    Parameters
    ----------
    record : Record
        A whole record, or one of the standstill alone, which needs no speed.
    machine : Machine
        The machine, for its nominal air gaps.

    Raises
    ------
    RecordError
        When the record does not reach standstill; says how fast or how far the shaft still moves.
    """
    start, turning = float(record.time[0]), _turning(record)
    if turning is not None and record.speed_time is not None and record.speed_readings is not None:
        start = float(record.speed_time[turning])
        if record.time[-1] - start < SHORTEST_TAIL:
            speed = format_quantity(float(abs(record.speed_readings[turning])), "speed")
            raise UnsettledError(
                record.name,
                f"does not reach standstill: the shaft still turns at {speed} at {start:.6g} s and the "
                f"record ends at {record.time[-1]:.6g} s",
            )
    gap = min(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    still = record.window(start, np.inf)
    path, time = still.whole.motion, still.time
    block = max(int(_QUIET * record.sampling_rate), 4)
    swings = [np.ptp(path[end - block : end], axis=0).max() for end in range(len(path), block - 1, -block)]
    moving = np.flatnonzero(~(np.array(swings) < MOST_SWING * gap))
    quiet = int(moving[0]) if len(moving) else len(swings)
    if quiet * block < SHORTEST_TAIL * record.sampling_rate:
        moves = format_quantity(float(np.ptp(path[-block:], axis=0).max()), "length")
        raise UnsettledError(
            record.name,
            f"does not reach standstill: the shaft still moves by {moves} peak to peak in the last "
            f"{_QUIET:g} s, more than {percent(MOST_SWING)} of the nominal air gap of "
            f"{format_quantity(gap, 'length')}",
        )
    first = len(time) - quiet * block
    return SettledTail(
        start=float(time[first]),
        end=float(time[-1]),
        mean=np.mean(still.signals[first:], axis=0),
        swing=np.asarray(np.ptp(path[first:], axis=0)),
    )


def resting_record(record: Record, tail: Record | None, machine: Machine) -> Record:
    """The settled part of a tail given, or of a record that reaches standstill.

    Raises
    ------
    RecordError
        When neither shows a rotor at rest.
    """
    if tail is None and record.measured_speed is None:
        raise UnsettledError(
            record.name,
            "has no measured shaft speed, so it cannot be seen where the rotor stands still",
        )
    source = record if tail is None else tail
    found = settled_tail(source, machine)
    return source.window(found.start, found.end)


@dataclass(frozen=True, kw_only=True)
class Rest:
    """Where the rotor rests at the end of a drop; B bearings, S sensors."""

    radius: Array
    """Mean distance of the rotor centre from the centre of the arc of its sway, at the bearings [m], (B,)."""
    standard_error: Array
    """Standard error of the mean radius by the scatter of the blocks, widened as they are few [m], (B,)."""
    sideways: Array
    """Mean horizontal reading at the bearings [m]; taken as horizontal sensor zero, shape (B,)."""
    sway: Array
    """Half the swing around the lowest point [m], shape (B,)."""
    along: Array
    """Readings along the sensors [m] with the rotor at the lowest point of its sway, shape (S,)."""
    start: float
    end: float
    """Part of the record that was used [s]."""


def rest_of(record: Record, sensing: Sensing, *, turning: bool = False) -> Rest:
    """Where the rotor rests in a record of standstill alone, or at the end of one whose shaft may turn.

    Raises
    ------
    IdentificationError
        If the rotor does not lie in its bearings there, or the record is too short.
    """
    name, time, along, largest = record.name, record.time, record.along, LARGEST_SWAY
    if turning:
        late = time >= time[-1] - END
        if record.duration < 2.0 * END:
            raise IdentificationError(f"{name} is shorter than {2.0 * END:g} s")
        time, along, largest = time[late], along[late], LARGEST_SWING
    elif record.duration < 0.9 * SHORTEST_TAIL:
        raise IdentificationError(
            f"{name}: {record.duration:.3g} s of settled rotor; at least {SHORTEST_TAIL:g} s are "
            "needed for the air gap. Record longer after standstill."
        )
    level = along.mean(axis=0)
    along -= sensing.settled_bend
    place = sensing.at_bearings(along)
    sideways, height = place[..., 0].mean(axis=0), place[..., 1].mean(axis=0)
    # the arc is taken to be level where the rotor lies on average, and centred at the zero of the sensors
    place[..., 0] -= sideways
    radius = np.hypot(place[..., 0], place[..., 1])
    mean, sway, spread = radius.mean(axis=0), 0.5 * np.ptp(place[..., 0], axis=0), radius.std(axis=0)
    if np.any(height > 0.0) or np.any(sway > largest * mean):
        raise IdentificationError(
            f"{name}: the rotor is not at rest on its bearings: mean height {_microns(height)} µm, swing "
            f"{_microns(sway)} µm; expected a height near minus the air gap and a swing below "
            f"{percent(largest)} of it. Check polarity and angles of the sensors, or give a later settled "
            "tail."
        )
    if turning and np.any(spread > MOST_SPREAD * mean):
        raise IdentificationError(
            f"{name}: in its last {END:g} s the rotor still leaves its races: its distance from their "
            f"centre scatters by {_microns(spread)} µm; expected less than {percent(MOST_SPREAD)} of it"
        )
    blocks = max(2, int((time[-1] - time[0]) / BLOCK + 0.1))
    means = np.array([part.mean(axis=0) for part in np.array_split(radius, blocks)])
    # a rotor that sways is lifted: its mean readings are let down to the lowest point of the arc
    raised = np.einsum("sb,b->s", sensing.from_bearings[..., 1], mean + height)
    return Rest(
        radius=mean,
        standard_error=of_few(means.std(axis=0, ddof=1) / np.sqrt(blocks), blocks - 1),
        sideways=sideways,
        sway=sway,
        along=level - raised,
        start=float(time[0]),
        end=float(time[-1]),
    )


@dataclass(frozen=True, kw_only=True)
class AirGap:
    """Air gaps by where the rotor rests, shape (B,) each [m]."""

    value: Array
    """Air gap: the radius of the rest less the sag."""
    standard_error: Array
    """With vertical zero and gain of the sensors, which the tail cannot separate from the gap."""
    rest: Rest
    """The rest behind it."""


def identify_air_gap(rest: Rest, model: DropModel, sensing: Sensing) -> AirGap:
    """Air gap of each bearing: settled radius less what gives way under the weight.

    The model gives load shares, contact, balls and support: with a better support call again. The sensing
    gives what the tail cannot tell.

    Notes
    -----
    Source: Neisi 2020, section 5. Differs from the paper: the settled position is corrected for indentation,
    race and support deflection, for the bend of the resting rotor between sensor and bearing, and for the arc
    of the sway.
    """
    from rotordrop.rotor.parameters import sag_of_model

    by_gain = np.sum((sensing.to_bearings[:, 1, :] * rest.along * sensing.gain_sigma) ** 2, axis=1)
    return AirGap(
        value=rest.radius - sag_of_model(model).total,
        standard_error=np.sqrt(sensing.height_sigma**2 + by_gain + rest.standard_error**2),
        rest=rest,
    )


def _microns(values: Array) -> str:
    return "/".join(f"{1e6 * v:.4g}" for v in values)
