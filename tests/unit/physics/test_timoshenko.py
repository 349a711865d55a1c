"""Laws of the beam element: statics exact at nodes, symmetry, inertia of rigid motion, Cowper's limits."""

import math

import numpy as np
import pytest
from tests.reference.closed_forms import rectangle_shear_coefficient

from rotordrop.physics.timoshenko import (
    element_mass,
    element_polar,
    element_stiffness,
    round_section,
    shape_functions,
    shear_coefficient,
    shear_parameter,
    with_layer,
)

LENGTH = 0.3
STUBBY = round_section(0.12, 0.05, 2.1e11, 0.3, 7850.0)


def rigid_motions(length):
    shift = np.array([1.0, 0.0, 1.0, 0.0])
    turn = np.array([0.0, 1.0, length, 1.0])
    return shift, turn


def test_matrices_are_symmetric_of_the_right_rank_and_rigid_motion_is_free_with_the_inertia_of_the_cylinder():
    stiffness = element_stiffness(STUBBY, LENGTH)
    for matrix in (stiffness, element_mass(STUBBY, LENGTH), element_polar(STUBBY, LENGTH)):
        np.testing.assert_allclose(matrix, matrix.T, rtol=1e-14)
    scale = np.diag([1.0, 1.0 / LENGTH, 1.0, 1.0 / LENGTH])
    values = np.linalg.eigvalsh(scale @ stiffness @ scale)
    assert np.sum(np.abs(values) < 1e-9 * values[-1]) == 2
    assert np.linalg.eigvalsh(element_mass(STUBBY, LENGTH))[0] > 0.0
    for motion in rigid_motions(LENGTH):
        np.testing.assert_allclose(stiffness @ motion, 0.0, atol=1e-6 * np.max(stiffness))
    shift, turn = rigid_motions(LENGTH)
    about_middle = turn - 0.5 * LENGTH * shift
    mass, polar = element_mass(STUBBY, LENGTH), element_polar(STUBBY, LENGTH)
    m = 7850.0 * math.pi / 4 * (0.12**2 - 0.05**2) * LENGTH
    squares = (0.12**2 + 0.05**2) / 4
    assert shift @ mass @ shift == pytest.approx(m, rel=1e-13)
    assert shift @ mass @ about_middle == pytest.approx(0.0, abs=1e-12 * m)
    assert about_middle @ mass @ about_middle == pytest.approx(m * (3 * squares + LENGTH**2) / 12, rel=1e-13)
    assert turn @ polar @ turn == pytest.approx(m * squares / 2, rel=1e-13)
    np.testing.assert_allclose(polar @ shift, 0.0, atol=1e-15)


def test_the_cantilever_bends_and_shears_exactly():
    free = element_stiffness(STUBBY, LENGTH)[2:, 2:]
    deflection, slope = np.linalg.solve(free, [1000.0, 0.0])
    bending = 1000.0 * LENGTH**3 / (3 * STUBBY.bending_stiffness)
    shear = 1000.0 * LENGTH / STUBBY.shear_stiffness
    assert deflection == pytest.approx(bending + shear, rel=1e-12)
    assert slope == pytest.approx(1000.0 * LENGTH**2 / (2 * STUBBY.bending_stiffness), rel=1e-12)
    assert shear > 0.1 * bending


def test_shape_functions_are_one_at_their_node_and_reproduce_the_stiffness():
    phi = shear_parameter(STUBBY, LENGTH)
    N_u, N_psi = shape_functions(np.array([0.0, 1.0]), LENGTH, phi)
    np.testing.assert_allclose(np.array([N_u[0], N_psi[0], N_u[1], N_psi[1]]), np.eye(4), atol=1e-14)
    xi, step = np.linspace(0.05, 0.95, 10), 1e-4
    up, down = (shape_functions(xi + s, LENGTH, phi) for s in (step, -step))
    slope, curvature = ((a - b) / (2 * step * LENGTH) for a, b in zip(up, down, strict=True))
    shear_strain = slope - shape_functions(xi, LENGTH, phi)[1]
    np.testing.assert_allclose(shear_strain, shear_strain[:1] * np.ones((10, 1)), rtol=1e-6, atol=1e-9)
    moment = STUBBY.bending_stiffness * curvature
    force = element_stiffness(STUBBY, LENGTH)
    along = -force[1][None, :] + xi[:, None] * LENGTH * force[0][None, :]
    np.testing.assert_allclose(moment, along, rtol=1e-6, atol=1e-6 * np.max(np.abs(along)))


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_shear_coefficients_reach_the_limits_of_cowper(nu):
    assert shear_coefficient(nu) == pytest.approx(6 * (1 + nu) / (7 + 6 * nu), rel=1e-14)
    assert shear_coefficient(nu, 1.0) == pytest.approx(2 * (1 + nu) / (4 + 3 * nu), rel=1e-14)
    assert shear_coefficient(nu) > shear_coefficient(nu, 0.5) > shear_coefficient(nu, 0.9)


def test_shear_and_layers_have_the_printed_coefficients_and_inertia():
    assert shear_coefficient(0.3) == pytest.approx(0.8863636, rel=1e-7)
    assert rectangle_shear_coefficient(0.3) == pytest.approx(0.8497, abs=5e-5)
    bare = round_section(0.08, 0.0, 2.1e11, 0.3, 7800.0)
    tube = round_section(0.1, 0.08, 2.1e11, 0.3, 5000.0)
    layered = with_layer(bare, 0.08, 0.1, 5000.0)
    assert layered.bending_stiffness == bare.bending_stiffness
    assert layered.shear_stiffness == bare.shear_stiffness
    assert layered.mass == pytest.approx(bare.mass + tube.mass, rel=1e-14)
    assert layered.diametral_inertia == pytest.approx(
        bare.diametral_inertia + tube.diametral_inertia, rel=1e-14
    )
    assert layered.polar_inertia == pytest.approx(2 * layered.diametral_inertia, rel=1e-14)
