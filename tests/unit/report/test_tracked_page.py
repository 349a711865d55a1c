"""The report on a tracked drop: what the estimate says is what the page says."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from rotordrop.estimation.tracked import COARSE_BASIS, TrackedDrop, drop_problem, prepare, tracked_drop
from rotordrop.machine import Machine, example_machine
from rotordrop.measurement.quality.finding import Finding
from rotordrop.measurement.record import read_record
from rotordrop.model.parameters import build_drop_model
from rotordrop.report.cross_check import CrossCheck
from rotordrop.report.estimate_page import tracked_page
from rotordrop.report.page import render_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.simulated_record import simulated_notice
from rotordrop.report.tracked_sections import (
    parameter_section,
    sensor_table,
    tracked_first_contacts,
    tracked_forces,
    tracked_motions,
    tracked_stresses,
)
from rotordrop.tracking.calibration import CALIBRATED_SCHEDULE, track


@pytest.fixture(scope="module")
def machine() -> Machine:
    return example_machine("lp400")


@pytest.fixture(scope="module")
def drop(machine: Machine) -> TrackedDrop:
    folder = resources.files("rotordrop").joinpath("examples", "lp400")
    with resources.as_file(folder.joinpath("drop_060.h5")) as path:
        record = read_record(path, machine)
    with resources.as_file(folder.joinpath("drop_060_tail.csv")) as path:
        tail = read_record(path, machine)
    prepared = prepare(machine, record, tail, "drop_060")
    problem = drop_problem(build_drop_model(machine, COARSE_BASIS), prepared, until=0.02)
    smoothed = track([problem], CALIBRATED_SCHEDULE[:1]).smoothed[0]
    return tracked_drop(prepared, problem, smoothed, 1.0)


def test_the_headline_has_every_number_with_its_interval(drop: TrackedDrop, machine: Machine) -> None:
    content = tracked_page(drop, machine)
    for card, values in zip(content.cards, drop.values.values(), strict=True):
        peak = card.figures[0].value
        assert (peak.value, peak.interval_90) == (
            values["peak_force_N"].value,
            values["peak_force_N"].interval_90,
        )
        assert card.figures[1].value.interval_90 == values["peak_stress_Pa"].interval_90
    rows = {row[0]: row for row in content.summary[0].rows}
    gap = rows["air gap"][1]
    assert isinstance(gap, Quantity)
    assert gap.value == drop.values["NDE"]["air_gap_m"].value
    assert rows["static friction coefficient"][2] == "prior"


def test_the_page_says_that_the_bundled_record_is_simulated(drop: TrackedDrop, machine: Machine) -> None:
    assert "simulated" in tracked_page(drop, machine).simulated
    other = replace(drop.record, sha256="0" * 64, metadata={}, notes=())
    assert simulated_notice(other) == ""
    assert simulated_notice(replace(other, metadata={"source": "Simulated by X"})) != ""


def test_bands_are_as_wide_as_the_stated_intervals(drop: TrackedDrop) -> None:
    for b, values in enumerate(drop.values.values()):
        for histories, field in ((tracked_forces, "peak_force_N"), (tracked_stresses, "peak_stress_Pa")):
            band = histories(drop)[b].band
            stated = values[field].interval_90
            assert band is not None
            assert stated is not None
            assert band.upper.max() == pytest.approx(stated[1], rel=0.01)
            assert band.lower[np.argmax(band.upper)] == pytest.approx(stated[0], rel=0.01)
            assert band.lower.min() >= 0.0


def test_bands_widen_where_model_and_record_disagree(drop: TrackedDrop) -> None:
    def width(shown: TrackedDrop) -> float:
        band = tracked_stresses(shown)[0].band
        assert band is not None
        return float((band.upper - band.lower).max())

    assert width(replace(drop, consistent=False)) == pytest.approx(2 * width(replace(drop, consistent=True)))


def test_the_measured_motion_follows_the_estimated_one_within_the_bending(
    drop: TrackedDrop, machine: Machine
) -> None:
    for bearing in tracked_motions(drop, machine):
        measured, estimated = bearing.motions
        assert (measured.role, estimated.role) == ("measured", "estimated")
        difference = measured.displacement[: len(estimated.time)] - estimated.displacement
        assert np.sqrt(np.mean(difference**2)) < 10e-6
        assert np.ptp(estimated.displacement[:, 1]) > 250e-6


def test_the_first_contact_is_the_first_impact(drop: TrackedDrop) -> None:
    contacts = tracked_first_contacts(drop)
    for name in drop.values:
        first = next(impact for impact in drop.impacts if impact.bearing == name)
        assert (contacts[name].start, contacts[name].end) == (first.start, first.end)
        assert 5e-6 < contacts[name].indentation < 60e-6


def test_every_unknown_has_prior_estimate_interval_and_verdict(drop: TrackedDrop) -> None:
    section = parameter_section(drop)
    machine_table, drop_table, _ = section.tables
    assert len(machine_table.rows) + len(drop_table.rows) == len(drop.problem.unknowns)
    rows = {str(row[0]): row for row in machine_table.rows}
    prior = rows["NDE.support.stiffness"][1]
    assert isinstance(prior, Quantity)
    assert prior.value == pytest.approx(1e8)
    for path, field in (
        ("air_gap", "air_gap_m"),
        ("support.stiffness", "support.stiffness_N_per_m"),
        ("friction.dynamic", "friction.dynamic"),
        ("preload", "preload_N"),
    ):
        for bearing in drop.values:
            shown, stated = rows[f"{bearing}.{path}"], drop.values[bearing][field]
            assert isinstance(shown[2], Quantity)
            assert (shown[2].value, shown[2].interval_90) == (stated.value, stated.interval_90)
            assert shown[3] == stated.status


def test_sensor_errors_are_stated_by_channel(drop: TrackedDrop, machine: Machine) -> None:
    table = sensor_table(drop)
    assert [row[0] for row in table.rows] == [sensor.name for sensor in machine.sensors]
    noise = table.rows[0][3]
    assert isinstance(noise, Quantity)
    assert noise.value == pytest.approx(0.46e-6, rel=0.15)


def test_checks_findings_and_cross_check_are_on_the_page(drop: TrackedDrop, machine: Machine) -> None:
    finding = Finding(kind="hum", message="50 Hz hum", remedy="ground", severity="warning", channel="S_DE_B")
    check = CrossCheck(
        name="NDE peak force",
        estimate=Quantity(value=3000.0, kind="force"),
        check=Quantity(value=2000.0, kind="force"),
        accuracy=0.1,
    )
    content = tracked_page(drop, machine, findings=[finding], cross_checks=[check], warnings=["no tail"])
    texts = [statement.text for statement in content.verdict]
    assert texts[:2] == [drop.sentence(), "no tail"]
    assert any("a difference of −33 %" in text for text in texts)
    assert "Channel S_DE_B: 50 Hz hum" in texts
    again = tracked_page(drop, machine, findings=[finding], warnings=["50 Hz hum"])
    assert sum("50 Hz hum" in statement.text for statement in again.verdict) == 1
    consistency = next(section for section in content.sections if section.heading == "Consistency")
    assert [row[0] for row in consistency.tables[0].rows] == [item.name for item in drop.checks]
    headings = [section.heading for section in content.sections]
    assert headings.index("Bearing force") < headings.index("Parameters") < headings.index("Data quality")


def test_the_page_is_complete_and_small(drop: TrackedDrop, machine: Machine) -> None:
    html = render_page(tracked_page(drop, machine))
    assert len(html.encode()) < 6_000_000
    assert drop.record.sha256 in html
    assert html.count('class="chart"') >= 14
    assert "60.00 Hz (3\u202f600 rpm)" in html
