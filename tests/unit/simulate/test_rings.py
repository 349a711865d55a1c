"""Drops on pairs whose preload springs make: derivative, energy, symmetry and limits."""

import numpy as np
import pytest
from tests.unit.simulate.test_right_hand_side import SPEED, a_state, assert_jacobian, mirrored_drops

from rotordrop import DropCase, build_drop_model, simulate_drop
from rotordrop.errors import MachineFileError
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.physics import ring
from rotordrop.physics.ball_set import COSINE, COUNT, DAMPING, row_axial_damping
from rotordrop.physics.ring import preload_force, seat_on_springs
from rotordrop.rotor.unknowns import structure_unknowns
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate.losses import losses

TEXT = example_path("small").read_text(encoding="utf-8")
PLACE = "preload = { guess"
SPRING = 'preload_kind = "spring"'


def sprung(*lines, bearing=None):
    """The small machine with springs in both bearings, or in one of them."""
    assert TEXT.count(PLACE) == 2
    new = "\n".join([SPRING, *lines, PLACE])
    if bearing is None:
        return loads_machine(TEXT.replace(PLACE, new))
    before, name, after = TEXT.partition(f'name = "{bearing}"')
    return loads_machine(before + name + after.replace(PLACE, new, 1))


@pytest.mark.parametrize("way", [6e-6, -3e-6, 250e-6])
@pytest.mark.parametrize("bearing", [None, "DE"])
def test_jacobian_agrees_with_finite_differences(way, bearing):
    """On the springs, drawn in, and on the stop."""
    model = build_drop_model(sprung("ring_damping = 0.5", bearing=bearing), "quick")
    state = a_state(model, np.array([-40e-6, 15e-6]), 0.98)
    rings = model.layout.further_at(L.RING_STATES)
    state[rings] = np.resize([way, 0.2], rings.stop - rings.start)
    numeric = assert_jacobian(model, state)
    assert np.max(np.abs(numeric[rings.start + 1])) > 1e6


def test_energy_closes_the_fit_takes_some_and_the_first_peak_falls():
    case = DropCase(speed=SPEED, duration=0.03)
    model = build_drop_model(sprung(), "quick")
    drop = simulate_drop(model, case)
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    loose = build_drop_model(sprung("fit_friction = 0.0"), "quick")
    free = simulate_drop(loose, case)
    assert free.certificate.energy_residual < 1e-6 * free.certificate.energy_scale
    assert np.max(np.abs(drop.ring_travel("DE"))) < np.max(np.abs(free.ring_travel("DE")))
    assert losses(model, drop).total == pytest.approx(drop.state[-1, model.layout.dissipated], rel=1e-5)
    case = DropCase(speed=SPEED, duration=0.02, reduction="quick")
    texts = ("fit_friction = 0.0", "fit_friction = 0.15", "fit_friction = 0.4")
    free, usual, tight = (simulate_drop(sprung(text), case).peak_force("DE")[0] for text in texts)
    rigid = simulate_drop(loads_machine(TEXT), case).peak_force("DE")[0]
    assert free < usual < tight < 1.02 * rigid
    assert free < 0.93 * rigid


@pytest.mark.parametrize("way", [0.0, 30e-6, -10e-6])
def test_a_ring_is_damped_as_its_balls_are(way):
    """A dashpot along the line of contact of every ball gives the radial damping and that of a ring."""
    machine = sprung()
    numbers = machine.touchdown_bearings[0].bearing.numbers()
    row = build_drop_model(machine, "quick").parameters.bearing[0, L.ROLLING : L.ROLLING_END]
    balls, constants = numbers.places(), numbers.constants
    rest, now = (np.arctan2(constants.axial_offset - moved, constants.radial_offset) for moved in (0.0, way))
    radial = np.sum(balls[COUNT] * np.cos(rest) ** 2 * balls[COSINE] ** 2)
    axial = np.sum(balls[COUNT]) / constants.row_count * np.sin(now) ** 2
    found = row_axial_damping(row, 1.0 / constants.row_count, way)
    assert found == pytest.approx(row[DAMPING] * axial / radial, rel=1e-9)


