"""The sections that every drop has, followed, replayed or simulated: all drawn from `BearingDrop`.

A further figure of a drop is one function here, or one file and a line here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rotordrop.estimate.bearing_drop import BearingDrop, BearingMotions, History
from rotordrop.report.content import Figure, Section, Statement, Table
from rotordrop.report.first_contact import first_contact_figure
from rotordrop.report.impacts import impact_figure, impact_table
from rotordrop.report.orbit import orbit_figure
from rotordrop.report.quantity import shown
from rotordrop.report.stress_box import StressBox, stress_box, stress_box_figure, stress_table
from rotordrop.report.style import MICRO, TURN
from rotordrop.report.time_panels import Panel, time_panels

AROUND_PEAK = (2e-3, 4e-3)
"""Stretch before and after a peak [s] that gets a figure of its own; chosen, not measured."""
MEGA = 1e-6
CARRIED = (
    "The measured motion is carried from the planes of the sensors to the bearings along the straight line "
    "through them; the bending in between, a few micrometres, is left out."
)
NO_DISTRIBUTION = (
    "No distribution of the stress is stated: its numbers have no ranges, and single numbers do not hold."
)
NO_IMPACT = "The rotor did not touch a bearing in this window."


def drop_sections(
    bearings: Sequence[BearingDrop],
    origin: str,
    speed: float,
    static_loads: Mapping[str, float] | None = None,
    *,
    contact_tables: tuple[Table, ...] = (),
    certain: bool = True,
) -> tuple[Section, ...]:
    """Force, orbit, stress, impacts, motion and first contact of a drop, in this order.

    The origin says what is drawn, as "measured and estimated"; the speed at power-off [rad/s] names the
    drop; static loads are the share of the weight by bearing [N]. Where single numbers are not certain,
    ranges alone are stated.
    """
    contact = Figure(
        first_contact_figure(bearings),
        "Vertical displacement around the first contact: t₁ first touch, t₂ lift-off, T the time "
        "between; indentation counts from the air gap, support included (Neisi 2020, Fig. 10).",
        "first contact",
    )
    return (
        _force(bearings, static_loads or {}, certain=certain),
        orbit_section(bearings),
        _stress(bearings, speed, certain=certain),
        _impacts(bearings),
        motion_section(bearings, origin),
        radial_section(bearings),
        Section("First contact", figures=(contact,), tables=contact_tables),
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
        axis="max. Hertz stress",
        histories=(bearing.stress,),
        band=bearing.stress_band,
        levels=() if bearing.preload_stress is None else (("preload alone", bearing.preload_stress),),
        peak=bearing.peak_stress,
        certain=certain,
    )


def _force(bearings: Sequence[BearingDrop], loads: Mapping[str, float], *, certain: bool) -> Section:
    """The whole force beside its stretch around the peak, where the 90 % interval can be seen."""
    panels = [force_panel(bearing, loads, certain=certain) for bearing in bearings]
    near = [replace(panel.around(*AROUND_PEAK), title=f"{panel.title}, around its peak") for panel in panels]
    rows = [[replace(whole, peak=None), close] for whole, close in zip(panels, near, strict=True)]
    chart = time_panels(rows, 1.0, "N", from_zero=True, from_power_off=False)
    caption = "Magnitude of the ball force on the race, instantaneous (Neisi 2020, Fig. 15), and its peak."
    return Section("Bearing force", figures=(Figure(chart, caption, "force"),))


def _stress(bearings: Sequence[BearingDrop], speed: float, *, certain: bool) -> Section:
    history = Figure(
        time_panels([[stress_panel(bearing, certain=certain)] for bearing in bearings], MEGA, "MPa"),
        "Largest Hertz stress of all balls at the inner race, instantaneous.",
        "stress",
    )
    if not certain:
        return Section("Hertz stress", (), (Statement(NO_DISTRIBUTION),), (history,))
    boxes = stress_boxes(bearings, speed)
    box = Figure(
        stress_box_figure(boxes),
        "Distribution of the stress within the drop; dashed in the box: mean (Neisi 2020, Fig. 16).",
        "stress distribution",
    )
    # statistics of an estimated history have no interval of their own; mean and peak stand above with theirs
    tables = () if any(one.stress_band for one in bearings) else (stress_table(boxes),)
    return Section("Hertz stress", figures=(history, box), tables=tables)


def stress_boxes(bearings: Sequence[BearingDrop], speed: float) -> tuple[StressBox, ...]:
    """Distribution of the stress at every bearing, under the speed of the drop."""
    label = shown(speed / TURN, "frequency", 3)
    return tuple(
        stress_box(label, bearing.name, bearing.stress.values, bearing.statistics) for bearing in bearings
    )


def _impacts(bearings: Sequence[BearingDrop]) -> Section:
    reasons = tuple(
        Statement(f"{bearing.name}: no impacts are listed, because {bearing.missing['impacts']}.")
        for bearing in bearings
        if "impacts" in bearing.missing
    )
    hit = [bearing for bearing in bearings if bearing.impacts]
    if not hit:
        return Section("Impacts", statements=reasons or (Statement(NO_IMPACT),))
    force = hit[0].impact_force
    figure = Figure(
        impact_figure(hit, force=force),
        f"Peak {force} of every impact where it hit the race, seen from {bearings[-1].name}; −90° is "
        "the bottom, the distance from the centre is the force, the bar its 90 % interval.",
        "impacts",
    )
    return Section("Impacts", (), reasons, (figure,), (impact_table(hit, force=force),))


def motion_section(bearings: Sequence[BearingMotions | BearingDrop], origin: str, *text: str) -> Section:
    """Displacement against time: horizontal beside vertical, all bearings zooming together."""
    caption = f"Displacement of the rotor, {origin}; the panels zoom together (Neisi 2020, Figs 7, 8 and 13)."
    carried = any(isinstance(b, BearingDrop) and b.motions[0].role == "measured" for b in bearings)
    figure = Figure(displacement_figure(bearings), caption, "displacement")
    return Section("Displacement", (*text, *((CARRIED,) if carried else ())), figures=(figure,))


def radial_section(bearings: Sequence[BearingMotions | BearingDrop]) -> Section:
    """Distance of the rotor from the centre of every bearing against time."""
    rows = [
        [
            Panel(
                title=bearing.name,
                axis="radial displacement",
                histories=tuple(motion.radial for motion in bearing.at_gap_limits or bearing.motions),
                air_gap=bearing.air_gap,
            )
        ]
        for bearing in bearings
    ]
    radial = Figure(
        time_panels(rows, MICRO, "µm", from_zero=True),
        "Radial displacement, simulated for both limits of the air gap (Neisi 2020, Fig. 14)."
        if any(bearing.at_gap_limits for bearing in bearings)
        else "Distance of the rotor from the bearing centre; above the air gap the rotor indents the race "
        "(Neisi 2020, Fig. 14).",
        "radial displacement",
    )
    return Section("Radial displacement", figures=(radial,))


def displacement_figure(bearings: Sequence[BearingMotions | BearingDrop]) -> object:
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
    bearings: Sequence[BearingMotions | BearingDrop], early: Sequence[BearingMotions] = (), until: str = ""
) -> Section:
    """Orbits in the clearance circle, of an early part alone where one is given."""
    # planes of sensors alone stand in the order of the record, not in that of the rotor
    seen = f", seen from {bearings[-1].name}" if isinstance(bearings[-1], BearingDrop) else ""
    orbit = Figure(
        orbit_figure(early or bearings),
        f"Path of the rotor centre against the clearance circle{until}; x to the right, y up{seen} "
        "(Neisi 2020, Fig. 12).",
        "orbit",
    )
    return Section("Orbit", figures=(orbit,))


def speed_figure(rotor: Sequence[History], races: Sequence[History] = ()) -> object:
    """Draw the speed of the rotor, and of the inner races beside it [rad/s], in Hz."""
    row = [Panel(title="rotor", axis="speed", histories=tuple(rotor))]
    if races:
        axis = "race speed"
        row.append(Panel(title="inner races", axis=axis, histories=tuple(races), series=True))
    return time_panels([row], 1.0 / TURN, "Hz", height=250)
