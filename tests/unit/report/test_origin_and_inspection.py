"""What a report says of its own making, and what it suggests to do next."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rotordrop.estimate.bearing_drop import AirGap, BearingDrop, simulated_bearings
from rotordrop.estimate.later_motion import LaterMotion
from rotordrop.known import Known
from rotordrop.report.content import ReportContent
from rotordrop.report.inspection import inspection_section, limits_section
from rotordrop.report.origin import Origin, UsedFile, command_line
from rotordrop.report.page import css_text, render_page
from rotordrop.report.style import LOG_LABELS, faded
from rotordrop.report.time_panels import Panel, time_panels
from rotordrop.simulate.result import DropResult


def test_the_origin_names_who_when_how_and_from_what(tmp_path: Path) -> None:
    file = tmp_path / "machine 1.toml"
    file.write_bytes(b"name = 'a'")
    origin = Origin(
        command=command_line(["estimate", "machine 1.toml", "a.csv"]),
        files=(UsedFile.of("machine file", file),),
        operator="A. Person",
        made="2026-01-02 03:04 UTC",
        fingerprint="0123456789abcdef0123",
    )
    assert origin.facts() == (
        ("report made", "2026-01-02 03:04 UTC"),
        ("by", "A. Person"),
        ("command", "rotordrop estimate 'machine 1.toml' a.csv"),
        ("machine file", f"machine 1.toml, SHA-256 {hashlib.sha256(file.read_bytes()).hexdigest()}"),
        ("arithmetic", "fingerprint 0123456789abcdef"),
    )
    assert Origin().facts() == ()


def test_a_running_title_cannot_leave_its_string() -> None:
    assert css_text('a"; } body { x: 1') == "a\\000022 \\00003b  \\00007d  body \\00007b  x\\00003a  1"
    page = render_page(ReportContent(title='T"</style><script>window.stolen=1</script>', subtitle="µ"))
    assert page.count("<script>window.stolen") == 0
    assert 'page " counter(page)' in page
    assert '@top-left { content: "T\\000022 \\00003c \\00002f style' in page


def test_a_reader_without_scripts_is_told_first() -> None:
    page = render_page(ReportContent(title="T"))
    assert page.index("<noscript>") < page.index("<footer>")
    assert "save the file and open it in a browser" in page


def estimate(drop_result: DropResult, **changes: Any) -> Any:
    bearings = tuple(replace(one, values={}) for one in simulated_bearings(drop_result))
    told = {"consistent": True, "bearings": bearings, "later": (), "innovations": None, "cross_check": ()}
    return SimpleNamespace(**{**told, **changes})


def stressed(bearing: BearingDrop, value: float, high: float) -> BearingDrop:
    known = Known(value=value, status="determined", interval_90=(0.9 * value, high), unit="Pa")
    return replace(bearing, peak_stress=replace(bearing.peak_stress, known=known))


def test_a_usual_drop_asks_for_a_lift_check_with_the_gaps_found(drop_result: DropResult) -> None:
    said = inspection_section(estimate(drop_result)).statements
    assert [one.level for one in said] == ["notice", "notice"]
    assert "NDE 275 µm; DE 285 µm" in said[0].text


def test_a_stress_whose_interval_reaches_the_static_limit_asks_for_a_look_at_the_raceways(
    drop_result: DropResult,
) -> None:
    nde, de = simulated_bearings(drop_result)
    below = estimate(drop_result, bearings=(stressed(nde, 3.9e9, 4.19e9), de))
    above = estimate(drop_result, bearings=(stressed(nde, 3.9e9, 4.21e9), de))
    assert not any(one.level == "warning" for one in inspection_section(below).statements)
    said = inspection_section(above).statements[0]
    assert said.level == "warning"
    assert "NDE: look at balls and raceways" in said.text
    assert "as high as 4\u202f210 MPa" in said.text


@pytest.mark.parametrize(("answer", "when"), [("restart", "next standstill"), ("replace", "next start")])
def test_what_to_do_keeps_to_the_restart_card(drop_result: DropResult, answer: str, when: str) -> None:
    """It asked to open the bearings before the next start beside a card that said to restart."""
    nde, de = simulated_bearings(drop_result)
    above = estimate(drop_result, bearings=(stressed(nde, 3.9e9, 4.21e9), de))
    card: Any = SimpleNamespace(answer=answer)
    told, opened, *_ = inspection_section(above, card).statements
    assert told.text.startswith(answer.capitalize()) and when in opened.text


def test_a_model_that_does_not_fit_is_to_be_settled_before_anything_else(drop_result: DropResult) -> None:
    later = LaterMotion(bearing="DE", first=2e-4, first_time=0.01, later=3e-4, later_time=1.25, resolved=1e-6)
    said = inspection_section(estimate(drop_result, consistent=False, later=(later,))).statements
    assert [one.level for one in said] == ["bad", "warning", "notice", "notice"]
    assert "DE: look at the rest of the record" in said[1].text
    assert "at 1.25 s" in said[1].text


def test_every_limit_that_decided_something_is_listed(drop_result: DropResult) -> None:
    innovations = SimpleNamespace(limits=(0.7, 1.6))
    check = SimpleNamespace(name="NDE peak force", accuracy=0.05, replaced=False)
    section = limits_section(estimate(drop_result, innovations=innovations, cross_check=(check,)))
    shown = [row[1].text for row in section.tables[0].rows]  # type: ignore[union-attr]
    assert shown == ["4\u202f200 MPa", "0.70 to 1.60", "5.0 %"]


def test_the_measured_curve_lies_on_top_and_thin(drop_result: DropResult) -> None:
    simulated = simulated_bearings(drop_result)[0].motions[0].vertical
    measured = replace(simulated, label="measured", role="measured")
    figure = time_panels([[Panel(title="a", axis="y", histories=(measured, simulated))]], 1e6, "µm")
    assert [trace.name for trace in figure.data] == ["simulated", "measured"]
    assert figure.data[1].line.width < figure.data[0].line.width
    assert figure.data[0].line.color == faded("#1c7ed6", 0.6) == "rgba(28, 126, 214, 0.6)"


def test_ticks_of_a_logarithmic_axis_show_whole_numbers() -> None:
    labels = dict(zip(LOG_LABELS["tickvals"], LOG_LABELS["ticktext"], strict=True))
    assert (labels[20.0], labels[5000.0], labels[0.02]) == ("20", "5\u202f000", "0.02")


def test_the_gap_of_a_lift_check_is_stated_with_its_interval(drop_result: DropResult) -> None:
    """With it where single numbers hold, as it where they do not; limits where no more is known."""
    gap = Known(value=436e-6, status="determined", interval_90=(407e-6, 465e-6), unit="m")
    nde, de = estimate(drop_result).bearings
    known = (replace(nde, values={"air_gap_m": gap}), replace(de, air_gap=AirGap(lower=28e-5, upper=29e-5)))
    for consistent, told in ((True, "NDE 436 µm (407 to 465 µm)"), (False, "NDE 407 to 465 µm")):
        section = inspection_section(estimate(drop_result, bearings=known, consistent=consistent))
        text = next(one.text for one in section.statements if "lift check" in one.text)
        assert f"({told}; DE 280 to 290 µm)" in text
