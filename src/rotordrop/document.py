"""Documents: types declared once, from which JSON, its JSON Schema and reading back follow."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Self, get_args, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from rotordrop.errors import UsageError
from rotordrop.files import DIGEST, read_sealed, without_digest
from rotordrop.json_schema import closed, of_type
from rotordrop.require import require

ABSENT: Any = None
"""Default of a field that may be left out. It is then not written, and null is refused in its place."""

DEEPEST = 40
"""Brackets or parts of a key inside one another that a file can need (chosen)."""

_LONG_KEY = re.compile(
    r"""(?<![\w."'-])(?:(?:[\w-]++|"[^"]*+"|'[^']*+')\s*+\.\s*+){%d,}""" % (DEEPEST + 1)  # noqa: UP031
)
"""A key of more parts than that, bare or quoted."""

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]

_UNIT = re.compile(r"(_(m|m2|s|kg|N|J|A|H|K|Hz|hz|Pa|rad|per))+$")
"""Unit at the end of a key."""


@dataclass(frozen=True)
class Of:
    """Where a result has what a field states, if not in the attribute of its name without the unit."""

    source: str | Callable[[Any], Any]
    """Attributes with dots between them, or what reads it off."""


class Schema(GenerateJsonSchema):
    """JSON Schema without what a reader of documents has no use for: titles of fields, defaults."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        """The schema of the value alone."""
        return self.generate_inner(schema["schema"])

    def field_title_should_be_set(self, schema: Any) -> bool:
        """No: the key says what the title would."""
        return False


class Document(BaseModel):
    """A frozen part of a document; it refuses unknown keys, NaN, infinity and values of another type."""

    # a number given as text, or a flag as 1, is a document that somebody else wrote
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    def as_json(self) -> dict[str, Any]:
        """The document ready for JSON; what was left out stays out."""
        return self.model_dump(exclude_unset=True)

    @classmethod
    def of_result(cls, result: Any, **given: Any) -> Self:
        """The document of a result: its fields as given, or read off as they say.

        A field with a default is read off only where it has an `Of`, and left out if nothing is there.
        """
        for key, field in cls.model_fields.items():
            said = next((one.source for one in field.metadata if isinstance(one, Of)), None)
            if key not in given and (said is not None or field.is_required()):
                found = _read_off(result, said or without_unit(key))
                if field.is_required() or (found is not None and found != {}):
                    given[key] = _stated(found, field.annotation)
        return cls.model_validate(given)

    @classmethod
    def of(cls, content: Any, place: str, made_by: str) -> Self:
        """The document that a mapping holds.

        Raises
        ------
        UsageError
            If it holds something else; names the place, the first fault in it and who writes such documents.
        """
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise UsageError(f"{place}: {first_fault(error)}. Give a file that '{made_by}' wrote.") from None


def stated(result: Any, keys: str, **given: Any) -> dict[str, Any]:
    """Parts of a result ready for JSON, by keys in their order.

    Each is given, or read off: from the attribute of its name without the unit, or from what follows its "=".
    """
    split = (key.partition("=") for key in keys.split())
    return {
        key: _stated(given[key] if key in given else _read_off(result, source or without_unit(key)))
        for key, _, source in split
    }


def typed(cls: type, keys: str, **given: Any) -> dict[str, Any]:
    """Schema of what `stated` makes of an instance of a class, by the types of fields and properties."""
    split = (key.partition("=") for key in keys.split())
    return closed(
        **{
            key: given[key] if key in given else of_type(_type_at(cls, source or without_unit(key)))
            for key, _, source in split
        }
    )


_hints = cache(get_type_hints)


def _type_at(cls: Any, path: str) -> Any:
    for name in path.split("."):
        own = getattr(cls, name, None)
        cls = _hints(own.fget)["return"] if isinstance(own, property) else _hints(cls)[name]
    return cls


def without_unit(key: str) -> str:
    """The name in a key, ``impact_speed`` of ``impact_speed_m_per_s``."""
    return _UNIT.sub("", key)


def _read_off(result: Any, source: str | Callable[[Any], Any]) -> Any:
    found = attrgetter(source)(result) if isinstance(source, str) else source(result)
    return found() if callable(found) else found


def _stated(found: Any, kind: Any = None) -> Any:
    """A part of a result as JSON has it, what is within it by the document in its type; NaN is None."""
    if isinstance(found, np.ndarray | np.generic):
        found = found.tolist()
    if isinstance(found, Mapping):
        return {name: _stated(one, kind) for name, one in found.items()}
    if isinstance(found, list | tuple):
        return [_stated(one, kind) for one in found]
    if isinstance(found, float):
        return float(found) if math.isfinite(found) else None
    if found is None or isinstance(found, str | int) or (kind and isinstance(found, Document)):
        return found
    return _stated(found.as_json()) if hasattr(found, "as_json") else _document_in(kind).of_result(found)


def _document_in(kind: Any) -> type[Document]:
    """The document in a type such as ``dict[str, Parameter]``."""
    if isinstance(kind, type) and issubclass(kind, Document):
        return kind
    return next(_document_in(one) for one in get_args(kind) if one not in (str, type(None)))


def read_document(path: str | Path) -> dict[str, Any]:
    """The values of a JSON document that a command wrote with ``--json``.

    Raises
    ------
    UsageError
        If there is no such file.
    DamagedFileError
        If it has no digest, or holds other values than were written with it.
    """
    require(path, "path", str, PathLike)
    try:
        return read_sealed(path, "give it as a command wrote it with --json")
    except OSError as fault:
        raise UsageError(
            f"{path} cannot be read ({fault.strerror}); name a file that a command wrote with --json"
        ) from fault


def first_fault(error: ValidationError) -> str:
    """Where the first fault of a document lies, what stands there, and what was expected."""
    fault = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in fault["loc"]) or "the document"
    found = "" if fault["type"] == "missing" else f" is {str(fault['input'])[:60]!r}"
    return f"{where}{found}: {fault['msg']}"


class NestedTomlError(ValueError):
    """TOML with more levels inside one another than a file of ours can have."""

    def __init__(self, depth: int, line: int) -> None:
        super().__init__(f"{depth} levels inside one another")
        self.line = line


def parse_toml(text: str) -> dict[str, Any]:
    """Table in a text of TOML; every reader of TOML comes here.

    Raises
    ------
    ValueError
        If it is no TOML, or nested as only a damaged or hostile file is: the parser needs memory with the
        square of the parts of a key, and no end of its stack.
    """
    for number, line in enumerate(text.splitlines(), start=1):
        key = _LONG_KEY.search(line)
        depth = max(line.count("[") - line.count("]"), line.count("{"), key.group().count(".") if key else 0)
        if depth > DEEPEST:
            raise NestedTomlError(depth, number)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("brackets inside one another without an end") from None


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """The table that a file of the user holds (TOML); ``what`` names its kind in messages.

    Raises
    ------
    UsageError
        If it cannot be read, or is no TOML.
    """
    require(path, "path", str, PathLike)
    try:
        return parse_toml(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UsageError(f"{path}: cannot read the {what} file: {error.strerror}") from error
    except ValueError as error:  # not UTF-8, or no TOML
        raise UsageError(f"{path}: not valid TOML: {error}") from error


def read_json(path: str | Path, made_by: str) -> dict[str, Any]:
    """The object that a JSON file holds, without its digest if it has one.

    Raises
    ------
    UsageError
        If it cannot be read, is no JSON, or holds something else than an object.
    DamagedFileError
        If it holds other values than were written with its digest.
    """
    way_out = f"Give a file that '{made_by}' wrote."
    path = Path(require(path, "path", str, PathLike))
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as fault:
        raise UsageError(f"{path} cannot be read ({fault.strerror}). {way_out}") from fault
    except (ValueError, RecursionError) as fault:
        why = "it is no UTF-8 text" if isinstance(fault, UnicodeDecodeError) else str(fault)
        raise UsageError(f"{path} is not JSON ({why}). {way_out}") from fault
    if not isinstance(content, dict):
        raise UsageError(f"{path} holds a {type(content).__name__}; expected an object. {way_out}")
    if DIGEST not in content:
        return content
    remedy = f"give it as '{made_by}' wrote it, or take its last member {DIGEST!r} out if the change is meant"
    return without_digest(content, str(path), remedy)
