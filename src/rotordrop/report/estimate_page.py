"""The report on one recorded drop."""

from __future__ import annotations

from collections.abc import Sequence

from rotordrop._version import __version__
from rotordrop.estimation.tracked import TrackedDrop
from rotordrop.machine import Machine
from rotordrop.report.content import ReportContent, Section, Statement
from rotordrop.report.cross_check import CrossCheck, cross_check_statements, cross_check_table
from rotordrop.report.estimate_numbers import headline_card, identified_table
from rotordrop.report.machine_sections import defaults_section, weight_shares
from rotordrop.report.measured_motion import CARRIED
from rotordrop.report.quantity import Quantity
from rotordrop.report.record_quality import FindingLike, quality_statements, record_quality_section
from rotordrop.report.sections import (
    first_contact_section,
    force_section,
    impact_section,
    motion_section,
    orbit_section,
    static_limit_statement,
    stress_section,
)
from rotordrop.report.simulated_record import simulated_notice
from rotordrop.report.tracked_sections import (
    consistency_section,
    parameter_section,
    tracked_boxes,
    tracked_first_contacts,
    tracked_forces,
    tracked_impacts,
    tracked_motions,
    tracked_peaks,
    tracked_stresses,
)


def tracked_page(
    drop: TrackedDrop,
    machine: Machine,
    *,
    findings: Sequence[FindingLike] = (),
    cross_checks: Sequence[CrossCheck] = (),
    warnings: Sequence[str] = (),
    quick: bool = False,
) -> ReportContent:
    """Build the report on a drop that the tracked twin followed.

    Parameters
    ----------
    drop : TrackedDrop
        The estimate.
    machine : Machine
        The machine it was made with.
    findings : sequence of Finding
        What the plausibility checks found in the record.
    cross_checks : sequence of CrossCheck
        Comparisons with the linear joint input-state estimate.
    warnings : sequence of str
        Further warnings of the estimate.
    quick : bool
        Whether it is the estimate of a single pass.
    """
    return ReportContent(
        title="Touchdown-bearing force and stress from a recorded drop",
        subtitle=_subtitle(drop, machine),
        simulated=simulated_notice(drop.record),
        verdict=(*_verdict(drop, findings, cross_checks, warnings), *(_quick_notice(drop) if quick else ())),
        cards=tuple(
            headline_card(name, values, _peak_times(drop, name)) for name, values in drop.values.items()
        ),
        summary=(identified_table(drop.values),),
        facts=_facts(drop, machine, quick),
        sections=_sections(drop, machine, findings, cross_checks),
    )


def _quick_notice(drop: TrackedDrop) -> tuple[Statement, ...]:
    """What a single pass leaves out; the cross-check only where model and record agree."""
    unchecked = "without the independent cross-check and " if drop.cross_check is None else ""
    text = (
        f"Quick estimate: one pass over the record, {unchecked}without the search for the size of the "
        "unknown impulses. For a number that decides, leave --quick out."
    )
    return (Statement(text=text, level="notice"),)


def _subtitle(drop: TrackedDrop, machine: Machine) -> str:
    speed = Quantity(value=drop.speed, kind="speed", digits=4)
    return f"{machine.name}, {drop.name}, from {speed.text}"


def _peak_times(drop: TrackedDrop, bearing: str) -> dict[str, float]:
    fields = ("peak_force_N", "peak_stress_Pa")
    return {field: tracked_peaks(drop, field)[bearing].time for field in fields}


def _verdict(
    drop: TrackedDrop,
    findings: Sequence[FindingLike],
    cross_checks: Sequence[CrossCheck],
    warnings: Sequence[str],
) -> tuple[Statement, ...]:
    consistency = Statement(text=drop.sentence(), level="good" if drop.consistent else "bad")
    told = [finding for finding in findings if finding.message not in warnings]
    serious = [statement for statement in quality_statements(told) if statement.level in ("bad", "warning")]
    limits = [
        static_limit_statement(name, values["peak_stress_Pa"].value) for name, values in drop.values.items()
    ]
    return (
        consistency,
        *(Statement(text=warning, level="warning") for warning in warnings),
        *(cross_check_statements(cross_checks) if cross_checks else ()),
        *serious,
        *limits,
    )


def _facts(drop: TrackedDrop, machine: Machine, quick: bool) -> tuple[tuple[str, str], ...]:
    record, instant = drop.record, drop.drop_instant
    power_off = Quantity(value=instant.value, kind="time", interval_90=instant.interval_90)
    path = machine.source_path
    return (
        ("machine", machine.name if path is None else f"{machine.name} ({path.name})"),
        ("record", drop.name if record.path is None else record.path.name),
        ("SHA-256", record.sha256 or "not from a file"),
        ("power-off", f"{power_off.text} in record time (90 %: {power_off.interval_text})"),
        ("method", "tracked twin, one pass" if quick else "tracked twin"),
        ("sampling", f"{record.sampling_rate:g} Hz, {len(record.sensors)} sensors"),
        ("rotordrop", __version__),
    )


def _sections(
    drop: TrackedDrop,
    machine: Machine,
    findings: Sequence[FindingLike],
    cross_checks: Sequence[CrossCheck],
) -> tuple[Section, ...]:
    motions = tracked_motions(drop, machine)
    sections = [
        force_section(tracked_forces(drop), tracked_peaks(drop, "peak_force_N"), weight_shares(machine)),
        stress_section(tracked_stresses(drop), tracked_peaks(drop, "peak_stress_Pa"), tracked_boxes(drop)),
        impact_section(tracked_impacts(drop), force="bearing force"),
        motion_section(motions, "measured and estimated", CARRIED),
        first_contact_section(motions, tracked_first_contacts(drop)),
        orbit_section(motions),
        parameter_section(drop),
        consistency_section(drop),
    ]
    if cross_checks:
        sections.append(_cross_check_section(cross_checks))
    return (*sections, record_quality_section(findings), *defaults_section(machine))


def _cross_check_section(cross_checks: Sequence[CrossCheck]) -> Section:
    return Section(
        heading="Independent cross-check",
        statements=cross_check_statements(cross_checks),
        tables=(cross_check_table(cross_checks),),
    )
