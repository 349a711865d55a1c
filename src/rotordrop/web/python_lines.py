"""The lines of Python that make the numbers and curves of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Files = Mapping[str, Mapping[str, Any]]

_ROTOR = """from rotordrop import load_machine

machine = load_machine({machine!r})
nodes = machine.rotor.node_positions  # [m]
bearings = {{part.name: nodes[part.node - 1] for part in machine.touchdown_bearings}}  # [m]
sensors = {{part.name: nodes[part.node - 1] for part in machine.sensors}}  # [m]
"""
_WATERFALL = """from rotordrop import load_machine, read_record
from rotordrop.estimate.recorded_coast_down import recorded_coast_down, with_found_air_gaps
from rotordrop.spectrum.coast_down import analyse_coast_down
from rotordrop.spectrum.machine_candidates import machine_candidates
{rules}
machine = load_machine({machine!r})
record = read_record({record!r}, machine{by_rules})
signal = recorded_coast_down(machine, record)
planes = {{name: name for name in signal.planes}}
candidates = machine_candidates(with_found_air_gaps(machine, signal), planes)
found = analyse_coast_down(signal, candidates)
lines = [(line.label, line.frequency, line.amplitude) for line in found.lines]  # [Hz], [m]
fall = next(f for f in found.planes[{plane!r}].waterfalls if f.component == {part!r})
time, frequency, amplitude = fall.time, fall.frequency, fall.amplitude  # [s], [Hz], [m]
"""
_COURSE = """import numpy as np
line = next(line for line in found.lines if line.label == {label!r})
path = np.interp(time, line.path.time, line.path.frequency, left=np.nan, right=np.nan)
sides = (1, -1) if fall.component == 'full' else (1,)
bins = [[abs(frequency - s * f).argmin() + k for s in sides for k in (-1, 0, 1)] for f in path]
course = [amplitude[row, near].max() if np.isfinite(f) else np.nan \
for row, (near, f) in enumerate(zip(bins, path))]  # [m]
"""

_VECTORS = """import numpy as np
track = found.planes[{plane!r}].track
vectors = {{order: np.where(track.separable[:, track.of(order), None], track.amplitude[:, track.of(order)], \
np.nan) for order in (1.0, 2.0)}}  # (x, y) [m], complex; nothing where a steady line is too near
speed = track.speed  # [rad/s]
slow = 0.0  # speed of the vector that is taken off [rad/s]; 0: none
for order, vector in vectors.items():
    known = np.isfinite(vector[:, 0])
    if slow > 0.0 and known.any():
        vectors[order] = vector - vector[np.where(known, abs(speed - slow), np.inf).argmin()]
