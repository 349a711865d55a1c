"""The levitated start: it stays where it is while the magnets hold, and falls as it must afterwards."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.errors import SimulationError, UsageError
from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate._sensitivity import drop_jacobian
from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import levitated_orbit, levitated_static, start_of_drop

SPEED = 2.0 * np.pi * 150.0


@pytest.fixture(scope="module")
def levitated():
    machine = example_machine("lp400").with_values({"unbalance.0.phase": 0.7, "unbalance.1.phase": 2.9})
    return build_drop_model(machine, "quick")


def test_while_the_magnets_hold_the_rotor_keeps_its_orbit(levitated):
    """The closed-form orbit and sag solve the equations of motion: nothing else happens for two turns."""
    start = LevitatedStart(rotor_angle=0.4, delay=1.0, offset=np.array([[3e-6, -8e-6], [5e-6, 2e-6]]))
    case = DropCase(speed=SPEED, duration=2 / 150, tolerance=1e-10, start=start, spin="coasting")
    result = simulate_drop(levitated, case)
    static, _ = levitated_static(levitated, start.offset)
    orbit = levitated_orbit(levitated, SPEED)
    turn = np.exp(1j * (0.4 + SPEED * result.time))
    shape = levitated.parameters.bearing_shape
    expected = (shape @ static)[None] + (turn[:, None, None] * (shape @ orbit)[None]).real
    assert np.max(np.abs(shape @ orbit)) > 1e-7
    assert result.displacement == pytest.approx(expected, abs=1e-12)


def test_the_magnets_carry_the_weight_and_hold_their_places(levitated):
    offset = np.array([[3e-6, -8e-6], [5e-6, 2e-6]])
    static, holding = levitated_static(levitated, offset)
    assert levitated.parameters.magnet_shape @ static == pytest.approx(offset, abs=1e-13)
    assert np.sum(holding, axis=0) == pytest.approx(
        [0.0, levitated.machine.rotor.mass * 9.81], rel=1e-6, abs=1e-6
    )


def test_the_sag_at_the_bearings_against_the_rigid_line(levitated):
    """An independent study of this machine found -6.6 and +4.9 µm."""
    model = build_drop_model(levitated.machine, "full")
    static, _ = levitated_static(model, None)
    sag = model.parameters.bearing_shape[:, 2:] @ static[2:]
    assert sag[:, 1] == pytest.approx([-6.6e-6, 4.9e-6], abs=0.1e-6)
    assert np.max(np.abs(sag[:, 0])) < 1e-15


def test_a_given_orbit_is_met_at_the_magnets(levitated):
    wanted = np.array([7e-6, 3e-6j])
    orbit = levitated_orbit(levitated, SPEED, wanted)
    met = levitated.parameters.magnet_shape @ orbit
    assert met[:, 0] == pytest.approx(wanted, abs=1e-16)
    assert met[:, 1] == pytest.approx(-1j * wanted, abs=1e-16)


def test_an_orbit_for_the_wrong_number_of_magnets_is_refused(levitated):
    with pytest.raises(SimulationError, match=r"orbit has shape \(3,\); expected \(2,\)"):
        levitated_orbit(levitated, SPEED, np.zeros(3))


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
def test_the_orbit_turns_with_the_rotor(levitated, speed):
    start = LevitatedStart(orbit=np.array([5e-6, 5e-6]))
    result = simulate_drop(levitated, DropCase(speed=speed, duration=1e-4, start=start))
    place, velocity = levitated.parameters.bearing_shape @ result.state[0, :8], result.state[0]
    layout = levitated.layout
    vy = levitated.parameters.bearing_shape @ velocity[layout.velocity_of(layout.modal_y)]
    assert np.all(place * vy * np.sign(speed) > 0.0)


def test_remanent_force_delays_the_fall_by_its_impulse(levitated):
    """Upwards F e^(-t/τ) takes away F τ of momentum, however it is spread over the magnets."""
    force = np.array([[0.0, 60.0], [0.0, 90.0]])
    start = LevitatedStart(remanent_force=force, remanence_time_constant=4e-4)
    case = DropCase(speed=0.0, duration=0.005, start=start, spin="coasting", tolerance=1e-9)
    with_lift, without = (
        simulate_drop(levitated, case),
        simulate_drop(
            levitated,
            DropCase(speed=0.0, duration=0.005, start=LevitatedStart(), spin="coasting", tolerance=1e-9),
        ),
    )
    layout = levitated.layout
    lift = np.zeros(len(levitated.fe.mass))
    lift[0::2] = 1.0
    momentum = levitated.fe.mass @ lift @ levitated.basis.shapes
    row = layout.velocity_of(layout.modal_y)
    gained = momentum @ (with_lift.state[-1, row] - without.state[-1, row])
    assert gained == pytest.approx(150.0 * 4e-4, rel=1e-4)


def test_a_delay_holds_the_rotor_first(levitated):
    start = LevitatedStart(delay=0.003)
    result = simulate_drop(levitated, DropCase(speed=0.0, duration=0.006, start=start, spin="coasting"))
    fallen = result.displacement[:, :, 1] - result.displacement[0, :, 1]
    assert np.max(np.abs(fallen[:300])) < 1e-9
    assert np.mean(fallen[-1]) == pytest.approx(-0.5 * 9.81 * 0.003**2, rel=0.1)


def test_a_machine_without_magnets_cannot_levitate(quick):
    with pytest.raises(SimulationError, match=r"at least two radial AMBs; .* has 0.*use another start"):
        simulate_drop(quick.__class__(**{**vars(quick), "parameters": quick.parameters._replace(
            magnet=np.zeros((0, 8)))}), DropCase(speed=SPEED, start=LevitatedStart()))  # fmt: skip


def test_a_remanent_force_for_one_magnet_is_refused(levitated):
    start = LevitatedStart(remanent_force=np.array([0.0, 50.0]))
    with pytest.raises(SimulationError, match=r"remanent force has shape \(2,\); expected \(2, 2\)"):
        simulate_drop(levitated, DropCase(speed=SPEED, start=start))


def test_a_state_of_another_basis_is_refused(levitated):
    start = StateStart(state=np.zeros(7))
    with pytest.raises(SimulationError, match=r"start state has shape \(7,\); this model expects \(54,\)"):
        simulate_drop(levitated, DropCase(speed=SPEED, start=start))


@pytest.fixture(scope="module")
def one_end():
    return build_drop_model(example_machine("lp400").with_magnets_on(["NDE"]), "quick")


@pytest.mark.parametrize("start", [LevitatedStart(), CentredStart()])
def test_one_end_falls_where_the_magnet_of_the_other_stays_on(one_end, start):
    """The held end never touches; the other falls as a bar about it, faster or slower than free, and lies."""
    result = simulate_drop(one_end, DropCase(speed=SPEED, duration=0.2, start=start))
    held, fell = (one_end.bearing_names.index(name) for name in ("NDE", "DE"))
    reach = np.hypot(*np.moveaxis(result.displacement, -1, 0))
    gaps = [float(bearing.air_gap) for bearing in one_end.machine.touchdown_bearings]
    assert np.max(result.contact_force[:, held]) == 0.0
    assert np.max(reach[:, held]) < 0.7 * gaps[held]
    assert np.max(result.contact_force[:, fell]) > 3.0 * float(one_end.load_shares[fell])
    assert result.certificate.energy_residual < 1e-4 * result.certificate.energy_scale


def test_a_magnet_that_stays_on_has_the_slopes_of_its_spring_and_damper(one_end):
    _, parameters = start_of_drop(one_end, DropCase(speed=SPEED, start=LevitatedStart()))
    free = one_end.with_values({}).parameters
    size, m = one_end.layout.n_dynamic, one_end.layout.n_modes
    state = np.zeros(one_end.layout.size)
    slopes = []
    for p in (parameters, free):
        slopes.append(np.zeros((size, size)))
        drop_jacobian(1.0, state, p, slopes[-1])
    added, shape, amb = slopes[0] - slopes[1], one_end.parameters.magnet_shape[0], one_end.machine.ambs[0]
    rates = one_end.layout.n_coordinates + np.arange(m)
    assert added[np.ix_(rates, np.arange(m))] == pytest.approx(-float(amb.stiffness) * np.outer(shape, shape))
    assert added[np.ix_(rates, rates)] == pytest.approx(-float(amb.damping) * np.outer(shape, shape))


def test_magnets_that_stay_on_are_named_and_leave_one_to_let_go():
    machine = example_machine("lp400")
    assert machine.with_magnets_on([]) is machine
    with pytest.raises(UsageError, match="no AMB 'A' that could stay on; expected one of NDE, DE"):
        machine.with_magnets_on(["A"])
    with pytest.raises(UsageError, match=r"every AMB .* nothing falls"):
        machine.with_magnets_on(["NDE", "DE"])
