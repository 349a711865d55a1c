"""Axial motion: forces at rest by the ball sum, landings and the spin-up by a face by `simulate_drop`."""

import math
from dataclasses import replace

import numpy as np
from cases import checks_of
from rigid_machine import SHAFT, disc_in

from rotordrop.physics import columns as L
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.physics.contact import contact_law
from rotordrop.simulate.case import CentredStart, DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.used import landings

RIGID = 1e4
"""Factor on the stiffness of the balls that makes them rigid beside a face."""


def model_of(v, rigid_balls=False):
    """A rigid rotor without weight in the plane, pushed along its axis onto the face of one pair."""
    u = {"m": 20.0, "push": 0.0, "gap": 1e-4, "face": 1e12, "lam": 0.0, "mu": 0.0, "race_mass": 5e-3} | dict(
        v
    )
    pair = f"""
[[loads]]
node = 2
direction = "axial"
force = "{u["push"]} N"
[[touchdown_bearings]]
name = "A"
node = 2
air_gap = "0.25 mm"
bore_radius = "34 mm"
damping_time = "0 s"
bearing = {{ ball_diameter = "{u["ball_diameter"]} m", ball_count = {u["balls"]}, \
pitch_diameter = "{u["pitch_diameter"]} m", contact_angle = "25 deg", preload = "{u["preload"]} N", \
conformity = {u["conformity"]}, arrangement = "{u.get("arrangement", "X")}", \
row_spacing = "{u.get("row_spacing", 0.016)} m" }}
face = {{ gap = "{u["gap"]} m", inner_radius = "{u.get("inner", 0.035)} m", \
outer_radius = "{u.get("outer", 0.039)} m", stiffness = "{u["face"]} N/m", damping = "{u["lam"]} s/m", \
friction = {u["mu"]} }}
contact = {{ stiffness = "1e9 N/m^1.1111" }}
race = {{ mass = "{u["race_mass"]} kg", inertia = "{u.get("inertia", 4e-4)} kg m^2", drag_coefficient = 0.0 }}
support = {{ mass = "10 kg", stiffness = "1e8 N/m" }}
"""
    model = disc_in(pair, u["m"] - SHAFT, 0)
    if not rigid_balls:
        return model
    bearing = model.parameters.bearing.copy()
    bearing[:, L.BALL_STIFFNESS] *= RIGID
    return replace(model, parameters=model.parameters._replace(bearing=bearing))


def dropped(model, duration, speed=0.0, output_step=1e-6):
    case = DropCase(
        speed=speed, duration=duration, output_step=output_step, tolerance=1e-8, spin="constant",
        start=CentredStart(),
    )  # fmt: skip
    return simulate_drop(model, case)


def at_rest(v):
    """Axial forces of the pair at two displacements, and its stiffness against tilt in both arrangements."""
    numbers = model_of(v).machine.touchdown_bearings[0].bearing.numbers()
    found = {}
    for name in ("near", "far"):
        response = bearing_response(numbers.constants, [0.0, 0.0, v[name], 0.0, 0.0])
        found[f"axial force, {name}"] = -float(response.force[2])
    found["load of the relieved row, far"] = float(np.min(np.max(response.ball_loads, axis=1)))
    for arrangement in ("X", "O"):
        bearing = model_of({**v, "arrangement": arrangement}).machine.touchdown_bearings[0].bearing
        (tilt,) = [
            one.value
            for one in bearing.numbers().axial_figures(contact_law(1e9, 1.0, 0.0), 1e-4, 0.0)
            if one.field == "tilt_stiffness_N_m_per_rad"
        ]
        found[f"tilt stiffness, {arrangement}"] = tilt
    return found


def landed(v):
    """Largest force of the balls along the axis and contact angle of two rotors, simulated and by energy."""
    found = {}
    for name in ("light", "heavy"):
        mass, gap = v[name]["m"], v[name]["gap"]
        push = mass * v["g"]
        model = model_of({**v, "m": mass, "gap": gap, "push": push})
        fall = math.sqrt(2.0 * gap * mass / push)
        drop = dropped(model, fall + 2.5e-3)
        numbers = model.machine.touchdown_bearings[0].bearing.numbers()
        deepest = float(np.max(drop.race_axial_displacement("A")))
        response = bearing_response(numbers.constants, [0.0, 0.0, deepest, 0.0, 0.0])
        found[f"axial force, {name} rotor"] = -float(response.force[2])
        (one,) = landings(model.machine, drop)
        found[f"contact angle, {name} rotor"] = math.degrees(one.contact_angle)
        rigid = numbers.landing(contact_law(1e15, 1.0, 0.0), gap, push)
        found[f"axial force by energy, {name} rotor"] = rigid[0]
    return found


def on_a_spring(v):
    """Largest force on a linear face before balls as good as rigid."""
    drop = dropped(model_of(v, rigid_balls=True), v["duration"])
    contacts = drop.contacts_at("A.face")
    assert contacts is not None
    return {"axial force": float(np.max(contacts.peak_force))}


def spun_up(v):
    """Time until the race turns with the rotor, by its even acceleration, and the heat of sliding."""
    omega = 2.0 * math.pi * v["speed"]
    drop = dropped(model_of(v), v["duration"], omega, 1e-4)
    race = drop.race_speed[:, 0]
    most = int(np.argmax(race > 0.9 * omega))
    assert drop.lost is not None
    # the last of it creeps below the smoothing speed
    return {
        "race in step after": float(drop.time[most] * omega / race[most]),
        "heat of sliding": float(drop.lost[0, 0]),
    }


CASES = {"AX01": at_rest, "AX02": landed, "AX03": on_a_spring, "AX04": spun_up}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
