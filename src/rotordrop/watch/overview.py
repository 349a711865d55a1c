"""The overview of the fleet: one static page, sorted by what needs a person."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from rotordrop.errors import RotordropError
from rotordrop.files import require_file
from rotordrop.jobs.runner import published_run
from rotordrop.ledger.book import used_shares
from rotordrop.report.content import Column, Link, ReportContent, Section, Statement, table
from rotordrop.report.page import write_page
from rotordrop.report.quantity import Quantity
from rotordrop.units import format_minute
from rotordrop.watch.fleet import Fleet
from rotordrop.watch.kept import QUARANTINE, Kept, status_of
from rotordrop.watch.scalars import KINDS, NO_PEAKS, NOT_KNOWN, PEAKS, REPLACED, VERBS, shown_peak

MOST_ROWS = 300
"""Records of one table; chosen, not measured."""
RANKS = ("failed", "estimated", "quarantined", "looked", REPLACED)
"""Outcomes by how soon somebody should look where there is a reason to."""


def write_overview(kept: Kept, fleet: Fleet, log: str, file: Path) -> bool:
    """Write the page, on which is every machine of the fleet; true when that is done."""
    require_file(file, "remove it: the overview is written there")
    rows, counts = [], dict.fromkeys(RANKS, 0)
    last: dict[str, dict[str, Any]] = {}
    drops: dict[str, int] = {}
    for row in _records(kept):
        counts[row["outcome"]] += 1
        serial = row["machine"]
        if row["outcome"] == "estimated":
            drops[serial] = drops.get(serial, 0) + 1
            if serial not in last or row["when"] > last[serial]["when"]:
                last[serial] = row
        if row["needs_person"]:
            rows.append(row)
    rows.sort(key=lambda row: row["when"], reverse=True)
    rows.sort(key=lambda row: RANKS.index(row["outcome"]))
    doubtful = {row["machine"]: row["needs_person"] for row in reversed(rows) if row["machine"]}
    used = {}
    with suppress(RotordropError):  # no log yet, or one that is damaged: whoever reads it is told
        used = {(one.machine, one.bearing_set): one.sentence().partition(": ")[2] for one in used_shares(log)}
    machines = [
        {
            "serial": serial,
            "name": one.name,
            "drops": drops.get(serial, 0),
            "used": used.get((one.name, one.bearings), "no drop logged"),
            "needs_person": doubtful.get(serial, ""),
            **{key: last.get(serial, {}).get(key) for key in ("when", "record", "href", "scalars")},
        }
        for serial, one in fleet.machines.items()
    ]
    machines.sort(key=lambda row: (not row["needs_person"], -row["drops"], row["serial"]))
    write_page(_page(machines, rows, counts), file)
    return True


def _records(kept: Kept) -> Iterator[dict[str, Any]]:
    """Every record that is done, on a row of its own."""
    for number in kept.numbers():
        job = kept.job(number)
        status = status_of(job)
        if status is None or not status.get("done"):
            continue
        scalars = status.get("scalars") or {"record": number, "machine": "", "needs_person": status["why"]}
        arrived = datetime.fromtimestamp(status.get("mtime_ns", 0) / 1e9).isoformat(timespec="minutes")
        href = ""
        if status["outcome"] == "quarantined":
            href = f"{QUARANTINE}/{number}/why.txt"
        elif status["outcome"] == "estimated":
            run = published_run(job, VERBS["estimated"])
            href = "" if run is None else f"jobs/{number}/estimate.{run}/report.html"
        yield {
            "outcome": status["outcome"],
            "record": scalars["record"],
            "machine": scalars["machine"],
            "needs_person": scalars["needs_person"],
            "when": scalars.get("recorded") or arrived,
            "href": href,
            "scalars": scalars,
        }


def _page(
    machines: list[dict[str, Any]], rows: list[dict[str, Any]], counts: Mapping[str, int]
) -> ReportContent:
    said = ", ".join(f"{count} {outcome}" for outcome, count in counts.items() if count) or "none yet"
    grave = sum(row["outcome"] != "looked" for row in rows)
    first = Statement(f"Records that need a person: {len(rows)}.", "warning" if grave else "notice")
    if not rows:
        first = Statement("No record needs a person.", "good")
    force, stress = (
        Column(label, partial(_peak, name=name, unit=unit, kind=kind), kind)
        for label, (name, unit), kind in zip(LABELS, PEAKS, KINDS, strict=True)
    )
    fleet = table(
        machines,
        (
            Column("machine", lambda row: f"{row['serial']}, {row['name']}"),
            Column("needs a person", lambda row: row["needs_person"] or "–"),
            Column("last drop", lambda row: _linked(row) if row["record"] else "–"),
            Column("when", lambda row: format_minute(row["when"] or "")),
            force,
            stress,
            Column("log", lambda row: row["used"]),
        ),
        "Machines, those that need a person first",
        "Peaks are those of the last drop, at the bearing where each is largest, with their 90 % intervals.",
    )
    records = table(
        rows[:MOST_ROWS],
        (
            Column("record", _linked),
            Column("machine", lambda row: row["machine"] or NOT_KNOWN),
            Column("when", lambda row: format_minute(row["when"])),
            Column("outcome", lambda row: row["outcome"]),
            Column("why", lambda row: row["needs_person"]),
        ),
        f"Records that need a person{f', {MOST_ROWS} of {len(rows)}' if len(rows) > MOST_ROWS else ''}",
    )
    return ReportContent(
        title="Drops of the fleet",
        subtitle=f"Machines: {len(machines)}; as of {format_minute(datetime.now().isoformat())}",
        verdict=(first, Statement(f"Records: {said}.")),
        sections=(Section("Machines", tables=(fleet,)), Section("Needs a person", tables=(records,))),
    )


LABELS = ("peak force", "peak Hertz stress")


def _peak(row: Mapping[str, Any], name: str, unit: str, kind: str) -> Quantity:
    return shown_peak(row["scalars"] or NO_PEAKS, name, unit, kind)


def _linked(row: Mapping[str, Any]) -> str:
    return Link(row["record"], row["href"]) if row["href"] else row["record"]
