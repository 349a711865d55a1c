"""A drop model with a start in contact, and the bundled record as an estimation problem."""

import numpy as np
import pytest

from rotordrop import build_drop_model
from rotordrop.evidence.evidence import read_evidence
from rotordrop.track.smoother import PassSettings, forward, smooth
from rotordrop.twin.problems import COARSE_BASIS, drop_problem


@pytest.fixture(scope="session")
def model(lp400):
    """It with 6 + 2 modes per plane."""
    return build_drop_model(lp400, COARSE_BASIS)


@pytest.fixture(scope="session")
def prepared(lp400, whole_drop, tail):
    """The bundled record with its power-off and its settled tail."""
    return read_evidence(build_drop_model(lp400), whole_drop, tail, name="drop_060")


def flight_of(machine, prepared):
    """The first 3 ms of a record of a machine: free flight, without any contact."""
    return drop_problem(build_drop_model(machine, COARSE_BASIS), prepared, until=0.003)


def place_of(problem, path):
    """Where an unknown stands in the estimate."""
    return problem.n_dynamic + [unknown.path for unknown in problem.unknowns].index(path)


@pytest.fixture(scope="session")
def flight(lp400, prepared):
    return flight_of(lp400, prepared)


@pytest.fixture(scope="session")
def impacts(model, prepared):
    """The first 25 ms of it, with the first impacts at both bearings."""
    return drop_problem(model, prepared, until=0.025)


@pytest.fixture(scope="session")
def impacts_filtered(impacts):
    return forward(impacts, PassSettings(impulse=3e-3, share=0.03))


@pytest.fixture(scope="session")
def impacts_smoothed(impacts_filtered):
    return smooth(impacts_filtered)


@pytest.fixture
def random():
    return np.random.default_rng(5)
