"""Priors of the unknowns, what the settled tail says about them, and the readings of the levitated phase."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine
from tests.unit.track.conftest import flight_of, place_of

from rotordrop import build_drop_model, example_machine, read_record
from rotordrop.elements.table import EXTENSIONS, parameter
from rotordrop.errors import IdentificationError, RecordError
from rotordrop.evidence.colour import SlowNoise
from rotordrop.evidence.evidence import Missing, read_evidence
from rotordrop.known import NINETY, Known
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import held_lightly
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.unknowns import aero_time_constant, all_unknowns, inferred_together, prior, smallest_gap
from rotordrop.simulate.levitation import levitated_orbit
from rotordrop.track.prior import START_ORBIT_SIGMA, prior_at_power_off
from rotordrop.track.problem import (
    NOISE_FLOOR,
    TAIL_VERTICAL_SIGMA,
    RecordedDrop,
    apply_tail,
    build_problem,
    sensor_rows,
    settled_displacement,
    transferred,
)
from rotordrop.twin.problems import COARSE_BASIS, drop_problem, recorded_drop

NO_TAIL = Missing(reason="none was given")


def unknown_of(machine, path):
    return next(u for u in all_unknowns(build_drop_model(machine, COARSE_BASIS)) if u.path == path)


# priors


@pytest.mark.parametrize(
    ("quantity", "expected"),
    [
        (Known(value=1e8, status="guess", range=(0.5e8, 2e8)), math.log(4.0) / (2 * NINETY)),
        (Known(value=1e8, status="estimated", interval_90=(0.9e8, 1.1e8)), math.log(11 / 9) / (2 * NINETY)),
        (
            Known(value=1e8, status="estimated", interval_90=(0.99e8, 1.01e8), range=(0.5e8, 2e8)),
            math.log(101 / 99) / (2 * NINETY),
        ),
        (Known(value=1e8, status="estimated", standard_error=2e6), 0.02),
        (Known(value=1e8, status="guess"), 0.5),
        (Known(value=1e8, status="default"), 0.5),
        (Known(value=1e8, status="given"), 0.05),
        (Known(value=1e8, status="estimated", interval_90=(1e8, 1e8)), 1e-4),
    ],
)
def test_the_prior_comes_from_interval_range_error_or_status(quantity, expected):
    assert prior(parameter("support.stiffness"), quantity).sigma == pytest.approx(expected)


def race_errors(machine):
    """Prior covariance of mass and inertia of the race at NDE, of their logarithms."""
    model = build_drop_model(machine, COARSE_BASIS)
    unknowns = all_unknowns(model)
    places = [[u.path for u in unknowns].index(f"NDE.race.{part}") for part in ("mass", "inertia")]
    block = np.diag([u.sigma**2 for u in unknowns])
    inferred_together(model, unknowns, block)
    return block[np.ix_(places, places)]


def test_a_race_that_is_heavier_than_inferred_is_as_much_harder_to_turn(lp400):
    unstated = {"NDE.race.mass": Known(value=0.3, status="inferred", range=(0.24, 0.375))}
    inertia = Known(value=6e-4, status="inferred", range=(6e-4 / 1.41, 6e-4 * 1.41))
    both = race_errors(lp400.with_values(unstated | {"NDE.race.inertia": inertia}))
    form = both[0, 0] + both[1, 1] - 2.0 * both[0, 1]
    assert NINETY * math.sqrt(both[0, 0]) == pytest.approx(math.log(1.25))
    assert NINETY * math.sqrt(form) == pytest.approx(math.log(1.3), rel=0.01)
    stated = race_errors(lp400.with_values(unstated | {"NDE.race.inertia": 6e-4}))
    assert stated[0, 1] == 0.0


def test_a_race_of_which_nobody_said_what_spins_along_may_be_heavier_and_begins_so(lp400):
    rings = next(one for one in EXTENSIONS if one.name == "ring masses")
    assert rings.values(lp400) == {}  # its masses are stated
    inferred = Known(value=0.3, status="inferred", range=(0.24, 0.375), unit="kg")
    unstated = lp400.with_values({"NDE.race.mass": inferred})
    heavier = rings.added_to(unstated)
    assert set(rings.values(unstated)) == {"NDE.race.mass", "NDE.race.inertia"}
    assert rings.values(heavier) == {}
    mass = unknown_of(heavier, "NDE.race.mass")
    assert mass.value_of(mass.begin) == pytest.approx(0.6)
    assert mass.value_of(mass.mean + NINETY * mass.sigma) == pytest.approx(1.5)
    found = {"NDE.race.mass": Known(value=0.69, interval_90=(0.66, 0.72), unit="kg")}
    assert "NDE 0.690 kg (0.660 to 0.720)" in rings.found(unstated, found, 300.0)


def test_what_a_drop_owns_is_not_shared_and_friction_drifts(flight):
    scopes = {u.path: u.scope for u in flight.unknowns}
    assert scopes["unbalance.0.cosine"] == scopes["NDE.remanent_force.y"] == "drop"
    assert scopes["speed.aero_time_constant"] == scopes["remanence.time_constant"] == "drop"
    assert scopes["NDE.air_gap"] == scopes["DE.friction.dynamic"] == "machine"
    shared = set(flight.machine_indices.tolist())
    start, n_p, n_c = flight.n_dynamic, len(flight.unknowns), flight.n_channels
    for k, unknown in enumerate(flight.unknowns):
        assert (start + k in shared) == (unknown.scope == "machine")
    assert {start + n_p + i for i in range(2 * n_c)} <= shared
    assert not shared & {start + n_p + i for i in range(2 * n_c, 4 * n_c)}  # runout turns with the drop
    by_path = {u.path: (u, i) for i, u in enumerate(flight.unknowns)}
    friction, i = by_path["NDE.friction.dynamic"]
    stiffness, k = by_path["NDE.support.stiffness"]
    factor = friction.parameter.late_drift_factor
    assert flight.targets.drift[i] == friction.parameter.drift > 0.0 and factor > 1.0
    assert flight.targets.late_drift[i] == factor * flight.targets.drift[i]
    assert flight.targets.late_drift[k] == flight.targets.drift[k] == stiffness.parameter.drift > 0.0
    g = by_path["NDE.air_gap"][1]
    assert flight.targets.drift[g] == pytest.approx(0.032 * 250e-6)
    assert by_path["NDE.preload"][0].parameter.drift == 0.0


def test_a_loose_race_is_followed_held_lightly_with_its_play_in_the_gap(lp400):
    machine = scaled_machine(60.0, bearing='{ designation = "6015", clearance = "20 um" }')
    as_described = build_drop_model(machine, "quick")
    held = held_lightly(as_described)
    gap = as_described.parameters.bearing[:, L.AIR_GAP]
    np.testing.assert_allclose(held.play[0], 10e-6, atol=2e-6)  # half the clearance, and what balls give way
    np.testing.assert_allclose(held.play[1], 0.5 * (30e-6 - 10e-6) / (2.0 * NINETY), rtol=1e-9)  # CN, 75 mm
    np.testing.assert_allclose(held.parameters.bearing[:, L.AIR_GAP], gap + held.play[0], rtol=1e-12)
    assert not as_described.parameters.bearing[:, L.AXIAL_OFFSET].any()
    assert (held.parameters.bearing[:, L.AXIAL_OFFSET] > 0.0).all()
    unknowns = {u.path: u for u in all_unknowns(held)}
    assert "NDE.preload" not in unknowns
    assert unknowns["NDE.air_gap"].targets[0].shift == pytest.approx(held.play[0, 0], rel=1e-9)
    ungiven = (
        '{ rows = 1, clearance = "0 um", ball_diameter = "13 mm", ball_count = 14, pitch_diameter = "95 mm" }'
    )
    no_play = held_lightly(build_drop_model(scaled_machine(60.0, bearing=ungiven), "quick"))
    assert no_play.play_sigma(0) == pytest.approx(held.play_sigma(0))  # by the bore that the balls leave
    rigid = build_drop_model(lp400, "quick")
    assert held_lightly(rigid) is rigid


def test_unknowns_are_there_with_and_without_magnets_and_drag(lp400):
    bare = lp400.model_copy(update={"ambs": ()})
    paths = {u.path for u in all_unknowns(build_drop_model(bare, COARSE_BASIS))}
    assert not any("remanen" in path for path in paths)
    assert "NDE.air_gap" in paths
    assert lp400.speed.aero_time_constant is None
    assert aero_time_constant(lp400) == 10.0
    assert aero_time_constant(lp400.with_values({"speed.aero_time_constant": 7.0})) == 7.0


# the problem


def test_sensors_start_from_what_the_machine_says(lp400, prepared):
    known = lp400.with_values(
        {
            "sensors.S_NDE_A.gain": Known(value=1.02, status="estimated", interval_90=(1.019, 1.021)),
            "sensors.S_NDE_A.offset": Known(value=4e-6, status="estimated", interval_90=(3e-6, 5e-6)),
        }
    )
    problem = flight_of(known, prepared.with_facts(settled_level=NO_TAIL))
    gain = problem.n_dynamic + len(problem.unknowns)
    offset = gain + problem.n_channels
    sigma = np.sqrt(np.diag(problem.covariance))
    assert problem.mean[gain] == pytest.approx(1.0 / 1.02 - 1.0)
    assert sigma[gain] == pytest.approx(0.001 / NINETY)
    assert problem.mean[offset] == pytest.approx(4e-6)
    assert sigma[offset] == pytest.approx(1e-6 / NINETY)
    assert sigma[gain + 1] == pytest.approx(0.01)
    assert sigma[offset + 1] == pytest.approx(0.04 * 250e-6)


def test_the_rotor_starts_where_the_sensors_see_it_with_their_noise(flight, prepared):
    predicted = flight.sensor_rows @ flight.mean[: flight.n_dynamic]
    first = flight.readings[:10].mean(axis=0)
    np.testing.assert_allclose(predicted, first, atol=1e-6)
    bending = flight.mean[flight.model.layout.modal_y][2:]
    assert np.abs(bending).max() > 0.0
    assert np.all(flight.mean[flight.model.layout.modal_x][2:] == 0.0)
    noise = prepared.noise(0.003)
    np.testing.assert_allclose(flight.variances, noise**2 + NOISE_FLOOR**2)
    assert np.all((noise > 0.2e-6) & (noise < 1e-6))


def test_a_record_without_speed_is_refused(model, prepared):
    mute = replace(prepared.record, speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(RecordError, match=r"the record drop_060 has no rotor speed.*profile"):
        read_evidence(model, mute, name="drop_060")


# the settled tail


@pytest.fixture(scope="module")
def loose(model, prepared):
    """The problem before the tail is used."""
    return drop_problem(model, prepared.with_facts(settled_level=NO_TAIL), until=0.003)


def height_at_sensors(problem, theta):
    """Settled readings of perfect sensors: only the height is known, the rotor may be held aside."""
    angles = np.array([float(sensor.angle) for sensor in problem.model.machine.sensors])
    return np.sin(angles) * settled_displacement(problem, theta)[1]


def test_the_rotor_settles_below_the_gap_by_its_indentation(loose):
    theta = loose.mean[loose.parameter_slice]
    level = settled_displacement(loose, theta)[1]
    assert np.all((level > -300e-6) & (level < -250e-6))
    wider = theta.copy()
    paths = [u.path for u in loose.unknowns]
    wider[[paths.index("NDE.air_gap"), paths.index("DE.air_gap")]] += 10e-6
    np.testing.assert_allclose(settled_displacement(loose, wider)[1], level - 10e-6, atol=1e-12)
    softer = theta.copy()
    softer[paths.index("NDE.support.stiffness")] -= math.log(2.0)
    assert settled_displacement(loose, softer)[1, 0] < level[0]


def test_the_tail_ties_gap_and_offset(loose):
    theta = loose.mean[loose.parameter_slice]
    tail = height_at_sensors(loose, theta)
    angles = np.array([float(sensor.angle) for sensor in loose.model.machine.sensors])
    lower = tail - 8e-6 * np.sin(angles)
    mean, covariance = loose.mean.copy(), loose.covariance.copy()
    apply_tail(loose, lower, mean, covariance)
    gap = place_of(loose, "NDE.air_gap")
    offsets = loose.n_dynamic + len(loose.unknowns) + loose.n_channels + np.arange(2)
    assert mean[gap] - loose.mean[gap] > 2e-6
    down = -np.sum(mean[offsets]) / (2.0 * math.sin(math.pi / 4))
    gains = mean[offsets - loose.n_channels] @ (np.sin(angles[:2]) ** 2 * tail[:2] / np.sin(angles[:2]))
    stiff = place_of(loose, "NDE.support.stiffness")
    assert abs(mean[stiff] - loose.mean[stiff]) < 0.05
    explained = (mean[gap] - loose.mean[gap]) + down - gains
    assert explained == pytest.approx(8e-6, abs=1.5e-6)
    sigma = np.sqrt(np.diag(covariance))
    assert sigma[gap] < 0.5 * math.sqrt(loose.covariance[gap, gap])
    assert sigma[gap] > 3.0 * TAIL_VERTICAL_SIGMA * 250e-6  # not separable from the offset
    row = np.zeros(len(mean))
    row[gap], row[offsets] = -1.0, np.array([0.5, 0.5]) / math.sin(math.pi / 4)
    row[offsets - loose.n_channels] = row[offsets] * tail[:2]
    assert math.sqrt(row @ covariance @ row) < 1.5e-6
    unit = np.maximum(sigma, 1e-12)
    assert np.linalg.eigvalsh(covariance / np.outer(unit, unit))[0] > -1e-8


def test_a_tail_far_from_the_guessed_gaps_is_met_at_both_ends(loose):
    """Each plane sees both gaps: what the one has moved the other one begins with."""
    angles = np.array([float(sensor.angle) for sensor in loose.model.machine.sensors])
    lower = height_at_sensors(loose, loose.mean[loose.parameter_slice]) - 40e-6 * np.sin(angles)
    mean, covariance = loose.mean.copy(), loose.covariance.copy()
    apply_tail(loose, lower, mean, covariance)
    first, n_c = loose.n_dynamic + len(loose.unknowns), loose.n_channels
    gain, offset = mean[first : first + n_c], mean[first + n_c : first + 2 * n_c]
    told = (1.0 + gain) * height_at_sensors(loose, mean[loose.parameter_slice]) + offset
    assert np.abs(told - lower).max() < 0.2e-6, told - lower


def test_the_tail_says_less_of_a_gap_where_a_landing_sleeve_may_be_oval(lp400, prepared, loose):
    oval = {
        f"{b.name}.landing_sleeve.oval": Known(value=20e-6, status="guess") for b in lp400.touchdown_bearings
    }
    problem = flight_of(lp400.with_values(oval), prepared.with_facts(settled_level=NO_TAIL))
    theta = problem.mean[problem.parameter_slice]
    gained = []
    for one in (loose, problem):
        mean, covariance = one.mean.copy(), one.covariance.copy()
        apply_tail(one, height_at_sensors(problem, theta), mean, covariance)
        gap = place_of(one, "NDE.air_gap")
        gained.append(1.0 / covariance[gap, gap] - 1.0 / one.covariance[gap, gap])
    assert gained[1] < 0.5 * gained[0]


def test_a_rotor_held_aside_by_friction_says_nothing_about_the_gap(loose):
    theta = loose.mean[loose.parameter_slice]
    tail = height_at_sensors(loose, theta)
    angles = np.array([float(sensor.angle) for sensor in loose.model.machine.sensors])
    mean, covariance = loose.mean.copy(), loose.covariance.copy()
    apply_tail(loose, tail + 15e-6 * np.cos(angles), mean, covariance)
    np.testing.assert_allclose(mean[loose.parameter_slice], theta, rtol=1e-3, atol=0.3e-6)


def test_a_single_sensor_in_a_plane_cannot_tell_height_from_aside(lp400, prepared):
    three = lp400.model_copy(update={"sensors": lp400.sensors[:3]})
    record = prepared.record
    prepared = prepared.with_facts(
        record=replace(record, signals=record.signals[:, :3].copy(), sensors=three.sensors),
        levitated=prepared.levitated.of_channels(range(3)),
        settled_level=NO_TAIL,
    )
    problem = flight_of(three, prepared)
    mean, covariance = problem.mean.copy(), problem.covariance.copy()
    angles = np.array([float(sensor.angle) for sensor in three.sensors])
    tail = height_at_sensors(problem, mean[problem.parameter_slice])
    apply_tail(problem, tail + 20e-6 * np.cos(angles), mean, covariance)
    variances = []
    for name, limit in (("NDE", 1e-6), ("DE", 15e-6)):
        gap = place_of(problem, f"{name}.air_gap")
        variances.append(covariance[gap, gap])
        assert abs(mean[gap] - problem.mean[gap]) < min(limit, math.sqrt(variances[-1]))
    assert variances[1] > 3.0 * variances[0]


def test_the_settled_level_is_that_of_the_lowest_point_of_the_sway(lp400, prepared):
    sensing, rest = prepared.sensing, prepared.rest
    time = np.arange(3000) * 1e-3
    angle = 0.14 * np.sin(2.0 * np.pi * 29.0 * time)
    place = np.stack([np.outer(np.sin(angle), rest.radius), np.outer(-np.cos(angle), rest.radius)], axis=-1)
    along = np.einsum("sbc,tbc->ts", sensing.from_bearings, place) + sensing.settled_bend
    still = {"speed": None, "speed_time": None, "speed_readings": None}
    tail = replace(prepared.record, time=time, signals=along, sampling_rate=1e3, **still)
    found = read_evidence(build_drop_model(lp400), prepared.record, tail)
    bottom = sensing.from_bearings[..., 1] @ -rest.radius + sensing.settled_bend
    np.testing.assert_allclose(found.settled_level, bottom, atol=2e-8)
    assert np.abs(along.mean(axis=0) - bottom).max() > 0.9e-6


# what the record says


@pytest.fixture(scope="module")
def fast(lp400):
    """A short drop at 150 Hz and what it says."""
    path = Path(__file__).parents[1] / "record" / "recordings" / "drop_150_short.h5"
    return read_evidence(build_drop_model(lp400), read_record(path, lp400), name="fast")


def test_hum_at_60_hz_is_no_noise_of_the_twin(lp400, fast):
    record = fast.record
    hum = 1.5e-6 * np.cos(2.0 * np.pi * 60.0 * record.time[:, None] + np.arange(4))
    noisy = replace(record, signals=record.signals + hum)
    model = build_drop_model(lp400)
    found, plain = (recorded_drop(read_evidence(model, one), 0.1) for one in (noisy, record))
    np.testing.assert_allclose(found.noise, plain.noise, rtol=0.02)
    assert np.abs(found.readings - plain.readings).max() < 0.25e-6


def test_a_speed_given_by_hand_is_no_reading_after_power_off(lp400, fast):
    nominal = replace(
        fast.record,
        speed=np.full(len(fast.record.time), 2.0 * np.pi * 150.2),
        speed_time=fast.record.time[[0, -1]],
        speed_readings=np.full(2, 2.0 * np.pi * 150.2),
        speed_by_hand=True,
    )
    model = build_drop_model(lp400)
    found, plain = (recorded_drop(read_evidence(model, one), 0.1) for one in (nominal, fast.record))
    assert np.all(np.isnan(found.speed)) and np.any(np.isfinite(plain.speed))
    assert found.initial_speed == pytest.approx(plain.initial_speed, abs=0.1)  # the orbit says it


# from one basis to another


def test_a_transferred_trajectory_keeps_the_motion_of_every_node(lp400, prepared, flight, random):
    fine = drop_problem(build_drop_model(lp400, Reduction(modes=10, attachment=True)), prepared, until=0.003)
    means = flight.mean + 1e-5 * random.standard_normal((7, len(flight.mean)))
    moved = transferred(flight, fine, means)
    assert moved.shape == (7, len(fine.mean))
    layouts = flight.model.layout, fine.model.layout
    for part in ("modal_x", "modal_y"):
        one, two = (getattr(layout, part) for layout in layouts)
        for a, b in ((one, two), (layouts[0].velocity_of(one), layouts[1].velocity_of(two))):
            for node in (1, 5, 17, 26, 33):
                before = means[:, a] @ flight.model.basis.node_row(node)
                after = moved[:, b] @ fine.model.basis.node_row(node)
                np.testing.assert_allclose(after, before, rtol=0.02, atol=1e-7)
    for part in ("race", "support", "race_spin"):
        np.testing.assert_array_equal(
            means[:, getattr(layouts[0], part)], moved[:, getattr(layouts[1], part)]
        )
    np.testing.assert_array_equal(means[:, flight.n_dynamic :], moved[:, fine.n_dynamic :])


def test_a_trajectory_carried_over_is_the_same_but_for_other_priors(flight, random, lp400, prepared):
    means = flight.mean + 1e-5 * random.standard_normal((3, len(flight.mean)))
    np.testing.assert_allclose(transferred(flight, flight, means), means, rtol=1e-9, atol=1e-16)
    heavier = Known(value=0.6, status="guess", range=(0.24, 1.5), unit="kg")
    problem = flight_of(lp400.with_values({"NDE.race.mass": heavier}), prepared)
    means = flight.mean + 1e-5 * random.standard_normal((3, len(flight.mean)))
    moved = transferred(flight, problem, means)
    at = place_of(flight, "NDE.race.mass")
    np.testing.assert_allclose(moved[:, at], problem.start[at])
    others = np.arange(len(flight.mean)) != at
    np.testing.assert_allclose(moved[:, others], means[:, others], rtol=1e-9, atol=1e-16)


def test_a_rotor_that_does_not_rest_on_a_bearing_is_refused_with_its_numbers():
    machine = example_machine("lp400")
    bearings = machine.touchdown_bearings
    beside = machine.changed(touchdown_bearings=(bearings[0], bearings[1].changed(node=12)))
    time = np.arange(400) / 20e3
    drop = RecordedDrop(
        time=time,
        readings=np.zeros((len(time), len(beside.sensors))),
        noise=np.full(len(beside.sensors), 1e-6),
        initial_speed=600.0,
        initial_speed_error=0.1,
        speed=np.full(len(time), 600.0),
        tail_level=None,
        first_contact=7e-3,
    )
    expected = r"does not rest on the touchdown bearing NDE \(-\d+ N of .* 584 N\).* expected it between them"
    with pytest.raises(IdentificationError, match=expected):
        build_problem(build_drop_model(beside, COARSE_BASIS), drop)


@pytest.mark.parametrize("speed", [300.0, 500.0, 700.0])
def test_bending_on_the_orbit_of_the_levitated_rotor_lies_in_the_prior(speed, model):
    """A controller that follows the runout of its sensors holds an orbit of some hundredths of the gap."""
    omega, gap = 2.0 * np.pi * speed, smallest_gap(model.machine)
    rows = sensor_rows(model)
    covariance = prior_at_power_off(model, (), rows, np.zeros(len(rows)), (omega, 0.1), SlowNoise())[1]
    for phase in (0.0, 2.0, 4.0):
        held = START_ORBIT_SIGMA * gap * np.exp([0.0, 1j * phase])
        bent = levitated_orbit(model, omega, held)[model.basis.n_rigid :]
        for amplitudes, modes in zip(bent.T, (model.layout.modal_x, model.layout.modal_y), strict=True):
            sigma = np.sqrt(np.diag(covariance)[modes])[model.basis.n_rigid :]
            assert np.all(np.abs(amplitudes[:2]) < 3.0 * sigma[:2])


@pytest.mark.parametrize(("gain", "polarity"), [(1.0, 1), (1.25, 1), (1.25, -1)])
def test_the_rotor_begins_where_gain_offset_and_polarity_put_its_readings(gain, polarity, lp400, model):
    """With an offset of 1.2 mm the filter began 1.2 mm from the bearing, and diverged after one sample."""
    rows, along = sensor_rows(model), np.array([10e-6, -20e-6, 15e-6, 5e-6])

    def began(sensors, readings):
        machine = model_with(sensors)
        return prior_at_power_off(machine, (), rows, readings, (600.0, 0.1), SlowNoise())[0]

    def model_with(sensors):
        return build_drop_model(lp400.model_copy(update={"sensors": tuple(sensors)}), COARSE_BASIS)

    plain = began(lp400.sensors, along)
    changed = [one.changed(gain=gain, polarity=polarity, offset="-1206 um") for one in lp400.sensors]
    read = began(changed, polarity * (polarity * along / gain - 1206e-6))
    dynamic = slice(0, model.layout.n_dynamic)
    assert read[dynamic] == pytest.approx(plain[dynamic], abs=1e-12)
