"""The rest at the end: a rotor at standstill on its touchdown bearings, swinging out, and the air gap.

At the end of a drop the rotor rests on its bearings, so the distance of its centre from the sensors' origin
is the air gap plus what race, support and contact give way under the weight (Neisi 2020, section 5). A
vertical zero error of the sensors reads exactly like a larger or smaller gap: the tail alone cannot separate
them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import IdentificationError, UnsettledError
from rotordrop.record.recording import Array
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.evidence.sensing import Sensing
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record
    from rotordrop.rotor.parameters import DropModel, StaticSag

STANDSTILL = 2 * np.pi * 0.5
"""Slower than this counts as standstill [rad/s]."""

MOST_SWING = 0.5
"""Peak-to-peak motion at rest, in nominal air gaps."""

_BLOCK = 0.1
_SHORTEST = 0.2


@dataclass(frozen=True, kw_only=True)
class SettledTail:
    """The part of a record in which the rotor rests on its touchdown bearings."""

    start: float
    end: float
    """Where it is, in record time [s]."""
    mean: Array
    """Mean readings [m]; a mean over a swing lies above the lowest point, take the arc into account, shape
    (S,)."""
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
    start = _standstill_begins(record)
    gap = min(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    still = record.window(start, np.inf)
    path, time = still.whole.motion, still.time
    block = max(int(_BLOCK * record.sampling_rate), 4)
    count = len(time) // block
    quiet = 0
    while quiet < count and _swing(path[len(path) - (quiet + 1) * block :]).max() < MOST_SWING * gap:
        quiet += 1
    if quiet * block < _SHORTEST * record.sampling_rate:
        moves = format_quantity(float(_swing(path[-block:]).max()), "length")
        raise UnsettledError(
            record.name,
            f"does not reach standstill: the shaft still moves by {moves} peak to peak in the last "
            f"{_BLOCK:g} s, more than {MOST_SWING:.0%} of the nominal air gap of "
            f"{format_quantity(gap, 'length')}",
        )
    first = len(time) - quiet * block
    return SettledTail(
        start=float(time[first]),
        end=float(time[-1]),
        mean=np.mean(still.signals[first:], axis=0),
        swing=_swing(path[first:]),
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


def _standstill_begins(record: Record) -> float:
    """Time of the last speed reading above standstill [s]; the begin of a record without speed."""
    measured = record.measured_speed
    if measured is None:
        return float(record.time[0])
    speed_time, readings = measured
    turning = np.flatnonzero(np.abs(readings) > STANDSTILL)
    if not len(turning):
        return float(record.time[0])
    last = int(turning[-1])
    left = float(record.time[-1] - speed_time[last])
    if left < _SHORTEST:
        speed = format_quantity(float(abs(readings[last])), "speed")
        raise UnsettledError(
            record.name,
            f"does not reach standstill: the shaft still turns at {speed} at {speed_time[last]:.6g} s and "
            f"the record ends at {record.time[-1]:.6g} s",
        )
    return float(speed_time[last])


def _swing(path: Array) -> Array:
    return np.asarray(np.ptp(path, axis=0))


SHORTEST_TAIL = 0.2
"""Length of settled record needed at least [s]: some five swings."""

BLOCK = 0.5
"""Length of the blocks whose means give the lower and upper limit [s]: some fifteen swings."""

LARGEST_SWAY = 0.25
"""Largest swing of a rotor that counts as settled, as a share of its radius [1]."""

LARGEST_SWING = 0.7
"""The same where only centre and radius are asked, which a swing along the race does not move."""

MOST_SPREAD = 0.05
"""Scatter of the radius of a rotor that lies in its bearings, as a share of it [1]."""

END = 1.0
"""Length of the end of a record that shows where the rotor lies [s]: some thirty swings."""


@dataclass(frozen=True, kw_only=True)
class SettledRest:
    """Where the rotor rests at the end of a drop; B bearings, S sensors."""

    radius: Array
    """Mean distance of the rotor centre at the bearing nodes from the centre of the sway arc [m], shape (B,).
    """
    radius_lower: Array
    radius_upper: Array
    """Smallest and largest mean over a block of the tail [m], shape (B,)."""
    standard_error: Array
    """Standard error of the mean radius from the scatter of the blocks [m], shape (B,)."""
    sideways: Array
    """Mean horizontal reading at the bearings [m]; taken as horizontal sensor zero, shape (B,)."""
    sway: Array
    """Half the swing around the lowest point [m], shape (B,)."""
    spread: Array
    """Standard deviation of the radius [m], shape (B,)."""
    along: Array
    """Displacements along the sensors [m] with the rotor at the lowest point of its sway, shape (S,)."""
    start: float
    end: float
    """Part of the record that was used [s]."""


@dataclass(frozen=True, kw_only=True)
class AirGap:
    """Air gaps from the settled tail, shape (B,) each [m]."""

    value: Array
    """Air gap [m], shape (B,)."""
    lower: Array
    upper: Array
    """Limits from the smallest and largest block of the tail [m] (the paper's two windows), shape (B,)."""
    sag: StaticSag
    """What was taken off the settled radius."""
    zero_sigma: Array
    gain_sigma: Array
    """Standard deviation of the gap [m] by the vertical zero and by the gain of the sensors, which the tail
    cannot separate from the gap, shape (B,)."""
    rest: SettledRest
    """The rest position behind it."""

    @property
    def standard_error(self) -> Array:
        """Standard error with everything the tail cannot separate [m], shape (B,)."""
        return np.asarray(np.sqrt(self.zero_sigma**2 + self.gain_sigma**2 + self.rest.standard_error**2))


def find_rest(still: Record, sensing: Sensing) -> SettledRest:
    """Where the rotor rests in a record of standstill alone.

    Raises
    ------
    IdentificationError
        If the rotor is not at rest in it, or it is too short.
    """
    if still.duration < 0.9 * SHORTEST_TAIL:
        raise IdentificationError(
            f"{still.name}: {still.duration:.3g} s of settled rotor; at least {SHORTEST_TAIL:g} s are "
            "needed for the air gap. Record longer after standstill."
        )
    return _rest(still.name, still.time, still.along, sensing)


def rest_at_end(record: Record, sensing: Sensing) -> SettledRest:
    """Where the rotor lies at the end of a record, the shaft turning or not: in contact, swinging at most.

    Raises
    ------
    IdentificationError
        If the rotor does not lie in its bearings for the last second, or the record is shorter.
    """
    late = record.time >= record.time[-1] - END
    if record.time[-1] - record.time[0] < 2.0 * END:
        raise IdentificationError(f"{record.name} is shorter than {2.0 * END:g} s")
    rest = _rest(record.name, record.time[late], record.along[late], sensing, LARGEST_SWING)
    if np.any(rest.spread > MOST_SPREAD * rest.radius):
        raise IdentificationError(
            f"{record.name}: in its last {END:g} s the rotor still leaves its races: its distance from their "
            f"centre scatters by {_microns(rest.spread)} µm; expected less than {MOST_SPREAD:.0%} of it"
        )
    return rest


def _rest(
    name: str, time: Array, along: Array, sensing: Sensing, largest_sway: float = LARGEST_SWAY
) -> SettledRest:
    place = sensing.at_bearings(along - sensing.settled_bend)
    sideways = place[..., 0].mean(axis=0)
    swing = place[..., 0] - sideways
    radius = np.hypot(swing, place[..., 1])
    sway = 0.5 * np.ptp(swing, axis=0)
    if np.any(place[..., 1].mean(axis=0) > 0.0) or np.any(sway > largest_sway * radius.mean(axis=0)):
        raise IdentificationError(
            f"{name}: the rotor is not at rest on its bearings: mean height "
            f"{_microns(place[..., 1].mean(axis=0))} µm, swing {_microns(sway)} µm; expected a height near "
            "minus the air "
            f"gap and a swing below {largest_sway:.0%} of it. Check polarity and angles of the sensors, or "
            "give a later tail (--tail)."
        )
    # A rotor that sways along its race is lifted: its mean height is above the lowest point, its mean radius
    # is not. Gap and rest follow from the radius, and the mean readings are let down by the difference.
    blocks = max(1, int((time[-1] - time[0]) / BLOCK + 0.1))
    means = np.array([part.mean(axis=0) for part in np.array_split(radius, blocks)])
    mean = radius.mean(axis=0)
    lift = mean + place[..., 1].mean(axis=0)
    raised = np.einsum("sb,b->s", sensing.from_bearings[..., 1], lift)
    return SettledRest(
        radius=mean,
        radius_lower=means.min(axis=0),
        radius_upper=means.max(axis=0),
        standard_error=means.std(axis=0, ddof=1) / np.sqrt(blocks) if blocks > 1 else np.zeros(len(mean)),
        sideways=sideways,
        sway=sway,
        spread=radius.std(axis=0),
        along=along.mean(axis=0) - raised,
        start=float(time[0]),
        end=float(time[-1]),
    )


def identify_air_gap(rest: SettledRest, model: DropModel, sensing: Sensing) -> AirGap:
    """Air gap of each bearing: settled radius less what gives way under the weight.

    Parameters
    ----------
    rest : SettledRest
        From `find_rest`.
    model : DropModel
        Gives load shares, contact, balls and support; call again with a better support until the gap rests.
    sensing : Sensing
        Gives the uncertainty of gain and zero.

    Notes
    -----
    Source: Neisi 2020, section 5. Differs from the paper: the settled position is corrected for indentation,
    race and support deflection, for the bend of the resting rotor between sensor and bearing, and for the arc
    of the sway.
    """
    from rotordrop.rotor.parameters import sag_of_model

    sag = sag_of_model(model)
    vertical = np.abs(sensing.to_bearings[:, 1, :])
    zero = np.sqrt(np.sum((vertical * sensing.offset_sigma) ** 2, axis=1))
    gain = np.sqrt(np.sum((sensing.to_bearings[:, 1, :] * rest.along * sensing.gain_sigma) ** 2, axis=1))
    return AirGap(
        value=rest.radius - sag.total,
        lower=rest.radius_lower - sag.total,
        upper=rest.radius_upper - sag.total,
        sag=sag,
        zero_sigma=zero,
        gain_sigma=gain,
        rest=rest,
    )


def _microns(values: Array) -> str:
    return "/".join(f"{1e6 * v:.4g}" for v in values)
