"""Read a machine from its TOML file; every refusal says where and what to do."""

from __future__ import annotations

import os
import re
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.description import LARGEST_FILE, Description, Misfit, UnknownKey
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.machine.machine import Machine
from rotordrop.machine.shaft_table import SECTION_LINE, read_shaft_table
from rotordrop.units import KINDS

D = TypeVar("D", bound=Description)

_UNION_TAGS = {"by_length", "by_nodes"}
_DECIMAL_COMMA = re.compile(r"=\s*([+-]?\d+),(\d+)(?!\s*\])")
_ALIASES = {**BallBearing.written_as, "grade_mm_s": "grade"}
_EXPECTED = {
    "tuple_type": "expected a list, [[…]] for a list of tables",
    "model_type": "expected a table, {…} or [header]",
    "dict_type": "expected a table of tables",
    "too_short": "at least one entry is needed",
    "missing_argument": "expected two entries",
}
_DEEPEST = 40
"""Brackets or parts of a key inside one another that a machine file can need."""

_SYNTAX_PLACE = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)")


def load_machine(path: str | os.PathLike[str]) -> Machine:
    """Read a machine from a TOML file.

    Parameters
    ----------
    path : path-like
        The machine file; a shaft table named in it counts from its folder.

    Raises
    ------
    MachineFileError
        When the file cannot be used; the message holds file, line, column, the value and the way out.
    """
    file = Path(path)
    return _loaded(_text_of(file, "machine file"), file)


def load_description(kind: type[D], file: Path) -> D:
    """Read a description that is no machine from a TOML file, refused with the same care."""
    text = _text_of(file, "case file")
    raw = _parsed(text, file)
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        raise _located(error, TomlPositions(text), file, None) from None


def _text_of(file: Path, what: str) -> str:
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise MachineFileError(f"cannot read the {what}: {error.strerror}", file=file) from error
    if len(content) > LARGEST_FILE:
        raise MachineFileError(f"more than {LARGEST_FILE} bytes are no {what}", file=file)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        start = content.rfind(b"\n", 0, error.start) + 1
        raise MachineFileError(
            f"the byte 0x{content[error.start]:02x} is not UTF-8 text; save the {what} as UTF-8",
            file=file,
            line=content.count(b"\n", 0, error.start) + 1,
            column=len(content[start : error.start].decode("utf-8", "replace")) + 1,
        ) from error
    return text.replace("\r\n", "\n")


def loads_machine(text: str, folder: str | os.PathLike[str] = ".") -> Machine:
    """Read a machine from TOML text; a shaft table named in it counts from `folder`."""
    return _loaded(text, None, Path(folder))


def _loaded(text: str, file: Path | None, folder: Path | None = None) -> Machine:
    raw = _parsed(text, file)
    positions = TomlPositions(text)
    table = _with_shaft_table(raw, file, folder or (file.parent if file else Path()), positions)
    try:
        machine = Machine.model_validate(raw)
    except ValidationError as error:
        raise _located(error, positions, file, table) from None
    if file is not None:
        machine._source_path = file  # the one moment before the machine leaves the house
    return machine


def _parsed(text: str, file: Path | None) -> dict[str, Any]:
    _refuse_depth(text, file)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(text, str(error), file) from None
    except (ValueError, RecursionError) as error:
        longest = max(text.splitlines(), key=len)
        raise MachineFileError(
            f"this cannot be a value of a machine: {str(error).partition(';')[0]}",
            file=file,
            line=text.splitlines().index(longest) + 1,
            column=1,
        ) from None


def _refuse_depth(text: str, file: Path | None) -> None:
    """Refuse keys and lists nested so deep that only a damaged or hostile file has them."""
    for number, line in enumerate(text.splitlines(), start=1):
        key = re.match(r"[\s\[]*([\w\s.-]*)", line)
        depth = max(line.count("[") - line.count("]"), line.count("{"), key.group(1).count(".") if key else 0)
        if depth > _DEEPEST:
            raise MachineFileError(
                f"{depth} levels inside one another; a machine file has a handful", file=file, line=number
            )


