"""The report on a design study: the front, drawn with other chances, beside the machine as described."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.machine import kind_of_path
from rotordrop.report.content import Column, Figure, ReportContent, Section, Statement, Table, table
from rotordrop.report.quantity import display_unit
from rotordrop.report.spread import ends, percent, spread, study_facts, study_numbers_of
from rotordrop.report.style import SERIES, axis_title, bars, curve, fit_legend, panels, plain
from rotordrop.study.design import Aim, Candidate, DesignPlan, DesignResult
from rotordrop.study.quantities import columns_of
from rotordrop.units import format_quantity

BETTER = "Both aims are better the smaller; bars: 90 % intervals."
SCOPE = "The drops are simulated; bounds and what varies decide what can be found here."
LUCK = '"Luck": on the front at first, beaten when drawn again.'


def design_page(plan: DesignPlan, result: DesignResult) -> ReportContent:
    """Build the report on a design study."""
    study = plan.study
    again = (
        "Every candidate met the same chances. Those on the front were drawn again with fresh "
        f"ones, {plan.again} drops each: where a point moves, the first value was partly luck."
    )
    return ReportContent(
        title=f"Design by simulated drops: {study.name}",
        subtitle=f"{study.machine.name}, {len(result.candidates)} candidates, {study.repeats} drops each",
        verdict=_verdict(plan, result),
        summary=(_table(plan, result),),
        facts=study_facts(study),
        sections=(Section("Front", (again,), figures=(Figure(_figure(plan, result), BETTER),)),),
    )


def _verdict(plan: DesignPlan, result: DesignResult) -> tuple[Statement, ...]:
    kept = sum(one.on_front for one in result.front)
    text = (
        f"Of {len(result.candidates)} candidates {len(result.front)} on the front: no other is "
        f"better in every aim. Drawn again with fresh chances, {kept} of {len(result.front)} still on it."
    )
    said = [Statement(text)]
    for number, aim in enumerate(result.aims):
        best = min(result.front, key=lambda one: one.aims[number].value).aims[number]
        now = result.described.aims[number]
        clear = best.high < now.low
        end = "." if clear else "; the intervals overlap, so no gain is proven."
        best_text, now_text = (_text(plan, aim, known) for known in (best, now))
        text = f"{aim.name}: {best_text} at best, {now_text} for the machine as described{end}"
        said.append(Statement(text, "good" if clear else "notice"))
    return (*said, Statement(SCOPE))


def _kind(machine: Machine, aim: Aim) -> str:
    if aim.above is not None:
        return "probability"
    first = machine.touchdown_bearings[0].name
    return next(q.kind for q in columns_of(machine) if q.name == aim.column.replace("*", first, 1))


def _text(plan: DesignPlan, aim: Aim, known: Known) -> str:
    kind = _kind(plan.study.machine, aim)
    return percent(known, "{:.3g} % ({:.3g} to {:.3g} %)") if kind == "probability" else spread(known, kind)


def _table(plan: DesignPlan, result: DesignResult) -> Table:
    machine = plan.study.machine
    first = machine.touchdown_bearings[0].name

    def chosen(name: str) -> Column:
        def text(row: tuple[str, Candidate]) -> str:
            value = row[1].chosen(plan.study)[name]
            kind = "" if isinstance(value, str) else kind_of_path(machine, name.replace("*", first, 1))
            return value if isinstance(value, str) else format_quantity(value, kind)

        return Column(name, text)

    def reached(number: int, aim: Aim) -> Column:
        return Column(f"{aim.name} (90 %)", lambda row: _text(plan, aim, row[1].aims[number]))

    front = sorted(result.front, key=lambda one: one.aims[0].value)
    rows = [(f"{k + 1}" if one.on_front else f"{k + 1}, luck", one) for k, one in enumerate(front)]
    columns = (
        Column("design", lambda row: row[0]),
        *(chosen(name) for name in plan.study.choose),
        *(reached(number, aim) for number, aim in enumerate(result.aims)),
    )
    described = ("as described", result.described)
    return table([*rows, described], columns, "The front, drawn again with fresh chances", LUCK)


def _figure(plan: DesignPlan, result: DesignResult) -> go.Figure:
    figure = panels(("",))
    both = (result.aims[0], result.aims[-1])
    kinds = [_kind(plan.study.machine, aim) for aim in both]
    (size_x, unit_x), (size_y, unit_y) = (
        (1.0, "") if kind == "probability" else display_unit(kind) for kind in kinds
    )
    for label, shown, colour in (
        ("all candidates", result.candidates, SERIES[3]),
        ("front, drawn again", result.front, SERIES[0]),
        ("as described", (result.described,), SERIES[1]),
    ):
        first, last = (
            [(one.aims[k].value, one.aims[k].low, one.aims[k].high) for one in shown] for k in (0, -1)
        )
        again = label != "all candidates"
        error: dict[str, Any] = (
            {"error_x": bars(first, size_x), "error_y": bars(last, size_y)} if again else {}
        )
        curve(
            figure,
            [value / size_x for value, _, _ in first],
            [value / size_y for value, _, _ in last],
            label,
            mode="markers",
            marker={"color": colour, "size": 8 if again else 5},
            **error,
        )
    figure.update_xaxes(title_text=axis_title(plain(both[0].name), unit_x))
    figure.update_yaxes(title_text=axis_title(plain(both[1].name), unit_y))
    return fit_legend(figure)


def design_numbers(plan: DesignPlan, result: DesignResult) -> dict[str, Any]:
    """The same numbers, ready for JSON (SI; an open end of an interval is null)."""

    def candidate(one: Candidate) -> dict[str, Any]:
        aims = [ends(known) for known in one.aims]
        return {"values": one.chosen(plan.study), "on_front": one.on_front, "aims": aims}

    made = study_numbers_of(plan.study)
    del made["digest"]
    return made | {
        "aims": [aim.name for aim in result.aims],
        "candidates": [candidate(one) for one in result.candidates],
        "front": [candidate(one) for one in result.front],
        "described": candidate(result.described),
    }
