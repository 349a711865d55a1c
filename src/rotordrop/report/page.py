"""One offline HTML file from a report's content: plotly inside, no network, names escaped."""

from __future__ import annotations

import base64
import hashlib
import json
import os
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from rotordrop.files import write_text
from rotordrop.report.content import ReportContent
from rotordrop.report.origin import Origin
from rotordrop.report.quantity import Quantity, unbroken
from rotordrop.sketch import still

if TYPE_CHECKING:
    from jinja2 import Environment

_PACKAGE = "rotordrop.report"
_JSON_ESCAPES = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}
LEVEL_WORDS = {"good": "good", "notice": "note", "warning": "warning", "bad": "problem"}


def write_page(content: ReportContent, path: str | os.PathLike[str], origin: Origin | None = None) -> None:
    """Write a report as one HTML file that needs no network; complete or not at all.

    The origin stands with the facts of the content, at one place.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    made = (origin or Origin()).facts()
    facts = (*content.facts, *(one for one in made if one not in content.facts))
    write_text(path, render_page(replace(content, facts=facts)))


def render_page(content: ReportContent) -> str:
    """Give the HTML of a report.

    The page carries its own content security policy: only the scripts that belong to it run, and nothing is
    loaded from anywhere. Figures travel as JSON, which no browser executes.
    """
    numbered = _numbered_sections(content)
    head = " · ".join(filter(None, (content.title, content.subtitle)))
    drawn = any(section.figures for section in content.sections)
    drawing = (_text("assets", "plotly-cartesian.min.js"),) if drawn else ()
    scripts = (*drawing, _text("templates", "page.js"))
    html: str = (
        _environment()
        .get_template("page.html")
        .render(
            content=content,
            sections=numbered,
            running_title=css_text(head),
            css_text=css_text,
            style=_text("templates", "page.css"),
            scripts=scripts,
            policy=content_security_policy(scripts),
            level_words=LEVEL_WORDS,
        )
    )
    return html


def css_text(text: str) -> str:
    """A text for a string in a style sheet: whatever is not plain is written as its number.

    The blank after a number belongs to it: without one the next blank of the text would be swallowed.
    """
    return "".join(
        sign if sign.isascii() and (sign.isalnum() or sign == " ") else f"\\{ord(sign):06x} " for sign in text
    )


def content_security_policy(scripts: tuple[str, ...]) -> str:
    """Policy that lets exactly these inline scripts run and forbids every request."""
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def _numbered_sections(content: ReportContent) -> list[dict[str, Any]]:
    """Sections with an anchor each and their figures as JSON with a number through the whole page."""
    numbered: list[dict[str, Any]] = []
    count = 0
    for index, section in enumerate(content.sections, start=1):
        figures = [
            {
                "number": number,
                "caption": figure.caption,
                "json": chart_json(figure.chart),
                "still": "" if section.folded else still(figure.chart),
                "height": int(figure.chart.layout.height or 400),
            }
            for number, figure in enumerate(section.figures, start=count + 1)
        ]
        count += len(figures)
        first = section.folded and not any(entry["section"].folded for entry in numbered)
        anchor = f"section-{index}"
        numbered.append({"anchor": anchor, "section": section, "figures": figures, "appendix": first})
    return numbered


def chart_json(chart: Any) -> str:
    """A plotly figure as JSON that is safe inside a page: no character in it can end a script element."""
    description = json.loads(chart.to_json())
    text = json.dumps(description, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for character, escape in _JSON_ESCAPES.items():
        text = text.replace(character, escape)
    return text


@lru_cache(maxsize=4)
def _text(folder: str, name: str) -> str:
    return resources.files(_PACKAGE).joinpath(folder, name).read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def _environment() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(
        loader=FunctionLoader(lambda name: _text("templates", name)),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=lambda cell: unbroken(cell) if type(cell) is str else cell,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["quantity"] = lambda cell: isinstance(cell, Quantity)
    return environment
