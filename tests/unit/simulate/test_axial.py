"""Rotors that move along their axis and land on faces: forces, energy, symmetry, release, what is said."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from tests.reference.differences import slopes
from tests.unit.simulate.test_right_hand_side import a_state, both_jacobians

from rotordrop import build_drop_model, load_result, simulate_coast_down, simulate_drop
from rotordrop.elements.face import Face
from rotordrop.errors import MachineFileError
from rotordrop.estimate.simulated_drop import landing_count, simulation_numbers
from rotordrop.evidence.colour import SlowNoise
from rotordrop.evidence.impacts import HOP
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.plausibility import doubts
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.physics.ball_set import ball_set_energy, two_row_axial_force, two_row_force
from rotordrop.physics.face import face_contact, face_energy, mean_friction_radius
from rotordrop.report.simulate_page import simulate_page
from rotordrop.rotor.machine_summary import machine_json, machine_warnings, summarise_machine
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate.case import CentredStart, CoastDownCase, DropCase, LevitatedStart
from rotordrop.simulate.expected_steps import expected_steps
from rotordrop.simulate.losses import losses
from rotordrop.simulate.used import landings
from rotordrop.study.quantities import columns_of, row_of
from rotordrop.track.prior import AXIAL_SIGMA, prior_at_power_off
from rotordrop.track.problem import sensor_rows

TEXT = example_path("small").read_text(encoding="utf-8")
HEAD = '[[touchdown_bearings]]\nname = "DE"\n'
FACE = 'gap = "0.2 mm", inner_radius = "22 mm", outer_radius = "26 mm"'
SPEED = 2.0 * np.pi * 200.0
CASE = DropCase(speed=SPEED, duration=0.02, reduction="quick")
PLACE = "[touchdown_bearings.bearing]\n"


def push(force=1000.0, direction="axial"):
    """An axial load."""
    return f'\n[[loads]]\nnode = 3\ndirection = "{direction}"\nforce = "{force} N"\n'


def text_of(face=FACE, more="", balls=""):
    """The small machine with a face at its DE."""
    before, after = TEXT.split(HEAD)
    table = f"face = {{ {face} }}\n" if face else ""
    for line in balls.splitlines():
        old = re.compile(rf"^{line.split(' ')[0]} = .*\n", re.MULTILINE)
        after = old.sub("", after)
    return f"{before}{HEAD}{table}{after.replace(PLACE, PLACE + balls, 1)}{more}"


def faced(more="", **others):
    """That machine."""
    return loads_machine(text_of(more=more, **others))


@pytest.fixture(scope="module")
def machine():
    return faced(push())


@pytest.fixture(scope="module")
def drop(machine):
    return simulate_drop(build_drop_model(machine, "quick"), CASE)


@pytest.mark.parametrize("place", [(0.0, 0.0, 4e-6), (-20e-6, 9e-6, 12e-6), (5e-6, -30e-6, -25e-6)])
@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_forces_of_the_rows_are_the_slope_of_their_energy(place, offset):
    """And they are those of the sum in five directions, ball by ball."""
    machine = faced(balls=f"second_row_offset = {offset}\n" if offset else "")
    p = build_drop_model(machine, "quick").parameters
    entries, rows = p.bearing[1, L.BALL_SET : L.BALL_SET_END], (p.balls[1], p.balls[3])
    work = np.empty((2, p.balls.shape[2]))

    def energy(x, y, z):
        return ball_set_energy(entries, rows[0], x, y, -z) + ball_set_energy(entries, rows[1], x, y, z)

    slope = slopes(lambda at: energy(*at), place, 1e-8)
    force = (*two_row_force(entries, rows, *place, work), two_row_axial_force(entries, rows, *place, work))
    assert force == pytest.approx(slope, rel=1e-6, abs=1e-3)
    whole = bearing_response(machine.touchdown_bearings[1].bearing.numbers().constants, [*place, 0.0, 0.0])
    assert force == pytest.approx(-whole.force[:3], rel=1e-9, abs=1e-6)


def face_of(**more):
    """A face, and its numbers for the kernel."""
    sizes = {"gap": "0.2 mm", "inner_radius": "32 mm", "outer_radius": "36 mm"}
    face, row = Face.model_validate(sizes | more), np.zeros(L.N_BEARING_COLUMNS)
    face.fill(row)
    return face, row[L.FACE : L.FACE_END]


@pytest.mark.parametrize("side", ["both", "+z", "-z"])
@pytest.mark.parametrize("z", [0.25e-3, -0.23e-3])
def test_the_thrust_of_a_face_is_the_slope_of_its_energy(side, z):
    (face, numbers), step = face_of(side=side, exponent=1.2), 1e-9
    slope = (face_energy(numbers, z + step) - face_energy(numbers, z - step)) / (2.0 * step)
    depth, force, *_ = face_contact(numbers, z, 0.0, 0.0, 0.0, 100.0)
    assert force == pytest.approx(slope, rel=1e-6, abs=1e-9)
    assert (depth > 0.0) == (force != 0.0) == face.stops(math.copysign(1.0, z))


@pytest.mark.parametrize(("across", "slip"), [((0.0, 0.0), 300.0), ((3.0, -4.0), 0.0), ((1.0, 2.0), 50.0)])
def test_friction_of_a_face_opposes_sliding_at_every_point(across, slip):
    radius, mu = mean_friction_radius(0.032, 0.036), 0.1
    _, force, x, y, torque, sliding, _ = face_contact(face_of()[1], 0.21e-3, 0.0, *across, slip)
    assert sliding == pytest.approx(x * across[0] + y * across[1] + torque * slip, rel=1e-12)
    if across == (0.0, 0.0):
        assert torque == pytest.approx(mu * force * radius, rel=1e-12)
        assert math.hypot(x, y) < 1e-9 * force
    elif slip == 0.0:
        assert [x, y] == pytest.approx(mu * force * np.array(across) / math.hypot(*across), rel=1e-12)
    assert 0.0 < sliding <= mu * force * (math.hypot(*across) + abs(slip) * radius) * (1.0 + 1e-9)


def test_the_landing_is_that_of_plain_equations():
    """Of a rotor without weight across: two masses and a spin on the ball sum in five directions."""
    thrust = 400.0
    text = text_of(more=push(thrust)).replace('gravity = "9.81 m/s^2"', 'gravity = "0 m/s^2"')
    model = build_drop_model(loads_machine(text), "quick")
    case = DropCase(
        speed=SPEED, duration=6e-3, reduction="quick", tolerance=1e-9, spin="constant", start=CentredStart()
    )
    drop = simulate_drop(model, case)
    bearing, row = model.machine.touchdown_bearings[1], model.parameters.bearing[1]
    constants, face = bearing.bearing.numbers().constants, bearing.face
    mass, race, inertia = model.machine.rotor.mass, float(bearing.race.mass), float(bearing.race.inertia)

    def damping(u):
        """Equal dashpots along the lines of contact make up the radial damping."""
        offsets = [constants.axial_offset + sign * u for sign in constants.axial_signs]
        angles = [math.atan2(offset, constants.radial_offset) for offset in offsets]
        rest = math.atan2(constants.axial_offset, constants.radial_offset)
        balls = constants.ball_count
        one = row[L.BEARING_DAMPING] / (len(angles) * balls * 0.5 * math.cos(rest) ** 2)
        return sum(balls * one * math.sin(angle) ** 2 for angle in angles)

    def rates(_t, s):
        z, v, u, w, spin = s
        depth = z - u - float(face.gap)
        growth = max(1.0 + 1.5 * float(face.damping) * (v - w), 0.0)
        force = float(face.stiffness) * max(depth, 0.0) * growth
        held = -bearing_response(constants, [0.0, 0.0, u, 0.0, 0.0]).force[2]
        torque = float(face.friction) * force * mean_friction_radius(0.022, 0.026)
        drag = row[L.DRAG_COEFFICIENT] * abs(held) * 0.5 * row[L.PITCH_DIAMETER]
        drag *= math.tanh(spin / row[L.DRAG_SPEED])
        damped = damping(u) * w
        return [v, (thrust - force) / mass, w, (force - held - damped) / race, (torque - drag) / inertia]

    accurate = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-13, "max_step": 1e-4}
    found = solve_ivp(rates, (0.0, 6e-3), np.zeros(5), t_eval=drop.time, **accurate)
    assert drop.contacts_at("DE.face").end[0] < 6e-3
    assert drop.axial_displacement == pytest.approx(found.y[0], abs=1e-9)
    assert drop.race_axial_displacement("DE") == pytest.approx(found.y[2], abs=1e-9)
    assert drop.race_speed[:, 1] == pytest.approx(found.y[4], rel=1e-3, abs=0.1)


def deep_grooves(clearance='designation = "6008/C3"', thrust=300.0):
    """A row with play in place of the pair."""
    before, name, after = text_of(more=push(thrust)).partition(HEAD)
    for old in ("preload = .*\n", "arrangement = .*\n"):
        after = re.sub(old, "", after, count=1)
    return loads_machine(before + name + re.sub("designation = .*", clearance, after, count=1))


def damped_at(model, way, speed=1e-3):
    """Axial force [N] of a race per speed [N s/m], and what the books lose of it, by the right-hand side."""
    p, state, found = model.parameters, model.at_rest(), []
    own = p.bearing_at[1, L.FACE_STATES]
    for moving in (speed, 0.0):
        state[[own, own + 1]], rates = (way, moving), np.zeros_like(state)
        drop_derivative(1.0, state, p, rates, scratch_of(p))
        found.append((rates[own + 1], rates[model.layout.dissipated]))
    (moved, lost), (still, before) = found
    return (still - moved) * p.bearing[1, L.RACE_MASS] / speed, (lost - before) / speed**2


@pytest.mark.parametrize("angle", [12.0, 15.0, 25.0, 40.0])
def test_the_axial_swing_of_a_pair_is_damped_along_its_lines_of_contact(angle):
    """``2 tan²α`` of the radial damping at rest: a seventh of it at 15°, under half at 25°."""
    model = build_drop_model(faced(balls=f'contact_angle = "{angle} deg"\n'), "quick")
    constants = model.machine.touchdown_bearings[1].bearing.numbers().constants
    share = 2.0 * (constants.axial_offset / constants.radial_offset) ** 2
    expected = share * model.parameters.bearing[1, L.BEARING_DAMPING]
    assert damped_at(model, 0.0) == pytest.approx((expected, expected), rel=1e-6)
    # the preload opens the angle somewhat
    opened = math.degrees(math.atan(math.sqrt(0.5 * share)))
    assert angle < opened < angle + 2.0


@pytest.mark.parametrize("clearance", ['designation = "6008/C3"', 'designation = "6008"\nclearance = "0 um"'])
def test_deep_grooves_are_damped_as_far_as_their_angle_has_opened(clearance):
    """In the middle they lie across the axis; without any clearance it is the load that opens the angle."""
    machine = deep_grooves(clearance)
    model = build_drop_model(machine, "quick")
    constants = machine.touchdown_bearings[1].bearing.numbers().constants
    assert damped_at(model, 0.0) == (0.0, 0.0)
    end = 0.5 * constants.axial_play
    for way in (0.4 * end, end, end + 30e-6):
        angle = math.atan2(way, constants.radial_offset)
        expected = 2.0 * math.sin(angle) ** 2 * model.parameters.bearing[1, L.BEARING_DAMPING]
        for side in (1.0, -1.0):
            assert damped_at(model, side * way) == pytest.approx((expected, expected), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("arrangement", ["", 'arrangement = "O"\n'])
@pytest.mark.parametrize("offset", ["", "second_row_offset = 0.4\n"])
def test_energy_closes_by_place(arrangement, offset):
    model = build_drop_model(faced(push(), balls=arrangement + offset), "quick")
    drop = simulate_drop(model, CASE)
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    found = losses(model, drop)
    assert found.total == pytest.approx(drop.state[-1, model.layout.dissipated], rel=1e-10)
    contacts = drop.contacts_at("DE.face")
    assert len(contacts) > 1
    assert found.sliding[1] == pytest.approx(
        np.sum(contacts.sliding_energy) + np.sum(drop.contacts.of_bearing(1).sliding_energy), rel=2e-3
    )


def test_a_row_of_deep_grooves_lands_after_its_play():
    """Within its play nothing holds the race along the axis: the rotor throws it to and fro to its balls."""
    machine = deep_grooves()
    model = build_drop_model(machine, "quick")
    drop = simulate_drop(model, replace(CASE, tolerance=1e-7))
    numbers = machine.touchdown_bearings[1].bearing.numbers()
    pushed = np.max(drop.race_axial_displacement("DE"))
    assert pushed > 0.5 * numbers.constants.axial_play > 10e-6
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    figures = machine_json(machine, summarise_machine(machine), ())["bearings"]["DE"]
    balls = -bearing_response(numbers.constants, [0.0, 0.0, pushed, 0.0, 0.0]).force[2]
    assert figures["landing_force_N"] == pytest.approx(balls, rel=0.15)
    assert np.max(drop.face_force) > balls
    assert "axial_stiffness_N_per_m" not in figures


def test_a_vertical_rotor_has_its_weight_along_the_axis():
    text = text_of(more=push(130.8)).replace('gravity = "9.81 m/s^2"', 'gravity = "0 m/s^2"')
    machine = loads_machine(text)
    assert summarise_machine(machine).bearings[1].load == pytest.approx(0.0, abs=1e-9)
    drop = simulate_drop(machine, CASE)
    fall = math.sqrt(2.0 * 0.2e-3 * machine.rotor.mass / 130.8)
    assert drop.contacts_at("DE.face").start[0] == pytest.approx(fall, rel=1e-3)
    assert len(drop.contacts) == 0


def test_x_pushed_one_way_is_o_pushed_the_other_way():
    case = DropCase(speed=SPEED, duration=8e-3, reduction="quick", tolerance=1e-8)
    offset = "second_row_offset = 0.3\n"
    x = simulate_drop(faced(push(), balls=offset), case)
    o = simulate_drop(faced(push(direction="-axial"), balls=f'arrangement = "O"\n{offset}'), case)
    same = simulate_drop(faced(push(), balls=f'arrangement = "O"\n{offset}'), case)
    assert o.axial_displacement == pytest.approx(-x.axial_displacement, abs=1e-10)
    right, wrong = (np.max(np.abs(one.max_ball_load - x.max_ball_load)) for one in (o, same))
    assert right < 1e-3 * wrong and wrong > 0.01


def test_a_face_that_is_never_reached_leaves_the_radial_drop():
    case = DropCase(speed=SPEED, duration=6e-3, reduction="quick", tolerance=1e-8)
    plain, far = simulate_drop(loads_machine(TEXT), case), simulate_drop(faced(), case)
    assert far.bearing_force == pytest.approx(plain.bearing_force, abs=0.1)
    assert np.all(far.axial_displacement == 0.0)
    assert plain.face_force is None and np.all(plain.axial_displacement == 0.0)
    machine = faced()
    drop = simulate_drop(machine, DropCase(speed=SPEED, duration=2e-3, reduction="quick"))
    assert simulation_numbers(drop, machine)["axial"]["faces"]["DE"]["peak_force_N"]["value"] == 0.0


AXIAL_AMB = '[[axial_ambs]]\nname = "thrust"\nstiffness = "1e6 N/m"\ndamping = "500 N s/m"\n'
GROWING = 'over_time = [{ time = "0 s", force = "0 N" }, { time = "3 ms", force = "1000 N" }]'


@pytest.mark.parametrize(
    "more",
    [push(), push() + AXIAL_AMB, push().replace('force = "1000.0 N"', GROWING)],
    ids=["", "AMB", "grows"],
)
def test_magnets_hold_the_rotor_until_the_release(more):
    """A load that grows too; without an axial AMB it drifted by half the axial gap."""
    machine = faced(more)
    case = DropCase(speed=SPEED, duration=6e-3, reduction="quick", start=LevitatedStart(delay=3e-3))
    drop = simulate_drop(machine, case)
    z, free = drop.axial_displacement, drop.time[drop.time > 3e-3] - 3e-3
    assert np.max(np.abs(z[drop.time < 3e-3])) < 1e-12
    fall = 0.5 * 1000.0 / machine.rotor.mass * free**2
    inside = fall < 0.2e-3
    assert z[drop.time > 3e-3][inside] == pytest.approx(fall[inside], abs=1e-7)


def test_a_load_the_other_way_is_the_mirror_and_ball_loads_follow_the_axial_motion(machine, drop):
    loads = drop.ball_loads(machine, "DE")
    assert np.max(loads, axis=(1, 2)) == pytest.approx(drop.max_ball_load[:, 1], rel=1e-9)
    pushed = np.argmax(drop.race_axial_displacement("DE"))
    assert np.max(loads[pushed, 1]) > 10.0 * np.max(loads[pushed, 0]) == 0.0
    other = simulate_drop(build_drop_model(faced(push(direction="-axial")), "quick"), CASE)
    early = drop.time < 7e-3  # before a drop is chaotic
    assert other.axial_displacement[early] == pytest.approx(-drop.axial_displacement[early], abs=1e-10)
    assert other.face_force[early] == pytest.approx(-drop.face_force[early], rel=1e-4, abs=1.0)
    assert other.displacement[early] == pytest.approx(drop.displacement[early], abs=1e-9)


def test_log_page_and_document_say_how_it_landed(machine, drop):
    (one,) = landings(machine, drop)
    force, moment = one.contacts.peak
    assert force == pytest.approx(np.max(drop.face_force[:, 1]), rel=0.02)
    assert np.all(drop.face_force[:, 0] == 0.0)
    assert drop.time[np.argmax(drop.face_force[:, 1])] == pytest.approx(moment, abs=2e-5)
    assert np.all(one.contacts.azimuth == 0.0)
    entry = simulation_numbers(drop, machine)["axial"]
    assert entry["faces"]["DE"]["peak_force_N"] == {"value": force, "time_s": moment}
    assert entry["largest_travel_m"] == np.max(drop.axial_displacement)
    count = entry["faces"]["DE"]["landings"]
    assert 1 <= count < len(one.contacts) == entry["faces"]["DE"]["contacts"]
    assert one.rotor_travel == np.max(drop.axial_displacement) != one.travel
    (section,) = [part for part in simulate_page(drop, machine).sections if part.heading == "Axial landing"]
    drawn = np.asarray(section.figures[0].chart.data[0].y)
    assert np.max(drawn) == pytest.approx(np.max(drop.face_force), rel=1e-6)
    values = row_of(build_drop_model(machine, "quick"), drop)
    row = dict(zip((q.name for q in columns_of(machine)), values, strict=True))
    assert row["DE.face.peak_force"] == force
    assert 0.0 < row["DE.face.edge_over_shoulder"] < 1.0


def test_a_contact_over_the_shoulder_is_said_with_its_angles():
    low = faced(push(6000.0), balls='shoulder_height = "0.4 mm"\n')
    drop = simulate_drop(low, CASE)
    (one,) = landings(low, drop)
    assert one.edge_angle > one.contact_angle > 0.0
    balls = low.touchdown_bearings[1].bearing
    groove = min(float(balls.conformity_inner), float(balls.conformity_outer)) * float(balls.ball_diameter)
    assert groove * (1.0 - math.cos(one.climb.shoulder)) == pytest.approx(0.4e-3, rel=1e-9)
    # the ellipse by its area and by its axis ratio, of Legendre's integrals
    at = one.climb.highest
    gamma = float(balls.ball_diameter) / float(balls.pitch_diameter) * math.cos(float(balls.contact_angle))
    bent, curved = 2.0 * gamma / (1.0 - gamma), 1.0 / float(balls.conformity_inner)
    difference = (curved + bent) / (4.0 - curved + bent)

    def off(kappa):
        E, K = ellipe(1.0 - kappa**-2), ellipk(1.0 - kappa**-2)
        return ((kappa**2 + 1.0) * E - 2.0 * K) / ((kappa**2 - 1.0) * E) - difference

    area = 1.5 * drop.max_ball_load[at, 1] / drop.max_stress[at, 1]
    reach = math.sqrt(area / math.pi * brentq(off, 1.01, 100.0))
    assert one.edge_angle - one.climb.angle[at] == pytest.approx(reach / groove, rel=1e-3)
    assert one.climb.excess is not None and one.climb.excess.limit == one.climb.shoulder < one.edge_angle
    assert simulation_numbers(drop, low)["axial"]["faces"]["DE"]["beyond_shoulder"] is True


def test_check_says_what_a_landing_makes_and_warns_of_one_over_the_shoulder(machine, drop):
    figures = machine_json(machine, summarise_machine(machine), ())["bearings"]["DE"]
    # bearing and face lose little in the first landing, and the race adds its own swing
    assert figures["landing_force_N"] == pytest.approx(np.max(drop.face_force), rel=0.15)
    assert figures["axial_stiffness_N_per_m"] > 0.0
    assert "landing_force_N" not in machine_json(faced(), summarise_machine(faced()), ())["bearings"]["DE"]
    stiffer = faced(balls='arrangement = "O"\n')
    other = machine_json(stiffer, summarise_machine(stiffer), ())["bearings"]["DE"]
    assert other["tilt_stiffness_N_m_per_rad"] > 2.0 * figures["tilt_stiffness_N_m_per_rad"]
    low = faced(push(6000.0), balls='shoulder_height = "0.4 mm"\n')
    (told,) = [one for one in machine_warnings(low, summarise_machine(low)) if "shoulder" in one.kind]
    assert told.bearing == "DE" and told.value > told.limit
    assert not any("shoulder" in one.kind for one in machine_warnings(machine, summarise_machine(machine)))
    stiff = machine.with_values({"DE.face.stiffness": 1e14})
    assert "its face" in expected_steps(stiff, 0.1).cause
    assert expected_steps(stiff, 0.1).steps > 10.0 * expected_steps(machine, 0.1).steps


def test_faces_go_with_a_coast_down_and_through_files(machine, drop, tmp_path):
    machine = faced(push(200.0))
    air = {"speed.aero_linear": 1e-6}
    case = CoastDownCase(speed=SPEED, duration=0.1)
    run = simulate_coast_down(machine.with_values(air), case)
    free = simulate_coast_down(machine.with_values({"DE.face.friction": 0.0, **air}), case)
    assert run.windows.speed[-1] < free.windows.speed[-1]
    assert run.energy_residual < 1e-6 * run.energy_scale
    drop.save(tmp_path / "drop.h5")
    again = load_result(tmp_path / "drop.h5")
    assert np.array_equal(again.face_force, drop.face_force)
    assert np.array_equal(again.contacts_at("DE.face").impulse, drop.contacts_at("DE.face").impulse)
    both = faced(push(300.0, "-axial") + AXIAL_AMB)
    assert loads_machine(machine_text(both)) == both


@pytest.mark.parametrize("deep", [False, True], ids=["in flight", "on its face"])
def test_jacobian_agrees_with_finite_differences(deep):
    """But for friction of faces and drag by axial force, which the derivative leaves out."""
    model = build_drop_model(faced(push(300.0), face=f"{FACE}, friction = 0.0"), "quick")
    layout, state = model.layout, a_state(model, np.array([12e-6, 18e-6]), 0.3)
    own = layout.bearing_at()[1, L.FACE_STATES]
    state[[layout.axial, layout.axial + 1]] = (0.21e-3 if deep else 0.1e-3), 0.02
    state[[own, own + 1]] = 3e-6, -2.0
    jacobian, numeric = both_jacobians(model, state, DropCase(speed=SPEED, spin="prescribed"))
    places = [layout.axial, layout.axial + 1, own, own + 1, *range(layout.race.start, layout.support.stop)]
    found, expected = (np.delete(one[:, places], layout.race_spin, axis=0) for one in (jacobian, numeric))
    size = np.maximum(np.max(np.abs(expected), axis=0), 1e-9)
    assert np.max(np.abs(found - expected) / size) < 1e-4
    assert (np.abs(numeric[layout.axial + 1, layout.axial]) > 1e6) == deep


def test_an_estimate_takes_axial_motion_along():
    machine = faced(push(300.0))
    assert machine.not_estimated == ""
    model = build_drop_model(machine, "quick")
    rows = sensor_rows(model)
    _mean, covariance = prior_at_power_off(model, (), rows, np.zeros(len(rows)), (SPEED, 0.1), SlowNoise())
    at = model.layout.axial
    assert np.sqrt(np.diag(covariance)[at : at + 2]) == pytest.approx(AXIAL_SIGMA)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (text_of(FACE.replace("0.2 mm", "0 mm")), r"must be positive"),
        (text_of(FACE.replace("26 mm", "21 mm")), r"inner radius of the face, 22 mm, must be .* 21 mm"),
        (text_of(f'{FACE}, side = "up"'), r"side"),
        (text_of(f'{FACE}, stiffness = "1e9 N/m^1.2"'), r"belongs to the exponent 1.2, but .* exponent 1"),
        (text_of(f"{FACE}, friction = -0.1"), r"must not be negative"),
        (text_of("", push()), r"nothing stops .* towards higher nodes; give a touchdown bearing a face"),
        (text_of(f'{FACE}, side = "-z"', push()), r"higher nodes.*face of DE stops .* side = \"\+z\""),
        (text_of(f'{FACE}, side = "+z"', push(direction="-axial")), r"towards lower nodes; .* side = \"-z\""),
        (text_of(more=push(direction="DE")), r"'DE' is no direction; write \"axial\" \(along the axis"),
        (text_of().replace("[rotor]\n", "[rotor]\naxial = false\n"), r"axial = false, .* has a face"),
        (text_of(more='[[loads]]\nnode = 3\nforce = "1 N"\n'), r"needs a 'direction'.*axial"),
        (text_of(more='[[loads]]\nnode = 3\ndirection = "up"\nforce = "1 N"\n'), r"up"),
        (text_of(balls='preload_kind = "spring"\n'), r"DE cannot have a face: .* springs .* leave the face"),
        (text_of(balls="ball_inertia = true\n"), r"balls with inertia knows no axial motion"),
        (text_of(balls='arrangement = "tandem"\n'), r"rows that all face one way"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(text, message):
    with pytest.raises(MachineFileError, match=message):
        loads_machine(text)


def test_a_face_that_nothing_presses_and_one_outside_its_ring_are_said():
    machine = faced(face=FACE.replace("22 mm", "35 mm").replace("26 mm", "39 mm"))
    found = {one.kind: one for one in machine_warnings(machine, summarise_machine(machine))}
    assert found["face radii"].doubtful and found["face radii"].value == pytest.approx(39e-3)
    assert not found["face"].doubtful
    inside = doubts(faced(face=FACE.replace("22 mm", "12 mm").replace("26 mm", "14 mm")))
    assert [one.value for one in inside if one.kind == "face radii"] == pytest.approx([12e-3])
    fitting = faced(push(), face=FACE.replace("26 mm", "23 mm"))
    kinds = {one.kind for one in machine_warnings(fitting, summarise_machine(fitting))}
    assert not kinds & {"face", "face radii"}


def test_landings_are_those_after_hops_of_a_share_of_the_gap_whatever_the_thrust():
    """By gravity in place of the thrust, 6 kN on a rotor of 131 N landed once: no hop lasts over 1.8 ms."""
    force = 6000.0
    course = f'over_time = [{{ time = "0 ms", force = "0 N" }}, {{ time = "1 us", force = "{force} N" }}]'
    grown = push(force).replace(f'force = "{force} N"', course)
    for machine in (faced(push(force)), faced(grown)):
        drop = simulate_drop(machine, CASE)
        (one,) = landings(machine, drop)
        away = one.gap - np.abs(drop.axial_displacement - drop.race_axial_displacement("DE"))
        flights = zip(one.contacts.end[:-1], one.contacts.start[1:], strict=True)
        heights = [np.max(away[(drop.time > a) & (drop.time < b)], initial=0.0) for a, b in flights]
        assert landing_count(one) == 1 + np.sum(np.array(heights) > HOP * one.gap) > 5
