"""Estimate bearing force and stress from recorded drops.

Prints the verdict; writes the numbers as JSON and an offline report on request.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption, MachineArgument
from rotordrop.cli._output import deliver, progress_bar, require_places
from rotordrop.cli._recordings import require_own_content, require_own_names, tails_of
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.machine import Machine
    from rotordrop.measurement.quality.finding import Finding
    from rotordrop.measurement.record import Record
    from rotordrop.report.content import ReportContent


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
    profile: Annotated[
        Path | None, typer.Option("--profile", metavar="FILE", help="Channel map of the recorder.")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Write the report, one offline HTML file per drop."),
    ] = None,
    json: JsonOption = None,
) -> None:
    """Estimate touchdown-bearing force and stress from recorded drops."""
    from rotordrop.machine import load_machine
    from rotordrop.measurement.quality import check_record
    from rotordrop.measurement.quality.finding import refuse_unusable
    from rotordrop.measurement.record import read_record

    if fixed is not None and method is not Method.replay:
        raise UsageError(
            "--fixed belongs to --method replay; the tracked twin uses a calibrated machine file instead."
        )
    description = load_machine(machine)
    require_own_names(records)
    require_own_content(records)
    if quick and method is Method.tracked:
        _require_calibrated(description, machine)
    reports = _report_places(report, records)
    require_places(json, *reports)
    read = [read_record(path, description, profile=profile) for path in records]
    tails = tails_of(tail or [], len(read), lambda path: read_record(path, description, profile=profile))
    findings = [check_record(r, description, t) for r, t in zip(read, tails, strict=True)]
    for record, found in zip(read, findings, strict=True):
        refuse_unusable(found, record.name)
    with progress_bar("estimating") as progress:
        if method is Method.tracked:
            documents, pages = _tracked(description, read, tails, findings, quick, progress)
        else:
            documents, pages = _replayed(description, read, tails, findings, fixed, progress)
    _write(description, documents, pages, reports, json)


def _report_places(report: Path | None, records: Sequence[Path]) -> list[Path]:
    if report is None:
        return []
    if len(records) == 1:
        return [report]
    return [report.with_name(f"{report.stem}_{record.stem}{report.suffix}") for record in records]


def _require_calibrated(description: Machine, file: Path) -> None:
    from rotordrop.estimation.tracked import is_calibrated

    if not is_calibrated(description):
        raise UsageError(
            f"--quick needs a calibrated machine; supports and contacts of {file.name} are guesses. "
            f"Calibrate it with 'rotordrop calibrate {file.name} RECORD... --output calibrated.toml', "
            "or leave --quick out."
        )


def _warnings(findings: Sequence[Finding], tail: Record | None, notes: Sequence[str] = ()) -> list[str]:
    """Collect what record, tail and method warn of, each said once; the notes are those of the method."""
    words = [finding.message for finding in findings if finding.severity == "warning"]
    if tail is None:
        words.append(
            "no settled tail: the air gap rests on its prior and on the contacts; give one with --tail"
        )
    return list(dict.fromkeys((*words, *notes)))


COUNTED_TWICE = (
    "the machine was calibrated on a drop named {}: if it is this one, its readings count twice and the "
    "intervals are too narrow; use the machine file from before the calibration for it"
)


def _tracked(
    machine: Machine,
    records: list[Record],
    tails: list[Record | None],
    findings: Sequence[Sequence[Finding]],
    quick: bool,
    progress: Any,
) -> tuple[dict[str, dict[str, Any]], dict[str, ReportContent]]:
    from rotordrop.estimation.calibrated import calibrated_on
    from rotordrop.estimation.document import tracked_document
    from rotordrop.estimation.tracked import estimate_tracked, settled_tail
    from rotordrop.report.estimate_page import tracked_page
    from rotordrop.report.simulated_record import simulated_notice
    from rotordrop.report.twin_cross_check import twin_cross_checks

    drops = estimate_tracked(machine, records, tails, quick=quick, progress=progress)
    documents, pages = {}, {}
    for drop, found, tail in zip(drops, findings, tails, strict=True):
        checks = () if quick and drop.cross_check is None else twin_cross_checks(drop)
        words = _warnings(found, settled_tail(drop.record, tail), drop.drop_instant.notes)
        if drop.name in calibrated_on(machine):
            words.append(COUNTED_TWICE.format(drop.name))
        documents[drop.name] = tracked_document(drop, machine, words)
        documents[drop.name]["simulated_record"] = bool(simulated_notice(drop.record))
        documents[drop.name]["cross_check"] = [
            {
                "name": check.name,
                "estimate": check.estimate.value,
                "cross_check": check.check.value,
                "known_relative_accuracy": check.accuracy,
                "agrees": check.agrees,
            }
            for check in checks
        ]
        pages[drop.name] = tracked_page(
            drop, machine, findings=found, cross_checks=checks, warnings=words, quick=quick
        )
    return documents, pages


def _replayed(
    machine: Machine,
    records: list[Record],
    tails: list[Record | None],
    findings: Sequence[Sequence[Finding]],
    fixed: Path | None,
    progress: Any,
) -> tuple[dict[str, dict[str, Any]], dict[str, ReportContent]]:
    from rotordrop.estimation.replay import replay_document, replay_drop
    from rotordrop.report.replay_page import replay_page
    from rotordrop.report.simulated_record import simulated_notice

    documents, pages = {}, {}
    for record, tail, found in zip(records, tails, findings, strict=True):
        drop = replay_drop(machine, record, tail=tail, fixed=fixed, progress=progress)
        words = _warnings(found, tail, (*drop.warnings, *drop.drop_instant.notes))
        documents[record.name] = replay_document(drop)
        documents[record.name] |= {"warnings": words, "simulated_record": bool(simulated_notice(record))}
        pages[record.name] = replay_page(drop, machine, findings=found, warnings=words)
    return documents, pages


def _write(
    machine: Machine,
    documents: dict[str, dict[str, Any]],
    pages: dict[str, ReportContent],
    reports: list[Path],
    json: Path | None,
) -> None:
    from rotordrop.estimation.document import combined
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary

    for page, place in zip(pages.values(), reports, strict=False):
        write_page(page, place)

    def summarise(out: Console) -> None:
        for page in pages.values():
            print_summary(page, out)
        for place in reports:
            out.print(f"Report: {place}")

    deliver(combined(documents, machine), json, summarise)
