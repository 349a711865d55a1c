"""The report on critical speeds: map, Campbell diagrams and mode shapes, with their numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement, Table
from rotordrop.report.critical_speeds_figure import (
    campbell_figure,
    critical_speed_figure,
    mode_shape_figure,
    stability_figure,
)
from rotordrop.report.machine_sections import defaults_section
from rotordrop.report.quantity import Quantity
from rotordrop.rotor.campbell import (
    CampbellDiagram,
    Separation,
    StabilityMap,
    amplification_factor,
    separations,
)
from rotordrop.rotor.critical_speeds import CriticalSpeedMap

if TYPE_CHECKING:
    from rotordrop.machine import Machine

TURN = 2.0 * math.pi
HIGHEST = 1000.0
SHAPES = 6
AT_LINES = {
    "tangent": "bearings' tangent stiffness, supports without mass",
    "simple": "simple formula, supports without mass",
    "with contact": "tangent stiffness and contact, supports without mass",
    "with support mass": "tangent stiffness, supports with mass",
}
_WHIRL_WORDS = {
    "standstill": "natural frequencies at standstill",
    "forward": "forward critical speeds",
    "backward": "backward critical speeds",
}


def critical_speeds_page(
    machine: Machine,
    maps: Mapping[str, CriticalSpeedMap],
    diagrams: Mapping[str, CampbellDiagram],
    stability: Sequence[StabilityMap] = (),
) -> ReportContent:
    """Build the report on critical speeds.

    Parameters
    ----------
    machine : Machine
        The machine.
    maps : mapping of str to CriticalSpeedMap
        By whirl: "standstill" as in the paper, "forward", "backward".
    diagrams : mapping of str to CampbellDiagram
        By what holds the rotor.
    stability : sequence of StabilityMap
        One for each suspension that has one.
    """
    return ReportContent(
        title=f"Critical speeds of {machine.name}",
        verdict=_verdict(machine, maps["standstill"], diagrams),
        cards=_cards(maps["standstill"]),
        facts=(("machine", machine.name), ("rotordrop", __version__)),
        summary=(line_table(maps["standstill"]), crossing_table(diagrams, float(machine.speed.nominal))),
        sections=(
            *(_map_section(found) for found in maps.values()),
            *(_campbell_section(machine, diagram) for diagram in diagrams.values()),
            *(_stability_section(machine, stability) if stability else ()),
            *defaults_section(machine),
        ),
    )


def critical_speeds_json(
    maps: Mapping[str, CriticalSpeedMap],
    diagrams: Mapping[str, CampbellDiagram],
    stability: Sequence[StabilityMap] = (),
) -> dict[str, Any]:
    """Everything the page shows, ready for JSON, SI units; null where there is no line."""
    return {
        "maps": {name: _map_json(found) for name, found in maps.items()},
        "campbell": {name: _campbell_json(diagram) for name, diagram in diagrams.items()},
        "stability": {
            one.suspension: {
                "speed_Hz": one.speed / TURN,
                "node": one.node,
                "coupling_N_m": one.coupling.tolist(),
                "logarithmic_decrement": one.decrement.tolist(),
                "limit_N_m": one.limit if math.isfinite(one.limit) else None,
            }
            for one in stability
        },
    }


_WORST_FIRST = ("bad", "good", "warning", "notice")


def _verdict(
    machine: Machine, found: CriticalSpeedMap, diagrams: Mapping[str, CampbellDiagram]
) -> tuple[Statement, ...]:
    massless, massive = found.at_lines["tangent"], found.at_lines["with support mass"]
    statements = [
        Statement(
            text="Settled in the touchdown bearings, with supports without mass as in the paper, the rotor "
            f"has natural frequencies of {_listed(massless)} Hz; with the mass of the supports "
            f"{_listed(massive)} Hz. The paper's map leaves that mass out."
        )
    ]
    top = float(machine.speed.nominal)
    for name, diagram in diagrams.items():
        forward = [c for c in diagram.crossings if c.direction != "backward" and c.speed <= top]
        if forward:
            speeds = ", ".join(f"{c.speed / TURN:.1f}" for c in forward)
            text = f"{_held(name)}: forward or mixed modes meet the rotor's own speed at {speeds} Hz"
            statements.append(Statement(text=f"{text}, up to the nominal speed."))
        statements += _margins(name, diagram, top)
    if not any(one.level == "bad" for one in statements):
        clear = "No critical speed of the held rotor is nearer to the nominal speed than API 617 asks for."
        statements.append(Statement(text=clear, level="good"))
    return tuple(sorted(statements, key=lambda one: _WORST_FIRST.index(one.level)))


def _margins(name: str, diagram: CampbellDiagram, nominal: float) -> list[Statement]:
    """One problem per critical speed that is nearer to the nominal speed than API 617 asks for."""
    return [_too_near(name, one, nominal) for one in separations(diagram, nominal, nominal) if not one.met]


def _too_near(name: str, one: Separation, nominal: float) -> Statement:
    crossing = one.crossing
    return Statement(
        text=f"{_held(name)}: a {crossing.direction} mode meets the rotor's own speed at "
        f"{_speed_text(crossing.speed)}, {one.margin:.1%} from the nominal speed of {_speed_text(nominal)}, "
        f"with a damping ratio of {crossing.damping_ratio:.2%} and an amplification factor of "
        f"{one.factor:.1f}; API 617 asks for {one.required:.1%}.",
        level="warning" if name == "free-free" else "bad",
    )


def _speed_text(speed: float) -> str:
    return f"{speed / TURN:.1f} Hz ({60.0 * speed / TURN:.0f} rpm)"


def _held(name: str) -> str:
    return "Free-free" if name == "free-free" else f"In its {name}"


def _listed(frequencies: Any) -> str:
    return ", ".join(f"{frequency:.1f}" for frequency in frequencies[:4] if np.isfinite(frequency))


def _cards(found: CriticalSpeedMap) -> tuple[Card, ...]:
    cards = []
    for part in found.lines:
        values = (
            ("Static load", part.load, "force"),
            ("Ball bearing, tangent", part.tangent, "stiffness"),
            ("Ball bearing, simple formula", part.simple, "stiffness"),
            ("Support", part.support, "stiffness"),
            ("Equivalent, tangent", part.equivalent("tangent"), "stiffness"),
            ("Equivalent, simple formula", part.equivalent("simple"), "stiffness"),
        )
        figures = tuple(
            KeyFigure(label=label, value=Quantity(value=value, kind=kind, digits=4))
            for label, value, kind in values
        )
        cards.append(Card(title=f"{part.bearing} touchdown bearing", figures=figures))
    return tuple(cards)


def line_table(found: CriticalSpeedMap) -> Table:
    """Frequencies with every bearing at its own stiffness, by every way to reckon it."""
    count = len(found.at_lines["tangent"])
    rows = tuple(
        (
            AT_LINES[name],
            *(f"{value:.1f}" if np.isfinite(value) else "–" for value in found.at_lines[name]),
        )
        for name in AT_LINES
    )
    return Table(
        columns=("every bearing at its own stiffness", *(f"line {k + 1} [Hz]" for k in range(count))),
        rows=rows,
        caption=f"Where the map meets the machine: {_WHIRL_WORDS[found.whirl]}",
    )


def crossing_table(diagrams: Mapping[str, CampbellDiagram], nominal: float) -> Table:
    """Critical speeds with damping, amplification factor and margin from the nominal speed [rad/s]."""
    rows = []
    for name, diagram in diagrams.items():
        judged = {id(one.crossing): one for one in separations(diagram, nominal, nominal)}
        for crossing in diagram.crossings:
            one = judged.get(id(crossing))
            rows.append(
                (
                    name,
                    Quantity(value=crossing.speed, kind="speed", digits=4),
                    crossing.direction,
                    f"{100.0 * crossing.damping_ratio:.2f} %",
                    f"{amplification_factor(crossing.damping_ratio):.1f}",
                    "–" if one is None else f"{100.0 * one.margin:.1f} %",
                    "–" if one is None else f"{100.0 * one.required:.1f} %",
                    "–" if one is None else one.verdict,
                )
            )
    return Table(
        columns=(
            *("rotor held by", "critical speed", "direction", "damping ratio"),
            *("amplification", "margin", "required", "API 617"),
        ),
        rows=tuple(rows),
        caption="Critical speeds with damping and separation margins",
        note="Unbalance excites forward modes, and backward ones only on unequal supports. Amplification "
        "1/(2ζ); margin from the nominal speed as a share of it; required by API 617, part 1.",
    )


def _map_section(found: CriticalSpeedMap) -> Section:
    figure = Figure(
        chart=critical_speed_figure(found),
        caption=f"Undamped {_WHIRL_WORDS[found.whirl]} against the equivalent stiffness of bearing and "
        "support in series, equal at all bearings (Neisi 2020, Fig. 19). Vertical: the machine's own "
        "stiffness, full by the tangent of the ball forces with preload, dashed by the simple formula.",
        name=f"map {found.whirl}",
    )
    text = (
        "Right: the support's mass sits between bearing and support spring; it adds modes of its own and "
        "ends where the bearing alone would be softer than the equivalent stiffness."
    )
    return Section(
        heading=f"Critical speed map: {_WHIRL_WORDS[found.whirl]}",
        text=(text,),
        figures=(figure,),
        tables=(line_table(found),),
    )


def _campbell_section(machine: Machine, diagram: CampbellDiagram) -> Section:
    nodes = machine.rotor.node_positions
    bearings = [(b.name, nodes[b.node - 1]) for b in machine.touchdown_bearings]
    figures = (
        Figure(
            chart=campbell_figure(diagram, HIGHEST, float(machine.speed.nominal)),
            caption="Damped frequencies and damping ratios against the rotor speed; circles: critical "
            "speeds; dashed upright: nominal speed.",
            name=f"campbell {diagram.suspension}",
        ),
        Figure(
            chart=mode_shape_figure(diagram, bearings, SHAPES),
            caption="Shapes of the lowest modes at the lowest speed, in the plane of the largest deflection.",
            name=f"shapes {diagram.suspension}",
        ),
    )
    return Section(heading=f"{_held(diagram.suspension)}: Campbell diagram and shapes", figures=figures)


def _stability_section(machine: Machine, stability: Sequence[StabilityMap]) -> tuple[Section, ...]:
    node, speed = stability[0].node, _speed_text(float(machine.speed.nominal))
    text = (
        f"A cross-coupled stiffness at node {node}, in the middle of the bearings, stands for what seals and "
        f"impellers do to the rotor at {speed}: so API 617, part 1, screens it. What yours do is not known "
        "here; it asks for a decrement of at least 0.1 with them."
    )
    rows = tuple(
        (
            one.suspension,
            f"{one.decrement[0]:.3g}",
            Quantity(value=one.limit, kind="stiffness", digits=4)
            if math.isfinite(one.limit)
            else "none found",
        )
        for one in stability
    )
    figure = Figure(
        chart=stability_figure(stability),
        caption="Least logarithmic decrement against cross-coupled stiffness; below zero the rotor whirls "
        "by itself.",
        name="stability",
    )
    table = Table(
        caption="Stability at the nominal speed",
        columns=("held by", "decrement without coupling", "coupling at the limit"),
        rows=rows,
    )
    return (Section(heading="Stability map", text=(text,), figures=(figure,), tables=(table,)),)


def _map_json(found: CriticalSpeedMap) -> dict[str, Any]:
    return {
        "whirl": found.whirl,
        "stiffness_N_m": found.stiffness.tolist(),
        "massless_Hz": _table(found.massless),
        "with_support_mass_Hz": _table(found.with_support_mass),
        "bearings": {
            part.bearing: {
                "load_N": part.load,
                "tangent_N_m": part.tangent,
                "simple_N_m": part.simple,
                "support_N_m": part.support,
                "contact_N_m": part.contact,
                "equivalent_tangent_N_m": part.equivalent("tangent"),
                "equivalent_simple_N_m": part.equivalent("simple"),
            }
            for part in found.lines
        },
        "at_the_machine_Hz": {name: _table(values) for name, values in found.at_lines.items()},
    }


def _campbell_json(diagram: CampbellDiagram) -> dict[str, Any]:
    shapes = diagram.shapes[0]
    return {
        "speed_Hz": (diagram.speed / TURN).tolist(),
        "frequency_Hz": _table(diagram.frequency),
        "damping_ratio": _table(diagram.damping_ratio),
        "whirl": _table(diagram.whirl),
        "node_positions_m": [float(z) for z in diagram.node_positions],
        "shapes_at_lowest_speed": {"real": _table(shapes.real), "imaginary": _table(shapes.imag)},
        "critical_speeds": [
            {
                "speed_Hz": crossing.speed / TURN,
                "line": crossing.line,
                "direction": crossing.direction,
                "damping_ratio": crossing.damping_ratio,
                "amplification_factor": _finite(amplification_factor(crossing.damping_ratio)),
            }
            for crossing in diagram.crossings
        ],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _table(values: Any) -> Any:
    """Nested lists with None for NaN."""
    table = np.asarray(values).astype(object)
    table[~np.isfinite(values)] = None
    return table.tolist()
