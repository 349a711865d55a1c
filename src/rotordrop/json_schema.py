"""The pieces that the published JSON Schemas of documents are put together from."""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"
NUMBER: Schema = {"type": "number"}
MAYBE: Schema = {"type": ["number", "null"]}
COUNT: Schema = {"type": "integer"}
TEXT: Schema = {"type": "string"}
FLAG: Schema = {"type": "boolean"}
TEXTS: Schema = {"type": "array", "items": TEXT}
NUMBERS: Schema = {"type": "array", "items": NUMBER}
PAIR: Schema = {**NUMBERS, "minItems": 2, "maxItems": 2}
MAYBE_PAIR: Schema = {**PAIR, "type": ["array", "null"]}


def closed(optional: Schema | None = None, **needed: Any) -> Schema:
    """An object with these keys, those that must be there, and no other."""
    return {
        "type": "object",
        "properties": {**(optional or {}), **needed},
        "required": list(needed),
        "additionalProperties": False,
    }


def listed(**needed: Any) -> Schema:
    """A list of closed objects."""
    return {"type": "array", "items": closed(**needed)}


def by_name(entry: Schema) -> Schema:
    """An object with any keys and entries of one form."""
    return {"type": "object", "additionalProperties": entry}


def numbers(*names: str) -> Schema:
    """Numbers by these names."""
    return dict.fromkeys(names, NUMBER)
