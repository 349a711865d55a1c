"""The comparison of several drops: all numbers, the ranking of the severity package, limits kept or not."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtr
from tests.published import bearing, published, value, went_on

from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.report.compare_page import (
    ComparedDrop,
    compare_page,
    comparison_figure,
    left_out,
    limit_statement,
    rankings,
)
from rotordrop.report.quantity import Quantity
from rotordrop.severity.numbers import LOADS, read_limits
from rotordrop.severity.ranking import DropSeverity, rank_drops


def drop(name, speed, nde, de, half=150.0):
    def peak(at):
        return value(at) if half is None else value(at, at - half, at + half)

    stress = value(1.5e9, 1.48e9, 1.52e9)
    estimate = published(
        machine="",
        speed_Hz=speed,
        simulated_record=name == "a",
        warnings=["the tail does not reach standstill"] if name == "c" else [],
        bearings={
            end: bearing({"peak_force_N": peak(force), "peak_stress_Pa": stress})
            for end, force in (("NDE", nde), ("DE", de))
        },
    )
    return ComparedDrop(name, estimate)


def marked(name, *, record="", **told):
    return another(drop(name, 150, 9000, 9000), record_sha256=record, **told)


def another(one, name="", **told):
    """The same drop with something else of its estimate."""
    return ComparedDrop(name or one.name, one.drop.model_copy(update=told))


DROPS = (drop("a", 60, 3300, 3600), drop("b", 100, 3100, 3300), drop("c", 210, 2500, 4200))


def test_every_number_of_every_drop_is_in_the_table_of_its_bearing():
    page = compare_page(DROPS)
    name, speed, bearing_name, told, _ = page.screen.rows[0]
    assert (name, bearing_name, speed.text) == ("c", "DE", "210 Hz")
    table = next(t for t in page.sections[0].tables if t.caption == "DE: severity of every drop")
    force = next(row[3] for row in table.rows if row[0] == "peak bearing force")
    assert (force.text, force.interval_text) == ("4\u202f200 N", "4\u202f050 to 4\u202f350 N")
    assert told == f"{force.text} ({force.interval_text})"


def test_the_ranking_is_the_one_of_the_severity_package():
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


def test_without_an_interval_there_is_no_ranking():
    drops = (DROPS[0], drop("d", 150, 3500, 3900, half=None))
    assert {field for _, field in rankings(drops, ("NDE", "DE"), {})} == {"peak_stress_Pa"}


def test_points_and_intervals_of_the_figure_are_the_numbers():
    values = {"NDE": [DROPS[0].number("NDE", LOADS[1]), Quantity(value=1.7e9, kind="pressure")]}
    chart = comparison_figure(("a", "b"), values, "peak Hertz stress")
    assert_allclose(chart.data[0].y, (1500.0, 1700.0))
    assert_allclose(chart.data[0].error_y.array, (20.0, 0.0))
    assert_allclose(chart.data[0].error_y.arrayminus, (20.0, 0.0))
    assert chart.layout.yaxis.title.text == "peak Hertz stress [MPa]"
    assert np.ravel(chart.data[0].x).tolist() == ["a", "b"]


def test_an_estimate_beside_its_record_is_shown_but_takes_no_part_in_the_ranking():
    drops = (*DROPS, marked("lost", consistent=False))
    assert rankings(drops, ("NDE", "DE"), {})["DE", "peak_force_N"].names == ("c", "a", "b")
    content = compare_page(drops)
    assert content.verdict[0].level == "bad"
    assert "NDE 8\u202f850 to 9\u202f150 N" in content.verdict[0].text
    assert rankings(drops[2:], ("NDE", "DE"), {}) == {}


def test_of_an_estimate_beside_its_record_ranges_alone_are_shown():
    """In the tables, and in the figures by a bar without a point."""
    content = compare_page((*DROPS, marked("lost", consistent=False)))
    severity = content.sections[0]
    force = next(row[4] for row in severity.tables[0].rows if row[0] == "peak bearing force")
    assert (force.text, force.interval_text) == ("8\u202f850 to 9\u202f150 N", "")
    chart = next(f.chart for f in severity.figures if f.caption.startswith("Peak bearing force"))
    assert chart.data[0].marker.size == (9, 9, 9, 0)
    assert list(chart.data[0].customdata)[3] == force.text


ONE = marked("one", record="4f")
SECOND = marked("second", record="4f", method="replay", consistent=False)


@pytest.mark.parametrize(
    ("drops", "message"),
    [
        (DROPS[:1], "1 drop to compare; at least two are needed"),
        (
            (DROPS[0], another(DROPS[1], "x", bearings={"front": bearing({}), "rear": bearing({})})),
            "x has the bearings front, rear, a has NDE, DE; only drops of one machine",
        ),
        ((ONE, another(ONE, "same")), "one and same are estimates of the same recording; expected"),
        ((ONE, SECOND, another(SECOND, "third")), "second and third are estimates of the same recording"),
    ],
)
def test_what_cannot_be_compared_is_refused(drops, message):
    with pytest.raises(UsageError, match=message):
        compare_page(drops)


def test_one_recording_estimated_in_two_ways_counts_once():
    other = another(ONE, "same", method="replay")
    assert left_out((ONE, other, DROPS[0])) == {"same": "the same recording as one, estimated by replay"}
    assert left_out((marked("x"), marked("y"))) == {}
    assert set(left_out((another(ONE, consistent=False), other, DROPS[0]))) == {"one"}


def test_machines_are_never_mixed_unsaid():
    one, *others = (another(drop, machine="LP-400") for drop in DROPS)
    assert not any("machines" in s.text for s in compare_page((one, *others)).verdict)
    mixed = compare_page((another(one, machine="HP-90"), *others))
    assert [s.level for s in mixed.verdict if "machines" in s.text] == ["warning"]


def test_the_ranking_says_how_much_worse_than_the_next():
    ranked = rankings(DROPS, ("NDE", "DE"), {})["DE", "peak_force_N"]
    sigma = 150.0 / 1.6448536
    assert_allclose(ranked.worse_than_next[0], ndtr(600.0 / (2**0.5 * sigma)), rtol=1e-6)
    assert_allclose(ranked.worse_than_next[1], ndtr(300.0 / (2**0.5 * sigma)), rtol=1e-6)


def test_severity_of_a_document_is_compared():
    def known(at):
        return value(at, 0.95 * at, 1.05 * at)

    def estimate(peak):
        numbers = {
            "peak_force_N": known(peak),
            "severity.static_safety": known(1e10 / peak**2),
            "severity.impulse_N_s": known(4.0),
        }
        return published(recorded="2026-03-14T08:05:30.25Z", bearings={"NDE": bearing(numbers)})

    drops = [ComparedDrop(name, estimate(p)) for name, p in (("a", 3000.0), ("b", 4000.0))]
    assert drops[0].label == "a, 2026-03-14 08:05, 60.0 Hz"
    content = compare_page(drops)
    table = next(t for t in content.sections[0].tables if t.caption == "NDE: severity of every drop")
    assert len(table.rows) == 3
    assert [key for _, key in rankings(drops, ("NDE",), {})] == ["peak_force_N", "severity.impulse_N_s"]


def test_stresses_of_one_bearing_are_ranked_by_what_their_records_say():
    """The balls, inferred within 16 %, are the same in both drops: the stress is as sure as its record."""

    def wide(at):
        return value(at, 0.84 * at, 1.16 * at).model_copy(update={"allowance_90": 0.159 * at})

    one, other = (
        another(drop, bearings={"NDE": bearing({"peak_stress_Pa": wide(at)})})
        for drop, at in ((DROPS[0], 1.50e9), (DROPS[1], 1.65e9))
    )
    worst = rankings([one, other], ("NDE",), {})["NDE", "peak_stress_Pa"].worst_drop
    assert worst[0] > 0.98
    other = another(other, machine="of other balls, for all that is known")
    worst = rankings([one, other], ("NDE",), {})["NDE", "peak_stress_Pa"].worst_drop
    assert 0.6 < worst[0] < 0.8


def stressed(name, stress, half, safety=8.0):
    numbers = {
        "peak_stress_Pa": value(stress, stress - half, stress + half),
        "severity.static_safety": value(safety, safety - 0.1, safety + 0.1),
    }
    return ComparedDrop(name, published(bearings={"NDE": bearing(numbers)}))


STRESSED = (stressed("a", 1.9e9, 2e7), stressed("b", 2.0e9, 2e7, safety=2.0))


@pytest.mark.parametrize(
    ("limits", "level", "text"),
    [
        ([], "notice", "No limit given"),
        (["peak_stress=2.2 GPa"], "good", "kept by all drops (passed by b at NDE with 0.0 % at most)"),
        (["peak_stress=1.95 GPa"], "bad", "passed by b at NDE (> 99 %)"),
        (["peak_stress=1.905 GPa"], "bad", "passed by b at NDE (> 99 %); open: a at NDE (34 %)"),
        (["peak_stress=2 GPa"], "warning", "open, passed by b at NDE with a probability of 50 %"),
        (["static_safety = 3"], "bad", "passed by b at NDE (> 99 %)"),  # from above
    ],
)
def test_limits_are_kept_passed_open_or_not_given(limits, level, text):
    said = limit_statement(STRESSED, read_limits(limits))
    assert said.level == level and text in said.text and "passed by a" not in said.text


@pytest.mark.parametrize(
    ("limit", "level", "text"),
    [
        ("peak_stress=2.2 GPa", "warning", "MPa until 200 ms and further out after that"),
        ("peak_stress=1.5 GPa", "bad", "passed by a at NDE"),
        ("mean_stress=2.2 GPa", "good", "kept by all drops"),
    ],
)
def test_no_limit_is_kept_where_the_rotor_went_further_out_after_the_estimate(limit, level, text):
    numbers = {"mean_stress_Pa": value(1.2e9, 1.1e9, 1.3e9), **STRESSED[0].drop.bearings["NDE"].numbers}
    gone = another(STRESSED[0], bearings={"NDE": bearing(numbers)}, later_motion=[went_on("NDE")])
    judged = limit_statement([gone], read_limits([limit]))
    assert judged.level == level and text in judged.text
    ranked = compare_page((gone, STRESSED[1])).verdict
    assert {one.level for one in ranked if "worst" in one.text} == {"warning"}
    assert "notice" in {one.level for one in compare_page(STRESSED).verdict if "worst" in one.text}


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ("peak_strss=2 GPa", r"did you mean 'peak_stress'"),
        ("peak_stress", r"expected a number and its limit"),
        ("peak_stress=2 kN", r"2 kN"),
    ],
)
def test_what_is_no_limit_is_refused(limit, message):
    with pytest.raises(UsageError, match=message):
        read_limits([limit])


def written(name, speed, peaks):
    bearings = {
        end: bearing(
            {
                "peak_force_N": value(peak, 0.95 * peak, 1.05 * peak),
                "mean_force_0p15_0p2_N": value(0.1 * peak, 0.09 * peak, 0.11 * peak),
                "peak_stress_Pa": value(1e9 + 2e5 * peak, 1e9, 1e9 + 4e5 * peak),
                "mean_stress_Pa": value(1e9 + peak, 1e9, 1e9 + 2.0 * peak),
            }
        )
        for end, peak in zip(("NDE", "DE"), peaks, strict=True)
    }
    return published(speed_Hz=speed, record_sha256=name, bearings=bearings).as_json()


def test_the_comparison_ranks_every_number_of_every_bearing(tmp_path):
    drops = (("a", 60.0, (3300.0, 3900.0)), ("b", 100.0, (3500.0, 3600.0)), ("c", 210.0, (2500.0, 3700.0)))
    documents = {one[0]: written(*one) for one in drops}
    files = [tmp_path / f"{name}.json" for name in documents]
    for file in files:
        file.write_text(json.dumps(documents[file.stem]))
    out = tmp_path / "compared.json"
    assert run(["compare", *map(str, files), "--json", str(out)]) == 0
    told = json.loads(out.read_text())
    assert told["left_out"] == {}
    for end in ("NDE", "DE"):
        for key, entry in told["bearings"][end].items():
            numbers = {name: document["bearings"][end][key] for name, document in documents.items()}
            order = sorted(numbers, key=lambda name: -numbers[name]["value"])
            assert entry["worst_first"] == order, (end, key)
            assert entry["values"] == [numbers[name]["value"] for name in order]
            drops = [
                DropSeverity.from_interval(name, one["value"], tuple(one["interval_90"]))
                for name, one in numbers.items()
            ]
            assert entry["probability_worst_drop"] == pytest.approx(rank_drops(drops).worst_drop)
            assert sum(entry["probability_worst_drop"]) == pytest.approx(1.0)
            assert entry["probability_worst_condition"] is None
    assert {"peak_force_N", "peak_stress_Pa"} <= set(told["bearings"]["DE"])
