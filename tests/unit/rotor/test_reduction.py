"""The reduced rotor: orthonormal, statically exact at its attachment nodes, better with more modes."""

from __future__ import annotations

import numpy as np
import pytest
from tests.reference.rotor_shapes import elastic_flexibility, residual_flexibility

from rotordrop.errors import SimulationError, UsageError
from rotordrop.rotor.assembly import free_free_modes, modal_damping_matrix
from rotordrop.rotor.reduction import (
    PRESETS,
    Reduction,
    attachment_coordinates,
    reduce_rotor,
    reduction_of,
)

BEARINGS = (4, 26)
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


@pytest.mark.parametrize(("preset", "size"), [("accurate", 16), ("quick", 8), ("full", 72)])
def test_presets_have_their_sizes(paper_fe, preset, size):
    basis = reduce_rotor(paper_fe, preset, BEARINGS)
    assert basis.size == size
    assert basis.n_rigid == 2


def test_plain_modes_are_the_free_free_modes(paper_fe):
    basis = reduce_rotor(paper_fe, Reduction(modes=12, attachment=False), BEARINGS)
    modes = free_free_modes(paper_fe, 12)
    np.testing.assert_array_equal(basis.shapes, modes.shapes)
    np.testing.assert_array_equal(basis.damping, np.diag(0.01 * modes.omega))


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


def test_elastic_flexibility_is_the_answer_of_the_free_rotor(paper_fe):
    """A force at a bearing, balanced by the inertia of the rigid motion it causes."""
    force = paper_fe.node_row(4)
    rigid = free_free_modes(paper_fe, 2).shapes
    balanced = force - paper_fe.mass @ rigid @ (rigid.T @ force)
    shape = np.linalg.lstsq(paper_fe.stiffness, balanced, rcond=1e-14)[0]
    shape -= rigid @ (rigid.T @ paper_fe.mass @ shape)
    assert elastic_flexibility(paper_fe, [4])[0] == pytest.approx(paper_fe.node_row(4) @ shape, rel=1e-6)


def test_truncation_falls_with_the_modes_at_the_time_scale_of_a_contact(paper_fe):
    kept = (2, 6, 14, 24)
    bases = [reduce_rotor(paper_fe, Reduction(modes=m), BEARINGS) for m in kept]
    left = [np.max(np.abs(residual_flexibility(paper_fe, b, BEARINGS, 2 * np.pi * 100.0))) for b in bases]
    assert np.all(np.diff(left) < 0.0)
    assert left[-1] < 1e-3 * left[0]


def test_everything_kept_is_the_full_rotor(paper_fe):
    basis = reduce_rotor(paper_fe, "full", BEARINGS)
    back = basis.shapes @ basis.shapes.T @ paper_fe.mass
    np.testing.assert_allclose(back, np.eye(paper_fe.size), atol=1e-9)
    random = np.random.default_rng(1).normal(size=paper_fe.size)
    np.testing.assert_allclose(back @ random, random, rtol=1e-9, atol=1e-9)


def test_two_attachments_at_one_node_are_one(paper_fe):
    assert reduce_rotor(paper_fe, "quick", (4, 4)).size == 7
    assert reduce_rotor(paper_fe, "quick", ()).size == 6


def test_more_attachments_than_modes_left_do_not_repeat_shapes(overhung):
    basis = reduce_rotor(overhung, Reduction(modes=21, attachment=True), (2, 8))
    assert basis.size == 22
    np.testing.assert_allclose(basis.shapes.T @ overhung.mass @ basis.shapes, np.eye(22), atol=1e-10)


def test_a_direction_that_repeats_another_gives_no_shape(paper_fe):
    """Directions are compared at unit length, so that rounding is not taken for a second one."""
    modes = free_free_modes(paper_fe)
    inner, eigenvalues, damping = attachment_coordinates(paper_fe, modes, 6, (4, 26, 4))
    assert (inner.shape[1], eigenvalues.shape, damping.shape) == (2, (2,), (2, 2))
    once = attachment_coordinates(paper_fe, modes, 6, (4, 26))[1]
    np.testing.assert_allclose(eigenvalues, once, rtol=1e-9)


def test_the_same_rotor_gives_the_same_bits(paper_fe):
    one, other = (reduce_rotor(paper_fe, "accurate", BEARINGS) for _ in range(2))
    np.testing.assert_array_equal(one.shapes, other.shapes)


def test_rows_are_the_shapes_at_a_node(paper_fe):
    basis = reduce_rotor(paper_fe, "quick", BEARINGS)
    np.testing.assert_array_equal(basis.node_row(26), paper_fe.node_row(26) @ basis.shapes)
    np.testing.assert_array_equal(basis.slope_row(26), paper_fe.slope_row(26) @ basis.shapes)
    with pytest.raises(UsageError, match="node 37 is not on the rotor, which has nodes 1 to 36"):
        basis.node_row(37)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ("accurate", "14 free-free modes and 2 attachment modes per plane"),
        ("full", "all 72 finite-element coordinates per plane"),
        (Reduction(modes=12, attachment=False), "12 free-free modes per plane"),
    ],
)
def test_the_reduction_in_words(paper_fe, choice, words):
    assert reduce_rotor(paper_fe, choice, BEARINGS).description == words


def test_an_unknown_preset_and_too_few_modes_are_refused(paper_fe):
    with pytest.raises(
        UsageError, match=r"unknown reduction 'exact'; choose one of 'accurate', 'quick', 'full'"
    ):
        reduction_of("exact")
    with pytest.raises(SimulationError, match="1 modes per plane are too few: the 2 rigid modes"):
        reduce_rotor(paper_fe, Reduction(modes=1), BEARINGS)
