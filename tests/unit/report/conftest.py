"""A small drop with known numbers: two bearings, three impacts, one of them still lasting."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest

from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.methods import Tracked
from rotordrop.estimate.record_facts import facts_of
from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.machine import example_machine
from rotordrop.physics.hertz import LineContact
from rotordrop.record.record import read_record
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.certificate import Certificate
from rotordrop.simulate.result import ContactLog, DropResult
from rotordrop.track.calibration import CALIBRATED_SCHEDULE, track
from rotordrop.twin.problems import COARSE_BASIS, drop_problem
from rotordrop.twin.tracked import tracked_drop
from rotordrop.twin.tracked_estimate import estimate_of

GAPS = (275e-6, 285e-6)
TIME = np.linspace(0.0, 0.2, 4001)


@pytest.fixture
def drop_result() -> DropResult:
    count = len(TIME)
    fall = np.minimum(0.5 * 9.81 * TIME**2, 290e-6)
    displacement = np.zeros((count, 2, 2))
    displacement[:, :, 1] = -fall[:, None]
    displacement[:, :, 0] = 20e-6 * np.sin(2 * np.pi * 29.0 * TIME)[:, None]
    radius = np.hypot(displacement[..., 0], displacement[..., 1])
    indentation = radius - np.array(GAPS)
    pulse = np.exp(-(((TIME - 0.009) / 4e-4) ** 2))
    force = np.zeros((count, 2, 2))
    force[:, 0, 1] = -2840.0 * pulse - 180.0
    force[:, 1, 1] = -4858.0 * pulse - 440.0
    stress = 993e6 + 1e9 * pulse[:, None] * np.array([0.8, 1.1])
    return DropResult(
        time=TIME,
        displacement=displacement,
        race_displacement=np.zeros_like(displacement),
        support_displacement=np.zeros_like(displacement),
        indentation=indentation,
        contact_force=np.abs(force[..., 1]),
        friction_force=0.1 * np.abs(force[..., 1]),
        bearing_force=force,
        max_ball_load=np.abs(force[..., 1]) / 10.0,
        max_stress=stress,
        speed=2 * np.pi * (60.0 - 10.0 * TIME),
        race_speed=np.outer(TIME, np.array([100.0, 200.0])),
        state=np.zeros((count, 2)),
        contacts=ContactLog(
            bearing=np.array([0, 1, 1], dtype=np.int64),
            start=np.array([0.0076, 0.0077, 0.03]),
            end=np.array([0.0085, 0.0101, np.nan]),
            peak_force=np.array([2644.0, 4660.0, 900.0]),
            peak_time=np.array([0.0079, 0.0092, 0.031]),
            azimuth=np.radians([-90.0, -95.0, 250.0]),
            impulse=np.array([1.33, 6.4, 0.5]),
            dissipated_energy=np.array([1.7, 7.6, 0.2]),
            sliding_energy=np.array([1.6, 7.5, 0.2]),
        ),
        bearing_names=("NDE", "DE"),
        state_names=("a", "b"),
        shapes=np.eye(2),
        machine_name="test rotor",
        initial_speed=2 * np.pi * 60.0,
        tolerance=1e-6,
        reduction="14+2 modes",
        steps=1000,
        rejected_steps=10,
        outcome="The drop was simulated to 0.2 s in 1000 steps with 3 contacts.",
        finished=True,
        certificate=Certificate(
            energy_residual=1e-6, energy_scale=0.2, peak_force=np.array([3020.0, 5298.0])
        ),
        line_contacts=(LineContact(radius=4.0, length=0.032, compliance=8.7e-12),) * 2,
    )


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """The first 20 ms of the bundled record, in one coarse pass."""
    machine = example_machine("lp400")
    folder = resources.files("rotordrop").joinpath("examples", "lp400")
    with resources.as_file(folder.joinpath("drop_060.h5")) as path:
        record = read_record(path, machine)
    with resources.as_file(folder.joinpath("drop_060_tail.csv")) as path:
        tail = read_record(path, machine)
    evidence = read_evidence(build_drop_model(machine), record, tail, name="drop_060")
    problem = drop_problem(build_drop_model(machine, COARSE_BASIS), evidence, until=0.02)
    smoothed = track([problem], CALIBRATED_SCHEDULE[:1]).smoothed[0]
    drop = tracked_drop(evidence, problem, smoothed, smoothed, 1.0)
    return estimate_of(
        drop, Tracked(), facts_of(Evidence(record=record, machine=machine, tail=tail, name="drop_060"))
    )
