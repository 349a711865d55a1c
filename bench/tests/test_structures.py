"""Structures of hidden machines: absent they leave every bit, present they keep the laws of mechanics."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop import build_drop_model, simulate_drop
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import SimulationError
from rotordrop.physics import columns as L
from rotordrop.physics.ball_set import ball_set_force
from rotordrop.physics.contact import contact_force
from rotordrop.rotor.assembly import free_free_modes
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart, PlacedStart, UnbalanceJump
from rotordrop.simulate.losses import losses
from rotordrop_bench import Violations, hidden_machine
from rotordrop_bench import departure as D
from rotordrop_bench.departing import STATES_AT, departing
from rotordrop_bench.recording import true_drop
from rotordrop_bench.settled import settled_coordinates, without_magnets
from rotordrop_bench.structure import departures_of, violated

SPEED = 2.0 * np.pi * 120.0
LEVITATED = LevitatedStart(rotor_angle=1.0, remanent_force=np.array([[2.0, 30.0], [-3.0, 20.0]]))
FOUNDATION = {"mass": "400 kg", "frequency": "85 Hz", "frequency_horizontal": "70 Hz"}
AXES = {"axes_angle": "30 deg", "stiffness_ratio": 0.65, "damping_ratio": 0.8}


def violations(**parts):
    return Violations.model_validate(parts)


@pytest.fixture(scope="module")
def model(known):
    return build_drop_model(known, "quick")


@pytest.fixture(scope="module")
def case():
    return DropCase(speed=SPEED, duration=0.03, start=LEVITATED)


@pytest.fixture(scope="module")
def plain(model, case):
    return simulate_drop(model, case)


@pytest.fixture(scope="module")
def centred(model):
    return simulate_drop(model, DropCase(speed=SPEED, duration=0.03, tolerance=1e-8))


def departed(model, **parts):
    """A quick model of a machine with violations; with a row for every bearing, whether it departs or not."""
    v = violations(**parts)
    machine = violated(model.machine, v)
    values = build_drop_model(machine, "quick") if machine is not model.machine else model
    rows = departures_of(machine, v)
    return departing(values, rows if len(rows) else nothing(machine))


def nothing(machine):
    return np.tile(D.no_departure(), (len(machine.touchdown_bearings), 1))


def hidden_drop(model, case, **parts):
    return simulate_drop(departed(model, **parts), case)


def jumping(known, case, **jump):
    hidden = hidden_machine(known, 0, violations(unbalance_jump=jump), drawn=False, reduction="quick")
    return true_drop(hidden, case)


ABSENT = {
    "nothing": {},
    "axes at zero": {"support": {"axes_angle": "0 deg", "stiffness_ratio": 1.0}},
    "no hardening": {"support": {"hardening": 0.0, "hardening_force": "1 kN"}},
    "no slip": {"support": {"slip_force": "0 N", "slip_travel": "3 um"}},
    "a round sleeve": {"sleeve": {"eccentricity": "0 um", "ovality": "0 um", "angle": "1 rad"}},
    "no wear": {"friction": {"wear": 0.0, "wear_heat": "3 J"}},
    "a gap that stays": {"gap": {"drift": "0 um", "drift_time": "1 s", "closing": "0 um", "heat": "1 J"}},
}


@pytest.mark.parametrize("parts", ABSENT.values(), ids=ABSENT)
def test_a_structure_that_is_absent_leaves_every_bit_of_the_simulated_drop(model, case, plain, parts):
    found = hidden_drop(model, case, **parts)
    assert found.state.shape[1] == plain.state.shape[1] + 2 * D.N_STATES
    same_bits(found, plain)


def same_bits(found, plain):
    n = plain.state.shape[1]
    assert np.array_equal(found.state[:, :n], plain.state)
    for name in ("bearing_force", "contact_force", "max_stress", "indentation", "friction_force"):
        assert np.array_equal(getattr(found, name), getattr(plain, name)), name
    assert found.steps == plain.steps
    for name in ("start", "end", "peak_force", "impulse", "dissipated_energy"):
        assert np.array_equal(getattr(found.contacts, name), getattr(plain.contacts, name), equal_nan=True)
    assert len(plain.contacts) > 1


def test_what_is_late_or_has_no_compliance_leaves_every_bit(known, case, plain, model):
    same_bits(jumping(known, case, node=3, amount="1 g mm", time="1 s"), plain)
    tilt = {"tilt_stiffness": "600 N/um", "tilt_frequency": "11 kHz"}
    rows = departed(model, foundation=FOUNDATION, race=tilt).parameters.departure
    compliances = [D.FOUNDATION_MODE + D.COMPLIANCE, D.TILT_MODE + D.COMPLIANCE]
    assert np.all(rows[:, compliances] > 0.0)
    rows[:, compliances] = 0.0
    same_bits(simulate_drop(departing(model, rows), case), plain)


PRESENT = {
    "axes": {"support": AXES},
    "hardening": {"support": {"hardening": 0.5, "hardening_force": "2.6 kN"}},
    "slip": {"support": {"slip_force": "150 N", "slip_travel": "2 um"}},
    "foundation": {"foundation": FOUNDATION},
    "law": {
        "contact": {"law": [{"depth": "1 um", "force": "90 N"}, {"depth": "4 um", "force": "1.6 kN"}]},
    },
    "tilt": {"race": {"tilt_stiffness": "600 N/um", "tilt_frequency": "11 kHz"}},
    "drift": {"gap": {"drift": "-10 um", "drift_time": "30 ms"}},
    "closing": {"gap": {"closing": "10 um", "heat": "10 J"}},
    "balls": {"balls": {"turn": True}},
    "centre": {"centre": {"x": "30 um"}},
    "sleeve off": {"sleeve": {"eccentricity": "12 um", "angle": "1 rad"}},
    "sleeve oval": {"sleeve": {"ovality": "5 um", "angle": "1 rad"}},
    "wear": {"friction": {"wear": 0.6, "wear_heat": "20 J"}},
    "seat play": {"balls": {"seat_play": "5 um"}},
}


@pytest.mark.parametrize(
    ("amounts", "keys", "apart"),
    [
        ({"eccentricity": "12 um"}, {"eccentricity": 12e-6, "eccentricity_phase": 1.0 - 0.5 * np.pi}, 1e-4),
        # 2 % of the gap, squared
        ({"ovality": "5 um"}, {"oval": 5e-6, "oval_phase": 1.0 - 0.5 * np.pi}, 5e-3),
    ],
    ids=["eccentric", "oval"],
)
def test_a_sleeve_moves_the_drop_as_that_of_a_machine_file_does(known, model, amounts, keys, apart):
    case = DropCase(speed=SPEED, duration=0.012)
    found = hidden_drop(model, case, sleeve={**amounts, "angle": "1 rad"})
    names = [bearing.name for bearing in known.touchdown_bearings]
    values = {f"{name}.landing_sleeve.{key}": value for name in names for key, value in keys.items()}
    described, round_one = simulate_drop(model.with_values(values), case), simulate_drop(model, case)
    size = np.abs(found.bearing_force).max()
    assert np.abs(found.bearing_force - described.bearing_force).max() < apart * size
    assert np.abs(found.bearing_force - round_one.bearing_force).max() > 20.0 * apart * size


RADIAL = {"hardening": 0.5, "hardening_force": "2.6 kN", "hardening_radial": True}
KEPT = PRESENT | {
    "all together": {
        "support": AXES
        | {"hardening": 0.5, "hardening_force": "2 kN", "slip_force": "80 N", "slip_travel": "1 um"},
        "foundation": FOUNDATION,
        **PRESENT["tilt"],
        **PRESENT["law"],
        "centre": {"x": "20 um"},
    },
    "radial hardening": {"support": AXES | RADIAL},
}


@pytest.mark.parametrize("parts", KEPT.values(), ids=KEPT)
def test_a_structure_moves_the_drop_and_its_energy_is_kept_and_booked_by_place(model, centred, parts):
    """But for a gap that changes: what moves the bore works against the contact."""
    changed = departed(model, **parts)
    speed = 0.0 if parts.get("support") == AXES | RADIAL else SPEED
    found = simulate_drop(changed, DropCase(speed=speed, duration=0.03, tolerance=1e-8))
    assert speed == 0.0 or np.max(np.abs(found.displacement - centred.displacement)) > 1e-9
    assert np.max(found.indentation) > 0.0
    lost = found.state[-1, changed.layout.dissipated]
    assert lost > 1e-3 and losses(changed, found).total == pytest.approx(lost, rel=1e-6)
    if "gap" not in parts:
        # an oval is known to the first order of its size over the displacement, 2 % here
        share = 1e-4 if "ovality" in parts.get("sleeve", {}) else 1e-6
        assert found.certificate.energy_residual < share * found.certificate.energy_scale


def test_a_seat_with_play_holds_the_bearing_behind_it(known):
    """With the force of the drop model's balls, by another equation."""
    rows, play = departures_of(known, violations(balls={"seat_play": "5 um"})), 5e-6
    numbers = numbers_of(known.touchdown_bearings[0])
    places = numbers.places()
    for way in (-5e-6, -4e-6, -2.5e-6):  # the table rounds the corner within a step or two of it
        assert D.from_table(rows[0], D.TABLE_FORCE, way + play) == pytest.approx(0.0, abs=1.0)
    for way in (4e-6, 15e-6):
        held, _ = ball_set_force(numbers.entries(), places, way, 0.0, np.empty((2, places.shape[1])))
        assert D.from_table(rows[0], D.TABLE_FORCE, way + play) == pytest.approx(held, rel=5e-3)


