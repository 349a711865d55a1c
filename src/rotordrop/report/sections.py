"""The parts that reports on simulated and on recorded drops share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rotordrop.report.content import Figure, Section, Statement, Table
from rotordrop.report.displacement import displacement_figure
from rotordrop.report.displacement_pair import displacement_pair_figure
from rotordrop.report.first_contact import FirstContact, first_contact_figure
from rotordrop.report.force import Peak, force_figure
from rotordrop.report.history import BearingHistories, BearingMotions
from rotordrop.report.impacts import CONTACT_FORCE, Impact, impact_figure, impact_table
from rotordrop.report.orbit import orbit_figure
from rotordrop.report.quantity import Quantity
from rotordrop.report.radial import radial_figure
from rotordrop.report.stress import stress_figure
from rotordrop.report.stress_box import StressBox, stress_box_figure, stress_table
from rotordrop.severity.damage import STATIC_LIMIT

EARLY = 0.04
"""Window [s] around the first contacts that gets figures of its own."""


def motion_section(bearings: Sequence[BearingMotions], origin: str, *text: str) -> Section:
    """Displacement against time: every bearing for itself, and all side by side."""
    figures = [
        Figure(
            chart=displacement_figure(bearing),
            caption=f"Displacement of the rotor in the {bearing.bearing} touchdown bearing, {origin}; "
            "vertical above, horizontal below (Neisi 2020, Figs 7 and 8).",
        )
        for bearing in bearings
    ]
    pair = Figure(
        chart=displacement_pair_figure(bearings),
        caption="All bearings side by side; the panels zoom together (Neisi 2020, Fig. 13).",
    )
    return Section(heading="Displacement", text=text, figures=(*figures, pair))


def first_contact_section(
    bearings: Sequence[BearingMotions], contacts: Mapping[str, FirstContact], tables: tuple[Table, ...] = ()
) -> Section:
    """Vertical displacement around the first contact, with its times and depth."""
    figure = Figure(
        chart=first_contact_figure(bearings, contacts),
        caption="Vertical displacement around the first contact: t₁ first touch, t₂ lift-off, T the time "
        "between; indentation counts from the air gap, support included (Neisi 2020, Fig. 10).",
    )
    return Section(heading="First contact", figures=(figure,), tables=tables)


def orbit_section(bearings: Sequence[BearingMotions], tables: tuple[Table, ...] = ()) -> Section:
    """Orbits in the clearance circle and the radial displacement."""
    orbit = Figure(
        chart=orbit_figure(bearings),
        caption="Path of the rotor centre against the clearance circle; x to the right, y up, seen from the "
        "last bearing (Neisi 2020, Fig. 12).",
    )
    radial = Figure(
        chart=radial_figure(bearings),
        caption="Distance of the rotor from the bearing centre; above the air gap the rotor indents the race "
        "(Neisi 2020, Fig. 14).",
    )
    return Section(heading="Orbit", figures=(orbit, radial), tables=tables)


def force_section(
    bearings: Sequence[BearingHistories],
    peaks: Mapping[str, Peak],
    static_loads: Mapping[str, float] | None = None,
    tables: tuple[Table, ...] = (),
) -> Section:
    """Magnitude of the bearing force over the whole drop and at the first contacts."""
    whole = Figure(
        chart=force_figure(bearings, peaks=peaks, static_loads=static_loads),
        caption="Magnitude of the ball force on the race, instantaneous (Neisi 2020, Fig. 15).",
    )
    figures = [whole]
    if max(history.time[-1] for bearing in bearings for history in bearing.histories) > EARLY:
        chart = force_figure(bearings, peaks=peaks, until=EARLY)
        figures.append(Figure(chart=chart, caption=f"The same force in the first {1e3 * EARLY:.0f} ms."))
    return Section(heading="Bearing force", figures=tuple(figures), tables=tables)


def stress_section(
    bearings: Sequence[BearingHistories],
    peaks: Mapping[str, Peak],
    boxes: Sequence[StressBox],
    text: tuple[str, ...] = (),
) -> Section:
    """Maximum Hertz stress against time, its distribution and its numbers."""
    known = ((box.bearing, box.statistics.preload_stress) for box in boxes)
    preload = {bearing: stress for bearing, stress in known if stress is not None}
    history = Figure(
        chart=stress_figure(bearings, peaks=peaks, preload_stress=preload),
        caption="Largest Hertz stress of all balls at the inner race, instantaneous.",
    )
    box = Figure(
        chart=stress_box_figure(boxes),
        caption="Distribution of the stress within the drop; dashed in the box: mean (Neisi 2020, Fig. 16).",
    )
    return Section(heading="Hertz stress", text=text, figures=(history, box), tables=(stress_table(boxes),))


def impact_section(impacts: Sequence[Impact], *, force: str = CONTACT_FORCE) -> Section:
    """Where around the race and how hard the rotor hit."""
    if not impacts:
        none = Statement(text="The rotor did not touch a bearing in this window.", level="notice")
        return Section(heading="Impacts", statements=(none,))
    figure = Figure(
        chart=impact_figure(impacts, force=force),
        caption=f"Peak {force} of every impact over its place on the race; −90° is the bottom.",
    )
    table = impact_table(impacts, force=force)
    return Section(heading="Impacts", figures=(figure,), tables=(table,))


def static_limit_statement(bearing: str, stress: float) -> Statement:
    """Set a peak stress beside the stress of the static load rating, as information."""
    peak, limit = (Quantity(value=value, kind="pressure").text for value in (stress, STATIC_LIMIT))
    share = 100.0 * stress / STATIC_LIMIT
    return Statement(
        text=f"{bearing}: the peak stress of {peak} is {share:.0f} % of the {limit} at which ISO 76 defines "
        "the static load rating of ball bearings (information, not an acceptance limit).",
        level="notice" if stress < STATIC_LIMIT else "warning",
    )
