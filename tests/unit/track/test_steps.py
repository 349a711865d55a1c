"""What is read from a filter pass: levels, deviations, the likelihood of a drop that was lost."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.track.consistency import CORRELATION_LIMIT, innovation_checks, nuisance_check
from rotordrop.track.forces import displacements_of
from rotordrop.track.problem import WATCHED, first_level
from rotordrop.track.smoother import Forward


def test_the_first_level_of_a_channel_is_the_mean_of_what_it_read() -> None:
    time = 5e-5 * np.arange(40)
    readings = np.full((40, 3), 7.0)
    readings[:9] = [[1.0, 2.0, 3.0]]
    readings[:3] += 0.5
    assert first_level(time, readings, 0.49e-3)[1] == pytest.approx(readings[time < 0.49e-3, 1].mean())
    readings[:3, 0] = np.nan
    readings[:, 2] = np.nan
    assert first_level(time, readings, 0.49e-3)[0] == pytest.approx(readings[3:10, 0].mean())
    assert np.isnan(first_level(time, readings, 0.49e-3)[2])


def test_a_displacement_is_as_uncertain_as_its_covariance_says() -> None:
    dice = np.random.default_rng(2)
    roots = dice.normal(size=(6, 2 * WATCHED, 2 * WATCHED))
    watched = roots @ roots.transpose(0, 2, 1)
    rows = {name: dice.normal(size=(WATCHED, 4)) for name in ("NDE", "DE")}
    problem: Any = SimpleNamespace(
        model=SimpleNamespace(bearing_names=("NDE", "DE")), watched_rows=lambda name: rows[name]
    )
    smoothed: Any = SimpleNamespace(means=dice.normal(size=(6, 4)), watched=watched)
    values, sigma = displacements_of(problem, smoothed)
    for b, name in enumerate(rows):
        for axis in range(2):
            assert values[:, b, axis] == pytest.approx(smoothed.means @ rows[name][3 + axis])
            place = WATCHED * b + 3 + axis
            assert sigma[:, b, axis] ** 2 == pytest.approx(watched[:, place, place])
    smoothed.watched = -watched
    assert np.all(displacements_of(problem, smoothed)[1] == 0.0)  # below zero by rounding only


@pytest.mark.parametrize("red", [0, 1, 2])
def test_the_channel_whose_innovations_follow_each_other_is_named(red: int) -> None:
    dice = np.random.default_rng(4)
    noise = dice.standard_normal((4000, 4))
    for k in range(1, 4000):
        noise[k, red] = 0.6 * noise[k - 1, red] + 0.8 * noise[k, red]
    smoothed: Any = SimpleNamespace(
        filtered=SimpleNamespace(
            done=4000, innovations=2e-7 * noise, innovation_variances=np.full((4000, 4), 4e-14)
        )
    )
    names = ("A", "B", "C")
    sensors = tuple(SimpleNamespace(name=name) for name in names)
    problem: Any = SimpleNamespace(model=SimpleNamespace(machine=SimpleNamespace(sensors=sensors)))
    size, whiteness = innovation_checks(problem, smoothed)
    assert size.passed
    assert not whiteness.passed and CORRELATION_LIMIT < 0.5
    assert re.search(rf"channel {names[red]} correlate by 0\.(5|6)", whiteness.message)


def test_a_filter_that_lost_the_drop_is_judged_by_what_it_followed() -> None:
    """Sixty of a hundred samples: the sums over these, whatever the arrays hold behind them."""
    dice = np.random.default_rng(5)
    innovations, variances = dice.normal(size=(100, 3)), dice.uniform(0.5, 2.0, (100, 3))
    innovations[10, 1] = np.nan
    nothing = np.zeros(0)
    made: Any = Forward(
        done=60,
        impulse=1e-3,
        means=nothing,
        innovations=innovations,
        innovation_variances=variances,
        reached=nothing,
        course=nothing,  # type: ignore[arg-type]
        starts=(),
    )
    terms = [
        (e**2 / s, np.log(s))
        for e, s in zip(innovations[:60].ravel(), variances[:60].ravel(), strict=True)
        if np.isfinite(e)
    ]
    squares, logs = np.array(terms).T
    assert made.nis == pytest.approx(squares.mean())
    assert made.negative_log_likelihood == pytest.approx(0.5 * (squares.sum() + logs.sum()))


@pytest.mark.parametrize("path", ["unbalance.1.sine", "remanence.time_constant", "speed.aero_time_constant"])
@pytest.mark.parametrize(("sigmas", "white"), [(1.0, True), (9.0, True), (9.0, False)])
def test_what_is_unusual_in_one_drop_is_a_note_while_its_innovations_are_white(
    path: str, sigmas: float, white: bool
) -> None:
    """Unbalance beyond its grade, long remanence, strong drag are news of the machine, no faults of a fit."""
    unknowns = all_unknowns(build_drop_model(example_machine("lp400"), "quick"))
    theta = np.array([u.mean + (sigmas * u.sigma if u.path == path else 0.0) for u in unknowns])
    problem: Any = SimpleNamespace(unknowns=unknowns, parameter_slice=slice(0, len(unknowns)))
    smoothed: Any = SimpleNamespace(means=theta[None], filtered=SimpleNamespace(parameter_sample=0))
    found = nuisance_check(problem, smoothed, white)
    assert found.passed is (white or sigmas < 5.0)
    assert found.path == path
    assert found.message.startswith(f"departs by {sigmas:.1f} prior standard deviations")
    assert bool(found.note) is (white and sigmas > 5.0)
    assert not found.note or found.note == f"{found.message}; the readings are followed all the same"
