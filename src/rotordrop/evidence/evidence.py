"""What a record says before the first contact and at rest, found once: both methods start from it.

The tracked twin and the replay differ only in what they do after the first contact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import IdentificationError, RecordError
from rotordrop.evidence.air_gap import AirGap, SettledRest, find_rest, identify_air_gap
from rotordrop.evidence.contacts import first_forces
from rotordrop.evidence.events import AFTER_FALL, DropInstant
from rotordrop.evidence.first_contact import TimedContact, identify_first_contacts
from rotordrop.evidence.initial_state import InitialState, fit_initial_state
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.power_off import PowerOff, find_power_off
from rotordrop.evidence.sensing import Sensing, build_sensing
from rotordrop.evidence.settled import resting_record
from rotordrop.evidence.speed import SpeedFit, identify_speed
from rotordrop.record.axes import along_sensors, sensor_polarity
from rotordrop.record.record import Record
from rotordrop.record.speed import RotorAngle, rotor_angle
from rotordrop.rotor.parameters import DropModel

Array = NDArray[np.float64]
Fact = TypeVar("Fact")


@dataclass(frozen=True, kw_only=True)
class Missing:
    """A fact that a record does not give, and why."""

    reason: str


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


def _sought(find: Callable[[], Fact]) -> Fact | Missing:
    """A fact, or why there is none; what rests on a missing fact is missing for the same reason."""
    try:
        return find()
    except (IdentificationError, RecordError) as error:
        return Missing(reason=str(error))


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a record says of a drop beside the contacts; N samples, S sensors, B bearings.

    Facts that a record need not give are ``Missing`` with a reason; `known` insists on one.

    Attributes
    ----------
    name : str
        Name of the drop.
    record : Record
        The record.
    model : DropModel
        The machine as described, with the speed law of the record.
    power_off : DropInstant or PowerOff
        Power-off in record time, refined by the fit of the fall where there is one.
    levitated : LevitatedModel or None
        Readings before power-off; None when the record begins with the fall.
    speed : SpeedFit
        Speed at power-off and how it falls.
    angle : RotorAngle
        Rotor angle over the whole record.
    sensing : Sensing
        The sensors in front of the rotor, with what is known of their zeros and gains.
    rest : SettledRest
        Where the rotor rests in the tail.
    settled_level : ndarray, shape (S,)
        What the sensors read of the resting rotor, in their positive directions [m]; NaN without readings.
    gap : AirGap
        Air gaps with the sag of the machine's supports.
    fall : InitialState
        State of the rotor at power-off with its covariance, and the fall up to the first contact.
    contacts : tuple of TimedContact
        First contact of every bearing.
    reach : ndarray, shape (B,)
        Distance from the bearing centre at which the first force acts [m]; NaN for a bearing that is not
        touched soon after the fall.
    """

    name: str
    record: Record
    model: DropModel
    power_off: DropInstant | PowerOff
    levitated: LevitatedModel | None
    speed: SpeedFit
    angle: RotorAngle
    sensing: Sensing | Missing
    rest: SettledRest | Missing
    settled_level: Array | Missing
    gap: AirGap | Missing
    fall: InitialState | Missing
    contacts: tuple[TimedContact, ...] | Missing
    reach: Array | Missing

    @property
    def time(self) -> Array:
        """Time from power-off [s], shape (N,)."""
        return np.asarray(self.record.time - self.power_off.value)

    @property
    def earliest_contact(self) -> float:
        """When the first bearing is touched [s from power-off]."""
        return min(contact.start for contact in known(self.contacts))

    @property
    def latest_first_contact(self) -> float:
        """When the last bearing is touched for the first time [s from power-off]."""
        return max(contact.start for contact in known(self.contacts))

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
        """The same for some of the sensors; what was found with all of them stays."""
        chosen, record, level = list(columns), self.record, self.settled_level
        return replace(
            self,
            record=replace(
                record,
                signals=np.ascontiguousarray(record.signals[:, chosen]),
                sensors=tuple(record.sensors[c] for c in chosen),
            ),
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

    def measured(self, until: float) -> tuple[Array, Array]:
        """Samples from power-off [s], shape (K,), and displacement at the bearings [m], shape (K, B, 2).

        As the sensors show it: the straight rotor through them, counted from the rest position.
        """
        fall = known(self.fall)
        inside = (self.time >= 0.0) & (self.time <= until)
        along = fall.deviation_of(self.record)[inside] + fall.settled
        return self.time[inside], fall.sensing.at_bearings(along)


def read_evidence(
    model: DropModel,
    record: Record,
    tail: Record | None = None,
    *,
    name: str = "",
    power_off: DropInstant | PowerOff | None = None,
) -> Evidence:
    """Find what a record says before the first contact and at rest.

    Parameters
    ----------
    model : DropModel
        Drop model of the machine.
    record : Record
        The recorded drop.
    tail : Record, optional
        The settled tail; that of the record itself where it reaches standstill.
    name : str
        Name of the drop; that of the record by default.
    power_off : DropInstant or PowerOff, optional
        Power-off where it is known already.

    Raises
    ------
    RecordError
        When the rotor does not fall in the record, or it has no speed.
    """
    name = name or record.name
    if record.speed_readings is None:
        raise RecordError(
            f"the record {name} has no rotor speed; expected one. Name its channel in a profile "
            '([speed] channel = "..."), or give it by hand ([speed] constant = "60 Hz").'
        )
    instant = find_power_off(record, model.machine) if power_off is None else power_off
    levitated = instant.levitated if isinstance(instant, DropInstant) else None
    turning = None if levitated is None else 2.0 * np.pi * levitated.frequency
    speed = identify_speed(record, instant.value, turning=turning)
    angle = rotor_angle(
        record,
        instant.value,
        speed.initial if turning is None else turning,
        strongest_slowing=strongest_slowing(model),
    )
    slowed = {"speed.aero_time_constant": min(speed.aero_time_constant.value, 1e6)}
    sensing = _sought(lambda: build_sensing(model, heard_sensors(record)))
    still = _sought(lambda: resting_record(record, tail, model.machine))
    rest = _sought(lambda: find_rest(known(still), known(sensing)))
    nothing = Missing(reason="not looked for")
    found = Evidence(
        name=name,
        record=record,
        model=model.with_values(slowed),
        power_off=instant,
        levitated=levitated,
        speed=speed,
        angle=angle,
        sensing=sensing,
        rest=rest,
        settled_level=_sought(lambda: _settled_level(known(still), rest)),
        gap=_sought(lambda: identify_air_gap(known(rest), model, known(sensing))),
        fall=nothing,
        contacts=nothing,
        reach=_sought(lambda: _reach(record, instant, model, known(sensing))),
    )
    until = max(instant.value, float(record.time[0])) + AFTER_FALL
    seen = None
    if record.time[-1] > until:
        seen = _with_fall(found, replace(found, record=record.window(-np.inf, until)))
    return seen or _with_fall(found, found) or found


def _with_fall(found: Evidence, seen: Evidence) -> Evidence | None:
    """The evidence with the fall that part of its record shows, and power-off as the fit leaves it.

    None where only a part was seen that does not show fall and first contacts: all of it may.
    """
    whole = seen is found
    fall = _sought(lambda: fit_initial_state(seen, known(found.gap), known(found.sensing)))
    if isinstance(fall, Missing):
        return replace(found, fall=fall, contacts=fall) if whole else None
    instant = found.power_off
    refined = fall.refined(instant) if isinstance(instant, DropInstant) else instant
    contacts = _sought(lambda: _first_contacts(seen, fall, known(found.gap)))
    if isinstance(contacts, Missing) and not whole:
        return None
    return replace(found, power_off=refined, fall=fall, contacts=contacts)


def heard_sensors(record: Record) -> tuple[Sensor, ...]:
    """The sensors of a record.

    Raises
    ------
    RecordError
        If one of them has no readings at all.
    """
    silent = [s.name for s, c in zip(record.sensors, record.signals.T, strict=True) if np.isnan(c).all()]
    if silent:
        raise RecordError(f"{record.name} has no readings of {', '.join(silent)}")
    return record.sensors


def _settled_level(still: Record, rest: SettledRest | Missing) -> Array:
    """What the sensors read of the resting rotor, in their positive directions [m], shape (S,)."""
    polarity = sensor_polarity(still.sensors)
    if not isinstance(rest, Missing):
        gain = np.array([float(sensor.gain) for sensor in still.sensors])
        offset = np.array([float(sensor.offset) for sensor in still.sensors])
        return np.asarray((rest.along / gain + offset) * polarity)
    # Without both directions in two planes no lowest point can be told: the mean over the swing has to do.
    heard = np.flatnonzero(np.isfinite(still.signals).any(axis=0))
    level = np.full(len(polarity), np.nan)
    level[heard] = np.nanmean(still.signals[:, heard], axis=0)
    return np.asarray(level * polarity)


def _first_contacts(found: Evidence, fall: InitialState, gap: AirGap) -> tuple[TimedContact, ...]:
    record, model = found.record, found.model
    return identify_first_contacts(
        record.time - fall.drop_instant,
        fall.sensing.at_bearings(fall.deviation_of(record) + fall.settled),
        gap.value,
        np.asarray(model.load_shares),
        float(model.machine.gravity),
        float(np.mean(fall.noise)),
    )


def _reach(record: Record, instant: DropInstant | PowerOff, model: DropModel, sensing: Sensing) -> Array:
    """Distance from the bearing centre at which the first force acts on the rotor [m], shape (B,).

    The fitted fall says where the rotor is when a force first makes it leave that fall; no contact law
    enters. The zeros of the sensors shift the result one to one, so it is a place to start from where no tail
    tells the gap, and not a measurement of it.
    """
    if not isinstance(instant, DropInstant):
        raise IdentificationError(
            f"{record.name} begins with the fall: where the first forces act shows only with the levitated "
            "rotor before it"
        )
    reached = np.full(len(model.bearing_names), np.nan)
    for contact in first_forces(record, model.machine, instant):
        b = model.bearing_names.index(contact.bearing)
        along = along_sensors(instant.fall.predicted(np.array([contact.start])), record.sensors)
        reached[b] = np.hypot(*sensing.at_bearings(along)[0, b])
    return reached


def strongest_slowing(model: DropModel) -> float:
    """Deceleration [rad/s²] by the friction of races that stand still under the weight."""
    torque = sum(
        float(share) * float(bearing.friction.dynamic) * float(bearing.bore_radius)
        for share, bearing in zip(model.load_shares, model.machine.touchdown_bearings, strict=True)
    )
    return torque / model.fe.polar_inertia
