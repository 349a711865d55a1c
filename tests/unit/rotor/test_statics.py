"""The rotor at rest: weight shares, sag of a uniform beam, the two sags of the reference machine."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.reference.rotor_shapes import bending_part

from rotordrop.errors import SimulationError
from rotordrop.physics.timoshenko import round_section
from rotordrop.rotor.assembly import assemble
from rotordrop.rotor.statics import (
    bearing_load_shares,
    levitated_sag,
    rest_on,
    settled_sag,
    weight_vector,
)

G = 9.81


def test_load_shares_of_the_reference_machine(paper, paper_fe):
    shares = bearing_load_shares(paper)
    assert shares == pytest.approx([174.618, 409.077], abs=1e-3)
    assert np.sum(shares) == pytest.approx(paper_fe.total_mass * G, rel=1e-12)
    positions = np.array(paper.rotor.node_positions)[[3, 25]]
    assert shares @ positions == pytest.approx(
        paper_fe.total_mass * G * paper_fe.centre_of_gravity, rel=1e-12
    )


def test_a_uniform_beam_sags_as_the_textbook_says():
    section = round_section(0.05, 0.0, 2.1e11, 0.3, 7850.0)
    beam = assemble(np.linspace(0.0, 1.0, 9), [section] * 8)
    shape, reactions = rest_on(beam, [1, 9], G)
    load = section.mass * G
    bending, shear = 5 * load / (384 * section.bending_stiffness), load / (8 * section.shear_stiffness)
    assert shape[8] == pytest.approx(-(bending + shear), rel=1e-9)
    assert reactions == pytest.approx([0.5 * load] * 2, rel=1e-9)
    assert shape[1] == pytest.approx(-load / (24 * section.bending_stiffness), rel=1e-9)


def test_three_supports_share_as_a_continuous_beam():
    section = round_section(0.01, 0.0, 2.1e11, 0.3, 7850.0)
    beam = assemble(np.linspace(0.0, 1.0, 9), [section] * 8)
    _, reactions = rest_on(beam, [1, 5, 9], G)
    assert reactions / (section.mass * G) == pytest.approx([3 / 16, 10 / 16, 3 / 16], rel=1e-3)


def test_sag_of_the_levitated_rotor_against_the_straight_one(paper, paper_fe):
    sag = levitated_sag(paper_fe, paper)
    assert sag[[14, 42]] == pytest.approx([0.0, 0.0], abs=1e-15)
    bent = bending_part(paper_fe, sag)
    assert bent[[6, 50]] * 1e6 == pytest.approx([-6.6, 4.9], abs=0.06)
    twice = bending_part(paper_fe, bent)
    np.testing.assert_allclose(twice, bent, atol=1e-18)


def test_sag_is_in_balance_and_proportional_to_gravity(paper_fe):
    one, other = (rest_on(paper_fe, [8, 22], g) for g in (G, 2 * G))
    np.testing.assert_allclose(2 * one[0], other[0], rtol=1e-9, atol=1e-16)
    force = paper_fe.stiffness @ one[0] - weight_vector(paper_fe, G)
    expected = one[1][0] * paper_fe.node_row(8) + one[1][1] * paper_fe.node_row(22)
    np.testing.assert_allclose(force, expected, atol=1e-6)


def test_ambs_without_integral_action_give_way(paper, paper_fe):
    ambs = [
        SimpleNamespace(node=n, stiffness=2e6, integral_action=integral)
        for n, integral in ((8, True), (22, False))
    ]
    sag = levitated_sag(paper_fe, SimpleNamespace(ambs=ambs, gravity=G, name="half"))
    _, reactions = rest_on(paper_fe, [8, 22], G)
    assert sag[14] == pytest.approx(0.0, abs=1e-12)
    assert sag[42] == pytest.approx(-reactions[1] / 2e6, rel=1e-9)


def test_the_settled_rotor_is_straight_at_its_bearings(paper, paper_fe):
    sag = settled_sag(paper_fe, paper)
    assert sag[[6, 50]] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert np.min(sag[0::2]) < -5e-6
    difference = levitated_sag(paper_fe, paper) - sag
    force = paper_fe.stiffness @ difference
    assert set(np.flatnonzero(np.abs(force) > 1e-5)) == {6, 14, 42, 50}


def test_one_bearing_carries_everything_and_holds_a_level_rotor(paper, paper_fe):
    only = SimpleNamespace(
        touchdown_bearings=[SimpleNamespace(node=18, name="mid")], gravity=G, rotor=paper.rotor
    )
    assert bearing_load_shares(only, paper_fe) == pytest.approx([paper_fe.total_mass * G])
    sag = settled_sag(paper_fe, only)
    assert sag[34] == pytest.approx(0.0, abs=1e-18)
    assert sag[0] < 0.0
    assert sag[70] < 0.0


def test_without_two_planes_there_is_no_rest(paper, paper_fe):
    with pytest.raises(SimulationError, match=r"two or more different nodes; it is held at: 8, 8"):
        rest_on(paper_fe, [8, 8], G)
    lone = SimpleNamespace(ambs=paper.ambs[:1], gravity=G)
    with pytest.raises(SimulationError, match=r"the machine has 1 AMB planes; the sag .* needs two"):
        levitated_sag(paper_fe, lone)


def test_a_shaft_without_stiffness_somewhere_is_a_sentence(paper_fe):
    """A section of some nanometres among others ended in a traceback of the linear algebra."""
    stiffness = paper_fe.stiffness.copy()
    stiffness[40:42] = stiffness[:, 40:42] = 0.0
    with pytest.raises(SimulationError, match="the shaft cannot hold its own weight"):
        rest_on(replace(paper_fe, stiffness=stiffness), [8, 28], G)
