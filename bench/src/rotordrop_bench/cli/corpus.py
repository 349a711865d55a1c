"""Run the corpus with a version, and compare two versions."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._output import deliver
from rotordrop.errors import ConsistencyError, UsageError
from rotordrop_bench.cli.scores import new_table, percent

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop_bench.corpus.table import Row


def corpus(
    what: Annotated[str, Argument(metavar="run|compare", help="Run a version, or compare two tables.")],
    names: Annotated[
        list[str], Argument(metavar="VERSION...", help="Checkout or Python to run; two tables to compare.")
    ],
    folder: Annotated[
        Path | None, Option(metavar="FOLDER", help="Where records and answers are.", show_default="cache")
    ] = None,
    name: Annotated[
        str | None, Option(metavar="NAME", help="Name of the version; by default its commit.")
    ] = None,
    short: Annotated[
        bool, Option("--short", help="The 60 cases that end work early and accept nothing.")
    ] = False,
    json: options.Json = None,
) -> None:
    """Run the corpus with a version, or compare two versions by their tables; 7 where a limit is broken.

    Example: rotordrop-bench corpus run . && rotordrop-bench corpus compare BEFORE.csv AFTER.csv
    """
    if what == "run" and len(names) == 1:
        _run(names[0], folder or _cache(), name, short, json)
    elif what == "compare" and len(names) == 2:
        _compare(names[0], names[1], short, json)
    else:
        raise UsageError("say 'corpus run VERSION' or 'corpus compare TABLE TABLE'")


def _cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rotordrop-bench" / "corpus"


def _run(place: str, folder: Path, name: str | None, short: bool, json: Path | None) -> None:
    from rotordrop_bench.corpus.cases import listed, plan_digest
    from rotordrop_bench.corpus.compare import quantities
    from rotordrop_bench.corpus.run import Version, run
    from rotordrop_bench.corpus.table import kept_table, read_table, write_table

    def keep(so_far: list[Row]) -> None:
        write_table(so_far, plan_digest(), table)
        typer.echo(so_far[-1].case, err=True)

    version = Version.at(place, name)
    chosen = sorted(listed(short=short), key=lambda case: (case.number >= case.plan["short"], case.number))
    table = folder / f"{version.name}{'-short' if short else ''}.csv"
    known = read_table(version.name)[1] if kept_table(version.name).is_file() else []
    rows = run(version, chosen, folder, known, keep)
    write_table(rows, plan_digest(), table)
    found = {"table": str(table), "quantities": [vars(one) for one in quantities(rows)]}
    deliver(found, json, lambda out: _show(out, rows, table))


def _show(out: Console, rows: list[Row], table: Path) -> None:
    from rotordrop_bench.corpus import compare

    shown = new_table("Corpus", "quantity", "values", "50 %", "80 %", "90 %", "error", "half width", "ranks")
    for one in compare.quantities(rows):
        held = [percent(part) for part in (*one.covered.values(), one.median_error, one.half_width)]
        ranks = f"{' '.join(map(str, one.ranks))} ({one.unevenness:.2f})"
        shown.add_row(f"{one.group}: {one.name}", str(one.values), *held, ranks)
    out.print(shown)
    for group in compare.WRONG:
        own = [row for row in rows if row.group == group]
        tests = (compare.answered, compare.silent, compare.flagged)
        counts = ", ".join(f"{test.__name__} {sum(map(test, own))}" for test in tests)
        out.print(f"{group}: {len(own)} cases, {counts}")
    alarms = compare.share(rows, compare.CLEAN, compare.alarmed)
    out.print(f"alarms on clean records: {percent(alarms)}")
    if missed := compare.missed_faults(rows):
        out.print(f"faults caught: {len(missed) - sum(missed)} of {len(missed)}")
    spent = sum(row.look_seconds + (row.seconds or 0.0) for row in rows)
    out.print(f"processor time: {spent / 60.0:.1f} min; table: {table}")


def _compare(first: str, second: str, short: bool, json: Path | None) -> None:
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
        shown = new_table(f"{second} against {first}", "limit", "before", "after", "at most", "")
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
