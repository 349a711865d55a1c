"""Find the probability of a rare drop, to one in a million.

Reads a study file: its machine, its case and what varies. Subset simulation in independent repeats.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import JsonOption, ThreadsOption
from rotordrop.cli._output import deliver, progress_bar, require_places
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.study.rare import RareEvent


def study_rare(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (.toml).")],
    column: Annotated[
        str, typer.Option(metavar="COLUMN", help='Quantity of a study, such as "NDE.peak_force".')
    ],
    above: Annotated[str, typer.Option(metavar="LIMIT", help='Limit with its unit, such as "12 kN".')],
    samples: Annotated[int, typer.Option(metavar="N", help="Points of a level, a multiple of ten.")] = 500,
    repeats: Annotated[int, typer.Option(metavar="N", help="Independent repeats.")] = 8,
    threads: ThreadsOption = None,
    json: JsonOption = None,
) -> None:
    """Find the probability that a drop exceeds a limit, where that is rare."""
    from rotordrop.elements.description import unknown_key
    from rotordrop.study.plan import load_study
    from rotordrop.study.quantities import columns_of
    from rotordrop.study.rare import rare_drops
    from rotordrop.units import parse_quantity

    require_places(json)
    plan = load_study(study)
    kinds = {q.name: q.kind for q in columns_of(plan.machine)}
    if column not in kinds:
        raise UsageError(unknown_key(column, tuple(kinds)))
    limit = parse_quantity(above, kinds[column])
    with progress_bar(plan.name) as bar:
        found = rare_drops(plan, column, limit, samples=samples, runs=repeats, threads=threads, progress=bar)
    content = {
        "machine": plan.machine.name,
        "digest": plan.digest,
        "column": column,
        "above": limit,
        **asdict(found),
        "sentence": found.sentence(f"{column} above {above}"),
    }
    deliver(content, json, lambda out: _summary(out, found, f"{column} above {above}"))


def _summary(out: Console, found: RareEvent, what: str) -> None:
    out.print(found.sentence(what))
    out.print("The spread is that of the values that vary in the study, not of all that is unknown.")
