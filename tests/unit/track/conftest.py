"""A drop model with a start in contact, and the bundled record as an estimation problem."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.machine import Machine
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import read_record
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, PassSettings, Smoothed, forward, smooth
from rotordrop.twin.problems import COARSE_BASIS, drop_problem


@pytest.fixture(scope="session")
def model(lp400: Machine) -> DropModel:
    """It with 6 + 2 modes per plane."""
    return build_drop_model(lp400, COARSE_BASIS)


@pytest.fixture(scope="session")
def prepared(lp400: Machine) -> Evidence:
    """The bundled record with its power-off and its settled tail."""
    record = read_record(example_record_path("lp400_drop_060"), lp400)
    tail = read_record(example_record_path("lp400_drop_060_tail"), lp400)
    return read_evidence(build_drop_model(lp400), record, tail, name="drop_060")


@pytest.fixture(scope="session")
def flight(model: DropModel, prepared: Evidence) -> DropProblem:
    """The first 3 ms of it: free flight, without any contact."""
    return drop_problem(model, prepared, until=0.003)


@pytest.fixture(scope="session")
def impacts(model: DropModel, prepared: Evidence) -> DropProblem:
    """The first 25 ms of it, with the first impacts at both bearings."""
    return drop_problem(model, prepared, until=0.025)


@pytest.fixture(scope="session")
def impacts_filtered(impacts: DropProblem) -> Forward:
    return forward(impacts, PassSettings(impulse=3e-3, share=0.03))


@pytest.fixture(scope="session")
def impacts_smoothed(impacts_filtered: Forward) -> Smoothed:
    return smooth(impacts_filtered)


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(5)
