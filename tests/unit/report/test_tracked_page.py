"""The report on a tracked drop: what the estimate says is what the page says."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rotordrop.estimate.bearing_drop import Impact, Origin
from rotordrop.estimate.document import estimate_document, published_drop
from rotordrop.estimate.estimate import CrossCheck, Estimate, Verdict
from rotordrop.estimate.later_motion import LaterMotion
from rotordrop.evidence.quality.finding import Finding
from rotordrop.known import Known
from rotordrop.report.content import ReportContent, Table
from rotordrop.report.drop_sections import drop_sections
from rotordrop.report.estimate_page import assumed_card, cross_check_statements, estimate_page, spoken
from rotordrop.report.impacts import impact_table
from rotordrop.report.page import render_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.restart_page import restart_page
from rotordrop.track.consistency import Check


def table(estimate: Estimate, heading: str, number: int = 0) -> Table:
    section = next(s for s in estimate_page(estimate).sections if s.heading == heading)
    return section.tables[number]


def test_card_document_figure_and_table_agree_on_every_peak(estimate: Estimate) -> None:
    """Value, time and interval of a peak stand in four places and have one source."""
    content = estimate_page(estimate)
    document = json.loads(json.dumps(estimate_document(estimate), allow_nan=False))
    loads = next(s for s in content.sections if s.heading == "Bearing force").figures[0].chart
    for k, (bearing, card) in enumerate(zip(estimate.bearings, content.cards, strict=True)):
        for figure, field, peak in (
            (card.figures[0], "peak_force_N", bearing.peak_force),
            (card.figures[1], "peak_stress_Pa", bearing.peak_stress),
        ):
            entry = document["bearings"][bearing.name][field]
            assert figure.value.value == entry["value"] == peak.value
            assert figure.value.interval_90 == tuple(entry["interval_90"]) == peak.interval_90
            assert entry["time_s"] == peak.time
            assert peak.time_interval_90 is not None
            early, late = peak.time_interval_90
            assert entry["time_interval_90_s"] == [early, late]
            assert early < peak.time < late
            assert re.fullmatch(r"at \d+\.\d+ ms \(\d+\.\d+ to \d+\.\d+ ms\)", figure.note)
        mark = next(one for one in loads.layout.annotations if one.xref == f"x{2 * k + 2}")
        assert (mark.x, mark.y) == pytest.approx((1e3 * bearing.peak_force.time, bearing.peak_force.value))


def test_the_headline_has_every_number_with_its_interval(estimate: Estimate) -> None:
    rows = {row[0]: row for row in estimate_page(estimate).summary[0].rows}
    gap = rows["air gap"][1]
    assert isinstance(gap, Quantity)
    assert gap.value == estimate.bearing("NDE").values["air_gap_m"].value
    assert rows["static friction coefficient"][2] == "the record does not determine it"


def test_a_number_that_is_missing_has_its_reason(estimate: Estimate) -> None:
    figures = {figure.label: figure for figure in estimate_page(estimate).cards[0].figures}
    late = figures["Mean force, 150 to 200 ms"]
    assert (late.value.text, late.note) == ("–", "the estimated part ends before 200 ms")
    entry = estimate_document(estimate)["bearings"]["NDE"]
    assert entry["not_stated"] == {"mean_force_0p15_0p2_N": "the estimated part ends before 200 ms"}


def test_a_record_is_simulated_by_one_definition(estimate: Estimate) -> None:
    assert "simulated" in estimate_page(estimate).simulated
    assert estimate_document(estimate)["simulated_record"] is True
    other = replace(estimate.record, sha256="0" * 64, metadata={}, notes=())
    assert not other.is_simulated
    assert replace(other, metadata={"source": "Simulated by X"}).is_simulated
    assert replace(other, notes=("made by synthesize",)).is_simulated


def test_bands_are_as_wide_as_the_stated_intervals(estimate: Estimate) -> None:
    for bearing in estimate.bearings:
        for band, peak in (
            (bearing.force_band, bearing.peak_force),
            (bearing.stress_band, bearing.peak_stress),
        ):
            assert band is not None and peak.interval_90 is not None
            assert band.upper.max() == pytest.approx(peak.interval_90[1], rel=0.01)
            assert band.lower[np.argmax(band.upper)] == pytest.approx(peak.interval_90[0], rel=0.01)
            assert band.lower.min() >= 0.0


def test_the_measured_motion_follows_the_estimated_one_within_the_bending(estimate: Estimate) -> None:
    for bearing in estimate.bearings:
        measured, estimated = bearing.motions
        assert (measured.role, estimated.role) == ("measured", "estimated")
        difference = measured.displacement[: len(estimated.time)] - estimated.displacement
        assert np.sqrt(np.mean(difference**2)) < 10e-6
        assert np.ptp(estimated.displacement[:, 1]) > 250e-6


def test_the_first_contact_is_the_first_impact(estimate: Estimate) -> None:
    for bearing in estimate.bearings:
        first, contact = bearing.impacts[0], bearing.first_contact
        assert contact is not None
        assert (contact.start, contact.end) == (first.start, first.end)
        assert 5e-6 < contact.indentation < 60e-6


def test_every_unknown_has_prior_estimate_interval_and_verdict(estimate: Estimate) -> None:
    both = [table(estimate, "Parameters", number) for number in (0, 1)]
    rows, columns = {str(row[0]): row for one in both for row in one.rows}, both[0].columns
    assert len(rows) == len(estimate.parameters)
    assert not any("." in name or "unbalance 0" in name for name in rows), "a path, or a count from zero"
    prior = rows["NDE: support stiffness"][1]
    assert isinstance(prior, Quantity) and prior.levelled == "90 %: 50 to 200 N/µm"
    for one in estimate.parameters:
        shown = rows[spoken(one)]
        assert isinstance(shown[2], Quantity)
        assert (shown[2].value, shown[2].interval_90) == (one.estimate.value, one.estimate.interval_90)
        verdict = dict(zip(columns, shown, strict=True)).get("verdict", "")
        assert verdict == ("" if one.estimate.status == "determined" else one.estimate.status)
        if one.scope == "machine":
            assert estimate.bearing(one.owner).values[one.row.field] == one.estimate


def test_sensor_errors_are_stated_by_channel(estimate: Estimate) -> None:
    found = table(estimate, "Parameters", 2)
    assert [row[0] for row in found.rows] == [sensor.name for sensor in estimate.machine.sensors]
    noise = found.rows[0][3]
    assert isinstance(noise, Quantity) and noise.value == pytest.approx(0.46e-6, rel=0.15)


def test_checks_findings_and_warnings_are_on_the_page(estimate: Estimate) -> None:
    finding = Finding(kind="hum", message="50 Hz hum", remedy="ground", severity="warning", channel="S_DE_B")
    told = replace(estimate, findings=(finding,), warnings=("no tail",), notes=("unbalance of 3 g mm",))
    content = estimate_page(told)
    texts = [statement.text for statement in content.verdict]
    assert texts[0] == estimate.sentence and "no tail" in texts and "unbalance of 3 g mm" in texts
    assert "Channel S_DE_B: 50 Hz hum" in texts
    again = estimate_page(replace(told, warnings=("50 Hz hum",)))
    assert sum("50 Hz hum" in statement.text for statement in again.verdict) == 1
    assert [row[0] for row in table(estimate, "Consistency").rows] == [item.name for item in estimate.checks]
    headings = [section.heading for section in content.sections]
    assert headings.index("Bearing force") < headings.index("Parameters") < headings.index("Data quality")


def beside(estimate: Estimate, verdict: Verdict, origin: Origin) -> Estimate:
    """The estimate as it would look had the model not fitted the record."""
    failed = Check(name="innovation size", passed=False, message="mean squared innovation 9.00 × expected")
    bearings = tuple(
        replace(
            b,
            peak_force=replace(b.peak_force, origin=origin),
            peak_stress=replace(b.peak_stress, origin=origin),
        )
        for b in estimate.bearings
    )
    return replace(estimate, verdict=verdict, checks=(failed,), bearings=bearings)


def test_an_estimate_beside_its_record_shows_ranges_and_no_single_number(estimate: Estimate) -> None:
    shown = estimate_page(beside(estimate, Verdict.WIDENED, Origin.TWIN))
    assert shown.verdict[0].level == "bad"
    assert shown.verdict[0].text.startswith("The model is not consistent with the record.")
    assert "9.00 × expected" in shown.verdict[0].text
    for card in shown.cards:
        for figure in card.figures:
            low, high = figure.value.interval_90 or (0.0, 0.0)
            assert figure.value.text == "–" or re.fullmatch(
                r"[\d\u202f.]+ to [\d\u202f.]+ (N|MPa)", figure.value.text
            )
            assert figure.value.interval_text == "" and "at " not in figure.note
            assert low <= high
    html = render_page(shown)
    assert html.index("not consistent with the record") < html.index('class="cards"')


def test_loads_of_the_cross_check_are_called_so(estimate: Estimate) -> None:
    shown = estimate_page(beside(estimate, Verdict.REPLACED, Origin.CROSS_CHECK))
    assert all(
        card.title.endswith("touchdown bearing, by the independent cross-check") for card in shown.cards
    )
    document = estimate_document(beside(estimate, Verdict.REPLACED, Origin.CROSS_CHECK))
    assert document["consistent"] is False and document["verdict"] == Verdict.REPLACED.value
    assert document["bearings"]["DE"]["origin"] == "independent cross-check"
    assert list(document)[:3] == ["format", "verdict", "consistent"]


def compared(value: float, other: float, *, replaced: bool = False) -> CrossCheck:
    return CrossCheck(
        name="NDE peak force",
        estimate=Known(value=value, status="determined", unit="N"),
        check=other,
        accuracy=0.15,
        replaced=replaced,
    )


def test_what_gave_way_is_not_compared_with_itself(estimate: Estimate) -> None:
    gone = compared(2528.0, 9433.0, replaced=True)
    assert cross_check_statements([gone]) == ()
    (statement,) = cross_check_statements([gone, compared(3000.0, 2400.0)])
    assert "−20 %" in statement.text and "273" not in statement.text
    rows = table(replace(estimate, cross_check=(gone,)), "Independent cross-check").rows
    assert rows[0][3:] == ("–", "± 15 %", "stated in place of the twin")


def test_a_later_and_larger_motion_is_a_warning_in_page_and_document(estimate: Estimate) -> None:
    later = LaterMotion(
        bearing="DE", first=310e-6, first_time=0.009, later=333e-6, later_time=0.559, resolved=2e-6
    )
    told = replace(estimate, later=(later,), warnings=(later.sentence(),))
    words = [statement for statement in estimate_page(told).verdict if statement.level == "warning"]
    assert any("23.0 µm further out at 0.5590 s" in statement.text for statement in words)
    (entry,) = estimate_document(told)["later_motion"]
    assert entry["larger"] is True and entry["later_time"] == 0.559
    same = replace(later, later=311e-6)
    assert not same.larger
    quiet = estimate_page(replace(estimate, later=(same,)))
    assert any("went no further out" in statement.text for statement in quiet.verdict)


def test_the_page_is_complete_and_small(estimate: Estimate) -> None:
    html = render_page(estimate_page(estimate))
    assert len(html.encode()) < 6_000_000
    assert estimate.record.sha256 in html
    assert html.count('class="chart"') >= 12
    assert "60.00\u00a0Hz (3\u202f600\u00a0rpm)" in html


def test_no_colour_is_a_row_of_numbers_and_no_axis_matches_itself(estimate: Estimate) -> None:
    """A browser would complain of either and draw something else."""
    for section in drop_sections(estimate.bearings, "", estimate.speed):
        for figure in section.figures:
            described: dict[str, Any] = json.loads(figure.chart.to_json())
            for one in described["data"]:
                if one.get("error_y", {}).get("visible"):
                    assert isinstance(one["error_y"]["color"], str)
            layout = described["layout"]
            for name, axis in layout.items():
                if name.startswith(("xaxis", "yaxis")):
                    seen, follows = [name.replace("axis", "")], axis.get("matches")
                    while follows:  # a circle of axes that follow each other is broken up by the browser
                        assert follows not in seen, (seen, follows)
                        seen.append(follows)
                        follows = layout[f"{follows[0]}axis{follows[1:]}"].get("matches")


def test_a_failed_check_names_its_unknown_as_the_tables_do(estimate: Estimate) -> None:
    failed = Check(
        name="parameters",
        passed=False,
        message="departs by 13.7 prior standard deviations",
        path="DE.support.stiffness",
    )
    told = replace(estimate, checks=(failed,), verdict=Verdict.WIDENED)
    first = estimate_page(told).verdict[0].text
    assert "DE: support stiffness departs by 13.7" in first and "DE.support" not in first
    assert "DE.support.stiffness departs by 13.7" in told.sentence
    assert (
        table(told, "Consistency").rows[0][2]
        == "DE: support stiffness departs by 13.7 prior standard deviations"
    )


def test_captions_and_foot_say_which_bearing_one_looks_from(estimate: Estimate) -> None:
    html = render_page(estimate_page(estimate))
    assert "last bearing" not in html and "first bearing" not in html
    assert "from DE towards NDE" in html
    assert "where it hit the race, seen from DE" in html


def test_the_event_is_written_as_a_person_would(estimate: Estimate) -> None:
    record = replace(estimate.record, metadata={"event_time": "2019-10-16T13:42:07.250000Z"})
    facts = dict(estimate_page(replace(estimate, record=record)).facts)
    assert facts["event"] == "2019-10-16 13:42:07 UTC"


def test_every_curve_is_drawn_once(estimate: Estimate) -> None:
    content = estimate_page(estimate)
    front = [section.heading for section in content.sections[: content.lead]]
    assert front == ["Bearing force", "Orbit"]
    html = render_page(content)
    verdict, advice, numbers = (html.index(part) for part in ('id="verdict"', 'id="to-do"', 'class="cards"'))
    assert verdict < advice < numbers < html.index("Figure 1")  # it stood below force and orbit
    assert html[advice:numbers].count("<li") == len(content.to_do.statements)
    assert all(section.folded for section in content.sections[content.lead :])
    drawn = {section.heading: len(section.figures) for section in content.sections}
    assert (drawn["Bearing force"], drawn["Displacement"]) == (1, 1)


def test_no_more_than_a_few_notes_stand_open_and_all_are_sentences(estimate: Estimate) -> None:
    notes = tuple(f"note {number}" for number in range(9))
    content = estimate_page(replace(estimate, notes=notes, warnings=("no tail",)))
    assert len(content.notes) == 6
    assert "no tail" in [one.text for one in content.notes]
    assert {*content.notes, *content.assumptions} == set(content.verdict[1:])
    assert content.notes[1].sentence == "No tail."
    html = render_page(content)
    assert html.index('id="section-1"') < html.index("No tail.") < html.index("more notes and assumptions")
    assert "Note 8." in html


def test_the_page_speaks_of_what_its_reader_can_do(estimate: Estimate) -> None:
    """Options and commands belong to the terminal; "state your own with --assumptions" stood on the page."""
    card = assumed_card(estimate)
    said = [*parts_of(estimate_page(estimate)), *parts_of(restart_page(card, published_drop(estimate)))]
    assert len(said) > 30
    wrong = [text for text in said if re.search(r"--[a-z]|'rotordrop|TOML|[a-z]_[a-z]| = \{", text)]
    assert not wrong


def parts_of(content: ReportContent) -> list[str]:
    sections = [*content.sections, *([content.to_do] if content.to_do else [])]
    said = [one.text for one in (*content.verdict, *(s for part in sections for s in part.statements))]
    return [*said, *(text for part in sections for text in part.text)]


def test_what_is_estimated_has_its_interval_or_is_not_shown(estimate: Estimate) -> None:
    """Azimuths and durations of contacts, and quartiles, stood beside intervals with none."""
    sections = {part.heading: part for part in estimate_page(estimate).sections}
    assert not sections["Hertz stress"].tables
    contacts = sections["Impacts"].tables[0]
    assert not {"azimuth", "duration"} & {*contacts.columns}
    simulated = impact_table(
        [replace(b, impacts=tuple(without(one) for one in b.impacts)) for b in estimate.bearings],
        force="bearing force",
    )
    assert {"azimuth", "duration"} <= {*simulated.columns}


def without(impact: Impact) -> Impact:
    return replace(impact, peak_force=replace(impact.peak_force, interval_90=None))
