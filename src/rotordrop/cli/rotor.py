"""Critical speeds and Campbell diagrams of a machine."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from typer import Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured
from rotordrop.cli._output import deliver, progress_bar

Held = StrEnum("Held", {"free_free": "free-free", "ambs": "AMBs", "touchdown_bearings": "touchdown bearings"})
"""What holds the rotor."""


def critical_speeds(
    machine: options.Machine,
    top_speed: Annotated[
        float | None, measured("speed", "Highest speed; 1.3 × nominal when left out.")
    ] = None,
    held: Annotated[
        list[Held] | None, Option(help="What holds the rotor; all that the machine has when left out.")
    ] = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Show critical speeds on supports of any stiffness, and damped modes against the speed.

    Example: rotordrop critical-speeds machine.toml --report speeds.html
    """
    from rotordrop.machine import load_machine
    from rotordrop.report.critical_speeds_page import critical_speeds_page
    from rotordrop.rotor.campbell import campbell_diagram, critical_speeds_json, speed_grid
    from rotordrop.rotor.critical_speeds import WHIRLS, critical_speed_map

    described = load_machine(machine)
    grid = speed_grid(described, top_speed)
    chosen = list(held or (item for item in Held if item is not Held.ambs or described.ambs))
    with progress_bar("critical speeds") as progress:
        progress("maps", 0.0)
        maps = {whirl: critical_speed_map(described, whirl=whirl) for whirl in WHIRLS}
        progress("Campbell diagrams", 0.5)
        diagrams = {item.value: campbell_diagram(described, grid, item.value) for item in chosen}
    page = critical_speeds_page(described, maps, diagrams)
    deliver(critical_speeds_json(maps, diagrams), json, page, report=report)
