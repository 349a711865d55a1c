"""Sliding in a sleeve, which has no race, by `simulate_drop`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of
from rigid_machine import disc_in

from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase, PlacedStart
from rotordrop.simulate.drop import simulate_drop

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]


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


CASES: dict[str, Compute] = {"SL01": sliding}

test_case, test_a_changed_input_is_noticed = checks_of(
    CASES, [("SL01", {"mu": 0.1505}), ("SL01", {"radius": 0.0348}), ("SL01", {"polar_inertia": 0.501})]
)
