"""The assembled and the reduced rotor, and the form of a beam in its place."""

import math
from pathlib import Path

import numpy as np
import pytest
from tests.reference.rotor_shapes import elastic_flexibility, residual_flexibility
from tests.scaled_machines import TWELVE_NUMBERS

from rotordrop.elements.rotor import FORM, element_factors
from rotordrop.elements.table import structure_rows
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, load_machine
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.physics.timoshenko import round_section
from rotordrop.rotor.assembly import (
    PointMass,
    assemble,
    build_rotor_fe,
    free_free_modes,
    modal_damping_matrix,
    rotor_fe,
)
from rotordrop.rotor.reduction import (
    PRESETS,
    Reduction,
    attachment_coordinates,
    contact_frequency,
    reduce_rotor,
    reduction_for_contact,
    reduction_of,
)

SHAFT = round_section(0.05, 0.0, 2.1e11, 0.3, 7850.0)


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


def test_what_cannot_be_assembled_is_refused(overhung):
    with pytest.raises(UsageError, match="3 nodes need 2 sections between them, not 3"):
        assemble([0.0, 0.1, 0.2], [SHAFT] * 3)
    with pytest.raises(UsageError, match=r"node 2 is at 0\.2 m, node 3 at 0\.1 m"):
        assemble([0.0, 0.2, 0.1], [SHAFT] * 2)
    with pytest.raises(UsageError, match="node 12 is not on the rotor, which has nodes 1 to 11"):
        overhung.node_row(12)
    with pytest.raises(UsageError, match="node 0 is not on the rotor"):
        assemble([0.0, 0.1], [SHAFT], [PointMass(node=0, mass=1.0)])


BEARINGS = (4, 26)
LONG = Path(__file__).parents[2] / "machines" / "long_rotor.toml"
NAMES = ("NDE", "DE")
CHOICES = [*PRESETS, Reduction(modes=12, attachment=False), Reduction(modes=2, attachment=True)]


@pytest.mark.parametrize("choice", CHOICES, ids=str)
def test_mass_is_one_and_stiffness_diagonal(paper_fe, choice):
    basis = reduce_rotor(paper_fe, choice, BEARINGS)
    mass = basis.shapes.T @ paper_fe.mass @ basis.shapes
    stiffness = basis.shapes.T @ paper_fe.stiffness @ basis.shapes
    np.testing.assert_allclose(mass, basis.mass, atol=1e-11)
    np.testing.assert_allclose(stiffness, basis.stiffness, atol=1e-9 * np.max(basis.eigenvalues))
    assert tuple(basis.eigenvalues[:2]) == (0.0, 0.0)
    assert np.all(basis.eigenvalues[2:] > 0.0)


@pytest.mark.parametrize("choice", CHOICES, ids=str)
def test_polar_and_damping_are_projections_of_the_full_matrices(paper_fe, choice):
    basis = reduce_rotor(paper_fe, choice, BEARINGS)
    np.testing.assert_allclose(basis.polar, basis.shapes.T @ paper_fe.polar @ basis.shapes, atol=1e-12)
    np.testing.assert_array_equal(basis.polar, basis.polar.T)
    full = basis.shapes.T @ modal_damping_matrix(paper_fe) @ basis.shapes
    np.testing.assert_allclose(basis.damping, full, atol=1e-8)


@pytest.mark.parametrize(
    ("choice", "size", "words"),
    [
        ("accurate", 16, "14 free-free modes and 2 attachment modes per plane"),
        ("quick", 8, "6 free-free modes and 2 attachment modes per plane"),
        ("full", 72, "all 72 finite-element coordinates per plane"),
        (Reduction(modes=12, attachment=False), 12, "12 free-free modes per plane"),
    ],
)
def test_presets_have_their_sizes(paper_fe, choice, size, words):
    basis = reduce_rotor(paper_fe, choice, BEARINGS)
    assert (basis.size, basis.n_rigid, basis.description) == (size, 2, words)


