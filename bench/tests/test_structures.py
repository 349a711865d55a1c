"""Structures of hidden machines: absent they leave every bit, present they keep the laws of mechanics."""

import math
from dataclasses import replace
from operator import attrgetter

import numpy as np
import pytest

from rotordrop import build_drop_model, simulate_drop
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import SimulationError
from rotordrop.machine import example_machine
from rotordrop.physics.ball_set import ball_set_force
from rotordrop.physics.contact import contact_force
from rotordrop.rotor.assembly import free_free_modes
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart, PlacedStart, UnbalanceJump
from rotordrop.simulate.losses import losses
from rotordrop_bench import Violations, hidden_machine
from rotordrop_bench import departing as D
from rotordrop_bench.departing import STATES_AT
from rotordrop_bench.recording import true_drop
from rotordrop_bench.settled import settled_coordinates
from rotordrop_bench.structure import departures_of

KNOWN = example_machine("lp400")
LOADS = bearing_load_shares(KNOWN)
SPEED = 2.0 * np.pi * 120.0
START = LevitatedStart(rotor_angle=1.0, remanent_force=np.array([[2.0, 30.0], [-3.0, 20.0]]))
CASE = DropCase(speed=SPEED, duration=0.03, start=START)
EXACT = DropCase(speed=SPEED, duration=0.03, tolerance=1e-8)

AXES = {"axes_angle": "30 deg", "stiffness_ratio": 0.65, "damping_ratio": 0.8}
FOUNDATION = {"mass": "400 kg", "frequency": "85 Hz", "frequency_horizontal": "70 Hz"}
TILT = {"tilt_stiffness": "600 N/um", "tilt_frequency": "11 kHz"}
HARDENING = {"hardening": 0.5, "hardening_force": "2.6 kN"}
DRIFT = {"gap": {"drift": "-10 um", "drift_time": "0.2 s"}}
POINTS = ((1e-6, 90.0), (4e-6, 1600.0), (9e-6, 3000.0))


def law(points):
    return {"contact": {"law": [{"depth": f"{depth} m", "force": f"{force} N"} for depth, force in points]}}


def hidden_of(known=KNOWN, **parts):
    return hidden_machine(known, 0, Violations.of(parts), drawn=False, reduction="quick")


def row_of(**parts):
    return departures_of(KNOWN, Violations.of(parts))[0]


def rows(names, table):
    return pytest.mark.parametrize(names, table.values(), ids=table)


@pytest.fixture(scope="module")
def model():
    return build_drop_model(KNOWN, "quick")


@pytest.fixture(scope="module")
def plain(model):
    return simulate_drop(model, CASE)


@pytest.fixture(scope="module")
def centred(model):
    return simulate_drop(model, EXACT)


ABSENT = {
    "support": {"axes_angle": "0 deg", "stiffness_ratio": 1.0, "hardening": 0.0, "hardening_force": "1 kN"}
    | {"slip_force": "0 N", "slip_travel": "3 um"},
    "sleeve": {"eccentricity": "0 um", "ovality": "0 um", "angle": "1 rad"},
    "friction": {"wear": 0.0, "wear_heat": "3 J"},
    "gap": {"drift": "0 um", "drift_time": "1 s", "closing": "0 um", "heat": "1 J"},
    "unbalance_jump": {"node": 3, "amount": "1 g mm", "time": "1 s"},
}


@pytest.mark.parametrize("parts", [ABSENT, {"foundation": FOUNDATION, "race": TILT}])
def test_what_is_absent_late_or_without_compliance_leaves_every_bit(plain, parts):
    hidden = hidden_of(**parts)
    departures = hidden.model.parameters.departure
    departures[:, [D.FOUNDATION_MODE + D.COMPLIANCE, D.TILT_MODE + D.COMPLIANCE]] = 0.0
    found, n = true_drop(hidden, CASE), plain.state.shape[1]
    assert found.state.shape[1] == n + len(departures) * D.N_STATES and len(plain.contacts) > 1
    assert np.array_equal(found.state[:, :n], plain.state) and found.steps == plain.steps
    for name in ("bearing_force", "contact_force", "max_stress", "indentation", "friction_force"):
        assert np.array_equal(getattr(found, name), getattr(plain, name)), name
    for name in ("start", "end", "peak_force", "impulse", "dissipated_energy"):
        assert np.array_equal(getattr(found.contacts, name), getattr(plain.contacts, name), equal_nan=True)


