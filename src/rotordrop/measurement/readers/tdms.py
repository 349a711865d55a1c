"""TDMS, the file format of LabVIEW."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.measurement.profile import Profile
from rotordrop.measurement.readers import needs_extra
from rotordrop.measurement.recording import Array, Channel, Recording, known_unit, split_unit

_LEAD_IN = 28
_UNFINISHED = 2**64 - 1


def read_tdms(path: Path, profile: Profile) -> Recording:
    """Read all numeric channels of a TDMS file; the clock is in the waveform properties.

    Parameters
    ----------
    path : Path
        The file.
    profile : Profile
        Rules that replace guesses.

    Raises
    ------
    RecordError
        When segments are missing or the channels hold another number of bytes than the segments declare.
    """
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise needs_extra("npTDMS", path, error) from error

    declared = _raw_bytes(path)
    try:
        file: Any = TdmsFile.read(path)
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a TDMS file: {error}; copy the file again") from error
    series = [channel for group in file.groups() for channel in group.channels() if len(channel)]
    numeric = [channel for channel in series if channel.dtype.kind in "iuf"]
    _compare(series, numeric, declared, path)
    if not numeric:
        raise RecordError(f"{path} holds no numeric channel")
    channels = tuple(_channel(channel, profile, path) for channel in numeric)
    return Recording(channels=channels, metadata={key: str(value) for key, value in file.properties.items()})


def _raw_bytes(path: Path) -> int:
    """Walk the segments and add up the bytes of samples they declare."""
    size, at, raw = path.stat().st_size, 0, 0
    with path.open("rb") as stream:
        while at < size:
            stream.seek(at)
            lead = stream.read(_LEAD_IN)
            if len(lead) < _LEAD_IN or lead[:4] != b"TDSm":
                raise RecordError(f"{path}: no TDMS segment at byte {at} of {size}; the file is damaged")
            length, offset = struct.unpack_from("<QQ", lead, 12)
            if length == _UNFINISHED or at + _LEAD_IN + length > size:
                told = "no length" if length == _UNFINISHED else f"{length} bytes"
                raise RecordError(
                    f"{path} is truncated: the segment at byte {at} declares {told} and "
                    f"{size - at - _LEAD_IN} "
                    "bytes are present; copy the file again, or let the recorder close it"
                )
            if offset > length:
                raise RecordError(f"{path}: the segment at byte {at} places its samples outside itself")
            raw += length - offset
            at += _LEAD_IN + length
    return raw


def _compare(series: list[Any], numeric: list[Any], declared: int, path: Path) -> None:
    present = sum(channel.raw_data.nbytes for channel in numeric)
    if len(series) == len(numeric) and present != declared:
        raise RecordError(
            f"{path}: the segments declare {declared} bytes of samples and the channels hold {present}; "
            "the file is damaged, copy it again"
        )


def _channel(channel: Any, profile: Profile, path: Path) -> Channel:
    properties = channel.properties
    name, _, unit = split_unit(channel.name)
    unit = str(properties.get("unit_string", properties.get("NI_UnitDescription", unit)))
    label = f"{channel.group_name}/{channel.name}"
    unit = profile.units.get(label, profile.units.get(channel.name, unit))
    return Channel(
        name=name,
        label=channel.name,
        unit=known_unit(unit) or unit,
        values=np.asarray(channel[:], dtype=np.float64),
        time=_time(properties, len(channel), label, path),
    )


def _time(properties: Any, count: int, label: str, path: Path) -> Array:
    step = float(properties.get("wf_increment", 0.0))
    if step <= 0:
        raise RecordError(
            f"{path}: channel {label!r} has no waveform property 'wf_increment' and so no clock"
        )
    return float(properties.get("wf_start_offset", 0.0)) + step * np.arange(count, dtype=np.float64)
