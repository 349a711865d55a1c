"""Critical speeds, Campbell diagrams and the response to unbalance of a machine."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured
from rotordrop.cli._output import deliver, progress_bar
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.report.content import ReportContent

BEYOND_NOMINAL = 1.1
"""Highest speed of a Campbell diagram over the nominal one [1]; chosen, not measured."""
BEYOND = 1.5
"""Highest speed of an unbalance response over the nominal one [1]; chosen, not measured."""
SPEEDS = 61
"""Speeds of a Campbell diagram; chosen, not measured."""
Held = StrEnum("Held", {"free_free": "free-free", "ambs": "AMBs", "touchdown_bearings": "touchdown bearings"})
"""What holds the rotor."""


def critical_speeds(
    machine: options.Machine,
    top_speed: Annotated[
        float | None,
        measured("speed", "Highest speed; 1.1 × nominal when left out, 1.5 × with --unbalance."),
    ] = None,
    held: Annotated[
        list[Held] | None, Option(help="What holds the rotor; all that the machine has when left out.")
    ] = None,
    unbalance: Annotated[
        bool,
        Option("--unbalance", help="Show instead amplitude and phase under unbalance over the speed."),
    ] = False,
    run_up: Annotated[
        float | None,
        measured("time", 'With --unbalance, from standstill in this time, "20 s"; steady when left out.'),
    ] = None,
    report: options.Report = None,
    data: options.Data = None,
    json: options.Json = None,
) -> None:
    """Show critical speeds on supports of any stiffness, and damped modes against the speed.

    With --unbalance the response to unbalance, with amplification factors and margins.

    Example: rotordrop critical-speeds machine.toml --report speeds.html
    """
    import numpy as np

    from rotordrop.machine import load_machine
    from rotordrop.report.critical_speeds_page import critical_speeds_json, critical_speeds_page
    from rotordrop.rotor.campbell import campbell_diagram, stability_map
    from rotordrop.rotor.critical_speeds import WHIRLS, critical_speed_map

    described = load_machine(machine)
    if unbalance or run_up is not None:
        numbers, response = _unbalance_response(described, held or [], top_speed, run_up)
        deliver(numbers, json, response, report=report, data=data)
        return
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
    deliver(critical_speeds_json(maps, diagrams, stability), json, page, report=report, data=data)


def _unbalance_response(
    described: Machine, held: list[Held], top_speed: float | None, run_up: float | None
) -> tuple[dict[str, Any], ReportContent]:
    """Amplitude and phase under unbalance over the speed, as numbers and as a page."""
    from rotordrop.report.unbalance_page import unbalance_json, unbalance_page
    from rotordrop.rotor.unbalanced import resolved_response, run_up_response

    if len(held) > 1:
        raise UsageError("--unbalance is of a rotor held in one way; name --held once")
    chosen = held[0] if held else Held.ambs if described.ambs else Held.touchdown_bearings
    if chosen is Held.free_free:
        raise UsageError("nothing holds a free rotor: choose 'AMBs' or 'touchdown bearings'")
    top = top_speed or BEYOND * float(described.speed.nominal)
    steady = resolved_response(described, top, chosen.value)
    rising = None if run_up is None else run_up_response(described, top, run_up, chosen.value)
    return unbalance_json(described, steady, rising), unbalance_page(described, steady, rising)
