"""Supports from the first impacts of a record with a known truth."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop import build_drop_model, example_machine
from rotordrop.errors import IdentificationError
from rotordrop.evidence.initial_state import InitialState, covariance_root
from rotordrop.physics import columns as L
from rotordrop.replay.first_impacts import (
    Trial,
    first_impacts,
    influential_directions,
    start_state,
)
from rotordrop.replay.least_squares import completed, fit_window
from rotordrop.replay.support_and_friction import (
    fit_support,
    identified_values,
    refit_with_friction,
    sweep_friction,
    widened_covariance,
)
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.unknowns import all_unknowns

NINETY = 1.6448536269514722


def moved_from_truth(problem):
    """Start with supports 15 % and 10 % off."""
    x = problem.table.mean.copy()
    x[:6] += np.array([0.15, 0.1, -0.3, -0.1, 0.1, 0.3])
    return x


def test_the_truth_leaves_noise_in_residual_and_orbit(problem, contacts):
    residual = problem.residual(problem.table.mean, float(contacts.max()) + 2e-3)
    assert 0.6 < float(np.mean(residual**2)) < 1.6
    count = problem.until(float(contacts.max()) + 2e-3)
    distance = problem.initial.sensing.at_bearings(problem.difference(problem.table.mean, count))
    assert float(np.sqrt(np.mean(np.sum(distance**2, axis=-1)))) < 1.2e-6


def test_supports_return_to_what_was_put_in(problem, contacts):
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


def test_preload_keeps_its_prior(problem, contacts):
    fit = fit_window(problem, problem.table.mean, float(contacts.max()) + 3e-3, iterations=2)
    place = problem.paths.index("NDE.preload")
    assert fit.x[place] == problem.table.mean[place]
    assert fit.covariance[place, place] == pytest.approx(problem.table.sigma[place] ** 2)


@pytest.mark.slow
def test_search_from_several_starts_over_short_windows(problem, contacts, monkeypatch):
    monkeypatch.setattr("rotordrop.replay.support_and_friction.WINDOWS", (1.75e-3, 3.25e-3, 5.25e-3, 7.25e-3))
    fit = fit_support(problem, problem, float(contacts.max()), starts=3, threads=2)
    assert len(fit.coarse.windows) == 3 and len(fit.search.windows) == 2
    assert fit.search.best.misfit < 1.3
    stiffness = identified_values(problem, fit.search.best.x, fit.covariance)["NDE.support.stiffness"]
    assert stiffness.value == pytest.approx(1e8, rel=0.15)
    assert stiffness.start == pytest.approx(1e8)
    pairs = {(pair.first, pair.second): pair.value for pair in fit.correlations}
    assert pairs["NDE.support.stiffness", "NDE.support.mass"] > 0.5
    ends = [[path.split(".")[0] for path in pair] for pair in pairs]
    assert ends and all(first == second for first, second in ends)


def test_verdicts_name_bounds_and_what_is_not_determined(problem):
    x = problem.table.mean
    covariance = np.diag((0.1 * problem.table.sigma) ** 2)
    covariance[1, 1] = problem.table.sigma[1] ** 2
    active = tuple(k == 0 for k in range(len(x)))
    found = identified_values(problem, x, covariance, active=active)
    paths = problem.paths
    assert found[paths[0]].status == "at its bound"
    assert found[paths[1]].status == "the record does not determine it"
    assert found[paths[2]].status == "determined"
    assert identified_values(problem, x, covariance, given=True)[paths[2]].status == "taken over"


def moved(problem, **values):
    """The guesses of the machine file, which need not be the middle of a range, with other values."""
    theta = np.array([one.begin for one in problem.unknowns])
    for path, value in values.items():
        theta[problem.paths.index(path)] = np.log(value)
    return Trial(theta, problem.initial.mean)


def test_trials_follow_sag_rest_and_ratios(problem, model):
    soft, stiff = (problem.rows(moved(problem, **{"NDE.support.stiffness": k})) for k in (0.5e8, 1e8))
    change = soft[:, L.AIR_GAP] - stiff[:, L.AIR_GAP]
    assert change == pytest.approx([-float(model.load_shares[0]) / 1e8, 0.0], abs=1e-12)
    trial = moved(problem)
    shifted = trial.fall.copy()
    shifted[problem.initial.unknowns.rest] += [0.0, 3e-6, 0.0, -2e-6]
    change = problem.rows(trial._replace(fall=shifted)) - problem.rows(trial)
    assert change[:, L.AIR_GAP] == pytest.approx([-3e-6, 2e-6], abs=1e-15)
    rows = problem.rows(moved(problem, **{"DE.support.stiffness": 3e8}))
    assert rows[1, L.SUPPORT_STIFFNESS_X] == pytest.approx(3e8)
    assert rows[1, L.SUPPORT_STIFFNESS_Y] == pytest.approx(3e8)
    same = np.arange(rows.shape[1]) != L.AIR_GAP
    assert rows[0, same] == pytest.approx(problem.rows(moved(problem))[0, same])
    theta, fall = moved(problem)
    theta[problem.friction] = np.log(0.08)
    rows = problem.rows(Trial(theta, fall))
    assert rows[:, L.FRICTION_DYNAMIC] == pytest.approx([0.08, 0.08])
    assert rows[:, L.FRICTION_STATIC] == pytest.approx([0.104, 0.104])
    rows = problem.rows(moved(problem))
    others = [k for k in range(rows.shape[1]) if k not in (L.AIR_GAP, L.ROTOR_RADIUS)]
    assert rows[:, others] == pytest.approx(model.parameters.bearing[:, others], rel=1e-12)


def test_impossible_values_are_refused_with_the_time(problem):
    rows, p = problem.rows(moved(problem)), problem.model.parameters
    rows[:, L.RACE_MASS] = np.nan
    unbalance = np.stack([p.unbalance_cos, p.unbalance_sin])
    with pytest.raises(IdentificationError, match=r"stopped at .* ms \(outcome \d\); expected"):
        problem.run(rows, problem.time[:200], problem.start_state, unbalance)


def test_a_coarser_basis_starts_from_the_same_motion(problem, evidence):
    coarser = build_drop_model(problem.model.machine, Reduction(modes=4, attachment=True))
    coarse = first_impacts(evidence, coarser, until=0.045)
    assert coarse.model.layout.n_dynamic < problem.model.layout.n_dynamic
    places = []
    for one in (problem, coarse):
        shape, layout = one.model.parameters.bearing_shape, one.model.layout
        places.append([shape @ one.start_state[part] for part in (layout.modal_x, layout.modal_y)])
    assert np.array(places[0]) == pytest.approx(np.array(places[1]), abs=1e-6)


def directions_of(problem):
    return influential_directions(problem.initial, problem.start)


def remaining(problem, directions):
    """A square root of what directions leave of the covariance."""
    return covariance_root(problem.initial.covariance - directions.unknowns @ directions.unknowns.T)


def test_directions_hold_a_part_of_the_covariance(problem):
    scale = np.sqrt(np.diag(problem.initial.covariance))
    of_directions = directions_of(problem).unknowns
    left = problem.initial.covariance - of_directions @ of_directions.T
    least, *_, most = np.linalg.eigvalsh(left / np.outer(scale, scale))
    assert -1e-8 < least < most


def test_a_direction_moves_the_start_as_its_unknowns_do(problem):
    directions, mean = directions_of(problem), problem.initial.mean
    for k in range(directions.unknowns.shape[1]):
        step = 1e-3 * directions.unknowns[:, k]
        (ahead, _, turned), (behind, _, back) = (
            start_state(problem.initial, problem.start, mean + side * step) for side in (1.0, -1.0)
        )
        for found, slope in (
            (directions.states[:, k], 500.0 * (ahead - behind)),
            (directions.unbalances[..., k], 500.0 * (turned - back)),
        ):
            assert np.linalg.norm(found - slope) < 0.02 * np.linalg.norm(slope), k


def test_directions_hold_the_covariance_and_leave_little(problem, monkeypatch):
    directions = directions_of(problem)
    rest = remaining(problem, directions)
    place, shape = problem.model.layout.modal_y, problem.model.parameters.bearing_shape
    followed = shape @ directions.states[place]
    step = 1e-3
    initial, start = problem.initial, problem.start
    left = [start_state(initial, start, initial.mean + step * d)[0] for d in rest.T]
    beyond = shape @ (np.array(left) - problem.start_state).T[place] / step
    # standard deviations: unlike the largest column they do not depend on how the rest is cut into columns
    assert np.all(np.linalg.norm(beyond, axis=1) < 0.05 * np.linalg.norm(followed, axis=1))
    expected, root = directions_of(problem), problem.initial.square_root()
    turn, _ = np.linalg.qr(np.random.default_rng(1).standard_normal(root.shape))
    monkeypatch.setattr(InitialState, "square_root", lambda state: root @ turn)
    found = directions_of(problem)
    scale = np.sqrt(np.diag(problem.initial.covariance))[:, None]
    assert found.unknowns / scale == pytest.approx(expected.unknowns / scale, abs=1e-6)
    reach = np.abs(expected.states).max(axis=0)
    assert found.states / reach == pytest.approx(expected.states / reach, abs=1e-6)


def test_friction_sweep_finds_the_coefficient(problem, contacts):
    swept = sweep_friction(
        problem,
        problem.table.mean,
        float(contacts.min()),
        coefficients=np.array([0.06, 0.08, 0.1, 0.12, 0.14]),
        draws=[problem.table.mean + side * 1e-2 * problem.table.sigma for side in (1.0, -1.0)],
    )
    assert swept.value.value == pytest.approx(0.1, abs=0.004)
    assert swept.value.status == "determined"
    assert int(np.argmin(swept.disagreement)) == 2
    assert len(swept.best) == 3
    assert swept.window[1] - swept.window[0] == pytest.approx(33e-3)


def test_friction_beyond_the_sweep_is_at_its_bound(problem, contacts):
    swept = sweep_friction(
        problem, problem.table.mean, float(contacts.min()), coefficients=np.array([0.13, 0.15, 0.17])
    )
    assert swept.value.status == "at its bound"


def test_refit_takes_the_friction_of_the_sweep(problem, contacts):
    start = fit_window(problem, problem.table.mean, float(contacts.max()) + 3e-3, iterations=1)
    swept = sweep_friction(
        problem, start.x, float(contacts.min()), coefficients=np.array([0.09, 0.1, 0.11]), draws=[start.x]
    )
    known, x, covariance = refit_with_friction(problem, start, swept.value, threads=2)
    place = known.friction
    error = (swept.value.standard_error or 0.0) / swept.value.value
    assert known.table.mean[place] == pytest.approx(np.log(swept.value.value))
    assert x[place] == pytest.approx(np.log(swept.value.value), abs=2.0 * error)
    assert covariance.shape == (len(x), len(x))


def test_a_found_parameter_lies_in_the_middle_of_its_interval():
    unknowns = all_unknowns(build_drop_model(example_machine("lp400"), "quick"))
    low, high = (np.array([unknown.bounds[side] for unknown in unknowns]) for side in (0, 1))
    problem: Any = SimpleNamespace(unknowns=unknowns, table=SimpleNamespace(lower=low, upper=high))
    mean = np.array([unknown.mean for unknown in unknowns])
    error = np.array([0.1 * unknown.sigma for unknown in unknowns])
    found = identified_values(problem, mean, np.diag(error**2))
    for unknown, middle, one in zip(unknowns, mean, error, strict=True):
        value = found[unknown.path]
        assert value.value == unknown.value_of(middle)
        limits = [unknown.value_of(middle + side * NINETY * one) for side in (-1.0, 1.0)]
        assert value.interval_90 == pytest.approx(tuple(limits), rel=1e-9), unknown.path
        assert limits[0] < value.value < limits[1]
        bounds = tuple(unknown.value_of(bound) for bound in unknown.bounds)
        assert value.bounds == pytest.approx(bounds, nan_ok=True)
        assert value.status == "determined"
    given = identified_values(problem, mean, np.diag(error**2), given=True)
    assert {value.status for value in given.values()} == {"taken over"}
