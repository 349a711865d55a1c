"""A report's verdict and numbers for the terminal."""

from __future__ import annotations

import re
from io import StringIO
from typing import IO, TYPE_CHECKING
from unicodedata import category

from rotordrop.report.content import (
    Cell,
    KeyFigure,
    Level,
    ReportContent,
    Statement,
    Table,
    card_table,
)
from rotordrop.report.quantity import THIN_SPACE, Quantity, one_line

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

MARKS: dict[Level, tuple[str, str]] = {
    "good": ("good", "green"),
    "notice": ("note", "cyan"),
    "warning": ("warning", "yellow"),
    "bad": ("problem", "bold red"),
}


def print_summary(content: ReportContent, console: Console | None = None) -> None:
    """Print title, verdict, headline numbers and summary tables of a report, by default on standard output.

    Colours follow the terminal: none with ``NO_COLOR`` set or when the output is not a terminal. Names from
    files cannot switch colours on.
    """
    console = console or summary_console()
    for part in _parts(content):
        console.print(part)


def summary_text(content: ReportContent) -> str:
    """The same as text, 100 columns wide."""
    console = summary_console(out := StringIO())
    console.width = 100
    print_summary(content, console)
    return out.getvalue()


def summary_console(file: IO[str] | None = None) -> Console:
    """A console that obeys ``NO_COLOR`` and writes plain text when its output is not a terminal."""
    from rich.console import Console

    return Console(file=file, highlight=False, markup=False, emoji=False)


def _parts(content: ReportContent) -> list[RenderableType]:
    from rich.text import Text

    parts: list[RenderableType] = [Text(_safe(content.title), style="bold")]
    if content.subtitle or content.simulated:
        below = f"{content.subtitle}. " if content.subtitle and content.simulated else content.subtitle
        parts.append(Text.assemble((_safe(below), "dim"), (_safe(content.simulated), "yellow")))
    first = [s for s in content.verdict[:1] if s.level != "bad"]
    first += [s for s in content.verdict if s.level == "bad"]
    parts.extend(_statement(statement) for statement in first)
    if content.screen is not None:
        parts.append(_table(content.screen))
    elif content.cards:
        parts.append(_table(card_table(content.cards, _told)))
    parts.extend(_statement(statement) for statement in content.verdict if statement not in first)
    parts.extend(_table(table) for table in content.summary)
    return parts


def _told(figure: KeyFigure) -> str:
    """A number with its interval behind it, and with its time."""
    known = one_line(figure.value)
    return f"{known} {figure.note}" if re.match(r"at [\d.]+ m?s$", figure.note) else known


def _statement(statement: Statement) -> RenderableType:
    from rich.text import Text

    word, style = MARKS[statement.level]
    return Text.assemble((f"{word}: ", style), _safe(statement.sentence))


def _table(table: Table) -> RenderableType:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    drawn = RichTable(
        title=Text(_safe(table.caption)) if table.caption else None,
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        show_edge=False,
    )
    table = table.with_units_above()
    for index, column in enumerate(table.columns):
        numeric = bool(table.rows) and isinstance(table.rows[0][index], Quantity)
        drawn.add_column(Text(_safe(column)), justify="right" if numeric else "left")
    for row in table.rows:
        drawn.add_row(*(Text(_cell(cell)) for cell in row))
    return drawn


def _cell(cell: Cell) -> str:
    if not isinstance(cell, Quantity):
        return _safe(cell)
    value, interval = _safe(cell.levelled), _safe(cell.interval_text)
    if not interval:
        return value
    lines = [value, f"{'90 %: ' if cell.interval_90 else ''}{interval}", _safe(cell.parts_text)]
    return "\n".join(line for line in lines if line)


def _safe(text: str) -> str:
    """Text without control characters, which a name from a file could use to repaint the terminal.

    Thin spaces between thousands go too: a terminal would break the line there.
    """
    shown = text.replace(THIN_SPACE, "")
    return "".join("\N{REPLACEMENT CHARACTER}" if category(mark).startswith("C") else mark for mark in shown)
