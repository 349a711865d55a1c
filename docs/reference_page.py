"""Write the reference of machine file and profile from their schemas."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from rotordrop.machine.schema import field_meanings, machine_schema
from rotordrop.machine.simple import simple_schema
from rotordrop.record.profile import Profile

MACHINE = """\
# Machine file

Every key of a machine file, from the schema that reads it (`rotordrop init --schema machine` prints it).
A value with a unit is a text such as `"0.25 mm"`, or a table: `{ guess = …, range = […, …], source = "…" }`
for what is only guessed, `{ value = …, interval = […, …] }` for what was measured with an error. Keys in bold
are needed. `rotordrop init` writes a commented file to start from.
"""

PROFILE = """\
# Profile of a recorder

Every key of a [profile](../recorders.md), from the model that reads it. None is needed.
"""


def machine_page() -> str:
    """Every key of a machine file."""
    schema = machine_schema()
    parts = schema["$defs"]
    lines = [MACHINE, "## At the top", "", *_table(schema, parts)]
    # a part that may stand at two places is described where it stands first
    headings: dict[str, str] = {}
    for name, heading in _headings(schema, parts, ""):
        headings.setdefault(name, heading)
    for name, heading in headings.items():
        about = str(parts[name].get("description", ""))
        lines += ["", f"## {heading}", "", about, "", *_table(parts[name], parts)]
    return "\n".join([*lines, ""])


def _headings(part: Mapping[str, Any], parts: Mapping[str, Any], path: str) -> Iterator[tuple[str, str]]:
    """Every part below another and where in the file it stands, in the order of its keys."""
    for key, entry in part["properties"].items():
        tables = _tables(entry, f"{path}.{key}" if path else key)
        held = [(name, table) for name, table in tables if "properties" in parts[name]]
        for name, table in held:
            words = re.sub(r"(?<!^)(?=[A-Z])", " ", name).lower()
            yield name, f"`{table}`" if len(held) == 1 else f"`{table}`, {words}"
            yield from _headings(parts[name], parts, table.strip("[]"))


def _tables(entry: Mapping[str, Any], place: str, brackets: str = "[{}]") -> Iterator[tuple[str, str]]:
    """Parts that a key may hold, each with the header of its table."""
    if "$ref" in entry:
        yield entry["$ref"].split("/")[-1], brackets.format(place)
    if "items" in entry:
        yield from _tables(entry["items"], place, "[[{}]]")
    if isinstance(entry.get("additionalProperties"), Mapping):
        yield from _tables(entry["additionalProperties"], f"{place}.NAME")
    for choices in ("anyOf", "oneOf", "allOf"):
        for one in entry.get(choices, ()):
            yield from _tables(one, place, brackets)


def profile_page() -> str:
    """Every key of a profile."""
    schema = Profile.model_json_schema()
    parts = schema["$defs"]
    top = {name: entry for name, entry in schema["properties"].items() if "$ref" not in entry}
    meanings = field_meanings(Profile)
    lines = [PROFILE, "## At the top", "", *_table({"properties": top}, {}, meanings)]
    for name, entry in schema["properties"].items():
        if "$ref" in entry:
            part = parts[entry["$ref"].split("/")[-1]]
            about = meanings.get(name, str(part.get("description", "")))
            lines += ["", f"## `[{name}]`", "", about, "", *_table(part, {})]
    return "\n".join([*lines, ""])


def twelve_numbers() -> str:
    """The numbers of a machine made by ``init --simple``."""
    return "\n".join([*_table(simple_schema(), {}), ""])


def _table(
    part: Mapping[str, Any], kinds: Mapping[str, Any], meanings: Mapping[str, str] | None = None
) -> Iterator[str]:
    yield "| key | for example | meaning |"
    yield "|---|---|---|"
    needed = part.get("required", [])
    for name, entry in part["properties"].items():
        key = f"**`{name}`**" if name in needed else f"`{name}`"
        words = entry.get("description") or (meanings or {}).get(name, "")
        yield f"| {key} | {_example(entry, kinds)} | {_cell(words)} |"


def _example(entry: Mapping[str, Any], kinds: Mapping[str, Any]) -> str:
    """A value as one writes it: of its kind, or the words it may be."""
    for one in (entry, *entry.get("anyOf", ()), *entry.get("allOf", ())):
        kind = str(one.get("$ref", "")).split("/")[-1]
        if f"{kind}_number" in kinds:
            value = kinds[f"{kind}_number"]["examples"][0]
            return f"`{value}`" if isinstance(value, float) else f'`"{value}"`'
        if "examples" in one:
            return f"`{_written(one['examples'][0])}`"
        if "enum" in one:
            return ", ".join(f"`{_written(word)}`" for word in one["enum"])
    return _of_type(entry)


def _of_type(entry: Mapping[str, Any]) -> str:
    types = [entry.get("type"), *(one.get("type") for one in entry.get("anyOf", ()))]
    names = {"string": "text", "integer": "whole number", "number": "number", "boolean": "`true`, `false`"}
    names["array"] = "list"
    return next((names[one] for one in types if isinstance(one, str) and one in names), "table")


def _written(word: object) -> str:
    return f'"{word}"' if isinstance(word, str) else str(word)


def _cell(words: str) -> str:
    return words.replace("``", "`").replace("|", "\\|").replace("\n", " ")
