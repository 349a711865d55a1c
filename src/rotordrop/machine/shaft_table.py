"""Shaft sections from a CSV table."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any, NoReturn

from rotordrop.errors import MachineFileError, UsageError
from rotordrop.estimated import Estimated
from rotordrop.machine.description import unknown_key
from rotordrop.units import parse_quantity

_COLUMNS = {
    "position": "length",
    "length": "length",
    "outer_diameter": "length",
    "inner_diameter": "length",
    "layer_diameter": "length",
    "layer_density": "density",
    "elements": None,
    "material": None,
    "part": None,
}
_HEADING = re.compile(r"^\s*([^\[\]()]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*$")


SECTION_LINE = "_line"
"""Key under which a row remembers its line in the table, for error messages."""


def read_shaft_table(path: Path) -> dict[str, Any]:
    """Read shaft sections from a CSV file, as the tables of a machine file would give them.

    The first line names the columns with their units, such as ``position [mm]``. Either ``position`` says
    where each node lies, the row describing the shaft from there to the next one (the last row holds the end
    only), or ``length`` gives every section its length.
    """
    lines = _text(path).splitlines()
    rows = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and line[0] != "#"]
    if len(rows) < 2:
        raise MachineFileError(
            "the shaft table holds no sections; give a heading and at least one row", file=path
        )
    separator = _separator(rows[0][1])
    cells = [(number, next(csv.reader([line], delimiter=separator))) for number, line in rows]
    table = _Table(path, [text.strip() for text in cells[0][1]], rows[0][0])
    described = [table.row(number, row) for number, row in cells[1:]]
    if "position" in table.names:
        return _by_position(described, table)
    if "length" in table.names:
        return {"sections": described}
    raise table.error("the shaft table needs a column 'position [mm]' or 'length [mm]'", rows[0][0])


class _Table:
    """Names and units of the columns, and how a row is read with them."""

    def __init__(self, path: Path, headings: list[str], line: int) -> None:
        self.path = path
        self.names: list[str] = []
        self.units: list[str] = []
        for column, heading in enumerate(headings):
            match = _HEADING.match(heading)
            name = (match.group(1) if match else heading).strip().lower().replace(" ", "_")
            if name not in _COLUMNS:
                raise self.error(
                    unknown_key(name, tuple(_COLUMNS)).replace("key", "column", 1), line, column + 1
                )
            unit = (match.group(2) if match else None) or ""
            if _COLUMNS[name] is not None and not unit:
                raise self.error(
                    f"the column {heading!r} has no unit; write for example '{name.replace('_', ' ')} [mm]'",
                    line,
                )
            self.names.append(name)
            self.units.append(unit)

    def error(self, message: str, line: int, column: int | None = None) -> MachineFileError:
        return MachineFileError(message, file=self.path, line=line, column=column)

    def row(self, number: int, cells: list[str]) -> dict[str, Any]:
        if len(cells) > len(self.names) or (len(cells) < 2 and len(self.names) > 1):
            raise self.error(
                f"the row has {len(cells)} columns, the heading {len(self.names)}; is a decimal comma in it?",
                number,
            )
        values: dict[str, Any] = {SECTION_LINE: number}
        for index, (name, unit, cell) in enumerate(zip(self.names, self.units, cells, strict=False)):
            if cell.strip():
                values[name] = self._cell(name, unit, cell.strip(), number, index + 1)
        return values

    def _cell(self, name: str, unit: str, cell: str, line: int, column: int) -> Any:
        kind = _COLUMNS[name]
        try:
            if kind is not None:
                return Estimated(value=parse_quantity(f"{cell} {unit}", kind))
            return int(cell) if name == "elements" else cell
        except (UsageError, ValueError) as error:
            raise self.error(f"{name.replace('_', ' ')}: {error}", line, column) from error


def _text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file():
            raise MachineFileError("the shaft table is no plain file; name a CSV file", file=path)
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            _refuse_encoding(path, error)
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise MachineFileError(
            f"cannot read the shaft table: {reason}; the path counts from the folder of the machine file",
            file=path,
        ) from error


def _refuse_encoding(path: Path, error: UnicodeDecodeError) -> NoReturn:
    raise MachineFileError(
        "the shaft table is not UTF-8 text; save it as CSV UTF-8",
        file=path,
        line=error.object.count(b"\n", 0, error.start) + 1,
    ) from error


def _separator(heading: str) -> str:
    return max(";\t,", key=heading.count)


def _by_position(rows: list[dict[str, Any]], table: _Table) -> dict[str, Any]:
    for row in rows:
        _need(row, "position", table)
    for row in rows[:-1]:
        _need(row, "outer_diameter", table)
    positions = [row.pop("position").value for row in rows]
    if set(rows[-1]) != {SECTION_LINE}:
        raise table.error(
            "the last row must hold the end of the shaft only, its position", rows[-1][SECTION_LINE]
        )
    sections: list[dict[str, Any]] = []
    for node, row in enumerate(rows[:-1], start=1):
        if sections and _same_shaft(sections[-1], row):
            sections[-1]["nodes"][1] = node + 1
        else:
            sections.append(row | {"nodes": [node, node + 1]})
    return {"node_positions": tuple(positions), "sections": sections}


def _same_shaft(section: dict[str, Any], row: dict[str, Any]) -> bool:
    ignored = {SECTION_LINE, "nodes"}
    return {k: v for k, v in section.items() if k not in ignored} == {
        k: v for k, v in row.items() if k not in ignored
    }


def _need(row: dict[str, Any], name: str, table: _Table) -> None:
    if name not in row:
        raise table.error(f"the row has no {name.replace('_', ' ')}", row[SECTION_LINE])
