"""The form of a beam in place of a rotor: what it moves, and what it leaves."""

import numpy as np
import pytest
from tests.scaled_machines import TWELVE_NUMBERS

from rotordrop.elements.rotor import FORM, element_factors
from rotordrop.elements.table import structure_rows
from rotordrop.errors import UsageError
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.rotor.assembly import free_free_modes, rotor_fe

PLAIN = {f"rotor.{row.path}": 0.0 for row in FORM} | {"rotor.stiffness_factor": 1.0}


@pytest.fixture(scope="module")
def beam():
    return simple_machine(SimpleMachine(**TWELVE_NUMBERS)).with_values(PLAIN)


@pytest.mark.parametrize("row", FORM, ids=lambda row: row.path)
@pytest.mark.parametrize("amount", [-0.7, 0.7])
def test_mass_and_centre_of_mass_stay_whatever_moves(beam, row, amount):
    fe = rotor_fe(beam.with_values({f"rotor.{row.path}": amount}).rotor)
    assert fe.total_mass == pytest.approx(60.0, rel=1e-9)
    assert fe.centre_of_gravity == pytest.approx(0.52, rel=1e-9)


def test_mass_at_the_ends_turns_harder_and_bends_slower(beam):
    light, heavy = (rotor_fe(beam.with_values({"rotor.mass_to_ends": x}).rotor) for x in (-0.5, 1.0))
    assert heavy.diametral_inertia > 1.2 * light.diametral_inertia
    assert free_free_modes(heavy, 3).frequency[2] < 0.95 * free_free_modes(light, 3).frequency[2]


def test_stiffness_towards_an_end_moves_the_node_of_the_first_bending_away_from_it(beam):
    nodes = []
    for amount in (-0.8, 0.0, 0.8):
        fe = rotor_fe(beam.with_values({"rotor.stiffness_to_de": amount}).rotor)
        shape = free_free_modes(fe, 3).shapes[0::2, 2]
        nodes.append(float(np.interp(0.0, np.sort(shape[:9]), fe.node_positions[np.argsort(shape[:9])])))
    assert len(set(np.round(nodes, 4))) == 3
    assert (nodes[1] - nodes[0]) * (nodes[2] - nodes[1]) > 0.0


def test_no_form_leaves_the_beam_as_it_is_and_a_described_rotor_has_none(beam, paper):
    density, stiffness = element_factors(beam.rotor)
    np.testing.assert_allclose(density, 1.0)
    np.testing.assert_allclose(stiffness, 1.0)
    assert beam.rotor.is_beam
    assert not paper.rotor.is_beam
    assert not {row.path for row in FORM} & {row.path for row in structure_rows("rotor")}


def test_more_mass_than_there_is_cannot_move(beam):
    far = beam.with_values({"rotor.mass_to_ends": 5.0})
    with pytest.raises(UsageError, match=r"mass_to_ends = 5 and mass_to_de = 0 leave no mass at 5\d\d"):
        rotor_fe(far.rotor)
