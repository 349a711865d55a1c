"""Steps of a fit: what is read from a pass, damping, noise, scaling; a pass as plain Python."""

import math
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine

from rotordrop import build_drop_model
from rotordrop.track import calibration, noise_size
from rotordrop.track._filter import is_plausible
from rotordrop.track.calibration import (
    BLIND_SCHEDULE,
    MOST_REPEATS,
    QUICK_SCHEDULE,
    Stage,
    converged,
    stage_settings,
    track,
    window_end,
)
from rotordrop.track.forces import displacements_of, force_history
from rotordrop.track.noise_size import LARGEST, SMALLEST, forward_passes, likeliest_noise, likelihood_of
from rotordrop.track.prior import fall_time
from rotordrop.track.problem import WATCHED, first_level
from rotordrop.track.smoother import PassSettings, forward, smooth, smooth_means
from rotordrop.twin.problems import COARSE_BASIS


def test_the_first_level_of_a_channel_is_the_mean_of_what_it_read():
    time = 5e-5 * np.arange(40)
    readings = np.full((40, 3), 7.0)
    readings[:9] = [[1.0, 2.0, 3.0]]
    readings[:3] += 0.5
    assert first_level(time, readings, 0.49e-3)[1] == pytest.approx(readings[time < 0.49e-3, 1].mean())
    readings[:3, 0] = np.nan
    readings[:, 2] = np.nan
    assert first_level(time, readings, 0.49e-3)[0] == pytest.approx(readings[3:10, 0].mean())
    assert np.isnan(first_level(time, readings, 0.49e-3)[2])


def test_a_displacement_is_as_uncertain_as_its_covariance_says(impacts, impacts_smoothed):
    roots = np.random.default_rng(2).normal(size=(len(impacts_smoothed.means), 2 * WATCHED, 2 * WATCHED))
    smoothed = replace(impacts_smoothed, watched=roots @ roots.transpose(0, 2, 1))
    values, sigma = displacements_of(impacts, smoothed)
    for b, name in enumerate(impacts.model.bearing_names):
        for axis, place in enumerate(WATCHED * b + 3 + np.arange(2)):
            row = impacts.watched_rows(name)[3 + axis]
            assert values[:, b, axis] == pytest.approx(smoothed.means @ row)
            assert sigma[:, b, axis] ** 2 == pytest.approx(smoothed.watched[:, place, place])
    below = replace(smoothed, watched=-smoothed.watched)
    assert np.all(displacements_of(impacts, below)[1] == 0.0)  # below zero by rounding only


def test_damping_holds_the_parameters_to_the_pass_before(impacts):
    stage = Stage(until=0.012, force=0.35, share=0.03, passes=2)
    sigma = np.array([unknown.sigma for unknown in impacts.unknowns])
    start = impacts.start[impacts.parameter_slice]

    def steps(damping):
        fit = track([impacts], (replace(stage, damping=damping),))
        found = fit.smoothed[0]
        return np.abs(found.means[found.filtered.parameter_sample][impacts.parameter_slice] - start) / sigma

    constant = impacts.targets.drift == 0.0
    free, held, between = (steps(damping)[constant] for damping in (0.0, 1e8, 1.0))
    assert constant.sum() > 5 and free.max() > 0.3
    assert held.max() < 1e-3
    assert between[np.argmax(free)] < free.max()


@pytest.mark.parametrize(
    ("scores", "passes", "lost"),
    [
        ([-100.0, -120.0, -121.0], 3, None),  # it has come to rest
        ([-100.0, -60.0, -150.0, -154.0], 4, None),  # a fall is no rest
        ([10.0 * (-1.0) ** k for k in range(9)], MOST_REPEATS, None),  # it swings for ever
        ([-100.0, -50.0, -20.0, -20.0], 4, 1),  # a pass that lost a drop gives no middle to begin at
    ],
)
def test_passes_go_on_while_the_likelihood_changes(monkeypatch, scores, passes, lost):
    seen: list[Any] = []

    def one_pass(_problems, _stages, *, references, noise_factor, progress, **_):
        ends = (3, 2 if len(seen) == lost else 3)
        seen.append((references[1][0, 0], len(references[1]), noise_factor))
        progress("fitting", 0.0)
        ended = [np.full((end, 1), float(len(seen))) for end in ends]
        return SimpleNamespace(negative_log_likelihood=scores[len(seen) - 1], trajectories=ended)

    monkeypatch.setattr(calibration, "track", one_pass)
    stage = Stage(until=0.2, force=0.07, share=0.01, passes=2)
    shares: list[float] = []
    begun = [np.zeros((4, 1))] * 2
    converged([], stage, begun, noise_factor=0.5, progress=lambda _, share: shares.append(share))
    place, length, begins = 0.0, 4, []
    for k in range(passes):
        begins.append((place, length, 0.5))
        before, length = length, 2 if k == lost else 3
        fell = k > 0 and scores[k] > scores[k - 1] and length == before
        place = 0.5 * (place + k + 1.0) if fell else k + 1.0
    assert seen == begins
    assert shares == [k / MOST_REPEATS for k in range(passes)]


