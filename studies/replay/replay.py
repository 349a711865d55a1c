"""What the paper's route recovers from simulated records, as tables in Markdown.

    python studies/replay/replay.py identification [--first 1120] [--count 12]
    python studies/replay/replay.py open_loop [--first 1000] [--count 16]

``identification``: supports and air gap with everything else known, from sensors with ordinary noise, hum,
runout and 16 bits, but without zero and gain errors.

``open_loop``: how much error the initial state alone brings. Each drop is recorded by an ordinary measuring
chain (zeros up to 10 µm, gains up to 1 % off, noise, hum, runout). The machine of the replay is the true one,
of a coarser reduction; only the start comes from the record, in these ways:

- ``fit``: fit over the whole fall with gravity sag and remanent lift, rest position from the true air gap
- ``fit, gap from tail``: the same, with the air gap as the settled tail gives it, zero errors included
- ``expansion``: modal expansion at power-off (Neisi 2020, eqs. 14-16) with the true sensor planes
- ``paper``: the same with the sensors taken in the bearing planes

The two expansions get the true unbalance and its true phase, and know no remanent lift, as in the paper.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.evidence.evidence import known as present
from rotordrop.evidence.initial_state import InitialState, initial_state_of
from rotordrop.evidence.rest import identify_air_gap
from rotordrop.evidence.sensing import build_sensing
from rotordrop.known import Known
from rotordrop.machine import Machine, example_machine
from rotordrop.machine.machine import value_of_path
from rotordrop.record.record import Record
from rotordrop.replay.draws import whole_drop
from rotordrop.replay.first_impacts import first_impacts
from rotordrop.replay.modal_expansion import ExpandedState, expand_initial_state
from rotordrop.replay.support_and_friction import (
    LONGEST_WINDOW,
    fit_support,
    identified_values,
    refit_with_friction,
)
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult
from rotordrop_bench import HiddenMachine, SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.event import drop_conditions

SPEEDS_HZ = (60.0, 100.0, 150.0, 210.0)
UNTIL, EARLY, DURATION, HORIZONS = 0.06, 0.02, 0.2, (0.02, 0.05, 0.2)
TOLERANCE = 1e-7
RIGHT_SENSORS = SensorChain(gain_error=0.0, offset=0.0)
SUPPORT = ("support.stiffness", "support.mass", "support.damping")
ASKED = {"support.stiffness": 1.0, "support.mass": 1.0, "support.damping": 15.0, "air_gap": 1.0}
"""Error that was asked for [%], of the air gap [µm]."""
NUISANCE = (
    "contact.stiffness",
    "contact.damping",
    "friction.dynamic",
    "friction.static",
    "friction.stribeck_speed",
    "race.mass",
    "race.inertia",
    "race.drag_coefficient",
    "damping_time",
    "preload",
    "bearing.first_ball_angle",
)


def exactly(value: float, error: float | None = None) -> Known:
    """A value known to a thousandth, or to an error in its own unit."""
    own = max(1e-3 * abs(value), 1e-15) if error is None else error
    return Known(value=value, status="estimated", standard_error=own)


def informed(known: Machine, hidden: HiddenMachine, *further: str) -> Machine:
    """The owner's machine that knows all but supports, air gap, unbalance and magnets, or these paths too."""
    paths = [f"{b.name}.{path}" for b in known.touchdown_bearings for path in (*NUISANCE, *further)]
    values: dict[str, Known | float] = {path: exactly(value_of_path(hidden.machine, path)) for path in paths}
    return known.with_values(values | {"rotor.modal_damping": float(hidden.machine.rotor.modal_damping)})


def table(head: list[str], rows: list[list[str]]) -> None:
    """Print a table in Markdown."""
    print("", "| " + " | ".join(head) + " |", "|" + "---|" * len(head), sep="\n")
    print(*("| " + " | ".join(row) + " |" for row in rows), sep="\n", flush=True)


def of_size(errors: Any) -> str:
    """Median, 90th percentile and worst of absolute errors."""
    size = np.abs(np.asarray(errors, dtype=float)).ravel()
    return f"{np.median(size):.2f} | {np.quantile(size, 0.9):.2f} | {size.max():.2f}"


