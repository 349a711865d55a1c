"""The report on a tracked drop: what the estimate says is what the page says."""

import copy
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.report.conftest import section
from tests.unit.report.test_tables import check

from rotordrop.estimate.bearing_drop import Origin
from rotordrop.estimate.changed import changes
from rotordrop.estimate.document import estimate_document, published_drop
from rotordrop.estimate.estimate import Verdict
from rotordrop.estimate.published import Drop, LaterMotion, later_warning
from rotordrop.evidence.quality.finding import Finding
from rotordrop.report.drop_sections import drop_sections, impact_table
from rotordrop.report.estimate_page import cross_check_statements, estimate_page, estimate_screen
from rotordrop.report.page import render_page
from rotordrop.report.told_changes import changes_page
from rotordrop.track.consistency import Check


def test_a_number_that_is_missing_has_its_reason(page, document):
    late = section(page, "Severity").tables[-1].rows[0]
    assert late[:2] == ("mean force, 150 to 200 ms", "estimate ends before 200 ms")
    missing = document["bearings"]["NDE"]["not_stated"]
    assert missing == {"mean_force_0p15_0p2_N": "estimate ends before 200 ms"}


def test_a_force_that_the_balls_do_not_bear_costs_the_share_of_a_life_alone(estimate):
    first, *others = estimate.bearings
    crushed = replace(first, force_vector=1e12 * first.force_vector)
    told = estimate_document(replace(estimate, bearings=(crushed, *others)))["bearings"]
    severities = [told[name]["severity"] for name in ("NDE", "DE")]
    assert severities[1].keys() - severities[0].keys() == {"fatigue_by_16281"}
    assert told["NDE"]["not_stated"]["severity.fatigue_by_16281"] == "the balls bear no such force"


def test_a_record_is_simulated_by_one_definition(estimate, page, document):
    assert page.simulated == "Simulated record." and document["simulated_record"] is True
    other = replace(estimate.record, sha256="0" * 64, metadata={}, notes=())
    assert not other.is_simulated
    assert replace(other, metadata={"source": "Simulated by X"}).is_simulated
    assert replace(other, notes=("made by synthesize",)).is_simulated


def test_bands_are_as_wide_as_the_stated_intervals(estimate):
    for b in estimate.bearings:
        for band, peak in ((b.force_band, b.peak_force), (b.stress_band, b.peak_stress)):
            assert band.upper.max() == pytest.approx(peak.interval_90[1], rel=0.01)
            assert band.lower[np.argmax(band.upper)] == pytest.approx(peak.interval_90[0], rel=0.01)
            assert band.lower.min() >= 0.0


def test_the_estimated_motion_gives_the_readings_within_their_noise(estimate):
    found = estimate.at_sensors
    assert found.channels == tuple(one.sensor for one in estimate.sensors)
    assert found.rms == pytest.approx([one.noise for one in estimate.sensors], rel=0.2)
    assert np.ptp(found.estimated, axis=0).min() > 200e-6
    assert all(motion.role == "estimated" for bearing in estimate.bearings for motion in bearing.motions)
    at_sensors, _ = section(estimate_page(estimate), "Motion at the sensors").figures
    assert [trace.name for trace in at_sensors.chart.data[:2]] == ["estimated", "measured"]


def test_the_first_contact_is_the_first_impact(estimate):
    for bearing in estimate.bearings:
        first, contact = bearing.impacts[0], bearing.first_contact
        assert (contact.start, contact.end) == (first.start, first.end)
        assert 5e-6 < contact.indentation < 60e-6


def beside(estimate, verdict, origin):
    """The estimate as it would look had the model not fitted the record."""

    def by(peak):
        return replace(peak, origin=origin)

    failed = Check(name="innovation size", passed=False, message="mean squared innovation 9.00 × expected")
    bearings = tuple(
        replace(b, peak_force=by(b.peak_force), peak_stress=by(b.peak_stress)) for b in estimate.bearings
    )
    return replace(estimate, verdict=verdict, checks=(failed,), bearings=bearings)


def test_an_estimate_beside_its_record_shows_ranges_and_no_single_number(estimate):
    shown = estimate_page(beside(estimate, Verdict.WIDENED, Origin.TWIN))
    first = shown.verdict[0]
    assert first.level == "bad"
    for figure in (one for card in shown.cards for one in card.figures):
        ranged = r"–|[\d\u202f.]+ to [\d\u202f.]+ (N|MPa)"
        assert re.fullmatch(ranged, figure.value.text)
        assert figure.value.interval_text == "" and "at " not in figure.note
        assert figure.value.text == "–" or figure.value.interval_90[0] <= figure.value.interval_90[1]


def test_loads_of_the_cross_check_are_called_so(estimate):
    replaced = beside(estimate, Verdict.REPLACED, Origin.CROSS_CHECK)
    document = estimate_document(replaced)
    assert document["consistent"] is False and document["verdict"] == Verdict.REPLACED.value
    assert document["bearings"]["DE"]["origin"] == "independent cross-check"
    assert list(document)[:3] == ["format", "verdict", "consistent"]


