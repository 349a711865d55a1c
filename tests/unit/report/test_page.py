"""The page is one file that needs no network, trusts no name, and is written complete or not at all."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from rotordrop.estimate.bearing_drop import History
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement, Table
from rotordrop.report.page import render_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import Panel, time_panels

EVIL = "<script>alert('1')</script>\"&<img src=x onerror=alert(2)>"
LOADING = {"src", "href", "action", "data", "poster", "srcset", "background", "formaction", "xlink:href"}


class Reader(HTMLParser):
    """Collects what a page would load and what it would run."""

    def __init__(self, html):
        super().__init__()
        self.addresses, self.handlers, self.tags, self.scripts, self.styles = [], [], [], [], []
        self.text, self.policy, self._inside, self._attributes = [], "", None, {}
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._inside, self._attributes = tag, dict(attrs)
        self.addresses += [value or "" for name, value in attrs if name in LOADING]
        self.handlers += [name for name, _ in attrs if name.startswith("on")]
        if self._attributes.get("http-equiv") == "Content-Security-Policy":
            self.policy = str(self._attributes["content"])

    def handle_endtag(self, tag):
        self._inside = None

    def handle_data(self, data):
        if self._inside == "script":
            self.scripts.append((self._attributes, data))
        else:
            (self.styles if self._inside == "style" else self.text).append(data)

    def data(self):
        """What the figures are drawn from, of one figure."""
        (found,) = [text for of, text in self.scripts if of.get("type") == "application/json"]
        return found


def content(name="LP-400"):
    time = np.linspace(0.0, 0.2, 20_001)
    history = History(label=name, time=time, values=1000.0 * np.abs(np.sin(90.0 * time)))
    panel = Panel(title=name, axis="bearing force", histories=(history,))
    figure = Figure(chart=time_panels([[panel]], 1.0, "N"), caption=name)
    quantity = Quantity(value=3333.0, kind="force", interval_90=(3180.0, 3490.0))
    table = Table(columns=("quantity", name), rows=((name, quantity),), caption=name, note=name)
    key = KeyFigure(label="Peak bearing force", value=quantity, note=name)
    return ReportContent(
        title=f"Drop of {name}",
        subtitle=name,
        simulated="This record is simulated.",
        facts=(("record", name),),
        verdict=(Statement(text=name, level="warning"),),
        cards=(Card(title=name, figures=(key,)),),
        summary=(table,),
        sections=(Section(heading=name, text=(name,), figures=(figure,), tables=(table,)),),
    )


def test_the_page_loads_nothing_from_anywhere_and_says_its_numbers():
    reader = Reader(render_page(content()))
    assert reader.addresses
    assert all(address.startswith("#") for address in reader.addresses)
    assert not {"link", "iframe", "object", "embed", "base", "form"} & set(reader.tags)
    assert not any(re.search(r"url\(|@import|https?:", style) for style in reader.styles)
    own = reader.scripts[-1][1]
    assert "http" not in reader.scripts[0][1]
    assert not re.search(r"https?:|fetch|XMLHttpRequest|import\(", own)
    assert 'plotlyServerURL: ""' in own and "showSendToCloud: false" in own
    text = " ".join(reader.text)
    assert "3\u202f333\u00a0N" in text and "90\u00a0%: 3\u202f180 to 3\u202f490\u00a0N" in text


def test_the_policy_lets_exactly_the_two_own_scripts_run():
    reader = Reader(render_page(content()))
    running = [text for attributes, text in reader.scripts if attributes.get("type") != "application/json"]
    assert len(running) == 2
    allowed = set(re.findall(r"'sha256-([^']+)'", reader.policy))
    assert allowed == {base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in running}
    assert "default-src 'none'" in reader.policy
    assert "unsafe-eval" not in reader.policy
    assert not re.search(r"script-src[^;]*unsafe-inline", reader.policy)


def test_names_from_files_stay_text():
    plain, attacked = Reader(render_page(content())), Reader(render_page(content(EVIL)))
    assert attacked.tags == plain.tags
    assert attacked.handlers == []
    assert any(EVIL in text for text in attacked.text)
    assert not set("<>&") & set(attacked.data())
    assert json.loads(attacked.data())["data"][0]["name"].startswith("&lt;script&gt;")


def test_the_figures_of_the_page_hold_the_numbers():
    values = json.loads(Reader(render_page(content())).data())["data"][0]["y"]
    drawn = np.frombuffer(base64.b64decode(values["bdata"]), dtype=values["dtype"])
    assert drawn.max() == pytest.approx(1000.0, rel=1e-6)
    assert len(drawn) < 2000


def test_problems_stand_with_the_verdict_before_the_figures_and_notes_after_them():
    said = (*(Statement(f"problem {k}", "bad") for k in range(3)), Statement("a note"))
    html = render_page(ReportContent(title="t", verdict=said, sections=(Section("s"),), lead=1))
    places = [html.index(text) for text in ("Problem 0.", "Problem 2.", 'id="section-1"', "A note.")]
    assert places == sorted(places)


def test_a_page_of_many_figures_stays_small():
    html = render_page(ReportContent(title="many", sections=content().sections * 25))
    assert len(html.encode()) < 6_000_000
    assert len(set(re.findall(r'id="(chart-\d+)"', html))) == 25