STAGE = Stage(until=0.012, force=0.07, share=0.01, passes=1)


def pass_of(value, done=10):
    """A pass over ten samples with such a negative log likelihood."""
    return SimpleNamespace(done=done, means=range(10), negative_log_likelihood=value)


def parabola(likeliest, scale=30.0):
    """Passes of two drops whose improbability is lowest there, a parabola in the logarithm."""
    return lambda factor: [pass_of(share * scale * math.log(factor / likeliest) ** 2) for share in (0.3, 0.7)]


@pytest.mark.parametrize(
    ("passes", "needed", "size"),
    [
        *((parabola(one), 1.0, one) for one in (0.125, 0.3, 0.9, 1.1, 2.9, 30.0)),
        (parabola(17.0), 8.0, 17.0),
        (parabola(1e-4, 1.0), 1.0, SMALLEST),
        (parabola(1e4, 1.0), 1.0, LARGEST),
        (parabola(2.0, 1.0), 8.0, 8.0),  # else a drop that the usual impulses lose would be called followed
        (lambda factor: [pass_of(factor, 10 if factor >= 1.0 else 9)], 1.0, 1.0),  # none that loses a drop
        (lambda factor: [pass_of(factor, 9)], 1.0, 1.0),  # where every size loses it
    ],
)
def test_the_size_is_the_likeliest_within_its_limits_that_follows_the_drops(
    passes, needed, size, monkeypatch
):
    monkeypatch.setattr(noise_size, "forward_passes", lambda _problems, _references, _stage, f: passes(f))
    # two drops whose last passes needed so much larger impulses
    drops = [SimpleNamespace(means=np.zeros((10, 1)))] * 2
    fit = SimpleNamespace(noise_factors=(1.0, needed), problems=drops, trajectories=())
    assert likeliest_noise(fit, STAGE) == pytest.approx(size, rel=1e-9)


def test_larger_impulses_make_the_readings_say_less(impacts):
    fit = track([impacts], (STAGE,))
    found = likeliest_noise(fit, STAGE)
    best, other = (
        sum(map(likelihood_of, forward_passes(fit.problems, fit.trajectories, STAGE, factor)))
        for factor in (found, 4.0 * found)
    )
    assert best < other + 1.0, "the parabola is no exact one"
    means = fit.smoothed[0].means.copy()
    spread = {}
    for factor in (found, 16.0 * found):
        again = track([impacts], (STAGE,), references=fit.trajectories, noise_factor=factor)
        spread[factor] = again.smoothed[0].watched[:, 0, 0].copy()
        assert again.smoothed[0].means.shape == means.shape
        assert not any(again.diverged)
    assert np.all(spread[16.0 * found][5:] > spread[found][5:])


LAST = QUICK_SCHEDULE[-1]


def of_mass(flight, mass):
    return replace(flight, model=build_drop_model(scaled_machine(mass), COARSE_BASIS))


def test_on_the_machine_of_the_record_the_unknown_impulses_are_as_they_were(flight):
    settings = stage_settings(flight, LAST)
    assert settings.impulse == pytest.approx(1e-3, rel=0.03)
    assert settings.share == pytest.approx(0.01, rel=0.01)
    assert settings.learning_end == pytest.approx(0.05, rel=0.01)


@pytest.mark.parametrize("mass", [5.0, 130.0, 6000.0])
def test_unknown_impulses_of_a_fall_are_the_same_part_of_its_momentum(flight, mass):
    """A random walk: over the time of the fall it spreads by 0.6 per cent of the momentum of the fall."""

    def part(problem):
        momentum = float(np.mean(problem.model.load_shares)) * problem.fall_time
        return stage_settings(problem, LAST).impulse * math.sqrt(problem.fall_time / 50e-6) / momentum

    assert part(of_mass(flight, mass)) == pytest.approx(part(flight), rel=1e-9)


@pytest.mark.parametrize("rate", [5e3, 20e3, 100e3])
def test_noise_gathers_with_time_and_not_with_samples(rate):
    usual, numbers = PassSettings().for_sampling(50e-6), PassSettings().for_sampling(1.0 / rate)

    def gathered(settings):
        samples = 1e-3 / settings.dt
        share = settings.share * 1000.0 * settings.dt
        return [samples * x**2 for x in (settings.impulse, share, settings.spin_noise, settings.speed_noise)]

    assert gathered(numbers) == pytest.approx(gathered(usual), rel=1e-9)


def test_windows_follow_the_first_contact_and_last_as_long_as_the_rebounds():
    fall = math.sqrt(2.0 * 0.25e-3 / 9.81)
    usual = [stage.until for stage in BLIND_SCHEDULE]
    assert [window_end(stage, 0.0075, fall) for stage in BLIND_SCHEDULE] == pytest.approx(usual)
    slow = [window_end(stage, 0.015, 2.0 * fall) for stage in BLIND_SCHEDULE]
    assert slow == pytest.approx([2.0 * until for until in usual])
    assert window_end(LAST, 0.015, 2.0 * fall) == LAST.until


