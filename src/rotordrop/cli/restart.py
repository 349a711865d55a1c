"""Judge whether a machine may run again after a drop."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import file_option, text_option
from rotordrop.cli._output import deliver, progress_bar
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.restart.order import EarlierDrop, MadeCheck


CHECKS = ("lift", "coast-down", "turning", "borescope", "tail")
"""Checks of the package by name; assumptions of your own may name others."""
CHECK_HELP = (
    f'A check that was made, "turning=bad", "2026-03-14 lift=good"; of {", ".join(CHECKS)}; repeat it.'
)


def restart(
    machine: options.Machine,
    estimate: Annotated[Path, Argument(metavar="ESTIMATE", help="Estimate of the drop (.json).")],
    since: Annotated[
        list[Path] | None,
        file_option("--since", "Estimate of an earlier drop with these bearings, the first before the next."),
    ] = None,
    log: Annotated[str | None, text_option("LOG", "Log of drops: earlier ones count.")] = None,
    bearings: Annotated[str, Option(metavar="NAME", help="Set of touchdown bearings in the log.")] = "1",
    check: Annotated[
        list[str] | None,
        Option(metavar="CHECK", help=CHECK_HELP),
    ] = None,
    assumptions: Annotated[
        Path | None,
        file_option("--assumptions", "Costs, kinds of damage and checks that you state otherwise (.toml)."),
    ] = None,
    limit: Annotated[
        list[str] | None,
        Option(metavar="LIMIT", help='Limit of the next drop, "peak_stress=2.5 GPa"; repeat it.'),
    ] = None,
    drops: Annotated[
        int | None, Option(min=0, metavar="N", help="Next drops to simulate a speed; 0 leaves them out.")
    ] = None,
    report: options.Report = None,
    data: options.Data = None,
    json: options.Json = None,
) -> None:
    """Judge whether a machine may run again after a drop: restart, with limits, inspect first, or replace.

    Example: rotordrop restart machine.toml drop.json --log drops.db
    """
    from rotordrop.estimate.published import read_drop
    from rotordrop.machine import load_machine
    from rotordrop.report.limits import read_limits
    from rotordrop.report.restart_page import restart_numbers, restart_page
    from rotordrop.restart.assumptions import assumptions_of, load_assumptions
    from rotordrop.restart.card import restart_card
    from rotordrop.restart.foreseen import Foreseen
    from rotordrop.restart.next_drop import DROPS, lift_now, next_drops
    from rotordrop.restart.order import in_order, with_checks
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
    assumed = assumptions_of({}, "the assumptions") if assumptions is None else load_assumptions(assumptions)
    speed = 2.0 * math.pi * drop.speed_Hz
    found = Foreseen()
    count = DROPS if drops is None else drops
    if count and described.ambs:
        with progress_bar("the next drop") as bar:
            found = next_drops(
                *(described, speed, limits),
                drop=drop,
                chance=assumed.most_beyond,
                drops=count,
                progress=bar,
            )
        found = replace(found, lift=lift_now(described, drop=drop))
    before = [read_drop(one) for one in since or ()]
    for path, one in zip(since or (), before, strict=True):
        if one.record_sha256 == drop.record_sha256:
            raise UsageError(
                f"--since {path} and {estimate} are of one recording; name the estimate of an earlier drop"
            )
    logged = [] if log is None else _logged(log, drop.machine, bearings, drop.record_sha256)
    history, remarks = in_order(drop, before, logged)
    earlier, made = with_checks(drop, history, _checks(check or ()))
    card = restart_card(
        drop,
        assumed,
        earlier=earlier,
        checks=made,
        foreseen=found,
        remarks=remarks,
    )
    deliver(restart_numbers(card), json, restart_page(card, drop), report=report, data=data)


def _checks(written: list[str] | tuple[str, ...]) -> list[MadeCheck]:
    """Checks as they are written on the command line, an earlier one with its date before it."""
    from rotordrop.restart.order import MadeCheck

    found = []
    for text in written:
        left, equals, outcome = (part.strip() for part in text.partition("="))
        if not equals:
            raise UsageError(
                f'--check {text!r}; expected one of {", ".join(CHECKS)} and its outcome, "turning=bad", or '
                'one after an earlier drop with its date, "2026-03-14 turning=bad"'
            )
        day, _, name = left.rpartition(" ")
        found.append(MadeCheck(name=name, outcome=outcome, day=day.strip()))
    return found


def _logged(log: str, machine: str, bearings: str, sha256: str) -> list[EarlierDrop]:
    """Drops of a set of bearings in a log, this one left out."""
    from rotordrop.estimate.published import Value
    from rotordrop.ledger.book import logged_drops
    from rotordrop.restart.order import EarlierDrop

    of_machine = logged_drops(log, machine=machine)
    sets = sorted({drop.bearing_set for drop in of_machine.values()})
    if sets and bearings not in sets:
        raise UsageError(
            f"--bearings {bearings}: {log} has no drops of {machine} with this set of bearings; there are "
            f"{', '.join(sets[:8])}"
        )
    return [
        EarlierDrop(
            record=drop.record,
            recorded=drop.recorded,
            sha256=drop.sha256,
            stresses={
                one.bearing: Value(
                    value=math.sqrt(one.lower * one.upper) if one.value is None else one.value,
                    interval_90=[one.lower, one.upper],
                )
                for one in drop.severity
                if one.quantity == "peak_stress_Pa" and one.lower > 0.0
            },
        )
        for drop in of_machine.values()
        if drop.bearing_set == bearings and (not sha256 or drop.sha256 != sha256)
    ]
