"""Universal file format, dataset 58 (functions at nodal degrees of freedom), text or binary."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotordrop.record.profile import Profile
from rotordrop.record.recording import Channel, Recording, known_unit, split_unit
from rotordrop.record.unpacking import Item, unpack


def read_uff(path: Path, profile: Profile) -> Recording:
    """Read the time histories of a universal file; channels are named in the first identification line.

    Parameters
    ----------
    path : Path
        The file.
    profile : Profile
        Rules that replace guesses.

    Raises
    ------
    RecordError
        When a dataset is cut off, or holds another number of samples than it declares.
    """
    content = unpack(path, "uff")
    pairs = zip(content.items[::2], content.items[1::2], strict=True)
    histories = tuple(_channel(values, time, profile) for values, time in pairs)
    entries = {key: str(value) for key, value in content.attributes.items()}
    return Recording(channels=histories, metadata=entries)


def _channel(item: Item, time: Item, profile: Profile) -> Channel:
    name, label, unit = split_unit(item.name)
    unit = str(item.attributes["unit"]) or unit
    unit = "" if unit.upper() == "NONE" else unit
    return Channel(
        name=name,
        label=label,
        unit=known_unit(profile.units.get(label, unit)) or unit,
        values=item.values.astype(np.float64),
        time=time.values.astype(np.float64),
    )
