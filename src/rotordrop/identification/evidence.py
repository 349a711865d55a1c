"""What a record says before the first contact and at rest, found once: both methods start from it.

The tracked twin and the replay differ only in what they do after the first contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.identification.speed import SpeedFit, identify_speed
from rotordrop.measurement.axes import sensor_polarity
from rotordrop.measurement.events import DropInstant
from rotordrop.measurement.levitated import LevitatedModel
from rotordrop.measurement.power_off import PowerOff, find_power_off
from rotordrop.measurement.record import Record
from rotordrop.measurement.speed import RotorAngle, rotor_angle
from rotordrop.model.parameters import DropModel

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a record says of a drop beside the contacts; N samples, S sensors.

    Attributes
    ----------
    record : Record
        The record.
    power_off : DropInstant or PowerOff
        Power-off in record time.
    levitated : LevitatedModel or None
        Readings before power-off; None when the record begins with the fall.
    speed : SpeedFit
        Speed at power-off and how it falls.
    angle : RotorAngle
        Rotor angle over the whole record.
    """

    record: Record
    power_off: DropInstant | PowerOff
    levitated: LevitatedModel | None
    speed: SpeedFit
    angle: RotorAngle

    @property
    def time(self) -> Array:
        """Time from power-off [s], shape (N,)."""
        return np.asarray(self.record.time - self.power_off.value)

    def noise(self, until: float) -> Array:
        """Noise of each channel [m], shape (S,), until a time from power-off [s]; NaN where it is not known.

        2X runout whose phase is not known counts as noise.
        """
        if self.levitated is None:
            return np.full(len(self.record.sensors), np.nan)
        falling = (self.time >= 0.0) & (self.time <= until)
        runout = self.levitated.unknown_runout(self.record.time[falling], self.angle)
        return np.asarray(np.sqrt(self.levitated.noise**2 + runout))

    def readings(self, until: float) -> Array:
        """Readings in the positive direction of each sensor [m], hum and 2X runout taken off.

        Parameters
        ----------
        until : float
            Readings up to this time from power-off [s].
        """
        near = self.time <= until
        signals = self.record.signals[near]
        if self.levitated is not None:
            signals = signals - self.levitated.disturbance(self.record.time[near], self.angle)
        return np.asarray(signals * sensor_polarity(self.record.sensors))

    def of_channels(self, columns: Sequence[int]) -> Evidence:
        """The same for some of the sensors; power-off and speed stay."""
        chosen, record = list(columns), self.record
        return replace(
            self,
            record=replace(
                record,
                signals=np.ascontiguousarray(record.signals[:, chosen]),
                sensors=tuple(record.sensors[c] for c in chosen),
            ),
            levitated=None if self.levitated is None else self.levitated.of_channels(chosen),
        )

    def measured_speed(self, until: float) -> Array:
        """Measured speed at the samples [rad/s]; NaN where nobody measured it."""
        near = self.time <= until
        speed = self.record.speed
        if speed is None or self.record.measured_speed is None:
            return np.full(np.count_nonzero(near), np.nan)
        return np.asarray(speed[near])


def read_evidence(
    model: DropModel, record: Record, *, power_off: DropInstant | PowerOff | None = None
) -> Evidence:
    """Find what a record says before the first contact and at rest.

    Parameters
    ----------
    model : DropModel
        Drop model of the machine.
    record : Record
        The recorded drop.
    power_off : DropInstant or PowerOff, optional
        Power-off where it is known already.

    Raises
    ------
    RecordError
        When the rotor does not fall in the record, or the record has no speed.
    """
    instant = find_power_off(record, model.machine) if power_off is None else power_off
    levitated = instant.levitated if isinstance(instant, DropInstant) else None
    turning = None if levitated is None else 2.0 * np.pi * levitated.frequency
    speed = identify_speed(record, instant.value, turning=turning)
    return Evidence(
        record=record,
        power_off=instant,
        levitated=levitated,
        speed=speed,
        angle=rotor_angle(
            record,
            instant.value,
            speed.initial if turning is None else turning,
            strongest_slowing=strongest_slowing(model),
        ),
    )


def strongest_slowing(model: DropModel) -> float:
    """Deceleration [rad/s²] by the friction of races that stand still under the weight."""
    torque = sum(
        float(share) * float(bearing.friction.dynamic) * float(bearing.bore_radius)
        for share, bearing in zip(model.load_shares, model.machine.touchdown_bearings, strict=True)
    )
    return torque / model.fe.polar_inertia
