"""HDF5: one dataset per channel with its unit and clock in attributes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import OutputError
from rotordrop.files import new_hdf5
from rotordrop.record.recording import Channel, Recording

_SPEED_UNITS = ("Hz", "rpm", "rad/s")
_FULL_SCALE = 32767


def write_hdf5(recording: Recording, path: str | Path, *, step: float | None = None) -> None:
    """Write a recording as HDF5.

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
            turning = channel.unit in _SPEED_UNITS
            folder = file.require_group("speed" if turning else "displacement")
            _write(folder, channel, None if turning else step)


def _write(folder: Any, channel: Channel, step: float | None) -> None:
    values = channel.values
    if step is not None:
        counts = np.rint(values / step)
        largest = float(np.max(np.abs(counts), initial=0.0))
        if not largest <= _FULL_SCALE:
            raise OutputError(
                f"{channel.name} needs {largest:.6g} steps of {step:g} {channel.unit}; 16 bits have "
                f"{_FULL_SCALE}: take a "
                "larger step"
            )
        values = counts.astype(np.int16)
    item = folder.create_dataset(channel.name, data=values, compression="gzip", shuffle=True, fletcher32=True)
    item.attrs["unit"] = channel.unit
    if step is not None:
        item.attrs["scale"], item.attrs["offset"] = step, 0.0
    steps = np.diff(channel.time)
    usual = float(np.median(steps)) if len(steps) else 1.0
    if len(steps) and float(np.max(np.abs(steps - usual))) > 1e-6 * usual:
        folder.create_dataset(f"{channel.name}_time", data=channel.time, compression="gzip")
        item.attrs["time"] = f"{channel.name}_time"
        return
    item.attrs["t0_s"] = float(channel.time[0]) if len(channel.time) else 0.0
    item.attrs["dt_s"] = float(channel.time[-1] - channel.time[0]) / max(len(channel.time) - 1, 1) or usual
