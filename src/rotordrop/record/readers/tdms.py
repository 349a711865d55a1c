"""TDMS, the file format of LabVIEW."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Array, Channel, Recording, known_unit, split_unit
from rotordrop.record.unpacking import Item, unpack


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
    content = unpack(path, "tdms")
    if not content.items:
        raise RecordError(f"{path} holds no numeric channel")
    channels = tuple(_channel(item, profile, path) for item in content.items)
    return Recording(
        channels=channels, metadata={key: str(value) for key, value in content.attributes.items()}
    )


def _channel(item: Item, profile: Profile, path: Path) -> Channel:
    own = item.name.removeprefix(f"{item.attributes['group']}/")
    name, _, unit = split_unit(own)
    unit = str(item.attributes.get("unit_string", item.attributes.get("NI_UnitDescription", unit)))
    unit = profile.units.get(item.name, profile.units.get(own, unit))
    return Channel(
        name=name,
        label=own,
        unit=known_unit(unit) or unit,
        values=item.values.astype(np.float64),
        time=_time(item, path),
    )


def _time(item: Item, path: Path) -> Array:
    try:
        step = float(item.attributes.get("wf_increment", 0.0))
        start = float(item.attributes.get("wf_start_offset", 0.0))
    except ValueError:
        step, start = 0.0, 0.0
    if not 0.0 < step < np.inf:
        raise RecordError(
            f"{path}: channel {item.name!r} has no waveform property 'wf_increment' and so no clock"
        )
    return start + step * np.arange(len(item.values), dtype=np.float64)
