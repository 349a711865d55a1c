"""What 'study run' and 'study show' share: their options and how results are delivered."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._output import console, deliver
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.study.summary import StudyResults

ByOption = Annotated[
    list[str] | None,
    typer.Option("--by", metavar="VALUE", help='Map the results against a varied value, "speed"; repeat it.'),
]
AboveOption = Annotated[
    list[str] | None,
    typer.Option(
        "--above",
        metavar="LIMIT",
        help='Map the probability to exceed a limit, "peak_stress=1.8 GPa"; repeat it.',
    ),
]
DropsOption = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="Write all drops as HDF5 (NetCDF4) or .parquet."),
]


def deliver_study(
    results: StudyResults,
    place: Path,
    by: Sequence[str],
    above: Sequence[str],
    *,
    output: Path | None,
    report: Path | None,
    data: Path | None,
    json_file: Path | None,
) -> None:
    """Write what was asked for, and print how force, stress and whirl are spread."""
    from rotordrop.report.page import write_page
    from rotordrop.report.study_page import study_numbers, study_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.study.summary import save_results

    if not len(results):
        console().print(f"{place}: no drop is finished yet")
        return
    limits = _limits(results, above)
    page = study_page(results, by, limits)
    if output is not None:
        save_results(results, output)
    if report is not None:
        write_page(page, report)
    if data is not None:
        from rotordrop.report.csv_files import write_data

        write_data(page, data)
    deliver(study_numbers(results, by, limits), json_file, lambda out: print_summary(page, out))


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
