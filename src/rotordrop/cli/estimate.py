"""Estimate bearing force and stress from recorded drops.

Prints the verdict; writes the numbers as JSON and an offline report on request.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import DataOption, JsonOption, MachineArgument, ProfileOption
from rotordrop.cli._output import deliver, progress_bar, require_places
from rotordrop.cli._recordings import require_own_content, require_own_names, tails_of
from rotordrop.errors import ConsistencyError, UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.estimate.estimate import Estimate
    from rotordrop.machine import Machine
    from rotordrop.report.origin import Origin


class Method(StrEnum):
    """How force is found: a model that follows the record, or the paper's open-loop replay."""

    tracked = "tracked"
    replay = "replay"


def estimate(
    machine: MachineArgument,
    records: Annotated[
        list[Path], typer.Argument(metavar="RECORD...", help="Recorded drops of this machine.")
    ],
    tail: Annotated[
        list[Path] | None,
        typer.Option(
            "--tail", metavar="FILE", help="Settled tail: one for all drops, or one for each in order."
        ),
    ] = None,
    method: Annotated[Method, typer.Option("--method", help="How the force is found.")] = Method.tracked,
    fixed: Annotated[
        Path | None,
        typer.Option("--fixed", metavar="FILE", help="Replay: use the support of this earlier estimate."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One pass; for a calibrated machine.")] = False,
    profile: ProfileOption = None,
    tail_profile: Annotated[
        Path | None,
        typer.Option("--tail-profile", metavar="FILE", help="Channel map of the recorder of the tails."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Write the report, one offline HTML file per drop."),
    ] = None,
    since: Annotated[
        Path | None,
        typer.Option("--since", metavar="FILE", help="Earlier estimate (.json), for what changed."),
    ] = None,
    operator: Annotated[str, typer.Option("--operator", metavar="NAME", help="Who, for the report.")] = "",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write force, stress, displacement, ball load against time: .h5, .csv, .mat, .parquet.",
        ),
    ] = None,
    data: DataOption = None,
    json: JsonOption = None,
) -> None:
    """Estimate touchdown-bearing force and stress from recorded drops."""
    from rotordrop.cli.compare import read_estimate
    from rotordrop.estimate.histories import require_format
    from rotordrop.estimation import Replay, Tracked, estimate_drops
    from rotordrop.machine import load_machine
    from rotordrop.record.record import read_record
    from rotordrop.report.origin import origin_here

    if fixed is not None and method is not Method.replay:
        raise UsageError(
            "--fixed belongs to --method replay; the tracked twin uses a calibrated machine file instead."
        )
    description, earlier = load_machine(machine), None if since is None else read_estimate(since)
    require_own_names(records)
    require_own_content(records)
    if quick and method is Method.tracked:
        _require_calibrated(description, machine)
    reports, outputs = _places(report, records), _places(output, records)
    if output is not None:
        require_format(output)
    require_places(json, *reports, *outputs)
    read = [read_record(path, description, profile=profile) for path in records]
    of_tails = tail_profile or profile
    tails = tails_of(tail or [], len(read), lambda path: read_record(path, description, profile=of_tails))
    chosen = Tracked(quick=quick) if method is Method.tracked else Replay(fixed=fixed)
    with progress_bar("estimating") as progress:
        estimates = estimate_drops(description, read, tails, method=chosen, progress=progress)
    folders = _places(data, records)
    for made, place in zip(estimates, outputs, strict=False):
        made.save(place)
    for made, place in zip(estimates, folders, strict=False):
        made.data(place)
    used = [
        ("machine file", machine),
        *(("record", path) for path in records),
        *(("tail", path) for path in tail or []),
        *(() if since is None else (("earlier estimate", since),)),
    ]
    _write(estimates, reports, [*outputs, *folders], json, origin_here(sys.argv[1:], used, operator), earlier)


def _places(named: Path | None, records: Sequence[Path]) -> list[Path]:
    """The file or folder named, or one for each of several records."""
    if named is None:
        return []
    if len(records) == 1:
        return [named]
    return [named.with_name(f"{named.stem}_{record.stem}{named.suffix}") for record in records]


def _require_calibrated(description: Machine, file: Path) -> None:
    from rotordrop.twin.search import is_calibrated

    if not is_calibrated(description):
        raise UsageError(
            f"--quick needs a calibrated machine; supports and contacts of {file.name} are guesses. "
            f"Calibrate it with 'rotordrop calibrate {file.name} RECORD... --output calibrated.toml', "
            "or leave --quick out."
        )


def _write(
    estimates: Sequence[Estimate],
    reports: list[Path],
    others: list[Path],
    json: Path | None,
    origin: Origin,
    since: Mapping[str, Any] | None,
) -> None:
    from rotordrop.estimate.document import combined, estimate_document
    from rotordrop.report.estimate_page import estimate_page, estimate_summary
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary

    whole = bool(reports) or since is not None
    pages = [estimate_page(e, origin, since) if whole else estimate_summary(e, origin) for e in estimates]
    for page, place in zip(pages, reports, strict=False):
        write_page(page, place)

    def summarise(out: Console) -> None:
        for page in pages:
            print_summary(page, out)
        for place in reports:
            out.print(f"Report: {place}")
        for place in others:
            out.print(f"Histories: {place}" if place.suffix else f"Tables and figures: {place}")

    documents = [estimate_document(estimate) for estimate in estimates]
    deliver(combined(documents, [estimate.name for estimate in estimates]), json, summarise)
    beside = [estimate for estimate in estimates if not estimate.consistent]
    if beside:
        names = ", ".join(estimate.name for estimate in beside)
        raise ConsistencyError(f"{names}: {beside[0].sentence}")
