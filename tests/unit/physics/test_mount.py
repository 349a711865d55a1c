"""Laws of a soft mount and of a landing sleeve: forces are gradients, slip only loses, no axis preferred."""

import math

import numpy as np
import pytest
from tests.unit.simulate.test_power_balance import rate_of, slope_of_energy
from tests.unit.simulate.test_right_hand_side import a_state

from rotordrop import DropCase, build_drop_model, simulate_drop
from rotordrop.elements.landing_sleeve import tolerance
from rotordrop.elements.mount import Mount
from rotordrop.errors import UsageError
from rotordrop.machine import loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.physics import landing_sleeve as law
from rotordrop.physics import mount
from rotordrop.simulate._histories import stored_energy
from rotordrop.simulate.levitation import start_of_drop


def numbers_of(**elements):
    row = np.zeros(L.N_BEARING_COLUMNS)
    Mount.model_validate(elements).fill(row)
    return row[L.MOUNT : L.MOUNT_END]


ALL = {
    "stop": {"gap": "20 um", "stiffness": "5e8 N/m", "damping": "0.1 s/m"},
    "ribbon": {"friction_stiffness": "6e7 N/m", "slip_force": "1.5 kN", "sharpness": 8.0},
    "maxwell": [{"stiffness": "4e6 N/m", "time": "30 ms"}, {"stiffness": "9e6 N/m", "time": "0.3 ms"}],
}
STATES = 6


def force(numbers, place, velocity, stretch):
    rate = np.zeros(STATES)
    return np.array([*mount.mount_force(numbers, *place, *velocity, stretch, rate)]), rate


@pytest.fixture
def moving():
    random = np.random.default_rng(7)
    return (
        np.array([21e-6, -14e-6]),
        0.05 * random.standard_normal(2),
        np.concatenate([[12e-6, 11e-6], 5e-6 * random.standard_normal(4)]),
    )


def test_force_is_the_gradient_of_the_energy_at_rest(moving):
    numbers, (place, _, stretch), step = numbers_of(**ALL), moving, 1e-11
    stop = numbers_of(stop=ALL["stop"])
    for axis in range(2):
        ends = [
            mount.mount_energy(stop, *(place + side * step * np.eye(2)[axis]), stretch) for side in (1, -1)
        ]
        held = mount.stop_force(stop, *place, 0.0, 0.0)
        assert (ends[0] - ends[1]) / (2.0 * step) == pytest.approx(held[axis], rel=1e-5)
    for state in range(0, STATES, 2):
        moved = stretch + 1e-9 * np.eye(STATES)[state]
        rise = mount.mount_energy(numbers, *place, moved) - mount.mount_energy(numbers, *place, stretch)
        held = force(numbers, place, np.zeros(2), stretch)[0][0]
        without = force(numbers, place, np.zeros(2), stretch * (np.arange(STATES) != state))[0][0]
        assert rise / 1e-9 == pytest.approx(held - without, rel=1e-3)


def test_power_put_in_is_stored_or_lost(moving):
    """Force on rate of deflection = rate of the energy + power lost, at any state."""
    numbers, (place, velocity, stretch) = numbers_of(**ALL), moving
    (fx, fy, lost), rate = force(numbers, place, velocity, stretch)
    step = 1e-8
    energies = [
        mount.mount_energy(numbers, *(place + side * step * velocity), stretch + side * step * rate)
        for side in (1.0, -1.0)
    ]
    stored = (energies[0] - energies[1]) / (2.0 * step)
    assert lost > 0.0
    assert fx * velocity[0] + fy * velocity[1] == pytest.approx(stored + lost, rel=1e-6)


@pytest.mark.parametrize("turn", [0.3, 1.9, -2.5])
def test_no_axis_is_preferred(moving, turn):
    numbers, (place, velocity, stretch) = numbers_of(**ALL), moving
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s], [s, c]])
    (*plain, lost), _ = force(numbers, place, velocity, stretch)
    (*other, as_much), _ = force(
        numbers, turned @ place, turned @ velocity, (stretch.reshape(-1, 2) @ turned.T).ravel()
    )
    assert other == pytest.approx(list(turned @ plain), rel=1e-12)
    assert as_much == pytest.approx(lost, rel=1e-12)


