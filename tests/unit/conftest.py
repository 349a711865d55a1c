"""Bundled machines, and a synthetic drop of a hidden one for the tests of what is estimated from it."""

import pytest
from tests.bank import SEED

from rotordrop.machine import example_machine
from rotordrop_bench import hidden_machine


@pytest.fixture(scope="session")
def known():
    """The machine of the supplied records, as its owner knows it."""
    return example_machine("lp400")


@pytest.fixture(scope="session")
def lp400(known):
    """The same by its name."""
    return known


@pytest.fixture(scope="session")
def paper():
    """The reference machine of the paper."""
    return example_machine("paper")


@pytest.fixture(scope="session")
def hidden(known):
    """A machine drawn around it."""
    return hidden_machine(known, SEED)


@pytest.fixture
def synthetic(bank):
    """A recorded drop of it, over before the motion dies away."""
    return bank("recorded")
