"""Static safety by ISO 76: by C0 and by the stress, which must agree at the rating itself."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.elements.race_bearing import numbers_of
from rotordrop.estimate.severity_numbers import static_safety_of_load, static_safety_of_stress
from rotordrop.machine import example_machine
from rotordrop.severity.fatigue import fatigue_shares
from rotordrop.severity.numbers import SEVERITY


@pytest.fixture(scope="module")
def numbers():
    return numbers_of(example_machine("paper").touchdown_bearings[0])


def test_the_static_rating_is_where_its_stress_is_reached():
    assert static_safety_of_stress(4.2e9) == 1.0
    assert static_safety_of_stress(2.1e9) == pytest.approx(8.0)
    assert static_safety_of_load(40e3, 10e3) == 4.0


def test_ratings_follow_from_the_balls_or_are_taken_as_given(numbers):
    found = numbers.ratings()
    assert found.rows == 2 and found.balls == 23
    assert found.static / 2 == pytest.approx(30.9e3, rel=0.01)
    assert found.dynamic == pytest.approx(31.6e3, rel=0.01)
    assert "ISO 76" in found.source
    given = {"NDE.bearing.static_load_rating": 32e3, "NDE.bearing.dynamic_load_rating": 33e3}
    bearing = example_machine("paper").with_values(given).touchdown_bearings[0]
    assert numbers_of(bearing).ratings().static == 64e3
    assert numbers_of(bearing).ratings().dynamic == 33e3


STANDARD = {
    "ball_youngs_modulus": 207e9,
    "ball_poisson_ratio": 0.3,
    "ring_youngs_modulus": 207e9,
    "ring_poisson_ratio": 0.3,
    "conformity_inner": 0.52,
    "conformity_outer": 0.52,
    "preload": 20.0,
}


def test_both_safeties_agree_for_steel_balls_in_the_grooves_of_the_standard():
    """At a radial load of C0 the most loaded ball of the standard has 4 200 MPa.

    The standard puts 5/Z of the load on it, a bearing without play 4.37/Z (Stribeck 1901), hence the ratio.
    Ceramic balls in wider grooves press harder.
    """
    found = []
    for values in (STANDARD, {}):
        machine = example_machine("paper").with_values({f"NDE.bearing.{k}": v for k, v in values.items()})
        numbers = numbers_of(machine.touchdown_bearings[0])
        loads = numbers.element_loads_under(np.array([[0.0, numbers.ratings().static]]))
        stress = numbers.constants.stress_coefficient_inner * loads.max() ** (1.0 / 3.0)
        found.append(static_safety_of_stress(float(stress)))
    assert found[0] == pytest.approx(5.0 / 4.37, abs=0.06)
    assert found[1] < 0.7


def test_a_drop_uses_next_to_nothing_of_a_life(numbers):
    time = np.linspace(0.0, 0.2, 2001)
    force = np.stack([np.zeros(2001), 4000.0 * np.abs(np.sin(60.0 * time))], axis=1)
    spin = np.where(time > 0.01, 2.0 * np.pi * 60.0, 0.0)
    loads = numbers.element_loads_under(force)
    segments, standard, rainflow = fatigue_shares(numbers.ratings(), time, loads, spin)
    assert 0.0 < rainflow < segments < 1e-5
    assert segments == pytest.approx(standard, rel=0.3)


def test_every_number_has_its_own_field_and_a_direction():
    assert len({one.field for one in SEVERITY}) == len(SEVERITY)
    assert [one.field for one in SEVERITY if not one.more_is_worse] == [
        "severity.static_safety",
        "severity.static_safety_of_rating",
    ]
