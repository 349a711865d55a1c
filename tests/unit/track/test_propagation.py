"""One sample of the drop model with its sensitivity, against finite differences; away from switches."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

from rotordrop.elements.contact import TYPICAL_LOADS
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.track import _propagation as P
from rotordrop.track._filter import soften_friction
from rotordrop.track.problem import parameter_targets, private_copy
from rotordrop.track.smoother import PassSettings
from rotordrop.twin.problems import COARSE_BASIS

DT = 50e-6
ANGLES = np.array([-1.3, -1.8])
"""Direction of the contact at both bearings [rad]."""


def theta_of(problem):
    theta = np.array([unknown.begin for unknown in problem.unknowns])
    for i, unknown in enumerate(problem.unknowns):
        if unknown.begin == 0.0:  # otherwise nothing of it would act
            theta[i] = 0.4 * unknown.sigma
    return theta


def start_of(model, indentation):
    """A state without symmetry: the rotor this far inside the race [m] at both bearings, sliding."""
    layout, shapes = model.layout, model.parameters.bearing_shape
    y = np.zeros(layout.size)
    gaps = model.parameters.bearing[:, L.AIR_GAP]
    normal = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
    race = max(indentation, 0.0) * normal  # about where the balls hold the race against the contact
    rigid = np.linalg.inv(shapes[:, :2])
    for axis, part in enumerate((layout.modal_x, layout.modal_y)):
        y[part][:2] = rigid @ (race + (gaps + indentation)[:, None] * normal)[:, axis]
        y[layout.velocity_of(part)][:2] = rigid @ np.array([[0.05, -0.03], [-0.04, -0.06]])[axis]
    y[layout.race] = race.ravel()
    y[layout.support] = [0.5e-6, -1e-6, 0.2e-6, -0.5e-6]
    y[layout.velocity_of(layout.race)] = [0.01, -0.02, 0.0, 0.01]
    y[layout.race_spin] = [20.0, 35.0]
    y[layout.rotor_speed] = 380.0
    y[layout.rotor_angle] = 0.7
    return y


def advanced(problem, y, theta, substeps, frozen=1, terms=3):
    """State after one sample, with sensitivity and contact impulses."""
    s, n_p = problem.n_dynamic, len(problem.unknowns)
    after, F = y.copy(), np.zeros((s, s + n_p))
    impulses = np.zeros(problem.model.layout.n_bearings)
    p = private_copy(problem.model.parameters)
    P.apply_parameters(theta.copy(), problem.targets, p)
    numbers = PassSettings().for_sampling(DT)._replace(substeps=substeps, frozen=frozen, terms=terms)
    P.propagate(2e-4, after, theta.copy(), problem.targets, p, numbers, F, impulses)
    return after, F, impulses


def scales(problem):
    """A change of every state and parameter that matters about as much as the others."""
    layout = problem.model.layout
    scale = np.ones(problem.n_dynamic)
    sizes = ((layout.modal_x, 1e-5), (layout.modal_y, 1e-5), (layout.race, 1e-6), (layout.support, 1e-6))
    for part, size in sizes:
        scale[part] = size
        scale[layout.velocity_of(part)] = 3e3 * size
    own = layout.further_at(L.BEARING_OWN)
    scale[own] = np.resize([1e-6, 1e-6, 3e-3, 3e-3], own.stop - own.start)
    return np.concatenate([scale, [unknown.sigma for unknown in problem.unknowns]])


def finite_differences(problem, y, theta, substeps):
    s, scale = problem.n_dynamic, scales(problem)
    columns = []
    for j, size in enumerate(scale):
        step = 1e-4 * size
        ends = []
        for sign in (1.0, -1.0):
            moved, changed = y.copy(), theta.copy()
            if j < s:
                moved[j] += sign * step
            else:
                changed[j - s] += sign * step
            ends.append(advanced(problem, moved, changed, substeps)[0][:s])
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.column_stack(columns)


def relative_errors(problem, F, expected):
    """Largest error of every column in units in which states matter equally, over the column's size."""
    scale = scales(problem)
    rows = scale[: problem.n_dynamic, None]
    error = np.abs(F - expected) * scale / rows
    return error.max(axis=0) / np.maximum((np.abs(expected) * scale / rows).max(axis=0), 1e-3)


@pytest.mark.parametrize(("indentation", "touches"), [(-60e-6, False), (4e-6, True)])
def test_the_sensitivity_is_that_of_finite_differences(flight, indentation, touches):
    y, theta = start_of(flight.model, indentation), theta_of(flight)
    _, F, impulses = advanced(flight, y, theta, 64)
    assert np.all(impulses > 0.01) if touches else np.all(impulses == 0.0)
    errors = relative_errors(flight, F, finite_differences(flight, y, theta, 64))
    assert errors[: flight.n_dynamic].max() < 3e-4
    assert errors.max() < 5e-3


