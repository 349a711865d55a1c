"""A small drop with known numbers: two bearings, three impacts, one of them still lasting."""

import json

import numpy as np
import pytest

from rotordrop.estimate.document import estimate_document
from rotordrop.physics.hertz import LineContact
from rotordrop.report.estimate_page import estimate_page
from rotordrop.simulate.result import Certificate, ContactLog, DropResult

GAPS = (275e-6, 285e-6)
TIME = np.linspace(0.0, 0.2, 4001)


@pytest.fixture
def drop_result():
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
        lost=np.zeros((3, 5)),
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


@pytest.fixture
def estimate(bank):
    """The first 20 ms of the bundled record, in one coarse pass."""
    return bank("begun")


def section(content, heading):
    """The part of a page under a heading."""
    return next(part for part in content.sections if part.heading == heading)


@pytest.fixture(scope="module")
def page(bank):
    """The page of it."""
    return estimate_page(bank("begun"))


@pytest.fixture(scope="module")
def document(bank):
    """Its document, as it comes back from a file."""
    return json.loads(json.dumps(estimate_document(bank("begun")), allow_nan=False))
