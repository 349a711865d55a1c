"""Calibrate a machine on several recorded drops.

One fit over all drops: supports, contacts, air gaps, friction, preload, sensors, each with a 90 % interval.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import JsonOption, MachineArgument, ProfileOption
from rotordrop.cli._output import deliver, progress_bar, require_places
from rotordrop.cli._recordings import require_own_content, require_own_names, tails_of
from rotordrop.errors import ConsistencyError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.twin.calibrated import Calibration


def calibrate(
    machine: MachineArgument,
    records: Annotated[
        list[Path], typer.Argument(metavar="RECORD...", help="Recorded drops of this machine.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Calibrated machine file to write (.toml).")
    ],
    tail: Annotated[
        list[Path] | None,
        typer.Option(
            "--tail", metavar="FILE", help="Settled tail: one for all drops, or one for each in order."
        ),
    ] = None,
    profile: ProfileOption = None,
    tail_profile: Annotated[
        Path | None,
        typer.Option("--tail-profile", metavar="FILE", help="Channel map of the recorder of the tails."),
    ] = None,
    even_if_inconsistent: Annotated[
        bool,
        typer.Option(
            "--even-if-inconsistent",
            help="Write the machine file, marked, although it does not fit.",
        ),
    ] = False,
    json: JsonOption = None,
) -> None:
    """Calibrate a machine on recorded drops."""
    from rotordrop.evidence.quality import check_record
    from rotordrop.evidence.quality.finding import refuse_unusable
    from rotordrop.machine import load_machine, save_machine
    from rotordrop.record.record import read_record
    from rotordrop.twin.calibrated import calibrate_machine, calibration_json

    require_places(output, json)
    require_own_names(records)
    require_own_content(records)
    description = load_machine(machine)
    read = [read_record(path, description, profile=profile) for path in records]
    of_tails = tail_profile or profile
    tails = tails_of(tail or [], len(read), lambda path: read_record(path, description, profile=of_tails))
    for record, rest in zip(read, tails, strict=True):
        refuse_unusable(check_record(record, description, rest), record.name)
    with progress_bar("calibrating") as report:
        result = calibrate_machine(description, read, tails, progress=report)
    written = result.consistent or even_if_inconsistent
    if written:
        save_machine(result.machine, output)
    deliver(calibration_json(result), json, lambda out: _summary(result, output if written else None, out))
    if not result.consistent:
        outcome = f"{output} is marked as such" if written else f"{output} was not written"
        raise ConsistencyError(
            f"{result.sentence()} {outcome}: air gaps and supports that do not fit would send every later "
            "estimate the wrong way. Leave out the drop that does not fit, check sensors and bearing nodes, "
            "or give better guesses; --even-if-inconsistent writes the file all the same."
        )


def _summary(result: Calibration, output: Path | None, out: Console) -> None:
    from rich.table import Table

    from rotordrop.elements.table import row_of
    from rotordrop.report.quantity import Quantity

    table = Table("parameter", "estimate", "90 % interval", "verdict", box=None)
    for path, value in result.values.items():
        shown = Quantity(value=value.value, kind=row_of(path).display_kind, interval_90=value.interval_90)
        table.add_row(
            path,
            shown.text,
            shown.interval_text,
            value.status,
        )
    out.print(table)
    for pair in result.confounded:
        out.print(
            f"confounded: {pair.first} and {pair.second} (correlation {pair.correlation:.2f}); {pair.way_out}"
        )
    for name, checks in result.checks.items():
        for check in checks:
            if not check.passed:
                out.print(f"{name}: {check.message}")
    out.print(result.sentence())
    if output is not None:
        out.print(f"Calibrated machine: {output}")