PRESENT = {
    "axes": {"support": AXES},
    "hardening": {"support": AXES | HARDENING},
    "slip": {"support": {"slip_force": "150 N", "slip_travel": "2 um"}},
    "foundation": {"foundation": FOUNDATION},
    "law": law(POINTS[:2]),
    "tilt": {"race": TILT},
    "drift": {"gap": {"drift": "-10 um", "drift_time": "30 ms"}},
    "closing": {"gap": {"closing": "10 um", "heat": "10 J"}},
    "balls": {"balls": {"turn": True}},
    "centre": {"centre": {"x": "30 um"}},
    "sleeve off": {"sleeve": {"eccentricity": "12 um", "angle": "1 rad"}},
    "sleeve oval": {"sleeve": {"ovality": "5 um", "angle": "1 rad"}},
    "wear": {"friction": {"wear": 0.6, "wear_heat": "20 J"}},
    "seat play": {"balls": {"seat_play": "5 um"}},
    "all together": {"support": AXES | HARDENING | {"slip_force": "80 N", "slip_travel": "1 um"}}
    | {"foundation": FOUNDATION, "race": TILT, "centre": {"x": "20 um"}}
    | law(POINTS[:2]),
}


@rows("parts", PRESENT)
def test_a_structure_moves_the_drop_and_its_energy_is_kept_and_booked_by_place(centred, parts):
    """But for a gap that changes: what moves the bore works against the contact."""
    changed = hidden_of(**parts).model
    found = simulate_drop(changed, EXACT)
    assert np.max(np.abs(found.displacement - centred.displacement)) > 1e-9
    assert np.max(found.indentation) > 0.0
    lost = found.state[-1, changed.layout.dissipated]
    assert lost > 1e-3 and losses(changed, found).total == pytest.approx(lost, rel=1e-6)
    if "gap" not in parts:
        # an oval is known to the first order of its size over the displacement, 2 % here
        share = 1e-4 if "ovality" in parts.get("sleeve", {}) else 1e-6
        assert found.certificate.energy_residual < share * found.certificate.energy_scale


def of_bearings(values):
    """Values [SI] of all bearings by path, each a number or a share of what the description has at a path."""
    return {
        f"{b.name}.{path}": value[0] * float(attrgetter(value[1])(b)) if isinstance(value, tuple) else value
        for b in KNOWN.touchdown_bearings
        for path, value in values.items()
    }


def on_its_points(contact):
    return law((depth, float(contact.stiffness) * depth ** float(contact.exponent)) for depth, _ in POINTS)


TURNED, ECCENTRIC, OVAL = 1.0 - np.pi / 2, {"eccentricity": "12 um"}, {"ovality": "5 um"}
LIMITS = {  # violations, the same said by a machine file, and how far the forces may be apart [1]
    "eccentric": (
        {"sleeve": ECCENTRIC | {"angle": "1 rad"}},
        of_bearings({"landing_sleeve.eccentricity": 12e-6, "landing_sleeve.eccentricity_phase": TURNED}),
        1e-4,
    ),
    "oval": (
        {"sleeve": OVAL | {"angle": "1 rad"}},
        of_bearings({"landing_sleeve.oval": 5e-6, "landing_sleeve.oval_phase": TURNED}),
        5e-3,  # 2 % of the gap, squared
    ),
    "axes turned by a quarter": (
        {"support": AXES | {"axes_angle": "90 deg"}},
        of_bearings(
            {
                "support.stiffness": (0.65, "support.stiffness"),
                "support.damping": (0.8, "support.damping"),
                "support.stiffness_horizontal": (1.0, "support.stiffness"),
                "support.damping_horizontal": (1.0, "support.damping"),
            }
        ),
        1e-4,
    ),
    "law on the points of the old one": (
        {"bearing": {b.name: on_its_points(b.contact) for b in KNOWN.touchdown_bearings}},
        {},
        1e-4,
    ),
}


@rows(("parts", "values", "apart"), LIMITS)
def test_a_structure_moves_the_drop_as_a_machine_file_does_that_has_it(model, parts, values, apart):
    models, case = (
        (hidden_of(**parts).model, model.with_values(values), model),
        replace(EXACT, duration=0.012),
    )
    found, described, without = (simulate_drop(one, case).bearing_force for one in models)
    largest = np.abs(found).max()
    assert np.abs(found - described).max() < apart * largest and largest > 500.0
    assert not values or np.abs(found - without).max() > 20.0 * apart * largest


