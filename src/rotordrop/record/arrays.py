"""A record from what is in memory already: arrays, or a table of a data-analysis package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.errors import RecordError, UsageError
from rotordrop.machine import Machine
from rotordrop.record.profile import Profile, SpeedSource
from rotordrop.record.recording import Array, Channel, Recording, known_unit, split_unit
from rotordrop.units import parse_quantity

if TYPE_CHECKING:
    from rotordrop.record.record import Record

_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
_TIME_NAMES = ("time", "t", "zeit")
_SPEED = "shaft speed"


def record_from_arrays(
    machine: Machine,
    time: ArrayLike | str,
    signals: Mapping[str, ArrayLike] | ArrayLike,
    *,
    unit: str | Mapping[str, str],
    speed: str | tuple[ArrayLike, str] | None = None,
    time_unit: str = "s",
    start: str = "0 s",
) -> Record:
    """Make a record of arrays; see `Record.from_arrays`."""
    names = [sensor.name for sensor in machine.sensors]
    columns = _columns(signals, names)
    count = len(next(iter(columns.values())))
    clock = _clock(time, count, time_unit, start)
    channels = [
        Channel(name=name, label=name, unit=_unit_of(name, unit), values=values, time=clock)
        for name, values in columns.items()
    ]
    return _record(machine, channels, clock, speed)


def record_from_dataframe(
    machine: Machine,
    frame: Any,
    *,
    unit: str | Mapping[str, str] | None = None,
    speed: str | None = None,
    profile: Profile | None = None,
) -> Record:
    """Make a record of a table with named columns; see `Record.from_dataframe`."""
    clock, taken = _clock_of(frame)
    channels = []
    for column in frame.columns:
        if column is taken or not np.issubdtype(np.asarray(frame[column]).dtype, np.number):
            continue
        name, label, own = split_unit(str(column))
        values = np.asarray(frame[column], dtype=np.float64)
        given = unit.get(name, unit.get(str(column), own)) if isinstance(unit, Mapping) else own or unit or ""
        channels.append(
            Channel(name=name, label=label, unit=known_unit(given) or given, values=values, time=clock)
        )
    return _record(machine, channels, clock, speed, profile)


def _record(
    machine: Machine,
    channels: Sequence[Channel],
    clock: Array,
    speed: str | tuple[ArrayLike, str] | None,
    profile: Profile | None = None,
) -> Record:
    from rotordrop.record.record import record_of

    rules = profile or Profile()
    if isinstance(speed, str):
        parse_quantity(speed, "speed")
        rules = rules.model_copy(update={"speed": SpeedSource(constant=speed)})
    elif speed is not None:
        channels = [*channels, _speed_channel(speed, clock)]
    return record_of(Recording(channels=tuple(channels)), machine.sensors, profile=rules)


def _speed_channel(speed: Any, clock: Array) -> Channel:
    if not isinstance(speed, tuple) or len(speed) != 2 or not isinstance(speed[1], str):
        raise UsageError(
            f"speed is {_kind_of(speed)}; expected a text such as '60 Hz', or readings with their unit, "
            "(array, 'rpm')"
        )
    values = np.asarray(speed[0], dtype=np.float64)
    if values.shape != clock.shape:
        raise RecordError(f"the speed has the shape {values.shape}; the time has {clock.shape}")
    return Channel(
        name=_SPEED, label=_SPEED, unit=known_unit(speed[1]) or speed[1], values=values, time=clock
    )


def _columns(signals: Mapping[str, ArrayLike] | ArrayLike, names: list[str]) -> dict[str, Array]:
    if isinstance(signals, Mapping):
        columns = {str(name): np.asarray(values, dtype=np.float64) for name, values in signals.items()}
        lengths = {name: values.shape for name, values in columns.items()}
        if (
            not columns
            or len(set(lengths.values())) > 1
            or any(len(shape) != 1 for shape in lengths.values())
        ):
            raise RecordError(f"signals must be arrays of one length each; they have the shapes {lengths}")
        return columns
    table = np.asarray(signals, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise RecordError(
            f"signals have the shape {table.shape}; expected (samples, {len(names)}), one column for each of "
            f"{', '.join(names)}, or a mapping from the names of sensors to arrays"
        )
    return {name: table[:, k].copy() for k, name in enumerate(names)}


def _unit_of(name: str, unit: str | Mapping[str, str]) -> str:
    said = unit.get(name, "") if isinstance(unit, Mapping) else unit
    if not said:
        raise UsageError(f"the unit of {name} is {said!r}; say it, for example unit='um'")
    return known_unit(said) or said


def _clock(time: ArrayLike | str, count: int, unit: str, start: str) -> Array:
    """Time of the samples [s]: an array, or a sampling rate such as "20 kHz" and the first instant."""
    if isinstance(time, str):
        rate = parse_quantity(time, "frequency")
        return np.asarray(parse_quantity(start, "time") + np.arange(count) / rate)
    if unit not in _TIMES:
        raise UsageError(f"time_unit is {unit!r}; expected one of {', '.join(_TIMES)}")
    clock = np.asarray(time, dtype=np.float64) * _TIMES[unit]
    if clock.shape != (count,):
        raise RecordError(
            f"time has the shape {clock.shape} and the signals have {count} samples; give one time for each "
            "sample, or a sampling rate such as '20 kHz'"
        )
    return clock


def _clock_of(frame: Any) -> tuple[Array, Any]:
    """Time [s] of the rows, from a column "time" or "t", else from the index; and the column taken."""
    for column in frame.columns:
        name, _, unit = split_unit(str(column))
        if name.lower() in _TIME_NAMES:
            return _seconds(np.asarray(frame[column]), unit or "s", str(column)), column
    index = np.asarray(frame.index)
    if np.issubdtype(index.dtype, np.integer) and frame.index.name is None:
        raise RecordError(
            "the table has no column 'time' and its index only counts rows; name the time 'time [s]'"
        )
    return _seconds(index, split_unit(str(frame.index.name or ""))[2] or "s", "the index"), None


def _seconds(values: Any, unit: str, where: str) -> Array:
    if np.issubdtype(values.dtype, np.datetime64):
        return np.asarray((values - values[0]) / np.timedelta64(1, "s"), dtype=np.float64)
    if np.issubdtype(values.dtype, np.timedelta64):
        return np.asarray(values / np.timedelta64(1, "s"), dtype=np.float64)
    if unit not in _TIMES:
        raise RecordError(f"{where}: {unit!r} is no unit of time; write one of {', '.join(_TIMES)}")
    return np.asarray(values, dtype=np.float64) * _TIMES[unit]


def _kind_of(value: object) -> str:
    return repr(value) if isinstance(value, int | float) else f"a {type(value).__name__}"
