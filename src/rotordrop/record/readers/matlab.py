"""MATLAB files: version 5 to 7, and version 7.3."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Array, Channel, Recording, known_unit, split_unit
from rotordrop.record.unpacking import unpack
from rotordrop.units import parse_quantity

_RATES = ("fs", "fs_hz", "samplerate", "sampling_rate")
_STEPS = ("dt", "dt_s", "step")
_STARTS = ("t0", "t0_s", "start")
_TIMES = ("t", "time", "time_s")
_NAMES = ("name", "label", "channel")
_UNITS = ("unit", "units")


def read_matlab(path: Path, profile: Profile) -> Recording:
    """Read a MAT file: channels as vectors, or as the columns of a matrix beside a list of names.

    The clock comes from a vector ``t`` or ``time`` beside the samples (in the same structure), or from ``fs``
    or ``dt`` and ``t0``. The ending of a variable name gives the unit: ``disp_um``. A structure of its own
    for every channel may hold its ``name`` and ``unit``.

    Parameters
    ----------
    path : Path
        The file.
    profile : Profile
        Rules that replace guesses.

    Raises
    ------
    RecordError
        When the declared length of a variable is not present in the file, or no channels are found.
    """
    content = unpack(path, "matlab")
    found = {item.name: item.values for item in content.items}
    return recording_of_variables({**content.attributes, **found}, path, profile)


def recording_of_variables(variables: dict[str, Any], path: Path, profile: Profile) -> Recording:
    """Make a recording of named arrays, numbers, texts and lists of texts."""
    names = next((_names(value) for value in variables.values() if _names(value)), [])
    channels: list[Channel] = []
    for key, value in variables.items():
        folder, _, last = key.rpartition(".")
        samples = isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and value.size > 1
        if samples and value.ndim in (1, 2) and last.lower() not in _TIMES and last != profile.time.channel:
            channels += _channels_of(
                key, value, names, lambda n, f=folder: _clock(variables, f, n, profile), profile, variables
            )
    if not channels:
        raise RecordError(
            f"{path}: found no samples with a clock among {', '.join(variables) or 'no variables'}; a vector "
            "'t', or 'fs' and 't0', must stand beside the channels, or time.step in the profile"
        )
    entries = {key: str(value) for key, value in variables.items() if isinstance(value, str | int | float)}
    return Recording(channels=tuple(channels), metadata=entries)


def _names(value: Any) -> list[str]:
    """Read a cell array or character matrix of names."""
    named = isinstance(value, list) and len(value) > 0 and all(isinstance(entry, str) for entry in value)
    return [entry.strip() for entry in value] if named else []


def _channels_of(
    key: str, value: Any, names: list[str], clock: Any, profile: Profile, variables: dict[str, Any]
) -> list[Channel]:
    """Make channels of a vector, or of a matrix whose columns (or rows) are named."""
    folder, _, last = key.rpartition(".")
    name, _label, unit = split_unit(last)
    unit = unit or known_unit(last) or ""
    matrix = np.asarray(value, dtype=np.float64)
    if matrix.ndim == 1:
        labels, matrix = [key], matrix[:, None]
        own = [variables.get(f"{folder}.{name}") for name in _NAMES] if folder else []
        told = next((text for text in own if isinstance(text, str) and text), None)
        shown = [told or (name if not known_unit(last) else key.partition(".")[0])]
        written = [variables.get(f"{folder}.{name}") for name in _UNITS] if folder and not unit else []
        unit = next((known_unit(text) or text for text in written if isinstance(text, str)), unit)
    else:
        if matrix.shape[1] != len(names) and matrix.shape[0] == len(names):
            matrix = matrix.T
        if matrix.shape[1] != len(names):
            return []
        labels = shown = names
    time = clock(len(matrix))
    if time is None:
        return []
    return [
        Channel(name=n, label=t, unit=profile.units.get(t, unit), values=matrix[:, i].copy(), time=time)
        for i, (n, t) in enumerate(zip(shown, labels, strict=True))
    ]


def _clock(variables: dict[str, Any], folder: str, count: int, profile: Profile) -> Array | None:
    """Find the clock of samples: in the profile, in the same structure, then at the top of the file."""
    if profile.time.step is not None:
        first = parse_quantity(profile.time.start or "0 s", "time")
        return first + parse_quantity(profile.time.step, "time") * np.arange(count, dtype=np.float64)
    times = _TIMES if profile.time.channel is None else (profile.time.channel,)
    for prefix in dict.fromkeys((f"{folder}." if folder else "", "")):
        for name in times:
            value = _get(variables, prefix, name)
            if isinstance(value, np.ndarray) and value.shape == (count,):
                return np.asarray(value, dtype=np.float64)
        rate = _scalar(variables, prefix, _RATES)
        step = _scalar(variables, prefix, _STEPS) or (1.0 / rate if rate else None)
        if step:
            start = _scalar(variables, prefix, _STARTS) or 0.0
            return start + step * np.arange(count, dtype=np.float64)
    return None


def _get(variables: dict[str, Any], prefix: str, name: str) -> Any:
    pattern = re.compile(re.escape(prefix + name), re.IGNORECASE)
    return next((value for key, value in variables.items() if pattern.fullmatch(key)), None)


def _scalar(variables: dict[str, Any], prefix: str, names: tuple[str, ...]) -> float | None:
    for name in names:
        value = _get(variables, prefix, name)
        if isinstance(value, int | float | np.number):
            return float(value)
    return None
