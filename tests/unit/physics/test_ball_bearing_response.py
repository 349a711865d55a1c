"""Laws of the five-degree-of-freedom ball bearing: energy, symmetry, rotation, arrangements, equilibrium."""

import math

import numpy as np
import pytest
from tests.reference.closed_forms import bearing_equilibrium

from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.physics.ball_bearing_response import bearing_response, simple_radial_stiffness
from rotordrop.physics.ball_set import ball_set_entries, ball_set_force, ball_set_gradient
from rotordrop.physics.hertz import compliance

SPACING = 0.016
ARRANGEMENTS = ("X", "O", "tandem", "single")
UNITS = np.array([1e-5, 1e-5, 5e-6, 2e-4, 2e-4])


def displacements(count, seed=7):
    """Displacements at which some balls are loose and some heavily loaded."""
    return np.random.default_rng(seed).normal(size=(count, 5)) * UNITS


def turn(q, angle):
    """A displacement or force turned about z."""
    c, s = math.cos(angle), math.sin(angle)
    rotation = np.eye(5)
    rotation[:2, :2] = rotation[3:, 3:] = [[c, -s], [s, c]]
    return rotation @ q


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_force_is_minus_the_gradient_of_the_elastic_energy(touchdown_bearing, arrangement):
    constants = bearing_constants(touchdown_bearing(arrangement=arrangement, second_row_offset=0.3))
    for q in displacements(6):
        response = bearing_response(constants, q, row_spacing=SPACING)
        steps = 1e-4 * np.diag(UNITS)
        energy = [
            [bearing_response(constants, q + sign * step, row_spacing=SPACING).energy for sign in (1, -1)]
            for step in steps
        ]
        gradient = -np.diff(energy, axis=1)[:, 0] / (2 * np.diag(steps))
        np.testing.assert_allclose(
            response.force * UNITS, -gradient * UNITS, atol=2e-6 * np.max(np.abs(response.force * UNITS))
        )


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_stiffness_is_minus_the_derivative_of_the_force_and_symmetric(touchdown_bearing, arrangement):
    constants = bearing_constants(touchdown_bearing(arrangement=arrangement, second_row_offset=0.3))
    scale = np.outer(UNITS, UNITS)
    for q in displacements(6, seed=3):
        stiffness = bearing_response(constants, q, row_spacing=SPACING).stiffness
        columns = []
        for step in 1e-5 * np.diag(UNITS):
            up = bearing_response(constants, q + step, row_spacing=SPACING).force
            down = bearing_response(constants, q - step, row_spacing=SPACING).force
            columns.append((down - up) / (2 * step.sum()))
        size = np.max(np.abs(stiffness * scale))
        np.testing.assert_allclose(stiffness * scale, np.array(columns).T * scale, atol=2e-5 * size)
        np.testing.assert_allclose(stiffness * scale, stiffness.T * scale, atol=1e-14 * size)
        assert np.all(np.linalg.eigvalsh(stiffness * scale) > -1e-12 * size)


def test_turning_the_balls_or_mirroring_turns_or_mirrors_the_force(touchdown_bearing):
    """The balls are their own mirror image (first on +y): x and the rotation about y change sign."""
    q = displacements(1)[0]
    force = bearing_response(bearing_constants(touchdown_bearing()), q, row_spacing=SPACING).force
    for angle in (0.3, 2.0, 4.5):
        constants = bearing_constants(touchdown_bearing(first_ball_angle=angle))
        turned = bearing_response(constants, turn(q, angle), row_spacing=SPACING).force
        np.testing.assert_allclose(turned, turn(force, angle), rtol=1e-9, atol=1e-9)
    constants = bearing_constants(touchdown_bearing())
    mirror = np.array([-1.0, 1.0, 1.0, 1.0, -1.0])
    for q in displacements(3):
        force = bearing_response(constants, q, row_spacing=SPACING).force
        mirrored = bearing_response(constants, mirror * q, row_spacing=SPACING).force
        np.testing.assert_allclose(mirrored, mirror * force, rtol=1e-9, atol=1e-9)


