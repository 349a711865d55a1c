"""A number and what is known about it: given, guessed, estimated with an interval, or a default."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Status = Literal["given", "guess", "estimated", "default", "inferred"]
NINETY = 1.6448536269514722
"""Half width of a 90 % interval in standard deviations of a normal distribution [1]."""

Verdict = Literal[
    "determined",
    "weakly determined",
    "at its bound",
    "the record does not determine it",
    "known from the calibration",
    "the model does not fit the record",
    "of the cross-check: the model does not fit the record",
    "taken over",
]


@dataclass(frozen=True, kw_only=True)
class Estimated:
    """A physical value of the machine, with how it is known.

    Attributes
    ----------
    value : float
        The value in SI units; ``float(x)`` gives it too.
    status : {"given", "guess", "estimated", "default", "inferred"}
        How the value is known.
    range : tuple of float, optional
        Lowest and highest value thought possible, for a guess.
    interval_90 : tuple of float, optional
        Interval that holds the true value with 90 % probability, for an estimate.
    standard_error : float, optional
        Standard error of an estimate.
    lower, upper : float, optional
        Limits between which the value is known to lie.
    source : str, optional
        Where the value comes from.
    unit : str
        SI unit, for display.
    """

    value: float
    status: Status = "given"
    range: tuple[float, float] | None = None
    interval_90: tuple[float, float] | None = None
    standard_error: float | None = None
    lower: float | None = None
    upper: float | None = None
    source: str | None = None
    unit: str = ""

    def __float__(self) -> float:
        return self.value

    def as_json(self) -> dict[str, Any]:
        """Give the fields that are known, ready for JSON."""
        return _known_fields(
            value=self.value,
            unit=self.unit or None,
            status=self.status,
            range=self.range,
            interval_90=self.interval_90,
            standard_error=self.standard_error,
            lower=self.lower,
            upper=self.upper,
            source=self.source,
        )


@dataclass(frozen=True, kw_only=True)
class IdentifiedValue:
    """A number found from a recording; it never travels without its error, start and bounds.

    Attributes
    ----------
    value : float
        The identified value in SI units; ``float(x)`` gives it too.
    status : Verdict
        What the record says about the value.
    standard_error : float, optional
        Standard error, in the unit of the value.
    interval_90 : tuple of float, optional
        Interval that holds the true value with 90 % probability.
    allowance_90 : float, optional
        Half width, in the unit of the value, by what the model leaves out alone; with what the record leaves
        open, as independent errors, it makes up the interval.
    lower, upper : float, optional
        Limits the record itself sets, for example the lower and upper air gap.
    start : float, optional
        Where the search began.
    bounds : tuple of float, optional
        Limits of the search.
    unit : str
        SI unit, for display.
    """

    value: float
    status: Verdict = "determined"
    standard_error: float | None = None
    interval_90: tuple[float, float] | None = None
    allowance_90: float | None = None
    lower: float | None = None
    upper: float | None = None
    start: float | None = None
    bounds: tuple[float, float] | None = None
    unit: str = ""

    def __float__(self) -> float:
        return self.value

    def as_json(self) -> dict[str, Any]:
        """Give the fields that are known, ready for JSON."""
        return _known_fields(
            value=self.value,
            status=self.status,
            standard_error=self.standard_error,
            interval_90=self.interval_90,
            allowance_90=self.allowance_90,
            lower=self.lower,
            upper=self.upper,
            start=self.start,
            bounds=self.bounds,
            unit=self.unit or None,
        )


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Two parameters by their paths, and how their errors correlate [1]."""

    first: str
    second: str
    value: float


def _known_fields(**fields: Any) -> dict[str, Any]:
    known = {name: value for name, value in fields.items() if value is not None}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in known.items()}
