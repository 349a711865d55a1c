"""The document and the page of a tracked estimate: every number is that of its source."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from rotordrop.elements.table import published, rows
from rotordrop.estimate.document import estimate_document
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.later_motion import RESOLVED
from rotordrop.known import Known
from rotordrop.report.estimate_page import estimate_page
from rotordrop.report.page import render_page
from rotordrop.report.quantity import Quantity
from rotordrop.twin.tracked import TrackedDrop
from rotordrop_bench import SyntheticDrop

BEARINGS = ("NDE", "DE")


@pytest.fixture(scope="module")
def document(tracked: Estimate) -> dict[str, Any]:
    written: dict[str, Any] = json.loads(json.dumps(estimate_document(tracked), allow_nan=False))
    return written


def same(written: dict[str, Any], known: Known) -> bool:
    error, interval = written.get("standard_error"), written.get("interval_90")
    return (
        written["value"] == known.value
        and error == known.standard_error
        and (None if interval is None else tuple(interval)) == known.interval_90
        and written.get("status") in (known.status, None)
    )


def test_the_head_names_the_drop(
    document: dict[str, Any], tracked: Estimate, workshop: TrackedDrop, synthetic: SyntheticDrop
) -> None:
    assert document["machine"] == workshop.problem.model.machine.name
    assert document["record_sha256"] == synthetic.record.sha256
    assert document["speed_Hz"] == pytest.approx(60.0, abs=0.05)
    off = float(synthetic.truth["t_off_in_record_s"])
    assert document["drop_instant_s"] == workshop.evidence.power_off.value == pytest.approx(off, abs=5e-4)
    assert tuple(document["drop_instant_interval_90_s"]) == workshop.evidence.power_off.interval_90
    assert document["estimated_until_s"] == workshop.problem.time[-1] == pytest.approx(0.2, abs=1e-4)
    assert (document["method"], document["quick"], document["simulated_record"]) == ("tracked", False, True)
    judged = document["consistency"]
    assert judged["nis"] == workshop.judged.nis
    assert judged["process_noise_factor"] == workshop.noise_factor
    assert [(c["name"], c["passed"], c["message"]) for c in judged["checks"]] == [
        (c.name, c.passed, c.said()) for c in workshop.checks
    ]
    assert document["verdict"] == tracked.verdict.value and judged["sentence"] == tracked.sentence


def test_peaks_and_means_are_those_of_the_filter(document: dict[str, Any], workshop: TrackedDrop) -> None:
    forces = workshop.forces
    late = (forces.time >= 0.15) & (forces.time <= 0.2)
    for b, name in enumerate(BEARINGS):
        entry = document["bearings"][name]
        for field, values in (("peak_force_N", forces.magnitude), ("peak_stress_Pa", forces.stress)):
            at = int(np.argmax(values[:, b]))
            assert values[at, b] <= entry[field]["value"] < 1.01 * values[at, b]  # between two samples
            assert entry[field]["time_s"] == pytest.approx(forces.time[at], abs=6e-5)
        assert entry["mean_force_0p15_0p2_N"]["value"] == pytest.approx(forces.magnitude[late, b].mean())
        assert entry["mean_stress_Pa"]["value"] == pytest.approx(forces.stress[:, b].mean())
        statistics = entry["stress_statistics_Pa"]
        assert statistics["maximum"] == entry["peak_stress_Pa"]["value"]
        assert statistics["mean"] == pytest.approx(forces.stress[:, b].mean(), rel=1e-3)


def test_every_impact_lasts_as_long_as_the_indentation(
    document: dict[str, Any], workshop: TrackedDrop
) -> None:
    forces = workshop.forces
    dt = float(forces.time[1] - forces.time[0])
    for b, name in enumerate(BEARINGS):
        impacts = document["bearings"][name]["impacts"]
        inside = forces.indentation[:, b] > 0.0
        covered = np.zeros_like(inside)
        for impact in impacts:
            end = (
                forces.time[-1] if impact["end_s"] is None else impact["end_s"]
            )  # cut by the end of the window
            first, last = np.searchsorted(forces.time, np.array([impact["start_s"], end]) - 1e-9)
            covered[first : last + 1] = True
            part = slice(first, last + 1)
            force, lost = forces.contact_force[part, b], forces.contact_power[part, b]
            assert impact["impulse_N_s"]["value"] == pytest.approx(dt * force.sum())
            assert impact["dissipated_energy_J"]["value"] == pytest.approx(dt * lost.sum())
            assert impact["azimuth_rad"] == forces.azimuth[first + int(np.argmax(force)), b]
            near = forces.magnitude[max(first - 1, 0) : last + 3, b]
            assert near.max() <= impact["peak_force_N"]["value"] < 1.1 * near.max()  # between two samples
            assert impact["start_s"] - dt <= impact["peak_time_s"] <= end + 2.0 * dt
        assert np.array_equal(covered, inside)


def test_innovations_are_those_of_the_displacement_channels(tracked: Estimate, workshop: TrackedDrop) -> None:
    """Reading minus prediction over its deviation: squares near one where the model fits."""
    found, filtered = tracked.innovations, workshop.judged
    assert found is not None
    sensors = workshop.problem.model.machine.sensors
    assert found.channels == tuple(sensor.name for sensor in sensors)
    assert found.values.shape == found.deviation.shape == (filtered.done, len(sensors))
    for c in range(len(sensors)):
        squares = (found.values[:, c] / found.deviation[:, c]) ** 2
        assert 0.7 < np.nanmean(squares) < 1.3
        assert found.values[:, c] == pytest.approx(filtered.innovations[: filtered.done, c], nan_ok=True)
        noise = next(one.noise for one in tracked.sensors if one.sensor == sensors[c].name)
        assert np.nanmin(found.deviation[:, c]) >= noise * (1.0 - 1e-9)


def test_the_rest_of_the_record_is_compared_above_the_noise(
    document: dict[str, Any], tracked: Estimate
) -> None:
    noise = math.sqrt(np.mean([one.noise**2 for one in tracked.sensors]))
    assert {one["bearing"] for one in document["later_motion"]} == set(BEARINGS)
    for one in document["later_motion"]:
        assert one["resolved"] == pytest.approx(RESOLVED * noise)
        radius = tracked.bearing(one["bearing"]).motions[0].radial.values
        assert one["first"] == pytest.approx(np.nanmax(radius), abs=0.5e-6)
        assert 0.2 < one["later_time"] < 0.23
        assert one["larger"] == (one["later"] > one["first"] + one["resolved"])


def test_every_row_of_the_table_arrives_in_document_and_page(
    document: dict[str, Any], tracked: Estimate
) -> None:
    page = estimate_page(tracked)
    html = render_page(page)
    (shown,) = (section for section in page.sections if section.heading == "Parameters")
    machine, *_ = shown.tables
    of_machine = [one for one in tracked.parameters if one.scope == "machine"]
    table = {one.path: line for one, line in zip(of_machine, machine.rows, strict=True)}
    assert all(one.owner in str(table[one.path][0]) for one in of_machine)
    written = {entry["path"]: entry for entry in document["parameters"]}
    assert list(written) == [one.path for one in tracked.parameters]
    for name in BEARINGS:
        values = tracked.bearing(name).values
        for field, row in published().items():
            entry = document["bearings"][name]
            for part in field.split("."):
                entry = entry[part]
            assert same(entry, values[field]), (name, field)
            if row.path_of(name) in written:
                known = next(one for one in tracked.parameters if one.path == row.path_of(name))
                assert same(written[known.path]["estimate"], known.estimate)
                assert known.prior is not None and same(written[known.path]["prior"], known.prior)
                assert known.estimate == values[field]
                _, before, after, verdict = table[known.path]
                assert isinstance(before, Quantity) and before.value == known.prior.value
                assert isinstance(after, Quantity) and after.value == known.estimate.value
                assert after.interval_90 == known.estimate.interval_90
                assert verdict == ("" if known.estimate.status == "determined" else known.estimate.status)
        for row in rows("bearing"):
            assert row.path_of(name) in written or row.field in values, row.path
            assert row.path_of(name) not in written or row.label.lower() in html.lower(), row.label
    for one in tracked.sensors:
        entry = document["sensors"][one.sensor]
        assert same(entry["gain_error"], one.gain_error) and same(entry["offset_m"], one.offset)
        assert entry["noise_m"] == one.noise and one.sensor in html


def test_the_cross_check_stands_beside_what_it_checks(document: dict[str, Any], tracked: Estimate) -> None:
    assert len(document["cross_check"]) == len(tracked.cross_check) == 3 * len(BEARINGS)
    for entry, one in zip(document["cross_check"], tracked.cross_check, strict=True):
        assert (entry["name"], entry["estimate"], entry["cross_check"]) == (
            one.name,
            one.estimate.value,
            one.check,
        )
        apart = abs(entry["cross_check"] / entry["estimate"] - 1.0)
        assert entry["agrees"] == (apart <= entry["known_relative_accuracy"])
        name, what = entry["name"].split(" ", 1)
        field = {"peak force": "peak_force_N", "peak stress": "peak_stress_Pa"}.get(what)
        if field is not None:
            assert entry["estimate"] == document["bearings"][name][field]["value"]
