"""The report on a study: verdict first, what matters, how it is spread, few numbers beside the verdict."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.unit.web.browser import CHROMIUM
from tests.unit.web.conftest import browser as browser

from rotordrop.machine import example_machine
from rotordrop.report.page import write_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.study_page import SHARES, study_page
from rotordrop.study.plan import read_study
from rotordrop.study.quantities import columns_of
from rotordrop.study.summary import StudyResults, quantile

DROPS = 200
FRICTION = "*.friction.dynamic"


@pytest.fixture(scope="module")
def results():
    """Drops whose peak force follows the friction alone."""
    machine = example_machine("lp400")
    plan = {
        "name": "friction",
        "speed": "60 Hz",
        "drops": DROPS,
        "duration": "10 ms",
        "vary": {FRICTION: {"uniform": [0.05, 0.2]}, "speed": {"uniform": ["60 Hz", "200 Hz"]}},
    }
    random = np.random.default_rng(3)
    varied = {FRICTION: random.uniform(0.05, 0.2, DROPS), "speed": random.uniform(377.0, 1257.0, DROPS)}
    numbers = {q.name: np.full(DROPS, np.nan) for q in columns_of(machine)}
    for bearing in machine.touchdown_bearings:
        numbers[f"{bearing.name}.backward_whirl"] = np.zeros(DROPS)
        for quantity, size in (("peak_force", 1e4), ("peak_stress", 1e10)):
            noise = 0.001 * random.standard_normal(DROPS)
            numbers[f"{bearing.name}.{quantity}"] = size * (varied[FRICTION] + noise)
    study = read_study(plan, machine)
    return StudyResults(
        study=study, drop=np.arange(DROPS), varied=varied, numbers=numbers, reasons=("",) * DROPS
    )


@pytest.fixture(scope="module")
def page(results):
    return study_page(results)


def test_what_matters_stands_first_in_words_and_in_one_table(page):
    (found,) = page.sections[0].tables
    assert found.rows[0][0] == "dynamic friction coefficient, every bearing"
    assert found.columns[1:3] == ("NDE peak force", "NDE peak stress")
    shares = [int(str(row[1]).partition(" ")[0]) for row in found.rows[:2]]
    assert shares[0] > 80 > shares[1]
    cells = [str(cell) for row in found.rows for cell in row[1:]]
    assert any("(0 to" in cell for cell in cells)  # a share of the variance is never below none
    assert not any("-" in cell for cell in cells)


def test_the_curve_of_the_drops_below_passes_the_quantiles(page, results):
    chart = page.sections[1].figures[0].chart
    below = next(one for one in chart.data if one.yaxis == "y")
    values = results.numbers["NDE.peak_force"]
    for share in SHARES[:2]:
        at = np.interp(quantile(values, share).value, below.x, below.y)
        assert at == pytest.approx(100.0 * share, abs=1.0)
    lines = [shape.x0 for shape in chart.layout.shapes if shape.xref == "x"]
    assert_allclose(lines, [quantile(values, share).value for share in SHARES])


def test_whirl_that_never_was_has_no_figure(results):
    share = np.where(np.arange(DROPS) == 7, 0.4, 0.0)
    whirled = replace(results, numbers={**results.numbers, "NDE.backward_whirl": share})
    never, once = (study_page(one, ["speed"]) for one in (results, whirled))
    count = [len(one.sections[2].figures) for one in (never, once)]
    assert count == [3, 4]  # no figure of what happened in no drop
    assert any(one.text.startswith("NDE: 0.5 %") and one.level == "warning" for one in once.verdict)


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_labels_of_the_percentiles_do_not_collide(results, browser, tmp_path):
    """Half of the drops are alike, so that all but one percentile lie at one value."""
    force = np.where(np.arange(DROPS) < 0.6 * DROPS, 2000.0, 2400.0) + np.linspace(0.0, 0.1, DROPS)
    close = replace(results, numbers={**results.numbers, "NDE.peak_force": force})
    write_page(study_page(close), tmp_path / "study.html")
    browser.open(f"file://{tmp_path / 'study.html'}")
    browser.until("Number(document.documentElement.getAttribute('data-drawn')) >= 2")
    boxes = browser.evaluate(
        "[...document.querySelector('.chart').querySelectorAll('.annotation-text')]"
        ".filter(one => one.textContent.endsWith('%')).map(one => one.getBoundingClientRect())"
        ".map(one => [one.left, one.top, one.right, one.bottom])"
    )
    assert len(boxes) == 6
    for one, other in combinations(boxes, 2):
        assert one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
    assert browser.messages() == []


def test_at_most_five_lines_stand_beside_the_verdict_each_with_its_interval(page):
    (summary,) = page.summary
    assert len(summary.rows) <= 5
    cells = [cell for row in summary.rows for cell in row if isinstance(cell, Quantity)]
    assert len(cells) == len(summary.rows) * len(SHARES)
    assert all(cell.interval_90 is not None for cell in cells)
    assert not any(math.isnan(cell.value) for cell in cells)


def test_against_a_value_every_drop_is_a_point(results):
    """Quantiles alone hid that a cell holds four drops."""
    drawn = study_page(results, [FRICTION]).sections[2].figures[0].chart.data
    points = [one for one in drawn if one.name == "a drop"]
    assert [len(one.x) for one in points] == [DROPS, DROPS]
    assert points[0].y == pytest.approx(results.column("NDE.peak_force"))
