"""The time loop: order, tolerance, output grid, repeatability, what it reports when it stops."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.physics import columns as L
from rotordrop.simulate import _loop
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate._run import error_scale
from rotordrop.simulate._tableau import dp5, tsit5
from rotordrop.simulate.case import DropCase, PlacedStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import start_of_drop

SPEED = 2.0 * np.pi * 60.0
# 5 µm deep in both bearings: they stay in contact and no ball is unloaded in the window, so nothing switches.
PRESSED = PlacedStart(displacement=np.array([[0.0, -280e-6], [0.0, -290e-6]]), velocity=np.zeros((2, 2)))
WINDOW = 2.4e-4


def fixed_step(model, integrator, step, start=PRESSED):
    case = DropCase(speed=SPEED, duration=WINDOW, output_step=WINDOW / 8, start=start, integrator=integrator)
    return simulate_drop(model, replace(case, largest_step=step, tolerance=1e12))


@pytest.mark.parametrize("integrator", ["tsit5", "dp5"])
def test_fifth_order_on_a_smooth_window(quick, integrator):
    exact = fixed_step(quick, "tsit5", 0.25e-6)
    assert np.all(exact.contact_force > 0.0)
    layout = quick.layout
    moving = slice(0, 2 * layout.n_coordinates)
    scale = np.max(np.abs(exact.state[:, moving]), axis=0) + 1e-12
    steps = np.array([8e-6, 4e-6, 2e-6])
    errors = []
    for step in steps:
        last = fixed_step(quick, integrator, step).state[-1, moving]
        errors.append(np.linalg.norm((last - exact.state[-1, moving]) / scale))
    order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert order[-1] == pytest.approx(5.0, abs=0.2), order


@pytest.mark.parametrize("tableau", [tsit5(), dp5()], ids=["tsit5", "dp5"])
def test_coefficients_are_consistent_and_dense_output_is_of_fourth_order(tableau):
    """Row sums, the seven conditions up to fourth order, and those of the interpolant at every point."""
    a, c = tableau.a, tableau.c
    b = a[6]
    assert a.sum(axis=1) == pytest.approx(c, abs=1e-14)
    conditions = [(b @ c**k, 1.0 / (k + 1)) for k in range(5)]
    conditions += [
        (b @ a @ c, 1 / 6),
        (b @ (c * (a @ c)), 1 / 8),
        (b @ a @ c**2, 1 / 12),
        (b @ a @ a @ c, 1 / 24),
    ]
    for found, expected in conditions:
        assert found == pytest.approx(expected, abs=2e-14)
    assert tableau.e.sum() == pytest.approx(0.0, abs=2e-14)
    assert tableau.p.sum(axis=1) == pytest.approx(b, abs=2e-13)
    assert np.max(np.abs(tableau.e)) > 0.01
    for theta in (0.1, 0.35, 0.5, 0.8):
        w = tableau.p @ theta ** np.arange(1, 5)
        for k in range(4):
            assert w @ tableau.c**k == pytest.approx(theta ** (k + 1) / (k + 1), abs=5e-14)
        assert w @ tableau.a @ tableau.c == pytest.approx(theta**3 / 6, abs=5e-14)


def test_neither_tolerance_nor_output_moves_a_drop(quick):
    """Less than 0.5 % at a ten times tighter tolerance, for the default and for identifications."""
    case = DropCase(speed=SPEED, duration=0.02)
    drops = {rtol: simulate_drop(quick, replace(case, tolerance=rtol)) for rtol in (1e-5, 1e-6, 1e-7, 1e-8)}
    peaks = {rtol: np.max(one.bearing_force_magnitude, axis=0) for rtol, one in drops.items()}
    assert peaks[1e-6] == pytest.approx(peaks[1e-7], rel=5e-3)
    assert peaks[1e-7] == pytest.approx(peaks[1e-8], rel=5e-4)
    assert np.max(np.abs(peaks[1e-5] / peaks[1e-8] - 1.0)) > np.max(np.abs(peaks[1e-7] / peaks[1e-8] - 1.0))
    fine, coarse = simulate_drop(quick, case), simulate_drop(quick, replace(case, output_step=1e-4))
    assert coarse.steps == fine.steps
    assert coarse.state == pytest.approx(fine.state[::10], rel=1e-12, abs=1e-15)
    case = DropCase(speed=SPEED, duration=0.02, tolerance=1e-9)
    one, two = simulate_drop(quick, case), simulate_drop(quick, replace(case, integrator="dp5"))
    assert two.bearing_force == pytest.approx(one.bearing_force, abs=0.05)


def test_repeated_and_threaded_drops_are_the_same_bits(quick, skewed_start):
    cases = [DropCase(speed=SPEED * (1 + 0.2 * i), duration=0.02, start=skewed_start) for i in range(4)]
    alone = [simulate_drop(quick, case) for case in cases]
    with ThreadPoolExecutor(2) as two, ThreadPoolExecutor(4) as four:
        together = list(two.map(simulate_drop, [quick] * 4, cases))
        again = list(four.map(simulate_drop, [quick] * 4, cases))
    for one, two, three in zip(alone, together, again, strict=True):
        assert one.state.tobytes() == two.state.tobytes() == three.state.tobytes()
        assert one.max_stress.tobytes() == two.max_stress.tobytes()
    assert alone[0].state.tobytes() != alone[1].state.tobytes()


def test_contacts_are_logged_where_the_indentation_is_with_peak_impulse_and_azimuth(drop):
    for b, _ in enumerate(drop.bearing_names):
        log = drop.contacts.of_bearing(b)
        inside = np.zeros(len(drop.time), dtype=bool)
        for start, end in zip(log.start, log.end, strict=True):
            end = np.inf if np.isnan(end) else end
            inside |= (drop.time > start) & (drop.time < end)
        assert np.array_equal(inside, drop.indentation[:, b] > 0.0)
        assert np.all(np.diff(log.start) > 0.0)
    step = drop.time[1] - drop.time[0]
    log = drop.contacts
    for i in range(len(log)):
        b = log.bearing[i]
        end = drop.time[-1] if np.isnan(log.end[i]) else log.end[i]
        rows = (drop.time >= log.start[i]) & (drop.time <= end)
        force = drop.contact_force[rows, b]
        if len(force) < 20:
            continue
        assert log.peak_force[i] == pytest.approx(np.max(force), rel=2e-3)
        assert log.impulse[i] == pytest.approx(np.sum(force[1:] + force[:-1]) * 0.5 * step, rel=2e-3)
        row = int(np.argmin(np.abs(drop.time - log.peak_time[i])))
        between = drop.displacement[row, b] - drop.race_displacement[row, b]
        assert log.azimuth[i] == pytest.approx(np.arctan2(between[1], between[0]), abs=0.01)


def test_too_few_steps_and_a_value_that_explodes_are_reported_with_the_way_out(quick):
    result = simulate_drop(quick, DropCase(speed=SPEED, duration=0.02, most_steps=100))
    assert not result.finished
    assert "100 steps were not enough" in result.outcome
    assert 0.0 < result.time[-1] < 0.02
    assert np.all(np.isfinite(result.state))
    bearing = quick.parameters.bearing.copy()
    bearing[0, L.SUPPORT_MASS_Y] = np.nan
    broken = replace(quick, parameters=quick.parameters._replace(bearing=bearing))
    result = simulate_drop(broken, DropCase(speed=SPEED, duration=0.02))
    assert not result.finished
    assert "a value became infinite" in result.outcome


def test_work_and_dissipation_do_not_steer_the_steps(quick):
    """The states behind the rotor speed are outputs: the step control must not look at them."""
    scale = error_scale(quick)
    assert len(scale) == quick.layout.size
    assert np.all(scale > 0.0)
    assert np.array_equal(np.isfinite(scale), np.arange(len(scale)) <= quick.layout.rotor_speed)


def test_steps_end_at_contacts_and_begin_within_them(quick):
    """A fall from rest reaches the gap after √(2 c/g)."""
    result = simulate_drop(quick, DropCase(speed=0.0, duration=0.009, spin="coasting", output_step=1e-3))
    gaps = np.array([float(b.air_gap) for b in quick.machine.touchdown_bearings])
    first = [result.contacts.of_bearing(b).start[0] for b in range(2)]
    expected = np.sqrt(2.0 * gaps / 9.81)
    earliest = int(np.argmin(expected))
    assert first[earliest] == pytest.approx(expected[earliest], abs=1e-8)
    state, parameters = start_of_drop(quick, DropCase(speed=SPEED, start=PRESSED))
    running, log = np.zeros((2, _loop.N_RUN_COLUMNS)), np.zeros((4, _loop.N_LOG_COLUMNS))
    assert _loop.start_running(state, 0.0, parameters, running, log) == 2
    assert np.all(log[:2, _loop.LOG_PEAK_FORCE] > 0.0)
    rate, work = np.zeros(quick.layout.size), scratch_of(parameters)
    drop_derivative(0.0, state, parameters, rate, work)
    assert np.all(np.isfinite(rate))
