"""The report on a study: how force, stress and whirl are spread over many drops, and against what varies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.elements.description import unknown_key
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine.machine import kind_of_path
from rotordrop.report.content import Cell, Figure, ReportContent, Section, Statement, Table
from rotordrop.report.quantity import display_unit
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels, plain
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study.plan import case_kind
from rotordrop.study.quantities import Quantity
from rotordrop.study.sensitivity import influences
from rotordrop.study.summary import StudyResults
from rotordrop.units import format_quantity

SHARES = (0.5, 0.9, 0.99)
MAPPED = ("peak_force", "peak_stress", "settling_time")
"""Quantities of a bearing whose quantiles are drawn against what varies."""
MATTERS = ("peak_force", "peak_stress")
"""Quantities of a bearing for which it is said which varied values matter."""
WHIRL = {"backward_whirl": 0.0}
HEADLINES = ("peak_force", "peak_stress", "largest_radius")
"""Quantities of a bearing that stand beside the verdict."""


def study_page(
    results: StudyResults, by: Sequence[str] = (), limits: Mapping[str, float] | None = None
) -> ReportContent:
    """Build the report on a study.

    Parameters
    ----------
    results : StudyResults
        Finished drops.
    by : sequence of str
        Varied values to draw the results against.
    limits : mapping, optional
        Limits [SI] by the quantity of a bearing, such as ``"peak_stress"``: the probability to exceed them.
    """
    study = results.study
    sections = [_spread_section(results), *_influence_section(results)]
    sections += [_map_section(results, name, limits or {}) for name in by]
    return ReportContent(
        title=f"{len(results)} simulated drops: {study.name}",
        subtitle=f"{study.machine.name}, {1e3 * study.duration:g} ms each",
        verdict=tuple(_verdict(results, limits or {})),
        summary=(_table(results, SHARES, only=HEADLINES),),
        facts=(
            ("machine", study.machine.name),
            ("design", f"{study.design}, seed {study.seed}, shards of {study.shard}"),
            ("digest", study.digest),
            ("rotordrop", __version__),
        ),
        sections=tuple(sections),
    )


def _what_is_missing(results: StudyResults) -> str:
    until, planned = results.study.until, results.study.drops
    missing = f"{planned - len(results)} of {planned} drops are not part of this"
    if until is None:
        return f"{missing}."
    found = results.quantile(until.column, until.quantile)
    wanted = f"the {100 * until.quantile:g} % quantile of {until.column} is known within ± {until.within:.3g}"
    reach = 0.5 * (found.high - found.low) / abs(found.value)
    if reach <= until.within:
        return f"{missing}: {wanted} of itself (± {reach:.2g} now), which ends the study."
    return f"{missing}; it goes on until {wanted} of itself (± {reach:.2g} now)."


def _verdict(results: StudyResults, limits: Mapping[str, float]) -> list[Statement]:
    said = []
    if len(results) < results.study.drops:
        said.append(Statement(text=_what_is_missing(results), level="notice"))
    if results.study.design == "sensitivity":
        text = "Drops of one block differ in one value each: intervals of quantiles, which take drops as "
        said.append(Statement(text=text + "independent, are too narrow here.", level="notice"))
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
        for quantity, limit in limits.items():
            over = results.exceedance(f"{bearing.name}.{quantity}", limit)
            shown = format_quantity(limit, _quantity(results, bearing.name, quantity).kind)
            said.append(
                Statement(
                    text=f"{bearing.name}: {_share(over)} of the drops exceed "
                    f"{quantity.replace('_', ' ')} {shown}.",
                    level="notice" if over.high < 0.5 else "warning",
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
    return f"{100 * known.value:.3g} % (90 %: {100 * known.low:.3g} to {100 * known.high:.3g} %)"


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
    ends = [format_quantity(end, kind) if math.isfinite(end) else "open" for end in (known.low, known.high)]
    return f"{format_quantity(known.value, kind)} ({ends[0]} to {ends[1]})"


def _kind(results: StudyResults, name: str) -> str:
    if (kind := case_kind(results.study.machine, name)) is not None:
        return kind
    first = results.study.machine.touchdown_bearings[0].name
    return kind_of_path(results.study.machine, name.replace("*", first, 1))


def _quantity(results: StudyResults, bearing: str, quantity: str) -> Quantity:
    wanted = f"{bearing}.{quantity}"
    names = {q.name: q for q in results.columns}
    if wanted not in names:
        raise UsageError(unknown_key(quantity, tuple(name.partition(".")[2] for name in names)))
    return names[wanted]


def _influence_section(results: StudyResults) -> tuple[Section, ...]:
    """Which varied values matter, or nothing where there are too few drops to say it."""
    tables = []
    for bearing in results.study.machine.touchdown_bearings:
        for quantity in MATTERS:
            try:
                found = influences(results, f"{bearing.name}.{quantity}")
            except UsageError:
                return ()
            tables.append(
                Table(
                    columns=("varied value", "alone (90 %)", "with all others (90 %)"),
                    rows=tuple((one.name, _part(one.alone), _part(one.total)) for one in found),
                    caption=f"{bearing.name} {quantity.replace('_', ' ')}: shares of the variance",
                )
            )
    text = (
        "Alone: the part of the variance over the drops that would go if this value were known. With all "
        "others: the part that would be left if everything else were known; it takes the design "
        '"sensitivity". What no value explains alone is their interplay, which in a drop is chaos.'
    )
    return (Section(heading="What matters", text=(text,), tables=tuple(tables)),)


def _part(share: Known | None) -> str:
    if share is None:
        return "–"
    return f"{100 * share.value:.0f} % ({100 * share.low:.0f} to {100 * share.high:.0f} %)"


def _map_section(results: StudyResults, name: str, limits: Mapping[str, float]) -> Section:
    kind = _kind(results, name)
    figures = [
        Figure(
            chart=_map_figure(results, name, kind, quantity),
            caption="Quantiles of drops with neighbouring values; bars: 90 % intervals.",
        )
        for quantity in MAPPED
    ]
    figures += [
        Figure(
            chart=_map_figure(results, name, kind, quantity, limit),
            caption="Probability among drops with neighbouring values; bars: 90 % intervals.",
        )
        for quantity, limit in (WHIRL | dict(limits)).items()
    ]
    return Section(heading=f"Against {plain(name)}", figures=tuple(figures))


def _map_figure(
    results: StudyResults, name: str, kind: str, quantity: str, limit: float | None = None
) -> go.Figure:
    bearings = [bearing.name for bearing in results.study.machine.touchdown_bearings]
    figure = panels(bearings)
    factor, unit = display_unit(kind)
    for column, bearing in enumerate(bearings, start=1):
        key = f"{bearing}.{quantity}"
        shown = _quantity(results, bearing, quantity)
        size, size_unit = display_unit(shown.kind) if limit is None else (1.0, "")
        for k, share in enumerate(SHARES if limit is None else SHARES[:1]):
            cells = results.map(key, name, share=share, above=limit)
            known: list[Known] = [cell["known"] for cell in cells]
            figure.add_trace(
                go.Scatter(
                    x=[0.5 * (cell["from"] + cell["to"]) / factor for cell in cells],
                    y=[one.value / size for one in known],
                    error_y={
                        "array": [_reach(one.high - one.value, size) for one in known],
                        "arrayminus": [_reach(one.value - one.low, size) for one in known],
                    },
                    mode="lines+markers",
                    line={"color": SERIES[k], "width": 1.6},
                    name=f"{100 * share:g} % of drops below" if limit is None else "probability",
                    legendgroup=str(k),
                    showlegend=column == 1,
                ),
                row=1,
                col=column,
            )
        figure.update_xaxes(title_text=axis_title(plain(name), unit), col=column)
    words = quantity.replace("_", " ")
    if limit is not None:
        beyond = format_quantity(limit, shown.kind) if limit else ""
        words = f"P({words} > {beyond})" if beyond else f"P({words})"
    figure.update_yaxes(title_text=axis_title(words, size_unit), col=1)
    return fit_legend(figure)


def _reach(length: float, size: float) -> float:
    return length / size if math.isfinite(length) else 0.0


def study_numbers(
    results: StudyResults, by: Sequence[str] = (), limits: Mapping[str, float] | None = None
) -> dict[str, Any]:
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
            | {
                f"{bearing.name}.{quantity} > {limit:g}": [
                    {"from": cell["from"], "to": cell["to"], **_numbers(cell["known"])}
                    for cell in results.map(f"{bearing.name}.{quantity}", name, above=limit)
                ]
                for bearing in study.machine.touchdown_bearings
                for quantity, limit in (WHIRL | dict(limits or {})).items()
            }
            for name in by
        },
        "influences": _influences(results),
    }


def _influences(results: StudyResults) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for bearing in results.study.machine.touchdown_bearings:
        for quantity in MATTERS:
            column = f"{bearing.name}.{quantity}"
            try:
                found[column] = [
                    {"name": one.name, "alone": _ends(one.alone), "total": one.total and _ends(one.total)}
                    for one in influences(results, column)
                ]
            except UsageError:
                return {}  # too few drops
    return found


def _ends(known: Known) -> dict[str, float]:
    return {"value": known.value, "lower": known.low, "upper": known.high}


def _numbers(known: Known) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "value": finite(known.value),
        "interval_90": [finite(known.low), finite(known.high)],
        "drops": known.drops,
    }
