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

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError
from rotordrop.machine import Machine
from rotordrop.record.axes import (
    Plane,
    along_sensors,
    planar_of,
    sees_both_directions,
    sensor_directions,
    sensor_planes,
)
from rotordrop.record.matching import displacement, find_pulses, find_speed, match_sensors, speed_factor
from rotordrop.record.profile import Profile, load_profile
from rotordrop.record.readers import read_recording
from rotordrop.record.recording import MARKS, Array, Channel, Recording
from rotordrop.record.speed import readings_of_held_signal
from rotordrop.record.tacho import Passages, passages
from rotordrop.record.writers import recording_of, write_hdf5
from rotordrop.units import format_quantity, parse_quantity

SPEED_SOURCE, BY_HAND = "speed_source", "given by hand"
"""Header entry of a saved record whose speed nobody measured."""


LEAST_REPEATED = 0.01
"""Share of time stamps equal to their neighbour from which a clock may be a rounded one [1]."""

ROUNDING_SLACK = 0.05
"""How far a stamp may be off beyond half its resolution, for the fit of the even clock [1]."""


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
        from rotordrop.record.arrays import record_from_arrays

        return record_from_arrays(
            machine, time, signals, unit=unit, speed=speed, time_unit=time_unit, start=start
        )

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
        from rotordrop.record.arrays import record_from_dataframe

        return record_from_dataframe(machine, frame, unit=unit, speed=speed, profile=profile)

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
        there = [node for node in {sensor.node for sensor in self.sensors} if self._resolves(node)]
        columns = [i for i, sensor in enumerate(self.sensors) if sensor.node in there]
        return self if len(columns) in (0, len(self.sensors)) else self.of_channels(columns)

    def _resolves(self, node: int) -> bool:
        return sees_both_directions([sensor for sensor in self.sensors if sensor.node == node])

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
        return planar_of(self.along, self.planes)

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
        """Cut out the samples from `start` to `end` [s]; the speed readings stay whole."""
        slack = 1e-3 / self.sampling_rate if np.isfinite(self.sampling_rate) else 0.0
        keep = (self.time >= start - slack) & (self.time <= end + slack)
        if not keep.any():
            raise RecordError(
                f"the record reaches from {self.time[0]:.6g} s to {self.time[-1]:.6g} s; nothing lies "
                "between "
                f"{start:.6g} s and {end:.6g} s"
            )
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

    Raises
    ------
    RecordError
        When the file cannot be read, or a sensor has no channel, or a channel no unit.
    """
    path = Path(path)
    rules = profile if isinstance(profile, Profile) else load_profile(profile) if profile else Profile()
    recording = read_recording(path, rules)
    return record_of(recording, machine.sensors, profile=rules, path=path, sha256=sha256_of(path))


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
    matched = match_sensors(recording, sensors, profile, place)
    matched, thinned = _at_one_rate(matched)
    time, rate = _shared_clock(matched, place)
    rounded = (
        ("time stamps are rounded; an even clock was put behind them",) if _repeats(matched[0].time) else ()
    )
    signals, words = np.empty((len(time), len(sensors))), []
    for column, (channel, sensor) in enumerate(zip(matched, sensors, strict=True)):
        signals[:, column], said = displacement(channel, sensor, recording, profile, place)
        words += said
    pulses = _pulses(recording, matched, profile, place)
    speed_time, speed_readings, notes = _speed(recording, matched, profile, time, place, pulses)
    speed = None
    if speed_time is not None and speed_readings is not None:
        speed = np.interp(time, speed_time, speed_readings)
    spoken = tuple(dict.fromkeys(words))
    return Record(
        time=time,
        signals=signals,
        sensors=sensors,
        sampling_rate=rate,
        speed=speed,
        speed_time=speed_time,
        speed_readings=speed_readings,
        speed_by_hand=profile.speed.constant is not None or recording.metadata.get(SPEED_SOURCE) == BY_HAND,
        marks=_marks(recording, pulses),
        path=path,
        sha256=sha256,
        metadata=recording.metadata,
        notes=(*recording.notes, *thinned, *notes, *(rounded if np.all(np.diff(time) > 0.0) else ())),
        warnings=(*recording.warnings, *spoken, *(pulses.warnings if pulses else ())),
    )


def _at_one_rate(channels: tuple[Channel, ...]) -> tuple[tuple[Channel, ...], tuple[str, ...]]:
    """Take every k-th sample of channels sampled k times as fast as the slowest, whose clock they share.

    Nothing is filtered or interpolated: what is kept was read. Channels whose clocks do not meet are left for
    `_shared_clock` to refuse.
    """
    steps = [_step(channel.time) for channel in channels]
    slowest = max(steps)
    slow = channels[steps.index(slowest)].time
    kept, notes = [], []
    for channel, step in zip(channels, steps, strict=True):
        times = round(slowest / step) if step > 0.0 else 1
        thin = channel.time[::times][: len(slow)]
        meets = len(thin) == len(slow) and float(np.max(np.abs(thin - slow), initial=0.0)) <= 1e-3 * slowest
        if times < 2 or not meets:
            kept.append(channel)
            continue
        kept.append(replace(channel, time=thin, values=channel.values[::times][: len(slow)]))
        notes.append(
            f"{channel.label} is sampled {times} times as fast as the slowest sensor; every {times}th sample "
            "is used"
        )
    return tuple(kept), tuple(notes)


def _shared_clock(channels: tuple[Channel, ...], place: str) -> tuple[Array, float]:
    """One clock for all sensors, evenly spaced where the file means it to be."""
    first = channels[0]
    for other in channels[1:]:
        if len(other.time) != len(first.time):
            raise RecordError(
                f"{place}: {first.label!r} has {len(first.time)} samples and {other.label!r} "
                f"{len(other.time)}; the "
                "channels must be sampled together, export them at one rate and length"
            )
        shift = float(np.max(np.abs(other.time - first.time), initial=0.0))
        if shift > 1e-3 * _step(first.time):
            raise RecordError(
                f"{place}: the clocks of {first.label!r} and {other.label!r} differ by "
                f"{format_quantity(shift, 'time')}; the channels must be sampled together"
            )
    if len(first.time) < 2:
        raise RecordError(f"{place}: {len(first.time)} samples are no recording")
    return _even(first.time)


def _step(time: Array) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 1.0


def _even(time: Array) -> tuple[Array, float]:
    """Replace times that are even but for rounding in the file by exactly even ones."""
    count = len(time) - 1
    step = (time[-1] - time[0]) / count
    even = time[0] + step * np.arange(count + 1)
    if step > 0 and float(np.max(np.abs(time - even))) <= 0.02 * step:
        rate = float(f"{1.0 / step:.9g}")
        return time[0] + np.arange(count + 1) / rate, rate
    rounded = _rounded_clock(time)
    if rounded is not None:
        return rounded
    usual = _step(time)
    return time.copy(), 1.0 / usual if usual > 0 else float("nan")


def _repeats(time: Array) -> bool:
    return bool(np.any(np.diff(time) == 0.0))


def _rounded_clock(time: Array) -> tuple[Array, float] | None:
    """The even clock behind stamps that were rounded to about their step; None where there is none.

    Such stamps are multiples of one resolution, many of them equal to their neighbour, and none is further
    from the even clock than half the resolution. Rows that are there twice, or missing, drift away from it.
    """
    steps = np.diff(time)
    if np.mean(steps == 0.0) < LEAST_REPEATED or np.any(steps < 0.0) or not np.any(steps > 0.0):
        return None
    resolution = float(np.min(steps[steps > 0.0]))
    count = np.rint((time - time[0]) / resolution)
    if np.max(np.abs(time - time[0] - count * resolution)) > 1e-3 * resolution:
        return None
    index = np.arange(len(time), dtype=np.float64)
    slope, start = np.polyfit(index, count, 1)
    if np.max(np.abs(count - start - slope * index)) > 0.5 + ROUNDING_SLACK:
        return None
    if (
        abs(slope - 1.0) * len(time) < 1.0
    ):  # within one step over the whole record: the step is the resolution
        slope = 1.0
        start = float(np.mean(count - index))
    rate = float(f"{1.0 / (slope * resolution):.9g}")
    return time[0] + start * resolution + index / rate, rate


def _pulses(
    recording: Recording, taken: tuple[Channel, ...], profile: Profile, place: str
) -> Passages | None:
    channel = find_pulses(recording, taken, profile, place)
    if channel is None:
        return None
    rules, where = profile.speed, f"{place}: channel {channel.label!r}"
    return passages(
        channel.time, channel.values, per_turn=rules.pulses_per_turn, edge=rules.edge, place=where
    )


def _marks(recording: Recording, pulses: Passages | None) -> Array | None:
    """Passages of a mark: from pulses, or as a record that was saved keeps them."""
    if pulses is not None:
        return pulses.marks if pulses.marks.size else None
    kept = [channel.values for channel in recording.channels if channel.name == MARKS and channel.unit == "s"]
    return kept[0] if kept else None


def _speed(
    recording: Recording,
    taken: tuple[Channel, ...],
    profile: Profile,
    time: Array,
    place: str,
    pulses: Passages | None,
) -> tuple[Array | None, Array | None, list[str]]:
    if profile.speed.constant is not None:
        value = parse_quantity(profile.speed.constant, "speed")
        note = f"speed given by hand: {profile.speed.constant}"
        return time[[0, -1]], np.array([value, value]), [note]
    channel = find_speed(recording, taken, profile, place)
    if channel is None and pulses is not None:
        return pulses.time, pulses.speed, [f"shaft speed from the pulses of {profile.speed.pulses!r}"]
    if channel is None:
        return None, None, []
    when, readings = readings_of_held_signal(channel.time, channel.values)
    return when, readings * speed_factor(channel, profile, place), [f"shaft speed from {channel.label!r}"]


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
