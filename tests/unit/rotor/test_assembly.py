"""The assembled rotor: the reference machine's numbers, rigid motion, what cannot be assembled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import UsageError
from rotordrop.physics.timoshenko import round_section
from rotordrop.rotor.assembly import PointMass, assemble, free_free_modes

SHAFT = round_section(0.05, 0.0, 2.1e11, 0.3, 7850.0)


def test_the_reference_machine_has_its_published_numbers(paper_fe):
    assert paper_fe.total_mass == pytest.approx(59.49996, abs=5e-6)
    assert paper_fe.polar_inertia == pytest.approx(0.0875213, abs=5e-8)
    assert free_free_modes(paper_fe, 5).frequency[2:] == pytest.approx([187.305, 482.965, 876.980], abs=5e-4)


def test_matrices_are_symmetric_and_a_rigid_motion_is_free(paper_fe):
    for matrix in (paper_fe.mass, paper_fe.stiffness, paper_fe.polar):
        np.testing.assert_array_equal(matrix, matrix.T)
    forces = paper_fe.stiffness @ paper_fe.rigid_shapes
    assert np.max(np.abs(forces)) < 1e-12 * np.max(paper_fe.stiffness)


def test_mass_centre_and_inertias_are_sums_over_the_parts(overhung):
    discs = [(20.0, 1.0, 0.22, 0.4), (5.0, 0.3, 0.011, 0.02)]
    section = round_section(0.06, 0.02, 2.1e11, 0.3, 7850.0)
    shaft = section.mass * 1.0
    mass = shaft + sum(m for m, *_ in discs)
    centre = (0.5 * shaft + sum(m * z for m, z, *_ in discs)) / mass
    diametral = shaft / 12 + section.diametral_inertia + shaft * (0.5 - centre) ** 2
    diametral += sum(inertia + m * (z - centre) ** 2 for m, z, inertia, _ in discs)
    assert overhung.total_mass == pytest.approx(mass, rel=1e-13)
    assert overhung.centre_of_gravity == pytest.approx(centre, rel=1e-13)
    assert overhung.diametral_inertia == pytest.approx(diametral, rel=1e-12)
    assert overhung.polar_inertia == pytest.approx(section.polar_inertia + 0.42, rel=1e-12)


def test_the_rotor_accelerates_as_a_whole_under_any_forces(overhung):
    """Newton and Euler: whatever the elastic forces are, momentum and moment follow the outer forces."""
    random = np.random.default_rng(5)
    shape, force = random.normal(size=(2, overhung.size))
    acceleration = np.linalg.solve(overhung.mass, force - overhung.stiffness @ shape * 1e-6)
    for rigid in overhung.rigid_shapes.T:
        assert rigid @ overhung.mass @ acceleration == pytest.approx(rigid @ force, rel=1e-7, abs=1e-7)


def test_a_reversed_rotor_has_the_same_modes(overhung):
    flip = np.diag(np.tile([1.0, -1.0], 11))
    order = np.arange(22).reshape(11, 2)[::-1].ravel()
    section = round_section(0.06, 0.02, 2.1e11, 0.3, 7850.0)
    discs = [
        PointMass(node=1, mass=20.0, polar_inertia=0.4, diametral_inertia=0.22),
        PointMass(node=8, mass=5.0, polar_inertia=0.02, diametral_inertia=0.011),
    ]
    reverse = assemble(np.linspace(0.0, 1.0, 11), [section] * 10, discs)
    for one, other in ((overhung.mass, reverse.mass), (overhung.polar, reverse.polar)):
        np.testing.assert_allclose((flip @ one @ flip)[np.ix_(order, order)], other, atol=1e-12)
    assert free_free_modes(reverse).omega == pytest.approx(free_free_modes(overhung).omega, rel=1e-8)


def test_a_layer_slows_the_rotor(paper):
    from rotordrop.rotor.assembly import build_rotor_fe

    class Bare:
        elements = tuple(replace(e, layer_diameter=None) for e in paper.rotor.elements)

        def __getattr__(self, name):
            return getattr(paper.rotor, name)

    class Machine:
        rotor = Bare()

    bare, layered = build_rotor_fe(Machine), build_rotor_fe(paper)  # type: ignore[arg-type]
    np.testing.assert_array_equal(bare.stiffness, layered.stiffness)
    assert np.all(free_free_modes(bare).omega[2:6] > free_free_modes(layered).omega[2:6])


def test_sections_must_fit_between_the_nodes():
    with pytest.raises(UsageError, match="3 nodes need 2 sections between them, not 3"):
        assemble([0.0, 0.1, 0.2], [SHAFT] * 3)


def test_nodes_must_be_in_order():
    with pytest.raises(UsageError, match=r"node 2 is at 0\.2 m, node 3 at 0\.1 m"):
        assemble([0.0, 0.2, 0.1], [SHAFT] * 2)


def test_a_node_off_the_rotor_is_named(overhung):
    with pytest.raises(UsageError, match="node 12 is not on the rotor, which has nodes 1 to 11"):
        overhung.node_row(12)
    with pytest.raises(UsageError, match="node 0 is not on the rotor"):
        assemble([0.0, 0.1], [SHAFT], [PointMass(node=0, mass=1.0)])
