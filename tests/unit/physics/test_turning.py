"""What turns and swings: spin-up and drag of a race, air, whirl against swinging, a pendulum on a race."""

import math

import numpy as np
import pytest

from rotordrop.physics import pendulum
from rotordrop.physics.aerodynamics import exponential_deceleration, speed_dependent_deceleration
from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.physics.magnet import remanent_fraction
from rotordrop.physics.spin import race_drag_torque, surface_speed
from rotordrop.physics.whirl import race_spin_up_time
from rotordrop.physics.whirl_spells import whirl_spells


def test_rolling_leaves_no_surface_speed():
    """35 mm at 100 rad/s against a race of 35.28 mm: 3.5 m/s at rest, zero at 99.2 rad/s."""
    assert surface_speed(0.0, 100.0, 0.035, 0.0, 0.03528) == pytest.approx(3.5)
    assert surface_speed(0.0, 100.0, 0.035, 100.0 * 0.035 / 0.03528, 0.03528) == pytest.approx(0.0, abs=1e-12)
    assert surface_speed(-0.2, 100.0, 0.035, 50.0, 0.03528) == pytest.approx(-0.2 + 3.5 - 1.764)


def test_drag_of_a_race_brakes_it_either_way():
    """0.002 of 1000 N on half of 85 mm: 0.085 N m."""
    assert race_drag_torque(1000.0, 200.0, 0.002, 0.085, 1.0) == pytest.approx(0.085, rel=1e-12)
    assert race_drag_torque(1000.0, -200.0, 0.002, 0.085, 1.0) == pytest.approx(-0.085, rel=1e-12)
    assert race_drag_torque(1000.0, 1.0, 0.002, 0.085, 2.0) == pytest.approx(0.085 * math.tanh(0.5))


def test_exponential_deceleration_is_the_derivative_of_the_profile():
    h, omega_0, tau = 1e-5, 377.0, 5.9
    profile = [omega_0 * math.exp(-(0.3 + s) / tau) for s in (h, -h)]
    expected = (profile[0] - profile[1]) / (2 * h)
    assert exponential_deceleration(0.3, omega_0, tau) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("omega", [-300.0, -1.0, 2.0, 377.0])
def test_air_brakes_either_way(omega):
    found = speed_dependent_deceleration(omega, 0.03, 2e-4)
    assert found == pytest.approx(-math.copysign(0.03 * abs(omega) + 2e-4 * omega**2, omega))


def test_remanence_starts_when_the_magnets_let_go():
    assert remanent_fraction(0.0009, 0.001, 0.002) == 0.0
    assert remanent_fraction(0.001, 0.001, 0.002) == 1.0
    assert remanent_fraction(0.003, 0.001, 0.002) == pytest.approx(1.0 / math.e)
    assert remanent_fraction(0.003, 0.001, 0.0) == 0.0


@pytest.mark.parametrize("r_r", [0.035, 0.030])
def test_spin_up_ends_when_the_surfaces_run_together(r_r):
    """Constant torque of the friction kernel until the surface speed vanishes."""
    inertia, mu, F_r, R_i, omega_r = 3e-4, 0.1, 400.0, 0.035, 377.0
    T = race_spin_up_time(inertia, mu, F_r, R_i, omega_r, r_r)
    sliding = stribeck_coefficient(surface_speed(0.0, omega_r, r_r, 0.0, R_i), mu, mu, 0.5, 0.02)
    omega_i = sliding * F_r * R_i / inertia * T
    assert surface_speed(0.0, omega_r, r_r, omega_i, R_i) == pytest.approx(0.0, abs=1e-10)
    assert math.isclose(
        race_spin_up_time(inertia, mu, F_r, R_i, omega_r),
        race_spin_up_time(inertia, mu, F_r, R_i, omega_r, R_i),
    )


GAP = 250e-6
TIME = np.arange(0.0, 0.2, 5e-5)


def circle(frequency, *, time=TIME, radius=1.02 * GAP, phase=0.0):
    angle = 2 * np.pi * frequency * time + phase
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def swinging(amplitude, frequency=29.0):
    angle = -0.5 * np.pi + amplitude * np.cos(2 * np.pi * frequency * TIME)
    return 1.02 * GAP * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("frequency", [30.0, -30.0, 92.0, -92.0, 250.0, -250.0])
