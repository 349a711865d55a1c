"""Energy: at every instant what is put in less what is lost, and every place of loss is found."""

import numpy as np
import pytest
from tests.unit.simulate.short_drop import START
from tests.unit.simulate.test_right_hand_side import DEPTHS, SPEED, a_state

from rotordrop import DropCase, LevitatedStart, build_drop_model, example_machine, load_result, simulate_drop
from rotordrop.physics import columns as L
from rotordrop.physics.columns import POLAR_INERTIA, RACE_INERTIA
from rotordrop.simulate._histories import stored_energy
from rotordrop.simulate._rhs import (
    SUPPORT,
    add_magnet_forces,
    bearing_accelerations,
    drop_derivative,
    scratch_of,
)
from rotordrop.simulate.levitation import start_of_drop
from rotordrop.simulate.losses import losses


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


CASE = DropCase(
    speed=2.0 * np.pi * 60.0, duration=0.03, reduction="quick", start=LevitatedStart(rotor_angle=1.0)
)
FOUNDATION = {
    "NDE.support.foundation_share": 0.05,
    "NDE.support.foundation_frequency": 2.0 * np.pi * 90.0,
    "NDE.support.foundation_damping_ratio": 0.05,
}


@pytest.fixture(scope="module")
def model():
    return build_drop_model(example_machine("paper"), "quick")


@pytest.fixture(scope="module")
def drop(model):
    return simulate_drop(model, CASE)


def test_places_sum_to_the_book_of_the_time_loop_and_come_back_from_a_file(model, drop, tmp_path):
    found = losses(model, drop)
    book = float(drop.state[-1, model.layout.dissipated])
    assert book > 10.0
    assert found.total == pytest.approx(book, rel=1e-12)
    assert found.sliding.sum() + found.contact.sum() == pytest.approx(
        drop.contacts.dissipated_energy.sum(), rel=1e-4
    )
    drop.save(tmp_path / "drop.h5")
    read = losses(model, load_result(tmp_path / "drop.h5"))
    assert read.total == losses(model, drop).total
    assert np.array_equal(read.support, losses(model, drop).support)


def test_places_close_with_a_foundation_that_gives_way():
    machine = example_machine("paper").with_values(FOUNDATION)
    model = build_drop_model(machine, "quick")
    drop = simulate_drop(model, CASE)
    found = losses(model, drop)
    assert found.total == pytest.approx(float(drop.state[-1, model.layout.dissipated]), rel=1e-12)
    layout, own = model.layout, model.layout.further_at(L.BEARING_OWN)
    mount = drop.state[:, layout.velocity_of(layout.support)][:, :2] - drop.state[:, own][:, 2:]
    damping = [
        float(getattr(machine.touchdown_bearings[0].support, f"damping{a}")) for a in ("_horizontal", "")
    ]
    by_hand = np.trapezoid(mount**2 @ damping, drop.time)
    assert 0.5 < by_hand / found.support[0] < 0.999  # the rest is the foundation's own damper


def test_each_part_follows_its_damper_and_friction_on_the_race_becomes_spin_and_drag(model, drop):
    """Support damping of one bearing alone makes the loss of that support, and only some of the others."""
    name = "NDE.support.damping"
    damping = float(model.machine.touchdown_bearings[0].support.damping)
    dry = model.with_values({name: 1e-6 * damping, "NDE.support.damping_horizontal": 1e-6 * damping})
    found = losses(dry, simulate_drop(dry, CASE))
    assert found.support[0] < 1e-5 * losses(model, drop).support[0]
    assert found.support[1] > 0.1 * losses(model, drop).support[1]
    values = {f"{b}.friction.{k}": 1e-9 for b in ("NDE", "DE") for k in ("static", "dynamic")}
    smooth = model.with_values(values)
    without = losses(smooth, simulate_drop(smooth, CASE))
    assert np.all(without.sliding < 1e-5) and np.all(without.contact > 0.0)
    found = losses(model, drop)
    kinetic = 0.5 * model.parameters.bearing[:, RACE_INERTIA] * drop.race_speed[-1] ** 2
    np.testing.assert_allclose(found.spin_up, kinetic + found.drag)
    bore = np.array([float(b.bore_radius) for b in model.machine.touchdown_bearings])
    work = np.trapezoid(drop.friction_force * bore * drop.race_speed, drop.time, axis=0)
    np.testing.assert_allclose(found.spin_up, work, rtol=2e-2)
