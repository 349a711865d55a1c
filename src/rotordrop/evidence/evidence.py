"""What a record says of a drop, each fact found when it is first asked for and never again.

The quality gate, both methods, the first look and the coast-down ask one and the same evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError, RecordError, RotordropError, UnsettledError
from rotordrop.evidence.colour import SlowNoise
from rotordrop.evidence.ends import falling, held_bearings
from rotordrop.evidence.events import (
    Beginning,
    DropInstant,
    beginning_of,
    find_fall,
    instant_of,
    nominal_gaps,
    of_whole,
)
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.measured_speed import RotorAngle, SpeedAtDrop, rotor_angle, speed_at_drop
from rotordrop.evidence.rest import rest_of, resting_record
from rotordrop.record.axes import along_sensors, sensor_polarity
from rotordrop.record.record import Record

if TYPE_CHECKING:
    from rotordrop.evidence.events import PowerOff
    from rotordrop.evidence.fall import Fall
    from rotordrop.evidence.free_rotor import FreeRotor
    from rotordrop.evidence.paths import Motion
    from rotordrop.evidence.quality.flight import Weighed
    from rotordrop.evidence.rest import Rest
    from rotordrop.evidence.sensing import Sensing
    from rotordrop.machine import Machine
    from rotordrop.rotor.parameters import DropModel

Fact = TypeVar("Fact")

BEHIND_FALL = 5e-4
"""Time behind the fitted fall up to which that of a rotor with one end held is followed on [s] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Missing:
    """A fact that a record does not give, and why."""

    reason: str
    """Why, in a sentence."""
    error: RotordropError | None = field(default=None, repr=False, compare=False)
    """What was raised where it was looked for."""


def known(fact: Fact | Missing) -> Fact:
    """A fact that a method cannot do without.

    Raises
    ------
    IdentificationError
        If the record does not give it; says why.
    """
    if isinstance(fact, Missing):
        raise IdentificationError(fact.reason)
    return fact


def sought(find: Callable[[], Fact]) -> Fact | Missing:
    """A fact, or why there is none; what rests on a missing fact is missing for the same reason."""
    try:
        return find()
    except (IdentificationError, RecordError) as error:
        return Missing(reason=str(error), error=error)


@dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """What a record of a machine says of a drop; N samples, S sensors, B bearings.

    Facts that a record need not give are ``Missing`` with a reason; `known` insists on one.
    """

    record: Record
    """The record."""
    machine: Machine
    """The machine, as described."""
    tail: Record | None = None
    """The settled tail, where it is a recording of its own."""
    name: str = ""
    """Name of the drop."""

    def __post_init__(self) -> None:
        """The sensors of record and tail are those of the machine, whatever machine they were read for."""
        of_name = {sensor.name: sensor for sensor in self.machine.sensors}
        for name, read in (("record", self.record), ("tail", self.tail)):
            sensors = () if read is None else tuple(of_name.get(one.name, one) for one in read.sensors)
            if read is not None and sensors != read.sensors:
                object.__setattr__(self, name, replace(read, sensors=sensors))

    def with_facts(self, **facts: Any) -> Evidence:
        """The same with some facts taken as given in place of what the record says."""
        other = replace(self)
        other.__dict__.update({**self.__dict__, **facts})
        return other

    @cached_property
    def beginning(self) -> Beginning | Missing:
        """First guess of the drop, and the levitated motion of all sensors before it."""
        return sought(lambda: beginning_of(self.record, self.machine))

    @cached_property
    def gaps(self) -> Array:
        """Nominal air gap at every plane whose sensors give x and y [m]."""
        return nominal_gaps(self.machine, self.record.whole)

    @cached_property
    def free_fall(self) -> Fall | Missing:
        """The fall after the levitated motion, fitted by the released rotor without tail or air gap."""
        return sought(lambda: find_fall(self.record, self.rotor, known(self.beginning)))

    @cached_property
    def rotor(self) -> FreeRotor:
        """The released rotor, seen in the planes whose sensors give x and y."""
        # The rotor model brings the compiler with it, and a first look at a record needs neither.
        from rotordrop.evidence.free_rotor import free_rotor

        return free_rotor(self.machine, self.record.whole.planes)

    @cached_property
    def floating(self) -> LevitatedModel:
        """The levitated motion in the planes whose sensors give x and y."""
        return of_whole(known(self.beginning).levitated, self.record)

    @property
    def held(self) -> tuple[str, ...]:
        """Touchdown bearings whose end did not fall, because its magnets stayed on."""
        return held_bearings(self.machine)

    @cached_property
    def falling(self) -> Record:
        """The whole planes of the record whose end fell."""
        return falling(self.record, self.machine)

    @cached_property
    def flights(self) -> Weighed | None:
        """How fast every sensor saw the rotor fall between impacts; None where it never flew."""
        if self.held:
            return None
        from rotordrop.evidence.quality.flight import weighed

        drop = known(self.beginning).coarse.instant
        return weighed(self.record.whole, self.machine, self.rotor, self.floating, drop)

    @cached_property
    def still(self) -> Record | Missing:
        """The settled part of the tail, or of a record that reaches standstill."""

        def found() -> Record:
            if self.held:
                raise UnsettledError(
                    self.record.name,
                    f"shows no rotor that lies on all its bearings: {', '.join(self.held)} stayed held by "
                    "its magnets",
                )
            return resting_record(self.record, self.tail, self.machine)

        return sought(found)

    @cached_property
    def motion(self) -> Motion | Missing:
        """The paths in the clearance circles that the record shows without the machine file."""
        from rotordrop.evidence.paths import motion_of

        whole = self.falling
        alone = (None,) * len(whole.planes)
        return sought(lambda: motion_of(whole, gaps=alone, angles_known=True, machine=self.machine))

    @cached_property
    def power_off(self) -> PowerOff:
        """Power-off in record time, by the levitated motion and the fall, or by the fall alone.

        Raises
        ------
        RecordError
            When the rotor does not fall in the record, or the record begins in the middle of the fall.
        """
        from rotordrop.evidence.events import begins_with_fall, power_off_of_fall

        if begins_with_fall(self.record, self.machine):
            return power_off_of_fall(self.record, self.machine)
        for fact in (self.beginning, self.free_fall):
            if isinstance(fact, Missing):
                raise fact.error or RecordError(fact.reason)
        return instant_of(known(self.free_fall), known(self.beginning).levitated, self.record)

    @cached_property
    def levitated(self) -> LevitatedModel | None:
        """Readings before power-off; None when the record begins with the fall."""
        return self.power_off.levitated if isinstance(self.power_off, DropInstant) else None

    @cached_property
    def base(self) -> DropModel:
        """The drop model of the machine as described."""
        from rotordrop.rotor.parameters import build_drop_model

        return build_drop_model(self.machine)

    @cached_property
    def speed(self) -> SpeedAtDrop:
        """Speed at power-off, by the levitated orbit where the readings of the speed do not contradict it."""
        read = speed_at_drop(self.record, self.power_off.value)
        error, turning = max(read.standard_error, 1e-4 * read.value), self._turning
        if turning is not None and abs(turning - read.value) < 5.0 * error + 2e-3 * read.value:
            return SpeedAtDrop(value=turning, standard_error=1e-4 * turning)
        return SpeedAtDrop(value=read.value, standard_error=error)

    @property
    def _turning(self) -> float | None:
        return None if self.levitated is None else 2.0 * np.pi * self.levitated.frequency

    @cached_property
    def angle(self) -> RotorAngle:
        """Rotor angle over the whole record."""
        turning = self.speed.value if self._turning is None else self._turning
        slowing = strongest_slowing(self.base)
        return rotor_angle(self.record, self.power_off.value, turning, strongest_slowing=slowing)

    @cached_property
    def sensing(self) -> Sensing | Missing:
        """The sensors in front of the rotor, with what is known of their zeros and gains."""
        from rotordrop.evidence.sensing import build_sensing

        def found() -> Sensing:
            silent = [
                sensor.name
                for sensor, readings in zip(self.record.sensors, self.record.signals.T, strict=True)
                if np.isnan(readings).all()
            ]
            if silent:
                raise RecordError(f"{self.record.name} has no readings of {', '.join(silent)}")
            return build_sensing(self.base, self.record.sensors)

        return sought(found)

    @cached_property
    def rest(self) -> Rest | Missing:
        """Where the rotor rests in the tail."""
        return sought(lambda: rest_of(known(self.still), known(self.sensing)))

    @cached_property
    def lying(self) -> Rest | Missing:
        """Where the rotor rests, or where it lies at the end of a record although the shaft still turns."""
        if not isinstance(self.rest, Missing):
            return self.rest
        return sought(lambda: rest_of(self.record, known(self.sensing), turning=True))

    @cached_property
    def settled_level(self) -> Array | Missing:
        """What the sensors read of the resting rotor, in their positive directions [m]; NaN where dead."""
        if isinstance(self.still, Missing):
            return self.still
        sensors = self.still.sensors
        if not isinstance(self.rest, Missing):
            offset = np.array([float(sensor.offset) for sensor in sensors])
            return np.asarray((self.rest.along / self.still.gains + offset) * sensor_polarity(sensors))
        # Without both directions in two planes no lowest point shows: the mean over the swing has to do.
        live = np.flatnonzero(np.isfinite(self.still.signals).any(axis=0))
        level = np.full(len(sensors), np.nan)
        level[live] = np.nanmean(self.still.signals[:, live], axis=0)
        return level * sensor_polarity(sensors)

    @cached_property
    def reach(self) -> Array | Missing:
        """Distance from the bearing centre at which the first force acts [m], shape (B,); NaN without one.

        The fitted fall says where the rotor is when a force first makes it leave that fall; no contact law
        enters. The zeros of the sensors shift the result one to one, so it is a place to start from where no
        tail tells the gap, and not a measurement of it.
        """
        from rotordrop.evidence.contacts import first_forces

        def found() -> Array:
            instant, sensing, names = self.power_off, known(self.sensing), self.base.bearing_names
            if not isinstance(instant, DropInstant):
                raise IdentificationError(
                    f"{self.record.name} begins with the fall: where the first forces act shows only with "
                    "the levitated rotor before it"
                )
            reached = np.full(len(names), np.nan)
            for contact in first_forces(self.record, self.machine, instant):
                if contact.bearing in self.held:
                    continue  # that is the force of its magnets
                if self.held and contact.start > instant.fall.end + BEHIND_FALL:
                    continue  # what a magnet adds to its force is not known so far behind the fall
                b = names.index(contact.bearing)
                along = along_sensors(instant.fall.predicted(np.array([contact.start])), self.record.sensors)
                reached[b] = np.hypot(*sensing.at_bearings(along)[0, b])
            return reached

        return sought(found)

    @property
    def time(self) -> Array:
        """Time from power-off [s], shape (N,)."""
        return np.asarray(self.record.time - self.power_off.value)

    @property
    def damaged(self) -> NDArray[np.bool_]:
        """Samples that are no readings of the motion, shape (N, S)."""
        from rotordrop.evidence.quality.channels import damaged_samples

        damaged = damaged_samples(self.record.signals)
        return damaged if self.record.missing is None else damaged | self.record.missing

    def noise(self, until: float) -> Array:
        """Noise of each channel [m], shape (S,), until a time from power-off [s]; NaN where it is not known.

        2X runout whose phase is not known counts as noise.
        """
        if self.levitated is None:
            return np.full(len(self.record.sensors), np.nan)
        falling = (self.time >= 0.0) & (self.time <= until)
        runout = self.levitated.unknown_runout(self.record.time[falling], self.angle)
        return np.asarray(np.sqrt(self.slow_noise.variances(self.levitated.noise**2) + runout))

    @property
    def slow_noise(self) -> SlowNoise:
        """The part of the noise of all channels that is not white."""
        return SlowNoise() if self.levitated is None else self.levitated.slow_noise

    def readings(self, until: float) -> Array:
        """Readings in the positive directions [m] until a time [s], hum and 2X runout taken off.

        NaN where a channel held its reading or a single one stands out: the filter goes on without them.
        """
        near = self.time <= until
        signals = np.where(self.damaged[near], np.nan, self.record.signals[near])
        if self.levitated is not None:
            signals = signals - self.levitated.disturbance(self.record.time[near], self.angle)
        return np.asarray(signals * sensor_polarity(self.record.sensors))

    def of_channels(self, columns: Sequence[int]) -> Evidence:
        """The same for some of the sensors; what was found with all of them stays."""
        chosen, level = list(columns), self.settled_level
        facts = {name: getattr(self, name) for name in _OF_ALL}
        return replace(self, record=self.record.of_channels(chosen)).with_facts(
            **facts,
            levitated=None if self.levitated is None else self.levitated.of_channels(chosen),
            settled_level=level if isinstance(level, Missing) else level[chosen],
        )

    def measured_speed(self, until: float) -> Array:
        """Measured speed at the samples [rad/s]; NaN where nobody measured it."""
        near = self.time <= until
        speed = self.record.speed
        if speed is None or self.record.measured_speed is None:
            return np.full(np.count_nonzero(near), np.nan)
        return np.asarray(speed[near])


