"""Sizes of ISO 15, load ratings of ISO 76 and ISO 281, and balls inferred from them."""

import math

import numpy as np
import pytest
from tests.reference.ball_bearing_catalogue import geometry_of

from rotordrop.elements.bearing_numbers import inferred_stress_sigma
from rotordrop.elements.catalog.boundary import DIMENSION_SERIES, boundary_dimensions
from rotordrop.elements.catalog.designation import read_designation
from rotordrop.elements.catalog.inference import (
    PairRigidity,
    dynamic_rating,
    groove_factors,
    infer_balls,
    pair_rigidity,
    static_rating,
)
from rotordrop.elements.catalog.lookup import ball_size, designations, find_bearing
from rotordrop.errors import MachineFileError
from rotordrop.known import NINETY
from rotordrop.machine import loads_machine
from rotordrop.physics.ball_bearing import axial_rigidity, bearing_constants
from rotordrop.physics.hertz import compliance, race_contact


@pytest.mark.parametrize("name", designations())
def test_sizes_and_boundary_dimensions_are_those_of_both_catalogues(name):
    listed, read = find_bearing(name), read_designation(name)
    assert ball_size(name) == read.balls
    assert read.bore == pytest.approx(listed.bore)
    outside, width = boundary_dimensions(read.series, read.bore)
    assert outside == pytest.approx(listed.outside_diameter)
    assert listed.width is None or width == pytest.approx(listed.width)


# Bearings whose balls are public: those of the Case Western Reserve University test rig (6203, 6205) and
# the series they belong to.
PUBLIC = [("6203", 8, 6.746), ("6204", 8, 7.938), ("6205", 9, 7.938), ("6206", 9, 9.525), ("6207", 9, 11.112)]


@pytest.mark.parametrize(("name", "count", "diameter"), PUBLIC)
def test_public_deep_groove_complements_lie_in_their_interval(name, count, diameter):
    balls = find_bearing(name).complement
    assert balls.count_range[0] <= count <= balls.count_range[1]
    assert balls.diameter_range[0] - 1e-6 <= 1e-3 * diameter <= balls.diameter_range[1] + 1e-6
    assert balls.count_range[1] - balls.count_range[0] <= 3


def test_nine_in_ten_of_the_published_complements_lie_in_their_interval():
    listed = [find_bearing(name) for name in designations()]
    listed = [bearing for bearing in listed if bearing.maker == "GMN"]
    held = 0
    for bearing in listed:
        read = read_designation(bearing.designation)
        found = infer_balls(
            kind=read.kind,
            dimension_series=DIMENSION_SERIES[read.series],
            bore=bearing.bore,
            outside_diameter=bearing.outside_diameter,
            contact_angle=bearing.contact_angle,
            small_balls=read.balls == "small",
        )
        count, diameter = bearing.complement.ball_count, bearing.complement.ball_diameter
        held += (
            found.count_range[0] <= count <= found.count_range[1]
            and found.diameter_range[0] - 1e-6 <= diameter <= found.diameter_range[1] + 1e-6
        )
    assert len(listed) == 107
    assert held / len(listed) > 0.9


@pytest.mark.parametrize(("count", "diameter", "pitch"), [(9, 7.938, 38.5), (14, 13.494, 102.5)])
def test_the_static_rating_puts_4200_mpa_on_the_most_loaded_ball(count, diameter, pitch):
    """ISO 76 defines it so, with grooves of 0.52 ball diameters inside and 5/Z of the load on that ball."""
    rating = static_rating(count, 1e-3 * diameter, 1e-3 * pitch, 0.0)
    steel = compliance(207e9, 0.3, 207e9, 0.3)
    contact = race_contact(1e-3 * diameter, 1e-3 * pitch, 0.52, 0.0, steel, inner=True)
    assert contact.maximum_pressure(5.0 * rating / count) == pytest.approx(4200e6, rel=0.02)


