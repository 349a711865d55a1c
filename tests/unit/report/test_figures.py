"""Figures contain the numbers they were given, in the unit their axes name."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rotordrop.report.displacement import displacement_figure
from rotordrop.report.displacement_pair import displacement_pair_figure
from rotordrop.report.first_contact import (
    FirstContact,
    OverlaidDrop,
    first_contact_figure,
    first_contacts_figure,
)
from rotordrop.report.force import Peak, force_figure
from rotordrop.report.friction_curve import FrictionLaw, friction_curve_figure
from rotordrop.report.history import AirGap, Band, BearingHistories, BearingMotions, History, Motion
from rotordrop.report.innovations import innovations_figure, nis_figure, whiteness_figure
from rotordrop.report.orbit import orbit_figure
from rotordrop.report.radial import radial_figure
from rotordrop.report.speed import speed_figure
from rotordrop.report.stress import stress_figure

TIME = np.linspace(0.0, 0.1, 1001)
SINGLE = 2e-7
LAW = FrictionLaw(label="NDE", static=0.13, dynamic=0.10, stribeck_speed=0.2, smoothing_speed=0.02)


def motion(label: str, role: Any = "simulated", phase: float = 0.0) -> Motion:
    angle = 2 * np.pi * 29.0 * TIME + phase
    return Motion(
        label=label,
        time=TIME,
        displacement=275e-6 * np.stack([np.sin(angle), -np.cos(angle)], axis=1),
        role=role,
    )


def bearings(gap: AirGap | None = None) -> tuple[BearingMotions, ...]:
    gap = gap or AirGap(lower=270e-6, upper=275e-6)
    return tuple(
        BearingMotions(
            bearing=name, motions=(motion("measured", "measured", 0.1), motion("simulated")), air_gap=gap
        )
        for name in ("NDE", "DE")
    )


def histories(factor: float = 1.0) -> tuple[BearingHistories, ...]:
    values = factor * (1000.0 + 900.0 * np.sin(40.0 * TIME))
    history = History(label="estimated", time=TIME, values=values, role="estimated")
    band = Band(time=TIME, lower=0.9 * values, upper=1.2 * values)
    return tuple(BearingHistories(bearing=name, histories=(history,), band=band) for name in ("NDE", "DE"))


def trace(figure: Any, name: str, panel: int = 1) -> Any:
    """The trace of a name in a panel, panels counted as plotly counts axes."""
    axis = "x" if panel == 1 else f"x{panel}"
    found = [item for item in figure.data if item.name == name and (item.xaxis or "x") == axis]
    assert len(found) == 1, [(item.name, item.xaxis) for item in figure.data]
    return found[0]


def shapes(figure: Any, panel: int = 1) -> list[Any]:
    axis = "y" if panel == 1 else f"y{panel}"
    return [shape for shape in figure.layout.shapes if shape.yref.split()[0] == axis]


ALL_FIGURES = {
    "friction curve": lambda: friction_curve_figure([LAW]),
    "displacement": lambda: displacement_figure(bearings()[0]),
    "displacement pair": lambda: displacement_pair_figure(bearings()),
    "first contact": lambda: first_contact_figure(bearings(), {}),
    "orbit": lambda: orbit_figure(bearings()),
    "radial": lambda: radial_figure(bearings()),
    "force": lambda: force_figure(histories()),
    "stress": lambda: stress_figure(histories(1e6)),
    "speed": lambda: speed_figure(histories()[0].histories, histories()[1].histories),
    "innovations": lambda: innovations_figure(TIME, np.zeros((1001, 2)), ("A", "B")),
    "innovation square": lambda: nis_figure(TIME, np.ones(1001), (0.8, 1.2)),
    "whiteness": lambda: whiteness_figure(np.random.default_rng(1).normal(size=(500, 2)), ("A", "B"), 5e-5),
}


@pytest.mark.parametrize("name", ALL_FIGURES)
def test_every_axis_title_has_its_unit(name: str) -> None:
    layout = ALL_FIGURES[name]().to_dict()["layout"]
    axes = {key: axis for key, axis in layout.items() if re.fullmatch(r"[xy]axis\d*", key)}
    titles = {key: axis["title"]["text"] for key, axis in axes.items() if axis.get("title", {}).get("text")}
    assert any(key.startswith("x") for key in titles)
    assert any(key.startswith("y") for key in titles)
    for key, title in titles.items():
        assert re.search(r"\w \[[^\[\]]+\]", title), (key, title)


def test_displacement_comes_back_in_micrometres_and_milliseconds() -> None:
    drawn = displacement_figure(bearings()[0])
    given = motion("simulated")
    for panel, axis in ((1, 1), (2, 0)):
        item = trace(drawn, "simulated", panel)
        assert_allclose(item.x, 1e3 * TIME, rtol=SINGLE)
        assert_allclose(item.y, 1e6 * given.displacement[:, axis], rtol=SINGLE, atol=1e-4)
    assert "y [µm]" in drawn.layout.yaxis.title.text
    assert "x [µm]" in drawn.layout.yaxis2.title.text


def test_the_air_gap_is_below_in_the_vertical_and_on_both_sides_in_the_horizontal() -> None:
    drawn = displacement_figure(bearings()[0])
    vertical = {(round(shape.y0, 6), round(shape.y1, 6)) for shape in shapes(drawn, 1)}
    horizontal = {(round(shape.y0, 6), round(shape.y1, 6)) for shape in shapes(drawn, 2)}
    assert vertical == {(-275.0, -270.0)}
    assert horizontal == {(-275.0, -270.0), (270.0, 275.0)}


def test_a_gap_known_as_one_value_is_one_line() -> None:
    drawn = radial_figure(bearings(AirGap.of(280e-6)))
    assert [(round(shape.y0, 6), round(shape.y1, 6)) for shape in shapes(drawn, 1)] == [(280.0, 280.0)]


def test_the_pair_has_horizontal_left_and_vertical_right_of_every_bearing() -> None:
    drawn = displacement_pair_figure(bearings())
    given = motion("measured", "measured", 0.1)
    for panel, axis in ((1, 0), (2, 1), (3, 0), (4, 1)):
        assert_allclose(
            trace(drawn, "measured", panel).y, 1e6 * given.displacement[:, axis], rtol=SINGLE, atol=1e-4
        )


def test_radial_displacement_is_the_distance_from_the_centre() -> None:
    item = trace(radial_figure(bearings()), "simulated", 2)
    assert_allclose(item.y, 275.0, rtol=1e-6)


def test_the_orbit_lies_in_circles_of_both_gap_limits_at_equal_scales() -> None:
    drawn = orbit_figure(bearings())
    for name, gap in (("clearance circle, upper limit", 275.0), ("clearance circle, lower limit", 270.0)):
        circle = trace(drawn, name)
        assert_allclose(np.hypot(circle.x, circle.y), gap, rtol=1e-6)
    orbit = trace(drawn, "simulated", 2)
    assert_allclose(np.hypot(orbit.x, orbit.y), 275.0, rtol=1e-6)
    assert_allclose(orbit.customdata, 1e3 * TIME, rtol=SINGLE)
    assert (drawn.layout.yaxis.scaleanchor, drawn.layout.yaxis2.scaleanchor) == ("x", "x2")
    assert tuple(drawn.layout.xaxis.range) == tuple(drawn.layout.yaxis.range)


def test_the_first_contact_is_marked_with_its_times_and_depth() -> None:
    contact = FirstContact(start=0.00775, end=0.0087, indentation=20.04e-6, deepest_time=0.008)
    drawn = first_contact_figure(bearings(), {"DE": contact})
    texts = [note.text for note in drawn.layout.annotations]
    assert "t₁ 7.75, t₂ 8.70, T 0.95 ms" in texts
    assert "indentation 20.0 µm" in texts
    lines = [shape for shape in drawn.layout.shapes if shape.xref == "x2" and shape.x0 == shape.x1]
    assert [round(shape.x0, 6) for shape in lines] == [7.75, 8.7]
    assert trace(drawn, "simulated").x[-1] == pytest.approx(40.0)


def test_several_drops_are_told_apart_by_colour_and_measured_from_simulated_by_dash() -> None:
    def vertical(phase: float) -> dict[str, History]:
        return {name: motion("", phase=phase).vertical for name in ("NDE", "DE")}

    drops = [
        OverlaidDrop(label=label, measured=vertical(phase), simulated=vertical(phase + 0.1))
        for label, phase in (("60 Hz", 0.0), ("210 Hz", 0.5))
    ]
    drawn = first_contacts_figure(drops, ("NDE", "DE"), {"NDE": 275e-6, "DE": 285e-6})
    simulated, measured = trace(drawn, "60 Hz"), trace(drawn, "60 Hz, measured (dashed)")
    assert simulated.line.color == measured.line.color != trace(drawn, "210 Hz").line.color
    assert (simulated.line.dash, measured.line.dash) == ("solid", "5px,3px")
    inside = TIME <= 0.04
    assert_allclose(measured.y, 1e6 * motion("").displacement[inside, 1], rtol=SINGLE, atol=1e-4)
    assert [shape.y0 for shape in shapes(drawn, 2)] == [pytest.approx(-285.0)]


def test_the_force_has_its_band_its_peak_and_the_weight() -> None:
    peak = Peak(time=0.00818, value=3333.1, interval_90=(3180.0, 3490.0))
    drawn = force_figure(histories(), peaks={"NDE": peak}, static_loads={"NDE": 174.6, "DE": 409.1})
    values = histories()[0].histories[0].values
    assert_allclose(trace(drawn, "estimated").y, values, rtol=SINGLE)
    band = [item for item in drawn.data if item.legendgroup == "90 % interval" and item.xaxis == "x"]
    assert_allclose(band[0].y, 0.9 * values, rtol=SINGLE)
    assert_allclose(band[1].y, 1.2 * values, rtol=SINGLE)
    assert band[1].fill == "tonexty"
    texts = [note.text.replace("\u202f", "") for note in drawn.layout.annotations]
    assert "peak 3333 N at 8.18 ms (90 %: 3180 to 3490 N)" in texts
    assert [shape.y0 for shape in shapes(drawn, 2)] == [409.1]


def test_a_window_cuts_history_and_band_and_hides_a_later_peak() -> None:
    late = Peak(time=0.05, value=2000.0)
    drawn = force_figure(histories(), peaks={"NDE": late}, until=0.02)
    assert all(max(item.x) <= 20.0 for item in drawn.data)
    assert not any("peak" in note.text for note in drawn.layout.annotations)


def test_stress_is_in_megapascal_above_the_preload() -> None:
    drawn = stress_figure(histories(1e6), preload_stress={"NDE": 993.36e6})
    assert_allclose(trace(drawn, "estimated").y, 1e-6 * histories(1e6)[0].histories[0].values, rtol=SINGLE)
    assert [shape.y0 for shape in shapes(drawn, 1)] == [pytest.approx(993.36)]


def test_speeds_are_in_hertz() -> None:
    rotor = History(label="rotor", time=TIME, values=np.full(1001, 2 * np.pi * 60.0))
    item = trace(speed_figure([rotor]), "rotor")
    assert_allclose(item.y, 60.0, rtol=SINGLE)


def test_the_friction_curve_is_odd_with_the_static_value_at_the_end_of_the_smoothing() -> None:
    drawn = friction_curve_figure([LAW])
    whole, near = trace(drawn, "NDE"), trace(drawn, "NDE", 2)
    assert_allclose(whole.y, -np.asarray(whole.y)[::-1], atol=1e-7)
    assert whole.y[-1] == pytest.approx(0.10 + 0.03 * np.exp(-(1.0 - 0.02) / 0.2), rel=1e-6)
    assert max(near.y) == pytest.approx(0.13, rel=1e-4)
    assert near.x[int(np.argmax(near.y))] == pytest.approx(0.02, abs=3e-4)


def test_innovations_come_with_the_band_the_filter_expects() -> None:
    rng = np.random.default_rng(3)
    innovations = 0.5e-6 * rng.normal(size=(1001, 2))
    drawn = innovations_figure(TIME, innovations, ("S_A", "S_B"), np.full((1001, 2), 0.5e-6))
    assert_allclose(trace(drawn, "innovation", 2).y, 1e6 * innovations[:, 1], rtol=SINGLE, atol=1e-6)
    limits = [
        item for item in drawn.data if item.name == "90 % expected by the filter" and item.xaxis == "x2"
    ]
    assert_allclose([item.y[0] for item in limits], [1.6448536 * 0.5, -1.6448536 * 0.5], rtol=1e-6)
    inside = np.mean(np.abs(1e6 * innovations[:, 1]) <= limits[0].y[0])
    assert inside == pytest.approx(0.9, abs=0.03)


def test_the_autocorrelation_of_a_first_order_process_is_its_power_of_the_lag() -> None:
    rng = np.random.default_rng(4)
    noise = rng.normal(size=200_000)
    values = np.zeros_like(noise)
    for index in range(1, len(noise)):
        values[index] = 0.8 * values[index - 1] + noise[index]
    drawn = whiteness_figure(values[:, None], ("A",), 5e-5)
    item = trace(drawn, "A")
    assert_allclose(item.y[:5], 0.8 ** np.arange(1, 6), atol=0.01)
    assert_allclose(item.x[:2], (0.05, 0.10), rtol=1e-6)


def test_the_innovation_square_is_averaged_over_its_window() -> None:
    squares = np.where(TIME < 0.05, 1.0, 3.0)
    item = trace(nis_figure(TIME, squares, (0.8, 1.2), window=2e-3), "mean over 2 ms")
    assert item.y[0] == pytest.approx(1.0)
    assert item.y[250] == pytest.approx(1.0)
    assert item.y[750] == pytest.approx(3.0)


def test_a_history_of_two_million_points_is_drawn_with_few_and_all_its_peaks() -> None:
    time = np.linspace(0.0, 50.0, 2_000_001)
    values = np.sin(time)
    values[1_234_567] = 4858.0
    history = History(label="force", time=time, values=values)
    item = trace(force_figure([BearingHistories(bearing="NDE", histories=(history,))]), "force")
    assert len(item.y) < 2000
    assert max(item.y) == pytest.approx(4858.0, rel=SINGLE)


EVIL = "<a href='https://example.org'>x</a>"
EVIL_HISTORY = History(label=EVIL, time=TIME, values=TIME)
EVIL_MOTION = BearingMotions(bearing=EVIL, motions=(motion(EVIL),), air_gap=AirGap.of(1e-4))
EVIL_LAW = FrictionLaw(label=EVIL, static=0.2, dynamic=0.1, stribeck_speed=1.0, smoothing_speed=0.1)
EVIL_FIGURES = {
    "orbit": lambda: orbit_figure([EVIL_MOTION]),
    "radial": lambda: radial_figure([EVIL_MOTION]),
    "displacement": lambda: displacement_figure(EVIL_MOTION),
    "displacement pair": lambda: displacement_pair_figure([EVIL_MOTION]),
    "first contact": lambda: first_contact_figure([EVIL_MOTION], {}),
    "force": lambda: force_figure([BearingHistories(bearing=EVIL, histories=(EVIL_HISTORY,))]),
    "friction curve": lambda: friction_curve_figure([EVIL_LAW]),
    "innovations": lambda: innovations_figure(TIME, np.zeros((1001, 1)), (EVIL,)),
    "whiteness": lambda: whiteness_figure(np.eye(200)[:, :1], (EVIL,), 5e-5),
}


@pytest.mark.parametrize("name", EVIL_FIGURES)
def test_names_from_files_cannot_bring_tags_into_a_figure(name: str) -> None:
    text = EVIL_FIGURES[name]().to_json()
    assert "<a href" not in text.replace("\\u003c", "<")
    assert "&lt;a href" in text.replace("\\u0026", "&")
