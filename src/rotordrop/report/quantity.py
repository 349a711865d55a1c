"""A number as a report shows it: fixed unit per kind, and never without its interval where there is one."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from rotordrop.known import Known
from rotordrop.units import KINDS, format_chance

System: TypeAlias = Literal["SI", "US"]

DISPLAY: dict[str, tuple[float, str]] = {
    "length": (1e-6, "µm"),
    "dimension": (1e-3, "mm"),
    "time": (1e-3, "ms"),
    "duration": (1.0, "s"),
    "force": (1.0, "N"),
    "pressure": (1e6, "MPa"),
    "stiffness": (1e6, "N/µm"),
    "damping": (1.0, "N s/m"),
    "impulse": (1.0, "N s"),
    "energy": (1.0, "J"),
    "inertia": (1e-6, "kg mm²"),
    "unbalance": (1e-6, "g mm"),
    "contact_stiffness": (1e9, "GN/mⁿ"),
    "short_time": (1e-6, "µs"),
    "voltage_sensitivity": (1e3, "mV/µm"),
    "share": (1e-2, "%"),
    "probability": (1e-2, "%"),
    "count": (1.0, ""),
}
"""Unit in which a report shows a kind, so that the numbers of a column can be compared."""

IN_OTHER_UNITS: dict[str, tuple[float, str]] = {
    "length": (25.4e-6, "mil"),
    "dimension": (25.4e-3, "in"),
    "force": (4.4482216152605, "lbf"),
    "pressure": (6.894757293168e6, "ksi"),
    "stiffness": (175126.83524647637, "klbf/in"),
    "damping": (175.12683524647637, "lbf s/in"),
    "impulse": (4.4482216152605, "lbf s"),
    "energy": (0.1129848290276167, "in lbf"),
    "velocity": (25.4e-3, "in/s"),
    "mass": (0.45359237, "lb"),
    "speed": (math.pi / 30.0, "rpm"),
}
"""The same for readers who think in mil, rpm and lbf."""

PLACES_OF_SCIENCE = (-4, 7)
NO_INTERVAL = "–"
"""In place of an estimated number whose interval is not known."""
FIXED_PLACES = {"count": 0, "probability": 1}
BEYOND_GAP = "Beyond the air gap"
THIN_SPACE, NO_BREAK = "\u202f", "\u00a0"
_OF_KNOWN = ("value", "interval_90", "standard_error", "lower", "upper")


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number for a table or a headline, in SI units, with what is known about its error."""

    value: float
    """Value in the SI unit of the kind; NaN shows as a dash."""
    kind: str
    """Kind of quantity, a key of `DISPLAY` or of `rotordrop.units.KINDS`."""
    interval_90: tuple[float, float] | None = None
    """Interval that holds the true value with 90 % probability."""
    standard_error: float | None = None
    """Standard error."""
    lower: float | None = None
    upper: float | None = None
    """Limits set by the record itself, for example of the air gap."""
    digits: int = 4
    """Significant digits when no interval says how many are meant."""
    range_only: bool = False
    """Show the interval in place of the value, where a single number would say too much."""
    places: int | None = None
    """Decimal places of the shown unit, where a column has the same; a smaller number is "< 0.01"."""
    bare: bool = False
    """Without its unit, which stands above the column."""
    system: System = "SI"
    """``"SI"``, or ``"US"`` for mil, rpm and lbf."""

    def __post_init__(self) -> None:
        if self.kind not in DISPLAY and self.kind not in KINDS:
            raise ValueError(
                f"{self.kind!r} is not a kind a report can show; known are {', '.join((*DISPLAY, *KINDS))}"
            )

    @classmethod
    def of(cls, known: object, kind: str, digits: int = 4, *, range_only: bool = False) -> Quantity:
        """Take over a value of a machine or an identification with all that is known about it."""
        if not isinstance(known, Known):
            value = math.nan if known is None else float(known)  # type: ignore[arg-type]
            return cls(value=value, kind=kind, digits=digits)
        shared = {name: getattr(known, name) for name in _OF_KNOWN}
        return cls(kind=kind, digits=digits, range_only=range_only, **shared)

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the interval; the value itself where there is none."""
        return self.interval_90 or (self.value, self.value)

    @property
    def unit(self) -> str:
        """Unit shown with the number, empty for a pure number."""
        return display_unit(self.kind, self.system)[1]

    @property
    def number(self) -> str:
        """The number alone, in the shown unit."""
        return written(self._in_unit(self.value), self._places())

    @property
    def text(self) -> str:
        """Number and unit; a speed in Hz and rpm; the range where only that is to be shown."""
        most = self._in_unit(max(map(abs, (self.value, *self.ends))))
        if self.places is not None and 0.0 < most < 0.5 * 10.0**-self.places:
            return self._with_unit(f"< {written(10.0**-self.places, self.places)}")
        if self.range_only:
            return self._range() if self.interval_90 is not None else "–"
        sure = self.kind == "probability" and self.interval_90 is None and math.isfinite(self.value)
        if sure and (chance := format_chance(self.value))[0] in "<>":
            return self._with_unit(chance.removesuffix(" %"))
        if self.kind == "speed" and self.system == "SI" and math.isfinite(self.value):
            rpm = 60 * self.value / (2 * math.pi)
            return f"{self.number} Hz ({written(rpm, max(0, 3 - _magnitude(rpm)))} rpm)"
        return self._with_unit(self.number)

    @property
    def levelled(self) -> str:
        """What stands for the number where it stands alone; a range with its level."""
        return f"90 %: {self.text}" if self.range_only and self.interval_90 else self.text

    @property
    def interval_text(self) -> str:
        """The 90 % interval or else the limits in words; empty when neither is known."""
        if self.range_only or self.text.startswith("<"):
            return ""
        if self.interval_90 is not None:
            return self._range()
        if self.lower is not None and self.upper is not None:
            return "limits " + self._with_unit(f"{self._at(self.lower)} to {self._at(self.upper)}")
        if self.standard_error is not None:
            return f"± {self._with_unit(self._at(self.standard_error))} (standard error)"
        return ""

    def _range(self) -> str:
        """The interval; one without an end goes on."""
        low, high = self.interval_90 or (math.nan, math.nan)
        if self.range_only and low == 0.0 < high:  # nothing is known of that end
            low = -math.inf
        if math.isfinite(low) and not math.isfinite(high):
            return f"{self._with_unit(self._at(low))} or more"
        if math.isfinite(high) and not math.isfinite(low):
            return f"{self._with_unit(self._at(high))} or less"
        return self._with_unit(f"{self._at(low)} to {self._at(high)}")

    def _at(self, value: float) -> str:
        return written(self._in_unit(value), self._places())

    def _with_unit(self, number: str) -> str:
        if number == "–" or not self.unit or self.bare:
            return number
        return f"{number}{self.unit}" if self.unit == "°" else f"{number} {self.unit}"

    def _in_unit(self, value: float) -> float:
        return value / display_unit(self.kind, self.system)[0]

    def _places(self) -> int | None:
        """Decimal places: two digits of the error if there is one, else the significant digits asked for."""
        value = self._in_unit(self.value)
        if not math.isfinite(value):
            return 0
        if self.places is not None:
            return self.places
        if self.kind in FIXED_PLACES:
            return FIXED_PLACES[self.kind]
        if not PLACES_OF_SCIENCE[0] < _magnitude(value) < PLACES_OF_SCIENCE[1]:
            return None
        error = abs(self._in_unit(self.standard_error or 0.0))
        if self.interval_90 is not None:
            error = 0.5 * abs(self._in_unit(self.interval_90[1] - self.interval_90[0]))
        if error > 0.0 and math.isfinite(error):
            return min(12, max(0, 1 - _magnitude(error)))
        return max(0, self.digits - 1 - _magnitude(value))


def places_of(values: Iterable[float], kind: str, digits: int = 3) -> int:
    """Decimal places with which the largest of some values [SI] has so many digits in its unit."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    return max(0, digits - 1 - _magnitude(largest / display_unit(kind)[0]))


