"""The list of drops in a headless Chromium: found, sorted, removed, addressed."""

import numpy as np
import pytest
from tests.unit.web.browser import CHROMIUM
from tests.unit.web.made_drops import estimated
from tests.unit.web.steps import open_drop, press, quiet

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")]
NAMES = "[...document.querySelectorAll('.dropname')].map(one => one.innerText).join()"


@pytest.fixture
def three(server):
    for name, peak, year in (("middle", 3000.0, 2022), ("small", 1000.0, 2023), ("large", 9000.0, 2021)):
        estimated(server, name, name[0] * 64, peak, recorded=f"{year}-01-01T00:00:00")
    return server


def test_drops_are_sorted_and_filtered_and_the_address_keeps_it(browser, three):
    browser.open(three.address)
    browser.until(f"{NAMES} === 'small,middle,large'")  # the latest event first
    drawn = (
        "[...document.querySelectorAll('.drawn i')].map(i => [i.style.left, i.style.width].map(parseFloat))"
    )
    ends = [(low, low + wide) for low, wide in browser.evaluate(drawn)]
    expected = [(100 * 0.9 * peak / 9900, 100 * 1.1 * peak / 9900) for peak in (1000, 3000, 9000)]
    np.testing.assert_allclose(ends, expected, rtol=1e-4)
    press(browser, "sort-force")
    assert browser.evaluate(NAMES) == "large,middle,small"
    press(browser, "sort-force")
    assert browser.evaluate(NAMES) == "small,middle,large"
    assert browser.evaluate("document.querySelector('[aria-sort]').ariaSort") == "ascending"
    browser.evaluate("query.value = 'none'; query.dispatchEvent(new Event('input'))")
    assert "No drop has none in its name" in browser.evaluate("droprows.innerText")
    browser.evaluate("query.value = 'll'; query.dispatchEvent(new Event('input'))")
    assert browser.evaluate(NAMES) == "small"
    browser.until("location.hash.includes('q=ll') && location.hash.includes('sort=force')")
    browser.call("Page.reload")
    browser.until(f"{NAMES} === 'small'")
    quiet(browser)


def test_a_drop_is_removed_after_a_question(browser, three):
    browser.open(three.address)
    browser.until(NAMES)
    browser.evaluate("document.querySelector('[aria-label=\"Remove middle\"]').click()")
    browser.evaluate("document.querySelector('#sure [value=cancel]').click()")
    assert browser.evaluate(NAMES) == "small,middle,large"
    browser.evaluate("document.querySelector('[aria-label=\"Remove middle\"]').click()")
    browser.evaluate("document.querySelector('#sure [value=remove]').click()")
    browser.until(f"{NAMES} === 'small,large'")
    browser.evaluate("document.querySelector('[aria-label=\"Remove small\"]').click()")
    browser.key("Escape")
    browser.until("!document.getElementById('sure').open")
    browser.call("Page.reload")
    browser.until(f"{NAMES} === 'small,large'")
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