def test_a_fall_takes_the_time_of_its_gap(flight):
    assert fall_time(flight.model.machine) == pytest.approx(7.14e-3, rel=1e-3)
    assert of_mass(flight, 6000.0).fall_time > 1.4 * flight.fall_time


@pytest.mark.parametrize("mass", [5.0, 6000.0])
def test_a_filter_has_lost_a_drop_by_the_gap_of_its_machine(flight, mass):
    problem = of_mass(flight, mass)
    gap = float(problem.model.machine.touchdown_bearings[0].air_gap)
    p, mean = problem.model.parameters, np.zeros(problem.n_dynamic)
    race = problem.model.layout.race.start
    mean[race] = 3.9 * gap
    assert is_plausible(mean, p)
    mean[race] = 4.1 * gap
    assert not is_plausible(mean, p)


SAMPLES = 3
SCRIPT = """
import pickle, sys
from tests.unit.track.test_steps import whole_pass
with open(sys.argv[1], "rb") as file:
    problem = pickle.load(file)
with open(sys.argv[2], "wb") as file:
    pickle.dump(whole_pass(problem), file)
"""


def whole_pass(problem):
    """What filter, smoother and forces make of a few samples."""
    filtered = forward(problem, PassSettings(impulse=3e-3, share=0.03))
    again = forward(problem, PassSettings(impulse=3e-3, share=0.03), reference=filtered.means)
    smoothed = smooth(again, watched=problem.watched, kept=(0, SAMPLES - 1))
    history = force_history(problem, smoothed)
    return {
        "means": smoothed.means,
        "alone": smooth_means(again)[0],
        "watched": smoothed.watched,
        "information": smoothed.information,
    } | {name: getattr(history, name) for name in ("force", "magnitude_sigma", "stress", "contact_force")}


def in_contact(problem, filtered):
    """The few samples after the first contact, with the filtered estimate before them as prior."""
    layout, shape = problem.model.layout, problem.model.parameters.bearing_shape
    means = filtered.means[: filtered.done]
    across = [means[:, part] @ shape.T for part in (layout.modal_x, layout.modal_y)]
    radius = np.hypot(*across)
    gaps = [k for k, unknown in enumerate(problem.unknowns) if unknown.path.endswith(".air_gap")]
    touching = np.any(radius > means[:, problem.n_dynamic + np.array(gaps)] + 2e-6, axis=1)
    first = int(np.argmax(touching))
    assert touching[first]
    chosen = slice(first, first + SAMPLES)
    return replace(
        problem,
        unknowns=tuple(replace(unknown, published=None) for unknown in problem.unknowns),  # cannot be pickled
        time=problem.time[chosen],
        readings=problem.readings[chosen],
        speed=problem.speed[chosen],
        mean=means[first],
        covariance=filtered.covariance(first),
    )


@pytest.mark.slow
def test_a_pass_over_a_contact_is_the_same_interpreted(impacts, impacts_filtered, tmp_path):
    """Compiled code reads and writes beyond the end of an array without a word; plain Python does not."""
    problem = in_contact(impacts, impacts_filtered)
    (tmp_path / "problem").write_bytes(pickle.dumps(problem))
    root = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "problem"), str(tmp_path / "result")],
        cwd=root,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    interpreted, compiled = pickle.loads((tmp_path / "result").read_bytes()), whole_pass(problem)
    assert np.max(compiled["contact_force"]) > 10.0
    for name, values in compiled.items():
        size = np.max(np.abs(values))
        assert interpreted[name] == pytest.approx(values, rel=1e-5, abs=1e-6 * size), name


def test_between_samples_a_force_is_that_of_the_model(impacts, impacts_smoothed):
    """With every fourth sample impacts have nearly the force they have with all: straight lines do not."""
    every, shape = 4, (len(impacts_smoothed.means), len(impacts.watched), len(impacts.watched))
    dense = replace(impacts_smoothed, watched=np.zeros(shape))
    settings = dense.filtered.settings._replace(substeps=every * dense.filtered.settings.substeps)
    filtered, means = replace(dense.filtered, settings=settings), dense.means[::every].copy()
    thinned = replace(dense, filtered=filtered, means=means, watched=dense.watched[::every])
    sparse = force_history(replace(impacts, time=impacts.time[::every].copy()), thinned)
    whole = force_history(impacts, dense).magnitude[: len(sparse.time)]
    at = slice(None, None, sparse.substeps)
    straight = np.stack([np.interp(sparse.time, sparse.time[at], one[at]) for one in whole.T], axis=1)
    errors = [np.max(np.abs(one - whole)) / np.max(whole) for one in (sparse.magnitude, straight)]
    assert errors[0] < min(0.1, 0.6 * errors[1])
