"""Delimited text with a header, units in the column names and a time column."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotordrop.errors import OutputError
from rotordrop.files import write_text
from rotordrop.record.recording import Array, Channel, Recording

_SPEED_UNITS = ("Hz", "rpm", "rad/s")


def write_delimited(
    recording: Recording,
    path: str | Path,
    *,
    separator: str = ";",
    decimal: str = ".",
    digits: int = 3,
) -> None:
    """Write a recording as text, displacements in micrometres.

    Parameters
    ----------
    recording : Recording
        What to write; all displacement channels must share one clock. A speed read less often is held.
    path : path-like
        Where to.
    separator, decimal : str
        Sign between columns and in numbers.
    digits : int
        Decimals of the displacements.
    """
    if separator == decimal:
        raise OutputError(f"{separator!r} cannot be both the separator and the decimal sign")
    clock = recording.channels[0].time
    columns = [_on_clock(channel, clock) for channel in recording.channels]
    header = [f"# {key}: {value}" for key, value in recording.metadata.items()]
    names = ["Time [s]"] + [f"{channel.name} [{_unit(channel)}]" for channel in recording.channels]
    step = float(np.median(np.diff(clock))) if len(clock) > 1 else 1.0
    places = max(int(np.ceil(-np.log10(step))) + 2, 3)
    formats = [f"%.{places}f"] + [
        "%.4f" if channel.unit in _SPEED_UNITS else f"%.{digits}f" for channel in recording.channels
    ]
    rows = np.column_stack([clock, *columns])
    lines = [separator.join(formats) % tuple(row) for row in rows]
    if decimal != ".":
        lines = [line.replace(".", decimal) for line in lines]
    write_text(path, "\n".join([*header, separator.join(names), *lines]) + "\n")


def _unit(channel: Channel) -> str:
    return "um" if channel.unit == "m" else channel.unit


def _on_clock(channel: Channel, clock: Array) -> Array:
    values = channel.values * (1e6 if channel.unit == "m" else 1.0)
    if len(channel.time) == len(clock) and np.allclose(channel.time, clock, rtol=0.0, atol=1e-9):
        return values
    if channel.unit not in _SPEED_UNITS:
        raise OutputError(
            f"{channel.name} has {len(channel.time)} samples on another clock than {len(clock)}; write HDF5 "
            "instead"
        )
    held = np.clip(np.searchsorted(channel.time, clock, side="right") - 1, 0, len(values) - 1)
    return np.asarray(values[held])
