"""Rotor cases: published codes, a book and closed forms; every number by our elements and modes."""

import math

import numpy as np
import pytest
from cases import checks_of
from scipy.optimize import minimize_scalar
from tests.reference.closed_forms import rectangle_shear_coefficient

from rotordrop.physics.timoshenko import Section, round_section
from rotordrop.rotor.assembly import PointMass, assemble, modes_on_springs
from rotordrop.rotor.critical_speeds import critical_speeds
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import spring
from rotordrop.rotor.whirl import unbalance_response, whirl_modes

RIGID = Reduction(modes=2, attachment=False)
PINNED = 1e14


def rpm(value):
    return value * 2.0 * math.pi / 60.0


def uniform(section, length, elements, discs=()):
    """A uniform shaft of equal elements, without material damping."""
    return assemble(np.linspace(0.0, length, elements + 1), [section] * elements, discs, modal_damping=0.0)


def node_at(inputs, z):
    return 1 + round(z / inputs["L"] * inputs["elements"])


def disc_of(inputs, disc):
    """A disc by its inertias, or a cylinder of the shaft's density."""
    node = node_at(inputs, disc["z"])
    if "m" in disc:
        return PointMass(node=node, mass=disc["m"], polar_inertia=disc["Ip"], diametral_inertia=disc["Id"])
    outer, inner, width = disc["od"], disc["id"], disc["width"]
    mass = inputs["rho"] * 0.25 * math.pi * (outer**2 - inner**2) * width
    polar = mass * (outer**2 + inner**2) / 8.0
    return PointMass(
        node=node, mass=mass, polar_inertia=polar, diametral_inertia=0.5 * polar + mass * width**2 / 12.0
    )


def disc_rotor(inputs):
    nu = inputs["nu"] if "nu" in inputs else inputs["E"] / (2.0 * inputs["G"]) - 1.0
    section = round_section(inputs["d"], 0.0, inputs["E"], nu, inputs["rho"])
    discs = tuple(disc_of(inputs, disc) for disc in inputs["discs"])
    rotor = uniform(section, inputs["L"], inputs["elements"], discs)
    nodes = [node_at(inputs, z) for z in inputs["bearing_z"]]
    return rotor, [spring(node, inputs["stiffness"], inputs["damping"]) for node in nodes]


def at_speeds(inputs):
    rotor, supports = disc_rotor(inputs)
    return {f"{speed:.0f} rpm": whirl_modes(rotor, rpm(speed), supports) for speed in inputs["speeds_rpm"]}


def undamped_disc_rotor(inputs):
    return {
        f"lateral natural frequency {k + 1} at {speed}": modes.eigenvalue[k].imag
        for speed, modes in at_speeds(inputs).items()
        for k in range(5)
    }


def damped_disc_rotor(inputs):
    numbers = {}
    for speed, modes in at_speeds(inputs).items():
        for k in range(6 if speed == "0 rpm" else 5):
            numbers[f"|lambda| mode {k + 1} at {speed}"] = abs(modes.eigenvalue[k]) / (2.0 * np.pi)
            numbers[f"damped frequency mode {k + 1} at {speed}"] = modes.frequency[k]
    return numbers


def three_disc_rotor(inputs):
    numbers = {}
    for speed, modes in at_speeds(inputs).items():
        for k in range(4):
            numbers[f"frequency mode {k + 1} at {speed}"] = modes.frequency[k]
            numbers[f"damping ratio mode {k + 1} at {speed}"] = modes.damping_ratio[k]
    return numbers


def lumped_stations(inputs):
    """Massless elements between stations that carry all the mass."""
    stations = inputs["stations_m_Ip_It"]
    nu = inputs["E"] / (2.0 * inputs["G"]) - 1.0
    section = round_section(inputs["d"], 0.0, inputs["E"], nu, 0.0)
    masses = tuple(
        PointMass(node=k, mass=m, polar_inertia=polar, diametral_inertia=diametral)
        for k, (m, polar, diametral) in enumerate(stations, start=1)
    )
    elements = len(stations) - 1
    rotor = uniform(section, elements * inputs["element_length"], elements, masses)
    supports = [spring(node, inputs["stiffness"]) for node in (1, len(stations))]
    modes = whirl_modes(rotor, rpm(inputs["speed_rpm"]), supports)
    return {f"natural frequency {k + 1}": modes.frequency[k] for k in range(8)}


