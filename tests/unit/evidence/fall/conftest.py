"""One simulated drop with a known truth, recorded by good sensors."""

import math
from dataclasses import replace

import pytest

from rotordrop import Known, build_drop_model, example_machine
from rotordrop.evidence.evidence import known, read_evidence
from rotordrop.evidence.sensing import build_sensing
from rotordrop.rotor.reduction import Reduction
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.sensor_chain import PERFECT

SPEED = 2.0 * math.pi * 100.0
BASIS = Reduction(modes=6, attachment=True)


@pytest.fixture(scope="session")
def truth():
    """The machine of the records with its sensors known to be exact."""
    machine = example_machine("lp400")
    values: dict[str, Known | float] = {}
    for sensor in machine.sensors:
        values[f"sensors.{sensor.name}.gain"] = Known(value=1.0, standard_error=1e-5)
        values[f"sensors.{sensor.name}.offset"] = Known(value=0.0, standard_error=1e-8)
    return machine.with_values(values)


@pytest.fixture(scope="session")
def drop(truth):
    """A drop from 100 Hz of that machine, 60 ms long, with 0.45 µm of noise and nothing else wrong."""
    hidden = hidden_machine(truth, 5, drawn=False, reduction=BASIS)
    chain = replace(PERFECT, noise=0.45e-6, speed_noise=0.1)
    return synthesize_drop(hidden, SPEED, 3, sensor_chain=chain, duration=0.06, tolerance=1e-7)


@pytest.fixture(scope="session")
def model(truth):
    """The drop model of that machine, in the basis the record was made with."""
    return build_drop_model(truth, BASIS)


@pytest.fixture(scope="session")
def sensing(model, drop):
    return build_sensing(model, drop.record.sensors)


@pytest.fixture(scope="session")
def evidence(drop, model):
    return read_evidence(model, drop.record, drop.tail)


@pytest.fixture(scope="session")
def rest(evidence):
    return known(evidence.rest)
