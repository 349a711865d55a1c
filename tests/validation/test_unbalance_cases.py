"""Unbalance response, deflected shapes, amplification factors and separation margins against known ones."""

import math
from dataclasses import replace

import numpy as np
from cases import checks_of
from test_rotor_cases import disc_rotor, rigid_rotor, rpm

from rotordrop.rotor.campbell import Separation
from rotordrop.rotor.suspension import Link, Support, spring
from rotordrop.rotor.whirl import unbalance_response


def amplification(inputs):
    """Amplification factor of a single mass from its response, and the margins that follow from it."""
    m, k, zeta = inputs["m"], inputs["k"], inputs["damping_ratio"]
    omega = math.sqrt(k / m)
    rotor = rigid_rotor(0.5, 0.5, m, 0.0, 1e-3)
    held = [spring(node, 0.5 * k, zeta * math.sqrt(k * m)) for node in (1, 3)]
    speeds = np.linspace(0.3 * omega, 2.0 * omega, 20001)
    amplitude = np.abs(unbalance_response(rotor, speeds, {2: m * inputs["eccentricity"]}, held)[:, 1, 0])
    top = int(np.argmax(amplitude))
    level = amplitude[top] / math.sqrt(2.0)
    low = float(np.interp(level, amplitude[: top + 1], speeds[: top + 1]))
    high = float(np.interp(-level, -amplitude[top:], speeds[top:]))
    peak, factor = float(speeds[top]), float(speeds[top]) / (high - low)
    found = {
        "speed of the peak": peak / rpm(1.0),
        "amplitude of the peak": float(amplitude[top]),
        "amplification factor": factor,
    }
    for name, (lowest, highest) in inputs["operating_rpm"].items():
        one = Separation.of(peak, factor, rpm(lowest), rpm(highest))
        found |= {f"{name}: margin": one.margin, f"{name}: required margin": one.required}
    return found


def fixed_point(inputs):
    """A mass on a shaft in series with springs and dampers: where damping does not matter."""
    m, shaft, bearing = inputs["m"], inputs["shaft_stiffness"], inputs["bearing_stiffness"]
    rotor = rigid_rotor(0.5, 0.5, m, 0.0, 1e-3)
    softest, stiffest = shaft * bearing / (shaft + bearing), shaft
    omega = math.sqrt((softest + stiffest) / (2.0 * m))
    found = {"speed of the fixed point": omega / rpm(1.0)}
    for damping in inputs["dampings"]:
        links = (
            Link(stiffness=0.5 * shaft * np.eye(2), damping=np.zeros((2, 2))),
            Link(stiffness=0.5 * bearing * np.eye(2), damping=0.5 * damping * np.eye(2)),
        )
        held = [Support(node=node, links=links, masses=(inputs["journal_mass"],)) for node in (1, 3)]
        answer = unbalance_response(rotor, omega, {2: m}, held)
        found[f"amplification with {damping:g} N s/m"] = float(np.abs(answer[0, 1, 0]))
    return found


def couple_unbalance(inputs):
    """A rigid rotor with opposite unbalances at its ends: only the conical motion answers."""
    a, k, c, amount = inputs["a"], inputs["k"], inputs["c"], inputs["unbalance"]
    rotor = rigid_rotor(a, a, inputs["m"], inputs["Ip"], inputs["Id"])
    held = [spring(node, k, c) for node in (1, 3)]
    found = {}
    for speed in inputs["speeds"]:
        answer = unbalance_response(rotor, speed, {1: amount, 3: -amount}, held)[0]
        found[f"end at {speed:g} rad/s"] = float(np.abs(answer[0, 0]))
        assert np.abs(answer[1]).max() < 1e-9 * found[f"end at {speed:g} rad/s"]
    return found


def unlike_supports(inputs):
    """A mass on supports that differ in x and y: between its critical speeds it whirls against its spin."""
    m, k_x, k_y, zeta = inputs["m"], inputs["k_x"], inputs["k_y"], inputs["damping_ratio"]
    rotor = rigid_rotor(0.5, 0.5, m, 0.0, 1e-3)
    damping = [zeta * math.sqrt(k_x * m), zeta * math.sqrt(k_y * m)]
    held = [spring(node, [0.5 * k_x, 0.5 * k_y], damping) for node in (1, 3)]
    found = {}
    for speed in inputs["speeds"]:
        x, y = unbalance_response(rotor, speed, {2: m * inputs["eccentricity"]}, held)[0, 1]
        forward, backward = 0.5 * abs(x + 1j * y), 0.5 * abs(np.conj(x) + 1j * np.conj(y))
        found |= {
            f"forward radius at {speed:g} rad/s": float(forward),
            f"backward radius at {speed:g} rad/s": float(backward),
            f"phase of x at {speed:g} rad/s": math.degrees(np.angle(x)),
        }
    return found


def orbit_axis(displacement):
    """Half the major axis of orbits (x, y), last axis 2: a forward and a backward circle make the ellipse."""
    x, y = displacement[..., 0], displacement[..., 1]
    return np.asarray(0.5 * np.abs(x + 1j * y) + 0.5 * np.abs(np.conj(x) + 1j * np.conj(y)))


def response_of(inputs, node, speed):
    """Displacement (x, y) of a node of a disc rotor under the unbalances of the case."""
    fe, held = disc_rotor(inputs)
    unbalances = {int(n): complex(u) for n, u in inputs["unbalances"].items()}
    moved = unbalance_response(replace(fe, modal_damping=0.0), speed, unbalances, held)
    return np.asarray(moved[0, node - 1])


def two_discs(inputs):
    found = {}
    for speed in inputs["speeds"]:
        x, y = np.abs(response_of(inputs, 1, speed))
        found |= {f"x at {speed:g} rad/s": float(x), f"y at {speed:g} rad/s": float(y)}
    return found


def probe(inputs):
    found = {}
    for speed in inputs["speeds"]:
        moved = response_of(inputs, 1, speed)
        along = (moved[0] + moved[1]) / math.sqrt(2.0)
        found |= {
            f"probe at 45° at {speed:g} rad/s": float(abs(along)),
            f"major axis at {speed:g} rad/s": float(orbit_axis(moved)),
        }
    return found


def deflected_shape(inputs):
    (speed,) = inputs["speeds"]
    return {f"major axis at node {n}": float(orbit_axis(response_of(inputs, n, speed))) for n in (1, 2)}


CASES = {
    "U01": amplification,
    "U02": fixed_point,
    "U03": couple_unbalance,
    "U04": unlike_supports,
    "U05": two_discs,
    "U06": probe,
    "U07": deflected_shape,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
