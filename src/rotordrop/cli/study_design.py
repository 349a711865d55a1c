"""Choose supports, gap or preload for the mildest drops.

All candidates meet the same chances; the best are drawn again with fresh ones, which shows what was luck.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import JsonOption, ReportOption, ThreadsOption
from rotordrop.cli._output import deliver, drops_shown, progress_bar, require_places


def study_design(
    plan: Annotated[Path, typer.Argument(metavar="DESIGN", help="Design file (.toml).")],
    folder: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder of the drops; the name of the file by default."),
    ] = None,
    threads: ThreadsOption = None,
    report: ReportOption = None,
    json: JsonOption = None,
) -> None:
    """Choose values of a machine within bounds for the mildest drops."""
    from rotordrop.report.design_page import design_numbers, design_page
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.study.design import best_designs, load_design

    require_places(json, report)
    read = load_design(plan)
    with progress_bar(read.study.name) as bar:
        found = best_designs(read, folder or plan.with_suffix(""), threads=threads, report=drops_shown(bar))
    page = design_page(read, found)
    if report is not None:
        write_page(page, report)
    deliver(design_numbers(read, found), json, lambda out: print_summary(page, out))
