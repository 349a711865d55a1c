"""The report on one recorded drop, and what a terminal shows first, drawn from its estimate alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import plotly.graph_objects as go

from rotordrop.arrays import Array
from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.parameter import Role
from rotordrop.elements.table import published, row_of
from rotordrop.estimate.bearing_drop import BearingDrop, History
from rotordrop.estimate.estimate import (
    CrossCheck,
    Estimate,
    FittedParameter,
    Replay,
    TimedContact,
    Verdict,
)
from rotordrop.estimate.published import Agreement
from rotordrop.evidence.impacts import CONTACT_FROM
from rotordrop.evidence.quality.finding import WIRING
from rotordrop.known import NINETY, Known
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Column,
    Figure,
    Level,
    ReportContent,
    Section,
    Statement,
    Table,
    folded,
    table,
    verdict_column,
)
from rotordrop.report.drop_sections import (
    drop_sections,
    headline_card,
    moment_of,
    quality_statements,
    record_quality_section,
    sensor_figure,
    static_limit_statement,
    unseen_in,
)
from rotordrop.report.machine_content import drawing_section, not_given, weight_shares
from rotordrop.report.origin import UsedFile, machine_facts
from rotordrop.report.quantity import NO_INTERVAL, Quantity, shown, with_interval, written
from rotordrop.report.style import (
    LIMIT,
    MICRO,
    add_history,
    finished,
    label_time,
    panels,
)
from rotordrop.severity.numbers import NOTE, NUMBERS, Number
from rotordrop.twin.allowances import MODEL_STRESS_SIGMA
from rotordrop.twin.value_of_information import DRAWING
from rotordrop.units import format_minute, format_second

KINDS = {"N": "force", "Pa": "pressure"}
FRONT = 2
"""Sections of the page to send: force and orbit."""
MAIN = 2
"""Headline numbers of the page to send: peak force and stress."""
WORTH = 0.7
"""Share of an interval that is left from which it is not said what would narrow it [1] (chosen)."""
BALLS = (
    "balls inferred from the designation",
    "their number, diameter and conformity, from the maker",
)
"""Why the stress of a bearing is known no better than its force, and what would narrow it."""
BEAM = "the beam in place of the rotor"
EXPECTED = "90 % expected by the filter"
LIMIT_LINE = {"color": LIMIT, "width": 1.2, "dash": "dash"}
SHOWN_SHARE = 0.995
"""Share of the innovations inside the drawn range [1]; the first ones, before anything is known, are huge."""

MEANS = (
    "A mean force is the mean of the magnitude; the mean Hertz stress ends with the record where that is "
    "shorter."
)
"""What the mean numbers of an estimate are means of."""
PRIOR_NOTE = (
    "Priors are ranges (90 %), below an estimate stands its 90 % interval. What the record does not "
    "determine enters the intervals of force and stress by its prior."
)
SENSORS_NOTE = "The gain of a machine file, true displacement over reading, is 1 / (1 + gain error)."
PHASE_NOTE = "Phase: direction of the heavy spot when the mark of the shaft passes, from +y with the spin."
CHECKS_NOTE = (
    "The checks see what moves the readings; a contact stiffness or exponent that hardly does enters by its "
    "prior, and its verdict says so."
)
CROSS_CHECK_NOTE = (
    "The cross-check knows the rotor only: no contact, friction or support parameter enters it. From a twin "
    "that fits its record it takes sensor errors, air gaps and, for the stress, the preload; from one that "
    "does not it takes nothing."
)
AGREES = "The independent cross-check agrees within its known accuracy."
SCOPE = "No acceptance limit was given: maker and operator agree on one (ISO 14839-5:2022)."
SETTLE_FIRST = (
    "Before anything is concluded from force or stress: check machine file and record against each other "
    "(data quality, sensors, air gap), and estimate again. Of its loads ranges are known at most."
)
ASSUMED = (
    "The rotor is linear: beam elements, reduced to its lowest modes and its shapes under bearing loads.",
    "Rotor and touchdown bearings move in the planes of the bearings; tilt of the races and axial motion are "
    "left out.",
    "The contact of rotor and race follows a Hertzian law with losses, friction a Stribeck law; their "
    "parameters are among the unknowns.",
    "The magnets carry nothing after power-off but a decaying remanent force.",
    "Parameters the record does not determine keep their prior, inside every interval of force and stress.",
)
"""What every estimate takes for granted."""


def estimate_page(estimate: Estimate) -> ReportContent:
    """Build the report on one recorded drop, followed or replayed; all it says comes from the estimate."""
    summary = estimate_summary(estimate)
    return replace(
        summary,
        verdict=(summary.verdict[0], *summary.grave),
        cards=tuple(replace(card, figures=card.figures[:MAIN]) for card in summary.cards),
        summary=(),
        to_do=_next(estimate),
        sections=_sections(estimate, summary),
        lead=FRONT,
    )


def estimate_summary(estimate: Estimate) -> ReportContent:
    """The same without its sections: what a terminal shows, for which no figure need be drawn."""
    replayed = isinstance(estimate.method, Replay)
    certain = estimate.consistent
    machine, date = estimate.machine, format_minute(estimate.record.event_date)
    serial = f"serial number {machine.serial_number}" if machine.serial_number else ""
    parts = (machine.name, serial, estimate.name, date, f"from {shown(estimate.speed, 'speed')}")
    return ReportContent(
        title=f"Touchdown-bearing force and stress {'by replay of' if replayed else 'from'} a recorded drop",
        subtitle=", ".join(filter(None, parts)),
        simulated=SIMULATED_RECORD if estimate.simulated_record else "",
        verdict=estimate_verdict(estimate),
        cards=tuple(headline_card(b, certain=certain) for b in estimate.bearings),
        summary=(_of_bearings(estimate),),
        facts=_facts(estimate),
        ends=(estimate.bearings[0].name, estimate.bearings[-1].name),
    )


def spoken(one: FittedParameter) -> str:
    """Name of an unknown for people: what it belongs to, and what it is."""
    return one.row.named(one.owner)


def names_in(estimate: Estimate) -> Callable[[str], str]:
    """Gives the name of an unknown by its path, as the tables name it."""
    names = {one.path: spoken(one) for one in estimate.parameters}
    return lambda path: names.get(path, path)


def estimate_verdict(estimate: Estimate) -> tuple[Statement, ...]:
    """What model and record say of each other first, then warnings, notes and limits."""
    serious = [s for s in quality_statements(estimate.findings) if s.level in ("bad", "warning")]
    told = {one.text for one in serious}
    name_of = names_in(estimate)
    worth_knowing = {check.noted(): check.noted(name_of) for check in estimate.checks if check.note}
    judged = _judgement(estimate)
    if estimate.later_warning in judged.text:
        told.add(estimate.later_warning)
    return (
        judged,
        _part(estimate),
        *serious,
        *(Statement(text, "warning") for text in estimate.warnings if text not in told),
        *cross_check_statements(estimate.cross_check),
        *(Statement(worth_knowing.get(note, note)) for note in estimate.notes),
        static_limit_statement(estimate.bearings, certain=estimate.consistent),
        *map(Statement, width_advice(estimate)),
    )


def _judgement(estimate: Estimate) -> Statement:
    level: Level = "good" if estimate.consistent else "bad"
    if isinstance(estimate.method, Replay):
        level = "notice"
    elif estimate.consistent and any(check.failed for check in estimate.checks):
        level = "warning"
    said = [estimate.verdict_in(names_in(estimate))]
    if level == "good" and any(not one.agrees and not one.replaced for one in estimate.cross_check):
        said.append("The independent cross-check disagrees.")
    if level != "bad" and estimate.later_warning:
        said.append(f"{estimate.later_warning}.")
    if level == "bad" and estimate.machine.rotor.is_beam:
        said.append(GUESSED_ROTOR)
    return Statement(" ".join(said), "warning" if len(said) > 1 and level != "bad" else level)


def _part(estimate: Estimate) -> Statement:
    """Which part of the record the numbers are of, and what the rest says."""
    rest = "the record ends there" if not estimate.later else "later motion is smaller"
    if estimate.later_warning:
        rest = "the rotor went further out later on"
    return Statement(f"Peaks: first {1e3 * estimate.until:.0f} ms after power-off; {rest}.")


def width_advice(estimate: Estimate) -> Iterator[str]:
    """Why peak force and stress of a bearing are known no better, and what would narrow them most."""
    found: dict[tuple[str, str, str], list[tuple[str, float, float]]] = {}
    for bearing in estimate.bearings:
        force, stress = bearing.peak_force.known, bearing.peak_stress.known
        if estimate.consistent and bearing.peak_force.is_wide:
            half = 0.5 * (force.high - force.low) / force.value
            lefts = [one.left(bearing.name) for one in estimate.advice]
            left = min(lefts, default=1.0)
            cause = remedy = ""
            if left < WORTH:
                best = estimate.advice[lefts.index(left)]
                causes = (BEAM if path == "rotor" else row_of(path).label for path in best.paths)
                cause, remedy = ", ".join(dict.fromkeys(causes)), best.measurement
            found.setdefault(("Force", cause, remedy), []).append((bearing.name, half, half * left))
        if stress.allowance_90 and numbers_of(estimate.machine.bearing(bearing.name)).stress_sigma:
            half, rest = 0.5 * (stress.high - stress.low) / stress.value, stress.allowance_90 / stress.value
            left = math.hypot(math.sqrt(max(half**2 - rest**2, 0.0)), NINETY * MODEL_STRESS_SIGMA)
            found.setdefault(("Stress", *BALLS), []).append((bearing.name, half, left))
    for (load, cause, remedy), every in found.items():
        if narrowed := [one for one in every if load == "Force" or one[2] < WORTH * one[1]]:
            names, now, then = zip(*narrowed, strict=True)
            known = f"{load} ({', '.join(names)}) ± {_per_cent(now)} %"
            if not remedy:
                yield f"{known}; no one measurement of the machine would narrow it much."
            else:
                yield f"{known} because of {cause}; would become ± {_per_cent(then)} % with {remedy}."


def _per_cent(shares: Sequence[float]) -> str:
    """Shares of several ends in per cent, the least and the largest where they differ."""
    ends = (min(shares), max(shares))
    return " to ".join(
        dict.fromkeys(f"{100.0 * one:.0f}" if one > 0.01 else f"{100.0 * one:.1f}" for one in ends)
    )


def inspection_section(estimate: Estimate) -> Section:
    """Suggest the next step of inspection, the gravest reason first."""
    said = [] if estimate.consistent else [Statement(SETTLE_FIRST, "bad")]
    for bearing in estimate.bearings:
        highest = bearing.peak_stress.known.high
        if highest >= STATIC_STRESS and "peak_stress_Pa" not in bearing.missing:
            text = (
                f"{bearing.name}: look at balls and raceways for indentations before the next start. "
                f"The peak stress may be as high as {shown(highest, 'pressure', 3)}; from "
                f"{shown(STATIC_STRESS, 'pressure')} on ISO 76 expects a permanent indentation of a "
                "ten-thousandth of the ball diameter."
            )
            said.append(Statement(text, "warning"))
    if estimate.later_warning:
        text = (
            "Look at the rest of the record before the next start: the largest load may not be among these."
        )
        said.append(Statement(text, "warning"))
    gaps = []
    for bearing in estimate.bearings:
        limits = bearing.values.get("air_gap_m")
        if limits is None or "peak_force_N" in bearing.missing:
            continue
        play = numbers_of(estimate.machine.bearing(bearing.name)).play  # a gauge shows it with the gap
        seen = f"{1e6 * (limits.low + play):.0f} to {1e6 * (limits.high + play):.0f} µm"
        gaps.append(f"{bearing.name} {seen}{f' with {1e6 * play:.0f} µm of its play' if play else ''}")
    expected = f" (expect {', '.join(gaps)}; another gap is wear or a sensor that has moved)" if gaps else ""
    text = f"Next standstill: lift check{expected}, turn each bearing by hand."
    return Section("What next", (), (*said, Statement(text), Statement(SCOPE)))


def _next(estimate: Estimate) -> Section:
    """What to do next, how far the stress is from its limit, and what the numbers rest on."""
    advised = inspection_section(estimate)
    assumed = ", ".join(dict.fromkeys(estimate.assumed.values()))
    rest = (
        *map(Statement, width_advice(estimate)),
        static_limit_statement(estimate.bearings, certain=estimate.consistent),
        *((Statement(f"Assumed: {assumed}."),) if assumed else ()),
    )
    return replace(advised, statements=(*advised.statements, *rest))


def _facts(estimate: Estimate) -> tuple[tuple[str, str], ...]:
    record, path = estimate.record, estimate.record.path
    instant = estimate.drop_instant
    power_off = Quantity(value=instant.value, kind="time", interval_90=instant.interval_90)
    name = estimate.name if path is None else path.name
    method = "replay" if isinstance(estimate.method, Replay) else "tracked twin"
    if not isinstance(estimate.method, Replay) and estimate.method.quick:
        method = "tracked twin, one pass"
    facts = {
        "record": UsedFile(role="record", name=name, sha256=record.sha256).fact[1],
        "event": format_second(record.event_date),
        "power-off": f"{power_off.text} in record time (90 %: {power_off.interval_text})",
        "method": method,
        "estimated part": f"0 to {1e3 * estimate.until:.0f} ms after power-off",
        "sampling": f"{record.sampling_rate:g} Hz, {len(record.sensors)} sensors",
    }
    return (*machine_facts(estimate.machine), *((name, text) for name, text in facts.items() if text))


def _sections(estimate: Estimate, summary: ReportContent) -> tuple[Section, ...]:
    """Force and orbit, and the seven parts behind them."""
    names = [bearing.name for bearing in estimate.bearings]
    steps = estimate.replay
    tables = () if steps is None else (first_contact_table(names, steps.contacts),)
    origin = "estimated" if steps is None else "measured and simulated"
    at_sensors = () if estimate.at_sensors is None else (sensor_figure(estimate.at_sensors),)
    force, orbit, impacts, motion, stress = drop_sections(
        estimate.bearings,
        origin,
        weight_shares(estimate.machine),
        contact_tables=tables,
        at_sensors=at_sensors,
        certain=estimate.consistent,
    )
    agreement = () if estimate.agreement is None else (agreement_section(estimate.agreement),)
    unseen = unseen_in(estimate.notes)
    elsewhere = {*summary.grave, *map(Statement, unseen), *_next(estimate).statements}
    notes = Section("", statements=tuple(one for one in summary.verdict[1:] if one not in elsewhere))
    return (
        force,
        orbit,
        impacts,
        folded("Severity", stress, _severity(estimate), printed=True),
        folded("Motion at the sensors", motion, *agreement),
        folded("Parameters", _parameters(estimate)),
        folded("Checks", notes, _checks(estimate)),
        folded("Record", record_quality_section(estimate.findings, *unseen)),
        folded(
            "Machine",
            drawing_section(estimate.machine),
            Section(
                "",
                statements=tuple(map(Statement, ASSUMED)),
                tables=not_given(estimate.machine, reasons=False),
            ),
        ),
    )


def _severity(estimate: Estimate) -> Section:
    """Means, safety, impulse, energy, indices, fatigue of a drop by bearing, and what they rest on."""
    found = {b.name: {**b.missing, **b.values} for b in estimate.rated}
    uncertain = not estimate.consistent
    if estimate.verdict is Verdict.UNDETERMINED:
        return Section("Severity")

    def at(name: str) -> Column:
        def stated(row: Number) -> Quantity | str:
            value = found[name].get(row.field)
            if isinstance(value, str):
                return value
            return replace(Quantity.of(value, row.shown_as, range_only=uncertain), places=row.places)

        return Column(name, stated)

    rated: dict[str, list[str]] = {}
    for name in found:
        own = numbers_of(estimate.machine.bearing(name)).ratings()
        static, dynamic = (shown(value, "force", 3) for value in (own.static, own.dynamic))
        text = f"C0 = {static} of all rows ({own.rows}), C = {dynamic} of one, {own.source}"
        rated.setdefault(text, []).append(name)
    rows = [one for one in NUMBERS[MAIN:] if any(one.field in values for values in found.values())]
    columns = (Column("severity", "label"), *map(at, found))
    severity = table(rows, columns, "Severity of the drop", f"{MEANS} {NOTE}")
    of_rows = tuple(f"{', '.join(names)}: {text}." for text, names in rated.items())
    return Section("Severity", of_rows, tables=(severity,))


class ParameterRow(NamedTuple):
    """One parameter: its prior (or start and bounds), the estimate and the verdict of the identification."""

    name: str
    prior: Quantity
    estimate: Quantity
    verdict: str
    bearing: str = ""
    """The touchdown bearing that it belongs to; empty for another owner, whom the name tells then."""


def _rows(estimate: Estimate, scope: str) -> list[ParameterRow]:
    """The unknowns of the machine or of the drop; behind those of the machine what follows from them."""
    uncertain = not estimate.consistent
    names = [bearing.name for bearing in estimate.bearings]
    rows = []
    for one in estimate.parameters:
        # the amount of an unbalance stands in a table of its own
        if one.scope != scope or (one.row.owner == "unbalance" and estimate.unbalance):
            continue
        kind = one.row.display_kind
        verdict: str = one.estimate.status
        if one.row.way_of and one.estimate.lower is not None:
            verdict = (
                f"larger than {shown(one.estimate.lower, kind)}, the most that the {one.row.way_of} moved"
            )
        # a prior is a range: its middle is nobody's word
        spread = one.prior is not None and one.prior.standard_error is not None
        prior = Quantity.of(one.prior, kind, range_only=spread)
        found = Quantity.of(one.estimate, kind, range_only=uncertain)
        own = one.owner in names and scope == "machine"
        name = one.row.label if own else spoken(one)
        rows.append(ParameterRow(name, prior, found, verdict, one.owner if own else ""))
    if scope == "drop":
        return rows
    told = {(row.name, row.bearing) for row in rows}
    for parameter in published().values():
        for bearing in estimate.bearings:
            known = bearing.values.get(parameter.field)
            shared = parameter.role in (Role.SOUGHT, Role.DERIVED)
            if known is None or not shared or (parameter.label, bearing.name) in told:
                continue
            kind = parameter.display_kind
            found = Quantity.of(known, kind, range_only=uncertain)
            none = Quantity.of(None, kind)
            rows.append(ParameterRow(parameter.label, none, found, known.status, bearing.name))
    return rows


def parameter_table(
    rows: Sequence[ParameterRow], names: Sequence[str] = (), *, caption: str = "Parameters", note: str = ""
) -> Table:
    """Set prior, estimate, 90 % interval and a verdict where it is not determined side by side.

    Those of the bearings that are named stand in one line where their priors are the same.
    """
    order = list(dict.fromkeys(row.name for row in rows))
    lines: dict[tuple[str, str], dict[str, ParameterRow]] = {}
    for row in sorted(rows, key=lambda one: order.index(one.name)):
        lines.setdefault((row.name, row.prior.text), {})[row.bearing] = row

    def verdict(line: dict[str, ParameterRow]) -> str:
        if len({row.verdict for row in line.values()}) == 1:
            return next(iter(line.values())).verdict
        open_ = (row for row in line.values() if row.verdict != "determined")
        return "; ".join(f"{row.bearing}: {row.verdict}" for row in open_)

    def of(name: str) -> Column:
        label = name or "estimate (90 % interval)"
        return Column(label, lambda line: line[name].estimate if name in line else "")

    columns = (
        Column("parameter", lambda line: next(iter(line.values())).name),
        Column("prior or start", lambda line: next(iter(line.values())).prior),
        *map(of, names or ("",)),
        verdict_column(verdict),
    )
    return table(lines.values(), columns, caption, note)


def _of_bearings(estimate: Estimate) -> Table:
    """Parameters of the touchdown bearings side by side."""
    rows = [one for one in _rows(estimate, "machine") if one.bearing]
    names = [bearing.name for bearing in estimate.bearings]
    return parameter_table(rows, names, caption="Parameters of the machine", note=PRIOR_NOTE)


def _parameters(estimate: Estimate) -> Section:
    """Every unknown with prior, estimate, interval and verdict; first those of the machine."""
    uncertain = not estimate.consistent
    machine, drop = _rows(estimate, "machine"), _rows(estimate, "drop")
    tables = [_of_bearings(estimate)]
    if others := [one for one in machine if not one.bearing] + drop:
        tables.append(parameter_table(others, caption="Other unknowns"))
    if estimate.sensors:
        of_sensor = (
            Column("sensor", "sensor"),
            Column("gain error", lambda o: Quantity.of(o.gain_error, "share", range_only=uncertain)),
            Column("offset", lambda o: Quantity.of(o.offset, "length", range_only=uncertain)),
            Column("noise (standard deviation)", "noise", "length", 2),
            verdict_column(lambda o: o.gain_error.status),
        )
        tables.append(table(estimate.sensors, of_sensor, "Sensors", SENSORS_NOTE))
    if estimate.unbalance:
        columns = (
            Column("node", "node"),
            Column("amount", lambda o: Quantity.of(o.amount, "unbalance", range_only=uncertain)),
            Column("phase against the mark", lambda o: o.phase or o.reason, "angle"),
            verdict_column(lambda o: (o.phase or o.amount).status),
        )
        tables.append(table(estimate.unbalance, columns, "Unbalance", PHASE_NOTE))
    return Section("Parameters", tables=tuple(tables))


def _checks(estimate: Estimate) -> Section:
    """Checks of the model against the record, and the innovations behind them."""
    name_of = names_in(estimate)
    columns = (
        Column("check", "name"),
        Column("passed", lambda check: "yes" if check.passed else "no" if check.judged else "not judged"),
        Column("numbers compared", lambda check: check.said(name_of)),
    )
    checks = table(estimate.checks, columns, "Consistency of model and record", CHECKS_NOTE)
    figures: tuple[Figure, ...] = ()
    if (found := estimate.innovations) is not None:
        chart = innovations_figure(found.time, found.values, found.channels, found.deviation)
        figures = (
            Figure(chart, "What each reading says beyond the prediction from all readings before it."),
        )
    compared = (cross_check_table(estimate.cross_check),) if estimate.cross_check else ()
    return Section("Checks", figures=figures, tables=(*((checks,) if estimate.checks else ()), *compared))


def innovations_figure(
    time: Array, innovations: Array, channels: Sequence[str], standard_deviation: Array | None = None
) -> go.Figure:
    """Draw the innovation of every channel (N, S) [m] with the band in which 90 % of it should lie."""
    rows = -(-len(channels) // 2)
    figure = panels(channels, rows=rows, columns=min(2, len(channels)), height=190)
    for index in range(len(channels)):
        row, column, legend = index // 2 + 1, index % 2 + 1, index == 0
        history = History(label="innovation", time=time, values=innovations[:, index], role="measured")
        line = {"color": "#6b7785", "width": 0.8}
        add_history(figure, history, MICRO, "µm", row=row, column=column, legend=legend, line=line)
        if standard_deviation is not None:
            half = NINETY * standard_deviation[:, index]
            for sign in (1.0, -1.0):
                limit = History(label=EXPECTED, time=time, values=sign * half)
                named = legend and sign > 0.0
                add_history(figure, limit, MICRO, "µm", row=row, column=column, legend=named, line=LIMIT_LINE)
        reach = 1.1 * MICRO * float(np.nanquantile(np.abs(innovations[:, index]), SHOWN_SHARE)) or 1.0
        figure.update_yaxes(range=[-reach, reach], row=row, col=column)
    label_time(figure, row=rows)
    return finished(figure, y="innovation [µm]")


def cross_check_statements(checks: Sequence[CrossCheck]) -> tuple[Statement, ...]:
    """One warning per disagreement of a number that stands, or one sentence that all agree.

    Where the cross-check stands in place of the estimate the verdict says so, and nothing is compared.
    """
    standing = [check for check in checks if not check.replaced]
    warnings = tuple(
        Statement(
            f"{check.name}: the cross-check finds {_other(check).text} against {_own(check).text}, "
            f"a difference of {written(100 * check.difference, 0)} % where "
            f"± {100 * check.accuracy:.3g} % is known.",
            "warning",
        )
        for check in standing
        if not check.agrees
    )
    return warnings or ((Statement(AGREES, "good"),) if standing else ())


def cross_check_table(checks: Sequence[CrossCheck]) -> Table:
    """Set estimate and cross-check side by side with their difference and the accuracy that is known."""

    def verdict(check: CrossCheck) -> str:
        if check.replaced:
            return "stated in place of the twin"
        return "agrees" if check.agrees else "disagrees"

    columns = (
        Column("quantity", "name"),
        Column("tracked twin", _own),
        Column("cross-check", _other),
        Column("difference", lambda check: "–" if check.replaced else check.difference, "share", 2),
        Column("known accuracy", lambda check: f"± {100 * check.accuracy:.3g} %"),
        Column("verdict", verdict),
    )
    return table(checks, columns, "Independent cross-check", CROSS_CHECK_NOTE)


def _own(check: CrossCheck) -> Quantity:
    return Quantity.of(check.estimate, KINDS[check.estimate.unit], 3)


def _other(check: CrossCheck) -> Quantity:
    return Quantity.of(check.check, KINDS[check.estimate.unit], 3)


GUESSED_ROTOR = "A beam stands for the rotor, in the cross-check too: the ranges are no 90 % intervals."
MEAN = "mean_force_0p15_0p2_N"
OVER_GAP = "displacement / air gap"
ONLY_CERTAIN = ("at (from power-off)", "impacts", CONTACT_FROM, "largest displacement", OVER_GAP)
"""What is not shown where the model does not fit: there would be ranges from end to end, of a wrong gap."""


def estimate_screen(estimate: Estimate) -> ReportContent:
    """The first screen of an estimate, the gravest statement first."""
    judgement, _part, *others = estimate_verdict(estimate)
    static = static_limit_statement(estimate.bearings, certain=estimate.consistent)
    advice = [*width_advice(estimate)]
    elsewhere = {*estimate.assumed, *unseen_in(estimate.notes), static.text, *advice}
    limits = [one for one in others if one.level != "good" and one.text not in elsewhere]
    # what hides a loss first, then what is a warning
    limits.sort(
        key=lambda one: (one.text != (estimate.later_warning or None), one.level not in ("bad", "warning"))
    )
    grave = [one for one in (static, *limits) if one.level in ("bad", "warning")]
    assumed = ", ".join(dict.fromkeys(estimate.assumed.values()))
    remedies = dict.fromkeys("; ".join(_remedies(estimate)).split("; "))
    told = (
        f"to do next: {'; '.join(remedies)}" if any(remedies) else "",
        *advice,
        static.text if estimate.consistent and static not in grave else "",
        f"assumed: {assumed}" if assumed else "",
    )
    calm = [*(Statement(text) for text in told if text), *(one for one in limits if one not in grave)]
    # a way out comes first: what the record itself says of the failure, then what to do
    seen = [one for one in grave if one in quality_statements(estimate.findings)]
    ranked = [*seen, *calm[:1], *(one for one in grave if one not in seen), *calm[1:]]
    if not told[0]:
        ranked = [*grave, *calm]
    return ReportContent(
        title=f"{estimate.machine.name}, {estimate.name}, dropped from {shown(estimate.speed, 'speed')}",
        simulated=SIMULATED_RECORD if estimate.simulated_record else "",
        verdict=(judgement, *ranked),
        screen=_loads(estimate),
        rest="--all",
    )


def _remedies(estimate: Estimate) -> Iterator[str]:
    """What to do next, first what may well let the model fit."""
    yield from (one.remedy for one in estimate.findings if one.severity == "warning" and one.kind in WIRING)
    if estimate.verdict is Verdict.UNDETERMINED:
        return
    if estimate.machine.rotor.is_beam and not estimate.consistent:
        yield DRAWING  # nothing else that is measured makes a beam the rotor
        return
    name_of = names_in(estimate)
    yield from (check.advised(name_of) for check in estimate.checks if check.failed and check.remedy)


def _loads(estimate: Estimate) -> Table:
    """Loads of every bearing, one line each."""
    certain = estimate.consistent

    def number(known: Known | None, kind: str) -> str:
        if known is None or (known.interval_90 is None and estimate.replay is None):
            return NO_INTERVAL
        one = Quantity.of(known, kind, range_only=not certain)
        return f"{one.text} ({one.interval_text})" if one.interval_text else one.text

    def load(b: BearingDrop, field: str, known: Known | None, kind: str = "force") -> str:
        return b.missing.get(field) or number(known, kind)

    lines: dict[str, Callable[[BearingDrop], str]] = {
        "peak bearing force": lambda b: load(b, "peak_force_N", b.peak_force.known),
        "at (from power-off)": lambda b: moment_of(b.peak_force) or NO_INTERVAL,
        "peak Hertz stress": lambda b: load(b, "peak_stress_Pa", b.peak_stress.known, "pressure"),
        "impacts": lambda b: (
            b.missing.get("impacts") or with_interval(len(b.touched), "count", b.count_interval_90)
        ),
        # the begin of the last impact is known closely, but no event: hops go on behind it
        CONTACT_FROM: lambda b: (
            NO_INTERVAL if b.contact_from_interval_90 is None else f"≈ {shown(b.contact_from, 'time', 2)}"
        ),
        "largest displacement": lambda b: number(b.largest, "length"),
        OVER_GAP: _over_gap,
        "mean force, 150 to 200 ms": lambda b: load(b, MEAN, b.values.get(MEAN)),
    }
    names = [name for name in lines if certain or name not in ONLY_CERTAIN]
    ranges = "ranges" if estimate.machine.rotor.is_beam else "90 % ranges"
    what = "open loop" if estimate.replay else "90 % intervals" if certain else ranges
    columns = [Column(f"first {1e3 * estimate.until:.0f} ms, {what}", str)]
    cells = [{name: lines[name](bearing) for name in names} for bearing in estimate.bearings]
    columns += [Column(b.name, own.__getitem__) for b, own in zip(estimate.bearings, cells, strict=True)]
    return table([name for name in names if any(own[name] != NO_INTERVAL for own in cells)], columns)


def _over_gap(b: BearingDrop) -> str:
    """The largest distance from the centre over the air gap, with errors that count as independent."""
    gap = b.values.get("air_gap_m")
    if gap is None or b.largest is None:
        return NO_INTERVAL
    ratio = b.largest.value / gap.value
    doubt = ratio * math.hypot(
        0.5 * (b.largest.high - b.largest.low) / b.largest.value, 0.5 * (gap.high - gap.low) / gap.value
    )
    return with_interval(ratio, "dimensionless", (ratio - doubt, ratio + doubt))


HALF_PERIOD = (
    "Eq. (17) takes the contact for half a period; gravity lengthens it, and one contact can be two. Both "
    "stiffnesses serve as a start of the search only."
)


def first_contact_table(names: Sequence[str], contacts: Sequence[TimedContact]) -> Table:
    """State first contact and half-period stiffness of every bearing (Neisi 2020, Table 3)."""

    def stiffness(row: tuple[str, TimedContact]) -> Quantity:
        value, error = row[1].equivalent_stiffness, row[1].standard_error
        return Quantity(value=value, kind="stiffness", standard_error=error, digits=3)

    columns = (
        Column("bearing", lambda row: row[0]),
        Column("t₁", lambda row: row[1].start, "time"),
        Column("t₂", lambda row: row[1].end, "time"),
        Column("T", lambda row: row[1].duration, "time", 3),
        Column("beyond the gap", lambda row: row[1].indentation, "length", 3),
        Column("mass", lambda row: row[1].mass, "mass"),
        Column("stiffness, eq. (17)", stiffness),
        Column("gravity-corrected", lambda row: row[1].corrected_stiffness, "stiffness", 3),
    )
    error = max((contact.timing_error for contact in contacts), default=None)
    timing = "" if error is None else f"Standard error of t₁ and t₂: {shown(error, 'time', 2)} or less. "
    rows = zip(names, contacts, strict=True)
    return table(rows, columns, "First contact (Neisi 2020, Table 3)", f"{timing}{HALF_PERIOD}")


def agreement_section(agreement: Agreement) -> Section:
    """How far a replay follows the record, and how long a comparison point by point means anything."""
    horizon = min(bearing.horizon_s for bearing in agreement.bearings.values())
    text = (
        f"Replay and record stay within a tenth of the air gap for {1e3 * horizon:.0f} ms. A drop is "
        "chaotic: small differences grow tenfold in about 33 ms, so later only statistics can be compared."
    )
    return Section("Agreement with the record", (text,))