def _syntax_error(text: str, message: str, file: Path | None) -> MachineFileError:
    lines = text.splitlines() or [""]
    place = _SYNTAX_PLACE.search(message)
    line = int(place.group(1)) if place and place.group(1) else len(lines)
    column = int(place.group(2)) if place and place.group(2) else len(lines[-1]) + 1
    comma = _DECIMAL_COMMA.search(lines[min(line, len(lines)) - 1])
    if comma:
        value = f"{comma.group(1)},{comma.group(2)}"
        return MachineFileError(
            f"{value} has a decimal comma; write {value.replace(',', '.')}, in quotes with its unit, "
            f'as in "{value.replace(",", ".")} mm"',
            file=file,
            line=line,
            column=comma.start(1) + 1,
        )
    reason = _SYNTAX_PLACE.sub("", message)
    unquoted = re.search(
        r"=\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*([A-Za-zµ°%][^#\"']*?)\s*(#.*)?$", lines[line - 1]
    )
    if unquoted:
        reason = f'a value with a unit is a text: write "{unquoted.group(1)} {unquoted.group(2)}" in quotes'
    return MachineFileError(f"not valid TOML: {reason}", file=file, line=line, column=column)


def _with_shaft_table(
    raw: dict[str, Any], file: Path | None, folder: Path, positions: TomlPositions
) -> tuple[Path, list[int]] | None:
    """Put the sections of the shaft table in place of its name; give its path and their lines."""
    rotor = raw.get("rotor")
    if not isinstance(rotor, dict) or "shaft_table" not in rotor:
        return None
    place = positions.value(("rotor", "shaft_table")) or (None, None)
    named = rotor.pop("shaft_table")
    if not isinstance(named, str):
        raise MachineFileError(
            f"shaft_table = {named!r} is not the name of a CSV file",
            file=file,
            line=place[0],
            column=place[1],
        )
    both = [key for key in ("sections", "node_positions") if key in rotor]
    if both:
        raise MachineFileError(
            f"the shaft is given by 'shaft_table' and by {both[0]!r}; keep one of them",
            file=file,
            line=place[0],
            column=place[1],
        )
    path = folder / named
    try:
        rotor.update(read_shaft_table(path))
    except MachineFileError as error:
        if error.line is not None:
            raise
        raise MachineFileError(
            f"shaft_table = {named!r}: {error.message}", file=file, line=place[0], column=place[1]
        ) from error
    return path, [section.pop(SECTION_LINE) for section in rotor["sections"]]


def _located(
    error: ValidationError, positions: TomlPositions, file: Path | None, table: tuple[Path, list[int]] | None
) -> MachineFileError:
    entries = error.errors()
    # A list that loses an entry to an error inside it is then called too short; that error is the cause.
    inside = {entry["loc"][:depth] for entry in entries for depth in range(len(entry["loc"]))}
    causes = [entry for entry in entries if entry["type"] != "too_short" or entry["loc"] not in inside]
    found = [_one_error(entry, positions, file, table) for entry in causes]
    found.sort(key=lambda refusal: (refusal.line or 0, refusal.column or 0))
    first = found[0]
    others = "".join(f"\n{text}" for text in dict.fromkeys(map(str, found[1:])) if text != str(first))
    return MachineFileError(first.message + others, file=first.file, line=first.line, column=first.column)


def _one_error(
    entry: Any, positions: TomlPositions, file: Path | None, table: tuple[Path, list[int]] | None
) -> MachineFileError:
    place = tuple(_ALIASES.get(part, part) for part in entry["loc"] if part not in _UNION_TAGS)
    message, at_key = _message(entry, place)
    cause = entry.get("ctx", {}).get("error")
    if isinstance(cause, Misfit):
        place = (*place, *cause.place)
    if table is not None and place[:2] == ("rotor", "sections") and len(place) > 2:
        return MachineFileError(
            f"{_dotted(place[2:])}: {message}", file=table[0], line=table[1][int(place[2])]
        )
    if place and place[-1] in ("conformity_inner", "conformity_outer") and not positions.has(place):
        place = (*place[:-1], "conformity")
    line, column = (positions.key(place) if at_key else positions.value(place)) or (1, 1)
    return MachineFileError(
        f"{_dotted(place)}: {message}" if place else message, file=file, line=line, column=column
    )


def _message(entry: Any, place: tuple[str | int, ...]) -> tuple[str, bool]:
    """Say what is wrong, and whether the key rather than the value is to blame."""
    cause = entry.get("ctx", {}).get("error")
    if isinstance(cause, Misfit):
        return cause.message, isinstance(cause, UnknownKey)
    if isinstance(cause, UsageError):
        return str(cause), False
    if entry["type"] == "missing":
        return _missing(place), True
    if cause is not None:
        return str(cause), False
    found = entry["input"]
    shown = (
        "a table"
        if isinstance(found, dict)
        else "a list"
        if isinstance(found, list | tuple)
        else f"{found!r}"
    )
    return f"{shown} does not fit; {_EXPECTED.get(entry['type']) or _spoken(entry['msg'])}", False


