"""Show the response to unbalance, with margins.

Bode and polar plots, deflected shapes, margins by API 617. The rotor turns in its AMBs, or settled in its
touchdown bearings, with the unbalance of the machine file.
"""

from __future__ import annotations

from typing import Annotated

import typer

from rotordrop.cli._options import DataOption, JsonOption, MachineArgument, ReportOption, quantity
from rotordrop.cli._output import deliver, require_places
from rotordrop.cli.critical_speeds import Held
from rotordrop.errors import UsageError

BEYOND = 1.5


def unbalance_response(
    machine: MachineArgument,
    top_speed: Annotated[
        float | None,
        typer.Option(
            parser=quantity("speed"), metavar="SPEED", help="Highest speed; 1.5 × nominal when left out."
        ),
    ] = None,
    held: Annotated[
        Held | None, typer.Option(help="What holds the rotor; its AMBs where it has some.")
    ] = None,
    report: ReportOption = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Show amplitude and phase under unbalance over the speed, with amplification factors and margins."""
    from rotordrop.machine import load_machine
    from rotordrop.report.csv_files import write_data
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.report.unbalance_page import unbalance_json, unbalance_page
    from rotordrop.rotor.unbalanced import resolved_response

    require_places(report, json_file)
    described = load_machine(machine)
    chosen = held or (Held.ambs if described.ambs else Held.touchdown_bearings)
    if chosen is Held.free_free:
        raise UsageError("nothing holds a free rotor: choose 'AMBs' or 'touchdown bearings'")
    top = top_speed or BEYOND * float(described.speed.nominal)
    response = resolved_response(described, top, chosen.value)
    page = unbalance_page(described, response)
    if report is not None:
        write_page(page, report)
    if data is not None:
        write_data(page, data)
    deliver(unbalance_json(described, response), json_file, lambda out: print_summary(page, out))
