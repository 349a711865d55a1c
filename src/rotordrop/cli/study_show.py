"""Show what is there of a study.

Computes nothing: others may still be working on it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import DataOption, JsonOption, ReportOption
from rotordrop.cli._output import require_places
from rotordrop.cli._study import AboveOption, ByOption, DropsOption, deliver_study


def study_show(
    place: Annotated[Path, typer.Argument(metavar="STUDY", help="Folder of a study that has begun.")],
    by: ByOption = None,
    above: AboveOption = None,
    output: DropsOption = None,
    report: ReportOption = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Show what is there of a study: how force, stress and whirl are spread."""
    from rotordrop.study.summary import load_results

    require_places(output, report, json_file)
    deliver_study(
        load_results(place),
        place,
        by or (),
        above or (),
        output=output,
        report=report,
        data=data,
        json_file=json_file,
    )