def _missing(place: tuple[str | int, ...]) -> str:
    if isinstance(place[-1], int):
        return f"one entry is missing; {place[-2]} needs {place[-1] + 1} at least"
    kind = _kind_at(place)
    example = f'for example {place[-1]} = "{KINDS[kind].example}"' if kind else "'rotordrop init' shows how"
    return f"{place[-1]!r} is missing; add it, {example}"


def _kind_at(place: tuple[str | int, ...]) -> str | None:
    """Find the kind of quantity a file holds at a place."""
    part: type[Description] = Machine
    for key in (key for key in place[:-1] if isinstance(key, str)):
        inner = _description_in(part.model_fields[key].annotation) if key in part.model_fields else None
        part = inner or part
    name = str(place[-1])
    physical = part.physical(name) if name in part.model_fields else None
    return physical.kind if physical else None


def _description_in(annotation: Any) -> type[Description] | None:
    """Find the description a field holds, one or many of them."""
    if isinstance(annotation, type) and issubclass(annotation, Description):
        return annotation
    inner = (_description_in(argument) for argument in getattr(annotation, "__args__", ()))
    return next((description for description in inner if description is not None), None)


def _spoken(message: str) -> str:
    return message.replace("Input should be", "expected")


def _dotted(place: tuple[str | int, ...]) -> str:
    """Write a place as the file shows it; list entries count from 1."""
    text = ""
    for part in place:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text


Place = tuple[int, int]
Keys = tuple[str | int, ...]


class TomlPositions:
    """Where the keys and values of a TOML text stand; lines and columns count from 1."""

    def __init__(self, text: str) -> None:
        self._keys: dict[Keys, Place] = {}
        self._values: dict[Keys, Place] = {}
        self._counts: dict[Keys, int] = {}
        tree = _parser().parse(text.encode("utf-8"))
        self._lines = text.encode("utf-8").split(b"\n")
        self._document(tree.root_node)

    def value(self, path: Keys) -> Place | None:
        """Place of a value, or of the nearest table around it that stands in the file."""
        return self._nearest(path, self._values)

    def key(self, path: Keys) -> Place | None:
        """Place of a key, or of the nearest table around it that stands in the file."""
        return self._nearest(path, self._keys)

    def has(self, path: Keys) -> bool:
        """Tell whether a key stands in the file."""
        return path in self._keys

    def _nearest(self, path: Keys, places: dict[Keys, Place]) -> Place | None:
        for length in range(len(path), 0, -1):
            part = path[:length]
            place = places.get(part) or self._keys.get(part) or self._keys.get((*part, 0))
            if place is not None:
                return place
        return None

    def _document(self, root: Any) -> None:
        for child in root.children:
            if child.type == "pair":
                self._pair(child, ())
            elif child.type in ("table", "table_array_element"):
                self._table(child)

    def _table(self, node: Any) -> None:
        header = next(child for child in node.children if child.is_named)
        path = self._header_path(_key_parts(header), node.type == "table_array_element")
        self._keys.setdefault(path, self._place(header))
        for child in node.children:
            if child.type == "pair":
                self._pair(child, path)

    def _header_path(self, parts: list[str], opens_element: bool) -> Keys:
        path: Keys = ()
        for depth, part in enumerate(parts):
            path = (*path, part)
            if opens_element and depth == len(parts) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
                return (*path, self._counts[path])
            if path in self._counts:
                path = (*path, self._counts[path])
        return path

    def _pair(self, node: Any, table: Keys) -> None:
        key, value = (child for child in node.children if child.is_named and child.type != "comment")
        path: Keys = (*table, *_key_parts(key))
        self._keys[path] = self._place(key)
        self._value(value, path)

    def _value(self, node: Any, path: Keys) -> None:
        self._values[path] = self._place(node)
        if node.type == "inline_table":
            for child in node.children:
                if child.type == "pair":
                    self._pair(child, path)
        elif node.type == "array":
            elements = [child for child in node.children if child.is_named and child.type != "comment"]
            for index, element in enumerate(elements):
                self._value(element, (*path, index))

    def _place(self, node: Any) -> Place:
        row, byte = node.start_point
        return row + 1, len(self._lines[row][:byte].decode("utf-8", "replace")) + 1


def _key_parts(node: Any) -> list[str]:
    if node.type == "dotted_key":
        return [part for child in node.children if child.is_named for part in _key_parts(child)]
    text: str = node.text.decode("utf-8")
    return [text[1:-1] if node.type == "quoted_key" else text]


@lru_cache(maxsize=1)
def _parser() -> Any:
    import tree_sitter_toml
    from tree_sitter import Language, Parser

    return Parser(Language(tree_sitter_toml.language()))
