"""Forces from the rotor's own motion, for a rotor pushed by known pulses without any contact law."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.physics import columns as L
from rotordrop.simulate._rhs import scratch_of
from rotordrop.track import _propagation as P
from rotordrop.track.forces import bearing_values, stress_at_force
from rotordrop.track.input_state import (
    SensorCorrections,
    at_bearings,
    corrections_by_record,
    input_state_estimate,
)
from rotordrop.track.problem import private_copy

DT = 5e-5
COUNT = 800
PULSES = (  # bearing, direction (x, y), middle [s], duration [s], peak [N]
    (0, (0.0, -1.0), 8.0e-3, 2.0e-3, 4000.0),
    (1, (0.6, -0.8), 15.0e-3, 1.5e-3, 2500.0),
    (0, (-0.6, -0.8), 24.0e-3, 2.5e-3, 3000.0),
)


def true_force(t, n_b):
    """Force of the rotor on the races [N], shape (B, 2): half sines squared."""
    force = np.zeros((n_b, 2))
    for b, direction, middle, duration, peak in PULSES:
        if abs(t - middle) < 0.5 * duration:
            force[b] += peak * np.cos(np.pi * (t - middle) / duration) ** 2 * np.array(direction)
    return force


def pushed_rotor(model, speed, start):
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


def moved_by_pulses(flight):
    """The same of the rotor that flies in a problem."""
    m = flight.model.layout.n_modes
    start = np.concatenate([flight.mean[: 2 * m], np.zeros(2 * m)])
    return pushed_rotor(flight.model, float(flight.mean[flight.model.layout.rotor_speed]), start)


@pytest.fixture(scope="module")
def pushed(flight):
    """Readings of the pushed rotor with noise, a gate that opens at the pulses, true force."""
    return recorded_pushes(flight, every=1)


def recorded_pushes(flight, every):
    """The pushed rotor with every so manieth reading, the noise density of the readings the same."""
    m, n_b = flight.model.layout.n_modes, flight.model.layout.n_bearings
    states = moved_by_pulses(flight)[::every]
    time = DT * np.arange(COUNT)[::every]
    variances = flight.variances / every
    noise = np.sqrt(variances) * np.random.default_rng(3).standard_normal((len(time), flight.n_channels))
    clean = states[:, : 2 * m] @ flight.sensor_rows[:, : 2 * m].T
    gain, offset = np.array([1.01, 0.99, 1.0, 1.005]), np.array([3e-6, -2e-6, 0.0, 1e-6])
    force = np.array([true_force(t, n_b) for t in time])
    problem = replace(
        flight,
        time=time,
        readings=gain * (clean + noise) + offset,
        variances=variances,
        speed=np.full(len(time), np.nan),
    )
    corrections = SensorCorrections(
        gain_errors=gain - 1.0,
        offsets=offset,
        radius=np.where(np.abs(force).max(axis=2) > 0.0, 1.0, 0.0),
        reach=np.full(n_b, 0.5),
        theta=flight.mean[flight.parameter_slice],
    )
    return problem, corrections, force


def largest(force):
    """Largest force of every bearing [N]."""
    return np.hypot(*force.transpose(2, 0, 1)).max(axis=0)


def peaks_of(force, dt=DT):
    """Largest force vector within every pulse."""
    found = []
    for b, _, middle, duration, _ in PULSES:
        near = slice(round((middle - 0.5 * duration) / dt), round((middle + 0.5 * duration) / dt) + 1)
        size = np.hypot(*force[near, b].T)
        found.append(force[near, b][np.argmax(size)])
    return found


def test_the_peaks_of_known_pulses_are_found_back(pushed):
    problem, corrections, force = pushed
    found = input_state_estimate(problem, corrections)
    for estimate, pulse in zip(peaks_of(found.force), PULSES, strict=True):
        true = pulse[4] * np.array(pulse[1])
        assert np.hypot(*(estimate - true)) < 0.2 * pulse[4]
    np.testing.assert_allclose(found.peak, largest(force), rtol=0.12)
    np.testing.assert_array_equal(found.magnitude.max(axis=0), found.peak)
    assert np.all(np.isnan(found.mean_late))  # the record ends before


def test_the_peak_stress_is_that_of_the_bearing_under_the_peak_force(pushed):
    problem, corrections, _ = pushed
    theta = corrections.theta
    p = private_copy(problem.model.parameters)
    P.apply_parameters(theta.copy(), problem.targets, p)
    out = np.empty(4)
    for b, deflection in ((0, 12e-6), (1, 25e-6)):
        bearing_values(0.0, -deflection, p.bearing[b, L.AXIAL_OFFSET], b, p, scratch_of(p), out)
        found = stress_at_force(problem, theta, b, np.array([0.0, -out[2]]))
        assert found == pytest.approx(out[3], rel=1e-6)
    estimate = input_state_estimate(problem, corrections)
    for b in range(2):
        worst = estimate.force[estimate.magnitude[:, b].argmax(), b]
        assert estimate.peak_stress[b] == pytest.approx(stress_at_force(problem, theta, b, worst), rel=1e-9)
        for i in range(0, COUNT, 50):
            there = stress_at_force(problem, theta, b, estimate.force[i, b])
            assert estimate.stress[i, b] == pytest.approx(there, rel=0.01)


def test_without_the_twin_the_record_itself_opens_the_gate(pushed):
    problem, _, force = pushed
    own = corrections_by_record(problem)
    motion = at_bearings(problem, (problem.readings - own.offsets) / (1.0 + own.gain_errors))
    np.testing.assert_array_equal(own.radius, np.hypot(motion[..., 0], motion[..., 1]))
    assert np.all((own.reach > 100e-6) & (own.reach < 0.96 * problem.mean[problem.gap_entries]))
    opened = replace(own, reach=np.zeros(2))  # this rotor is pushed where no race is
    found = input_state_estimate(problem, opened)
    np.testing.assert_allclose(found.peak, largest(force), rtol=0.15)


def test_the_gate_leaves_room_for_a_rotor_that_bends_beside_the_line_through_its_sensors(flight):
    """However well the gap is known: pushed by some kN this rotor stands off that line by over 10 µm."""
    model, layout = flight.model, flight.model.layout
    m, states = layout.n_modes, moved_by_pulses(flight)
    line = at_bearings(flight, states[:, : 2 * m] @ flight.sensor_rows[:, : 2 * m].T)
    shapes = model.parameters.bearing_shape.T
    path = np.stack([states[:, :m] @ shapes, states[:, m : 2 * m] @ shapes], axis=-1)
    bent = np.quantile(np.linalg.norm(line - path, axis=2), 0.9, axis=0)
    known = replace(flight, covariance=np.zeros_like(flight.covariance))
    room = flight.mean[flight.gap_entries] - corrections_by_record(known).reach
    assert np.all(bent > 5e-6), bent
    assert np.all(room > bent), (room, bent)


@pytest.mark.parametrize("every", [2, 4])
def test_fewer_readings_of_the_same_information_give_the_same_forces(flight, pushed, every):
    """Process noise grows with time, not with samples: 5 and 10 kHz find what 20 kHz finds."""
    problem, corrections, force = pushed
    whole = input_state_estimate(problem, corrections)
    thin, thin_lent, thin_force = recorded_pushes(flight, every)
    found = input_state_estimate(thin, thin_lent)
    assert found.turn == pytest.approx(whole.turn, rel=0.35)
    peaks = peaks_of(found.force, every * DT), peaks_of(whole.force)
    for one, other, pulse in zip(*peaks, PULSES, strict=True):
        assert np.hypot(*(one - other)) < 0.15 * pulse[4]
    apart, usual = np.mean((found.force - thin_force) ** 2), np.mean((whole.force - force) ** 2)
    assert np.sqrt(apart) < 2.0 * np.sqrt(usual)


def test_the_stated_error_holds_the_peak_and_grows_with_noise(flight):
    problem, corrections, force = recorded_pushes(flight, 1)
    true = largest(force)
    found = input_state_estimate(problem, corrections)
    assert np.all(np.abs(found.peak - true) < found.peak_error * true)
    noise = np.random.default_rng(4).standard_normal(problem.readings.shape)
    worse = replace(
        problem, readings=problem.readings + 4e-6 * noise, variances=problem.variances + (4e-6) ** 2
    )
    poor = input_state_estimate(worse, corrections)
    assert np.all(np.abs(poor.peak - true) < poor.peak_error * true)
    assert np.all(poor.reinserted > 1.5 * found.reinserted)
    assert np.all(poor.peak_error > found.peak_error)
    np.testing.assert_allclose(poor.stress_error, np.hypot(0.015, 0.4 * poor.peak_error), rtol=0.2)


def test_a_loose_race_opens_the_gate_by_its_play(flight):
    tight = corrections_by_record(flight)
    play = np.array([[20e-6, 0.0], [3e-6, 0.0]])
    reach = corrections_by_record(replace(flight, model=replace(flight.model, play=play))).reach
    assert tight.reach[0] - reach[0] == pytest.approx(20e-6, rel=1e-9)
    assert reach[1] == tight.reach[1]


def test_a_force_that_no_bearing_carries_is_refused(pushed):
    problem, corrections, _ = pushed
    theta = corrections.theta
    with pytest.raises(IdentificationError, match=r"NDE: a bearing force of 1000000000000 N was found"):
        stress_at_force(problem, theta, 0, np.array([0.0, -1e12]))


def test_impulses_are_those_of_the_pulses_with_nothing_between(pushed):
    problem, corrections, force = pushed
    found = input_state_estimate(problem, corrections)
    np.testing.assert_allclose(
        DT * found.force.sum(axis=0), DT * force.sum(axis=0), atol=0.05 * DT * np.abs(force).sum(axis=0).max()
    )
    flying = np.abs(force).max(axis=2) == 0.0
    assert np.count_nonzero(flying) > 1000
    assert found.magnitude[flying].max() < 0.05 * found.peak.max()
    readings = problem.readings.copy()
    readings[400:405] = np.nan
    readings[100:130, 2] = np.nan
    worse = replace(problem, readings=readings)
    gappy = input_state_estimate(worse, corrections)
    assert np.all(np.isfinite(gappy.force))
    np.testing.assert_allclose(gappy.peak, found.peak, rtol=0.05)


def test_slow_noise_of_the_sensors_is_no_force(flight):
    problem, corrections, force = recorded_pushes(flight, 1)
    decay, size = 0.98, 4e-6
    random = np.random.default_rng(8)
    slow = np.empty_like(problem.readings)
    slow[0] = size * random.standard_normal(problem.n_channels)
    for i in range(1, len(slow)):
        slow[i] = decay * slow[i - 1] + size * np.sqrt(1.0 - decay**2) * random.standard_normal(4)
    white = replace(problem, readings=problem.readings + slow, variances=problem.variances + size**2)
    form = problem.sensor_form._replace(
        noisy=np.arange(4), noise_decay=np.full(4, decay), noise_variance=np.full(4, size**2)
    )
    found = input_state_estimate(replace(white, sensor_form=form), corrections)
    taken_for_white = input_state_estimate(white, corrections)
    error, other = (np.sqrt(np.mean((one.force - force) ** 2)) for one in (found, taken_for_white))
    assert error < 0.8 * other, (error, other)
    np.testing.assert_allclose(found.peak, largest(force), rtol=0.15)