def supports(known: Machine, seed: int, hertz: float) -> dict[str, Any]:
    """Errors of each bearing [%], [µm] by path, and which intervals hold, of one record."""
    hidden = hidden_machine(known, seed)
    drop = synthesize_drop(hidden, 2.0 * math.pi * hertz, seed, sensor_chain=RIGHT_SENSORS)
    right = {"gain": exactly(1.0, 1e-5), "offset": exactly(0.0, 1e-8)}
    values = {f"sensors.{one.name}.{key}": value for one in known.sensors for key, value in right.items()}
    model = build_drop_model(informed(known, hidden).with_values(values))
    evidence = read_evidence(model, drop.record, drop.tail)
    quick = build_drop_model(evidence.model.machine, "quick")
    coarse, fine = (first_impacts(evidence, one, until=UNTIL) for one in (quick, evidence.model))
    # as the replay finds them, but for the sweep of the friction, which is known here
    found = fit_support(coarse, fine, evidence.latest_first_contact)
    friction = identified_values(fine, found.search.best.x, found.covariance)[fine.paths[fine.friction]]
    longest = evidence.latest_first_contact + LONGEST_WINDOW
    problem, x, covariance = refit_with_friction(fine, found.search.best, friction, longest=longest)
    told = identified_values(problem, x, covariance)
    parameters = evidence.model.parameters._replace(bearing=problem.rows(problem.trial(x)))
    settled = replace(evidence.model, parameters=parameters)
    gap = identify_air_gap(present(evidence.rest), settled, present(evidence.sensing))
    errors, held = dict[str, list[float]](), []
    for b, bearing in enumerate(hidden.machine.touchdown_bearings):
        for path in SUPPORT:
            value, true = (
                told[f"{bearing.name}.{path}"],
                value_of_path(hidden.machine, f"{bearing.name}.{path}"),
            )
            low, high = value.interval_90 or (math.nan,) * 2
            errors.setdefault(path, []).append(100.0 * (value.value / true - 1.0))
            held.append(low <= true <= high)
        errors.setdefault("air_gap", []).append(1e6 * (float(gap.value[b]) - float(bearing.air_gap)))
    early = found.search.ended_early or found.coarse.ended_early
    return {"errors": errors, "held": held, "ended early": early}


def identification(known: Machine, seeds: dict[int, float]) -> None:
    """Supports and air gap from records of these seeds and speeds [Hz]."""
    rows, errors, held = [], {path: list[float]() for path in ASKED}, list[bool]()
    for seed, hertz in seeds.items():
        one = supports(known, seed, hertz)
        cells = [" / ".join(f"{error:+.2f}" for error in one["errors"][path]) for path in ASKED]
        rows.append([str(seed), f"{hertz:.0f}", *cells, one["ended early"] or ""])
        print(*rows[-1], flush=True)
        held += one["held"]
        for path in ASKED:
            errors[path] += one["errors"][path]
    inside = {path: sum(abs(e) <= asked for e in errors[path]) for path, asked in ASKED.items()}
    table(
        ["", "asked, % or µm", "median", "90th percentile", "worst", "within what was asked"],
        [
            [path, f"{asked:g}", of_size(errors[path]), f"{inside[path]} of {len(errors[path])}"]
            for path, asked in ASKED.items()
        ],
    )
    print(f"\n{100.0 * np.mean(held):.0f} % of the 90 % intervals of K, M and C hold the truth.")
    table(["seed", "Hz", "K % NDE / DE", "M %", "C %", "gap µm", "ended early"], rows)


def with_gap(evidence: Evidence, gaps: Array) -> Evidence:
    """The evidence with other air gaps, and so another rest position."""
    gap = present(evidence.gap)
    rest = replace(gap.rest, radius=gaps + gap.sag.total)
    other = replace(gap, value=gaps, rest=rest)
    sensing, speed, off = present(evidence.sensing), evidence.speed.initial, evidence.power_off
    fall = initial_state_of(evidence.record, evidence.model, off, speed, evidence.angle, other, sensing)
    return evidence.with_facts(rest=rest, gap=other, fall=fall)


def by_fit(evidence: Evidence) -> tuple[InitialState, DropResult]:
    """Replay from the fit over the fall."""
    problem = first_impacts(evidence, evidence.model, until=EARLY)
    central = problem.trial(problem.table.mean)
    return present(evidence.fall), whole_drop(problem, central, duration=DURATION, tolerance=TOLERANCE)


def by_expansion(model: DropModel, start: ExpandedState, speed: float, angle: float) -> DropResult:
    """Replay from a modal expansion."""
    layout = model.layout
    state = layout.zeros()
    for axis, place in enumerate((layout.modal_x, layout.modal_y)):
        state[place] = start.displacement[:, axis]
        state[layout.velocity_of(place)] = start.velocity[:, axis]
    state[layout.rotor_speed], state[layout.rotor_angle] = speed, angle
    case = DropCase(speed=speed, duration=DURATION, tolerance=TOLERANCE, start=StateStart(state=state))
    return simulate_drop(model, case)


