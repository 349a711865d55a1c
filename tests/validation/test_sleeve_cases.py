"""Sliding in a sleeve, which has no race, and rest on a landing sleeve of the rotor that is not round."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of
from rigid_machine import disc_in, rigid_model

from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate._sensitivity import drop_jacobian
from rotordrop.simulate.case import DropCase, PlacedStart
from rotordrop.simulate.drop import simulate_drop

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]

STEPS = 20


def model_of(v: Inputs) -> DropModel:
    """A rigid rotor in one sleeve on a support as good as rigid."""
    sleeve = f"""
[[touchdown_bearings]]
kind = "sleeve"
name = "A"
node = 2
air_gap = "{v["gap"]} m"
bore_radius = "{v["radius"] + v["gap"]!r} m"
contact = {{ stiffness = "{v["contact"]} N/m^1", exponent = 1.0, damping = "0 s/m" }}
friction = {{ static = {v["mu"]}, dynamic = {v["mu"]} }}
support = {{ mass = "1e6 kg", stiffness = "1e14 N/m", damping = "0 N s/m" }}
"""
    return disc_in(sleeve, v["m"], v["g"], v["speed"], (v["polar_inertia"], 1))


def sliding(v: Inputs) -> dict[str, float]:
    """Mean angle and force, and the torque by which the speed falls."""
    phi, weight = math.atan(v["mu"]), v["m"] * v["g"]
    radius = v["gap"] + weight * math.cos(phi) / v["contact"]
    place = radius * np.array([[-math.sin(phi), -math.cos(phi)]])
    start = PlacedStart(displacement=place, velocity=np.zeros((1, 2)))
    omega, duration = 2.0 * math.pi * v["speed"], 0.1
    case = DropCase(speed=omega, duration=duration, tolerance=1e-9, spin="coasting", start=start)
    drop = simulate_drop(model_of(v), case)
    x, y = drop.displacement[:, 0].T
    torque = v["polar_inertia"] * (drop.speed[0] - drop.speed[-1]) / drop.time[-1]
    return {
        "angle against the motion": float(np.degrees(np.mean(np.arctan2(-x, -y)))),
        "normal force": float(np.mean(drop.contact_force)),
        "friction torque": float(torque),
        "time to standstill": float(v["polar_inertia"] * omega / torque),
    }


def resting(v: Inputs) -> dict[str, float]:
    """Place of the rotor at rest, and the torque that its contact force is about its axis."""
    stiff = {"n": 1.0, "lam": 0.0, "ms": 1.0, "Ks": 1e13, "Cs": 0.0}
    amounts = f'eccentricity = "{v["eccentricity"]} m", oval = "{v["oval"]} m"'
    phases = f'eccentricity_phase = "{v["eccentricity_phase"]} rad", oval_phase = "{v["oval_phase"]} rad"'
    model = rigid_model(stiff | v, more=f"landing_sleeve = {{ {amounts}, {phases} }}")
    layout, state = model.layout, model.layout.zeros()
    shape = model.parameters.bearing_shape[0]
    state[layout.modal_y] = -(v["c"] + v["m"] * v["g"] / v["K"]) * shape / (shape @ shape)
    state[layout.rotor_angle] = v["angle"]
    p, n_q = model.parameters, layout.n_coordinates
    rates, slopes = layout.zeros(), np.zeros((layout.n_dynamic, layout.n_dynamic))
    for _ in range(STEPS):  # of Newton's; nothing holds the tilt of the rotor, which stays zero
        drop_derivative(0.0, state, p, rates, scratch_of(p))
        drop_jacobian(0.0, state, p, slopes)
        stiffness = slopes[n_q : 2 * n_q, :n_q]
        state[:n_q] -= np.linalg.lstsq(stiffness, rates[n_q : 2 * n_q], rcond=1e-14)[0]
    x, y = (model.parameters.bearing_shape[0] @ state[part] for part in (layout.modal_x, layout.modal_y))
    return {
        "place across": 1e6 * float(x),
        "place along": 1e6 * float(y),
        "torque": 1e3 * model.fe.polar_inertia * float(rates[layout.rotor_speed]),
    }


CASES: dict[str, Compute] = {"SL01": sliding, "LS01": resting}

test_case, test_a_changed_input_is_noticed = checks_of(
    CASES,
    [("SL01", {"mu": 0.1505}), ("SL01", {"radius": 0.0348}), ("SL01", {"polar_inertia": 0.501})]
    + [
        ("LS01", {name: value})
        for name, value in (("eccentricity", 12.01e-6), ("oval_phase", -0.201), ("angle", 0.901))
    ],
)