def test_a_cross_check_that_disagrees_and_exchanged_planes_come_first(estimate):
    ends = Finding(kind="swapped ends", message="", remedy="exchange the planes", severity="warning")
    seen = estimate_screen(replace(estimate, cross_check=(check(3000.0, 6300.0),), findings=(ends,))).verdict
    assert seen[0].level == "warning"
    assert any(one.text.startswith("to do next: exchange the planes") for one in seen)


def test_what_gave_way_is_not_compared_with_itself(estimate):
    gone = replace(check(2528.0, 9433.0), replaced=True)
    assert cross_check_statements([gone]) == ()
    (statement,) = cross_check_statements([gone, check(3000.0, 2400.0)])
    assert "−20 %" in statement.text and "273" not in statement.text
    shown = section(estimate_page(replace(estimate, cross_check=(gone,))), "Checks")
    assert shown.tables[-1].rows[0][3:] == ("–", "± 15 %", "stated in place of the twin")


def test_a_later_and_larger_motion_is_a_warning_in_page_and_document(estimate):
    times = {"first_time": 0.009, "later_time": 0.559}
    later = LaterMotion(bearing="DE", first=310e-6, later=333e-6, resolved=2e-6, larger=True, **times)
    told = replace(estimate, later=(later,), warnings=(later_warning((later,), estimate.until),))
    said = [one.text for one in estimate_page(told).verdict if one.level == "warning"]
    assert any("23.0 µm further out at 559 ms" in text for text in said)
    (entry,) = estimate_document(told)["later_motion"]
    assert entry["larger"] is True and entry["later_time"] == 0.559


def test_no_colour_is_a_row_of_numbers_and_no_axis_matches_itself(estimate):
    """A browser would complain of either and draw something else."""
    sections = drop_sections(estimate.bearings, "")
    for figure in (figure for one in sections for figure in one.figures):
        described = json.loads(figure.chart.to_json())
        bars = [one["error_y"] for one in described["data"] if one.get("error_y", {}).get("visible")]
        assert all(isinstance(bar["color"], str) for bar in bars)
        layout = described["layout"]
        for name in (one for one in layout if one.startswith(("xaxis", "yaxis"))):
            seen, follows = [name.replace("axis", "")], layout[name].get("matches")
            while follows:  # a circle of axes that follow each other is broken up by the browser
                assert follows not in seen, (seen, follows)
                seen.append(follows)
                follows = layout[f"{follows[0]}axis{follows[1:]}"].get("matches")


def test_every_curve_is_drawn_once(estimate, page):
    assert [section.heading for section in page.sections[: page.lead]] == ["Bearing force", "Orbit"]
    html = render_page(page)
    assert estimate.record.sha256 in html
    verdict, numbers, advice = (html.index(part) for part in ('id="verdict"', 'class="cards"', 'id="to-do"'))
    assert verdict < numbers < html.index("Figure 1") < advice
    assert html[advice:].partition("</section>")[0].count("<li") == len(page.to_do.statements)
    parts = "Impacts,Severity,Motion at the sensors,Parameters,Checks,Record,Machine"
    assert [one.heading for one in page.sections[page.lead :] if one.folded] == parts.split(",")
    printed = [one.printed for one in page.sections[page.lead :]]
    assert printed == sorted(printed, reverse=True), "else figures on paper leave numbers out"
    assert html.count("<details") == 7
    assert [len(section(page, name).figures) for name in ("Bearing force", "Motion at the sensors")] == [1, 2]


def test_a_report_stays_under_two_thousand_words(estimate, page):
    html = re.sub(r"<(script|style|nav|noscript)\b.*?</\1>", " ", render_page(page), flags=re.DOTALL)
    words = [word for word in re.sub(r"<[^>]+>", " ", html).split() if re.search("[A-Za-z]", word)]
    assert 500 < len(words) < 2000


def test_what_is_estimated_has_its_interval_or_is_not_shown(estimate, page):
    """Azimuths and durations of contacts, and quartiles, have none."""

    def without(impact):
        return replace(impact, peak_force=replace(impact.peak_force, interval_90=None))

    assert "quartile" not in str(section(page, "Severity").tables)
    assert not {"azimuth", "duration"} & {*section(page, "Impacts").tables[0].columns}
    bare = [replace(b, impacts=tuple(without(one) for one in b.impacts)) for b in estimate.bearings]
    assert {"azimuth", "duration"} <= {*impact_table(bare).columns}


def test_a_wider_gap_before_is_named_in_words(estimate):
    document = copy.deepcopy(estimate_document(estimate))
    known = next(one["estimate"] for one in document["parameters"] if one["path"] == "NDE.air_gap")
    known["value"] -= 60e-6
    known["interval_90"] = [end - 60e-6 for end in known["interval_90"]]
    joint = document["joint"]
    joint["mean"][joint["paths"].index("NDE.air_gap")] -= 60e-6
    first = changes_page(
        changes(Drop.of(document, "before.json", "estimate"), published_drop(estimate))
    ).verdict[0]
    assert first.level == "warning" and "NDE: air gap (" in first.text
