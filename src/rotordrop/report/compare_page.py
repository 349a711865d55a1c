"""The report on several drops: how hard each was, and how sure the ranking is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.errors import UsageError
from rotordrop.report.compared_drop import ComparedDrop, left_out
from rotordrop.report.content import Column, Figure, ReportContent, Section, Statement, Table, table
from rotordrop.report.limits import limit_statement
from rotordrop.report.quantity import Quantity, display_unit, shown
from rotordrop.report.stress_box import StressBox, stress_box_figure
from rotordrop.report.style import axis_title, bars, curve, fit_legend, panels, plain
from rotordrop.severity.numbers import LOADS, NOTE, NUMBERS, Number
from rotordrop.severity.ranking import DropSeverity, Ranking, rank_drops

RANKED = tuple(number for number in NUMBERS if "fatigue" not in number.field)
"""Numbers that rank drops; shares of a life have upper ends only."""
FIRST = tuple(number for number in LOADS if number.field in ("peak_force_N", "peak_stress_Pa"))
"""Those whose ranking is said in words even where it cannot be given."""
_DRAWN = frozenset((*(n.field for n in LOADS), "severity.impulse_N_s", "severity.skid_energy_J"))

Rankings = Mapping[tuple[str, str], Ranking]
"""Rankings by bearing and field of the number."""


def compare_page(
    drops: Sequence[ComparedDrop],
    *,
    machine_name: str = "",
    drop_scatter: Mapping[str, float] | None = None,
    limits: Mapping[str, float] | None = None,
    allowed: int | None = None,
) -> ReportContent:
    """Build the report that compares at least two drops with the same bearings.

    The scatter between equal drops (1 s.d.) and the limits are known by the field of a number, such as
    ``"peak_force_N"`` [SI]; so many drops are allowed.
    """
    bearings = _bearings(drops)
    ranked = rankings(drops, bearings, drop_scatter or {})
    simulated = [one.name for one in drops if one.drop.simulated_record]
    text = f"The records of these drops are simulated, not measured: {', '.join(simulated)}."
    return ReportContent(
        title=f"Comparison of {len(drops)} drops" + (f" of {machine_name}" if machine_name else ""),
        subtitle=", ".join(one.name for one in drops),
        simulated=text if simulated else "",
        verdict=(*_verdict(drops, bearings, ranked), limit_statement(drops, limits or {}, allowed)),
        summary=tuple(_number_table(drops, bearing) for bearing in bearings),
        facts=(("rotordrop", __version__),),
        sections=(_severity_section(drops, bearings, ranked),),
    )


def _bearings(drops: Sequence[ComparedDrop]) -> tuple[str, ...]:
    if len(drops) < 2:
        raise UsageError(f"comparison: {len(drops)} drop given, at least two are needed")
    bearings = tuple(drops[0].drop.bearings)
    for one in drops[1:]:
        if set(one.drop.bearings) != set(bearings):
            raise UsageError(
                f"comparison: {one.name} has the bearings {', '.join(one.drop.bearings)}, {drops[0].name} "
                f"has {', '.join(bearings)}; only drops of one machine can be compared"
            )
    return bearings


def rankings(
    drops: Sequence[ComparedDrop], bearings: Sequence[str], drop_scatter: Mapping[str, float]
) -> Rankings:
    """Rank the drops by every number at every bearing, where every drop states its error.

    Estimates that do not fit their record, and second estimates of one recording, take no part.
    """
    found: dict[tuple[str, str], Ranking] = {}
    excluded = left_out(drops)
    taken = [one for one in drops if one.name not in excluded]
    if len(taken) < 2:
        return found
    for bearing in bearings:
        for number in RANKED:
            severities = [_severity(one.name, one.number(bearing, number)) for one in taken]
            known = [severity for severity in severities if severity is not None]
            if len(known) == len(taken):
                scatter, more = drop_scatter.get(number.field), number.more_is_worse
                ranking = rank_drops(known, drop_scatter=scatter, more_is_worse=more)
                found[bearing, number.field] = ranking
    return found


def _severity(name: str, quantity: Quantity) -> DropSeverity | None:
    if not math.isfinite(quantity.value):
        return None
    if quantity.interval_90 is not None:
        return DropSeverity.from_interval(name, quantity.value, quantity.interval_90)
    if quantity.standard_error is None:
        return None
    return DropSeverity(name=name, value=quantity.value, standard_error=quantity.standard_error)


def _verdict(
    drops: Sequence[ComparedDrop], bearings: Sequence[str], ranked: Rankings
) -> tuple[Statement, ...]:
    excluded = left_out(drops)
    by_name = {one.name: one for one in drops}
    said = [
        Statement(f"{name} is left out of the ranking: {why}{_reach(by_name[name])}.", "bad")
        for name, why in excluded.items()
    ]
    machines = sorted({one.drop.machine for one in drops if one.drop.machine})
    if len(machines) > 1:  # their numbers mean different things
        whose = "; ".join(
            f"{name}: {', '.join(one.name for one in drops if one.drop.machine == name)}" for name in machines
        )
        said.append(Statement(f"These are drops of {len(machines)} machines, {whose}.", "warning"))
    for bearing in bearings:
        for number in FIRST:
            if (bearing, number.field) in ranked:
                text = f"{ranked[bearing, number.field].statement}."
            elif len(drops) - len(excluded) < 2:
                text = "fewer than two drops are left to rank."
            else:
                text = (
                    "not every drop states an interval, so the order of the numbers says nothing about which "
                    "drop was the worst."
                )
            said.append(Statement(f"{bearing}, {number.label}: {text}"))
    said += [Statement(f"{one.name}: {text}", "warning") for one in drops for text in one.drop.warnings]
    return tuple(said)


def _reach(one: ComparedDrop) -> str:
    """Between what the peak force of a drop may lie, for the statement that leaves it out."""
    peaks = {bearing: one.number(bearing, LOADS[0]) for bearing in one.drop.bearings}
    parts = [f"{bearing} {peak.text}" for bearing, peak in peaks.items() if peak.interval_90]
    return f"; its peak force may be {', '.join(parts)}" if parts else ""


def _number_table(drops: Sequence[ComparedDrop], bearing: str) -> Table:
    def name(one: ComparedDrop) -> str:
        return one.name if one.drop.consistent else f"{one.name} (not consistent with its record)"

    def stated(number: Number) -> Column:
        return Column(number.label, lambda one: one.number(bearing, number))

    columns = (
        Column("drop", name),
        Column("recorded", lambda one: one.minute or "–"),
        Column("speed", lambda one: 2 * math.pi * one.drop.speed_Hz, "speed", 3),
        *map(stated, LOADS),
    )
    note = "Below a number: its 90 % interval. Peaks are the largest value within the drop."
    return table(drops, columns, f"{bearing} touchdown bearing", note)


def _severity_table(drops: Sequence[ComparedDrop], bearing: str) -> Table:
    """One line a number, one column a drop, and below what the worst impact of each was."""

    def of(one: ComparedDrop) -> Column:
        return Column(
            one.label,
            lambda number: one.number(bearing, number) if number else one.hardest(bearing),
        )

    stated = {field for one in drops for field in one.drop.bearings[bearing].numbers}
    rows = [*(number for number in NUMBERS if number.field in stated), None]
    first = Column("severity", lambda number: number.label if number else "worst impact")
    return table(rows, (first, *map(of, drops)), f"{bearing}: severity of every drop", NOTE)


def _boxes(drops: Sequence[ComparedDrop]) -> tuple[StressBox, ...]:
    return tuple(
        StressBox(
            label=one.name,
            bearing=bearing,
            statistics=entry.stress_statistics_Pa,
            outliers=np.zeros(0),
        )
        for one in drops
        if one.drop.consistent  # of others no single number holds
        for bearing, entry in one.drop.bearings.items()
    )


def _severity_section(drops: Sequence[ComparedDrop], bearings: Sequence[str], ranked: Rankings) -> Section:
    figures, tables = [], [_severity_table(drops, bearing) for bearing in bearings]
    stated = {field for one in drops for bearing in bearings for field in one.drop.bearings[bearing].numbers}
    for number in NUMBERS:
        if number.field in stated and number.field in _DRAWN:
            values = {bearing: [one.number(bearing, number) for one in drops] for bearing in bearings}
            caption = f"{number.label[0].upper()}{number.label[1:]} of every drop with its 90 % interval."
            chart = comparison_figure([one.name for one in drops], values, number.label)
            figures.append(Figure(chart, caption))
        tables += [
            _ranking_table(f"{bearing}: ranking by {number.label}", ranked[bearing, number.field], number)
            for bearing in bearings
            if (bearing, number.field) in ranked
        ]
    if not (boxes := _boxes(drops)):
        return Section("Severity", figures=tuple(figures), tables=tuple(tables))
    caption = "Distribution of the stress within each drop, outliers left out (Neisi 2020, Fig. 16)."
    figures.append(Figure(stress_box_figure(boxes), caption))
    return Section("Severity", figures=tuple(figures), tables=tuple(tables))


def _ranking_table(caption: str, ranking: Ranking, number: Number) -> Table:
    def of(values: Sequence[float], k: int) -> float | None:
        return values[k] if k < len(values) else None

    columns = (
        Column("drop, worst first", lambda k: ranking.names[k]),
        Column("value", lambda k: ranking.values[k], number.kind),
        Column("was the worst drop", lambda k: ranking.worst_drop[k], "probability"),
        Column("was worse than the next", lambda k: of(ranking.worse_than_next, k), "probability"),
        Column("has the worst conditions", lambda k: of(ranking.worst_condition or (), k), "probability"),
    )
    scatter = "The scatter between equal drops is unknown, so nothing is said about conditions."
    if ranking.drop_scatter is not None:
        spread = shown(ranking.drop_scatter, number.kind)
        scatter = f"Scatter between equal drops: {spread} (standard deviation)."
    note = f"Probabilities follow from the intervals of the drops. {scatter}"
    return table(range(len(ranking.names)), columns, caption, note)


def comparison_figure(drops: Sequence[str], values: Mapping[str, Sequence[Quantity]], name: str) -> go.Figure:
    """Draw a number of several drops, one quantity per drop and bearing, as points with 90 % intervals."""
    figure = panels(tuple(values), height=290)
    unit = ""
    for column, quantities in enumerate(values.values(), start=1):
        scale, unit = display_unit(quantities[0].kind)
        curve(
            figure,
            [plain(drop) for drop in drops],
            [quantity.value / scale for quantity in quantities],
            f"{name}, 90 % interval",
            column=column,
            mode="markers",
            marker={"size": [0 if quantity.range_only else 9 for quantity in quantities]},
            legend=column == 1,
            error_y=bars([(one.value, *one.ends) for one in quantities], scale, thickness=1.6, width=6),
            customdata=[quantity.text for quantity in quantities],
            hover="%{x}: %{customdata}",
        )
    figure.update_xaxes(type="category", range=[-0.6, len(drops) - 0.4])
    figure.update_yaxes(title_text=axis_title(name, unit), col=1)
    figure.update_yaxes(rangemode="tozero")
    return fit_legend(figure)
