"""TDMS, the file format of LabVIEW."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from nptdms import TdmsFile

from rotordrop.errors import RecordError
from rotordrop.record.unpacking import Content, Item, plain, refuse_bomb

_LEAD_IN = 28
_UNFINISHED = 2**64 - 1


def unpacked(path: Path) -> Content:
    """Read all numeric channels with their properties; the group stands before a slash."""
    declared = _raw_bytes(path)
    refuse_bomb(declared // 8, path.stat().st_size, path)
    try:
        with TdmsFile.open(path) as file:
            found = [channel for group in file.groups() for channel in group.channels() if len(channel)]
            refuse_bomb(sum(len(channel) for channel in found), path.stat().st_size, path)
            numeric = [channel for channel in found if channel.dtype.kind in "iuf"]
            raw = [channel.read_data(scaled=False) for channel in numeric]
            _compare(found, raw, declared, path)
            items = tuple(_item(channel) for channel in numeric)
            attributes = {str(key): plain(value) for key, value in file.properties.items()}
    except (RecordError, MemoryError):
        raise
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a TDMS file: {error}; copy the file again") from error
    return Content(items=items, attributes=attributes)


def _item(channel: Any) -> Item:
    properties = {str(key): plain(value) for key, value in channel.properties.items()}
    name = f"{channel.group_name}/{channel.name}"
    return Item(name=name, values=channel[:], attributes=properties | {"group": channel.group_name})


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


def _compare(found: list[Any], numeric: list[Any], declared: int, path: Path) -> None:
    present = sum(values.nbytes for values in numeric)
    if len(found) == len(numeric) and present != declared:
        raise RecordError(
            f"{path}: the segments declare {declared} bytes of samples and the channels hold {present}; "
            "the file is damaged, copy it again"
        )
