"""What is known when a machine is to run again, as a page: changes, next drop, lift, open checks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import plotly.graph_objects as go

from rotordrop.estimate.published import Drop
from rotordrop.files import finite
from rotordrop.known import Known
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Column,
    Figure,
    ReportContent,
    Section,
    Statement,
    Table,
    table,
)
from rotordrop.report.style import SERIES, curve, finished, panels
from rotordrop.restart.card import POSITIVE, Foreseen, LiftNow, NextDrop, RestartCard
from rotordrop.restart.damages import CHECKS, DAMAGES, Check
from rotordrop.restart.evidence import Indicator
from rotordrop.severity.numbers import NUMBERS
from rotordrop.units import format_amount, format_chance, format_quantity

SCOPE = (
    "Whether the machine may run again is for its owner to decide; no damage is measured here, and how many "
    "drops a set of touchdown bearings may take is for maker and operator to agree (ISO 14839-5:2022)."
)
RATIO_NOTE = (
    "Likelihood ratio: how much likelier the change is with the damage than on a sound machine; the sizes of "
    "damages and the scatter of a sound machine are assumed."
)
NO_DROPS = "No next drop was simulated."


def restart_page(card: RestartCard, drop: Drop) -> ReportContent:
    """Build the page of a restart card."""
    return ReportContent(
        title=f"Restart of {drop.machine}",
        subtitle=f"after the drop {drop.record} at {format_quantity(2.0 * math.pi * drop.speed_Hz, 'speed')}",
        simulated=SIMULATED_RECORD if drop.simulated_record else "",
        verdict=tuple(_said(card, drop)),
        facts=(("estimate", drop.verdict),),
        sections=(
            Section("What changed", tables=(evidence_table(card.indicators),) if card.indicators else ()),
            Section("Open checks", tables=(_checks(card.checks),)),
            _next(card.foreseen),
        ),
    )


def _said(card: RestartCard, drop: Drop) -> Iterator[Statement]:
    yield _of_changes(card, drop)
    yield from (
        Statement(f"{words}. Nothing is concluded from that drop.", "warning") for words in card.apart
    )
    for one in card.indicators:
        if one.smaller is not None:
            yield Statement(
                f"A contradiction: {one.what} since {one.since}, {one.smaller:.1f} standard errors below no "
                "change, and a bearing only wears wider. One of the two estimates is wrong, a sensor moved, "
                "or the bearings are not the same set; this gap is no evidence against wear.",
                "warning",
            )
    for name, outcome in card.made.items():
        if outcome == "bad":
            yield Statement(f"{CHECKS[name].label} was bad: {_shown_by(CHECKS[name].shows)}", "warning")
    if drop.later_warning:
        yield Statement(drop.later_warning, "warning")
    yield from map(Statement, _of_next_drop(card.foreseen))
    yield from map(Statement, _of_lift(card.foreseen.lift))
    if card.checks:
        names = (one.label + (_expected(card) if name == "lift" else "") for name, one in card.checks.items())
        yield Statement(f"Open checks: {', '.join(names)}.")
    yield Statement(SCOPE)


def _of_changes(card: RestartCard, drop: Drop) -> Statement:
    """What the changes since the earlier drops speak of."""
    if not drop.consistent:
        return Statement(
            "The model is not consistent with this record: its parameters are no evidence.", "warning"
        )
    if not card.since:
        return Statement("No earlier estimate to compare with: nothing is known of a change.")
    if card.positive:
        found = "; ".join(
            f"{one.what} since {one.since}, {_times(one.ratio)} times likelier with a "
            f"{DAMAGES[one.kind].label} than on a sound machine"
            for one in card.positive
        )
        return Statement(f"Evidence of damage: {found}.", "warning")
    return Statement(f"No change since {card.since[0]} speaks of damage.", "good")


def _times(ratio: float) -> str:
    """A likelihood ratio; how much larger than a thousand it is, the tails decide that nobody knows."""
    return "over 1000" if ratio > 1000.0 else format_amount(ratio)


def _expected(card: RestartCard) -> str:
    """What a lift check would show of a sound machine."""
    if not card.gaps:
        return ""
    gaps = ", ".join(
        f"{name} {1e6 * low:.0f} to {1e6 * high:.0f} µm" for name, (low, high) in card.gaps.items()
    )
    return f" (expect {gaps}; more is wear)"


def _shown_by(kinds: Sequence[str]) -> str:
    return ", ".join(DAMAGES[kind].label for kind in kinds)


def evidence_table(found: Sequence[Indicator]) -> Table:
    """Each change with its likelihood ratio."""
    columns = (
        Column("change", "what"),
        Column("since", "since"),
        Column("damage", lambda one: DAMAGES[one.kind].label),
        Column("likelihood ratio", lambda one: _times(one.ratio)),
    )
    return table(
        found, columns, "Changes since earlier drops", f"{RATIO_NOTE} {POSITIVE:g} is positive evidence."
    )


def _checks(checks: Mapping[str, Check]) -> Table:
    columns = (Column("check", "label"), Column("would show", lambda one: _shown_by(one.shows)))
    return table(checks.values(), columns, "Checks that were not made")


def _of_next_drop(foreseen: Foreseen) -> Iterator[str]:
    """What the next drop would be at full speed, and up to which speed it keeps to the limits."""
    if not foreseen.drops:
        return
    full = foreseen.drops[0]
    of = "as this estimate found the machine" if foreseen.of_estimate else "by the machine file alone"
    count = full.peak_force[next(iter(full.peak_force))][0].drops
    peaks = "; ".join(
        f"{name} {format_quantity(force[1].value, 'force')} and "
        f"{format_quantity(full.peak_stress[name][1].value, 'pressure')}"
        for name, force in full.peak_force.items()
    )
    yield (
        f"Next drop from {format_quantity(full.speed, 'speed')}, {of}: for "
        f"{format_quantity(foreseen.duration, 'time')} 95 % of {count} simulated ones stay below {peaks}"
    )
    if full.beyond_limit is not None:
        yield f"By these alone it passes the limit, {_limits(foreseen)}, with {_with_ends(full.beyond_limit)}"
        yield _of_speed_limit(foreseen)


def _limits(foreseen: Foreseen) -> str:
    """The limits by name, value and unit, "peak Hertz stress of 2500 MPa"."""
    return " or ".join(
        f"{one.label} of {format_quantity(foreseen.limits[one.field], one.kind, 4)}"
        for one in NUMBERS
        if one.field in foreseen.limits
    )


def _of_speed_limit(foreseen: Foreseen) -> str:
    """Up to which simulated speed it keeps to the limits, and with what the next higher one passes them."""
    chances = {one.speed: one.beyond_limit for one in foreseen.drops if one.beyond_limit is not None}
    allowed, limit = format_chance(foreseen.chance), foreseen.speed_limit
    above = [speed for speed in sorted(chances) if limit is None or speed > limit]
    next_one = f"{format_quantity(above[0], 'speed')} with {_with_ends(chances[above[0]])}" if above else ""
    if limit is None:
        return f"No simulated speed brings that chance to {allowed}: it passes even from {next_one}"
    most = format_chance(max(one.high for speed, one in chances.items() if speed <= limit))
    kept = f"{allowed} of the drops at most pass it (90 %: up to {most})"
    if not above:
        return f"No speed limit is needed: from each simulated speed {kept}"
    speed = format_quantity(limit, "speed")
    return f"Speed limit {speed}: from it and each lower simulated speed {kept}, from {next_one}"


def _of_lift(lift: LiftNow | None) -> Iterator[str]:
    """Whether it may be lifted now."""
    if lift is None:
        return
    count = lift.probability.drops or 0
    low, high = (format_chance(end) for end in lift.probability.interval_90 or (lift.probability.value,) * 2)
    within = ""
    if lift.took is not None:
        within = " within " + " to ".join(format_quantity(one, "time", 3) for one in lift.took)
    needs = ", ".join(
        f"{'more than the' if amount is None else f'{amount:.3g} A of'} {lift.limit[name]:.3g} A of {name}"
        for name, amount in lift.current.items()
    )
    yield (
        f"Lift from where it rests: {round(count * lift.probability.value)} of {count} simulated lifts "
        f"succeed{within} (90 %: {low} to {high}); the weight needs {needs}"
    )


def _next(foreseen: Foreseen) -> Section:
    drops = foreseen.drops
    if not drops:
        return Section("The next drop", text=(NO_DROPS,))

    def peak(of: str, name: str) -> Any:
        return lambda one: " / ".join(_shown(known, of) for known in getattr(one, f"peak_{of}")[name])

    names = list(drops[0].peak_force)
    columns = (
        Column("speed", "speed", "speed", 3),
        *(
            Column(f"{name}: half / 95 % of peak {label} below", peak(of, name))
            for of, label in (("force", "forces"), ("stress", "stresses"))
            for name in names
        ),
        Column(
            f"passes {_limits(foreseen)}" if foreseen.limits else "passes a limit",
            lambda one: _with_ends(one.beyond_limit) if one.beyond_limit else "no limit given",
        ),
        Column("simulated drops", lambda one: str(one.peak_force[names[0]][0].drops)),
    )
    of = "as this estimate found it" if foreseen.of_estimate else "by its file alone"
    note = f"Simulated, the machine {of}; no damage is simulated. In brackets: 90 % intervals."
    return Section(
        "The next drop",
        figures=(Figure(_by_speed(drops, names), "Half of the next drops, and 95 % of them, stay below."),),
        tables=(table(drops, columns, "The next drop by speed", note),),
    )


def _shown(known: Known, of: str) -> str:
    kind = "pressure" if of == "stress" else of
    low, high = known.interval_90 or (known.value,) * 2
    value, least = (format_quantity(number, kind) for number in (known.value, low))
    # of few drops even the largest may lie below the quantile
    return f"{value} ({least} {f'to {format_quantity(high, kind)}' if math.isfinite(high) else 'or more'})"


def _with_ends(known: Known) -> str:
    """A chance and its interval."""
    low, high = (format_chance(end) for end in known.interval_90 or (known.value,) * 2)
    return f"{format_chance(known.value)} (90 %: {low} to {high})"


def _by_speed(drops: Sequence[NextDrop], names: Sequence[str]) -> go.Figure:
    figure = panels(names)
    for column, name in enumerate(names, start=1):
        for k, label in enumerate(("half of the drops below", "95 % of the drops below")):
            speeds = [one.speed / (2.0 * math.pi) for one in drops]
            peaks = [one.peak_force[name][k].value / 1e3 for one in drops]
            look: dict[str, Any] = {"mode": "lines+markers", "line": {"color": SERIES[k]}}
            curve(figure, speeds, peaks, label, column=column, legend=column == 1, **look)
    figure.update_yaxes(rangemode="tozero", col=1)
    return finished(figure, "speed at power-off [Hz]", "peak force [kN]")


def restart_numbers(card: RestartCard) -> dict[str, Any]:
    """The card ready for JSON (SI)."""
    content: dict[str, Any] = finite(asdict(card))
    return {"format": "rotordrop restart 1"} | content
