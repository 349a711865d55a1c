"""The comparison of several drops: all numbers, the ranking of the severity package, and its limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtr
from tests.published import bearing, published, value

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop, Impact, Value
from rotordrop.report.compare_page import compare_page, comparison_figure, rankings
from rotordrop.report.compared_drop import ComparedDrop, left_out
from rotordrop.report.quantity import Quantity
from rotordrop.severity.numbers import LOADS
from rotordrop.severity.ranking import DropSeverity, rank_drops


def number(at: float, half: float | None) -> Value:
    return value(at) if half is None else value(at, at - half, at + half)


def drop(name: str, speed: float, nde: float, de: float, half: float | None = 150.0) -> ComparedDrop:
    estimate = published(
        machine="",
        speed_Hz=speed,
        simulated_record=name == "a",
        warnings=["the tail does not reach standstill"] if name == "c" else [],
        bearings={
            end: bearing({"peak_force_N": number(force, half), "peak_stress_Pa": number(1.5e9, 2e7)})
            for end, force in (("NDE", nde), ("DE", de))
        },
    )
    return ComparedDrop(name, estimate)


def marked(name: str, *, consistent: bool = True, method: str = "tracked", record: str = "") -> ComparedDrop:
    one = drop(name, 150, 9000, 9000)
    return another(one, consistent=consistent, method=method, record_sha256=record)


def another(one: ComparedDrop, name: str = "", **told: Any) -> ComparedDrop:
    """The same drop with something else of its estimate."""
    return ComparedDrop(name or one.name, one.drop.model_copy(update=told))


DROPS = (drop("a", 60, 3300, 3600), drop("b", 100, 3100, 3300), drop("c", 210, 2500, 4200))


def test_every_number_of_every_drop_is_in_the_table_of_its_bearing() -> None:
    nde, de = compare_page(DROPS, machine_name="LP-400").summary
    assert nde.caption == "NDE touchdown bearing"
    forces = {row[0]: row[3] for row in de.rows}
    assert isinstance(forces["c"], Quantity)
    assert forces["c"].text == "4\u202f200 N"
    assert forces["c"].interval_text == "4\u202f050 to 4\u202f350 N"
    speed = nde.rows[2][2]
    assert isinstance(speed, Quantity)
    assert speed.text == "210 Hz (12\u202f600 rpm)"


def test_the_ranking_is_the_one_of_the_severity_package() -> None:
    ranked = rankings(DROPS, ("NDE", "DE"), {"peak_force_N": 600.0})["DE", "peak_force_N"]
    expected = rank_drops(
        [
            DropSeverity.from_interval(n, v, (v - 150.0, v + 150.0))
            for n, v in (("a", 3600), ("b", 3300), ("c", 4200))
        ],
        drop_scatter=600.0,
    )
    assert ranked.names == expected.names == ("c", "a", "b")
    assert_allclose(ranked.worst_drop, expected.worst_drop)
    content = compare_page(DROPS, drop_scatter={"peak_force_N": 600.0})
    assert any(expected.statement in statement.text for statement in content.verdict)
    table = next(t for t in content.sections[0].tables if t.caption == "DE: ranking by peak bearing force")
    assert [row[0] for row in table.rows] == ["c", "a", "b"]
    assert "600.0 N" in table.note


def test_without_an_interval_there_is_no_ranking_and_the_page_says_why() -> None:
    drops = (DROPS[0], drop("d", 150, 3500, 3900, half=None))
    content = compare_page(drops)
    texts = [statement.text for statement in content.verdict]
    assert any(
        text.startswith("NDE, peak bearing force: not every drop states an interval") for text in texts
    )
    assert not [t for t in content.sections[0].tables if "bearing force" in t.caption]


def test_warnings_and_simulated_records_are_named() -> None:
    content = compare_page(DROPS)
    assert "simulated, not measured: a." in content.simulated
    warnings = [statement.text for statement in content.verdict if statement.level == "warning"]
    assert warnings == ["c: the tail does not reach standstill"]


def test_points_and_intervals_of_the_figure_are_the_numbers() -> None:
    values = {"NDE": [DROPS[0].number("NDE", LOADS[1]), Quantity(value=1.7e9, kind="pressure")]}
    chart = comparison_figure(("a", "b"), values, "peak Hertz stress")
    assert_allclose(chart.data[0].y, (1500.0, 1700.0))
    assert_allclose(chart.data[0].error_y.array, (20.0, 0.0))
    assert_allclose(chart.data[0].error_y.arrayminus, (20.0, 0.0))
    assert chart.layout.yaxis.title.text == "peak Hertz stress [MPa]"
    assert np.ravel(chart.data[0].x).tolist() == ["a", "b"]


def test_a_single_drop_cannot_be_compared() -> None:
    with pytest.raises(UsageError, match="1 drop given, at least two are needed"):
        compare_page(DROPS[:1])


def test_drops_of_different_machines_are_refused() -> None:
    other = another(drop("x", 1.0, 1.0, 1.0), bearings={"front": bearing({}), "rear": bearing({})})
    with pytest.raises(
        UsageError, match="x has the bearings front, rear, a has NDE, DE; only drops of one machine"
    ):
        compare_page((DROPS[0], other))


def test_an_estimate_beside_its_record_is_shown_but_takes_no_part_in_the_ranking() -> None:
    drops = (*DROPS, marked("lost", consistent=False))
    ranked = rankings(drops, ("NDE", "DE"), {})
    assert ranked["DE", "peak_force_N"].names == ("c", "a", "b")
    content = compare_page(drops)
    first = content.verdict[0]
    assert first.level == "bad"
    assert first.text.startswith("lost is left out of the ranking: its model is not consistent with")
    assert "NDE 8\u202f850 to 9\u202f150 N" in first.text
    assert content.summary[0].rows[3][0] == "lost (not consistent with its record)"


def test_of_an_estimate_beside_its_record_ranges_alone_are_shown() -> None:
    """In the tables, and in the figures by a bar without a point; no box of its stress."""
    content = compare_page((*DROPS, marked("lost", consistent=False)))
    force = content.summary[0].rows[3][3]
    assert isinstance(force, Quantity)
    assert (force.text, force.interval_text) == ("8\u202f850 to 9\u202f150 N", "")
    severity = content.sections[0]
    told = next(row for row in severity.tables[0].rows if row[0] == "peak bearing force")
    assert isinstance(told[4], Quantity) and told[4].text == force.text
    chart = next(f.chart for f in severity.figures if f.caption.startswith("Peak bearing force"))
    assert chart.data[0].marker.size == (9, 9, 9, 0)  # type: ignore[attr-defined]
    assert list(chart.data[0].customdata)[3] == force.text  # type: ignore[attr-defined]
    boxes = severity.figures[-1]
    assert boxes.caption.startswith("Distribution") and "lost" not in str(boxes.chart.to_plotly_json())
    lost = [marked(name, consistent=False, record=name) for name in ("x", "y")]
    assert not [f for f in compare_page(lost).sections[0].figures if f.caption.startswith("Distribution")]


def test_fewer_than_two_drops_left_are_not_ranked() -> None:
    content = compare_page((DROPS[0], marked("lost", consistent=False)))
    assert rankings((DROPS[0], marked("lost", consistent=False)), ("NDE", "DE"), {}) == {}
    assert any("fewer than two drops are left to rank" in statement.text for statement in content.verdict)


def test_one_recording_estimated_twice_is_refused_or_counts_once() -> None:
    one, same = marked("one", record="4f"), marked("same", record="4f")
    with pytest.raises(UsageError, match="one and same are estimates of the same recording; expected"):
        compare_page((one, same))
    other = another(same, method="replay")
    assert left_out((one, other, DROPS[0])) == {"same": "the same recording as one, estimated by replay"}
    assert left_out((marked("x"), marked("y"))) == {}
    lost = another(one, consistent=False)
    assert set(left_out((lost, other, DROPS[0]))) == {"one"}


def test_a_third_estimate_of_one_recording_in_the_same_way_is_refused_too() -> None:
    one = marked("one", record="4f")
    second = marked("second", record="4f", method="replay", consistent=False)
    third = another(second, "third")
    with pytest.raises(UsageError, match="second and third are estimates of the same recording"):
        left_out((one, second, third))


def test_machines_are_never_mixed_unsaid() -> None:
    one, *others = (another(drop, machine="LP-400") for drop in DROPS)
    assert not any("machines" in s.text for s in compare_page((one, *others)).verdict)
    mixed = compare_page((another(one, machine="HP-90"), *others))
    (said,) = (s for s in mixed.verdict if "machines" in s.text)
    assert said.level == "warning"
    assert said.text.startswith("These are drops of 2 machines, HP-90: a; LP-400: b, c")


def test_no_limit_given_is_said_and_a_limit_is_judged() -> None:
    assert compare_page(DROPS).verdict[-1].text.startswith("No limit given")
    said = compare_page(DROPS, limits={"peak_force_N": 4000.0}).verdict[-1]
    assert said.level == "bad" and "passed by c at DE" in said.text


def test_the_ranking_says_how_much_worse_than_the_next() -> None:
    ranked = rankings(DROPS, ("NDE", "DE"), {})["DE", "peak_force_N"]
    sigma = 150.0 / 1.6448536
    assert_allclose(ranked.worse_than_next[0], ndtr(600.0 / (2**0.5 * sigma)), rtol=1e-6)
    assert_allclose(ranked.worse_than_next[1], ndtr(300.0 / (2**0.5 * sigma)), rtol=1e-6)
    assert "it was worse than a with" in ranked.statement


def test_severity_of_a_document_is_compared_with_its_worst_impact() -> None:
    def known(at: float) -> Value:
        return value(at, 0.95 * at, 1.05 * at)

    def estimate(peak: float) -> Drop:
        impacts = [
            Impact.model_construct(
                peak_force_N=known(p), impulse_N_s=known(i), dissipated_energy_J=known(e), peak_time_s=t
            )
            for p, i, e, t in ((900.0, 1.0, 2.0, 0.008), (peak, 3.0, 6.0, 0.02))
        ]
        numbers = {
            "peak_force_N": known(peak),
            "severity.static_safety": known(1e10 / peak**2),
            "severity.impulse_N_s": known(4.0),
        }
        return published(recorded="2026-03-14T08:05:30.25Z", bearings={"NDE": bearing(numbers, impacts)})

    drops = [ComparedDrop(name, estimate(p)) for name, p in (("a", 3000.0), ("b", 4000.0))]
    assert drops[0].label == "a, 2026-03-14 08:05, 60.0 Hz"
    content = compare_page(drops)
    table = next(t for t in content.sections[0].tables if t.caption == "NDE: severity of every drop")
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["worst impact"][1] == "impact 2 of 2 at 20.0 ms: 75 % of the impulse and 75 % of the energy"
    ranked = rankings(drops, ("NDE",), {})["NDE", "severity.static_safety"]
    assert ranked.names == ("b", "a")  # the smaller factor is the worse one
    assert ranked.values[0] < ranked.values[1]
