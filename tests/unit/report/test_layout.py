"""How a page looks in a browser: nothing overflows, it is dark where that is asked for, two columns fit."""

import base64
import re
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.web.browser import CHROMIUM, Browser

from rotordrop.estimate.bearing_drop import History
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement, Table
from rotordrop.report.estimate_page import estimate_page
from rotordrop.report.page import write_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import Panel, time_panels
from rotordrop.sketch import HEIGHT

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")]

LABELS = (("Peak bearing force, range", "force"), ("Peak Hertz stress, range", "pressure"))


def ranged(kind):
    low, high = (2049.0, 14709.0) if kind == "force" else (1552e6, 12017e6)
    return Quantity(value=high, kind=kind, interval_90=(low, high), range_only=True)


def content():
    """A failed estimate: ranges in place of numbers."""
    time = np.linspace(0.0, 0.2, 500)
    history = History(label="estimated", time=time, values=1000.0 * np.sin(90.0 * time) ** 2)
    also = [replace(history, label=f"a history of the other kind, number {at}") for at in range(4)]
    panel = Panel(title="NDE", axis="bearing force", histories=(history, *also))
    figures = tuple(KeyFigure(label, ranged(kind), "by the cross-check") for label, kind in 2 * LABELS)
    return ReportContent(
        title="Drop",
        verdict=(Statement("The model does not follow the record.", "bad"), Statement("a note")),
        cards=tuple(Card(f"{name} touchdown bearing", figures) for name in ("NDE", "DE")),
        sections=(Section("Bearing force", figures=(Figure(time_panels([[panel]], 1.0, "N"), "force"),)),),
        lead=1,
    )


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    write_page(content(), folder / "page.html")
    driven = Browser(folder / "profile")
    driven.open(f"file://{folder / 'page.html'}")
    driven.until("document.documentElement.getAttribute('data-drawn') === '1'")
    yield driven
    driven.close()


def edges(browser, selector):
    """Left, top, right and bottom edge of the first element."""
    box = f"document.querySelector('{selector}').getBoundingClientRect()"
    left, top, right, bottom = browser.evaluate(f"[{box}.left, {box}.top, {box}.right, {box}.bottom]")
    return left, top, right, bottom


@pytest.mark.parametrize("width", [360, 800, 1280, 1920])
def test_no_number_leaves_its_card(browser, width):
    browser.size(width, 900)
    beyond = browser.evaluate(
        "Array.from(document.querySelectorAll('.card dl > div')).filter(one => "
        "Array.from(one.querySelectorAll('.value')).some(value => "
        "value.getBoundingClientRect().right > one.getBoundingClientRect().right + 0.5)).length"
    )
    assert beyond == 0
    browser.until("document.documentElement.scrollWidth <= window.innerWidth", 20.0)


def test_the_curve_stands_under_the_cards_and_before_the_notes(browser):
    browser.size(1280, 900)
    assert edges(browser, ".cards")[3] < edges(browser, ".chart")[1]
    assert edges(browser, ".chart")[3] < edges(browser, "#notes")[1]
    browser.size(1920, 900)
    assert edges(browser, ".cards")[3] < edges(browser, ".chart")[1]


def test_a_page_is_dark_where_that_is_asked_for_its_figures_too(browser):
    browser.size(1280, 900)
    paper = "getComputedStyle(document.body).backgroundColor"
    drawn = "document.querySelector('.chart')._fullLayout.paper_bgcolor"
    for scheme, page, figure in (
        ("dark", "rgb(22, 28, 34)", "#161c22"),
        ("light", "rgb(255, 255, 255)", "#ffffff"),
    ):
        browser.colours(scheme)
        browser.until(f"{drawn} === '{figure}'")
        assert browser.evaluate(paper) == page


@pytest.mark.parametrize("width", [400, 1100, 1280, 1920])
def test_the_tools_of_a_figure_cover_neither_its_legend_nor_the_heading(browser, width):
    """The legend is as wide as the figure, as that of an orbit is."""
    browser.size(width, 900)
    chart = "document.querySelector('.chart').getBoundingClientRect()"
    browser.until(f"document.querySelector('.legend').getBoundingClientRect().right < {chart}.right")
    left, top, right, bottom = edges(browser, ".modebar")
    assert 0.0 <= left < right <= max(width, 640)  # a figure keeps the width that its words need
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    for selector in (".legend", "#section-1 h2"):
        beside = edges(browser, selector)
        assert beside[2] <= left or right <= beside[0] or beside[3] <= top or bottom <= beside[1], selector


