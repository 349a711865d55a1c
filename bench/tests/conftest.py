"""Hidden machines and a synthetic drop of the synthesis tests."""

import numpy as np
import pytest

from rotordrop.machine import example_machine
from rotordrop_bench import hidden_machine, synthesize_drop

SPEED = 2.0 * np.pi * 60.0


@pytest.fixture(scope="session")
def known():
    """The machine of the supplied records, as its owner knows it."""
    return example_machine("lp400")


@pytest.fixture(scope="session")
def hidden(known):
    """A machine drawn around it."""
    return hidden_machine(known, 3)


@pytest.fixture(scope="session")
def synthetic(hidden):
    """One recording of it, as long as the truth needs."""
    return synthesize_drop(hidden, SPEED, 8, duration=0.21)
