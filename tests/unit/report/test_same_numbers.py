"""One drop, one number: report, JSON and Python say the same of every quantity."""

import dataclasses
import html
import re
from functools import reduce
from itertools import product
from operator import getitem

import numpy as np
import pytest
from tests.unit.report.conftest import section

from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.elements.table import published, rows
from rotordrop.report.content import Section, Table
from rotordrop.report.estimate_page import spoken
from rotordrop.report.page import render_page
from rotordrop.report.quantity import IN_OTHER_UNITS, Quantity, display_unit, unbroken
from rotordrop.severity.numbers import LOADS


@pytest.fixture(scope="module")
def report(page):
    return html.unescape(re.sub(r"<script.*?</script>", "", render_page(page), flags=re.DOTALL))


def test_loads_of_every_bearing(estimate, page, document):
    """Value, time and interval of a load stand in four places and have one source."""
    compared = 0
    marks = section(page, "Bearing force").figures[0].chart.layout.annotations
    for k, (card, bearing) in enumerate(zip(page.cards, estimate.bearings, strict=True)):
        peaks = {"peak_force_N": bearing.peak_force, "peak_stress_Pa": bearing.peak_stress}
        in_python = {**bearing.values, **{field: peak.known for field, peak in peaks.items()}}
        means = {row[0]: row[1 + k] for row in section(page, "Severity").tables[-1].rows}
        for load in (one for one in LOADS if one.field in in_python):
            shown = next((f for f in card.figures if f.label.lower() == load.label.lower()), None)
            value = means[load.label] if shown is None else shown.value
            entry, known = document["bearings"][bearing.name][load.field], in_python[load.field]
            assert value.value == entry["value"] == known.value
            assert value.interval_90 == tuple(entry["interval_90"]) == known.interval_90
            if peak := peaks.get(load.field):
                early, late = peak.time_interval_90
                assert (entry["time_s"], entry["time_interval_90_s"]) == (peak.time, [early, late])
                assert early < peak.time < late
                assert re.fullmatch(r"at \d+\.\d+ ms \(\d+\.\d+ to \d+\.\d+ ms\)", shown.note)
            compared += 1
        mark = next(one for one in marks if one.xref == f"x{2 * k + 2}")
        assert (mark.x, mark.y) == pytest.approx((1e3 * bearing.peak_force.time, bearing.peak_force.value))
    assert compared >= 6


def same(told, known):
    """Whether the document says what Python does."""
    interval = told.get("interval_90")
    return (told["value"], told.get("standard_error"), told.get("status", known.status)) == (
        known.value,
        known.standard_error,
        known.status,
    ) and (None if interval is None else tuple(interval)) == known.interval_90


def test_every_identified_value(estimate, page, document):
    listed = section(page, "Parameters").tables[0].rows
    by_label = {row[0]: row for row in listed}
    assert by_label["static friction coefficient"][-1] == "the record does not determine it"
    compared = 0
    for (field, row), (b, bearing) in product(published().items(), enumerate(estimate.bearings)):
        lines = [line for line in listed if line[0] == row.label and line[2 + b]]
        if field in bearing.values and lines:
            found = reduce(getitem, field.split("."), document["bearings"][bearing.name])
            assert lines[0][2 + b].value == found["value"] and same(found, bearing.values[field])
            said = lines[0][-1]
            own = dict(one.split(": ") for one in said.split("; ") if ": " in one) or {bearing.name: said}
            assert own.get(bearing.name, "") == found["status"].replace(
                "determined", "", found["status"] == "determined"
            )
            compared += 1
    assert compared >= 30


def test_every_parameter_and_sensor(estimate, page, document):
    tables = section(page, "Parameters").tables
    names = [bearing.name for bearing in estimate.bearings]
    shown = {
        (name, row[0]): (row[1], row[2 + k])
        for row in tables[0].rows
        for k, name in enumerate(names)
        if row[2 + k]
    }
    shown |= {("", row[0]): row[1:3] for row in tables[1].rows}
    assert not any("." in name or "unbalance 0" in name for _, name in shown), "a path, or a count from zero"
    assert shown["NDE", "support stiffness"][0].levelled == "90 %: 50 to 200 N/µm"
    in_json = {one["path"]: one for one in document["parameters"]}
    for name, row in product(names, rows("bearing")):
        assert row.path_of(name) in in_json or row.field in estimate.bearing(name).values, row.path
    assert len(estimate.parameters) == len(in_json)
    for one in estimate.parameters:
        if one.row.owner == "unbalance":  # its amount stands in a table of its own
            continue
        machine = one.scope == "machine"
        before, found = shown[(one.owner, one.row.label) if machine else ("", spoken(one))]
        assert (before.value, found.value) == (one.prior.value, one.estimate.value)
        assert same(in_json[one.path]["estimate"], one.estimate) and same(
            in_json[one.path]["prior"], one.prior
        )
        assert found.interval_90 == one.estimate.interval_90
        if machine and one.owner:  # the rotor is at no bearing
            assert estimate.bearing(one.owner).values[one.row.field] == one.estimate
    assert [row[0] for row in tables[2].rows] == [sensor.name for sensor in estimate.machine.sensors]
    assert tables[2].rows[0][3].value == pytest.approx(0.46e-6, rel=0.15)  # the noise of the first
    for row, sensor in zip(tables[2].rows, estimate.sensors, strict=True):
        told = document["sensors"][sensor.sensor]
        assert (row[1].value, row[2].value) == (sensor.gain_error.value, sensor.offset.value)
        assert same(told["gain_error"], sensor.gain_error) and same(told["offset_m"], sensor.offset)
        assert told["noise_m"] == sensor.noise
    for row, plane, told in zip(tables[3].rows, estimate.unbalance, document["unbalance"], strict=True):
        assert row[1].value == told["amount_kg_m"]["value"] == plane.amount.value
        assert (plane.phase, row[2]) == (None, plane.reason)  # the record has no mark


