"""Every table and every figure of a report as CSV files."""

from __future__ import annotations

import csv
import html
import io
import re
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.estimate.histories import SIMULATED_COLUMN
from rotordrop.files import make_folder, write_text
from rotordrop.report.content import Cell, ReportContent, Table
from rotordrop.report.quantity import Quantity

_SAME = 1e-6
"""Places on the paper that are nearer are the same [1]: they differ by rounding."""


def write_data(content: ReportContent, folder: str | Path) -> list[Path]:
    """Write the tables and figures of a report as CSV into a folder, which is made; give the files.

    Quantities are in SI units, with the ends of their interval where they have one. A figure becomes pairs of
    columns, x and y of every line as it is drawn, headed by the title of its panel where it has one; a
    picture has its value as a third. What comes from a simulation has a last column that says so.
    """
    folder = Path(folder)
    make_folder(folder)
    written: list[Path] = []
    for name, rows in _all(content):
        stem = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").lower()[:60] or "table"
        path, k = folder / f"{stem}.csv", 2
        while path in written:
            path, k = folder / f"{stem}_{k}.csv", k + 1
        if content.simulated:
            rows = [[*row, "yes" if k else SIMULATED_COLUMN] for k, row in enumerate(rows)]
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        write_text(path, text.getvalue())
        written.append(path)
    return written


def _all(content: ReportContent) -> Iterator[tuple[str, list[list[str]]]]:
    for table in content.summary:
        yield f"table {table.caption or table.columns[0] or 'summary'}", _table(table)
    for section in content.sections:
        for table in section.tables:
            yield f"table {table.caption or section.heading}", _table(table)
    for name, chart in content.figures.items():
        rows = _figure(chart)
        if rows:
            yield f"figure {name}", rows


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


def _figure(chart: Any) -> list[list[str]]:
    columns: list[list[str]] = []
    for trace in chart.data:
        if getattr(trace, "x", None) is None or getattr(trace, "y", None) is None:
            continue
        values = {axis: np.asarray(getattr(trace, axis)).ravel() for axis in ("x", "y")}
        if getattr(trace, "z", None) is not None:
            height = np.asarray(trace.z)
            values["x"], values["y"] = (grid.ravel() for grid in np.meshgrid(values["x"], values["y"]))
            values["z"] = height.ravel()
        panel = _panel(chart, trace)
        for axis, along in values.items():
            title = "value" if axis == "z" else _axis_title(chart, trace, axis)
            texts = (f"{v:.9g}" if isinstance(v, int | float | np.number) else str(v) for v in along)
            columns.append([f"{panel}{trace.name or 'line'}: {title}", *texts])
    return [list(row) for row in zip_longest(*columns, fillvalue="")]


def _axis(chart: Any, trace: Any, axis: str) -> Any:
    reference = getattr(trace, f"{axis}axis", None) or axis
    return chart.layout[f"{axis}axis{reference[1:]}"]


def _axis_title(chart: Any, trace: Any, axis: str) -> str:
    """Title with unit; panels of one row or column share one, written at its edge."""
    own = _axis(chart, trace, axis)
    alike = chart.select_xaxes() if axis == "x" else chart.select_yaxes()
    texts = (one.title.text for one in (own, *alike) if one.domain == own.domain)
    return html.unescape(str(next(filter(None, texts), axis)))


def _panel(chart: Any, trace: Any) -> str:
    """Title of the panel that a trace is in, or else of the one above it; empty where it has none."""
    across, up = (_axis(chart, trace, axis).domain for axis in ("x", "y"))
    if across is None or up is None:
        return ""
    above = [
        (note.y, note.text)
        for note in chart.layout.annotations
        if note.xref == note.yref == "paper"
        and note.text
        and abs(note.x - sum(across) / 2.0) < _SAME
        and note.y > up[1] - _SAME
    ]
    return f"{html.unescape(min(above)[1])}: " if above else ""
