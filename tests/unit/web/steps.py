"""What a person does on the page, step by step, and what is expected of it at every step."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tests.unit.web.browser import Browser
from tests.unit.web.serving import Served

LOOKED = "document.querySelectorAll('.panel canvas').length >= 2"


def send(browser: Browser, files: Sequence[Path]) -> None:
    browser.choose_files("#files", list(files))
    browser.until("document.getElementById('sending').open")
    browser.key("Enter")


def look_at(browser: Browser, server: Served, files: Sequence[Path]) -> None:
    """Open the page, send the files, and wait until the record is drawn."""
    browser.open(server.address)
    browser.until("!document.getElementById('empty').hidden")
    send(browser, files)
    browser.until(LOOKED)


def open_drop(browser: Browser, name: str) -> None:
    """Open a drop from the list by a click on its name."""
    link = f"[...document.querySelectorAll('.dropname')].find(one => one.innerText === {name!r})"
    browser.until(link)
    browser.evaluate(f"{link}.click()")


def press(browser: Browser, button: str) -> None:
    """Press it as soon as it can be pressed: a click on a disabled button is lost without a word."""
    here = f"document.getElementById({button!r})"
    browser.until(f"{here} && !{here}.disabled")
    browser.evaluate(f"{here}.click()")


def quiet(browser: Browser) -> None:
    said = browser.messages() + browser.foreign()
    assert not said, said  # this file's assertions are not rewritten by pytest


def words(browser: Browser, selector: str) -> str:
    return str(browser.evaluate(f"document.querySelector({selector!r})?.innerText"))
