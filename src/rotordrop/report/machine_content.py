"""What ``rotordrop check`` says about a machine, for the terminal and for a page."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from rotordrop._version import __version__
from rotordrop.report.content import Card, Cell, KeyFigure, ReportContent, Statement, Table
from rotordrop.report.machine_sections import defaults_section, drawing_section
from rotordrop.report.quantity import Quantity

if TYPE_CHECKING:
    from rotordrop.elements.race_bearing import BearingFigure
    from rotordrop.machine import Machine
    from rotordrop.rotor.machine_summary import BearingSummary, MachineSummary, MachineWarning


def machine_content(
    machine: Machine,
    summary: MachineSummary,
    warnings: tuple[MachineWarning, ...],
    *,
    drawn: bool = False,
    brief: bool = False,
) -> ReportContent:
    """Put what is known about a machine into a report.

    Parameters
    ----------
    machine, summary, warnings
        The machine, what it amounts to, what to know before trusting a result of it.
    drawn : bool
        With the rotor's drawing, for a page.
    brief : bool
        For one screen: where the drop model ends is named only, and defaults are counted only.
    """
    open_values = defaults_section(machine)
    tables = () if brief else tuple(table for section in open_values for table in section.tables)
    return ReportContent(
        title=f"Machine: {machine.name}",
        subtitle="; ".join(machine.notes),
        facts=(("machine file", str(machine.source_path or "-")), ("rotordrop", __version__)),
        verdict=(_verdict(warnings), *_remarks(machine, warnings, brief)),
        cards=tuple(_card(machine, rest) for rest in summary.bearings),
        summary=(
            _rotor_table(summary),
            _mode_table(summary),
            *(() if drawn else tables),
        ),
        sections=(drawing_section(machine), *open_values) if drawn else (),
    )


def _verdict(warnings: tuple[MachineWarning, ...]) -> Statement:
    """One line: may this description be worked with?"""
    doubtful = [warning for warning in warnings if warning.doubtful]
    if doubtful:
        count = "one value looks" if len(doubtful) == 1 else f"{len(doubtful)} values look"
        text = f"The file can be read, but {count} wrong: {', '.join(_named(doubtful))}."
        return Statement(text=text, level="warning")
    if warnings:
        kinds = len({warning.kind for warning in warnings})
        what = "one thing" if kinds == 1 else f"{kinds} things"
        return Statement(text=f"The machine can be worked with; {what} to know below.", level="good")
    text = "The machine can be worked with; the drop model leaves out nothing known of it."
    return Statement(text=text, level="good")


def _named(warnings: Iterable[MachineWarning]) -> list[str]:
    """Kinds of warning, each with the places it was found at."""
    places: dict[str, list[str]] = {}
    for warning in warnings:
        places.setdefault(warning.kind, []).append(warning.bearing)
    return [f"{kind} ({', '.join(dict.fromkeys(found))})" for kind, found in places.items()]


def _remarks(machine: Machine, warnings: tuple[MachineWarning, ...], brief: bool) -> list[Statement]:
    told = [warning for warning in warnings if warning.doubtful or not brief]
    remarks = [Statement(text=warning.message, level="warning") for warning in told]
    if not brief:
        return remarks
    limits = _named(warning for warning in warnings if not warning.doubtful)
    if limits:
        remarks.append(Statement(text=f"To know: {'; '.join(limits)}. 'check --all' says why, with numbers."))
    assumed, inferred = len(machine.defaults_in_use), len(machine.inferred)
    if assumed or inferred:
        text = f"{assumed} defaults in use, {inferred} values inferred; 'check --all' lists them."
        remarks.append(Statement(text=text))
    return remarks


def _card(machine: Machine, rest: BearingSummary) -> Card:
    bearing = machine.bearing(rest.name)
    return Card(
        title=rest.name,
        figures=(
            KeyFigure(label="share of the weight", value=Quantity(value=rest.load, kind="force")),
            KeyFigure(label="air gap", value=Quantity.of(bearing.air_gap, "length")),
            *(_stated(figure) for figure in rest.figures),
            KeyFigure(
                label="pressure of rotor on race at rest",
                value=Quantity(value=rest.contact_pressure, kind="pressure"),
            ),
            KeyFigure(
                label="tangent stiffness at rest",
                value=Quantity(value=rest.tangent_stiffness, kind="stiffness"),
            ),
            KeyFigure(
                label="in series with the support",
                value=Quantity(value=rest.equivalent_stiffness, kind="stiffness"),
            ),
            KeyFigure(
                label="support by itself", value=Quantity(value=rest.support_frequency, kind="frequency")
            ),
        ),
    )


def _stated(figure: BearingFigure) -> KeyFigure:
    known = Quantity(value=figure.value, kind=figure.kind)
    if figure.described is not None:
        known = Quantity.of(figure.described, figure.kind)
    return KeyFigure(label=figure.label, value=known, note=figure.note)


def _rotor_table(summary: MachineSummary) -> Table:
    fe = summary.fe
    rows: list[tuple[Cell, ...]] = [
        ("mass", Quantity(value=fe.total_mass, kind="mass")),
        ("centre of gravity from node 1", Quantity(value=fe.centre_of_gravity, kind="dimension")),
        ("polar inertia", f"{fe.polar_inertia:.4g} kg m²"),
        ("diametral inertia about the centre of gravity", f"{fe.diametral_inertia:.4g} kg m²"),
    ]
    if summary.levitated_sag is not None:
        span = float(max(summary.levitated_sag) - min(summary.levitated_sag))
        rows.append(("levitated sag, lowest to highest node", Quantity(value=span, kind="length")))
    return Table(columns=("rotor", ""), rows=tuple(rows))


def _mode_table(summary: MachineSummary) -> Table:
    count = max(len(summary.free_free), len(summary.settled))
    columns = ("bending or support mode", *(str(number) for number in range(1, count + 1)))
    rows: tuple[tuple[Cell, ...], ...] = (
        ("free-free", *_frequencies(summary.free_free, count)),
        ("resting in its bearings, supports without mass", *_frequencies(summary.settled, count)),
    )
    return Table(columns=columns, rows=rows)


def _frequencies(values: Iterable[float], count: int) -> list[Quantity]:
    listed = [float(value) for value in values]
    return [Quantity(value=value, kind="frequency") for value in listed + [math.nan] * (count - len(listed))]


def machine_json(
    machine: Machine, summary: MachineSummary, warnings: tuple[MachineWarning, ...]
) -> dict[str, object]:
    """Give what ``rotordrop check`` found, ready for JSON, in SI units."""
    fe = summary.fe
    sag = summary.levitated_sag
    return {
        "machine": machine.name,
        "mass_kg": fe.total_mass,
        "centre_of_gravity_m": fe.centre_of_gravity,
        "polar_inertia_kg_m2": fe.polar_inertia,
        "diametral_inertia_kg_m2": fe.diametral_inertia,
        "free_free_Hz": [float(value) for value in summary.free_free],
        "settled_Hz": [float(value) for value in summary.settled],
        "levitated_sag_m": None if sag is None else [float(value) for value in sag],
        "bearings": {rest.name: _bearing_json(rest) for rest in summary.bearings},
        "warnings": [warning.message for warning in warnings],
        "defaults": [list(entry) for entry in machine.defaults_in_use],
        "inferred": [list(entry) for entry in machine.inferred],
    }


def _bearing_json(rest: BearingSummary) -> dict[str, float]:
    return {
        "load_N": rest.load,
        **{figure.field: figure.value for figure in rest.figures},
        "contact_pressure_at_rest_Pa": rest.contact_pressure,
        "tangent_stiffness_N_per_m": rest.tangent_stiffness,
        "equivalent_stiffness_N_per_m": rest.equivalent_stiffness,
        "support_frequency_Hz": rest.support_frequency,
    }
