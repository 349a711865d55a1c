"""Open-loop replay with true parameters: how much error the initial state alone brings.

    python studies/replay/open_loop.py [--first 1000] [--count 16]

Each drop is recorded by an ordinary measuring chain (zeros up to 10 µm, gains up to 1 % off, noise, hum,
runout). The machine of the replay is the true one, of a coarser reduction; only the start comes from the
record, in these ways:

- ``fit``: fit over the whole fall with gravity sag and remanent lift, rest position from the true air gap
- ``fit, gap from tail``: the same, with the air gap as the settled tail gives it, zero errors included
- ``expansion``: modal expansion at power-off (Neisi 2020, eqs. 14-16) with the true sensor planes
- ``paper``: the same with the sensors taken in the bearing planes

The two expansions get the true unbalance and its true phase, and know no remanent lift, as in the paper.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np
from common import informed, known_machine, radians, size_of, speed_of, value_of, write

from rotordrop.arrays import Array
from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.evidence.evidence import known as present
from rotordrop.evidence.initial_state import InitialState, initial_state_of
from rotordrop.evidence.sensing import build_sensing
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop.replay.draws import seen_at_bearings, whole_drop
from rotordrop.replay.first_impacts import first_impacts
from rotordrop.replay.modal_expansion import ExpandedState, expand_initial_state
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult
from rotordrop_bench import HiddenMachine, hidden_machine, synthesize_drop
from rotordrop_bench.event import drop_conditions

DURATION = 0.2
EARLY = 0.02
TOLERANCE = 1e-7
HORIZONS = (0.02, 0.05, 0.2)


def true_machine(known: Machine, hidden: HiddenMachine) -> Machine:
    """What the owner knows of the sensors and the magnets, and the truth of all else."""
    values = {
        f"unbalance.{k}.{part}": float(getattr(unbalance, part))
        for k, unbalance in enumerate(hidden.machine.unbalances)
        for part in ("amount", "phase")
    }
    return informed(known, hidden, supports=True).with_values(values)


def by_fit(evidence: Evidence) -> tuple[InitialState, DropResult, Array]:
    """Replay from the fit over the fall, and its orbit at the bearings as the sensors would show it."""
    initial = present(evidence.fall)
    problem = first_impacts(evidence, evidence.model, until=EARLY)
    central = problem.trial(problem.table.mean)
    result = whole_drop(problem, central, duration=DURATION, tolerance=TOLERANCE)
    return initial, result, seen_at_bearings(problem, central, result)


def with_gap(evidence: Evidence, gaps: Array) -> Evidence:
    """The evidence with other air gaps, and so another rest position."""
    gap = present(evidence.gap)
    rest = replace(gap.rest, radius=gaps + gap.sag.total)
    other = replace(gap, value=gaps, rest=rest)
    sensing, speed, off = present(evidence.sensing), evidence.speed.initial, evidence.power_off
    fall = initial_state_of(evidence.record, evidence.model, off, speed, evidence.angle, other, sensing)
    return evidence.with_facts(rest=rest, gap=other, fall=fall)


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
    moved = [
        sensor.model_copy(update={"node": min(nodes, key=lambda node, own=sensor.node: abs(node - own))})
        for sensor in record.sensors
    ]
    return replace(record, sensors=tuple(moved))


def peaks(result: DropResult, until: float) -> Array:
    """Largest force of every bearing up to a time [N]."""
    return np.asarray(result.bearing_force_magnitude[result.time <= until].max(axis=0))


def orbit_errors(result: DropResult, orbit: Array, truth: DropResult) -> list[list[float]]:
    """Root mean square distance of the orbits at every bearing over the horizons [µm]."""
    time = result.time
    true = np.stack(
        [
            [np.interp(time, truth.time, truth.displacement[:, b, axis]) for axis in range(2)]
            for b in range(orbit.shape[1])
        ]
    )
    apart = np.sum((orbit - true.transpose(2, 0, 1)) ** 2, axis=-1)
    return [(1e6 * np.sqrt(apart[time <= h].mean(axis=0))).tolist() for h in HORIZONS]


def one(seed: int, hertz: float) -> dict[str, Any]:
    """Errors of one drop, whose machine and drop have this seed."""
    known = known_machine()
    hidden = hidden_machine(known, seed)
    conditions = drop_conditions(hidden, radians(hertz), seed)
    drop = synthesize_drop(hidden, radians(hertz), seed, conditions=conditions)
    assert drop.tail is not None
    machine = true_machine(known, hidden)
    evidence = read_evidence(build_drop_model(machine), drop.record, drop.tail)
    model = evidence.model
    gaps = np.array([value_of(b, "air_gap") for b in hidden.machine.touchdown_bearings])
    found: dict[str, tuple[DropResult, Array]] = {}
    initial, result, _ = by_fit(with_gap(evidence, gaps))
    found["fit"] = result, result.displacement
    _, result, _ = by_fit(evidence)
    found["fit, gap from tail"] = result, result.displacement
    along = initial.deviation_of(drop.record) + initial.settled
    for name, record in (("expansion", drop.record), ("paper", in_bearing_planes(drop.record, machine))):
        sensing = build_sensing(model, record.sensors)
        start = expand_initial_state(record.time, along, initial.drop_instant, model, sensing)
        result = by_expansion(model, start, radians(hertz), conditions.start.rotor_angle)
        found[name] = result, result.displacement
    truth = {"20 ms": peaks(drop.result, EARLY), "0.2 s": peaks(drop.result, DURATION)}
    ways = {}
    for name, (result, orbit) in found.items():
        own = {"20 ms": peaks(result, EARLY), "0.2 s": peaks(result, DURATION)}
        ways[name] = {
            **{f"peak in {k} error_percent": (100.0 * (own[k] / truth[k] - 1.0)).tolist() for k in own},
            "orbit_error_um": orbit_errors(result, orbit, drop.result),
        }
    return {
        "seed": seed,
        "speed_Hz": hertz,
        "peak_N": {k: v.tolist() for k, v in truth.items()},
        "misfit_of_the_fall": initial.misfit,
        "power_off_error_us": 1e6 * (initial.drop_instant - conditions.jitter),
        "ways": ways,
    }


def summary(drops: list[dict[str, Any]]) -> dict[str, Any]:
    """Sizes of the errors of every way, over both bearings and for each."""
    sizes: dict[str, Any] = {}
    for name in drops[0]["ways"]:
        ways = [drop["ways"][name] for drop in drops]
        sizes[name] = {
            "peak in 20 ms [%]": size_of([way["peak in 20 ms error_percent"] for way in ways]),
            "peak in 0.2 s [%]": size_of([way["peak in 0.2 s error_percent"] for way in ways]),
            "median per bearing, 20 ms [%]": np.median(
                np.abs([way["peak in 20 ms error_percent"] for way in ways]), axis=0
            ).tolist(),
            "rms per bearing, 20 ms [%]": np.sqrt(
                np.mean(np.square([way["peak in 20 ms error_percent"] for way in ways]), axis=0)
            ).tolist(),
            "median orbit error after 20, 50, 200 ms per bearing [um]": np.median(
                [way["orbit_error_um"] for way in ways], axis=0
            ).tolist(),
        }
    return sizes


def main() -> None:
    """Run the seeds named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--count", type=int, default=16)
    options = parser.parse_args()
    drops: list[dict[str, Any]] = []
    for place in range(options.count):
        drops.append(one(options.first + place, speed_of(place)))
        ways = drops[-1]["ways"].items()
        shown = {name: np.round(way["peak in 20 ms error_percent"], 2).tolist() for name, way in ways}
        print(drops[-1]["seed"], drops[-1]["speed_Hz"], shown, flush=True)
        write("open_loop.json", {"summary": summary(drops), "drops": drops})


if __name__ == "__main__":
    main()
