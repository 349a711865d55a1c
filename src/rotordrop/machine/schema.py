"""JSON Schema of a machine file, for editors that check and complete while one types."""

from __future__ import annotations

import ast
import inspect
from typing import Any

from rotordrop.elements.catalog.boundary import CLASSES
from rotordrop.elements.description import Description
from rotordrop.elements.mount import ELEMENTS
from rotordrop.elements.touchdown_bearing import WITHOUT_BALLS
from rotordrop.elements.values import KIND_MARK, STATUSES
from rotordrop.json_schema import DIALECT, TEXT
from rotordrop.known import Known
from rotordrop.machine.machine import Machine
from rotordrop.units import KINDS, format_quantity


def machine_schema() -> dict[str, Any]:
    """Give the JSON Schema (draft 2020-12) of a machine file."""
    schema = Machine.model_json_schema()
    parts = schema["$defs"]
    _describe(schema, Machine)
    for description in _parts(Description):
        if description.__name__ in parts:
            _describe(parts[description.__name__], description)
    _add_shaft_table(parts["Rotor"])
    _add_shorthand(parts)
    _add_bearing_kinds(parts)
    _add_mount_elements(parts)
    kinds: set[str] = set()
    _refer(schema, kinds)
    for kind in sorted(kinds):
        parts[f"{kind}_number"] = _number(kind)
        parts[kind] = _value(kind)
    return {"$schema": DIALECT, "title": "rotordrop machine file", **schema}


def _parts(base: type[Description]) -> list[type[Description]]:
    found: list[type[Description]] = []
    for child in base.__subclasses__():
        found += [child, *_parts(child)]
    return found


def _describe(schema: dict[str, Any], description: type[Description]) -> None:
    """Put the words of the class into its schema: what each key means and what holds when it is left out."""
    schema["description"] = (description.__doc__ or "").split("\n")[0]
    schema.pop("title", None)
    meanings = field_meanings(description)
    for name, entry in schema["properties"].items():
        entry.pop("title", None)
        standing = entry.pop("default", None)
        field = description.model_fields[name]
        said = field.description or ""
        meaning = meanings.get(name, said)
        words = [meaning, said if said.startswith("When left out") and "left out" not in meaning else ""]
        if isinstance(field.default, Known) and field.default.value == field.default.value:
            physical = description.physical(name)
            value = format_quantity(field.default.value, physical.kind if physical else "dimensionless")
            words = [meaning, f"Default {value}: {field.default.source}"]
        elif isinstance(standing, str | int | float | bool) and standing not in ("", "-", 0):
            entry["default"] = standing
        entry["description"] = ". ".join(word.rstrip(".") for word in words if word)


def field_meanings(kind: type) -> dict[str, str]:
    """What stands beneath each field of a class; beneath the last of several, it holds for all of them."""
    found: dict[str, str] = {}
    for part in reversed(kind.__mro__):
        if part.__module__.partition(".")[0] != "rotordrop":
            continue
        (described,) = ast.parse(inspect.getsource(part)).body
        fields: list[str] = []
        for statement in getattr(described, "body", []):
            match statement:
                case ast.AnnAssign(target=ast.Name(id=name)):
                    fields.append(name)
                case ast.Expr(value=ast.Constant(value=str(words))):
                    found |= dict.fromkeys(fields, " ".join(words.split()))
                    fields = []
    return found


def _refer(node: Any, kinds: set[str]) -> None:
    """Let every physical value refer to the one description of its kind."""
    if isinstance(node, list):
        for entry in node:
            _refer(entry, kinds)
    elif isinstance(node, dict):
        choices = node.get("anyOf")
        if isinstance(choices, list) and {"type": "null"} in choices:
            choices.remove({"type": "null"})  # a TOML file leaves out what it does not give; it has no null
            if len(choices) == 1:
                node.update(node.pop("anyOf")[0])
        kind = node.pop(KIND_MARK, None)
        if kind is not None:
            kinds.add(kind)
            node["$ref"] = f"#/$defs/{kind}"
        for entry in node.values():
            _refer(entry, kinds)


RANGE = "Holds the value with 90 % probability; the guess need not be its middle"


def _number(kind: str) -> dict[str, Any]:
    if not KINDS[kind].unit:
        return {"type": ["number", "string"], "examples": [float(KINDS[kind].example)]}
    return {"type": "string", "examples": [KINDS[kind].example], "pattern": r"^\s*[+-]?[\d.]"}


def _value(kind: str) -> dict[str, Any]:
    """Describe a number with unit, a guess with range, or an estimate with interval and source."""
    number = {"$ref": f"#/$defs/{kind}_number"}
    pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
    guess: dict[str, Any] = {
        "guess": {"description": "Where a search begins, and what a simulation takes", "allOf": [number]},
        "range": {**pair, "description": RANGE},
        "lower": number,
        "upper": number,
        "source": TEXT,
    }
    known: dict[str, Any] = {"value": number, "interval": pair, "standard_error": number, "range": pair}
    known |= {"lower": number, "upper": number, "source": TEXT, "status": {"enum": list(STATUSES)}}
    return {
        "description": f"{kind.replace('_', ' ')}, for example {KINDS[kind].example}",
        "anyOf": [
            number,
            {"type": "object", "properties": guess, "required": ["guess"], "additionalProperties": False},
            {"type": "object", "properties": known, "required": ["value"], "additionalProperties": False},
        ],
    }


