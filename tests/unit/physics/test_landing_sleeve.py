"""A landing sleeve that is eccentric and oval: geometry, rates and the books of a drop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.unit.simulate.test_power_balance import rate_of, slope_of_energy
from tests.unit.simulate.test_right_hand_side import a_state

from rotordrop.elements.landing_sleeve import tolerance
from rotordrop.errors import UsageError
from rotordrop.machine import loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import landing_sleeve as law
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate._histories import stored_energy
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import start_of_drop

RADIUS, GAP = 30e-3, 250e-6
SLEEVE = np.array([1.0, 9e-6, -7e-6, 4e-6, 2e-6])
PLACES = [
    (angle, GAP * np.array([math.cos(p), math.sin(p)])) for angle, p in ((0.3, -1.4), (2.1, 0.8), (5.0, 3.0))
]
KEYS = {"eccentricity": 12e-6, "eccentricity_phase": 0.4, "oval": 5e-6, "oval_phase": -0.9}


def height(chi: np.ndarray) -> np.ndarray:
    """What the radius of the sleeve is beyond a round one, at angles from its mark."""
    _, a, b, c, d = SLEEVE
    return a * np.cos(chi) + b * np.sin(chi) + c * np.cos(2.0 * chi) + d * np.sin(2.0 * chi)


@pytest.mark.parametrize(("angle", "place"), PLACES)
def test_it_reaches_as_deep_as_its_outline_does(angle, place):
    """Against the outline itself, point by point; a bore is wide, so that the gap counts to its square."""
    psi = np.linspace(0.0, 2.0 * math.pi, 1_000_001)
    outline = (RADIUS + height(psi - angle)) * np.exp(1j * psi) + complex(*place)
    at = int(np.argmax(np.abs(outline)))
    reach, nx, ny, _slope, _curved = law.deepest(SLEEVE, angle, *place)
    assert reach == pytest.approx(abs(outline[at]) - RADIUS, abs=GAP**2 / RADIUS)
    normal = outline[at] / abs(outline[at])
    assert (nx, ny) == pytest.approx((normal.real, normal.imag), abs=2.0 * GAP / RADIUS)


def test_an_eccentric_sleeve_is_a_circle_about_another_centre():
    once = SLEEVE * [1.0, 1.0, 1.0, 0.0, 0.0]
    for angle, place in PLACES:
        centre = complex(*place) + complex(once[1], once[2]) * np.exp(1j * angle)
        reach, nx, ny, _slope, _curved = law.deepest(once, angle, *place)
        assert reach == pytest.approx(abs(centre), rel=1e-12)
        assert complex(nx, ny) == pytest.approx(centre / abs(centre), rel=1e-12)


@pytest.mark.parametrize(("angle", "place"), PLACES)
def test_its_place_of_contact_is_found_up_to_the_largest_oval(angle, place):
    sleeve = np.array([1.0, 5e-6, 0.0, 0.8 * law.LARGEST_OVAL * GAP, 0.6 * law.LARGEST_OVAL * GAP])
    _reach, nx, ny, slope, _curved = law.deepest(sleeve, angle, *place)
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


def test_a_drop_on_it_keeps_its_books_and_is_another_drop(paper):
    case = DropCase(speed=2.0 * math.pi * 60.0, duration=0.04, tolerance=1e-8, reduction="quick")
    found, plain = simulate_drop(keyed(paper), case), simulate_drop(paper, case)
    assert found.certificate.energy_residual < 1e-7 * found.certificate.energy_scale
    peaks = [np.linalg.norm(one.bearing_force, axis=-1).max(axis=0) for one in (found, plain)]
    assert np.all(np.abs(peaks[0] / peaks[1] - 1.0) > 0.003)


def test_a_round_one_that_is_described_is_none(paper):
    case = DropCase(speed=2.0 * math.pi * 60.0, duration=0.015, reduction="quick")
    found = simulate_drop(keyed(paper, {"eccentricity": 0.0, "oval": 0.0}), case)
    assert found.bearing_force == pytest.approx(simulate_drop(paper, case).bearing_force, rel=1e-4, abs=1.0)


def test_a_machine_file_holds_it_and_refuses_what_cannot_be(lp400):
    assert loads_machine(machine_text(keyed(lp400))) == keyed(lp400)
    with pytest.raises(UsageError, match="'oval_phase' but no 'oval'"):
        lp400.with_values({"NDE.landing_sleeve.oval_phase": 0.3})
    with pytest.raises(
        UsageError, match=r"oval = 100 um, with an air gap of 285 um; expected 23.75 um at most"
    ):
        lp400.with_values({"DE.air_gap": 285e-6, "DE.landing_sleeve.oval": 100e-6})


def test_its_usual_tolerance_is_grade_6():
    """ISO 286-1: 19 µm between 50 and 80 mm, 13 µm between 18 and 30 mm."""
    assert tolerance(math.sqrt(50e-3 * 80e-3)) == pytest.approx(19e-6, abs=0.5e-6)
    assert tolerance(math.sqrt(18e-3 * 30e-3)) == pytest.approx(13e-6, abs=0.5e-6)
