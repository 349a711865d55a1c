"""Closed-form impacts against integrated contact kernels, and their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.reference import impact

from rotordrop.physics.contact import contact_energy, contact_force, contact_law


def hunt_crossley_force(delta: float, rate: float, K: float, n: float, lam: float) -> float:
    """Normal force [N] of the contact kernel, none without indentation."""
    return contact_force(contact_law(K, n, lam), delta, rate)[0] if delta > 0.0 else 0.0


def strike(m: float, K: float, n: float, lam: float, v_0: float) -> tuple[float, float, float]:
    """Contact time, rebound speed and peak force of one integrated impact of the contact kernel."""

    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -hunt_crossley_force(state[0], state[1], K, n, lam) / m]

    def separation(t: float, state: np.ndarray) -> float:
        return state[0] if t > 0 else 1.0

    separation.terminal = True  # type: ignore[attr-defined]
    separation.direction = -1  # type: ignore[attr-defined]
    delta = impact.elastic_indentation(m, K, n, v_0)
    solution = solve_ivp(
        motion,
        (0, 6 * impact.elastic_contact_time(m, K, n, v_0)),
        [0.0, v_0],
        events=separation,
        rtol=1e-11,
        atol=[1e-12 * delta, 1e-12 * v_0],
        method="DOP853",
    )
    forces = [hunt_crossley_force(*state, K, n, lam) for state in solution.y.T]
    return solution.t_events[0][0], -solution.y_events[0][0][1], max(forces)


@pytest.mark.parametrize("n", [1.0, 10 / 9, 1.5])
@pytest.mark.parametrize(("m", "K"), [(1.0, 1e8), (20.0, 8.3e8)])
def test_restitution_depends_on_lambda_times_speed_only(n: float, m: float, K: float) -> None:
    _, rebound, _ = strike(m, K, n, 0.8, 0.5)
    assert rebound / 0.5 == pytest.approx(impact.restitution(0.8, 0.5), abs=1e-8)
    assert impact.restitution(0.8, 0.5) == impact.restitution(0.4, 1.0)


def test_restitution_starts_like_one_minus_lambda_v_and_never_turns_negative() -> None:
    assert impact.restitution(0.0, 1.0) == 1.0
    assert 1 - impact.restitution(1e-3, 1.0) == pytest.approx(1e-3, rel=1e-3)
    assert 1 - impact.restitution(1e-9, 1.0) == pytest.approx(1e-9, rel=1e-6)
    e = [impact.restitution(lam, 1.0) for lam in (0.01, 0.1, 1.0, 10.0, 1e3)]
    assert np.all(np.diff(e) < 0)
    assert 0 < e[-1] < 1e-3


def test_restitution_is_continuous_where_the_series_takes_over() -> None:
    below, above = impact.restitution(1e-5 / 1.5 * 0.999, 1.0), impact.restitution(1e-5 / 1.5 * 1.001, 1.0)
    assert above - below == pytest.approx(-2 / 3 * 1e-5 * 0.002, rel=0.05)


@pytest.mark.parametrize("e", [0.3, 0.7, 0.9942])
def test_damping_for_a_wanted_restitution_delivers_it(e: float) -> None:
    lam = impact.damping_for_restitution(e, 0.0734)
    _, rebound, _ = strike(1.0, 1e8, 10 / 9, lam, 0.0734)
    assert rebound / 0.0734 == pytest.approx(e, abs=1e-8)


@pytest.mark.parametrize("n", [1.0, 10 / 9, 1.5, 2.0])
def test_elastic_impact_agrees_with_the_kernel(n: float) -> None:
    m, K, v_0 = 3.0, 2e8, 0.2
    duration, rebound, peak = strike(m, K, n, 0.0, v_0)
    assert duration == pytest.approx(impact.elastic_contact_time(m, K, n, v_0), rel=1e-7)
    assert rebound == pytest.approx(v_0, rel=1e-9)
    assert peak == pytest.approx(impact.elastic_peak_force(m, K, n, v_0), rel=0.01)
    stored = contact_energy(contact_law(K, n, 0.0), impact.elastic_indentation(m, K, n, v_0))
    assert stored == pytest.approx(0.5 * m * v_0**2, rel=1e-12)


def test_bounces_lose_e_in_time_and_e_squared_in_height() -> None:
    times = impact.bounce_times(1e-4, 0.8, 40)
    flights = np.diff(times)
    np.testing.assert_allclose(flights[1:] / flights[:-1], 0.8, rtol=1e-9)
    np.testing.assert_allclose(impact.bounce_heights(1e-4, 0.8, 39), 9.81 * (flights / 2) ** 2 / 2, rtol=1e-9)
    assert times[0] == impact.fall_time(1e-4)
    assert impact.bounce_times(1e-4, 0.8, 400)[-1] == pytest.approx(impact.time_to_rest(1e-4, 0.8), rel=1e-12)


@pytest.mark.parametrize("v_0", [0.005, 0.0734, 1.0])
def test_gravity_lengthens_the_contact_with_a_spring(v_0: float) -> None:
    m, K, g = 17.8, 7.4e7, 9.81
    omega = math.sqrt(K / m)

    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], g - hunt_crossley_force(state[0], state[1], K, 1.0, 0.0) / m]

    def separation(t: float, state: np.ndarray) -> float:
        return state[0] if t > 0 else 1.0

    separation.terminal = True  # type: ignore[attr-defined]
    separation.direction = -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        motion, (0, 7 / omega), [0.0, v_0], events=separation, rtol=1e-11, atol=1e-14, max_step=0.01 / omega
    )
    T = impact.spring_contact_time(omega, v_0)
    assert solution.t_events[0][0] == pytest.approx(T, rel=1e-6)
    assert K * solution.y[0].max() == pytest.approx(impact.spring_peak_force(m, omega, v_0), rel=1e-4)
    assert impact.contact_time_stiffness(m, T, v_0) == pytest.approx(K, rel=1e-12)
    assert impact.half_period_stiffness(m, T) < K


def test_half_period_is_right_without_gravity_only() -> None:
    T = impact.spring_contact_time(2000.0, 1e9)
    assert impact.half_period_stiffness(10.0, T) == pytest.approx(10.0 * 2000.0**2, rel=1e-6)
