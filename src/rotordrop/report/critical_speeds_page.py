"""The report on critical speeds: map (Neisi 2020, Fig. 19), Campbell diagrams, numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go

from rotordrop.elements.magnet import DAMPING_RATIO, RIGID_FREQUENCY
from rotordrop.report.content import (
    Card,
    Column,
    Figure,
    ReportContent,
    Section,
    Statement,
    Table,
    appendix,
    card_table,
    fact,
    table,
)
from rotordrop.report.machine_content import drawing_section, machine_content, not_given, rotor_tables
from rotordrop.report.origin import machine_facts
from rotordrop.report.quantity import NO_BREAK
from rotordrop.report.style import (
    INK,
    LIMIT,
    LOG_LABELS,
    MUTED,
    SERIES,
    TURN,
    curve,
    finished,
    panels,
    upright,
)
from rotordrop.rotor.campbell import (
    MORE_ABOVE,
    MOST_MARGIN,
    CampbellDiagram,
    Crossing,
    Separation,
    amplification_factor,
    campbell_diagram,
    separations,
    speed_grid,
)
from rotordrop.rotor.critical_speeds import CriticalSpeedMap, critical_speed_map
from rotordrop.units import percent

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.rotor.machine_summary import MachineSummary, MachineWarning

HIGHEST = 1000.0
"""Highest frequency of a Campbell diagram [Hz]; chosen, not measured."""
ON_CARD = 6
"""Critical speeds on a screen; all stand in the table."""
_WHIRL_WORDS = {
    "standstill": "natural frequencies at standstill",
    "forward": "forward critical speeds",
    "backward": "backward critical speeds",
}
DIRECTIONS = {"forward": SERIES[0], "backward": SERIES[1], "mixed": SERIES[2]}
_DASHES = {"tangent": "solid", "simple": "dash"}
_WORST_FIRST = ("bad", "good", "warning", "notice")
NOT_SEARCHED = (
    "In its AMBs: whether a critical speed is nearer to the nominal speed than API 617 asks for is open, as "
    "the search ends below 1.26 × nominal (--top-speed)."
)
CLEAR = "In its AMBs: no critical speed is nearer to the nominal speed than API 617 asks for."
ASSUMED = (
    "The machine file gives no stiffness and damping of {}: those in the AMBs hold for an assumed rigid-body "
    f"frequency of {RIGID_FREQUENCY:g} Hz with {percent(DAMPING_RATIO)} of critical damping. Give both for "
    "margins of API 617."
)
WITH_MASS = (
    "Right: the support's mass sits between bearing and support spring; it adds modes of its own and ends "
    "where the bearing alone would be softer than the equivalent stiffness."
)
CROSSINGS_NOTE = (
    "Unbalance excites forward modes, and backward ones only on unequal supports. Amplification 1/(2ζ)."
)
MARGINS_NOTE = "Margin from the nominal speed as a share of it; required by API 617, part 1."
Margins = Mapping[Crossing, Separation]
"""Critical speeds that are set against the nominal speed: those in AMBs whose stiffness was given."""


def critical_speeds_page(
    machine: Machine, maps: Mapping[str, CriticalSpeedMap], diagrams: Mapping[str, CampbellDiagram]
) -> ReportContent:
    """Build the report on critical speeds.

    Maps by whirl ("standstill" as in the paper, "forward", "backward"), and Campbell diagrams by what holds
    the rotor.
    """
    first, *others = sorted(maps.values(), key=lambda found: found.whirl != "forward")
    margins = _margins(machine, diagrams)
    given = not_given(machine)
    rest = [Section("Values that were not given", tables=given)] if given else []
    return ReportContent(
        title=f"Critical speeds of {machine.name}",
        verdict=_verdict(machine, maps["standstill"], diagrams, margins),
        screen=_screen(machine, diagrams),
        facts=machine_facts(machine),
        sections=(
            Section("Damped critical speeds", tables=(crossing_table(machine, diagrams, margins),)),
            _map_section(first),
            *(_campbell_section(machine, diagram) for diagram in diagrams.values()),
            *appendix([*map(_map_section, others), *rest]),
        ),
        lead=2,
    )


def machine_page(
    machine: Machine, summary: MachineSummary, warnings: tuple[MachineWarning, ...]
) -> ReportContent:
    """Build the page of a machine: mass, critical speeds, drawing, and what is known of its bearings."""
    grid = speed_grid(machine)
    held = ["touchdown bearings", *(["AMBs"] if machine.ambs else [])]
    diagrams = {name: campbell_diagram(machine, grid, name) for name in held}
    speeds = critical_speeds_page(machine, {"standstill": critical_speed_map(machine)}, diagrams)
    told = machine_content(machine, summary, warnings)

    rotor = (
        fact("mass", summary.fe.total_mass, "mass"),
        fact("centre of gravity from node 1", summary.fe.centre_of_gravity, "dimension"),
    )
    return replace(
        told,
        verdict=(told.verdict[0], *speeds.verdict),
        cards=(Card("Rotor", rotor),),
        summary=(),
        sections=(
            replace(drawing_section(machine), tables=rotor_tables(summary)),
            *speeds.sections[:-1],
            Section(
                "Bearings and AMBs at rest",
                statements=told.verdict[2:],
                tables=(card_table(told.cards, lambda figure: figure.value),),
            ),
            *speeds.sections[-1:],
        ),
        lead=2,
    )


def _margins(machine: Machine, diagrams: Mapping[str, CampbellDiagram]) -> Margins:
    """Margins in AMBs that were given: no standard asks for any of a free or a dropped rotor."""
    if "AMBs" not in diagrams or _assumed(machine):
        return {}
    nominal = float(machine.speed.nominal)
    return separations(diagrams["AMBs"], nominal, nominal)


def _assumed(machine: Machine) -> list[str]:
    """Names of the AMBs whose stiffness or damping was not given."""
    return [amb.name for amb in machine.ambs if not amb.loop_is_given]


def _verdict(
    machine: Machine,
    found: CriticalSpeedMap,
    diagrams: Mapping[str, CampbellDiagram],
    margins: Margins,
) -> tuple[Statement, ...]:
    massless, massive = (
        ", ".join(f"{frequency:.1f}" for frequency in found.at_lines[name][:4] if np.isfinite(frequency))
        for name in ("tangent", "with support mass")
    )
    text = (
        f"Natural frequencies at standstill, undamped, settled in the touchdown bearings: {massive} Hz; on "
        f"massless supports, as in the paper, {massless} Hz. Critical speeds are where damped modes of the "
        "turning rotor meet its speed."
    )
    said = [Statement(text), *_followed(found)]
    top = float(machine.speed.nominal)
    near = [_too_near(crossing, one, top) for crossing, one in margins.items() if not one.met]
    if "AMBs" in diagrams and (assumed := _assumed(machine)):
        said.append(Statement(ASSUMED.format(f"the AMBs {', '.join(assumed)}"), "warning"))
    elif "AMBs" in diagrams and not near:
        searched = float(diagrams["AMBs"].speed[-1]) >= (1.0 + MOST_MARGIN + MORE_ABOVE) * top
        said.append(Statement(CLEAR, "good") if searched else Statement(NOT_SEARCHED, "warning"))
    return tuple(sorted([*said, *near], key=lambda one: _WORST_FIRST.index(one.level)))


def _followed(found: CriticalSpeedMap) -> Iterator[Statement]:
    """How mounts that relax are taken; the JSON has their stiffness at every line."""
    if relaxing := [part.bearing for part in found.lines if part.branches]:
        yield Statement(
            f"{', '.join(relaxing)}: the mount relaxes; every line and damped mode of the machine is taken "
            "at the stiffness of its own frequency."
        )


def _too_near(crossing: Crossing, one: Separation, nominal: float) -> Statement:
    """A critical speed that is nearer to the nominal speed than API 617 asks for."""
    return Statement(
        f"AMBs: {crossing.direction} critical speed {_speed_text(crossing.speed)}, {100.0 * one.margin:.1f} "
        f"% from the nominal {_speed_text(nominal)} (API 617: {100.0 * one.required:.1f} %), amplification "
        f"{one.factor:.1f}.",
        "bad",
    )


def _speed_text(speed: float) -> str:
    return f"{speed / TURN:.1f} Hz ({60.0 * speed / TURN:.0f} rpm)"


def _held(machine: Machine, name: str) -> str:
    """What holds the rotor, and whether its stiffness is our own."""
    assumed = f", assumed {RIGID_FREQUENCY:g} Hz" if name == "AMBs" and _assumed(machine) else ""
    return "Free-free" if name == "free-free" else f"In its {name}{assumed}"


def _screen(machine: Machine, diagrams: Mapping[str, CampbellDiagram]) -> Table:
    """The lowest critical speeds with direction and damping, one line a number."""

    def of(name: str, diagram: CampbellDiagram) -> Column:
        ordered = sorted(diagram.crossings, key=lambda one: one.speed)[:ON_CARD]
        told = [
            f"{one.speed / TURN:.1f} Hz {one.direction}, {100.0 * one.damping_ratio:.2g} %".replace(
                " ", NO_BREAK
            )
            for one in ordered
        ]
        return Column(_held(machine, name), lambda k: told[k] if k < len(told) else "–")

    rows = range(min(ON_CARD, max(len(one.crossings) for one in diagrams.values())))
    number = Column("", lambda k: str(k + 1))
    columns = (number, *(of(name, one) for name, one in diagrams.items()))
    return table(rows, columns, "Critical speeds, lowest first: direction of whirl, damping ratio")


def crossing_table(machine: Machine, diagrams: Mapping[str, CampbellDiagram], margins: Margins) -> Table:
    """Critical speeds, the lowest first, with damping, amplification and margins where there are some."""
    rows = [
        (name, crossing, margins.get(crossing) if name == "AMBs" else None)
        for name, diagram in diagrams.items()
        for crossing in diagram.crossings
    ]
    rows.sort(key=lambda row: row[1].speed)
    columns = (
        Column("rotor", lambda row: _held(machine, row[0])),
        Column("critical speed", lambda row: row[1].speed, "speed"),
        Column("direction", lambda row: row[1].direction),
        Column("damping ratio", lambda row: f"{100.0 * row[1].damping_ratio:.2f} %"),
        Column("amplification", lambda row: f"{amplification_factor(row[1].damping_ratio):.1f}"),
    )
    if not margins:
        return table(rows, columns, "Critical speeds with damping", CROSSINGS_NOTE)
    judged = (
        Column("margin", lambda row: f"{100.0 * row[2].margin:.1f} %" if row[2] else "–"),
        Column("API 617", lambda row: f"{row[2].asked}, {row[2].verdict}" if row[2] else "–"),
    )
    caption = "Critical speeds with damping and separation margins"
    return table(rows, (*columns, *judged), caption, f"{CROSSINGS_NOTE} {MARGINS_NOTE}")


def _map_section(found: CriticalSpeedMap) -> Section:
    words = _WHIRL_WORDS[found.whirl]
    caption = (
        f"Undamped {words} against the equivalent stiffness of bearing and support in series, equal at all "
        "bearings (Neisi 2020, Fig. 19). Vertical: the machine's own stiffness, full by the tangent of the "
        "ball forces with preload, dashed by the simple formula."
    )
    figure = Figure(critical_speed_figure(found), caption)
    return Section(f"Critical speed map: {words}", (WITH_MASS,), figures=(figure,))


def _campbell_section(machine: Machine, diagram: CampbellDiagram) -> Section:
    lines = Figure(
        campbell_figure(diagram, HIGHEST, float(machine.speed.nominal)),
        "Damped frequencies and damping ratios against the rotor speed; circles: critical speeds; dashed "
        "upright: nominal speed.",
    )
    return Section(f"{_held(machine, diagram.suspension)}: Campbell diagram", figures=(lines,))


def critical_speed_figure(found: CriticalSpeedMap) -> go.Figure:
    """Draw natural frequencies against the equivalent stiffness of the supports (Neisi 2020, Fig. 19).

    Left without mass of the supports as in the paper, right with it; vertical lines at the machine's own
    equivalent stiffness by the tangent and by the simple formula.
    """
    titles = ("supports without mass, as in the paper", "with the mass of the supports")
    figure = panels(titles, height=430, spacing=0.06)
    for column, frequencies in enumerate((found.massless, found.with_support_mass), start=1):
        for k in range(frequencies.shape[1]):
            curve(
                figure,
                found.stiffness,
                frequencies[:, k],
                f"line {k + 1}",
                column=column,
                colour=SERIES[k % len(SERIES)],
                width=1.6,
                legend=False,
                hover="%{x:.3~g} N/m: %{y:.1f} Hz",
            )
        for index, part in enumerate(found.lines):
            for formula, dash in _DASHES.items():
                stiffness = part.equivalent(formula)
                curve(
                    figure,
                    [stiffness, stiffness],
                    [10.0, 1000.0],
                    f"{part.bearing}, {formula}",
                    column=column,
                    colour=(INK, LIMIT)[index % 2],
                    width=1.3,
                    dash=dash,
                    legend=column == 1,
                    hover=f"{stiffness:.3g} N/m",
                )
    figure.update_xaxes(type="log", exponentformat="power", dtick=1)
    figure.update_yaxes(type="log", range=[1.0, math.log10(1000.0)], **LOG_LABELS)
    what = "natural frequency" if found.whirl == "standstill" else "critical speed"
    return finished(figure, "equivalent stiffness [N/m]", f"{what} [Hz]")


def campbell_figure(diagram: CampbellDiagram, highest: float, nominal: float | None = None) -> go.Figure:
    """Draw damped frequencies up to a highest one [Hz] and damping ratios against the rotor speed.

    Lines keep their shape from speed to speed; their colour is the direction. The nominal speed [rad/s] is
    an upright line.
    """
    figure = panels(("damped frequencies", "damping ratios"), height=360, spacing=0.1)
    shown: set[str] = set()
    for k in range(diagram.frequency.shape[1]):
        if not np.any(np.isfinite(diagram.whirl[:, k])):
            continue
        direction, frequency = diagram.direction(k), diagram.frequency[:, k]
        for column, values in ((1, frequency), (2, 100.0 * diagram.damping_ratio[:, k])):
            curve(
                figure,
                diagram.speed / TURN,
                np.where(frequency > highest, np.nan, values),
                direction,
                column=column,
                colour=DIRECTIONS[direction],
                legend=column == 1 and direction not in shown,
                hover="%{x:.1f} Hz: %{y:.4~g}",
            )
        shown.add(direction)
    top = min(highest, float(diagram.speed[-1]) / TURN)
    curve(figure, [0.0, top], [0.0, top], "1X", colour=MUTED, width=1.0, dash="dash", hover=None)
    at = [crossing.speed / TURN for crossing in diagram.crossings if crossing.speed / TURN <= highest]
    if at:
        marker = {"color": INK, "size": 7, "symbol": "circle-open", "line": {"width": 1.8}}
        curve(figure, at, at, "critical speed", mode="markers", marker=marker, hover="%{x:.1f} Hz")
    if nominal is not None:
        for column in (1, 2):
            upright(figure, nominal / TURN, row=1, col=column)
    figure.update_yaxes(range=[0.0, highest], col=1)
    figure.update_yaxes(title_text="damping ratio [%]", rangemode="tozero", col=2)
    return finished(figure, "rotor speed [Hz]", "frequency [Hz]")