def test_an_o_pair_is_an_x_pair_with_the_rows_exchanged(touchdown_bearing):
    pair = [bearing_constants(touchdown_bearing(arrangement=a)) for a in ("X", "O")]
    x, o = (bearing_response(c, [3e-6, -2e-5, 0, 0, 0], row_spacing=SPACING) for c in pair)
    np.testing.assert_allclose(x.force[:3], o.force[:3], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(x.stiffness[:3, :3], o.stiffness[:3, :3], rtol=1e-9, atol=1.0)
    np.testing.assert_allclose(x.ball_loads, o.ball_loads, rtol=1e-12)
    x, o = (bearing_constants(touchdown_bearing(arrangement=a)) for a in ("X", "O"))
    for q in displacements(3):
        force_x = bearing_response(x, q, row_spacing=SPACING).force
        force_o = bearing_response(o, q, row_spacing=-SPACING).force
        np.testing.assert_allclose(force_x, force_o, rtol=1e-10, atol=1e-9)


def test_o_arrangement_resists_tilt_with_the_longer_base(touchdown_bearing):
    """Moment stiffness of a pair: its load lines meet the axis at the distance D_pw tan α ± l."""
    tilt = {}
    for arrangement in ("X", "O"):
        constants = bearing_constants(touchdown_bearing(arrangement=arrangement))
        response = bearing_response(constants, np.zeros(5), row_spacing=SPACING)
        tilt[arrangement] = response.stiffness[3, 3]
        slope = 1.5 * constants.ball_stiffness ** (2 / 3) * constants.preload_ball_load ** (1 / 3)
        phi = math.atan2(constants.axial_offset, constants.radial_offset)
        sign = 1.0 if arrangement == "O" else -1.0
        base = 0.5 * SPACING * math.cos(phi) + sign * constants.pitch_radius * math.sin(phi)
        along = slope * 23 * base**2
        # the rest is the force turning with the tilt
        assert tilt[arrangement] == pytest.approx(along, rel=0.08)
        assert tilt[arrangement] > along
    assert tilt["O"] > 2.0 * tilt["X"]


def test_rigid_tilt_is_the_same_as_axial_motion_of_each_ball(touchdown_bearing):
    """Right-handed axes: a turn about +x lifts the race at +y in +z, a turn about +y sinks it at +x."""
    constants = bearing_constants(touchdown_bearing(ball_count=4, arrangement="single"))
    for tilt, loaded in (((1e-4, 0), "+y"), ((-1e-4, 0), "-y"), ((0, 1e-4), "-x"), ((0, -1e-4), "+x")):
        loads = bearing_response(constants, [0, 0, 0, *tilt]).ball_loads[0]
        assert ("+y", "-x", "-y", "+x")[int(np.argmax(loads))] == loaded
        moved = bearing_response(constants, [0, 0, 1e-4 * 0.0425, 0, 0]).ball_loads[0]
        assert loads.max() == pytest.approx(moved.max(), rel=1e-12)


def test_planar_kernel_agrees_with_the_full_function(touchdown_bearing):
    constants = bearing_constants(touchdown_bearing(first_ball_angle=0.05))
    beta = np.append(constants.ball_angles, 0.0)
    weights = np.append(np.full(23, 2.0), 0.0)
    entries, balls = ball_set_entries(constants), np.array([np.cos(beta), np.sin(beta), weights])
    for dx, dy, *_ in displacements(5):
        full = bearing_response(constants, [dx, dy, 0, 0, 0])
        force = ball_set_force(entries, balls, dx, dy, np.empty((2, 24)))
        assert force == pytest.approx(tuple(-full.force[:2]), rel=1e-9, abs=1e-9)
        gradient = ball_set_gradient(entries, balls, dx, dy)
        k = full.stiffness
        assert gradient[2:] == pytest.approx((k[0, 0], k[0, 1], k[1, 1]), rel=1e-9, abs=1.0)


def test_stress_is_the_coefficient_times_the_cube_root_of_the_load(touchdown_bearing):
    constants = bearing_constants(touchdown_bearing())
    response = bearing_response(constants, [0, -2e-5, 0, 0, 0])
    ratio = response.stress_inner[response.ball_loads > 0] / response.stress_outer[response.ball_loads > 0]
    np.testing.assert_allclose(
        ratio, constants.stress_coefficient_inner / constants.stress_coefficient_outer, rtol=1e-13
    )
    loads = (response.stress_inner / constants.stress_coefficient_inner) ** 3
    np.testing.assert_allclose(loads, response.ball_loads, rtol=1e-12, atol=1e-12)
    bottom = int(np.argmax(response.ball_loads[0]))
    assert math.sin(constants.ball_angles[bottom]) < -0.98  # the loaded part of the race is at the bottom


def test_simple_formula_is_the_slope_of_its_deflection_that_of_gargiulo_and_knows_no_preload(
    touchdown_bearing,
):
    """Palmgren with Stribeck's 5 and the pound-inch coefficient 0.0325e6 are one formula within 0.2 %."""
    D, Z, alpha, F = 0.009525, 46, math.radians(25), 409.1
    inch, pound = 0.0254, 4.4482216
    gargiulo = 0.0325e6 * (D / inch * F / pound * Z**2 * math.cos(alpha) ** 5) ** (1 / 3) * pound / inch
    assert simple_radial_stiffness(D, Z, alpha, F) == pytest.approx(gargiulo, rel=2e-3)
    D, Z, alpha = 0.009525, 46, math.radians(25)
    stiffness = simple_radial_stiffness(D, Z, alpha, 400.0)
    assert simple_radial_stiffness(D, Z, alpha, 3200.0) == pytest.approx(2.0 * stiffness, rel=1e-12)
    ratio = compliance(208e9, 0.3, 315e9, 0.26) / compliance(208e9, 0.3, 208e9, 0.3)
    hybrid = simple_radial_stiffness(D, Z, alpha, 400.0, ratio)
    assert hybrid / stiffness == pytest.approx(ratio ** (-2 / 3), rel=1e-12)
    constants = bearing_constants(touchdown_bearing())
    q = bearing_equilibrium(constants, [0, -409.1, 0, 0, 0])
    tangent = bearing_response(constants, q).stiffness[1, 1]
    assert simple_radial_stiffness(0.009525, 46, constants.contact_angle, 409.1) < 0.5 * tangent
