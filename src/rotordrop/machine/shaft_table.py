"""Shaft sections from a table: CSV, a spreadsheet, or as other programs print it."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

from rotordrop.elements.description import LARGEST_FILE
from rotordrop.errors import MachineFileError, UsageError, unknown_key
from rotordrop.known import Known
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
_ALIASES = {
    alias: name
    for name, aliases in {
        "length": "l len länge laenge element_length elem_length",
        "position": "z x axial_position location lage",
        "outer_diameter": "od da d outer_dia outside_dia outside_diameter stiffness_od stiff_od diameter "
        "stiffness_outer_diameter aussendurchmesser außendurchmesser",
        "inner_diameter": "id di inner_dia inside_dia inside_diameter stiffness_id stiff_id bore "
        "innendurchmesser",
        "layer_diameter": "mass_od mass_outer_diameter mass_diameter massendurchmesser",
        "layer_density": "mass_density mass_rho",
        "material": "material_name matl mat werkstoff",
        "part": "comment remark description bemerkung",
    }.items()
    for alias in aliases.split()
}
"""What programs and people call a column."""
_NUMBERS = ("ele", "element", "el", "elem", "no", "nr", "station", "sta", "sub", "subele", "mass_id", "layer")
"""Columns that only count or say nothing here; passed over."""
_MASS_DENSITY = 7850.0
"""Density of what a mass diameter adds where the table gives none [kg/m³]: steel."""
_HEADING = re.compile(r"^\s*([^\[\]()]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*$")
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3},\d{3}")

SECTION_LINE = "_line"
"""Key under which a row remembers its line in the table, for error messages."""


def read_shaft_table(path: Path) -> dict[str, Any]:
    """Read shaft sections from a CSV file or a spreadsheet, as a machine file would give them.

    The first line names the columns with their units, such as ``position [mm]``. Either ``position`` says
    where each node lies, the row describing the shaft from there to the next one (the last row holds the end
    only), or ``length`` gives every section its length. Columns may be called as other programs do: ``L``,
    ``OD``, ``ID``, ``Mass OD``; units may stand in brackets or in a row below the names. Without a density,
    what a mass diameter adds is steel.
    """
    lines = (_sheet(path) if path.suffix.lower() in (".xlsx", ".xlsm") else _text(path)).splitlines()
    rows = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and line[0] != "#"]
    if len(rows) < 2:
        raise MachineFileError(
            "the shaft table holds no sections; give a heading and at least one row", file=path
        )
    separator = max(";\t,", key=rows[0][1].count)
    cells = [(number, next(csv.reader([line], delimiter=separator))) for number, line in rows]
    if separator != ",":
        cells = _with_points(cells)
    headings = [text.strip() for text in cells[0][1]]
    if _are_units(cells[1][1]):
        units = [*cells.pop(1)[1], *([""] * len(headings))]
        headings = [
            f"{name} [{_bare(unit)}]" if _bare(unit) else name
            for name, unit in zip(headings, units, strict=False)
        ]
    table = _Table(path, headings, rows[0][0])
    described = [table.row(number, row) for number, row in cells[1:]]
    if table.by_mass_diameter:
        described = [_with_layer(row) for row in described]
    if "position" in table.names:
        return _by_position(described, table)
    if "length" in table.names:
        return {"sections": described}
    raise table.error("the shaft table needs a column 'position [mm]' or 'length [mm]'", rows[0][0])


def _with_points(cells: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """The same rows with points for decimal commas, where no number has a point and commas cannot be those of
    thousands alone.
    """
    numbers = [cell.strip() for _, row in cells for cell in row if _NUMBER.fullmatch(cell.strip())]
    with_comma = [cell for cell in numbers if "," in cell]
    if any("." in cell for cell in numbers) or all(_THOUSANDS.fullmatch(cell) for cell in with_comma):
        return cells
    return [
        (line, [cell.replace(",", ".") if _NUMBER.fullmatch(cell.strip()) else cell for cell in row])
        for line, row in cells
    ]


def _bare(unit: str) -> str:
    return unit.strip().strip("[]()-").strip()


def _are_units(cells: list[str]) -> bool:
    """Whether a row below the names holds units only."""
    said = [_bare(cell) for cell in cells if _bare(cell)]
    return bool(said) and all(
        cell.lower() in ("mm", "m", "cm", "in", "inch", "kg/m^3", "kg/m3", "kg/m³") for cell in said
    )


def _with_layer(row: dict[str, Any]) -> dict[str, Any]:
    """Bring a mass diameter to a layer: none where it is that of the shaft, steel without a density."""
    layer, outer = row.get("layer_diameter"), row.get("outer_diameter")
    if layer is None or outer is None:
        return row
    if abs(layer.value - outer.value) < 1e-9 or layer.value == 0.0:
        return {key: value for key, value in row.items() if key not in ("layer_diameter", "layer_density")}
    return {"layer_density": Known(value=_MASS_DENSITY)} | row


def _sheet(path: Path) -> str:
    """The first sheet of a workbook as text with tabs."""
    try:
        import openpyxl
    except ModuleNotFoundError:
        raise MachineFileError(
            "spreadsheets need a package that is not installed; install rotordrop[io], or save it as CSV",
            file=path,
        ) from None
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    except Exception as error:  # a damaged workbook fails in as many ways as zip and XML can
        raise MachineFileError(f"cannot read the spreadsheet: {error}", file=path) from error
    rows = book.worksheets[0].iter_rows(values_only=True)
    lines = ["\t".join("" if cell is None else str(cell) for cell in row) for row in rows]
    book.close()
    return "\n".join(line.rstrip("\t") for line in lines)


class _Table:
    """Names and units of the columns, and how a row is read with them.

    ``by_mass_diameter`` says that the table gives a mass diameter, as other programs do, in place of a layer.
    """

    def __init__(self, path: Path, headings: list[str], line: int) -> None:
        self.path = path
        self.names: list[str] = []
        self.units: list[str] = []
        self.by_mass_diameter = False
        for column, heading in enumerate(headings):
            match = _HEADING.match(heading)
            name = (match.group(1) if match else heading).strip(" .:,").lower().replace(" ", "_")
            self.by_mass_diameter |= _ALIASES.get(name) == "layer_diameter"
            name = _ALIASES.get(name, name)
            if name not in _COLUMNS and name not in _NUMBERS:
                raise self.error(
                    unknown_key(name, tuple(_COLUMNS)).replace("key", "column", 1), line, column + 1
                )
            unit = (match.group(2) if match else None) or ""
            if _COLUMNS.get(name) is not None and not unit:
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
            if cell.strip() and name in _COLUMNS:
                values[name] = self._cell(name, unit, cell.strip(), number, index + 1)
        return values

    def _cell(self, name: str, unit: str, cell: str, line: int, column: int) -> Any:
        kind = _COLUMNS[name]
        try:
            if kind is not None:
                return Known(value=parse_quantity(f"{cell} {unit}", kind))
            return int(cell) if name == "elements" else cell
        except (UsageError, ValueError) as error:
            raise self.error(f"{name.replace('_', ' ')}: {error}", line, column) from error


def _text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file():
            raise MachineFileError("the shaft table is no plain file; name a CSV file", file=path)
        if path.stat().st_size > LARGEST_FILE:
            raise MachineFileError(f"more than {LARGEST_FILE} bytes are no shaft table", file=path)
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise MachineFileError(
            "the shaft table is not UTF-8 text; save it as CSV UTF-8",
            file=path,
            line=error.object.count(b"\n", 0, error.start) + 1,
        ) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise MachineFileError(
            f"cannot read the shaft table: {reason}; the path counts from the folder of the machine file",
            file=path,
        ) from error


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
    before: dict[str, Any] = {}
    for node, row in enumerate(rows[:-1], start=1):
        shaft = {key: value for key, value in row.items() if key != SECTION_LINE}
        if shaft == before:
            sections[-1]["nodes"][1] = node + 1
        else:
            sections.append(row | {"nodes": [node, node + 1]})
        before = shaft
    return {"node_positions": tuple(positions), "sections": sections}


def _need(row: dict[str, Any], name: str, table: _Table) -> None:
    if name not in row:
        raise table.error(f"the row has no {name.replace('_', ' ')}", row[SECTION_LINE])
