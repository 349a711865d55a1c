"""The restart card as a page: the answer, why, what to check, and on which assumptions it hangs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import plotly.graph_objects as go

from rotordrop.estimate.published import Drop
from rotordrop.known import Known
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Card,
    Column,
    Figure,
    KeyFigure,
    Level,
    ReportContent,
    Section,
    Statement,
    Table,
    fact,
    table,
)
from rotordrop.report.quantity import Quantity
from rotordrop.report.spread import finite
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels
from rotordrop.restart.card import ANSWERS, RestartCard, answer_in
from rotordrop.units import format_amount, format_chance, format_quantity, percent

if TYPE_CHECKING:
    from rotordrop.restart.foreseen import NextDrop

_LEVELS: dict[str, Level] = {
    "restart": "good",
    "restart with limits": "warning",
    "inspect first": "warning",
    "replace": "bad",
}
SCOPE = (
    "A decision by expected cost. Damage is never measured here: its chances are assumptions, moved by what "
    "the estimate and the checks show."
)
RESTART = "Restart"
NO_DROPS = "The next drop is foreseen where the machine file and a limit are given."


def restart_page(card: RestartCard, drop: Drop) -> ReportContent:
    """Build the page of a restart card."""
    columns = (
        Column("damage", "label"),
        Column("chance by one drop", lambda one: f"{100.0 * one.prior:.3g} %"),
        Column("risk of running on", lambda one: f"{100.0 * one.risk:.3g} %"),
        Column("remedy", "remedy"),
        Column("source", "source"),
    )
    kinds = table(card.assumptions.damages.values(), columns, "Kinds of damage as they are assumed")
    return ReportContent(
        title=f"Restart of {drop.machine}: {card.answer}",
        subtitle=f"after the drop {drop.record} at {format_quantity(2.0 * math.pi * drop.speed_Hz, 'speed')}",
        simulated=SIMULATED_RECORD if drop.simulated_record else "",
        verdict=_said(card),
        cards=tuple(_bearing(card, drop, name) for name in drop.bearings),
        summary=(_answers(card), _checks(card)),
        facts=(("assumptions", card.assumptions.source), ("estimate", drop.verdict)),
        sections=(
            Section("What may be damaged", tables=(_suspected(card), *_evidence(card))),
            Section("On what the answer hangs", tables=(_flips(card), _costs(card), kinds)),
            _next(card),
        ),
    )


def restart_section(card: RestartCard) -> Section:
    """The card as a part of the report on its drop: answer, costs, checks, what may be damaged."""
    tables = (_answers(card), _checks(card), _suspected(card), *_evidence(card))
    return Section(RESTART, statements=_said(card), tables=tables)


def _said(card: RestartCard) -> tuple[Statement, ...]:
    first, *rest = card.statements
    lead: list[Statement] = []
    if card.prior_alone:
        lead, (first, *rest) = [Statement(first, "warning")], rest
    return (*lead, Statement(first, _LEVELS[card.answer]), *map(Statement, rest), Statement(SCOPE))


def _bearing(card: RestartCard, drop: Drop, name: str) -> Card:
    numbers = drop.bearings[name].numbers
    stated = (
        ("peak_force_N", "peak bearing force", "force"),
        ("peak_stress_Pa", "peak Hertz stress", "pressure"),
    )
    shown = [
        KeyFigure(label, Quantity(value=found.value, kind=kind, interval_90=found.interval))
        for key, label, kind in stated
        if (found := numbers.get(key)) is not None
    ]
    here = [one for one in card.suspicions if one.bearing == name]
    some = 1.0 - math.prod(1.0 - one.probability for one in here)
    likeliest = f"most likely a {card.assumptions.damages[here[0].kind].label}"
    return Card(name, (*shown, fact("chance of a damage", some, "probability", 2, likeliest)))


def _answers(card: RestartCard) -> Table:
    bounds = {
        name: format_chance(bound) for name, bound in zip(ANSWERS, card.bounds, strict=False) if bound > 0.0
    }
    columns = (
        Column("answer", lambda name: f"{name} ←" if name == card.answer else name),
        Column(f"expected cost [{card.assumptions.unit}]", lambda name: format_amount(card.costs[name])),
        Column("up to a chance of a damage of", lambda name: bounds.get(name, "–")),
        Column("right if the state was known", lambda name: card.right[name], "probability", 2),
    )
    return table(ANSWERS, columns, "The four answers")


def _checks(card: RestartCard) -> Table:
    unit = card.assumptions.unit
    columns = (
        Column("check", "label"),
        Column(f"costs [{unit}]", lambda one: format_amount(one.cost)),
        Column("changes the answer", "settles", "probability", 2),
        Column(f"saves, its cost taken off [{unit}]", lambda one: format_amount(one.value)),
    )
    made = ", ".join(f"{card.assumptions.checks[name].label} ({how})" for name, how in card.made.items())
    return table(card.checks, columns, f"Checks before a restart{f'; made: {made}' if made else ''}")


def _suspected(card: RestartCard) -> Table:
    kinds = card.assumptions.damages
    columns = (
        Column("damage", lambda one: kinds[one.kind].label),
        Column("where", lambda one: one.bearing or "rotor"),
        Column("chance before", "prior", "probability", 2),
        Column("chance now", "probability", "probability", 2),
    )
    return table(
        card.suspicions, columns, "Kinds of damage", "Before: by the number of drops and the peak stress."
    )


def _evidence(card: RestartCard) -> tuple[Table, ...]:
    if not card.indicators:
        return ()
    kinds = card.assumptions.damages
    columns = (
        Column("found", "what"),
        Column("where", lambda one: one.bearing or "rotor"),
        Column("speaks of a", lambda one: kinds[one.kind].label),
        Column("odds times", lambda one: format_amount(one.ratio)),
    )
    return (table(card.indicators, columns, "What changed since the earlier drop"),)


def _flips(card: RestartCard) -> Table:
    columns = (
        Column("assumption", "of"),
        Column("times", lambda one: f"{one.factor:.2g}"),
        Column("answer then", lambda one: answer_in(card, one)),
    )
    return table(card.flips, columns, "Where the answer flips")


def _costs(card: RestartCard) -> Table:
    one = card.assumptions
    rows = (
        ("a day of standstill", one.cost(one.day_cost)),
        ("a set of touchdown bearings", one.cost(one.bearing_set_cost)),
        ("a damaged machine", one.cost(one.machine_cost)),
        ("opening and looking", f"{one.inspection_days:g} d"),
        ("exchange or repair after that", f"{one.exchange_days:g} d"),
        ("exchange in one go", f"{one.replace_days:g} d"),
        (
            "running with limits",
            f"{one.limited_days:g} d, and {percent(one.limited_risk)} of the risk is left",
        ),
        ("risk with sound bearings", percent(one.sound_risk, 2)),
        ("another drop until the next planned inspection", percent(one.another_drop)),
        ("damage allowed in a restart without limits", percent(one.most_doubt, 1)),
        (
            "chance to pass a limit that a speed limit brings it down to",
            percent(one.most_beyond, 1),
        ),
    )
    columns = (Column("assumption", lambda row: row[0]), Column("value", lambda row: row[1]))
    return table(rows, columns, "Costs and chances", f"Source: {one.source}.")


def _next(card: RestartCard) -> Section:
    drops = card.foreseen.drops
    if not drops:
        return Section("The next drop", text=(NO_DROPS,))

    def high(of: str, name: str) -> Any:
        return lambda one: getattr(one, of)[name][1].value

    names = list(drops[0].peak_force)
    columns = (
        Column("speed", "speed", "speed", 3),
        *(
            Column(f"{name}: 95 % of peak forces below", high("peak_force", name), "force", 3)
            for name in names
        ),
        *(
            Column(f"{name}: 95 % of peak stresses below", high("peak_stress", name), "pressure", 3)
            for name in names
        ),
        Column(
            f"passes {card.foreseen.limits_in_words}" if card.foreseen.limits else "passes a limit",
            lambda one: _with_ends(one.beyond_limit) if one.beyond_limit else "no limit given",
        ),
        Column("simulated drops", lambda one: str(one.peak_force[names[0]][0].drops)),
    )
    of = "as this estimate found it" if card.foreseen.of_estimate else "by its file alone"
    note = f"Simulated, the machine {of}; no damage is simulated."
    return Section(
        "The next drop",
        figures=(Figure(_by_speed(drops, names), "Half of the next drops, and 95 % of them, stay below."),),
        tables=(table(drops, columns, "The next drop by speed", note),),
    )


def _with_ends(known: Known) -> str:
    """A chance and its interval as the sentence above writes them."""
    low, high = (format_chance(end) for end in known.interval_90 or (known.value,) * 2)
    return f"{format_chance(known.value)} ({low} to {high})"


def _by_speed(drops: Sequence[NextDrop], names: Sequence[str]) -> go.Figure:
    figure = panels(names)
    for column, name in enumerate(names, start=1):
        for k, label in enumerate(("half of the drops below", "95 % of the drops below")):
            figure.add_scatter(
                x=[one.speed / (2.0 * math.pi) for one in drops],
                y=[one.peak_force[name][k].value / 1e3 for one in drops],
                mode="lines+markers",
                name=label,
                legendgroup=label,
                showlegend=column == 1,
                line={"color": SERIES[k]},
                row=1,
                col=column,
            )
        figure.update_xaxes(title_text=axis_title("speed at power-off", "Hz"), col=column)
    figure.update_yaxes(title_text=axis_title("peak force", "kN"), rangemode="tozero", col=1)
    return fit_legend(figure)


def restart_numbers(card: RestartCard) -> dict[str, Any]:
    """The card ready for JSON (SI; costs in the unit of the assumptions)."""
    content: dict[str, Any] = finite(
        asdict(card) | {"assumptions": card.assumptions.model_dump(), "unit": card.assumptions.unit}
    )
    return {"format": "rotordrop restart 1"} | content
