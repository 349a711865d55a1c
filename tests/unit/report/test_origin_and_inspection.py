"""What a report says of its own making, and what it suggests to do next."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from plotly.subplots import make_subplots
from tests.scaled_machines import scaled_machine

from rotordrop._version import __version__
from rotordrop.estimate.bearing_drop import simulated_bearings
from rotordrop.estimate.published import LaterMotion
from rotordrop.known import Known
from rotordrop.report.content import Figure, ReportContent, Section
from rotordrop.report.drop_sections import static_limit_statement
from rotordrop.report.estimate_page import inspection_section
from rotordrop.report.origin import Origin, UsedFile, command_line
from rotordrop.report.page import css_text, render_page
from rotordrop.report.style import drawn_together
from rotordrop.sketch import still


def test_the_origin_names_who_when_how_and_from_what():
    origin = Origin(
        command=command_line(["estimate", "machine 1.toml", "a.csv"]),
        files=(UsedFile(role="machine file", name="machine 1.toml", sha256="0123abc"),),
        operator="A. Person",
        made="2026-01-02 03:04 UTC",
        fingerprint="0123456789abcdef0123",
    )
    assert origin.facts() == (
        ("report made", f"2026-01-02 03:04 UTC by rotordrop {__version__}"),
        ("operator", "A. Person"),
        ("command", "rotordrop estimate 'machine 1.toml' a.csv"),
        ("machine file", "machine 1.toml, SHA-256 0123abc"),
        ("arithmetic", "fingerprint 0123456789abcdef"),
    )
    assert [name for name, _ in Origin().facts()] == ["report made"]


def test_a_running_title_cannot_leave_its_string():
    assert css_text('a"; } body { x: 1') == "a\\000022 \\00003b  \\00007d  body \\00007b  x\\00003a  1"
    page = render_page(ReportContent(title='T"</style><script>window.stolen=1</script>', subtitle=200 * "m"))
    assert page.count("<script>window.stolen") == 0
    assert page.index("<noscript>") < page.index("<footer>")
    assert 'page " counter(page)' in page
    assert '@top-left { content: "T\\000022 \\00003c \\00002f style' in page
    assert f'{200 * "m"}"; }}' in page, "the running title is whole"


def test_without_scripts_the_first_figures_are_small_pictures():
    curve = drawn_together(np.array([0.0, 0.5]), {"NDE": {"force": np.array([1.0, 7.0])}}, "force", "N")
    shown = Section("Force", figures=(Figure(curve, "The force."),))
    page = render_page(ReportContent(title="T", sections=(shown, replace(shown, folded=True))))
    assert page.count("<polyline") == 1 and ">NDE</pre><svg" in page.partition("<noscript><pre")[2]
    assert all(f">{mark}</text>" in page for mark in ("7", "1", "500", "force [N]"))


def test_a_small_picture_has_title_and_axes_of_its_own_panel():
    chart = make_subplots(2, 1, subplot_titles=("impacts", "stress"))
    chart.add_scatter(x=[0, 1], y=[3, 4], mode="markers", row=1, col=1)
    chart.add_scatter(x=[0, 1], y=[5, 6], mode="lines", line_width=1.5, name="DE", row=2, col=1)
    chart.update_yaxes(title_text="force [N]", row=1).update_yaxes(title_text="stress [MPa]", row=2)
    drawn = still(chart)
    assert ">stress</pre>" in drawn and ">stress [MPa]</text>" in drawn and "force [N]" not in drawn
    chart.update_yaxes(type="log", row=2)
    assert still(chart) == ""


def estimate(drop_result, **changes):
    bearings = tuple(replace(one, values={}) for one in simulated_bearings(drop_result))
    told = {"consistent": True, "bearings": bearings, "later": (), "innovations": None, "cross_check": ()}
    return SimpleNamespace(**{"later_warning": "", **told, **changes})


def stressed(bearing, value, high):
    known = Known(value=value, status="determined", interval_90=(0.9 * value, high), unit="Pa")
    return replace(bearing, peak_stress=replace(bearing.peak_stress, known=known))


def test_a_stress_whose_interval_reaches_the_static_limit_asks_for_a_look_at_the_raceways(drop_result):
    nde, de = simulated_bearings(drop_result)
    below = estimate(drop_result, bearings=(stressed(nde, 3.9e9, 4.19e9), de))
    above = estimate(drop_result, bearings=(stressed(nde, 3.9e9, 4.21e9), de))
    assert not any(one.level == "warning" for one in inspection_section(below).statements)
    said = inspection_section(above).statements[0]
    assert said.level == "warning" and "4\u202f210 MPa" in said.text
    cases = ((3.9e9, 4.19e9, "notice"), (3.9e9, 4.21e9, "warning"), (4.3e9, 4.5e9, "bad"))
    for value, high, level in cases:  # kept, open, passed: as a limit of 'compare'
        assert static_limit_statement((stressed(nde, value, high), de)).level == level
    assert static_limit_statement((stressed(nde, 4.3e9, 4.5e9), de), certain=False).level == "warning"


def test_a_model_that_does_not_fit_is_to_be_settled_before_anything_else(drop_result):
    later = LaterMotion(
        bearing="DE", first=2e-4, first_time=0.01, later=3e-4, later_time=1.25, resolved=1e-6, larger=True
    )
    unfit = estimate(drop_result, consistent=False, later=(later,), later_warning="larger later on")
    said = inspection_section(unfit).statements
    assert [one.level for one in said] == ["bad", "warning", "notice", "notice"]


def test_the_gap_of_a_lift_check_is_stated_by_its_interval(drop_result):
    gap = Known(value=436e-6, status="determined", interval_90=(407e-6, 465e-6), unit="m")
    nde, de = estimate(drop_result).bearings
    known = (replace(nde, values={"air_gap_m": gap}), de)
    for bearing, told in (
        ('{ designation = "7016 CD", preload = "100 N" }', "expect NDE 407 to 465 µm;"),
        ('{ designation = "6016", clearance = "40 um" }', "expect NDE 427 to 485 µm with 20 µm of its play;"),
    ):
        machine = scaled_machine(60.0, bearing=bearing)
        text = inspection_section(estimate(drop_result, bearings=known, machine=machine)).statements[0].text
        assert f"lift check ({told}" in text
