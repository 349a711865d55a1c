"""The joint distribution in a calibrated file says no more than its intervals, and keeps the correlations."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop import build_drop_model, example_machine
from rotordrop.known import NINETY, Known
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.rotor.unknowns import bearing_unknowns, correlate
from rotordrop.twin.calibrated import as_filed, joint_covariance
from rotordrop.twin.tracked_parameters import identified


@pytest.fixture(scope="module")
def model():
    return build_drop_model(example_machine("lp400"), "quick")


@pytest.fixture(scope="module")
def problem(model):
    unknowns = [one for b in range(2) for one in bearing_unknowns(model, b)]
    return SimpleNamespace(unknowns=unknowns, n_dynamic=3, model=model)


@pytest.fixture(scope="module")
def covariance(problem):
    random = np.random.default_rng(4)
    n = len(problem.unknowns)
    mix = random.standard_normal((n, 2 * n))
    correlation = np.corrcoef(mix)
    sigma = np.array([0.3 * one.sigma for one in problem.unknowns])
    whole = np.zeros((3 + n, 3 + n))
    whole[3:, 3:] = sigma[:, None] * correlation * sigma
    return whole


def middle(problem):
    return np.concatenate([np.zeros(3), [one.begin for one in problem.unknowns]])


def stated(problem, covariance, widening):
    sigma = np.sqrt(np.diag(covariance)[3:])
    return {
        one.path: identified(one, one.begin, float(s), widening)
        for one, s in zip(problem.unknowns, sigma, strict=True)
    }


def spread_of(problem, mean, covariance, known):
    """What a file holds of a fit whose first three entries are no parameters."""
    fitted = {one.path: one for one in problem.unknowns}
    return joint_covariance(problem.model, fitted, mean[3:], covariance[3:, 3:], known)


def place(problem, path):
    return next(k for k, one in enumerate(problem.unknowns) if one.path == path)


@pytest.fixture(scope="module")
def spread(problem, covariance):
    """What a file holds of the fit as it is."""
    return spread_of(problem, middle(problem), covariance, stated(problem, covariance, 1.0))


def test_spreads_are_those_of_intervals_above_zero(problem, covariance):
    known = as_filed(problem.model.machine, stated(problem, covariance, 1.5))
    spread = spread_of(problem, middle(problem), covariance, known)
    sigma = np.sqrt(np.diag(spread.matrix))
    for path in ("NDE.air_gap", "DE.support.mass", "NDE.preload", "DE.friction.dynamic"):
        low, high = known[path].interval_90
        k = spread.paths.index(path)
        width = np.log(high / low) if spread.logarithmic[k] else high - low
        assert sigma[k] == pytest.approx(width / (2.0 * NINETY), rel=1e-6)
    known = stated(problem, covariance, 1.0)
    known["DE.support.damping"] = Known(value=0.0, interval_90=(0.0, 500.0))
    spread = spread_of(problem, middle(problem), covariance, known)
    assert "DE.support.damping" not in spread.paths and "NDE.support.damping" in spread.paths
    assert np.all(np.isfinite(spread.matrix))
    k = place(problem, "DE.preload")
    preload = problem.unknowns[k]
    theta = preload.mean - 12.0 * preload.sigma
    known = stated(problem, covariance, 1.0) | {"DE.preload": identified(preload, theta, 0.3 * preload.sigma)}
    described = float(problem.model.machine.touchdown_bearings[1].bearing.preload)
    assert known["DE.preload"].value == pytest.approx(0.01 * described, rel=1e-6)
    mean = middle(problem)
    mean[3 + k] = theta
    assert np.all(np.isfinite(spread_of(problem, mean, covariance, known).matrix))


def test_correlations_follow_the_fit_and_what_goes_with_it(problem, covariance, spread):
    assert "NDE.support.anisotropy" not in spread.paths
    a, b = (spread.paths.index(f"NDE.support.{name}") for name in ("stiffness", "stiffness_horizontal"))
    i, j = (3 + place(problem, f"NDE.support.{name}") for name in ("stiffness", "anisotropy"))
    expected = covariance[i, i] + covariance[j, j] + 2.0 * covariance[i, j]
    assert spread.matrix[b, b] == pytest.approx(expected, rel=1e-6)
    assert spread.matrix[a, a] == pytest.approx(covariance[i, i], rel=1e-6)
    machine = problem.model.machine
    depth = machine.touchdown_bearings[0].contact.typical_depth(float(np.mean(problem.model.load_shares)))
    k, n = (spread.paths.index(f"NDE.contact.{name}") for name in ("stiffness", "exponent"))
    along = np.zeros(len(spread.paths))
    along[k], along[n] = 1.0, float(machine.touchdown_bearings[0].contact.exponent) * np.log(depth)
    i = 3 + place(problem, "NDE.contact.stiffness")
    assert along @ spread.matrix @ along == pytest.approx(covariance[i, i], rel=0.02)


def calibrated_in_file(problem, spread):
    origin = CalibrationOrigin(drops=(CalibrationDrop(name="one"),), consistent=True, joint=spread)
    return replace(problem.model, machine=problem.model.machine.model_copy(update={"calibration": origin}))


def test_correlations_are_handed_on_and_changed_values_err_alone(problem, covariance, spread):
    joint = spread_of(problem, middle(problem), covariance, stated(problem, covariance, 1.5))
    unknowns = [replace(one, calibrated=True) for one in problem.unknowns]
    sigma = 1.0 + np.arange(len(unknowns))
    block = np.diag(sigma**2)
    correlate(calibrated_in_file(problem, joint), unknowns, block)
    fitted = covariance[3:, 3:]
    own = np.sqrt(np.diag(fitted))
    assert block / np.outer(sigma, sigma) == pytest.approx(fitted / np.outer(own, own), abs=1e-6)
    unknowns = [replace(one, calibrated=k != 2) for k, one in enumerate(problem.unknowns)]
    block = np.eye(len(unknowns))
    correlate(calibrated_in_file(problem, spread), unknowns, block)
    assert np.count_nonzero(block[2]) == 1 and np.count_nonzero(block[1]) > 2
    assert np.linalg.eigvalsh(block).min() > 0.0
    block = np.eye(len(problem.unknowns))
    correlate(problem.model, problem.unknowns, block)
    assert (block == np.eye(len(problem.unknowns))).all()
