"""Drops computed by a code of others, EXUDYN: a rigid rotor in two bearings, and one landing on a face."""

import math
from dataclasses import replace

import numpy as np
from cases import checks_of
from rigid_machine import bearing_of, linked, rigid_model

from rotordrop import DropCase, PlacedStart, build_drop_model, simulate_drop
from rotordrop.machine import loads_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.reduction import Reduction


def rigid_rotor(inputs):
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
    bearings = "".join(bearing_of(values_of(v), v["name"], node) for node, v in ((1, first), (3, second)))
    model = build_drop_model(loads_machine(rotor + bearings), Reduction(modes=2, attachment=False))
    halves = np.array([0.5 * v["ring_mass"] for v in inputs["bearings"]])
    parameters = linked(model, inputs["link"], halves)
    parameters.bearing[:, L.RACE_WEIGHT] = 0.0
    return replace(model, parameters=parameters)


NAMES = {
    "c": "air_gap", "r": "bore_radius", "K": "contact_stiffness", "n": "contact_exponent", "mu": "friction",
    "ms": "ring_mass", "I": "race_inertia", "Ks": "support_stiffness", "Cs": "support_damping",
}  # fmt: skip


def values_of(bearing):
    """The values of a bearing of a case by the names of `bearing_of`."""
    return {"lam": 0.0} | {short: bearing[name] for short, name in NAMES.items()}


def coasting_case(inputs, velocity):
    """A drop from the middle of the bearings with velocities there [m/s], shape (B, 2)."""
    return DropCase(
        speed=inputs["speed"],
        duration=inputs["duration"],
        output_step=inputs["compared_step"],
        tolerance=1e-9,
        spin="coasting",
        start=PlacedStart(displacement=np.zeros_like(velocity), velocity=velocity),
    )


def path_of_exudyn(inputs):
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


def landing_of_exudyn(inputs):
    """Displacement [m] of a rotor that a thrust lands on a face, and spin of the race there [rad/s]."""
    b, face = inputs["bearing"], inputs["face"]
    aside, up, along = (inputs["force"][axis] for axis in ("x", "y", "along"))
    values = values_of(b) | {"m": inputs["mass"], "g": inputs["gravity"]}
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
        values,
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


CASES = {"E01": path_of_exudyn, "E02": landing_of_exudyn}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
