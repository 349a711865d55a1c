"""Documents of critical speeds and of a comparison: every number is that of its source."""

import json
import math

import numpy as np
import pytest
from tests.published import bearing as published_bearing
from tests.published import published, value

from rotordrop.cli.app import run
from rotordrop.machine import example_machine
from rotordrop.report.critical_speeds_page import critical_speeds_json
from rotordrop.rotor.campbell import campbell_diagram
from rotordrop.rotor.critical_speeds import critical_speed_map
from rotordrop.severity.ranking import DropSeverity, rank_drops

TURN = 2.0 * math.pi


def same(written, values):
    """Equal to the last digit, with what is unknown in the same places."""
    np.testing.assert_array_equal(np.array(written, dtype=np.float64), values)


def test_every_number_of_the_map_is_that_of_the_rotor_on_springs():
    machine = example_machine("lp400")
    stiffness, speeds = np.geomspace(1e6, 1e9, 4), np.linspace(10.0, 150.0, 4)
    found = critical_speed_map(machine, stiffness, count=3)
    diagram = campbell_diagram(machine, TURN * speeds, "touchdown bearings")
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


def estimate(name, speed, peaks):
    bearings = {
        end: published_bearing(
            {
                "peak_force_N": value(peak, 0.95 * peak, 1.05 * peak),
                "mean_force_0p15_0p2_N": value(0.1 * peak, 0.09 * peak, 0.11 * peak),
                "peak_stress_Pa": value(1e9 + 2e5 * peak, 1e9, 1e9 + 4e5 * peak),
                "mean_stress_Pa": value(1e9 + peak, 1e9, 1e9 + 2.0 * peak),
            }
        )
        for end, peak in zip(("NDE", "DE"), peaks, strict=True)
    }
    return published(speed_Hz=speed, record_sha256=name, bearings=bearings).as_json()


def test_the_comparison_ranks_every_number_of_every_bearing(tmp_path):
    drops = (("a", 60.0, (3300.0, 3900.0)), ("b", 100.0, (3500.0, 3600.0)), ("c", 210.0, (2500.0, 3700.0)))
    documents = {one[0]: estimate(*one) for one in drops}
    files = [tmp_path / f"{name}.json" for name in documents]
    for file in files:
        file.write_text(json.dumps(documents[file.stem]))
    out = tmp_path / "compared.json"
    assert run(["compare", *map(str, files), "--json", str(out)]) == 0
    written = json.loads(out.read_text())
    assert written["left_out"] == {}
    for bearing in ("NDE", "DE"):
        for key, entry in written["bearings"][bearing].items():
            numbers = {name: document["bearings"][bearing][key] for name, document in documents.items()}
            order = sorted(numbers, key=lambda name: -numbers[name]["value"])
            assert entry["worst_first"] == order, (bearing, key)
            assert entry["values"] == [numbers[name]["value"] for name in order]
            drops = [
                DropSeverity.from_interval(name, one["value"], tuple(one["interval_90"]))
                for name, one in numbers.items()
            ]
            assert entry["probability_worst_drop"] == pytest.approx(rank_drops(drops).worst_drop)
            assert sum(entry["probability_worst_drop"]) == pytest.approx(1.0)
            assert entry["probability_worst_condition"] is None
    assert {"peak_force_N", "peak_stress_Pa"} <= set(written["bearings"]["DE"])
