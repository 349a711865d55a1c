"""Keep the log of a machine's drops and what they are allowed: one SQLite file, or a data base by URL."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured, text_option
from rotordrop.cli._output import console, deliver
from rotordrop.errors import UsageError
from rotordrop.units import format_minute, format_quantity

if TYPE_CHECKING:
    from rotordrop.ledger.book import LoggedDrop
    from rotordrop.report.content import ReportContent, Statement

LARGEST = (("force, 90 %", "peak_force_N", 1.0, "N"), ("stress, 90 %", "peak_stress_Pa", 1e-6, "MPa"))
WHEN = "add: when it happened, ISO 8601; what the recorder wrote by default."
WHAT = "add: estimate.json; remove: number of the drop."


Action = StrEnum("Action", ["add", "show", "allow", "remove"])
"""What to do with a log."""


def log(
    action: Annotated[
        Action,
        Argument(metavar="ACTION", help="add an estimate, show, allow, remove a drop."),
    ],
    where: Annotated[str, Argument(metavar="LOG", help="SQLite file, or postgresql://….")],
    what: Annotated[str | None, Argument(metavar="[WHAT]", help=WHAT)] = None,
    machine: Annotated[str | None, text_option("NAME", "Only this machine.")] = None,
    bearings: Annotated[
        str, typer.Option(metavar="NAME", help="Set of touchdown bearings, a name of your own.")
    ] = "1",
    recorded: Annotated[str, text_option("DATE", WHEN)] = "",
    duration: Annotated[
        float | None, measured("time", 'add: time in the touchdown bearings, "51 s".')
    ] = None,
    cause: Annotated[str, text_option("TEXT", "add: why levitation was lost.")] = "",
    drops: Annotated[int | None, typer.Option(metavar="N", help="allow: number of drops.")] = None,
    seconds: Annotated[float | None, measured("time", "allow: time in all, as in '600 s'.")] = None,
    source: Annotated[str, text_option("TEXT", "allow: who agreed on it, and where.")] = "",
    everything: Annotated[bool, typer.Option("--all", help="Show all drops, not the latest alone.")] = False,
    json: options.Json = None,
) -> None:
    """Add a drop to the log of a machine, list what is there, and count it against an allowance.

    Example: rotordrop log add drops.db drop.json
    """
    from rotordrop.ledger import book
    from rotordrop.report.content import Statement

    if action is Action.add:
        drop = _drop(what, bearings, recorded, duration, cause)
        number = book.add_drop(where, drop)
        console().print(f"drop {number}: {drop.record} at {format_quantity(drop.speed, 'speed')} was logged")
    elif action is Action.remove:
        if what is None or not what.isascii() or not what.isdigit():
            raise UsageError(f"{what!r} is not the number of a drop; 'rotordrop log show' lists them")
        book.remove_drop(where, int(what))
        console().print(f"drop {what} was removed")
    elif action is Action.allow:
        _allow(where, machine, bearings, drops, seconds, source)
    log = book.read_log(where)
    found = book.logged_drops(log, machine=machine)
    shares = [share for share in book.used_shares(log) if machine in (None, share.machine)]
    rising = book.trends(log, machine=machine)
    content = {
        "drops": {str(number): asdict(drop) for number, drop in found.items()},
        "used": [asdict(share) | {"sentence": share.sentence()} for share in shares],
        "trends": [asdict(one) | {"sentence": one.sentence()} for one in rising],
        "statement": book.STATEMENT,
    }
    said = [Statement(share.sentence(), "bad" if share.passed else "notice") for share in shares]
    said += [Statement(text) for text in (*(one.sentence() for one in rising), book.STATEMENT)]
    deliver(content, json, _page(where, found, said), whole=everything)


def _allow(
    where: str, machine: str | None, bearings: str, drops: int | None, seconds: float | None, source: str
) -> None:
    from rotordrop.ledger import book

    if machine is None:
        raise UsageError("an allowance belongs to a machine; name it with --machine")
    book.allow(where, machine, bearings, drops=drops, seconds=seconds, source=source)
    logged = {drop.machine for drop in book.logged_drops(where).values()}
    if logged and machine not in logged:  # a name written otherwise would never count
        console().print(
            f"note: no drop of {machine!r} is in the log, only of "
            f"{', '.join(sorted(map(repr, logged)))}; an allowance counts drops of the machine of "
            "exactly its name"
        )


def _drop(what: str | None, bearings: str, recorded: str, duration: float | None, cause: str) -> LoggedDrop:
    """The drop of an estimate, with what somebody knows of it."""
    from rotordrop.estimate.published import read_drop
    from rotordrop.ledger.book import drop_of_estimate

    if what is None:
        raise UsageError("nothing to add; name the JSON file of an estimate")
    drop = read_drop(Path(what))
    try:
        date = datetime.fromisoformat(recorded).isoformat() if recorded else ""
    except ValueError as error:
        raise UsageError(
            f"{recorded!r} is not a date; write it as 2026-03-14 or 2026-03-14T15:09:26"
        ) from error
    return drop_of_estimate(drop, bearings, recorded=date, duration=duration, cause=cause)


def _page(where: str, found: Mapping[int, LoggedDrop], said: Sequence[Statement]) -> ReportContent:
    """What is used, and the drops, the latest first."""
    from rotordrop.report.content import ReportContent, Table

    rows = []
    owners = {"machine": "machine", "bearings": "bearing_set"}
    several = [head for head, name in owners.items() if len({getattr(o, name) for o in found.values()}) > 1]
    for number, drop in sorted(found.items(), reverse=True):
        marks = ["simulated"] * drop.simulated + ["not consistent with it"] * (not drop.consistent)
        marks += ["further out after the estimated part"] * drop.went_on
        day = format_minute(drop.recorded or drop.added)
        lasted = "" if drop.duration is None else f", {drop.duration:.4g} s"
        told = {
            "drop": str(number),
            **{head: getattr(drop, owners[head]) for head in several},
            "date": day if drop.recorded else f"logged {day}",
            "record": drop.record + (f" ({', '.join(marks)})" if marks else ""),
            "speed": f"{format_quantity(drop.speed / (2.0 * math.pi), 'frequency')}{lasted}",
        }
        for head, field, scale, unit in LARGEST:
            rated = [one for one in drop.severity if one.quantity == field]
            worst = max(rated, key=lambda one: one.upper, default=None)
            ends = "" if worst is None else f"{scale * worst.lower:.0f} to {scale * worst.upper:.0f} {unit}"
            told[head] = "" if worst is None else f"{worst.bearing} {ends}"
        rows.append(told)
    table = Table(tuple(rows[0]) if rows else ("drop",), tuple(tuple(row.values()) for row in rows))
    return ReportContent(
        title=f"Log of drops: {where}",
        verdict=tuple(said),
        rest="--all",
        summary=(table,),
    )