def test_a_loose_bearing_lies_in_its_seat_and_is_not_damped_there(known):
    play = 5e-6
    hidden = hidden_machine(known, 1, violations(balls={"seat_play": f"{play} m"}), drawn=False)
    model, state = hidden.model, hidden.model.at_rest()
    (x, down), pushed = range(model.layout.race.start, model.layout.race.start + 2), 1e-3
    support = model.layout.support.start
    assert state[down] - state[support + 1] == pytest.approx(-play, rel=0.01)
    state[model.layout.n_coordinates + x] = pushed
    for way, damped in ((0.5 * play, False), (2.0 * play, True)):
        state[down] = state[support + 1] - way
        rates, p = model.layout.zeros(), model.parameters
        p.form.of(drop_derivative)(0.0, state, p, rates, scratch_of(p))
        assert bool(rates[model.layout.n_coordinates + x] < -pushed) == damped


def test_axes_turned_by_a_quarter_exchange_the_supports(known, case):
    turned = {"axes_angle": "90 deg", "stiffness_ratio": 0.65, "damping_ratio": 0.8}
    found = hidden_drop(build_drop_model(known, "quick"), case, support=turned)
    values = {}
    for b in known.touchdown_bearings:
        values[f"{b.name}.support.stiffness"] = 0.65 * float(b.support.stiffness)
        values[f"{b.name}.support.damping"] = 0.8 * float(b.support.damping)
        values[f"{b.name}.support.stiffness_horizontal"] = float(b.support.stiffness)
        values[f"{b.name}.support.damping_horizontal"] = float(b.support.damping)
    exchanged = simulate_drop(build_drop_model(known.with_values(values), "quick"), case)
    early = found.time < 0.02
    assert found.displacement[early] == pytest.approx(exchanged.displacement[early], abs=1e-9)


