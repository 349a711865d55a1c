"""The compiled right-hand side against plain equations, its derivative against finite differences."""

import numpy as np
import pytest
from tests.unit.simulate import plain_equations

from rotordrop import DropCase, PlacedStart, build_drop_model, simulate_drop
from rotordrop.physics import columns as L
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate._sensitivity import drop_jacobian
from rotordrop.simulate.levitation import rigid_amplitudes, start_of_drop

SPEED = 2.0 * np.pi * 60.0
CASE = DropCase(speed=SPEED)

# One bearing, both, none; sliding fast, slowly (below the smoothing speed), backwards.
DEPTHS = {"flight": (-40e-6, -20e-6), "one bearing": (15e-6, -20e-6), "both bearings": (12e-6, 18e-6)}
STEPS = {L.POSITION: 1e-9, L.INTERNAL: 1e-9, L.VELOCITY: 1e-6}
SLIPS = {"fast": 0.0, "slow": 0.98, "sticking": 0.99995, "backwards": 1.3}


def a_state(model, depths, slip, seed=4):
    """A state with everything moving: rotor at depths in its bearings, races and supports displaced."""
    random = np.random.default_rng(seed)
    layout, state = model.layout, model.layout.zeros()
    bearings = model.machine.touchdown_bearings
    azimuth = random.uniform(0.0, 2 * np.pi, len(bearings))
    away = np.array([np.cos(azimuth), np.sin(azimuth)]).T
    race = 3e-6 * random.standard_normal((len(bearings), 2))
    radius = np.array([float(b.air_gap) for b in bearings]) + depths
    positions = np.array([model.fe.node_positions[b.node - 1] for b in bearings])
    place = rigid_amplitudes(model, positions, race + radius[:, None] * away)
    state[layout.modal_x], state[layout.modal_y] = place[:, 0], place[:, 1]
    state[layout.race] = race.ravel()
    state[layout.support] = 2e-6 * random.standard_normal(2 * len(bearings))
    motion = slice(layout.n_coordinates, 2 * layout.n_coordinates)
    state[motion] = 0.005 * random.standard_normal(layout.n_coordinates)
    state[layout.rotor_speed] = SPEED
    state[layout.rotor_angle] = 0.7
    rims = [1.0 - float(b.air_gap) / float(b.bore_radius) for b in bearings]
    state[layout.race_spin] = slip * SPEED * np.array(rims)
    return state


def kernel_derivative(model, state, case=CASE):
    _, parameters = start_of_drop(model, case)
    rate, work = np.zeros(model.layout.size), scratch_of(parameters)
    drop_derivative(0.003, state, parameters, rate, work)
    return rate


@pytest.mark.parametrize("slip", SLIPS.values(), ids=SLIPS)
@pytest.mark.parametrize("depths", DEPTHS.values(), ids=DEPTHS)
def test_kernel_agrees_with_plain_equations(quick, depths, slip):
    state = a_state(quick, np.array(depths), slip)
    expected = plain_equations.derivative(quick, CASE, 0.003, state)
    found = kernel_derivative(quick, state)[: len(expected)]
    # the damping of the balls carries the error of a difference quotient
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-7 * np.max(np.abs(expected)))


def test_every_arrangement_of_the_machine_reaches_the_kernel(paper):
    """Anisotropic support, turned second row, turned first ball: none may be lost in the flat arrays."""
    values = {
        "NDE.support.stiffness_horizontal": 4e7,
        "NDE.support.mass_horizontal": 31.0,
        "DE.support.damping_horizontal": 900.0,
        "DE.bearing.second_row_offset": 0.3,
        "NDE.bearing.first_ball_angle": 0.05,
        "DE.friction.dynamic": 0.17,
    }
    model = build_drop_model(paper.with_values(values), "quick")
    state = a_state(model, np.array([10e-6, 20e-6]), 0.3)
    expected = plain_equations.derivative(model, CASE, 0.003, state)
    found = kernel_derivative(model, state)[: len(expected)]
    assert np.max(np.abs(found - expected)) < 2e-6 * np.max(np.abs(expected))
    plain = build_drop_model(paper, "quick")
    assert np.max(np.abs(kernel_derivative(plain, state)[: len(expected)] - expected)) > 1e-3 * np.max(
        np.abs(expected)
    )


@pytest.mark.parametrize("slip", [0.0, 0.98, 1.3])
@pytest.mark.parametrize("depths", DEPTHS.values(), ids=DEPTHS)
def test_jacobian_agrees_with_finite_differences(quick, depths, slip):
    """With a prescribed speed the derivative leaves nothing out but ω̇ against ω² in the unbalance."""
    case = DropCase(speed=SPEED, spin="prescribed")
    state = a_state(quick, np.array(depths), slip)
    jacobian, numeric = both_jacobians(quick, state, case)
    size = np.max(np.abs(numeric), axis=0)
    error = np.max(np.abs(jacobian - numeric), axis=0) / np.maximum(size, 1e-9)
    angle = quick.layout.rotor_angle
    assert np.max(np.delete(error, angle)) < 3e-5, int(np.argmax(np.delete(error, angle)))
    assert error[angle] < 1e-3


@pytest.mark.parametrize("slip", [0.0, 0.98, 1.3])
def test_torque_on_the_rotor_is_differentiated(quick, slip):
    state = a_state(quick, np.array([12e-6, 18e-6]), slip)
    jacobian, numeric = both_jacobians(quick, state, CASE)
    row = quick.layout.rotor_speed
    assert np.max(np.abs(numeric[row])) > 1.0
    assert jacobian[row] == pytest.approx(numeric[row], abs=3e-5 * np.max(np.abs(numeric[row])))


def assert_jacobian(model, state, speed=SPEED):
    """The derivative of every rate by every state but the rotor angle; gives that by differences."""
    jacobian, numeric = both_jacobians(model, state, DropCase(speed=speed, spin="prescribed"))
    size = np.maximum(np.max(np.abs(numeric), axis=0), 1e-9)
    error = np.delete(np.max(np.abs(jacobian - numeric), axis=0) / size, model.layout.rotor_angle)
    assert np.max(error) < 5e-5, int(np.argmax(error))
    return numeric


def mirrored_drops(machine, speed=SPEED):
    """A drop without unbalance, placed aside and turning, and its mirror image."""
    even, drops = machine.with_values({"unbalance.0.amount": 0.0}), []
    for side in (1.0, -1.0):
        place = np.array([[side * 40e-6, -20e-6], [side * 70e-6, 10e-6]])
        start = PlacedStart(displacement=place, velocity=np.zeros((2, 2)))
        case = DropCase(speed=side * speed, duration=0.012, reduction="quick", start=start)
        drops.append(simulate_drop(even, case))
    return drops


def both_jacobians(model, state, case):
    _, parameters = start_of_drop(model, case)
    size = model.layout.rotor_angle + 1
    jacobian, numeric = np.zeros((size, size)), np.zeros((size, size))
    drop_jacobian(0.003, state, parameters, jacobian)
    for column in range(size):
        step = STEPS.get(model.layout.kinds[column], 1e-4)
        up, down = state.copy(), state.copy()
        up[column] += step
        down[column] -= step
        difference = kernel_derivative(model, up, case) - kernel_derivative(model, down, case)
        numeric[:, column] = difference[:size] / (2.0 * step)
    return jacobian, numeric
