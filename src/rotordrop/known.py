"""A number and what is known about it: how it is known, its error, its 90 % interval, its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

import numpy as np

from rotordrop.errors import UsageError
from rotordrop.require import numbers, require

NINETY = 1.6448536269514722
"""Half width of a 90 % interval in standard deviations of a normal distribution [1]."""


def deviation_of(value: float, ends: tuple[float, float] | None, *, logarithmic: bool = False) -> float:
    """Standard deviation that belongs to a 90 % interval, of the logarithm where that is normal."""
    low, high = ends or (value, value)
    if not logarithmic:
        return (high - low) / (2.0 * NINETY)
    return math.log(high / value) / NINETY if low <= 0.0 else math.log(high / low) / (2.0 * NINETY)


Provenance = Literal["given", "guess", "estimated", "default", "inferred"]
"""How a value of a machine is known; what a machine file may say."""

Status = (
    Provenance
    | Literal[
        "determined",
        "weakly determined",
        "at its bound",
        "the record does not determine it",
        "known from the calibration",
        "the model does not fit the record",
        "of the cross-check: the model does not fit the record",
        "the estimated part ends during this contact",
        "taken over",
    ]
)
"""How a value is known, or the verdict on one that a record was asked for."""
_STATUSES = [one for part in get_args(Status) for one in get_args(part)]


@dataclass(frozen=True, kw_only=True)
class Known:
    """A physical value with what is known about it; an identified one never travels without its error.

    ``float(x)`` gives the value.
    """

    value: float
    """In SI units."""
    status: Status = "given"
    """How it is known, or what the record says about it."""
    standard_error: float | None = None
    """Standard error, in the unit of the value."""
    interval_90: tuple[float, float] | None = None
    """Interval that holds the true value with 90 % probability."""
    allowance_90: float | None = None
    """Half width by what the model leaves out alone; independent of what the record leaves open."""
    range: tuple[float, float] | None = None
    """Lowest and highest value thought possible, for a guess."""
    lower: float | None = None
    """Lower limit that the record itself sets, for example of the air gap."""
    upper: float | None = None
    """Upper limit that the record itself sets."""
    start: float | None = None
    """Where the search began."""
    bounds: tuple[float, float] | None = None
    """Limits of the search."""
    drops: int | None = None
    """Drops behind it, where it was counted."""
    source: str | None = None
    """Where the value comes from."""
    unit: str = ""
    """SI unit, for display."""

    def __post_init__(self) -> None:
        require(self.status, "status", str, among=_STATUSES)
        require(self.drops, "drops", int, none=True, least=0)
        require(self.unit, "unit", str)
        require(self.source, "source", str, none=True)
        for name in ("value", "standard_error", "allowance_90", "lower", "upper", "start"):
            one = getattr(self, name)  # nan: no number follows from the record
            fits = (isinstance(one, float | np.number) or type(one) is int) or (
                one is None and name != "value"
            )
            if not fits:
                raise UsageError(f"{name} is {one!r}; expected a number, in SI units")
            if type(one) is int:
                require(one, name, float)
            if name in ("standard_error", "allowance_90") and one is not None and one < 0.0:
                raise UsageError(f"{name} is {one!r}; it must be zero or positive")
        for name in ("interval_90", "range", "bounds"):
            pair = getattr(self, name)
            low, high = (0.0, 0.0) if pair is None else numbers(pair, name, (2,))
            if low > high:
                raise UsageError(f"{name} is {pair!r}; expected two numbers, the lower one first")

    def __float__(self) -> float:
        return float(self.value)

    def __repr__(self) -> str:
        known = ((one.name, getattr(self, one.name)) for one in fields(self))
        said = (f"{name}={value!r}" for name, value in known if repr(value) not in ("None", "''"))
        return f"Known({', '.join(said)})"

    @property
    def low(self) -> float:
        """Lower end of the interval; the value itself where there is none."""
        return self.value if self.interval_90 is None else self.interval_90[0]

    @property
    def high(self) -> float:
        """Upper end of the interval; the value itself where there is none."""
        return self.value if self.interval_90 is None else self.interval_90[1]

    def as_json(self) -> dict[str, Any]:
        """Give the fields that are known, ready for JSON."""
        known = {name: value for name, value in vars(self).items() if value is not None and value != ""}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in known.items()}
