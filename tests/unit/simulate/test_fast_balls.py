"""Drops with balls that have inertia: the table, its derivative, the books of energy, limits, refusals."""

import numpy as np
import pytest
from tests.unit.simulate.test_right_hand_side import a_state, assert_jacobian

from rotordrop import load_result, simulate_drop
from rotordrop.errors import MachineFileError, SimulationError, UsageError
from rotordrop.machine import example_machine, example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.physics.ball_table import PLACES, fast_energy, fast_force, fast_loads
from rotordrop.physics.fast_balls import FastBalls, ball_equilibrium, centred_balls
from rotordrop.rotor.parameters import FASTEST, build_drop_model
from rotordrop.simulate._rhs import scratch_of
from rotordrop.simulate.case import CentredStart, DropCase, StateStart
from rotordrop.track.forces import FORCE, STRESS, bearing_values

TEXT = example_path("small").read_text(encoding="utf-8")
PLACE = "preload = { guess"
WITH = TEXT.replace(PLACE, f"ball_inertia = true\n{PLACE}")
NOMINAL = float(loads_machine(TEXT).speed.nominal)


@pytest.fixture(scope="module")
def fast():
    return build_drop_model(loads_machine(WITH), "quick")


@pytest.fixture(scope="module")
def slow():
    return build_drop_model(loads_machine(TEXT), "quick")


@pytest.mark.parametrize(("example", "share"), [("paper", 1e-6), ("small", 6e-6)])
def test_the_table_holds_what_the_balls_do(example, share):
    """Within a millionth of the largest load at 25°, six of them at 15°, where balls lose the inner race."""
    described = example_machine(example).touchdown_bearings[0].bearing.changed(ball_inertia=True)
    numbers = described.numbers()
    balls, table = FastBalls.of(numbers.balls, numbers.constants), numbers.speed_table(FASTEST * NOMINAL)
    random, one, scratch = np.random.default_rng(3), np.zeros((3, 8)), (np.empty(8), np.empty((3, PLACES)))
    one[0], one[2, 0] = 1.0, 1.0
    error, largest = 0.0, 0.0
    for omega in random.uniform(0.0, FASTEST * NOMINAL, 25):
        _, orbit = centred_balls(balls, omega)
        way = np.concatenate([random.uniform(-40e-6, 70e-6, 40), random.uniform(-8e-6, 4e-6, 40)])
        force = balls.centrifugal_force(orbit)
        true = ball_equilibrium(balls, balls.axial_offset, balls.radial_offset + way, force)
        found = [fast_force(table.entries, table.values, one, dx, 0.0, omega, *scratch)[0] for dx in way]
        loads = [fast_loads(table.entries, table.values, one, dx, 0.0, omega) for dx in way]
        wanted = np.stack([true.radial_force, true.inner_load, true.outer_load])
        error = max(error, float(np.max(np.abs(np.vstack([found, np.transpose(loads)]) - wanted))))
        largest = max(largest, float(np.max(wanted)))
    assert error < share * largest


@pytest.mark.parametrize("spin", [0.4, -0.9, 0.02])
def test_force_and_exchange_are_slopes_of_the_energy(fast, spin):
    p, omega, h = fast.parameters, spin * NOMINAL, 1e-9
    grid, table, balls = p.bearing[0, L.FAST : L.FAST_END], p.ball_table[0], p.balls[0]

    def energy(x, y, w):
        return fast_energy(grid, table, balls, x, y, w)

    for x, y in ((0.0, -9e-6), (3e-6, 5e-6), (-2e-6, -30e-6)):
        F_x, F_y, by_spin = fast_force(grid, table, balls, x, y, omega, np.empty(24), np.empty((3, PLACES)))
        scale = np.hypot(F_x, F_y)
        by_x = (energy(x + h, y, omega) - energy(x - h, y, omega)) / (2.0 * h)
        by_y = (energy(x, y + h, omega) - energy(x, y - h, omega)) / (2.0 * h)
        assert (F_x, F_y) == pytest.approx((by_x, by_y), abs=1e-4 * scale)
        step = 1e-3 * NOMINAL
        turned = (energy(x, y, omega + step) - energy(x, y, omega - step)) / (2.0 * step)
        assert by_spin == pytest.approx(turned, rel=1e-2, abs=1e-12)