_OF_ALL = (
    "base",
    "power_off",
    "speed",
    "angle",
    "sensing",
    "rest",
    "still",
    "reach",
)
"""Facts found with all sensors, which evidence of some of them keeps."""


def read_evidence(
    model: DropModel,
    record: Record,
    tail: Record | None = None,
    *,
    name: str = "",
) -> Evidence:
    """Ask a record what it says before the first contact and at rest; the name is that of the record if
    empty.

    The tail is that of the record itself where it reaches standstill.

    Raises
    ------
    RecordError
        When the rotor does not fall in the record, or it has no speed.
    """
    found = Evidence(record=record, machine=model.machine, tail=tail, name=name or record.name)
    return insisted(found.with_facts(base=model))


def insisted(evidence: Evidence) -> Evidence:
    """Evidence of a drop with a speed and a release, without which no method can begin.

    Raises
    ------
    RecordError
        When the rotor does not fall in the record, or it has no speed.
    """
    machine = evidence.machine
    if machine.not_estimated:
        raise RecordError(machine.not_estimated)
    if evidence.record.speed_readings is None:
        raise RecordError(
            f"the record {evidence.name} has no rotor speed; expected one. Name its channel in a profile "
            '([speed] channel = "..."), or give it by hand ([speed] constant = "60 Hz").'
        )
    for fact in (evidence.power_off, evidence.speed):
        assert fact is not None
    return evidence


def strongest_slowing(model: DropModel) -> float:
    """Deceleration [rad/s²] by the friction of races that stand still under the weight."""
    torque = sum(
        float(share) * float(bearing.friction.dynamic) * float(bearing.bore_radius)
        for share, bearing in zip(model.load_shares, model.machine.touchdown_bearings, strict=True)
    )
    return torque / model.fe.polar_inertia
