"""Figures contain the numbers they were given, in the unit their axes name; thinned, all peaks and bands."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from rotordrop.estimate.bearing_drop import (
    AirGap,
    Band,
    BearingDrop,
    BearingMotions,
    FirstContact,
    History,
    Motion,
    Origin,
    Peak,
    highest,
)
from rotordrop.known import Known
from rotordrop.report.drop_sections import (
    displacement_figure,
    drop_sections,
    first_contact_figure,
    force_panel,
    orbit_figure,
    speed_figure,
)
from rotordrop.report.estimate_page import innovations_figure
from rotordrop.report.style import Panel, block_envelope, time_panels
from rotordrop.series import peak_indices

TIME = np.linspace(0.0, 0.1, 1001)
SINGLE = 2e-7


def motion(label, role="simulated", phase=0.0):
    angle = 2 * np.pi * 29.0 * TIME + phase
    place = 275e-6 * np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    return Motion(label=label, time=TIME, displacement=place, role=role)


def history(factor=1.0):
    values = factor * (1000.0 + 900.0 * np.sin(40.0 * TIME))
    return History(label="estimated", time=TIME, values=values, role="estimated")


def band(of):
    return Band(time=of.time, lower=0.9 * of.values, upper=1.2 * of.values)


def drop(name, gap=None, label="simulated", **changes):
    force, stress = history(), history(1e6)
    given = {
        "name": name,
        "motions": (motion("measured", "measured", 0.1), motion(label)),
        "air_gap": gap or AirGap(lower=270e-6, upper=275e-6),
        "force": force,
        "force_band": band(force),
        "stress": stress,
        "stress_band": band(stress),
        "peak_force": highest(force, "N", Origin.TWIN),
        "peak_stress": highest(stress, "Pa", Origin.TWIN),
    }
    given["at_gap_limits"] = given["motions"]  # the radius is drawn of what was simulated with both limits
    return BearingDrop(**{**given, **changes})


def bearings(gap=None):
    return drop("NDE", gap), drop("DE", gap)


def charts(*drops, loads=None):
    """Figures of a drop by a word of their caption."""
    found = {}
    for section in drop_sections(drops or bearings(), "simulated", loads):
        for figure in section.figures:
            for word in ("ball force", "Hertz stress of all", "zoom together", "Radial"):
                if word in figure.caption:
                    found[word] = figure.chart
    return found


def trace(figure, name, panel=1):
    """The trace of a name in a panel, panels counted as plotly counts axes."""
    axis = "x" if panel == 1 else f"x{panel}"
    found = [item for item in figure.data if item.name == name and (item.xaxis or "x") == axis]
    assert len(found) == 1, [(item.name, item.xaxis) for item in figure.data]
    return found[0]


def shapes(figure, panel=1):
    axis = "y" if panel == 1 else f"y{panel}"
    return [shape for shape in figure.layout.shapes if shape.yref.split()[0] == axis]


EVIL = "<a href='https://example.org'>x</a>"
EVIL_DROP = drop(EVIL, AirGap.of(1e-4), label=EVIL, force=History(label=EVIL, time=TIME, values=TIME))
FIGURES = {
    "displacement": lambda: displacement_figure([EVIL_DROP]),
    "first contact": lambda: first_contact_figure([EVIL_DROP]),
    "orbit": lambda: orbit_figure([EVIL_DROP]),
    "radial": lambda: charts(EVIL_DROP)["Radial"],
    "force": lambda: charts(EVIL_DROP)["ball force"],
    "stress": lambda: charts(EVIL_DROP)["Hertz stress of all"],
    "speed": lambda: speed_figure([EVIL_DROP.force], [EVIL_DROP.force]),
    "innovations": lambda: innovations_figure(TIME, np.zeros((1001, 1)), (EVIL,)),
}


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_title_has_its_unit_and_names_from_files_bring_no_tags(name):
    figure = FIGURES[name]()
    layout = figure.to_dict()["layout"]
    axes = {key: axis for key, axis in layout.items() if re.fullmatch(r"[xy]axis\d*", key)}
    titles = {key: axis["title"]["text"] for key, axis in axes.items() if axis.get("title", {}).get("text")}
    assert any(key.startswith("x") for key in titles)
    assert any(key.startswith("y") for key in titles)
    for key, title in titles.items():
        assert re.search(r"\w \[[^\[\]]+\]", title), (key, title)
    text = figure.to_json()
    assert "<a href" not in text.replace("\\u003c", "<")
    assert ("&lt;a href" in text.replace("\\u0026", "&")) == (name != "innovation square")


def gaps(figure, panel):
    return {(round(shape.y0, 6), round(shape.y1, 6)) for shape in shapes(figure, panel)}


def test_the_air_gap_is_below_in_the_vertical_and_on_both_sides_in_the_horizontal():
    drawn = displacement_figure(bearings())
    assert gaps(drawn, 2) == {(-275.0, -270.0)}
    assert gaps(drawn, 1) == {(-275.0, -270.0), (270.0, 275.0)}
    one = charts(*bearings(AirGap.of(280e-6)))["Radial"]
    assert gaps(one, 1) == {(280.0, 280.0)} and len(shapes(one, 1)) == 1


def test_the_displacement_has_horizontal_left_and_vertical_right_of_every_bearing():
    given, drawn = 1e6 * motion("measured", "measured", 0.1).displacement, charts()["zoom together"]
    for panel, axis in ((1, 0), (2, 1), (3, 0), (4, 1)):
        item = trace(drawn, "measured", panel)
        assert_allclose(item.x, 1e3 * TIME, rtol=SINGLE)
        assert_allclose(item.y, given[:, axis], rtol=SINGLE, atol=1e-4)
    titles = drawn.layout.yaxis.title.text, drawn.layout.yaxis2.title.text
    assert "x [µm]" in titles[0] and "y [µm]" in titles[1]


def test_distance_stress_and_speed_have_their_units():
    assert_allclose(trace(charts()["Radial"], "simulated", 2).y, 275.0, rtol=1e-6)
    stress = charts(drop("NDE", preload_stress=993.36e6))["Hertz stress of all"]
    assert_allclose(trace(stress, "estimated").y, 1e-6 * history(1e6).values, rtol=SINGLE)
    assert [shape.y0 for shape in shapes(stress, 1)] == [pytest.approx(993.36)]
    rotor = History(label="rotor", time=TIME, values=np.full(1001, 2 * np.pi * 60.0))
    assert_allclose(trace(speed_figure([rotor]), "rotor").y, 60.0, rtol=SINGLE)


def test_a_long_record_counts_seconds():
    time = np.linspace(-0.25, 57.0, 20_001)
    long = History(label="measured", time=time, values=np.sin(time), role="measured")
    peak = Peak(known=Known(value=1.0, status="determined"), time=12.5, origin=Origin.TWIN)
    drawn = time_panels([[Panel(title="NDE", axis="force", histories=(long,), peak=peak)]], 1.0, "N")
    assert drawn.layout.xaxis.title.text == "time from power-off [s]"
    assert_allclose(drawn.data[0].x[[0, -1]], (-0.25, 57.0), rtol=SINGLE)
    assert "%{x:.4f} s" in drawn.data[0].hovertemplate
    assert 12.5 in [mark.x for mark in drawn.layout.annotations]


def test_a_long_orbit_is_no_polygon_of_far_points():
    """The extremes of blocks alone cut forty turns into chords up to a diameter long."""
    angle = np.linspace(0.0, 2.0 * np.pi * 40.0, 20_000)
    time = np.linspace(0.0, 0.5, len(angle))
    path = 250e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    turned = Motion(label="measured", time=time, displacement=path, role="measured")
    (orbit, *_) = orbit_figure([BearingMotions(name="NDE", motions=(turned,))]).data
    chords = np.hypot(np.diff(orbit.x), np.diff(orbit.y))
    assert float(np.max(chords)) < 250.0 * 2.0 * np.pi / 90.0


def test_the_orbit_lies_in_circles_of_both_gap_limits_at_equal_scales():
    drawn = orbit_figure(bearings())
    for name, gap in (("clearance circle, upper limit", 275.0), ("clearance circle, lower limit", 270.0)):
        circle = trace(drawn, name)
        assert_allclose(np.hypot(circle.x, circle.y), gap, rtol=1e-6)
    orbit = trace(drawn, "simulated", 2)
    assert_allclose(np.hypot(orbit.x, orbit.y), 275.0, rtol=1e-6)
    assert_allclose(orbit.customdata, 1e3 * TIME, rtol=SINGLE)
    assert (drawn.layout.yaxis.scaleanchor, drawn.layout.yaxis2.scaleanchor) == ("x", "x2")
    assert tuple(drawn.layout.xaxis.range) == tuple(drawn.layout.yaxis.range)


def test_the_first_contact_is_marked_with_its_times_and_depth():
    contact = FirstContact(start=0.00775, end=0.0087, indentation=20.04e-6)
    drawn = first_contact_figure((drop("NDE"), drop("DE", first_contact=contact)))
    texts = [line for note in drawn.layout.annotations for line in note.text.split("<br>")]
    assert {"t₁ 7.75, t₂ 8.70, T 0.95 ms", "indentation 20.0 µm"} <= {*texts}
    gap = Known(value=275e-6, interval_90=(270e-6, 279e-6), unit="m")
    one = drop("DE", first_contact=contact, values={"air_gap_m": gap})
    peak = replace(one.peak_force, known=Known(value=3333.1, interval_90=(3180.0, 3490.0), unit="N"))
    said = first_contact_figure([replace(one, peak_force=peak)]).layout.annotations
    texts = [line for note in said for line in note.text.split("<br>")]
    assert "indentation 16.0 to 25.0 µm" in texts  # as sure as the air gap
    assert not any("T 0.95" in text for text in texts), "nobody knows the error of a lift-off"
    lines = [shape for shape in drawn.layout.shapes if shape.xref == "x2" and shape.x0 == shape.x1]
    assert [round(shape.x0, 6) for shape in lines] == [7.75, 8.7]
    assert trace(drawn, "simulated").x[-1] == pytest.approx(40.0)


def test_the_force_has_its_band_its_peak_and_the_weight():
    known = Known(value=3333.1, status="determined", interval_90=(3180.0, 3490.0), unit="N")
    peak = Peak(known=known, time=0.00818, origin=Origin.TWIN)
    drawn = charts(drop("NDE", peak_force=peak), drop("DE"), loads={"NDE": 174.6, "DE": 409.1})["ball force"]
    values = history().values
    assert_allclose(trace(drawn, "estimated").y, values, rtol=SINGLE)
    found = [item for item in drawn.data if item.legendgroup == "90 % interval" and item.xaxis == "x"]
    assert_allclose(found[0].y, 0.9 * values, rtol=SINGLE)
    assert_allclose(found[1].y, 1.2 * values, rtol=SINGLE)
    assert found[1].fill == "tonexty"
    texts = [note.text.replace("\u202f", "") for note in drawn.layout.annotations]
    assert "peak 3333 N at 8.18 ms<br>90 %: 3180 to 3490 N" in texts
    assert [shape.y0 for shape in shapes(drawn, 3)] == [409.1]
    near = trace(drawn, "estimated", 2)
    assert (near.x[0], near.x[-1]) == pytest.approx((6.2, 14.1), abs=0.1)
    (mark,) = (note for note in drawn.layout.annotations if "peak 3" in note.text)
    assert (mark.yanchor, mark.y) == ("bottom", 3333.1), "above all curves"
    drawn = time_panels([[force_panel(drop("DE"), {}, certain=False)]], 1.0, "N")
    assert {one.name for one in drawn.data} == {"estimated, not believed", "90 % interval, not believed"}


def test_a_window_around_a_peak_cuts_history_and_band():
    peak = Peak(known=Known(value=2000.0, status="determined"), time=0.05, origin=Origin.TWIN)
    panel = Panel(title="NDE", axis="force", histories=(history(),), band=band(history()), peak=peak)
    drawn = time_panels([[panel.around(2e-3, 4e-3)]], 1.0, "N")
    assert all(min(item.x) >= 48.0 and max(item.x) <= 54.0 for item in drawn.data)
    assert any("peak" in note.text for note in drawn.layout.annotations)


def test_innovations_come_with_the_band_the_filter_expects():
    rng = np.random.default_rng(3)
    innovations = 0.5e-6 * rng.normal(size=(1001, 2))
    drawn = innovations_figure(TIME, innovations, ("S_A", "S_B"), np.full((1001, 2), 0.5e-6))
    assert_allclose(trace(drawn, "innovation", 2).y, 1e6 * innovations[:, 1], rtol=SINGLE, atol=1e-6)
    expected = (one for one in drawn.data if one.name == "90 % expected by the filter")
    limits = [one for one in expected if one.xaxis == "x2"]
    assert_allclose([item.y[0] for item in limits], [1.6448536 * 0.5, -1.6448536 * 0.5], rtol=1e-6)
    inside = np.mean(np.abs(1e6 * innovations[:, 1]) <= limits[0].y[0])
    assert inside == pytest.approx(0.9, abs=0.03)


def test_a_history_of_two_million_points_is_drawn_with_few_and_all_its_peaks():
    time = np.linspace(0.0, 50.0, 2_000_001)
    values = np.sin(time)
    values[1_234_567] = 4858.0
    force = History(label="force", time=time, values=values)
    item = trace(time_panels([[Panel(title="NDE", axis="force", histories=(force,))]], 1.0, "N"), "force")
    assert len(item.y) < 2000
    assert max(item.y) == pytest.approx(4858.0, rel=SINGLE)


def test_where_single_numbers_do_not_hold_peaks_are_ranges_and_no_distribution_is_stated():
    force = highest(history(), "N", Origin.CROSS_CHECK)
    ranged = replace(force, known=replace(force.known, interval_90=(1500.0, 2300.0)))
    for certain in (True, False):
        sections = drop_sections((drop("NDE", peak_force=ranged),), "", certain=certain)
        told = [note.text for one in sections for f in one.figures for note in f.chart.layout.annotations]
        (peak,) = (text for text in told if "N" in text and text.startswith("peak") and "MPa" not in text)
        stress = next(section for section in sections if section.heading == "Hertz stress")
        if certain:
            assert peak.startswith(f"peak {force.value:,.0f} N at ".replace(",", "\u202f"))
            assert peak.endswith("90 %: 1\u202f500 to 2\u202f300 N")
            assert len(stress.figures) == 2  # its box; numbers without an interval stand in no table
        else:
            assert peak == "peak, 90 %: 1\u202f500 to 2\u202f300 N"
            assert not stress.tables and len(stress.figures) == 1
            assert stress.statements[0].text.startswith("No distribution of the stress is stated")


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(2, 5000),
    blocks=st.integers(1, 60),
    signals=st.integers(1, 3),
)
@settings(max_examples=60, deadline=None)
def test_every_block_keeps_its_extremes(seed, count, blocks, signals):
    values = np.random.default_rng(seed).normal(size=(signals, count))
    chosen = peak_indices(*values, blocks=blocks)
    assert chosen[0] == 0
    assert chosen[-1] == count - 1
    assert np.all(np.diff(chosen) > 0)
    assert len(chosen) <= 2 * signals * blocks + 2
    for block in np.split(np.arange(count), np.linspace(0, count, blocks + 1).astype(int)[1:-1]):
        if len(block):
            kept = values[:, np.intersect1d(block, chosen)]
            assert np.array_equal(kept.max(axis=1), values[:, block].max(axis=1))
            assert np.array_equal(kept.min(axis=1), values[:, block].min(axis=1))


def test_short_histories_are_drawn_as_they_are():
    assert np.array_equal(peak_indices(np.arange(100.0), blocks=50), np.arange(100))


def test_a_gap_in_a_history_does_not_hide_the_peak_beside_it():
    values = np.ones(10_000)
    values[4000:4500] = np.nan
    values[4501] = 7.0
    chosen = peak_indices(values, blocks=40)
    assert np.nanmax(values[chosen]) == 7.0
    assert np.isnan(values[chosen]).any()


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_a_thinned_band_contains_the_whole_one(seed):
    rng = np.random.default_rng(seed)
    middle = rng.normal(size=3000).cumsum()
    lower, upper = middle - rng.random(3000), middle + rng.random(3000)
    index, lowest, highest = block_envelope(lower, upper, blocks=30)
    edges = np.linspace(0, 3000, 31).astype(int)
    for block, (start, end) in enumerate(pairwise(edges)):
        assert start <= index[block] < end
        assert lowest[block] <= lower[start:end].min()
        assert highest[block] >= upper[start:end].max()
