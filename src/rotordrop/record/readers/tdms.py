"""TDMS, the file format of LabVIEW."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.recording import Recording, damaged
from rotordrop.record.sandbox import Content, Item, plain, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_LEAD_IN = 28
"""Bytes before every segment, by the definition of the format; its length is all ones while it is open."""

_UNFINISHED = 2**64 - 1


def read_tdms(path: Path, profile: Profile) -> Recording:
    """Read all numeric channels of a TDMS file; the clock is in the waveform properties, or a channel."""
    from rotordrop.record.readers.variables import recording_of

    content = unpack(path, "tdms")
    if not content.items:
        raise RecordError(f"{path} holds no numeric channel")
    lacks = "channel {} has no waveform property 'wf_increment' and so no clock"
    return recording_of(content, path, profile, "/", lacks=lacks)


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
                words = f"the segments declare {declared} bytes of samples and the channels hold {present}"
                raise damaged(path, f": {words}")
            starts = [one.properties["wf_start_time"] for one in numeric if "wf_start_time" in one.properties]
            first = min(starts, default=None)
            items = tuple(
                Item(
                    name=f"{channel.group_name}/{channel.name}",
                    values=channel[:],
                    attributes={str(key): plain(value) for key, value in channel.properties.items()}
                    | _began(channel.properties, first),
                )
                for channel in numeric
            )
            attributes = {str(key): plain(value) for key, value in file.properties.items()}
    except (RecordError, MemoryError):
        raise
    except Exception as error:
        raise damaged(path, f" cannot be read as a TDMS file: {error}") from error
    return Content(items=items, attributes=attributes)


def _began(properties: Mapping[str, Any], first: Any) -> dict[str, float]:
    """When a channel began, after the first of all [s]; a step of nothing is none."""
    began = properties.get("wf_start_time")
    known = began is not None and first is not None
    return {"began_s": float((began - first) / np.timedelta64(1, "s"))} if known else {}


def _raw_bytes(path: Path) -> int:
    """Walk the segments and add up the bytes of samples they declare."""
    size, at, raw = path.stat().st_size, 0, 0
    with path.open("rb") as stream:
        while at < size:
            stream.seek(at)
            lead = stream.read(_LEAD_IN)
            if len(lead) < _LEAD_IN or lead[:4] != b"TDSm":
                raise damaged(path, f": no TDMS segment at byte {at} of {size}")
            length, offset = struct.unpack_from("<QQ", lead, 12)
            if length == _UNFINISHED or at + _LEAD_IN + length > size:
                declared = "no length" if length == _UNFINISHED else f"{length} bytes"
                words = f"declares {declared} and {size - at - _LEAD_IN} bytes are present, or is still open"
                raise damaged(path, f" is truncated: the segment at byte {at} {words}")
            if offset > length:
                raise damaged(path, f": the segment at byte {at} places its samples outside itself")
            raw += length - offset
            at += _LEAD_IN + length
    return raw
