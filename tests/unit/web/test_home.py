"""The list of drops in a headless Chromium: found, sorted, removed, addressed."""

import pytest
from tests.unit.web.browser import CHROMIUM
from tests.unit.web.made_drops import estimated
from tests.unit.web.steps import open_drop, press, quiet, serving

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")]
NAMES = "[...document.querySelectorAll('.dropname')].map(one => one.innerText).join()"


@pytest.fixture
def three(tmp_path):
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


def test_a_drop_is_removed_after_a_question(browser, three):
    browser.open(three.address)
    browser.until(NAMES)
    browser.evaluate("document.querySelector('[aria-label=\"Remove middle\"]').click()")
    browser.evaluate("document.querySelector('#sure [value=cancel]').click()")
    assert browser.evaluate(NAMES) == "large,small,middle"
    browser.evaluate("document.querySelector('[aria-label=\"Remove middle\"]').click()")
    browser.evaluate("document.querySelector('#sure [value=remove]').click()")
    browser.until(f"{NAMES} === 'large,small'")
    browser.evaluate("document.querySelector('[aria-label=\"Remove small\"]').click()")
    browser.key("Escape")
    browser.until("!document.getElementById('sure').open")
    browser.call("Page.reload")
    browser.until(f"{NAMES} === 'large,small'")
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
    assert browser.evaluate(f"document.querySelector('[aria-label=\"Remove {damaged}\"]') !== null")
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
