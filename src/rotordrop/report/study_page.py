"""The report on a study: how force, stress and whirl are spread over many drops, and against what varies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.machine.parameter_paths import kind_of_path
from rotordrop.report.content import Cell, Figure, ReportContent, Section, Statement, Table
from rotordrop.report.quantity import display_unit
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels, plain
from rotordrop.simulation.fingerprint import fingerprint
from rotordrop.study.plan import CASE_KINDS
from rotordrop.study.quantities import Quantity
from rotordrop.study.summary import Known, StudyResults
from rotordrop.units import format_quantity

SHARES = (0.5, 0.9, 0.99)
MAPPED = ("peak_force", "peak_stress")
"""Quantities of a bearing that are drawn against what varies."""
HEADLINES = ("peak_force", "peak_stress", "largest_radius")
"""Quantities of a bearing that stand beside the verdict."""


def study_page(results: StudyResults, by: Sequence[str] = ()) -> ReportContent:
    """Build the report on a study.

    Parameters
    ----------
    results : StudyResults
        Finished drops.
    by : sequence of str
        Varied values to draw the results against.
    """
    study = results.study
    sections = [_spread_section(results)]
    sections += [_map_section(results, name) for name in by]
    return ReportContent(
        title=f"{len(results)} simulated drops: {study.name}",
        subtitle=f"{study.machine.name}, {1e3 * study.duration:g} ms each",
        verdict=tuple(_verdict(results)),
        summary=(_table(results, SHARES, only=HEADLINES),),
        facts=(
            ("machine", study.machine.name),
            ("design", f"{study.design}, seed {study.seed}, shards of {study.shard}"),
            ("digest", study.digest),
            ("rotordrop", __version__),
        ),
        sections=tuple(sections),
    )


def _verdict(results: StudyResults) -> list[Statement]:
    said = []
    missing = results.study.drops - len(results)
    if missing:
        said.append(
            Statement(text=f"{missing} of {results.study.drops} drops are not part of this.", level="notice")
        )
    failed = sum(results.failed.values())
    if failed:
        reasons = "; ".join(f"{count} ×: {reason}" for reason, count in results.failed.items())
        said.append(Statement(text=f"{failed} drops could not be computed: {reasons}", level="warning"))
    for bearing in results.study.machine.touchdown_bearings:
        whirl = results.exceedance(f"{bearing.name}.backward_whirl", 0.0)
        said.append(
            Statement(
                text=f"{bearing.name}: {_share(whirl)} of the drops went into backward whirl.",
                level="notice" if whirl.value == 0.0 else "warning",
            )
        )
    said.append(
        Statement(
            text="The drops are simulated; the spread is that of the values that vary here, not of all that "
            "is unknown about the machine.",
        )
    )
    return said


def _share(known: Known) -> str:
    return f"{100 * known.value:.3g} % (90 %: {100 * known.lower:.3g} to {100 * known.upper:.3g} %)"


def _spread_section(results: StudyResults) -> Section:
    return Section(
        heading="Spread over all drops",
        text=(
            "Quantiles over the drops with 90 % intervals from order statistics: how well the number of "
            "drops determines them. An open end means that more drops are needed.",
        ),
        tables=(_table(results, (0.05, *SHARES)),),
    )


def _table(results: StudyResults, shares: Sequence[float], only: Sequence[str] = ()) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for column in results.columns:
        values = results.numbers[column.name]
        if not np.isfinite(values).any() or (only and column.name.rpartition(".")[2] not in only):
            continue
        rows.append(
            (
                column.meaning,
                *(_text(results.quantile(column.name, share), column.kind) for share in shares),
                str(int(np.count_nonzero(np.isfinite(values)))),
            )
        )
    heads = ("quantity", *(f"{100 * share:g} % quantile (90 %)" for share in shares), "drops")
    return Table(columns=heads, rows=tuple(rows), caption="Quantiles over the drops")


def _text(known: Known, kind: str) -> str:
    ends = [
        format_quantity(end, kind) if math.isfinite(end) else "open" for end in (known.lower, known.upper)
    ]
    return f"{format_quantity(known.value, kind)} ({ends[0]} to {ends[1]})"


def _kind(results: StudyResults, name: str) -> str:
    if name in CASE_KINDS:
        return CASE_KINDS[name]
    first = results.study.machine.touchdown_bearings[0].name
    return kind_of_path(results.study.machine, name.replace("*", first, 1))


def _map_section(results: StudyResults, name: str) -> Section:
    kind = _kind(results, name)
    figures = [
        Figure(
            chart=_map_figure(results, name, kind, quantity),
            caption="Quantiles of drops with neighbouring values; bars: 90 % intervals.",
        )
        for quantity in MAPPED
    ]
    return Section(heading=f"Against {plain(name)}", figures=tuple(figures))


def _map_figure(results: StudyResults, name: str, kind: str, quantity: str) -> go.Figure:
    bearings = [bearing.name for bearing in results.study.machine.touchdown_bearings]
    figure = panels(bearings)
    factor, unit = display_unit(kind)
    for column, bearing in enumerate(bearings, start=1):
        key = f"{bearing}.{quantity}"
        shown: Quantity = next(q for q in results.columns if q.name == key)
        size, size_unit = display_unit(shown.kind)
        for k, share in enumerate(SHARES):
            cells = results.map(key, name, share=share)
            known: list[Known] = [cell["known"] for cell in cells]
            figure.add_trace(
                go.Scatter(
                    x=[0.5 * (cell["from"] + cell["to"]) / factor for cell in cells],
                    y=[one.value / size for one in known],
                    error_y={
                        "array": [_reach(one.upper - one.value, size) for one in known],
                        "arrayminus": [_reach(one.value - one.lower, size) for one in known],
                    },
                    mode="lines+markers",
                    line={"color": SERIES[k], "width": 1.6},
                    name=f"{100 * share:g} % of drops below",
                    legendgroup=str(k),
                    showlegend=column == 1,
                ),
                row=1,
                col=column,
            )
        figure.update_xaxes(title_text=axis_title(plain(name), unit), col=column)
    figure.update_yaxes(title_text=axis_title(quantity.replace("_", " "), size_unit), col=1)
    return fit_legend(figure)


def _reach(length: float, size: float) -> float:
    return length / size if math.isfinite(length) else 0.0


def study_numbers(results: StudyResults, by: Sequence[str] = ()) -> dict[str, Any]:
    """The same numbers, ready for JSON (SI; an open end of an interval is null)."""
    study = results.study
    return {
        "study": study.document(),
        "machine": study.machine.name,
        "digest": study.digest,
        "rotordrop": __version__,
        "fingerprint": fingerprint(),
        "drops": len(results),
        "failed": dict(results.failed),
        "quantiles": {
            q.name: {
                "unit": q.unit,
                "meaning": q.meaning,
                **{f"{share:g}": _numbers(results.quantile(q.name, share)) for share in (0.05, *SHARES)},
            }
            for q in results.columns
        },
        "maps": {
            name: {
                f"{bearing.name}.{quantity}": [
                    {
                        "from": cell["from"],
                        "to": cell["to"],
                        "quantile": share,
                        **_numbers(cell["known"]),
                    }
                    for share in SHARES
                    for cell in results.map(f"{bearing.name}.{quantity}", name, share=share)
                ]
                for bearing in study.machine.touchdown_bearings
                for quantity in MAPPED
            }
            for name in by
        },
    }


def _numbers(known: Known) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "value": finite(known.value),
        "interval_90": [finite(known.lower), finite(known.upper)],
        "drops": known.drops,
    }
