"""Air gap of each touchdown bearing from the settled tail of a record (Neisi 2020, section 5).

At the end of a drop the rotor rests on its bearings, so the distance of its centre from the sensors' origin
is the air gap plus what race, support and contact give way under the weight. A vertical zero error of the
sensors reads exactly like a larger or smaller gap: the tail alone cannot separate them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError
from rotordrop.evidence.sensing import Sensing
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import DropModel, StaticSag, sag_of_model

Array = NDArray[np.float64]

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
