"""What a part of a machine may have beyond the base model, and what an accepted extension says of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self, TypeVar

from rotordrop.elements.parameter import Owner, Parameter, path_of
from rotordrop.known import Known

Values = Mapping[str, Known]
"""Values by path."""


class Assembly(Protocol):
    """A machine, as far as an extension looks at it."""

    @property
    def touchdown_bearings(self) -> tuple[Any, ...]:
        """Touchdown bearings."""

    @property
    def sensors(self) -> tuple[Any, ...]:
        """Displacement sensors."""

    @property
    def unbalances(self) -> tuple[Any, ...]:
        """Unbalances."""

    @property
    def rotor(self) -> Any:
        """The rotor."""

    def with_values(self, values: Mapping[str, float | str | Known]) -> Self:
        """The same machine with other values."""


M = TypeVar("M", bound=Assembly)


def parts_of(machine: Assembly, owner: Owner) -> list[tuple[str, Any]]:
    """The parts of a machine that may own a parameter, with the name each has in a path."""
    if owner == "bearing":
        return [(bearing.name, bearing) for bearing in machine.touchdown_bearings]
    if owner == "sensor":
        return [(sensor.name, sensor) for sensor in machine.sensors]
    if owner == "unbalance":
        return [(str(i), unbalance) for i, unbalance in enumerate(machine.unbalances)]
    return [("", machine.rotor if owner == "rotor" else machine)]


def guess(value: float) -> Known:
    """A value to begin with."""
    return Known(value=value, status="guess")


def nothing(_part: Any) -> dict[str, Known]:
    """No value at all."""
    return {}


@dataclass(frozen=True, kw_only=True)
class Extension:
    """Something that parts of one kind may have beyond the base model."""

    name: str
    """What it is called."""
    owner: Owner
    """Kind of part that has it."""
    rows: tuple[Parameter, ...] = ()
    """Its unknowns, of a machine that names them."""
    names: tuple[str, ...]
    """Fields below the part that a description with this extension fills; one of them filled, it is there."""
    neutral: Callable[[Any], dict[str, Known]]
    """Values of a part to begin with, by field: the base model says the same."""
    sentence: Callable[[Any, Values, float], str]
    """What the values found say of a part, by field; the last argument is the mean load of a bearing [N]."""
    joined: str = "; "
    """What stands between the words on two parts."""
    frame: str = "{}"
    """What stands around the words on all parts."""
    base: Callable[[Any], dict[str, Known]] = nothing
    """Values with which a machine says what the base model says and is followed as with this extension:
    smaller process noise in the fall is no evidence of a long remanence."""
    shows_beside: bool = True
    """Whether it can show beside a base model that is consistent with the record."""

    def values(self, machine: Assembly) -> dict[str, Known]:
        """Values that a description with this extension names; none where it names some already."""
        parts = parts_of(machine, self.owner)
        if any(_field(part, name) is not None for _, part in parts for name in self.names):
            return {}
        return _at(self.owner, parts, self.neutral)

    def usual(self, machine: Assembly) -> dict[str, Known]:
        """Values with which the base model is followed as with this extension."""
        return _at(self.owner, parts_of(machine, self.owner), self.base)

    def added_to(self, machine: M) -> M:
        """The machine with this extension."""
        return machine.with_values(self.values(machine))

    def saying_the_usual(self, machine: M) -> M:
        """The machine followed as with this extension, which says nothing."""
        return machine.with_values(self.usual(machine))

    def found(self, machine: Assembly, values: Values, mean_load: float) -> str:
        """What the values found say, by path in the machine; in brackets 90 % intervals."""
        words = []
        for name, part in parts_of(machine, self.owner):
            prefix = path_of(self.owner, name, "")
            inside = {
                path.removeprefix(prefix): one for path, one in values.items() if path.startswith(prefix)
            }
            words.append(self.sentence(part, inside, mean_load))
        return self.frame.format(self.joined.join(word for word in words if word))


def _field(part: Any, path: str) -> object:
    for name in path.split("."):
        part = getattr(part, name)
    return part


def _at(
    owner: Owner, parts: list[tuple[str, Any]], values: Callable[[Any], dict[str, Known]]
) -> dict[str, Known]:
    return {path_of(owner, name, key): one for name, part in parts for key, one in values(part).items()}


def derived(function: Callable[..., float], *known: Known) -> tuple[float, float, float]:
    """A number that follows from values, with its 90 % interval; their errors count as independent."""
    middle = [one.value for one in known]
    square = 0.0
    for k, one in enumerate(known):
        low, high = one.interval_90 or (one.value, one.value)
        ends = [function(*middle[:k], end, *middle[k + 1 :]) for end in (low, high)]
        square += (0.5 * (ends[1] - ends[0])) ** 2
    value, half = function(*middle), math.sqrt(square)
    return value, value - half, value + half


def itself(known: Known) -> tuple[float, float, float]:
    """A value with its 90 % interval, made symmetric."""
    return derived(float, known)


def in_words(number: tuple[float, float, float], unit: str, scale: float = 1.0) -> str:
    """A number with its interval, in a unit of a size [SI], with as many digits as the interval leaves."""
    value, low, high = (one / scale for one in number)
    gap = "" if unit in ("", "°") else " "
    digits = max(0, min(4, 1 - math.floor(math.log10(max(high - low, 1e-12)))))
    return f"{value:.{digits}f}{gap}{unit} ({low:.{digits}f} to {high:.{digits}f})"
