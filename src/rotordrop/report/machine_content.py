"""What is said of a machine, of an imported rotor and of a bearing found by designation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import plotly.graph_objects as go

from rotordrop.elements.catalog.lookup import CatalogueBearing
from rotordrop.machine.ross_files import ImportedRotor
from rotordrop.report.content import (
    Card,
    Column,
    Figure,
    ReportContent,
    Section,
    Statement,
    Table,
    fact,
    folded,
    table,
)
from rotordrop.report.origin import machine_facts
from rotordrop.report.quantity import Quantity, shown
from rotordrop.report.style import COLOURS, MILLI, MUTED, SERIES, axis_title, curve, panels, plain
from rotordrop.rotor.assembly import rotor_fe
from rotordrop.rotor.imported import SHOWN, free_frequencies, supported_frequencies
from rotordrop.rotor.machine_summary import CRITICAL

if TYPE_CHECKING:
    from rotordrop.elements.touchdown_bearing import TouchdownBearing
    from rotordrop.machine import Machine
    from rotordrop.rotor.assembly import RotorFE
    from rotordrop.rotor.machine_summary import BearingSummary, MachineSummary, MachineWarning
    from rotordrop.rotor.magnet_loop import LoopStability, MagnetSummary

ALL_RIGHT = "Machine file OK; the drop model leaves out nothing known of it."
ON_SPRINGS = "force_on_springs"
"""Of another machine: what the peak force would be if springs pressed on the rings."""
FREE, RESTING = "free-free", "in touchdown bearings, massless supports"


def machine_content(
    machine: Machine, summary: MachineSummary, warnings: tuple[MachineWarning, ...]
) -> ReportContent:
    """What a machine amounts to, and what to know before trusting its description."""
    free, resting = (", ".join(f"{one:.4g}" for one in of[:3]) for of in (summary.free_free, summary.settled))
    mass = shown(summary.fe.total_mass, "mass")
    return ReportContent(
        title=f"Machine: {machine.name}",
        subtitle="; ".join(machine.notes),
        facts=machine_facts(machine),
        verdict=(
            _verdict(warnings),
            *(Statement(f"{one.message}.", "warning") for one in warnings if one.kind == CRITICAL),
            Statement(f"Mass {mass}; free-free {free} Hz; on massless supports {resting} Hz."),
            *(one for rest in summary.bearings for one in _has(machine.bearing(rest.name), rest)),
            *map(Statement, _remarks(one for one in warnings if not (one.doubtful or one.kind == CRITICAL))),
        ),
        cards=(
            *(_card(machine, rest) for rest in summary.bearings),
            *(_magnet_card(one, summary.loop) for one in summary.magnets),
        ),
        rest="--all",
        summary=(*rotor_tables(summary), *not_given(machine)),
    )


def _verdict(warnings: tuple[MachineWarning, ...]) -> Statement:
    """One line: may this description be worked with?"""
    if doubts := _remarks(one for one in warnings if one.doubtful):
        count = "one value looks" if len(doubts) == 1 else f"{len(doubts)} values look"
        return Statement(f"{count} wrong: {'; '.join(doubts)}.", "warning")
    return Statement("Machine file OK." if warnings else ALL_RIGHT, "good")


def _has(bearing: TouchdownBearing, rest: BearingSummary) -> Iterator[Statement]:
    """What a bearing has beyond balls and a plain support, and what of it counts with the support."""
    springs = ["preload springs"] * (bearing.bearing.ring_travel is not None)
    mount = [f"a mount ({', '.join(bearing.mount.stiffnesses)})"] * bearing.mount.present
    parts = [*springs, *mount, *(["a face"] * (bearing.face is not None))]
    if parts:
        held = f"; its support counts with {' and '.join(rest.beside_support)}" if rest.beside_support else ""
        yield Statement(f"{bearing.name} has {', '.join(parts)}{held}.")


def _remarks(warnings: Iterable[MachineWarning]) -> list[str]:
    """What looks wrong, or where the drop model ends; the same of several in one."""
    said: dict[str, list[str]] = {}
    for one in warnings:
        said.setdefault(one.message.removeprefix(f"{one.bearing}: "), []).append(one.bearing)
    return [f"{', '.join(of)}: {text}" for text, of in said.items()]


def _card(machine: Machine, rest: BearingSummary) -> Card:
    figures = [
        fact(one.label, one.value if one.described is None else one.described, one.kind, note=one.note)
        for one in rest.figures
        if one.field != ON_SPRINGS
    ]
    load = fact("share of the weight", rest.load, "force")
    gap = fact("air gap", machine.bearing(rest.name).air_gap, "length")
    tangent = fact("tangent stiffness at rest", rest.tangent_stiffness, "stiffness")
    return Card(rest.name, (load, gap, *figures, tangent))


def rotor_tables(summary: MachineSummary) -> tuple[Table, ...]:
    """Centre of gravity, inertias and sag of a rotor, and its lowest modes by what holds it."""
    rotor = rotor_values(summary.fe, 4)[1:]
    if (sag := summary.levitated_sag) is not None:
        span = float(max(sag) - min(sag))
        rotor.append(("levitated sag, lowest to highest node", Quantity.of(span, "length")))
    modes = ((FREE, summary.free_free), (RESTING, summary.settled))
    return named_values("rotor", rotor), mode_table(modes, "bending or support")


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


DRAWN = "The rotor to scale. Bearings, AMBs and sensors stand at their nodes."


def machine_sections(machine: Machine) -> tuple[Section, ...]:
    """The machine of a simulation in one folded part: drawing, what was not given."""
    return (folded("Machine", drawing_section(machine), Section("", tables=not_given(machine))),)


def drawing_section(machine: Machine) -> Section:
    """The rotor to scale with everything that sits on it."""
    return Section("Rotor", figures=(Figure(rotor_figure(machine), DRAWN),))


def not_given(machine: Machine, *, reasons: bool = True) -> tuple[Table, ...]:
    """What was defaulted or inferred, and why; equal values of several owners in one line."""
    owners: dict[tuple[str, str, str], list[str]] = {}
    for key, used, why in (*machine.defaults_in_use, *machine.inferred):
        owner, _, rest = spoken_key(key).partition(", ")
        owners.setdefault((rest, used, why), []).append(owner)
    columns = (
        Column("not in the machine file", lambda row: row[0][0]),
        Column("of", lambda row: ", ".join(row[1])),
        Column("used", lambda row: row[0][1]),
        Column("why", lambda row: row[0][2] if reasons else "", optional=True),
    )
    return (table(owners.items(), columns),) if owners else ()


def spoken_key(key: str) -> str:
    """A key of the machine file in words; entries of a list count from one."""
    words: list[str] = []
    for part in key.replace("_", " ").split("."):
        if part == "*" and words:
            words[-1] = f"every one of {words[-1]}"
        elif part.isdigit() and words:
            words[-1] = f"{words[-1]} {int(part) + 1}"
        else:
            words.append(part)
    return ", ".join(words)


def weight_shares(machine: Machine | None) -> dict[str, float]:
    """Share of the weight [N] by name of the bearing; empty without a machine."""
    if machine is None:
        return {}
    from rotordrop.rotor.statics import bearing_load_shares

    shares = bearing_load_shares(machine)
    return {
        bearing.name: float(share) for bearing, share in zip(machine.touchdown_bearings, shares, strict=True)
    }


SHAFT_COLOUR = "#9fb3c8"
LAYER_COLOUR = "#dbe4ec"
DRAWN_AT_LEAST = 0.02
"""Radius [m] at which bearings are drawn when the shaft is thinner."""
MARKS = {
    "touchdown bearing": ("triangle-up", COLOURS["measured"]),
    "AMB": ("square", COLOURS["simulated"]),
    "sensor": ("triangle-down", COLOURS["cross-check"]),
}


def rotor_figure(machine: Machine) -> go.Figure:
    """Draw the rotor to scale in mm from the side, NDE at the left, with everything that sits on it."""
    figure = panels([""], height=240)
    nodes = machine.rotor.node_positions
    radii = [0.5 * max(e.outer_diameter, e.layer_diameter or 0.0) for e in machine.rotor.elements]
    top = 1.5 * max(*radii, DRAWN_AT_LEAST)
    layers, shaft = ("outer_diameter", "layer_diameter"), ("inner_diameter", "outer_diameter")
    _add_pieces(figure, _pieces(machine, *layers), "layer without stiffness", LAYER_COLOUR)
    _add_pieces(figure, _pieces(machine, *shaft), "shaft", SHAFT_COLOUR)
    for index, disc in enumerate(machine.rotor.discs):
        z, reach = MILLI * nodes[disc.node - 1], 0.85 * MILLI * top
        label = plain(disc.name or f"disc {index + 1}")
        curve(
            figure,
            [z, z],
            [-reach, reach],
            "disc or point mass",
            colour=SERIES[3],
            width=5,
            legend=index == 0,
            hover=f"{label}: {float(disc.mass):.3g} kg at node {disc.node}",
        )
    mounted = (
        ("touchdown bearing", machine.touchdown_bearings, -top),
        ("AMB", machine.ambs, -1.25 * top),
        ("sensor", machine.sensors, top),
    )
    for kind, parts, height in mounted:
        if parts:
            symbol, colour = MARKS[kind]
            curve(
                figure,
                [MILLI * nodes[part.node - 1] for part in parts],
                [MILLI * height] * len(parts),
                kind,
                mode="markers",
                marker={"symbol": symbol, "size": 13, "color": colour},
                customdata=[[plain(part.name), part.node] for part in parts],
                hover="%{customdata[0]}, node %{customdata[1]}, %{x:.1f} mm",
            )
    figure.update_xaxes(title_text=axis_title("position from node 1", "mm"))
    figure.update_yaxes(title_text=axis_title("radius", "mm"), scaleanchor="x", constrain="domain")
    return figure


def _pieces(machine: Machine, inner: str, outer: str) -> Iterator[tuple[float, float, float, float]]:
    """Left and right end, inner and outer radius [m] of the elements that have such an outer diameter."""
    spans = pairwise(machine.rotor.node_positions)
    for (left, right), element in zip(spans, machine.rotor.elements, strict=True):
        if getattr(element, outer) is not None:
            yield left, right, 0.5 * getattr(element, inner), 0.5 * getattr(element, outer)


def _add_pieces(figure: go.Figure, pieces: Iterable[Any], name: str, colour: str) -> None:
    """Draw rectangles above and below the axis, all in one trace."""
    x: list[float | None] = []
    y: list[float | None] = []
    for left, right, inner, outer in pieces:
        for side in (MILLI, -MILLI):
            x += [MILLI * left, MILLI * right, MILLI * right, MILLI * left, MILLI * left, None]
            y += [side * inner, side * inner, side * outer, side * outer, side * inner, None]
    if x:
        edge = {"color": MUTED, "width": 0.7}
        curve(figure, x, y, name, hover=None, line=edge, fill="toself", fillcolor=colour)


def imported_content(imported: ImportedRotor, name: str) -> ReportContent:
    """Show mass, inertias and frequencies of a rotor from another program."""
    rows = [("nodes", len(imported.rotor.node_positions)), *rotor_values(rotor_fe(imported.rotor), 5)]
    modes = [("free-free bending, at standstill", free_frequencies(imported))]
    for k, axis in enumerate("xy"):
        if imported.springs:
            held = f"on the bearings of the source, {axis}, undamped"
            modes.append((held, supported_frequencies(imported, k)))
    return ReportContent(
        title=f"Rotor from {name}",
        subtitle=imported.source,
        verdict=tuple(Statement(note) for note in imported.notes)
        or (Statement("All of the rotor in the file was taken over.", "good"),),
        summary=(named_values("rotor", rows), mode_table(modes, "rotor held", SHOWN)),
    )


def bearing_content(written: str, found: Sequence[CatalogueBearing]) -> ReportContent:
    """The bearing that a designation means most likely, and the listed ones of its size."""
    others = found if found[0].listed else found[1:]
    columns = (
        Column("listed bearings of this size", lambda one: f"{one.maker} {one.designation}"),
        Column("angle", _angle),
        Column("balls", _balls),
        Column("preload light / medium / heavy", _forces),
        Column("balls are", lambda one: "published" if one.maker == "GMN" else "reconstructed"),
    )
    return ReportContent(
        title=f"Bearings: {written}",
        verdict=tuple(_statements(written, found[0])),
        summary=(_meant(found[0]), *((table(others, columns),) if others else ())),
        rest="--all",
    )


def _statements(written: str, first: CatalogueBearing) -> list[Statement]:
    balls = first.complement
    if first.listed:
        text = f"{written} is listed: {first.maker} {first.designation}. Balls: {balls.basis}"
        said = [Statement(text, "good")]
    else:
        said = [Statement(f"no list in the catalogue has {written}: size by ISO 15, balls {balls.basis}")]
    if first.read is not None and first.read.unread:
        unread = ", ".join(first.read.unread)
        said.append(Statement(f"not read: {unread}; what names cage, seals or accuracy has no effect here"))
    if first.contact_angle_range is not None:
        low, high = (math.degrees(angle) for angle in first.contact_angle_range)
        text = f"{written} does not say its contact angle: {low:.0f}° to {high:.0f}° are usual; give it"
        said.append(Statement(text, "warning"))
    if not first.preload and first.kind == "angular contact":
        text = "no bearing of this size is listed, so no preload is known; give it as a force"
        said.append(Statement(text, "warning"))
    elif first.preload_basis:
        said.append(Statement(f"the preload is {first.preload_basis}"))
    return said


def _meant(bearing: CatalogueBearing) -> Table:
    balls, play = bearing.complement, bearing.clearance_range
    width = "" if bearing.width is None else f" × {1e3 * bearing.width:g}"
    rows: list[tuple[str, object]] = [
        (
            f"{bearing.kind}, bore × outside × width",
            f"{1e3 * bearing.bore:g} × {1e3 * bearing.outside_diameter:g}{width} mm",
        ),
        ("balls per row", _with_range(balls.ball_count, balls.count_range)),
        ("ball diameter", _with_range(balls.ball_diameter, balls.diameter_range, " mm", 1e-3)),
        ("pitch diameter", f"{1e3 * balls.pitch_diameter:.4g} mm"),
        ("conformity", _with_range(balls.conformity, balls.conformity_range)),
        ("ball material", bearing.ball_material),
    ]
    if bearing.kind == "angular contact":
        rows.insert(1, ("contact angle", _angle(bearing)))
        rows.append(("preload light / medium / heavy", _forces(bearing)))
    if play is not None:
        rows.append(("radial clearance", f"{1e6 * play[0]:.0f} to {1e6 * play[1]:.0f} µm"))
    return named_values(bearing.designation, rows)


def _with_range(value: float, ends: tuple[float, float] | None, unit: str = "", size: float = 1.0) -> str:
    """A number in a unit of some size [SI], and between what it lies where it was inferred."""
    known = "" if ends is None else f" (inferred, 90 %: {ends[0] / size:.4g} to {ends[1] / size:.4g})"
    return f"{value / size:.4g}{unit}{known}"


def _angle(bearing: CatalogueBearing) -> str:
    ends = " to ".join(f"{math.degrees(angle):.0f}°" for angle in bearing.contact_angle_range or ())
    return f"{math.degrees(bearing.contact_angle):.0f}°" + (f" (not said; {ends})" if ends else "")


def _forces(bearing: CatalogueBearing) -> str:
    forces = [f"{force:.3g}" if force < 1000.0 else f"{force:.0f}" for force in bearing.preload.values()]
    return f"{' / '.join(forces)} N" if forces else "not known"


def _balls(bearing: CatalogueBearing) -> str:
    balls = bearing.complement
    material = "" if bearing.ball_material == "steel" else f", {bearing.ball_material}"
    return f"{balls.ball_count} × {1e3 * balls.ball_diameter:.4g} mm{material}"
