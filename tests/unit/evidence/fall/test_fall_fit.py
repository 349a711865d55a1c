"""The least squares behind the fall: derivatives are those of the residual, the prior is the stated one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.evidence.initial_state import FallFit, FallReadings, InitialState
from rotordrop.evidence.sensing import Sensing
from rotordrop.rotor.parameters import DropModel

OFFSET = 8e-6


def fit_of(initial: InitialState, sensing: Sensing, model: DropModel, noise: float) -> FallFit:
    """The problem with readings of no meaning: 40 samples every 0.1 ms, an orbit of 10 µm."""
    dice = np.random.default_rng(2)
    count, sensors = 40, len(sensing.names)
    readings = FallReadings(
        time=1e-4 * np.arange(1, count + 1),
        deviation=20e-6 * dice.standard_normal((count, sensors)),
        noise=np.full(sensors, noise),
        orbit=10e-6 * dice.standard_normal(sensors),
        orbit_velocity=5e-3 * dice.standard_normal(sensors),
        orbit_acceleration=3.0 * dice.standard_normal(sensors),
    )
    unsure = replace(sensing, offset_sigma=np.full(sensors, OFFSET), gain_sigma=np.full(sensors, 0.01))
    return FallFit(initial.fall, unsure, readings, 1e-6 * dice.standard_normal(sensors), model, 2e-5)


def test_the_derivatives_are_those_of_the_residual(
    initial: InitialState, sensing: Sensing, model: DropModel
) -> None:
    fit = fit_of(initial, sensing, model, 0.5e-6)
    unknowns, dice = fit.unknowns, np.random.default_rng(3)
    sigma = 1.0 / np.diag(fit.prior_root)
    at = initial.mean + 0.3 * sigma * dice.standard_normal(unknowns.size)
    at[unknowns.shift] = 0.02
    _, jacobian = fit.linearised(at)
    for entry in range(unknowns.size):
        step = np.zeros(unknowns.size)
        step[entry] = 1e-3 * sigma[entry] if entry != initial.fall.one else 1e-3
        before, after = fit.linearised(at - step)[0], fit.linearised(at + step)[0]
        column = -(after - before) / (2.0 * step[entry])
        # Of decay and shift the derivative is itself a finite difference.
        rel = 0.05 if entry in (unknowns.decay, unknowns.shift) else 1e-5
        assert np.linalg.norm(jacobian[:, entry] - column) < rel * np.linalg.norm(column), entry


def test_without_readings_the_prior_is_left(
    initial: InitialState, sensing: Sensing, model: DropModel
) -> None:
    """The rest is as uncertain as the sensors' zeros make it, gains as the machine file says."""
    fit = fit_of(initial, sensing, model, 1e3)
    _, covariance, _ = fit.solve()
    sigma = np.sqrt(np.diag(covariance))
    assert sigma[fit.unknowns.gain] == pytest.approx(0.01, rel=0.02)
    zeros = OFFSET * np.random.default_rng(4).standard_normal((20000, len(sensing.names)))
    vertical = np.std(sensing.at_bearings(zeros)[..., 1], axis=0)
    assert sigma[fit.unknowns.rest][1::2] == pytest.approx(vertical, rel=0.03)
    assert sigma[fit.unknowns.shift] == pytest.approx(0.02, rel=0.1)


def test_the_estimate_is_where_no_step_leads_away(
    initial: InitialState, sensing: Sensing, model: DropModel
) -> None:
    """Not where the first step ends: gains, decay and release enter as products."""
    fit = fit_of(initial, sensing, model, 5e-6)
    estimate, covariance, _ = fit.solve()
    residual, jacobian = fit.linearised(estimate)
    step = covariance @ jacobian.T @ residual
    assert np.max(np.abs(step) / np.sqrt(np.diag(covariance))) < 0.05
