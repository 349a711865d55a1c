"""A report's verdict and numbers for the terminal."""

from __future__ import annotations

import re
from dataclasses import replace
from io import StringIO
from textwrap import shorten
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
GRAVE = ("bad", "warning")
LINES, WIDTH = 17, 100
"""Of what a verb shows first; one more line names the files that it wrote."""
FIRST, OTHERS = 3, 2
"""Lines of the first statement and of another one where not all fit."""


def print_summary(content: ReportContent, console: Console | None = None, *, whole: bool = False) -> None:
    """Print title, verdict, headline numbers and summary tables of a report, by default on standard output.

    What does not fit a screen is shortened or counted, unless the whole is wanted. Colours follow the
    terminal: none with ``NO_COLOR`` set or when the output is not a terminal. Names from files cannot switch
    colours on.
    """
    console = console or summary_console()
    for part in _parts(content, whole=whole):
        console.print(part)


def summary_text(content: ReportContent) -> str:
    """The same as text, 100 columns wide."""
    console = summary_console(out := StringIO())
    console.width = WIDTH
    print_summary(content, console)
    return out.getvalue()


def summary_console(file: IO[str] | None = None) -> Console:
    """A console that obeys ``NO_COLOR`` and writes plain text when its output is not a terminal."""
    from rich.console import Console

    return Console(file=file, highlight=False, markup=False, emoji=False)


def _parts(content: ReportContent, *, whole: bool) -> list[RenderableType]:
    from rich.text import Text

    parts: list[RenderableType] = [Text(_safe(content.title), style="bold")]
    if content.subtitle or content.simulated:
        below = f"{content.subtitle}. " if content.subtitle and content.simulated else content.subtitle
        parts.append(Text.assemble((_safe(below), "dim"), (_safe(content.simulated), "yellow")))
    numbers = [content.screen] if content.screen is not None else []
    if content.cards and not numbers:
        numbers = [card_table(content.cards, _told)]
    verdict, tables = content.verdict, (*numbers, *content.summary)
    if not whole:
        verdict, tables = _fitting(verdict, tables, LINES - sum(map(_height, parts)), content.rest)
    first = [one for k, one in enumerate(verdict) if k == 0 or one.level == "bad"]
    parts.extend(_statement(one) for one in first)
    parts.extend(_table(one) for one in tables[: len(numbers)])
    parts.extend(_statement(one) for one in verdict if one not in first)
    parts.extend(_table(one) for one in tables[len(numbers) :])
    return parts


def _fitting(
    verdict: tuple[Statement, ...], tables: tuple[Table, ...], room: int, rest: str
) -> tuple[tuple[Statement, ...], tuple[Table, ...]]:
    """What of statements and tables fits so many lines, in its order; the last statement counts the rest."""
    numbers = sum(map(_height, map(_table, tables)))
    for lines in (room, FIRST + 1, FIRST):
        whole = tuple(_short(one, lines, rest) for one in verdict)
        if numbers + sum(map(_height, map(_statement, whole))) <= room:
            return whole, tables
    said = [_short(one, FIRST, rest) for one in verdict[:1]]
    others = verdict[len(said) :]
    room -= sum(_height(_statement(one)) for one in said)
    kept = max(1 + sum(one.level in GRAVE for one in others), min(len(others), OTHERS))
    cut: list[Table] = []
    for of_all in tables:
        shown = replace(of_all, rows=of_all.rows[: max(room, 1)])
        while _height(_table(shown)) > room - kept and len(shown.rows) > (not cut):
            shown = replace(shown, rows=shown.rows[:-1])
        if shown.rows:
            room -= _height(_table(shown))
            cut.append(shown)
    rows = sum(len(one.rows) for one in tables) - sum(len(one.rows) for one in cut)
    hidden: list[Statement] = []
    for k, one in enumerate(others, start=1):
        last = k == len(others) and not (hidden or rows)
        left = 99 if one.level == "bad" else room - (not last)  # a problem is told whole
        shorter = (_short(one, lines, rest) for lines in (left if last else OTHERS, 1))
        fits = next((short for short in shorter if _height(_statement(short)) <= left), None)
        if fits is None:
            hidden.append(one)
        else:
            said.append(fits)
            room -= _height(_statement(fits))
    if hidden or rows:
        warnings = sum(one.level in GRAVE for one in hidden)
        some = f" ({warnings} warning{'s' * (warnings > 1)})" if warnings else ""
        of_rows = f"{rows} row{'s' * (rows > 1)} more"
        counted = [f"{len(hidden)} more{some}"] * bool(hidden) + [of_rows] * bool(rows)
        said.append(Statement(f"{' and '.join(counted)} with {rest}"))
    return tuple(said), tuple(cut)


def _short(one: Statement, lines: int, rest: str) -> Statement:
    if one.level == "bad":  # it says the way out
        return one
    plainly = one.text.replace(THIN_SPACE, "")  # which would be taken for a blank
    longest = lines * (WIDTH - len("warning: ")) - len(".")
    return Statement(shorten(plainly, longest, placeholder=f" … ({rest})"), one.level)


def _height(part: RenderableType) -> int:
    """Lines of a terminal."""
    from rich.console import Console

    return len(Console(width=WIDTH, file=StringIO()).render_lines(part, pad=False))


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
    return f"{value}\n{'90 %: ' if cell.interval_90 else ''}{interval}"


def _safe(text: str) -> str:
    """Text without control characters, which a name from a file could use to repaint the terminal.

    Thin spaces between thousands go too: a terminal would break the line there.
    """
    shown = text.replace(THIN_SPACE, "")
    return "".join("\N{REPLACEMENT CHARACTER}" if category(mark).startswith("C") else mark for mark in shown)
