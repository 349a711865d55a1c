"""Heat of a touchdown bearing: a network of nodes, a sliding race, preload by warmth, its steady state."""

import math

import numpy as np
from cases import checks_of
from rigid_machine import SHAFT, disc_in

from rotordrop.elements.thermal import steady_limit
from rotordrop.physics import thermal
from rotordrop.simulate.case import CentredStart, DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.heat import preload_of, remembered, warmed


def pair_of(v):
    """A rigid rotor in one pair whose race passes no heat on."""
    u = {"m": 20.0, "gap": 1e-4, "mu": 0.1, "race_mass": 0.24, "inertia": 4e-4, "drag": 0.0} | dict(v)
    pair = f"""
[[touchdown_bearings]]
name = "A"
node = 2
air_gap = "{u["gap"]} m"
bore_radius = "34 mm"
bearing = {{ ball_diameter = "{u["ball_diameter"]} m", ball_count = {u["balls"]}, \
pitch_diameter = "{u["pitch_diameter"]} m", contact_angle = "25 deg", preload = "{u["preload"]} N", \
conformity = {u["conformity"]}, arrangement = "X" }}
contact = {{ stiffness = "1e9 N/m^1.1111", damping = "0 s/m" }}
friction = {{ static = {u["mu"]}, dynamic = {u["mu"]} }}
race = {{ mass = "{u["race_mass"]} kg", inertia = "{u["inertia"]} kg m^2", drag_coefficient = {u["drag"]} }}
support = {{ mass = "10 kg", stiffness = "1e8 N/m" }}
thermal = {{ sleeve_conductance = "0 W/K", ball_conductance = "0 W/K" }}
"""
    return disc_in(pair, u["m"] - SHAFT, 9.81, u.get("speed", 100.0))


def network(v):
    """Steady state and time constants, and the way there in many steps."""
    nodes = thermal.HeatNetwork.of(*(np.array(v[name]) for name in ("capacities", "neighbours", "out")))
    powers, warmth, gone = np.array(v["powers"]), np.zeros(len(v["capacities"])), 0.0
    for _ in range(v["steps"]):
        warmth, more = nodes.after(warmth, powers, v["time"] / v["steps"])
        gone += more
    held = float(np.sum(nodes.capacity * warmth))
    return {
        "inner race at the end": float(nodes.steady(powers)[1]),
        "inner race after many steps": float(warmth[1]),
        "shortest time constant": 1.0 / float(np.max(nodes.rates)),
        "longest time constant": 1.0 / float(np.min(nodes.rates)),
        "heat that is nowhere": float(np.sum(powers)) * v["time"] - held - gone,
    }


def spun_up(v):
    """A drop until the race turns with a rotor that keeps its speed."""
    case = DropCase(
        speed=2.0 * math.pi * v["speed"], duration=v["duration"], output_step=1e-3, spin="constant",
        start=CentredStart(),
    )  # fmt: skip
    drop = simulate_drop(pair_of(v), case)
    assert drop.lost is not None
    assert drop.heat is not None
    return {"heat of sliding": float(drop.lost[0, 0]), "warming of the race": float(drop.heat.race(0)[-1])}


def preloads(v):
    """Axial force of a row of the kernel's bearing with a warm or cold race."""
    model, found = pair_of(v), {}
    for name, text in (("warmer", "10 K warmer"), ("colder", "20 K colder")):
        p = model.parameters._replace(memory=model.parameters.memory.copy())
        remembered(p, p.memory)[0, [thermal.SKIN, thermal.RACE]] = v[name]
        state = model.at_rest()
        found[f"preload, race {text}"] = preload_of(0, warmed(p, p.memory, state), state)[0]
    return found


def least(v):
    """What `check` says of a pair at a speed."""
    limit = steady_limit(pair_of(v).machine.touchdown_bearings[0], 2.0 * math.pi * v["speed"])
    assert limit is not None
    return {"least conductance": limit[0], "warmth there": limit[1]}


CASES = {"HT01": network, "HT02": spun_up, "HT03": preloads, "HT04": least}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
