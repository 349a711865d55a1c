"""How the preload is made: forces at rest and at the first impact, between rigid spacers and on springs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of
from rigid_machine import disc_in

from rotordrop.physics import columns as L
from rotordrop.physics.ball_set import ball_set_gradient
from rotordrop.physics.ring import seat_on_springs
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]
FREE = 'preload_kind = "spring", spring_rate = "1 N/m", fit_friction = 0.0, ring_travel = "1 mm", '


def model_of(v: Inputs, springs: str = "") -> DropModel:
    """A rigid rotor in one pair, whose first ball stands on the line of the load."""
    pair = f"""
[[touchdown_bearings]]
name = "A"
node = 2
air_gap = "{v["gap"]} m"
bore_radius = "40 mm"
bearing = {{ {springs}ball_diameter = "{v["ball_diameter"]} m", ball_count = {v["balls"]}, \
pitch_diameter = "{v["pitch_diameter"]} m", contact_angle = "25 deg", preload = "{v["preload"]} N", \
conformity = {v["conformity"]}, first_ball_angle = "180 deg" }}
contact = {{ stiffness = "{v["contact"]} N/m^1.111", exponent = {10.0 / 9.0!r}, damping = "0 s/m" }}
friction = {{ static = 0.0, dynamic = 0.0 }}
race = {{ mass = "{v["race_mass"]} kg", inertia = "4e-4 kg m^2", drag_coefficient = 0.0 }}
support = {{ mass = "{v["support_mass"]} kg", stiffness = "{v["support_stiffness"]} N/m", \
damping_ratio = {v["support_damping_ratio"]} }}
"""
    model = disc_in(pair, v["m"], v["g"])
    bearing = model.parameters.bearing.copy()
    bearing[:, L.BEARING_DAMPING] = v["race_damping"]
    bearing[:, L.LINES] = 0.0  # rings follow freely
    return replace(model, parameters=model.parameters._replace(bearing=bearing))


def pushed(v: Inputs) -> dict[str, float]:
    """Force against a push, with rings held and with rings that springs of a constant force follow."""
    p = model_of(v).parameters
    entries = p.bearing[0, L.BALL_SET : L.BALL_SET_END]
    held = -ball_set_gradient(entries, p.balls[0], 0.0, -v["push"])[1]
    (sprung,) = model_of(v, FREE).machine.touchdown_bearings
    numbers = sprung.bearing.numbers()
    low, high = 0.0, held
    for _ in range(60):
        middle = 0.5 * (low + high)
        seat = seat_on_springs(numbers.constants, numbers.rings(), np.array([[0.0, middle]]))[0]
        low, high = (middle, high) if -seat[1] < v["push"] else (low, middle)
    return {"force with rigid spacers": held, "force with springs": middle}


def impact(v: Inputs) -> dict[str, float]:
    """Contact force and stress of the first impact."""
    light = f'{FREE}ring_mass = "{v["ring_mass"]} kg", '
    found = {}
    for kind, springs in (("rigid spacers", ""), ("springs", light)):
        case = DropCase(speed=0.0, duration=v["duration"], output_step=1e-6, tolerance=1e-8, spin="constant")
        result = simulate_drop(model_of(v, springs), case)
        found[f"peak contact force with {kind}"] = float(np.max(result.contact_force))
        found[f"peak stress with {kind}"] = float(np.max(result.max_stress))
    return found


CASES: dict[str, Compute] = {"PL01": pushed, "PL02": impact}


test_case, test_a_changed_input_is_noticed = checks_of(
    CASES,
    [
        ("PL01", {"push": 1.01e-5}),
        ("PL01", {"preload": 540.0}),
        ("PL02", {"gap": 2.52e-4}),
        ("PL02", {"ring_mass": 0.05}),
    ],
)
