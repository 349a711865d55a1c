"""Hertz contact and ball bearing cases: tables, textbook examples, standards and two catalogues."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cases import checks_of, load_case
from tests.plain_bearing import BallBearingGeometry
from tests.reference import closed_forms
from tests.reference.ball_bearing_catalogue import (
    conformity_of_rigidity,
    pair_lift_off_force,
    pair_rigidity,
    row_of_catalogue,
    row_of_conformity,
)
from tests.reference.closed_forms import bearing_equilibrium, lift_off_force

from rotordrop.elements.catalog.lookup import designations, find_bearing
from rotordrop.physics import hertz
from rotordrop.physics.ball_bearing import axial_rigidity, bearing_constants
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.severity.fatigue import ball_row, share_by_16281

CLASSES = ("light", "medium", "heavy")


def contact_parameters(inputs):
    numbers = {}
    for F_rho in inputs["F_rho"]:
        a_star, b_star, delta_star = hertz.contact_parameters(F_rho)
        numbers |= {
            f"a* at F(rho)={F_rho}": a_star,
            f"b* at F(rho)={F_rho}": b_star,
            f"delta* at F(rho)={F_rho}": delta_star,
        }
    return numbers


def curvatures(inputs):
    numbers = {}
    for name, bearing in (("209", inputs["b209"]), ("218", inputs["b218"])):
        f = bearing["f"] if "f" in bearing else bearing["groove_radius"] / bearing["Dw"]
        alpha = math.radians(bearing["alpha_deg"])
        for race in ("inner", "outer"):
            total, difference = hertz.race_curvatures(
                bearing["Dw"], bearing["dm"], f, alpha, inner=race == "inner"
            )
            numbers[f"{name} {race} curvature sum"] = total
            numbers[f"{name} {race} curvature difference F"] = difference
    return numbers


def iso_16281_equilibrium(inputs):
    """A deep-groove row: contact angle and axial offset come from the clearance; the race starts centred."""
    names = (
        "load case 1: radial displacement",
        "load case 2: axial displacement (from centred, incl. half axial clearance)",
        "load case 3: radial displacement",
    )
    numbers = {}
    for name, load in zip(names, inputs["load_cases"], strict=True):
        constants, q = deep_groove_equilibrium(inputs, load)
        numbers[name] = -q[1] if load["Fr"] else q[2] + constants.axial_offset
    return numbers


def deep_groove_equilibrium(inputs, load):
    """The row of H03, and where its race lies under a load case."""
    A_0 = inputs["ri"] + inputs["re"] - inputs["Dw"]
    constants = bearing_constants(
        BallBearingGeometry(
            ball_diameter=inputs["Dw"],
            ball_count=inputs["Z"],
            pitch_diameter=inputs["Dpw"],
            contact_angle=math.acos(1.0 - load["clearance_s"] / (2.0 * A_0)),
            conformity_inner=inputs["ri"] / inputs["Dw"],
            conformity_outer=inputs["re"] / inputs["Dw"],
            ring_youngs_modulus=inputs["E"],
            ring_poisson_ratio=inputs["nu"],
            ball_youngs_modulus=inputs["E"],
            ball_poisson_ratio=inputs["nu"],
            arrangement="single",
            first_ball_angle=math.pi,
        )
    )
    beside = 1e-5 if load["Fr"] and load["Fa"] else 0.0
    start = np.array([0.0, -1e-6, beside - constants.axial_offset, 0.0, 0.0])
    return constants, bearing_equilibrium(constants, [0.0, -load["Fr"], load["Fa"], 0.0, 0.0], start=start)


def iso_16281_life(inputs):
    """Revolutions until the share of the rating life is one, under a load that does not change."""
    row = ball_row(
        inputs["C"],
        inputs["Z"],
        inputs["Dw"] / inputs["Dpw"],
        1.0,
        inputs["ri"] / inputs["Dw"],
        inputs["re"] / inputs["Dw"],
    )
    numbers = {}
    for load in inputs["load_cases"]:
        balls = bearing_response(*deep_groove_equilibrium(inputs, load)).ball_loads
        a_turn = share_by_16281(
            row, np.array([0.0, 1.0]), np.repeat(balls, 2, axis=0), np.full(2, 2.0 * math.pi)
        )
        numbers[f"load case {load['case']}: reference rating life"] = 1e-6 / a_turn
    return numbers


def stribeck_loaded_inner_race(inputs):
    eta = hertz.compliance(inputs["E"], inputs["nu"], inputs["E"], inputs["nu"])
    f = inputs["groove_radius"] / inputs["Dw"]
    contact = hertz.race_contact(inputs["Dw"], inputs["dm"], f, 0.0, eta, inner=True)
    a, b = contact.semi_axes(inputs["Q"])
    pressure = float(contact.maximum_pressure(inputs["Q"]))
    return {
        "ellipticity (exact)": float(contact.semi_major_coefficient / contact.semi_minor_coefficient),
        "semi-major axis (exact)": float(a),
        "semi-minor axis (exact)": float(b),
        "max Hertz stress (exact)": pressure,
        "max Hertz stress (Hamrock-Brewe page)": pressure,
    }


def cylinder_on_a_block(inputs):
    (E_1, E_2), (nu_1, nu_2) = inputs["E"], inputs["nu"]
    line = hertz.LineContact(
        radius=inputs["radius"], length=1.0, compliance=hertz.compliance(E_1, nu_1, E_2, nu_2)
    )
    load = inputs["load_per_length"]
    return {"largest pressure": line.maximum_pressure(load), "half width": line.half_width(load)}


def circular_contacts(inputs):
    steel, ceramic = (tuple(inputs[name][key] for key in ("E", "nu")) for name in ("steel", "Si3N4"))
    all_steel, hybrid = hertz.compliance(*steel, *steel), hertz.compliance(*ceramic, *steel)
    numbers = {}
    for name, contact, Q in (
        (
            "sphere R=10 mm on plane, steel/steel, 100 N",
            closed_forms.circular_contact(0.01, math.inf, all_steel),
            100,
        ),
        (
            "spheres 10 and 20 mm, steel/steel, 500 N",
            closed_forms.circular_contact(0.01, 0.02, all_steel),
            500,
        ),
        (
            "Si3N4 ball R=5 mm on steel plane, 200 N",
            closed_forms.circular_contact(0.005, math.inf, hybrid),
            200,
        ),
    ):
        numbers[f"{name}: contact radius"] = float(contact.semi_axes(Q)[0])
        numbers[f"{name}: approach"] = float(contact.approach(Q))
        numbers[f"{name}: p0"] = float(contact.maximum_pressure(Q))
    return numbers


def catalogue(maker):
    bearings = (find_bearing(designation) for designation in designations())
    return [bearing for bearing in bearings if bearing.maker == maker]


def gmn_errors(bearings, eta, *, angle_changes=True):
    """Relative errors of the rigidity at light and strong preload; the medium one gives the conformity."""
    balls = [bearing.complement for bearing in bearings]
    D_w, D_pw = (np.array([getattr(b, f"{name}_diameter") for b in balls]) for name in ("ball", "pitch"))
    Z, alpha = np.array([b.ball_count for b in balls]), np.array([b.contact_angle for b in bearings])
    F_V, C_ax = (
        {c: np.array([getattr(b, quantity)[c] for b in bearings]) for c in CLASSES}
        for quantity in ("preload", "axial_rigidity")
    )
    f = conformity_of_rigidity(C_ax["medium"], F_V["medium"], D_w, D_pw, Z, alpha, eta)
    ZK, A_0 = row_of_conformity(f, D_w, D_pw, Z, alpha, eta)
    if not angle_changes:  # a groove distance beyond measure holds the contact angle; K then fits the medium
        A_0 = 1e6 * A_0
        ZK = ZK * (C_ax["medium"] / pair_rigidity(F_V["medium"], ZK, A_0, alpha)) ** 1.5
    predicted = [pair_rigidity(F_V[c], ZK, A_0, alpha) / C_ax[c] - 1.0 for c in ("light", "heavy")]
    return np.concatenate(predicted)


def gmn_catalogue(inputs):
    steel = (inputs["steel"]["E"], inputs["steel"]["nu"])
    errors = np.abs(gmn_errors(catalogue(inputs["maker"]), hertz.compliance(*steel, *steel)))
    return {
        "median |error| of predicted L and S rigidity": float(np.median(errors)),
        "90th percentile |error|": float(np.percentile(errors, 90)),
    }


def fag_errors(bearings):
    """Relative errors of rigidity and lift-off force at three preloads, two free numbers per bearing."""
    F_V, C_a, lift_off = (
        np.array([[getattr(b, quantity)[c] for c in CLASSES] for b in bearings])
        for quantity in ("preload", "axial_rigidity", "lift_off")
    )
    alpha = np.array([b.contact_angle for b in bearings])
    ZK, A_0 = row_of_catalogue(F_V, C_a, lift_off, alpha)
    row = (ZK[:, None], A_0[:, None], alpha[:, None])
    errors = [pair_rigidity(F_V, *row) / C_a - 1.0, pair_lift_off_force(F_V, *row) / lift_off - 1.0]
    return np.hstack(errors)


def fag_catalogue(inputs):
    errors = np.abs(fag_errors(catalogue(inputs["maker"])))
    return {
        "median |error| over all numbers": float(np.median(errors)),
        "95th percentile |error|": float(np.percentile(errors, 95)),
        "worst |error|": float(errors.max()),
    }


def papers_touchdown_bearing(inputs):
    numbers = {}
    for F_V in (96, 452, 1026):
        constants = bearing_constants(
            BallBearingGeometry(
                ball_diameter=inputs["Dw"],
                ball_count=inputs["Z"],
                pitch_diameter=inputs["dm"],
                contact_angle=math.radians(inputs["alpha0_deg"]),
                conformity_inner=inputs["fi"],
                conformity_outer=inputs["fo"],
                ring_youngs_modulus=inputs["ring_steel"]["E"],
                ring_poisson_ratio=inputs["ring_steel"]["nu"],
                ball_youngs_modulus=inputs["ball_Si3N4"]["E"],
                ball_poisson_ratio=inputs["ball_Si3N4"]["nu"],
                preload=F_V,
                arrangement="X",
            )
        )
        numbers[f"axial rigidity of pair at Fv={F_V} N"] = axial_rigidity(constants)
        numbers[f"lift-off force at Fv={F_V} N"] = lift_off_force(constants)
    return numbers


CASES = {
    "H01a": contact_parameters,
    "H02": curvatures,
    "H03a": iso_16281_equilibrium,
    "H03b": iso_16281_life,
    "H05": stribeck_loaded_inner_race,
    "H06a": gmn_catalogue,
    "H07a": fag_catalogue,
    "H09": circular_contacts,
    "H11": papers_touchdown_bearing,
    "H12": cylinder_on_a_block,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)


def test_fixed_contact_angle_fails_the_gmn_catalogue():
    case = load_case("H06a")
    steel = (case.inputs["steel"]["E"], case.inputs["steel"]["nu"])
    bearings = catalogue("GMN")
    errors = np.abs(gmn_errors(bearings, hertz.compliance(*steel, *steel), angle_changes=False))
    assert np.median(errors) > 2.0 * case.expected[0].tolerance
    assert len(bearings) == 107


@pytest.mark.parametrize(
    ("quantity", "preload_class", "factor"),
    [("preload", "medium", 1.05), ("lift_off", "heavy", 0.95), ("axial_rigidity", "light", 1.1)],
)
def test_perturbed_numbers_fail_the_fag_catalogue(quantity, preload_class, factor):
    case = load_case("H07a")
    bearings = catalogue("FAG")
    changed = []
    for bearing in bearings:
        values = getattr(bearing, quantity)
        values = values | {preload_class: factor * values[preload_class]}
        changed.append(replace(bearing, **{quantity: values}))
    errors = np.abs(fag_errors(changed))
    statistics = (np.median(errors), np.percentile(errors, 95), errors.max())
    assert any(not e.holds(value) for e, value in zip(case.expected, statistics, strict=True))
    assert len(bearings) == 433
