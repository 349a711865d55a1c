"""Power-off of a record that begins too late for a levitated part, from the fall alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.events import (
    FALLEN_SHARE,
    DropInstant,
    find_drop_instant,
    first_sudden,
    nominal_gaps,
    sinking,
    until_fallen,
)
from rotordrop.evidence.fall import REMANENT_SHARE, REMANENT_TIME
from rotordrop.known import NINETY
from rotordrop.record.recording import Array

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

RINGING_ERROR = 4e-4
"""Standard uncertainty [s] by the velocity of the orbit and of the released sag at power-off."""

RINGING = 5e-6
"""Ringing of the released sag [m]; it lasts as long as the fall."""

INDEPENDENT = 4.0
"""Readings of a plane during the fall that count as independent, because ringing is no white noise [1]."""

MARGIN = 4e-4
"""Time before the first contact that the parabola keeps away from [s]."""

FEWEST = 20
"""Samples that a parabola needs."""

EARLIEST = 5e-3
"""Power-off may lie at most this long before the record begins [s]."""


@dataclass(frozen=True, kw_only=True)
class PowerOff:
    """When the magnetic bearings let the rotor go, told by the fall alone."""

    value: float
    """Power-off, in record time [s]."""
    standard_error: float
    """Its standard uncertainty [s]."""
    interval_90: tuple[float, float]
    """Interval that holds it with 90 % probability [s]."""
    contact: float
    """First sudden acceleration [s]."""
    method: str
    """How it was found."""
    notes: tuple[str, ...]
    """What to know about this value."""

    def __float__(self) -> float:
        return self.value


def find_power_off(record: Record, machine: Machine) -> DropInstant | PowerOff:
    """Find power-off from levitation and fall, or from the fall alone where the record begins with it.

    Parameters
    ----------
    record : Record
        The recorded drop.
    machine : Machine
        The machine, for its gaps, AMB planes and rotor.

    Raises
    ------
    RecordError
        When the rotor does not fall in the record, or the record begins in the middle of the fall.
    """
    if begins_with_fall(record, machine):
        return power_off_of_fall(record, machine)
    return find_drop_instant(record, machine)


def begins_with_fall(record: Record, machine: Machine) -> bool:
    """Whether the rotor has fallen by a share of its gap before it could have levitated for 5 ms."""
    gaps = nominal_gaps(machine, record.whole)
    height = until_fallen(record.whole, gaps, first=1).motion[:, :, 1]
    sunk = height[:1] - height > FALLEN_SHARE * gaps
    if not sunk.all(axis=1).any():
        return False
    fallen = float(record.time[sinking(sunk)] - record.time[0])
    needed = float(np.sqrt(2.0 * FALLEN_SHARE * float(np.max(gaps)) / float(machine.gravity)))
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
    gravity, height = float(machine.gravity), record.whole.motion[:, :, 1]
    low = height[0] - height > FALLEN_SHARE * nominal_gaps(machine, record.whole)
    start = float(record.time[0])
    contact = first_sudden(record.whole, gravity, start, sinking(low))
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
    instant = start + value
    return PowerOff(
        value=instant,
        standard_error=error,
        interval_90=(instant - NINETY * error, instant + NINETY * error),
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