def test_everything_kept_is_the_full_rotor_and_plain_modes_are_the_free_free_ones(paper_fe):
    basis = reduce_rotor(paper_fe, Reduction(modes=12, attachment=False), BEARINGS)
    modes = free_free_modes(paper_fe, 12)
    np.testing.assert_array_equal(basis.shapes, modes.shapes)
    np.testing.assert_array_equal(basis.damping, np.diag(0.01 * modes.omega))
    basis = reduce_rotor(paper_fe, "full", BEARINGS)
    back = basis.shapes @ basis.shapes.T @ paper_fe.mass
    np.testing.assert_allclose(back, np.eye(paper_fe.size), atol=1e-9)
    random = np.random.default_rng(1).normal(size=paper_fe.size)
    np.testing.assert_allclose(back @ random, random, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("modes", [2, 6, 14])
def test_attachment_makes_the_static_flexibility_exact_where_it_sits(paper_fe, modes):
    exact = elastic_flexibility(paper_fe, BEARINGS)
    attached, plain = (
        reduce_rotor(paper_fe, Reduction(modes=modes, attachment=a), BEARINGS) for a in (True, False)
    )
    assert np.max(np.abs(residual_flexibility(paper_fe, attached, BEARINGS))) < 1e-10 * np.min(exact)
    assert np.min(residual_flexibility(paper_fe, plain, BEARINGS) / exact) > 1e-3
    elsewhere = residual_flexibility(paper_fe, attached, [15])
    assert 0.0 < elsewhere[0] < residual_flexibility(paper_fe, plain, [15])[0]


def test_flexibility_is_that_of_the_free_rotor_and_truncation_falls(paper_fe):
    """A force at a bearing, balanced by the inertia of the rigid motion it causes."""
    force = paper_fe.node_row(4)
    rigid = free_free_modes(paper_fe, 2).shapes
    balanced = force - paper_fe.mass @ rigid @ (rigid.T @ force)
    shape = np.linalg.lstsq(paper_fe.stiffness, balanced, rcond=1e-14)[0]
    shape -= rigid @ (rigid.T @ paper_fe.mass @ shape)
    assert elastic_flexibility(paper_fe, [4])[0] == pytest.approx(paper_fe.node_row(4) @ shape, rel=1e-6)
    kept = (2, 6, 14, 24)
    bases = [reduce_rotor(paper_fe, Reduction(modes=m), BEARINGS) for m in kept]
    left = [np.max(np.abs(residual_flexibility(paper_fe, b, BEARINGS, 2 * np.pi * 100.0))) for b in bases]
    assert np.all(np.diff(left) < 0.0)
    assert left[-1] < 1e-3 * left[0]


def test_attachments_that_repeat_others_give_no_shape(paper_fe, overhung):
    """Directions are compared at unit length, so that rounding is not taken for a second one."""
    assert reduce_rotor(paper_fe, "quick", (4, 4)).size == 7
    assert reduce_rotor(paper_fe, "quick", ()).size == 6
    modes = free_free_modes(paper_fe)
    inner, eigenvalues, damping = attachment_coordinates(paper_fe, modes, 6, (4, 26, 4))
    assert (inner.shape[1], eigenvalues.shape, damping.shape) == (2, (2,), (2, 2))
    once = attachment_coordinates(paper_fe, modes, 6, (4, 26))[1]
    np.testing.assert_allclose(eigenvalues, once, rtol=1e-9)
    basis = reduce_rotor(overhung, Reduction(modes=21, attachment=True), (2, 8))
    assert basis.size == 22
    np.testing.assert_allclose(basis.shapes.T @ overhung.mass @ basis.shapes, np.eye(22), atol=1e-10)


def test_rows_are_the_shapes_at_a_node_and_unknown_presets_are_refused(paper_fe):
    basis = reduce_rotor(paper_fe, "quick", BEARINGS)
    np.testing.assert_array_equal(basis.node_row(26), paper_fe.node_row(26) @ basis.shapes)
    np.testing.assert_array_equal(basis.slope_row(26), paper_fe.slope_row(26) @ basis.shapes)
    with pytest.raises(UsageError, match="node 37 is not on the rotor, which has nodes 1 to 36"):
        basis.node_row(37)
    with pytest.raises(UsageError, match=r"reduction is 'exact'; expected one of accurate, quick, full"):
        reduction_of("exact")


@pytest.mark.parametrize(("name", "coarse"), [("lp400", 6), ("small", 6), ("long", 7)])
def test_the_modes_reach_beyond_the_contact(name, coarse):
    machine = load_machine(LONG) if name == "long" else example_machine(name)
    assert reduction_for_contact(machine, least=2, reach=1e-3).modes == 3
    basis = reduction_for_contact(machine, least=6, reach=2.25)
    assert basis.modes == coarse
    frequency = free_free_modes(build_rotor_fe(machine)).frequency
    assert frequency[basis.modes - 1] >= 2.25 * contact_frequency(machine)


def test_the_frequency_of_contact_is_that_of_two_masses_on_a_spring_with_the_balls_in_series():
    """Balls stand in series; of a light support only its own mass counts, a quarter swings twice as fast."""
    machine = example_machine("lp400")
    stiff = {f"{n}.contact.stiffness": 4.0 * float(machine.bearing(n).contact.stiffness) for n in NAMES}
    assert 1.0 < contact_frequency(machine.with_values(stiff)) / contact_frequency(machine) < 2.0
    light, lighter = (
        contact_frequency(machine.with_values({f"{n}.support.mass": mass for n in NAMES}))
        for mass in (4e-3, 1e-3)
    )
    assert lighter / light == pytest.approx(math.sqrt(4.0), rel=1e-3)
    assert light > contact_frequency(machine)


PLAIN = {f"rotor.{row.path}": 0.0 for row in FORM} | {"rotor.stiffness_factor": 1.0}


@pytest.fixture(scope="module")
def beam():
    return simple_machine(SimpleMachine(**TWELVE_NUMBERS)).with_values(PLAIN)


@pytest.mark.parametrize("row", FORM, ids=lambda row: row.path)
@pytest.mark.parametrize("amount", [-0.7, 0.7])
def test_mass_and_centre_of_mass_stay_whatever_moves(beam, row, amount):
    plain, fe = rotor_fe(beam.rotor), rotor_fe(beam.with_values({f"rotor.{row.path}": amount}).rotor)
    assert fe.total_mass == pytest.approx(plain.total_mass, rel=1e-9) == pytest.approx(60.0, rel=1e-6)
    assert fe.centre_of_gravity == pytest.approx(plain.centre_of_gravity, rel=1e-9)


def test_the_form_of_a_beam_moves_its_modes(beam, paper):
    light, heavy = (rotor_fe(beam.with_values({"rotor.mass_to_ends": x}).rotor) for x in (-0.5, 1.0))
    assert heavy.diametral_inertia > 1.2 * light.diametral_inertia
    assert free_free_modes(heavy, 3).frequency[2] < 0.95 * free_free_modes(light, 3).frequency[2]
    far = beam.with_values({"rotor.mass_to_ends": 5.0})
    with pytest.raises(UsageError, match=r"mass_to_ends = 5 and mass_to_de = 0 leave no mass at 5\d\d"):
        rotor_fe(far.rotor)
    nodes = []
    for amount in (-0.8, 0.0, 0.8):
        fe = rotor_fe(beam.with_values({"rotor.stiffness_to_de": amount}).rotor)
        shape = free_free_modes(fe, 3).shapes[0::2, 2]
        nodes.append(float(np.interp(0.0, np.sort(shape[:9]), fe.node_positions[np.argsort(shape[:9])])))
    assert len(set(np.round(nodes, 4))) == 3
    assert (nodes[1] - nodes[0]) * (nodes[2] - nodes[1]) > 0.0
    density, stiffness = element_factors(beam.rotor)
    np.testing.assert_allclose(density, 1.0)
    np.testing.assert_allclose(stiffness, 1.0)
    assert beam.rotor.is_beam
    assert not paper.rotor.is_beam
    assert not {row.path for row in FORM} & {row.path for row in structure_rows("rotor")}
