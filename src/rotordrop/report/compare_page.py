"""Drops compared: their numbers and ranks, limits that somebody gives, what changed on the machine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import plotly.graph_objects as go

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop, Value
from rotordrop.known import NINETY
from rotordrop.report.content import Column, Figure, Level, ReportContent, Section, Statement, Table, table
from rotordrop.report.quantity import Quantity, display_unit, one_line, shown
from rotordrop.report.style import axis_title, bars, curve, finished, panels, plain
from rotordrop.severity.numbers import LOADS, NOTE, NUMBERS, Number
from rotordrop.severity.ranking import DropSeverity, Ranking, rank_drops
from rotordrop.twin.allowances import MODEL_STRESS_SIGMA
from rotordrop.units import format_chance, format_minute, percent

RANKED = tuple(one for one in NUMBERS if not one.field.startswith(("severity.fatigue", "severity.static")))
"""Numbers that rank drops; shares of a life have upper ends only, safety factors go with force and stress."""
FIRST = tuple(number for number in LOADS if number.field in ("peak_force_N", "peak_stress_Pa"))
"""Those whose ranking is said in words even where it cannot be given."""
UNKNOWN_SCATTER = "The scatter between equal drops is unknown, so nothing follows for conditions (--scatter)."
_DRAWN = frozenset((*(n.field for n in LOADS), "severity.impulse_N_s", "severity.skid_energy_J"))

Rankings = Mapping[tuple[str, str], Ranking]
"""Rankings by bearing and field of the number."""


def compare_page(
    drops: Sequence[ComparedDrop],
    *,
    drop_scatter: Mapping[str, float] | None = None,
    limits: Mapping[str, float] | None = None,
) -> ReportContent:
    """Build the report that compares at least two drops with the same bearings.

    The scatter between equal drops (1 s.d.) and the limits are known by the field of a number, such as
    ``"peak_force_N"`` [SI].
    """
    bearings = _bearings(drops)
    ranked = rankings(drops, bearings, drop_scatter or {})
    simulated = [one.name for one in drops if one.drop.simulated_record]
    which = "" if len(simulated) == len(drops) else f": {', '.join(simulated)}"
    machines = sorted({one.drop.machine for one in drops if one.drop.machine})
    judged = limit_statement(drops, limits or {})
    said = _verdict(drops, bearings, ranked)
    return ReportContent(
        title=f"Comparison of {len(drops)} drops" + (f" of {', '.join(machines)}" if machines else ""),
        subtitle=", ".join(one.name for one in drops),
        simulated=f"Simulated records{which}." if simulated else "",
        verdict=(judged, *said) if limits else (*said, judged),
        screen=_screen(drops, bearings),
        sections=(_severity_section(drops, bearings),),
    )


def _bearings(drops: Sequence[ComparedDrop]) -> tuple[str, ...]:
    if len(drops) < 2:
        raise UsageError(
            f"{len(drops)} drop to compare; at least two are needed. Give several estimates, or one of "
            "several drops."
        )
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

    Estimates that do not fit their record, and second estimates of one recording, take no part. The balls of
    a bearing are the same in all drops of a machine: what they add to the error of a stress moves no order.
    """
    found: dict[tuple[str, str], Ranking] = {}
    excluded = left_out(drops)
    taken = [one for one in drops if one.name not in excluded]
    if len(taken) < 2:
        return found
    one_machine = len({one.drop.machine for one in taken}) == 1
    for bearing in bearings:
        for number in RANKED:
            balls_shared = one_machine and number.kind == "pressure"
            severities = [
                _severity(one.name, one.drop.bearings[bearing].numbers.get(number.field), balls_shared)
                for one in taken
            ]
            known = [severity for severity in severities if severity is not None]
            if len(known) == len(taken):
                scatter, more = drop_scatter.get(number.field), number.more_is_worse
                ranking = rank_drops(known, drop_scatter=scatter, more_is_worse=more)
                found[bearing, number.field] = ranking
    return found