def shown(value: object, kind: str, digits: int = 4) -> str:
    """A value [SI] in words: number and unit."""
    return Quantity.of(value, kind, digits).text


def one_line(number: Quantity) -> str:
    """A number with its interval behind it."""
    return f"{number.levelled} ({number.interval_text})" if number.interval_text else number.levelled


def with_interval(value: float | None, kind: str, interval_90: tuple[float, float] | None) -> str:
    """An estimated value [SI] with its interval; one whose interval is not known is not shown."""
    if value is None or interval_90 is None:
        return NO_INTERVAL
    one = Quantity(value=value, kind=kind, interval_90=interval_90)
    return f"{one.text} ({one.interval_text})"


def display_unit(kind: str, system: System = "SI") -> tuple[float, str]:
    """Factor and unit in which a kind is shown; kinds without an entry in `DISPLAY` in their first scale."""
    if system == "US" and kind in IN_OTHER_UNITS:
        return IN_OTHER_UNITS[kind]
    if kind in DISPLAY:
        return DISPLAY[kind]
    scales = KINDS[kind].scales
    return next((scale for scale in scales if scale[0] == 1.0), scales[0])


def written(value: float, places: int | None) -> str:
    """Write a number with thin spaces between thousands, or with a power of ten when `places` is None."""
    if not math.isfinite(value):
        return "–"
    if places is None:
        if value == 0.0:
            return "0"
        mantissa, exponent = f"{value:.2e}".split("e")
        power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{mantissa} × 10{power}"
    text = f"{value:,.{places}f}".replace(",", THIN_SPACE)
    nothing = text.startswith("-0") and not text.strip(f"-0.{THIN_SPACE}")
    return f"0{text[2:]}" if nothing else text.replace("-", "−")


