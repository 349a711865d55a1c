"""TDMS, the file format of LabVIEW."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.recording import Recording, split_unit
from rotordrop.record.sandbox import Content, Item, plain, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_LEAD_IN = 28
"""Bytes before every segment, by the definition of the format; its length is all ones while it is open."""

_UNFINISHED = 2**64 - 1


def read_tdms(path: Path, profile: Profile) -> Recording:
    """Read all numeric channels of a TDMS file; the clock is in the waveform properties."""
    content = unpack(path, "tdms")
    if not content.items:
        raise RecordError(f"{path} holds no numeric channel")
    channels = []
    for item in content.items:
        own = item.name.removeprefix(f"{item.attributes['group']}/")
        name, _, unit = split_unit(own)
        unit = str(item.attributes.get("unit_string", item.attributes.get("NI_UnitDescription", unit)))
        try:
            step = float(item.attributes.get("wf_increment", 0.0))
            start = float(item.attributes.get("wf_start_offset", 0.0))
        except ValueError:
            step, start = 0.0, 0.0
        if not 0.0 < step < np.inf:
            raise RecordError(
                f"{path}: channel {item.name!r} has no waveform property 'wf_increment' and so no clock"
            )
        time = start + step * np.arange(len(item.values), dtype=np.float64)
        unit = profile.units.get(item.name, unit)
        channels.append(profile.channel(name, unit, item.values, time, label=own))
    entries = {key: str(value) for key, value in content.attributes.items()}
    return Recording(channels=tuple(channels), metadata=entries)


def unpacked(path: Path) -> Content:
    """In the child: all numeric channels with their properties; the group stands before a slash."""
    from nptdms import TdmsFile

    declared = _raw_bytes(path)
    refuse_bomb(declared // 8, path.stat().st_size, path)
    try:
        with TdmsFile.open(path) as file:
            found = [channel for group in file.groups() for channel in group.channels() if len(channel)]
            refuse_bomb(sum(len(channel) for channel in found), path.stat().st_size, path)
            numeric = [channel for channel in found if channel.dtype.kind in "iuf"]
            present = sum(channel.read_data(scaled=False).nbytes for channel in numeric)
            if len(found) == len(numeric) and present != declared:
                raise RecordError(
                    f"{path}: the segments declare {declared} bytes of samples and the channels hold "
                    f"{present}; the file is damaged, copy it again"
                )
            items = tuple(
                Item(
                    name=f"{channel.group_name}/{channel.name}",
                    values=channel[:],
                    attributes={str(key): plain(value) for key, value in channel.properties.items()}
                    | {"group": channel.group_name},
                )
                for channel in numeric
            )
            attributes = {str(key): plain(value) for key, value in file.properties.items()}
    except (RecordError, MemoryError):
        raise
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a TDMS file: {error}; copy the file again") from error
    return Content(items=items, attributes=attributes)


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
                declared = "no length" if length == _UNFINISHED else f"{length} bytes"
                raise RecordError(
                    f"{path} is truncated: the segment at byte {at} declares {declared} and "
                    f"{size - at - _LEAD_IN} bytes are present; copy the file again, or let the recorder "
                    "close it"
                )
            if offset > length:
                raise RecordError(f"{path}: the segment at byte {at} places its samples outside itself")
            raw += length - offset
            at += _LEAD_IN + length
    return raw
