"""The page on critical speeds tells where one of them lies nearer to the nominal speed than allowed."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.machine import example_machine
from rotordrop.report.critical_speeds_page import (
    critical_speeds_cards,
    critical_speeds_json,
    critical_speeds_page,
)
from rotordrop.rotor.campbell import Crossing, StabilityMap, campbell_diagram
from rotordrop.rotor.critical_speeds import critical_speed_map

MACHINE = example_machine("lp400")
NOMINAL = float(MACHINE.speed.nominal)


@lru_cache
def drawn():
    """The map and the diagram of the machine, for other crossings to be put in."""
    found = critical_speed_map(MACHINE, whirl="standstill")
    return {"standstill": found}, campbell_diagram(MACHINE, np.linspace(0.0, NOMINAL, 3), "AMBs")


def page(share, direction="forward", stability=()):
    """The page of a machine with one critical speed, at a share of the nominal one."""
    maps, diagram = drawn()
    crossing = Crossing(speed=share * NOMINAL, line=0, direction=direction, damping_ratio=0.025)
    return critical_speeds_page(MACHINE, maps, {"AMBs": replace(diagram, crossings=(crossing,))}, stability)


def problems(share, direction="forward"):
    return [one.text for one in page(share, direction).verdict if one.level == "bad"]


@pytest.mark.parametrize("share", [0.997, 0.95, 1.04])
def test_a_mode_near_the_nominal_speed_is_a_problem(share):
    (text,) = problems(share)
    hertz = NOMINAL / (2.0 * math.pi)
    assert f"a forward mode meets the rotor's own speed at {share * hertz:.1f} Hz" in text
    away = f"{100.0 * abs(share - 1.0):.1f} %"
    assert f"{away} from the nominal speed of {hertz:.1f} Hz ({60.0 * hertz:.0f} rpm)" in text
    assert "damping ratio of 2.50 % and an amplification factor of 20.0" in text
    assert f"API 617 asks for {'16.0' if share < 1.0 else '26.0'} %" in text


def test_a_mode_further_off_or_against_the_spin_is_none():
    assert problems(0.83) == []
    assert problems(1.27) == []
    assert problems(0.997, "backward") == []


def test_the_verdict_stands_first_and_says_that_nothing_is_too_near():
    first, *others = page(0.83).verdict
    assert first.level == "good" and "No critical speed of the held rotor is nearer" in first.text
    assert {one.level for one in others} == {"notice"}
    levels = [one.level for one in page(0.997).verdict]
    assert levels[0] == "bad" and "good" not in levels


def test_the_stability_map_is_drawn_told_and_in_the_json():
    found = StabilityMap(
        suspension="AMBs",
        speed=100.0,
        node=7,
        coupling=np.array([0.0, 2e6, 4e6]),
        decrement=np.array([0.3, 0.1, -0.1]),
        limit=3e6,
    )
    (section,) = (one for one in page(0.83, stability=[found]).sections if one.heading == "Stability map")
    assert "node 7" in section.text[0]
    assert section.tables[0].rows[0][2].value == 3e6
    np.testing.assert_allclose(section.figures[0].chart.data[0].y, found.decrement, rtol=1e-6)
    told = critical_speeds_json({}, {}, [found])["stability"]["AMBs"]
    assert told["limit_N_m"] == 3e6
    assert told["logarithmic_decrement"] == [0.3, 0.1, -0.1]


def test_the_cards_hold_the_critical_speeds_in_their_order():
    crossings = tuple(
        Crossing(speed=2.0 * math.pi * hertz, line=k, direction=direction, damping_ratio=0.025)
        for k, (hertz, direction) in enumerate(((90.0, "backward"), (548.4, "forward"), (120.0, "forward")))
    )
    diagram = SimpleNamespace(crossings=crossings, suspension="AMBs")
    (card,) = critical_speeds_cards({"AMBs": diagram}, NOMINAL)
    assert card.title == "In its AMBs"
    assert [one.value.text for one in card.figures] == ["90.00 Hz", "120.0 Hz", "548.4 Hz"]
    assert [one.label for one in card.figures[:2]] == [
        "Critical speed 1, backward",
        "Critical speed 2, forward",
    ]
    assert "7\u202f200 rpm; damping 2.50\u00a0%; margin" in card.figures[1].note
    assert "margin" not in card.figures[0].note
