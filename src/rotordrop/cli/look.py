"""Look at a recorded drop, with nothing known of the machine.

What was read, the quality gate, what happened when, impacts and whirl from displacement alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import JsonOption, PlanesOption, ProfileOption, ReportOption, quantity
from rotordrop.cli._output import deliver


def look(
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="Recorded drop.", show_default=False)],
    machine: Annotated[
        Path | None, typer.Argument(metavar="[MACHINE]", help="Machine description, if there is one.")
    ] = None,
    gap: Annotated[
        float | None,
        typer.Option(parser=quantity("length"), metavar="LENGTH", help='Radial air gap, "250 um".'),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(parser=quantity("speed"), metavar="SPEED", help='Speed at the drop, "9000 rpm".'),
    ] = None,
    mapping: PlanesOption = None,
    profile: ProfileOption = None,
    report: ReportOption = None,
    json: JsonOption = None,
) -> None:
    """Look at a recorded drop: what was read, its quality, what happened when, impacts, whirl, indices."""
    from rotordrop.evidence.look import look as look_at
    from rotordrop.report.look_page import look_page
    from rotordrop.report.terminal import print_summary

    described = None
    if machine is not None:
        from rotordrop.machine import load_machine

        described = load_machine(machine)
    seen = look_at(record, machine=described, gap=gap, speed=speed, mapping=mapping or (), profile=profile)
    if report is not None:
        from rotordrop.report.page import write_page

        write_page(look_page(seen), report)
    page = look_page(seen, drawn=False)
    deliver(seen.as_json(), json, lambda out: print_summary(page, out))
