"""One recorded drop: what the sensors of the machine read, and when."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotordrop.arrays import Array
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UsageError
from rotordrop.machine import Machine
from rotordrop.record.arrangement import Arrangement, arrangement_of
from rotordrop.record.axes import (
    Plane,
    along_sensors,
    planar_of,
    sees_both_directions,
    sensor_directions,
    sensor_planes,
)
from rotordrop.record.clock import at_one_rate, shared_clock
from rotordrop.record.columns import displacement, find_pulses, find_speed, match_sensors, speed_factor
from rotordrop.record.event_date import event_of
from rotordrop.record.examples import example_hashes
from rotordrop.record.profile import Profile, SpeedSource, rules_of
from rotordrop.record.readers import read_recording
from rotordrop.record.recording import MARKS, Channel, Recording, recording_of, spelled, split_unit
from rotordrop.record.speed import readings_of_held_signal
from rotordrop.record.tacho import passages
from rotordrop.record.writers import write_hdf5
from rotordrop.units import parse_quantity

SPEED_SOURCE, BY_HAND = "speed_source", "given by hand"
"""Header entry of a saved record whose speed nobody measured."""

_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
_TIME_NAMES = ("time", "t", "zeit")

_PART = 65536
"""Samples of a long record that are resolved at a time (chosen)."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Record:
    """Readings of the displacement sensors over a drop, with the shaft speed."""

    time: Array
    """Record time [s], shape (N,)."""
    signals: Array
    """Readings [m], positive in the reading direction, offsets included, shape (N, S)."""
    sensors: tuple[Sensor, ...]
    """The sensor of the machine behind every column of `signals`."""
    sampling_rate: float
    """Samples per second [Hz]."""
    speed: Array | None = None
    """Shaft speed [rad/s], between the readings by straight lines, shape (N,)."""
    speed_time: Array | None = None
    speed_readings: Array | None = None
    """When the speed was read [s] and what was read [rad/s], shape (K,)."""
    speed_by_hand: bool = False
    """Whether somebody gave the speed: it then holds until the magnetic bearings let go, and nothing is known
    of it afterwards."""
    marks: Array | None = None
    """When a mark of the shaft passed the keyphasor [s]: the rotor angle there is a whole number of turns,
    shape (M,)."""
    path: Path | None = None
    """Where the record comes from."""
    sha256: str = ""
    """Hash of that file."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Header entries of the file."""
    notes: tuple[str, ...] = ()
    """Choices made on reading."""
    warnings: tuple[str, ...] = ()
    """Damage worked around on reading."""

    def __post_init__(self) -> None:
        shape = (len(self.time), len(self.sensors))
        if self.signals.shape != shape:
            raise RecordError(
                f"signals have the shape {self.signals.shape}; {shape[0]} times and {shape[1]} sensors need "
                f"{shape}"
            )
        for array in (self.time, self.signals, self.speed, self.speed_time, self.speed_readings, self.marks):
            if array is not None:
                array.setflags(write=False)

    @classmethod
    def from_arrays(
        cls,
        machine: Machine,
        time: ArrayLike | str,
        signals: Mapping[str, ArrayLike] | ArrayLike,
        *,
        unit: str | Mapping[str, str],
        speed: str | tuple[ArrayLike, str] | None = None,
        time_unit: str = "s",
        start: str = "0 s",
    ) -> Record:
        """Make a record of arrays.

        Parameters
        ----------
        machine : Machine
            Names the sensors, and says which way each reads.
        time : array_like, shape (N,), or str
            Time of the samples in ``time_unit``, or the sampling rate, such as "20 kHz".
        signals : mapping or array_like, shape (N, S)
            Readings by the name of the sensor, or one column for every sensor of the machine in its order.
        unit : str or mapping
            Unit of the readings, such as "um" or "mV", of all or by the name of the sensor.
        speed : str or tuple, optional
            "60 Hz" given by hand, or readings with their unit, ``(array, "rpm")``.
        time_unit, start : str
            Unit of the times; first instant where a sampling rate is given.

        Examples
        --------
        >>> import numpy as np
        >>> from rotordrop import Record, example_machine
        >>> machine = example_machine("paper")
        >>> record = Record.from_arrays(machine, "20 kHz", np.zeros((100, 4)), unit="um", speed="60 Hz")
        >>> record.sampling_rate
        20000.0
        """
        names = [sensor.name for sensor in machine.sensors]
        columns = _columns(signals, names)
        count = len(next(iter(columns.values())))
        if isinstance(time, str):
            rate = parse_quantity(time, "frequency")
            clock = np.asarray(parse_quantity(start, "time") + np.arange(count) / rate)
        elif time_unit not in _TIMES:
            raise UsageError(f"time_unit is {time_unit!r}; expected one of {', '.join(_TIMES)}")
        else:
            clock = np.asarray(time, dtype=np.float64) * _TIMES[time_unit]
        if clock.shape != (count,):
            raise RecordError(
                f"time has the shape {clock.shape} and the signals have {count} samples; give one time for "
                "each sample, or a sampling rate such as '20 kHz'"
            )
        channels = []
        for name, values in columns.items():
            given = unit.get(name, "") if isinstance(unit, Mapping) else unit
            if not given:
                raise UsageError(f"the unit of {name} is {given!r}; say it, for example unit='um'")
            channels.append(Channel(name=name, label=name, unit=spelled(given), values=values, time=clock))
        return _record_of_channels(machine, channels, clock, speed, Profile())

    @classmethod
    def from_dataframe(
        cls,
        machine: Machine,
        frame: Any,
        *,
        unit: str | Mapping[str, str] | None = None,
        speed: str | None = None,
        profile: Profile | None = None,
    ) -> Record:
        """Make a record of a table with named columns, such as a pandas data frame.

        Parameters
        ----------
        machine : Machine
            Names the sensors.
        frame : data frame
            Columns named as in a recorded file, "X1 [um]"; a column "time [s]", or times as the index. A
            column such as "speed [rpm]" is the shaft speed.
        unit : str or mapping, optional
            Unit of the columns that do not name one, of all or by column.
        speed : str, optional
            Speed given by hand, such as "60 Hz".
        profile : Profile, optional
            Which column is which sensor, where the names differ.
        """
        clock, taken = _clock_of(frame)
        channels = []
        for column in frame.columns:
            values = np.asarray(frame[column])
            if column is taken or not np.issubdtype(values.dtype, np.number):
                continue
            name, label, own = split_unit(str(column))
            by_name = unit if isinstance(unit, Mapping) else {}
            given = by_name.get(name, by_name.get(str(column), own))
            given = given if isinstance(unit, Mapping) else own or unit or ""
            values = values.astype(np.float64)
            channels.append(Channel(name=name, label=label, unit=spelled(given), values=values, time=clock))
        return _record_of_channels(machine, channels, clock, speed, profile or Profile())

    def __repr__(self) -> str:
        """Name, length, rate and channels."""
        return (
            f"<Record {self.name}: {self.duration:.4g} s at {self.sampling_rate:g} Hz, "
            f"{', '.join(self.channel_names)}, {'with' if self.speed is not None else 'no'} speed>"
        )

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the columns of `signals`, as the machine names its sensors."""
        return tuple(sensor.name for sensor in self.sensors)

    @cached_property
    def planes(self) -> tuple[Plane, ...]:
        """The sensor planes.

        Raises
        ------
        RecordError
            When the sensors of a plane do not give x and y.
        """
        return sensor_planes(self.sensors)

    @cached_property
    def whole(self) -> Record:
        """The record with those planes only whose sensors give x and y: a lost sensor takes its plane along.

        Raises
        ------
        RecordError
            When no plane is whole.
        """
        columns = [
            i
            for i, sensor in enumerate(self.sensors)
            if sees_both_directions([other for other in self.sensors if other.node == sensor.node])
        ]
        # without a whole plane the record stays as it is: whoever asks for its planes says what is missing
        return self if len(columns) in (0, len(self.sensors)) else self.of_channels(columns)

    @cached_property
    def directions(self) -> Array:
        """Unit vectors (x, y) along which the sensors read positive, shape (S, 2)."""
        return sensor_directions(self.sensors)

    @cached_property
    def plane_of(self) -> NDArray[np.int64]:
        """Index of the plane of every sensor, shape (S,)."""
        of_node = {plane.node: number for number, plane in enumerate(self.planes)}
        return np.array([of_node[sensor.node] for sensor in self.sensors], dtype=np.int64)

    @cached_property
    def gains(self) -> Array:
        """True displacement per reading of every sensor [1], shape (S,)."""
        return np.array([float(sensor.gain) for sensor in self.sensors])

    @property
    def along(self) -> Array:
        """True displacement along every sensor [m], shape (N, S)."""
        return along_sensors(self.signals, self.sensors)

    @cached_property
    def motion(self) -> Array:
        """Displacement (x, y) of the shaft in every plane, from the origin of the sensors [m], (N, P, 2)."""
        return self.resolved()

    def resolved(self) -> Array:
        """The same, made anew and not kept, part by part: copies of a minute would fill 150 MB."""
        motion = np.empty((len(self.time), len(self.planes), 2))
        for begin in range(0, len(motion), _PART):
            part = slice(begin, begin + _PART)
            motion[part] = planar_of(along_sensors(self.signals[part], self.sensors), self.planes)
        return motion

    def of_channels(self, columns: Sequence[int]) -> Record:
        """The record of some of its sensors."""
        chosen = list(columns)
        return replace(
            self,
            signals=np.ascontiguousarray(self.signals[:, chosen]),
            sensors=tuple(self.sensors[c] for c in chosen),
        )

    @property
    def measured_speed(self) -> tuple[Array, Array] | None:
        """When the speed was read [s] and what was read [rad/s]; None without readings or given by hand.

        A column that repeats one speed to the last digit over a drop was not measured either.
        """
        if self.speed_by_hand or self.speed_time is None or self.speed_readings is None:
            return None
        if np.ptp(self.speed_readings) == 0.0 and self.speed_readings[0] != 0.0:
            return None
        return self.speed_time, self.speed_readings

    @property
    def name(self) -> str:
        """Short name of the record."""
        return self.path.stem if self.path else "record"

    @property
    def event_date(self) -> str:
        """When the recorder says the drop was (ISO 8601); empty where its header does not tell."""
        return event_of(self.metadata)[0]

    @property
    def is_simulated(self) -> bool:
        """Whether it ships with rotordrop, or its header or notes say that it is simulated."""
        words = " ".join((*self.metadata, *self.metadata.values(), *self.notes)).lower()
        return self.sha256 in example_hashes() or "simulat" in words or "synthe" in words

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    def reading(self, channel: str) -> Array:
        """Give the readings of one sensor [m], shape (N,)."""
        try:
            return self.signals[:, self.channel_names.index(channel)]
        except ValueError:
            raise RecordError(
                f"the record has no channel {channel!r}; it has {', '.join(self.channel_names)}"
            ) from None

    def window(self, start: float, end: float) -> Self:
        """Give the samples from `start` to `end` [s], no copies of them; the speed readings stay whole."""
        slack = 1e-3 / self.sampling_rate if np.isfinite(self.sampling_rate) else 0.0
        inside = np.flatnonzero((self.time >= start - slack) & (self.time <= end + slack))
        if not len(inside):
            raise RecordError(
                f"the record reaches from {self.time[0]:.6g} s to {self.time[-1]:.6g} s; nothing lies "
                f"between {start:.6g} s and {end:.6g} s"
            )
        # a slice, unless the time goes back and forth: a copy of a minute would fill 40 MB
        first, last = int(inside[0]), int(inside[-1]) + 1
        keep = slice(first, last) if last - first == len(inside) else inside
        return replace(
            self,
            time=self.time[keep],
            signals=self.signals[keep],
            speed=None if self.speed is None else self.speed[keep],
        )


def read_record(
    path: str | Path,
    machine: Machine,
    *,
    profile: Profile | str | Path | None = None,
    mapping: Sequence[str] = (),
    tail: bool = False,
) -> Record:
    """Read the recording of a drop and match its channels to the sensors of the machine.

    Parameters
    ----------
    path : path-like
        The recording, in any format of `rotordrop.record.readers`.
    machine : Machine
        Names the sensors to look for.
    profile : Profile or path-like, optional
        Channel map and reading rules where the file does not speak for itself.
    mapping : sequence of str
        Channels of sensors, ``"S_NDE_A = X1"``, or of planes, ``"NDE: X1, Y1"``, beside those of the profile.
    tail : bool
        Whether it is the settled tail of a record: it needs no speed, even where the profile names one.

    Raises
    ------
    RecordError
        When the file cannot be read, or a sensor has no channel, or a channel no unit.
    """
    return open_record(path, machine, profile=rules_of(profile, mapping), tail=tail)[0]


def open_record(
    path: str | Path, machine: Machine | None, *, profile: Profile, tail: bool = False
) -> tuple[Record, Arrangement | None]:
    """Read a recording for the sensors of a machine, or without one for those that its channels make."""
    path = Path(path)
    recording = read_recording(path, profile)
    arrangement, sensors = None, () if machine is None else machine.sensors
    if machine is None:
        arrangement = arrangement_of(recording, profile)
        sensors, said = arrangement.sensors, {"channels": dict(arrangement.channels), "planes": {}}
        profile = profile.model_copy(update=said)
    if tail:
        names = {name for channel in recording.channels for name in (channel.label, channel.name)}
        absent = {
            key: None for key in ("channel", "pulses") if getattr(profile.speed, key) not in (None, *names)
        }
        profile = profile.model_copy(update={"speed": profile.speed.model_copy(update=absent)})
    return record_of(recording, sensors, profile=profile, path=path, sha256=sha256_of(path)), arrangement


def sha256_of(path: Path) -> str:
    """Hash of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def record_of(
    recording: Recording,
    sensors: tuple[Sensor, ...],
    *,
    profile: Profile | None = None,
    path: Path | None = None,
    sha256: str = "",
) -> Record:
    """Match the channels of a recording to sensors and bring them to SI units on one clock."""
    profile = profile or Profile()
    place = str(path or "the recording")
    if not sensors:
        raise RecordError("the machine has no sensors; describe them in [[sensors]] of the machine file")
    matched, notes = at_one_rate(match_sensors(recording, sensors, profile, place))
    time, rate, rounded = shared_clock(matched, place)
    signals, words = np.empty((len(time), len(sensors))), []
    for column, (channel, sensor) in enumerate(zip(matched, sensors, strict=True)):
        signals[:, column], said = displacement(channel, sensor, recording, profile, place)
        words += said
    notes += [doubt] if (doubt := event_of(recording.metadata)[1]) else []
    marks = next((c.values for c in recording.channels if c.name == MARKS and c.unit == "s"), None)
    when: Array | None = None
    readings: Array | None = None
    pulses = find_pulses(recording, matched, profile, place)
    if pulses is not None:
        passed = passages(
            pulses.time,
            pulses.values,
            per_turn=profile.speed.pulses_per_turn,
            edge=profile.speed.edge,
            place=f"{place}: channel {pulses.label!r}",
        )
        marks = passed.marks if passed.marks.size else None
        words += passed.warnings
    if profile.speed.constant is not None:
        when, readings = time[[0, -1]], np.full(2, parse_quantity(profile.speed.constant, "speed"))
        notes.append(f"speed given by hand: {profile.speed.constant}")
    elif (channel_of_speed := find_speed(recording, matched, profile, place)) is not None:
        when, readings = readings_of_held_signal(channel_of_speed.time, channel_of_speed.values)
        readings = readings * speed_factor(channel_of_speed, profile, place)
        notes.append(f"shaft speed from {channel_of_speed.label!r}")
    elif pulses is not None:
        when, readings = passed.time, passed.speed
        notes.append(f"shaft speed from the pulses of {profile.speed.pulses!r}")
    return Record(
        time=time,
        signals=signals,
        sensors=sensors,
        sampling_rate=rate,
        speed=None if when is None or readings is None else np.interp(time, when, readings),
        speed_time=when,
        speed_readings=readings,
        speed_by_hand=profile.speed.constant is not None or recording.metadata.get(SPEED_SOURCE) == BY_HAND,
        marks=marks,
        path=path,
        sha256=sha256,
        metadata=recording.metadata,
        notes=(*recording.notes, *notes, *rounded),
        warnings=(*recording.warnings, *dict.fromkeys(words)),
    )


