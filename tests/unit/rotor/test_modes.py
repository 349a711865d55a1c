"""Undamped modes: convergence at the known order, exact rigid modes, springs in their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.errors import SimulationError
from rotordrop.physics.timoshenko import Section, round_section
from rotordrop.rotor.assembly import (
    PointMass,
    assemble,
    free_free_modes,
    modal_damping_matrix,
    modes_on_springs,
)

EXACT_FREE_FREE = (228.6965036678562, 622.9134501251403, 1200.6896615980231)
CLAMPED_FREE_FREE = (4.730040744862704, 7.853204624095838, 10.995607838001671)


def uniform(section, elements, length=1.0):
    return assemble(np.linspace(0.0, length, elements + 1), [section] * elements)


def orders(errors):
    return np.log2(np.abs(errors[:-1] / errors[1:]))


def test_timoshenko_frequencies_converge_with_the_square_of_the_element_length():
    section = round_section(0.05, 0.0, 2.1e11, 0.3, 7850.0)
    errors = np.array(
        [free_free_modes(uniform(section, n), 5).frequency[2:] / EXACT_FREE_FREE - 1 for n in (24, 48, 96)]
    )
    assert np.all(errors > 0.0)
    assert orders(errors)[-1] == pytest.approx(2.0, abs=0.1)
    assert np.max(errors[-1]) < 3e-5


def test_bernoulli_frequencies_converge_with_the_fourth_power():
    section = Section(
        bending_stiffness=1.0, shear_stiffness=math.inf, mass=1.0, diametral_inertia=0.0, polar_inertia=0.0
    )
    exact = np.square(CLAMPED_FREE_FREE)
    errors = np.array([free_free_modes(uniform(section, n), 5).omega[2:] / exact - 1 for n in (8, 16, 32)])
    assert np.all(errors > 0.0)
    assert orders(errors)[-1] == pytest.approx(4.0, abs=0.2)


def test_modes_are_orthonormal_and_the_rigid_ones_exact(paper_fe):
    modes = free_free_modes(paper_fe)
    np.testing.assert_allclose(
        modes.shapes.T @ paper_fe.mass @ modes.shapes, np.eye(paper_fe.size), atol=1e-12
    )
    assert tuple(modes.omega[:2]) == (0.0, 0.0)
    assert np.all(np.diff(modes.omega[1:]) > 0.0)
    height, slope = modes.shapes[0::2, 1], modes.shapes[1::2, 1]
    np.testing.assert_allclose(np.diff(height), np.diff(paper_fe.node_positions) * slope[0], atol=1e-14)
    bending = modes.shapes[0::2, 2:]
    assert np.all(np.max(bending, axis=0) >= np.max(-bending, axis=0))


def test_springs_of_nothing_free_the_rotor_and_stiff_ones_pin_it(overhung):
    free = free_free_modes(overhung).frequency
    assert modes_on_springs(overhung, {2: 1.0, 8: 1.0}).frequency[2:6] == pytest.approx(free[2:6], rel=1e-5)
    pinned = modes_on_springs(overhung, {2: 1e13, 8: 1e13})
    deflection = np.abs(pinned.shapes[[2, 14], :3]) / np.max(np.abs(pinned.shapes[0::2, :3]), axis=0)
    assert np.max(deflection) < 1e-4


def test_each_frequency_rises_with_the_stiffness_and_stays_between_its_neighbours(overhung):
    """Rayleigh: two springs raise a mode at most over the second next one of the free rotor."""
    free = free_free_modes(overhung).omega
    softer, stiffer = (modes_on_springs(overhung, {2: k, 8: k}).omega for k in (1e6, 1e8))
    assert np.all(stiffer[:10] > softer[:10])
    assert np.all(stiffer[:10] < free[2:12])


def test_a_rigid_body_bounces_on_its_spring():
    section = round_section(0.1, 0.0, 2e11, 0.3, 1.0)
    body = PointMass(node=2, mass=50.0, polar_inertia=1.0, diametral_inertia=1.0)
    rotor = assemble([0.0, 0.2, 0.4], [section] * 2, [body])
    bounce = modes_on_springs(rotor, {1: 1e5, 3: 1e5}, 1).omega[0]
    assert bounce == pytest.approx(math.sqrt(2e5 / 50.0), rel=1e-3)


def test_modal_damping_is_that_of_every_bending_mode(paper_fe):
    modes = free_free_modes(paper_fe)
    projected = modes.shapes.T @ modal_damping_matrix(paper_fe) @ modes.shapes
    np.testing.assert_allclose(projected, np.diag(2 * 0.005 * modes.omega), atol=1e-9)


@pytest.mark.parametrize("count", [1, 73])
def test_too_few_or_too_many_modes_are_refused(paper_fe, count):
    with pytest.raises(
        SimulationError, match=rf"{count} modes per plane .* this rotor has 72.*Choose 2 to 72"
    ):
        free_free_modes(paper_fe, count)


def test_a_shaft_without_mass_has_rigid_modes_only():
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    body = PointMass(node=2, mass=50.0, polar_inertia=1.0, diametral_inertia=2.0)
    rotor = assemble([0.0, 0.2, 0.4], [section] * 2, [body])
    assert free_free_modes(rotor, 2).shapes[0, 0] == pytest.approx(1 / math.sqrt(50.0))
    with pytest.raises(SimulationError, match="neither mass nor inertia at node 1"):
        free_free_modes(rotor)
