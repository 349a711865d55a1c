"""One drop, one number: page, report, JSON and Python say the same of every quantity."""

from __future__ import annotations

import dataclasses
import html
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.unit.report.conftest import estimate as estimate

from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.elements.table import published
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.severity_numbers import severity_values
from rotordrop.report.estimate_page import assumed_card
from rotordrop.report.quantity import IN_OTHER_UNITS, display_unit, unbroken
from rotordrop.report.restart_page import restart_numbers
from rotordrop.restart import RestartCard
from rotordrop.severity.numbers import LOADS
from rotordrop.web.drawn import write_estimate, write_look
from rotordrop.web.python_lines import estimate_lines, look_lines
from rotordrop.web.traces import open_traces
from rotordrop.web.workspace import Job, Workspace

NAMES = {
    "machine": {"name": "lp400.toml", "stored": "machine.toml", "bytes": 1, "sha256": "a" * 64},
    "record": {"name": "drop_060.h5", "stored": "record.h5", "bytes": 1, "sha256": "b" * 64},
    "tail": {"name": "drop_060_tail.csv", "stored": "tail.csv", "bytes": 1, "sha256": "c" * 64},
}


@pytest.fixture(scope="module")
def written(estimate: Estimate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    space = Workspace(tmp_path_factory.mktemp("same"))
    space.prepare()
    job = space.new_job("drop_060", {})
    job.write({**job.read(), "files": NAMES})
    made = job.path / "estimate.made"
    made.mkdir()
    write_estimate(estimate, Job(job.path), made, {})
    return made


@pytest.fixture(scope="module")
def page(written: Path) -> dict[str, Any]:
    return dict(json.loads((written / "page.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def document(written: Path) -> dict[str, Any]:
    return dict(json.loads((written / "document.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def report(written: Path) -> str:
    text = (written / "report.html").read_text(encoding="utf-8")
    return html.unescape(re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL))


def section(page: dict[str, Any], heading: str) -> dict[str, Any]:
    return next(dict(part) for part in page["sections"] if part["heading"] == heading)


def test_loads_of_every_bearing(estimate: Estimate, page: dict[str, Any], document: dict[str, Any]) -> None:
    compared = 0
    for card, bearing in zip(page["cards"], estimate.bearings, strict=True):
        in_json = document["bearings"][bearing.name]
        in_python = {
            **bearing.values,
            "peak_force_N": bearing.peak_force.known,
            "peak_stress_Pa": bearing.peak_stress.known,
        }
        for load in LOADS:
            if load.field not in in_python:
                continue
            shown = next(f for f in card["figures"] if f["label"].lower() == load.label.lower())
            value = in_python[load.field].value
            assert shown["value"]["value"] == in_json[load.field]["value"] == value
            assert tuple(in_json[load.field]["interval_90"]) == in_python[load.field].interval_90
            compared += 1
        for place in page["places"]:
            if place["name"] == bearing.name:
                assert place["peaks"]["force"]["value"] == bearing.peak_force.value
                assert place["peaks"]["force"]["time"] == in_json["peak_force_N"]["time_s"]
    assert compared >= 6


def test_the_gap_that_is_drawn_has_its_level(estimate: Estimate, page: dict[str, Any]) -> None:
    for place, bearing in zip(page["places"], estimate.bearings, strict=True):
        assert place["gap"] == list(bearing.values["air_gap_m"].interval_90)
        assert place["gap_is"] == "90 %"


def test_every_impact(estimate: Estimate, page: dict[str, Any], document: dict[str, Any]) -> None:
    in_json = [
        (
            one["peak_time_s"],
            name,
            one["peak_force_N"]["value"],
            one["impulse_N_s"]["value"],
            one["azimuth_rad"],
        )
        for name, bearing in document["bearings"].items()
        for one in bearing["impacts"]
        if one["after_flight"]
    ]
    on_page = [
        (one["time"], one["place"], one["numbers"][0]["value"], one["numbers"][1]["value"], one["azimuth"])
        for one in page["impacts"]
    ]
    in_python = [
        (i.peak_time, bearing.name, i.peak_force.value, i.impulse.value, i.azimuth)
        for bearing in estimate.bearings
        for i, after in zip(bearing.impacts, bearing.after_flight, strict=True)
        if after
    ]
    assert sorted(in_json) == sorted(on_page) == sorted(in_python)
    assert len(on_page) > 2


def test_every_identified_value(estimate: Estimate, page: dict[str, Any], document: dict[str, Any]) -> None:
    rows = {row[0]: row[1:] for row in page["summary"][0]["rows"]}
    compared = 0
    for field, row in published().items():
        for number, bearing in enumerate(estimate.bearings):
            if field in bearing.values and row.label in rows:
                found: Any = document["bearings"][bearing.name]
                for part in field.split("."):
                    found = found[part]
                assert rows[row.label][2 * number]["value"] == found["value"] == bearing.values[field].value
                told = "" if found["status"] == "determined" else found["status"]
                assert rows[row.label][2 * number + 1] == told
                assert bearing.values[field].status == found["status"]
                compared += 1
    assert compared >= 10


def test_every_parameter_and_sensor(
    estimate: Estimate, page: dict[str, Any], document: dict[str, Any]
) -> None:
    tables = section(page, "Parameters")["tables"]
    shown = [row for table in tables[:2] for row in table["rows"]]
    order = sorted(estimate.parameters, key=lambda one: one.scope != "machine")
    in_json = {one["path"]: one["estimate"]["value"] for one in document["parameters"]}
    assert len(shown) == len(order) == len(in_json)
    for row, one in zip(shown, order, strict=True):
        assert row[2]["value"] == one.estimate.value == in_json[one.path]
        assert "." not in row[0]
    for row, sensor in zip(tables[2]["rows"], estimate.sensors, strict=True):
        told = document["sensors"][sensor.sensor]
        assert row[1]["value"] == told["gain_error"]["value"] == sensor.gain_error.value
        assert row[2]["value"] == told["offset_m"]["value"] == sensor.offset.value
    for row, plane, told in zip(tables[3]["rows"], estimate.unbalance, document["unbalance"], strict=True):
        assert row[1]["value"] == told["amount_kg_m"]["value"] == plane.amount.value
        assert (plane.phase, row[2]) == (None, plane.reason)  # the record has no mark


def test_statistics_and_cross_check(
    estimate: Estimate, page: dict[str, Any], document: dict[str, Any]
) -> None:
    assert not section(page, "Hertz stress")[
        "tables"
    ]  # statistics without an interval stand in the document alone
    for bearing in estimate.bearings:
        told = document["bearings"][bearing.name]["stress_statistics_Pa"]
        assert told["median"] == bearing.statistics.median
    if estimate.cross_check:
        rows = section(page, "Independent cross-check")["tables"][0]["rows"]
        for row, one, check in zip(rows, document["cross_check"], estimate.cross_check, strict=True):
            assert (row[1]["value"], row[2]["value"]) == (one["estimate"], one["cross_check"])
            assert (row[1]["value"], row[2]["value"]) == (check.estimate.value, check.check)


def numbers(told: Any) -> Iterator[dict[str, Any]]:
    if isinstance(told, dict) and "kind" in told and "SI" in told:
        yield told
    elif isinstance(told, dict | list):
        for part in told.values() if isinstance(told, dict) else told:
            yield from numbers(part)


def test_every_number_of_the_page_stands_in_the_report_as_it_is_written(
    page: dict[str, Any], report: str
) -> None:
    listed = [number for part in ("cards", "summary", "sections") for number in numbers(page[part])]
    assert len(listed) > 100
    for number in listed:
        for text in number["SI"]:
            # a table has the unit of a column in its heading
            bare = text.removesuffix(f" {display_unit(number['kind'])[1]}")
            assert unbroken(text) in report or unbroken(bare) in report, number


def test_the_unit_of_a_column_stands_in_its_heading_alone_in_both_systems(page: dict[str, Any]) -> None:
    impacts = [{"columns": page["impact_columns"], "rows": [one["numbers"] for one in page["impacts"]]}]
    tables = impacts + page["summary"] + [one for part in page["sections"] for one in part["tables"]]
    above = 0
    for table in tables:
        for k, head in enumerate(table["columns"]):
            for system in ("SI", "US"):
                unit = head[system].partition("[")[2].rstrip("]")
                cells = [row[k][system] for row in table["rows"] if not isinstance(row[k], str)]
                above += bool(unit and cells)
                assert not any(unit and text.endswith(f" {unit}") for cell in cells for text in cell), head
    assert above > 20
    assert page["impact_columns"][0] == {"SI": "peak force [N]", "US": "peak force [lbf]"}


def test_verdict_and_sentences_are_those_of_the_report(page: dict[str, Any], report: str) -> None:
    assert report.index(unbroken(page["verdict"][0]["text"])) < report.index(page["cards"][0]["title"])
    for statement in page["verdict"]:
        assert unbroken(statement["text"]) in report


def test_the_other_units_are_the_same_numbers(page: dict[str, Any]) -> None:
    compared = 0
    for number in numbers(page):
        if number["value"] is None or number["kind"] not in IN_OTHER_UNITS or number["US"][0] == "–":
            continue
        factor, unit = IN_OTHER_UNITS[number["kind"]]
        text = number["US"][0].replace("\u202f", "").replace("−", "-")
        if "×" in text:
            continue
        written, _, shown = text.partition(" ")
        digits = len(written.partition(".")[2])
        assert shown in (unit, "")  # above its column
        assert float(written) == pytest.approx(number["value"] / factor, abs=0.51 * 10.0**-digits)
        compared += 1
    assert compared > 20


def test_the_curves_are_those_of_the_estimate(
    estimate: Estimate, page: dict[str, Any], written: Path
) -> None:
    traces = open_traces(written, "drop", tuple(page["traces"]["columns"]))
    np.testing.assert_array_equal(traces.time, estimate.bearings[0].force.time)
    for b, bearing in enumerate(estimate.bearings):
        rows = traces.chosen((f"force {b}", f"stress {b}", f"y measured {b}", f"y estimated {b}"))
        motions = {motion.role: motion.vertical.values for motion in bearing.motions}
        wanted = [bearing.force.values, bearing.stress.values, motions["measured"], motions["estimated"]]
        for row, values in zip(rows, wanted, strict=True):
            if len(values) == len(traces.time):
                np.testing.assert_array_equal(traces.values[row], values.astype("f4"))


def test_the_lines_of_python_give_these_curves(estimate: Estimate, tmp_path: Path) -> None:
    lines = estimate_lines(NAMES, {}, [bearing.name for bearing in estimate.bearings])
    for figure, text in lines.items():
        compile(text, figure, "exec")
        if figure == "rotor":
            continue
        *head, last = text.strip().split("\n")
        assert head[-1] == "estimate = estimate_drop(machine, record, tail)"
        told: dict[str, Any] = {"estimate": estimate}
        exec(last, told)
        if figure == "force":
            np.testing.assert_array_equal(told["force"]["DE"][1], estimate.bearing("DE").force.values)
        if figure == "impacts":
            assert told["impacts"][0][3] == estimate.bearings[0].impacts[0].peak_force.value
    assert "method=Replay()" in estimate_lines(NAMES, {"method": "replay"}, [])["force"]
    name = {"machine": {"name": "a'); import os #"}, "record": {"name": 'b"\n'}}
    assert 'load_machine("a\'); import os #")' in estimate_lines(name, {}, [])["force"]


def test_the_lines_of_python_of_a_look_run(
    files: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rotordrop import load_machine, look

    for file in files.values():
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    options = {"gap": "260 um"}
    lines = look_lines(NAMES, options, 2)
    told: dict[str, Any] = {}
    exec(lines["motion 1"], told)
    seen = look("drop_060.h5", machine=load_machine("lp400.toml"), gap=260e-6)
    np.testing.assert_array_equal(told["motion"], seen.motion.paths[1].position)
    space = Workspace(tmp_path / "space")
    space.prepare()
    job = space.new_job("drop_060", {})
    job.write({**job.read(), "files": NAMES})
    write_look(seen, job, tmp_path, options, load_machine("lp400.toml"))
    page = json.loads((tmp_path / "page.json").read_text(encoding="utf-8"))
    document = json.loads((tmp_path / "document.json").read_text(encoding="utf-8"))
    for number, plane in enumerate(document["planes"]):
        assert page["cards"][number]["figures"][0]["value"]["value"] == plane["largest_displacement_m"]
        assert page["places"][number]["gap"] == [plane["air_gap_m"]] * 2
    exec(lines["rotor"], told)
    marks = [(one["kind"], one["name"], one["position"]) for one in page["rotor"]["marks"]]
    assert [("touchdown bearing", *part) for part in told["bearings"].items()] == marks[:2]
    assert [("sensor", *part) for part in told["sensors"].items()] == marks[-4:]
    exec(lines["impacts"], told)
    found = [(one["place"], one["time"], one["azimuth"]) for one in page["impacts"]]
    assert [entry[:3] for entry in told["impacts"]] == found


def in_json(told: Any) -> Iterator[float]:
    if isinstance(told, dict | list):
        for part in told.values() if isinstance(told, dict) else told:
            yield from in_json(part)
    elif isinstance(told, int | float) and not isinstance(told, bool):
        yield float(told)


def in_python(told: Any, seen: set[int]) -> Iterator[float]:
    if id(told) in seen:
        return
    seen.add(id(told))
    if isinstance(told, int | float | np.floating):
        yield float(told)
    elif isinstance(told, dict | list | tuple):
        for part in told.values() if isinstance(told, dict) else told:
            yield from in_python(part, seen)
    elif isinstance(told, np.ndarray) and told.size < 100 and told.dtype.kind == "f":
        yield from (float(one) for one in told.ravel())
    elif dataclasses.is_dataclass(told):
        for field in dataclasses.fields(told):
            yield from in_python(getattr(told, field.name), seen)


def derived(document: dict[str, Any]) -> Iterator[float]:
    """What the page says by a difference of two numbers of the document, and the limit it compares with."""
    for bearing in document["bearings"].values():
        ended = (one for one in bearing["impacts"] if one["end_s"] is not None)
        yield from (one["end_s"] - one["start_s"] for one in ended)
    yield from (one["cross_check"] / one["estimate"] - 1.0 for one in document["cross_check"])
    yield STATIC_STRESS


def missing_chances(card: RestartCard) -> Iterator[float]:
    """What the page says of a bearing by the chances of its damages: that there is one at all."""
    for name in {one.bearing for one in card.suspicions}:
        yield 1.0 - np.prod([1.0 - one.probability for one in card.suspicions if one.bearing == name])


def test_no_number_of_the_page_is_missing_in_the_document_or_in_python(
    estimate: Estimate, page: dict[str, Any], document: dict[str, Any]
) -> None:
    written, seen = {*in_json(document), *derived(document)}, set[int]()
    known = {*in_python(estimate, seen), *derived(document)}
    card = assumed_card(estimate)  # as 'rotordrop restart' computes it from the document
    written |= {*in_json(restart_numbers(card)), *missing_chances(card)}
    known |= {*in_python(card, seen), *missing_chances(card)}
    for bearing in estimate.bearings:
        known |= {*in_python([*severity_values(estimate, bearing).values()], set())}
        known |= {
            *in_python(
                [bearing.peak_force.known, bearing.peak_stress.known, bearing.statistics.as_json()], set()
            )
        }
        known |= {one.value for one in bearing.values.values()}
    compared = 0
    for part in ("cards", "summary", "sections", "impacts"):
        for number in numbers(page[part]):
            value = number["value"]
            if value is not None:
                for where, found in (("JSON", written), ("Python", known)):
                    assert any(abs(value - one) <= 1e-12 * abs(value) for one in found), (where, number)
                compared += 1
    assert compared > 100