@pytest.mark.parametrize("radial", [False, True])
def test_a_mirrored_machine_moves_mirrored(known, radial):
    """Mirror at the vertical plane: axes, foundation and start turn over, and so does the spin."""
    still = {f"unbalance.{i}.amount": 0.0 for i in range(len(known.unbalances))}
    still |= {f"{b.name}.bearing.first_ball_angle": 0.0 for b in known.touchdown_bearings}
    model = build_drop_model(known.with_values(still), "quick")
    drops = []
    for sign in (1.0, -1.0):
        support = AXES | {"axes_angle": f"{sign * 30} deg", "hardening": 0.5, "hardening_force": "2.6 kN"}
        support |= {"hardening_radial": radial, "slip_force": "100 N", "slip_travel": "2 um"}
        centre = {"x": f"{sign * 15} um", "y": "5 um"}
        start = PlacedStart(
            displacement=np.array([[sign * 20e-6, 0.0], [sign * -10e-6, 0.0]]),
            velocity=np.array([[sign * 5e-3, 0.0], [0.0, 0.0]]),
        )
        case = DropCase(speed=sign * SPEED, duration=0.025, start=start)
        drops.append(hidden_drop(model, case, support=support, foundation=FOUNDATION, centre=centre))
    one, other = drops
    assert len(one.contacts) > 1
    mirror = np.array([-1.0, 1.0])
    assert other.displacement == pytest.approx(one.displacement * mirror, abs=2e-8)
    assert np.max(np.abs(one.displacement[..., 0])) > 2e-5