def test_an_unbalance_comes_from_the_start_or_with_the_first_contact(plain):
    case, own = replace(CASE, start=CentredStart(), duration=0.02), KNOWN.unbalances[0]
    jump = {"node": own.node, "amount": "40 g mm", "phase": f"{float(own.phase)} rad", "time": "0 s"}
    bare, whole = (KNOWN.with_values({"unbalance.0.amount": amount}) for amount in (0.0, 40e-6))
    found = true_drop(hidden_of(bare, unbalance_jump=jump), case).displacement
    expected = simulate_drop(build_drop_model(whole, "quick"), case).displacement
    assert found == pytest.approx(expected, abs=1e-9)
    off = true_drop(hidden_of(unbalance_jump={"node": 33, "amount": "600 g mm"}), CASE)
    off, first = np.abs(off.displacement - plain.displacement), plain.contacts.start[0]
    assert np.max(off[plain.time < first - 2e-5]) < 1e-13 < 1e-7 < np.max(off[plain.time < first + 2e-3])


def test_a_mirrored_machine_moves_mirrored():
    """Mirror at the vertical plane: axes, foundation and start turn over, and so does the spin."""
    still = {f"unbalance.{i}.amount": 0.0 for i in range(len(KNOWN.unbalances))}
    still |= of_bearings({"bearing.first_ball_angle": 0.0})
    place, velocity, drops = np.array([[20e-6, 0.0], [-10e-6, 0.0]]), np.array([[5e-3, 0.0], [0.0, 0.0]]), []
    for sign in (1.0, -1.0):
        support = AXES | HARDENING | {"axes_angle": f"{sign * 30} deg"}
        support |= {"slip_force": "100 N", "slip_travel": "2 um"}
        centre = {"x": f"{sign * 15} um", "y": "5 um"}
        hidden = hidden_of(KNOWN.with_values(still), support=support, foundation=FOUNDATION, centre=centre)
        start = PlacedStart(displacement=sign * place, velocity=sign * velocity)
        drops.append(true_drop(hidden, DropCase(speed=sign * SPEED, duration=0.025, start=start)))
    one, other = (drop.displacement for drop in drops)
    assert len(drops[0].contacts) > 1 and np.max(np.abs(one[..., 0])) > 2e-5
    assert other == pytest.approx(one * [-1.0, 1.0], abs=2e-8)


@pytest.mark.parametrize("velocity", [-1e-4, 1e-2])
@pytest.mark.parametrize(("slip", "sticks"), [(0.0, 1.0), (0.5, 0.5), (1.0, 0.0)])
def test_slip_in_a_support_follows_the_way_however_slow(velocity, slip, sticks):
    """Dahl's bristle: of its stretch over the travel of 1 µm depends how much of the way it takes along."""
    model = hidden_of(support={"slip_force": "100 N", "slip_travel": "1 um"}).model
    p, y, rates = model.parameters, model.layout.zeros(), model.layout.zeros()
    y[model.layout.n_coordinates + model.layout.support.start] = velocity
    at = p.bearing_at[0, STATES_AT] + D.SLIP_X
    y[at] = math.copysign(slip, velocity)
    p.form.of(drop_derivative)(0.0, y, p, rates, scratch_of(p))
    assert rates[at] == pytest.approx(sticks * velocity / 1e-6, abs=1e-9)


def test_a_seat_with_play_holds_the_bearing_behind_it_and_damps_it_there():
    """With the force of the drop model's balls, by another equation."""
    play, numbers = 5e-6, numbers_of(KNOWN.touchdown_bearings[0])
    row, places = row_of(balls={"seat_play": f"{play} m"}), numbers.places()
    for way in (-5e-6, -4e-6, -2.5e-6):  # the table rounds the corner within a step or two of it
        assert D.from_table(row, D.TABLE_FORCE, way + play) == pytest.approx(0.0, abs=1.0)
    for way in (4e-6, 15e-6):
        held, _ = ball_set_force(numbers.entries(), places, way, 0.0, np.empty((2, places.shape[1])))
        assert D.from_table(row, D.TABLE_FORCE, way + play) == pytest.approx(held, rel=5e-3)
    model = hidden_of(balls={"seat_play": f"{play} m"}).model
    state, p, n, x = model.at_rest(), model.parameters, model.layout.n_coordinates, model.layout.race.start
    support = state[model.layout.support.start + 1]
    assert state[x + 1] - support == pytest.approx(-play, rel=0.01)
    state[n + x] = 1e-3
    for way, damped in ((0.5 * play, False), (2.0 * play, True)):
        state[x + 1], rates = support - way, model.layout.zeros()
        p.form.of(drop_derivative)(0.0, state, p, rates, scratch_of(p))
        assert bool(rates[n + x] < -1e-3) == damped


def test_a_law_goes_through_its_points():
    row, depths = row_of(**law(POINTS)), (*np.geomspace(1e-8, 3e-5, 60), *(depth for depth, _ in POINTS))
    at = [D.law_at(row, depth) for depth in depths]
    forces = [contact_force(row[a : a + D.LAW_UNTIL], d, 0.0)[1] for a, d in zip(at, depths, strict=True)]
    assert forces[60:] == pytest.approx([force for _, force in POINTS], rel=1e-12)
    assert np.all(np.diff(forces[:60]) > 0.0)


