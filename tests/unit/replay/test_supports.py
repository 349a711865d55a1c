"""Supports and friction from the first impacts of a record with a known truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.elements.parameter import Role
from rotordrop.errors import IdentificationError
from rotordrop.physics import columns as L
from rotordrop.replay.friction import sweep_friction
from rotordrop.replay.problem import ReplayProblem
from rotordrop.replay.supports import (
    ImpactFit,
    fit_supports,
    identified_values,
    posterior_covariance,
    refit_with_friction,
    support_correlations,
)


@pytest.fixture(scope="module")
def guess(problem: ReplayProblem) -> np.ndarray:
    """What the machine file says of every parameter, here the truth."""
    z = np.zeros(problem.size)
    begin = np.array([unknown.begin for unknown in problem.unknowns])
    z[: len(begin)] = (begin - problem.mean) / problem.sigma
    return z


def known_fit(problem: ReplayProblem, z: np.ndarray) -> ImpactFit:
    return ImpactFit(
        z=z, cost=1.0, misfit=1.0, window=0.01, at_bound=np.zeros(problem.size, dtype=np.bool_), simulations=1
    )


def test_true_parameters_leave_noise(problem: ReplayProblem, guess: np.ndarray, contacts: np.ndarray) -> None:
    residual = problem.residual(guess, float(contacts.max()) + 2e-3)
    assert 0.6 < float(np.mean(residual**2)) < 1.6


def test_supports_return_to_what_was_put_in(problem: ReplayProblem, contacts: np.ndarray) -> None:
    """From three starts; every interval, twice as wide, holds the truth, the machine file's value."""
    fit = fit_supports(problem, float(contacts.max()), starts=3, threads=2)
    found = identified_values(problem, fit.best.z, fit.covariance, fit.best.at_bound)
    assert fit.best.misfit < 1.3 and len(fit.windows) == 6 and not fit.ended_early
    assert fit.starts == 3 and fit.simulations > 300
    for bearing, stiffness, ratio in (("NDE", 1e8, 0.025), ("DE", 4e8, 0.025)):
        damping = 2.0 * ratio * np.sqrt(stiffness * 40.0)
        assert found[f"{bearing}.support.stiffness"].value == pytest.approx(stiffness, rel=0.03)
        assert found[f"{bearing}.support.mass"].value == pytest.approx(40.0, rel=0.03)
        assert found[f"{bearing}.support.damping"].value == pytest.approx(damping, rel=0.25)
    for path, value in found.items():
        low, high = value.interval_90 or (0.0, 0.0)
        assert value.start is not None
        assert low - (high - low) < value.start < high + (high - low), path
    preload = problem.paths.index("NDE.preload")
    assert fit.best.z[preload] == 0.0 and fit.covariance[preload, preload] == 1.0
    pairs = {(one.first, one.second): one.value for one in support_correlations(problem, fit.covariance)}
    assert pairs["NDE.support.stiffness", "NDE.support.mass"] > 0.5
    assert all(len({path.split(".")[0] for path in pair}) == 1 for pair in pairs)


def test_a_window_the_model_cannot_follow_is_given_up(problem: ReplayProblem, contacts: np.ndarray) -> None:
    beyond = problem.time[:, None] > contacts.max() + 4e-3
    other = replace(problem, deviation=problem.deviation + 30e-6 * beyond)
    fit = fit_supports(other, float(contacts.max()), starts=1, threads=2)
    assert "the model no longer follows the record" in fit.ended_early
    assert fit.best.window == pytest.approx(float(contacts.max()) + 3.25e-3)


def test_refit_takes_the_friction_of_the_sweep(
    problem: ReplayProblem, guess: np.ndarray, contacts: np.ndarray
) -> None:
    window = float(contacts.max()) + 3e-3
    short = replace(problem, time=problem.time[problem.time < window])
    fit = fit_supports(short, float(contacts.max()), starts=1, threads=2)
    swept = sweep_friction(
        problem, fit.best.z, float(contacts.min()), coefficients=np.array([0.09, 0.1, 0.11]), draws=[guess]
    )
    known, again = refit_with_friction(problem, fit, swept.value, window, threads=2)
    error = (swept.value.standard_error or 0.0) / swept.value.value
    assert known.mean[known.friction] == pytest.approx(np.log(swept.value.value))
    assert known.sigma[known.friction] == pytest.approx(error)
    assert known.theta(again.best.z)[known.friction] == pytest.approx(
        np.log(swept.value.value), abs=4.0 * error
    )
    assert again.windows[-1] == pytest.approx(window)


