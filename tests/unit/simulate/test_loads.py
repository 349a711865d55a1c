"""Loads, an accelerating ground and the levitated start: closed forms, published values, laws."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.validation.rigid_machine import linked, rigid_model

from rotordrop import build_drop_model, example_machine, simulate_drop
from rotordrop.errors import MachineFileError, RotordropError, SimulationError, UsageError
from rotordrop.evidence.free_rotor import held_by
from rotordrop.known import NINETY
from rotordrop.machine import loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics.load import load_now
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.simulate._sensitivity import drop_jacobian
from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart, StateStart
from rotordrop.simulate.levitation import levitated_orbit, levitated_static, start_of_drop
from rotordrop.track import _propagation as P
from rotordrop.track.problem import parameter_targets, private_copy, settled_displacement

G = 9.81
RIGID = {
    "m": 30.0, "c": 0.25e-3, "K": 1e9, "n": 10.0 / 9.0, "lam": 0.0, "g": G,
    "ms": 3.0, "Ks": 1e8, "Cs": 0.2 * math.sqrt(1e8 * 33.0),
}  # fmt: skip


def rigid_with(more, **values):
    """The rigid rotor of the drop cases with more lines in its machine file."""
    machine = loads_machine(machine_text(rigid_model(RIGID | values).machine) + more)
    model = build_drop_model(machine, Reduction(modes=2, attachment=False))
    return replace(model, parameters=linked(model, 1e13, 0.5 * RIGID["ms"]))


def with_lines(machine, more):
    return loads_machine(machine_text(machine) + more)


def dropped(model, duration=0.01, **more):
    case = DropCase(speed=0.0, duration=duration, start=CentredStart(), output_step=2e-6, **more)
    return simulate_drop(model, case)


def down(force):
    return f'\n[[loads]]\nnode = 2\ndirection = "-90 deg"\n{force}\n'


@pytest.mark.parametrize(("more", "peak"), [("", 3284.0), (down('force = "147.15 N"'), 4088.0)])
def test_a_constant_load_adds_to_the_first_peak(more, peak):
    """Reference: own computation of 30 kg on a race of 3 kg, published with the scope of the physics."""
    found = dropped(rigid_with(more))
    assert float(np.max(found.contact_force)) == pytest.approx(peak, rel=1e-3)
    assert found.certificate.energy_residual < 1e-5 * found.certificate.energy_scale


def test_the_ground_may_move_up_or_accelerate_steadily():
    """0.2 g at 10 Hz, phase zero at release: y = -½gt² - 0.2g (t/ω - sin ωt/ω²)."""
    base = '\n[base]\ny = "1.962 m/s^2"\nfrequency = "10 Hz"\n'
    found = dropped(rigid_with(base), tolerance=1e-9)
    first = float(found.contacts.start[0])
    # 0.35 µs late: the ground pushes the race down too, by 25 nm, which the fall alone does not know
    assert first == pytest.approx(7.03724e-3, abs=4e-7)
    w = 2.0 * math.pi * 10.0
    speed = G * first + 0.2 * G * (1.0 - math.cos(w * first)) / w
    assert speed == pytest.approx(72.038e-3, abs=5e-6)
    velocity = np.gradient(found.displacement[:, 0, 1], found.time)
    assert -velocity[np.searchsorted(found.time, first) - 2] == pytest.approx(speed, rel=2e-3)
    base = '\n[base]\nover_time = [{ time = "0 s", y = "1 m/s^2" }]\n'
    moved, heavier = dropped(rigid_with(base)), dropped(rigid_with("", g=G + 1.0))
    # a race that its balls hold has no weight in gravity, but inertia: its support gives way by 30 nm
    assert moved.displacement[:, 0, 1] == pytest.approx(heavier.displacement[:, 0, 1], abs=1e-7)


SIDEWAYS = '\n[[loads]]\nnode = 20\ndirection = "{} deg"\nforce = "200 N"\n'
SWAYS = '\n[base]\nx = "{} m/s^2"\ny = "1 m/s^2"\nfrequency = "40 Hz"\n'


@pytest.mark.parametrize(
    "more", [SIDEWAYS.format(20), SWAYS.format(2), SIDEWAYS.format(-80) + SWAYS.format(-2)]
)
def test_energy_is_kept_and_the_work_is_booked(paper, more):
    model = build_drop_model(with_lines(paper, more), "quick")
    found = simulate_drop(model, DropCase(speed=300.0, duration=0.03, tolerance=1e-8))
    assert np.max(found.indentation) > 0.0
    assert found.certificate.energy_residual < 1e-6 * found.certificate.energy_scale
    still = simulate_drop(build_drop_model(paper, "quick"), DropCase(speed=300.0, duration=0.03))
    work = [drop.state[-1, model.layout.work_in] for drop in (found, still)]
    assert abs(work[0] - work[1]) > 1e-4


def test_a_load_of_nothing_changes_no_bit_and_a_mirrored_one_mirrors_the_drop(paper):
    """With a load a drop takes the kernels with all optional parts, without one their plain form."""
    nothing = SIDEWAYS.format(20).replace("200 N", "0 N")
    drops = [
        simulate_drop(build_drop_model(machine, "quick"), DropCase(speed=300.0, duration=0.012))
        for machine in (paper, with_lines(paper, nothing))
    ]
    assert np.max(drops[0].contact_force) > 0.0
    assert np.array_equal(drops[0].state, drops[1].state)
    quiet = paper.with_values({f"unbalance.{i}.amount": 0.0 for i in range(len(paper.unbalances))})
    drops = []
    for sign, angle in ((1.0, 20), (-1.0, 160)):
        model = build_drop_model(with_lines(quiet, SIDEWAYS.format(angle) + SWAYS.format(2 * sign)), "quick")
        drops.append(simulate_drop(model, DropCase(speed=sign * 300.0, duration=0.012)))
    mirrored = drops[0].displacement * np.array([-1.0, 1.0])
    assert np.max(np.abs(mirrored[..., 0])) > 1e-5
    assert drops[1].displacement == pytest.approx(mirrored, abs=2e-8)


def test_a_course_over_time_and_over_speed_and_a_load_by_its_number(paper):
    course = 'over_time = [{ time = "0 s", force = "10 N" }, { time = "0.1 s", force = "30 N" }]'
    squared = 'force = "50 N"\nspeed_exponent = 2'
    model = build_drop_model(with_lines(paper, down(course) + down(squared)), "quick")
    p, nominal = model.parameters, float(paper.speed.nominal)
    for t, expected in ((-1.0, 10.0), (0.05, 20.0), (0.1, 30.0), (9.0, 30.0)):
        assert load_now(p.load[0], p.load_points, t, nominal)[1] == pytest.approx(-expected, rel=1e-12)
    for speed, expected in ((nominal, 50.0), (-0.5 * nominal, 12.5), (0.0, 0.0)):
        assert load_now(p.load[1], p.load_points, 0.0, speed)[1] == pytest.approx(-expected, rel=1e-12)
    machine = with_lines(paper, down('force = "100 N"')).with_values({"loads.0.force": "120 N"})
    assert float(machine.loads[0].force) == pytest.approx(120.0)
    assert loads_machine(machine_text(machine)) == machine


def test_the_magnets_hold_the_load_before_the_release(paper):
    """The rotor starts where the controller holds it, and the magnets carry the load beside the weight."""
    plain, loaded = (
        build_drop_model(with_lines(paper, more), "quick") for more in ("", down('force = "100 N"'))
    )
    case = DropCase(speed=300.0, start=LevitatedStart(delay=0.01))
    (_, one), (_, other) = (start_of_drop(model, case) for model in (plain, loaded))
    more = np.sum(other.magnet - one.magnet, axis=0)
    assert more[3] == pytest.approx(100.0, rel=1e-6)  # holding force along y
    held = simulate_drop(loaded, replace(case, duration=0.009))
    assert np.max(np.abs(held.displacement - held.displacement[0])) < 2e-5


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (down(""), "a load needs either 'force' or 'over_time'"),
        (down('force = "3 N"').replace("node = 2", "node = 99"), "node 99 is outside the rotor"),
        (down('force = "3 N"').replace("-90 deg", "axial"), "nothing stops the rotor .* higher nodes"),
        (
            down('over_time = [{ time = "1 s", force = "1 N" }, { time = "1 s", force = "2 N" }]'),
            "time 1 s of point 2 does not exceed 1 s before it; order them",
        ),
        ('\n[base]\ny = "1 m/s^2"\n', "the sine of a base needs 'frequency' and an amplitude"),
        ('\n[base]\nz = "1 m/s^2"\nfrequency = "3 Hz"\n', "'z' is reserved for an axial acceleration"),
        ("\n[base]\n", "a base needs either a sine"),
    ],
)
def test_what_does_not_fit_is_refused(paper, more, told):
    with pytest.raises(MachineFileError, match=told):
        with_lines(paper, more)


def loaded(force='{ guess = "0 N" }', direction="-90 deg"):
    """The example with a load at its centre of gravity."""
    machine = example_machine("lp400")
    apart = np.abs(np.array(machine.rotor.node_positions) - machine.rotor.centre_of_gravity)
    node = int(np.argmin(apart)) + 1
    return with_lines(machine, f'\n[[loads]]\nnode = {node}\ndirection = "{direction}"\nforce = {force}\n')


def load_unknowns(machine):
    model = build_drop_model(machine, "quick")
    return model, [one for one in all_unknowns(model) if one.parameter.owner == "load"]


def test_a_load_is_an_unknown_known_to_half_the_weight_where_it_is_a_guess_and_over_time_none():
    machine = loaded(direction="30 deg")
    model, (force,) = load_unknowns(machine)
    half = 0.5 * machine.rotor.mass * float(machine.gravity)
    assert force.path == "loads.0.force" and force.scope == "drop"
    assert force.parameter.named(force.owner) == "force of load 1"
    assert NINETY * force.sigma == pytest.approx(half)
    p = private_copy(model.parameters)
    P.apply_parameters(np.array([200.0]), parameter_targets(model, (force,)), p)
    turned = math.radians(30.0)
    assert p.load[0, :2] == pytest.approx([200.0 * math.cos(turned), 200.0 * math.sin(turned)])
    ranged = load_unknowns(loaded('{ guess = "50 N", range = ["-100 N", "300 N"] }'))[1][0]
    assert (ranged.mean, NINETY * ranged.sigma) == pytest.approx((100.0, 200.0))
    assert load_unknowns(loaded('"50 N"'))[1][0].sigma < 0.01 * half
    course = '[{ time = "0 s", force = "1 N" }, { time = "1 s", force = "2 N" }]'
    line = f'\n[[loads]]\nnode = 14\ndirection = "0 deg"\nover_time = {course}\n'
    assert load_unknowns(with_lines(example_machine("lp400"), line))[1] == []


@pytest.mark.parametrize("direction", ["-90 deg", "0 deg"])
def test_what_held_a_loaded_rotor_bore_its_load_and_lets_it_go_with_the_weight(direction):
    machine = loaded('"200 N"', direction)
    held = held_by(machine, (), build_drop_model(machine, "quick").fe)
    weight = machine.rotor.mass * float(machine.gravity)
    down = direction == "-90 deg"
    assert np.sum(held.lift) == pytest.approx(weight + 200.0 * down)
    assert np.sum(held.aside) == pytest.approx(-200.0 * (not down))


def test_a_loaded_rotor_rests_where_its_weight_and_its_load_point():
    sides = []
    for direction in ("-90 deg", "0 deg"):
        model = build_drop_model(loaded('"300 N"', direction), "quick")
        unknowns = all_unknowns(model)
        problem = SimpleNamespace(model=model, targets=parameter_targets(model, unknowns), unknowns=unknowns)
        sides.append(settled_displacement(problem, np.array([one.begin for one in unknowns])))
    deeper, turned = sides
    weight = model.machine.rotor.mass * float(model.machine.gravity)
    assert deeper[0] == pytest.approx(0.0, abs=1e-12)
    assert np.mean(turned[0]) / -np.mean(turned[1]) == pytest.approx(300.0 / weight, rel=0.1)
    assert np.all(deeper[1] < turned[1])


def test_a_side_force_is_gravity_turned_and_its_work_is_booked(paper):
    """A tenth of the weight in +x: the whole rotor, however it bends, falls by a tenth as far to the side."""
    pushed = loads_machine(machine_text(paper.with_values({"side_force": 0.1})))
    assert float(pushed.side_force) == 0.1
    case = DropCase(speed=300.0, duration=0.03, tolerance=1e-8)
    drops = [simulate_drop(build_drop_model(machine, "quick"), case) for machine in (paper, pushed)]
    falling = drops[0].time < 0.006
    aside = drops[1].displacement[falling] - drops[0].displacement[falling]
    fall = np.broadcast_to(0.05 * G * drops[0].time[falling, None] ** 2, aside[..., 0].shape)
    assert aside[..., 0] == pytest.approx(fall, rel=1e-4, abs=1e-10)
    assert np.max(np.abs(aside[..., 1])) < 1e-10
    assert np.max(drops[1].indentation) > 0.0
    assert drops[1].certificate.energy_residual < 1e-6 * drops[1].certificate.energy_scale


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


def test_the_magnets_hold_their_places_and_the_sag_is_that_of_an_independent_study(levitated):
    """An independent study of this machine found -6.6 and +4.9 µm."""
    offset = np.array([[3e-6, -8e-6], [5e-6, 2e-6]])
    static, holding = levitated_static(levitated, offset)
    assert levitated.parameters.magnet_shape @ static == pytest.approx(offset, abs=1e-13)
    assert np.sum(holding, axis=0) == pytest.approx(
        [0.0, levitated.machine.rotor.mass * 9.81], rel=1e-6, abs=1e-6
    )
    wanted = np.array([7e-6, 3e-6j])
    orbit = levitated_orbit(levitated, SPEED, wanted)
    met = levitated.parameters.magnet_shape @ orbit
    assert met[:, 0] == pytest.approx(wanted, abs=1e-16)
    assert met[:, 1] == pytest.approx(-1j * wanted, abs=1e-16)
    model = build_drop_model(levitated.machine, "full")
    static, _ = levitated_static(model, None)
    sag = model.parameters.bearing_shape[:, 2:] @ static[2:]
    assert sag[:, 1] == pytest.approx([-6.6e-6, 4.9e-6], abs=0.1e-6)
    assert np.max(np.abs(sag[:, 0])) < 1e-15


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
    case = DropCase(speed=0.0, duration=0.005, spin="coasting", tolerance=1e-9)
    with_lift, without = (
        simulate_drop(levitated, replace(case, start=one)) for one in (start, LevitatedStart())
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


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (LevitatedStart(orbit=np.zeros(3)), r"orbit has shape \(3,\); expected \(2,\)"),
        (LevitatedStart(remanent_force=np.zeros(2)), r"remanent_force .* \(2,\); expected \(2, 2\)"),
        (StateStart(state=np.zeros(7)), r"state, .* has the shape \(7,\); expected \(54,\)"),
    ],
)
def test_starts_of_another_shape_and_machines_without_magnets_are_refused(levitated, start, message):
    with pytest.raises(RotordropError, match=message):
        simulate_drop(levitated, DropCase(speed=SPEED, start=start))
    without = replace(levitated, parameters=levitated.parameters._replace(magnet=np.zeros((0, 8))))
    with pytest.raises(SimulationError, match=r"at least two radial AMBs; .* has 0.*use another start"):
        simulate_drop(without, DropCase(speed=SPEED, start=LevitatedStart()))


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
