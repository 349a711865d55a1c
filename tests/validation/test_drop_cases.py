"""Drop cases: mirror symmetry and conservation of energy of the compiled drop of the reference machine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of

from rotordrop.machine import Machine, example_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate.case import DropCase, PlacedStart
from rotordrop.simulate.drop import simulate_drop

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]

HUGE = 1e12
"""Tolerance that lets every step of the given length pass."""


def mirrored(inputs: Inputs) -> dict[str, float]:
    what = inputs["mirrored"]
    mirror = np.array([-1.0, 1.0])
    start = PlacedStart(
        displacement=np.array([[30e-6, -120e-6], [-50e-6, -90e-6]]),
        velocity=np.array([[0.02, -0.05], [-0.03, 0.01]]),
    )
    image = start
    if "place" in what:
        image = PlacedStart(displacement=start.displacement * mirror, velocity=start.velocity * mirror)
    machine = example_machine("paper")
    speed = 2.0 * math.pi * inputs["speed_hz"]
    case = DropCase(
        speed=speed,
        duration=inputs["duration_s"],
        tolerance=HUGE,
        largest_step=inputs["fixed_step_s"],
        start=start,
    )
    other = replace(case, start=image, speed=-speed if "speed" in what else speed)
    sign = -1.0 if "unbalance phase" in what else 1.0
    one = simulate_drop(build_drop_model(_with_phases(machine, 1.0), "quick"), case)
    two = simulate_drop(build_drop_model(_with_phases(machine, sign), "quick"), other)
    assert len(one.contacts) > 0
    clearance = min(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    error = float(np.max(np.abs(two.displacement - one.displacement * mirror)))
    return {"max |x_mirrored + x| / clearance": error / clearance}


def _with_phases(machine: Machine, sign: float) -> Machine:
    phases = {f"unbalance.{i}.phase": sign * (0.6 + i) for i in range(len(machine.unbalances))}
    return machine.with_values(phases)


def undamped(inputs: Inputs) -> dict[str, float]:
    model = _without_losses(build_drop_model(example_machine("paper"), "quick"), inputs)
    case = DropCase(
        speed=2.0 * math.pi * inputs["speed_hz"],
        duration=inputs["duration_s"],
        tolerance=inputs["tolerance"],
        spin="coasting",
    )
    result = simulate_drop(model, case)
    assert len(result.contacts) > 10
    p, layout = model.parameters, model.layout
    moving = result.state[:, layout.n_coordinates : 2 * layout.n_coordinates]
    mass = np.ones(layout.n_coordinates)
    mass[layout.race] = np.repeat(p.bearing[:, L.RACE_MASS], 2)
    mass[layout.support] = p.bearing[:, [L.SUPPORT_MASS_X, L.SUPPORT_MASS_Y]].ravel()
    kinetic = 0.5 * moving**2 @ mass
    # the certificate balances stored, lost and supplied energy; here what was lost counts as missing
    lost = float(np.max(result.state[:, layout.dissipated]))
    missing = result.certificate.energy_residual + lost
    return {"max |E-E0| / max kinetic energy": missing / float(np.max(kinetic))}


def _without_losses(model: DropModel, inputs: Inputs) -> DropModel:
    p = model.parameters
    bearing = p.bearing.copy()
    bearing[:, [L.FRICTION_STATIC, L.FRICTION_DYNAMIC]] = inputs["friction"]
    bearing[:, L.CONTACT_DAMPING] = inputs["contact_damping"]
    bearing[:, [L.SUPPORT_DAMPING_X, L.SUPPORT_DAMPING_Y]] = inputs["support_damping"]
    bearing[:, L.BEARING_DAMPING] = inputs["bearing_damping"]
    bearing[:, L.DRAG_COEFFICIENT] = 0.0
    still = np.zeros_like(p.unbalance_cos)
    parameters = p._replace(
        bearing=bearing, damping=np.zeros_like(p.damping), unbalance_cos=still, unbalance_sin=still
    )
    return replace(model, parameters=parameters)


CASES: dict[str, Compute] = {"M01": mirrored, "M03": undamped}


test_case, test_a_changed_input_is_noticed = checks_of(
    CASES,
    [
        ("M01", {"mirrored": ["speed", "place"]}),
        ("M01", {"mirrored": ["place", "unbalance phase"]}),
        ("M01", {"mirrored": ["speed", "unbalance phase"]}),
        ("M03", {"friction": 1e-4}),
        ("M03", {"contact_damping": 1e-4}),
        ("M03", {"support_damping": 1.0}),
        ("M03", {"bearing_damping": 1.0}),
        ("M03", {"tolerance": 1e-4}),
    ],
)
