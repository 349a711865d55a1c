"""Bearings by designation, as people write them, and as the catalogue has them."""

import math
from dataclasses import replace

import pytest
from tests.reference.ball_bearing_catalogue import geometry_of
from tests.reference.closed_forms import lift_off_force

from rotordrop.elements.catalog.designation import read_designation
from rotordrop.elements.catalog.lookup import designations, find_bearing, search_bearings
from rotordrop.machine import loads_machine
from rotordrop.physics.ball_bearing import axial_rigidity, bearing_constants


def test_the_catalogue_holds_both_makers_and_every_complement_fits_on_its_circle():
    names = designations()
    assert len(names) == 433 + 107
    assert sum(find_bearing(name).maker == "FAG" for name in names) == 433
    for name in designations():
        bearing = find_bearing(name)
        balls = bearing.complement
        filled = balls.ball_count * balls.ball_diameter / (math.pi * balls.pitch_diameter)
        assert 0.55 < filled < 0.9, name
        assert balls.ball_diameter < 0.66 * 0.5 * (bearing.outside_diameter - bearing.bore), name


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


def test_balls_come_from_load_ratings_or_as_published_and_say_so():
    balls = find_bearing("XCB71914-E").complement
    assert (balls.ball_count, balls.ball_diameter, balls.pitch_diameter) == (23, 0.009525, 0.085)
    assert find_bearing("B71914C").complement == find_bearing("XCB71914-E").complement
    bearing = find_bearing("KH 61914 E TA")
    assert (bearing.maker, bearing.complement.ball_count) == ("GMN", 32)


def worst(bearing):
    """Largest relative deviation of rigidity and lift-off force over the preload classes."""
    found = []
    for name, force in bearing.preload.items():
        constants = bearing_constants(geometry_of(bearing, force))
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
    more = round(1.1 * bearing.complement.ball_count)
    constants = bearing_constants(replace(geometry_of(bearing, bearing.preload["medium"]), ball_count=more))
    assert abs(axial_rigidity(constants) / bearing.axial_rigidity["medium"] - 1.0) > 0.05


def test_a_mistake_is_answered_with_the_nearest():
    with pytest.raises(LookupError, match=r"no bearing 'XCB71914-F'; did you mean .*XCB71914[CE]"):
        find_bearing("XCB71914-F")
    for typed, meant in (("HCB7O20C", "HCB7020C"), ("7OO8", "7008"), ("7OI4", "7014")):
        with pytest.raises(LookupError, match=f"no bearing '{typed}'; did you mean {meant}\\?"):
            find_bearing(typed)
    with pytest.raises(
        LookupError, match=r"series 619 at a bore of 11 mm are not known.*619/9 or 61900 or 61901"
    ):
        find_bearing("619/11")


def test_a_machine_says_what_it_took_and_that_an_unstated_preload_is_light_to_heavy(small_text):
    """The designation leaves the class open, so that the prior reaches from the lightest to the heaviest."""
    machine = loads_machine(small_text)
    inferred = {path: (text, why) for path, text, why in machine.inferred}
    assert inferred["NDE.bearing.ball_count"][0] == "23"
    assert inferred["DE.bearing.preload"] == ("1.03 kN", "FAG catalogue, heavy preload of XCB71914E.T.P4S")
    defaults = {path: (text, why) for path, text, why in machine.defaults_in_use}
    assert defaults["NDE.bearing.preload"][0] == "96.0 N"
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


