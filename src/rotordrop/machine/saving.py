"""Write a machine to a TOML file that reads back as the same machine."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rotordrop.elements.description import Description
from rotordrop.elements.rotor import Rotor
from rotordrop.elements.unbalance import BalanceGrade
from rotordrop.files import write_text
from rotordrop.known import Known
from rotordrop.machine.machine import Machine
from rotordrop.require import require
from rotordrop.units import KINDS, parse_quantity, si_unit

_FILE_UNITS = {
    "length": (("mm", 1e-3), ("um", 1e-6), ("m", 1.0)),
    "mass": (("kg", 1.0),),
    "speed": (("Hz", 6.283185307179586),),
    "angle": (("deg", 0.017453292519943295),),
    "pressure": (("GPa", 1e9),),
    "unbalance": (("g mm", 1e-6),),
    "area": (("cm^2", 1e-4),),
    "voltage_sensitivity": (("mV/um", 1e3),),
}
"""Units to write a kind in when the number comes back exactly; else its SI unit."""


def save_machine(machine: Machine, path: str | os.PathLike[str]) -> None:
    """Write a machine to a TOML file, with guesses, intervals and sources.

    What was left out of the description stays left out, so that defaults remain defaults. A shaft that came
    from a table is written into the file, which therefore stands alone. Reading the file gives an equal
    machine.
    """
    write_text(path, machine_text(require(machine, "machine", Machine)))


def machine_text(machine: Machine, remarks: Mapping[str, str] | None = None) -> str:
    """Give the TOML text of a machine, with remarks by path ("sensors.angle") where no source is."""
    return "\n".join(_table(_content(machine), "", remarks or {})).strip("\n") + "\n"


@dataclass(frozen=True)
class _Written:
    """A value as it stands in the file."""

    text: str


def _content(part: Description) -> dict[str, Any]:
    """What a description writes: texts, tables and lists of tables, by key."""
    content: dict[str, Any] = {}
    for name in sorted(type(part).model_fields, key=lambda name: name != "name"):
        value = getattr(part, name)
        if name not in part.model_fields_set or value is None:
            continue
        if isinstance(value, Known):
            physical = part.physical(name)
            content[name] = _Written(_value_text(value, physical.kind if physical else "dimensionless"))
        elif isinstance(value, Description):
            # a table that is there or not says something even when it is empty
            optional = type(part).model_fields[name].default is None
            content[name] = _content(value) or (_Written("{}") if optional else {})
        elif isinstance(value, dict):
            content[name] = {key: _content(item) for key, item in value.items()}
        elif isinstance(value, tuple) and value and isinstance(value[0], Description):
            content[name] = [_content(item) for item in value]
        else:
            content[name] = _Written(_plain_text(value))
    return _shorthand(part, content)


def _shorthand(part: Description, content: dict[str, Any]) -> dict[str, Any]:
    """Write what the file says in another way than the description."""
    if isinstance(part, Rotor) and "node_positions" in content:
        texts = [_number_text(position, "length").split(" ", 1) for position in part.node_positions]
        in_mm = all(unit == "mm" for _, unit in texts)
        numbers = [number for number, _ in texts] if in_mm else [repr(one) for one in part.node_positions]
        unit = _Written(_plain_text("mm" if in_mm else "m"))
        content["node_positions"] = {"unit": unit, "values": _Written(f"[{', '.join(numbers)}]")}
    if isinstance(part, BalanceGrade):
        del content["grade_mm_s"]
        grade = _plain_text(f"G {repr(part.grade_mm_s).removesuffix('.0')}")
        content = {"grade": _Written(grade)} | content
    for field, key in part.written_as.items():
        if field in content:
            content[key] = content.pop(field)
    return content


def _table(content: dict[str, Any], header: str, remarks: Mapping[str, str]) -> Iterator[str]:
    """Write the lines of a table: values first, then the tables below it."""
    for key, item in content.items():
        if isinstance(item, _Written):
            remark = None if "source = " in item.text else remarks.get(f"{header}.{key}")
            yield f"{_key(key)} = {item.text}" + (f"  # {remark}" if remark else "")
    for key, item in content.items():
        path = f"{header}.{_key(key)}" if header else _key(key)
        if isinstance(item, dict):
            holds_values = any(isinstance(entry, _Written) for entry in item.values())
            yield from ("", f"[{path}]") if holds_values else ()
            yield from _table(item, path, remarks)
        elif isinstance(item, list):
            for entry in item:
                yield from ("", f"[[{path}]]", *_table(entry, path, remarks))


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _plain_text(key)


def _plain_text(value: Any) -> str:
    import tomlkit

    if isinstance(value, tuple) and any(isinstance(entry, str) for entry in value):
        return "[\n" + "".join(f"  {_plain_text(entry)},\n" for entry in value) + "]"
    text: str = tomlkit.item(list(value) if isinstance(value, tuple) else value).as_string()
    return text


def _value_text(value: Known, kind: str) -> str:
    is_guess = value.status == "guess" and value.interval_90 is None and value.standard_error is None
    entries = {"guess" if is_guess else "value": _quoted(value.value, kind)}
    for key, pair in (("range", value.range), ("interval", value.interval_90)):
        if pair is not None:
            entries[key] = f"[{_quoted(pair[0], kind)}, {_quoted(pair[1], kind)}]"
    for key in ("standard_error", "lower", "upper"):
        if (number := getattr(value, key)) is not None:
            entries[key] = _quoted(number, kind)
    # the status that a reader would take it for need not be written
    read_back = "estimated" if entries.keys() & {"interval", "standard_error", "lower", "upper"} else "given"
    if value.source is not None:
        entries["source"] = _plain_text(value.source)
    if not is_guess and value.status != read_back:
        entries["status"] = _plain_text(value.status)
    if set(entries) == {"value"}:
        return entries["value"]
    return "{ " + ", ".join(f"{key} = {text}" for key, text in entries.items()) + " }"


def _quoted(number: float, kind: str) -> str:
    text = _number_text(number, kind)
    return f'"{text}"' if KINDS[kind].unit else text


@lru_cache(maxsize=4096)
def _number_text(number: float, kind: str) -> str:
    """Write a number so that it comes back exactly, in a unit an engineer likes where that is possible."""
    if not KINDS[kind].unit:
        return repr(float(number))
    for unit, factor in _FILE_UNITS.get(kind, ()):
        text = f"{number / factor:.12g} {unit}"
        if parse_quantity(text, kind) == number and (number == 0.0 or 1e-3 <= abs(number / factor) < 1e6):
            return text
    # else in its SI unit, with or without exponent, whichever is shorter
    plain = repr(number).removesuffix(".0")
    candidates = (f"{number:.{digits}e}" for digits in range(17))
    mantissa, exponent = next((one for one in candidates if float(one) == number), f"{number:.16e}").split(
        "e"
    )
    scientific = f"{mantissa}e{int(exponent)}"
    return f"{scientific if len(scientific) < len(plain) else plain} {si_unit(kind)}"
