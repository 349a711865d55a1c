"""Writers of recordings, in the layouts that the readers read back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rotordrop.record.recording import MARKS, Array, Channel, Recording
from rotordrop.record.writers.delimited import write_delimited
from rotordrop.record.writers.hdf5 import write_hdf5


def recording_of(
    time: Array,
    signals: Array,
    names: Sequence[str],
    *,
    speed_time: Array | None = None,
    speed: Array | None = None,
    marks: Array | None = None,
    metadata: Mapping[str, str] | None = None,
    notes: tuple[str, ...] = (),
    warnings: tuple[str, ...] = (),
) -> Recording:
    """Make a recording of displacement readings and, where known, the shaft speed.

    Parameters
    ----------
    time : array, shape (N,)
        Time of the samples [s].
    signals : array, shape (N, S)
        Readings [m].
    names : sequence of str, length S
        Names of the channels.
    speed_time, speed : array, shape (K,), optional
        When the speed was read [s] and what was read [rad/s].
    marks : array, shape (M,), optional
        When a mark of the shaft passed [s].
    metadata : mapping of str to str, optional
        Header entries.
    notes, warnings : tuple of str
        Kept with the recording.
    """
    channels = [
        Channel(name=name, label=name, unit="m", values=signals[:, i], time=time)
        for i, name in enumerate(names)
    ]
    if speed is not None and speed_time is not None:
        turns = np.asarray(speed) / (2 * np.pi)
        channels.append(Channel(name="speed", label="speed", unit="Hz", values=turns, time=speed_time))
    if marks is not None:
        channels.append(Channel(name=MARKS, label=MARKS, unit="s", values=marks, time=marks))
    return Recording(channels=tuple(channels), metadata=dict(metadata or {}), notes=notes, warnings=warnings)


__all__ = ["recording_of", "write_delimited", "write_hdf5"]
