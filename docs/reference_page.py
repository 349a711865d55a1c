"""Write the reference of machine file and profile from their schemas."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rotordrop.machine.schema import field_meanings, machine_schema
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

TITLES = {
    "SpeedDescription": "[speed]",
    "Rotor": "[rotor]",
    "Material": "[rotor.materials.NAME]",
    "SectionByLength": "[[rotor.sections]] by length",
    "SectionByNodes": "[[rotor.sections]] by nodes",
    "Disc": "[[rotor.discs]]",
    "BalanceGrade": "[balance_grade]",
    "Unbalance": "[[unbalances]]",
    "TouchdownBearing": "[[touchdown_bearings]]",
    "BallBearing": "[touchdown_bearings.bearing]",
    "Race": "[touchdown_bearings.race]",
    "Contact": "[touchdown_bearings.contact]",
    "Friction": "[touchdown_bearings.friction]",
    "Support": "[touchdown_bearings.support]",
    "ActiveMagneticBearing": "[[ambs]]",
    "Sensor": "[[sensors]]",
    "CalibrationOrigin": "[calibration]",
    "CalibrationDrop": "[[calibration.drops]]",
}
"""Where in the file each part stands, in the order of the page."""


def machine_page() -> str:
    """Every key of a machine file."""
    schema = machine_schema()
    parts = schema["$defs"]
    kinds = {name: part for name, part in parts.items() if name not in TITLES}
    lines = [MACHINE, "## At the top", "", *_table(schema, kinds)]
    for name, title in TITLES.items():
        lines += [
            "",
            f"## `{title}`",
            "",
            str(parts[name].get("description", "")),
            "",
            *_table(parts[name], kinds),
        ]
    return "\n".join([*lines, ""])


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
        if "enum" in one:
            return ", ".join(f"`{_written(word)}`" for word in one["enum"])
    return _of_type(entry)


def _of_type(entry: Mapping[str, Any]) -> str:
    types = [entry.get("type"), *(one.get("type") for one in entry.get("anyOf", ()))]
    names = {"string": "text", "integer": "whole number", "number": "number", "boolean": "`true`, `false`"}
    return next((names[one] for one in types if isinstance(one, str) and one in names), "table")


def _written(word: object) -> str:
    return f'"{word}"' if isinstance(word, str) else str(word)


def _cell(words: str) -> str:
    return words.replace("``", "`").replace("|", "\\|").replace("\n", " ")