@pytest.mark.parametrize("amplitude", [2e-6, 10e-6])
def test_slip_in_a_support_dissipates_however_slow(model, amplitude):
    """Work over a closed loop is positive and the same at any rate: that is hysteresis, not damping."""
    rows = nothing(model.machine)
    rows[0, [D.SLIP_FORCE, D.SLIP_TRAVEL]] = 100.0, 1e-6
    changed = departing(model, rows)
    p = changed.parameters._replace(bearing=changed.parameters.bearing.copy())
    p.bearing[:, [L.SUPPORT_DAMPING_X, L.SUPPORT_DAMPING_Y]] = 0.0
    lost = [_loop_work(changed, p, amplitude, frequency) for frequency in (1.0, 100.0)]
    assert lost[0] == pytest.approx(lost[1], rel=1e-3)
    assert 0.3 * 4.0 * 100.0 * amplitude < lost[0] < 4.0 * 100.0 * amplitude


def _loop_work(model, p, amplitude, frequency):
    """Work [J] that the support takes in its third turn of a sinusoidal motion along x."""
    y, rates, work, steps = model.layout.zeros(), model.layout.zeros(), scratch_of(p), 4000
    h, w = model.layout.support.start, 2.0 * np.pi * frequency
    slip = p.bearing_at[0, STATES_AT] + D.SLIP_X
    done, dt, derivative = 0.0, 1.0 / (frequency * steps), p.form.of(drop_derivative)
    for i in range(3 * steps):
        phase = w * (i + 0.5) * dt
        y[h], y[h + model.layout.n_coordinates] = amplitude * np.sin(phase), amplitude * w * np.cos(phase)
        derivative(0.0, y, p, rates, work)
        y[slip] += dt * rates[slip]
        force = p.bearing[0, L.SUPPORT_STIFFNESS_X] * y[h] + 100.0 * y[slip]
        done += force * y[h + model.layout.n_coordinates] * dt * (i >= 2 * steps)
    return done


def test_a_law_on_the_points_of_the_old_one_is_the_old_one(known, case, plain):
    law = {}
    for b in known.touchdown_bearings:
        k, n = float(b.contact.stiffness), float(b.contact.exponent)
        depths = (1e-6, 3e-6, 8e-6)
        law[b.name] = {"contact": {"law": [{"depth": f"{d} m", "force": f"{k * d**n} N"} for d in depths]}}
    found = hidden_drop(build_drop_model(known, "quick"), case, bearing=law)
    early = found.time < 0.015  # later what rounding differs by has grown from bounce to bounce
    assert np.max(plain.bearing_force[early]) > 500.0
    assert found.bearing_force[early] == pytest.approx(plain.bearing_force[early], abs=0.01)


