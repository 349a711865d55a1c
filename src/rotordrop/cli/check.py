"""Check a machine file and show what it amounts to.

Prints one line of verdict, then mass, inertias, load shares and frequencies on one screen; with ``--all``
also what was assumed, and where the drop model ends and why.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import JsonOption, MachineArgument, quantity
from rotordrop.cli._output import deliver, require_places

if TYPE_CHECKING:
    from rich.console import Console


def check(
    machine: MachineArgument,
    speed: Annotated[
        float | None,
        typer.Option(
            parser=quantity("speed"),
            metavar="SPEED",
            help='Speed at the drop, such as "60 Hz", for the warnings; the nominal speed when left out.',
        ),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Also every default and inferred value, and limits with numbers.")
    ] = False,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the same with a drawing of the rotor as an HTML page."),
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Check a machine file and show what it amounts to: mass, load shares, frequencies, sag, assumptions."""
    from rotordrop.cli._rotor_text import rotor_lines
    from rotordrop.machine import load_machine
    from rotordrop.report.machine_content import machine_content, machine_json
    from rotordrop.report.terminal import print_summary
    from rotordrop.rotor.machine_summary import machine_warnings, summarise_machine

    require_places(report, json_file)
    described = load_machine(machine)
    summary = summarise_machine(described)
    warnings = machine_warnings(described, summary, speed)

    def summarise(out: Console) -> None:
        print_summary(machine_content(described, summary, warnings, brief=not everything), out)
        for line in rotor_lines(described):
            out.print(line, no_wrap=True, crop=True)

    if report is not None:
        from rotordrop.report.page import write_page

        write_page(machine_content(described, summary, warnings, drawn=True), report)
    deliver(machine_json(described, summary, warnings), json_file, summarise)