@pytest.mark.parametrize("ratio", [0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
def test_the_dynamic_rating_follows_lundberg_and_palmgren(ratio):
    """f_c in closed form for grooves of 0.52 ball diameters and a reduction factor of 0.95."""
    groove = 0.52
    shape = ((1 - ratio) / (1 + ratio)) ** 1.72
    closed = (1 + (1.04 * shape) ** (10 / 3)) ** -0.3
    closed *= (
        ratio**0.3 * (1 - ratio) ** 1.39 / (1 + ratio) ** (1 / 3) * (2 * groove / (2 * groove - 1)) ** 0.41
    )
    expected = 0.95 * 39.88 * closed * 1.3 * 8 ** (2 / 3) * 10**1.8
    assert dynamic_rating(8, 10e-3, 10e-3 / ratio, 0.0) == pytest.approx(expected, rel=0.02)


def test_load_ratings_narrow_what_the_size_leaves_open():
    size = {"kind": "deep groove", "dimension_series": "10", "bore": 0.08, "outside_diameter": 0.125}
    alone = infer_balls(**size)
    ratings = {
        "static_load_rating": static_rating(14, 13.494e-3, 0.1025, 0.0),
        "dynamic_load_rating": dynamic_rating(14, 13.494e-3, 0.1025, 0.0),
    }
    rated = infer_balls(**size, **ratings)
    assert (rated.ball_count, rated.ball_diameter) == (14, pytest.approx(13.494e-3, rel=1e-3))
    assert (
        rated.diameter_range[1] - rated.diameter_range[0] < alone.diameter_range[1] - alone.diameter_range[0]
    )


FIRST = 'bearing = { designation = "XCB71914-E" }'


def described(small_text, text):
    assert FIRST in small_text
    table = ", ".join(line for line in text.splitlines())
    return loads_machine(small_text.replace(FIRST, f"bearing = {{ {table} }}")).touchdown_bearings[0].bearing


def test_a_bearing_by_designation_takes_rows_angle_clearance_and_preload_from_it(small_text):
    bearing = described(small_text, 'designation = "6014-2Z/C3"')
    assert bearing.arrangement == "single"
    assert bearing.clearance.range == pytest.approx((25e-6, 51e-6))
    assert (bearing.preload.value, bearing.contact_angle.value) == (0.0, 0.0)
    assert bearing.ball_material == "steel"
    assert bearing.ball_diameter.status == "inferred"
    assert bearing.ball_diameter.range == pytest.approx((10.319e-3, 12.7e-3), rel=1e-3)
    bearing = described(small_text, 'designation = "7014 ACD/HCP4ADBB"')
    assert math.degrees(bearing.contact_angle.value) == pytest.approx(25.0)
    assert (bearing.arrangement, bearing.ball_material) == ("O", "silicon nitride")
    low, high = bearing.preload.range
    assert high / low == pytest.approx(4.0)
    with pytest.raises(MachineFileError, match=r"has no 'preload'; write for example preload = \"100 N\""):
        described(small_text, 'designation = "71820 C"')


def test_ratings_in_the_file_narrow_the_balls_and_inferred_ones_widen_the_stress(small_text):
    rated = described(
        small_text, 'designation = "6014"\nstatic_load_rating = "30.9 kN"\ndynamic_load_rating = "38.1 kN"'
    )
    alone = described(small_text, 'designation = "6014"')
    assert rated.ball_diameter.range[1] <= alone.ball_diameter.range[1]
    assert inferred_stress_sigma(rated) < inferred_stress_sigma(alone)
    assert inferred_stress_sigma(loads_machine(small_text).touchdown_bearings[0].bearing) == 0.0
    bearing = described(small_text, 'designation = "7014 ACD/P4A"')
    sigma = inferred_stress_sigma(bearing)
    assert 0.03 < sigma < 0.12


@pytest.mark.parametrize("name", ["B7016C.T.P4S", "HCB71914E.T.P4S", "S 6016 E TA", "B706C.T.P4S"])
@pytest.mark.parametrize("preload_class", ["light", "heavy"])
def test_the_rigidity_of_a_pair_is_that_of_the_simulated_bearing(name, preload_class):
    """In closed form for the catalogue, by Hertz contacts for the simulation."""
    bearing, balls = find_bearing(name), find_bearing(name).complement
    preload, hybrid = bearing.preload[preload_class], bearing.ball_material != "steel"
    simulated = bearing_constants(geometry_of(bearing, preload))
    row = (balls.ball_count, balls.ball_diameter, balls.pitch_diameter, bearing.contact_angle)
    closed = pair_rigidity(row, balls.conformity, preload, hybrid=hybrid)
    assert closed == pytest.approx(axial_rigidity(simulated), rel=0.01)


def test_a_rigidity_narrows_what_size_and_ratings_leave_open():
    """The balls come back from which the rigidity was computed; the grooves are known from nothing else."""
    row, conformity = (20, 11.1125e-3, 0.09, math.radians(15.0)), 0.52
    size = {
        "kind": "angular contact",
        "dimension_series": "10",
        "bore": 0.07,
        "outside_diameter": 0.11,
        "contact_angle": row[3],
    }
    rigidity = PairRigidity(value=pair_rigidity(row, conformity, 290.0), preload=290.0)
    alone, known = infer_balls(**size), infer_balls(**size, rigidity=rigidity)
    known_width, width = (np.ptp(found.conformity_range) for found in (known, alone))
    assert (alone.conformity, width) == (0.53, pytest.approx(2.0 * NINETY * 0.011))
    assert known_width < 0.9 * width
    assert abs(known.conformity - conformity) < abs(alone.conformity - conformity)


def test_a_rigidity_in_the_file_narrows_the_grooves_and_deep_grooves_are_those_of_the_tables(small_text):
    """At 0.52 the tables of ISO 281 hold as they stand, so that a dynamic rating needs no correction."""
    rated = 'static_load_rating = "43 kN"\ndynamic_load_rating = "47 kN"'
    stiff = 'designation = "7014 CD"\npreload = "290 N"\naxial_rigidity = "88 N/um"\n' + rated
    known = described(small_text, stiff).conformity_inner.range
    alone = described(small_text, 'designation = "7014 CD"\npreload = "290 N"\n' + rated)
    assert known[1] - known[0] < alone.conformity_inner.range[1] - alone.conformity_inner.range[0]
    with pytest.raises(MachineFileError, match=r"axial_rigidity = 88\.0 MN/m holds at a preload"):
        described(small_text, 'designation = "7014 CD"\naxial_rigidity = "88 N/um"')
    balls = infer_balls(kind="deep groove", dimension_series="10", bore=0.08, outside_diameter=0.125)
    row = (balls.ball_count, balls.ball_diameter, balls.pitch_diameter, 0.0)
    assert balls.conformity == 0.52
    assert groove_factors(row, balls.conformity) == pytest.approx((1.0, 1.0), abs=1e-12)


def test_ratings_of_wide_grooves_are_those_of_the_same_balls():
    """GMN lists S 605 and SM 605 with 8 balls of 2.381 mm and 0.57 of the static rating: other grooves."""
    size = {"kind": "angular contact", "dimension_series": "10", "bore": 0.005, "outside_diameter": 0.014}
    for static, dynamic in ((545.0, 1400.0), (310.0, 990.0)):
        found = infer_balls(
            **size, contact_angle=math.radians(15.0), static_load_rating=static, dynamic_load_rating=dynamic
        )
        assert found.count_range[0] <= 8 <= found.count_range[1]
        assert found.diameter_range[0] <= 2.3813e-3 <= found.diameter_range[1] + 1e-6
