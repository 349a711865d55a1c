"""What the page draws: histories with their levels, and the content of the report as JSON.

Cards, sentences, tables and panels are those of the report; the page derives no number of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.arrays import Array
from rotordrop.files import write_json
from rotordrop.known import NINETY
from rotordrop.record.impacts import AFTER_LAST
from rotordrop.report.content import Table
from rotordrop.report.origin import Origin, UsedFile, command_line, now
from rotordrop.report.quantity import Quantity
from rotordrop.report.record_quality import unseen_in
from rotordrop.web.python_lines import course_lines, estimate_lines, look_lines, vector_lines, waterfall_lines
from rotordrop.web.rows import content_json, quantity_json, row_of, shown_units, table_json
from rotordrop.web.traces import write_traces
from rotordrop.web.workspace import Job

if TYPE_CHECKING:
    from rotordrop.estimate.estimate import Estimate
    from rotordrop.estimate.published import Drop
    from rotordrop.evidence.look import Look
    from rotordrop.evidence.quality.finding import Finding
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record
    from rotordrop.report.time_panels import Panel
    from rotordrop.spectrum.coast_down import CoastDownAnalysis
    from rotordrop.spectrum.orders import OrderTrack

MOST_PLACES = 200
"""Places of a line, and of the centre of the shaft, that are drawn [1]; chosen, not measured."""
MOST_ROWS, MOST_MARKS = 1500, 20_000
"""Vectors of an order, and passages of a mark, that are sent [1]; chosen, not measured."""
VECTORS = (1.0, 2.0)
"""Orders that are drawn as vectors: unbalance and bow, misalignment and stiffness that turns."""
TURN_OF_UNKNOWN_S = 0.02
"""Length of a turn where no speed is known [s]; chosen, not measured."""


def write_look(
    seen: Look, job: Job, made: Path, options: Mapping[str, Any], machine: Machine | None = None
) -> None:
    """Write what a look shows: motion of every plane with the speed, and its page as JSON."""
    from rotordrop.report.look_page import look_page
    from rotordrop.report.rotor_drawing import rotor_outline

    columns: dict[str, Array] = {}
    labels: dict[str, str] = {}
    for number, path in enumerate(seen.motion.paths):
        columns |= {f"x{number}": path.position[:, 0], f"y{number}": path.position[:, 1]}
        columns[f"r{number}"] = path.radius
        labels |= {f"{axis}{number}": f"{path.name} {axis} [m]" for axis in "xy"}
        labels[f"r{number}"] = f"{path.name} radius [m]"
    if seen.record.speed is not None:
        columns["speed"], labels["speed"] = seen.record.speed, "speed [rad/s]"
    write_traces(made, "motion", seen.motion.time, columns)
    content = look_page(seen, drawn=False)
    doubt = {path.name: path.wall.distance_error for path in seen.motion.paths}
    met: list[tuple[Any, float, tuple[float, float] | None, tuple[float, float] | None]] = [
        (hit, hit.depth, (hit.depth - doubt[hit.plane], hit.depth + doubt[hit.plane]), None)
        for hit in seen.impacts
    ]
    met += [(one, one.distance, None, one.approach_interval_90) for one in seen.contacts]
    impacts = [
        (
            one.plane,
            one.time,
            one.azimuth,
            Quantity(value=beyond, kind="length", interval_90=ends, digits=3),
            Quantity(value=one.approach, kind="velocity", interval_90=speeds, digits=3),
        )
        for one, beyond, ends, speeds in met
    ]
    write_json(made / "document.json", seen.as_json(), sealed=True)
    write_json(
        made / "page.json",
        {
            **content_json(content),
            **_common("motion", tuple(columns), seen.motion.time),
            "row": {
                "machine": "" if machine is None else machine.name,
                "recorded": seen.record.event_date,
                "sha256": seen.record.sha256,
                "simulated": seen.record.is_simulated,
                "speed": None
                if seen.speed is None
                else quantity_json(Quantity(value=seen.speed, kind="speed")),
            },
            "centreline": _centreline(seen),
            "marks": [] if seen.record.marks is None else seen.record.marks[:MOST_MARKS].tolist(),
            "rotor": None if machine is None else rotor_outline(machine),
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
                impacts,
                "beyond the air gap" if seen.drops else "from the usual place",
                "radial velocity before",
            ),
            "findings": _findings(seen.findings),
            "not_seen": seen.not_seen,
            "command": _command(job, options, "look"),
            "python": look_lines(job.read()["files"], options, len(seen.motion.paths)),
        },
    )


def write_estimate(
    estimate: Estimate,
    job: Job,
    made: Path,
    options: Mapping[str, Any],
    since: Drop | None = None,
) -> None:
    """Write what an estimate says: histories with bands, its document, its report, and its page as JSON."""
    from rotordrop.estimate.document import estimate_document
    from rotordrop.estimate.published import drop_of
    from rotordrop.ledger.book import drop_of_estimate
    from rotordrop.report.drop_sections import force_panel, stress_panel
    from rotordrop.report.estimate_page import assumed_card, estimate_page
    from rotordrop.report.machine_sections import weight_shares
    from rotordrop.report.page import write_page
    from rotordrop.report.restart_page import restart_page
    from rotordrop.report.rotor_drawing import rotor_outline

    card = assumed_card(estimate, since)
    content = estimate_page(estimate, _origin(job, options), since, card)
    names, grid, columns = histories_of(estimate)
    loads = weight_shares(estimate.machine)
    places = []
    for bearing, own in zip(estimate.bearings, names, strict=True):
        gap, peaks = bearing.air_gap, {"force": bearing.peak_force, "stress": bearing.peak_stress}
        shown = {
            kind: {"time": one.time, "value": one.value, "interval_90": one.interval_90}
            for kind, one in peaks.items()
        }
        ends = None if gap is None else [gap.lower, gap.upper]
        known = bearing.values.get("air_gap_m")
        level = "limits" if ends is None or known is None or list(known.interval_90 or ()) != ends else "90 %"
        places.append({"name": bearing.name, "gap": ends, "gap_is": level, **own, "peaks": shown})
    impacts = [
        (
            bearing.name,
            impact.peak_time,
            impact.azimuth,
            Quantity.of(impact.peak_force, "force"),
            Quantity.of(impact.impulse, "impulse", digits=3),
        )
        for bearing in estimate.bearings
        for impact, after in zip(bearing.impacts, bearing.after_flight, strict=True)
        if after  # the report lists every contact, and how many of them are impacts
    ]
    write_traces(made, "drop", grid, columns)
    write_page(content, made / "report.html")
    document = estimate_document(estimate)
    write_json(made / "document.json", document, sealed=True)
    drop = drop_of(document, estimate.record.name)
    write_json(
        made / "page.json",
        {
            **content_json(content),
            **_common("drop", tuple(columns), grid),
            "row": row_of(drop_of_estimate(drop, "")),
            "rotor": rotor_outline(estimate.machine),
            "labels": {column: _label(estimate, column) for column in columns},
            "timeline": _events(estimate),
            "findings": _findings(estimate.findings),
            "not_seen": " ".join(unseen_in(estimate.notes)),
            "zero": estimate.drop_instant.value,
            "speed": estimate.speed,
            "places": places,
            "panels": {
                "force": [_panel(force_panel(bearing, loads)) for bearing in estimate.bearings],
                "stress": [_panel(stress_panel(bearing)) for bearing in estimate.bearings],
            },
            **_impacts(impacts, "peak force", "impulse"),
            "assumptions": [one.sentence for one in content.assumptions],
            "restart": content_json(restart_page(card, drop)),
            "command": _command(job, options, "estimate"),
            "python": estimate_lines(job.read()["files"], options, [b.name for b in estimate.bearings]),
        },
    )


def _findings(found: Iterable[Finding]) -> list[dict[str, Any]]:
    return [
        {"severity": f.severity, "channel": f.channel, "message": f.message, "remedy": f.remedy}
        for f in found
    ]


def _label(estimate: Estimate, column: str) -> str:
    """A column as people name it, ``"force lower 0"`` by the bearing it is of and with its unit."""
    words, _, number = column.rpartition(" ")
    unit = {"force": "N", "stress": "Pa"}.get(words.partition(" ")[0], "m")
    return f"{estimate.bearings[int(number)].name} {words} [{unit}]"


def _events(estimate: Estimate) -> list[dict[str, Any]]:
    """What happened when, times [s] from power-off: the estimate knows better than the first look.

    A first touch has the interval of power-off and its own, by its timing or by the steps of the force. What
    has no interval is left out.
    """
    events = [(0.0, "power-off")]
    timed = [contact.timing_error for contact in estimate.replay.contacts] if estimate.replay else []
    for number, bearing in enumerate(estimate.bearings):
        if bearing.impacts:
            first = min(impact.start for impact in bearing.impacts)
            step = float(np.median(np.diff(bearing.force.time)))
            own = math.hypot(timed[number] if timed else 0.0, step / math.sqrt(12.0))
            low, high = estimate.drop_instant.interval_90
            half = math.hypot(0.5 * (high - low), NINETY * own)
            events.append((first, f"first touch at {bearing.name} (± {1e3 * half:.2g} ms)"))
        peak = bearing.peak_force
        for time, between, words in (
            (
                bearing.contact_from,
                bearing.contact_from_interval_90,
                f"last impact at {bearing.name}, {AFTER_LAST}",
            ),
            (peak.time, peak.time_interval_90, f"largest force at {bearing.name}"),
        ):
            if time is not None and between is not None:
                early, late = (1e3 * abs(end - time) for end in between)
                events.append((time, f"{words} (−{early:.2g}, +{late:.2g} ms)"))
    return [{"time": time, "words": words} for time, words in sorted(events) if math.isfinite(time)]


def field_name(plane: int, part: str) -> str:
    """File of the amplitudes of one waterfall."""
    return f"field {plane} {part}.f4"


def write_waterfall(
    found: CoastDownAnalysis,
    machine: Machine,
    record: Record,
    job: Job,
    made: Path,
    options: Mapping[str, Any],
) -> None:
    """Write the frequencies of a coast-down: waterfalls and lines, their document, and their report."""
    from rotordrop.report.content import SIMULATED_RECORD
    from rotordrop.report.page import write_page
    from rotordrop.report.waterfall_page import waterfall_page

    content = waterfall_page(
        found,
        title=f"Frequencies of a coast-down of {machine.name}",
        facts=(
            ("machine", machine.name),
            ("record", f"{record.path.name if record.path else record.name}"),
            ("SHA-256", record.sha256),
            ("centre of the bearings", found.signal.centre),
            *_origin(job, options, "waterfall").facts(record.sha256),
        ),
        simulated=SIMULATED_RECORD if record.is_simulated else "",
    )
    write_page(content, made / "report.html")
    write_json(made / "document.json", found.as_json(), sealed=True)
    write_json(made / "page.json", {**content_json(content), **_falls(found, job, made, options)})


def _falls(found: CoastDownAnalysis, job: Job, made: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Write the amplitudes of every waterfall, and tell what the page draws over them."""
    from rotordrop.report.waterfall_figure import DRAWN_ORDERS, highest_shown
    from rotordrop.report.waterfall_page import seen_of, where_of

    planes = list(found.planes)
    falls = found.planes[planes[0]].waterfalls
    if not falls:
        return {"planes": planes, "parts": []}
    for number, plane in enumerate(found.planes.values()):
        for fall in plane.waterfalls:
            (made / field_name(number, fall.component)).write_bytes(fall.amplitude.astype("<f4").tobytes())
    parts = sorted((fall.component for fall in falls), key=("full", "y", "x").index)
    speed = falls[0].speed
    return {
        "version": __version__,
        "units": shown_units(),
        "planes": planes,
        "parts": parts,
        "time": falls[0].time.tolist(),
        "frequency": {fall.component: fall.frequency.tolist() for fall in falls},
        "speed": None if speed is None else (speed / (2.0 * math.pi)).tolist(),
        "orders": list(DRAWN_ORDERS),
        "highest": highest_shown(found),
        "amplitude_kind": falls[0].amplitude_kind,
        "lines": [
            {
                "label": line.label,
                "named": line.named,
                "kind": line.kind,
                "where": where_of(line),
                "frequency": line.frequency,
                "amplitude": quantity_json(Quantity(value=line.amplitude, kind="length", digits=3)),
                "confidence": quantity_json(Quantity(value=line.confidence, kind="probability")),
                "reason": line.reason,
                "planes": list(line.forward),
                "seen": seen_of(line, found.lines),
                "python": course_lines(line.label),
                "frames": [
                    float(value) if math.isfinite(value) else None
                    for value in _on(falls[0].time, line.path.time, line.path.frequency)
                ],
                "path": {
                    "time": line.path.time[:: max(len(line.path.time) // MOST_PLACES, 1)].tolist(),
                    "frequency": line.path.frequency[:: max(len(line.path.time) // MOST_PLACES, 1)].tolist(),
                },
            }
            for line in found.lines
        ],
        "command": _command(job, options, "waterfall"),
        "orders_tracked": {
            name: vectors_of(plane.track) | {"python": vector_lines(name)}
            for name, plane in found.planes.items()
            if plane.track
        },
        "python": waterfall_lines(job.read()["files"], options, planes, parts),
    }


def vectors_of(track: OrderTrack) -> dict[str, Any]:
    """Vectors of 1X and 2X over the speed: real and imaginary parts in x and y with their standard error [m].

    Where a steady line lies too close to an order the vector would hold both: it is left out.
    """
    every = slice(None, None, max(len(track.time) // MOST_ROWS, 1))
    told: dict[str, Any] = {
        "time": track.time[every].tolist(),
        "speed": track.speed[every].tolist(),
        "orders": {},
    }
    for order in VECTORS:
        column = track.of(order)
        vector = np.where(track.separable[:, column, None], track.amplitude[:, column], np.nan)[every]
        error = track.standard_error[every, column]
        parts = np.stack([vector.real, vector.imag], axis=-1)
        told["orders"][f"{order:g}"] = {
            axis: [
                [None if math.isnan(v) else float(f"{v:.6g}") for v in (*parts[row, k], error[row, k])]
                for row in range(len(parts))
            ]
            for k, axis in enumerate("xy")
        }
    return told


def _centreline(seen: Look) -> dict[str, Any]:
    """Where the shaft centre is on average: means of stretches of a turn at release or more [m]."""
    time, speed = seen.motion.time, seen.record.speed
    rate = (len(time) - 1) / float(time[-1] - time[0])
    turn = TURN_OF_UNKNOWN_S if not seen.speed else 2.0 * math.pi / seen.speed
    size = max(round(turn * rate), len(time) // MOST_PLACES, 1)
    starts = np.arange(0, len(time) - size + 1, size)

    def means(values: Array) -> list[float | None]:
        sums = [
            float(np.nanmean(values[a : a + size])) if np.isfinite(values[a : a + size]).any() else None
            for a in starts
        ]
        return [None if one is None else float(f"{one:.6g}") for one in sums]

    return {
        "time": means(time),
        "speed": None if speed is None else means(speed),
        "planes": [
            {"x": means(path.position[:, 0]), "y": means(path.position[:, 1])} for path in seen.motion.paths
        ],
    }


def _command(job: Job, options: Mapping[str, Any], verb: str) -> str:
    """The command that does the same as the page with the files of a job."""
    told = job.read()["files"]
    order = ("record", "machine") if verb == "look" else ("machine", "record")
    words = [verb, *(told[role]["name"] for role in order if role in told)]
    words += ["--tail", told["tail"]["name"]] if "tail" in told and verb == "estimate" else []
    words += ["--profile", told["profile"]["name"]] if "profile" in told else []
    if verb == "look":
        for name in ("gap", "speed"):
            words += [f"--{name}", options[name]] if options.get(name) else []
        for plane in filter(None, map(str.strip, options.get("planes", "").split(";"))):
            words += ["--map", plane]
    if verb == "estimate":
        words += ["--method", "replay"] if options.get("method") == "replay" else []
        words += ["--quick"] if options.get("quick") else []
    return command_line(words)


def _origin(job: Job, options: Mapping[str, Any], verb: str = "estimate") -> Origin:
    from rotordrop.simulate.fingerprint import fingerprint

    named = {"machine": "machine file"}
    return Origin(
        command=_command(job, options, verb),
        operator=str(options.get("operator", "")),
        files=tuple(
            UsedFile(role=named.get(role, role.split(" ")[0]), name=file["name"], sha256=file["sha256"])
            for role, file in job.read()["files"].items()
        ),
        made=now(),
        fingerprint=fingerprint(),
    )


def _common(name: str, columns: tuple[str, ...], time: Array) -> dict[str, Any]:
    return {
        "version": __version__,
        "traces": {"name": name, "columns": list(columns), "start": float(time[0]), "end": float(time[-1])},
        "units": shown_units(),
    }


def histories_of(estimate: Estimate) -> tuple[list[dict[str, Any]], Array, dict[str, Array]]:
    """Every history of an estimate on the clock of its force, and which column of a bearing is what.

    Where a history has a clock of its own it is read off between its samples by straight lines.
    """
    grid = np.asarray(estimate.bearings[0].force.time)
    columns: dict[str, Array] = {}
    names: list[dict[str, Any]] = []
    for b, bearing in enumerate(estimate.bearings):
        told: dict[str, Any] = {"labels": {}}
        for motion in bearing.motions:
            role = "measured" if motion.role == "measured" else "estimated"
            if role in told:
                continue
            told[role] = [f"{axis} {role} {b}" for axis in "xy"]
            told["labels"][role] = motion.label
            for column, history in zip(told[role], (motion.horizontal, motion.vertical), strict=True):
                columns[column] = _on(grid, history.time, history.values)
        if {"measured", "estimated"} <= told.keys():
            told["residual"] = [f"{axis} residual {b}" for axis in "xy"]
            for axis, column in zip("xy", told["residual"], strict=True):
                columns[column] = columns[f"{axis} measured {b}"] - columns[f"{axis} estimated {b}"]
        for kind, history, band in (
            ("force", bearing.force, bearing.force_band),
            ("stress", bearing.stress, bearing.stress_band),
        ):
            told[kind] = [f"{kind} {b}"]
            columns[f"{kind} {b}"] = _on(grid, history.time, history.values)
            if band is not None:
                told[kind] += [f"{kind} lower {b}", f"{kind} upper {b}"]
                columns[f"{kind} lower {b}"] = _on(grid, band.time, band.lower)
                columns[f"{kind} upper {b}"] = _on(grid, band.time, band.upper)
        names.append(told)
    return names, grid, columns


def _on(grid: Array, time: Array, values: Array) -> Array:
    if len(time) == len(grid) and np.array_equal(time, grid):
        return values
    return np.asarray(np.interp(grid, time, values, left=math.nan, right=math.nan))


def _panel(panel: Panel) -> dict[str, Any]:
    return {
        "title": panel.title,
        "axis": panel.axis,
        "origin": panel.histories[0].label,
        "band": None if panel.band is None else panel.band.label,
        "levels": [{"name": name, "value": value} for name, value in panel.levels],
    }


def _impacts(found: Iterable[tuple[str, float, float, Quantity, Quantity]], *columns: str) -> dict[str, Any]:
    """Impacts in the order of time: place, time [s], azimuth [rad], and numbers as a table has them."""
    ordered = sorted(found, key=lambda one: one[1])
    shown = table_json(Table(columns, tuple(one[3:] for one in ordered)))
    impacts = [
        {"place": place, "time": time, "azimuth": azimuth, "numbers": numbers}
        for (place, time, azimuth, *_), numbers in zip(ordered, shown["rows"], strict=True)
    ]
    return {"impacts": impacts, "impact_columns": shown["columns"]}
