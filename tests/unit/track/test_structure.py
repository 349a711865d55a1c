"""What a machine may have beyond the usual model, springs included: laws, and what the filter makes of it."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from tests.unit.track.conftest import flight_of
from tests.unit.track.test_propagation import (
    advanced,
    finite_differences,
    relative_errors,
    start_of,
    theta_of,
)

from rotordrop import DropCase, Known, build_drop_model, simulate_drop
from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import UsageError
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.physics import support
from rotordrop.physics.ring import row_rigidity
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.track.calibration import BLIND_SCHEDULE, is_inconsistent, track
from rotordrop.track.forces import force_history
from rotordrop.track.problem import RecordedDrop, build_problem, sensor_rows
from rotordrop.track.sensor_form import add_seen, lag_step
from rotordrop.track.smoother import fastest_frequency
from rotordrop.twin.problems import COARSE_BASIS

STRUCTURE = {
    "support.coupling": 0.2,
    "support.cubic": 5e7,
    "support.friction": 40.0,
    "support.foundation_share": 0.1,
    "support.foundation_frequency": 600.0,
    "support.foundation_damping_ratio": 0.03,
    "landing_sleeve.eccentricity": 12e-6,
    "landing_sleeve.oval": 5e-6,
}


def structured(machine, status="guess"):
    """The machine with a stiffer rotor, slow clock, side force, turned and cubic supports, oval sleeves."""
    values = {
        f"{bearing.name}.{path}": Known(value=value, status=status)
        for bearing in machine.touchdown_bearings
        for path, value in STRUCTURE.items()
    }
    others = {"rotor.stiffness_factor": 1.02, "clock_error": 0.01, "side_force": 0.05}
    return machine.with_values(values | {path: Known(value=v, status=status) for path, v in others.items()})


def sensing(machine):
    """The machine whose sensors lag, see across, move with the housing and stand beside their nodes."""
    values = {"time_constant": 8e-5, "cross_axis": 0.02, "follows_housing": 0.3, "plane_offset": 4e-3}
    return machine.with_values(
        {
            f"sensors.{sensor.name}.{path}": Known(value=value, status="guess")
            for sensor in machine.sensors
            for path, value in values.items()
        }
    )


# the support


def form_of(**entries):
    form = np.zeros(support.N_ENTRIES)
    for name, value in entries.items():
        form[getattr(support, name)] = value
    return form


def test_a_support_turned_by_an_angle_is_stiff_along_its_own_axes():
    k_1, k_2, turn = 1.3e8, 0.8e8, math.radians(30.0)
    c, s = math.cos(turn), math.sin(turn)
    k_x, k_y = k_1 * c * c + k_2 * s * s, k_1 * s * s + k_2 * c * c
    form = form_of(COUPLING=(k_1 - k_2) * s * c / math.sqrt(k_x * k_y))
    for stiffness, (x, y) in ((k_1, (c, s)), (k_2, (-s, c))):
        force = support.support_force(form, k_x, k_y, 0.0, 0.0, 1e-5 * x, 1e-5 * y, 0.0, 0.0)
        assert force[:2] == pytest.approx((1e-5 * stiffness * x, 1e-5 * stiffness * y), rel=1e-12)


@pytest.mark.parametrize("entries", [{"COUPLING": 0.4}, {"CUBIC": 4e8}, {"CUBIC": -1e8, "COUPLING": -0.3}])
def test_force_is_the_slope_of_the_energy(entries):
    form, k_x, k_y, at = form_of(**entries), 0.7e8, 1e8, np.array([21e-6, -33e-6])
    force = support.support_force(form, k_x, k_y, 0.0, 0.0, at[0], at[1], 0.0, 0.0)
    step = 1e-9
    for axis in range(2):
        ends = [at + sign * step * np.eye(2)[axis] for sign in (1.0, -1.0)]
        energy = [support.support_energy(form, k_x, k_y, *end) for end in ends]
        assert (energy[0] - energy[1]) / (2 * step) == pytest.approx(force[axis], rel=1e-6)


def test_a_support_loses_what_its_force_does_beyond_that_of_its_springs():
    form = form_of(COUPLING=0.4, CUBIC=4e8, FRICTION=600.0)
    springs, rate = (form, 0.7e8, 1e8), np.array([0.02, -0.05])
    place, dampers = (21e-6, -33e-6), (3e3, 5e3)
    *still, lost_at_rest = support.support_force(*springs, *dampers, *place, 0.0, 0.0)
    *moving, lost = support.support_force(*springs, *dampers, *place, *rate)
    assert lost_at_rest == 0.0
    assert lost == pytest.approx((np.array(moving) - still) @ rate, rel=1e-9)
    rubbing = (np.array(moving) - still) - np.array(dampers) * rate
    assert np.linalg.norm(rubbing) == pytest.approx(600.0, rel=1e-3)  # at a hundred times the slow speed
    assert rubbing / np.linalg.norm(rubbing) == pytest.approx(rate / np.linalg.norm(rate), rel=1e-9)


@pytest.mark.parametrize("x", [1e-6, 1e-5, 1e-4, 5e-4])
def test_a_softening_spring_never_pulls(x):
    assert support.support_force(form_of(CUBIC=-1e9), 1e8, 1e8, 0.0, 0.0, x, 0.0, 0.0, 0.0)[0] > 0.0


def test_supports_beyond_springs_keep_books_and_plain_ones_their_bits(lp400):
    case = DropCase(speed=2.0 * math.pi * 60.0, duration=0.05)
    result, plain = simulate_drop(structured(lp400), case), simulate_drop(lp400, case)
    assert result.certificate is not None
    assert result.certificate.energy_residual < 1e-6 * result.certificate.energy_scale
    apart = np.abs(result.bearing_force - plain.bearing_force).max()
    assert apart > 0.05 * np.abs(plain.bearing_force).max()
    model = build_drop_model(lp400, "quick")
    assert not model.parameters.bearing[:, L.SUPPORT_FORM : L.SUPPORT_FORM_END].any()
    assert model.layout.further == () and model.layout.sensor_own == 0
    neutral = lp400.with_values({f"{n}.support.coupling": 0.0 for n in model.bearing_names})
    case = DropCase(speed=2.0 * math.pi * 60.0, duration=0.02)
    one, two = (simulate_drop(machine, case).bearing_force for machine in (lp400, neutral))
    assert np.abs(one - two).max() < 1e-5 * np.abs(one).max()


# the unknowns


@pytest.fixture(scope="module")
def described(lp400):
    """The machine with nothing said of what spins with its races."""
    return loads_machine(re.sub(r"\[touchdown_bearings\.race\]\n(?:\w.*\n)*", "", machine_text(lp400)))


@pytest.mark.parametrize("extension", EXTENSIONS, ids=lambda extension: extension.name)
def test_an_extension_adds_unknowns_and_a_machine_file_holds_them(described, extension):
    extended = extension.added_to(described)
    assert loads_machine(machine_text(extended)) == extended
    assert extension.values(described) and not extension.values(extended)  # what is named is not named anew
    usual = {u.path: u.sigma for u in all_unknowns(build_drop_model(described, COARSE_BASIS))}
    found = {u.path: u for u in all_unknowns(build_drop_model(extended, COARSE_BASIS))}
    assert set(usual) <= set(found)
    wider = [path for path, sigma in usual.items() if found[path].sigma > 1.5 * sigma]
    assert set(found) - set(usual) or wider
    for path in set(found) - set(usual):
        low, high = found[path].bounds
        of_record = extension.owner == "drop" or extension.name in ("eccentric sleeve", "oval sleeve")
        assert low <= found[path].mean < high and (found[path].scope == "drop") == of_record, path


def test_half_of_a_foundation_or_of_the_lags_is_refused(lp400, prepared):
    with pytest.raises(UsageError, match=r"'foundation_share' but no 'foundation_frequency'"):
        lp400.with_values({"NDE.support.foundation_share": 0.1})
    machine = lp400.with_values({f"sensors.{lp400.sensors[0].name}.time_constant": 5e-5})
    with pytest.raises(UsageError, match="1 of 4 sensors have a 'time_constant'"):
        flight_of(machine, prepared)


def test_what_both_sensors_of_a_plane_see_across_is_a_turn_and_has_a_prior_of_its_own(lp400, prepared):
    machine = next(e for e in EXTENSIONS if e.name == "cross-axis sensitivity").added_to(lp400)
    problem = flight_of(machine, prepared)
    names = [sensor.name for sensor in machine.sensors if sensor.node == machine.sensors[0].node]
    at = [problem.n_dynamic + k for k, u in enumerate(problem.unknowns) if u.owner in names]
    block = problem.covariance[np.ix_(at, at)]
    together, apart = np.array([0.5, 0.5]), np.array([0.5, -0.5])
    assert math.sqrt(together @ block @ together) == pytest.approx(0.003, rel=0.05)
    assert math.sqrt(apart @ block @ apart) == pytest.approx(0.03 / math.sqrt(2.0), rel=0.05)


# the filter


@pytest.fixture(scope="module")
def extended_flight(lp400, prepared):
    return flight_of(structured(lp400), prepared)


@pytest.mark.parametrize("indentation", [-60e-6, 8e-6])  # what the sleeves take of it leaves some
def test_the_sensitivity_of_such_a_machine_is_that_of_finite_differences(extended_flight, indentation):
    problem = extended_flight
    y, theta = start_of(problem.model, indentation), theta_of(problem)
    y[problem.model.layout.further_at(L.BEARING_OWN)] = np.resize([2e-6, -3e-6, 1e-3, -2e-3], 8)
    _, F, _ = advanced(problem, y, theta, 64)
    errors = relative_errors(problem, F, finite_differences(problem, y, theta, 64))
    assert errors[: problem.n_dynamic].max() < 3e-4
    assert errors.max() < 5e-3


def test_of_a_slow_clock_a_sample_lasts_longer(extended_flight):
    problem, layout = extended_flight, extended_flight.model.layout
    turns = []
    for slow in (0.0, 0.01):
        y, theta = start_of(problem.model, -60e-6), theta_of(problem)
        theta[[u.path for u in problem.unknowns].index("clock_error")] = slow
        after, _, _ = advanced(problem, y, theta, 8)
        turns.append(after[layout.rotor_angle] - y[layout.rotor_angle])
    assert turns[0] > 0.0 and turns[1] / turns[0] == pytest.approx(1.01, rel=1e-5)


@pytest.fixture(scope="module")
def lagging(lp400, prepared):
    return flight_of(sensing(lp400), prepared)


def test_a_lag_follows_a_straight_line_exactly(lagging):
    """Of a ramp, a first-order lag stays behind by slope times time constant, whatever the sampling."""
    problem, dt, slope = lagging, 5e-5, 0.07
    layout, s = problem.model.layout, problem.n_dynamic
    estimate = problem.mean[: s + len(problem.unknowns)].copy()
    estimate[:s] = 0.0
    form = problem.sensor_form._replace(term=np.zeros((0, 2), dtype=np.int64), term_row=np.zeros((0, s)))
    seen = form.lag_row[0]
    for step in range(60):
        after = estimate.copy()
        after[layout.modal_x], after[layout.modal_y] = (
            slope * (step + 1) * dt * seen[part] / (seen @ seen) for part in (layout.modal_x, layout.modal_y)
        )
        lag_step(estimate, after, form, dt, np.zeros((s, len(estimate))))
        estimate = after
    behind = slope * 60 * dt - estimate[layout.sensors.start]
    assert behind == pytest.approx(slope * 8e-5 * (1.0 - math.exp(-60 * dt / 8e-5)), rel=1e-9)


def test_the_sensitivity_of_a_lag_is_that_of_finite_differences(lagging, random):
    problem = lagging
    s, n = problem.n_dynamic, problem.n_dynamic + len(problem.unknowns)
    before = problem.mean[:n].copy()
    before[:s] += 1e-5 * random.standard_normal(s)

    def stepped(start):
        after = start.copy()
        after[:s] = motion @ start[:s]
        lag_step(start, after, problem.sensor_form, 5e-5, np.zeros((s, n)))
        return after[:s]

    motion = np.eye(s) + 0.05 * random.standard_normal((s, s))
    F = np.zeros((s, n))
    F[:, :s] = motion
    after = before.copy()
    after[:s] = motion @ before[:s]
    lag_step(before, after, problem.sensor_form, 5e-5, F)
    rows = problem.model.layout.sensors
    for j in range(n):
        step = 1e-7 if j < s else 1e-5
        ends = [stepped(before + sign * step * np.eye(n)[j])[rows] for sign in (1.0, -1.0)]
        assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(F[rows, j], rel=1e-4, abs=1e-8)


def test_sensors_read_as_their_form_says(lp400, prepared):
    """The reading predicted is that of the machine by hand: across, with the housing, beside the node."""
    seen = sensing(lp400)
    prompt = tuple(one.model_copy(update={"time_constant": None}) for one in seen.sensors)
    machine = seen.model_copy(update={"sensors": prompt})
    problem = flight_of(machine, prepared)
    layout, basis = problem.model.layout, problem.model.basis
    state = np.random.default_rng(2).standard_normal(problem.n_dynamic) * 1e-5
    sensor = machine.sensors[0]
    z = np.asarray(problem.model.fe.node_positions)
    shaft = CubicSpline(z, basis.shapes[0::2])
    rows = shaft(z[sensor.node - 1] + 4e-3), basis.node_row(sensor.node)
    (x, y), (plain_x, plain_y) = ((row @ state[layout.modal_x], row @ state[layout.modal_y]) for row in rows)
    b = problem.model.bearing_names.index(sensor.bearing)
    hx, hy = state[layout.support][2 * b : 2 * b + 2]
    c, s = math.cos(float(sensor.angle)), math.sin(float(sensor.angle))
    expected = c * (x - 0.3 * hx) + s * (y - 0.3 * hy) + 0.02 * (-s * plain_x + c * plain_y)
    estimate = np.concatenate([state, [u.begin for u in problem.unknowns]])
    row = np.zeros_like(estimate)
    seen = add_seen(0, estimate, problem.sensor_rows[0], problem.sensor_form, problem.n_dynamic, 1.0, row)
    assert seen == pytest.approx(expected, rel=1e-9)


SPRINGS = 'preload_kind = "spring"\nspring_rate = "1e5 N/m"\nfit_friction = 0.0\npreload = { guess'
SPEED, NOISE = 900.0, 0.3e-6


@pytest.mark.slow
def test_rings_without_friction_in_their_fits_are_followed():
    text = example_path("small").read_text(encoding="utf-8").replace("preload = { guess", SPRINGS)
    model = build_drop_model(loads_machine(text), COARSE_BASIS)
    case = DropCase(speed=SPEED, duration=0.03, output_step=50e-6)
    drop = simulate_drop(model, case)
    seen = drop.state[:, : model.layout.n_dynamic] @ sensor_rows(model).T
    noise = NOISE * np.random.default_rng(1).standard_normal(seen.shape)
    touched = np.any(drop.contact_force > 0.0, axis=1)
    recorded = RecordedDrop(
        time=drop.time,
        readings=seen + noise,
        noise=np.full(seen.shape[1], NOISE),
        initial_speed=SPEED,
        initial_speed_error=1.0,
        speed=np.full(len(drop.time), np.nan),
        tail_level=None,
        first_contact=float(drop.time[touched][0]),
    )
    problem = build_problem(model, recorded, until=0.03)
    fit = track([problem], BLIND_SCHEDULE[:4])
    assert not is_inconsistent(fit)
    forces = force_history(problem, fit.smoothed[0])
    for b in range(2):
        window = drop.time <= forces.time[-1]
        peak = np.max(drop.bearing_force_magnitude[window, b])
        assert np.max(forces.magnitude[:, b]) == pytest.approx(peak, rel=0.1)


def test_a_light_ring_sets_the_steps_of_the_filter():
    """Its frequency on balls at eight times their load; a heavy one is slower than the race."""
    text = example_path("small").read_text(encoding="utf-8")

    def fastest(*lines):
        machine = loads_machine(text.replace("preload = { guess", "\n".join((*lines, "preload = { guess"))))
        return fastest_frequency(SimpleNamespace(model=build_drop_model(machine, COARSE_BASIS)))

    spring = 'preload_kind = "spring"'
    light = fastest(spring, 'ring_mass = "4 g"')
    assert fastest(spring, 'ring_mass = "1 g"') == pytest.approx(2.0 * light, rel=1e-6)
    assert light > fastest() == fastest(spring, 'ring_mass = "4 kg"')
    stiffness = row_rigidity(loads_machine(text).touchdown_bearings[0].bearing.numbers().constants)
    assert light == pytest.approx((2.0 * stiffness / 4e-3) ** 0.5, rel=1e-6)
