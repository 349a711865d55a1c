"""The first screen of an estimate: what an engineer looks for, in 25 lines of 100 columns."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from rotordrop.estimate.estimate import Estimate, Verdict
from rotordrop.estimate.later_motion import LaterMotion
from rotordrop.evidence.quality import NO_CHECK_SEES
from rotordrop.known import Known
from rotordrop.report import estimate_screen as screen
from rotordrop.report.estimate_page import estimate_page
from rotordrop.report.estimate_screen import estimate_screen
from rotordrop.report.terminal import print_summary
from rotordrop.track.consistency import THIS, Check


def lines_of(estimate: Estimate) -> list[str]:
    stream = io.StringIO()
    print_summary(estimate_screen(estimate), Console(file=stream, width=100, highlight=False, markup=False))
    return stream.getvalue().splitlines()


def line(estimate: Estimate, begin: str) -> str:
    return next(one for one in lines_of(estimate) if one.strip().startswith(begin))


def test_the_loads_of_every_bearing_stand_in_one_line_each(estimate: Estimate) -> None:
    bearing = estimate.bearing("NDE")
    low, high = bearing.peak_force.interval_90 or (0.0, 0.0)
    assert f"{bearing.peak_force.value:.0f} N ({low:.0f} to {high:.0f} N)" in line(
        estimate, "peak bearing force"
    )
    counted = bearing.count_interval_90
    assert counted is not None
    assert f"{len(bearing.touched)} ({counted[0]} to {counted[1]})" in line(estimate, "impacts")
    assert "the estimated part ends before 200 ms" in " ".join(" ".join(lines_of(estimate)).split())


def test_every_estimated_number_of_the_first_screen_has_its_interval(estimate: Estimate) -> None:
    shown = estimate_screen(estimate)
    assert shown.screen is not None
    for name, *cells in shown.screen.rows:
        for cell, bearing in zip(cells, estimate.bearings, strict=True):
            reason = bearing.missing.get("mean_force_0p15_0p2_N")
            assert cell == reason or re.fullmatch(
                r"\S+( N| ms| MPa| µm)? \(\S+ to \S+( N| ms| MPa| µm)?\)", cell.replace("\u202f", "")
            ), name
    (assumed,) = (one.text for one in shown.verdict if one.text.startswith("assumed: "))
    peaks = [bearing.peak_stress.known for bearing in estimate.bearings]
    shares = ", ".join(f"{one.low / 42e6:.0f} to {one.high / 42e6:.0f}" for one in peaks)
    assert f"peak stress {shares} % of" in assumed
    late = replace(estimate.bearings[0], count_interval_90=None, largest=None)
    rows = dict(row[:2] for row in estimate_screen(replace(estimate, bearings=(late, late))).screen.rows)
    assert not {"impacts", "largest displacement", "over the air gap"} & rows.keys()


def test_every_cell_of_the_first_screen_is_found_once(estimate: Estimate, monkeypatch) -> None:
    """The farthest distance of an estimate that is not certain was looked for twice."""
    asked: list[str] = []
    monkeypatch.setattr(screen, "_over_gap", lambda b, *, certain: asked.append(b.name) or "1 to 2")
    screen.estimate_screen(estimate)
    assert sorted(asked) == sorted(b.name for b in estimate.bearings)


def test_what_every_record_leaves_to_assumption_stands_in_one_statement(estimate: Estimate) -> None:
    text = " ".join(" ".join(lines_of(estimate)).split())
    assert "assumed: gains within ±1.6 %, sensors faster than" in text
    (unseen,) = (note for note in estimate.notes if note.startswith(NO_CHECK_SEES))
    assert unseen in text
    (quality,) = (one for one in estimate_page(estimate).sections if one.heading == "Data quality")
    assert unseen in [one.text for one in quality.statements]
    assert "no unbalance phase" in text and "of C0 (ISO 76)" in text
    assert "lets the estimate find it" not in text  # the note that says more
    assert any("lets the estimate find it" in note for note in estimate.notes)


def test_a_larger_motion_later_on_comes_before_other_limits(estimate: Estimate) -> None:
    later = LaterMotion(bearing="NDE", first=3e-4, first_time=0.01, later=4e-4, later_time=1.7, resolved=1e-6)
    warned = replace(estimate, later=(later,), warnings=("one", "two", "three", later.sentence()), notes=())
    said = [one for one in lines_of(warned) if one.startswith("warning: ")]
    assert said[0].startswith("warning: NDE: the rotor went 100.0 µm further out at 1.7")
    assert len(said) == 3
    assert "1 more with --all" in " ".join(lines_of(warned))


@pytest.mark.parametrize("failed", ["innovation size", "sensor errors"])
def test_a_flagged_estimate_shows_ranges_and_what_to_do(estimate: Estimate, failed: str) -> None:
    check = Check(name=failed, passed=False, message=f"{40 * 'far off '}", remedy="calibrate on two drops")
    flagged = replace(
        estimate,
        verdict=Verdict.WIDENED,
        checks=(check,),
        warnings=tuple(f"{k} {40 * 'long '}" for k in range(5)),
        notes=(),
        simulated_record=True,
    )
    shown = lines_of(flagged)
    assert len(shown) <= 25
    text = " ".join(" ".join(shown).split())
    assert "problem: The model is not consistent" in text
    assert "to do next: calibrate on two drops" in text.lower()
    low, high = estimate.bearing("DE").peak_force.interval_90 or (0.0, 0.0)
    assert f"{low:.0f} to {high:.0f} N" in line(flagged, "peak bearing force")


def test_an_estimate_that_lost_its_record_says_that_first_and_blames_no_sensor(estimate: Estimate) -> None:
    """What failed by name, in the verdict and in what to do; what was not judged in neither."""
    lost = Check(name="filter", passed=False, message="the filter followed 9 of 99 samples", remedy="plan so")
    gain = Check(
        name="sensor errors", passed=False, judged=False, message="gain of A departs", remedy="check sensor A"
    )
    stiff = Check(
        name="parameters",
        passed=False,
        message="departs",
        path="DE.support.stiffness",
        remedy=f"measure {THIS}, or widen its range",
    )
    gap = Known(value=300e-6, status="determined", interval_90=(250e-6, 350e-6), unit="m")
    told = replace(
        estimate,
        verdict=Verdict.REPLACED,
        checks=(lost, gain, stiff),
        bearings=tuple(replace(b, values={**b.values, "air_gap_m": gap}) for b in estimate.bearings),
    )
    text = " ".join(" ".join(lines_of(told)).split())
    assert "as ranges. The filter followed 9 of 99 samples; DE: support stiffness departs." in text
    assert "o do next: plan so; measure DE: support stiffness, or widen its range" in text
    assert "gain of A" not in text and "check sensor" not in text
    farthest = float(np.nanmax(told.bearings[0].motions[-1].radial.values))
    assert f"{farthest / 350e-6:.2f} to {farthest / 250e-6:.2f}" in line(told, "over the air gap")
    assert f"{1e6 * farthest:.1f} µm" not in text
    (section,) = (one for one in estimate_page(told).sections if one.heading == "Consistency")
    assert [row[1] for row in section.tables[0].rows] == ["no", "not judged", "no"]
    (found,) = (one for one in estimate_page(told).sections if one.heading == "Parameters")
    sensors = next(one for one in found.tables if one.caption == "Sensors")
    assert "verdict" not in sensors.columns, "every gain is determined"