CLOSING, WEAR = (
    {"gap": {"closing": "10 um", "heat": "50 J"}},
    {"friction": {"wear": 0.6, "wear_heat": "20 J"}},
)


@pytest.mark.parametrize(
    ("parts", "time", "heat", "gap", "friction"),
    [
        (DRIFT, -1.0, 0.0, 280e-6, 1.0),
        (DRIFT, 0.1, 0.0, 275e-6, 1.0),
        (DRIFT, 50.0, 0.0, 270e-6, 1.0),
        (CLOSING, 1.0, 50.0, 270e-6 + 10e-6 / math.e, 1.0),
        (CLOSING, 1.0, 1e4, 270e-6, 1.0),
        (WEAR, 1.0, 20.0, 280e-6, 0.4 + 0.6 / math.e),
        (WEAR, 1.0, 1e3, 280e-6, 0.4),
    ],
)
def test_the_gap_drifts_and_gap_and_friction_change_with_heat(parts, time, heat, gap, friction):
    row, own = row_of(**parts), np.zeros(D.N_STATES)
    own[D.HEAT] = heat
    found = D.gap_now(row, own, time, 280e-6), D.friction_left(row, own)
    assert found == pytest.approx((gap, friction), rel=1e-9)


SAG = LOADS / (400.0 * (2.0 * math.pi * 85.0) ** 2) + LOADS / 6e8
RESTS = {  # angle of the rotor [rad], way aside [m] and as a share of the depth [1], lift [m]
    "tilted": ({"stand": {"tilt": "3 deg"}}, 0.0, 0.0, math.sin(math.radians(3.0)), 0.0),
    "oval, long axis down": ({"sleeve": OVAL}, np.pi / 2, 0.0, 0.0, 5e-6),
    "oval, short axis down": ({"sleeve": OVAL}, 0.0, 0.0, 0.0, -5e-6),
    "soft, closed gap": ({"foundation": FOUNDATION, "race": TILT} | DRIFT, 0.0, 0.0, 0.0, 1e-5 - SAG),
    "off the middle": ({"centre": {"x": "20 um"}}, 0.0, 20e-6, 0.0, 0.0),
}


@rows(("parts", "angle", "aside", "share", "lift"), RESTS)
def test_a_rotor_rests_where_its_structures_let_it(model, parts, angle, aside, share, lift):
    (x, y), (_, plain) = (
        [one.parameters.bearing_shape @ settled_coordinates(one, angle)[p] for p in (m.modal_x, m.modal_y)]
        for one, m in ((one, one.layout) for one in (hidden_of(**parts).model, model))
    )
    assert x == pytest.approx(aside - share * plain, abs=1e-7)
    assert y - plain * math.sqrt(1.0 - share**2) == pytest.approx(lift * np.ones(2), abs=1e-7)


def test_a_bowed_shaft_stands_off_the_line_of_its_ends(model):
    p = hidden_of(rotor={"bow": "10 um", "bow_speed": "60 Hz"}).model.parameters
    extra, stiff = p.unbalance_cos - model.parameters.unbalance_cos, np.maximum(p.eigenvalue, 1.0)
    unstrained = np.where(stiff > 1.0, (2.0 * np.pi * 60.0) ** 2 * extra / stiff, 0.0)
    place = np.asarray(model.fe.node_positions)
    shape = np.array([model.basis.node_row(n + 1) @ unstrained for n in range(len(place))])
    along = (place - place[0]) / (place[-1] - place[0])
    off = shape - shape[0] - along * (shape[-1] - shape[0])
    assert off == pytest.approx(4.0 * 10e-6 * along * (1.0 - along), abs=0.3e-6)


def test_youngs_modulus_moves_the_bending_frequencies_by_its_root(model):
    soft = free_free_modes(hidden_of(rotor={"youngs_modulus": 0.97}).model.fe).omega[2:5]
    assert soft / free_free_modes(model.fe).omega[2:5] == pytest.approx(math.sqrt(0.97), rel=1e-6)


def test_what_cannot_be_computed_says_what_to_do(model):
    jump = UnbalanceJump(node=99, amount=1e-4, time=0.01)
    with pytest.raises(SimulationError, match=r"comes at node 99; give one of the nodes 1 to"):
        simulate_drop(model, replace(CASE, jump=jump))
    with pytest.raises(SimulationError, match=r"stopped at .* a violation is too extreme .* milder"):
        true_drop(hidden_of(centre={"x": "20 um"}), replace(CASE, most_steps=10))
