"""The report on one recorded drop, drawn from its estimate alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from rotordrop._version import __version__
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.estimate.document import published_drop
from rotordrop.estimate.estimate import CrossCheck, Estimate, FittedParameter
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.published import Drop
from rotordrop.estimate.severity_numbers import severity_values
from rotordrop.report.changed_section import changed_section
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Column,
    Figure,
    Level,
    ReportContent,
    Section,
    Statement,
    Table,
    appendix,
    table,
    verdict_column,
)
from rotordrop.report.drop_sections import drop_sections
from rotordrop.report.estimate_numbers import headline_card, identified_table, static_limit_statement
from rotordrop.report.innovations import innovation_figures
from rotordrop.report.inspection import assumptions_section, inspection_section, limits_section
from rotordrop.report.machine_sections import defaults_section, drawing_section, weight_shares
from rotordrop.report.origin import Origin
from rotordrop.report.parameters import ParameterRow, parameter_figure, parameter_table
from rotordrop.report.quantity import Quantity, shown, written
from rotordrop.report.record_quality import quality_statements, record_quality_section, unseen_in
from rotordrop.report.replay_sections import (
    agreement_section,
    correlation_table,
    first_contact_table,
    friction_section,
    speed_section,
)
from rotordrop.report.restart_page import restart_section
from rotordrop.restart import RestartCard, restart_card
from rotordrop.restart.assumptions import assumptions_of
from rotordrop.restart.order import earlier_drop
from rotordrop.severity.numbers import NOTE, SEVERITY
from rotordrop.units import format_second

KINDS = {"N": "force", "Pa": "pressure"}
PRIOR_NOTE = (
    "A prior is a range; below an estimate stands its 90 % interval. What the record does not determine "
    "enters the intervals of force and stress by its prior."
)
PARAMETERS = (
    "Estimates with 90 % intervals over their priors, both relative to the prior's centre. Where the blue "
    "bar is as wide as the grey one, the record says nothing about the parameter."
)
SENSORS_NOTE = "Gains and offsets are estimated with the motion; the settled tail ties them to the air gap."
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
FRONT = 2
"""Sections of the page to send: force and orbit."""
AGREES = "The independent cross-check agrees within its known accuracy."


def estimate_page(
    estimate: Estimate,
    origin: Origin | None = None,
    since: Drop | None = None,
    card: RestartCard | None = None,
) -> ReportContent:
    """Build the report on one recorded drop, followed or replayed.

    Everything it says of the drop comes from the estimate; the origin says how it was made, and an earlier
    estimate of the machine, as published, is compared with this one. Without a restart card it has one by the
    assumptions of the package.
    """
    weighed = card or assumed_card(estimate, since)
    return replace(
        estimate_summary(estimate, origin),
        to_do=inspection_section(estimate, weighed),
        sections=_sections(estimate, since, weighed),
        lead=FRONT,
    )


def assumed_card(estimate: Estimate, since: Drop | None = None) -> RestartCard:
    """The restart card of a drop by the assumptions of the package, and by an earlier drop."""
    earlier = () if since is None else (earlier_drop(since),)
    return restart_card(published_drop(estimate), assumptions_of({}, "the assumptions"), earlier=earlier)


def estimate_summary(estimate: Estimate, origin: Origin | None = None) -> ReportContent:
    """The same without its sections: what a terminal shows, for which no figure need be drawn."""
    replayed = isinstance(estimate.method, Replay)
    fixed = estimate.replay.fixed if estimate.replay else ""
    certain = estimate.consistent
    return ReportContent(
        title=f"Touchdown-bearing force and stress {'by replay of' if replayed else 'from'} a recorded drop",
        subtitle=f"{estimate.machine.name}, {estimate.name}, from {shown(estimate.speed, 'speed')}",
        simulated=SIMULATED_RECORD if estimate.simulated_record else "",
        verdict=estimate_verdict(estimate),
        cards=tuple(headline_card(b, certain=certain) for b in estimate.bearings),
        summary=(identified_table(estimate.bearings, taken_over=fixed, certain=certain),),
        facts=(*_facts(estimate), *(origin or Origin()).facts(estimate.record.sha256)),
        ends=(estimate.bearings[0].name, estimate.bearings[-1].name),
    )


def estimate_figures(estimate: Estimate) -> dict[str, object]:
    """Figures of the page by name."""
    return dict(estimate_page(estimate).figures)


def spoken(one: FittedParameter) -> str:
    """Name of an unknown for people: what it belongs to, and what it is."""
    return one.row.named(one.owner)


def names_in(estimate: Estimate) -> Callable[[str], str]:
    """Gives the name of an unknown by its path, as the tables name it."""
    names = {one.path: spoken(one) for one in estimate.parameters}
    return lambda path: names.get(path, path)


def estimate_verdict(estimate: Estimate) -> tuple[Statement, ...]:
    """What model and record say of each other first, then warnings, notes and limits."""
    found = [f for f in estimate.findings if f.message not in estimate.warnings]
    serious = [s for s in quality_statements(found) if s.level in ("bad", "warning")]
    name_of = names_in(estimate)
    worth_knowing = {check.noted(): check.noted(name_of) for check in estimate.checks if check.note}
    return (
        _judgement(estimate),
        _part(estimate),
        *(Statement(text, "warning") for text in estimate.warnings),
        *cross_check_statements(estimate.cross_check),
        *serious,
        *(Statement(worth_knowing.get(note, note)) for note in estimate.notes),
        *(static_limit_statement(b, certain=estimate.consistent) for b in estimate.bearings),
    )


def _judgement(estimate: Estimate) -> Statement:
    level: Level = "good" if estimate.consistent else "bad"
    if isinstance(estimate.method, Replay):
        level = "notice"
    elif estimate.consistent and any(check.failed for check in estimate.checks):
        level = "warning"
    return Statement(estimate.verdict_in(names_in(estimate)), level)


def _part(estimate: Estimate) -> Statement:
    """Which part of the record the numbers are of, and what the rest says."""
    text = f"Peaks are the largest of the first {1e3 * estimate.until:.0f} ms after power-off"
    if not estimate.later:
        return Statement(f"{text}; the record ends there.")
    if any(one.larger for one in estimate.later):
        return Statement(f"{text}, and the rotor went further out later on.", "warning")
    return Statement(f"{text}; in the rest of the record the rotor went no further out.")


def _facts(estimate: Estimate) -> tuple[tuple[str, str], ...]:
    record, machine, steps = estimate.record, estimate.machine, estimate.replay
    instant = estimate.drop_instant
    power_off = Quantity(value=instant.value, kind="time", interval_90=instant.interval_90)
    path = machine.source_path
    if steps is None:
        quick = not isinstance(estimate.method, Replay) and estimate.method.quick
        method = "tracked twin, one pass" if quick else "tracked twin"
    else:
        method = f"replay with the supports of {steps.fixed}" if steps.fixed else "replay"
    facts = {
        "machine": machine.name if path is None else f"{machine.name} ({path.name})",
        "record": estimate.name if record.path is None else record.path.name,
        "SHA-256": record.sha256 or "not from a file",
        "event": format_second(record.event_date),
        "power-off": f"{power_off.text} in record time (90 %: {power_off.interval_text})",
        "method": method,
    }
    if steps is not None:
        drawn = f"{steps.draws} drops, {steps.rejected} rejected"
        facts["intervals"] = "none" if steps.draws is None else drawn
    facts |= {
        "estimated part": f"0 to {1e3 * estimate.until:.0f} ms after power-off",
        "sampling": f"{record.sampling_rate:g} Hz, {len(record.sensors)} sensors",
        "rotordrop": __version__,
    }
    return tuple((name, text) for name, text in facts.items() if text)


def _sections(estimate: Estimate, since: Drop | None, card: RestartCard) -> tuple[Section, ...]:
    names = [bearing.name for bearing in estimate.bearings]
    steps = estimate.replay
    tables = () if steps is None else (first_contact_table(names, steps.contacts),)
    origin = "measured and estimated" if steps is None else "measured and simulated"
    shares = weight_shares(estimate.machine)
    cross_check = Section(
        "Independent cross-check",
        statements=cross_check_statements(estimate.cross_check),
        tables=(cross_check_table(estimate.cross_check),),
    )
    force, orbit, *rest = drop_sections(
        estimate.bearings,
        origin,
        estimate.speed,
        shares,
        contact_tables=tables,
        certain=estimate.consistent,
    )
    further = (
        *rest,
        _severity(estimate),
        changed_section(estimate, since),
        restart_section(card),
        *(() if estimate.agreement is None else (agreement_section(estimate.agreement, names),)),
        _parameters(estimate),
        *(() if steps is None or steps.friction is None else (friction_section(steps.friction),)),
        *(() if steps is None else (speed_section(estimate, steps),)),
        *((_consistency(estimate),) if estimate.checks else ()),
        *((cross_check,) if estimate.cross_check else ()),
        limits_section(estimate),
        record_quality_section(estimate.findings, *unseen_in(estimate.notes)),
        drawing_section(estimate.machine),
        assumptions_section(),
        *defaults_section(estimate.machine),
    )
    return (force, orbit, *appendix(further))


def _severity(estimate: Estimate) -> Section:
    """Safety, impulse, energy, indices, fatigue of a drop, bearing by bearing, and what they rest on."""
    found = {bearing.name: severity_values(estimate, bearing) for bearing in estimate.bearings}
    uncertain = not estimate.consistent

    def at(name: str) -> Column:
        values = found[name]
        return Column(
            name,
            lambda o: replace(
                Quantity.of(values.get(o.field), o.shown_as, range_only=uncertain), places=o.places
            ),
        )

    def rating(name: str) -> str:
        ratings = numbers_of(estimate.machine.bearing(name)).ratings()
        if ratings is None:
            return f"{name}: no load ratings."
        static, dynamic = (shown(value, "force", 3) for value in (ratings.static, ratings.dynamic))
        return f"{name}: C0 = {static} of all rows ({ratings.rows}), C = {dynamic} of one, {ratings.source}."

    rows = [one for one in SEVERITY if any(one.field in values for values in found.values())]
    columns = (Column("severity", "label"), *map(at, found))
    severity = table(rows, columns, "Severity of the drop", NOTE)
    return Section("Severity", tuple(map(rating, found)), tables=(severity,))


def _parameters(estimate: Estimate) -> Section:
    """Every unknown with prior, estimate, interval and verdict; first those of the machine."""
    uncertain = not estimate.consistent
    rows: dict[str, list[ParameterRow]] = {"machine": [], "drop": []}
    for one in estimate.parameters:
        kind = one.row.display_kind
        found = Quantity.of(one.estimate, kind, range_only=uncertain)
        verdict: str = one.estimate.status
        if one.row.way_of and one.estimate.lower is not None:
            verdict = (
                f"larger than {shown(one.estimate.lower, kind)}, the most that the {one.row.way_of} moved"
            )
        # a prior is a range: its middle is nobody's word; where a replay begins is a number of its own
        spread = one.prior is not None and one.prior.standard_error is not None
        row = ParameterRow(spoken(one), Quantity.of(one.prior, kind, range_only=spread), found, verdict)
        rows[one.scope].append(row)
    tables = [parameter_table(rows["machine"], caption="Parameters of the machine", note=PRIOR_NOTE)]
    if rows["drop"]:
        tables.append(parameter_table(rows["drop"], caption="Unknowns of this drop"))
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
    steps = estimate.replay
    if steps is not None and steps.correlations:
        tables.append(correlation_table(steps.correlations))
    fixed = "" if steps is None else steps.fixed
    text = (f"The supports were taken from {fixed}; this drop did not change them.",) if fixed else ()
    figure = Figure(parameter_figure(rows["machine"]), PARAMETERS, "parameters")
    return Section("Parameters", text, figures=(figure,), tables=tuple(tables))


def _consistency(estimate: Estimate) -> Section:
    """Checks of the model against the record, and the innovations behind them."""
    name_of = names_in(estimate)
    columns = (
        Column("check", "name"),
        Column("passed", lambda check: "yes" if check.passed else "no" if check.judged else "not judged"),
        Column("numbers compared", lambda check: check.said(name_of)),
    )
    checks = table(estimate.checks, columns, "Consistency of model and record", CHECKS_NOTE)
    figures = () if estimate.innovations is None else innovation_figures(estimate.innovations)
    return Section("Consistency", (), (_judgement(estimate),), figures, (checks,))


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