def test_a_law_goes_through_its_points(known):
    points = [(1e-6, 90.0), (4e-6, 1600.0), (9e-6, 3000.0)]
    law = [{"depth": f"{d} m", "force": f"{f} N"} for d, f in points]
    row = departures_of(known, violations(contact={"law": law}))[0]

    def force_at(depth):
        at = D.law_at(row, depth)
        return contact_force(row[at : at + D.LAW_UNTIL], depth, 0.0)[1]

    for depth, force in points:
        assert force_at(depth) == pytest.approx(force, rel=1e-12)
    assert np.all(np.diff([force_at(d) for d in np.geomspace(1e-8, 3e-5, 60)]) > 0.0)


def rest_of(known, angle=0.0, **parts):
    """Where a rotor at an angle rests in its bearings [m], x and y, shape (2, B)."""
    model = hidden_machine(known, 3, violations(**parts), reduction="quick").model
    rest, layout = settled_coordinates(model, angle), model.layout
    return np.array([model.parameters.bearing_shape @ rest[p] for p in (layout.modal_x, layout.modal_y)])


def test_a_tilted_rotor_rests_aside_by_the_tilt(known):
    x, y = rest_of(known, stand={"tilt": "3 deg"})
    assert np.degrees(np.arctan2(x, -y)) == pytest.approx(3.0, abs=0.02)


@pytest.mark.parametrize(("angle", "raised"), [(0.0, -5e-6), (np.pi / 2, 5e-6)])
def test_an_oval_sleeve_rests_on_the_place_that_is_down(known, angle, raised):
    on_round, on_oval = (rest_of(known, angle, sleeve={"ovality": one})[1] for one in ("0 um", "5 um"))
    assert on_oval - on_round == pytest.approx(raised, abs=1e-7)  # on its short axis it lies deeper


def test_a_bowed_shaft_stands_off_the_line_of_its_ends(known):
    plain, bowed = (
        hidden_machine(known, 3, violations(rotor={"bow": bow, "bow_speed": "60 Hz"})).model
        for bow in ("0 um", "10 um")
    )
    extra = bowed.parameters.unbalance_cos - plain.parameters.unbalance_cos
    flexible = plain.parameters.eigenvalue > 1.0
    unstrained = np.zeros(len(extra))
    unstrained[flexible] = (2.0 * np.pi * 60.0) ** 2 * extra[flexible] / plain.parameters.eigenvalue[flexible]
    place = np.asarray(plain.fe.node_positions)
    shape = np.array([plain.basis.node_row(n + 1) @ unstrained for n in range(len(place))])
    along = (place - place[0]) / (place[-1] - place[0])
    off = shape - shape[0] - along * (shape[-1] - shape[0])
    assert off == pytest.approx(4.0 * 10e-6 * along * (1.0 - along), abs=0.3e-6)


def test_the_gap_drifts_and_gap_and_friction_change_with_heat(known):
    def after(row, heat):
        own = np.zeros(D.N_STATES)
        own[D.HEAT] = heat
        return D.gap_now(row, own, 1.0, 280e-6), D.friction_left(row, own)

    row = departures_of(known, violations(gap={"drift": "-10 um", "drift_time": "0.2 s"}))[0]
    gaps = [D.gap_now(row, np.zeros(D.N_STATES), t, 280e-6) for t in (-1.0, 0.0, 0.1, 0.2, 50.0)]
    assert gaps == pytest.approx([280e-6, 280e-6, 275e-6, 270e-6, 270e-6], rel=1e-12)
    row = departures_of(known, violations(gap={"closing": "10 um", "heat": "50 J"}))[0]
    gaps = [after(row, heat)[0] for heat in (0.0, 50.0, 1e4)]
    assert gaps == pytest.approx([280e-6, (280 - 10 * (1 - math.exp(-1.0))) * 1e-6, 270e-6], rel=1e-9)
    row = departures_of(known, violations(friction={"wear": 0.6, "wear_heat": "20 J"}))[0]
    left = [after(row, heat)[1] for heat in (0.0, 20.0, 1e3)]
    assert left == pytest.approx([1.0, 1.0 - 0.6 * (1.0 - math.exp(-1.0)), 0.4], rel=1e-9)


