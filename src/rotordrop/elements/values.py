"""How a physical value is written in a machine file: with unit, as a guess, or as an estimate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, cast

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from rotordrop.errors import UsageError
from rotordrop.known import Known, Status
from rotordrop.units import KINDS, format_quantity, parse_quantity, si_unit

LEFT_OUT = Known(value=math.nan, status="default", source="follows from other values")
"""Stands for a value that was left out and follows from its neighbours."""

SMALLEST, LARGEST = 1e-20, 1e20
"""Magnitudes [SI] no machine has beyond; far inside what squares and fourth powers can be taken of."""

MOST_TURNS = 2e3 * math.pi
"""Largest angle [rad]; beyond it nothing is left of the angle within a turn."""

KIND_MARK = "x-quantity"
"""Marks a physical value in the schema of a description, with its kind."""

STATUSES: tuple[Status, ...] = ("given", "guess", "estimated", "default", "inferred")
"""How a machine file may say that a value is known; verdicts on a record are no part of a file."""
_TABLE_KEYS = ("value", "guess", "range", "interval", "standard_error", "lower", "upper", "source", "status")


@dataclass(frozen=True)
class Physical:
    """Kind and admissible range of a physical value; reads every way of writing it."""

    kind: str
    """Kind of quantity, one of `rotordrop.units.KINDS`."""
    above: float | None = None
    """The value must be greater than this [SI unit of the kind]."""
    least: float | None = None
    most: float | None = None
    """The value must lie between these [SI unit of the kind]."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read with `read`."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Name the kind; `rotordrop.machine.schema` describes the ways of writing it once for all values."""
        return {KIND_MARK: self.kind}

    def read(self, raw: Any) -> Known:
        """Read a number with unit, a guess with range, or an estimate with interval and source."""
        if isinstance(raw, Known):
            if raw is LEFT_OUT:
                return raw
            unit = si_unit(self.kind)
            return self._admissible(raw if raw.unit == unit else replace(raw, unit=unit), raw)
        if isinstance(raw, Mapping):
            return self._admissible(self._from_table(raw), raw)
        return self._admissible(Known(value=self.number(raw), unit=si_unit(self.kind)), raw)

    def number(self, raw: Any) -> float:
        """Read one number [SI unit of the kind]."""
        if isinstance(raw, int | float) and not isinstance(raw, bool) and KINDS[self.kind].unit:
            raise UsageError(
                f"{raw!r} has no unit; {spoken(self.kind)} needs one, for example "
                f"{KINDS[self.kind].example!r}"
            )
        if isinstance(raw, str) and (exact := _exact_si(raw, self.kind)) is not None:
            return exact
        return parse_quantity(raw, self.kind)

    def _from_table(self, table: Mapping[str, Any]) -> Known:
        unknown = [key for key in table if key not in _TABLE_KEYS]
        if unknown:
            raise UsageError(
                f"{unknown[0]!r} does not belong to a value; write {{guess = …, range = […]}} or "
                f"{{value = …, interval = […], source = …}}"
            )
        if ("guess" in table) == ("value" in table):
            raise UsageError("a value given as a table needs either 'guess' or 'value', and only one of them")
        guessed = "guess" in table
        if guessed and (misplaced := sorted({"interval", "standard_error"} & set(table))):
            raise UsageError(
                f"a guess has a range, not {misplaced[0]!r}; write {{guess = …, range = […]}} or "
                f"{{value = …, {misplaced[0]} = …}}"
            )
        return Known(
            value=self.number(table["guess" if guessed else "value"]),
            status="guess" if guessed else _status(table),
            range=self._pair(table, "range"),
            interval_90=self._pair(table, "interval"),
            standard_error=self._optional(table, "standard_error"),
            lower=self._optional(table, "lower"),
            upper=self._optional(table, "upper"),
            source=_source(table),
            unit=si_unit(self.kind),
        )

    def _optional(self, table: Mapping[str, Any], key: str) -> float | None:
        return self.number(table[key]) if key in table else None

    def _pair(self, table: Mapping[str, Any], key: str) -> tuple[float, float] | None:
        if key not in table:
            return None
        written = table[key]
        if not isinstance(written, list | tuple) or len(written) != 2:
            raise UsageError(
                f"{key} = {written!r} is not a pair; write {key} = [lowest, highest], with decimal points"
            )
        low, high = self.number(written[0]), self.number(written[1])
        if low > high:
            raise UsageError(f"{key} = {written!r} runs backwards; write the lower value first")
        if low == high and key == "range":
            raise UsageError(f"{key} = {written!r} has no width; write the lowest and the highest value")
        for number, text in zip((low, high), written, strict=True):
            self._check(number, text, key)
        return low, high

    def _admissible(self, value: Known, raw: Any) -> Known:
        self._check(value.value, raw)
        for name, pair in (("range", value.range), ("interval", value.interval_90)):
            if pair is not None and not pair[0] <= value.value <= pair[1]:
                raise UsageError(
                    f"{self.text(value.value)} lies outside its own {name}, {self.text(pair[0])} to "
                    f"{self.text(pair[1])}; change one of them"
                )
        if value.standard_error is not None and not value.standard_error < math.inf:
            raise UsageError(f"standard_error = {value.standard_error:g} is no finite number")
        lower, upper = value.lower, value.upper
        if lower is not None and upper is not None and lower > upper:
            raise UsageError(
                f"lower = {self.text(lower)} lies above upper = {self.text(upper)}; exchange the two"
            )
        return value

    def _check(self, number: float, raw: Any, what: str = "") -> None:
        name = f"{what} reaches to {self.text(number)}, which" if what else self.text(number)
        if not math.isfinite(number):
            raise UsageError(
                f"{raw!r} is not a finite number; write for example {KINDS[self.kind].example!r}"
            )
        least = 0.0 if self.above is None else SMALLEST  # a fitted drag may come out as good as zero
        if number and not least <= abs(number) <= LARGEST:
            raise UsageError(
                f"{raw!r} is no {self.kind.replace('_', ' ')} that a machine has; write for example "
                f"{KINDS[self.kind].example!r}"
            )
        if self.above is not None and not number > self.above:
            limit = "positive" if self.above == 0 else f"greater than {self.text(self.above)}"
            example = f", such as {KINDS[self.kind].example!r}" if self.above == 0 else ""
            raise UsageError(f"{name} is not allowed here; {spoken(self.kind)} must be {limit}{example}")
        if self.least is not None and number < self.least:
            limit = "negative" if self.least == 0 else f"below {self.text(self.least)}"
            raise UsageError(f"{name} is not allowed here; it must not be {limit}")
        if self.most is not None and number > self.most:
            raise UsageError(f"{name} is not allowed here; at most {self.text(self.most)}")

    def text(self, number: float) -> str:
        """Write a number the way an engineer reads it."""
        return format_quantity(number, self.kind) if number else f"0 {si_unit(self.kind)}".strip()


def spoken(kind: str) -> str:
    """Name a kind with its article."""
    if kind == "dimensionless":
        return "the number"
    return ("an " if kind[0] in "aeiou" else "a ") + kind.replace("_", " ")


def default(value: float, why: str, bounds: tuple[float, float] | None = None) -> Any:
    """Give a field a documented default [SI], with the range thought possible."""
    return Field(default=Known(value=value, status="default", range=bounds, source=why), description=why)


def follows(why: str) -> Any:
    """Mark a field that, when left out, follows from its neighbours."""
    return Field(default=LEFT_OUT, description=f"When left out: {why}")


def scaled(value: Known, factor: float, why: str, unit: str) -> Known:
    """Another value that follows from one by a factor, with its range."""
    bounds = None if value.range is None else (value.range[0] * factor, value.range[1] * factor)
    return Known(value=value.value * factor, status="default", range=bounds, source=why, unit=unit)


def _status(table: Mapping[str, Any]) -> Status:
    stated = table.get("status")
    if stated is None:
        return "estimated" if {"interval", "standard_error", "lower", "upper"} & set(table) else "given"
    if stated not in STATUSES:
        raise UsageError(f"status = {stated!r} is not known; it is one of {', '.join(STATUSES)}")
    return cast(Status, stated)


def _source(table: Mapping[str, Any]) -> str | None:
    source = table.get("source")
    if source is not None and not isinstance(source, str):
        raise UsageError(f'source = {source!r} is not a text; write source = "where the value comes from"')
    return source


def _exact_si(text: str, kind: str) -> float | None:
    """Read a text in the SI unit of the kind without converting: what was saved comes back exactly."""
    head, _, unit = text.strip().partition(" ")
    if unit != si_unit(kind) or not unit or not head.isascii():
        return None
    try:
        number = float(head)
    except ValueError:
        return None
    return number if math.isfinite(number) and "_" not in head else None


Length = Annotated[Known, Physical("length")]
PositiveLength = Annotated[Known, Physical("length", above=0.0)]
NonNegativeLength = Annotated[Known, Physical("length", least=0.0)]
PositiveMass = Annotated[Known, Physical("mass", above=0.0)]
Inertia = Annotated[Known, Physical("inertia", least=0.0)]
PositiveInertia = Annotated[Known, Physical("inertia", above=0.0)]
Angle = Annotated[Known, Physical("angle", least=-MOST_TURNS, most=MOST_TURNS)]
ContactAngle = Annotated[Known, Physical("angle", least=0.0, most=math.radians(60.0))]
Time = Annotated[Known, Physical("time", least=0.0)]
PositiveTime = Annotated[Known, Physical("time", above=0.0)]
Speed = Annotated[Known, Physical("speed", least=0.0)]
PositiveSpeed = Annotated[Known, Physical("speed", above=0.0)]
Velocity = Annotated[Known, Physical("velocity", above=0.0)]
Force = Annotated[Known, Physical("force", least=0.0)]
PositiveForce = Annotated[Known, Physical("force", above=0.0)]
Stiffness = Annotated[Known, Physical("stiffness", above=0.0)]
Damping = Annotated[Known, Physical("damping", least=0.0)]
Pressure = Annotated[Known, Physical("pressure", above=0.0)]
Density = Annotated[Known, Physical("density", above=0.0)]
Acceleration = Annotated[Known, Physical("acceleration", least=0.0)]
Unbalance = Annotated[Known, Physical("unbalance", least=0.0)]
CubicTerm = Annotated[Known, Physical("cubic_term")]
Coupling = Annotated[Known, Physical("dimensionless", least=-0.9, most=0.9)]
ContactStiffness = Annotated[Known, Physical("contact_stiffness", above=0.0)]
ContactDamping = Annotated[Known, Physical("contact_damping", least=0.0)]
Drag = Annotated[Known, Physical("rotational_drag", least=0.0)]
QuadraticDrag = Annotated[Known, Physical("quadratic_drag", least=0.0)]
HeatCapacity = Annotated[Known, Physical("heat_capacity", above=0.0)]
HeatConductance = Annotated[Known, Physical("heat_conductance", least=0.0)]
Expansion = Annotated[Known, Physical("expansion", least=0.0)]
Share = Annotated[Known, Physical("dimensionless", least=0.0, most=1.0)]
Sensitivity = Annotated[Known, Physical("voltage_sensitivity", above=0.0)]
Current = Annotated[Known, Physical("current", above=0.0)]
Resistance = Annotated[Known, Physical("resistance", above=0.0)]
Voltage = Annotated[Known, Physical("voltage", above=0.0)]
Area = Annotated[Known, Physical("area", above=0.0)]
ProportionalGain = Annotated[Known, Physical("proportional_gain", above=0.0)]
IntegralGain = Annotated[Known, Physical("integral_gain", least=0.0)]
DerivativeGain = Annotated[Known, Physical("derivative_gain", least=0.0)]
PositiveFrequency = Annotated[Known, Physical("frequency", above=0.0)]
PoleAngle = Annotated[Known, Physical("angle", least=0.0, most=math.radians(60.0))]
Number = Annotated[Known, Physical("dimensionless")]
NonNegative = Annotated[Known, Physical("dimensionless", least=0.0)]
Positive = Annotated[Known, Physical("dimensionless", above=0.0)]
PoissonRatio = Annotated[Known, Physical("dimensionless", above=-1.0, most=0.5)]
Conformity = Annotated[Known, Physical("dimensionless", above=0.5, most=1.0)]
ContactExponent = Annotated[Known, Physical("dimensionless", least=1.0, most=2.0)]
