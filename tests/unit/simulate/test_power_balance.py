"""Energy stored changes by what is put in less what is dissipated, at every instant, in every state."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.simulate.short_drop import START
from tests.unit.simulate.test_right_hand_side import DEPTHS, SPEED, a_state

from rotordrop.machine import example_machine
from rotordrop.physics.columns import POLAR_INERTIA
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate._histories import stored_energy
from rotordrop.simulate._rhs import (
    SUPPORT,
    add_magnet_forces,
    bearing_accelerations,
    drop_derivative,
    scratch_of,
)
from rotordrop.simulate.case import DropCase, LevitatedStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import start_of_drop


def rate_of(state, parameters):
    rate, work = np.zeros(len(state)), scratch_of(parameters)
    drop_derivative(0.003, state, parameters, rate, work)
    return rate


def slope_of_energy(state, rate, parameters, layout):
    """Rate of the stored energy [W] by central differences; exact where the energy is a square."""
    slope = parameters.spin[POLAR_INERTIA] * state[layout.rotor_speed] * rate[layout.rotor_speed]
    for i in range(layout.rotor_speed):
        step = 1e-9 if i < layout.n_coordinates else 1e-2
        upper, lower = state.copy(), state.copy()
        upper[i] += step
        lower[i] -= step
        change = stored_energy(0.0, upper, parameters, False) - stored_energy(0.0, lower, parameters, False)
        slope += rate[i] * change / (2.0 * step)
    return slope


def assert_balanced(state, parameters, layout):
    rate = rate_of(state, parameters)
    stored = slope_of_energy(state, rate, parameters, layout)
    size = abs(rate[layout.dissipated]) + abs(rate[layout.work_in])
    assert size > 1.0
    assert stored == pytest.approx(rate[layout.work_in] - rate[layout.dissipated], abs=2e-5 * size)
    return rate


@pytest.mark.parametrize("slip", [0.0, 0.98, 1.3])
@pytest.mark.parametrize("depths", DEPTHS.values(), ids=DEPTHS)
def test_power_of_a_drop_is_balanced(quick, depths, slip):
    _, parameters = start_of_drop(quick, DropCase(speed=SPEED))
    state = a_state(quick, np.array(depths), slip)
    rate = assert_balanced(state, parameters, quick.layout)
    assert rate[quick.layout.dissipated] > 0.0


@pytest.mark.parametrize("seed", [4, 5])
def test_power_of_a_hard_impact_without_sliding_is_balanced(quick, seed):
    """What the contact damps shows beside what friction takes: rims of equal speed, 0.3 m/s everywhere."""
    _, parameters = start_of_drop(quick, DropCase(speed=SPEED))
    state = a_state(quick, np.array(DEPTHS["both bearings"]), 1.0, seed)
    state[quick.layout.n_coordinates : 2 * quick.layout.n_coordinates] *= 60.0
    assert_balanced(state, parameters, quick.layout)


def test_power_is_balanced_with_strong_unbalance_spin_up_and_support(paper):
    """Everything small made large: ω̇ terms, unbalance, unequal support damping."""
    values = {
        "unbalance.0.amount": 5e-2,
        "unbalance.1.amount": 3e-2,
        "NDE.support.damping": 4e5,
        "DE.support.damping_horizontal": 7e5,
        "speed.aero_time_constant": 0.02,
    }
    model = build_drop_model(paper.with_values(values), "quick")
    _, parameters = start_of_drop(model, DropCase(speed=SPEED))
    assert_balanced(a_state(model, np.array([15e-6, 10e-6]), 0.4), parameters, model.layout)


def test_power_is_balanced_at_a_prescribed_speed(quick):
    """The drive that holds the profile puts in what friction takes."""
    _, parameters = start_of_drop(quick, DropCase(speed=SPEED, spin="prescribed"))
    assert_balanced(a_state(quick, np.array([12e-6, 18e-6]), 0.3), parameters, quick.layout)


def test_certificate_of_a_prescribed_speed_is_balanced_too(quick):
    case = DropCase(speed=SPEED, duration=0.004, output_step=1e-4, spin="prescribed", start=START)
    certificate = simulate_drop(quick, case).certificate
    assert certificate.energy_scale > 1.0
    assert certificate.energy_residual < 1e-5 * certificate.energy_scale


@pytest.mark.parametrize("holds", [True, False])
def test_magnets_put_in_force_times_velocity(holds):
    """While they hold, a spring and a damper about their place; then the remanent force that is left."""
    model = build_drop_model(example_machine("lp400"), "quick")
    remanent = np.array([[40.0, 90.0], [-25.0, 60.0]])
    start = LevitatedStart(
        delay=0.01 if holds else 0.001, remanent_force=remanent, remanence_time_constant=2e-3
    )
    _, parameters = start_of_drop(model, DropCase(speed=SPEED, start=start))
    state = a_state(model, np.array([-40e-6, -20e-6]), 0.0)
    layout, rate = model.layout, np.zeros(model.layout.size)
    put_in = add_magnet_forces(0.003, state, parameters, rate)
    shape = parameters.magnet_shape
    place = np.column_stack([shape @ state[s] for s in (layout.modal_x, layout.modal_y)])
    parts = [layout.velocity_of(s) for s in (layout.modal_x, layout.modal_y)]
    velocity = np.column_stack([shape @ state[part] for part in parts])
    force = np.exp(-1.0) * remanent
    if holds:
        row = parameters.magnet
        force = row[:, 2:4] - row[:, 4:5] * (place - row[:, 6:8]) - row[:, 5:6] * velocity
    assert put_in == pytest.approx(np.sum(force * velocity), rel=1e-12)
    for axis, part in enumerate(parts):
        assert rate[part] == pytest.approx(shape.T @ force[:, axis], rel=1e-12)


def test_a_moving_support_loses_to_its_own_dampers(quick):
    """A support that moves with its race: nothing but its own dampers."""
    _, parameters = start_of_drop(quick, DropCase(speed=SPEED))
    layout, state = quick.layout, quick.layout.zeros()
    support = layout.velocity_of(layout.support)
    work = scratch_of(parameters)
    state[support] = [0.3, 0.2, 0.0, 0.0]
    race = layout.velocity_of(layout.race)
    state[race] = state[support]
    rate = np.zeros(layout.size)
    bearing_accelerations(0.0, 0, state, parameters, rate, work)
    damping = quick.machine.touchdown_bearings[0].support
    expected = float(damping.damping_horizontal) * 0.3**2 + float(damping.damping) * 0.2**2
    assert work.power[0, SUPPORT] == pytest.approx(expected, rel=1e-12)
    assert np.sum(work.power[0]) == pytest.approx(expected, rel=1e-12)