def sheets(browser):
    """How many sheets a print has."""
    printed = browser.call("Page.printToPDF", preferCSSPageSize=True)["data"]
    return len(re.findall(rb"/Type /Page\b", base64.b64decode(printed)))


PAPER = (695, 1005)
"""Width and height of A4 inside the margins of a report [px of 1/96 inch]."""


def test_the_first_printed_page_is_the_one_to_send_and_the_rest_an_appendix(browser, tmp_path, estimate):
    """Verdict, four numbers, force, orbit and what next; on screens all else is folded."""
    write_page(estimate_page(estimate), tmp_path / "page.html")
    browser.size(1280, 900)
    browser.open(f"file://{tmp_path / 'page.html'}")
    browser.until("document.documentElement.getAttribute('data-drawn') === '2'")
    heads = "[...document.querySelectorAll('.front h2')].map(one => one.innerText).join()"
    assert browser.evaluate(heads) == "Bearing force,Orbit,What next"
    assert browser.evaluate("document.querySelectorAll('.front .card dl > div').length") == 4
    told = browser.evaluate("document.querySelector('.appendix').innerText")
    assert "Printed: Impacts, Severity, what is open." in told
    assert edges(browser, ".chart")[3] < edges(browser, "#to-do")[1]
    last = "[...document.querySelectorAll('.part:not(.printed)')].find(one => one.querySelector('.chart'))"
    assert browser.evaluate(f"{last}.open") is False
    browser.evaluate(f"document.querySelector(`.contents a[href='#${{{last}.id}}']`).click()")
    browser.until(f"{last}.open && {last}.querySelector('.chart svg')")
    browser.size(*PAPER)
    browser.call("Emulation.setEmulatedMedia", media="print")
    browser.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    browser.until("[...document.querySelectorAll('[open] .chart')].every(one => one.querySelector('svg'))")
    # two parts of seven are printed without being asked for, beside the one that is open
    shown = "[...document.querySelectorAll('.part')].filter(one => one.checkVisibility()).length"
    assert browser.evaluate(shown) == 3
    # a wider page is made smaller, words and all
    assert browser.evaluate("document.documentElement.scrollWidth") <= PAPER[0]
    assert edges(browser, ".front")[3] <= PAPER[1]
    left, _, right, _ = edges(browser, ".front .wide .chart")
    assert (
        right - left > 0.95 * PAPER[0]
    )  # it was half as wide, and the titles of its panels lay on their axes
    browser.evaluate("window.dispatchEvent(new Event('afterprint'))")
    browser.call("Emulation.setEmulatedMedia", media="")
    assert browser.evaluate("document.querySelectorAll('.part[open]').length") == 1
    longer = sheets(browser)
    browser.evaluate(f"{last}.open = false")
    assert (sheets(browser), longer) == (3, 4)


def test_a_full_sheet_is_not_followed_by_one_of_a_single_sentence(browser, tmp_path):
    write_page(ReportContent(title="Drop"), tmp_path / "page.html")
    browser.open(f"file://{tmp_path / 'page.html'}")
    browser.evaluate("document.querySelector('#made').remove()")
    browser.evaluate("document.querySelector('header').style.height = '985px'")
    assert sheets(browser) == 1
    browser.evaluate("document.querySelector('header').style.height = '1025px'")
    assert sheets(browser) == 2


def test_without_scripts_there_is_room_for_the_small_picture_alone(browser, tmp_path):
    write_page(content(), tmp_path / "page.html")
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    browser.open(f"file://{tmp_path / 'page.html'}")
    drawn = edges(browser, "figure")
    browser.call("Emulation.setScriptExecutionDisabled", value=False)
    assert HEIGHT < drawn[3] - drawn[1] < 2 * HEIGHT


def test_a_table_of_many_numbers_fits_a_narrow_screen(browser, tmp_path):
    kinds = ("force", "pressure", "length", "impulse", "speed", "time", "energy")
    number = {"force": 3333.0, "pressure": 2009e6, "length": 312e-6, "speed": 377.0}
    values = [
        Quantity(value=at, kind=kind, interval_90=(0.93 * at, 1.07 * at))
        for kind in kinds
        for at in (number.get(kind, 0.51),)
    ]
    wide = Table(("drop", *kinds), (("drop_1.h5", *values),), "DE")
    write_page(ReportContent(title="Comparison", summary=(wide,)), tmp_path / "page.html")
    browser.call("Emulation.setEmulatedMedia", media="screen")
    browser.size(820, 900)
    browser.open(f"file://{tmp_path / 'page.html'}")
    box = "document.querySelector('.table')"
    browser.until(f"{box} && {box}.scrollWidth <= {box}.clientWidth", 20.0)
    assert edges(browser, ".table")[2] <= 820