def test_statistics_and_cross_check(estimate, page, document):
    # statistics without an interval stand in the document alone
    assert "quartile" not in str(section(page, "Severity").tables)
    for bearing in estimate.bearings:
        told = document["bearings"][bearing.name]["stress_statistics_Pa"]
        assert told["median"] == bearing.statistics.median
    listed = section(page, "Checks").tables[-1].rows if estimate.cross_check else ()
    for row, one, check in zip(listed, document["cross_check"], estimate.cross_check, strict=True):
        assert row[1].value == one["estimate"] == check.estimate.value
        assert row[2].value == one["cross_check"] == check.check


def parts(told, kind):
    """Everything of a kind in a content."""
    if isinstance(told, kind):
        yield told
    elif isinstance(told, tuple):
        for part in told:
            yield from parts(part, kind)
    elif isinstance(told, Section | Table) or dataclasses.is_dataclass(told):
        for field in dataclasses.fields(told):
            yield from parts(getattr(told, field.name), kind)


def numbers(page):
    return [*parts((page.cards, page.summary, page.sections), Quantity)]


def test_every_number_stands_in_the_report_as_it_is_written(page, report):
    assert len(numbers(page)) > 100
    for number in numbers(page):
        for text in (number.levelled, number.interval_text):
            # a table has the unit of a column in its heading
            bare = text.removesuffix(f" {display_unit(number.kind)[1]}")
            assert unbroken(text) in report or unbroken(bare) in report, number


@pytest.mark.parametrize("system", ["SI", "US"])
def test_the_unit_of_a_column_stands_in_its_heading_alone(page, system):
    def told(cell):
        return dataclasses.replace(cell, system=system) if isinstance(cell, Quantity) else cell

    above = 0
    for table in parts((page.summary, page.sections), Table):
        in_units = tuple(tuple(told(cell) for cell in row) for row in table.rows)
        shown = Table(table.columns, in_units).with_units_above()
        for k, head in enumerate(shown.columns):
            unit = head.partition("[")[2].rstrip("]")
            cells = [row[k] for row in shown.rows if isinstance(row[k], Quantity)]
            above += bool(unit and cells)
            texts = [text for cell in cells for text in (cell.levelled, cell.interval_text)]
            assert not any(unit and text.endswith(f" {unit}") for text in texts), head
    assert above > 8


def test_the_other_units_are_the_same_numbers(page):
    compared = 0
    for number in numbers(page):
        text = dataclasses.replace(number, system="US").levelled.replace("\u202f", "").replace("−", "-")
        if number.range_only or number.kind not in IN_OTHER_UNITS or text == "–" or "×" in text:
            continue
        factor, unit = IN_OTHER_UNITS[number.kind]
        written, _, shown = text.partition(" ")
        digits = len(written.partition(".")[2])
        assert shown in (unit, "")  # above its column
        assert float(written) == pytest.approx(number.value / factor, abs=0.51 * 10.0**-digits)
        compared += 1
    assert compared > 20


def in_python(told, seen):
    """Every number in an object, whatever it is made of."""
    if id(told) in seen:
        return
    seen.add(id(told))
    if isinstance(told, int | float | np.floating):
        if not isinstance(told, bool):
            yield float(told)
    elif isinstance(told, dict | list | tuple):
        for part in told.values() if isinstance(told, dict) else told:
            yield from in_python(part, seen)
    elif isinstance(told, np.ndarray) and told.size < 100 and told.dtype.kind == "f":
        yield from (float(one) for one in told.ravel())
    elif dataclasses.is_dataclass(told):
        for field in dataclasses.fields(told):
            yield from in_python(getattr(told, field.name), seen)


def derived(document):
    """What the page says by a difference of two numbers of the document, and the limit it compares with."""
    for bearing in document["bearings"].values():
        ended = (one for one in bearing["impacts"] if one["end_s"] is not None)
        yield from (one["end_s"] - one["start_s"] for one in ended)
    yield from (one["cross_check"] / one["estimate"] - 1.0 for one in document["cross_check"])
    yield STATIC_STRESS


def test_no_number_of_the_report_is_missing_in_the_document_or_in_python(estimate, page, document):
    written = {*in_python(document, set()), *derived(document)}
    known = {*in_python(estimate, set()), *derived(document)}
    for bearing in estimate.rated:
        more = (bearing.peak_force.known, bearing.peak_stress.known, bearing.statistics.as_json())
        known |= {*in_python([*bearing.values.values(), *more], set())}
        known |= {one.value for one in bearing.values.values()}
    compared = 0
    for number in numbers(page):
        if np.isfinite(number.value) and not number.range_only:
            for where, found in (("JSON", written), ("Python", known)):
                near = (abs(number.value - one) <= 1e-12 * abs(number.value) for one in found)
                assert any(near), (where, number)
            compared += 1
    assert compared > 100
