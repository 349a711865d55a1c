"""Keep the log of a machine's drops and what they are allowed.

The log is one SQLite file, or a PostgreSQL data base by URL.
"""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption, quantity
from rotordrop.cli._output import console, deliver, require_places
from rotordrop.errors import RecordError, UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.ledger.book import LoggedDrop


WHEN = "add: when it happened, ISO 8601; what the recorder wrote by default."
WHAT = "add: estimate.json; remove: number of the drop; export: file of the table (.csv)."


class Action(StrEnum):
    """What to do with a log."""

    add = "add"
    show = "show"
    allow = "allow"
    remove = "remove"
    export = "export"


def log(
    action: Annotated[
        Action,
        typer.Argument(metavar="ACTION", help="add an estimate, show, allow, remove a drop, export a table."),
    ],
    where: Annotated[str, typer.Argument(metavar="LOG", help="SQLite file, or postgresql://….")],
    what: Annotated[str | None, typer.Argument(metavar="[WHAT]", help=WHAT)] = None,
    machine: Annotated[str | None, typer.Option(metavar="NAME", help="Only this machine.")] = None,
    bearings: Annotated[
        str, typer.Option(metavar="NAME", help="Set of touchdown bearings, a name of your own.")
    ] = "1",
    recorded: Annotated[str, typer.Option(metavar="DATE", help=WHEN)] = "",
    duration: Annotated[
        float | None,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help='add: time in the touchdown bearings, "51 s".'
        ),
    ] = None,
    cause: Annotated[str, typer.Option(metavar="TEXT", help="add: why levitation was lost.")] = "",
    drops: Annotated[int | None, typer.Option(metavar="N", help="allow: number of drops.")] = None,
    seconds: Annotated[
        float | None,
        typer.Option(parser=quantity("time"), metavar="TIME", help="allow: time in all, as in '600 s'."),
    ] = None,
    source: Annotated[str, typer.Option(metavar="TEXT", help="allow: who agreed on it, and where.")] = "",
    json_file: JsonOption = None,
) -> None:
    """Add a drop to the log of a machine, list what is there, and count it against an allowance."""
    from rotordrop.ledger import book

    if action is Action.export and what is not None:
        if Path(what).resolve() == Path(where).resolve():
            raise UsageError(f"{what} is the log itself; name another file for the table")
        require_places(Path(what))
    require_places(json_file)
    if action is Action.add:
        drop = book.drop_of_estimate(
            _document(what), bearings, recorded=_date(recorded), duration=duration, cause=cause
        )
        number = book.add_drop(where, drop)
        console().print(f"drop {number}: {drop.record} at {drop.speed / (2 * math.pi):.4g} Hz was logged")
    elif action is Action.remove:
        book.remove_drop(where, _number(what))
        console().print(f"drop {what} was removed")
    elif action is Action.allow:
        if machine is None:
            raise UsageError("an allowance belongs to a machine; name it with --machine")
        book.allow(where, machine, bearings, drops=drops, seconds=seconds, source=source)
        _say_whose(machine, {drop.machine for drop in book.logged_drops(where).values()})
    found = book.logged_drops(where, machine=machine)
    shares = [share for share in book.used_shares(where) if machine in (None, share.machine)]
    if action is Action.export:
        _export(_csv(found), what)
        return
    rising = book.trends(where, machine=machine)
    content = {
        "drops": {str(number): asdict(drop) for number, drop in found.items()},
        "used": [{**asdict(share), "sentence": share.sentence()} for share in shares],
        "trends": [{**asdict(one), "sentence": one.sentence()} for one in rising],
        "statement": book.STATEMENT,
    }
    said = [share.sentence() for share in shares] + [one.sentence() for one in rising]
    deliver(content, json_file, lambda out: _summary(out, found, said))


def _export(table: str, file: str | None) -> None:
    from rotordrop.files import write_text

    if file is None:
        typer.echo(table, nl=False)
        return
    write_text(file, table)
    console().print(f"Table: {file}")


def _say_whose(machine: str, logged: set[str]) -> None:
    """Say it when an allowance counts nothing so far: a name written otherwise would never count."""
    if logged and machine not in logged:
        console().print(
            f"note: no drop of {machine!r} is in the log, only of {', '.join(sorted(map(repr, logged)))}; an "
            "allowance counts drops of the machine of exactly its name"
        )


def _document(what: str | None) -> dict[str, Any]:
    if what is None:
        raise UsageError("nothing to add; name the JSON file of an estimate")
    try:
        content = json.loads(Path(what).read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordError(f"{what}: cannot read the estimate: {error.strerror}") from error
    except ValueError as error:
        raise RecordError(f"{what} is not JSON ({error}); expected what 'estimate --json' writes") from error
    if not isinstance(content, dict):
        raise RecordError(
            f"{what} does not hold an estimate; expected what 'rotordrop estimate --json' writes"
        )
    return content


def _day(drop: LoggedDrop) -> str:
    """When it was, to the minute."""
    from rotordrop.units import format_minute

    shown = format_minute(drop.recorded or drop.added)
    return shown if drop.recorded else f"logged {shown}"


def _number(what: str | None) -> int:
    if what is None or not what.isascii() or not what.isdigit():
        raise UsageError(f"{what!r} is not the number of a drop; 'rotordrop log show' lists them")
    return int(what)


def _date(text: str) -> str:
    from datetime import datetime

    if not text:
        return ""
    try:
        return datetime.fromisoformat(text).isoformat()
    except ValueError as error:
        raise UsageError(f"{text!r} is not a date; write it as 2026-03-14 or 2026-03-14T15:09:26") from error


def _csv(found: dict[int, LoggedDrop]) -> str:
    from rotordrop.ledger.book import COLUMNS

    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["number", *COLUMNS, "bearing", "quantity", "unit", "value", "lower", "upper"])
    for number, drop in found.items():
        common = [number, *(getattr(drop, key) for key in COLUMNS)]
        for one in drop.severity or (None,):
            table.writerow([*common, *([""] * 6 if one is None else asdict(one).values())])
    return text.getvalue()


def _summary(out: Console, found: dict[int, LoggedDrop], shares: list[str]) -> None:
    from rich.table import Table

    from rotordrop.ledger.book import STATEMENT
    from rotordrop.units import format_quantity

    table = Table(
        "drop", "machine", "bearings", "date", "record", "speed", "duration", "largest force (90 %)"
    )
    for number, drop in found.items():
        forces = [one for one in drop.severity if one.quantity == "peak_force_N"]
        worst = max(forces, key=lambda one: one.upper, default=None)
        force = "" if worst is None else f"{worst.bearing} {worst.lower:.0f} to {worst.upper:.0f} N"
        lasted = "" if drop.duration is None else f"{drop.duration:.4g} s"
        record = f"{drop.record} (simulated)" if drop.simulated else drop.record
        table.add_row(
            str(number), drop.machine, drop.bearing_set, _day(drop), record,
            format_quantity(drop.speed, "speed"), lasted, force,
        )  # fmt: skip
    out.print(table)
    for share in shares:
        out.print(share)
    out.print(STATEMENT)