def test_a_ribbon_never_holds_more_than_its_slip_force():
    numbers = numbers_of(ribbon=ALL["ribbon"])
    stretch, rate, dt = np.zeros(2), np.zeros(2), 1e-6
    for _ in range(2000):
        mount.mount_force(numbers, 0.0, 0.0, 0.06, -0.08, stretch, rate)
        stretch = stretch + dt * rate
    assert 6e7 * np.hypot(*stretch) == pytest.approx(1500.0, rel=1e-6)
    mount.mount_force(numbers, 0.0, 0.0, -0.06, 0.08, stretch, rate)
    assert list(rate) == [-0.06, 0.08]  # it holds as soon as the motion turns back


RADIUS, GAP = 30e-3, 250e-6
SLEEVE = np.array([1.0, 9e-6, -7e-6, 4e-6, 2e-6])
PLACES = [
    (angle, GAP * np.array([math.cos(p), math.sin(p)])) for angle, p in ((0.3, -1.4), (2.1, 0.8), (5.0, 3.0))
]
KEYS = {"eccentricity": 12e-6, "eccentricity_phase": 0.4, "oval": 5e-6, "oval_phase": -0.9}


def height(chi):
    """What the radius of the sleeve is beyond a round one, at angles from its mark."""
    _, a, b, c, d = SLEEVE
    return a * np.cos(chi) + b * np.sin(chi) + c * np.cos(2.0 * chi) + d * np.sin(2.0 * chi)


@pytest.mark.parametrize(("angle", "place"), PLACES)
def test_it_reaches_as_deep_as_its_outline_does(angle, place):
    """Against the outline itself, point by point; a bore is wide, so that the gap counts to its square."""
    psi = np.linspace(0.0, 2.0 * math.pi, 1_000_001)
    outline = (RADIUS + height(psi - angle)) * np.exp(1j * psi) + complex(*place)
    at = int(np.argmax(np.abs(outline)))
    reach, nx, ny, _slope = law.deepest(SLEEVE, angle, *place)
    assert reach == pytest.approx(abs(outline[at]) - RADIUS, abs=GAP**2 / RADIUS)
    normal = outline[at] / abs(outline[at])
    assert (nx, ny) == pytest.approx((normal.real, normal.imag), abs=2.0 * GAP / RADIUS)


def test_an_eccentric_sleeve_is_a_circle_about_another_centre():
    once = SLEEVE * [1.0, 1.0, 1.0, 0.0, 0.0]
    for angle, place in PLACES:
        centre = complex(*place) + complex(once[1], once[2]) * np.exp(1j * angle)
        reach, nx, ny, _slope = law.deepest(once, angle, *place)
        assert reach == pytest.approx(abs(centre), rel=1e-12)
        assert complex(nx, ny) == pytest.approx(centre / abs(centre), rel=1e-12)


@pytest.mark.parametrize(("angle", "place"), PLACES)
def test_its_place_of_contact_is_found_up_to_the_largest_oval(angle, place):
    sleeve = np.array([1.0, 5e-6, 0.0, 0.8 * law.LARGEST_OVAL * GAP, 0.6 * law.LARGEST_OVAL * GAP])
    _reach, nx, ny, slope = law.deepest(sleeve, angle, *place)
    assert place @ np.array([-ny, nx]) + slope == pytest.approx(0.0, abs=1e-9 * GAP)


