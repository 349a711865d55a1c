"""Supports from the first impacts of a record with a known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.evidence.initial_state import InitialState
from rotordrop.identification.directions import influential_directions
from rotordrop.identification.fit import completed, fit_window
from rotordrop.identification.friction import orbit_disagreement, orbit_distance, sweep_friction
from rotordrop.identification.parameter_vector import ParameterVector, nuisance_vector, support_vector
from rotordrop.identification.replica import Replica
from rotordrop.identification.support import (
    ImpactFit,
    fit_support,
    identified_values,
    refit_with_friction,
    widened_covariance,
)
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel


def moved_from_truth(problem: ImpactFit) -> np.ndarray:
    """Start with supports 15 % and 10 % off."""
    x = problem.prior_mean.copy()
    x[:6] += np.array([0.15, 0.1, -0.3, -0.1, 0.1, 0.3])
    return x


def test_true_parameters_leave_noise(problem: ImpactFit, contacts: np.ndarray) -> None:
    residual = problem.residual(problem.prior_mean, float(contacts.max()) + 2e-3)
    assert 0.6 < float(np.mean(residual**2)) < 1.6


def test_supports_return_to_what_was_put_in(problem: ImpactFit, contacts: np.ndarray) -> None:
    x = moved_from_truth(problem)
    for window in (3e-3, 6e-3, 11e-3):
        fit = fit_window(problem, x, float(contacts.max()) + window, tolerance=1e-3)
        x = fit.x
    fit = completed(problem, fit)
    found = identified_values(problem, fit.x, widened_covariance(problem, fit))
    assert fit.misfit < 1.3
    for bearing, stiffness, ratio in (("NDE", 1e8, 0.025), ("DE", 4e8, 0.025)):
        damping = 2.0 * ratio * np.sqrt(stiffness * 40.0)
        assert found[f"{bearing}.support.stiffness"].value == pytest.approx(stiffness, rel=0.03)
        assert found[f"{bearing}.support.mass"].value == pytest.approx(40.0, rel=0.03)
        assert found[f"{bearing}.support.damping"].value == pytest.approx(damping, rel=0.25)
    for path, value in found.items():
        true = value.start
        low, high = value.interval_90 or (0.0, 0.0)
        assert true is not None and low - (high - low) < true < high + (high - low), path


def test_preload_keeps_its_prior(problem: ImpactFit, contacts: np.ndarray) -> None:
    fit = fit_window(problem, problem.prior_mean, float(contacts.max()) + 3e-3, iterations=2)
    place = problem.vector.place("NDE.preload")
    assert fit.x[place] == problem.prior_mean[place]
    assert fit.covariance[place, place] == pytest.approx(problem.prior_sigma[place] ** 2)


def test_search_from_several_starts_over_short_windows(
    problem: ImpactFit, contacts: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rotordrop.identification.support.WINDOWS", (1.75e-3, 3.25e-3, 5.25e-3, 7.25e-3))
    fit = fit_support(problem, problem, float(contacts.max()), starts=3, threads=2)
    assert len(fit.coarse.by_window) == 3 and len(fit.search.by_window) == 2
    assert fit.search.best.misfit < 1.3
    assert fit.values["NDE.support.stiffness"].value == pytest.approx(1e8, rel=0.15)
    assert fit.values["NDE.support.stiffness"].start == pytest.approx(1e8)
    pairs = {(pair.first, pair.second): pair.value for pair in fit.correlations}
    assert pairs["NDE.support.stiffness", "NDE.support.mass"] > 0.5
    ends = [[path.split(".")[0] for path in pair] for pair in pairs]
    assert ends and all(first == second for first, second in ends)


def test_verdicts_name_bounds_and_what_is_not_determined(problem: ImpactFit) -> None:
    x = problem.prior_mean
    covariance = np.diag((0.1 * problem.prior_sigma) ** 2)
    covariance[1, 1] = problem.prior_sigma[1] ** 2
    active = tuple(k == 0 for k in range(len(x)))
    found = identified_values(problem, x, covariance, active=active)
    paths = problem.vector.paths
    assert found[paths[0]].status == "at its bound"
    assert found[paths[1]].status == "the record does not determine it"
    assert found[paths[2]].status == "determined"
    assert identified_values(problem, x, covariance, given=True)[paths[2]].status == "taken over"


def test_gap_follows_the_sag_of_the_trial_support(replica: Replica, model: DropModel) -> None:
    vector = support_vector(model)
    theta = vector.mean
    softer = theta.copy()
    softer[0] -= np.log(2.0)
    moved = (
        replica.bearing_rows(vector, softer)[:, L.AIR_GAP] - replica.bearing_rows(vector, theta)[:, L.AIR_GAP]
    )
    assert moved == pytest.approx([-float(model.load_shares[0]) / 1e8, 0.0], abs=1e-12)


def test_rest_error_lowers_the_gap_by_itself(replica: Replica, model: DropModel) -> None:
    vector = support_vector(model)
    shifted = replica.bearing_rows(vector, vector.mean, np.array([[0.0, 3e-6], [0.0, -2e-6]]))
    gap = replica.bearing_rows(vector, vector.mean)[:, L.AIR_GAP]
    assert shifted[:, L.AIR_GAP] - gap == pytest.approx([-3e-6, 2e-6], abs=1e-15)


def test_impossible_values_are_refused_with_the_time(replica: Replica, model: DropModel) -> None:
    rows = replica.bearing_rows(support_vector(model), support_vector(model).mean)
    rows[:, L.RACE_MASS] = np.nan
    with pytest.raises(IdentificationError, match=r"stopped at .* ms \(outcome \d\); expected"):
        replica.states(rows, replica.time[:200])


def guesses(vector: ParameterVector) -> np.ndarray:
    """What the machine file says, which need not be the middle of a range."""
    return np.array([unknown.begin for unknown in vector.unknowns])


def test_support_vector_sets_both_directions(model: DropModel) -> None:
    vector = support_vector(model)
    rows = model.parameters.bearing.copy()
    theta = guesses(vector)
    theta[vector.place("DE.support.stiffness")] = np.log(3e8)
    vector.set(theta, rows)
    assert rows[1, L.SUPPORT_STIFFNESS_X] == pytest.approx(3e8)
    assert rows[1, L.SUPPORT_STIFFNESS_Y] == pytest.approx(3e8)
    assert rows[0] == pytest.approx(model.parameters.bearing[0])


def test_guesses_reproduce_the_machine(model: DropModel) -> None:
    rows = np.zeros_like(model.parameters.bearing)
    for vector in (support_vector(model), nuisance_vector(model)):
        vector.set(guesses(vector), rows)
    for column in (
        L.SUPPORT_MASS_Y,
        L.CONTACT_STIFFNESS,
        L.FRICTION_STATIC,
        L.BEARING_DAMPING,
        L.AXIAL_OFFSET,
    ):
        assert rows[:, column] == pytest.approx(model.parameters.bearing[:, column], rel=1e-12)


def test_friction_is_one_unknown_with_a_fixed_ratio(model: DropModel) -> None:
    vector = nuisance_vector(model)
    rows = model.parameters.bearing.copy()
    theta = vector.mean.copy()
    theta[vector.friction] = np.log(0.08)
    vector.set(theta, rows)
    assert rows[:, L.FRICTION_DYNAMIC] == pytest.approx([0.08, 0.08])
    assert rows[:, L.FRICTION_STATIC] == pytest.approx([0.104, 0.104])


def test_directions_and_the_rest_hold_the_whole_covariance(replica: Replica) -> None:
    directions = influential_directions(replica)
    whole = np.hstack([directions.unknowns, directions.remaining])
    scale = np.sqrt(np.diag(replica.initial.covariance))
    product = (whole @ whole.T) / np.outer(scale, scale)
    assert product == pytest.approx(replica.initial.covariance / np.outer(scale, scale), abs=1e-8)


def test_a_direction_moves_the_start_as_its_unknowns_do(replica: Replica) -> None:
    directions, mean = influential_directions(replica), replica.initial.mean
    for k in range(directions.unknowns.shape[1]):
        step = 1e-3 * directions.unknowns[:, k]
        (ahead, turned), (behind, back) = replica.start_state(mean + step), replica.start_state(mean - step)
        for found, slope in (
            (directions.states[:, k], 500.0 * (ahead - behind)),
            (directions.unbalances[..., k], 500.0 * (turned - back)),
        ):
            assert np.linalg.norm(found - slope) < 0.02 * np.linalg.norm(slope), k


def test_what_the_directions_leave_moves_the_bearings_little(replica: Replica) -> None:
    directions = influential_directions(replica)
    place, shape = replica.model.layout.modal_y, replica.model.parameters.bearing_shape
    followed = shape @ directions.states[place]
    step = 1e-3
    left = [replica.start_state(replica.initial.mean + step * d)[0] for d in directions.remaining.T]
    beyond = shape @ (np.array(left) - replica.state).T[place] / step
    # standard deviations: unlike the largest column they do not depend on how the rest is cut into columns
    assert np.all(np.linalg.norm(beyond, axis=1) < 0.05 * np.linalg.norm(followed, axis=1))


def test_directions_are_those_of_the_covariance_not_of_its_square_root(
    replica: Replica, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected, root = influential_directions(replica), replica.initial.square_root()
    turn, _ = np.linalg.qr(np.random.default_rng(1).standard_normal(root.shape))
    monkeypatch.setattr(InitialState, "square_root", lambda state: root @ turn)
    found = influential_directions(replica)
    scale = np.sqrt(np.diag(replica.initial.covariance))[:, None]
    assert found.remaining / scale == pytest.approx(expected.remaining / scale, abs=1e-6)
    assert found.unknowns / scale == pytest.approx(expected.unknowns / scale, abs=1e-6)
    reach = np.abs(expected.states).max(axis=0)
    assert found.states / reach == pytest.approx(expected.states / reach, abs=1e-6)


def test_friction_sweep_finds_the_coefficient(problem: ImpactFit, contacts: np.ndarray) -> None:
    swept = sweep_friction(
        problem,
        problem.prior_mean,
        float(contacts.min()),
        coefficients=np.array([0.06, 0.08, 0.1, 0.12, 0.14]),
        draws=[problem.prior_mean + 1e-3, problem.prior_mean - 1e-3],
    )
    assert swept.value.value == pytest.approx(0.1, abs=0.004)
    assert swept.value.status == "determined"
    assert int(np.argmin(swept.disagreement)) == 2
    assert len(swept.best) == 3
    assert swept.window[1] - swept.window[0] == pytest.approx(33e-3)


def test_friction_beyond_the_sweep_is_at_its_bound(problem: ImpactFit, contacts: np.ndarray) -> None:
    swept = sweep_friction(
        problem, problem.prior_mean, float(contacts.min()), coefficients=np.array([0.13, 0.15, 0.17])
    )
    assert swept.value.status == "at its bound"


def test_disagreement_forgets_what_chaos_does() -> None:
    time = np.arange(0.0, 40e-3, 5e-5)
    early = np.where(time[:, None] < 10e-3, 1e-6, 0.0)
    late = np.where(time[:, None] > 30e-3, 1e-6, 0.0)
    assert orbit_disagreement(time, np.full((len(time), 1), 2e-6), 5e-3) == pytest.approx(2e-6, rel=1e-12)
    assert orbit_disagreement(time, late, 5e-3) < 0.3 * orbit_disagreement(time, early, 5e-3)


def test_orbit_distance_of_the_truth_is_noise(problem: ImpactFit, contacts: np.ndarray) -> None:
    count = problem.replica.until(float(contacts.max()) + 2e-3)
    distance = orbit_distance(problem, problem.prior_mean, count)
    assert float(np.sqrt(np.mean(distance**2))) < 1.2e-6


def test_refit_takes_the_friction_of_the_sweep(problem: ImpactFit, contacts: np.ndarray) -> None:
    start = fit_window(problem, problem.prior_mean, float(contacts.max()) + 3e-3, iterations=1)
    swept = sweep_friction(
        problem, start.x, float(contacts.min()), coefficients=np.array([0.09, 0.1, 0.11]), draws=[start.x]
    )
    known, x, covariance = refit_with_friction(problem, start, swept.value, threads=2)
    place = known.vector.friction
    error = (swept.value.standard_error or 0.0) / swept.value.value
    assert known.prior_mean[place] == pytest.approx(np.log(swept.value.value))
    assert x[place] == pytest.approx(np.log(swept.value.value), abs=2.0 * error)
    assert covariance.shape == (len(x), len(x))
    assert replace(known, vector=problem.vector).vector is problem.vector
