"""Values by path, such as ``"NDE.support.stiffness"``: what may be set, and setting it."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from rotordrop.elements.description import Description
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine.provenance import kind_of, physical_of
from rotordrop.units import in_si

if TYPE_CHECKING:
    from rotordrop.machine.machine import Machine

_Changes = dict[str, Any]


def changed_machine_parts(machine: Machine, values: Mapping[str, float | str | Known]) -> dict[str, Any]:
    """Give the top-level parts of a machine that change with the given values."""
    tree: _Changes = {}
    for path, value in values.items():
        _graft(
            tree,
            _resolved(machine, path),
            value if isinstance(value, Known) else Known(value=_number(machine, path, value)),
        )
    parts: dict[str, Any] = {}
    for key, branch in tree.items():
        try:
            physical = physical_of(type(machine), key)
            part = getattr(machine, key)
            parts[key] = _changed(part, branch) if physical is None else physical.read(branch)
        except ValueError as error:
            raise UsageError(_refusal(error, values)) from error
    return parts


def _number(machine: Machine, path: str, value: float | str) -> float:
    """The number of a value given by path: a text is read with its unit, a number is in SI units already."""
    return in_si(value, kind_of_path(machine, path), path)


def kind_of_path(machine: Machine, path: str) -> str:
    """Kind of quantity of a value by path, one of `rotordrop.units.KINDS`.

    Raises
    ------
    UsageError
        If the machine has no such value.
    """
    *keys, last = _resolved(machine, path)
    part: Any = machine
    for key in keys:
        part = _step(part, key, path)
    kind = kind_of(type(part), last)
    assert kind is not None, path
    return kind


def value_of_path(machine: Machine, path: str) -> float:
    """Value [SI] by path, such as ``"NDE.support.stiffness"``.

    Raises
    ------
    UsageError
        If the machine has no such value.
    """
    part: Any = machine
    for key in _resolved(machine, path):
        part = _step(part, key, path)
    if part is None:
        raise UsageError(f"{machine.name!r} leaves {path!r} out; describe it to vary it")
    return float(part)


def _refusal(error: ValueError, values: Mapping[str, float | str | Known]) -> str:
    stated = ", ".join(f"{path} = {_shown(value)}" for path, value in values.items())
    return f"cannot set {stated} (SI units): {reasons_of(error)}"


def reasons_of(error: ValueError) -> str:
    """Why a description was refused, without the places pydantic names."""
    from pydantic import ValidationError

    if not isinstance(error, ValidationError):
        return str(error)
    return "; ".join(str(e["msg"]).removeprefix("Value error, ") for e in error.errors())


def _shown(value: float | str | Known) -> str:
    return value if isinstance(value, str) else f"{float(value):g}"


def _graft(tree: _Changes, keys: tuple[Any, ...], value: Known) -> None:
    for key in keys[:-1]:
        tree = tree.setdefault(key, {})
    tree[keys[-1]] = value


def _changed(part: Any, branch: Any) -> Any:
    if isinstance(branch, Known):
        return branch
    if isinstance(part, tuple):
        return tuple(_changed(item, branch[i]) if i in branch else item for i, item in enumerate(part))
    assert isinstance(part, Description)
    return part.changed(**{key: _changed(getattr(part, key), sub) for key, sub in branch.items()})


def _resolved(machine: Machine, path: str) -> tuple[Any, ...]:
    """Turn a path into keys and indices from the machine down to one physical value."""
    head, *rest = path.split(".")
    keys = _start(machine, head, rest, path)
    part: Any = machine
    for key in keys:
        part = _step(part, key, path)
    if not (isinstance(part, Known) or part is None):
        raise UsageError(f"{path!r} is not a single physical value; {_suggestion(machine, path)}")
    return keys


def _start(machine: Machine, head: str, rest: list[str], path: str) -> tuple[Any, ...]:
    for index, bearing in enumerate(machine.touchdown_bearings):
        if bearing.name == head:
            return ("touchdown_bearings", index, *(["bearing", *rest] if rest == ["preload"] else rest))
    if head == "unbalance":
        return ("unbalances", *(_index(rest[:1], path)), *rest[1:])
    for key in ("sensors", "ambs"):
        if head == key and rest:
            names = [part.name for part in getattr(machine, key)]
            if rest[0] in names:
                return (key, names.index(rest[0]), *rest[1:])
    return (head, *rest)


def _index(texts: list[str], path: str) -> list[int]:
    try:
        return [int(text) for text in texts]
    except ValueError:
        raise UsageError(f"{path!r}: unbalances are counted from 0, as in 'unbalance.0.amount'") from None


def _step(part: Any, key: Any, path: str) -> Any:
    if isinstance(part, tuple) and isinstance(key, int) and 0 <= key < len(part):
        return part[key]
    if isinstance(part, Description) and key in type(part).model_fields:
        return getattr(part, key)
    if isinstance(part, tuple):
        raise UsageError(f"the machine has no value {path!r}: there are {len(part)} of them, counted from 0")
    known = ", ".join(type(part).model_fields) if isinstance(part, Description) else ""
    close = get_close_matches(str(key), list(type(part).model_fields), 1, 0.5) if known else []
    way_out = f"did you mean {close[0]!r}?" if close else f"known there are {known or 'no further names'}"
    raise UsageError(f"the machine has no value {path!r}: {key!r} is not known; {way_out}")


def _suggestion(machine: Machine, path: str) -> str:
    names = ", ".join(bearing.name for bearing in machine.touchdown_bearings)
    return f"write for example '<bearing>.support.stiffness' with one of the bearings {names} (given: {path})"
