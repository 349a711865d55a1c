"""The fall as a linear system against free fall, the orbit of the levitated rotor and the compiled drop."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.elements.load import Load
from rotordrop.evidence.free_rotor import held_by, motion_of
from rotordrop.evidence.initial_state import build_free_fall, kernel_state
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.statics import levitated_sag, rest_on
from rotordrop.simulate.case import DropCase, LevitatedStart, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import levitated_orbit, start_of_drop
from rotordrop_bench import SyntheticDrop

SPEED = 2.0 * np.pi * 150.0


def test_released_straight_rotor_falls_as_galileo_says(model: DropModel) -> None:
    fall = build_free_fall(model, SPEED, (8, 22))
    state = np.zeros(fall.size)
    state[fall.one] = 1.0
    later = fall.transition(2e-3, 6e-3) @ state
    m = fall.n_modes
    place = model.parameters.bearing_shape @ later[m : 2 * m]
    assert place == pytest.approx(np.full(2, -0.5 * 9.81 * 6e-3**2), rel=1e-9)


@pytest.mark.parametrize("direction", [0.0, 0.5 * np.pi, -2.5])
def test_a_load_and_gravity_change_the_momentum_of_a_falling_rotor(truth: Machine, direction: float) -> None:
    """Newton's second law of the whole rotor, wherever the load acts and however it bends it."""
    load = Load(node=9, direction=f"{direction} rad", force="60 N")
    model = build_drop_model(truth.model_copy(update={"loads": (load,)}), Reduction(modes=6, attachment=True))
    fall = build_free_fall(model, SPEED, (8, 22))
    rates = fall.system[fall.velocity, fall.one].reshape(2, fall.n_modes)
    momentum = model.fe.rigid_shapes[:, 0] @ model.fe.mass @ model.basis.shapes
    weight = truth.rotor.mass * 9.81
    expected = (60.0 * np.cos(direction), 60.0 * np.sin(direction) - weight)
    assert rates @ momentum == pytest.approx(expected, rel=1e-6)


def test_fall_agrees_with_the_compiled_drop_to_the_first_contact(model: DropModel) -> None:
    force = np.array([[5.0, 40.0], [-8.0, 90.0]])
    start = LevitatedStart(rotor_angle=0.7, remanent_force=force, remanence_time_constant=1.8e-3)
    case = DropCase(speed=SPEED, duration=5e-3, tolerance=1e-10, start=start, spin="coasting")
    result = simulate_drop(model, case)
    initial, parameters = start_of_drop(model, case)
    nodes = tuple(unbalance.node for unbalance in model.machine.unbalances)
    fall = build_free_fall(model, SPEED, nodes)
    state = np.zeros(fall.size)
    layout = model.layout
    state[fall.displacement] = np.concatenate([initial[layout.modal_x], initial[layout.modal_y]])
    state[fall.velocity] = np.concatenate(
        [initial[layout.velocity_of(layout.modal_x)], initial[layout.velocity_of(layout.modal_y)]]
    )
    state[fall.one] = 1.0
    state[fall.remanent] = force.ravel()
    turned = [
        float(u.amount) * np.exp(1j * (float(u.phase) + 0.5 * np.pi + 0.7)) for u in model.machine.unbalances
    ]
    state[fall.unbalance] = np.array([(u.real, u.imag) for u in turned]).ravel()
    later = fall.transition(1.8e-3, 5e-3) @ state
    expected = result.state[-1]
    expected_place = np.concatenate([expected[layout.modal_x], expected[layout.modal_y]])
    assert not len(result.contacts)
    assert later[fall.displacement] == pytest.approx(expected_place, abs=1e-11)
    assert parameters.flags[1] == 1


def test_orbit_columns_solve_the_levitated_rotor(model: DropModel) -> None:
    orbit = levitated_orbit(model, SPEED)
    p = model.parameters
    nodes = tuple(unbalance.node for unbalance in model.machine.unbalances)
    fall = build_free_fall(model, SPEED, nodes)
    forward, backward = fall.orbit()
    turned = [float(u.amount) * np.exp(1j * (float(u.phase) + 0.5 * np.pi)) for u in model.machine.unbalances]
    at_magnets = p.magnet_shape @ orbit[:, 0]
    held = -(p.magnet[:, 4] + 1j * SPEED * p.magnet[:, 5]) * at_magnets
    found = forward @ np.array([*turned, *held])
    assert found.real == pytest.approx(orbit[:, 0].real, abs=1e-14)
    assert found.imag == pytest.approx(orbit[:, 1].real, abs=1e-14)
    # an orbit against the spin: what the motion by itself leaves of its rates is the force that holds it
    turning = np.vstack([backward, -1j * SPEED * backward])
    left = -1j * SPEED * turning - motion_of(model.basis, SPEED) @ turning
    assert left[: model.basis.size] == pytest.approx(0.0, abs=1e-15)
    assert left[model.basis.size :] == pytest.approx(p.magnet_shape.T, abs=1e-9)


def test_remanent_force_decays_with_its_time_constant(model: DropModel) -> None:
    fall = build_free_fall(model, SPEED, (8,))
    state = np.zeros(fall.size)
    state[fall.remanent] = 1.0
    assert (fall.transition(2e-3, 2e-3) @ state)[fall.remanent] == pytest.approx(np.exp(-1.0), rel=1e-9)


def test_the_rotor_is_held_by_its_magnets_or_else_at_its_sensor_planes(
    model: DropModel, drop: SyntheticDrop
) -> None:
    machine, planes = model.machine, drop.record.planes
    held = held_by(machine, planes, model.fe)
    assert held.sag == pytest.approx(levitated_sag(model.fe, machine), abs=1e-15)
    assert held.nodes == tuple(amb.node for amb in machine.ambs)
    beside = held_by(machine.changed(ambs=()), planes, model.fe)
    assert not beside.by_magnets
    assert beside.nodes == tuple(plane.node for plane in planes)
    assert beside.lift == pytest.approx(rest_on(model.fe, beside.nodes, 9.81)[1])
    one = held_by(machine.changed(ambs=()), planes[:1], model.fe)
    assert one.nodes == tuple(bearing.node for bearing in machine.touchdown_bearings)


def test_unbalance_keeps_its_place_on_the_rotor(model: DropModel) -> None:
    fall = build_free_fall(model, SPEED, (8, 22))
    state = np.zeros(fall.size)
    state[fall.unbalance] = [2e-6, 1e-6, -3e-6, 4e-6]
    _, _, at_start = kernel_state(fall, state, 0.0)
    later = fall.transition(2e-3, 4e-3) @ state
    whole, _, found = kernel_state(fall, later, SPEED * 4e-3)
    assert found == pytest.approx(at_start, abs=1e-15)
    result = simulate_drop(model, DropCase(speed=SPEED, duration=1e-4, start=StateStart(state=whole)))
    assert result.finished
