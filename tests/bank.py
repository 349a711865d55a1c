"""The drops and estimates that many tests look at, by name; ``conftest.py`` hands out copies."""

import math
from typing import Any

import numpy as np
import pytest
from tests.shared import Shared

from rotordrop import (
    Known,
    Machine,
    Replay,
    build_drop_model,
    estimate_drop,
    example_machine,
    example_record_path,
    read_record,
)
from rotordrop.estimate.estimate import Estimate, Tracked
from rotordrop.estimate.record_facts import facts_of
from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.replay.replay import replayed_drop
from rotordrop.track.calibration import CALIBRATED_SCHEDULE, track
from rotordrop.track.input_state import InputEstimate, corrections_by_record, input_state_estimate
from rotordrop.twin.calibrated import Calibration, calibrate_machine
from rotordrop.twin.problems import COARSE_BASIS, drop_problem
from rotordrop.twin.tracked import TrackedDrop, followed_drops, tracked_drop
from rotordrop.twin.tracked_estimate import estimate_of
from rotordrop_bench import HiddenMachine, SyntheticDrop, hidden_machine, synthesize_drop

SPEED = 2.0 * math.pi * 60.0
SEED = 4
CALIBRATED = {  # standard deviation of the logarithm after a calibration on two drops
    "support.stiffness": 0.015,
    "support.mass": 0.015,
    "support.damping": 0.04,
    "contact.stiffness": 0.03,
    "contact.damping": 0.2,
    "friction.dynamic": 0.02,
    "friction.stribeck_speed": 0.2,
    "race.inertia": 0.05,
    "race.drag_coefficient": 0.3,
    "damping_time": 0.3,
    "preload": 0.05,
}
GAP_SIGMA = 1e-6
NINETY = 1.6448536269514722


def calibrated_about(known: Machine, hidden: HiddenMachine, seed: int, share: float) -> Machine:
    """The owner's machine with estimates near the truth, off by a share of their standard error."""
    random = np.random.default_rng(seed)
    values: dict[str, Known] = {}
    for bearing in hidden.machine.touchdown_bearings:
        for path, sigma in CALIBRATED.items():
            part = bearing.bearing if path == "preload" else bearing
            for name in path.split("."):
                part = getattr(part, name)
            value = float(part) * math.exp(share * sigma * random.standard_normal())
            half = math.exp(NINETY * sigma)
            values[f"{bearing.name}.{path}"] = Known(
                value=value,
                status="estimated",
                interval_90=(value / half, value * half),
                source="calibration",
            )
        gap = float(bearing.air_gap) + share * GAP_SIGMA * random.standard_normal()
        values[f"{bearing.name}.air_gap"] = Known(
            value=gap,
            status="estimated",
            interval_90=(gap - NINETY * GAP_SIGMA, gap + NINETY * GAP_SIGMA),
            source="calibration",
        )
    return known.with_values(values)


def calibrated_machine() -> Machine:
    """The owner's machine as known after a calibration of the hidden one."""
    known = example_machine("lp400")
    return calibrated_about(known, hidden_machine(known, SEED), SEED, 0.7)


def recorded(_: Shared) -> SyntheticDrop:
    """A recorded drop of the hidden machine, over before the motion dies away."""
    hidden = hidden_machine(example_machine("lp400"), SEED)
    return synthesize_drop(hidden, SPEED, 10 * SEED, duration=0.22, name="hidden_060")


def workshop(shared: Shared) -> TrackedDrop:
    """It followed over its 0.2 s by the drop model of the calibrated machine, with its filter."""
    drop, calibrated = shared("recorded"), calibrated_machine()
    item = read_evidence(build_drop_model(calibrated), drop.record, drop.tail, name="hidden_060")
    return next(iter(followed_drops(calibrated, [item])))


def check(shared: Shared) -> InputEstimate:
    """Its forces without the contact law, from the record alone."""
    problem = shared("workshop").problem
    return input_state_estimate(problem, corrections_by_record(problem))


def tracked(shared: Shared) -> Estimate:
    """What is told of it."""
    drop, calibrated = shared("recorded"), calibrated_machine()
    evidence = Evidence(record=drop.record, machine=calibrated, tail=drop.tail, name="hidden_060")
    return estimate_of(shared("workshop"), Tracked(), facts_of(evidence))


def quick(shared: Shared) -> Estimate:
    """The same in a single pass, by the public function."""
    drop = shared("recorded")
    return estimate_drop(calibrated_machine(), drop.record, drop.tail, method=Tracked(quick=True))


def calibration(shared: Shared) -> Calibration:
    """The hidden machine calibrated blind on two short drops."""
    known, first = example_machine("lp400"), shared("recorded")
    speed, seed = 2.0 * math.pi * 150.0, 10 * SEED + 1
    hidden = hidden_machine(known, SEED)
    second = synthesize_drop(hidden, speed, seed, duration=0.09, tolerance=1e-7, name="second")
    names = ["hidden_060", "hidden_150"]
    return calibrate_machine(known, [first.record, second.record], [first.tail, second.tail], names=names)


def replayed(shared: Shared) -> Estimate:
    """It replayed open loop from there."""
    return replayed_drop(shared("workshop"), Replay(), facts_of(shared("workshop").evidence))


def begun(_: Shared) -> Estimate:
    """The first 20 ms of the bundled record, in one coarse pass."""
    machine = example_machine("lp400")
    record = read_record(example_record_path("lp400_drop_060"), machine)
    tail = read_record(example_record_path("lp400_drop_060_tail"), machine)
    evidence = read_evidence(build_drop_model(machine), record, tail, name="drop_060")
    problem = drop_problem(build_drop_model(machine, COARSE_BASIS), evidence, until=0.02)
    smoothed = track([problem], CALIBRATED_SCHEDULE[:1]).smoothed[0]
    drop = tracked_drop(evidence, problem, smoothed, smoothed, 1.0)
    facts = facts_of(Evidence(record=record, machine=machine, tail=tail, name="drop_060"))
    return estimate_of(drop, Tracked(), facts)


MAKERS = {
    made.__name__: made for made in (recorded, workshop, check, tracked, quick, calibration, replayed, begun)
}


def handed_out(name: str) -> Any:
    """A fixture of the name, which gives every test a copy of its own."""

    @pytest.fixture(name=name)
    def copy(bank: Shared) -> Any:
        return bank(name)

    return copy
