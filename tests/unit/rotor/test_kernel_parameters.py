"""What the kernel gets: unbalance by its phase, and attachment modes that do not repeat themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.reduction import Reduction, reduce_rotor


def test_unbalance_is_turned_by_its_phase_from_the_vertical(paper):
    """At rotor angle zero a phase of 0 pulls up, of 90° to the left: amount times shape, added up."""
    values = {"unbalance.0.phase": 0.0, "unbalance.1.phase": math.pi / 2}
    model = build_drop_model(paper.with_values(values), "quick")
    first, second = paper.unbalances
    rows = [model.basis.node_row(u.node) for u in (first, second)]
    assert len(paper.unbalances) == 2
    up = float(first.amount) * rows[0]
    left = float(second.amount) * rows[1]
    size = np.max(np.abs(up)) + np.max(np.abs(left))
    assert model.parameters.unbalance_sin == pytest.approx(up, abs=1e-12 * size)
    assert model.parameters.unbalance_cos == pytest.approx(-left, abs=1e-12 * size)


def test_an_attachment_named_twice_counts_once(paper_fe):
    once = reduce_rotor(paper_fe, Reduction(modes=6, attachment=True), (4, 26))
    twice = reduce_rotor(paper_fe, Reduction(modes=6, attachment=True), (4, 26, 26))
    assert once.shapes.shape[1] == twice.shapes.shape[1] == 8
    assert twice.eigenvalues == pytest.approx(once.eigenvalues, rel=1e-8, abs=1e-3)


def test_magnets_of_another_machine_are_in_its_model_and_what_a_start_put_there_stays(paper):
    model = build_drop_model(paper, "quick")
    started = model.parameters.magnet
    started[:, L.REMANENT_X] = 7.0
    stiffer = tuple(
        amb.model_copy(update={"stiffness": Known(value=2.0 * float(amb.stiffness), status="given")})
        for amb in paper.ambs
    )
    other = model.with_machine(paper.model_copy(update={"ambs": stiffer})).parameters.magnet
    assert len(other) == len(paper.ambs) > 0
    assert other[:, L.AMB_STIFFNESS] == pytest.approx(2.0 * started[:, L.AMB_STIFFNESS])
    assert other[:, L.REMANENT_X] == pytest.approx(7.0)
    assert started[:, L.AMB_STIFFNESS] == pytest.approx([float(amb.stiffness) for amb in paper.ambs])
