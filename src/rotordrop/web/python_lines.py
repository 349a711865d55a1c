"""The lines of Python that make the numbers and curves of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Files = Mapping[str, Mapping[str, Any]]


def look_lines(files: Files, options: Mapping[str, Any], planes: int) -> dict[str, str]:
    """Lines for every figure of a look."""
    imports = ["from rotordrop import look"]
    given = [repr(files["record"]["name"])]
    if "machine" in files:
        imports = ["from rotordrop import load_machine, look"]
        given.append(f"machine=load_machine({files['machine']['name']!r})")
    if options.get("gap") or options.get("speed"):
        imports[0] += ", parse_quantity"
    for name, kind in (("gap", "length"), ("speed", "speed")):
        if options.get(name):
            given.append(f"{name}=parse_quantity({options[name]!r}, {kind!r})")
    head = [*imports, "", f"seen = look({', '.join(given)})"]
    tail = {
        "overview": "time, radius = seen.motion.time, [p.radius for p in seen.motion.paths]  # [s], [m]",
        "impacts": "impacts = [(i.plane, i.time, i.azimuth, i.depth) for i in seen.impacts]  # s, rad, m",
    }
    for number in range(planes):
        motion = f"time, motion = seen.motion.time, seen.motion.paths[{number}].position  # [s], [m]"
        tail |= {f"motion {number}": motion, f"orbit {number}": motion}
    return {figure: "\n".join([*head, line, ""]) for figure, line in tail.items()}


def estimate_lines(files: Files, options: Mapping[str, Any], bearings: Sequence[str]) -> dict[str, str]:
    """Lines for every figure of an estimate."""
    replayed = options.get("method") == "replay"
    imports = "from rotordrop import estimate_drop, load_machine, read_record"
    lines = [imports]
    extra = ""
    if replayed or options.get("quick"):
        lines.append(f"from rotordrop.estimation import {'Replay' if replayed else 'Tracked'}")
        extra = f", method={'Replay()' if replayed else 'Tracked(quick=True)'}"
    lines += ["", f"machine = load_machine({files['machine']['name']!r})"]
    lines.append(f"record = read_record({files['record']['name']!r}, machine)")
    tail = "None"
    if "tail" in files:
        lines.append(f"tail = read_record({files['tail']['name']!r}, machine)")
        tail = "tail"
    lines.append(f"estimate = estimate_drop(machine, record, {tail}{extra})")
    last = {
        kind: f"{kind} = {{b.name: (b.{kind}.time, b.{kind}.values) for b in estimate.bearings}}  # s, {unit}"
        for kind, unit in (("force", "N"), ("stress", "Pa"))
    }
    last["impacts"] = (
        "impacts = [(b.name, i.peak_time, i.azimuth, i.peak_force.value) for b in estimate.bearings "
        "for i in b.impacts]  # [s], [rad], [N]"
    )
    for number, name in enumerate(bearings):
        motion = f"motions = estimate.bearing({name!r}).motions  # each .time [s] and .displacement [m]"
        last |= {f"motion {number}": motion, f"orbit {number}": motion}
    return {figure: "\n".join([*lines, line, ""]) for figure, line in last.items()}


def waterfall_lines(files: Files, planes: Sequence[str], parts: Sequence[str]) -> dict[str, str]:
    """Lines for every waterfall of a coast-down."""
    head = [
        "from rotordrop import load_machine, read_record",
        "from rotordrop.estimation.recorded_coast_down import recorded_coast_down, with_found_air_gaps",
        "from rotordrop.spectrum.coast_down import analyse_coast_down",
        "from rotordrop.spectrum.machine_candidates import machine_candidates",
        "",
        f"machine = load_machine({files['machine']['name']!r})",
        f"record = read_record({files['record']['name']!r}, machine)",
        "signal = recorded_coast_down(machine, record)",
        "planes = {name: name for name in signal.planes}",
        "candidates = machine_candidates(with_found_air_gaps(machine, signal), planes)",
        "found = analyse_coast_down(signal, candidates)",
        "lines = [(line.label, line.frequency, line.amplitude) for line in found.lines]  # [Hz], [m]",
    ]
    return {
        f"{number} {part}": "\n".join(
            [
                *head,
                f"fall = next(f for f in found.planes[{name!r}].waterfalls if f.component == {part!r})",
                "time, frequency, amplitude = fall.time, fall.frequency, fall.amplitude  # [s], [Hz], [m]",
                "",
            ]
        )
        for number, name in enumerate(planes)
        for part in parts
    }