@pytest.mark.parametrize("part", [0.25, 1.0])
def test_rings_swing_out_in_flight_without_friction_of_their_fit(part):
    model = build_drop_model(sprung("fit_friction = 0.0", f"ring_damping = {part}"), "quick")
    p, state = model.parameters, model.at_rest()
    at = p.bearing_at[1, L.RING_STATES]
    state[at + 1], rates = 2e-3, np.zeros_like(state)
    drop_derivative(1.0, state, p, rates, scratch_of(p))
    row = p.bearing[1]
    rings = row[L.RING : L.RING_END]
    share = 1.0 / rings[ring.ROWS]
    whole = row_axial_damping(row[L.ROLLING : L.ROLLING_END], share, state[at]) / share
    lost = part * whole * state[at + 1] ** 2
    assert lost > 0.0
    assert rates[model.layout.dissipated] == pytest.approx(lost, rel=1e-6)
    assert rates[at + 1] == pytest.approx(
        -lost / rings[ring.ROWS] / rings[ring.MASS] / state[at + 1], rel=1e-3
    )


def test_stiff_springs_are_rigid_spacers_and_hold_the_rows_that_the_preload_pressed():
    """The race comes to rest where rigid spacers leave it, and no ring moves."""
    stiff = sprung('spring_rate = "1e17 N/m"').touchdown_bearings[0].bearing.numbers()
    rigid = loads_machine(TEXT).touchdown_bearings[0].bearing.numbers()
    for load in (50.0, 500.0, 3000.0):
        assert stiff.deflection(load)[0] == pytest.approx(rigid.deflection(load)[0], rel=1e-9)
    bearing = sprung().touchdown_bearings[0].bearing
    numbers = bearing.numbers()
    assert preload_force(numbers.rings(), numbers.entries()) == pytest.approx(
        float(bearing.preload), rel=1e-9
    )
    at_rest = seat_on_springs(numbers.constants, numbers.rings(), np.zeros((1, 2)))
    assert np.max(np.abs(at_rest)) < 1e-12


def test_a_drop_on_stiff_springs_is_one_on_spacers_and_ball_loads_follow_the_rings():
    case = DropCase(speed=SPEED, duration=0.012, reduction="quick", tolerance=1e-8)
    rigid = simulate_drop(loads_machine(TEXT), case)
    gap = [
        np.max(np.abs(simulate_drop(sprung(f'spring_rate = "{rate} N/m"', bearing="DE"), case).bearing_force
                      - rigid.bearing_force))
        for rate in (1e10, 1e11)
    ]  # fmt: skip
    assert gap[1] < 0.2 * gap[0] < 0.02 * np.max(np.abs(rigid.bearing_force))
    case = DropCase(speed=SPEED, duration=0.012, reduction="quick")
    machine = sprung()
    drop = simulate_drop(machine, case)
    loads = drop.ball_loads(machine, "DE")
    assert np.max(loads, axis=(1, 2)) == pytest.approx(drop.max_ball_load[:, 1], rel=1e-9)


def test_a_mirrored_drop_is_the_mirror():
    one, other = mirrored_drops(sprung())
    way = one.ring_travel("DE")
    assert way == pytest.approx(other.ring_travel("DE"), rel=1e-6, abs=1e-5 * np.max(np.abs(way)))
    assert one.bearing_force[..., 0] == pytest.approx(-other.bearing_force[..., 0], rel=1e-5, abs=0.1)


def test_springs_need_a_preload_and_are_written_and_read_again():
    machine = sprung('spring_rate = "2e7 N/m"', "fit_friction = { guess = 0.2, range = [0.1, 0.3] }")
    again = loads_machine(machine_text(machine))
    assert again.touchdown_bearings == machine.touchdown_bearings
    paths = [one.path for one in structure_unknowns(build_drop_model(again, "quick"))]
    assert "DE.bearing.fit_friction" in paths and "DE.bearing.ring_mass" in paths
    assert not any(
        "fit" in one.path for one in structure_unknowns(build_drop_model(loads_machine(TEXT), "quick"))
    )
    guess = 'guess = "156 N", range = ["100 N", "220 N"]'
    text = TEXT.replace(PLACE, f"{SPRING}\n{PLACE}").replace(guess, 'value = "0 N"')
    with pytest.raises(MachineFileError, match=r"springs press the rings together, but the preload is zero"):
        loads_machine(text)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('preload_kind = "rigid"\nspring_rate = "1e7 N/m"', "'spring_rate' belongs to springs, and the pre"),
        ("fit_friction = 0.2", r"'fit_friction' belongs to springs"),
        ('preload_kind = "springs"', r"preload_kind"),
        ('preload_kind = "spring"\nring_travel = "0 mm"', r"must be positive"),
        ('preload_kind = "spring"\nfit_friction = -0.1', r"must not be negative"),
    ],
)
def test_what_does_not_go_together_is_refused(line, message):
    with pytest.raises(MachineFileError, match=message):
        loads_machine(TEXT.replace(PLACE, f"{line}\n{PLACE}"))
