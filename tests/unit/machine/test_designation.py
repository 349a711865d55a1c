"""Designations as people write them: series, bore, kind, contact angle, balls, clearance, pairing."""

import math

import pytest

from rotordrop.elements.catalog.designation import read_designation
from rotordrop.elements.catalog.lookup import find_bearing, search_bearings

# written; series and bore; contact angle [°] (D: deep groove, ?: not said); h: hybrid, s: small balls;
# clearance class, preload or arrangement
WRITTEN = """
71914 | 71914 | ? |
7914 | 71914 | ? |
B71914-C-T-P4S | 71914 | 15 |
B71914C.T.P4S | 71914 | 15 |
B71914-E-T-P4S-UL | 71914 | 25 | light
B71914E-T-P4S-DUM | 71914 | 25 | medium
B7016-C-T-P4S | 7016 | 15 |
B7016-C-T-P4S-UL | 7016 | 15 | light
FAG B7016-E-2RSD-T-P4S-UH | 7016 | 25 | heavy
HCB71914-E-2RSD-T-P4S-UL | 71914 | 25 | h light
HCB7016-C-T-P4S | 7016 | 15 | h
XCB71914-E | 71914 | 25 | h
XCB 71914 E.T.P4S | 71914 | 25 | h
xcb71914e | 71914 | 25 | h
HS71914-C-T-P4S | 71914 | 15 | s
HSS71914-C-T-P4S | 71914 | 15 | s
HC71914-E-T-P4S | 71914 | 25 | h s
HCS71914-E-T-P4S-UL | 71914 | 25 | h s light
XC7014-C-T-P4S | 7014 | 15 | h s
B71816-C-TPA-P4 | 71816 | 15 |
7016 ACD/HCP4A | 7016 | 25 | h
7016 ACD/P4A | 7016 | 25 |
7016 CD/P4A | 7016 | 15 |
7016 CD/HCP4A | 7016 | 15 | h
S7016 ACD/HCP4ADGA | 7016 | 25 | h light
7014 CD/P4ADGB | 7014 | 15 | medium
7014 CD/P4ADBB | 7014 | 15 | O medium
7014 ACD/P4ADFA | 7014 | 25 | X light
7014 ACD/P4ADTC | 7014 | 25 | tandem heavy
71914 CE/HCP4A | 71914 | 15 | h s
71914 ACE/P4A | 71914 | 25 | s
71914 CB/P4A | 71914 | 15 | s
SKF 71920 ACD/P4A | 71920 | 25 |
71824 ACD/P4 | 71824 | 25 |
7216 BECBM | 7216 | 40 |
7216 BEP | 7216 | 40 |
7216 BEGAP | 7216 | 40 |
7216-B-TVP | 7216 | 40 |
7216 B | 7216 | 40 |
7206 BEGBP | 7206 | 40 |
NSK 7014CTYNDBLP4 | 7014 | 15 | O light
NSK 7914A5TRDULP4 | 71914 | 25 | light
7014A5TYNSULP4 | 7014 | 25 | light
7914CTYNDFMP3 | 71914 | 15 | X medium
7014A | 7014 | 30 |
NTN 5S-7014UCG/GNP42 | 7014 | 15 | h
5S-7914CT1G/GLP42 | 71914 | 15 | h light
7014ADG/GLP42 | 7014 | 25 | light
S 6016 C TA | 6016 | 15 |
S 6016 E TA | 6016 | 25 |
S6016 E TA P4 DUL | 6016 | 25 | light
GMN S 61914 C TA | 61914 | 15 |
SM 6010 C TA | 6010 | 15 |
KH 61914 E TA | 61914 | 25 | s
HY KH 61914 E TA | 61914 | 25 | h s
HY S 6016 E TA | 6016 | 25 | h
HYSM 6011 C TA | 6011 | 15 | h
S 6206 E TA | 6206 | 25 |
6016 | 6016 | D |
6016-2RS1/C3 | 6016 | D | C3
6016-2RS1 | 6016 | D |
6016-2Z/C3 | 6016 | D | C3
6016-2Z/C3WT | 6016 | D | C3
6016 2ZR C3 | 6016 | D | C3
6016-2Z | 6016 | D |
6016-C3 | 6016 | D | C3
6016 C4 | 6016 | D | C4
6016/C2 | 6016 | D | C2
6016 M/C3 | 6016 | D | C3
6016-M-C4 | 6016 | D | C4
6016/HC5C3 | 6016 | D | h C3
6016-2RSLTN9/HC5C3WT | 6016 | D | h C3
FAG 6016.2RSR.C3 | 6016 | D | C3
FAG 6016-2RSR-C3 | 6016 | D | C3
6016-C-2HRS-C3 | 6016 | D | C3
6016 2HRS | 6016 | D |
6016 ZZ C3 | 6016 | D | C3
6016ZZC3 | 6016 | D | C3
6016ZZCM | 6016 | D |
6016LLU/2AS | 6016 | D |
6016LLBC3/5K | 6016 | D | C3
6016DDUC3 | 6016 | D | C3
NSK 6016VVC3E | 6016 | D | C3
6016 P6 | 6016 | D |
6206 P63 | 6206 | D | C3
6005 2RS C3 P6 | 6005 | D | C3
W 6016-2Z | 6016 | D |
SS6016 | 6016 | D |
HC6016 | 6016 | D | h
6216-2Z/C3 | 6216 | D | C3
SKF 61914 | 61914 | D |
61914-2RZ | 61914 | D |
6914ZZ | 61914 | D |
6914 ZZ C3 | 61914 | D | C3
61816-2RS1 | 61816 | D |
6816ZZ | 61816 | D |
608-2RSH | 608 | D |
608ZZ | 608 | D |
625 | 625 | D |
619/8-2Z | 619/8 | D |
618/5 | 618/5 | D |
60/28 | 60/28 | D |
61800 | 61800 | D |
6200-2Z | 6200 | D |
6003 CN | 6003 | D | CN
"""
CASES = [tuple(part.strip() for part in line.split("|")) for line in WRITTEN.strip().splitlines()]


def test_there_are_a_hundred_of_them():
    assert len(CASES) >= 100


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


@pytest.mark.parametrize("written", ["30206", "NU210", "22216 E", "paper", "", "51110", "16016"])
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


def test_an_unknown_size_is_answered_with_the_nearest():
    with pytest.raises(
        LookupError, match=r"series 619 at a bore of 11 mm are not known.*619/9, 61900, 61901"
    ):
        find_bearing("619/11")


def test_the_search_puts_what_is_meant_before_the_listed_bearings_of_its_size():
    found = search_bearings("7016 ACD/HCP4A")
    assert [found[0].designation, found[0].listed] == ["7016 ACD/HCP4A", False]
    assert {b.designation for b in found[1:]} >= {"B7016C.T.P4S", "HCB7016C.T.P4S", "S 6016 E TA"}
    assert all(b.bore == pytest.approx(0.080) and b.listed for b in found[1:])
