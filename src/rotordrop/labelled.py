"""Results in HDF5, declared once: a field says its axes, unit and label; writing and reading back follow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

LETTERS = {"axis": ("x", "y"), "race": ("inner", "outer")}
"""Axes whose places have names; those of the others are counted, or named by a field."""


@dataclass(frozen=True)
class Stored:
    """How a field stands in a file; an array without axes stands there without unit and label."""

    axes: str = ""
    """Its axes; an array along the axis of its own name is the scale of that axis."""
    unit: str = ""
    label: str = ""
    """SI unit, and what it is."""
    name: str = ""
    """Name in the file, where it is another one."""
    prefix: str = ""
    """Of a result within the result: what its names begin with; its arrays are along the axes given here."""


PLAIN = Stored()


def declared(cls: type) -> Iterator[tuple[str, Any, bool, Stored]]:
    """Name and type of every field of a result, whether it may be None, and how it stands in a file."""
    hints = get_type_hints(cls, include_extras=True)
    for item in fields(cls):
        hint, said = hints[item.name], PLAIN
        if hasattr(hint, "__metadata__"):
            said, hint = hint.__metadata__[0], get_args(hint)[0]
        optional = type(None) in get_args(hint)
        yield item.name, get_args(hint)[0] if optional else hint, optional, said


def write(result: Any, file: Any, within: Stored = PLAIN) -> None:
    """Write numbers, texts, arrays and marked parts of a result to an open HDF5 file; None is left out."""
    own = sorted(declared(type(result)), key=lambda one: one[1] != tuple[str, ...])  # scales come first
    for name, kind, _, said in own:
        value, stands = getattr(result, name), within.prefix + (said.name or name)
        if value is None or (isinstance(value, tuple) and not value):
            continue
        if kind in (str, float, int, bool):
            file.attrs[stands] = value if isinstance(value, str) else float(value)
        elif said.prefix:
            write(value, file, said)
        elif get_origin(kind) is np.ndarray or kind == tuple[str, ...]:
            put(file, stands, value, Stored(axes=within.axes, label=name) if within.axes else said)


def put(file: Any, name: str, values: Any, said: Stored) -> None:
    """Write an array, or texts."""
    import h5py

    axes = said.axes.split()
    if isinstance(values, tuple):
        values = np.array(values, dtype=h5py.string_dtype())
    packed = (
        {"compression": "gzip", "shuffle": True} if values.size > 1000 and axes not in ([], [name]) else {}
    )
    made = file.create_dataset(name, data=values, **packed)
    if said.unit or said.label:
        made.attrs["units"], made.attrs["long_name"] = said.unit, said.label
    if axes == [name]:
        made.make_scale(name)
    else:
        for place, axis in enumerate(axes):
            if axis not in file:
                put(file, axis, LETTERS.get(axis, np.arange(values.shape[place])), Stored(axis))
            made.dims[place].attach_scale(file[axis])


def read(cls: type, file: Any, within: Stored = PLAIN) -> dict[str, Any]:
    """What `write` wrote of a result, by the names of its fields.

    Raises
    ------
    KeyError
        If something is missing that every such result has.
    """
    values: dict[str, Any] = {}
    for name, kind, optional, said in declared(cls):
        stands = within.prefix + (said.name or name)
        if said.prefix:
            if not optional or said.prefix[:-1] in file:
                values[name] = kind(**read(kind, file, said))
        elif kind in (str, float, int, bool):
            values[name] = kind(file.attrs[stands])
        elif kind == tuple[str, ...]:
            values[name] = tuple(file[stands].asstr()[()]) if stands in file else ()
        elif get_origin(kind) is np.ndarray and not (optional and stands not in file):
            values[name] = file[stands][()]
    return values
