"""The first screen of an estimate: what an engineer looks for, in 17 lines of 100 columns."""

import io
import re
from dataclasses import replace

from rich.console import Console
from tests.scaled_machines import TWELVE_NUMBERS
from tests.unit.report.conftest import section

from rotordrop.estimate.estimate import Verdict
from rotordrop.evidence.impacts import CONTACT_FROM
from rotordrop.known import Known
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.report.estimate_page import GUESSED_ROTOR, estimate_page, estimate_screen, width_advice
from rotordrop.report.terminal import print_summary
from rotordrop.track.consistency import Check
from rotordrop.twin.value_of_information import advice_of


def lines_of(estimate):
    stream = io.StringIO()
    print_summary(estimate_screen(estimate), Console(file=stream, width=100, highlight=False, markup=False))
    return stream.getvalue().splitlines()


def line(estimate, begin):
    return next(one for one in lines_of(estimate) if one.strip().startswith(begin))


def text_of(estimate):
    return " ".join(" ".join(lines_of(estimate)).split())


def test_the_loads_of_every_bearing_stand_in_one_line_each(estimate):
    bearing = estimate.bearing("NDE")
    low, high = bearing.peak_force.interval_90
    force = f"{bearing.peak_force.value:.0f} N ({low:.0f} to {high:.0f} N)"
    assert force in line(estimate, "peak bearing force")
    least, most = bearing.count_interval_90
    assert f"{len(bearing.touched)} ({least} to {most})" in line(estimate, "impacts")
    assert any("estimate ends before 200 ms" in row for row in estimate_screen(estimate).screen.rows)


def test_every_estimated_number_of_the_first_screen_has_its_interval(estimate):
    shown = estimate_screen(estimate)
    for name, *cells in shown.screen.rows:
        for cell, bearing in zip(cells, estimate.bearings, strict=True):
            reason = bearing.missing.get("mean_force_0p15_0p2_N")
            assert (
                cell == reason
                or name == CONTACT_FROM
                or re.fullmatch(
                    r"\S+( N| ms| MPa| µm)? \(\S+ to \S+( N| ms| MPa| µm)?\)", cell.replace("\u202f", "")
                )
            ), name
    (shares,) = (one.text for one in shown.verdict if one.text.startswith("Peak stress is "))
    for bearing in estimate.bearings:
        known = bearing.peak_stress.known
        ends = dict.fromkeys(f"{one / 42e6:.0f}" for one in (known.low, known.high))
        assert re.search(rf"{' to '.join(ends)} % \([^)]*\b{bearing.name}\b", shares)
    late = replace(estimate.bearings[0], count_interval_90=None, largest=None)
    rows = dict(row[:2] for row in estimate_screen(replace(estimate, bearings=(late, late))).screen.rows)
    assert not {"impacts", "largest displacement", "displacement / air gap"} & rows.keys()


def test_an_estimate_that_lost_its_record_shows_ranges_and_blames_no_sensor(estimate):
    failed = (
        {"name": "filter", "message": "the filter followed 9 of 99 samples"},
        {"name": "sensor errors", "judged": False, "message": "gain of A departs"},
        {"name": "parameters", "message": "departs", "path": "DE.support.stiffness"},
    )
    gap = Known(value=300e-6, status="determined", interval_90=(250e-6, 350e-6), unit="m")
    told = replace(
        estimate,
        verdict=Verdict.REPLACED,
        checks=tuple(Check(passed=False, **one) for one in failed),
        bearings=tuple(replace(b, values={**b.values, "air_gap_m": gap}) for b in estimate.bearings),
    )
    text, page = text_of(told), estimate_page(told)
    assert "displacement" not in text, "the gap of a model that does not fit is off"
    assert [row[1] for row in section(page, "Checks").tables[0].rows] == ["no", "not judged", "no"]
    sensors = next(one for one in section(page, "Parameters").tables if one.caption == "Sensors")
    assert "verdict" not in sensors.columns, "every gain is determined"
    assert "90 % ranges" in text
    guessed = replace(told, machine=simple_machine(SimpleMachine(**TWELVE_NUMBERS)))
    text = text_of(guessed)
    assert GUESSED_ROTOR in text and "90 % ranges" not in text
    assert estimate_screen(guessed).verdict[0].level == "bad"


def test_a_wide_force_says_why_and_what_would_narrow_it_once_for_both_ends(estimate):
    def as_wide(bearing):
        value = bearing.peak_force.known.value
        known = replace(bearing.peak_force.known, interval_90=(0.84 * value, 1.16 * value))
        return replace(bearing, peak_force=replace(bearing.peak_force, known=known))

    halves = {one.name: 0.16 * one.peak_force.known.value for one in estimate.bearings}
    narrowed = {name: half / 8.0 for name, half in halves.items()}
    found = advice_of("a tap test", ["support.mass"], halves, narrowed)
    wide = replace(estimate, bearings=tuple(map(as_wide, estimate.bearings)), advice=(found,))
    (said,) = width_advice(wide)
    assert "Force (NDE, DE) ± 16 %" in said and "± 2 % with a tap test" in said
    assert said in text_of(wide)
    (said,) = width_advice(replace(wide, advice=(advice_of("a tap test", [], halves, halves),)))
    assert "Force (NDE, DE) ± 16 %; no one measurement" in said
