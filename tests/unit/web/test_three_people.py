"""Three people at once, each in a browser of their own, from the upload to the report."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.unit.web.browser import CHROMIUM, Browser
from tests.unit.web.steps import LOOKED, look_at, press, quiet, send, serving, words

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")


@pytest.fixture
def people(tmp_path: Path) -> Iterator[list[Browser]]:
    browsers = [Browser(tmp_path / f"profile{number}") for number in range(3)]
    yield browsers
    for browser in browsers:
        browser.close()


def own_files(files, folder: Path, number: int) -> list[Path]:
    """The files with a record of their own name."""
    record = folder / f"drop of {number}.h5"
    record.write_bytes(files["record"].read_bytes())
    return [record, *(file for role, file in files.items() if role != "record")]


def test_each_sees_the_own_drop_and_waits_for_the_others(people, tmp_path, files):
    with serving(tmp_path / "served") as server:
        for number, browser in enumerate(people):
            own = own_files(files, tmp_path, number)
            (_later if number else look_at)(browser, server, own)
        for number, browser in enumerate(people):
            assert words(browser, "#dropname") == f"drop of {number}"
            press(browser, "estimate")
            browser.until("document.getElementById('cancel')")
        for browser in people[1:]:
            browser.until("document.body.innerText.includes('waiting for another computation')")
        for browser in people:
            press(browser, "cancel")
            browser.until("document.body.innerText.includes('The estimate was cancelled')", 60)
            quiet(browser)
        states = [job["states"]["estimate"]["state"] for job in server.ask("GET", "/api/jobs").told["jobs"]]
        assert states == ["cancelled"] * 3


def _later(browser, server, files) -> None:
    """Whoever comes later finds the drops of the others and adds the own one."""
    browser.open(server.address)
    browser.until("document.querySelector('.dropname')", 120)
    send(browser, files)
    browser.until(f"document.getElementById('dropname').innerText === {files[0].stem!r}", 60)
    browser.until(LOOKED, 120)
    browser.until("document.getElementById('status').innerText.includes('released')", 120)


@pytest.mark.slow
def test_each_gets_an_estimate_and_its_report(people, tmp_path, files):
    """Three whole estimates, from the button to a report that opens once."""
    with serving(tmp_path / "served") as server:
        look_at(people[0], server, own_files(files, tmp_path, 0))
        for number in (1, 2):
            _later(people[number], server, own_files(files, tmp_path, number))
        for browser in people:
            press(browser, "estimate")
            browser.until("document.getElementById('cancel')")
        for number, browser in enumerate(people):
            consistent = "The model is consistent with the record."
            browser.until(f"document.getElementById('status').innerText.includes({consistent!r})", 900)
            assert browser.evaluate("document.querySelectorAll('.panel canvas').length") == 4
            chosen = browser.evaluate("new URLSearchParams(location.hash.slice(1)).get('drop')")
            document = server.ask("GET", f"/api/jobs/{chosen}/estimate/document").told
            peak = document["bearings"]["NDE"]["peak_force_N"]["value"]
            shown = words(browser, "#status").replace("\u202f", "")
            assert f"NDE peak bearing force {peak:.0f} N" in shown
            quiet(browser)
            address = server.order(f"/api/jobs/{chosen}/estimate/report").told["address"]
            browser.open(f"http://127.0.0.1:{server.port}{address}")
            browser.until("document.documentElement.getAttribute('data-drawn')")
            assert f"drop of {number}" in words(browser, "body")
            assert "consistent with the record" in words(browser, "#verdict")
            quiet(browser)
            again = server.ask("GET", address)
            assert (again.status, "has been used" in again.text) == (404, True)
