"""What ``rotordrop check`` says about a machine, for the terminal and for a page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from rotordrop._version import __version__
from rotordrop.report.content import Card, Column, KeyFigure, ReportContent, Statement, Table, fact, table
from rotordrop.report.machine_sections import defaults_section, drawing_section
from rotordrop.report.quantity import Quantity

if TYPE_CHECKING:
    from rotordrop.elements.race_bearing import BearingFigure
    from rotordrop.elements.touchdown_bearing import TouchdownBearing
    from rotordrop.machine import Machine
    from rotordrop.rotor.assembly import RotorFE
    from rotordrop.rotor.machine_summary import BearingSummary, MachineSummary, MachineWarning
    from rotordrop.rotor.magnet_loop import LoopStability, MagnetSummary

ALL_RIGHT = "The machine can be worked with; the drop model leaves out nothing known of it."


def machine_content(
    machine: Machine,
    summary: MachineSummary,
    warnings: tuple[MachineWarning, ...],
    *,
    drawn: bool = False,
    brief: bool = False,
) -> ReportContent:
    """Put what is known about a machine into a report: what it amounts to, what to know before trusting it.

    For a page it is ``drawn``; for one screen it is ``brief``: where the drop model ends is named only, and
    defaults are counted only.
    """
    open_values = defaults_section(machine)
    tables = () if brief or drawn else tuple(found for section in open_values for found in section.tables)
    rotor, sag = rotor_values(summary.fe, 4), summary.levitated_sag
    if sag is not None:
        span = float(max(sag) - min(sag))
        rotor.append(("levitated sag, lowest to highest node", Quantity.of(span, "length")))
    modes = (
        ("free-free", summary.free_free),
        ("resting in its bearings, supports without mass", summary.settled),
    )
    return ReportContent(
        title=f"Machine: {machine.name}",
        subtitle="; ".join(machine.notes),
        facts=(("machine file", str(machine.source_path or "-")), ("rotordrop", __version__)),
        verdict=(
            _verdict(warnings),
            *(one for rest in summary.bearings for one in _has(machine.bearing(rest.name), rest)),
            *_remarks(machine, warnings, brief),
        ),
        cards=(
            *(_card(machine, rest) for rest in summary.bearings),
            *(_magnet_card(one, summary.loop) for one in summary.magnets),
        ),
        summary=(named_values("rotor", rotor), mode_table(modes, "bending or support"), *tables),
        sections=(drawing_section(machine), *open_values) if drawn else (),
    )


def _verdict(warnings: tuple[MachineWarning, ...]) -> Statement:
    """One line: may this description be worked with?"""
    doubtful = [warning for warning in warnings if warning.doubtful]
    if doubtful:
        count = "one value looks" if len(doubtful) == 1 else f"{len(doubtful)} values look"
        text = f"The file can be read, but {count} wrong: {', '.join(_named(doubtful))}."
        return Statement(text, "warning")
    kinds = len({warning.kind for warning in warnings})
    what = "one thing" if kinds == 1 else f"{kinds} things"
    known = f"The machine can be worked with; {what} to know below."
    return Statement(known if warnings else ALL_RIGHT, "good")


def _named(warnings: Iterable[MachineWarning]) -> list[str]:
    """Kinds of warning, each with the places it was found at."""
    places: dict[str, list[str]] = {}
    for warning in warnings:
        places.setdefault(warning.kind, []).append(warning.bearing)
    return [f"{kind} ({', '.join(dict.fromkeys(found))})" for kind, found in places.items()]


def _has(bearing: TouchdownBearing, rest: BearingSummary) -> Iterator[Statement]:
    """What a bearing has beyond balls and a plain support, and what of it counts with the support."""
    springs = ["preload springs"] * (bearing.bearing.ring_travel is not None)
    mount = [f"a mount ({', '.join(bearing.mount.stiffnesses)})"] * bearing.mount.present
    parts = [*springs, *mount, *(["a face"] * (bearing.face is not None))]
    if parts:
        held = f"; its support counts with {' and '.join(rest.beside_support)}" if rest.beside_support else ""
        yield Statement(f"{bearing.name} has {', '.join(parts)}{held}.")


def _remarks(machine: Machine, warnings: tuple[MachineWarning, ...], brief: bool) -> list[Statement]:
    said = [Statement(one.message, "warning") for one in warnings if one.doubtful or not brief]
    if not brief:
        return said
    limits = _named(warning for warning in warnings if not warning.doubtful)
    if limits:
        said.append(Statement(f"To know: {'; '.join(limits)}. 'check --all' says why, with numbers."))
    assumed, inferred = len(machine.defaults_in_use), len(machine.inferred)
    if assumed or inferred:
        text = f"{assumed} defaults in use, {inferred} values inferred; 'check --all' lists them."
        said.append(Statement(text))
    return said


def _card(machine: Machine, rest: BearingSummary) -> Card:
    def stated(figure: BearingFigure) -> KeyFigure:
        known = figure.value if figure.described is None else figure.described
        return fact(figure.label, known, figure.kind, note=figure.note)

    return Card(
        rest.name,
        (
            fact("share of the weight", rest.load, "force"),
            fact("air gap", machine.bearing(rest.name).air_gap, "length"),
            *map(stated, rest.figures),
            fact("pressure of rotor on race at rest", rest.contact_pressure, "pressure"),
            fact("tangent stiffness at rest", rest.tangent_stiffness, "stiffness"),
            fact("in series with the support", rest.equivalent_stiffness, "stiffness"),
            fact("support by itself", rest.support_frequency, "frequency"),
        ),
    )


def _magnet_card(one: MagnetSummary, loop: LoopStability | None) -> Card:
    """A magnet at its operating point, and its loop with the mass it carries as a point."""
    figures = [
        fact("force by current", one.by_current, "force_by_current"),
        fact("negative stiffness", one.by_way, "stiffness"),
        fact("inductance of a coil", one.inductance, "inductance"),
        fact("pull beyond the weight, rotor at rest", one.spare_at_rest, "force"),
    ]
    if math.isfinite(one.lift.time):
        figures.append(fact("lift at full current, by the slopes", one.lift.time, "time"))
    if one.margins is not None:
        figures += [
            fact("crossover", one.margins.crossover / (2.0 * math.pi), "frequency"),
            fact("phase margin", one.margins.phase, "angle"),
            fact("delay margin, rigid rotor", one.margins.delay, "time"),
        ]
    if loop is not None and loop.longest_delay is not None:
        figures.append(fact("longest delay, bending included", loop.longest_delay, "time"))
    return Card(f"magnet {one.name}", tuple(figures))


def named_values(head: str, rows: Iterable[tuple[str, object]]) -> Table:
    """A table of two columns: what it is, and its value."""
    columns = (Column(head, lambda row: row[0]), Column("", lambda row: row[1]))
    return table(rows, columns)


def rotor_values(fe: RotorFE, digits: int) -> list[tuple[str, object]]:
    """Mass, centre of gravity and inertias of a rotor, for a table."""
    return [
        ("mass", Quantity.of(fe.total_mass, "mass")),
        ("centre of gravity from node 1", Quantity.of(fe.centre_of_gravity, "dimension")),
        ("polar inertia", f"{fe.polar_inertia:.{digits}g} kg m²"),
        ("diametral inertia about the centre of gravity", f"{fe.diametral_inertia:.{digits}g} kg m²"),
    ]


def mode_table(modes: Iterable[tuple[str, Iterable[float]]], head: str, count: int = 0) -> Table:
    """Frequencies of the lowest modes [Hz], one line for each way the rotor is held."""

    def frequency(number: int) -> Column:
        return Column(
            f"mode {number + 1}",
            lambda row: row[1][number] if number < len(row[1]) else None,
            "frequency",
        )

    rows = [(name, list(values)) for name, values in modes]
    count = count or max(len(values) for _, values in rows)
    return table(rows, (Column(head, lambda row: row[0]), *map(frequency, range(count))))


def machine_json(
    machine: Machine, summary: MachineSummary, warnings: tuple[MachineWarning, ...]
) -> dict[str, object]:
    """Give what ``rotordrop check`` found, ready for JSON, in SI units."""
    sag = summary.levitated_sag
    return {
        "machine": machine.name,
        **inertias_json(summary.fe),
        "free_free_Hz": [float(value) for value in summary.free_free],
        "settled_Hz": [float(value) for value in summary.settled],
        "levitated_sag_m": None if sag is None else [float(value) for value in sag],
        "bearings": {
            rest.name: {
                "load_N": rest.load,
                **{figure.field: figure.value for figure in rest.figures},
                "contact_pressure_at_rest_Pa": rest.contact_pressure,
                "tangent_stiffness_N_per_m": rest.tangent_stiffness,
                "equivalent_stiffness_N_per_m": rest.equivalent_stiffness,
                "support_frequency_Hz": rest.support_frequency,
            }
            for rest in summary.bearings
        },
        **({"magnets": {one.name: _magnet_json(one) for one in summary.magnets}} if summary.magnets else {}),
        **({} if summary.loop is None else {"control_loop": _loop_json(summary.loop)}),
        "warnings": [warning.message for warning in warnings],
        "defaults": [list(entry) for entry in machine.defaults_in_use],
        "inferred": [list(entry) for entry in machine.inferred],
    }


def _magnet_json(one: MagnetSummary) -> dict[str, object]:
    known: dict[str, object] = {
        "force_by_current_N_per_A": one.by_current,
        "negative_stiffness_N_per_m": one.by_way,
        "inductance_H": one.inductance,
        "spare_force_at_rest_N": one.spare_at_rest,
        "linear_lift": {
            "deepest_m": one.lift.deepest,
            "time_s": one.lift.time if math.isfinite(one.lift.time) else None,
            "speed_m_per_s": one.lift.speed,
        },
    }
    if one.margins is not None:
        known |= {
            "crossover_Hz": one.margins.crossover / (2.0 * math.pi),
            "phase_margin_rad": one.margins.phase,
            "delay_margin_s": one.margins.delay,
        }
    return known


def _loop_json(loop: LoopStability) -> dict[str, object]:
    return {
        "stable": loop.stable,
        "growth_per_s": loop.growth,
        "frequency_Hz": loop.frequency,
        "delay_s": loop.delay,
        "longest_delay_s": loop.longest_delay,
    }


def inertias_json(fe: RotorFE) -> dict[str, object]:
    """Mass, centre of gravity and inertias of a rotor, ready for JSON [SI]."""
    return {
        "mass_kg": fe.total_mass,
        "centre_of_gravity_m": fe.centre_of_gravity,
        "polar_inertia_kg_m2": fe.polar_inertia,
        "diametral_inertia_kg_m2": fe.diametral_inertia,
    }
