"""Read a machine from its TOML file; every refusal says where and what to do."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rotordrop.document import NestedTomlError, parse_toml
from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.description import LARGEST_FILE, Description, Misfit, UnknownKey
from rotordrop.elements.mount import ELEMENTS
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.machine.machine import Machine
from rotordrop.machine.shaft_table import SECTION_LINE, read_shaft_table
from rotordrop.require import require
from rotordrop.units import KINDS

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
_UNQUOTED = re.compile(r"=\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*([A-Za-zµ°%][^#\"']*?)\s*(#.*)?$")
_BARE = re.compile(r"=\s*((?!true\b|false\b|inf\b|nan\b)[A-Za-z][^#\"']*?)\s*(?:#.*)?$")
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
    file = Path(require(path, "path", str, os.PathLike))
    return _loaded(_text_of(file), file, file.parent)


def _text_of(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise MachineFileError(f"cannot read the machine file: {error.strerror}", file=file) from error
    if len(content) > LARGEST_FILE:
        raise MachineFileError(f"more than {LARGEST_FILE} bytes are no machine file", file=file)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        start = content.rfind(b"\n", 0, error.start) + 1
        raise MachineFileError(
            f"the byte 0x{content[error.start]:02x} is not UTF-8 text; save the machine file as UTF-8",
            file=file,
            line=content.count(b"\n", 0, error.start) + 1,
            column=len(content[start : error.start].decode("utf-8", "replace")) + 1,
        ) from error
    return text.replace("\r\n", "\n")


def loads_machine(text: str, folder: str | os.PathLike[str] = ".") -> Machine:
    """Read a machine from TOML text; a shaft table named in it counts from `folder`."""
    return _loaded(text, None, Path(folder))


def _loaded(text: str, file: Path | None, folder: Path) -> Machine:
    raw = _parsed(text, file)
    positions = TomlPositions(text)
    table = _with_shaft_table(raw, file, folder, positions)
    try:
        machine = Machine.model_validate(raw)
    except ValidationError as error:
        raise refusal(error, positions, file, table) from None
    if file is not None:
        machine._source_path = file  # the one moment before the machine leaves the house
    return machine


def _parsed(text: str, file: Path | None) -> dict[str, Any]:
    lines = text.splitlines()
    try:
        return parse_toml(text)
    except NestedTomlError as error:
        raise MachineFileError(f"{error}; a machine file has a handful", file=file, line=error.line) from None
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(lines or [""], str(error), file) from None
    except ValueError as error:
        told = f"this cannot be a value of a machine: {str(error).partition(';')[0]}"
        longest = lines.index(max(lines, key=len))
        raise MachineFileError(told, file=file, line=longest + 1, column=1) from None


def _syntax_error(lines: list[str], message: str, file: Path | None) -> MachineFileError:
    place = _SYNTAX_PLACE.search(message)
    line = int(place.group(1)) if place and place.group(1) else len(lines)
    column = int(place.group(2)) if place and place.group(2) else len(lines[-1]) + 1
    reason = f"not valid TOML: {_SYNTAX_PLACE.sub('', message)}"
    if comma := _DECIMAL_COMMA.search(lines[min(line, len(lines)) - 1]):
        point, column = f"{comma.group(1)}.{comma.group(2)}", comma.start(1) + 1
        reason = (
            f"{comma.group(1)},{comma.group(2)} has a decimal comma; write {point}, in quotes with its unit, "
            f'as in "{point} mm"'
        )
    elif re.search(r"'\\n'|Unterminated", message):
        reason = "not valid TOML: a text has no quote at its end"
    elif unquoted := _UNQUOTED.search(lines[line - 1]):
        written = f'"{unquoted.group(1)} {unquoted.group(2)}"'
        reason = f"not valid TOML: a value with a unit is a text: write {written} in quotes"
    elif word := _BARE.search(lines[line - 1]):
        reason = f'not valid TOML: a text stands in quotes: write "{word.group(1)}"'
    elif "=" not in lines[0] and lines[0].lstrip()[:1] not in ("#", "[", ""):
        reason += "; if this is a recording: a machine file belongs here, which 'rotordrop init' makes"
    elif (twice := lines[line - 1].partition("=")[0].strip()) and "Cannot overwrite" in message:
        reason, column = f"{twice} stands here for the second time; keep one of the two", 1
    return MachineFileError(reason, file=file, line=line, column=column)


def _with_shaft_table(
    raw: dict[str, Any], file: Path | None, folder: Path, positions: TomlPositions
) -> tuple[Path, list[int]] | None:
    """Put the sections of the shaft table in place of its name; give its path and their lines."""
    rotor = raw.get("rotor")
    if not isinstance(rotor, dict) or "shaft_table" not in rotor:
        return None
    line, column = positions.value(("rotor", "shaft_table")) or (None, None)
    named = rotor.pop("shaft_table")
    both = [key for key in ("sections", "node_positions") if key in rotor]
    told = f"the shaft is given by 'shaft_table' and by {both[0]!r}; keep one of them" if both else ""
    if not isinstance(named, str):
        told = f"shaft_table = {named!r} is not the name of a CSV file"
    if told:
        raise MachineFileError(told, file=file, line=line, column=column)
    try:
        rotor.update(read_shaft_table(folder / named))
    except MachineFileError as error:
        if error.line is not None:
            raise
        told = f"shaft_table = {named!r}: {error.message}"
        raise MachineFileError(told, file=file, line=line, column=column) from error
    return folder / named, [section.pop(SECTION_LINE) for section in rotor["sections"]]


def refusal(
    error: ValidationError, positions: TomlPositions, file: Path | None, table: tuple[Path, list[int]] | None
) -> MachineFileError:
    """All that does not fit in a description, each with its key, the value and what was expected."""
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
    message = _message(entry, place)
    cause = entry.get("ctx", {}).get("error")
    if isinstance(cause, Misfit):
        place = (*place, *cause.place)
    if table is not None and place[:2] == ("rotor", "sections") and len(place) > 2:
        return MachineFileError(
            f"{_dotted(place[2:])}: {message}", file=table[0], line=table[1][int(place[2])]
        )
    if place and place[-1] in ("conformity_inner", "conformity_outer") and not positions.has(place):
        place = (*place[:-1], "conformity")
    if isinstance(cause, UnknownKey):
        message = _of_above(place) or message
    # The key rather than the value is to blame where it is not known, or not there.
    at_key = isinstance(cause, UnknownKey) or (cause is None and entry["type"] == "missing")
    written = positions.written(place)
    line, column = (positions.key(written) if at_key else positions.value(written)) or positions.first
    told = f"{_dotted(written)}: {message}" if place else message
    return MachineFileError(told, file=file, line=line, column=column)


def _message(entry: Any, place: tuple[str | int, ...]) -> str:
    """Say what is wrong."""
    cause, found = entry.get("ctx", {}).get("error"), entry["input"]
    if isinstance(cause, Misfit):
        return cause.message
    if isinstance(cause, UsageError):
        return str(cause)
    if entry["type"] == "missing" and isinstance(place[-1], int):
        return f"one entry is missing; {place[-2]} needs {place[-1] + 1} at least"
    if entry["type"] == "missing":
        kind = _kind_at(place)
        way_out = (
            f'for example {place[-1]} = "{KINDS[kind].example}"' if kind else "'rotordrop init' shows how"
        )
        return f"{place[-1]!r} is missing; add it, {way_out}"
    if cause is not None:
        return str(cause)
    many = "a list" if isinstance(found, list | tuple) else f"{found!r}"
    shown = "a table" if isinstance(found, dict) else many
    expected = _EXPECTED.get(entry["type"]) or entry["msg"].replace("Input should be", "expected")
    return f"{shown} does not fit; {expected}"


def _of_above(place: tuple[str | int, ...]) -> str:
    """Say where a key belongs that a table above its own knows, which has the last header before it."""
    above: list[tuple[str, type[Description]]] = [("the top of the file", Machine)]
    for key in (key for key in place[:-1] if isinstance(key, str)):
        field = above[-1][1].model_fields.get(key)
        described = None if field is None else _description_in(field.annotation)
        above += [] if described is None else [(repr(key), described)]
    for (owner, described), (below, _) in zip(above[-2::-1], above[:0:-1], strict=True):
        if place[-1] in described.model_fields:
            return (
                f"{place[-1]!r} is no key of {above[-1][0]}; it belongs to {owner}: write it above the "
                f"header of the table {below}"
            )
    return ""


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
        import tree_sitter_toml
        from tree_sitter import Language, Parser

        self._keys: dict[Keys, Place] = {}
        self._values: dict[Keys, Place] = {}
        self._counts: dict[Keys, int] = {}
        self._listed: dict[Keys, Keys] = {}
        self.first = (1, 1) if text else (None, None)
        content = text.encode("utf-8")
        self._lines = content.split(b"\n")
        for child in Parser(Language(tree_sitter_toml.language())).parse(content).root_node.children:
            if child.type == "pair":
                self._pair(child, ())
            elif child.type in ("table", "table_array_element"):
                header = next(part for part in child.children if part.is_named)
                path = self._header_path(_key_parts(header), child.type == "table_array_element")
                self._keys.setdefault(path, self._place(header))
                for part in child.children:
                    if part.type == "pair":
                        self._pair(part, path)

    def value(self, path: Keys) -> Place | None:
        """Place of a value, or of the nearest table around it that stands in the file."""
        return self._nearest(path, self._values)

    def key(self, path: Keys) -> Place | None:
        """Place of a key, or of the nearest table around it that stands in the file."""
        return self._nearest(path, self._keys)

    def has(self, path: Keys) -> bool:
        """Tell whether a key stands in the file."""
        return path in self._keys

    def written(self, place: Keys) -> Keys:
        """Place as the file has it, where the elements of a mount are a list."""
        found = ((depth, self._listed.get(place[:depth])) for depth in range(len(place), 0, -1))
        return next(((*at, *place[depth:]) for depth, at in found if at is not None), place)

    def _nearest(self, path: Keys, places: dict[Keys, Place]) -> Place | None:
        for length in range(len(path), 0, -1):
            part = path[:length]
            place = places.get(part) or self._keys.get(part) or self._keys.get((*part, 0))
            if place is not None:
                return place
        return None

    def _header_path(self, parts: list[str], opens_element: bool) -> Keys:
        path: Keys = ()
        for depth, part in enumerate(parts):
            path = (*path, part)
            if opens_element and depth == len(parts) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
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
                pairs = (child for child in element.children if child.type == "pair")
                for key, _, value in (pair.children[:3] for pair in pairs):
                    if key.text == b"kind":  # as `rotordrop.elements.mount.mounted` sorts them
                        kind, at = value.text[1:-1].decode("utf-8"), (*path, index)
                        self._listed[*path, kind] = (*at, "branches") if kind == "maxwell" else at
                        for said in ELEMENTS.get(kind, ()):
                            if self.has((*at, said)):
                                self._listed[*path[:-1], "support", said] = (*at, said)

    def _place(self, node: Any) -> Place:
        row, byte = node.start_point
        return row + 1, len(self._lines[row][:byte].decode("utf-8", "replace")) + 1


def _key_parts(node: Any) -> list[str]:
    if node.type == "dotted_key":
        return [part for child in node.children if child.is_named for part in _key_parts(child)]
    text: str = node.text.decode("utf-8")
    return [text[1:-1] if node.type == "quoted_key" else text]
