"""Numbers with units: text such as ``"280 um"`` or ``"3600 rpm"`` to SI and back.

What a unit means depends on what is asked for: ``60 Hz`` is a speed of 376.99 rad/s and a frequency of 60 Hz.
The registry therefore treats the angle as a dimension of its own, knows a hertz as one turn per second, and
drops the angle wherever a quantity (a drag torque, say) does not count it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sized
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import Any, SupportsFloat, overload

import numpy as np

from rotordrop.errors import UsageError
from rotordrop.require import numbers, require


@dataclass(frozen=True, kw_only=True)
class Kind:
    """What a quantity is: its SI unit, an example to show, and the scales it is displayed in."""

    unit: str
    example: str
    scales: tuple[tuple[float, str], ...]
    keeps_angle: bool = False


def _metric(unit: str, *prefixes: str) -> tuple[tuple[float, str], ...]:
    factors = {"G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "µ": 1e-6, "n": 1e-9}
    return tuple((factors[prefix], prefix + unit) for prefix in prefixes)


FASTEST_SPIN = 1e5
"""Speed of a rotor [rad/s] beyond which a unit is mistyped (chosen)."""
GRAVITY = 9.81
"""Acceleration of free fall [m/s²], where no machine file says another."""


def fall_time(way: float, gravity: float = GRAVITY) -> float:
    """Time [s] of a fall from rest along a way [m] under an acceleration [m/s²]."""
    return math.sqrt(2.0 * way / gravity)


def fall_speed(way: float, gravity: float = GRAVITY) -> float:
    """Speed [m/s] after a fall from rest along a way [m] under an acceleration [m/s²]."""
    return math.sqrt(2.0 * way * gravity)


KINDS: dict[str, Kind] = {
    "length": Kind(unit="m", example="280 um", scales=_metric("m", "", "m", "µ")),
    "mass": Kind(unit="kg", example="105 kg", scales=((1.0, "kg"), (1e-3, "g"))),
    "time": Kind(unit="s", example="0.2 s", scales=_metric("s", "", "m", "µ")),
    "angle": Kind(unit="rad", example="45 deg", scales=((math.pi / 180, "°"),), keeps_angle=True),
    "speed": Kind(unit="rad/s", example="60 Hz", scales=((2 * math.pi, "Hz"),), keeps_angle=True),
    "frequency": Kind(unit="turn/s", example="60 Hz", scales=_metric("Hz", "k", ""), keeps_angle=True),
    "angular_acceleration": Kind(
        unit="rad/s^2", example="10 rad/s^2", scales=((1.0, "rad/s²"),), keeps_angle=True
    ),
    "velocity": Kind(unit="m/s", example="0.05 m/s", scales=_metric("m/s", "", "m")),
    "acceleration": Kind(unit="m/s^2", example="9.81 m/s^2", scales=((1.0, "m/s²"),)),
    "force": Kind(unit="N", example="515 N", scales=_metric("N", "M", "k", "")),
    "impulse": Kind(unit="N s", example="2 N s", scales=((1.0, "N s"), (1e-3, "mN s"))),
    "torque": Kind(unit="N m", example="0.1 N m", scales=_metric("N m", "k", "", "m", "µ")),
    "energy": Kind(unit="J", example="0.5 J", scales=_metric("J", "k", "", "m", "µ")),
    "power": Kind(unit="W", example="20 W", scales=_metric("W", "k", "", "m")),
    "pressure": Kind(unit="Pa", example="210 GPa", scales=((1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))),
    "density": Kind(unit="kg/m^3", example="7850 kg/m^3", scales=((1.0, "kg/m³"),)),
    "stiffness": Kind(unit="N/m", example="1e8 N/m", scales=_metric("N/m", "G", "M", "k", "")),
    "damping": Kind(unit="N s/m", example="5000 N s/m", scales=_metric("N s/m", "k", "")),
    "inertia": Kind(unit="kg m^2", example="0.42 kg m^2", scales=((1.0, "kg m²"), (1e-6, "kg mm²"))),
    "unbalance": Kind(unit="kg m", example="50 g mm", scales=((1e-6, "g mm"),)),
    "rotational_stiffness": Kind(unit="N m", example="10 N m/rad", scales=((1.0, "N m/rad"),)),
    "rotational_drag": Kind(unit="N m s", example="1e-4 N m s", scales=((1.0, "N m s"),)),
    "quadratic_drag": Kind(unit="N m s^2", example="1e-6 N m s^2", scales=((1.0, "N m s²"),)),
    "contact_stiffness": Kind(
        unit="N/m^n", example="1.05e9 N/m^1.11", scales=((1e9, "GN/mⁿ"), (1e6, "MN/mⁿ"), (1.0, "N/mⁿ"))
    ),
    "cubic_term": Kind(unit="1/m^2", example="3e8 1/m^2", scales=((1e6, "1/mm²"),)),
    "contact_damping": Kind(unit="s/m", example="0.1 s/m", scales=((1.0, "s/m"),)),
    "voltage": Kind(unit="V", example="5 V", scales=_metric("V", "k", "", "m", "µ")),
    "voltage_sensitivity": Kind(unit="V/m", example="8 mV/um", scales=((1e3, "mV/µm"),)),
    "current": Kind(unit="A", example="4 A", scales=_metric("A", "", "m")),
    "resistance": Kind(unit="ohm", example="0.5 ohm", scales=((1.0, "Ω"), (1e-3, "mΩ"))),
    "inductance": Kind(unit="H", example="10 mH", scales=_metric("H", "", "m", "µ")),
    "area": Kind(unit="m^2", example="6 cm^2", scales=((1e-4, "cm²"),)),
    "force_by_current": Kind(unit="N/A", example="130 N/A", scales=((1.0, "N/A"),)),
    "proportional_gain": Kind(unit="A/m", example="15 kA/m", scales=_metric("A/m", "k", "")),
    "integral_gain": Kind(unit="A/(m s)", example="300 kA/(m s)", scales=_metric("A/(m s)", "k", "")),
    "derivative_gain": Kind(unit="A s/m", example="50 A s/m", scales=_metric("A s/m", "")),
    "temperature": Kind(unit="K", example="20 degC", scales=((1.0, "K"),)),
    "heat_capacity": Kind(unit="J/K", example="130 J/K", scales=_metric("J/K", "k", "")),
    "heat_conductance": Kind(unit="W/K", example="4 W/K", scales=_metric("W/K", "k", "", "m")),
    "expansion": Kind(unit="1/K", example="12e-6 1/K", scales=((1e-6, "µm/(m K)"),)),
    "dimensionless": Kind(unit="", example="0.15", scales=((1.0, ""),)),
}

_DEFINITIONS = """
giga- = 1e9 = G-
mega- = 1e6 = M-
kilo- = 1e3 = k-
centi- = 1e-2 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = µ- = μ- = u-
nano- = 1e-9 = n-
metre = [length] = m = meter
second = [time] = s = sec
gram = [mass] = g
kelvin = [temperature] = K
volt = [voltage] = V
radian = [angle] = rad
turn = 6.283185307179586476925 * radian = _ = rev = revolution = cycle
degree = turn / 360 = deg
minute = 60 * second = min
hour = 3600 * second = h
hertz = turn / second = Hz
rpm = turn / minute = _ = RPM
micron = 1e-6 * metre
inch = 0.0254 * metre = in
foot = 0.3048 * metre = ft
mil = 0.001 * inch = _ = thou
tonne = 1e6 * gram = t
pound = 453.59237 * gram = lb
ounce = 28.349523125 * gram = oz
standard_gravity = 9.80665 * metre / second ** 2 = g_n = gn = g_0
newton = kilogram * metre / second ** 2 = N
pound_force = pound * standard_gravity = lbf
ounce_force = ounce * standard_gravity = ozf
kilogram_force = kilogram * standard_gravity = kgf
pascal = newton / metre ** 2 = Pa
bar = 1e5 * pascal
psi = pound_force / inch ** 2
ksi = 1000 * psi
joule = newton * metre = J
watt = joule / second = W
ampere = watt / volt = A
ohm = volt / ampere = Ω
henry = volt * second / ampere = H
degree_Celsius = kelvin; offset: 273.15 = degC
degree_Fahrenheit = 5 / 9 * kelvin; offset: 233.15 + 200 / 9 = degF
percent = 0.01 = %
"""

_USUAL = {
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "mil": 2.54e-5},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "rpm": 1.0 / 60.0},
    "speed": {"rad/s": 1.0, "Hz": 2.0 * math.pi, "rpm": math.pi / 30.0},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "velocity": {"mm/s": 1e-3},
    "pressure": {"GPa": 1e9, "MPa": 1e6},
    "unbalance": {"g mm": 1e-6},
    "voltage_sensitivity": {"mV/um": 1e3},
}
"""What recorders and machine files write beside SI units [SI units per unit]: the unit library takes half a
second to load, which a look can spare."""

_FAMILIAR = tuple(
    "m,mm,um,cm,in,mil,kg,g,t,lb,s,ms,min,Hz,kHz,rpm,rad,deg,N,kN,lbf,Pa,MPa,GPa,bar,psi,N/m,N/mm,N/um,"
    "N s/m,V,mV,mV/um,kg/m^3,kg m^2,g mm,m/s,mm/s,m/s^2,degC".split(",")
)

_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")

_LONGEST = 400
"""Characters that a number with its unit may have."""

_LONGEST_UNIT = 60

_EXPONENT = r"(?:\^|\*\*) ?(?:[+-]?[0-9]{1,2}(?:\.[0-9]{1,20})?|\([0-9]{1,2}/[0-9]{1,2}\))"
_FACTOR = rf"\(*(?:[^\W\d]\w*|%)(?: ?{_EXPONENT})?\)*"
_UNIT = re.compile(rf"(?:1 ?/ ?)?{_FACTOR}(?: ?[*/ ] ?{_FACTOR})*")
"""Names with small exponents, multiplied and divided. Anything else, such as ``m**9**9``, the unit library
would begin to compute."""


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(None, autoconvert_offset_to_baseunit=True)
    registry.load_definitions(_DEFINITIONS.strip().splitlines())
    return registry


def parse_quantity(text: object, kind: str) -> float:
    """Read a number with its unit, such as ``"280 um"``, and give it in SI units.

    Parameters
    ----------
    text : str
        A number, a blank, a unit. A plain number is accepted for the kind ``"dimensionless"`` only.
    kind : str
        What the quantity is, one of `KINDS`. A ``"speed"`` comes back in rad/s, a ``"frequency"`` in Hz.

    Returns
    -------
    float
        The value in the SI unit of the kind.

    Raises
    ------
    UsageError
        When the text is not a number with a fitting unit; the message says what to write instead.

    Examples
    --------
    >>> from rotordrop.units import parse_quantity
    >>> round(parse_quantity("3600 rpm", "frequency"), 6)
    60.0
    >>> round(parse_quantity("60 Hz", "speed"), 2)
    376.99
    """
    wanted = _kind(kind)
    number, unit = _split(text, kind, wanted)
    if not unit and wanted.unit:
        raise UsageError(f"{text!r} has no unit; {_spoken(kind)} needs one, for example {wanted.example!r}")
    if kind == "contact_stiffness":
        return _contact_stiffness(number, unit, text)
    factor = 1.0 if unit == wanted.unit else _USUAL.get(kind, {}).get(unit)
    if factor is not None:
        return number * factor
    return _convert(number, unit, text, kind, wanted)


def is_unit(text: str) -> bool:
    """Whether a text is a unit of anything."""
    try:
        return bool(text) and _unit(_plain_unit(text), text, "length") is not None
    except UsageError:
        return False


def in_si(value: object, kind: str, name: str) -> float:
    """Give a number in SI units: a text is read with its unit, a float is in SI units already.

    A whole number of a speed is refused unless it is zero: who writes ``speed=60`` means Hz or rpm.

    Examples
    --------
    >>> from rotordrop.units import in_si
    >>> in_si("60 rpm", "frequency", "speed")
    1.0
    """
    if isinstance(value, str):
        return parse_quantity(value, kind)
    wanted = _kind(kind)
    array = isinstance(value, Sized | np.ndarray)
    if array or isinstance(value, bool | complex) or not isinstance(value, SupportsFloat):
        raise UsageError(
            f"{name} is {value!r}; expected a text such as {wanted.example!r}, or a number [{wanted.unit}]"
        )
    if kind == "speed" and isinstance(value, int) and value != 0:
        raise UsageError(
            f"{name} = {value} has no unit; write '{value} Hz' or '{value} rpm' (a float is taken as rad/s)"
        )
    return float(require(value, name, float) if isinstance(value, int) else value)


class InSI:
    """Field of a frozen dataclass that takes a text with a unit or a number in SI units.

    Parameters
    ----------
    kind : str
        Kind of quantity, one of `KINDS`.
    default : float, optional
        Value when the field is left out [SI unit of the kind].
    """

    def __init__(self, kind: str, default: float | None = None) -> None:
        self.kind, self.default = kind, default

    def __set_name__(self, owner: type, name: str) -> None:
        """Keep the name of the field, for messages."""
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> float: ...
    @overload
    def __get__(self, instance: object, owner: type) -> float: ...
    def __get__(self, instance: object | None, owner: type) -> float:
        """Give the number, or the default to the dataclass that asks for it."""
        if instance is not None:
            value: float = instance.__dict__[self.name]
            return value
        if self.default is None:
            raise AttributeError(self.name)
        return self.default

    def __set__(self, instance: object, value: float | str) -> None:
        """Read what was given."""
        instance.__dict__[self.name] = in_si(value, self.kind, self.name)


def split_quantity(text: str) -> tuple[float, str]:
    """Give number and unit of a text such as ``"10 V"``, nothing converted."""
    number, unit = _split(text, "length", Kind(unit="", example="10 V", scales=()))
    return number, unit


def si_unit(kind: str) -> str:
    """Name the SI unit in which `parse_quantity` gives a kind, for display."""
    return "Hz" if kind == "frequency" else _kind(kind).unit


def format_quantity(value: float, kind: str, digits: int = 3) -> str:
    """Write an SI value the way an engineer reads it, for example ``"280 µm"`` or ``"60 Hz (3600 rpm)"``.

    Parameters
    ----------
    value : float
        Value in the SI unit of the kind (speeds in rad/s).
    kind : str
        What the quantity is, one of `KINDS`.
    digits : int
        Significant digits.
    """
    value = float(numbers(value, "value", ()))
    require(digits, "digits", int, least=1, most=17)
    scales = _kind(kind).scales
    if kind == "speed":
        turns = value / (2 * math.pi)
        return f"{_rounded(turns, digits)} Hz ({_rounded(60 * turns, max(digits, 4))} rpm)"
    size = abs(value) * (1 + 0.5 * 10.0**-digits)
    fits = (scale for scale in scales if (size >= scale[0] if size > 0.0 else scale[0] == 1.0))
    factor, unit = next(fits, scales[-1] if size > 0.0 else scales[0])
    number = _rounded(value / factor, digits)
    return f"{number}{unit}" if unit == "°" else f"{number} {unit}".rstrip()


def format_amount(number: float) -> str:
    """Write a factor to three digits as one says it: ``"128"``, ``"1110"``; below a thousandth "< 0.001"."""
    if 0.0 < number < 1e-3:
        return "< 0.001"
    return f"{float(f'{number:.3g}'):.15g}"


def format_moment(time: float) -> str:
    """Write a time of a record to 0.1 ms, as ``"214 ms"`` or, from one second on, ``"2.5 s"``."""
    number, unit = (time, "s") if abs(time) >= 1.0 else (1e3 * time, "ms")
    text = f"{round(number, 4 if unit == 's' else 1) + 0.0:.10g}"
    return f"{text.replace('-', '−')} {unit}"


def format_minute(moment: str) -> str:
    """Write a moment of ISO 8601 to the minute, ``"2026-03-01 12:30"``; anything else as it is."""
    return re.sub(r"^(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d).*$", r"\1 \2", moment)


def format_second(moment: str) -> str:
    """Write a moment of ISO 8601 to the second, ``"2026-03-01 12:30:05 UTC"``; anything else as it is."""
    return re.sub(
        r"^(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)(?:[.,]\d+)?(.*)$",
        lambda found: f"{found[1]} {found[2]}{' UTC' if found[3] == 'Z' else found[3]}",
        moment,
    )


def format_chance(probability: float) -> str:
    """Write a probability [1] in per cent, ``"93 %"``; nothing is certain: ends at "> 99 %", "< 1 %"."""
    if probability >= 0.995:
        return "> 99 %"
    return percent(probability) if probability > 0.005 else "< 1 %"


def percent(share: float, places: int = 0) -> str:
    """Write a share [1] in per cent with so many decimal places, ``"12.5 %"``."""
    return f"{100.0 * share:.{places}f} %"


def _kind(kind: str) -> Kind:
    return KINDS[require(kind, "kind of quantity", str, among=KINDS)]


def _split(text: object, kind: str, wanted: Kind) -> tuple[float, str]:
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise UsageError(f"{text!r} is not {_spoken(kind)}; write a number with a unit, {wanted.example!r}")
    if len(str(text)) > _LONGEST:
        raise UsageError(f"{_shown(text)} is no number with a unit; write for example {wanted.example!r}")
    written = str(text).strip().replace("−", "-").replace("·", " ")
    comma = _COMMA.match(written)
    if comma:
        point = comma.group().replace(",", ".")
        raise UsageError(f"{text!r} has a decimal comma; use {point}{written[comma.end() :]}")
    match = _NUMBER.match(written)
    if not match:
        raise UsageError(f"{text!r} does not begin with a number; write for example {wanted.example!r}")
    number = float(match.group())
    if not math.isfinite(number):
        raise UsageError(f"{text!r} is too large to be {_spoken(kind)}")
    unit = _plain_unit(written[match.end() :].strip())
    if kind in ("speed", "frequency") and _PER_MINUTE.fullmatch(unit):
        unit = "rpm"
    return number, unit


_PER_MINUTE = re.compile(r"1\s*/\s*min|min\s*(?:\^|\*\*)?\s*-\s*1|min⁻¹")
"""How DIN writes revolutions per minute."""


def _shown(text: object) -> str:
    written = str(text)
    return repr(written if len(written) <= _LONGEST_UNIT else f"{written[:_LONGEST_UNIT]}…")


def _plain_unit(unit: str) -> str:
    """Bring the usual ways of writing a unit to the one the registry reads."""
    unit = re.sub(r"\b([rU])/min\b", "rpm", unit)
    unit = re.sub(r"\bN(ms|m|s)\b", lambda match: "N " + " ".join(match.group(1)), unit)
    unit = re.sub(r"\bgmm\b", "g mm", unit)
    unit = re.sub(r"°\s*([CF]?)", r" deg\1", unit).strip()
    return unit.replace("²", "^2").replace("³", "^3")


def _unit(unit: str, text: object, kind: str) -> Any:
    if unit and (len(unit) > _LONGEST_UNIT or not _UNIT.fullmatch(" ".join(unit.split()))):
        raise UsageError(
            f"{_shown(text)}: {_shown(unit)} is not a unit known here; "
            f"write for example {_kind(kind).example!r}"
        )
    try:
        return _registry().parse_units(unit)
    except Exception as error:  # the parser fails in many ways on text that is no unit
        close = [name for name in _FAMILIAR if name.lower() == unit.lower()]
        close = close or get_close_matches(unit, _FAMILIAR, 1, 0.6)
        hint = f"did you mean {close[0]!r}?" if close else f"write for example {_kind(kind).example!r}"
        raise UsageError(f"{text!r}: {unit!r} is not a unit known here; {hint}") from error


def _convert(number: float, unit: str, text: object, kind: str, wanted: Kind) -> float:
    registry = _registry()
    quantity = registry.Quantity(number, _unit(unit, text, kind))
    if not wanted.keeps_angle:
        turns = quantity.dimensionality.get("[angle]", 0)
        quantity = quantity / registry.Quantity(1.0, "radian") ** turns if turns else quantity
    target = registry.parse_units(wanted.unit)
    if quantity.dimensionality != target.dimensionality:
        raise UsageError(_wrong_dimension(unit, text, kind, wanted))
    magnitude: float = quantity.to(target).magnitude
    return magnitude


def _wrong_dimension(unit: str, text: object, kind: str, wanted: Kind) -> str:
    hint = f"write for example {wanted.example!r}"
    if kind == "acceleration" and unit == "g":
        hint = "g is the gram; write '3 g_n' for three times gravity, or the value in 'm/s^2'"
    elif kind in ("speed", "frequency") and not re.search(r"Hz|rpm|RPM|rad|rev|turn|deg", unit):
        hint = "say what is counted: 'Hz', 'rpm' or 'rad/s'"
    elif re.search(r"\blb\b", unit):
        hint = "lb is a mass here; write 'lbf' for the force"
    return f"{text!r} is not {_spoken(kind)}; {hint}"


def _contact_stiffness(number: float, unit: str, text: object) -> float:
    """Convert N/m^n, whose exponent n is itself a parameter of the contact."""
    plain = re.fullmatch(r"N/m\^(1(?:\.[0-9]{1,20})?)", unit)
    if plain and float(plain[1]) < 2.0:
        return number
    quantity = _registry().Quantity(number, _unit(unit, text, "contact_stiffness"))
    dimension = dict(quantity.dimensionality)
    exponent = 1.0 - float(dimension.pop("[length]", 0))
    if dimension != {"[mass]": 1, "[time]": -2} or not 1.0 <= exponent <= 2.0:
        raise UsageError(
            f"{text!r} is not a contact stiffness; write N/m^n with n from 1 to 2, '1e9 N/m^1.11'"
        )
    magnitude: float = quantity.to_base_units().magnitude
    return magnitude * 1e-3  # base units count grams


def _rounded(number: float, digits: int) -> str:
    if not math.isfinite(number) or number == 0.0:
        return f"{number:g}".replace("-0", "0")
    if not 1e-3 <= abs(number) < 1e7:
        return f"{number:.{digits - 1}e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
    places = max(0, digits - 1 - math.floor(math.log10(abs(number) * (1 + 0.5 * 10.0**-digits))))
    return f"{number:.{places}f}"


def _spoken(kind: str) -> str:
    """Name a kind with its article."""
    if kind == "dimensionless":
        return "a number without a unit"
    return ("an " if kind[0] in "aeiou" else "a ") + kind.replace("_", " ")
