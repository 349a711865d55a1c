"""Studies of many drops: run one, show it, repeat a recorded drop."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import file_option, measured, pairs
from rotordrop.cli._output import console, deliver, progress_bar
from rotordrop.errors import UsageError, unknown_key

if TYPE_CHECKING:
    from rotordrop.study.summary import StudyResults

ByOption = Annotated[
    list[str] | None,
    Option("--by", metavar="VALUE", help='Map the results against a varied value, "speed"; repeat it.'),
]
AboveOption = Annotated[
    list[str] | None,
    Option(
        "--above",
        metavar="LIMIT",
        help='Map the probability to exceed a limit, "peak_stress=1.8 GPa"; repeat it.',
    ),
]
DropsOption = Annotated[
    Path | None, file_option("--output", "Write all drops as HDF5 (NetCDF4) or .parquet.", "-o")
]


def study_run(
    place: Annotated[
        Path, Argument(metavar="STUDY", help="Study file (.toml) or the folder of a study that has begun.")
    ],
    folder: Annotated[
        Path | None, Option(metavar="FOLDER", help="Folder of the study; the name of its file by default.")
    ] = None,
    threads: options.Threads = None,
    dask: Annotated[
        str | None,
        Option(metavar="ADDRESS", help='Dask scheduler, "tcp://…", or "local" for a cluster made here.'),
    ] = None,
    by: ByOption = None,
    above: AboveOption = None,
    output: DropsOption = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Compute what is missing of a study and show how force, stress and whirl are spread.

    Example: rotordrop study run study.toml --report study.html
    """
    from rotordrop.study.folder import study_of
    from rotordrop.study.plan import load_study
    from rotordrop.study.run import run_study

    begun = place.is_dir()
    if begun and folder is not None:
        raise UsageError(f"{place} is the folder of a study already; leave out --folder {folder}")
    planned = study_of(place) if begun else load_study(place)
    home = place if begun else folder or place.with_suffix("")
    with progress_bar(planned.name) as bar:
        results = run_study(planned, home, threads=threads, dask=dask, progress=bar)
    _deliver_results(results, place, by or (), above or (), output, report, json)


def study_show(
    place: Annotated[Path, Argument(metavar="STUDY", help="Folder of a study that has begun.")],
    by: ByOption = None,
    above: AboveOption = None,
    output: DropsOption = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Show what is there of a study: how force, stress and whirl are spread.

    Example: rotordrop study show study --by speed
    """
    from rotordrop.study.summary import load_results

    _deliver_results(load_results(place), place, by or (), above or (), output, report, json)


def _deliver_results(
    results: StudyResults,
    place: Path,
    by: Sequence[str],
    above: Sequence[str],
    output: Path | None,
    report: Path | None,
    json: Path | None,
) -> None:
    """Write what was asked for, and print how force, stress and whirl are spread."""
    from rotordrop.report.study_page import study_page
    from rotordrop.study.numbers import study_numbers
    from rotordrop.study.quantities import BEARING_QUANTITIES
    from rotordrop.study.summary import save_results
    from rotordrop.units import parse_quantity

    if results.aside:
        console(sys.stderr).print(
            f"note: {len(results.aside)} damaged shards were computed again; kept aside: "
            f"{', '.join(results.aside)}"
        )
    if not len(results):
        console().print(f"{place}: no drop is finished yet")
        return
    kinds = {q.name: q.kind for q in BEARING_QUANTITIES}
    limits = {}
    for name, limit in pairs(above, 'a quantity and its limit, "peak_stress=1.8 GPa"').items():
        if name not in kinds:
            raise UsageError(f"--above: {unknown_key(name, tuple(kinds))}")
        limits[name] = parse_quantity(limit, kinds[name])
    if output is not None:
        save_results(results, output)
    page = study_page(results, by, limits)
    deliver(study_numbers(results, by, limits), json, page, report=report, written=[output])


def study_repeat(
    machine: options.Machine,
    folder: Annotated[Path, Option(metavar="FOLDER", help="Folder of the simulated drops.")],
    estimate: Annotated[
        Path | None, Argument(metavar="[ESTIMATE]", help="Estimate of the recorded drop (.json).")
    ] = None,
    speed: Annotated[
        float | None, measured("speed", 'Predict at this speed, "210 Hz"; else that of the drop.')
    ] = None,
    drops: Annotated[int, Option(min=options.FEWEST_DROPS, metavar="N", help="Drops to simulate.")] = 500,
    seed: Annotated[int, Option(min=0, metavar="N", help="Key of the random numbers.")] = 1,
    threads: options.Threads = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """See where a recorded drop lies among those that could have happened.

    Example: rotordrop study repeat calibrated.toml drop.json --folder repeats
    """
    from rotordrop.estimate.published import read_drop
    from rotordrop.machine import load_machine
    from rotordrop.report.study_page import repeat_page
    from rotordrop.study.numbers import repeat_numbers
    from rotordrop.study.repeat import recorded_numbers, repeat_study, repeats
    from rotordrop.study.run import run_study

    described = load_machine(machine)
    drop = None if estimate is None else read_drop(estimate)
    if drop is None and speed is None:
        raise UsageError("neither an estimate nor a speed; give one of them, as in --speed '210 Hz'")
    omega = 2.0 * math.pi * drop.speed_Hz if speed is None and drop is not None else speed
    assert omega is not None
    length = 0.2 if drop is None else drop.estimated_until_s
    study = repeat_study(described, omega, duration=length, drops=drops, seed=seed)
    with progress_bar(study.name) as bar:
        results = run_study(study, folder, threads=threads, progress=bar)
    # at another speed the recorded drop is none of these
    recorded = {} if drop is None or speed is not None else recorded_numbers(drop)
    found = repeats(results, recorded)
    deliver(repeat_numbers(results, found), json, repeat_page(results, found), report=report)