def _severity(name: str, found: Value | None, balls_shared: bool) -> DropSeverity | None:
    if found is None or (found.interval is None and found.standard_error is None):
        return None
    if found.interval is None:
        return DropSeverity(name=name, value=found.value, standard_error=found.standard_error)
    whole = DropSeverity.from_interval(name, found.value, found.interval)
    if not balls_shared or found.allowance_90 is None:
        return whole
    record = math.sqrt(max(whole.standard_error**2 - (found.allowance_90 / NINETY) ** 2, 0.0))
    return replace(whole, standard_error=math.hypot(record, MODEL_STRESS_SIGMA * found.value))


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
    texts: dict[tuple[str, Level], list[str]] = {}
    # the surest first
    places = [(number, bearing) for number in FIRST for bearing in bearings]
    if len(drops) - len(excluded) < 2:
        places = []
        said.append(Statement("Nothing is ranked: fewer than two drops are left."))
    chance = {key: max(one.worst_drop) for key, one in ranked.items()}
    went_on = any(one.drop.went_on for one in drops)  # a peak may be larger than the one that is ranked
    for number, bearing in sorted(places, key=lambda place: -chance.get((place[1], place[0].field), 1.0)):
        sure = chance.get((bearing, number.field), 0.0) >= SURE and not went_on
        if (bearing, number.field) in ranked:
            text = f"{ranked[bearing, number.field].statement}."
        else:
            text = "not every drop states an interval, so their order does not say which was the worst."
        texts.setdefault((text, "notice" if sure else "warning"), []).append(f"{bearing} {number.label}")
    open_ones = [f"{', '.join(of)}: {text}" for (text, level), of in texts.items() if level == "warning"]
    said += [
        Statement(f"{', '.join(of)}: {text}") for (text, level), of in texts.items() if level == "notice"
    ]
    said += [Statement(" ".join(open_ones), "warning")] if open_ones else []
    of_drops: dict[str, list[str]] = {}
    for one in drops:
        for text in one.drop.warnings:
            of_drops.setdefault(text, []).append(one.name)
    said += [Statement(f"{', '.join(names)}: {text}", "warning") for text, names in of_drops.items()]
    if any(one.drop_scatter is None for one in ranked.values()):
        said.append(Statement(UNKNOWN_SCATTER))
    return tuple(said)


def _reach(one: ComparedDrop) -> str:
    """Between what the peak force of a drop may lie, for the statement that leaves it out."""
    peaks = {bearing: one.number(bearing, LOADS[0]) for bearing in one.drop.bearings}
    parts = [f"{bearing} {peak.text}" for bearing, peak in peaks.items() if peak.interval_90]
    return f"; its peak force may be {', '.join(parts)}" if parts else ""


def _screen(drops: Sequence[ComparedDrop], bearings: Sequence[str]) -> Table:
    """Peaks of every drop, one line a bearing, the largest force first."""

    def stated(number: Number) -> Column:
        return Column(number.label, lambda row: one_line(row[0].number(row[1], number)))

    columns = (
        Column("drop", lambda row: _name(row[0])),
        Column("speed", lambda row: row[0].drop.speed_Hz, "frequency", 3),
        Column("bearing", lambda row: row[1]),
        *map(stated, FIRST),
    )
    rows = [(one, bearing) for one in drops for bearing in bearings]
    rows.sort(key=lambda row: -np.nan_to_num(row[0].number(row[1], FIRST[0]).ends[1]))
    return table(rows, columns)


def _name(one: ComparedDrop) -> str:
    return one.name if one.drop.consistent else f"{one.name} (not consistent with its record)"


def _severity_table(drops: Sequence[ComparedDrop], bearing: str) -> Table:
    """One line a number, one column a drop."""

    def of(one: ComparedDrop) -> Column:
        return Column(one.label, lambda number: one.number(bearing, number))

    stated = {field for one in drops for field in one.drop.bearings[bearing].numbers}
    rows = [number for number in NUMBERS if number.field in stated]
    return table(
        rows, (Column("severity", "label"), *map(of, drops)), f"{bearing}: severity of every drop", NOTE
    )


def _severity_section(drops: Sequence[ComparedDrop], bearings: Sequence[str]) -> Section:
    figures, tables = [], tuple(_severity_table(drops, bearing) for bearing in bearings)
    stated = {field for one in drops for bearing in bearings for field in one.drop.bearings[bearing].numbers}
    for number in NUMBERS:
        if number.field in stated and number.field in _DRAWN:
            values = {bearing: [one.number(bearing, number) for one in drops] for bearing in bearings}
            caption = f"{number.label[0].upper()}{number.label[1:]} of every drop with its 90 % interval."
            chart = comparison_figure([one.name for one in drops], values, number.label)
            figures.append(Figure(chart, caption))
    return Section("Severity", figures=tuple(figures), tables=tables)


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
    figure.update_yaxes(rangemode="tozero")
    return finished(figure, y=axis_title(name, unit))


