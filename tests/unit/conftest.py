"""Bundled machines with their recordings, and a synthetic drop of a hidden machine."""

from pathlib import Path

import pytest
from tests.bank import SEED

from rotordrop import example_machine, example_record_path, read_record
from rotordrop_bench import hidden_machine

RECORDINGS = Path(__file__).parent / "record" / "recordings"


@pytest.fixture(scope="session")
def lp400():
    """The machine of the supplied records, as its owner knows it."""
    return example_machine("lp400")


@pytest.fixture(scope="session")
def machine(lp400):
    """The same, where a test has no other."""
    return lp400


@pytest.fixture(scope="session")
def paper():
    """The reference machine of the paper."""
    return example_machine("paper")


@pytest.fixture(scope="session")
def whole_drop(lp400):
    """The bundled drop at 60 Hz."""
    return read_record(example_record_path("lp400_drop_060"), lp400)


@pytest.fixture(scope="session")
def drop(whole_drop):
    """It from 0.25 s before to 0.3 s after."""
    return whole_drop.window(-0.25, 0.3)


@pytest.fixture(scope="session")
def tail(lp400):
    """Its tail."""
    return read_record(example_record_path("lp400_drop_060_tail"), lp400)


@pytest.fixture(scope="session")
def fast_drop(lp400):
    """A short drop at 150 Hz, simulated too."""
    return read_record(RECORDINGS / "drop_150_short.h5", lp400)


@pytest.fixture(scope="session")
def hidden(lp400):
    """A machine drawn around that of the records."""
    return hidden_machine(lp400, SEED)


@pytest.fixture
def synthetic(bank):
    """A recorded drop of it, over before the motion dies away."""
    return bank("recorded")
