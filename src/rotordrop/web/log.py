"""The log of drops as the page shows it, and how a drop of the page gets in and out."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from rotordrop.errors import RotordropError, UsageError
from rotordrop.estimate.published import read_drop
from rotordrop.ledger import book
from rotordrop.report.quantity import Quantity
from rotordrop.web.rows import quantity_json, row_of, shown_units
from rotordrop.web.running import result_folder
from rotordrop.web.workspace import Job

FIRST_SET = "1"
"""What the first set of bearings of a machine is called, as by 'rotordrop log add'."""


def log_told(log: str, own: bool) -> dict[str, Any]:
    """All that a log holds, written as the page shows it; what is wrong with it stands beside."""
    name = book.name_of(log) if book.is_url(log) else Path(log).name
    told: dict[str, Any] = {
        "name": name,
        "drops": [],
        "used": [],
        "trends": [],
        "problem": "",
        "statement": book.STATEMENT,
        "units": shown_units(),
    }
    if own and not Path(log).exists():
        return told
    try:
        whole = book.read_log(log)
        for number, drop in whole.drops.items():
            lines = (
                f"from rotordrop.ledger.book import logged_drops\n\ndrop = logged_drops({name!r})[{number}]\n"
            )
            lasted = (
                quantity_json(Quantity(value=drop.duration, kind="duration"))
                if drop.duration is not None
                else None
            )
            about = {"log": number, "name": drop.record, "bearings": drop.bearing_set, "added": drop.added}
            told["drops"].append(
                {**row_of(drop), **about, "cause": drop.cause, "duration": lasted, "python": lines}
            )
        told["used"] = [
            {
                "machine": one.machine,
                "bearings": one.bearing_set,
                "drops": one.drops,
                "allowed": one.allowed_drops,
                "passed": (one.drops_passed_at or one.seconds_passed_at) is not None,
                "sentence": one.sentence(),
            }
            for one in book.used_shares(whole)
        ]
        told["trends"] = [one.sentence() for one in book.trends(whole)]
    except RotordropError as error:
        told["problem"] = str(error)
    return told


def add_to_log(job: Job, log: str) -> dict[str, Any]:
    """Add the estimate of a drop to the log, with the set of bearings that its machine had last."""
    folder = result_folder(job, "estimate", "document.json")
    if folder is None:
        raise UsageError("only a drop whose force is estimated can be logged; make an estimate first")
    drop = read_drop(folder / "document.json")
    bearings = job.read().get("label", {}).get("bearings")
    if not bearings:
        logged: dict[int, book.LoggedDrop] = {}
        with suppress(UsageError):  # it has not been begun; what else is wrong, adding says
            logged = book.logged_drops(log, machine=drop.machine)
        bearings = [FIRST_SET, *(one.bearing_set for one in logged.values())][-1]
    return {"number": book.add_drop(log, book.drop_of_estimate(drop, bearings)), "bearings": bearings}


def take_out_of_log(job: Job, log: str) -> None:
    """Take every entry of the record of a drop out of the log."""
    sha256 = job.read()["files"].get("record", {}).get("sha256")
    numbers = [number for number, drop in book.logged_drops(log).items() if sha256 and drop.sha256 == sha256]
    if not numbers:
        raise UsageError("the log has no entry of this record")
    for number in numbers:
        book.remove_drop(log, number)
