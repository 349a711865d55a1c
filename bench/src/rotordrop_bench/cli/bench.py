"""Score estimators on a fixed set of simulated drops.

The drops are made on demand and their truth is hidden. Anybody's estimator can be scored: it needs one JSON
file for each drop.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption
from rotordrop.cli._output import deliver, progress_bar

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop_bench import BenchScores


FolderArgument = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Folder of the bench.", show_default=False)
]
OnlyOption = Annotated[
    list[str] | None,
    typer.Option("--only", metavar="NAME", help="A drop, a family or a rotor; repeatable. All by default."),
]


def list_drops(only: OnlyOption = None, json_file: JsonOption = None) -> None:
    """Name the drops of the bench: rotor, speed, family, departures."""
    from rotordrop_bench import VERSION
    from rotordrop_bench.make import chosen_drops

    drops = chosen_drops(only or [])

    def summarise(out: Console) -> None:
        out.print(f"DropBench, version {VERSION}; drops: {len(drops)}")
        for drop in drops:
            kinds = " + ".join(kind for kind, _ in drop.departures)
            out.print(
                f"{drop.name}  {drop.rotor:>6}  {drop.speed:>4g} Hz  {drop.family}"
                + (f": {kinds}" if kinds else "")
                + ("" if drop.sampling_rate == 20e3 else f": {drop.sampling_rate / 1e3:g} kHz"),
                highlight=False,
            )

    deliver({"bench_version": VERSION, "drops": [vars(drop) for drop in drops]}, json_file, summarise)


def make(folder: FolderArgument, only: OnlyOption = None, json_file: JsonOption = None) -> None:
    """Make the drops that are missing in a folder; their truth goes into a folder of its own."""
    from rotordrop_bench import make_bench
    from rotordrop_bench.make import chosen_drops

    with progress_bar("making drops") as report:
        made = make_bench(folder, only or [], report)
    asked = len(chosen_drops(only or []))

    def summarise(out: Console) -> None:
        out.print(f"drops made: {len(made)}, there already: {asked - len(made)} (simulated, not measured)")
        out.print(f"for estimators: {folder / 'drops'}; hidden truth, not for them: {folder / 'truth'}")

    deliver({"made": made, "there": asked - len(made)}, json_file, summarise)


def score_all(
    folder: FolderArgument,
    estimates: Annotated[
        Path,
        typer.Argument(metavar="ESTIMATES", help="Folder with NAME.json for each drop.", show_default=False),
    ],
    only: OnlyOption = None,
    every: Annotated[
        bool, typer.Option("--all-quantities", help="Also show each parameter by itself.")
    ] = False,
    json_file: JsonOption = None,
) -> None:
    """Score anybody's estimates of the drops of the bench, family by family."""
    from rotordrop_bench import score_bench

    scores = score_bench(folder, estimates, only or [])

    def summarise(out: Console) -> None:
        out.print(_table(scores, every))
        flagged = sum(drop["consistent"] is False for drop in scores.drops)
        out.print(f"Drops: {len(scores.drops)}; estimates that call themselves not consistent: {flagged}.")
        out.print(
            f"Of {scores.departures} departures {scores.named_rightly} were named; "
            f"{scores.named_wrongly} estimates name one that was not there."
        )
        for name, why in scores.unscored.items():
            out.print(f"{name}: no number: {why}")

    deliver(scores.as_json(), json_file, summarise)


SHOWN = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N", "air_gap_m", "parameters", "structure")


def _table(scores: BenchScores, every: bool) -> Any:
    from rich import box
    from rich.table import Table

    from rotordrop_bench import VERSION

    table = Table(title=f"DropBench, version {VERSION}", title_justify="left", box=box.SIMPLE_HEAD)
    for column in ("family", "quantity"):
        table.add_column(column)
    for column in ("values", "missing", "median", "90 %", "worst", "> 10 %", "covered", "± (90 %)"):
        table.add_column(column, justify="right")
    family = ""
    for row in scores.rows:
        if not every and row.quantity not in SHOWN:
            continue
        shares = (row.median, row.ninetieth, row.worst, row.lost, row.covered, row.half_width)
        table.add_row(
            row.family if row.family != family else "",
            row.quantity,
            str(row.values),
            str(row.missing),
            *map(_percent, shares),
        )
        family = row.family
    return table


def _percent(share: float | None) -> str:
    from rotordrop_bench.cli.score import percent

    return "" if share is None else percent(share)