def test_covariance_is_that_of_a_linear_fit_with_considered_parameters(
    problem: ReplayProblem, guess: np.ndarray
) -> None:
    """The fitted ones err by noise and prior, and by what the considered ones are off."""
    fit = known_fit(problem, guess)
    fitted, considered = problem.fitted(40), problem.has_role(Role.CONSIDERED)
    slopes = np.random.default_rng(4).standard_normal((200, problem.size)) * (fitted | considered)
    found = posterior_covariance(problem, fit, slopes, 1.0)
    a, b = slopes[:, fitted], slopes[:, considered]
    gain = np.linalg.solve(a.T @ a + np.eye(a.shape[1]), a.T)
    own = np.linalg.inv(a.T @ a + np.eye(a.shape[1]))
    assert found[np.ix_(fitted, fitted)] == pytest.approx(own + gain @ b @ b.T @ gain.T)
    assert found[np.ix_(fitted, considered)] == pytest.approx(-gain @ b)
    assert found[np.ix_(considered, considered)] == pytest.approx(np.eye(b.shape[1]))
    assert posterior_covariance(problem, fit, slopes, 1e6) == pytest.approx(np.eye(problem.size), abs=1e-3)


def test_a_simulation_that_fails_on_one_side_leaves_the_slope_of_the_other(
    problem: ReplayProblem, guess: np.ndarray, contacts: np.ndarray
) -> None:
    """A zero column would say that the unknown has no effect and leave it at its prior."""

    class Broken(ReplayProblem):
        def residual(self, z: np.ndarray, window: float) -> np.ndarray:
            if z[0] > guess[0]:
                raise IdentificationError("too stiff to integrate")
            return super().residual(z, window)

    window, first = float(contacts.max()) + 2e-3, np.arange(problem.size) == 0
    broken = Broken(**{name: getattr(problem, name) for name in problem.__dataclass_fields__})
    expected = problem.jacobian(guess, window, first)
    assert broken.jacobian(guess, window, first) == pytest.approx(expected, abs=0.1 * np.abs(expected).max())
    moved = guess.copy()
    moved[0] += 0.1
    assert broken.misfit(moved, window) == math.inf


def test_verdicts_name_bounds_and_what_is_not_determined(problem: ReplayProblem) -> None:
    z, variance = np.zeros(problem.size), np.full(problem.size, 0.01)
    variance[1] = 1.0
    at_bound = np.arange(problem.size) == 0
    found = identified_values(problem, z, np.diag(variance), at_bound)
    status = [found[path].status for path in problem.paths[:3]]
    assert status == ["at its bound", "the record does not determine it", "determined"]
    assert identified_values(problem, z, np.diag(variance))[problem.paths[2]].status == "taken over"


def test_an_identified_value_lies_in_the_middle_of_its_interval(problem: ReplayProblem) -> None:
    z = np.zeros(problem.size)
    found = identified_values(problem, z, 0.01 * np.eye(problem.size), np.zeros(problem.size, dtype=np.bool_))
    for unknown in problem.unknowns:
        value, half = found[unknown.path], 1.6448536269514722 * 0.1 * unknown.sigma
        assert value.value == unknown.value_of(unknown.mean)
        ends = tuple(unknown.value_of(unknown.mean + side * half) for side in (-1.0, 1.0))
        assert value.interval_90 == pytest.approx(ends, rel=1e-9)


def test_gap_follows_the_sag_of_the_trial_support(problem: ReplayProblem, guess: np.ndarray) -> None:
    softer = guess.copy()
    softer[0] -= np.log(2.0) / problem.sigma[0]
    moved = problem.bearing_rows(softer) - problem.bearing_rows(guess)
    assert problem.paths[0] == "NDE.support.stiffness"
    assert moved[:, L.AIR_GAP] == pytest.approx([-float(problem.model.load_shares[0]) / 1e8, 0.0], abs=1e-12)
    assert moved[:, L.ROTOR_RADIUS] == pytest.approx(-moved[:, L.AIR_GAP], abs=1e-15)


