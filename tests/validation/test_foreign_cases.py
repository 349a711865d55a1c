"""Drops computed by a code of others, EXUDYN: a rigid rotor in two bearings, and one landing on a face."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of
from numpy.typing import NDArray
from rigid_machine import linked, rigid_model

from rotordrop.machine import loads_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.simulate.case import DropCase, PlacedStart
from rotordrop.simulate.drop import simulate_drop

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]


def rigid_rotor(inputs: Inputs) -> DropModel:
    """Drop model of a rigid rotor in two bearings; their rings load the supports with no weight."""
    first, second = inputs["bearings"]
    lengths = (-first["position"], second["position"])
    # the shaft is there for its nodes only; what it weighs is taken off the disc
    shaft = math.pi / 4.0 * 1e-6 * 7850.0 * sum(lengths)
    about_disc = shaft * sum(length**3 for length in lengths) / (3.0 * sum(lengths))
    sections = ", ".join(
        f'{{ length = "{length} m", elements = 1, outer_diameter = "1 mm" }}' for length in lengths
    )
    rotor = f"""
name = "rigid"
gravity = "{inputs["gravity"]} m/s^2"
speed = {{ nominal = "{inputs["speed"]} rad/s" }}
[rotor]
sections = [{sections}]
discs = [{{ node = 2, mass = "{inputs["mass"] - shaft} kg", \
polar_inertia = "{inputs["polar_inertia"]} kg m^2", \
diametral_inertia = "{inputs["diametral_inertia"] - about_disc} kg m^2" }}]
materials = {{ steel = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }} }}
"""
    bearings = "".join(_bearing(v, node) for node, v in ((1, first), (3, second)))
    model = build_drop_model(loads_machine(rotor + bearings), Reduction(modes=2, attachment=False))
    halves = np.array([0.5 * v["ring_mass"] for v in inputs["bearings"]])
    parameters = linked(model, inputs["link"], halves)
    parameters.bearing[:, L.RACE_WEIGHT] = 0.0
    return replace(model, parameters=parameters)


def _bearing(v: Inputs, node: int) -> str:
    half = 0.5 * v["ring_mass"]
    exponent = v["contact_exponent"]
    return f"""
[[touchdown_bearings]]
name = "{v["name"]}"
node = {node}
air_gap = "{v["air_gap"]} m"
bore_radius = "{v["bore_radius"]} m"
damping_time = "0 s"
bearing = {{ ball_diameter = "{0.3 * v["bore_radius"]} m", ball_count = 8, \
pitch_diameter = "{3.0 * v["bore_radius"]} m", \
contact_angle = "15 deg", preload = "100 N", arrangement = "single" }}
contact = {{ stiffness = "{v["contact_stiffness"]} N/m^{exponent:.4f}", exponent = {exponent}, \
damping = "0 s/m" }}
friction = {{ static = {v["friction"]}, dynamic = {v["friction"]} }}
race = {{ mass = "{half} kg", inertia = "{v["race_inertia"]} kg m^2", drag_coefficient = 0.0 }}
support = {{ mass = "{half} kg", stiffness = "{v["support_stiffness"]} N/m", \
damping = "{v["support_damping"]} N s/m" }}
"""


def coasting_case(inputs: Inputs, velocity: NDArray[np.float64]) -> DropCase:
    """A drop from the middle of the bearings with velocities there [m/s], shape (B, 2)."""
    return DropCase(
        speed=inputs["speed"],
        duration=inputs["duration"],
        output_step=inputs["compared_step"],
        tolerance=1e-9,
        spin="coasting",
        start=PlacedStart(displacement=np.zeros_like(velocity), velocity=velocity),
    )


def path_of_exudyn(inputs: Inputs) -> dict[str, float]:
    """Displacement [m] of the rotor at each bearing at the instants of the case."""
    case = coasting_case(inputs, np.array(inputs["start"]["velocity"]))
    result = simulate_drop(rigid_rotor(inputs), case)
    assert len(result.contacts) >= inputs["fewest_contacts"]
    return {
        f"{axis} at {bearing['name']}, {1e3 * time:.0f} ms": float(result.displacement[i, j, k])
        for i, time in enumerate(result.time)
        if i > 0
        for j, bearing in enumerate(inputs["bearings"])
        for k, axis in enumerate("xy")
    }


def landing_of_exudyn(inputs: Inputs) -> dict[str, float]:
    """Displacement [m] of a rotor that a thrust lands on a face, and spin of the race there [rad/s]."""
    b, face = inputs["bearing"], inputs["face"]
    aside, up, along = (inputs["force"][axis] for axis in ("x", "y", "along"))
    values = {"m": inputs["mass"], "g": inputs["gravity"], "c": b["air_gap"], "r": b["bore_radius"]}
    values |= {"K": b["contact_stiffness"], "n": b["contact_exponent"], "lam": 0.0, "mu": b["friction"]}
    values |= {"ms": b["ring_mass"], "Ks": b["support_stiffness"], "Cs": b["support_damping"]}
    more = f"""mount = [{{ kind = "stop", gap = "{b["stop_gap"]} m", \
stiffness = "{b["stop_stiffness"]} N/m", damping = "0 s/m" }}]
face = {{ gap = "{face["gap"]} m", inner_radius = "{face["arm"] - 1e-9} m", \
outer_radius = "{face["arm"] + 1e-9} m", stiffness = "{face["stiffness"]} N/m", damping = "0 s/m", \
friction = {face["friction"]} }}
[[loads]]
node = 2
direction = "{math.atan2(up, aside)} rad"
force = "{math.hypot(aside, up)} N"
[[loads]]
node = 2
direction = "axial"
force = "{along} N"
"""
    model = rigid_model(
        values | {"I": b["race_inertia"]},
        link=inputs["link"],
        more=more,
        inertia=(inputs["polar_inertia"], inputs["diametral_inertia"]),
        arrangement="X",
    )
    model.parameters.bearing[:, L.RACE_WEIGHT] = 0.0
    result = simulate_drop(model, coasting_case(inputs, np.array([inputs["velocity"]])))
    paths = np.column_stack([result.displacement[:, 0], result.axial_displacement, result.race_speed[:, 0]])
    return {
        f"{name}, {1e3 * time:g} ms": float(value)
        for time, row in zip(np.round(result.time[1:], 9), paths[1:], strict=True)
        for name, value in zip(("x", "y", "z", "spin of the race"), row, strict=True)
    }


CASES: dict[str, Compute] = {"E01": path_of_exudyn, "E02": landing_of_exudyn}


test_case, test_a_changed_input_is_noticed = checks_of(
    CASES,
    [
        ("E01", {"bearings__0__friction": 0.151}),
        ("E01", {"bearings__1__contact_stiffness": 8.02e8}),
        ("E01", {"bearings__1__contact_exponent": 1.499}),
        ("E01", {"bearings__0__support_damping": 2.55e3}),
        ("E01", {"bearings__1__air_gap": 130.2e-6}),
        ("E01", {"polar_inertia": 0.11}),
        ("E02", {"force__along": 401.0}),
        ("E02", {"force__x": 60.1}),
        ("E02", {"bearing__stop_gap": 20.1e-6}),
        ("E02", {"bearing__stop_stiffness": 3.03e8}),
        ("E02", {"face__gap": 100.1e-6}),
        ("E02", {"face__stiffness": 2.01e8}),
        ("E02", {"face__friction": 0.121}),
    ],
)
