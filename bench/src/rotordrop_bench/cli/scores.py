"""Score an estimate against the truth of its recording, or many against DropBench."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import text_option
from rotordrop.cli._output import deliver
from rotordrop_bench.cli.drops import FolderArgument, OnlyOption

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

_OF_THE_DROP = {"drop_instant_s": ("drop instant", "time"), "speed_Hz": ("speed", "frequency")}
SHOWN = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N", "air_gap_m", "parameters", "structure")


def score(
    estimate: Annotated[
        Path, Argument(metavar="ESTIMATE", help="JSON of 'rotordrop estimate'.", show_default=False)
    ],
    truth: Annotated[Path, Argument(metavar="TRUTH", help="Truth file, a .json.", show_default=False)],
    drop: Annotated[
        str | None, text_option("NAME", "Which recording of an estimate of several, or its new name.")
    ] = None,
    json: options.Json = None,
) -> None:
    """Compare an estimate with the truth of a simulated recording, quantity by quantity.

    Example: rotordrop-bench score estimate.json truth.json
    """
    from rotordrop.units import format_quantity
    from rotordrop_bench import score_estimate

    scores = score_estimate(estimate, truth, drop=drop)

    def summarise(out: Console) -> None:
        out.print(_scored(scores))
        for name, impacts in scores["impacts"].items():
            above = format_quantity(impacts["above_N"], "force", digits=2)
            text = f"{name}: {impacts['found']} of {impacts['true_impacts']} impacts above {above} found"
            median = impacts["median_absolute_error"]
            out.print(text if median is None else f"{text}, median error of their peaks {percent(median)}")
        held, count = scores["coverage"]["covered"], scores["coverage"]["intervals"]
        words = f"{held} of {count} intervals of 90 % hold the true value."
        out.print(words if count else "The estimate states no interval.")

    deliver(scores, json, summarise)


def _scored(scores: dict[str, Any]) -> Table:
    """Table of one estimate: the drop, then bearing by bearing."""
    from rotordrop.elements.table import published
    from rotordrop.severity.numbers import LOADS
    from rotordrop.units import format_quantity

    named = {field: (row.label, row.kind) for field, row in published().items()}
    named |= {load.field: (load.label, load.kind) for load in LOADS} | _OF_THE_DROP
    table = new_table(f"{scores['name']}: estimate against truth", "quantity", "estimate", "truth", "error")
    table.add_column("90 % interval")
    parts = {"": scores["drop"]} | {f"{name} ": fields for name, fields in scores["bearings"].items()}
    for where, fields in parts.items():
        for path, entry in fields.items():
            words, kind = named[path]
            error = format_quantity(entry["error"], kind, digits=2)
            relative = entry.get("relative_error")
            if relative is not None and path != "drop_instant_s":
                error = f"{error} ({percent(relative, sign=True)})"
            held = {True: "holds", False: "misses", None: ""}[entry.get("covered")]
            width = f" (± {percent(entry['half_width'])})" if "half_width" in entry else ""
            values = (format_quantity(entry[key], kind, digits=4) for key in ("estimate", "truth"))
            table.add_row(f"{where}{words}", *values, error, f"{held}{width}")
    return table


def new_table(title: str, first: str, *others: str) -> Table:
    """A table with a title and columns of numbers after the first."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column(first)
    for column in others:
        table.add_column(column, justify="right")
    return table


def score_all(
    folder: FolderArgument,
    estimates: Annotated[
        Path, Argument(metavar="ESTIMATES", help="Folder with NAME.json for each drop.", show_default=False)
    ],
    only: OnlyOption = None,
    every: Annotated[bool, Option("--all-quantities", help="Also show each parameter by itself.")] = False,
    json: options.Json = None,
) -> None:
    """Score anybody's estimates of the drops of the bench, family by family.

    Example: rotordrop-bench score-all dropbench estimates
    """
    from rotordrop_bench import VERSION, score_bench

    scores = score_bench(folder, estimates, only or [])

    def summarise(out: Console) -> None:
        columns = ("values", "missing", "median", "90 %", "worst", "> 10 %", "covered", "± (90 %)")
        table = new_table(f"DropBench, version {VERSION}", "family", "quantity", *columns)
        table.columns[1].justify = "left"
        family = ""
        for row in scores.rows:
            if not every and row.quantity not in SHOWN:
                continue
            shares = (row.median, row.ninetieth, row.worst, row.lost, row.covered, row.half_width)
            numbers = ("" if share is None else percent(share) for share in shares)
            name = row.family if row.family != family else ""
            table.add_row(name, row.quantity, str(row.values), str(row.missing), *numbers)
            family = row.family
        out.print(table)
        flagged = sum(drop["consistent"] is False for drop in scores.drops)
        out.print(f"Drops: {len(scores.drops)}; estimates that call themselves not consistent: {flagged}.")
        out.print(
            f"Of {scores.departures} departures {scores.named_rightly} were named; "
            f"{scores.named_wrongly} estimates name one that was not there."
        )
        for name, why in scores.unscored.items():
            out.print(f"{name}: no number: {why}")

    deliver({"bench_version": VERSION, **asdict(scores)}, json, summarise)


def percent(share: float, *, sign: bool = False) -> str:
    """Write a share [1] in percent with two digits that count, never with a power of ten.

    Examples
    --------
    >>> from rotordrop_bench.cli.scores import percent
    >>> percent(1.53), percent(0.0231, sign=True)
    ('153 %', '+2.3 %')
    """
    number = 100.0 * share
    if not math.isfinite(number):
        return "– %"
    places = 0 if number == 0.0 else min(max(0, 1 - math.floor(math.log10(abs(number)))), 3)
    return f"{number:{'+' if sign else ''}.{places}f} %"
