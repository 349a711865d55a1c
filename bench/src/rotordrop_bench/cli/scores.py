"""Score anybody's estimates, or versions of the program on the corpus."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import text_option
from rotordrop.cli._output import deliver
from rotordrop.errors import ConsistencyError, UsageError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from rotordrop_bench.corpus.table import Quantity, Row

ShortOption = Annotated[bool, Option("--short", help="The 60 cases that end work early and accept nothing.")]


def score(
    estimates: Annotated[
        Path,
        Argument(
            metavar="ESTIMATE",
            help="JSON of 'rotordrop estimate', or a folder with NAME.json for each drop.",
            show_default=False,
        ),
    ],
    truths: Annotated[
        Path, Argument(metavar="TRUTH", help="Truth file, a .json, or folder of them.", show_default=False)
    ],
    drop: Annotated[
        str | None, text_option("NAME", "Which recording of an estimate of several, or its new name.")
    ] = None,
    json: options.Json = None,
) -> None:
    """Compare estimates with the truth of simulated recordings, quantity by quantity and family by family.

    Example: rotordrop-bench score estimates dropbench/truth
    """
    from rotordrop_bench.corpus.run import score_all
    from rotordrop_bench.corpus.table import quantities

    groups, scores = score_all(estimates, truths, drop)
    found = quantities(groups)

    def summarise(out: Console) -> None:
        out.print(_table("Estimates against truth", found))
        _count(out, "all drops", groups["all drops"])
        for name, why in scores.items():
            if isinstance(why, str):
                out.print(f"{name}: no number: {why}")

    deliver({"quantities": [vars(one) for one in found], "drops": scores}, json, summarise)


def corpus_run(
    place: Annotated[
        str, Argument(metavar="VERSION", help="Checkout, or Python with rotordrop.", show_default=False)
    ],
    folder: Annotated[
        Path | None, Option(metavar="FOLDER", help="Where records and answers are.", show_default="cache")
    ] = None,
    name: Annotated[
        str | None, Option(metavar="NAME", help="Name of the version; by default its commit.")
    ] = None,
    short: ShortOption = False,
    json: options.Json = None,
) -> None:
    """Run the corpus with a version of the program.

    Example: rotordrop-bench corpus run .
    """
    from rotordrop_bench.corpus import compare
    from rotordrop_bench.corpus.cases import listed, plan_digest
    from rotordrop_bench.corpus.run import Version, run
    from rotordrop_bench.corpus.table import quantities, write_table

    def keep(so_far: list[Row]) -> None:
        write_table(so_far, plan_digest(), table)
        typer.echo(so_far[-1].case, err=True)

    version = Version.at(place, name)
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = folder or cache / "rotordrop-bench" / "corpus"
    first = {case.name for case in listed(short=True)}
    chosen = sorted(listed(short=short), key=lambda case: case.name not in first)
    table = folder / f"{version.name}{'-short' if short else ''}.csv"
    rows = run(version, chosen, folder, keep)
    write_table(rows, plan_digest(), table)
    groups = {group: [row for row in rows if row.group == group] for group in compare.WRONG}
    found = quantities(groups)

    def summarise(out: Console) -> None:
        out.print(_table("Corpus", found))
        for group, own in groups.items():
            _count(out, group, own)
        out.print(f"alarms on clean records: {percent(compare.share(rows, compare.CLEAN, compare.alarmed))}")
        if missed := compare.missed_faults(rows):
            out.print(f"faults caught: {len(missed) - sum(missed)} of {len(missed)}")
        spent = sum(row.look_seconds + (row.seconds or 0.0) for row in rows)
        out.print(f"processor time: {spent / 60.0:.1f} min; table: {table}")

    deliver({"table": str(table), "quantities": [vars(one) for one in found]}, json, summarise)


def corpus_compare(
    first: Annotated[str, Argument(metavar="TABLE", help="Table of the version before.", show_default=False)],
    second: Annotated[str, Argument(metavar="TABLE", help="That of the version after.", show_default=False)],
    short: ShortOption = False,
    json: options.Json = None,
) -> None:
    """Compare two versions by their tables of the corpus; 7 where a limit is broken.

    Example: rotordrop-bench corpus compare BEFORE.csv AFTER.csv
    """
    from rotordrop_bench.corpus.cases import listed
    from rotordrop_bench.corpus.compare import limits, paired
    from rotordrop_bench.corpus.table import read_table

    wanted = {case.name for case in listed(short=short)}
    both = [pair for pair in paired(read_table(first), read_table(second)) if pair[0].case in wanted]
    if not both:
        raise UsageError(f"{first} and {second} have no record in common; run both on the same ones")
    found = limits(both)
    broken = [one for one in found if not one.kept]

    def summarise(out: Console) -> None:
        shown = new_table(f"{second} against {first}", ("limit",), ("before", "after", "at most", ""))
        for one in found:
            numbers = (f"{number:.4g}" for number in (one.before, one.after, one.most))
            verdict = "kept" if one.kept else "BROKEN" if one.before <= one.most else "BROKEN before too"
            shown.add_row(one.name, *numbers, verdict)
        out.print(shown)
        out.print(
            f"{len(both)} of {len(wanted)} cases in common; limits broken: {len(broken)} of {len(found)}"
        )
        if not broken and (short or len(both) < len(wanted)):
            out.print("Only the whole corpus accepts a version.")

    listing = [vars(one) | {"kept": one.kept} for one in found]
    deliver({"cases": len(both), "kept": not broken, "limits": listing}, json, summarise)
    if broken:
        numbers = (f"{one.name} {one.after:.4g}, at most {one.most:.4g}" for one in broken)
        raise ConsistencyError(f"{second} does not keep every limit against {first}: {'; '.join(numbers)}")


def _table(title: str, quantities: Iterable[Quantity]) -> Table:
    """Table of quantities by group."""
    from rotordrop_bench.corpus.table import SHOWN

    columns = ("values", "missing", "median", "90 %", "worst", "> 10 %", "covered", "± (90 %)", "ranks")
    table, group = new_table(title, ("group", "quantity"), columns), ""
    for one in quantities:
        if one.name in SHOWN:
            shares = (one.median_error, one.ninetieth, one.worst, one.lost, one.covered[0.9], one.half_width)
            ranks = "" if one.unevenness is None else f"{one.unevenness:.2f}"
            where = one.group if one.group != group else ""
            table.add_row(where, one.name, str(one.values), str(one.missing), *map(percent, shares), ranks)
            group = one.group
    return table


def _count(out: Console, group: str, rows: Sequence[Row]) -> None:
    """How many cases were answered, silently wrong, flagged; which departures were named."""
    from rotordrop_bench.corpus.table import answered, flagged, silent

    counts = ", ".join(f"{test.__name__} {sum(map(test, rows))}" for test in (answered, silent, flagged))
    there = sum(len(row.violated) for row in rows)
    named = sum(len({*row.named} & {*row.violated}) for row in rows)
    wrong = sum(bool({*row.named} - {*row.violated}) for row in rows)
    out.print(
        f"{group}: {len(rows)} cases, {counts}; of {there} departures {named} were named, "
        f"and {wrong} estimates name one that was not there"
    )


def new_table(title: str, words: Sequence[str], numbers: Sequence[str]) -> Table:
    """A table with a title, columns of words and, to the right, of numbers."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for column in words:
        table.add_column(column)
    for column in numbers:
        table.add_column(column, justify="right")
    return table


def percent(share: float | None) -> str:
    """Write a share [1] in percent with two digits that count, never with a power of ten."""
    if share is None:
        return ""
    number = 100.0 * share
    if not math.isfinite(number):
        return "– %"
    places = 0 if number == 0.0 else min(max(0, 1 - math.floor(math.log10(abs(number)))), 3)
    return f"{number:.{places}f} %"