@dataclass(frozen=True)
class ComparedDrop:
    """One drop of a comparison."""

    name: str
    drop: Drop
    """Its estimate."""

    @property
    def label(self) -> str:
        """Record, date and speed, for a table."""
        minute, speed = format_minute(self.drop.recorded), shown(self.drop.speed_Hz, "frequency", 3)
        return ", ".join(part for part in (self.name, minute, speed) if part)

    def number(self, bearing: str, number: Number) -> Quantity:
        """A number at a bearing with its interval; a dash where the estimate does not state it.

        Of an estimate that is not consistent with its record the interval alone is shown.
        """
        found = self.drop.bearings[bearing].stated(number.field)
        if found is None:
            return Quantity(value=math.nan, kind=number.shown_as)
        return Quantity(
            value=found.value,
            kind=number.shown_as,
            places=number.places,
            interval_90=found.interval,
            standard_error=found.standard_error,
            range_only=not self.drop.consistent,
        )


def left_out(drops: Sequence[ComparedDrop]) -> dict[str, str]:
    """Drops that a ranking must leave out, by name, and why.

    Raises
    ------
    UsageError
        If one recording was estimated twice in the same way.
    """
    reasons: dict[str, str] = {}
    counted: dict[str, ComparedDrop] = {}
    seen: dict[tuple[str, str], ComparedDrop] = {}
    for one in sorted(drops, key=lambda one: not one.drop.consistent):
        record, method = one.drop.record_sha256, one.drop.method
        twin = counted.setdefault(record, one) if record else one
        same = seen.setdefault((record, method), one) if record else one
        if same is not one:
            raise UsageError(
                f"{same.name} and {one.name} are estimates of the same recording; expected another drop in "
                "each. Leave one of them out."
            )
        if not one.drop.consistent:
            reasons[one.name] = "its model is not consistent with its record"
        elif twin is not one:
            reasons[one.name] = f"the same recording as {twin.name}, estimated by {method}"
    return reasons


SURE = 0.95
"""Probability from which a limit counts as kept, or as passed [1]; chosen, not measured."""


def limit_statement(drops: Sequence[ComparedDrop], limits: Mapping[str, float]) -> Statement:
    """The verdict: which limits are kept, passed or open, by the intervals of the drops."""
    if not limits:
        return Statement("No limit given: the numbers are compared with each other alone.")
    parts: list[str] = []
    found: list[bool | None] = []
    known = {number.field: number for number in NUMBERS}
    for field, limit in limits.items():
        text, kept = _against(drops, known[field], limit)
        parts.append(text)
        found.append(kept)
    level: Level = "bad" if False in found else "warning" if None in found else "good"
    return Statement(f"By the limits given: {'; '.join(parts)}.", level)


def _against(drops: Sequence[ComparedDrop], number: Number, limit: float) -> tuple[str, bool | None]:
    """What to say of one limit, and whether it is kept; None while that is open."""
    words = f"{number.label} {shown(limit, number.kind)}"
    beyond, ranges = [], []
    for one in drops:
        for bearing in one.drop.bearings:
            found, who = one.number(bearing, number), f"{one.name} at {bearing}"
            probability = _beyond(found, limit, number)
            if not one.drop.consistent and found.ends[0] < limit < found.ends[1]:  # no share is known
                ranges.append(f"{who}, {found.text}")
            elif probability is None:
                continue
            elif number.only_worsens and bearing in one.drop.went_on and probability < SURE:
                until = f"{1e3 * one.drop.estimated_until_s:.0f} ms"
                ranges.append(f"{who}, {found.text} until {until} and further out after that")
            else:
                beyond.append((probability, who))
    if not beyond and not ranges:
        return f"{words}: no drop states it with an interval", None
    over = [f"{who} ({format_chance(p)})" for p, who in beyond if p >= SURE]
    if over:
        near = [f"{who} ({format_chance(p)})" for p, who in beyond if 1.0 - SURE < p < SURE]
        return f"{words}: passed by {', '.join(over)}{'; open: ' * bool(near)}{', '.join(near)}", False
    if ranges:
        return f"{words}: open: {'; '.join(ranges)}", None
    worst, who = max(beyond)
    if worst > 1.0 - SURE:
        return f"{words}: open, passed by {who} with a probability of {format_chance(worst)}", None
    return f"{words}: kept by all drops (passed by {who} with {percent(worst, 1)} at most)", True


def _beyond(quantity: Quantity, limit: float, number: Number) -> float | None:
    """Probability that a number lies beyond its limit, by its interval [1]; None without one."""
    if quantity.interval_90 is None or not math.isfinite(quantity.value):
        return None
    low, high = quantity.interval_90
    sigma = max((high - low) / (2.0 * NINETY), 1e-12 * max(abs(quantity.value), 1e-300))
    above = 0.5 * math.erfc((limit - quantity.value) / (math.sqrt(2.0) * sigma))  # scipy takes longer to load
    return above if number.more_is_worse else 1.0 - above
