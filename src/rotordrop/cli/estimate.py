"""Estimate force and stress from recorded drops, and calibrate a machine on several."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import file_option, text_option
from rotordrop.cli._output import deliver, places_beside, progress_bar, require_places, write_report
from rotordrop.errors import ConsistencyError, UsageError
from rotordrop.interrupts import interruptible

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.machine import Machine
    from rotordrop.record.record import Record


Method = StrEnum("Method", ["tracked", "replay"])
"""How force is found: a model that follows the record, or the paper's open-loop replay."""


def estimate(
    machine: options.Machine,
    records: options.Records,
    tail: options.Tail = None,
    method: Annotated[Method, Option("--method", help="How the force is found.")] = Method.tracked,
    quick: Annotated[bool, Option("--quick", help="One pass; for a calibrated machine.")] = False,
    mapping: options.Planes = None,
    profile: options.Profile = None,
    tail_profile: options.TailProfile = None,
    report: Annotated[
        Path | None, file_option("--report", "Write the report, one offline HTML file per drop.")
    ] = None,
    operator: Annotated[str, text_option("NAME", "Who, for the report.")] = "",
    output: Annotated[
        Path | None,
        file_option(
            "--output",
            "Write force, stress, displacement, ball load against time: .h5, .csv, .mat, .parquet.",
            "-o",
        ),
    ] = None,
    everything: Annotated[
        bool, Option("--all", help="Show also identified values, every note and the parts of intervals.")
    ] = False,
    json: options.Json = None,
) -> None:
    """Estimate touchdown-bearing force and stress from recorded drops.

    Example: rotordrop estimate machine.toml record.csv --tail tail.csv --report report.html
    """
    from rotordrop.estimate.document import combined, estimate_document
    from rotordrop.estimate.histories import require_format
    from rotordrop.estimation import Replay, Tracked, estimate_drops
    from rotordrop.machine import load_machine
    from rotordrop.report.estimate_page import estimate_page, estimate_screen, estimate_summary
    from rotordrop.simulate.result import fingerprint
    from rotordrop.twin.search import is_calibrated

    machine, *records = options.machine_first(machine, *records)
    description = load_machine(machine)
    if quick and method is Method.tracked and not is_calibrated(description):
        raise UsageError(
            f"--quick needs a calibrated machine; supports and contacts of {machine.name} are guesses. "
            f"Calibrate it with 'rotordrop calibrate {machine.name} RECORD... --output calibrated.toml', "
            "or leave --quick out."
        )
    reports, outputs = (places_beside(named, records) for named in (report, output))
    if output is not None:
        require_format(output)
    require_places(json, *reports, *outputs)
    read, tails = _read(description, records, tail or [], mapping or (), profile, tail_profile)
    chosen = Tracked(quick=quick) if method is Method.tracked else Replay()
    with progress_bar("estimating") as progress:
        # in a thread of its own: compiled code would keep Ctrl-C waiting
        estimates = interruptible(
            lambda: estimate_drops(description, read, tails, method=chosen, progress=progress)
        )
    screens = [estimate_summary(made) if everything else estimate_screen(made) for made in estimates]
    for made, place in zip(estimates, outputs, strict=False):
        made.save(place)
    for made, place in zip(estimates, reports, strict=False):
        write_report(estimate_page(made), place, fingerprint())
    numbers = combined([estimate_document(made) for made in estimates], [made.name for made in estimates])
    deliver(numbers, json, screens, written=[*reports, *outputs], whole=everything)
    if names := ", ".join(made.name for made in estimates if not made.consistent):
        raise ConsistencyError(f"{names}: model and record disagree; of force and stress ranges hold at most")


def _read(
    machine: Machine,
    records: Sequence[Path],
    tails: Sequence[Path],
    mapping: Sequence[str],
    profile: Path | None,
    tail_profile: Path | None,
) -> tuple[list[Record], list[Record | None]]:
    """Every record and its settled tail: one for all, one for each in order, or none."""
    from rotordrop.record.record import read_record

    read = [read_record(path, machine, profile=profile, mapping=mapping) for path in records]
    if len(tails) not in (0, 1, len(records)):
        raise UsageError(
            f"{len(tails)} tails for {len(records)} records; expected one for all, one for each, or none. "
            "Repeat --tail in the order of the records."
        )
    rules, planes = (tail_profile, ()) if tail_profile else (profile, mapping)
    found: list[Record | None] = [
        read_record(path, machine, profile=rules, mapping=planes, tail=True) for path in tails
    ]
    return read, found if len(found) == len(read) else (found or [None]) * len(read)


def calibrate(
    machine: options.Machine,
    records: options.Records,
    output: Annotated[Path, file_option("--output", "Calibrated machine file to write (.toml).", "-o")],
    tail: options.Tail = None,
    mapping: options.Planes = None,
    profile: options.Profile = None,
    tail_profile: options.TailProfile = None,
    json: options.Json = None,
) -> None:
    """Calibrate a machine on recorded drops.

    Example: rotordrop calibrate machine.toml drop1.csv drop2.csv --output calibrated.toml
    """
    from rotordrop.evidence.quality import check_record
    from rotordrop.evidence.quality.finding import refuse_unusable
    from rotordrop.machine import load_machine
    from rotordrop.machine.saving import save_machine
    from rotordrop.twin.calibrated import calibrate_machine, calibration_json

    machine, *records = options.machine_first(machine, *records)
    description = load_machine(machine)
    read, tails = _read(description, records, tail or [], mapping or (), profile, tail_profile)
    for record, rest in zip(read, tails, strict=True):
        refuse_unusable(check_record(record, description, rest), record.name)
    with progress_bar("calibrating") as report:
        result = calibrate_machine(description, read, tails, progress=report)
    if result.consistent:
        save_machine(result.machine, output)

    def summarise(out: Console) -> None:
        out.print(result.sentence())
        for name, checks in result.checks.items():
            for check in checks:
                if check.failed:
                    out.print(f"{name}: {check.said()}")
        for pair in result.confounded:
            apart = f"(correlation {pair.correlation:.2f}); {pair.separated_by}"
            out.print(f"confounded: {pair.first} and {pair.second} {apart}")
        if result.consistent:
            out.print(f"Calibrated machine, every value with its interval: {output}")

    deliver(calibration_json(result), json, summarise)
    if not result.consistent:
        raise ConsistencyError(
            f"{result.sentence()} {output} was not written: air gaps and supports that do not fit would send "
            "every later estimate the wrong way. Leave out the drop that does not fit, check sensors and "
            "bearing nodes, or give better guesses."
        )
