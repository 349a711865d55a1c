"""The pieces that the published JSON Schemas of documents are put together from."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"
NUMBER: Schema = {"type": "number"}
TEXT: Schema = {"type": "string"}
PAIR: Schema = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}


def closed(optional: Schema | None = None, **needed: Any) -> Schema:
    """An object with these keys, those that must be there, and no other."""
    return {
        "type": "object",
        "properties": {**(optional or {}), **needed},
        "required": list(needed),
        "additionalProperties": False,
    }


def of_type(kind: Any) -> Schema:
    """What JSON has of a number, text, flag, choice, pair of numbers or texts, perhaps of none."""
    choices = get_args(kind)
    if type(None) in choices:
        made = of_type(next(one for one in choices if one is not type(None)))
        return {**made, "type": [made["type"], "null"]}
    if get_origin(kind) is Literal:
        return {"enum": list(choices)}
    if get_origin(kind) is tuple:
        return {"type": "array", "items": TEXT} if choices[0] is str else PAIR
    return {float: NUMBER, int: NUMBER, str: TEXT, bool: {"type": "boolean"}}[kind]
