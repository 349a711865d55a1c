"""Which values of a machine were defaulted or inferred, by path."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rotordrop.elements.description import Description
from rotordrop.elements.values import Physical
from rotordrop.known import Known, Status
from rotordrop.units import format_quantity


@dataclass(frozen=True)
class Mention:
    """A value worth mentioning: where it is, what it is and why."""

    path: str
    text: str
    why: str
    status: Status


_ENTRY = re.compile(r"(rotor\.sections|rotor\.discs|sensors|ambs)\..+\.(\w+)$")
_BEARINGS = "touchdown_bearings"
_SILENT = {"position", "notes", "unbalances", "node_positions", "sections", "elements", "part", "materials"}
_PLAIN_INFERRED = {"ball_count", "ball_material"}


def mentions(part: Description) -> tuple[Mention, ...]:
    """Mention every default and inference in a description, once where list entries share it."""
    merged: dict[tuple[str, str, str, Status], list[Mention]] = {}
    for mention in _walk(part):
        match = _ENTRY.match(mention.path)
        common = match.expand(r"\1.*.\2") if match else mention.path
        merged.setdefault((common, mention.text, mention.why, mention.status), []).append(mention)
    return tuple(
        found[0] if len(found) == 1 else Mention(common, text, why, status)
        for (common, text, why, status), found in merged.items()
    )


def _walk(part: Description, path: str = "") -> Iterator[Mention]:
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        here = f"{path}.{name}" if path else name
        if isinstance(value, Known):
            if value.status in ("default", "inferred"):
                physical = next(m for m in _physicals(field))
                yield Mention(
                    here, format_quantity(value.value, physical.kind), part.reason(name), value.status
                )
        elif isinstance(value, Description):
            yield from _walk(value, here)
        elif isinstance(value, tuple) and value and isinstance(value[0], Description):
            for index, item in enumerate(value):
                yield from _walk(item, _item_path(name, index, item, path))
        elif isinstance(value, dict):
            for key, item in value.items():
                yield from _walk(item, f"{here}.{key}")
        else:
            yield from _plain(part, name, value, here)


def _item_path(name: str, index: int, item: Description, path: str) -> str:
    label = getattr(item, "name", "")
    if name == _BEARINGS:
        return str(label)
    if name == "unbalances":
        return f"unbalance.{index}"
    prefix = f"{path}.{name}" if path else name
    return f"{prefix}.{label if label else index + 1}"


def _plain(part: Description, name: str, value: Any, here: str) -> Iterator[Mention]:
    if name in part.model_fields_set or name in _SILENT or value in (None, "", ()) or name == "node":
        return
    inferred = name in _PLAIN_INFERRED and getattr(part, "designation", None) is not None
    inferred = inferred or name == "bearing"
    text = {True: "yes", False: "no"}.get(value, str(value)) if isinstance(value, bool) else str(value)
    yield Mention(here, text, part.reason(name), "inferred" if inferred else "default")


def _physicals(field: Any) -> Iterator[Physical]:
    """Find how a field is read, directly or as one member of an optional field."""
    for metadata in field.metadata:
        if isinstance(metadata, Physical):
            yield metadata
    for argument in getattr(field.annotation, "__args__", ()):
        for metadata in getattr(argument, "__metadata__", ()):
            if isinstance(metadata, Physical):
                yield metadata


def kind_of(description: type[Description], name: str) -> str | None:
    """Name the kind of quantity of a field; None where it holds none."""
    physical = physical_of(description, name)
    return None if physical is None else physical.kind


def physical_of(description: type[Description], name: str) -> Physical | None:
    """How a field is read; None where it holds no physical value."""
    return next(_physicals(description.model_fields[name]), None)
