"""Left is no better than right: a mirrored record gives the mirrored estimate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.evidence.evidence import read_evidence
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track.forces import ForceHistory, force_history
from rotordrop.track.problem import build_problem
from rotordrop.track.smoother import PassSettings, forward, smooth
from rotordrop.twin.problems import COARSE_BASIS, recorded_drop
from rotordrop_bench import SyntheticDrop

UNTIL = 0.025


def mirrored(machine: Machine) -> Machine:
    """The machine seen in a mirror: a sensor at 45° looks along 135°."""
    sensors = []
    for sensor in machine.sensors:
        across = -math.cos(float(sensor.angle))
        plane = (other for other in machine.sensors if other.node == sensor.node)
        (angle,) = (other.angle for other in plane if math.isclose(math.cos(float(other.angle)), across))
        sensors.append(sensor.model_copy(update={"angle": angle}))
    return machine.model_copy(update={"sensors": tuple(sensors)})


def first_impacts(machine: Machine, drop: SyntheticDrop, spin: float) -> ForceHistory:
    """Forces over the first impacts."""
    seen = recorded_drop(read_evidence(build_drop_model(machine), drop.record, drop.tail), UNTIL)
    turned = replace(seen, initial_speed=spin * seen.initial_speed, speed=spin * seen.speed)
    problem = build_problem(build_drop_model(machine, COARSE_BASIS), turned, until=UNTIL)
    smoothed = smooth(forward(problem, PassSettings(impulse=3e-3, share=0.03)), watched=problem.watched)
    return force_history(problem, smoothed)


def test_a_mirrored_record_gives_the_mirrored_force(calibrated: Machine, synthetic: SyntheticDrop) -> None:
    """x to -x with the spin reversed: no law knows left from right."""
    one = first_impacts(calibrated, synthetic, 1.0)
    other = first_impacts(mirrored(calibrated), synthetic, -1.0)
    peak = one.magnitude.max()
    assert peak > 1000.0
    assert np.abs(one.force[..., 0]).max() > 100.0
    assert other.force[..., 0] == pytest.approx(-one.force[..., 0], abs=1e-5 * peak)
    assert other.force[..., 1] == pytest.approx(one.force[..., 1], abs=1e-5 * peak)
    assert other.magnitude_sigma == pytest.approx(one.magnitude_sigma, abs=1e-5 * peak)
    same_spin = first_impacts(mirrored(calibrated), synthetic, 1.0)
    assert np.abs(same_spin.force[..., 0] + one.force[..., 0]).max() > 1e-3 * peak
