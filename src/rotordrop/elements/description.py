"""What every part of a machine description has in common: frozen, strict, aware of what was given."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict, model_validator

from rotordrop.elements.values import Length, Physical
from rotordrop.errors import unknown_key
from rotordrop.known import Known

LARGEST_FILE = 16 * 2**20
"""Bytes that a machine file or a table of it can need."""


def _node(raw: Any) -> Any:
    if isinstance(raw, bool) or not isinstance(raw, int):
        raise ValueError(f"{raw!r} is not a node; write its number, counted from 1, without quotes")
    if raw < 1:
        raise ValueError(f"node {raw} is outside the rotor; nodes count from 1")
    return raw


def _name(raw: Any) -> Any:
    if not isinstance(raw, str) or not re.fullmatch(r"[^.\s]+", raw):
        raise ValueError(f'{raw!r} is not a name; write one word without dots, such as "NDE"')
    return raw


def _channel(raw: Any) -> Any:
    if not isinstance(raw, str) or not raw.strip():
        raise ValueError(f"{raw!r} is not the name of a channel; write it as the recording does")
    return raw


@dataclass(frozen=True, kw_only=True)
class Usual:
    """Bounds of one entry and what to look at beyond them."""

    least: float
    most: float
    look: str
    label: str = ""


Text = Annotated[str, Strict()]
Node = Annotated[int, BeforeValidator(_node)]
Name = Annotated[str, BeforeValidator(_name)]
Channel = Annotated[str, BeforeValidator(_channel)]

NODE_TOLERANCE = 1e-4
"""A position this close to a node [m] means the node (chosen)."""


class Misfit(ValueError):
    """Something does not fit, at a place below the table that found it."""

    def __init__(self, message: str, place: tuple[str | int, ...] = ()) -> None:
        self.message = message
        self.place = place
        super().__init__(message)


class UnknownKey(Misfit):
    """A key that nobody knows: the key is to blame, not its value."""


class Description(BaseModel):
    """A part of a machine: frozen, with no key that is not known."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Fields that give way when another one is set, because both say the same thing."""

    usual: ClassVar[Mapping[str, Usual]] = {}
    """Bounds of fields beyond which no machine of the field lies: of constants that do not scale with it."""

    written_as: ClassVar[Mapping[str, str]] = {}
    """Fields that a file writes under another key."""

    columns: ClassVar[Mapping[str, int]] = {}
    """Columns of a kernel row that fields stand in; what is left out is zero there."""

    states_at: ClassVar[int] = -1
    """Place of its further states among those of a touchdown bearing, see `physics.columns`."""

    reserved: ClassVar[Mapping[str, str]] = {}
    """Keys that a later version will know, with what they will hold."""

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, raw: Any) -> Any:
        if isinstance(raw, Mapping):
            raw = cls.rewritten(dict(raw))
            for key in raw:
                if key in cls.reserved:
                    what = f"{key!r} is reserved for {cls.reserved[key]}"
                    raise Misfit(f"{what}, which is not yet supported; leave it out", (key,))
                if key not in cls.model_fields:
                    raise UnknownKey(unknown_key(str(key), cls.known_keys()), (str(key),))
                if isinstance(raw[key], int) and not -(2**63) <= raw[key] < 2**63:
                    digits = str(abs(raw[key]))
                    told = f"{digits[:9]}... has {len(digits)} digits; TOML holds whole numbers of 64 bits"
                    raise Misfit(told, (key,))
        return raw

    @model_validator(mode="after")
    def _fill_left_out(self) -> Self:
        self.check()
        self.__dict__.update(self.left_out())
        return self

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Bring shorthand of the file to the fields of the description."""
        return raw

    @classmethod
    def physical(cls, name: str) -> Physical | None:
        """How a field is read, also as a member of an optional field; None where it is no quantity."""
        field = cls.model_fields[name]
        members = [getattr(one, "__metadata__", ()) for one in getattr(field.annotation, "__args__", ())]
        found = (one for metadata in (field.metadata, *members) for one in metadata)
        return next((one for one in found if isinstance(one, Physical)), None)

    @classmethod
    def known_keys(cls) -> tuple[str, ...]:
        """Keys to suggest for a mistyped one."""
        return tuple(cls.model_fields)

    def check(self) -> None:
        """Refuse values that do not fit together, with a `Misfit`."""

    def left_out(self) -> dict[str, Any]:
        """Values for fields that were left out and follow from others."""
        return {}

    def __dir__(self) -> list[str]:
        own = {name for name in dir(type(self)) if not name.startswith("_")} - set(dir(Description))
        return sorted({"changed", *type(self).model_fields} | own)

    @property
    def further_states(self) -> Mapping[str, int]:
        """Kinds of the states that it adds to a drop, by name, with ``{}`` for what has it."""
        return {}

    @property
    def beyond_estimates(self) -> tuple[str, str] | None:
        """What it has or is that no record can be estimated with yet, and what more to say of it."""
        return None

    @property
    def remembered(self) -> int:
        """Number of entries that it keeps in the discrete memory of a drop."""
        return 0

    def fill(self, row: NDArray[np.float64]) -> None:
        """Write the columns of a kernel row."""
        for name, column in self.columns.items():
            value = getattr(self, name)
            row[column] = 0.0 if value is None else float(value)

    def changed(self, **values: Any) -> Self:
        """Give a copy with other values; what follows from them follows again."""
        displaced = {other for name in values for other in self.displaces.get(name, ())}
        given = {name: getattr(self, name) for name in self.model_fields_set if name not in displaced}
        return type(self).model_validate(given | values)

    def completed_with(self, values: Mapping[str, Any]) -> Self:
        """Give a copy with values that follow from outside; they still count as left out."""
        copy = self.model_copy()
        copy.__dict__.update(values)
        return copy

    def reason(self, name: str) -> str:
        """Say why a value that was left out is what it is."""
        value = getattr(self, name)
        stated = value.source if isinstance(value, Known) else None
        return stated or type(self).model_fields[name].description or "the usual case"


class Placed(Description):
    """Something that sits at a node of the rotor, given by number or by position."""

    node: Node = Field(default=0, validate_default=False)
    """Node number, counted from 1."""
    position: Length | None = None
    """In place of the node: distance from node 1."""

    def check(self) -> None:
        """Refuse both or neither of node and position."""
        if ("node" in self.model_fields_set) == (self.position is not None):
            raise Misfit(
                "needs either 'node' (counted from 1) or 'position' (distance from node 1), and only one "
                "of them"
            )

    def changed(self, **values: Any) -> Self:
        """Give a copy with other values, at the same node where no other place is given."""
        if "node" in values:
            values = {"position": None, **values}  # a place by position would take it back
        copy = super().changed(**values)
        if "node" not in values and "position" not in values:
            copy.__dict__["node"] = self.node
        return copy


P = TypeVar("P", bound=Placed)


def place_on_nodes(items: tuple[P, ...], nodes: tuple[float, ...], key: str) -> tuple[P, ...]:
    """Find the node of everything that sits on the rotor; refuse what lies outside."""
    for index, item in enumerate(items):
        if item.position is not None:
            item.__dict__["node"] = _node_at(item.position, nodes, (key, index, "position"))
        elif not 1 <= item.node <= len(nodes):
            told = (
                f"node {item.node} is outside the rotor, whose nodes are 1 to {len(nodes)}; give one of "
                "them, or the 'position' from node 1 in its place"
            )
            raise Misfit(told, (key, index, "node"))
    return items


def _node_at(position: Known, nodes: tuple[float, ...], place: tuple[str | int, ...]) -> int:
    text = Physical("length").text
    if not nodes[0] - NODE_TOLERANCE <= position.value <= nodes[-1] + NODE_TOLERANCE:
        raise Misfit(
            f"{text(position.value)} is outside the rotor, which reaches from {text(nodes[0])} to "
            f"{text(nodes[-1])}",
            place,
        )
    nearest = min(range(len(nodes)), key=lambda i: abs(nodes[i] - position.value))
    if abs(nodes[nearest] - position.value) > NODE_TOLERANCE:
        raise Misfit(
            f"there is no node at {position.value * 1e3:.7g} mm; the nearest is node {nearest + 1} at "
            f"{nodes[nearest] * 1e3:.7g} mm: give every part its 'position' and none its 'node', or end a "
            "shaft section there",
            place,
        )
    return nearest + 1
