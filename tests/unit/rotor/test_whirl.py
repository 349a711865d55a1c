"""Whirling modes: direction, mirror, precession, damping; the response to unbalance."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.errors import SimulationError, UsageError
from rotordrop.physics.timoshenko import round_section
from rotordrop.rotor.assembly import PointMass, assemble, modes_on_springs
from rotordrop.rotor.reduction import reduce_rotor
from rotordrop.rotor.suspension import Support, in_series, link, spring
from rotordrop.rotor.whirl import (
    direction_name,
    matrices_of,
    unbalance_response,
    unbalance_run_up,
    whirl_modes,
)

EVEN = [spring(2, 2e7), spring(8, 2e7)]
UNEVEN = [spring(2, (2e7, 1.2e7), (300.0, 100.0)), spring(8, [[2e7, 3e6], [1e6, 1.5e7]], 200.0)]
SPEED = 900.0


def test_at_standstill_both_planes_have_the_undamped_modes(overhung):
    modes = whirl_modes(overhung, 0.0, EVEN, 8)
    expected = modes_on_springs(overhung, {2: 2e7, 8: 2e7}, 4).omega
    assert modes.eigenvalue.imag == pytest.approx(np.repeat(expected, 2), rel=1e-8)
    assert np.max(np.abs(modes.damping_ratio)) < 1e-8


def test_spin_parts_each_pair_into_backward_below_and_forward_above(overhung):
    rest, spin = (whirl_modes(overhung, speed, EVEN, 8) for speed in (0.0, SPEED))
    assert spin.direction[:4] == ("backward", "forward", "backward", "forward")
    assert np.all(spin.frequency[0:4:2] < rest.frequency[0:4:2])
    assert np.all(spin.frequency[1:4:2] > rest.frequency[1:4:2])
    assert np.abs(spin.whirl) == pytest.approx(np.ones(8), abs=1e-9)


def test_forward_turns_with_the_spin_also_when_it_is_negative(overhung):
    """The mirror image: the same frequencies, x turned round, forward still with the spin."""
    with_spin, against = (
        whirl_modes(overhung, speed, UNEVEN_MIRRORED[k], 8) for k, speed in enumerate((SPEED, -SPEED))
    )
    assert against.eigenvalue == pytest.approx(with_spin.eigenvalue, rel=1e-9)
    assert against.whirl == pytest.approx(with_spin.whirl, abs=1e-7)
    np.testing.assert_allclose(np.abs(against.shapes), np.abs(with_spin.shapes), atol=1e-6)


UNEVEN_MIRRORED = (
    UNEVEN,
    [spring(2, (2e7, 1.2e7), (300.0, 100.0)), spring(8, [[2e7, -3e6], [-1e6, 1.5e7]], 200.0)],
)


def test_a_forward_shape_turns_from_x_to_y(overhung):
    modes = whirl_modes(overhung, SPEED, EVEN, 2)
    for sign, shape in zip((-1, 1), modes.shapes, strict=True):
        moved = shape[np.abs(shape[:, 0]) > 0.1]
        np.testing.assert_allclose(moved[:, 1] / moved[:, 0], -1j * sign, atol=1e-7)


def test_unequal_springs_flatten_the_whirl(overhung):
    flat = [spring(2, (2e7, 1e7)), spring(8, (2e7, 1e7))]
    slow, fast = (whirl_modes(overhung, speed, flat, 2) for speed in (1.0, 5000.0))
    assert slow.direction == ("mixed", "mixed")
    assert fast.direction == ("backward", "forward")


def test_eigenpairs_solve_the_equations_of_motion(overhung):
    modes = whirl_modes(overhung, SPEED, UNEVEN, 6)
    system = matrices_of(overhung, UNEVEN)
    coupling = system.damping + SPEED * system.gyroscopic
    for value, vector in zip(modes.eigenvalue, modes.vectors.T, strict=True):
        forces = [value**2 * system.mass @ vector, value * coupling @ vector, system.stiffness @ vector]
        assert np.linalg.norm(sum(forces)) < 1e-6 * np.linalg.norm(forces[2])


def test_the_free_rotor_precesses_at_the_ratio_of_its_inertias(overhung):
    modes = whirl_modes(overhung, 20.0, (), 1)
    expected = 20.0 * overhung.polar_inertia / overhung.diametral_inertia
    assert modes.eigenvalue[0].imag == pytest.approx(expected, rel=2e-4)
    assert modes.direction == ("forward",)


def test_the_free_rotor_has_its_modal_damping_and_no_drift(paper_fe):
    modes = whirl_modes(reduce_rotor(paper_fe, "quick", (4, 26)), 0.0)
    assert modes.damping_ratio[:8] == pytest.approx([0.005] * 8, rel=1e-6)
    assert modes.frequency[0] == pytest.approx(187.305, abs=0.01)


def test_the_reduced_rotor_whirls_as_the_full_one(overhung):
    full = whirl_modes(overhung, SPEED, UNEVEN, 6)
    reduced = whirl_modes(reduce_rotor(overhung, "accurate", (2, 8)), SPEED, UNEVEN, 6)
    assert reduced.eigenvalue == pytest.approx(full.eigenvalue, rel=1e-5)
    np.testing.assert_allclose(np.abs(reduced.shapes), np.abs(full.shapes), atol=1e-4)


def test_a_heavy_foundation_is_ground_and_a_light_one_is_a_series(overhung):
    soft, stiff = link(3e7), link(6e7)
    heavy = [Support(node=n, links=(soft, stiff), masses=(1e9,)) for n in (2, 8)]
    light = [Support(node=n, links=(soft, stiff), masses=(1e-4,)) for n in (2, 8)]
    on_ground = whirl_modes(overhung, SPEED, [spring(n, 3e7) for n in (2, 8)], 4)
    in_row = whirl_modes(overhung, SPEED, [spring(n, in_series(3e7, 6e7)) for n in (2, 8)], 4)
    # the foundation itself swings slower than 0.05 Hz and is left out
    assert whirl_modes(overhung, SPEED, heavy, 4).frequency == pytest.approx(on_ground.frequency, rel=1e-6)
    assert whirl_modes(overhung, SPEED, light, 4).frequency == pytest.approx(in_row.frequency, rel=1e-5)


def test_an_overdamped_body_is_no_mode():
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    body = PointMass(node=2, mass=50.0, polar_inertia=1.0, diametral_inertia=1.0)
    rotor = reduce_rotor(assemble([0.0, 0.2, 0.4], [section] * 2, [body]), _rigid())
    assert len(whirl_modes(rotor, 0.0, [spring(1, 1e5), spring(3, 1e5)]).frequency) == 4
    assert len(whirl_modes(rotor, 0.0, [spring(1, 1e5, 1e5), spring(3, 1e5, 1e5)]).frequency) == 0


def _rigid():
    from rotordrop.rotor.reduction import Reduction

    return Reduction(modes=2, attachment=False)


def test_unbalance_response_is_a_circle_of_the_static_eccentricity_far_above_critical(overhung):
    """A free rotor with unbalance in its balance planes turns about its inertia axis."""
    amount = 1e-4
    centre = overhung.centre_of_gravity
    response = unbalance_response(
        overhung, [1.0], {3: amount, 9: amount}, [spring(2, 1e-3), spring(8, 1e-3)]
    )[0]
    z = overhung.node_positions
    moment = amount * (z[2] - centre) + amount * (z[8] - centre)
    expected = -2 * amount / overhung.total_mass - moment * (z - centre) / (
        overhung.diametral_inertia - overhung.polar_inertia
    )
    np.testing.assert_allclose(response[:, 0], expected, rtol=1e-4, atol=1e-8)
    np.testing.assert_allclose(response[:, 1], -1j * response[:, 0], rtol=1e-6)


def test_unbalance_response_peaks_at_the_forward_critical_speed(overhung):
    from rotordrop.rotor.critical_speeds import critical_speeds

    held = [spring(2, 2e7, 20.0), spring(8, 2e7, 20.0)]
    critical = critical_speeds(overhung, held, count=1)[0] * 2 * np.pi
    speeds = critical * np.linspace(0.99, 1.01, 201)
    response = np.abs(unbalance_response(overhung, speeds, {11: 1e-4}, held)[:, 10, 0])
    assert speeds[np.argmax(response)] == pytest.approx(critical, rel=2e-4)


RISE = (600.0, 2200.0)
"""Speeds of a run-up through the first critical speed [rad/s]."""
AMOUNTS = {11: 1e-4j, 3: 5e-5}
HELD, DAMPED = ([spring(2, 2e7, c), spring(8, [[2e7, 2e6], [2e6, 1.4e7]], c)] for c in (400.0, 4e3))


def risen(rotor, duration: float, steps: int, held=HELD) -> tuple[np.ndarray, np.ndarray]:
    """Speeds of a run-up, and the synchronous motion (x, y) at node 11."""
    speeds = np.linspace(*RISE, steps + 1)
    return speeds, unbalance_run_up(rotor, speeds, duration, AMOUNTS, held)[:, 10]


def test_a_run_up_is_that_of_the_equations_of_motion_in_time(overhung):
    """Against the real equations, with ω̇ in force and gyroscopic moment, by an integrator of others."""
    from scipy.integrate import solve_ivp

    from rotordrop.rotor.reduction import Reduction

    basis = reduce_rotor(overhung, Reduction(modes=4, attachment=False))
    duration = 0.2
    alpha = (RISE[1] - RISE[0]) / duration
    system = matrices_of(basis, HELD)
    n = system.plane_size
    spun = np.concatenate(
        [sum(u * turn * basis.node_row(k) for k, u in AMOUNTS.items()) for turn in (1, -1j)]
    )

    def rate(t, y):
        q, v = np.split(y, 2)
        omega = RISE[0] + alpha * t
        force = (spun * (omega**2 - 1j * alpha) * np.exp(1j * (RISE[0] * t + 0.5 * alpha * t**2))).real
        back = (system.damping + omega * system.gyroscopic) @ v
        return np.concatenate([v, force - back - (system.stiffness + alpha * system.gyroscopic) @ q])

    coupling = system.damping + RISE[0] * system.gyroscopic
    start = np.linalg.solve(
        system.stiffness - RISE[0] ** 2 * np.eye(2 * n) + 1j * RISE[0] * coupling, RISE[0] ** 2 * spun
    )
    times = np.linspace(0.0, duration, 1001)
    y0 = np.concatenate([start.real, (1j * RISE[0] * start).real])
    found = solve_ivp(rate, (0.0, duration), y0, "DOP853", times, rtol=1e-8, atol=1e-12).y
    path = np.stack([basis.node_row(11) @ found[:n], basis.node_row(11) @ found[n : 2 * n]], axis=1)
    angle = RISE[0] * times + 0.5 * alpha * times**2
    ours = (risen(basis, duration, 1000)[1] * np.exp(1j * angle)[:, None]).real
    assert np.abs(ours - path).max() < 2e-3 * np.abs(path).max()


def test_a_slow_run_up_is_the_steady_response(overhung):
    basis = reduce_rotor(overhung, "quick", (2, 8))
    speeds, slow = risen(basis, 10.0, 5000, DAMPED)
    steady = unbalance_response(basis, speeds, AMOUNTS, DAMPED)[:, 10]
    np.testing.assert_allclose(slow, steady, atol=0.02 * np.abs(steady).max())


def test_a_fast_run_up_stays_below_the_steady_peak_and_comes_after_it(overhung):
    basis = reduce_rotor(overhung, "quick", (2, 8))
    speeds, fast = risen(basis, 0.3, 1000)
    steady, fast = (
        np.abs(one).max(axis=1) for one in (unbalance_response(basis, speeds, AMOUNTS, HELD)[:, 10], fast)
    )
    assert fast.max() < 0.8 * steady.max()
    assert speeds[fast.argmax()] > speeds[steady.argmax()]


def test_names_of_directions():
    assert [direction_name(v) for v in (-1.0, -0.06, 0.0, 0.04, 0.5)] == [
        "backward",
        "backward",
        "mixed",
        "mixed",
        "forward",
    ]


def test_a_shaft_without_inertia_is_refused():
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    rotor = assemble([0.0, 0.2, 0.4], [section] * 2, [PointMass(node=2, mass=1.0)], modal_damping=0.0)
    with pytest.raises(SimulationError, match="nodes without mass or inertia"):
        whirl_modes(rotor, 0.0, [spring(1, 1e5), spring(3, 1e5)])


def test_supports_that_make_no_sense_are_refused():
    with pytest.raises(UsageError, match="node 3 has 2 links and 0 masses"):
        Support(node=3, links=(link(1.0), link(1.0)))
    with pytest.raises(UsageError, match=r"node 3 has the masses \(0\.0,\) kg; they must be positive"):
        Support(node=3, links=(link(1.0), link(1.0)), masses=(0.0,))
    with pytest.raises(UsageError, match=r"not by shape \(3,\)"):
        link([1.0, 2.0, 3.0])
    assert in_series(2.0, 0.0) == 0.0
