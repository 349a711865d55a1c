"""Show what is known when a machine is to run again after a drop."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import FEWEST_DROPS, file_option, pairs
from rotordrop.cli._output import deliver, progress_bar
from rotordrop.errors import UsageError

CHECKS = ("lift", "tail", "turning", "borescope", "coast-down")
CHECK_HELP = f'A check that was made after this drop, "turning=bad"; of {", ".join(CHECKS)}; repeat it.'


def restart(
    machine: options.Machine,
    estimate: Annotated[Path, Argument(metavar="ESTIMATE", help="Estimate of the drop (.json).")],
    since: Annotated[
        list[Path] | None,
        file_option("--since", "Estimate of an earlier drop with these bearings; repeat it."),
    ] = None,
    check: Annotated[
        list[str] | None,
        Option(metavar="CHECK", help=CHECK_HELP),
    ] = None,
    limit: Annotated[
        list[str] | None,
        Option(metavar="LIMIT", help='Limit of the next drop, "peak_stress=2.5 GPa"; repeat it.'),
    ] = None,
    drops: Annotated[
        int | None,
        Option(min=0, metavar="N", help=f"Next drops to simulate a speed, {FEWEST_DROPS} or more; 0: none."),
    ] = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Show what changed since earlier drops, what the next one and a lift would be, and what to check.

    Example: rotordrop restart machine.toml drop.json --since first.json --limit "peak_stress=2.5 GPa"
    """
    from rotordrop.estimate.published import read_drop
    from rotordrop.machine import load_machine
    from rotordrop.report.restart_page import restart_numbers, restart_page
    from rotordrop.restart.card import Foreseen, restart_card
    from rotordrop.restart.next_drop import DROPS, lift_now, next_drops
    from rotordrop.severity.numbers import read_limits
    from rotordrop.study.repeat import COMPARED

    described, drop = load_machine(machine), read_drop(estimate)
    if drop.machine != described.name:
        raise UsageError(
            f"{estimate} is of {drop.machine!r} and {machine} describes {described.name!r}; name the machine "
            "file of that drop"
        )
    limits = read_limits(limit or ())
    for field in limits:
        if field not in COMPARED:
            raise UsageError(f"--limit: no simulated drop has {field}; there are {', '.join(COMPARED)}")
    made = pairs(check, f'one of {", ".join(CHECKS)} and its outcome, "turning=bad"')
    earlier = [read_drop(one) for one in since or ()]
    restart_card(drop, earlier=earlier, checks=made)  # refuses before anything is simulated
    found = Foreseen()
    count = DROPS if drops is None else drops
    if 0 < count < FEWEST_DROPS:
        raise UsageError(
            f"--drops {count}: so few do not say what 95 % of drops stay below; give {FEWEST_DROPS} or more, "
            "or 0 to leave them out"
        )
    if count and described.ambs:
        speed = 2.0 * math.pi * drop.speed_Hz
        with progress_bar("the next drop") as bar:
            found = next_drops(described, speed, limits, drop=drop, drops=count, progress=bar)
        found = replace(found, lift=lift_now(described, drop=drop))
    card = restart_card(drop, earlier=earlier, checks=made, foreseen=found)
    deliver(restart_numbers(card), json, restart_page(card, drop), report=report)