@pytest.mark.parametrize("frozen", [2, 3])
def test_a_jacobian_held_for_some_steps_is_that_of_their_middle(flight, frozen):
    y, theta = start_of(flight.model, 4e-6), theta_of(flight)
    exact, errors = advanced(flight, y, theta, 192)[1], []
    for substeps in (8 * frozen, 16 * frozen):
        after, _, impulses = advanced(flight, y, theta, substeps)
        held_after, held, held_impulses = advanced(flight, y, theta, substeps, frozen)
        np.testing.assert_array_equal(held_after, after)
        np.testing.assert_allclose(held_impulses, impulses, rtol=1e-2)
        errors.append(np.median(relative_errors(flight, held, exact)))
    assert errors[1] < 0.35 * errors[0] < 0.35 * 2e-3


@pytest.mark.parametrize(("terms", "order"), [(3, 3), (4, 4)])
def test_the_exponential_of_the_jacobian_has_the_order_that_is_asked_for(flight, terms, order):
    """In flight the Jacobian changes little, so that the order in the step is that of the exponential."""
    y, theta = start_of(flight.model, -60e-6), theta_of(flight)
    exact = advanced(flight, y, theta, 192, 1, 4)[1]
    errors = [
        np.median(relative_errors(flight, advanced(flight, y, theta, substeps, 1, terms)[1], exact))
        for substeps in (2, 4)
    ]
    assert errors[1] == pytest.approx(errors[0] / 2**order, rel=0.5)


def test_a_jacobian_is_held_for_two_steps_with_the_order_that_the_fastest_mode_asks_for():
    for phase, steps in ((0.0, (4, 2, 3)), (2.3, (4, 2, 3)), (2.5, (4, 2, 4)), (4.1, (6, 2, 4))):
        one = PassSettings(substeps=4).for_sampling(DT, phase / DT)
        assert (one.substeps, one.frozen, one.terms) == steps
    single = PassSettings(substeps=1).for_sampling(DT)
    assert (single.substeps, single.frozen) == (1, 1)


def test_the_exponential_of_a_held_jacobian_turns_the_fastest_mode_to_a_tenth():
    for phase in np.linspace(0.2, 20.0, 100):
        one = PassSettings(substeps=4).for_sampling(DT, phase / DT)
        turn = 1j * phase * one.frozen / one.substeps
        series = sum(turn**k / math.factorial(k) for k in range(one.terms + 1))
        assert abs(series - np.exp(turn)) < 0.1


@pytest.mark.parametrize("indentation", [-60e-6, 4e-6])
def test_a_parameter_moves_its_owners_part_and_leaves_the_others_as_they_were(flight, indentation):
    """The derivative taken owner by owner is that of the whole right-hand side, written anew each time."""
    y, theta = start_of(flight.model, indentation), theta_of(flight)
    targets, p = flight.targets, private_copy(flight.model.parameters)
    work, n_p = scratch_of(p), len(theta)
    P.apply_parameters(theta, targets, p)
    before = private_copy(p)
    B = np.full((flight.n_dynamic, n_p), np.nan)
    P.parameter_jacobian(2e-4, y, theta, targets, p, work, B)
    for name in p._fields:
        np.testing.assert_array_equal(getattr(p, name), getattr(before, name), err_msg=name)
    rates = np.zeros((2, len(y)))
    for k in range(n_p):
        for side, sign in enumerate((-1.0, 1.0)):
            moved = theta.copy()
            moved[k] += sign * targets.step[k]
            P.apply_parameters(moved, targets, p)
            drop_derivative(2e-4, y, p, rates[side], work)
        expected = (rates[1] - rates[0])[: flight.n_dynamic] / (2.0 * targets.step[k])
        size = max(np.abs(expected).max(), 1.0)
        np.testing.assert_allclose(
            B[:, k] / size, expected / size, atol=2e-3, err_msg=flight.unknowns[k].path
        )


def test_filter_steps_are_good_and_parameters_move_their_bearing_first(flight):
    """A race swings at 7 kHz, a turn of half a radian in a step of 12.5 µs; the order is at least two."""
    y, theta = start_of(flight.model, 4e-6), theta_of(flight)
    fine = finite_differences(flight, y, theta, 64)
    every = [relative_errors(flight, advanced(flight, y, theta, n)[1], fine) for n in (4, 8, 16)]
    states = [errors[: flight.n_dynamic].max() for errors in every]
    assert states[0] < 0.06
    for coarse, halved in itertools.pairwise(states):
        assert halved < 0.25 * coarse
    for coarse, halved in itertools.pairwise(every):
        assert halved.max() < 0.35 * coarse.max()
    layout, names = flight.model.layout, flight.model.bearing_names
    F = advanced(flight, start_of(flight.model, 4e-6), theta_of(flight), 8)[1]
    paths = [unknown.path for unknown in flight.unknowns]
    for b, name in enumerate(names):
        k = flight.n_dynamic + paths.index(f"{name}.contact.stiffness")
        column = np.abs(F[layout.velocity_of(layout.race), k])
        own = slice(2 * b, 2 * b + 2)
        assert column[own].max() > 20.0 * np.delete(column, own).max() > 0.0


