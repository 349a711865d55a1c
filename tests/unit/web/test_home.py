"""The list of drops and the log in a headless Chromium: found, sorted, named, logged, compared, addressed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.unit.web.browser import CHROMIUM, Browser
from tests.unit.web.made_drops import estimated
from tests.unit.web.serving import Served
from tests.unit.web.steps import open_drop, press, quiet, serving, words

from rotordrop.ledger.book import allow

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
NAMES = "[...document.querySelectorAll('.dropname')].map(one => one.innerText).join()"
MENU = "document.querySelector('button[aria-label=\"More of {}\"]').click()"
OPEN = "[...document.querySelectorAll('[role=menu]:not([hidden]) button')]"


def chosen_of(browser: Browser, name: str, item: str) -> None:
    browser.evaluate(MENU.format(name))
    browser.evaluate(f"{OPEN}.find(one => one.innerText === {item!r}).click()")


@pytest.fixture
def three(tmp_path: Path) -> Iterator[Served]:
    with serving(tmp_path / "served") as server:
        estimated(server, "middle", "a" * 64, 3000.0, recorded="2022-01-01T00:00:00")
        estimated(server, "small", "b" * 64, 1000.0, recorded="2023-01-01T00:00:00")
        estimated(server, "large", "c" * 64, 9000.0, recorded="2021-01-01T00:00:00")
        yield server


def test_drops_are_sorted_and_filtered_and_the_address_keeps_it(browser, three):
    browser.open(three.address)
    browser.until(f"{NAMES} === 'large,small,middle'")  # the newest on the page first
    press(browser, "sort-force")
    assert browser.evaluate(NAMES) == "large,middle,small"
    press(browser, "sort-force")
    assert browser.evaluate(NAMES) == "small,middle,large"
    assert browser.evaluate("document.querySelector('[aria-sort]').ariaSort") == "ascending"
    press(browser, "sort-date")
    assert browser.evaluate(NAMES) == "small,middle,large"
    browser.evaluate("query.value = 'll'; query.dispatchEvent(new Event('input'))")
    assert browser.evaluate(NAMES) == "small"
    browser.until("location.hash.includes('q=ll') && location.hash.includes('sort=-date')")
    browser.call("Page.reload")
    browser.until(f"{NAMES} === 'small'")
    quiet(browser)


def test_a_drop_is_named_tagged_put_away_and_removed(browser, three):
    browser.open(three.address)
    browser.until(NAMES)
    chosen_of(browser, "middle", "Name and note …")
    browser.evaluate(
        "aboutname.value = 'March trip'; abouttags.value = 'cold, unit 7'; aboutnote.value = 'why?'"
    )
    browser.evaluate("document.querySelector('#about .main').click()")
    browser.until(f"{NAMES} === 'large,small,March trip'")
    browser.evaluate("[...document.querySelectorAll('.tag')].find(one => one.innerText === 'unit 7').click()")
    assert browser.evaluate(NAMES) == "March trip"
    assert "why?" in words(browser, "#droprows")
    chosen_of(browser, "March trip", "Archive")
    browser.until(f"{NAMES} === ''")
    browser.evaluate("which.value = 'archived'; which.dispatchEvent(new Event('change'))")
    assert browser.evaluate(NAMES) == "March trip"
    chosen_of(browser, "March trip", "Remove …")
    browser.evaluate("document.querySelector('#sure [value=remove]').click()")
    browser.until(f"{NAMES} === 'large,small'")
    quiet(browser)


def test_one_click_logs_a_drop_which_the_log_draws_with_what_is_allowed(browser, three):
    (three.space.path / "drops.db").touch()  # made, as by a data base, and not begun
    browser.open(three.address)
    for name in ("small", "large"):
        browser.until(f"document.querySelector('[aria-label=\"Add {name} to the log\"]')")
        browser.evaluate(f"document.querySelector('[aria-label=\"Add {name} to the log\"]').click()")
        browser.until(f"document.getElementById('status').innerText.includes('{name} was logged as drop')")
    allow(three.space.path / "drops.db", "LP-400", "1", drops=5, source="the maker")
    browser.evaluate("tolog.click()")
    browser.until("document.querySelector('#log canvas')")
    assert "2 of 5 drops (40 %), allowed by the maker" in words(browser, "#log .statements")
    drawn = browser.evaluate("document.querySelector('#log canvas').ariaLabel")
    assert "drop 2 DE 9\u202f000 N" in drawn and "drop 1 DE 1\u202f000 N" in drawn
    assert drawn.index("drop 2") < drawn.index("drop 1")  # in the order they happened
    browser.evaluate(
        "f = document.querySelector('#log input'); f.value = '5000'; f.dispatchEvent(new Event('change'))"
    )
    browser.until("location.hash.includes('force=5000')")
    beyond = "the limit of 5\u202f000 N on the peak bearing force: drop 2 at DE by 3\u202f100 to 4\u202f900 N"
    assert f"Passed is {beyond} (90 % intervals)." in words(browser, "#log .statements")
    assert "drop 1 at" not in words(browser, "#log .statements")
    browser.evaluate("document.querySelector('#log tbody a').click()")
    browser.until("document.getElementById('dropname').innerText === 'large'")
    browser.evaluate("history.back()")
    browser.until("document.querySelector('#log input')?.value === '5000'")
    quiet(browser)


def test_a_damaged_drop_is_listed_and_the_rest_works(browser, three):
    number = three.ask("GET", "/api/jobs").told["jobs"][1]["id"]
    (three.space.job(number).path / "job.json").write_text('{"name')
    browser.open(three.address)
    browser.until("document.querySelectorAll('.dropname').length === 3")
    damaged = f"damaged drop {number[:6]}"
    assert "damaged" in browser.evaluate(
        "[...document.querySelectorAll('#droprows tr')].map(r => r.innerText).join()"
    )
    browser.evaluate(MENU.format(damaged))
    assert browser.evaluate(f"{OPEN}.map(one => one.innerText).join()") == "Remove …"
    browser.key("Escape")
    browser.until("document.activeElement.ariaExpanded === 'false'")
    open_drop(browser, "large")
    browser.until("document.getElementById('dropname').innerText === 'large'")
    browser.key("l")
    browser.until(NAMES)
    quiet(browser)


def test_an_address_of_a_drop_that_is_gone_says_so_over_the_list(browser, three):
    browser.open(f"{three.address}&drop={'0' * 16}")
    browser.until("document.getElementById('status').innerText.includes('There is no such drop')")
    assert browser.evaluate("document.querySelectorAll('.dropname').length") == 3
    assert three.token not in browser.evaluate("location.href")
