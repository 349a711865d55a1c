"""Drops that a drop is compared with: estimates that are here, and entries of a log of drops."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from rotordrop.elements.table import LOADS
from rotordrop.errors import DamagedFileError, RotordropError, UsageError
from rotordrop.estimate.published import read_drop
from rotordrop.ledger.book import LoggedDrop, drop_of_estimate, logged_drops
from rotordrop.report.quantity import Quantity
from rotordrop.web.drawn import quantity_json
from rotordrop.web.running import result_folder
from rotordrop.web.workspace import Workspace

_KINDS = {"N": "force", "Pa": "pressure"}
_LABELS = {load.field: load.label for load in LOADS}


def compared_drops(space: Workspace, log: str | None) -> tuple[list[dict[str, Any]], str]:
    """Every drop with an estimate, and every drop of the log whose recording is not among them.

    Their numbers are those of the log: a number without an interval is no evidence. What is wrong with the
    log comes beside.
    """
    drops, seen, problem = [], set(), ""
    for job in space.jobs():
        # one that is removed meanwhile, or of nothing that can be compared, hides no other
        with suppress(FileNotFoundError, UsageError, DamagedFileError):
            folder = result_folder(job, "estimate", "document.json")
            if folder is not None:
                drop = _drop_of(folder)
                seen.add(drop.sha256)
                drops.append({**_told(drop), "job": job.number, "name": job.read()["name"]})
    logged: dict[int, LoggedDrop] = {}
    try:
        logged = {} if log is None else logged_drops(log)
    except RotordropError as error:
        problem = str(error)
    for number, drop in logged.items():
        if drop.sha256 not in seen:
            lines = f"from rotordrop.ledger.book import logged_drops\n\ndrop = logged_drops(LOG)[{number}]\n"
            drops.append({**_told(drop), "log": number, "name": drop.record, "python": lines})
    return drops, problem


@lru_cache(maxsize=512)
def _drop_of(folder: Path) -> LoggedDrop:
    return drop_of_estimate(read_drop(folder / "document.json"), "")


def _told(drop: LoggedDrop) -> dict[str, Any]:
    return {
        "machine": drop.machine,
        "recorded": drop.recorded,
        "method": drop.method,
        "verdict": drop.verdict,
        "speed": quantity_json(Quantity(value=drop.speed, kind="speed")),
        "numbers": [
            {
                "bearing": one.bearing,
                "quantity": _LABELS[one.quantity],
                "lower": one.lower,
                "upper": one.upper,
                **quantity_json(
                    Quantity(
                        value=math.nan if one.value is None else one.value,
                        kind=_KINDS[one.unit],
                        interval_90=(one.lower, one.upper),
                    )
                ),
            }
            for one in drop.severity
        ],
    }