def test_an_unbalance_comes_from_the_start_or_with_the_first_contact(known, case, plain):
    here, first = replace(case, start=CentredStart()), known.unbalances[0]
    bare = known.with_values({"unbalance.0.amount": 0.0})
    jump = {"node": first.node, "amount": "40 g mm", "phase": f"{float(first.phase)} rad", "time": "0 s"}
    found = jumping(bare, here, **jump)
    whole = build_drop_model(known.with_values({"unbalance.0.amount": 40e-6}), "quick")
    early = found.time < 0.02
    expected = simulate_drop(whole, here).displacement
    assert found.displacement[early] == pytest.approx(expected[early], abs=1e-9)
    found = jumping(known, case, node=33, amount="600 g mm")
    first = plain.contacts.start[0]
    before = found.time < first - 2e-5
    assert found.displacement[before] == pytest.approx(plain.displacement[before], abs=1e-13)
    later = np.searchsorted(found.time, first + 2e-3)
    assert np.max(np.abs(found.displacement[later] - plain.displacement[later])) > 1e-7


def test_what_cannot_be_computed_says_what_to_do(model, case, known):
    jump = UnbalanceJump(node=99, amount=1e-4, time=0.01)
    with pytest.raises(SimulationError, match=r"comes at node 99; give one of the nodes 1 to"):
        simulate_drop(model, replace(case, jump=jump))
    hidden = hidden_machine(known, 3, violations(centre={"x": "20 um"}), reduction="quick")
    with pytest.raises(SimulationError, match=r"stopped at .* a violation is too extreme .* milder"):
        true_drop(hidden, replace(case, most_steps=10))


def test_youngs_modulus_moves_the_bending_frequencies_by_its_root(known):
    softer = violated(known, violations(rotor={"youngs_modulus": 0.97}))
    plain, soft = (free_free_modes(build_drop_model(m, "quick").fe) for m in (known, softer))
    ratio = soft.omega[2:5] / plain.omega[2:5]
    assert ratio == pytest.approx(math.sqrt(0.97), rel=1e-6)


def test_the_rotor_rests_lower_on_a_foundation_and_higher_in_a_gap_that_closed(known):
    drift = {"drift": "-10 um", "drift_time": "0.2 s"}
    tilt = {"tilt_stiffness": "600 N/um", "tilt_frequency": "11 kHz"}
    hidden = hidden_machine(known, 3, violations(foundation=FOUNDATION, gap=drift, race=tilt))
    model = hidden.model
    plain = departing(model, model.parameters.departure[:0])
    moved = (settled_coordinates(model) - settled_coordinates(plain))[model.layout.modal_y]
    weight = model.load_shares
    sag = weight / (400.0 * (2.0 * math.pi * 85.0) ** 2) + weight / 6e8
    assert model.parameters.bearing_shape @ moved == pytest.approx(10e-6 - sag, abs=2e-8)


def test_a_machine_at_rest_has_no_acceleration(known):
    v = violations(support=AXES, foundation=FOUNDATION, centre={"x": "20 um"})
    hidden = hidden_machine(known, 3, v)
    model = hidden.model
    p, y, rates = without_magnets(model), model.layout.zeros(), model.layout.zeros()
    y[: model.layout.n_coordinates] = settled_coordinates(model)
    for b, first in enumerate(p.bearing_at[:, STATES_AT]):
        mode = p.departure[b, D.FOUNDATION_MODE : D.FOUNDATION_MODE + D.MODE_WIDTH]
        # what the foundation yields to the weight it carries
        y[first + 1] = -mode[D.COMPLIANCE] * model.load_shares[b] / mode[D.SQUARE_Y]
    p.form.of(drop_derivative)(1e9, y, p, rates, scratch_of(p))
    left = rates[model.layout.velocity_of(model.layout.modal_y)]
    assert np.max(np.abs(left)) < 1e-6 * np.max(np.abs(p.gravity))
