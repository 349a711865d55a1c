"""Compute many drops and show how force and stress are spread.

A study is one folder: it can be killed, resumed, and worked on by several processes at once.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import DataOption, JsonOption, ThreadsOption
from rotordrop.cli._output import console, deliver, drops_shown, progress_bar, require_places
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rotordrop.study.plan import Study
    from rotordrop.study.summary import StudyResults


class Action(StrEnum):
    """What to do with a study."""

    run = "run"
    show = "show"


def study(
    action: Annotated[
        Action,
        typer.Argument(metavar="ACTION", help="run: compute what is missing; show: show what is there."),
    ],
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
    by: Annotated[
        list[str] | None,
        typer.Option(metavar="VALUE", help='Map the results against a varied value, "speed"; repeat it.'),
    ] = None,
    above: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LIMIT", help='Map the probability to exceed a limit, "peak_stress=1.8 GPa"; repeat it.'
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write all drops as HDF5 (NetCDF4) or .parquet."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the report as one HTML file.")
    ] = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Compute many drops and show how force, stress and whirl are spread."""
    from rotordrop.report.page import write_page
    from rotordrop.report.study_page import study_numbers, study_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.study.run import run_study
    from rotordrop.study.summary import load_results, save_results

    require_places(output, report, json_file)
    if action is Action.show:
        results = load_results(place)
    else:
        planned, home = _opened(place, folder)
        with progress_bar(planned.name) as bar:
            results = run_study(
                planned, home, threads=threads, dask=dask, wait_for_others=not claim, report=drops_shown(bar)
            )
    if not len(results):
        console().print(f"{place}: no drop is finished yet")
        return
    limits = _limits(results, above or ())
    page = study_page(results, by or (), limits)
    if output is not None:
        save_results(results, output)
    if report is not None:
        write_page(page, report)
    if data is not None:
        from rotordrop.report.csv_files import write_data

        write_data(page, data)
    deliver(study_numbers(results, by or (), limits), json_file, lambda out: print_summary(page, out))


def _opened(place: Path, folder: Path | None) -> tuple[Study, Path]:
    from rotordrop.study.folder import study_of
    from rotordrop.study.plan import load_study

    if place.is_dir():
        if folder is not None:
            raise UsageError(f"{place} is the folder of a study already; leave out --folder {folder}")
        return study_of(place), place
    return load_study(place), folder or place.with_suffix("")


def _limits(results: StudyResults, written: Sequence[str]) -> dict[str, float]:
    """Limits [SI] by quantity of a bearing, of texts such as ``"peak_stress=1.8 GPa"``."""
    from rotordrop.elements.description import unknown_key
    from rotordrop.study.quantities import BEARING_QUANTITIES
    from rotordrop.units import parse_quantity

    kinds = {q.name: q.kind for q in BEARING_QUANTITIES}
    found = {}
    for text in written:
        name, equals, limit = text.partition("=")
        if not equals:
            raise UsageError(f'--above {text!r}; expected a quantity and its limit, "peak_stress=1.8 GPa"')
        if name.strip() not in kinds:
            raise UsageError(f"--above: {unknown_key(name.strip(), tuple(kinds))}")
        found[name.strip()] = parse_quantity(limit.strip(), kinds[name.strip()])
    return found
