"""The report on a virtual repeat: the recorded drop among those that could have happened."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go

from rotordrop.known import Known
from rotordrop.report.content import Column, Figure, ReportContent, Section, Statement, Table, table
from rotordrop.report.quantity import display_unit
from rotordrop.report.spread import finite, in_words, percent, spread, study_facts, study_numbers_of
from rotordrop.report.style import SERIES, axis_title, curve, fit_legend, panels, upright
from rotordrop.study.repeat import Repeat
from rotordrop.study.summary import StudyResults
from rotordrop.units import format_quantity

FEW = 0.05
"""Share of drops on one side of the recorded one from which it counts as out of the ordinary [1]."""
NOT_JOINT = (
    "The machine file holds no joint distribution: the machine is taken as described, so the spread is that "
    "of rotor angle and remanent lift alone, and too narrow. Calibrate it first."
)
SCOPE = "The drops are simulated by the model; what the model leaves out is not in the spread."
NOTE = (
    "Worst of so many: half of such sets have a worst drop below it. Intervals say how well the number of "
    "simulated drops determines a number."
)
BELOW = "Share of the simulated drops below a value; dashed: the recorded drop."


def repeat_page(results: StudyResults, found: Sequence[Repeat]) -> ReportContent:
    """Build the report on a virtual repeat."""
    study = results.study
    figures = (_figure(results, found, name) for name in ("peak_force", "peak_stress"))
    return ReportContent(
        title=f"{len(results)} virtual repeats at {format_quantity(study.speed, 'speed')}",
        subtitle=f"{study.machine.name}, {1e3 * study.duration:g} ms each",
        verdict=_verdict(results, found),
        summary=(_table(results, found),),
        facts=study_facts(study),
        sections=(Section("Distribution", figures=tuple(Figure(figure, BELOW) for figure in figures)),),
    )


def _verdict(results: StudyResults, found: Sequence[Repeat]) -> tuple[Statement, ...]:
    said = []
    if results.taken_over:
        said.append(Statement(results.taken_over, "warning"))
    failed = sum(results.failed.values())
    if failed:
        said.append(Statement(f"{failed} drops could not be computed.", "warning"))
    if results.study.joint is None:
        said.append(Statement(NOT_JOINT, "warning"))
    for one in found:
        if one.recorded is None or one.place is None:
            continue
        odd = one.place.high < FEW or one.place.low > 1.0 - FEW
        kind = _kind(results, one)
        text = (
            f"{one.column.replace('_', ' ')}: {percent(one.place)} of the drops that could have happened "
            f"were milder than the recorded {in_words(one.recorded.value, kind)}; the worst of {one.of} "
            f"would typically have {spread(one.worst, kind)}."
        )
        said.append(Statement(text, "warning" if odd else "notice"))
    return (*said, Statement(SCOPE))


def _kind(results: StudyResults, one: Repeat) -> str:
    return next(q.kind for q in results.columns if q.name == one.column)


def _table(results: StudyResults, found: Sequence[Repeat]) -> Table:
    def known(of: Known | None, one: Repeat) -> str:
        return "–" if of is None else spread(of, _kind(results, one))

    def most(one: Repeat) -> str:
        return " to ".join(in_words(end.value, _kind(results, one)) for end in (one.low, one.high))

    columns = (
        Column("quantity", lambda one: one.column.replace("_", " ")),
        Column("recorded (90 %)", lambda one: known(one.recorded, one)),
        Column("milder drops", lambda one: "–" if one.place is None else percent(one.place)),
        Column("median (90 %)", lambda one: known(one.median, one)),
        Column("nine of ten drops", most),
        Column(f"worst of {found[0].of} (90 %)", lambda one: known(one.worst, one)),
    )
    return table(found, columns, "The recorded drop among those that could have happened", NOTE)


def _figure(results: StudyResults, found: Sequence[Repeat], name: str) -> go.Figure:
    shown = [one for one in found if one.column.endswith(f".{name}")]
    figure = panels([one.column.partition(".")[0] for one in shown])
    for column, one in enumerate(shown, start=1):
        size, unit = display_unit(_kind(results, one))
        values = sorted(value for value in results.column(one.column).tolist() if math.isfinite(value))
        curve(
            figure,
            [value / size for value in values],
            [100.0 * (k + 0.5) / len(values) for k in range(len(values))],
            "simulated drops",
            column=column,
            legend=column == 1,
            line={"color": SERIES[0], "width": 1.6, "shape": "hv"},
        )
        if one.recorded is not None:
            upright(figure, one.recorded.value / size, SERIES[1], row=1, col=column)
        figure.update_xaxes(title_text=axis_title(name.replace("_", " "), unit), col=column)
    figure.update_yaxes(title_text=axis_title("drops below", "%"), col=1)
    return fit_legend(figure)


def repeat_numbers(results: StudyResults, found: Sequence[Repeat]) -> dict[str, Any]:
    """The same numbers, ready for JSON (SI; an open end of an interval is null)."""

    def counted(known: Known | None) -> dict[str, Any] | None:
        if known is None:
            return None
        return {"value": known.value, "lower": known.low, "upper": known.high, "drops": known.drops}

    def quantity(one: Repeat) -> dict[str, Any]:
        made: dict[str, Any] = finite(
            {
                "column": one.column,
                **{name: counted(getattr(one, name)) for name in ("median", "low", "high", "worst")},
                "of": one.of,
                "recorded": one.recorded
                and {"value": one.recorded.value, "interval": one.recorded.interval_90},
                "place": counted(one.place),
            }
        )
        return made

    made = study_numbers_of(results.study)
    if results.taken_over:
        made["taken_over"] = results.taken_over
    del made["digest"]
    return made | {
        "drops": len(results),
        "failed": dict(results.failed),
        "quantities": [quantity(one) for one in found],
    }
