"""Compute many drops and show how they are spread.

A study is one folder: it can be killed, resumed, and worked on by several processes at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import DataOption, JsonOption, ReportOption, ThreadsOption
from rotordrop.cli._output import drops_shown, progress_bar, require_places
from rotordrop.cli._study import AboveOption, ByOption, DropsOption, deliver_study
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.study.plan import Study


def study_run(
    place: Annotated[
        Path,
        typer.Argument(metavar="STUDY", help="Study file (.toml) or the folder of a study that has begun."),
    ],
    folder: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder of the study; the name of its file by default."),
    ] = None,
    threads: ThreadsOption = None,
    claim: Annotated[
        bool,
        typer.Option(
            "--claim", help="Help with a study that others work on: stop when nothing is left to claim."
        ),
    ] = False,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help='Dask scheduler, "tcp://…", or "local" for a cluster made here.'
        ),
    ] = None,
    by: ByOption = None,
    above: AboveOption = None,
    output: DropsOption = None,
    report: ReportOption = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Compute what is missing of a study and show how force, stress and whirl are spread."""
    from rotordrop.study.run import run_study

    require_places(output, report, json_file)
    planned, home = _opened(place, folder)
    with progress_bar(planned.name) as bar:
        results = run_study(
            planned, home, threads=threads, dask=dask, wait_for_others=not claim, report=drops_shown(bar)
        )
    deliver_study(
        results, place, by or (), above or (), output=output, report=report, data=data, json_file=json_file
    )


def _opened(place: Path, folder: Path | None) -> tuple[Study, Path]:
    from rotordrop.study.folder import study_of
    from rotordrop.study.plan import load_study

    if place.is_dir():
        if folder is not None:
            raise UsageError(f"{place} is the folder of a study already; leave out --folder {folder}")
        return study_of(place), place
    return load_study(place), folder or place.with_suffix("")
