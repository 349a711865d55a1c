"""See what else could have happened at a recorded drop.

With another speed: what the next drop will be, said before it happens.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from rotordrop.cli._options import JsonOption, MachineArgument, ReportOption, ThreadsOption, quantity
from rotordrop.cli._output import deliver, drops_shown, progress_bar, require_places
from rotordrop.errors import UsageError


def study_repeat(
    machine: MachineArgument,
    folder: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder of the simulated drops.")],
    estimate: Annotated[
        Path | None, typer.Argument(metavar="[ESTIMATE]", help="Estimate of the recorded drop (.json).")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            parser=quantity("speed"),
            metavar="SPEED",
            help='Predict at this speed, "210 Hz"; else that of the drop.',
        ),
    ] = None,
    drops: Annotated[int, typer.Option(min=20, metavar="N", help="Drops to simulate.")] = 500,
    worst_of: Annotated[int, typer.Option(min=2, metavar="N", help="Worst of how many drops.")] = 100,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Key of the random numbers.")] = 1,
    threads: ThreadsOption = None,
    report: ReportOption = None,
    json: JsonOption = None,
) -> None:
    """See where a recorded drop lies among those that could have happened."""
    from rotordrop.machine import load_machine
    from rotordrop.report.page import write_page
    from rotordrop.report.repeat_page import repeat_numbers, repeat_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.study.repeat import recorded_numbers, repeat_study, repeats
    from rotordrop.study.run import run_study

    require_places(json, report)
    described = load_machine(machine)
    document = _document(estimate)
    if speed is None and document is None:
        raise UsageError("neither an estimate nor a speed; give one of them, as in --speed '210 Hz'")
    own = document is not None and speed is None
    omega = 2.0 * math.pi * document["speed_Hz"] if document is not None and speed is None else speed
    assert omega is not None
    length = float(document["estimated_until_s"]) if document is not None else 0.2
    study = repeat_study(described, omega, duration=length, drops=drops, seed=seed)
    with progress_bar(study.name) as bar:
        results = run_study(study, folder, threads=threads, report=drops_shown(bar))
    told = recorded_numbers(document) if own and document is not None else {}
    found = repeats(results, told, worst_of=worst_of)
    page = repeat_page(results, found)
    if report is not None:
        write_page(page, report)
    deliver(repeat_numbers(results, found), json, lambda out: print_summary(page, out))


def _document(path: Path | None) -> dict[str, Any] | None:
    from rotordrop.cli.compare import read_estimate
    from rotordrop.study.repeat import recorded_numbers

    if path is None:
        return None
    document = read_estimate(path)
    recorded_numbers(document)  # refuses what is no estimate before hours of drops
    return document