def in_bearing_planes(record: Record, machine: Machine) -> Record:
    """The same record whose sensors are taken to sit at the nearest touchdown bearing."""
    nodes = [bearing.node for bearing in machine.touchdown_bearings]
    nearest = [min(nodes, key=lambda node, own=one.node: abs(node - own)) for one in record.sensors]
    moved = (one.model_copy(update={"node": node}) for one, node in zip(record.sensors, nearest, strict=True))
    return replace(record, sensors=tuple(moved))


def against(found: DropResult, truth: DropResult) -> dict[str, list[Any]]:
    """Errors of the peak force after 20 ms and 0.2 s [%], and of the orbit to each horizon, rms [µm]."""
    errors: dict[str, list[Any]] = {}
    for until in (EARLY, DURATION):
        own, true = (one.bearing_force_magnitude[one.time <= until].max(axis=0) for one in (found, truth))
        errors[f"{until} s"] = (100.0 * (own / true - 1.0)).tolist()
    columns = truth.displacement.reshape(len(truth.time), -1).T
    true = np.column_stack([np.interp(found.time, truth.time, column) for column in columns])
    apart = np.sum((found.displacement - true.reshape(found.displacement.shape)) ** 2, axis=-1)
    errors["orbit"] = [(1e6 * np.sqrt(apart[found.time <= h].mean(axis=0))).tolist() for h in HORIZONS]
    return errors


def starts(known: Machine, seed: int, hertz: float) -> dict[str, dict[str, list[Any]]]:
    """Errors of one drop by the way its start was found."""
    hidden, speed = hidden_machine(known, seed), 2.0 * math.pi * hertz
    conditions = drop_conditions(hidden, speed, seed)
    drop = synthesize_drop(hidden, speed, seed, conditions=conditions)
    parts = [f"unbalance.{k}.{p}" for k in range(len(known.unbalances)) for p in ("amount", "phase")]
    machine = informed(known, hidden, *SUPPORT, "air_gap").with_values(
        {path: value_of_path(hidden.machine, path) for path in parts}
    )
    evidence = read_evidence(build_drop_model(machine), drop.record, drop.tail)
    gaps = np.array([float(bearing.air_gap) for bearing in hidden.machine.touchdown_bearings])
    initial, fitted = by_fit(with_gap(evidence, gaps))
    found = {"fit": fitted, "fit, gap from tail": by_fit(evidence)[1]}
    along = initial.deviation_of(drop.record) + initial.settled
    for name, record in (("expansion", drop.record), ("paper", in_bearing_planes(drop.record, machine))):
        sensing = build_sensing(evidence.model, record.sensors)
        start = expand_initial_state(record.time, along, initial.drop_instant, evidence.model, sensing)
        found[name] = by_expansion(evidence.model, start, speed, conditions.start.rotor_angle)
    return {name: against(result, drop.result) for name, result in found.items()}


def open_loop(known: Machine, seeds: dict[int, float]) -> None:
    """Peak force from the initial state alone, true parameters."""
    drops = []
    for seed, hertz in seeds.items():
        drops.append(starts(known, seed, hertz))
        shown = {name: np.round(errors[f"{EARLY} s"], 2).tolist() for name, errors in drops[-1].items()}
        print(seed, hertz, shown, flush=True)
    rows = []
    for name in drops[0]:
        early, whole, orbit = (
            np.abs([drop[name][key] for drop in drops]) for key in (f"{EARLY} s", f"{DURATION} s", "orbit")
        )
        per_bearing = " / ".join(f"{error:.2f}" for error in np.median(early, axis=0))
        rms = [np.sqrt(np.mean(errors**2)) for errors in (early, whole)]
        cells = [f"{np.median(early):.2f}", per_bearing, f"{rms[0]:.2f}", f"{early.max():.1f}"]
        cells.append(f"{np.median(whole):.2f} ({rms[1]:.1f})")
        pairs = ("/".join(f"{one:.1f}" for one in pair) for pair in np.median(orbit, axis=0))
        rows.append([name, *cells, ", ".join(pairs)])
    head = ["start", "20 ms: median, %", "NDE / DE", "rms", "worst", "0.2 s: median (rms)"]
    table([*head, "orbit rms to 20, 50, 200 ms, median, µm"], rows)


STUDIES = {"identification": (identification, 1120, 12), "open_loop": (open_loop, 1000, 16)}


def main() -> None:
    """Run the seeds named on the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", choices=STUDIES)
    parser.add_argument("--first", type=int)
    parser.add_argument("--count", type=int)
    given = parser.parse_args()
    study, first, count = STUDIES[given.study]
    seeds = range(given.first or first, (given.first or first) + (given.count or count))
    study(example_machine("lp400"), {seed: SPEEDS_HZ[i % len(SPEEDS_HZ)] for i, seed in enumerate(seeds)})


if __name__ == "__main__":
    main()
