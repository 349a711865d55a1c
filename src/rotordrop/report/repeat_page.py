"""The report on a virtual repeat: the recorded drop among those that could have happened."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.known import Known
from rotordrop.report.content import Cell, Figure, ReportContent, Section, Statement, Table
from rotordrop.report.origin import study_facts
from rotordrop.report.quantity import display_unit
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study.repeat import Repeat
from rotordrop.study.summary import StudyResults
from rotordrop.units import format_quantity

FEW = 0.05
"""Share of drops on one side of the recorded one from which it counts as out of the ordinary [1]."""


def repeat_page(results: StudyResults, found: Sequence[Repeat]) -> ReportContent:
    """Build the report on a virtual repeat."""
    study = results.study
    return ReportContent(
        title=f"{len(results)} virtual repeats at {format_quantity(study.speed, 'speed')}",
        subtitle=f"{study.machine.name}, {1e3 * study.duration:g} ms each",
        verdict=_verdict(results, found),
        summary=(_table(results, found),),
        facts=study_facts(study),
        sections=(
            Section(
                heading="Distribution",
                figures=tuple(
                    Figure(
                        chart=_figure(results, found, name),
                        caption="Share of the simulated drops below a value; dashed: the recorded drop.",
                    )
                    for name in ("peak_force", "peak_stress")
                ),
            ),
        ),
    )


def _verdict(results: StudyResults, found: Sequence[Repeat]) -> tuple[Statement, ...]:
    said = []
    failed = sum(results.failed.values())
    if failed:
        said.append(Statement(text=f"{failed} drops could not be computed.", level="warning"))
    if results.study.joint is None:
        said.append(
            Statement(
                text="The machine file holds no joint distribution: the machine is taken as described, "
                "so the spread is that of rotor angle and remanent lift alone, and too narrow. Calibrate "
                "it first.",
                level="warning",
            )
        )
    for one in found:
        if one.recorded is None or one.place is None:
            continue
        odd = one.place.high < FEW or one.place.low > 1.0 - FEW
        said.append(
            Statement(
                text=f"{one.column.replace('_', ' ')}: {_share(one.place)} of the drops that could "
                f"have happened were milder than the recorded "
                f"{_value(results, one, one.recorded.value)}; the worst of "
                f"{one.of} would typically have {_known(results, one, one.worst)}.",
                level="warning" if odd else "notice",
            )
        )
    said.append(
        Statement(
            text="The drops are simulated by the model; what the model leaves out is not in the spread."
        )
    )
    return tuple(said)


def _kind(results: StudyResults, one: Repeat) -> str:
    return next(q.kind for q in results.columns if q.name == one.column)


def _value(results: StudyResults, one: Repeat, value: float) -> str:
    return format_quantity(value, _kind(results, one)) if math.isfinite(value) else "open"


def _known(results: StudyResults, one: Repeat, known: Known) -> str:
    low, high = (_value(results, one, end) for end in (known.low, known.high))
    return f"{_value(results, one, known.value)} ({low} to {high})"


def _share(known: Known) -> str:
    return f"{100 * known.value:.3g} % (90 %: {100 * known.low:.3g} to {100 * known.high:.3g} %)"


def _recorded(results: StudyResults, one: Repeat, recorded: Known | None) -> str:
    if recorded is None:
        return "–"
    ends = (recorded.low, recorded.high)
    value, low, high = (_value(results, one, number) for number in (recorded.value, *ends))
    return f"{value} ({low} to {high})"


def _table(results: StudyResults, found: Sequence[Repeat]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            one.column.replace("_", " "),
            _recorded(results, one, one.recorded),
            "–" if one.place is None else _share(one.place),
            _known(results, one, one.median),
            f"{_value(results, one, one.low.value)} to {_value(results, one, one.high.value)}",
            _known(results, one, one.worst),
        )
        for one in found
    ]
    return Table(
        columns=(
            "quantity",
            "recorded (90 %)",
            "milder drops",
            "median (90 %)",
            "nine of ten drops",
            f"worst of {found[0].of} (90 %)",
        ),
        rows=tuple(rows),
        caption="The recorded drop among those that could have happened",
        note="Worst of so many: half of such sets have a worst drop below it. Intervals say how well the "
        "number of simulated drops determines a number.",
    )


def _figure(results: StudyResults, found: Sequence[Repeat], name: str) -> go.Figure:
    shown = [one for one in found if one.column.endswith(f".{name}")]
    figure = panels([one.column.partition(".")[0] for one in shown])
    for column, one in enumerate(shown, start=1):
        size, unit = display_unit(_kind(results, one))
        values = sorted(value for value in results.column(one.column).tolist() if math.isfinite(value))
        count = len(values)
        figure.add_trace(
            go.Scatter(
                x=[value / size for value in values],
                y=[100.0 * (k + 0.5) / count for k in range(count)],
                mode="lines",
                line={"color": SERIES[0], "width": 1.6, "shape": "hv"},
                name="simulated drops",
                showlegend=column == 1,
            ),
            row=1,
            col=column,
        )
        if one.recorded is not None:
            figure.add_vline(
                x=one.recorded.value / size, line={"color": SERIES[1], "dash": "dash"}, row=1, col=column
            )
        figure.update_xaxes(title_text=axis_title(name.replace("_", " "), unit), col=column)
    figure.update_yaxes(title_text=axis_title("drops below", "%"), col=1)
    return fit_legend(figure)


def repeat_numbers(results: StudyResults, found: Sequence[Repeat]) -> dict[str, Any]:
    """The same numbers, ready for JSON (SI; an open end of an interval is null)."""
    return {
        "study": results.study.document(),
        "machine": results.study.machine.name,
        "rotordrop": __version__,
        "fingerprint": fingerprint(),
        "drops": len(results),
        "failed": dict(results.failed),
        "quantities": [finite(_quantity(one)) for one in found],
    }


def _quantity(one: Repeat) -> dict[str, Any]:
    def counted(known: Known) -> dict[str, Any]:
        return {"value": known.value, "lower": known.low, "upper": known.high, "drops": known.drops}

    return {
        "column": one.column,
        **{name: counted(getattr(one, name)) for name in ("median", "low", "high", "worst")},
        "of": one.of,
        "recorded": one.recorded and {"value": one.recorded.value, "interval": one.recorded.interval_90},
        "place": one.place and counted(one.place),
    }


def finite(tree: Any) -> Any:
    """The same content with nothing in place of what is not finite, which JSON cannot hold."""
    if isinstance(tree, dict):
        return {key: finite(value) for key, value in tree.items()}
    if isinstance(tree, tuple | list):
        return [finite(value) for value in tree]
    return None if isinstance(tree, float) and not math.isfinite(tree) else tree
