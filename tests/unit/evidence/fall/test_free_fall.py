"""The fall as a linear system against free fall, the orbit of the levitated rotor and the compiled drop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.reference.rotor_shapes import bending_part

from rotordrop.evidence.initial_state import build_free_fall, kernel_state, sagging_amplitudes
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import levitated_sag
from rotordrop.simulate.case import DropCase, LevitatedStart, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import levitated_orbit, start_of_drop

SPEED = 2.0 * np.pi * 150.0


def test_released_straight_rotor_falls_as_galileo_says(model: DropModel) -> None:
    fall = build_free_fall(model, SPEED, (8, 22))
    state = np.zeros(fall.size)
    state[fall.one] = 1.0
    later = fall.transition(2e-3, 6e-3) @ state
    m = fall.n_modes
    place = model.parameters.bearing_shape @ later[m : 2 * m]
    assert place == pytest.approx(np.full(2, -0.5 * 9.81 * 6e-3**2), rel=1e-9)


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
    columns = fall.synchronous()
    turned = [float(u.amount) * np.exp(1j * (float(u.phase) + 0.5 * np.pi)) for u in model.machine.unbalances]
    at_magnets = p.magnet_shape @ orbit[:, 0]
    held = -(p.magnet[:, 4] + 1j * SPEED * p.magnet[:, 5]) * at_magnets
    forces = np.array([*turned, *held])
    found = columns @ np.column_stack([forces.real, forces.imag]).ravel()
    m = fall.n_modes
    assert found[:m] == pytest.approx(orbit[:, 0].real, abs=1e-14)
    assert found[m : 2 * m] == pytest.approx(orbit[:, 1].real, abs=1e-14)
    assert found[2 * m : 3 * m] == pytest.approx((1j * SPEED * orbit[:, 0]).real, abs=1e-11)


def test_remanent_force_decays_with_its_time_constant(model: DropModel) -> None:
    fall = build_free_fall(model, SPEED, (8,))
    state = np.zeros(fall.size)
    state[fall.remanent] = 1.0
    assert (fall.transition(2e-3, 2e-3) @ state)[fall.remanent] == pytest.approx(np.exp(-1.0), rel=1e-9)


def test_sag_in_modes_is_the_sag_of_the_finite_elements(model: DropModel) -> None:
    shape = model.basis.shapes @ sagging_amplitudes(model)
    expected = levitated_sag(model.fe, model.machine)
    assert shape[0::2] == pytest.approx(expected[0::2], abs=1e-7)
    assert np.max(np.abs(bending_part(model.fe, expected)[0::2])) > 3e-6


def test_sag_without_magnet_planes_is_zero(model: DropModel) -> None:
    bare = replace(model, machine=model.machine.changed(ambs=()))
    assert not np.any(sagging_amplitudes(bare))


def test_observed_rows_are_transitions_seen_by_the_sensors(model: DropModel) -> None:
    fall = build_free_fall(model, SPEED, (8, 22))
    random = np.random.default_rng(1)
    rows = random.standard_normal((3, 2 * fall.n_modes))
    state = random.standard_normal(fall.size)
    seen = fall.observed(rows, 2e-3, 1e-4, 5e-5, 4)
    for k in range(4):
        later = fall.transition(2e-3, 1e-4 + 5e-5 * k) @ state
        assert seen[k] @ state == pytest.approx(rows @ later[fall.displacement], rel=1e-8)


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
