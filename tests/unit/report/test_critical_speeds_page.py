"""The page on critical speeds tells where one of them lies nearer to the nominal speed than allowed."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.machine import example_machine
from rotordrop.report.critical_speeds_page import (
    _stability_section,
    _verdict,
    critical_speeds_cards,
    critical_speeds_json,
)
from rotordrop.rotor.campbell import Crossing, StabilityMap

AT_LINES = {"tangent": np.array([100.0]), "with support mass": np.array([90.0])}


def said(hertz, direction="forward", nominal=550.0):
    crossing = Crossing(speed=2.0 * math.pi * hertz, line=0, direction=direction, damping_ratio=0.025)
    machine = SimpleNamespace(speed=SimpleNamespace(nominal=2.0 * math.pi * nominal))
    found, diagrams = (
        SimpleNamespace(at_lines=AT_LINES, followed=False),
        {"AMBs": SimpleNamespace(crossings=(crossing,))},
    )
    return [statement.text for statement in _verdict(machine, found, diagrams) if statement.level == "bad"]


@pytest.mark.parametrize("hertz", [548.4, 523.0, 577.0])
def test_a_mode_near_the_nominal_speed_is_a_problem(hertz):
    (text,) = said(hertz)
    assert f"a forward mode meets the rotor's own speed at {hertz:.1f} Hz" in text
    assert f"{abs(hertz / 550.0 - 1.0):.1%} from the nominal speed of 550.0 Hz (33000 rpm)" in text
    assert "damping ratio of 2.50% and an amplification factor of 20.0" in text
    assert f"API 617 asks for {'16.0' if hertz < 550.0 else '26.0'}%" in text


def test_a_mode_further_off_or_against_the_spin_is_none():
    assert said(455.0) == []
    assert said(700.0) == []
    assert said(548.4, "backward") == []


def test_the_verdict_stands_first_and_says_that_nothing_is_too_near():
    crossing = Crossing(speed=2.0 * math.pi * 455.0, line=0, direction="forward", damping_ratio=0.025)
    machine = SimpleNamespace(speed=SimpleNamespace(nominal=2.0 * math.pi * 550.0))
    found, diagrams = (
        SimpleNamespace(at_lines=AT_LINES, followed=False),
        {"AMBs": SimpleNamespace(crossings=(crossing,))},
    )
    first, *others = _verdict(machine, found, diagrams)
    assert first.level == "good" and "No critical speed of the held rotor is nearer" in first.text
    assert {one.level for one in others} == {"notice"}
    near = Crossing(speed=2.0 * math.pi * 548.0, line=0, direction="forward", damping_ratio=0.025)
    levels = [one.level for one in _verdict(machine, found, {"AMBs": SimpleNamespace(crossings=(near,))})]
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
    (section,) = _stability_section(SimpleNamespace(speed=SimpleNamespace(nominal=100.0)), [found])
    assert "node 7" in section.text[0]
    assert section.tables[0].rows[0][2].value == 3e6
    np.testing.assert_allclose(section.figures[0].chart.data[0].y, found.decrement, rtol=1e-6)
    told = critical_speeds_json({}, {}, [found])["stability"]["AMBs"]
    assert told["limit_N_m"] == 3e6
    assert told["logarithmic_decrement"] == [0.3, 0.1, -0.1]


def test_the_cards_hold_the_critical_speeds_forward_ones_first():
    crossings = tuple(
        Crossing(speed=2.0 * math.pi * hertz, line=k, direction=direction, damping_ratio=0.025)
        for k, (hertz, direction) in enumerate(((90.0, "backward"), (548.4, "forward"), (120.0, "forward")))
    )
    machine = example_machine("lp400")
    nominal = float(machine.speed.nominal) / (2.0 * math.pi)
    diagram = SimpleNamespace(crossings=crossings, suspension="AMBs")
    (card,) = critical_speeds_cards({"AMBs": diagram}, 2.0 * math.pi * nominal)
    assert card.title == "In its AMBs"
    assert [one.value.text for one in card.figures] == ["120.0 Hz", "548.4 Hz", "90.00 Hz"]
    assert card.figures[0].label == "Critical speed 1, forward"
    assert "7\u202f200 rpm; damping ratio 2.50%; margin" in card.figures[0].note
    assert "margin" not in card.figures[2].note
