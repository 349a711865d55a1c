"""The machine of the synthetic drop as known after a calibration, and its estimates."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.methods import Tracked
from rotordrop.estimate.record_facts import facts_of
from rotordrop.estimation import estimate_drop
from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.twin.tracked import TrackedDrop, followed_drops
from rotordrop.twin.tracked_estimate import estimate_of
from rotordrop_bench import HiddenMachine, SyntheticDrop

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


@pytest.fixture(scope="session")
def calibrated(known: Machine, hidden: HiddenMachine) -> Machine:
    """The machine as known after a calibration."""
    return calibrated_about(known, hidden, 4, 0.7)


@pytest.fixture(scope="session")
def workshop(calibrated: Machine, synthetic: SyntheticDrop) -> TrackedDrop:
    """The drop followed over its 0.2 s by the drop model of a calibrated machine, with its filter."""
    item = read_evidence(build_drop_model(calibrated), synthetic.record, synthetic.tail, name="hidden_060")
    return next(iter(followed_drops(calibrated, [item])))


@pytest.fixture(scope="session")
def tracked(workshop: TrackedDrop, calibrated: Machine, synthetic: SyntheticDrop) -> Estimate:
    """What is told of it."""
    facts = facts_of(
        Evidence(record=synthetic.record, machine=calibrated, tail=synthetic.tail, name="hidden_060")
    )
    return estimate_of(workshop, Tracked(), facts)


@pytest.fixture(scope="session")
def quick(calibrated: Machine, synthetic: SyntheticDrop) -> Estimate:
    """The same in a single pass, by the public function."""
    return estimate_drop(calibrated, synthetic.record, synthetic.tail, method=Tracked(quick=True))
