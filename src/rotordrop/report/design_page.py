"""The report on a design study: the front, drawn with other chances, beside the machine as described."""

from __future__ import annotations

import math
from typing import Any

import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.machine import kind_of_path
from rotordrop.report.content import Cell, Figure, ReportContent, Section, Statement, Table
from rotordrop.report.origin import study_facts
from rotordrop.report.quantity import display_unit
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels, plain
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study.design import Aim, Candidate, DesignPlan, DesignResult
from rotordrop.study.quantities import columns_of
from rotordrop.units import format_quantity


def design_page(plan: DesignPlan, result: DesignResult) -> ReportContent:
    """Build the report on a design study."""
    study = plan.study
    return ReportContent(
        title=f"Design by simulated drops: {study.name}",
        subtitle=f"{study.machine.name}, {len(result.candidates)} candidates, {study.repeats} drops each",
        verdict=_verdict(plan, result),
        summary=(_table(plan, result),),
        facts=study_facts(study),
        sections=(
            Section(
                heading="Front",
                text=(
                    "Every candidate met the same chances. Those on the front were drawn again with fresh "
                    f"ones, {plan.again} drops each: where a point moves, the first value was partly luck.",
                ),
                figures=(
                    Figure(
                        chart=_figure(plan, result),
                        caption="Both aims are better the smaller; bars: 90 % intervals.",
                    ),
                ),
            ),
        ),
    )


def _verdict(plan: DesignPlan, result: DesignResult) -> tuple[Statement, ...]:
    kept = sum(one.on_front for one in result.front)
    said = [
        Statement(
            text=f"Of {len(result.candidates)} candidates {len(result.front)} on the front: no other is "
            f"better in every aim. Drawn again with fresh chances, {kept} of {len(result.front)} still on it."
        )
    ]
    for number, aim in enumerate(result.aims):
        best = min(result.front, key=lambda one: one.aims[number].value)
        now = result.described.aims[number]
        clear = best.aims[number].high < now.low
        said.append(
            Statement(
                text=f"{aim.name}: {_text(plan, aim, best.aims[number])} at best, "
                f"{_text(plan, aim, now)} for the machine as described"
                + ("." if clear else "; the intervals overlap, so no gain is proven."),
                level="good" if clear else "notice",
            )
        )
    said.append(
        Statement(text="The drops are simulated; bounds and what varies decide what can be found here.")
    )
    return tuple(said)


def _kind(machine: Machine, aim: Aim) -> str:
    if aim.above is not None:
        return "probability"
    first = machine.touchdown_bearings[0].name
    return next(q.kind for q in columns_of(machine) if q.name == aim.column.replace("*", first, 1))


def _text(plan: DesignPlan, aim: Aim, known: Known) -> str:
    kind = _kind(plan.study.machine, aim)
    if kind == "probability":
        return f"{100 * known.value:.3g} % ({100 * known.low:.3g} to {100 * known.high:.3g} %)"
    ends = [format_quantity(e, kind) if math.isfinite(e) else "open" for e in (known.low, known.high)]
    return f"{format_quantity(known.value, kind)} ({ends[0]} to {ends[1]})"


def _table(plan: DesignPlan, result: DesignResult) -> Table:
    machine = plan.study.machine
    first = machine.touchdown_bearings[0].name

    def text(name: str, value: float | str) -> str:
        if isinstance(value, str):
            return value
        return format_quantity(value, kind_of_path(machine, name.replace("*", first, 1)))

    def row(label: str, one: Candidate) -> tuple[Cell, ...]:
        chosen = [text(name, value) for name, value in one.chosen(plan.study).items()]
        return (
            label,
            *chosen,
            *(_text(plan, aim, known) for aim, known in zip(result.aims, one.aims, strict=True)),
        )

    front = sorted(result.front, key=lambda one: one.aims[0].value)
    rows = [row(f"{k + 1}" if one.on_front else f"{k + 1}, luck", one) for k, one in enumerate(front)]
    rows.append(row("as described", result.described))
    return Table(
        columns=("design", *plan.study.choose, *(f"{aim.name} (90 %)" for aim in result.aims)),
        rows=tuple(rows),
        caption="The front, drawn again with fresh chances",
        note='"Luck": on the front at first, beaten when drawn again.',
    )


def _figure(plan: DesignPlan, result: DesignResult) -> go.Figure:
    x, y = result.aims[0], result.aims[-1]
    figure = panels(("",))
    units = []
    for aim in (x, y):
        kind = _kind(plan.study.machine, aim)
        units.append((1.0, "") if kind == "probability" else display_unit(kind))
    for label, shown, colour in (
        ("all candidates", result.candidates, SERIES[3]),
        ("front, drawn again", result.front, SERIES[0]),
        ("as described", (result.described,), SERIES[1]),
    ):
        bars = label != "all candidates"
        figure.add_trace(
            go.Scatter(
                x=[one.aims[0].value / units[0][0] for one in shown],
                y=[one.aims[-1].value / units[1][0] for one in shown],
                error_x=_bars([one.aims[0] for one in shown], units[0][0]) if bars else None,
                error_y=_bars([one.aims[-1] for one in shown], units[1][0]) if bars else None,
                mode="markers",
                marker={"color": colour, "size": 8 if bars else 5},
                name=label,
            )
        )
    figure.update_xaxes(title_text=axis_title(plain(x.name), units[0][1]))
    figure.update_yaxes(title_text=axis_title(plain(y.name), units[1][1]))
    return fit_legend(figure)


def _bars(known: list[Known], size: float) -> dict[str, Any]:
    def reach(length: float) -> float:
        return length / size if math.isfinite(length) else 0.0

    return {
        "array": [reach(one.high - one.value) for one in known],
        "arrayminus": [reach(one.value - one.low) for one in known],
    }


def design_numbers(plan: DesignPlan, result: DesignResult) -> dict[str, Any]:
    """The same numbers, ready for JSON (SI; an open end of an interval is null)."""
    return {
        "study": plan.study.document(),
        "machine": plan.study.machine.name,
        "rotordrop": __version__,
        "fingerprint": fingerprint(),
        "aims": [aim.name for aim in result.aims],
        "candidates": [_candidate(plan, one) for one in result.candidates],
        "front": [_candidate(plan, one) for one in result.front],
        "described": _candidate(plan, result.described),
    }


def _candidate(plan: DesignPlan, one: Candidate) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "values": one.chosen(plan.study),
        "on_front": one.on_front,
        "aims": [
            {"value": finite(k.value), "interval_90": [finite(k.low), finite(k.high)], "drops": k.drops}
            for k in one.aims
        ],
    }
