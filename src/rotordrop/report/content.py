"""What a report says before it is shown: verdict, headline numbers, sections, and tables as declared."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from rotordrop.report.quantity import Quantity

if TYPE_CHECKING:
    import plotly.graph_objects as go

Level: TypeAlias = Literal["good", "notice", "warning", "bad"]
Cell: TypeAlias = str | Quantity

SIMULATED_RECORD = "Simulated record."
"""What every report on a bundled record says."""


SIMULATED_MACHINE = "Simulated: computed from the machine description; nothing was measured."
"""What every report on a simulation says."""


@dataclass(frozen=True)
class Statement:
    """One sentence the reader can act on, and how serious it is."""

    text: str
    level: Level = "notice"

    @property
    def sentence(self) -> str:
        """The text with a capital at its beginning and a full stop at its end; names keep their letters."""
        first = self.text.partition(" ")[0]
        begun = f"{self.text[:1].upper()}{self.text[1:]}" if first.isalpha() else self.text
        return begun if begun.endswith((".", "!", "?", ":")) or not begun else f"{begun}."


@dataclass(frozen=True)
class KeyFigure:
    """One headline number of a card, with a few words on when or how."""

    label: str
    value: Quantity
    note: str = ""


def fact(label: str, value: object, kind: str, digits: int = 4, note: str = "") -> KeyFigure:
    """A headline number of a value [SI] of a kind."""
    return KeyFigure(label, Quantity.of(value, kind, digits), note)


@dataclass(frozen=True)
class Card:
    """The headline numbers of one bearing."""

    title: str
    figures: tuple[KeyFigure, ...]


class Link(str):
    """A cell that leads to another file, by its address from that of the page."""

    href: str

    def __new__(cls, text: str, href: str) -> Link:
        """Make the cell."""
        made = super().__new__(cls, text)
        made.href = href
        return made


@dataclass(frozen=True)
class Column:
    """One column of a table: its heading, where its value stands in a typed row, and how it is shown."""

    label: str
    value: str | Callable[[Any], object]
    """Name of a field of the row, with dots for a field of a field, or a function of the row."""
    kind: str = ""
    """Kind of quantity; empty for text. What is a quantity or a text already stays as it is."""
    digits: int = 4
    """Significant digits where no interval says how many are meant."""
    optional: bool = False
    """Whether the column is left out where it says nothing of any row."""

    def cell(self, row: object) -> Cell:
        """What the column shows of a row."""
        found = attrgetter(self.value)(row) if isinstance(self.value, str) else self.value(row)
        if isinstance(found, Quantity | str):
            return found
        if not self.kind:
            return str(found)
        return Quantity.of(found, self.kind, self.digits)


@dataclass(frozen=True)
class Table:
    """A table as it is shown on a page, in a terminal and as CSV; cells are text or quantities."""

    columns: tuple[str, ...]
    """Headings."""
    rows: tuple[tuple[Cell, ...], ...]
    """Cells, as many per row as columns."""
    caption: str = ""
    """What the table shows."""
    note: str = ""
    """Small print below, for example the rule behind a statistic."""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(
                    f"table {self.caption!r}: a row has {len(row)} cells for {len(self.columns)} columns: "
                    f"{row!r}; give as many cells as columns"
                )

    def with_units_above(self) -> Table:
        """The same table as it is shown: a unit that all numbers of a column share stands in its heading."""
        heads, columns = [], []
        for k, head in enumerate(self.columns):
            cells = [row[k] for row in self.rows]
            numbers = [cell for cell in cells if isinstance(cell, Quantity)]
            one_kind = len(numbers) > 1 and len({cell.kind for cell in numbers}) == 1
            above = one_kind and numbers[0].kind != "speed" and numbers[0].unit not in ("", "°")
            heads.append(f"{head} [{numbers[0].unit}]" if above else head)
            columns.append(
                [replace(cell, bare=above) if isinstance(cell, Quantity) else cell for cell in cells]
            )
        rows = tuple(zip(*columns, strict=True)) if self.rows else ()
        return Table(tuple(heads), rows, self.caption, self.note)


def verdict_column(status: Callable[[Any], str]) -> Column:
    """What the identification says of a number that is not determined; of one that is, nothing."""

    def said(row: Any) -> str:
        verdict = status(row)
        return "" if verdict == "determined" else verdict

    return Column("verdict", said, optional=True)


def table(rows: Iterable[Any], columns: Sequence[Column], caption: str = "", note: str = "") -> Table:
    """Make a table of typed rows by its declared columns."""
    cells = [[column.cell(row) for column in columns] for row in rows]
    shown = [k for k, column in enumerate(columns) if not column.optional or any(row[k] for row in cells)]
    by_row = tuple(tuple(row[k] for k in shown) for row in cells)
    return Table(tuple(columns[k].label for k in shown), by_row, caption, note)


def card_table(cards: Iterable[Card], told: Callable[[KeyFigure], object]) -> Table:
    """Headline numbers, one column per bearing."""

    def of(card: Card) -> Column:
        values = {figure.label: told(figure) for figure in card.figures}
        return Column(card.title, lambda label: values.get(label, ""))

    labels = dict.fromkeys(figure.label for card in cards for figure in card.figures)
    return table(labels, (Column("", str), *map(of, cards)))


@dataclass(frozen=True)
class Figure:
    """A plotly figure with the sentence that tells what is to be seen in it."""

    chart: go.Figure
    caption: str


@dataclass(frozen=True)
class Section:
    """One part of the report: heading, text, statements, figures, tables, in this order."""

    heading: str
    text: tuple[str, ...] = ()
    statements: tuple[Statement, ...] = ()
    figures: tuple[Figure, ...] = ()
    tables: tuple[Table, ...] = ()
    folded: bool = False
    """Whether a page shows the heading alone until it is opened; what is closed is not printed."""
    printed: bool = False
    """Whether it is printed all the same."""


def appendix(sections: Iterable[Section]) -> tuple[Section, ...]:
    """The same sections folded: what a page holds for whoever asks."""
    return tuple(replace(section, folded=True) for section in sections)


def folded(heading: str, *sections: Section, printed: bool = False) -> Section:
    """One folded part of a page that holds what several sections hold."""
    return Section(
        heading,
        tuple(chain.from_iterable(one.text for one in sections)),
        tuple(dict.fromkeys(chain.from_iterable(one.statements for one in sections))),
        tuple(chain.from_iterable(one.figures for one in sections)),
        tuple(chain.from_iterable(one.tables for one in sections)),
        folded=True,
        printed=printed,
    )


@dataclass(frozen=True, kw_only=True)
class ReportContent:
    """Everything a report says; pages and terminal summaries are made from it alone."""

    title: str
    subtitle: str = ""
    """What was done, to which machine, at which speed."""
    facts: tuple[tuple[str, str], ...] = ()
    """Provenance: machine file, record, method, version."""
    simulated: str = ""
    """Sentence that says the record is simulated; empty for a measured one."""
    verdict: tuple[Statement, ...] = ()
    """The result in sentences, warnings included, most important first."""
    to_do: Section | None = None
    """What follows from the verdict and the leading sections, after them."""
    cards: tuple[Card, ...] = ()
    """Headline numbers per bearing."""
    screen: Table | None = None
    """What a terminal shows in place of the cards, one line a number."""
    rest: str = "--report"
    """The option that shows what a terminal has no room for."""
    summary: tuple[Table, ...] = ()
    """Tables that belong beside the verdict and into the terminal."""
    sections: tuple[Section, ...] = ()
    """Figures and tables."""
    lead: int = 0
    """How many of the sections stand with the headline numbers, before the notes: the first printed page."""
    ends: tuple[str, str] | None = None
    """Names of the first and the last bearing, between which one looks."""
    counted_from: str = "power-off"
    """The instant from which the figures count time."""

    @property
    def grave(self) -> tuple[Statement, ...]:
        """Problems and warnings beside the first statement, which stand with it."""
        return tuple(one for one in self.verdict[1:] if one.level in ("bad", "warning"))

    @property
    def notes(self) -> tuple[Statement, ...]:
        """The others, which stand below the headline numbers."""
        return tuple(one for one in self.verdict[1:] if one.level not in ("bad", "warning"))
