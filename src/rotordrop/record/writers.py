"""Writers of recordings, in the layouts that the readers read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotordrop.errors import OutputError
from rotordrop.files import new_hdf5, write_text
from rotordrop.record.recording import SPEED_UNITS, Recording

_FULL_SCALE = 2**15 - 1
"""Largest count of a signed 16-bit integer, as recorders store them."""


def write_delimited(
    recording: Recording,
    path: str | Path,
    *,
    separator: str = ";",
    decimal: str = ".",
    digits: int = 3,
) -> None:
    """Write a recording as text with a header and a time column, displacements in micrometres.

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
    step = float(np.median(np.diff(clock))) if len(clock) > 1 else 1.0
    # two digits beyond the step, so that the even clock is found again on reading
    names, columns, formats = ["Time [s]"], [clock], [f"%.{max(int(np.ceil(-np.log10(step))) + 2, 3)}f"]
    for channel in recording.channels:
        unit, factor = ("um", 1e6) if channel.unit == "m" else (channel.unit, 1.0)
        turning = channel.unit in SPEED_UNITS
        values = channel.values * factor
        if len(channel.time) != len(clock) or not np.allclose(channel.time, clock, rtol=0.0, atol=1e-9):
            if not turning:
                raise OutputError(
                    f"{channel.name} has {len(channel.time)} samples on another clock than {len(clock)}; "
                    "write HDF5 instead"
                )
            held = np.clip(np.searchsorted(channel.time, clock, side="right") - 1, 0, len(values) - 1)
            values = values[held]
        names.append(f"{channel.name} [{unit}]")
        columns.append(values)
        formats.append("%.4f" if turning else f"%.{digits}f")
    lines = [separator.join(formats) % tuple(row) for row in np.column_stack(columns)]
    if decimal != ".":
        lines = [line.replace(".", decimal) for line in lines]
    header = [f"# {key}: {value}" for key, value in recording.metadata.items()]
    write_text(path, "\n".join([*header, separator.join(names), *lines]) + "\n")


def write_hdf5(recording: Recording, path: str | Path, *, step: float | None = None) -> None:
    """Write a recording as HDF5: one dataset per channel with its unit and clock in attributes.

    Parameters
    ----------
    recording : Recording
        What to write.
    path : path-like
        Where to.
    step : float, optional
        Quantisation of the channels in their unit; they are then stored as 16-bit integers with a scale, as
        recorders do. Without it nothing is rounded.
    """
    with new_hdf5(path) as file:
        for key, value in recording.metadata.items():
            file.attrs[key] = value
        for key, texts in (("notes", recording.notes), ("warnings", recording.warnings)):
            if texts:
                file.attrs[key] = "\n".join(texts)
        for channel in recording.channels:
            turning = channel.unit in SPEED_UNITS
            folder = file.require_group("speed" if turning else "displacement")
            values = channel.values
            if step is not None and not turning:
                counts = np.rint(values / step)
                largest = float(np.max(np.abs(counts), initial=0.0))
                if not largest <= _FULL_SCALE:
                    raise OutputError(
                        f"{channel.name} needs {largest:.6g} steps of {step:g} {channel.unit}; 16 bits have "
                        f"{_FULL_SCALE}: take a larger step"
                    )
                values = counts.astype(np.int16)
            item = folder.create_dataset(
                channel.name, data=values, compression="gzip", shuffle=True, fletcher32=True
            )
            item.attrs["unit"] = channel.unit
            if step is not None and not turning:
                item.attrs["scale"], item.attrs["offset"] = step, 0.0
            steps = np.diff(channel.time)
            usual = float(np.median(steps)) if len(steps) else 1.0
            if len(steps) and float(np.max(np.abs(steps - usual))) > 1e-6 * usual:
                folder.create_dataset(f"{channel.name}_time", data=channel.time, compression="gzip")
                item.attrs["time"] = f"{channel.name}_time"
                continue
            # the mean step over the whole channel: the median would carry the rounding of single stamps
            even = (
                float(channel.time[-1] - channel.time[0]) / max(len(steps), 1) if len(channel.time) else 0.0
            )
            item.attrs["t0_s"] = float(channel.time[0]) if len(channel.time) else 0.0
            item.attrs["dt_s"] = even or usual
