"""Every table of a report as a CSV file."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

from rotordrop.estimate.histories import SIMULATED_COLUMN
from rotordrop.files import make_folder, write_text
from rotordrop.report.content import Cell, ReportContent, Table
from rotordrop.report.quantity import Quantity


def write_data(content: ReportContent, folder: str | Path) -> list[Path]:
    """Write the tables of a report as CSV into a folder, which is made; give the files.

    Quantities are in SI units, with the ends of their interval where they have one. What comes from a
    simulation has a last column that says so.
    """
    folder = Path(folder)
    make_folder(folder)
    written: list[Path] = []
    for name, table in _tables(content):
        rows = _table(table)
        stem = re.sub(r"[^A-Za-z0-9]+", "_", name.partition(" (")[0]).strip("_").lower()[:60]
        path, k = folder / f"table_{stem}.csv", 2
        while path in written:
            path, k = folder / f"table_{stem}_{k}.csv", k + 1
        if content.simulated:
            rows = [[*row, "yes" if k else SIMULATED_COLUMN] for k, row in enumerate(rows)]
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        write_text(path, text.getvalue())
        written.append(path)
    return written


def _tables(content: ReportContent) -> list[tuple[str, Table]]:
    """Every table with the name of its file."""
    summary = [(table.caption or table.columns[0] or "summary", table) for table in content.summary]
    return summary + [
        (table.caption or section.heading or "table", table)
        for section in content.sections
        for table in section.tables
    ]


def _table(table: Table) -> list[list[str]]:
    """Heading and rows; a column of quantities gets its unit and, where one of them has it, its interval."""
    columns = [_column(head, [row[k] for row in table.rows]) for k, head in enumerate(table.columns)]
    flat = [part for column in columns for part in column]
    return [list(row) for row in zip(*flat, strict=True)]


def _column(head: str, cells: list[Cell]) -> list[list[str]]:
    """One column, or three with the ends of the intervals, heading first."""
    quantities = [cell for cell in cells if isinstance(cell, Quantity)]
    kinds = {cell.kind for cell in quantities}
    unit = f" [{quantities[0].si_unit}]" if len(kinds) == 1 and quantities[0].si_unit else ""
    mixed = len(kinds) > 1

    def text(cell: Cell) -> str:
        if isinstance(cell, str) or cell.value != cell.value:
            return cell if isinstance(cell, str) else ""
        return f"{cell.value:.9g} {cell.si_unit if mixed else ''}".rstrip()

    def end(cell: Cell, k: int) -> str:
        known = cell.interval_90 if isinstance(cell, Quantity) else None
        return "" if known is None else f"{known[k]:.9g}"

    values = [head + unit, *map(text, cells)]
    if not any(cell.interval_90 for cell in quantities):
        return [values]
    ends = []
    for k, name in ((0, "5 %"), (1, "95 %")):
        ends.append([f"{head} {name}{unit}", *(end(cell, k) for cell in cells)])
    return [values, *ends]
