"""The report on one recorded drop, drawn from its estimate alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotordrop._version import __version__
from rotordrop.estimate.bearing_drop import History
from rotordrop.estimate.estimate import CrossCheck, Estimate, FittedParameter, Innovations, ReplaySteps
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.published import Drop
from rotordrop.report.changed_section import changed_section
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Figure,
    Level,
    ReportContent,
    Section,
    Statement,
    Table,
)
from rotordrop.report.drop_sections import drop_sections, speed_figure, static_limit_statement
from rotordrop.report.estimate_numbers import headline_card, identified_table
from rotordrop.report.innovations import innovations_figure, nis_figure, whiteness_figure
from rotordrop.report.inspection import assumptions_section, inspection_section, limits_section
from rotordrop.report.machine_sections import defaults_section, drawing_section, weight_shares
from rotordrop.report.origin import Origin
from rotordrop.report.parameters import ParameterRow, parameter_figure, parameter_table
from rotordrop.report.quantity import Quantity, written
from rotordrop.report.record_quality import quality_statements, record_quality_section
from rotordrop.report.replay_tables import (
    contact_time_table,
    correlation_table,
    first_contact_table,
    friction_sweep_figure,
    window_table,
)
from rotordrop.report.severity_section import severity_section

KINDS = {"N": "force", "Pa": "pressure"}
PRIOR_NOTE = (
    "Below a prior or an estimate: its 90 % interval. What the record does not determine enters the "
    "intervals of force and stress by its prior."
)


def estimate_page(
    estimate: Estimate, origin: Origin | None = None, since: Drop | None = None
) -> ReportContent:
    """Build the report on one recorded drop, followed or replayed.

    Parameters
    ----------
    estimate : Estimate
        Everything the page says of the drop comes from it.
    origin : Origin, optional
        Who made it, when, by which command, from which files.
    since : Drop, optional
        Document of an earlier estimate of the machine, with which this one is compared.
    """
    return replace(estimate_summary(estimate, origin), sections=_sections(estimate, since))


def estimate_summary(estimate: Estimate, origin: Origin | None = None) -> ReportContent:
    """The same without its sections: what a terminal shows, for which no figure need be drawn."""
    speed = Quantity(value=estimate.speed, kind="speed", digits=4)
    replayed = isinstance(estimate.method, Replay)
    fixed = estimate.replay.fixed if estimate.replay else ""
    return ReportContent(
        title=f"Touchdown-bearing force and stress {'by replay of' if replayed else 'from'} a recorded drop",
        subtitle=f"{estimate.machine.name}, {estimate.name}, from {speed.text}",
        simulated=SIMULATED_RECORD if estimate.simulated_record else "",
        verdict=_verdict(estimate),
        cards=tuple(headline_card(b, certain=estimate.consistent) for b in estimate.bearings),
        summary=(identified_table(estimate.bearings, taken_over=fixed, certain=estimate.consistent),),
        facts=(*_facts(estimate), *(origin or Origin()).facts(estimate.record.sha256)),
    )


def estimate_figures(estimate: Estimate) -> dict[str, object]:
    """Figures of the page by name."""
    return dict(estimate_page(estimate).figures)


def _verdict(estimate: Estimate) -> tuple[Statement, ...]:
    """What model and record say of each other first, then warnings, notes and limits."""
    told = [f for f in estimate.findings if f.message not in estimate.warnings]
    serious = [s for s in quality_statements(told) if s.level in ("bad", "warning")]
    return (
        _judgement(estimate),
        _part(estimate),
        *(Statement(text=_in_words(estimate, text), level="warning") for text in estimate.warnings),
        *cross_check_statements(estimate.cross_check),
        *serious,
        *(Statement(text=_in_words(estimate, note)) for note in estimate.notes),
        *(static_limit_statement(b, certain=estimate.consistent) for b in estimate.bearings),
    )


def _judgement(estimate: Estimate) -> Statement:
    level: Level = "good" if estimate.consistent else "bad"
    if isinstance(estimate.method, Replay):
        level = "notice"
    elif estimate.consistent and any(not check.passed for check in estimate.checks):
        level = "warning"
    return Statement(text=estimate.sentence, level=level)


def _part(estimate: Estimate) -> Statement:
    """Which part of the record the numbers are of, and what the rest says."""
    until = f"{1e3 * estimate.until:.0f} ms"
    text = f"Peaks are the largest of the first {until} after power-off"
    if not estimate.later:
        return Statement(text=f"{text}; the record ends there.")
    if any(one.larger for one in estimate.later):
        return Statement(text=f"{text}, and the rotor went further out later on.", level="warning")
    return Statement(text=f"{text}; in the rest of the record the rotor went no further out.")


def _facts(estimate: Estimate) -> tuple[tuple[str, str], ...]:
    record, instant, machine = estimate.record, estimate.drop_instant, estimate.machine
    power_off = Quantity(value=instant.value, kind="time", interval_90=instant.interval_90)
    path = machine.source_path
    return (
        ("machine", machine.name if path is None else f"{machine.name} ({path.name})"),
        ("record", estimate.name if record.path is None else record.path.name),
        ("SHA-256", record.sha256 or "not from a file"),
        *((("event", event),) if (event := record.event_date) else ()),
        ("power-off", f"{power_off.text} in record time (90 %: {power_off.interval_text})"),
        ("method", _method(estimate)),
        *(() if estimate.replay is None else (("intervals", _draws(estimate.replay)),)),
        ("estimated part", f"0 to {1e3 * estimate.until:.0f} ms after power-off"),
        ("sampling", f"{record.sampling_rate:g} Hz, {len(record.sensors)} sensors"),
        ("rotordrop", __version__),
    )


def _method(estimate: Estimate) -> str:
    if estimate.replay is not None:
        return f"replay with the supports of {estimate.replay.fixed}" if estimate.replay.fixed else "replay"
    quick = not isinstance(estimate.method, Replay) and estimate.method.quick
    return "tracked twin, one pass" if quick else "tracked twin"


def _draws(steps: ReplaySteps) -> str:
    return "none" if steps.draws is None else f"{steps.draws} drops, {steps.rejected} rejected"


def _sections(estimate: Estimate, since: Drop | None) -> tuple[Section, ...]:
    names = [bearing.name for bearing in estimate.bearings]
    steps = estimate.replay
    tables = () if steps is None else (first_contact_table(names, steps.contacts),)
    origin = "measured and estimated" if steps is None else "measured and simulated"
    return (
        *drop_sections(
            estimate.bearings,
            origin,
            estimate.speed,
            weight_shares(estimate.machine),
            contact_tables=tables,
        ),
        severity_section(estimate),
        changed_section(estimate, since),
        *_agreement(estimate, names),
        _parameters(estimate),
        *_friction(steps),
        *_speed(estimate),
        *_consistency(estimate),
        *_cross_check(estimate.cross_check),
        inspection_section(estimate),
        limits_section(estimate),
        record_quality_section(estimate.findings),
        drawing_section(estimate.machine),
        assumptions_section(),
        *defaults_section(estimate.machine),
    )


def _parameters(estimate: Estimate) -> Section:
    """Every unknown with prior, estimate, interval and verdict; first those of the machine."""
    rows: dict[str, list[ParameterRow]] = {"machine": [], "drop": []}
    for one in estimate.parameters:
        kind = one.row.display_kind
        rows[one.scope].append(
            ParameterRow(
                name=spoken(one),
                prior=Quantity.of(one.prior, kind),
                estimate=Quantity.of(one.estimate, kind, range_only=not estimate.consistent),
                verdict=one.estimate.status,
            )
        )
    tables = [parameter_table(rows["machine"], caption="Parameters of the machine", note=PRIOR_NOTE)]
    if rows["drop"]:
        tables.append(parameter_table(rows["drop"], caption="Unknowns of this drop"))
    if estimate.sensors:
        tables.append(_sensors(estimate))
    if estimate.unbalance:
        tables.append(_unbalance(estimate))
    steps = estimate.replay
    if steps is not None and steps.correlations:
        tables.append(correlation_table(steps.correlations))
    figure = Figure(
        chart=parameter_figure(rows["machine"]),
        caption="Estimates with 90 % intervals over their priors, both relative to the prior's centre. Where "
        "the blue bar is as wide as the grey one, the record says nothing about the parameter.",
        name="parameters",
    )
    taken = steps is not None and steps.fixed
    text = (
        (f"The supports were taken from {steps.fixed}; this drop did not change them.",)
        if steps and taken
        else ()
    )
    return Section(heading="Parameters", text=text, figures=(figure,), tables=tuple(tables))


def spoken(one: FittedParameter) -> str:
    """Name of an unknown for people: what it belongs to, and what it is."""
    if one.row.owner == "unbalance":
        return f"{one.row.label} of unbalance {int(one.owner) + 1}" if one.owner.isdigit() else one.row.label
    return f"{one.owner}: {one.row.label}" if one.owner else one.row.label


def _in_words(estimate: Estimate, text: str) -> str:
    """A sentence with its unknowns named as the tables name them."""
    for one in sorted(estimate.parameters, key=lambda one: -len(one.path)):
        text = text.replace(one.path, spoken(one))
    return text


def _sensors(estimate: Estimate) -> Table:
    certain = estimate.consistent
    return Table(
        columns=("sensor", "gain error", "offset", "noise (standard deviation)"),
        rows=tuple(
            (
                one.sensor,
                Quantity.of(one.gain_error, "share", range_only=not certain),
                Quantity.of(one.offset, "length", range_only=not certain),
                Quantity(value=one.noise, kind="length", digits=2),
            )
            for one in estimate.sensors
        ),
        caption="Sensors",
        note="Gains and offsets are estimated with the motion; the settled tail ties them to the air gap.",
    )


def _unbalance(estimate: Estimate) -> Table:
    certain = estimate.consistent
    return Table(
        columns=("node", "amount", "phase against the mark", "verdict"),
        rows=tuple(
            (
                str(one.node),
                Quantity.of(one.amount, "unbalance", range_only=not certain),
                one.reason if one.phase is None else Quantity.of(one.phase, "angle"),
                one.amount.status if one.phase is None else one.phase.status,
            )
            for one in estimate.unbalance
        ),
        caption="Unbalance",
        note="Phase: direction of the heavy spot when the mark of the shaft passes, from +y with the spin.",
    )


def _consistency(estimate: Estimate) -> tuple[Section, ...]:
    """Checks of the model against the record, and the innovations behind them."""
    if not estimate.checks:
        return ()
    figures = () if estimate.innovations is None else _innovations(estimate.innovations)
    table = Table(
        columns=("check", "passed", "numbers compared"),
        rows=tuple(
            (check.name, "yes" if check.passed else "no", _in_words(estimate, check.message))
            for check in estimate.checks
        ),
        caption="Consistency of model and record",
        note="The checks see what moves the readings; a contact stiffness or exponent that hardly does "
        "enters by its prior, and its verdict says so.",
    )
    return (
        Section(heading="Consistency", statements=(_judgement(estimate),), figures=figures, tables=(table,)),
    )


def _innovations(found: Innovations) -> tuple[Figure, ...]:
    normalised = found.values / found.deviation
    square = np.nan_to_num(np.nanmean(normalised**2, axis=1), nan=1.0)
    return (
        Figure(
            chart=innovations_figure(found.time, found.values, found.channels, found.deviation),
            caption="What each reading says beyond the prediction from all readings before it.",
            name="innovations",
        ),
        Figure(
            chart=nis_figure(found.time, square, found.limits),
            caption="Innovations squared over what the filter expects: one where model and noise are right.",
            name="innovations squared",
        ),
        Figure(
            chart=whiteness_figure(
                np.nan_to_num(normalised), found.channels, float(found.time[1] - found.time[0])
            ),
            caption="Autocorrelation of the innovations; a correct model leaves none.",
            name="whiteness",
        ),
    )


def cross_check_statements(checks: Sequence[CrossCheck]) -> tuple[Statement, ...]:
    """One warning per disagreement of a number that stands, or one sentence that all agree.

    Where the estimate gave way to the cross-check its verdict says so, and there is nothing to compare.
    """
    standing = [check for check in checks if not check.replaced]
    if not standing:
        return ()
    warnings = tuple(
        Statement(
            text=f"{check.name}: the cross-check finds {_other(check).text} against {_own(check).text}, "
            f"a difference of {written(100 * check.difference, 0)} % where "
            f"± {100 * check.accuracy:.3g} % is known.",
            level="warning",
        )
        for check in standing
        if not check.agrees
    )
    return warnings or (
        Statement(text="The independent cross-check agrees within its known accuracy.", level="good"),
    )


def cross_check_table(checks: Sequence[CrossCheck]) -> Table:
    """Set estimate and cross-check side by side with their difference and the accuracy that is known."""
    return Table(
        columns=("quantity", "tracked twin", "cross-check", "difference", "known accuracy", "verdict"),
        rows=tuple(
            (
                check.name,
                _own(check),
                _other(check),
                "–" if check.replaced else Quantity(value=check.difference, kind="share", digits=2),
                f"± {100 * check.accuracy:.3g} %",
                "stated in place of the twin"
                if check.replaced
                else "agrees"
                if check.agrees
                else "disagrees",
            )
            for check in checks
        ),
        caption="Independent cross-check",
        note="The cross-check knows the rotor only: no contact, friction or support parameter enters it. "
        "From a twin that fits its record it takes sensor errors, air gaps and, for the stress, the "
        "preload; from one that does not it takes nothing.",
    )


def _own(check: CrossCheck) -> Quantity:
    return Quantity.of(check.estimate, KINDS[check.estimate.unit], digits=3)


def _other(check: CrossCheck) -> Quantity:
    return Quantity(value=check.check, kind=KINDS[check.estimate.unit], digits=3)


def _cross_check(checks: Sequence[CrossCheck]) -> tuple[Section, ...]:
    if not checks:
        return ()
    return (
        Section(
            heading="Independent cross-check",
            statements=cross_check_statements(checks),
            tables=(cross_check_table(checks),),
        ),
    )


def _agreement(estimate: Estimate, names: Sequence[str]) -> tuple[Section, ...]:
    """How far a replay follows the record, and how long a comparison point by point means anything."""
    agreement = estimate.agreement
    if agreement is None:
        return ()
    horizon = min(bearing.horizon for bearing in agreement.bearings)
    text = (
        f"Replay and record stay within a tenth of the air gap for {1e3 * horizon:.0f} ms. A drop is "
        "chaotic: small differences grow tenfold in about 33 ms, so later only statistics can be compared."
    )
    if agreement.expected_horizon is not None:
        expected = 1e3 * agreement.expected_horizon
        text += f" With everything that is uncertain here, {expected:.0f} ms are to be expected."
    tables = (window_table(agreement, names), contact_time_table(agreement, names))
    return (Section(heading="Agreement with the record", text=(text,), tables=tables),)


def _friction(steps: ReplaySteps | None) -> tuple[Section, ...]:
    """The sweep of the friction coefficient, if there was one."""
    if steps is None or steps.friction is None:
        return ()
    value = Quantity.of(steps.friction.value, "dimensionless", digits=2)
    start, end = (Quantity(value=t, kind="time", digits=3).text for t in steps.friction.window)
    figure = Figure(
        chart=friction_sweep_figure(steps.friction),
        caption=f"Distance of simulated and measured orbit from {start} to {end}; best {value.text} "
        f"(90 %: {value.interval_text}). A number in place of the paper's eye.",
    )
    return (Section(heading="Friction", figures=(figure,)),)


def _speed(estimate: Estimate) -> tuple[Section, ...]:
    """Recorded and simulated speed with the time constants found."""
    steps, record = estimate.replay, estimate.record
    if steps is None:
        return ()
    histories = [History(label="simulated", time=steps.speed_time, values=steps.speed_simulated)]
    if record.speed is not None and record.measured_speed is not None:
        time = np.asarray(record.time) - estimate.drop_instant.value
        measured = History(label="measured", time=time, values=np.asarray(record.speed), role="measured")
        histories.insert(0, measured.between(0.0, float(steps.speed_time[-1])))
    constant = Quantity.of(steps.speed.aero_time_constant, "duration")
    profile = Quantity(value=steps.speed.profile_time_constant, kind="duration", digits=3).text
    text = (
        f"Aerodynamic time constant {constant.text} ({constant.interval_text or constant.status}); "
        f"a plain exponential through the record, friction included, has {profile}."
    )
    figure = Figure(
        chart=speed_figure(histories), caption="Speed of the rotor, measured and simulated.", name="speed"
    )
    return (Section(heading="Speed", text=(text,), figures=(figure,)),)