_UNITS = {unit for scales in (DISPLAY, IN_OTHER_UNITS) for _, unit in scales.values()} | {
    unit for kind in KINDS.values() for _, unit in kind.scales
}
_NUMBER_AND_UNIT = re.compile(
    r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) ("
    + "|".join(re.escape(unit) for unit in sorted(_UNITS | {"rpm"}, key=len, reverse=True) if unit)
    + r")(?![\w/])|(?<=±) (?=\d)|(?<=\()[\d.−\u202f]+ to (?=[\d.−])"
)


def unbroken(text: str) -> str:
    r"""The text with no-break spaces between a number and its unit, after ±, and in an interval in brackets.

    Examples
    --------
    >>> from rotordrop.report.quantity import unbroken
    >>> unbroken("9 to 50 % at 3 N s/m (2 to 4 N s/m)").split(" ")
    ['9', 'to', '50\xa0%', 'at', '3\xa0N\xa0s/m', '(2\xa0to\xa04\xa0N\xa0s/m)']
    """
    return _NUMBER_AND_UNIT.sub(lambda found: found[0].replace(" ", NO_BREAK), text)


def with_error(value: float, error: float | None, unit: str) -> str:
    """Write a number with its standard error, both to two digits of the error; without one to three digits.

    Examples
    --------
    >>> from rotordrop.report.quantity import with_error
    >>> with_error(28.7613, 0.0113, "Hz")
    '28.761 ± 0.011 Hz'
    """
    if error is None or not math.isfinite(error) or error <= 0.0:
        return f"about {written(value, max(0, 2 - _magnitude(value)))} {unit}"
    places = min(12, max(0, 1 - _magnitude(error)))
    return f"{written(value, places)} ± {written(error, places)} {unit}"


def _magnitude(value: float) -> int:
    """Power of ten of the first significant digit; 0 for zero."""
    return 0 if value == 0.0 or not math.isfinite(value) else math.floor(math.log10(abs(value)))
