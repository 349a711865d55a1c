"""The report on a drop that was replayed by the paper's route."""

from __future__ import annotations

from collections.abc import Sequence

from rotordrop._version import __version__
from rotordrop.estimation.replayed import ReplayDrop
from rotordrop.machine import Machine
from rotordrop.report.content import Figure, ReportContent, Section, Statement
from rotordrop.report.estimate_numbers import headline_card, identified_table
from rotordrop.report.force import Peak
from rotordrop.report.from_simulation import force_histories, peak_stress, stress_boxes, stress_histories
from rotordrop.report.impacts import impacts_of
from rotordrop.report.machine_sections import defaults_section, weight_shares
from rotordrop.report.measured_motion import CARRIED
from rotordrop.report.quantity import Quantity
from rotordrop.report.radial import radial_figure
from rotordrop.report.record_quality import FindingLike, quality_statements, record_quality_section
from rotordrop.report.replay_sections import (
    agreement_section,
    friction_section,
    gap_limit_motions,
    measured_first_contacts,
    replay_motions,
    replay_speed_section,
    stiffness_tables,
    support_section,
)
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

OPEN_LOOP = (
    "This is the paper's route, an open-loop replay; the tracked twin (--method tracked) follows the record "
    "and gives narrower intervals."
)


def replay_page(
    drop: ReplayDrop,
    machine: Machine,
    *,
    findings: Sequence[FindingLike] = (),
    warnings: Sequence[str] | None = None,
) -> ReportContent:
    """Build the report on a drop replayed by the paper's route (Neisi 2020, Fig. 4).

    Parameters
    ----------
    drop : ReplayDrop
        The estimate.
    machine : Machine
        The machine it was made with.
    findings : sequence of Finding
        What the plausibility checks found in the record.
    warnings : sequence of str, optional
        What to warn of; what the drop itself warns of by default.
    """
    speed = Quantity(value=drop.speed.initial, kind="speed", digits=4)
    return ReportContent(
        title="Touchdown-bearing force and stress by replay of a recorded drop",
        subtitle=f"{machine.name}, {drop.name}, from {speed.text}",
        simulated=simulated_notice(drop.record),
        verdict=_verdict(drop, findings, drop.warnings if warnings is None else warnings),
        cards=tuple(
            headline_card(name, values, {"peak_force_N": drop.peak_times[name]})
            for name, values in drop.values.items()
        ),
        summary=(identified_table(drop.values, taken_over=drop.fixed),),
        facts=_facts(drop, machine),
        sections=_sections(drop, machine, findings),
    )


def _verdict(
    drop: ReplayDrop, findings: Sequence[FindingLike], words: Sequence[str]
) -> tuple[Statement, ...]:
    told = [finding for finding in findings if finding.message not in words]
    serious = [statement for statement in quality_statements(told) if statement.level in ("bad", "warning")]
    limits = [
        static_limit_statement(name, values["peak_stress_Pa"].value) for name, values in drop.values.items()
    ]
    warnings = (Statement(text=warning, level="warning") for warning in words)
    return (Statement(text=OPEN_LOOP), *warnings, *serious, *limits)


def _facts(drop: ReplayDrop, machine: Machine) -> tuple[tuple[str, str], ...]:
    record, instant = drop.record, drop.drop_instant
    power_off = Quantity(value=instant.value, kind="time", interval_90=instant.interval_90)
    path = machine.source_path
    draws = "none" if drop.draws is None else f"{len(drop.draws)} drops, {drop.draws.rejected} rejected"
    return (
        ("machine", machine.name if path is None else f"{machine.name} ({path.name})"),
        ("record", drop.name if record.path is None else record.path.name),
        ("SHA-256", record.sha256 or "not from a file"),
        ("power-off", f"{power_off.text} in record time (90 %: {power_off.interval_text})"),
        ("method", "replay" if not drop.fixed else f"replay with the supports of {drop.fixed}"),
        ("intervals", draws),
        ("sampling", f"{record.sampling_rate:g} Hz, {len(record.sensors)} sensors"),
        ("rotordrop", __version__),
    )


def _peaks(drop: ReplayDrop, field: str) -> dict[str, Peak]:
    peaks = {}
    for b, (name, values) in enumerate(drop.values.items()):
        moment = drop.peak_times[name] if field == "peak_force_N" else peak_stress(drop.simulated, b)[1]
        peaks[name] = Peak(time=moment, value=values[field].value, interval_90=values[field].interval_90)
    return peaks


def _sections(drop: ReplayDrop, machine: Machine, findings: Sequence[FindingLike]) -> tuple[Section, ...]:
    motions = replay_motions(drop)
    orbits = orbit_section(motions)
    radial = Figure(
        chart=radial_figure(gap_limit_motions(drop)),
        caption="Radial displacement, simulated for both limits of the air gap (Neisi 2020, Fig. 14).",
    )
    return (
        force_section(force_histories(drop.simulated), _peaks(drop, "peak_force_N"), weight_shares(machine)),
        stress_section(
            stress_histories(drop.simulated), _peaks(drop, "peak_stress_Pa"), stress_boxes(drop.simulated)
        ),
        agreement_section(drop),
        motion_section(motions, "measured and simulated", CARRIED),
        first_contact_section(motions, measured_first_contacts(drop), stiffness_tables(drop)),
        Section(heading="Orbit", figures=(orbits.figures[0], radial)),
        impact_section(impacts_of(drop.simulated.contacts, drop.simulated.bearing_names)),
        support_section(drop),
        *friction_section(drop),
        replay_speed_section(drop),
        record_quality_section(findings),
        *defaults_section(machine),
    )
