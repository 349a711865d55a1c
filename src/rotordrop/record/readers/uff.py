"""Universal file format, dataset 58 (functions at nodal degrees of freedom), text or binary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.recording import Channel, Recording, spelled, split_unit
from rotordrop.record.sandbox import Content, Item, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_DELIMITER = b"-1"
_HEADER_LINES = 11
"""Lines of a dataset 58 before its samples, by the definition of the format."""

_BYTES = {2: 4, 4: 8, 5: 8, 6: 16}
"""Bytes per sample by ordinate data type: real and complex, single and double."""

_ABSCISSA_BYTES = {2: 4, 4: 8, 5: 4, 6: 8}
"""Bytes per time stamp where the samples are not evenly spaced."""


def read_uff(path: Path, profile: Profile) -> Recording:
    """Read the time histories of a universal file; channels are named in the first identification line."""
    content = unpack(path, "uff")
    channels = []
    for item, time in zip(content.items[::2], content.items[1::2], strict=True):
        name, label, unit = split_unit(item.name)
        unit = str(item.attributes["unit"]) or unit
        unit = profile.units.get(label, "" if unit.upper() == "NONE" else unit)
        channels.append(
            Channel(
                name=name,
                label=label,
                unit=spelled(unit),
                values=item.values.astype(np.float64),
                time=time.values.astype(np.float64),
            )
        )
    entries = {key: str(value) for key, value in content.attributes.items()}
    return Recording(channels=tuple(channels), metadata=entries)


def unpacked(path: Path) -> Content:
    """In the child: the samples of every time history, then its time stamps under the same name."""
    import pyuff

    counts = _declared_samples(path)
    refuse_bomb(sum(counts), path.stat().st_size, path)
    try:
        sets = pyuff.UFF(str(path)).read_sets()
    except MemoryError:
        raise
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a universal file: {error}; export it again") from error
    sets = [item for item in (sets if isinstance(sets, list) else [sets]) if item.get("type") == 58]
    if len(sets) != len(counts):
        raise RecordError(
            f"{path} holds {len(counts)} datasets of type 58 but {len(sets)} could be read; export it again"
        )
    items: list[Item] = []
    for found, declared in zip(sets, counts, strict=True):
        label = str(found["id1"]).strip()
        values, time = np.asarray(found["data"]), np.asarray(found["x"], dtype=np.float64)
        if values.dtype.kind == "c" or len(values) != declared or len(time) != declared:
            raise RecordError(
                f"{path}: dataset {label!r} declares {declared} samples and {len(values)} {values.dtype} "
                "samples were read; a real time history is expected"
            )
        unit = str(found.get("ordinate_axis_units_lab", "")).strip()
        items.append(Item(name=label, values=values, attributes={"unit": unit}))
        items.append(Item(name=label, values=time, attributes={"of": "time"}))
    if not items:
        raise RecordError(f"{path} holds no dataset of type 58 (time history)")
    return Content(items=tuple(items), attributes={"id2": str(sets[0].get("id2", "")).strip()})


def _declared_samples(path: Path) -> list[int]:
    """Compare declared with present lengths; give the declared number of samples of each dataset 58."""
    content = path.read_bytes()
    counts: list[int] = []
    at = 0
    while (begin := _find_delimiter(content, at)) is not None:
        kind_end = content.find(b"\n", begin)
        kind = content[begin:kind_end]
        end = kind_end
        if kind.split()[:1] and kind.split()[0][:2] == b"58":
            count, end = _walk_58(content, kind, kind_end + 1, path)
            counts.append(count)
        closing = _find_delimiter(content, end)
        if closing is None:
            raise RecordError(
                f"{path} is truncated: dataset {len(counts)} has no closing -1 (the file has {len(content)} "
                "bytes); export it again"
            )
        at = closing
    return counts


def _find_delimiter(content: bytes, at: int) -> int | None:
    """Give the position after the next line that holds only -1."""
    while at < len(content):
        end = content.find(b"\n", at)
        end = len(content) if end < 0 else end
        if end - at < 20 and content[at:end].strip() == _DELIMITER:
            return end + 1
        at = end + 1
    return None


def _walk_58(content: bytes, kind: bytes, at: int, path: Path) -> tuple[int, int]:
    """Read the declared length of a dataset 58 and give it with the position where its samples end."""
    lines = content[at : at + 2000].split(b"\n")[:_HEADER_LINES]
    name = lines[0].decode("latin-1").strip()
    try:
        data_type, count, even = (int(part) for part in lines[6].split()[:3])
    except (ValueError, IndexError) as error:
        raise RecordError(
            f"{path}: dataset {name!r} has no readable line 7 (type, count, spacing)"
        ) from error
    start = at + sum(len(line) + 1 for line in lines)
    if not kind.split()[0].endswith(b"b"):
        return count, start
    try:
        declared = int(kind.split()[4])
    except (ValueError, IndexError) as error:
        raise RecordError(f"{path}: dataset {name!r} does not declare its bytes ({kind!r})") from error
    expected = count * (_BYTES.get(data_type, 0) + (0 if even else _ABSCISSA_BYTES.get(data_type, 0)))
    present = min(declared, len(content) - start)
    if declared != expected or present < declared:
        raise RecordError(
            f"{path}: dataset {name!r} declares {count} samples ({expected} bytes) in {declared} bytes and "
            f"{present} bytes are present; the file is truncated or damaged, export it again"
        )
    return count, start + declared
