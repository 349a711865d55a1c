"""The reports on many simulated drops: a study, and repeats of an estimate."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import plotly.graph_objects as go

from rotordrop.elements.table import fitted_row
from rotordrop.errors import UsageError, unknown_key
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.machine import kind_of_path
from rotordrop.report.content import (
    Column,
    Figure,
    ReportContent,
    Section,
    Statement,
    Table,
    appendix,
    table,
)
from rotordrop.report.origin import machine_facts
from rotordrop.report.quantity import Quantity as Shown
from rotordrop.report.quantity import display_unit, one_line, shown
from rotordrop.report.simulate_page import EQUAL, SYMMETRIC
from rotordrop.report.style import (
    MUTED,
    OVER,
    SERIES,
    axis_title,
    bars,
    curve,
    finished,
    panels,
    plain,
    upright,
    words,
)
from rotordrop.simulate.used import share_column, stopped
from rotordrop.study.numbers import MATTERS, SHARES, asked, influences_of
from rotordrop.study.plan import case_kind
from rotordrop.study.quantities import LIFT, Quantity
from rotordrop.study.repeat import Repeat
from rotordrop.study.summary import StudyResults
from rotordrop.units import format_quantity

BELOW = 115.0
"""Upper end of the axis of the shares below a value [%]: the label of the last one stands above 100."""
Marks: TypeAlias = Sequence[tuple[str, float, float]]
"""Values that are marked in a distribution: text, value [SI], share of the drops below it [1]."""
SCOPE = "Simulated: the spread is that of the values that vary here, not of all that is unknown."
SENSITIVITY = (
    "Drops of one block differ in one value each: intervals of quantiles, which take drops as independent, "
    "are too narrow here."
)
QUANTILES = (
    "Quantiles over the drops with 90 % intervals from order statistics: how well the number of drops "
    'determines them. "Or more" and "or less" mean that more drops are needed.'
)
DRAWN_DROPS = 1000
"""Drops of a scatter, at even steps of all; chosen, not measured."""
SHARES_OF_VARIANCE = (
    "Alone: the part of the variance over the drops that would go if this value were known. With all others: "
    'the part that would be left if everything else were known; it takes the design "sensitivity". What no '
    "value explains alone is their interplay, which in a drop is chaos."
)


def study_page(
    results: StudyResults, by: Sequence[str] = (), limits: Mapping[str, float] | None = None
) -> ReportContent:
    """Build the report on a study.

    It is drawn against the varied values ``by``; limits [SI] by the quantity of a bearing, such as
    ``"peak_stress"``, ask for the probability to exceed them.
    """
    study = results.study
    columns = [f"{one.name}.{quantity}" for quantity in MATTERS for one in study.machine.touchdown_bearings]
    quantiles: dict[str, Marks] = {
        name: [(f"{100 * share:g} %", results.quantile(name, share).value, share) for share in SHARES]
        for name in columns
    }
    below = ", ".join(f"{100 * share:g}" for share in SHARES)
    return ReportContent(
        title=f"{len(results)} simulated drops: {study.name}",
        subtitle=f"{study.machine.name}, {1e3 * study.duration:g} ms each",
        verdict=tuple(_verdict(results, limits or {})),
        summary=(_table(results, SHARES, only=MATTERS),),
        facts=(
            *machine_facts(study.machine),
            ("design", f"{study.design}, seed {study.seed}, shards of {study.shard}"),
            ("digest", study.digest),
            ("rotordrop", results.version),
        ),
        sections=(
            *_influence_section(results),
            _distribution_section(results, columns, quantiles, f"{below} % of the drops lie below"),
            *(_map_section(results, name, limits or {}) for name in by),
            *appendix([Section("All quantiles", (QUANTILES,), tables=(_table(results, (0.05, *SHARES)),))]),
        ),
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
    """What qualifies every number first, then limits, and whether the rotor whirled."""
    said = []
    failed = sum(results.failed.values())
    if failed:
        reasons = "; ".join(f"{count} ×: {reason}" for reason, count in results.failed.items())
        said.append(Statement(f"{failed} drops could not be computed: {reasons}", "warning"))
    names = [bearing.name for bearing in results.study.machine.touchdown_bearings]
    for name in names:
        for quantity, limit in limits.items():
            over = results.exceedance(f"{name}.{quantity}", limit)
            ceiling = format_quantity(limit, _kind(results, f"{name}.{quantity}"))
            text = f"{name}: {percent(over)} of the drops exceed {_in_words(quantity)} {ceiling}."
            said.append(Statement(text, "notice" if over.high < 0.5 else "warning"))
    if len(results) < results.study.drops:
        said.append(Statement(_what_is_missing(results)))
    if results.study.design == "sensitivity":
        said.append(Statement(SENSITIVITY))
    whirls = {name: results.exceedance(f"{name}.backward_whirl", 0.0) for name in names}
    said += [
        Statement(f"{name}: {percent(whirl)} of the drops went into backward whirl.", "warning")
        for name, whirl in whirls.items()
        if whirl.value > 0.0
    ]
    if all(whirl.value == 0.0 for whirl in whirls.values()):
        most = max(whirl.high for whirl in whirls.values())
        said.append(Statement(f"No drop went into backward whirl (90 %: at most {100 * most:.2g} % do)."))
    machine = results.study.machine
    places = [(one.name, False, "the rotor touches") for one in machine.clearances]
    places += [(name, True, "the mount reaches its stop") for name in stopped(machine)]
    for name, stop, happens in places:
        touching = results.exceedance(share_column(name, stop), 1.0)
        text = f"{name}: {happens} in {percent(touching)} of the drops."
        said.append(Statement(text, "notice" if touching.value == 0.0 else "warning"))
    if results.study.looped:
        lifted = results.exceedance(LIFT, 0.5)
        text = f"The magnets lift the rotor again in {percent(lifted)} of the drops."
        said.append(Statement(text, "good" if lifted.value == 1.0 else "warning"))
    peaks = [results.numbers[f"{name}.peak_force"] for name in names]
    if len(peaks) > 1 and all(np.allclose(one, peaks[0], EQUAL, equal_nan=True) for one in peaks):
        said.append(Statement(SYMMETRIC))
    return [*said, Statement(SCOPE)]


def _distribution_section(
    results: StudyResults, columns: Sequence[str], marks: Mapping[str, Marks], marked: str
) -> Section:
    """How columns are spread: the share of the drops below a value, and values that are marked in it."""
    quantities = dict.fromkeys(column.partition(".")[2] for column in columns)
    figures = tuple(
        Figure(
            _distribution_figure(results, [one for one in columns if one.endswith(f".{quantity}")], marks),
            f"Share of the drops below a value of the {_in_words(quantity)}; dotted: {marked}.",
        )
        for quantity in quantities
    )
    return Section("Distribution", figures=figures)


def _distribution_figure(
    results: StudyResults, columns: Sequence[str], marks: Mapping[str, Marks]
) -> go.Figure:
    """Draw the cumulative distribution of a quantity, a panel for each bearing."""
    figure = panels([name.partition(".")[0] for name in columns])
    for column, name in enumerate(columns, start=1):
        size, unit = display_unit(_kind(results, name))
        values = np.sort(results.column(name))
        values = values[np.isfinite(values)] / size
        below = 100.0 * (np.arange(len(values)) + 0.5) / len(values)
        step = {"color": SERIES[0], "width": 1.6, "shape": "hv"}
        hover = "%{x:.4~g}: %{y:.3~g} %"
        curve(figure, values, below, "drops below", column=column, legend=False, line=step, hover=hover)
        for text, at, share in marks[name]:
            if math.isnan(at):  # fewer drops than that
                continue
            upright(figure, at / size, SERIES[1], "dot", row=1, col=column)
            # at the height of its share, above the curve: at one height the labels of 90 and 99 % collide
            above: dict[str, Any] = {"xanchor": "right", "yanchor": "bottom", "bgcolor": OVER}
            words(figure, at / size, 100.0 * share, text, column=column, **above)
        title = _in_words(name.partition(".")[2])
        figure.update_xaxes(title_text=axis_title(title, unit), col=column)
    figure.update_yaxes(range=[0.0, BELOW])
    return finished(figure, y="drops below [%]")


def _table(results: StudyResults, shares: Sequence[float], only: Sequence[str] = ()) -> Table:
    """Quantiles over the drops; each in the unit of its line, its interval below it."""

    def quantile(share: float) -> Column:
        head = f"{100 * share:g} % of drops below"
        return Column(head, lambda q: Shown.of(results.quantile(q.name, share), q.kind, 3))

    def counted(q: Quantity) -> int:
        return int(np.count_nonzero(np.isfinite(results.numbers[q.name])))

    wanted = [q for q in results.columns if not only or q.name.rpartition(".")[2] in only]
    columns = (
        Column("quantity", (lambda q: _in_words(q.name)) if only else "meaning"),
        *(quantile(share) for share in shares),
        Column("drops", lambda q: "" if counted(q) == len(results) else str(counted(q)), optional=True),
    )
    return table([q for q in wanted if counted(q)], columns)


def _in_words(name: str) -> str:
    return name.replace(".", " ").replace("_", " ")


def _kind(results: StudyResults, name: str) -> str:
    """Kind of a column; of a quantity that no bearing has it is said which there are."""
    kinds = {q.name: q.kind for q in results.columns}
    if name not in kinds:
        known = tuple(one.partition(".")[2] for one in kinds)
        raise UsageError(unknown_key(name.partition(".")[2], known))
    return kinds[name]


def _influence_section(results: StudyResults) -> tuple[Section, ...]:
    """Which varied values matter, or nothing where there are too few drops to say it."""
    every = influences_of(results).items()
    found = {_in_words(column): {one.name: one for one in of} for column, of in every}
    if not found:
        return ()

    def part(what: str, field: str) -> Column:
        def text(name: str) -> str:
            share: Known | None = getattr(found[what][name], field)
            if share is None:
                return "–"
            # the estimate of a share near none goes below it, which no share does
            value, low, high = (max(100.0 * one, 0.0) for one in (share.value, share.low, share.high))
            return f"{value:.0f} % ({low:.0f} to {high:.0f} %)"

        return Column(what if field == "alone" else f"{what}, with all others", text)

    values = list(next(iter(found.values())))
    with_others = any(one.total is not None for parts in found.values() for one in parts.values())
    fields = ("alone", "total") if with_others else ("alone",)
    columns = (
        Column("varied value", lambda name: spoken_value(results.study.machine, name)),
        *(part(what, field) for what in found for field in fields),
    )
    shares = table(values, columns, "Shares of the variance (90 %)")
    return (Section("What matters", (SHARES_OF_VARIANCE,), tables=(shares,)),)


def spoken_value(machine: Machine, name: str) -> str:
    """A varied value in words: ``*.friction.dynamic`` is the dynamic friction of every bearing."""
    owner, _, rest = name.partition(".")
    if case_kind(machine, name) is not None or not rest:
        return name.replace("_", " ")
    row = fitted_row(name)
    label = rest.replace(".", " ").replace("_", " ") if row is None else row.label
    return f"{label}, {'every bearing' if owner == '*' else owner}"


def _map_section(results: StudyResults, name: str, limits: Mapping[str, float]) -> Section:
    """Quantiles of what counts, and probabilities of what happened, against a varied value."""
    figures = []
    for columns, limit in asked(results, limits):
        # what happened in no drop is said in the verdict: its figure would be a line at zero
        if (
            limit is None
            or columns == [LIFT]
            or any(results.exceedance(one, limit).value > 0.0 for one in columns)
        ):
            what = "Every drop, and quantiles of" if limit is None else "Probability among"
            caption = f"{what} drops with neighbouring values; bars: 90 % intervals."
            figures.append(Figure(_map_figure(results, name, columns, limit), caption))
    return Section(f"Against {spoken_value(results.study.machine, name)}", figures=tuple(figures))


def _map_figure(
    results: StudyResults, name: str, columns: Sequence[str], limit: float | None = None
) -> go.Figure:
    """Draw quantiles of columns, or their probability to exceed a limit [SI], against a varied value."""
    machine = results.study.machine
    kind = case_kind(machine, name)
    if kind is None:
        kind = kind_of_path(machine, name.replace("*", machine.touchdown_bearings[0].name, 1))
    factor, unit = display_unit(kind)
    of_columns = _kind(results, columns[0])
    size, size_unit = display_unit(of_columns) if limit is None else (1.0, "")
    figure = panels([column.partition(".")[0] for column in columns])
    for number, column in enumerate(columns, start=1):
        place: dict[str, Any] = {"column": number, "legend": number == 1}
        if limit is None:
            some = slice(None, None, -(-len(results) // DRAWN_DROPS))
            x, y = results.column(name)[some] / factor, results.column(column)[some] / size
            marker = {"color": MUTED, "size": 4, "opacity": 0.45}
            curve(figure, x, y, "a drop", mode="markers", marker=marker, **place)
        for k, share in enumerate(SHARES if limit is None else SHARES[:1]):
            cells = results.map(column, name, share=share, above=limit)
            known: list[Known] = [cell["known"] for cell in cells]
            curve(
                figure,
                [0.5 * (cell["from"] + cell["to"]) / factor for cell in cells],
                [one.value / size for one in known],
                f"{100 * share:g} % of drops below" if limit is None else "probability",
                mode="lines+markers",
                colour=SERIES[k],
                width=1.6,
                error_y=bars([(one.value, one.low, one.high) for one in known], size),
                **place,
            )
    quantity = _in_words(columns[0].partition(".")[2] or columns[0])
    if limit is not None:
        above = f" > {format_quantity(limit, of_columns)}" if limit and columns != [LIFT] else ""
        quantity = f"P({quantity}{above})"
    x_title = axis_title(plain(spoken_value(machine, name)), unit)
    return finished(figure, x_title, axis_title(quantity, size_unit))


FEW = 0.05
"""Share of drops on one side of the recorded one from which it counts as out of the ordinary [1]."""
NOT_JOINT = (
    "The machine file holds no joint distribution: the machine is taken as described, so the spread is that "
    "of rotor angle and remanent lift alone, and too narrow. Calibrate it first."
)
REPEAT_SCOPE = "The drops are simulated by the model; what the model leaves out is not in the spread."
NOTE = (
    "Worst of so many: half of such sets have a worst drop below it. Intervals say how well the number of "
    "simulated drops determines a number."
)


def repeat_page(results: StudyResults, found: Sequence[Repeat]) -> ReportContent:
    """Build the report on a virtual repeat."""
    study = results.study
    columns = [one.column for one in found if one.column.partition(".")[2] in MATTERS]
    recorded: dict[str, Marks] = {
        one.column: [("recorded", one.recorded.value, one.place.value)] if one.recorded and one.place else []
        for one in found
    }
    return ReportContent(
        title=f"{len(results)} virtual repeats at {format_quantity(study.speed, 'speed')}",
        subtitle=f"{study.machine.name}, {1e3 * study.duration:g} ms each",
        verdict=_repeat_verdict(results, found),
        summary=(_repeat_table(results, found),),
        facts=(
            *machine_facts(study.machine),
            ("seed", str(study.seed)),
            ("digest", study.digest),
        ),
        sections=(_distribution_section(results, columns, recorded, "the recorded drop"),),
    )


def _repeat_verdict(results: StudyResults, found: Sequence[Repeat]) -> tuple[Statement, ...]:
    said = []
    failed = sum(results.failed.values())
    if failed:
        said.append(Statement(f"{failed} drops could not be computed.", "warning"))
    if results.study.joint is None:
        said.append(Statement(NOT_JOINT, "warning"))
    for one in found:
        if one.recorded is None or one.place is None:
            continue
        odd = one.place.high < FEW or one.place.low > 1.0 - FEW
        kind = _kind(results, one.column)
        text = (
            f"{_in_words(one.column)}: {percent(one.place)} of the drops that could have happened were "
            f"milder than the recorded {shown(one.recorded.value, kind)}; the worst of {one.of} would "
            f"typically have {one_line(Shown.of(one.worst, kind, 3))}."
        )
        said.append(Statement(text, "warning" if odd else "notice"))
    return (*said, Statement(REPEAT_SCOPE))


def _repeat_table(results: StudyResults, found: Sequence[Repeat]) -> Table:
    def number(field: str) -> Callable[[Repeat], Shown]:
        return lambda one: Shown.of(getattr(one, field), _kind(results, one.column), 3)

    def most(one: Repeat) -> Shown:
        between = (one.low.value, one.high.value)
        kind = _kind(results, one.column)
        return Shown(value=one.median.value, kind=kind, interval_90=between, range_only=True)

    columns = (
        Column("quantity", lambda one: _in_words(one.column)),
        Column("recorded", number("recorded")),
        Column("milder drops", lambda one: Shown.of(one.place, "share")),
        Column("median", number("median")),
        Column("nine of ten drops", most),
        Column(f"worst of {found[0].of}", number("worst")),
    )
    return table(found, columns, "The recorded drop among those that could have happened (90 %)", NOTE)


def percent(share: Known, form: str = "{:.3g} % (90 %: {:.3g} to {:.3g} %)") -> str:
    """A share of the drops with its 90 % interval in words."""
    return form.format(*(100 * number for number in (share.value, share.low, share.high)))
