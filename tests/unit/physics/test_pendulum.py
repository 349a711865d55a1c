"""Pendulum motion against equations of motion: of the pendulum alone and of the rotor on a race."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.reference import closed_forms

from rotordrop.physics import pendulum

G = 9.81


@pytest.mark.parametrize("amplitude", [0.01, 0.8, 2.5])
def test_period_agrees_with_the_integrated_swing(amplitude: float) -> None:
    length = 2.8e-4

    def swing(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -G / length * math.sin(state[0])]

    def bottom(_: float, state: np.ndarray) -> float:
        return state[0]

    bottom.terminal = True  # type: ignore[attr-defined]
    end = closed_forms.period(length, amplitude)
    solution = solve_ivp(
        swing, (0, end), [amplitude, 0.0], events=bottom, rtol=1e-11, atol=1e-13, method="DOP853"
    )
    assert 4.0 * solution.t_events[0][0] == pytest.approx(end, rel=1e-8)


def test_period_grows_with_the_amplitude_like_its_series() -> None:
    theta = 0.2
    series = 1 + theta**2 / 16 + 11 * theta**4 / 3072
    assert pendulum.period_ratio(theta) == pytest.approx(series, rel=1e-6)
    assert np.all(np.diff(pendulum.period_ratio(np.linspace(0, 3.1, 50))) > 0)
    assert pendulum.period_ratio(0.0) == 1.0


def test_everything_that_gives_way_lengthens_the_pendulum() -> None:
    """Statics of the reference machine's NDE: 275 µm gap, contact, race and support under 174.6 N."""
    weight = 174.618
    indentation = (weight / 8.3e8) ** 0.9
    length = pendulum.effective_length(275e-6, indentation, weight / 509.9e6, weight / 1e8)
    assert length == pytest.approx(278.06e-6, abs=0.02e-6)
    assert pendulum.small_frequency(length) == pytest.approx(29.89, abs=0.01)


def test_soft_isotropic_spring_lengthens_the_swing_by_its_static_deflection() -> None:
    """A mass on a smooth circle whose centre hangs on a spring: lowest frequency of the coupled motion."""
    m, c, K, centre_mass = 10.0, 2.8e-4, 1e7, 1e-3
    sag = m * G / K
    # small horizontal motion of mass x and centre u: contact force m g towards the centre
    stiffness = np.array([[m * G / c, -m * G / c], [-m * G / c, m * G / c + K]])
    values = np.linalg.eigvals(np.linalg.solve(np.diag([m, centre_mass]), stiffness))
    frequency = math.sqrt(min(values.real)) / (2 * math.pi)
    assert pendulum.small_frequency(pendulum.effective_length(c, support_sag=sag)) == pytest.approx(
        frequency, rel=1e-6
    )


def test_rolling_contact_carries_race_and_rotor_spin_along() -> None:
    """Rotor translation, rotor spin and race spin with a no-slip constraint, solved as one system."""
    m, c, r_r, R_i, I_r, I_i = 17.8, 2.75e-4, 0.034725, 0.035, 0.0875, 0.00034
    # unknowns: acceleration c θ̈, ω̇_r, ω̇_i and the friction force f that opposes the swing
    matrix = np.array(
        [
            [m, 0, 0, 1],
            [0, I_r, 0, r_r],
            [0, 0, I_i, -R_i],
            [1, r_r, -R_i, 0],
        ]
    )
    acceleration = np.linalg.solve(matrix, [-m * G * 1.0, 0, 0, 0])[0]  # at θ = 1, linearised
    frequency = math.sqrt(-acceleration / c) / (2 * math.pi)
    carried = pendulum.spin_participation(r_r, R_i, I_r, I_i)
    assert carried == pytest.approx(0.277, abs=0.002)
    assert pendulum.small_frequency(c, inertia_ratio=1 + carried / m) == pytest.approx(frequency, rel=1e-12)
    assert frequency < 0.995 * pendulum.small_frequency(c)


@pytest.mark.parametrize("amplitude", [0.1, 0.7, 2.0])
def test_amplitude_of_a_frequency_inverts_the_period(amplitude: float) -> None:
    frequency = 1.0 / closed_forms.period(2.8e-4, amplitude)
    assert closed_forms.amplitude_of_frequency(frequency, 2.8e-4) == pytest.approx(amplitude, rel=1e-9)


def test_paper_line_at_29_hz_means_thirty_to_forty_degrees_of_swing() -> None:
    degrees = [math.degrees(closed_forms.amplitude_of_frequency(29.0, c)) for c in (275e-6, 285e-6)]
    assert degrees == pytest.approx([43, 31], abs=1)
    assert closed_forms.amplitude_of_frequency(31.0, 275e-6) == 0.0