"""


def _rules(files: Files, options: Mapping[str, Any]) -> list[str]:
    """Lines that make the reading rules; none where the recording speaks for itself."""
    lines = []
    if "profile" in files:
        lines.append("from rotordrop.record.profile import load_profile")
        lines.append(f"profile = load_profile({files['profile']['name']!r})")
    if options.get("speed"):
        lines.insert(0, "from rotordrop.record.profile import Profile, SpeedSource")
        given = "profile" if "profile" in files else "Profile()"
        source = f"SpeedSource(constant={options['speed']!r})"
        lines.append(f'profile = {given}.model_copy(update={{"speed": {source}}})')
    return lines


def look_lines(files: Files, options: Mapping[str, Any], planes: int) -> dict[str, str]:
    """Lines for every figure of a look."""
    imports, rules = "from rotordrop import look", _rules(files, options)
    given = [repr(files["record"]["name"])]
    if "machine" in files:
        imports = "from rotordrop import load_machine, look"
        given.append(f"machine=load_machine({files['machine']['name']!r})")
    if options.get("gap"):
        given.append(f"gap={options['gap']!r}")
    if options.get("planes"):
        given.append(f"mapping={[plane.strip() for plane in options['planes'].split(';') if plane.strip()]}")
    if rules:
        given.append("profile=profile")
    head = [imports, *rules, "", f"seen = look({', '.join(given)})"]
    radius = "time, radius = seen.motion.time, [p.radius for p in seen.motion.paths]  # [s], [m]"
    tail = {
        "overview": radius,
        "impacts": "impacts = [(i.plane, i.time, i.azimuth, i.depth) for i in seen.impacts]  # s, rad, m",
    }
    for number in range(planes):
        motion = f"time, motion = seen.motion.time, seen.motion.paths[{number}].position  # [s], [m]"
        tail |= {f"motion {number}": motion, f"orbit {number}": motion}
    found = {figure: "\n".join([*head, line, ""]) for figure, line in tail.items()}
    return found | ({"rotor": _ROTOR.format(machine=files["machine"]["name"])} if "machine" in files else {})


def estimate_lines(files: Files, options: Mapping[str, Any], bearings: Sequence[str]) -> dict[str, str]:
    """Lines for every figure of an estimate."""
    replayed = options.get("method") == "replay"
    lines = ["from rotordrop import estimate_drop, load_machine, read_record"]
    rules = _rules(files, options)
    extra, by_rules = "", ", profile=profile" if rules else ""
    if replayed or options.get("quick"):
        lines.append(f"from rotordrop.estimation import {'Replay' if replayed else 'Tracked'}")
        extra = f", method={'Replay()' if replayed else 'Tracked(quick=True)'}"
    lines += [*rules, "", f"machine = load_machine({files['machine']['name']!r})"]
    lines.append(f"record = read_record({files['record']['name']!r}, machine{by_rules})")
    tail = "None"
    if "tail" in files:
        lines.append(f"tail = read_record({files['tail']['name']!r}, machine{by_rules})")
        tail = "tail"
    lines.append(f"estimate = estimate_drop(machine, record, {tail}{extra})")
    last = {
        kind: f"{kind} = {{b.name: (b.{kind}.time, b.{kind}.values) for b in estimate.bearings}}  # s, {unit}"
        for kind, unit in (("force", "N"), ("stress", "Pa"))
    }
    last["impacts"] = (
        "impacts = [(b.name, i.peak_time, i.azimuth, i.peak_force.value) for b in estimate.bearings "
        "for i, after in zip(b.impacts, b.after_flight) if after]  # [s], [rad], [N]"
    )
    last["peaks"] = (
        "peaks = {b.name: (b.peak_force.known, b.peak_stress.known) for b in estimate.bearings}  # [N], [Pa]"
    )
    for number, name in enumerate(bearings):
        motion = f"motions = estimate.bearing({name!r}).motions  # each .time [s] and .displacement [m]"
        last |= {f"motion {number}": motion, f"orbit {number}": motion}
    found = {figure: "\n".join([*lines, line, ""]) for figure, line in last.items()}
    return found | {"rotor": _ROTOR.format(machine=files["machine"]["name"])}


def waterfall_lines(
    files: Files, options: Mapping[str, Any], planes: Sequence[str], parts: Sequence[str]
) -> dict[str, str]:
    """Lines for every waterfall of a coast-down, for its cuts, and for the course of its lines."""
    rules = _rules(files, options)
    given = {
        "rules": "".join(f"{line}\n" for line in rules),
        "by_rules": ", profile=profile" if rules else "",
        "machine": files["machine"]["name"],
        "record": files["record"]["name"],
    }
    return {
        f"{number} {part}": _WATERFALL.format(plane=name, part=part, **given)
        for number, name in enumerate(planes)
        for part in parts
    }


def vector_lines(plane: str) -> str:
    """Lines that give the vectors of 1X and 2X over the speed, after those of the waterfall."""
    return _VECTORS.format(plane=plane)


def course_lines(label: str) -> str:
    """Lines that follow a line of a waterfall over time, after those of the waterfall."""
    return _COURSE.format(label=label)
