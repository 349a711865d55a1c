"""Sections and figures that every drop has, followed, replayed or simulated: all drawn from `BearingDrop`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop.arrays import Array
from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.estimate.bearing_drop import (
    AirGap,
    BearingDrop,
    BearingMotions,
    FirstContact,
    History,
    Impact,
    Origin,
    Peak,
)
from rotordrop.estimate.estimate import SensorMotion
from rotordrop.evidence.impacts import HOP, shortest_flight
from rotordrop.evidence.quality import NO_CHECK_SEES
from rotordrop.evidence.quality.finding import Finding, sentences
from rotordrop.report.content import (
    Card,
    Column,
    Figure,
    KeyFigure,
    Level,
    Section,
    Statement,
    Table,
    folded,
    table,
)
from rotordrop.report.quantity import Quantity, one_line, places_of, shown, with_interval
from rotordrop.report.style import (
    GRID,
    INK,
    LIMIT,
    MICRO,
    MILLI,
    MUTED,
    SERIES,
    TIME_TITLE,
    TURN,
    Panel,
    add_gap_limits,
    add_history,
    axis_title,
    colour_of_time,
    compared_style,
    curve,
    finished,
    panels,
    plain,
    single,
    square,
    time_panels,
    upright,
    words,
)
from rotordrop.series import peak_indices
from rotordrop.severity.numbers import LOADS, NOT_DETERMINED
from rotordrop.units import percent

AROUND_PEAK = (2e-3, 6e-3)
"""Stretch before and after a peak [s] that gets a figure of its own; chosen, not measured."""
ANOTHER_PEAK = 5e-3
"""Uncertainty of the time of a peak [s] from which another peak may be the largest; chosen, not measured."""
MEGA = 1e-6
CARRIED = (
    "What was measured is carried from the planes of the sensors to the bearings along the straight line "
    "through them; the bending in between is left out."
)
NO_DISTRIBUTION = (
    "No distribution of the stress is stated: its numbers have no ranges, and single numbers do not hold."
)
NO_IMPACT = "The rotor did not touch a bearing in this window."
LEVELS: dict[str, Level] = {"stop": "bad", "warning": "warning", "note": "notice"}
"""Levels by severity of a finding, the gravest first."""
TURNING = "Speed of the rotor and of the inner races, which friction spins up."
SOUND = "The plausibility checks found nothing wrong with the record."


def headline_card(bearing: BearingDrop, *, certain: bool = True) -> Card:
    """Headline numbers of one bearing, peaks first, each with its time, or the reason why it is missing.

    Single numbers are shown where they are certain, else ranges.
    """
    peaks = {"peak_force_N": bearing.peak_force, "peak_stress_Pa": bearing.peak_stress}
    known = {**bearing.values, **{field: peak.known for field, peak in peaks.items()}}
    figures = []
    for load in LOADS:
        field, label = load.field, f"{load.label[0].upper()}{load.label[1:]}"
        reason = bearing.missing.get(field, "")
        if field not in known and not reason:
            continue
        value = Quantity.of(None if reason else known.get(field), load.kind, range_only=not certain)
        when = moment_of(peaks[field]) if field in peaks and certain else ""
        at = f"at {when}" if when else ""
        note = "; ".join(filter(None, (at, reason)))
        figures.append(KeyFigure(label if certain else f"{label}, range", value, note))
    origin = bearing.peak_force.origin
    of_another = origin in (Origin.CROSS_CHECK, Origin.REPLAY) and "peak_force_N" not in bearing.missing
    source = f", by the {origin.value}" if of_another else ""
    return Card(f"{bearing.name} touchdown bearing{source}", tuple(figures))


def moment_of(peak: Peak) -> str:
    """When a peak was, in words; nothing where it was estimated and its error is not known."""
    if peak.origin is Origin.SIMULATION:
        return shown(peak.time, "time", 3)
    if peak.time_interval_90 is None:
        return ""
    low, high = peak.time_interval_90
    if high - low < ANOTHER_PEAK:
        return with_interval(peak.time, "time", peak.time_interval_90)
    return one_line(Quantity(value=peak.time, kind="time", interval_90=(low, high), places=2))


def static_limit_statement(bearings: Sequence[BearingDrop], *, certain: bool = True) -> Statement:
    """Set the peak stresses beside the stress of the static load rating: passed, open or kept."""
    level: Level = "notice"
    if any("peak_stress_Pa" in bearing.missing for bearing in bearings):
        return Statement(f"The share of the static limit is {NOT_DETERMINED}.")
    shares: dict[str, list[str]] = {}
    for bearing in bearings:
        peak = Quantity.of(bearing.peak_stress.known, "pressure", range_only=not certain)
        ends = " to ".join(dict.fromkeys(f"{100.0 * end / STATIC_STRESS:.0f}" for end in peak.ends))
        ends = ends.replace("0 to", "at most") if ends.startswith("0 to") else ends
        shares.setdefault(ends, []).append(bearing.name)
        if (peak.value if certain else peak.ends[0]) >= STATIC_STRESS:
            level = "bad"
        elif peak.ends[1] >= STATIC_STRESS and level != "bad":
            level = "warning"
    limit = f"static limit, {shown(STATIC_STRESS, 'pressure')} (ISO 76)"
    told = " and ".join(f"{share} % ({', '.join(names)})" for share, names in shares.items())
    return Statement(f"Peak stress is {told} of the {limit}.", level)


def drop_sections(
    bearings: Sequence[BearingDrop],
    origin: str,
    static_loads: Mapping[str, float] | None = None,
    *,
    contact_tables: tuple[Table, ...] = (),
    at_sensors: tuple[Figure, ...] = (),
    certain: bool = True,
) -> tuple[Section, ...]:
    """Force, orbit, impacts with the first contact, motion and stress of a drop, in this order.

    The origin says what is drawn, as "measured and estimated"; static loads are the share of the weight by
    bearing [N]. Where single numbers are not certain, ranges alone are stated.
    """
    contact = Figure(
        first_contact_figure(bearings),
        "Vertical displacement around the first contact: t₁ first touch, t₂ lift-off, T the time "
        "between; indentation counts from the air gap, support included (Neisi 2020, Fig. 10).",
    )
    radial = [radial_section(bearings)] if any(bearing.at_gap_limits for bearing in bearings) else []
    return (
        _force(bearings, static_loads or {}, certain=certain),
        orbit_section(bearings),
        folded(
            "Impacts",
            _impacts(bearings),
            Section("", figures=(contact,), tables=contact_tables),
            printed=True,
        ),
        folded("Displacement", motion_section(bearings, origin, at_sensors=at_sensors), *radial),
        _stress(bearings, certain=certain),
    )


def force_panel(bearing: BearingDrop, loads: Mapping[str, float], *, certain: bool = True) -> Panel:
    """The ball force on the race with its band and peak, beside the share of the weight [N]."""
    return Panel(
        title=bearing.name,
        axis="bearing force",
        histories=(bearing.force,),
        band=bearing.force_band,
        levels=(("share of the weight", loads[bearing.name]),) if bearing.name in loads else (),
        peak=bearing.peak_force,
        certain=certain,
    )


def stress_panel(bearing: BearingDrop, *, certain: bool = True) -> Panel:
    """The largest Hertz stress with its band and peak, and what the preload alone does."""
    return Panel(
        title=bearing.name,
        axis="Hertz stress",
        histories=(bearing.stress,),
        band=bearing.stress_band,
        levels=() if bearing.preload_stress is None else (("preload alone", bearing.preload_stress),),
        peak=bearing.peak_stress,
        certain=certain,
    )


def _force(bearings: Sequence[BearingDrop], loads: Mapping[str, float], *, certain: bool) -> Section:
    """The whole force beside its stretch around the peak, where the 90 % interval can be seen."""
    if any("peak_force_N" in bearing.missing for bearing in bearings):
        return Section("Bearing force", (f"Force is {NOT_DETERMINED}.",))
    panels = [force_panel(bearing, loads, certain=certain) for bearing in bearings]
    near = [replace(panel.around(*AROUND_PEAK), title=f"{panel.title}, around its peak") for panel in panels]
    rows = [[replace(whole, peak=None), close] for whole, close in zip(panels, near, strict=True)]
    chart = time_panels(rows, 1.0, "N", from_zero=True, from_power_off=False)
    for axis in list(chart.select_yaxes())[1:]:
        axis.matches = "y"
    caption = "Magnitude of the ball force on the race, instantaneous (Neisi 2020, Fig. 15), and its peak."
    return Section("Bearing force", figures=(Figure(chart, caption),))


def _stress(bearings: Sequence[BearingDrop], *, certain: bool) -> Section:
    if any("peak_stress_Pa" in bearing.missing for bearing in bearings):
        return Section("Hertz stress", (f"Stress and severity are {NOT_DETERMINED}.",))
    history = Figure(
        time_panels([[stress_panel(bearing, certain=certain)] for bearing in bearings], MEGA, "MPa"),
        "Largest Hertz stress of all balls at the inner race, instantaneous.",
    )
    if not certain:
        return Section("Hertz stress", (), (Statement(NO_DISTRIBUTION),), (history,))
    box = Figure(
        stress_box_figure(bearings),
        "Distribution of the stress within the drop; dashed in the box: mean (Neisi 2020, Fig. 16).",
    )
    # statistics of an estimated history have no interval of their own; mean and peak stand above with theirs
    tables = () if any(one.stress_band for one in bearings) else (stress_table(bearings),)
    return Section("Hertz stress", figures=(history, box), tables=tables)


def _impacts(bearings: Sequence[BearingDrop]) -> Section:
    reasons = tuple(
        Statement(f"{bearing.name}: no impacts are listed, because {bearing.missing['impacts']}.")
        for bearing in bearings
        if "impacts" in bearing.missing
    )
    hit = [bearing for bearing in bearings if bearing.impacts]
    if not hit:
        return Section("Impacts", statements=reasons or (Statement(NO_IMPACT),))
    return Section("Impacts", (), reasons, tables=(impact_table(hit),))


def motion_section(
    bearings: Sequence[BearingMotions],
    origin: str,
    *text: str,
    at_sensors: tuple[Figure, ...] = (),
) -> Section:
    """Displacement against time: horizontal beside vertical, all bearings zooming together."""
    caption = f"Displacement of the rotor, {origin}; the panels zoom together (Neisi 2020, Figs 7, 8 and 13)."
    carried = any(isinstance(b, BearingDrop) and b.motions[0].role == "measured" for b in bearings)
    figure = Figure(displacement_figure(bearings), caption)
    return Section("Displacement", (*text, *((CARRIED,) if carried else ())), figures=(*at_sensors, figure))


def sensor_figure(found: SensorMotion) -> Figure:
    """What every sensor read, and what the estimated motion gives it, with their r.m.s. difference."""
    panels = [
        Panel(
            title=f"{name}, r.m.s. of the difference {shown(rms, 'length', 2)}",
            axis="reading",
            histories=(
                History(label="measured", time=found.time, values=measured, role="measured"),
                History(label="estimated", time=found.time, values=estimated, role="estimated"),
            ),
        )
        for name, rms, measured, estimated in zip(
            found.channels, found.rms, found.measured.T, found.estimated.T, strict=True
        )
    ]
    rows = [panels[first : first + 2] for first in range(0, len(panels), 2)]
    caption = "Readings of the sensors, and those that the estimated motion gives; the panels zoom together."
    return Figure(time_panels(rows, MICRO, "µm", height=190, together=True), caption)


def radial_section(bearings: Sequence[BearingDrop]) -> Section:
    """Distance of the rotor from the centre against time, with both limits of the air gap."""
    rows = [
        [
            Panel(
                title=bearing.name,
                axis="radial displacement",
                histories=tuple(motion.radial for motion in bearing.at_gap_limits),
                air_gap=bearing.air_gap,
            )
        ]
        for bearing in bearings
    ]
    radial = Figure(
        time_panels(rows, MICRO, "µm", from_zero=True),
        "Radial displacement, simulated for both limits of the air gap (Neisi 2020, Fig. 14).",
    )
    return Section("Radial displacement", figures=(radial,))


def displacement_figure(bearings: Sequence[BearingMotions]) -> object:
    """Draw horizontal (x) and vertical (y, up) displacement at every bearing (Neisi 2020, Figs 7, 8, 13).

    Differs from the paper: vertical is y and horizontal is x here, z runs along the rotor.
    """
    axes = (("horizontal", "x", (-1.0, 1.0)), ("vertical", "y", (-1.0,)))
    rows = [
        [
            Panel(
                title=f"{bearing.name}: {way}, {axis}",
                axis=f"displacement {axis}",
                histories=tuple(getattr(motion, way) for motion in bearing.motions),
                air_gap=bearing.air_gap,
                gap_signs=signs,
            )
            for way, axis, signs in axes
        ]
        for bearing in bearings
    ]
    return time_panels(rows, MICRO, "µm", height=250, together=True)


def orbit_section(
    bearings: Sequence[BearingMotions], early: Sequence[BearingMotions] = (), until: str = ""
) -> Section:
    """Orbits in the clearance circle, of an early part alone where one is given."""
    # planes of sensors alone stand in the order of the record, not in that of the rotor
    seen = f", seen from {bearings[-1].name}" if isinstance(bearings[-1], BearingDrop) else ""
    hit = any(isinstance(one, BearingDrop) and one.impacts for one in bearings)
    numbers = " 1 to 3: the largest contacts of a bearing, 1 the hardest; their force stands under Impacts."
    orbit = Figure(
        orbit_figure(early or bearings),
        f"Path of the rotor centre against the clearance circle{until}; x to the right, y up{seen} "
        f"(Neisi 2020, Fig. 12).{numbers if hit else ''}",
    )
    return Section("Orbit", figures=(orbit,))


def speed_figure(rotor: Sequence[History], races: Sequence[History] = ()) -> object:
    """Draw the speed of the rotor, and of the inner races beside it [rad/s], in Hz."""
    row = [Panel(title="rotor", axis="speed", histories=tuple(rotor))]
    if races:
        axis = "race speed"
        row.append(Panel(title="inner races", axis=axis, histories=tuple(races), series=True))
    return time_panels([row], 1.0 / TURN, "Hz", height=250)


def turning_section(time: Array, rotor: Array, races: Mapping[str, Array]) -> Section:
    """Speed of a simulated rotor and of the inner races by name of the bearing [rad/s], each (T,)."""
    turning = [History(label=f"{name} race", time=time, values=values) for name, values in races.items()]
    chart = speed_figure([History(label="rotor", time=time, values=rotor)], turning)
    return Section("Speed", figures=(Figure(chart, TURNING),))


def record_quality_section(findings: Sequence[Finding], *unseen: str) -> Section:
    """Tell what the gate found, with channel, time and remedy, or that it found nothing; what it cannot."""
    limits = tuple(map(Statement, unseen))
    if not findings:
        return Section("Data quality", statements=(Statement(SOUND, "good"), *limits))
    columns = (
        Column("finding", "kind"),
        Column("channel", lambda found: found.channel or "all"),
        Column("time in the record", lambda f: "whole record" if f.time is None else shown(f.time, "time")),
        Column("what was seen", "message"),
        Column("remedy", "remedy"),
    )
    return Section("Data quality", statements=limits, tables=(table(findings, columns),))


def unseen_in(notes: Sequence[str]) -> tuple[str, ...]:
    """What the gate cannot see, among the notes of an estimate."""
    return tuple(note for note in notes if note.startswith(NO_CHECK_SEES))


def quality_statements(findings: Sequence[Finding]) -> tuple[Statement, ...]:
    """The findings as sentences, the serious ones first."""
    return tuple(Statement(text, LEVELS[severity]) for text, severity in sentences(findings))


LISTED = 12
AZIMUTH = "Azimuth counter-clockwise from +x, −90° is the bottom. "
NUMBERED = 3
"""Contacts of a bearing that an orbit numbers."""


def impact_rule(gaps: Sequence[float], *, seen: bool = False) -> str:
    """The rule of an impact in words, with the shortest flight for these air gaps [m].

    Where displacement alone is seen it asks for more.
    """
    times = dict.fromkeys(f"{1e3 * shortest_flight(gap):.2g}" for gap in sorted(gaps))
    after = f"at least {' to '.join([*times][:: max(len(times) - 1, 1)])} ms" if times else "a time"
    leaves, swing = "", ""
    if seen:
        leaves = f", in which the rotor leaves the race by {percent(0.5 * HOP, 1)} of the gap or more"
        swing = ", and a swing along the race is none"
    return (
        f"An impact is a return to the race after {after} of free flight, as long as a hop of "
        f"{percent(HOP)} of the air gap under gravity lasts{leaves}; the first touch of a fall is one too. "
        f"Shorter hops belong to the impact before{swing}."
    )


def largest(bearing: BearingDrop) -> list[Impact]:
    """The contacts that an orbit numbers, the largest force first."""
    return sorted(bearing.impacts, key=lambda one: -one.peak_force.value)[:NUMBERED]


def impact_table(bearings: Sequence[BearingDrop], *, listed: int = LISTED) -> Table:
    """List the strongest impacts in the order of time."""
    impacts = [
        (bearing.name, impact, after)
        for bearing in bearings
        for impact, after in zip(bearing.impacts, bearing.after_flight, strict=True)
    ]
    count = sum(after for *_, after in impacts)
    strongest = sorted(impacts, key=lambda item: -item[1].peak_force.value)[:listed]
    left_out = len(impacts) - len(strongest)
    gaps = [0.5 * (one.air_gap.lower + one.air_gap.upper) for one in bearings if one.air_gap is not None]
    rest = f" {left_out} weaker ones are left out." if left_out else ""

    def number(label: str, field: str, kind: str) -> Column:
        """A number of the impacts, with as many places in every line as the largest needs."""
        places = places_of((getattr(impact, field).value for _, impact, _ in strongest), kind)
        return Column(label, lambda row: replace(Quantity.of(getattr(row[1], field), kind), places=places))

    numbers = {id(one): str(k) for bearing in bearings for k, one in enumerate(largest(bearing), start=1)}
    # where an impact hit, and for how long, has no known error in an estimate
    exact = all(impact.peak_force.interval_90 is None for _, impact, _ in impacts)
    place = Column("azimuth", lambda row: row[1].azimuth, "angle", 3)
    lasted = Column("duration", lambda row: row[1].end - row[1].start, "time", 3)
    columns = (
        Column("bearing", lambda row: row[0]),
        Column("time of peak", lambda row: row[1].peak_time, "time"),
        *((place,) if exact else ()),
        number("peak bearing force", "peak_force", "force"),
        number("impulse", "impulse", "impulse"),
        number("dissipated energy", "dissipated_energy", "energy"),
        *((lasted,) if exact else ()),
        Column("impact", lambda row: "yes" if row[2] else ""),
        Column("", lambda row: "goes on: at least this" if row[1].end != row[1].end else "", optional=True),
        Column("in the orbit", lambda row: numbers.get(id(row[1]), "")),
    )
    return table(
        sorted(strongest, key=lambda item: item[1].peak_time),
        columns,
        f"Contacts ({len(strongest)} of {len(impacts)}), {count} of them impacts",
        f"{AZIMUTH if exact else ''}{impact_rule(gaps)}{rest}",
    )


CIRCLE = np.linspace(0.0, 2.0 * np.pi, 181)
ORBIT_BLOCKS = 450
ORBIT_POINTS = 4000
"""Samples at even steps that an orbit is drawn with: 40 a turn at 200 Hz in half a second."""


def orbit_figure(bearings: Sequence[BearingMotions]) -> go.Figure:
    """Draw the path of the rotor centre in each bearing inside its clearance circle (Neisi 2020, Fig. 12).

    One panel per bearing in µm at one scale, x to the right and y up; the circle is the upper air gap, with
    the lower one dashed where they differ. A single path is the darker the earlier; the largest contacts are
    numbered.
    """
    figure = panels([b.name for b in bearings], height=430, spacing=0.12)
    timed = all(len(bearing.motions) == 1 for bearing in bearings)
    if timed:
        times = [MILLI * bearing.motions[0].time for bearing in bearings]
        colour_of_time(figure, float(min(map(min, times))), float(max(map(max, times))))
    for column, bearing in enumerate(bearings, start=1):
        for motion in sorted(bearing.motions, key=lambda one: one.role == "measured"):
            x, y = motion.displacement[:, 0], motion.displacement[:, 1]
            # extremes alone would join points of different turns by chords that the rotor never went
            even = np.arange(0, len(x), -(-len(x) // ORBIT_POINTS))
            chosen = np.union1d(peak_indices(x, y, np.hypot(x, y), blocks=ORBIT_BLOCKS), even)
            when = single(MILLI * motion.time[chosen])
            look: dict[str, Any] = {"line": compared_style(motion.role)}
            if timed:
                look = {"mode": "lines+markers", "line": {"color": GRID, "width": 1.2}}
                look["marker"] = {"size": 3.5, "color": when, "coloraxis": "coloraxis"}
            curve(
                figure,
                MICRO * x[chosen],
                MICRO * y[chosen],
                motion.label,
                column=column,
                legend=column == 1 and not timed,
                customdata=when,
                hover="x %{x:.1f} µm, y %{y:.1f} µm at %{customdata:.2f} ms",
                **look,
            )
        if bearing.air_gap is not None:
            _add_circles(figure, bearing.air_gap, column)
        if isinstance(bearing, BearingDrop) and bearing.impacts:
            _add_numbers(figure, bearing, column)
        radii = [float(np.nanmax(np.abs(motion.displacement))) for motion in bearing.motions]
        reach = 1.08 * MICRO * max([*radii, bearing.air_gap.upper if bearing.air_gap else 0.0])
        square(figure, column, reach)
    return finished(figure, "displacement x [µm]", "displacement y [µm]")


def _add_circles(figure: go.Figure, gap: AirGap, column: int) -> None:
    """The upper limit of the air gap, and the lower one dashed where it differs."""
    differ = gap.lower < gap.upper
    for which, dash in (("upper", "solid"), ("lower", "dash"))[: 1 + differ]:
        radius, line = MICRO * getattr(gap, which), {"color": LIMIT, "width": 1.2, "dash": dash}
        name = f"clearance circle, {which} limit" if differ else "clearance circle"
        look: dict[str, Any] = {"legend": column == 1, "line": line, "hover": f"{radius:.1f} µm"}
        curve(figure, radius * np.cos(CIRCLE), radius * np.sin(CIRCLE), name, column=column, **look)


def _add_numbers(figure: go.Figure, bearing: BearingDrop, column: int) -> None:
    """Where the rotor is at the peaks of the largest contacts, numbered by force."""
    hits, motion = largest(bearing), bearing.motion
    times = [hit.peak_time for hit in hits]
    x, y = (MICRO * np.interp(times, motion.time, motion.displacement[:, k]) for k in (0, 1))
    known = [[hit.peak_force.value, MILLI * hit.peak_time] for hit in hits]
    look: dict[str, Any] = {
        "mode": "markers+text",
        "marker": {"size": 16, "color": "#ffffff", "line": {"color": INK, "width": 1}},
        "text": [str(k) for k in range(1, len(hits) + 1)],
        "textfont": {"size": 11, "color": INK},
        "hover": "%{customdata[0]:.0f} N at %{customdata[1]:.2f} ms",
    }
    curve(figure, x, y, "largest contacts", column=column, legend=False, customdata=known, **look)


SHOWN = 0.04
"""Length of the window the paper shows [s]."""

CONTACT_FILL = "rgba(217, 120, 10, 0.13)"
ROOM_ABOVE = 1.45
"""Height of a panel over that of its curves [1]: two lines of words stand above every rebound."""


def first_contact_figure(bearings: Sequence[BearingDrop], *, until: float = SHOWN) -> go.Figure:
    """Draw the vertical displacement at the first contact with t1, t2 and indentation (Neisi 2020, Fig. 10).

    A bearing that was not touched is drawn without marks; the window ends at a time [s].
    """
    figure = panels([b.name for b in bearings])
    for column, bearing in enumerate(bearings, start=1):
        heights = [0.0 if bearing.air_gap is None else -MICRO * bearing.air_gap.upper]
        for motion in bearing.motions:
            history = motion.vertical.between(0.0, until)
            add_history(figure, history, MICRO, "µm", column=column, legend=column == 1)
            heights += [MICRO * float(end(history.values)) for end in (np.nanmin, np.nanmax)]
        low, span = min(heights), max(np.ptp(heights), 1.0)
        figure.update_yaxes(range=[low - 0.06 * span, low + ROOM_ABOVE * span], row=1, col=column)
        if bearing.air_gap is not None:
            add_gap_limits(figure, bearing.air_gap, sign=-1.0, column=column, legend=column == 1)
        if bearing.first_contact is not None:
            _mark_first(figure, bearing.first_contact, bearing, column)
    figure.update_xaxes(range=[0.0, MILLI * until])
    return finished(figure, TIME_TITLE, "vertical displacement y [µm]")


def _mark_first(figure: go.Figure, contact: FirstContact, bearing: BearingDrop, column: int) -> None:
    start, end = MILLI * contact.start, MILLI * contact.end
    # of an estimate lift-off has no known error, and the depth has that of the air gap
    exact, gap = bearing.peak_force.interval_90 is None, bearing.values.get("air_gap_m")
    beyond = (0.0,) if exact or gap is None else (gap.value - gap.high, gap.value - gap.low)
    depths = [max(MICRO * (contact.indentation + one), 0.0) for one in beyond]
    figure.add_vrect(x0=start, x1=end, fillcolor=CONTACT_FILL, line_width=0, row=1, col=column)
    for value in (start, end):
        upright(figure, value, MUTED, "dot", row=1, col=column)
    times = f"t₁ {start:.2f}, t₂ {end:.2f}, T {end - start:.2f} ms" if exact else "t₁ to t₂"
    top = "y domain" if column == 1 else f"y{column} domain"
    text = f"{times}<br>indentation {' to '.join(f'{one:.1f}' for one in depths)} µm"
    look: dict[str, Any] = {"size": 11.5, "xanchor": "left", "yanchor": "top", "align": "left", "xshift": 3}
    words(figure, end, 1.0, text, column=column, yref=top, **look)


STATED = (
    ("mean", "mean", "pressure"),
    ("median", "median", "pressure"),
    ("lower quartile", "lower_quartile", "pressure"),
    ("upper quartile", "upper_quartile", "pressure"),
    ("lower whisker", "lower_whisker", "pressure"),
    ("upper whisker", "upper_whisker", "pressure"),
    ("standard deviation", "standard_deviation", "pressure"),
    ("maximum", "maximum", "pressure"),
    ("samples beyond the whiskers", "beyond_whiskers", "count"),
    ("samples above mean + 3 σ", "above_three_sigma", "count"),
    ("preload's share of the mean", "preload_share", "share"),
)
"""Lines of the table: label, field of the statistics, kind."""


def stress_box_figure(bearings: Sequence[BearingDrop]) -> go.Figure:
    """Draw the distribution of the stress at every bearing as a box plot (Neisi 2020, Fig. 16).

    Differs from the paper: its text calls values beyond three standard deviations outliers; here they are
    beyond whiskers at 1.5 interquartile ranges, with quartiles by Hazen's rule.
    """
    figure = panels([""], height=360)
    for index, bearing in enumerate(bearings):
        box, stress, colour = bearing.statistics, bearing.stress.values, SERIES[index % len(SERIES)]
        name = plain(bearing.name)
        stated = {
            "q1": box.lower_quartile,
            "median": box.median,
            "q3": box.upper_quartile,
            "lowerfence": box.lower_whisker,
            "upperfence": box.upper_whisker,
            "mean": box.mean,
        }
        look: dict[str, Any] = {"boxpoints": False, "width": 0.45, "line": {"color": colour, "width": 1.6}}
        numbers = {key: [MEGA * value] for key, value in stated.items()}
        figure.add_trace(go.Box(x=[name], name=name, showlegend=False, **numbers, **look))
        beyond = stress[(stress < box.lower_whisker) | (stress > box.upper_whisker)]
        outliers = np.unique(np.round(MEGA * beyond))  # none that would be drawn on another
        cross = {"symbol": "cross-thin-open", "size": 5, "color": colour, "line": {"width": 0.8}}
        at, label = [name] * len(outliers), f"{bearing.name}: outliers"
        curve(figure, at, outliers, label, mode="markers", marker=cross, legend=False, hover="%{y:.0f} MPa")
    figure.update_yaxes(title_text=axis_title("max. Hertz stress", "MPa"))
    figure.update_xaxes(title_text="touchdown bearing", type="category", showgrid=False)
    return figure


def stress_table(bearings: Sequence[BearingDrop]) -> Table:
    """State the numbers of the box plots (Neisi 2020, Table 5), with the share of the preload in the mean."""
    found = {bearing.name: bearing.statistics for bearing in bearings}

    def of(name: str) -> Column:
        def stated(row: tuple[str, str, str]) -> Quantity:
            _, field, kind = row
            return Quantity.of(getattr(found[name], field), kind, 3 if kind == "share" else 4)

        return Column(name, stated)

    known = any(one.preload_share is not None for one in found.values())
    rules = dict.fromkeys(one.rules() for one in found.values())
    head = Column("stress, peak of the contact ellipse", lambda row: row[0])
    rows = STATED if known else STATED[:-1]
    note = f"Rules in use: {'; '.join(rules)}."
    return table(rows, (head, *map(of, found)), "Distribution of the maximum Hertz stress", note)
