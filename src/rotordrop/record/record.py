"""One recorded drop: what the sensors of the machine read, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotordrop.arrays import Array
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UsageError
from rotordrop.examples import example_hashes
from rotordrop.files import digest_of_file, new_hdf5
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
from rotordrop.record.clock import even, even_clock, from_first_stamp, in_seconds, on_one_clock, with_times
from rotordrop.record.columns import (
    NO_FILE,
    displacement,
    find_named,
    find_speed,
    match_sensors,
    speed_factor,
)
from rotordrop.record.event_date import event_of
from rotordrop.record.keys import speed_told
from rotordrop.record.missing import gone_on, mended, no_values, without_pairs
from rotordrop.record.profile import Profile, SpeedSource, rules_of
from rotordrop.record.readers import read_recording
from rotordrop.record.readers.numpy_files import recording_of_arrays
from rotordrop.record.recording import MARKS, SPEED_UNITS, Channel, Recording, spelled, split_unit, whose_time
from rotordrop.record.tacho import passages, readings_of_held_signal
from rotordrop.require import each, numbers, require
from rotordrop.series import PART, stride_of
from rotordrop.sketch import sketch
from rotordrop.units import FASTEST_SPIN, format_quantity, in_si, parse_quantity

SPEED_SOURCE, BY_HAND = "speed_source", "given by hand"
"""Header entry of a saved record whose speed nobody measured."""

_TIME_UNITS = ("s", "ms", "us", "min")
SLOWEST, FASTEST = 1e-3, 1e9
"""Sampling rates [Hz] beyond which a unit is mistyped (chosen)."""


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
    missing: NDArray[np.bool_] | None = None
    """Readings that nobody made, shape (N, S): in `signals` they lie between their neighbours, or are NaN."""
    marks: Array | None = None
    """When a mark of the shaft passed the keyphasor [s]: the rotor angle there is a whole number of turns,
    shape (M,)."""
    path: Path | None = None
    sha256: str = ""
    """Where the record comes from, and the hash of that file."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Header entries of the file."""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """Choices made on reading, and damage worked around."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", each(self.sensors, "sensors", Sensor))
        rate = float(numbers(self.sampling_rate, "sampling_rate", ()))
        object.__setattr__(
            self, "sampling_rate", require(rate, "sampling_rate", float, least=SLOWEST, most=FASTEST)
        )
        require(self.speed_by_hand, "speed_by_hand", bool)
        require(self.path, "path", Path, none=True)
        require(self.sha256, "sha256", str)
        require(self.metadata, "metadata", Mapping, hint="Give the header as {name: text}")
        each(self.notes, "notes", str)
        each(self.warnings, "warnings", str)
        shape = (numbers(self.time, "time").size, len(self.sensors))
        if np.shape(self.signals) != shape or not shape[0]:
            words = f"{shape[0]} times and {shape[1]} sensors need {shape}, one time at least"
            raise RecordError(f"signals have the shape {np.shape(self.signals)}; {words}")
        if (m := self.missing) is not None and (np.shape(m) != shape or np.asarray(m).dtype != np.bool_):
            raise RecordError(f"missing has the shape {np.shape(m)}; expected {shape}, True or False")
        if (self.speed_time is None) != (self.speed_readings is None):
            raise RecordError("speed_time and speed_readings belong together; give both or none")
        readings = None if self.speed_time is None else np.shape(self.speed_time)
        lengths = {"time": shape[:1], "signals": None, "speed": shape[:1], "speed_readings": readings}
        sizes = {name: (np.size(getattr(self, name)),) for name in ("speed_time", "marks")}
        for name, length in (lengths | sizes).items():
            if getattr(self, name) is not None:
                array = numbers(getattr(self, name), name, length, finite=name in ("time", "marks"))
                array.setflags(write=False)
                object.__setattr__(self, name, array)

    @classmethod
    def from_arrays(
        cls,
        machine: Machine,
        time: ArrayLike | str,
        signals: Mapping[str, ArrayLike] | ArrayLike,
        *,
        unit: str | Mapping[str, str],
        speed: str | float | tuple[ArrayLike, str] | None = None,
        time_unit: str = "s",
        start: str | float = 0.0,
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
        speed : str, float or tuple, optional
            "60 Hz" or a float [rad/s] given by hand, or readings with their unit, ``(array, "rpm")``.
        time_unit, start : str
            Unit of the times; first instant, also as a float [s], where a sampling rate is given.

        Examples
        --------
        >>> import numpy as np
        >>> from rotordrop import Record, example_machine
        >>> machine = example_machine("paper")
        >>> record = Record.from_arrays(machine, "20 kHz", np.zeros((100, 4)), unit="um", speed="60 Hz")
        >>> record.sampling_rate
        20000.0
        """
        names = [sensor.name for sensor in require(machine, "machine", Machine).sensors]
        require(unit, "unit", str, Mapping, hint="Say it, for example unit='um'")
        columns = _columns(signals, names)
        count = len(next(iter(columns.values())))
        first = require(in_si(start, "time", "start"), "start", float)
        if isinstance(time, str):
            rate = require(parse_quantity(time, "frequency"), "the sampling rate in time", float, above=0.0)
            clock = np.asarray(first + np.arange(count) / rate)
        else:
            unit_of_time = require(time_unit, "time_unit", str, among=_TIME_UNITS)
            stamps = numbers(time, "time", finite=True)
            if stamps.ndim == 0:
                expected = "a time for each sample, or the sampling rate as text, such as '20 kHz'"
                raise RecordError(f"time is one number, {stamps:g}; expected {expected}")
            if first or stamps.shape != (count,):
                words = (
                    f"time has the shape {stamps.shape} and the signals have {count} samples, from {start}"
                )
                raise RecordError(
                    f"{words}; give one time for each sample, or a sampling rate such as '20 kHz'"
                )
            (clock,) = in_seconds([stamps], [unit_of_time])
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
        speed: str | float | None = None,
        profile: Profile | None = None,
    ) -> Record:
        """Make a record of a table with named columns, such as a pandas data frame.

        Parameters
        ----------
        machine : Machine
            Names the sensors.
        frame : data frame
            Columns named as in a file, "X1 [um]", "speed [rpm]"; a column "time [s]", or times as the index.
        unit : str or mapping, optional
            Unit of the columns that do not name one, of all or by column.
        speed : str or float, optional
            Speed given by hand, such as "60 Hz", or a float [rad/s].
        profile : Profile, optional
            Which column is which sensor, where the names differ.
        """
        require(machine, "machine", Machine)
        if (
            not hasattr(frame, "columns")
            or not hasattr(frame, "index")
            or not len(frame)
            or hasattr(frame.index, "levels")
        ):
            words = "Record.from_arrays takes arrays, frame.reset_index() makes columns of levels."
            expected = "expected a data frame with rows and one level of index"
            raise UsageError(f"frame is a {type(frame).__name__}; {expected}. {words}")
        columns = {str(name): _plain(frame[name]) for name in frame.columns}
        if not any(whose_time(split_unit(name)[0]) == "" for name in columns):
            index, named = _plain(frame.index), str(frame.index.name or "")
            if index.dtype.kind in "iu" and not named:
                words = "no column 'time' and its index only counts rows; name the time 'time [s]'"
                raise RecordError(f"the table has {words}")
            columns[f"time [{split_unit(named)[2]}]"] = index
        timed = [name for name in columns if whose_time(split_unit(name)[0]) is not None]
        texts = [n for n, one in columns.items() if one.dtype.kind not in ("fiuMm" if n in timed else "fiu")]
        columns = {name: one for name, one in columns.items() if name not in texts}
        rules = rules_of(profile, ())
        require(unit, "unit", str, Mapping, none=True)
        given, every = (unit, "") if isinstance(unit, Mapping) else ({}, unit or "")
        channels = [
            replace(one, unit=spelled(given.get(one.name) or given.get(one.label) or one.unit or every))
            for one in recording_of_arrays(columns, Path("the table"), rules).channels
        ]
        record = _record_of_channels(machine, channels, channels[0].time, speed, rules)
        notes = (*record.notes, f"left out, no numbers: {', '.join(texts)}") if texts else record.notes
        return replace(record, notes=notes)

    def __repr__(self) -> str:
        """Name, length, rate and channels."""
        has = f"{', '.join(self.channel_names)}, {'with' if self.speed is not None else 'no'} speed"
        return f"<Record {self.name}: {self.duration:.4g} s at {self.sampling_rate:g} Hz, {has}>"

    def _repr_html_(self) -> str:
        read = zip(self.channel_names, self.signals.T, strict=True)
        return sketch(repr(self), "time [s]", "reading [µm]", {n: (self.time, v) for n, v in read}, 1e6)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the columns of `signals`, as the machine names its sensors."""
        return tuple(sensor.name for sensor in self.sensors)

    @cached_property
    def planes(self) -> tuple[Plane, ...]:
        """The sensor planes; `RecordError` where the sensors of one do not give x and y."""
        return sensor_planes(self.sensors)

    @cached_property
    def whole(self) -> Record:
        """The record with those planes only whose sensors give x and y; as it is where none does."""
        columns = [
            i
            for i, sensor in enumerate(self.sensors)
            if sees_both_directions([other for other in self.sensors if other.node == sensor.node])
        ]
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
        motion = np.empty((len(self.planes), len(self.time), 2)).swapaxes(0, 1)  # each plane by itself
        for begin in range(0, len(motion), PART):
            part = slice(begin, begin + PART)
            motion[part] = planar_of(along_sensors(self.signals[part], self.sensors), self.planes)
        return motion

    def thinned(self) -> Self:
        """Give every so many-th sample of a long record, no copies of them; itself up to `MANY` samples."""
        stride = stride_of(len(self.time))
        return (
            self
            if stride == 1
            else replace(self.samples(slice(None, None, stride)), sampling_rate=self.sampling_rate / stride)
        )

    def samples(self, keep: slice | NDArray[np.intp]) -> Self:
        """Give some samples; the speed readings stay whole."""
        return replace(
            self,
            time=self.time[keep],
            signals=self.signals[keep],
            missing=None if self.missing is None else self.missing[keep],
            speed=None if self.speed is None else self.speed[keep],
        )

    def of_channels(self, columns: Sequence[int]) -> Record:
        """The record of some of its sensors."""
        most = len(self.sensors) - 1
        chosen = [require(one, "column", int, least=0, most=most) for one in each(columns, "columns", int)]
        if not chosen or len(set(chosen)) < len(chosen):
            raise UsageError(f"columns is {chosen}; expected one or more, each once, of 0 to {most}")
        return replace(
            self,
            signals=np.ascontiguousarray(self.signals[:, chosen]),
            missing=None if self.missing is None else self.missing[:, chosen],
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
        if channel not in self.channel_names:
            have = ", ".join(self.channel_names)
            raise RecordError(f"the record has no channel {channel!r}; it has {have}")
        return self.signals[:, self.channel_names.index(channel)]

    def window(self, start: float, end: float) -> Self:
        """Give the samples from `start` to `end` [s], no copies of them; the speed readings stay whole."""
        start, end = numbers([start, end], "start and end", (2,))
        slack = 1e-3 / self.sampling_rate
        inside = np.flatnonzero((self.time >= start - slack) & (self.time <= end + slack))
        if not len(inside):
            reaches = f"the record reaches from {self.time[0]:.6g} s to {self.time[-1]:.6g} s"
            raise RecordError(f"{reaches}; nothing lies between {start:.6g} s and {end:.6g} s")
        # a slice, unless the time goes back and forth: a copy of a minute would fill 40 MB
        first, last = int(inside[0]), int(inside[-1]) + 1
        return self.samples(slice(first, last) if last - first == len(inside) else inside)


def read_record(
    path: str | Path,
    machine: Machine | None = None,
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
    machine : Machine, optional
        Names the sensors to look for; without it they are those that the channels make, as in `look`.
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
    require(path, "path", str, PathLike)
    require(machine, "machine", Machine, none=True)
    require(tail, "tail", bool)
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
    return record_of(recording, sensors, profile=profile, path=path, sha256=digest_of_file(path)), arrangement


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
    place = str(path or NO_FILE)
    if not sensors:
        raise RecordError("the machine has no sensors; describe them in [[sensors]] of the machine file")
    recording = from_first_stamp(with_times(recording, place))
    channels, set_back = gone_on(recording.channels)
    recording = replace(recording, channels=channels)
    matched = [
        replace(channel, values=np.where(bad, np.nan, channel.values)) if bad.any() else channel
        for channel in match_sensors(recording, sensors, profile, place)
        for bad in (no_values(channel.values),)
    ]
    plain, in_pairs = without_pairs(matched)
    shared, notes = on_one_clock(plain, place)
    time, rate, rounded = even_clock(shared, place)
    of_speed = None if profile.speed.constant else find_speed(recording, matched, profile, place)
    signals, factor, words = _in_si(shared, sensors, of_speed, recording, profile, place)
    words = [*set_back, *in_pairs, *words]
    even_time, signals, missing, said = mended(time, signals, [channel.label for channel in shared])
    time, rate = (time, rate) if np.array_equal(even_time, time) else even(even_time)
    words += said
    for own in (time, signals):  # the record's own: not copied
        own.setflags(write=False)
    notes += [doubt] if (doubt := event_of(recording.metadata)[1]) else []
    marks = next((c.values for c in recording.channels if c.name == MARKS and c.unit == "s"), None)
    when: Array | None = None
    readings: Array | None = None
    pulses = find_named(recording, matched, profile.speed.pulses, "channel of pulses", place)
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
    constant, told = None, ""
    if profile.speed.constant is not None:
        constant = parse_quantity(profile.speed.constant, "speed")
        told = f"speed given by hand: {format_quantity(constant, 'speed')}"
    elif of_speed is None and pulses is None:
        constant, told = speed_told(recording.metadata)
    notes += [told] if told else []
    if constant is not None:
        when, readings = time[[0, -1]], np.full(2, constant)
    elif of_speed is not None:
        known = ~no_values(of_speed.values)
        if not known.any():
            raise RecordError(f"{place}: {of_speed.label!r} holds no speed; give one by hand, '60 Hz'")
        when, readings = readings_of_held_signal(of_speed.time[known], of_speed.values[known])
        readings = readings * factor
        notes.append(f"shaft speed from {of_speed.label!r}")
    elif pulses is not None:
        when, readings = passed.time, passed.speed
        notes.append(f"shaft speed from the pulses of {profile.speed.pulses!r}")
    return Record(
        time=time,
        signals=signals,
        missing=missing if missing.any() else None,
        sensors=sensors,
        sampling_rate=rate,
        speed=None if when is None or readings is None else np.interp(time, when, readings),
        speed_time=when,
        speed_readings=readings,
        speed_by_hand=constant is not None or recording.metadata.get(SPEED_SOURCE) == BY_HAND,
        marks=marks,
        path=path,
        sha256=sha256,
        metadata=recording.metadata,
        notes=(*recording.notes, *notes, *rounded),
        warnings=(*recording.warnings, *dict.fromkeys(words)),
    )


def _in_si(
    shared: Sequence[Channel],
    sensors: Sequence[Sensor],
    of_speed: Channel | None,
    recording: Recording,
    profile: Profile,
    place: str,
) -> tuple[Array, float, list[str]]:
    """Readings (N, S) [m], the unit of the speed [rad/s], and words; what is not known is asked at once."""
    signals, factor, words = np.full((len(shared[0].time), len(sensors)), np.nan), 1.0, list[str]()
    asked: list[RecordError] = []
    for column, (channel, sensor) in enumerate(zip(shared, sensors, strict=True)):
        try:
            signals[:, column], said = displacement(channel, sensor, recording, profile, place)
            words += said
        except RecordError as error:
            asked += [] if asked else [error]
    try:
        factor = speed_factor(of_speed, profile, place) if of_speed else 1.0
    except RecordError as error:
        asked.append(error)
    if asked:
        more = (str(error).removeprefix(f"{place}: ") for error in asked[1:])
        raise RecordError("; also: ".join([str(asked[0]), *more]))
    return signals, factor, words


def _record_of_channels(
    machine: Machine, channels: Sequence[Channel], clock: Array, speed: Any, rules: Profile
) -> Record:
    """A record of channels in memory, with the speed given by hand or as readings."""
    if isinstance(speed, str | int | float):
        constant = f"{require(in_si(speed, 'speed', 'speed'), 'speed', float, most=FASTEST_SPIN)!r} rad/s"
        rules = rules.model_copy(update={"speed": SpeedSource(constant=constant)})
    elif speed is not None:
        if not isinstance(speed, tuple) or len(speed) != 2 or not isinstance(speed[1], str):
            expected = "a text such as '60 Hz', a float [rad/s], or readings with their unit, (array, 'rpm')"
            raise UsageError(f"speed is a {type(speed).__name__}; expected {expected}")
        values, name = numbers(speed[0], "speed"), "shaft speed"
        if values.shape != clock.shape:
            raise RecordError(f"the speed has the shape {values.shape}; the time has {clock.shape}")
        of_speed = Channel(name=name, label=name, unit=spelled(speed[1]), values=values, time=clock)
        channels = [*channels, of_speed]
    return record_of(Recording(channels=tuple(channels)), machine.sensors, profile=rules)


def _columns(signals: Mapping[str, ArrayLike] | ArrayLike, names: list[str]) -> dict[str, Array]:
    """Readings by the name of the sensor, each of shape (N,)."""
    table: Any = signals
    if isinstance(table, Mapping) or any(isinstance(name, str) for name in getattr(table, "columns", ())):
        columns = {str(name): numbers(values, str(name)) for name, values in table.items()}
        lengths = {name: values.shape for name, values in columns.items()}
        shapes = set(lengths.values())
        if len(shapes) != 1 or any(len(shape) != 1 for shape in shapes):
            raise RecordError(f"signals must be arrays of one length each; they have the shapes {lengths}")
        return columns
    table = numbers(table, "signals")
    if table.ndim != 2 or table.shape[1] != len(names):
        words = f"expected (samples, {len(names)}), one column for each of {', '.join(names)}"
        ask = "or a mapping from the names of sensors to arrays"
        raise RecordError(f"signals have the shape {table.shape}; {words}, {ask}")
    return {name: table[:, k].copy() for k, name in enumerate(names)}


def _plain(column: Any) -> NDArray[Any]:
    """A column of a table as numpy has it; moments with a time zone, which it does not know, in UTC."""
    values = np.asarray(column)
    zoned = values.dtype == object and len(values) > 0 and hasattr(values[0], "tzinfo")
    return np.asarray(column, dtype="datetime64[ns]") if zoned else values


def as_recording(record: Record) -> Recording:
    """A record as a file holds it: NaN for a reading that nobody made, the speed in Hz."""
    read = record.signals if record.missing is None else np.where(record.missing, np.nan, record.signals)
    channels = [
        Channel(name=name, label=name, unit="m", values=read[:, i], time=record.time)
        for i, name in enumerate(record.channel_names)
    ]
    if record.speed_readings is not None and record.speed_time is not None:
        turns = record.speed_readings / (2 * np.pi)
        channels.append(Channel(name="speed", label="speed", unit="Hz", values=turns, time=record.speed_time))
    if record.marks is not None:
        channels.append(Channel(name=MARKS, label=MARKS, unit="s", values=record.marks, time=record.marks))
    return Recording(
        channels=tuple(channels), metadata=record.metadata, notes=record.notes, warnings=record.warnings
    )


def save_record(record: Record, path: str | Path) -> None:
    """Write a record as HDF5, nothing rounded; `read_record` reads it back.

    Where it came from and the hash of that file are kept in the header entries.
    """
    metadata = dict(record.metadata)
    if record.path is not None:
        metadata |= {"source": record.path.name, "source_sha256": record.sha256}
    if record.speed_by_hand:
        metadata[SPEED_SOURCE] = BY_HAND
    write_hdf5(as_recording(replace(record, metadata=metadata)), path)


def write_hdf5(recording: Recording, path: str | Path) -> None:
    """Write a recording as HDF5: one dataset per channel with its unit and clock in attributes."""
    with new_hdf5(path) as file:
        for key, value in recording.metadata.items():
            file.attrs[key] = value
        for key, texts in (("notes", recording.notes), ("warnings", recording.warnings)):
            if texts:
                file.attrs[key] = "\n".join(texts)
        for channel in recording.channels:
            folder = file.require_group("speed" if channel.unit in SPEED_UNITS else "displacement")
            item = folder.create_dataset(
                channel.name, data=channel.values, compression="gzip", shuffle=True, fletcher32=True
            )
            item.attrs["unit"] = channel.unit
            steps = np.diff(channel.time)
            usual = float(np.median(steps)) if len(steps) else 1.0
            if len(steps) and float(np.max(np.abs(steps - usual))) > 1e-6 * usual:
                folder.create_dataset(f"{channel.name}_time", data=channel.time, compression="gzip")
                item.attrs["time"] = f"{channel.name}_time"
                continue
            # the mean step over the whole channel: the median would carry the rounding of single stamps
            span = float(channel.time[-1] - channel.time[0]) if len(channel.time) else 0.0
            item.attrs["t0_s"] = float(channel.time[0]) if len(channel.time) else 0.0
            item.attrs["dt_s"] = span / max(len(steps), 1) or usual
