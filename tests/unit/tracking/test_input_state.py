"""Forces from the rotor's own motion, for a rotor pushed by known pulses without any contact law."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.model import layout as L
from rotordrop.model.parameters import DropModel
from rotordrop.tracking import _propagation as P
from rotordrop.tracking.forces import bearing_values, stress_at_force
from rotordrop.tracking.input_state import GATE_MARGIN, input_state_estimate, lent_by_record, lent_by_twin
from rotordrop.tracking.problem import DropProblem, private_copy
from rotordrop.tracking.smoother import Smoothed

DT = 5e-5
COUNT = 800
PULSES = (  # bearing, direction (x, y), middle [s], duration [s], peak [N]
    (0, (0.0, -1.0), 8.0e-3, 2.0e-3, 4000.0),
    (1, (0.6, -0.8), 15.0e-3, 1.5e-3, 2500.0),
    (0, (-0.6, -0.8), 24.0e-3, 2.5e-3, 3000.0),
)


def true_force(t: float, n_b: int) -> np.ndarray:
    """Force of the rotor on the races [N], shape (B, 2): half sines squared."""
    force = np.zeros((n_b, 2))
    for b, direction, middle, duration, peak in PULSES:
        if abs(t - middle) < 0.5 * duration:
            force[b] += peak * np.cos(np.pi * (t - middle) / duration) ** 2 * np.array(direction)
    return force


def pushed_rotor(model: DropModel, speed: float, start: np.ndarray) -> np.ndarray:
    """Modal amplitudes and velocities, shape (N, 4m), of the rotor under the pulses."""
    p = model.parameters
    m, shapes = len(p.eigenvalue), p.bearing_shape

    def derivative(t, y):
        x, v = y[: 2 * m].reshape(2, m), y[2 * m :].reshape(2, m)
        push = -true_force(t, len(shapes)).T @ shapes
        push[1] += p.gravity
        turn = speed * np.stack([-p.polar @ v[1], p.polar @ v[0]])
        return np.concatenate([v.ravel(), (push + turn - p.eigenvalue * x - p.damping * v).ravel()])

    states, y, fine = [start], start.copy(), 8
    h = DT / fine
    for i in range((COUNT - 1) * fine):
        t = i * h
        k1 = derivative(t, y)
        k2 = derivative(t + 0.5 * h, y + 0.5 * h * k1)
        k3 = derivative(t + 0.5 * h, y + 0.5 * h * k2)
        k4 = derivative(t + h, y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        if (i + 1) % fine == 0:
            states.append(y)
    return np.array(states)


@pytest.fixture(scope="module")
def pushed(flight: DropProblem) -> tuple[DropProblem, Smoothed, np.ndarray]:
    """Readings of the pushed rotor with noise, a trajectory that opens the gate at the pulses, true force."""
    model, layout = flight.model, flight.model.layout
    m, n_b = layout.n_modes, layout.n_bearings
    start = np.zeros(4 * m)
    start[: 2 * m] = flight.mean[: 2 * m]
    states = pushed_rotor(model, float(flight.mean[layout.rotor_speed]), start)
    time = DT * np.arange(COUNT)
    noise = np.sqrt(flight.variances) * np.random.default_rng(3).standard_normal((COUNT, flight.n_channels))
    clean = states[:, : 2 * m] @ flight.sensor_rows[:, : 2 * m].T
    gain, offset = np.array([1.01, 0.99, 1.0, 1.005]), np.array([3e-6, -2e-6, 0.0, 1e-6])
    means = np.zeros((COUNT, len(flight.mean)))
    means[:] = flight.mean
    means[:, : 2 * m] = states[:, : 2 * m]
    first = flight.n_dynamic + len(flight.unknowns)
    means[:, first : first + 8] = np.concatenate([gain - 1.0, offset])
    force = np.array([true_force(t, n_b) for t in time])
    at_bearings = np.stack(
        [states[:, : 2 * m].reshape(-1, 2, m) @ s for s in model.parameters.bearing_shape], 1
    )
    gaps = np.array(
        [means[0, flight.n_dynamic + k] for k, u in enumerate(flight.unknowns) if u.path.endswith("air_gap")]
    )
    touching = np.abs(force).max(axis=2) > 0.0
    inside = np.where(touching, gaps, gaps - 2.0 * GATE_MARGIN)  # as far from the race as the gate wants it
    race = at_bearings.copy()
    race[..., 1] += inside
    means[:, layout.race] = race.reshape(COUNT, -1)
    problem = replace(
        flight, time=time, readings=gain * (clean + noise) + offset, speed=np.full(COUNT, np.nan)
    )
    empty = np.zeros((0, 0))
    smoothed = Smoothed(
        filtered=SimpleNamespace(parameter_sample=200),
        means=means,
        watched=empty,
        kept=np.zeros(0, dtype=np.int64),
        information=empty,
        score_0=empty,
        information_0=empty,  # type: ignore[arg-type]
    )
    return problem, smoothed, force


def peaks_of(force: np.ndarray) -> list[np.ndarray]:
    """Largest force vector within every pulse."""
    found = []
    for b, _, middle, duration, _ in PULSES:
        near = slice(round((middle - 0.5 * duration) / DT), round((middle + 0.5 * duration) / DT) + 1)
        size = np.hypot(*force[near, b].T)
        found.append(force[near, b][np.argmax(size)])
    return found


def test_the_peaks_of_known_pulses_are_found_back(pushed):
    problem, smoothed, force = pushed
    found = input_state_estimate(problem, lent_by_twin(problem, smoothed))
    for estimate, pulse in zip(peaks_of(found.force), PULSES, strict=True):
        true = pulse[4] * np.array(pulse[1])
        assert np.hypot(*(estimate - true)) < 0.2 * pulse[4]
    np.testing.assert_allclose(found.peak, np.hypot(*force.transpose(2, 0, 1)).max(axis=0), rtol=0.12)
    np.testing.assert_array_equal(found.magnitude.max(axis=0), found.peak)
    assert np.all(np.isnan(found.mean_late))  # the record ends before


def test_the_peak_stress_is_that_of_the_bearing_under_the_peak_force(pushed):
    """The twin's own force at a deflection leads back to the twin's own stress there."""
    problem, smoothed, _ = pushed
    theta = smoothed.means[0][problem.parameter_slice]
    p = private_copy(problem.model.parameters)
    P.apply_parameters(theta.copy(), problem.targets, p)
    out = np.empty(4)
    for b, deflection in ((0, 12e-6), (1, 25e-6)):
        work = np.empty((2, p.balls.shape[2]))
        bearing_values(0.0, -deflection, p.bearing[b, L.AXIAL_OFFSET], b, p, work, out)
        found = stress_at_force(problem, theta, b, np.array([0.0, -out[2]]))
        assert found == pytest.approx(out[3], rel=1e-6)
    estimate = input_state_estimate(problem, lent_by_twin(problem, smoothed))
    for b in range(2):
        worst = estimate.force[estimate.magnitude[:, b].argmax(), b]
        assert estimate.peak_stress[b] == pytest.approx(stress_at_force(problem, theta, b, worst), rel=1e-9)
        for i in range(0, COUNT, 50):
            there = stress_at_force(problem, theta, b, estimate.force[i, b])
            assert estimate.stress[i, b] == pytest.approx(there, rel=0.01)


def test_without_the_twin_the_record_itself_opens_the_gate(pushed):
    """Nothing of the twin enters: gains within 1 per cent, gaps within their prior, and the same peaks."""
    problem, smoothed, force = pushed
    lent = lent_by_record(problem)
    opened = replace(lent, reach=np.zeros(2))  # this rotor is pushed where no race is
    found = input_state_estimate(problem, opened)
    np.testing.assert_allclose(found.peak, np.hypot(*force.transpose(2, 0, 1)).max(axis=0), rtol=0.15)
    lost = replace(smoothed, means=smoothed.means * np.nan)
    assert np.all(np.isnan(lent_by_twin(problem, lost).radius)) and np.all(np.isfinite(lent.reach))


def test_a_force_that_no_bearing_carries_is_refused(pushed):
    problem, smoothed, _ = pushed
    theta = smoothed.means[0][problem.parameter_slice]
    with pytest.raises(IdentificationError, match=r"NDE: a bearing force of 1000000000000 N was found"):
        stress_at_force(problem, theta, 0, np.array([0.0, -1e12]))


def test_impulses_are_those_of_the_pulses(pushed):
    problem, smoothed, force = pushed
    found = input_state_estimate(problem, lent_by_twin(problem, smoothed))
    np.testing.assert_allclose(
        DT * found.force.sum(axis=0), DT * force.sum(axis=0), atol=0.05 * DT * np.abs(force).sum(axis=0).max()
    )


def test_in_flight_the_force_is_held_at_zero(pushed):
    problem, smoothed, force = pushed
    found = input_state_estimate(problem, lent_by_twin(problem, smoothed))
    flying = np.abs(force).max(axis=2) == 0.0
    assert np.count_nonzero(flying) > 1000
    assert found.magnitude[flying].max() < 0.05 * found.peak.max()


def test_missing_readings_are_bridged(pushed):
    problem, smoothed, _ = pushed
    readings = problem.readings.copy()
    readings[400:405] = np.nan
    readings[100:130, 2] = np.nan
    worse = replace(problem, readings=readings)
    found = input_state_estimate(worse, lent_by_twin(worse, smoothed))
    assert np.all(np.isfinite(found.force))
    whole = input_state_estimate(problem, lent_by_twin(problem, smoothed))
    np.testing.assert_allclose(found.peak, whole.peak, rtol=0.05)