# series and bore; contact angle [°] (D: deep groove, ?: not said); h: hybrid, s: small balls, class of
# clearance or preload, arrangement; as written
WRITTEN = """
71914 | ? | | 71914, 7914
71914 | 15 | | B71914-C-T-P4S, B71914C.T.P4S
71914 | 25 | light | B71914-E-T-P4S-UL, NSK 7914A5TRDULP4
71914 | 25 | medium | B71914E-T-P4S-DUM
7016 | 15 | | B7016-C-T-P4S, 7016 CD/P4A
7016 | 15 | light | B7016-C-T-P4S-UL
7016 | 25 | heavy | FAG B7016-E-2RSD-T-P4S-UH
71914 | 25 | h light | HCB71914-E-2RSD-T-P4S-UL
7016 | 15 | h | HCB7016-C-T-P4S, 7016 CD/HCP4A
71914 | 25 | h | XCB71914-E, XCB 71914 E.T.P4S, xcb71914e
71914 | 15 | s | HS71914-C-T-P4S, HSS71914-C-T-P4S, 71914 CB/P4A
71914 | 25 | h s | HC71914-E-T-P4S
71914 | 25 | h s light | HCS71914-E-T-P4S-UL
7014 | 15 | h s | XC7014-C-T-P4S
71816 | 15 | | B71816-C-TPA-P4
7016 | 25 | h | 7016 ACD/HCP4A
7016 | 25 | | 7016 ACD/P4A
7016 | 25 | h light | S7016 ACD/HCP4ADGA
7014 | 15 | medium | 7014 CD/P4ADGB
7014 | 15 | O medium | 7014 CD/P4ADBB
7014 | 25 | X light | 7014 ACD/P4ADFA
7014 | 25 | tandem heavy | 7014 ACD/P4ADTC
71914 | 15 | h s | 71914 CE/HCP4A
71914 | 25 | s | 71914 ACE/P4A
71920 | 25 | | SKF 71920 ACD/P4A
7016 | 18 | s | 80BNR10S, NSK 80BNR10STYNDUELP4
71914 | 25 | s | 70BER19S
71824 | 25 | | 71824 ACD/P4
7216 | 40 | | 7216 BECBM, 7216 BEP, 7216 BEGAP, 7216-B-TVP, 7216 B
7206 | 40 | | 7206 BEGBP
7014 | 15 | O light | NSK 7014CTYNDBLP4
7014 | 25 | light | 7014A5TYNSULP4, 7014ADG/GLP42
71914 | 15 | X medium | 7914CTYNDFMP3
7014 | 30 | | 7014A
7014 | 15 | h | NTN 5S-7014UCG/GNP42
71914 | 15 | h light | 5S-7914CT1G/GLP42
6016 | 15 | | S 6016 C TA
6016 | 25 | | S 6016 E TA
6016 | 25 | light | S6016 E TA P4 DUL
61914 | 15 | | GMN S 61914 C TA
6010 | 15 | | SM 6010 C TA
61914 | 25 | s | KH 61914 E TA
61914 | 25 | h s | HY KH 61914 E TA
6016 | 25 | h | HY S 6016 E TA
6011 | 15 | h | HYSM 6011 C TA
6206 | 25 | | S 6206 E TA
6016 | D | | 6016, 6016-2RS1, 6016-2Z, 6016 2HRS, 6016ZZCM, 6016LLU/2AS, 6016 P6, W 6016-2Z, SS6016
6016 | D | C3 | 6016-2RS1/C3, 6016-2Z/C3, 6016-2Z/C3WT, 6016 2ZR C3, 6016-C3, 6016 M/C3, FAG 6016.2RSR.C3
6016 | D | C3 | FAG 6016-2RSR-C3, 6016-C-2HRS-C3, 6016 ZZ C3, 6016ZZC3, 6016LLBC3/5K, 6016DDUC3
6016 | D | C3 | NSK 6016VVC3E
6016 | D | C4 | 6016 C4, 6016-M-C4
6016 | D | C2 | 6016/C2
6016 | D | h C3 | 6016/HC5C3, 6016-2RSLTN9/HC5C3WT
6206 | D | C3 | 6206 P63
6005 | D | C3 | 6005 2RS C3 P6
6016 | D | h | HC6016
6216 | D | C3 | 6216-2Z/C3
61914 | D | | SKF 61914, 61914-2RZ, 6914ZZ
61914 | D | C3 | 6914 ZZ C3
61816 | D | | 61816-2RS1, 6816ZZ
608 | D | | 608-2RSH, 608ZZ
625 | D | | 625
619/8 | D | | 619/8-2Z
618/5 | D | | 618/5
60/28 | D | | 60/28
61800 | D | | 61800
6200 | D | | 6200-2Z
6003 | D | CN | 6003 CN
"""
ROWS = [[part.strip() for part in line.split("|")] for line in WRITTEN.strip().splitlines()]
CASES = [(one.strip(), *said) for *said, written in ROWS for one in written.split(",")]


@pytest.mark.parametrize(("written", "basic", "angle", "more"), CASES, ids=[case[0] for case in CASES])
def test_a_designation_as_people_write_it(written, basic, angle, more):
    read = read_designation(written)
    assert read is not None
    assert read.basic == basic
    assert read.kind == ("deep groove" if angle == "D" else "angular contact")
    said = None if read.contact_angle is None else f"{math.degrees(read.contact_angle):.0f}"
    assert said == (None if angle in "D?" else angle)
    words = set(more.split())
    assert read.hybrid == ("h" in words)
    assert read.balls == ("small" if "s" in words else "standard")
    found = {read.clearance_class, read.preload_class, read.arrangement} - {None}
    assert found == words - {"h", "s"}


@pytest.mark.parametrize("written", [case[0] for case in CASES])
def test_every_one_of_them_is_found_or_inferred(written):
    bearing = find_bearing(written)
    assert bearing.complement.ball_count >= 5
    listed = bearing.complement.count_range is None
    assert listed == bearing.listed
    assert search_bearings(written)[0] == bearing


@pytest.mark.parametrize("written", ["30206", "NU210", "NU7020X99", "22216 E", "paper", "", "51110", "16016"])
def test_bearings_of_other_kinds_are_not_read_as_one_of_these(written):
    assert read_designation(written) is None


@pytest.mark.parametrize(
    ("written", "listed"),
    [
        ("B7016-C-T-P4S-UL", "B7016C.T.P4S"),
        ("HSS71914-C", "HS71914C.T.P4S"),
        ("HCB71914-E-2RSD-T-P4S-UL", "HCB71914E.T.P4S"),
        ("S 6016", "S 6016 E TA"),
        ("GMN S61914 C", "S 61914 C TA"),
    ],
)
def test_a_listed_bearing_is_found_behind_its_suffixes(written, listed):
    assert find_bearing(written).designation == listed


def test_the_search_puts_what_is_meant_before_the_listed_bearings_of_its_size():
    found = search_bearings("7016 ACD/HCP4A")
    assert [found[0].designation, found[0].listed] == ["7016 ACD/HCP4A", False]
    assert {b.designation for b in found[1:]} >= {"B7016C.T.P4S", "HCB7016C.T.P4S", "S 6016 E TA"}
    assert all(b.bore == pytest.approx(0.080) and b.listed for b in found[1:])
