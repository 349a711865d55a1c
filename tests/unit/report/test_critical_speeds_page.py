"""The page on critical speeds tells where one of them lies nearer to the nominal speed than allowed."""

import json
import math
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.machine import example_machine
from rotordrop.report.critical_speeds_page import critical_speeds_page, crossing_table
from rotordrop.rotor.campbell import Crossing, campbell_diagram, critical_speeds_json, separations
from rotordrop.rotor.critical_speeds import critical_speed_map

MACHINE = example_machine("small")
NOMINAL = float(MACHINE.speed.nominal)


@lru_cache
def drawn():
    """The map and the diagram of the machine, for other crossings to be put in."""
    found = critical_speed_map(MACHINE, whirl="standstill")
    return {"standstill": found}, campbell_diagram(MACHINE, np.linspace(0.0, NOMINAL, 3), "AMBs")


def page(share, direction="forward", held="AMBs", machine=MACHINE):
    """The page of a machine with one critical speed, at a share of the nominal one."""
    maps, diagram = drawn()
    crossing = Crossing(speed=share * NOMINAL, line=0, direction=direction, damping_ratio=0.025)
    return critical_speeds_page(machine, maps, {held: replace(diagram, crossings=(crossing,))})


def problems(share, direction="forward"):
    return [one.text for one in page(share, direction).verdict if one.level == "bad"]


@pytest.mark.parametrize("share", [0.997, 0.95, 1.04])
def test_a_mode_near_the_nominal_speed_is_a_problem(share):
    (text,) = problems(share)
    hertz = NOMINAL / (2.0 * math.pi)
    assert f"AMBs: forward critical speed {share * hertz:.1f} Hz" in text
    away = f"{100.0 * abs(share - 1.0):.1f} %"
    assert f"{away} from the nominal {hertz:.1f} Hz ({60.0 * hertz:.0f} rpm)" in text
    assert f"(API 617: {'16.0' if share < 1.0 else '26.0'} %), amplification 20.0" in text


@pytest.mark.parametrize("told", [(0.83,), (1.27,), (0.997, "backward")])
def test_a_mode_further_off_or_against_the_spin_is_none(told):
    assert problems(*told) == []


@pytest.mark.parametrize(("ends", "level"), [(1.3, "good"), (1.1, "warning")])
def test_margins_are_kept_only_as_far_as_was_searched(ends, level):
    """The search ended at 1.1 × nominal, below the 26 % that API 617 asks for above it, and said "good"."""
    maps, diagram = drawn()
    searched = replace(diagram, crossings=(), speed=np.linspace(0.0, ends * NOMINAL, 3))
    shown = critical_speeds_page(MACHINE, maps, {"AMBs": searched})
    assert [one.level for one in shown.verdict if "API 617" in one.text] == [level]


@pytest.mark.parametrize(
    ("held", "machine"),
    [("free-free", "small"), ("touchdown bearings", "small"), ("AMBs", "lp400")],
    ids=["free", "dropped", "magnets of unknown stiffness"],
)
def test_no_margin_is_judged_where_no_standard_asks_for_one(held, machine):
    shown = page(0.997, held=held, machine=example_machine(machine))
    assert not [one for one in shown.verdict if one.level in ("bad", "good")]
    (table,) = shown.sections[0].tables
    assert table.columns[-1] == "amplification"
    assert ("assumed 40 Hz" in table.rows[0][0]) == (held == "AMBs")
    warned = [one.text for one in shown.verdict if one.level == "warning"]
    assert len(warned) == (held == "AMBs")


def test_a_margin_stands_beside_forward_critical_speeds_in_given_ambs():
    crossings = tuple(
        Crossing(speed=2.0 * math.pi * hertz, line=k, direction=direction, damping_ratio=0.025)
        for k, (hertz, direction) in enumerate(((90.0, "backward"), (548.4, "forward"), (120.0, "forward")))
    )
    diagram = SimpleNamespace(crossings=crossings, suspension="AMBs")
    table = crossing_table(MACHINE, {"AMBs": diagram}, separations(diagram, NOMINAL, NOMINAL))
    margins = [row[table.columns.index("margin")] for row in table.rows]
    assert margins[0] == "–" and all(one.endswith(" %") for one in margins[1:])


def same(written, values):
    """Equal to the last digit, with what is unknown in the same places."""
    np.testing.assert_array_equal(np.array(written, dtype=np.float64), values)


def test_every_number_of_the_map_is_that_of_the_rotor_on_springs():
    machine = example_machine("lp400")
    stiffness, speeds = np.geomspace(1e6, 1e9, 4), np.linspace(10.0, 150.0, 4)
    found = critical_speed_map(machine, stiffness, count=3)
    diagram = campbell_diagram(machine, 2.0 * math.pi * speeds, "touchdown bearings")
    told = critical_speeds_json({"standstill": found}, {"held": diagram})
    written = json.loads(json.dumps(told, allow_nan=False))
    table, held = written["maps"]["standstill"], written["campbell"]["held"]
    assert table["stiffness_N_m"] == pytest.approx(stiffness)
    same(table["massless_Hz"], found.massless)
    same(table["with_support_mass_Hz"], found.with_support_mass)
    assert set(table["at_the_machine_Hz"]) == set(found.at_lines)
    for name, values in found.at_lines.items():
        same(table["at_the_machine_Hz"][name], values)
    for bearing, part in zip(machine.touchdown_bearings, found.lines, strict=True):
        entry = table["bearings"][bearing.name]
        assert entry["support_N_m"] == pytest.approx(float(bearing.support.stiffness))
        for way in ("tangent", "simple"):
            series = 1.0 / (1.0 / entry[f"{way}_N_m"] + 1.0 / entry["support_N_m"])
            assert entry[f"equivalent_{way}_N_m"] == pytest.approx(series, rel=1e-9)
        assert entry["tangent_N_m"] == part.tangent and entry["contact_N_m"] == part.contact
    assert held["speed_Hz"] == pytest.approx(speeds)
    same(held["frequency_Hz"], diagram.frequency)
    same(held["damping_ratio"], diagram.damping_ratio)
    same(held["whirl"], diagram.whirl)
    assert held["node_positions_m"] == pytest.approx(diagram.node_positions)
    same(held["shapes_at_lowest_speed"]["real"], diagram.shapes[0].real)
    same(held["shapes_at_lowest_speed"]["imaginary"], diagram.shapes[0].imag)
    for entry, crossing in zip(held["critical_speeds"], diagram.crossings, strict=True):
        frequency = np.array(held["frequency_Hz"], dtype=np.float64)[:, entry["line"]]
        meets = np.interp(entry["speed_Hz"], held["speed_Hz"], frequency)
        assert meets == pytest.approx(entry["speed_Hz"], rel=0.02)
        assert (entry["direction"], entry["damping_ratio"]) == (crossing.direction, crossing.damping_ratio)