def test_impulses_are_the_time_integral_of_the_contact_force(flight):
    """Momentum of the whole rotor: gravity, remanent lift and unbalance apart, contacts stop it."""
    model, layout = flight.model, flight.model.layout
    y, theta = start_of(flight.model, 4e-6), theta_of(flight)
    paths = [unknown.path for unknown in flight.unknowns]
    still = [i for i, path in enumerate(paths) if path.startswith("unbalance") or "remanent" in path]
    frictionless = [i for i, path in enumerate(paths) if path.endswith("friction.dynamic")]
    theta[still] = 0.0
    theta[frictionless] = -40.0
    boundless = np.full(len(theta), -np.inf)
    flight = replace(flight, targets=flight.targets._replace(lower=boundless))
    after, _, impulses = advanced(flight, y, theta, 64)
    uniform = model.basis.shapes.T @ (model.fe.mass @ np.tile([1.0, 0.0], model.fe.mass.shape[0] // 2))
    parts = (layout.modal_x, layout.modal_y)
    gained = np.array([uniform @ (after - y)[layout.velocity_of(part)] for part in parts])
    gained[1] += DT * model.fe.total_mass * 9.81
    pushed = -impulses @ np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
    np.testing.assert_allclose(gained, pushed, atol=0.02 * np.linalg.norm(pushed))


def test_process_noise_is_an_impulse_between_rotor_and_race_where_they_touch(flight):
    layout, p = flight.model.layout, flight.model.parameters
    n = len(flight.mean)
    covariance, impulses, sigmas = np.zeros((n, n)), np.array([0.5, 0.0]), np.empty(2)
    noise = PassSettings(impulse=2e-3, share=0.1, spin_noise=0.2, speed_noise=0.03)
    numbers = noise.for_sampling(DT)
    drift = np.arange(len(flight.unknowns), dtype=float)
    P.unknown_impulses(numbers, impulses, sigmas)
    P.add_process_noise(covariance, p, numbers, sigmas, drift)
    expected = np.zeros((n, n))
    for b, sigma in enumerate((2e-3 + 0.1 * 0.5, 2e-3)):
        for axis, part in enumerate((layout.modal_x, layout.modal_y)):
            push = np.zeros(n)
            push[layout.velocity_of(part)] = -p.bearing_shape[b]
            race = layout.velocity_of(layout.race).start + 2 * b + axis
            push[race] = (1.0 - b) / p.bearing[b, L.RACE_MASS]
            expected += sigma**2 * np.outer(push, push)
        spin = 0.2 + 0.1 * sigma * p.bearing[b, L.BORE_RADIUS] / p.bearing[b, L.RACE_INERTIA]
        expected[layout.race_spin.start + b, layout.race_spin.start + b] = spin**2
    expected[layout.rotor_speed, layout.rotor_speed] = 0.03**2
    here = np.arange(flight.parameter_slice.start, flight.parameter_slice.stop)
    expected[here, here] = drift**2 * DT
    np.testing.assert_allclose(covariance, expected, rtol=1e-12, atol=1e-30)
    score, taken = np.arange(1.0, n + 1.0), np.zeros(n)
    P.subtract_process_noise(score, p, numbers, sigmas, drift, taken)
    np.testing.assert_allclose(taken, -expected @ score, rtol=1e-12, atol=1e-30)


def single(flight, unknown):
    """Kernel arrays before and after only this unknown is moved, and where it was moved."""
    targets = parameter_targets(flight.model, (unknown,))
    moved = unknown.mean + (0.1 if unknown.logarithmic else 0.5 * unknown.sigma)
    before, after = private_copy(flight.model.parameters), private_copy(flight.model.parameters)
    P.apply_parameters(np.array([unknown.mean]), targets, before)
    P.apply_parameters(np.array([moved]), targets, after)
    return before, after, moved


FOLLOW = [L.BEARING_DAMPING, L.LINES, L.SUPPORT_DAMPING_X, L.SUPPORT_DAMPING_Y]
"""Entries that a description works out of others where nothing is given; an unknown leaves them."""


def described(flight, unknown, before, value):
    """The kernel arrays before, with what a machine with this value has otherwise, or what one drop has."""
    model, (owner, *path), p = flight.model, unknown.path.split("."), private_copy(before)
    if owner == "unbalance":
        shape = value * model.basis.node_row(model.machine.unbalances[int(path[0])].node)
        return p._replace(**{f"unbalance_{path[1][:3]}": shape})
    if path[0] == "remanent_force":
        amb = [one.name for one in model.machine.ambs].index(owner)
        p.magnet[amb, L.REMANENT_X if path[1] == "x" else L.REMANENT_Y] = value
        return p
    if owner == "remanence":
        p.spin[L.REMANENCE_TIME_CONSTANT] = value
        return p
    machine, values = model.machine, {unknown.path: value}
    if path[-1] == "anisotropy":
        stiffness = float(machine.bearing(owner).support.stiffness)
        values = {f"{owner}.support.stiffness_horizontal": value * stiffness}
    plain, other = (
        build_drop_model(one, COARSE_BASIS).parameters for one in (machine, machine.with_values(values))
    )
    changed = {
        part: np.where(getattr(other, part) != getattr(plain, part), getattr(other, part), getattr(p, part))
        for part in p._fields
    }
    return p._replace(**changed)


def test_an_unknown_sets_what_the_machine_with_its_value_has(flight):
    for unknown in flight.unknowns:
        if unknown.path.endswith("exponent"):
            continue
        before, after, moved = single(flight, unknown)
        expected = described(flight, unknown, before, unknown.value_of(moved))
        if unknown.path.endswith(("stiffness", "anisotropy", "support.mass", "preload")):
            expected.bearing[:, FOLLOW] = before.bearing[:, FOLLOW]
        for part in before._fields:
            one, other = getattr(after, part), getattr(expected, part)
            np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-300, err_msg=f"{unknown.path} {part}")


def test_another_exponent_keeps_the_force_at_a_typical_indentation(flight):
    by_path = {unknown.path: unknown for unknown in flight.unknowns}
    chosen = (by_path["DE.contact.exponent"], by_path["DE.contact.stiffness"])
    targets = parameter_targets(flight.model, chosen)
    p = private_copy(flight.model.parameters)
    load = float(np.mean(flight.model.load_shares))
    depth = flight.model.machine.bearing("DE").contact.typical_depth(load)
    for exponent in (1.0, 10.0 / 9.0, 1.5):
        stiffness = 1.2 * float(flight.model.machine.bearing("DE").contact.stiffness)
        P.apply_parameters(np.log([exponent, stiffness]), targets, p)
        row = p.bearing[1]
        assert row[L.CONTACT_EXPONENT] == pytest.approx(exponent)
        assert row[L.CONTACT_STIFFNESS] * depth**exponent == pytest.approx(1.2 * TYPICAL_LOADS * load)


def test_the_model_follows_a_drifting_parameter_only_so_far(flight):
    paths = [unknown.path for unknown in flight.unknowns]
    k = paths.index("NDE.race.drag_coefficient")
    mean = theta_of(flight)[k]

    def taken(theta, step=0.0):
        return P.bounded_value(k, theta, flight.targets, step) / np.exp(mean)

    bound = mean + np.log(6.0)
    for theta in (bound, bound + 1.0, bound + 100.0):
        assert taken(theta) == pytest.approx(6.0, rel=1e-12)
    assert taken(mean - 50.0) == pytest.approx(1.0 / 6.0, rel=1e-12)
    assert taken(mean + 0.5) == pytest.approx(np.exp(0.5), rel=1e-12)
    assert taken(bound + 9.0, 1e-6) - taken(bound) == pytest.approx(6e-6, rel=1e-5)
    free = paths.index("NDE.support.stiffness")
    assert not np.isfinite(flight.targets.upper[free])


def test_friction_changes_its_sign_as_softly_as_the_spin_is_uncertain(flight):
    """Against the mean of the sign over a normal distribution of the slip."""
    p = private_copy(flight.model.parameters)
    least = p.bearing[:, L.SMOOTHING_SPEED].copy()
    n_q = 2 * flight.model.layout.n_modes + 4 * len(least)
    covariance = np.zeros((len(flight.mean), len(flight.mean)))
    soften_friction(covariance, least, p)
    np.testing.assert_array_equal(p.bearing[:, L.SMOOTHING_SPEED], least)
    spin_sigma = 50.0
    covariance[2 * n_q, 2 * n_q] = spin_sigma**2
    soften_friction(covariance, least, p)
    sigma = spin_sigma * p.bearing[0, L.BORE_RADIUS]
    slip = np.linspace(-4.0, 4.0, 41) * sigma
    mean_sign = erf(slip / sigma / np.sqrt(2.0))
    assert np.abs(np.tanh(slip / p.bearing[0, L.SMOOTHING_SPEED]) - mean_sign).max() < 0.05
    assert p.bearing[1, L.SMOOTHING_SPEED] == least[1]