@pytest.mark.parametrize(("angle", "place"), PLACES)
def test_its_rates_are_those_of_its_reach(angle, place):
    spin, velocity, step = 400.0, np.array([0.05, -0.08]), 1e-7
    x, y, vx, vy = law.as_round(SLEEVE, angle, spin, *place, *velocity)
    reach, nx, ny, *_ = law.deepest(SLEEVE, angle, *place)
    assert (x, y) == pytest.approx((reach * nx, reach * ny), rel=1e-14)
    ends = [
        law.deepest(SLEEVE, angle + s * spin * step, *(place + s * step * velocity))[0] for s in (1.0, -1.0)
    ]
    assert vx * nx + vy * ny == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-5)
    assert vy * nx - vx * ny == pytest.approx(velocity @ np.array([-ny, nx]), rel=1e-12)


def keyed(machine, keys=KEYS):
    """The machine with such a sleeve at every bearing."""
    return machine.with_values(
        {
            f"{b.name}.landing_sleeve.{key}": value
            for b in machine.touchdown_bearings
            for key, value in keys.items()
        }
    )


@pytest.mark.parametrize("slip", [0.0, 0.98])
def test_what_it_does_to_rotor_and_race_balances(paper, slip):
    """Its normal force turns the rotor: without that torque the books would be off by 69 W."""
    model = build_drop_model(keyed(paper), "quick")
    _, parameters = start_of_drop(model, DropCase(speed=2.0 * math.pi * 60.0))
    state = a_state(model, np.array([25e-6, 30e-6]), slip, seed=5)
    rate, layout = rate_of(state, parameters), model.layout
    stored = slope_of_energy(state, rate, parameters, layout)
    ends = []
    for sign in (1.0, -1.0):
        turned = state.copy()
        turned[layout.rotor_angle] += sign * 1e-6
        ends.append(stored_energy(0.0, turned, parameters, False))
    by_turning = rate[layout.rotor_angle] * (ends[0] - ends[1]) / 2e-6
    size = abs(rate[layout.dissipated]) + abs(rate[layout.work_in])
    assert abs(by_turning) > 1e-3 * size
    assert stored + by_turning == pytest.approx(
        rate[layout.work_in] - rate[layout.dissipated], abs=1e-8 * size
    )


def test_a_drop_on_it_keeps_its_books_and_is_another_drop_and_one_on_a_round_one_is_not(paper):
    case = DropCase(speed=2.0 * math.pi * 60.0, duration=0.04, tolerance=1e-8, reduction="quick")
    found, plain = simulate_drop(keyed(paper), case), simulate_drop(paper, case)
    assert found.certificate.energy_residual < 1e-7 * found.certificate.energy_scale
    peaks = [np.linalg.norm(one.bearing_force, axis=-1).max(axis=0) for one in (found, plain)]
    assert np.all(np.abs(peaks[0] / peaks[1] - 1.0) > 0.003)
    case = DropCase(speed=2.0 * math.pi * 60.0, duration=0.015, reduction="quick")
    found = simulate_drop(keyed(paper, {"eccentricity": 0.0, "oval": 0.0}), case)
    assert found.bearing_force == pytest.approx(simulate_drop(paper, case).bearing_force, rel=1e-4, abs=1.0)


def test_a_machine_file_holds_it_refuses_what_cannot_be_and_its_usual_tolerance_is_grade_6(lp400):
    """ISO 286-1: 19 µm between 50 and 80 mm, 13 µm between 18 and 30 mm."""
    assert loads_machine(machine_text(keyed(lp400))) == keyed(lp400)
    with pytest.raises(UsageError, match="'oval_phase' but no 'oval'"):
        lp400.with_values({"NDE.landing_sleeve.oval_phase": 0.3})
    with pytest.raises(
        UsageError, match=r"oval = 100 um, with an air gap of 285 um; expected 23.75 um at most"
    ):
        lp400.with_values({"DE.air_gap": 285e-6, "DE.landing_sleeve.oval": 100e-6})
    assert tolerance(math.sqrt(50e-3 * 80e-3)) == pytest.approx(19e-6, abs=0.5e-6)
    assert tolerance(math.sqrt(18e-3 * 30e-3)) == pytest.approx(13e-6, abs=0.5e-6)
