"""Bearings by designation: catalogue numbers, and balls that reproduce them."""

import math

import pytest
from tests.reference.closed_forms import lift_off_force

from rotordrop.elements.catalog.lookup import ball_size, designations, find_bearing
from rotordrop.machine import loads_machine
from rotordrop.physics.ball_bearing import axial_rigidity, bearing_constants
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry


def described(bearing, preload):
    """The bearing as the physics sees it."""
    balls, steel = bearing.complement, bearing.ball_material == "steel"
    return BallBearingGeometry(
        ball_diameter=balls.ball_diameter,
        ball_count=balls.ball_count,
        pitch_diameter=balls.pitch_diameter,
        contact_angle=bearing.contact_angle,
        conformity_inner=balls.conformity,
        conformity_outer=balls.conformity,
        ball_youngs_modulus=208e9 if steel else 315e9,
        ball_poisson_ratio=0.3 if steel else 0.26,
        preload=preload,
    )


def test_the_catalogue_holds_both_makers():
    names = designations()
    assert len(names) == 433 + 107
    assert sum(find_bearing(name).maker == "FAG" for name in names) == 433


@pytest.mark.parametrize(
    "written", ["XCB71914-E", "xcb71914e", "XCB 71914 E", "XCB71914E.T.P4S", "XCB71914-E-T-P4S"]
)
def test_the_bearing_of_the_paper_is_found_however_it_is_written(written):
    bearing = find_bearing(written)
    assert bearing.preload == {"light": 96.0, "medium": 452.0, "heavy": 1026.0}
    assert bearing.lift_off == {"light": 281.0, "medium": 1351.0, "heavy": 3143.0}
    assert bearing.axial_rigidity == pytest.approx({"light": 125.8e6, "medium": 218.6e6, "heavy": 299.0e6})
    assert bearing.ball_material == "silicon nitride"
    assert math.degrees(bearing.contact_angle) == pytest.approx(25.0)


def test_the_balls_of_the_paper_s_bearing_come_from_its_load_ratings_and_say_so():
    balls = find_bearing("XCB71914-E").complement
    assert (balls.ball_count, balls.ball_diameter, balls.pitch_diameter) == (23, 0.009525, 0.085)
    assert "ISO 281/76 load ratings of the 71914 series to 0.3 %" in balls.basis


def test_steel_and_ceramic_bearings_of_a_size_share_their_balls():
    assert find_bearing("B71914C").complement == find_bearing("XCB71914-E").complement


def worst(bearing):
    """Largest relative deviation of rigidity and lift-off force over the preload classes."""
    found = []
    for name, force in bearing.preload.items():
        constants = bearing_constants(described(bearing, force))
        found.append(abs(axial_rigidity(constants) / bearing.axial_rigidity[name] - 1.0))
        if bearing.lift_off:
            found.append(abs(lift_off_force(constants) / bearing.lift_off[name] - 1.0))
    return max(found)


@pytest.mark.parametrize("name", ["B7013C", "HCB7013C", "HS7013C", "XC71914E", "HC71920C", "B7222C"])
def test_reconstructed_balls_reproduce_the_catalogue(name):
    assert worst(find_bearing(name)) < 0.03


def test_a_ball_more_would_be_seen():
    """The reconstruction is no matter of taste: 10 % more balls miss the tables by several per cent."""
    bearing = find_bearing("B7013C")
    constants = bearing_constants(
        BallBearingGeometry(
            **{
                **vars(described(bearing, bearing.preload["medium"])),
                "ball_count": round(1.1 * bearing.complement.ball_count),
            }
        )
    )
    assert abs(axial_rigidity(constants) / bearing.axial_rigidity["medium"] - 1.0) > 0.05


def test_every_complement_fits_on_its_circle():
    for name in designations():
        bearing = find_bearing(name)
        balls = bearing.complement
        filled = balls.ball_count * balls.ball_diameter / (math.pi * balls.pitch_diameter)
        assert 0.55 < filled < 0.9, name
        assert balls.ball_diameter < 0.66 * 0.5 * (bearing.outside_diameter - bearing.bore), name


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("HS71914C", "small"),
        ("HC71914C", "small"),
        ("XC7014C", "small"),
        ("B7014C", "standard"),
        ("HCB7014C", "standard"),
        ("XCB7014C", "standard"),
    ],
)
def test_the_series_tells_the_size_of_the_balls(name, size):
    assert ball_size(name) == size


def test_published_balls_are_taken_as_published():
    bearing = find_bearing("KH 61914 E TA")
    assert (bearing.maker, bearing.complement.ball_count) == ("GMN", 32)
    assert "GMN catalogue" in bearing.complement.basis


def test_a_mistyped_designation_is_met_with_the_nearest():
    with pytest.raises(LookupError, match=r"no bearing 'XCB71914-F'; did you mean one of .*XCB71914[CE]"):
        find_bearing("XCB71914-F")


def test_a_machine_says_what_it_took_from_the_catalogue(small_text):
    machine = loads_machine(small_text)
    inferred = {path: (text, why) for path, text, why in machine.inferred}
    assert inferred["NDE.bearing.ball_count"][0] == "23"
    assert "ISO 281/76" in inferred["NDE.bearing.ball_diameter"][1]
    assert inferred["DE.bearing.preload"] == ("1.03 kN", "FAG catalogue, heavy preload of XCB71914E.T.P4S")
    defaults = {path: (text, why) for path, text, why in machine.defaults_in_use}
    assert defaults["NDE.bearing.preload"][0] == "96.0 N"


def test_a_preload_that_nobody_stated_is_light_to_heavy(small_text):
    """The designation leaves the class open, so that the prior reaches from the lightest to the heaviest."""
    unsaid, said = (bearing.bearing.preload for bearing in loads_machine(small_text).touchdown_bearings)
    assert (unsaid.value, unsaid.range) == (96.0, (96.0, 1026.0))
    assert (said.value, said.range) == (1026.0, None)


def test_what_is_given_goes_before_the_catalogue(changed):
    text = changed(
        ('preload = "heavy"', 'preload = "300 N", ball_diameter = "8.731 mm", ball_material = "steel"')
    )
    bearing = loads_machine(text).touchdown_bearings[1].bearing
    assert bearing.ball_diameter.value == pytest.approx(8.731e-3)
    assert (bearing.ball_count, bearing.preload.value) == (23, 300.0)
    assert (bearing.ball_youngs_modulus.value, bearing.ball_density.value) == (208e9, 7800.0)