def test_rest_error_lowers_the_gap_by_itself(problem: ReplayProblem, guess: np.ndarray) -> None:
    moved = guess.copy()
    moved[-1] += 3.0
    moved[len(problem.unknowns)] += 2.0
    height = (problem.rest_error(moved) - problem.rest_error(guess))[:, 1]
    gap = [problem.bearing_rows(z)[:, L.AIR_GAP] for z in (moved, guess)]
    assert gap[0] - gap[1] == pytest.approx(-height, abs=1e-15)


def test_impossible_values_are_refused_with_the_time(problem: ReplayProblem, guess: np.ndarray) -> None:
    rows = problem.model.parameters.bearing.copy()
    rows[:, L.RACE_MASS] = np.nan
    model = replace(problem.model, parameters=problem.model.parameters._replace(bearing=rows))
    with pytest.raises(IdentificationError, match=r"stopped at .* ms \(outcome \d\); expected"):
        replace(problem, model=model).simulated(guess, 200)


def test_values_of_the_machine_file_reproduce_the_machine(problem: ReplayProblem, guess: np.ndarray) -> None:
    rows, described = problem.bearing_rows(guess), problem.model.parameters.bearing
    for column in (
        L.SUPPORT_STIFFNESS_X,
        L.SUPPORT_STIFFNESS_Y,
        L.SUPPORT_MASS_Y,
        L.CONTACT_STIFFNESS,
        L.FRICTION_STATIC,
        L.BEARING_DAMPING,
        L.AXIAL_OFFSET,
    ):
        assert rows[:, column] == pytest.approx(described[:, column], rel=1e-12)


def test_friction_is_one_unknown_with_a_fixed_ratio(problem: ReplayProblem, guess: np.ndarray) -> None:
    known = problem.with_friction(math.log(0.08), 0.01)
    z = guess.copy()
    z[known.friction] = 0.0
    rows = known.bearing_rows(z)
    assert rows[:, L.FRICTION_DYNAMIC] == pytest.approx([0.08, 0.08])
    assert rows[:, L.FRICTION_STATIC] == pytest.approx([0.104, 0.104])


def test_directions_hold_the_whole_covariance(problem: ReplayProblem) -> None:
    covariance = problem.initial.covariance
    scale = np.sqrt(np.diag(covariance))
    product = (problem.directions @ problem.directions.T) / np.outer(scale, scale)
    assert product == pytest.approx(covariance / np.outer(scale, scale), abs=1e-8)


def test_directions_that_no_fit_follows_hardly_show(
    problem: ReplayProblem, guess: np.ndarray, contacts: np.ndarray
) -> None:
    columns = np.arange(problem.size) >= len(problem.unknowns)
    effects = problem.jacobian(guess, float(contacts.max()) + 5e-3, columns)
    strength = np.linalg.norm(effects, axis=0)
    assert np.linalg.norm(strength[40:]) < 0.02 * strength[0]
    assert strength[0] > strength[8] > strength[20]


def test_friction_sweep_finds_the_coefficient(
    problem: ReplayProblem, guess: np.ndarray, contacts: np.ndarray
) -> None:
    swept = sweep_friction(
        problem,
        guess,
        float(contacts.min()),
        coefficients=np.array([0.06, 0.08, 0.1, 0.12, 0.14]),
        draws=[guess + 1e-3, guess - 1e-3],
    )
    assert swept.value.value == pytest.approx(0.1, abs=0.004)
    assert swept.value.status == "determined"
    assert int(np.argmin(swept.disagreement)) == 2
    assert len(swept.best) == 3
    assert swept.window[1] - swept.window[0] == pytest.approx(33e-3)


def test_friction_beyond_the_sweep_is_at_its_bound(
    problem: ReplayProblem, guess: np.ndarray, contacts: np.ndarray
) -> None:
    swept = sweep_friction(problem, guess, float(contacts.min()), coefficients=np.array([0.13, 0.15, 0.17]))
    assert swept.value.status == "at its bound"