def _add_shaft_table(rotor: dict[str, Any]) -> None:
    words = "CSV file with the shaft, in place of 'sections'"
    rotor["properties"]["shaft_table"] = TEXT | {"description": words}
    rotor["required"] = [key for key in rotor.get("required", []) if key != "sections"]
    rotor["oneOf"] = [{"required": ["sections"]}, {"required": ["shaft_table"]}]
    table = {
        "type": "object",
        "properties": {"unit": TEXT, "values": {"type": "array", "items": {"type": "number"}}},
        "required": ["unit", "values"],
        "additionalProperties": False,
    }
    rotor["properties"]["node_positions"] = {
        "description": "Position of every node, for sections given by nodes",
        "anyOf": [{"type": "array", "items": {KIND_MARK: "length"}}, table],
    }


def _add_bearing_kinds(parts: dict[str, Any]) -> None:
    """Let the kind of a touchdown bearing say what its table 'bearing' holds; without balls it may lack."""
    bearing = parts["TouchdownBearing"]
    choices = bearing["properties"]["bearing"]
    balls = {"$ref": choices.pop("$ref")}
    choices["anyOf"] = [balls]
    bearing["required"].remove("bearing")
    others = {"required": ["kind"], "properties": {"kind": {"enum": list(WITHOUT_BALLS)}}}
    bearing["allOf"] = [{"if": others, "else": {"required": ["bearing"], "properties": {"bearing": balls}}}]
    for name, kind in WITHOUT_BALLS.items():
        parts[kind.__name__] = kind.model_json_schema()
        _describe(parts[kind.__name__], kind)
        inside = {"$ref": f"#/$defs/{kind.__name__}"}
        choices["anyOf"].append(inside)
        named = {"required": ["kind"], "properties": {"kind": {"const": name}}}
        bearing["allOf"].append({"if": named, "then": {"properties": {"bearing": inside}}})


PLAIN_SPRING = "Plain spring and damper of the support, such as the elastic part of a ribbon"


def _add_mount_elements(parts: dict[str, Any]) -> None:
    """Let a mount be a list of elements in parallel, as files write it."""
    held, support = parts["Mount"]["properties"], parts["Support"]["properties"]
    elements = []
    for kind, of_support in ELEMENTS.items():
        part: dict[str, Any] = {"properties": {}}
        if kind == "maxwell":
            part = {"properties": {"branches": held[kind] | {"minItems": 1}}, "required": ["branches"]}
        elif kind in held:
            part = parts[kind.capitalize()]
        about = part.get("description", held.get(kind, {"description": PLAIN_SPRING})["description"])
        name = f"{kind.capitalize()}Element"
        elements.append({"$ref": f"#/$defs/{name}"})
        parts[name] = {
            "type": "object",
            "description": f"An element of a mount, in parallel to the others. {about}",
            "properties": {
                "kind": {"enum": [kind], "description": "What it is"},
                **{key: dict(entry) for key, entry in part["properties"].items()},
                **{
                    key: support[key]
                    | {"description": f"{PLAIN_SPRING}; stands for {key!r} of the table 'support'"}
                    for key in of_support
                },
            },
            "required": ["kind", *part.get("required", [])],
            "additionalProperties": False,
        }
    mount = parts["TouchdownBearing"]["properties"]["mount"]
    table = {"$ref": mount.pop("$ref")}
    mount["anyOf"] = [{"type": "array", "items": {"oneOf": elements}}, table]


def _add_shorthand(parts: dict[str, Any]) -> None:
    """Describe what the file writes in another way than the description holds it."""
    grade = parts["BalanceGrade"]
    described = grade["properties"].pop("grade_mm_s")["description"]
    grade["properties"]["grade"] = {"type": ["string", "number"], "description": described}
    grade["required"] = ["grade", "at_speed"]
    bearing = parts["BallBearing"]["properties"]
    del bearing["preload_class"]
    bearing["preload"] = {
        "description": bearing["preload"]["description"],
        "anyOf": [{"enum": ["light", "medium", "heavy"]}, {KIND_MARK: "force"}],
    }
    del bearing["clearance_class"]
    bearing["clearance"] = {
        "description": bearing["clearance"]["description"],
        "anyOf": [{"enum": list(CLASSES)}, {KIND_MARK: "length"}],
    }
    bearing["rows"] = {"description": "Rows of balls, 1 or 2, where no arrangement is given", "enum": [1, 2]}
    bearing["conformity"] = {"description": "Conformity of both races", KIND_MARK: "dimensionless"}
    load = parts["Load"]["properties"]
    del load["along"]
    load["direction"] = {
        "description": load["direction"]["description"],
        "anyOf": [{"enum": ["axial", "-axial"]}, {KIND_MARK: "angle"}],
    }
    parts["Load"]["required"] = [*parts["Load"].get("required", []), "direction"]
    for name in ("Disc", "Unbalance", "TouchdownBearing", "ActiveMagneticBearing", "Sensor"):
        part = parts[name]
        part["oneOf"] = [{"required": ["node"]}, {"required": ["position"]}]
        part["properties"]["node"]["minimum"] = 1
        part["required"] = [key for key in part.get("required", []) if key != "node"]