def _record_of_channels(
    machine: Machine,
    channels: Sequence[Channel],
    clock: Array,
    speed: Any,
    rules: Profile,
) -> Record:
    """A record of channels in memory, with the speed given by hand or as readings."""
    if isinstance(speed, str):
        parse_quantity(speed, "speed")
        rules = rules.model_copy(update={"speed": SpeedSource(constant=speed)})
    elif speed is not None:
        if not isinstance(speed, tuple) or len(speed) != 2 or not isinstance(speed[1], str):
            what = repr(speed) if isinstance(speed, int | float) else f"a {type(speed).__name__}"
            raise UsageError(
                f"speed is {what}; expected a text such as '60 Hz', or readings with their unit, "
                "(array, 'rpm')"
            )
        values, name = np.asarray(speed[0], dtype=np.float64), "shaft speed"
        if values.shape != clock.shape:
            raise RecordError(f"the speed has the shape {values.shape}; the time has {clock.shape}")
        of_speed = Channel(name=name, label=name, unit=spelled(speed[1]), values=values, time=clock)
        channels = [*channels, of_speed]
    return record_of(Recording(channels=tuple(channels)), machine.sensors, profile=rules)


def _columns(signals: Mapping[str, ArrayLike] | ArrayLike, names: list[str]) -> dict[str, Array]:
    """Readings by the name of the sensor, each of shape (N,)."""
    if isinstance(signals, Mapping):
        columns = {str(name): np.asarray(values, dtype=np.float64) for name, values in signals.items()}
        lengths = {name: values.shape for name, values in columns.items()}
        shapes = set(lengths.values())
        if len(shapes) != 1 or any(len(shape) != 1 for shape in shapes):
            raise RecordError(f"signals must be arrays of one length each; they have the shapes {lengths}")
        return columns
    table = np.asarray(signals, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise RecordError(
            f"signals have the shape {table.shape}; expected (samples, {len(names)}), one column for each of "
            f"{', '.join(names)}, or a mapping from the names of sensors to arrays"
        )
    return {name: table[:, k].copy() for k, name in enumerate(names)}


def _clock_of(frame: Any) -> tuple[Array, Any]:
    """Time [s] of the rows, from a column "time" or "t", else from the index; and the column taken."""
    values, unit, where, taken = np.asarray(frame.index), "", "the index", None
    for column in frame.columns:
        name, _, written = split_unit(str(column))
        if name.lower() in _TIME_NAMES:
            values, unit, where, taken = np.asarray(frame[column]), written, str(column), column
            break
    else:
        if np.issubdtype(values.dtype, np.integer) and frame.index.name is None:
            raise RecordError(
                "the table has no column 'time' and its index only counts rows; name the time 'time [s]'"
            )
        unit = split_unit(str(frame.index.name or ""))[2]
    if np.issubdtype(values.dtype, np.datetime64):
        values = values - values[0]
    if np.issubdtype(values.dtype, np.timedelta64):
        return np.asarray(values / np.timedelta64(1, "s"), dtype=np.float64), taken
    if unit and unit not in _TIMES:
        raise RecordError(f"{where}: {unit!r} is no unit of time; write one of {', '.join(_TIMES)}")
    return np.asarray(values, dtype=np.float64) * _TIMES[unit or "s"], taken


def save_record(record: Record, path: str | Path) -> None:
    """Write a record as HDF5, nothing rounded; `read_record` reads it back.

    Where it came from and the hash of that file are kept in the header entries.
    """
    metadata = dict(record.metadata)
    if record.path is not None:
        metadata |= {"source": record.path.name, "source_sha256": record.sha256}
    if record.speed_by_hand:
        metadata[SPEED_SOURCE] = BY_HAND
    recording = recording_of(
        record.time,
        record.signals,
        record.channel_names,
        speed_time=record.speed_time,
        speed=record.speed_readings,
        marks=record.marks,
        metadata=metadata,
        notes=record.notes,
        warnings=record.warnings,
    )
    write_hdf5(recording, path)
