"""Rotors of the model tests."""

import numpy as np
import pytest

from rotordrop.physics.timoshenko import round_section
from rotordrop.rotor.assembly import PointMass, assemble, build_rotor_fe


@pytest.fixture(scope="session")
def paper_fe(paper):
    """Its finite elements."""
    return build_rotor_fe(paper)


@pytest.fixture(scope="session")
def overhung():
    """A rotor of ten elements with a heavy disc at one end and a small one inside, without damping."""
    section = round_section(0.06, 0.02, 2.1e11, 0.3, 7850.0)
    discs = [
        PointMass(node=11, mass=20.0, polar_inertia=0.4, diametral_inertia=0.22),
        PointMass(node=4, mass=5.0, polar_inertia=0.02, diametral_inertia=0.011),
    ]
    return assemble(np.linspace(0.0, 1.0, 11), [section] * 10, discs, modal_damping=0.0)
