"""Bundled machines, and a synthetic drop of a hidden one for the tests of what is estimated from it."""

from __future__ import annotations

import math

import pytest

from rotordrop.machine import Machine, example_machine
from rotordrop_bench import HiddenMachine, SyntheticDrop, hidden_machine, synthesize_drop

SPEED = 2.0 * math.pi * 60.0
SEED = 4


@pytest.fixture(scope="session")
def known() -> Machine:
    """The machine of the supplied records, as its owner knows it."""
    return example_machine("lp400")


@pytest.fixture(scope="session")
def lp400(known: Machine) -> Machine:
    """The same by its name."""
    return known


@pytest.fixture(scope="session")
def paper() -> Machine:
    """The reference machine of the paper."""
    return example_machine("paper")


@pytest.fixture(scope="session")
def hidden(known: Machine) -> HiddenMachine:
    """A machine drawn around it."""
    return hidden_machine(known, SEED)


@pytest.fixture(scope="session")
def synthetic(hidden: HiddenMachine) -> SyntheticDrop:
    """A recorded drop of it, over before the motion dies away."""
    return synthesize_drop(hidden, SPEED, 10 * SEED, duration=0.22, name="hidden_060")
