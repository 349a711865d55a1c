"""Laws every drop obeys: symmetry, rotation, similarity, energy, weight, friction."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop import build_drop_model, simulate_drop
from rotordrop.physics import columns as L
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate.case import CentredStart, DropCase, PlacedStart, StateStart
from rotordrop.simulate.levitation import rigid_amplitudes, start_of_drop
from rotordrop_bench.settled import settled_coordinates

SPEED = 2.0 * np.pi * 60.0
AZIMUTHS = np.radians(np.arange(8) * 45.0 + 10.0)


def turned(vectors, angle):
    c, s = np.cos(angle), np.sin(angle)
    return vectors @ np.array([[c, s], [-s, c]])


def turned_start(start, angle):
    return PlacedStart(displacement=turned(start.displacement, angle), velocity=turned(start.velocity, angle))


def with_parameters(model, **arrays):
    return replace(model, parameters=model.parameters._replace(**arrays))


def with_columns(model, values):
    bearing = model.parameters.bearing.copy()
    for column, value in values.items():
        bearing[:, column] = value
    return with_parameters(model, bearing=bearing)


@pytest.mark.parametrize("pitches", [1, 5, 17])
def test_turning_the_start_turns_the_drop(quick, pitches):
    """Without gravity nothing tells directions apart but the balls, which repeat every pitch."""
    angle = pitches * 2.0 * np.pi / 23
    model = with_parameters(quick, gravity=np.zeros_like(quick.parameters.gravity))
    start = PlacedStart(
        displacement=np.array([[0.0, -2e-4], [1e-4, 1e-4]]), velocity=np.array([[0.05, -0.08], [-0.06, 0.05]])
    )
    other = turned_start(start, angle)
    p = model.parameters
    c, s = np.cos(angle), np.sin(angle)
    ahead = with_parameters(
        model,
        unbalance_cos=c * p.unbalance_cos - s * p.unbalance_sin,
        unbalance_sin=s * p.unbalance_cos + c * p.unbalance_sin,
    )
    case = DropCase(speed=SPEED, duration=0.01, tolerance=1e-10, start=start)
    one, two = simulate_drop(model, case), simulate_drop(ahead, replace(case, start=other))
    assert np.max(one.contact_force, axis=0).min() > 100.0
    assert two.displacement == pytest.approx(turned(one.displacement, angle), abs=2e-12)
    assert two.bearing_force == pytest.approx(turned(one.bearing_force, angle), abs=1e-3)
    assert two.max_stress == pytest.approx(one.max_stress, rel=1e-7)


@pytest.mark.parametrize(("spin", "kept"), [("constant", True), ("coasting", False), ("prescribed", False)])
def test_only_a_constant_speed_is_held_through_contacts(quick, spin, kept):
    result = simulate_drop(quick, DropCase(speed=SPEED, duration=0.02, spin=spin))
    assert np.max(result.contact_force) > 1000.0
    assert np.max(result.race_speed) > 0.1 * SPEED
    held = np.max(np.abs(result.speed / SPEED - 1.0)) < 1e-13
    assert held == kept


@pytest.mark.parametrize("amounts", [{}, {"eccentricity": 12e-6, "oval": 5e-6}], ids=["round", "not round"])
def test_mirroring_speed_place_unbalance_and_sleeve_mirrors_the_drop(paper, skewed_start, amounts):
    mirror = np.array([-1.0, 1.0])
    phases = {f"unbalance.{i}.phase": 0.6 + i for i in range(len(paper.unbalances))}
    sleeves = [
        (f"{bearing.name}.landing_sleeve", name) for bearing in paper.touchdown_bearings for name in amounts
    ]
    phases |= {f"{path}.{name}_phase": 0.7 for path, name in sleeves}
    paper = paper.with_values({f"{path}.{name}": amounts[name] for path, name in sleeves})
    model = build_drop_model(paper.with_values(phases), "quick")
    other = build_drop_model(paper.with_values({k: -v for k, v in phases.items()}), "quick")
    case = DropCase(speed=SPEED, duration=0.01, tolerance=1e-10, start=skewed_start)
    start = skewed_start
    image = PlacedStart(displacement=start.displacement * mirror, velocity=start.velocity * mirror)
    one = simulate_drop(model, case)
    two = simulate_drop(other, replace(case, speed=-SPEED, start=image))
    assert len(one.contacts) > 0
    assert two.displacement == pytest.approx(one.displacement * mirror, abs=5e-12)
    assert two.race_speed == pytest.approx(-one.race_speed, abs=2e-6)
    assert two.friction_force == pytest.approx(-one.friction_force, abs=1e-3)


def scaled_by_mass(model, factor):
    """All masses, stiffnesses and dampings times a factor: the same motion, other forces."""
    p, root = model.parameters, np.sqrt(factor)
    bearing, spin = p.bearing.copy(), p.spin.copy()
    columns = [
        L.CONTACT_STIFFNESS, L.RACE_MASS, L.RACE_INERTIA, L.BALL_STIFFNESS, L.BEARING_DAMPING,
        L.SUPPORT_MASS_X, L.SUPPORT_MASS_Y, L.SUPPORT_STIFFNESS_X, L.SUPPORT_STIFFNESS_Y,
        L.SUPPORT_DAMPING_X, L.SUPPORT_DAMPING_Y,
    ]  # fmt: skip
    bearing[:, columns] *= factor
    bearing[:, L.STRESS_COEFFICIENT] *= factor ** (2.0 / 3.0)
    spin[L.POLAR_INERTIA] *= factor
    return with_parameters(
        model,
        gravity=p.gravity * root,
        unbalance_cos=p.unbalance_cos * root,
        unbalance_sin=p.unbalance_sin * root,
        bearing_shape=p.bearing_shape / root,
        bearing=bearing,
        spin=spin,
    )


def test_similar_machines_take_the_same_path(quick):
    case = DropCase(speed=SPEED, duration=0.02, tolerance=1e-9)
    one, two = simulate_drop(quick, case), simulate_drop(scaled_by_mass(quick, 3.0), case)
    peak = np.max(one.bearing_force_magnitude)
    assert two.displacement == pytest.approx(one.displacement, abs=1e-11)
    assert two.bearing_force / 3.0 == pytest.approx(one.bearing_force, abs=1e-6 * peak)
    assert two.max_stress == pytest.approx(3.0 * one.max_stress, rel=1e-6)
    assert two.certificate.energy_scale == pytest.approx(3.0 * one.certificate.energy_scale, rel=1e-6)
    factor = 2.0
    slow = replace(case, speed=SPEED / factor, duration=factor * 0.02, output_step=factor * 1e-5)
    two = simulate_drop(slowed_down(quick, factor), slow)
    assert two.displacement == pytest.approx(one.displacement, abs=5e-11)
    assert two.speed * factor == pytest.approx(one.speed, rel=1e-9)
    assert two.bearing_force * factor**2 == pytest.approx(one.bearing_force, abs=5e-3)


def slowed_down(model, factor):
    """Every frequency divided by a factor, gravity by its square: the same path, more slowly."""
    p = model.parameters
    bearing, spin = p.bearing.copy(), p.spin.copy()
    forces = [L.CONTACT_STIFFNESS, L.BALL_STIFFNESS, L.SUPPORT_STIFFNESS_X, L.SUPPORT_STIFFNESS_Y]
    rates = [
        L.STRIBECK_SPEED, L.SMOOTHING_SPEED, L.DRAG_SPEED,
        L.BEARING_DAMPING, L.SUPPORT_DAMPING_X, L.SUPPORT_DAMPING_Y,
    ]  # fmt: skip
    bearing[:, forces] /= factor**2
    bearing[:, rates] /= factor
    bearing[:, L.CONTACT_DAMPING] *= factor
    spin[L.AERO_TIME_CONSTANT] *= factor
    return with_parameters(
        model,
        eigenvalue=p.eigenvalue / factor**2,
        damping=p.damping / factor,
        gravity=p.gravity / factor**2,
        bearing=bearing,
        spin=spin,
    )


def test_losses_are_counted_and_no_contact_force_is_negative_or_acts_without_indentation(drop, quick):
    """Stored, dissipated and supplied energy balance, and no contact gains energy."""
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    assert np.all(drop.contacts.dissipated_energy > 0.0)
    lost = drop.state[:, quick.layout.dissipated]
    assert np.min(np.diff(lost)) > -1e-9  # between steps the interpolation may fall by as much
    assert np.min(drop.contact_force) == 0.0
    assert np.all((drop.contact_force > 0.0) <= (drop.indentation > 0.0))
    assert np.max(drop.contact_force) > 1000.0


def test_at_rest_the_bearings_carry_the_weight_and_a_heavily_damped_drop_settles_there(paper, quick):
    state = quick.layout.zeros()
    state[: quick.layout.n_coordinates] = settled_coordinates(quick)
    case = DropCase(
        speed=0.0, duration=0.005, start=StateStart(state=state), spin="coasting", tolerance=1e-10
    )
    result = simulate_drop(quick, case)
    weight = paper.rotor.mass * float(paper.gravity)
    assert np.sum(result.contact_force, axis=1) == pytest.approx(weight, rel=1e-5)
    assert np.sum(result.bearing_force[..., 1], axis=1) == pytest.approx(weight, rel=1e-5)
    assert result.contact_force[0] == pytest.approx(quick.load_shares, rel=1e-6)
    assert np.max(np.abs(result.displacement - result.displacement[0])) < 1e-12
    columns = {L.FRICTION_STATIC: 0.0, L.FRICTION_DYNAMIC: 0.0, L.CONTACT_DAMPING: 3.0}
    model = with_columns(quick, columns | {L.SUPPORT_DAMPING_X: 1e5, L.SUPPORT_DAMPING_Y: 1e5})
    model = with_parameters(model, damping=np.full_like(quick.parameters.damping, 50.0))
    result = simulate_drop(model, DropCase(speed=0.0, duration=0.4, spin="coasting", output_step=1e-4))
    rest = settled_coordinates(model)
    assert np.sum(result.contact_force[-1]) == pytest.approx(paper.rotor.mass * 9.81, rel=1e-3)
    shape = model.parameters.bearing_shape
    assert result.displacement[-1, :, 1] == pytest.approx(shape @ rest[model.layout.modal_y], abs=2e-8)


def contact_on_race(model, azimuth, speed, velocity=(0.0, 0.0), depth=20e-6):
    """Force [N] of the rotor on each race when it stands at a depth in a direction, races at rest."""
    layout = model.layout
    case = DropCase(speed=speed, spin="coasting")
    _, p = start_of_drop(model, case)
    away = np.array([np.cos(azimuth), np.sin(azimuth)])
    nodes = [b.node for b in model.machine.touchdown_bearings]
    positions = np.asarray(model.fe.node_positions)[np.array(nodes) - 1]
    place = rigid_amplitudes(model, positions, (p.bearing[:, L.AIR_GAP] + depth)[:, None] * away)
    moving = rigid_amplitudes(model, positions, np.tile(velocity, (len(nodes), 1)))
    state = layout.zeros()
    state[layout.modal_x], state[layout.modal_y] = place[:, 0], place[:, 1]
    for k, part in enumerate((layout.modal_x, layout.modal_y)):
        state[layout.velocity_of(part)] = moving[:, k]
    state[layout.rotor_speed] = speed
    rate, work = layout.zeros(), scratch_of(p)
    drop_derivative(0.0, state, p, rate, work)
    force = rate[layout.velocity_of(layout.race)].reshape(-1, 2) * p.bearing[:, [L.RACE_MASS]]
    return force, rate, p


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
@pytest.mark.parametrize("azimuth", AZIMUTHS)
def test_friction_is_perpendicular_and_opposes_sliding(quick, azimuth, speed):
    force, rate, p = contact_on_race(quick, azimuth, speed)
    normal = np.array([np.cos(azimuth), np.sin(azimuth)])
    tangent = np.array([-np.sin(azimuth), np.cos(azimuth)])
    pressing, dragging = force @ normal, force @ tangent
    elastic = p.bearing[:, L.CONTACT_STIFFNESS] * 20e-6 ** p.bearing[:, L.CONTACT_EXPONENT]
    assert pressing == pytest.approx(elastic, rel=1e-9)
    slip = speed * p.bearing[:, L.ROTOR_RADIUS]
    excess = p.bearing[:, L.FRICTION_STATIC] - p.bearing[:, L.FRICTION_DYNAMIC]
    decay = np.exp(-(np.abs(slip) - p.bearing[:, L.SMOOTHING_SPEED]) / p.bearing[:, L.STRIBECK_SPEED])
    mu = p.bearing[:, L.FRICTION_DYNAMIC] + excess * decay
    assert dragging == pytest.approx(np.sign(speed) * mu * elastic, rel=1e-9)
    layout = quick.layout
    brakes = rate[layout.rotor_speed] * p.spin[L.POLAR_INERTIA]
    assert brakes == pytest.approx(-np.sum(dragging * p.bearing[:, L.ROTOR_RADIUS]), rel=1e-9)
    assert rate[layout.race_spin] * p.bearing[:, L.RACE_INERTIA] == pytest.approx(
        dragging * p.bearing[:, L.BORE_RADIUS], rel=1e-9
    )
    assert rate[layout.dissipated] > 0.0


@pytest.mark.parametrize("azimuth", AZIMUTHS)
def test_the_race_is_never_pulled(quick, azimuth):
    """However fast the rotor leaves, the contact force only vanishes."""
    away = -20.0 * np.array([np.cos(azimuth), np.sin(azimuth)])
    model = with_columns(quick, {L.CONTACT_DAMPING: 0.1})
    force, _, _ = contact_on_race(model, azimuth, 0.0, velocity=away)
    assert np.max(np.abs(force)) < 1e-9  # what rounding leaves of the balls
    slow, _, _ = contact_on_race(model, azimuth, 0.0, velocity=away / 20.0)
    assert np.all(slow @ away < 0.0)


def test_free_fall_is_a_parabola_and_a_dragged_race_takes_momentum(quick):
    result = simulate_drop(quick, DropCase(speed=0.0, duration=0.005, start=CentredStart(), spin="coasting"))
    expected = -0.5 * 9.81 * result.time**2
    assert result.displacement[:, :, 1] == pytest.approx(np.column_stack([expected, expected]), abs=1e-12)
    # Angular momentum: what friction takes from the rotor drives the races.
    model = with_columns(quick, {L.DRAG_COEFFICIENT: 0.0})
    result = simulate_drop(model, DropCase(speed=SPEED, duration=0.02, spin="coasting", tolerance=1e-8))
    p = model.parameters
    ratio = p.bearing[:, L.ROTOR_RADIUS] / p.bearing[:, L.BORE_RADIUS]
    gained = (result.race_speed[-1] * p.bearing[:, L.RACE_INERTIA]) @ ratio
    lost = p.spin[L.POLAR_INERTIA] * (SPEED - result.speed[-1])
    assert gained > 0.01
    assert gained == pytest.approx(lost, rel=1e-7)
