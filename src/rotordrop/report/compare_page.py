"""The report on several drops: how hard each was, and how sure the ranking is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields

import numpy as np

from rotordrop._version import __version__
from rotordrop.errors import UsageError
from rotordrop.report.compared_drop import LESS_IS_WORSE, NUMBERS, ComparedDrop, left_out
from rotordrop.report.comparison import comparison_figure
from rotordrop.report.content import Cell, Figure, ReportContent, Section, Statement, Table
from rotordrop.report.limits import limit_statement
from rotordrop.report.quantity import Quantity
from rotordrop.report.stress_box import StressBox, stress_box_figure, stress_table
from rotordrop.severity.numbers import NOTE, SEVERITY
from rotordrop.severity.ranking import DropSeverity, Ranking, rank_drops
from rotordrop.severity.statistics import StressStatistics

RANKED = tuple(key for key, _, _ in NUMBERS if "fatigue" not in key)
"""Numbers that rank drops; shares of a life have upper ends only."""
FIRST = ("peak_force_N", "peak_stress_Pa")
"""Those whose ranking is said in words even where it cannot be given."""


LOADS = tuple(number for number in NUMBERS if number[0] not in {one.field for one in SEVERITY})
"""Force and stress, which every estimate states."""
_DRAWN = frozenset((*(key for key, _, _ in LOADS), "severity.impulse_N_s", "severity.skid_energy_J"))


def compare_page(
    drops: Sequence[ComparedDrop],
    *,
    machine_name: str = "",
    drop_scatter: Mapping[str, float] | None = None,
    limits: Mapping[str, float] | None = None,
    allowed: int | None = None,
) -> ReportContent:
    """Build the report that compares several drops of one machine.

    Parameters
    ----------
    drops : sequence of ComparedDrop
        At least two drops with the same bearings.
    machine_name : str
        Name of the machine.
    drop_scatter : mapping, optional
        Standard deviation between equal drops by name of the number (``"peak_force_N"`` [N], …).
    limits : mapping, optional
        Limits by name of the number [SI], which somebody gives.
    allowed : int, optional
        Drops that somebody allows.
    """
    bearings = _bearings(drops)
    return ReportContent(
        title=f"Comparison of {len(drops)} drops" + (f" of {machine_name}" if machine_name else ""),
        subtitle=", ".join(drop.name for drop in drops),
        simulated=_simulated(drops),
        verdict=(
            *_verdict(drops, bearings, drop_scatter or {}),
            limit_statement(drops, limits or {}, allowed),
        ),
        summary=tuple(_number_table(drops, bearing) for bearing in bearings),
        facts=(("rotordrop", __version__),),
        sections=(_number_section(drops, bearings, drop_scatter or {}),),
    )


def _bearings(drops: Sequence[ComparedDrop]) -> tuple[str, ...]:
    if len(drops) < 2:
        raise UsageError(f"comparison: {len(drops)} drop given, at least two are needed")
    bearings = tuple(drops[0].numbers)
    for drop in drops[1:]:
        if set(drop.numbers) != set(bearings):
            raise UsageError(
                f"comparison: {drop.name} has the bearings {', '.join(drop.numbers)}, {drops[0].name} has "
                f"{', '.join(bearings)}; only drops of one machine can be compared"
            )
    return bearings


def _simulated(drops: Sequence[ComparedDrop]) -> str:
    names = [drop.name for drop in drops if drop.simulated]
    if not names:
        return ""
    return f"The records of these drops are simulated, not measured: {', '.join(names)}."


def rankings(
    drops: Sequence[ComparedDrop], bearings: Sequence[str], drop_scatter: Mapping[str, float]
) -> dict[tuple[str, str], Ranking]:
    """Rank the drops by every number at every bearing, where every drop states its error.

    Estimates that do not fit their record, and second estimates of one recording, take no part.
    """
    found = {}
    excluded = left_out(drops)
    ranked = [drop for drop in drops if drop.name not in excluded]
    if len(ranked) < 2:
        return {}
    for bearing in bearings:
        for key in RANKED:
            severities = [_severity(drop, bearing, key) for drop in ranked]
            known = [severity for severity in severities if severity is not None]
            if len(known) == len(ranked):
                found[bearing, key] = rank_drops(
                    known, drop_scatter=drop_scatter.get(key), more_is_worse=key not in LESS_IS_WORSE
                )
    return found


def _severity(drop: ComparedDrop, bearing: str, key: str) -> DropSeverity | None:
    quantity = drop.numbers[bearing].get(key)
    if quantity is None or not math.isfinite(quantity.value):
        return None
    if quantity.interval_90 is not None:
        return DropSeverity.from_interval(drop.name, quantity.value, quantity.interval_90)
    if quantity.standard_error is None:
        return None
    return DropSeverity(name=drop.name, value=quantity.value, standard_error=quantity.standard_error)


def _verdict(
    drops: Sequence[ComparedDrop], bearings: Sequence[str], drop_scatter: Mapping[str, float]
) -> tuple[Statement, ...]:
    names = {key: name for key, name, _ in NUMBERS}
    ranked = rankings(drops, bearings, drop_scatter)
    excluded = left_out(drops)
    statements = [
        Statement(text=f"{name} is left out of the ranking: {why}{_reach(drops, name)}.", level="bad")
        for name, why in excluded.items()
    ]
    statements += _machines(drops)
    for bearing in bearings:
        for key in FIRST:
            if (bearing, key) in ranked:
                text = f"{bearing}, {names[key]}: {ranked[bearing, key].statement}."
            elif len(drops) - len(excluded) < 2:
                text = f"{bearing}, {names[key]}: fewer than two drops are left to rank."
            else:
                text = (
                    f"{bearing}, {names[key]}: not every drop states an interval, so the order of the "
                    "numbers says nothing about which drop was the worst."
                )
            statements.append(Statement(text=text))
    statements += [
        Statement(text=f"{drop.name}: {warning}", level="warning")
        for drop in drops
        for warning in drop.warnings
    ]
    return tuple(statements)


def _machines(drops: Sequence[ComparedDrop]) -> list[Statement]:
    """Say it where drops of several machines stand side by side: their numbers mean different things."""
    names = sorted({drop.machine for drop in drops if drop.machine})
    if len(names) < 2:
        return []
    whose = "; ".join(
        f"{name}: {', '.join(drop.name for drop in drops if drop.machine == name)}" for name in names
    )
    return [Statement(text=f"These are drops of {len(names)} machines, {whose}.", level="warning")]


def _reach(drops: Sequence[ComparedDrop], name: str) -> str:
    """Between what the peak force of a drop may lie, for the statement that leaves it out."""
    parts = []
    for bearing, numbers in next(drop for drop in drops if drop.name == name).numbers.items():
        peak = numbers.get("peak_force_N")
        if peak is not None and peak.interval_90 is not None:
            parts.append(f"{bearing} {peak.interval_text}")
    return f"; its peak force may be {', '.join(parts)}" if parts else ""


def _number_table(drops: Sequence[ComparedDrop], bearing: str) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for drop in drops:
        speed = Quantity(value=drop.speed, kind="speed", digits=3)
        name = drop.name if drop.consistent else f"{drop.name} (not consistent with its record)"
        rows.append(
            (
                name,
                drop.minute or "–",
                speed,
                *(_number(drop, bearing, key, kind) for key, _, kind in LOADS),
            )
        )
    return Table(
        columns=("drop", "recorded", "speed", *(name for _, name, _ in LOADS)),
        rows=tuple(rows),
        caption=f"{bearing} touchdown bearing",
        note="Below a number: its 90 % interval. Peaks are the largest value within the drop.",
    )


def _severity_table(drops: Sequence[ComparedDrop], bearing: str) -> Table:
    """One line a number, one column a drop, and below what the worst impact of each was."""
    rows: list[tuple[Cell, ...]] = [
        (name, *(_number(drop, bearing, key, kind) for drop in drops))
        for key, name, kind in NUMBERS
        if any(key in drop.numbers[bearing] for drop in drops)
    ]
    rows.append(("worst impact", *(drop.hardest.get(bearing, "–") for drop in drops)))
    return Table(
        columns=("severity", *(drop.label for drop in drops)),
        rows=tuple(rows),
        caption=f"{bearing}: severity of every drop",
        note=NOTE,
    )


def _boxes(drops: Sequence[ComparedDrop]) -> tuple[StressBox, ...]:
    known = {item.name for item in fields(StressStatistics)}
    empty = {"preload_stress": None, "preload_share": None}
    return tuple(
        StressBox(
            label=drop.name,
            bearing=bearing,
            statistics=StressStatistics(
                **(empty | {key: value for key, value in numbers.items() if key in known})
            ),
            outliers=np.zeros(0),
        )
        for drop in drops
        for bearing, numbers in drop.statistics.items()
    )


def _number(drop: ComparedDrop, bearing: str, key: str, kind: str) -> Quantity:
    return drop.numbers[bearing].get(key, Quantity(value=math.nan, kind=kind))


def _number_section(
    drops: Sequence[ComparedDrop], bearings: Sequence[str], drop_scatter: Mapping[str, float]
) -> Section:
    figures, tables = [], []
    ranked = rankings(drops, bearings, drop_scatter)
    for key, name, kind in NUMBERS:
        if not any(key in drop.numbers[bearing] for drop in drops for bearing in bearings):
            continue
        values = {bearing: [_number(drop, bearing, key, kind) for drop in drops] for bearing in bearings}
        caption = f"{name[0].upper()}{name[1:]} of every drop with its 90 % interval."
        if key in _DRAWN:
            figures.append(
                Figure(chart=comparison_figure([drop.name for drop in drops], values, name), caption=caption)
            )
        tables += [
            _ranking_table(f"{bearing}: ranking by {name}", ranked[bearing, key], kind)
            for bearing in bearings
            if (bearing, key) in ranked
        ]
    boxes = _boxes(drops)
    if boxes:
        figures.append(
            Figure(
                chart=stress_box_figure(boxes),
                caption="Distribution of the stress within each drop, outliers left out (Neisi 2020, "
                "Fig. 16).",
            )
        )
        tables.append(stress_table(boxes))
    severity = tuple(_severity_table(drops, bearing) for bearing in bearings)
    return Section(heading="Severity", figures=tuple(figures), tables=(*severity, *tables))


def _ranking_table(caption: str, ranking: Ranking, kind: str) -> Table:
    conditions = ranking.worst_condition or (math.nan,) * len(ranking.names)
    worse = (*ranking.worse_than_next, math.nan)
    rows = tuple(
        (
            name,
            Quantity(value=value, kind=kind),
            Quantity(value=drop, kind="probability"),
            Quantity(value=below, kind="probability"),
            Quantity(value=condition, kind="probability"),
        )
        for name, value, drop, below, condition in zip(
            ranking.names, ranking.values, ranking.worst_drop, worse, conditions, strict=True
        )
    )
    scatter = (
        "The scatter between equal drops is unknown, so nothing is said about conditions."
        if ranking.drop_scatter is None
        else f"Scatter between equal drops: {Quantity(value=ranking.drop_scatter, kind=kind).text} "
        "(standard deviation)."
    )
    return Table(
        columns=(
            "drop, worst first",
            "value",
            "was the worst drop",
            "was worse than the next",
            "has the worst conditions",
        ),
        rows=rows,
        caption=caption,
        note=f"Probabilities follow from the intervals of the drops. {scatter}",
    )
