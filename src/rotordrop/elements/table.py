"""Every unknown parameter of a drop, one row each; whatever lists parameters is a query of this table.

A row says what a parameter is called, what it is measured in, what is known of it before a record is read,
which entries of the kernel it sets, what the estimators do with it and where its value is published. The rows
stand in the files of the elements that own them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from rotordrop.elements import (
    air,
    ball_bearing,
    contact,
    friction,
    landing_sleeve,
    load,
    magnet,
    mount,
    race,
    recorder,
    rotor,
    sensor,
    support,
    touchdown_bearing,
    unbalance,
)
from rotordrop.elements.parameter import Extension, Owner, Parameter
from rotordrop.elements.rotor import FORM
from rotordrop.known import Known

TABLE: tuple[Parameter, ...] = (
    *touchdown_bearing.PARAMETERS,
    *support.PARAMETERS,
    *contact.PARAMETERS,
    *friction.PARAMETERS,
    *race.PARAMETERS,
    *touchdown_bearing.DAMPING,
    *ball_bearing.PARAMETERS,
    *sensor.PARAMETERS,
    *unbalance.PARAMETERS,
    *magnet.FORCES,
    magnet.REMANENCE,
    *air.PARAMETERS,
)
"""The rows; those of a bearing in the order in which the estimators hold them."""

# In the order in which a search tries their extensions.
_ELEMENTS = (
    support,
    sensor,
    magnet,
    unbalance,
    rotor,
    contact,
    friction,
    race,
    touchdown_bearing,
    landing_sleeve,
    ball_bearing,
    mount,
    air,
    recorder,
    load,
)

EXTENSIONS: tuple[Extension, ...] = tuple(
    extension for element in _ELEMENTS for extension in getattr(element, "EXTENSIONS", ())
)
"""What a machine may have beyond the base model, in the order in which a search tries it."""

STRUCTURE: tuple[Parameter, ...] = (
    *(row for extension in EXTENSIONS for row in extension.rows),
    *(row for element in _ELEMENTS for row in getattr(element, "STATED", ())),
)
"""Unknowns of a machine only where its description names them: those of extensions, and ``STATED`` ones."""

_BY_PATH = {(row.owner, row.path): row for row in (*TABLE, *STRUCTURE, *FORM)}


def parameter(path: str, owner: Owner = "bearing") -> Parameter:
    """Row of a path below its owner."""
    return _BY_PATH[owner, path]


def rows(owner: Owner | None = None) -> Iterator[Parameter]:
    """Rows of one kind of owner, or all."""
    return (row for row in TABLE if owner in (None, row.owner))


def structure_rows(owner: Owner) -> Iterator[Parameter]:
    """Rows of one kind of owner that a machine may have beyond the base model."""
    return (row for row in STRUCTURE if row.owner == owner)


def row_of(path: str) -> Parameter:
    """Row of a path in the machine, such as ``"NDE.support.stiffness"`` or ``"sensors.X1.gain"``."""
    owner, _, rest = path.partition(".")
    if owner == "sensors":
        return _BY_PATH["sensor", rest.rpartition(".")[2]]
    if owner == "rotor":
        return _BY_PATH["rotor", rest]
    return _BY_PATH.get(("bearing", path)) or _BY_PATH["bearing", rest]


def following() -> Iterator[tuple[Parameter, str, Callable[[Any, Known], Known]]]:
    """Rows of a bearing whose value follows another: the row, the path of the other, and how."""
    return ((row, *row.follows) for row in rows("bearing") if row.follows is not None)


def keys_of(keys: list[str]) -> list[str]:
    """Keys of a value in the description of a bearing, for those of its path."""
    row = _BY_PATH.get(("bearing", ".".join(keys)))
    return keys if row is None or not row.stored else row.stored.split(".")


def fitted_row(path: str) -> Parameter | None:
    """Row of a path of the machine file; none for what is fitted by its ratio to another value there."""
    owner, _, rest = path.partition(".")
    return None if owner in ("sensors", "rotor") else _BY_PATH.get(("bearing", rest))


def published() -> dict[str, Parameter]:
    """Rows of bearings by their field in the JSON document."""
    return {row.field: row for row in rows("bearing")}


def separating_measurement(first: Parameter, second: Parameter) -> str:
    """What would tell two parameters apart that a record confounds."""
    for one, other in ((first, second), (second, first)):
        if other.path in one.separated_by:
            return one.separated_by[other.path]
    return "more drops at other speeds, or a measurement of one of the two"
