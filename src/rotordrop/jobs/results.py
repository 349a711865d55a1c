"""What a computation leaves: its report, its document, histories to draw, and their page as JSON.

Sentences and numbers are those of the report, in both systems of units; the page derives none of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotordrop.arrays import Array
from rotordrop.estimate.histories import Column, columns_of, finest_time, quantity_of
from rotordrop.evidence.impacts import AFTER_LAST
from rotordrop.files import write_json
from rotordrop.jobs.traces import write_traces
from rotordrop.known import NINETY
from rotordrop.report.content import SIMULATED_RECORD, Statement, Table
from rotordrop.report.origin import Origin, UsedFile, command_line, machine_facts
from rotordrop.report.page import write_page
from rotordrop.report.quantity import Quantity, System, display_unit

if TYPE_CHECKING:
    from rotordrop.estimate.estimate import Estimate
    from rotordrop.estimate.published import Drop
    from rotordrop.evidence.look import Look
    from rotordrop.jobs.workspace import Job
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record
    from rotordrop.report.style import Panel
    from rotordrop.spectrum.coast_down import CoastDownAnalysis

Met = tuple[str, float, float, Quantity, Quantity]
"""An impact: place, time [s], azimuth [rad], and two numbers of it."""
SYSTEMS: tuple[System, ...] = ("SI", "US")
SHOWN_KINDS = ("length", "force", "pressure", "speed")


def write_look(seen: Look, machine: Machine | None, job: Job, made: Path, options: Mapping[str, Any]) -> None:
    """Write what a look shows: motion of every plane with the speed, its report and its page as JSON."""
    from rotordrop.report.look_page import look_page

    columns: dict[str, Array] = {}
    labels: dict[str, str] = {}
    for number, path in enumerate(seen.motion.paths):
        curves = {"x": path.position[:, 0], "y": path.position[:, 1], "radius": path.radius}
        columns |= {f"{name[0]}{number}": values for name, values in curves.items()}
        labels |= {f"{name[0]}{number}": f"{path.name} {name} [m]" for name in curves}
    if seen.record.speed is not None:
        columns["speed"], labels["speed"] = seen.record.speed, "speed [rad/s]"
    write_traces(made, "motion", seen.motion.time, columns)
    content = look_page(seen, machine)
    write_page(content, made / "report.html", _origin(job, options, "look"))
    write_json(made / "document.json", seen.as_json(), sealed=True)
    stop = next((one for one in seen.findings if one.severity == "stop"), None)
    said = content.verdict[0] if stop is None else Statement(f"{stop.message}; {stop.remedy}", "bad")
    doubt = {path.name: path.wall.distance_error for path in seen.motion.paths}
    impacts = [
        _met(hit, hit.depth, (hit.depth - doubt[hit.plane], hit.depth + doubt[hit.plane]), None)
        for hit in seen.impacts
    ]
    impacts += [_met(one, one.distance, None, one.approach_interval_90) for one in seen.contacts]
    row = {
        "machine": "" if machine is None else machine.name,
        "recorded": seen.record.event_date,
        "simulated": seen.record.is_simulated,
        "falls": bool(seen.drops),
        "speed": quantity_json(Quantity(value=math.nan if seen.speed is None else seen.speed, kind="speed")),
    }
    write_json(
        made / "page.json",
        {
            **_common("motion", tuple(columns), seen.motion.time, said, row),
            "simulated": content.simulated,
            "labels": labels,
            "counted_from": content.counted_from,
            "zero": seen.drops[0].release if seen.drops else float(seen.motion.time[0]),
            "places": [
                {
                    "name": path.name,
                    "gap": list(path.wall.interval_90) if math.isfinite(path.gap) else None,
                    "gap_is": "90 %",
                    "measured": [f"x{b}", f"y{b}"],
                    "radius": f"r{b}",
                }
                for b, path in enumerate(seen.motion.paths)
            ],
            "timeline": [{"time": time, "words": words} for time, words in seen.timeline()],
            **_impacts(
                sorted(impacts, key=lambda one: one[1]),
                "beyond the air gap" if seen.drops else "from the usual place",
                "radial velocity before",
            ),
        },
    )


def write_estimate(estimate: Estimate, job: Job, made: Path, options: Mapping[str, Any]) -> None:
    """Write what an estimate says: histories with bands, its document, its report, and its page as JSON."""
    from rotordrop.estimate.document import published_drop
    from rotordrop.report.drop_sections import force_panel, stress_panel
    from rotordrop.report.estimate_page import estimate_page
    from rotordrop.report.machine_content import weight_shares
    from rotordrop.simulate.result import fingerprint

    content = estimate_page(estimate)
    names, grid, columns = histories_of(estimate)
    loads = weight_shares(estimate.machine)
    places = []
    for bearing, own in zip(estimate.bearings, names, strict=True):
        gap, peak = bearing.air_gap, bearing.peak_force
        ends = None if gap is None else [gap.lower, gap.upper]
        known = bearing.values.get("air_gap_m")
        level = "limits" if ends is None or known is None or list(known.interval_90 or ()) != ends else "90 %"
        shown = {"time": peak.time, "value": peak.value}
        places.append({"name": bearing.name, "gap": ends, "gap_is": level, **own, "peak_force": shown})
    contacts = sorted(
        ((b.name, *one) for b in estimate.bearings for one in zip(b.impacts, b.after_flight, strict=True)),
        key=lambda row: -row[1].peak_force.value,
    )
    met = [
        (
            name,
            one.peak_time,
            one.azimuth,
            Quantity.of(one.peak_force, "force"),
            Quantity.of(one.impulse, "impulse", digits=3),
        )
        for name, one, _ in contacts
    ]
    listed = _impacts(met, "peak force", "impulse")
    for row, (*_, after) in zip(listed["impacts"], contacts, strict=True):
        row["impact"] = after
    write_traces(made, "drop", grid, {name: column.values for name, column in columns.items()})
    origin = replace(_origin(job, options, "estimate"), fingerprint=fingerprint())
    write_page(content, made / "report.html", origin)
    published = published_drop(estimate)
    write_json(made / "document.json", published.as_json(), sealed=True)
    row = {
        "machine": estimate.machine.name,
        "recorded": estimate.record.event_date,
        "simulated": estimate.simulated_record,
        "speed": quantity_json(Quantity(value=estimate.speed, kind="speed")),
        "force": _largest(estimate, published, "peak_force_N", "force"),
        "stress": _largest(estimate, published, "peak_stress_Pa", "pressure"),
    }
    write_json(
        made / "page.json",
        {
            **_common("drop", tuple(columns), grid, content.verdict[0], row),
            "simulated": content.simulated,
            "headline": [
                {
                    "name": bearing.name,
                    "label": card.figures[0].label.lower(),
                    "number": quantity_json(card.figures[0].value),
                }
                for bearing, card in zip(estimate.bearings, content.cards, strict=True)
            ],
            "labels": {name: column.label for name, column in columns.items()},
            "timeline": _events(estimate),
            "zero": estimate.drop_instant.value,
            "speed": estimate.speed,
            "places": places,
            "panels": {
                "force": [_panel(force_panel(bearing, loads)) for bearing in estimate.bearings],
                "stress": [_panel(stress_panel(bearing)) for bearing in estimate.bearings],
            },
            **listed,
        },
    )


def write_waterfall(
    found: CoastDownAnalysis,
    machine: Machine,
    record: Record,
    job: Job,
    made: Path,
    options: Mapping[str, Any],
) -> None:
    """Write the frequencies of a coast-down: their report and their document."""
    from rotordrop.report.waterfall_page import waterfall_page

    content = waterfall_page(
        found,
        title=f"Frequencies of a coast-down of {machine.name}",
        facts=(*machine_facts(machine), ("centre of the bearings", found.signal.centre)),
        simulated=SIMULATED_RECORD if record.is_simulated else "",
    )
    write_page(content, made / "report.html", _origin(job, options, "waterfall"))
    write_json(made / "document.json", found.as_json(), sealed=True)


def write_check(machine: Machine, job: Job, made: Path, options: Mapping[str, Any]) -> None:
    """Write what a machine amounts to: its report and its document."""
    from rotordrop.report.critical_speeds_page import machine_page
    from rotordrop.rotor.machine_summary import machine_json, machine_warnings, summarise_machine

    summary = summarise_machine(machine)
    warnings = machine_warnings(machine, summary)
    content = machine_page(machine, summary, warnings)
    write_page(content, made / "report.html", _origin(job, options, "check"))
    write_json(made / "document.json", machine_json(machine, summary, warnings), sealed=True)


def _met(
    one: Any, beyond: float, ends: tuple[float, float] | None, speeds: tuple[float, float] | None
) -> Met:
    depth = Quantity(value=beyond, kind="length", interval_90=ends, digits=3)
    approach = Quantity(value=one.approach, kind="velocity", interval_90=speeds, digits=3)
    return one.plane, one.time, one.azimuth, depth, approach


def _common(
    name: str, columns: tuple[str, ...], time: Array, said: Statement, row: Mapping[str, Any]
) -> dict[str, Any]:
    statement = {"text": said.sentence, "level": said.level}
    return {
        "traces": {"name": name, "columns": list(columns), "start": float(time[0]), "end": float(time[-1])},
        "units": shown_units(),
        "statement": statement,
        "row": {**row, "statement": statement},
    }


def _largest(estimate: Estimate, drop: Drop, field: str, kind: str) -> dict[str, Any] | None:
    """The largest peak over the bearings; without an interval it is no evidence."""
    name, one = drop.largest(field)
    if one.interval is None:
        return None
    peak: Any = estimate.bearing(name).numbers[field]
    return {
        "bearing": name,
        "interval_90": list(one.interval),
        **quantity_json(Quantity.of(peak.known, kind)),
    }


def _events(estimate: Estimate) -> list[dict[str, Any]]:
    """What happened when, times [s] from power-off: the estimate knows better than the first look.

    A first touch has the interval of power-off and its own, by its timing or by the samples of the record.
    What has no interval is left out.
    """
    events = [(0.0, "power-off")]
    timed = [contact.timing_error for contact in estimate.replay.contacts] if estimate.replay else []
    for number, bearing in enumerate(estimate.bearings):
        if bearing.impacts:
            first = min(impact.start for impact in bearing.impacts)
            own = timed[number] if timed else 1.0 / (math.sqrt(12.0) * estimate.record.sampling_rate)
            low, high = estimate.drop_instant.interval_90
            half = math.hypot(0.5 * (high - low), NINETY * own)
            events.append((first, f"first touch at {bearing.name} (± {1e3 * half:.2g} ms)"))
        if bearing.contact_from is not None:
            events.append((bearing.contact_from, f"last impact at {bearing.name}, {AFTER_LAST}"))
        peak = bearing.peak_force
        if peak.time_interval_90 is not None:
            off = [1e3 * abs(end - peak.time) for end in peak.time_interval_90]
            early, late = (f"{time:.2g}" if time < 99.5 else f"{time:.0f}" for time in off)
            events.append((peak.time, f"largest force at {bearing.name} (−{early}, +{late} ms)"))
    return [{"time": time, "words": words} for time, words in sorted(events) if math.isfinite(time)]


def _origin(job: Job, options: Mapping[str, Any], verb: str) -> Origin:
    """Where the report of a job comes from, with the command that does the same with its files."""
    told, named = job.read()["files"], {"machine": "machine file"}
    words = [verb, *(told[role]["name"] for role in ("machine", "record") if role in told)]
    words += ["--tail", told["tail"]["name"]] if "tail" in told and verb == "estimate" else []
    words += ["--profile", told["profile"]["name"]] if "profile" in told else []
    if verb == "estimate":
        words += ["--method", "replay"] if options.get("method") == "replay" else []
        words += ["--quick"] if options.get("quick") else []
    return Origin(
        command=command_line(words),
        operator=str(options.get("operator", "")),
        files=tuple(
            UsedFile(role=named.get(role, role.split(" ")[0]), name=file["name"], sha256=file["sha256"])
            for role, file in told.items()
        ),
    )


def histories_of(estimate: Estimate) -> tuple[list[dict[str, Any]], Array, dict[str, Column]]:
    """Every history of an estimate on the clock of its force, and which column of a bearing is what."""
    grid, names, columns = finest_time(estimate), list[dict[str, Any]](), dict[str, Column]()
    for b, bearing in enumerate(estimate.bearings):
        own = {one.quantity: one for one in columns_of(bearing, estimate.machine, grid)}
        motions = {
            "measured" if one.role == "measured" else "estimated": one for one in bearing.motions[::-1]
        }
        parts = {role: [f"{quantity_of(one)}_{axis}" for axis in "xy"] for role, one in motions.items()}
        for kind in ("force", "stress"):
            parts[kind] = [one for one in (kind, f"{kind}_lower", f"{kind}_upper") if one in own]
        labels = {role: one.label for role, one in motions.items()}
        names.append({"labels": labels, **{part: [f"{q} {b}" for q in of] for part, of in parts.items()}})
        columns |= {f"{q} {b}": own[q] for of in parts.values() for q in of}
    return names, grid, columns


def _panel(panel: Panel) -> dict[str, Any]:
    return {
        "origin": panel.histories[0].label,
        "band": None if panel.band is None else panel.band.label,
        "levels": [{"name": name, "value": value} for name, value in panel.levels],
    }


def _impacts(found: Sequence[Met], *columns: str) -> dict[str, Any]:
    """Impacts with their numbers as a table has them."""
    heads, rows = columns_json(columns, [one[3:] for one in found])
    impacts = [
        {"place": place, "time": time, "azimuth": azimuth, "numbers": numbers}
        for (place, time, azimuth, *_), numbers in zip(found, rows, strict=True)
    ]
    return {"impacts": impacts, "impact_columns": heads}


def quantity_json(quantity: Quantity) -> dict[str, Any]:
    """A number as it is [SI] and as it is written, with its interval."""
    finite = math.isfinite(quantity.value) and not quantity.range_only
    told: dict[str, Any] = {"value": quantity.value if finite else None, "kind": quantity.kind}
    for system in SYSTEMS:
        shown = replace(quantity, system=system)
        told[system] = [shown.levelled, shown.interval_text]
    return told


def columns_json(
    heads: Sequence[str], rows: Sequence[Sequence[Quantity]]
) -> tuple[list[dict[str, str]], list[list[dict[str, Any]]]]:
    """Columns of numbers: headings with the unit that a column shares, and rows of numbers without it."""
    told = [[quantity_json(cell) for cell in row] for row in rows]
    above: dict[str, Sequence[str]] = {}
    for system in SYSTEMS:
        cells = (tuple(replace(cell, system=system) for cell in row) for row in rows)
        shown = Table(tuple(heads), tuple(cells)).with_units_above()
        above[system] = shown.columns
        for one, row in zip(told, shown.rows, strict=True):
            for cell, number in zip(one, row, strict=True):
                assert isinstance(number, Quantity)
                cell[system] = [number.levelled, number.interval_text]
    return [{system: above[system][k] for system in SYSTEMS} for k in range(len(heads))], told


def shown_units() -> dict[str, Any]:
    """What the page divides by [SI] and writes behind a number, by kind and system of units."""
    return {kind: {system: display_unit(kind, system) for system in SYSTEMS} for kind in SHOWN_KINDS}