def spinning_simply_supported_shaft(inputs):
    """Shear and rotary inertia off, gyroscopic effect on."""
    area, second_moment = math.pi * inputs["R"] ** 2, 0.25 * math.pi * inputs["R"] ** 4
    section = Section(
        bending_stiffness=inputs["E"] * second_moment,
        shear_stiffness=math.inf,
        mass=inputs["rho"] * area,
        diametral_inertia=0.0,
        polar_inertia=2.0 * inputs["rho"] * second_moment,
    )
    elements = inputs["elements"]
    rotor = uniform(section, inputs["L"], elements)
    ends = (1, elements + 1)
    rest = modes_on_springs(rotor, dict.fromkeys(ends, PINNED), 4)
    spin = whirl_modes(rotor, inputs["Omega"], [spring(node, PINNED) for node in ends], 8)
    numbers = {f"mode {k + 1} at rest": rest.frequency[k] for k in range(4)}
    for direction in ("backward", "forward"):
        found = [f for f, d in zip(spin.frequency, spin.direction, strict=True) if d == direction]
        numbers |= {f"mode {k + 1} {direction} at 1e4 rad/s": found[k] for k in range(4)}
    return numbers


def deep_square_beam(inputs):
    side, E, nu, rho = inputs["square_side"], inputs["E"], inputs["nu"], inputs["rho"]
    second_moment = side**4 / 12.0
    section = Section(
        bending_stiffness=E * second_moment,
        shear_stiffness=rectangle_shear_coefficient(nu) * E / (2.0 * (1.0 + nu)) * side**2,
        mass=rho * side**2,
        diametral_inertia=rho * second_moment,
        polar_inertia=2.0 * rho * second_moment,
    )
    rotor = uniform(section, inputs["L"], inputs["elements"])
    modes = modes_on_springs(rotor, dict.fromkeys((1, inputs["elements"] + 1), 1e17), 3)
    return {f"bending mode {k + 1} (double)": modes.frequency[k] for k in range(3)}


def ends_of_the_map(inputs):
    """Critical speed map at standstill at its soft and its stiff end."""
    section = round_section(inputs["d"], 0.0, inputs["E"], inputs["nu"], inputs["rho"])
    rotor = uniform(section, inputs["L"], inputs["elements"])
    soft, stiff = (
        critical_speeds(
            rotor, [spring(node, k) for node in (1, inputs["elements"] + 1)], whirl="standstill", count=5
        )
        for k in inputs["support_stiffness"]
    )
    return {f"free-free bending mode {k + 1}": soft[k + 2] for k in range(3)} | {
        f"simply supported mode {k + 1}": stiff[k] for k in range(3)
    }


def rigid_rotor(a, b, m, polar, diametral):
    """A body on a shaft without mass, a behind the first end and b before the other, as rigid modes."""
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    body = PointMass(node=2, mass=m, polar_inertia=polar, diametral_inertia=diametral)
    return reduce_rotor(assemble([0.0, a, a + b], [section] * 2, [body]), RIGID)


def jeffcott_unbalance(inputs):
    m, k, c = inputs["m"], inputs["k"], inputs["c"]
    rotor = rigid_rotor(0.5, 0.5, m, 0.0, 1e-3)
    held = [spring(node, 0.5 * k, 0.5 * c) for node in (1, 3)]

    def amplitude(omega):
        response = unbalance_response(rotor, omega, {2: m * inputs["eccentricity"]}, held)
        return float(np.abs(response[0, 1, 0]))

    critical = critical_speeds(rotor, held)[0] * 2.0 * math.pi
    peak = minimize_scalar(
        lambda omega: -amplitude(omega), bounds=(0.5 * critical, 2.0 * critical), options={"xatol": 1e-6}
    )
    return {
        "undamped critical speed": critical / rpm(1.0),
        "speed of peak response": peak.x / rpm(1.0),
        "peak amplitude": amplitude(peak.x),
        "amplitude at 2x critical": amplitude(2.0 * critical),
    }


def rigid_rotor_on_springs(inputs):
    body = (inputs["m"], inputs["Ip"], inputs["Id"])
    even, uneven = inputs["symmetric"], inputs["unsymmetric"]
    rotor = rigid_rotor(even["a"], even["b"], *body)
    modes = whirl_modes(rotor, even["Omega"], [spring(node, even["k"]) for node in (1, 3)])
    conical = {d: f for f, d in zip(modes.frequency[2:], modes.direction[2:], strict=True)}
    assert modes.frequency[0] == pytest.approx(modes.frequency[1], rel=1e-9)
    rotor = rigid_rotor(uneven["a"], uneven["b"], *body)
    held = [spring(1, uneven["k1"]), spring(3, uneven["k2"])]
    others = whirl_modes(rotor, rpm(uneven["speed_rpm"]), held)
    return {
        "bounce (symmetric)": modes.frequency[0],
        "conical backward (symmetric)": conical["backward"],
        "conical forward (symmetric)": conical["forward"],
    } | {f"unsymmetric mode {k + 1} at 12000 rpm": others.frequency[k] for k in range(4)}


CASES = {
    "R01": undamped_disc_rotor,
    "R02": undamped_disc_rotor,
    "R05": damped_disc_rotor,
    "R07": lumped_stations,
    "R08": three_disc_rotor,
    "R10": spinning_simply_supported_shaft,
    "R12": deep_square_beam,
    "R13": ends_of_the_map,
    "R16": jeffcott_unbalance,
    "R18": rigid_rotor_on_springs,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
