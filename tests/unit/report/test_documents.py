"""Documents of critical speeds and of a comparison: every number is that of its source."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

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


def unknown_as_nan(table: Any) -> Any:
    return np.array(table, dtype=np.float64)


def test_every_number_of_the_map_is_that_of_the_rotor_on_springs() -> None:
    machine = example_machine("lp400")
    stiffness = np.geomspace(1e6, 1e9, 4)
    found = critical_speed_map(machine, stiffness, count=3)
    diagram = campbell_diagram(machine, TURN * np.linspace(10.0, 150.0, 4), "touchdown bearings")
    written = json.loads(
        json.dumps(critical_speeds_json({"standstill": found}, {"held": diagram}), allow_nan=False)
    )
    table = written["maps"]["standstill"]
    assert table["stiffness_N_m"] == pytest.approx(stiffness)
    for key, values in (
        ("massless_Hz", found.massless),
        ("with_support_mass_Hz", found.with_support_mass),
    ):
        np.testing.assert_array_equal(unknown_as_nan(table[key]), values)
    assert set(table["at_the_machine_Hz"]) == set(found.at_lines)
    for name, values in found.at_lines.items():
        np.testing.assert_array_equal(unknown_as_nan(table["at_the_machine_Hz"][name]), values)
    weight = 0.0
    for bearing, part in zip(machine.touchdown_bearings, found.lines, strict=True):
        entry = table["bearings"][bearing.name]
        weight += entry["load_N"]
        assert entry["support_N_m"] == pytest.approx(float(bearing.support.stiffness))
        for bore, whole in (
            ("tangent_N_m", "equivalent_tangent_N_m"),
            ("simple_N_m", "equivalent_simple_N_m"),
        ):
            series = 1.0 / (1.0 / entry[bore] + 1.0 / entry["support_N_m"])
            assert entry[whole] == pytest.approx(series, rel=1e-9)
        assert entry["tangent_N_m"] == part.tangent and entry["contact_N_m"] == part.contact
    held = written["campbell"]["held"]
    assert held["speed_Hz"] == pytest.approx(np.linspace(10.0, 150.0, 4))
    for key, values in (
        ("frequency_Hz", diagram.frequency),
        ("damping_ratio", diagram.damping_ratio),
        ("whirl", diagram.whirl),
    ):
        np.testing.assert_array_equal(unknown_as_nan(held[key]), values)
    assert held["node_positions_m"] == pytest.approx(diagram.node_positions)
    shape = held["shapes_at_lowest_speed"]
    whole = unknown_as_nan(shape["real"]) + 1j * unknown_as_nan(shape["imaginary"])
    np.testing.assert_array_equal(whole, diagram.shapes[0])
    assert len(held["critical_speeds"]) == len(diagram.crossings)
    for entry, crossing in zip(held["critical_speeds"], diagram.crossings, strict=True):
        line = np.interp(
            entry["speed_Hz"], held["speed_Hz"], unknown_as_nan(held["frequency_Hz"])[:, entry["line"]]
        )
        assert line == pytest.approx(
            entry["speed_Hz"], rel=0.02
        )  # there the line meets the rotor's own speed
        assert (entry["direction"], entry["damping_ratio"]) == (crossing.direction, crossing.damping_ratio)


def estimate(name: str, speed: float, peaks: dict[str, float]) -> dict[str, Any]:
    bearings = {
        bearing_name: published_bearing(
            {
                "peak_force_N": value(peak, 0.95 * peak, 1.05 * peak),
                "mean_force_0p15_0p2_N": value(0.1 * peak, 0.09 * peak, 0.11 * peak),
                "peak_stress_Pa": value(1e9 + 2e5 * peak, 1e9, 1e9 + 4e5 * peak),
                "mean_stress_Pa": value(1e9 + peak, 1e9, 1e9 + 2.0 * peak),
            }
        )
        for bearing_name, peak in peaks.items()
    }
    return published(speed_Hz=speed, record_sha256=name, bearings=bearings).as_json()


def test_the_comparison_ranks_every_number_of_every_bearing(tmp_path: Path) -> None:
    peaks = {"a": (3300.0, 3900.0), "b": (3500.0, 3600.0), "c": (2500.0, 3700.0)}
    files = []
    documents = {}
    for (name, values), speed in zip(peaks.items(), (60.0, 100.0, 210.0), strict=True):
        documents[name] = estimate(name, speed, dict(zip(("NDE", "DE"), values, strict=True)))
        files.append(tmp_path / f"{name}.json")
        files[-1].write_text(json.dumps(documents[name]))
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