def test_slow_balls_give_the_force_of_the_drop_model_also_to_a_rotor_that_stands_still(fast, slow):
    state = a_state(fast, np.array([12e-6, 18e-6]), 0.0)
    case = DropCase(speed=NOMINAL, start=StateStart(state=state), duration=1e-5, reduction="quick")
    one, other = simulate_drop(fast, case), simulate_drop(slow, case)
    assert one.bearing_force[0] == pytest.approx(other.bearing_force[0], rel=2e-6)
    assert one.max_stress[0] == pytest.approx(other.max_stress[0], rel=1e-5)
    case = DropCase(speed=0.0, duration=0.012, reduction="quick", start=CentredStart(), tolerance=1e-8)
    one, other = simulate_drop(fast, case), simulate_drop(slow, case)
    assert np.max(np.abs(one.bearing_force - other.bearing_force)) < 1e-3 * np.max(other.bearing_force)


@pytest.mark.parametrize("spin", [0.0, 0.5, 0.98, -0.6])
def test_jacobian_agrees_with_finite_differences(fast, spin):
    state = a_state(fast, np.array([-40e-6, 15e-6]), spin)
    assert_jacobian(fast, state, NOMINAL)


def turning(model, share):
    """A drop that begins with its races turning."""
    state = model.at_rest()
    state[model.layout.rotor_speed], state[model.layout.race_spin] = NOMINAL, share * NOMINAL
    start = StateStart(state=state)
    return simulate_drop(model, DropCase(speed=NOMINAL, duration=0.06, reduction="quick", start=start))


@pytest.mark.parametrize("share", [0.0, 0.7])
def test_energy_closes_while_the_races_spin_up(fast, share):
    drop = turning(fast, share)
    assert np.ptp(drop.race_speed) > 30.0
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale


def test_the_outer_race_carries_more_once_the_race_is_fast(fast, slow, tmp_path):
    drop, without = turning(fast, 0.9), turning(slow, 0.9)
    assert without.race_stress is None
    inner, outer = np.moveaxis(drop.race_stress, -1, 0)
    assert np.array_equal(drop.max_stress, np.maximum(inner, outer))
    assert outer[0, 0] > inner[0, 0] > without.max_stress[0, 0]
    assert np.max(drop.bearing_force) < np.max(without.bearing_force)
    drop.save(tmp_path / "drop.h5")
    assert np.array_equal(load_result(tmp_path / "drop.h5").race_stress, drop.race_stress)


def test_the_key_is_read_again_and_a_check_says_what_springs_would_leave():
    """As of one whose balls have no inertia."""
    machine = loads_machine(WITH)
    assert machine.touchdown_bearings[0].bearing.ball_inertia
    assert loads_machine(machine_text(machine)).touchdown_bearings == machine.touchdown_bearings
    (*_, left), (*_, of_slow) = (
        loads_machine(text).touchdown_bearings[0].bearing.numbers().figures(100.0) for text in (WITH, TEXT)
    )
    assert left == of_slow and 0.0 < left.value < 1.0


def test_springs_overspeed_and_loads_of_every_ball_are_refused(fast):
    both = WITH.replace(PLACE, f'preload_kind = "spring"\n{PLACE}')
    with pytest.raises(MachineFileError, match=r"ball_inertia = true goes with a rigid preload today"):
        loads_machine(both)
    with pytest.raises(SimulationError, match=r"is beyond the .* 1\.25 times the nominal speed"):
        simulate_drop(fast, DropCase(speed=1.3 * NOMINAL, duration=0.01))
    result = simulate_drop(fast.machine, DropCase(speed="60 Hz", duration=2e-3, reduction="quick"))
    with pytest.raises(UsageError, match="race_stress of the drop"):
        result.ball_loads(fast.machine, 0)


@pytest.mark.parametrize("spin", [0.0, 0.9])
def test_an_estimate_has_force_and_stress_of_the_drop(fast, slow, spin):
    """Of the filter's state: those that the simulated drop has there, and those of slow balls otherwise."""
    assert fast.machine.not_estimated == ""
    state = a_state(fast, np.array([12e-6, 18e-6]), spin)
    case = DropCase(speed=NOMINAL, start=StateStart(state=state), duration=1e-5, reduction="quick")
    drop, layout, out = simulate_drop(fast, case), fast.layout, np.empty(4)
    dx, dy = state[layout.race][:2] - state[layout.support][:2]
    turn = state[layout.race_spin][0]
    for model, same in ((fast, True), (slow, spin == 0.0)):
        p = model.parameters
        bearing_values(dx, dy, p.bearing[0, L.SET_UNKNOWN], 0, p, scratch_of(p), out, 0.0, turn)
        force, stress = np.linalg.norm(drop.bearing_force[0, 0]), drop.max_stress[0, 0]
        assert (out[FORCE] == pytest.approx(force, rel=1e-5)) == same
        assert (out[STRESS] == pytest.approx(stress, rel=1e-4)) == same