def test_sense_and_frequency_of_a_circle(frequency):
    (spell,) = whirl_spells(TIME, circle(frequency), GAP)
    assert spell.frequency == pytest.approx(frequency, abs=0.05)
    assert spell.duration == pytest.approx(TIME[-1], abs=1.5e-4)
    (mirrored,) = whirl_spells(TIME, circle(frequency), GAP, spin=-300.0)
    assert mirrored.frequency == pytest.approx(-frequency, abs=0.05)


@pytest.mark.parametrize("amplitude", [0.1, 0.5, 1.5, 3.0])
def test_a_pendulum_does_not_whirl_however_far_it_swings(amplitude):
    assert whirl_spells(TIME, swinging(amplitude), GAP) == ()


def test_a_whirl_that_slows_down_has_its_fastest_and_its_last_turns():
    angle = -2.0 * np.pi * (100.0 * TIME - 0.5 * 80.0 / TIME[-1] * TIME**2)  # from 100 to 20 Hz
    (spell,) = whirl_spells(TIME, 1.02 * GAP * np.column_stack([np.cos(angle), np.sin(angle)]), GAP)
    assert -100.0 < spell.fastest < spell.frequency < spell.last < -20.0
    turns = angle / (2.0 * np.pi)  # without half a turn of run-in at either end
    ends = np.interp([0.5, 4.5], -turns, TIME), np.interp([-turns[-1] - 4.5, -turns[-1] - 0.5], -turns, TIME)
    assert [spell.fastest, spell.last] == pytest.approx([-4.0 / np.ptp(end) for end in ends], rel=0.01)


def test_noise_and_bounces_neither_make_nor_end_whirl():
    random = np.random.default_rng(1)
    noise = 1e-6 * random.standard_normal((len(TIME), 2))
    bounces = 1.0 - 0.3 * np.abs(np.sin(2 * np.pi * 170 * TIME))[:, None]
    (spell,) = whirl_spells(TIME, circle(-80.0) * bounces + noise, GAP)
    assert spell.frequency == pytest.approx(-80.0, abs=0.1)
    assert whirl_spells(TIME, swinging(0.4) * bounces + noise, GAP) == ()


def test_whirl_is_told_turn_by_turn():
    third = len(TIME) // 3
    backward = circle(-90.0, time=TIME[:third], phase=-1.5)
    forward = circle(120.0, time=TIME[: len(TIME) - 2 * third], phase=1.0)
    path = np.concatenate([swinging(0.8)[:third], backward, forward])
    spells = whirl_spells(TIME, path, GAP)
    assert [round(spell.frequency) for spell in spells] == [-90, 120]
    assert spells[0].start == pytest.approx(TIME[third], abs=0.02)
    assert spells[1].start == pytest.approx(TIME[2 * third], abs=0.01)
    assert whirl_spells(TIME, circle(9.0), GAP) == ()
    path = circle(60.0)
    path[2000:2010] *= 0.3
    assert len(whirl_spells(TIME, path, GAP)) == 2
    assert whirl_spells(TIME, circle(60.0, radius=0.3 * GAP), GAP) == ()


G = 9.81


def test_what_gives_way_lengthens_the_swing():
    """Statics of the reference machine's NDE: 275 µm gap, contact, race and support under 174.6 N."""
    weight = 174.618
    indentation = (weight / 8.3e8) ** 0.9
    length = pendulum.effective_length(275e-6, indentation, weight / 509.9e6, weight / 1e8)
    assert length == pytest.approx(278.06e-6, abs=0.02e-6)
    assert pendulum.small_frequency(length) == pytest.approx(29.89, abs=0.01)
    # A mass on a smooth circle whose centre hangs on a spring: lowest frequency of the coupled motion.
    m, c, K, centre_mass = 10.0, 2.8e-4, 1e7, 1e-3
    sag = m * G / K
    # small horizontal motion of mass x and centre u: contact force m g towards the centre
    stiffness = np.array([[m * G / c, -m * G / c], [-m * G / c, m * G / c + K]])
    values = np.linalg.eigvals(np.linalg.solve(np.diag([m, centre_mass]), stiffness))
    frequency = math.sqrt(min(values.real)) / (2 * math.pi)
    assert pendulum.small_frequency(pendulum.effective_length(c, support_sag=sag)) == pytest.approx(
        frequency, rel=1e-6
    )


def test_rolling_contact_carries_race_and_rotor_spin_along():
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
