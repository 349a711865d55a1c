"""Drops of the simulation tests."""

import numpy as np
import pytest

from rotordrop import DropCase, PlacedStart, build_drop_model, simulate_drop

SPEED = 2.0 * np.pi * 60.0


@pytest.fixture(scope="session")
def quick(paper):
    """It with 6 + 2 modes per plane."""
    return build_drop_model(paper, "quick")


@pytest.fixture(scope="session")
def reference_start():
    """Start of the reference trajectories: 2 µm above and 5 µm below the middle, at rest."""
    return PlacedStart(displacement=np.array([[0.0, 2e-6], [0.0, -5e-6]]), velocity=np.zeros((2, 2)))


@pytest.fixture(scope="session")
def skewed_start():
    """A start without any symmetry."""
    return PlacedStart(
        displacement=np.array([[30e-6, -120e-6], [-50e-6, -90e-6]]),
        velocity=np.array([[0.02, -0.05], [-0.03, 0.01]]),
    )


@pytest.fixture(scope="session")
def drop(quick):
    """A drop of 40 ms with several contacts at both bearings."""
    return simulate_drop(quick, DropCase(speed=SPEED, duration=0.04))
