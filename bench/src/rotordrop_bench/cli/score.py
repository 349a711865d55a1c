"""Compare an estimate with the truth of a simulated recording.

Reads truth files of 'rotordrop-bench synthesize' and those that come with the supplied records.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption
from rotordrop.cli._output import deliver

if TYPE_CHECKING:
    from rich.console import Console

_OF_THE_DROP = {"drop_instant_s": ("drop instant", "time"), "speed_Hz": ("speed", "frequency")}


def _words_and_kind(path: str) -> tuple[str, str]:
    """Name for people and kind of quantity of a scored field."""
    from rotordrop.elements.table import LOADS, published

    scored = {field: (row.label, row.kind) for field, row in published().items()}
    scored |= {load.field: (load.label, load.kind) for load in LOADS}
    return (scored | _OF_THE_DROP)[path]


def score(
    estimate: Annotated[
        Path, typer.Argument(metavar="ESTIMATE", help="JSON of 'rotordrop estimate'.", show_default=False)
    ],
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="Truth file, a .json.", show_default=False)],
    drop: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which recording of an estimate of several, or its new name."),
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Compare an estimate with the truth of a simulated recording, quantity by quantity."""
    from rotordrop_bench import score_estimate

    scores = score_estimate(estimate, truth, drop=drop)

    def summarise(out: Console) -> None:
        out.print(_table(scores))
        for name, impacts in scores["impacts"].items():
            out.print(_impact_line(name, impacts))
        coverage = scores["coverage"]
        if coverage["intervals"]:
            out.print(
                f"{coverage['covered']} of {coverage['intervals']} intervals of 90 % hold the true value."
            )
        else:
            out.print("The estimate states no interval.")

    deliver(scores, json_file, summarise)


def _table(scores: dict[str, Any]) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(
        title=f"{scores['name']}: estimate against truth", title_justify="left", box=box.SIMPLE_HEAD
    )
    for column in ("quantity", "estimate", "truth", "error", "90 % interval"):
        table.add_column(column, justify="left" if column in ("quantity", "90 % interval") else "right")
    rows = [("", path, score) for path, score in scores["drop"].items()]
    for name, fields in scores["bearings"].items():
        rows += [(f"{name} ", path, score) for path, score in fields.items()]
    for where, path, entry in rows:
        table.add_row(*_cells(where, path, entry))
    return table


def _cells(where: str, path: str, entry: dict[str, Any]) -> tuple[str, ...]:
    from rotordrop.units import format_quantity

    words, kind = _words_and_kind(path)
    relative = entry.get("relative_error")
    absolute = format_quantity(entry["error"], kind, digits=2)
    error = absolute
    if relative is not None and path != "drop_instant_s":
        error = f"{absolute} ({percent(relative, sign=True)})"
    held = {True: "holds", False: "misses", None: ""}[entry.get("covered")]
    width = f" (± {percent(entry['half_width'])})" if "half_width" in entry else ""
    return (
        f"{where}{words}",
        format_quantity(entry["estimate"], kind, digits=4),
        format_quantity(entry["truth"], kind, digits=4),
        error,
        f"{held}{width}",
    )


def _impact_line(name: str, impacts: dict[str, Any]) -> str:
    median = impacts["median_absolute_error"]
    from rotordrop.units import format_quantity

    above = format_quantity(impacts["above_N"], "force", digits=2)
    text = f"{name}: {impacts['found']} of {impacts['true_impacts']} impacts above {above} found"
    return text if median is None else f"{text}, median error of their peaks {percent(median)}"


def percent(share: float, *, sign: bool = False) -> str:
    """Write a share [1] in percent with two digits that count, never with a power of ten.

    Examples
    --------
    >>> from rotordrop_bench.cli.score import percent
    >>> percent(1.53), percent(0.0231, sign=True)
    ('153 %', '+2.3 %')
    """
    number = 100.0 * share
    if not math.isfinite(number):
        return "– %"
    places = 0 if number == 0.0 else min(max(0, 1 - math.floor(math.log10(abs(number)))), 3)
    return f"{number:{'+' if sign else ''}.{places}f} %"
