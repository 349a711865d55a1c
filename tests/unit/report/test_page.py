"""The page is one file that needs no network, trusts no name, and is written complete or not at all."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from rotordrop.errors import OutputError
from rotordrop.estimate.bearing_drop import History
from rotordrop.report.content import (
    Card,
    Figure,
    KeyFigure,
    ReportContent,
    Section,
    Statement,
    Table,
)
from rotordrop.report.page import render_page, write_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.time_panels import Panel, time_panels

EVIL = "<script>alert('1')</script>\"&<img src=x onerror=alert(2)>"
LOADING = {"src", "href", "action", "data", "poster", "srcset", "background", "formaction", "xlink:href"}


class Reader(HTMLParser):
    """Collects what a page would load and what it would run."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.handlers: list[str] = []
        self.tags: list[str] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.styles: list[str] = []
        self.policy = ""
        self.text: list[str] = []
        self._inside: str | None = None
        self._attributes: dict[str, str | None] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._inside, self._attributes = tag, dict(attrs)
        self.addresses += [value or "" for name, value in attrs if name in LOADING]
        self.handlers += [name for name, _ in attrs if name.startswith("on")]
        if self._attributes.get("http-equiv") == "Content-Security-Policy":
            self.policy = str(self._attributes["content"])

    def handle_endtag(self, tag: str) -> None:
        self._inside = None

    def handle_data(self, data: str) -> None:
        if self._inside == "script":
            self.scripts.append((self._attributes, data))
        elif self._inside == "style":
            self.styles.append(data)
        else:
            self.text.append(data)


def content(name: str = "LP-400") -> ReportContent:
    time = np.linspace(0.0, 0.2, 20_001)
    history = History(label=name, time=time, values=1000.0 * np.abs(np.sin(90.0 * time)))
    panel = Panel(title=name, axis="bearing force", histories=(history,))
    figure = Figure(chart=time_panels([[panel]], 1.0, "N"), caption=name)
    quantity = Quantity(value=3333.0, kind="force", interval_90=(3180.0, 3490.0))
    table = Table(columns=("quantity", name), rows=((name, quantity),), caption=name, note=name)
    return ReportContent(
        title=f"Drop of {name}",
        subtitle=name,
        simulated="This record is simulated.",
        facts=(("record", name),),
        verdict=(Statement(text=name, level="warning"),),
        cards=(
            Card(title=name, figures=(KeyFigure(label="Peak bearing force", value=quantity, note=name),)),
        ),
        summary=(table,),
        sections=(Section(heading=name, text=(name,), figures=(figure,), tables=(table,)),),
    )


def read(html: str) -> Reader:
    reader = Reader()
    reader.feed(html)
    reader.close()
    return reader


def test_the_page_loads_nothing_from_anywhere() -> None:
    reader = read(render_page(content()))
    assert reader.addresses
    assert all(address.startswith("#") for address in reader.addresses)
    assert not {"link", "iframe", "object", "embed", "base", "form"} & set(reader.tags)
    assert not any(re.search(r"url\(|@import|https?:", style) for style in reader.styles)
    data, own = reader.scripts[0][1], reader.scripts[-1][1]
    assert "http" not in data
    assert not re.search(r"https?:|fetch|XMLHttpRequest|import\(", own)
    assert 'plotlyServerURL: ""' in own
    assert "showSendToCloud: false" in own


def test_the_policy_lets_exactly_the_two_own_scripts_run() -> None:
    reader = read(render_page(content()))
    running = [text for attributes, text in reader.scripts if attributes.get("type") != "application/json"]
    assert len(running) == 2
    allowed = set(re.findall(r"'sha256-([^']+)'", reader.policy))
    assert allowed == {base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in running}
    assert "default-src 'none'" in reader.policy
    assert "unsafe-eval" not in reader.policy
    assert not re.search(r"script-src[^;]*unsafe-inline", reader.policy)


def test_names_from_files_stay_text() -> None:
    plain, attacked = read(render_page(content())), read(render_page(content(EVIL)))
    assert attacked.tags == plain.tags
    assert attacked.handlers == []
    assert any(EVIL in text for text in attacked.text)
    data = [text for attributes, text in attacked.scripts if attributes.get("type") == "application/json"]
    assert len(data) == 1
    assert not set("<>&") & set(data[0])
    assert json.loads(data[0])["data"][0]["name"].startswith("&lt;script&gt;")


def test_the_figures_of_the_page_hold_the_numbers() -> None:
    reader = read(render_page(content()))
    (data,) = [text for attributes, text in reader.scripts if attributes.get("type") == "application/json"]
    values = json.loads(data)["data"][0]["y"]
    drawn = np.frombuffer(base64.b64decode(values["bdata"]), dtype=values["dtype"])
    assert drawn.max() == pytest.approx(1000.0, rel=1e-6)
    assert len(drawn) < 2000


def test_numbers_stand_beside_their_interval_and_the_record_is_called_simulated() -> None:
    text = " ".join(read(render_page(content())).text)
    assert "3\u202f333\u00a0N" in text
    assert "90\u00a0%: 3\u202f180 to 3\u202f490\u00a0N" in text
    assert "This record is simulated." in text
    assert "peak (zero to peak)" in text


def test_the_verdict_of_a_first_page_says_how_many_problems_stand_below() -> None:
    said = tuple(Statement(f"problem {k}", "bad") for k in range(3))
    html = render_page(ReportContent(title="t", verdict=said, sections=(Section("s"),), lead=1))
    assert html.index('<a href="#notes">2 more problems</a>') < html.index('id="notes"')
    alone = render_page(ReportContent(title="t", verdict=said[:1], sections=(Section("s"),), lead=1))
    assert "more problem" not in alone


def test_a_page_of_many_figures_stays_small() -> None:
    many = content()
    sections = many.sections * 25
    html = render_page(ReportContent(title="many", sections=sections))
    assert len(html.encode()) < 6_000_000
    assert len(set(re.findall(r'id="(chart-\d+)"', html))) == 25


def test_writing_is_complete(tmp_path: Path) -> None:
    target = tmp_path / "out.html"
    write_page(content(), target)
    assert target.read_text(encoding="utf-8") == render_page(content())
    assert os.listdir(tmp_path) == ["out.html"]


@pytest.mark.parametrize("moment", ["os.fsync", "os.replace"])
def test_ctrl_c_leaves_the_old_page_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    target = tmp_path / "out.html"
    target.write_text("old")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(moment, interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_page(content(), target)
    monkeypatch.undo()
    assert os.listdir(tmp_path) == ["out.html"]
    assert target.read_text() == "old"


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"nowhere does not exist; create it first"):
        write_page(content(), tmp_path / "nowhere" / "out.html")
