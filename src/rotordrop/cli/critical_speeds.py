"""Show critical speeds, Campbell diagrams and mode shapes.

Undamped map as in the paper and with support mass; damped modes free-free, in the AMBs, in the bearings.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import DataOption, JsonOption, MachineArgument, quantity
from rotordrop.cli._output import deliver, progress_bar, require_places

BEYOND_NOMINAL = 1.1
SPEEDS = 61


class Held(StrEnum):
    """What holds the rotor."""

    free_free = "free-free"
    ambs = "AMBs"
    touchdown_bearings = "touchdown bearings"


def critical_speeds(
    machine: MachineArgument,
    top_speed: Annotated[
        float | None,
        typer.Option(
            parser=quantity("speed"),
            metavar="SPEED",
            help="Highest speed of the Campbell diagrams; 1.1 × nominal when left out.",
        ),
    ] = None,
    held: Annotated[
        list[Held] | None, typer.Option(help="What holds the rotor; all that the machine has when left out.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the report as one HTML file.")
    ] = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Show critical speeds on supports of any stiffness, and damped modes against the speed."""
    import numpy as np

    from rotordrop.machine import load_machine
    from rotordrop.report.critical_speeds_page import critical_speeds_json, critical_speeds_page
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.rotor.campbell import campbell_diagram, stability_map
    from rotordrop.rotor.critical_speeds import WHIRLS, critical_speed_map

    require_places(report, json_file)
    described = load_machine(machine)
    grid = np.linspace(0.0, top_speed or BEYOND_NOMINAL * float(described.speed.nominal), SPEEDS)
    chosen = list(held or (item for item in Held if item is not Held.ambs or described.ambs))
    maps, diagrams = {}, {}
    with progress_bar("critical speeds") as progress:
        parts = len(WHIRLS) + len(chosen)
        for number, whirl in enumerate(WHIRLS):
            progress(f"map, {whirl}", number / parts)
            maps[whirl] = critical_speed_map(described, whirl=whirl)
        for number, item in enumerate(chosen, start=len(WHIRLS)):
            progress(f"Campbell diagram, {item.value}", number / parts)
            diagrams[item.value] = campbell_diagram(described, grid, item.value)
    stability = [stability_map(described, item.value) for item in chosen if item is not Held.free_free]
    page = critical_speeds_page(described, maps, diagrams, stability)
    if report is not None:
        write_page(page, report)
    if data is not None:
        from rotordrop.report.csv_files import write_data

        write_data(page, data)
    deliver(critical_speeds_json(maps, diagrams, stability), json_file, lambda out: print_summary(page, out))
