"""The report on one simulated drop."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.estimate.bearing_drop import History, simulated_bearings
from rotordrop.record.impacts import HOP
from rotordrop.report.content import Column, Figure, ReportContent, Section, appendix, table
from rotordrop.report.drop_sections import drop_sections, speed_figure
from rotordrop.report.heat_section import heat_sections
from rotordrop.report.machine_sections import machine_sections, weight_shares
from rotordrop.report.simulate_summary import landing_count, simulate_summary
from rotordrop.report.time_panels import Panel, time_panels
from rotordrop.simulate.clearances import clearance_uses
from rotordrop.simulate.landing import Landing, landings
from rotordrop.simulate.magnets import MagnetHistory
from rotordrop.simulate.result import DropResult
from rotordrop.simulate.ribbons import ribbon_uses
from rotordrop.units import percent

if TYPE_CHECKING:
    from rotordrop.machine import Machine

CLEARANCES = (
    Column("clearance", lambda use: f"{use.name}, stop of the mount" if use.stop else use.name),
    Column("node", lambda use: str(use.node)),
    Column("gap", "gap", "length"),
    Column("largest travel", "travel", "length"),
    Column("travel over gap", "share", "dimensionless", 3),
    Column("at", "time", "time", 3),
    Column("contacts", lambda use: "no force acts" if use.count is None else str(use.count)),
    Column("largest force", "peak_force", "force"),
)

RIBBONS = (
    Column("ribbon of the mount", "name"),
    Column("slip force", "slip_force", "force"),
    Column("largest force", "peak_force", "force"),
    Column("at", "peak_time", "time", 3),
    Column("slipped for", "slipped", "time", 3),
    Column("energy taken", "dissipated", "energy", 3),
)


LANDINGS = (
    Column("bearing", "name"),
    Column("axial gap", "gap", "length"),
    Column("travel of the rotor", "rotor_travel", "length"),
    Column("against the race", "travel", "length"),
    Column("landings", lambda one: str(landing_count(one))),
    Column("largest axial force", lambda one: one.contacts.peak[0], "force"),
    Column("at", lambda one: one.contacts.peak[1], "time", 3),
    Column("contact angle", "contact_angle", "angle"),
    Column("edge of the contact", "edge_angle", "angle"),
    Column("shoulder", lambda one: one.climb.shoulder, "angle"),
)


def simulate_page(result: DropResult, machine: Machine | None = None) -> ReportContent:
    """Build the report on one simulated drop.

    The machine gives weight shares, the friction law and the defaults in use.
    """
    bearings = simulated_bearings(result)
    uses = () if machine is None else clearance_uses(machine, result)
    landed = () if machine is None else landings(machine, result)
    ribbons = () if machine is None else ribbon_uses(machine, result)
    rotor = (History(label="rotor", time=result.time, values=result.speed),)
    races = tuple(
        History(label=f"{name} race", time=result.time, values=result.race_speed[:, index])
        for index, name in enumerate(result.bearing_names)
    )
    turning = Figure(
        speed_figure(rotor, races), "Speed of the rotor and of the inner races, which friction spins up."
    )
    force, orbit, *rest = drop_sections(bearings, "simulated", result.initial_speed, weight_shares(machine))
    return replace(
        simulate_summary(result, machine),
        sections=(
            force,
            orbit,
            *appendix(rest),
            *((Section("Clearances", tables=(table(uses, CLEARANCES),)),) if uses else ()),
            *((Section("Ribbons", tables=(table(ribbons, RIBBONS),)),) if ribbons else ()),
            *((_landing(result, landed),) if landed else ()),
            *((_magnets(result, result.magnets),) if result.magnets is not None else ()),
            *heat_sections(result.heat, result.bearing_names),
            Section("Speed", figures=(turning,)),
            *(() if machine is None else appendix(machine_sections(machine))),
        ),
        lead=2,
        ends=(bearings[0].name, bearings[-1].name),
    )


EVENTS = (Column("magnets", lambda row: row[0]), Column("at", lambda row: row[1], "time", 3))


def _magnets(result: DropResult, magnets: MagnetHistory) -> Section:
    """Force of every magnet and the currents of its coils against time, and what happened to them."""
    forces, currents = [], []
    for a, name in enumerate(magnets.names):
        force = tuple(
            History(label=axis, time=result.time, values=magnets.force[:, a, k])
            for k, axis in enumerate("xy")
        )
        current = tuple(
            History(label=f"{axis}{sign}", time=result.time, values=magnets.current[:, a, k, j])
            for k, axis in enumerate("xy")
            for j, sign in enumerate("+−")
        )
        forces.append(Panel(title=name, axis="magnet force", histories=force, series=True))
        currents.append(Panel(title=name, axis="current", histories=current, series=True))
    figures = (
        Figure(time_panels([forces], 1.0, "N"), "Force of the magnets on the rotor.", "magnet force"),
        Figure(
            time_panels([currents], 1.0, "A"),
            "Currents of the coils that pull towards + and − of each axis.",
            "current",
        ),
    )
    times = [time if np.isfinite(time) else None for time in magnets.event_time.tolist()]
    events = table(list(zip(magnets.events, times, strict=True)), EVENTS)
    return Section("Magnets", figures=figures, tables=(events,) if magnets.events else ())


def _landing(result: DropResult, landed: tuple[Landing, ...]) -> Section:
    """Force on the faces against time, and what each landing came to."""
    assert result.face_force is not None
    rows = []
    for one in landed:
        force = result.face_force[:, result.index_of(one.name)]
        simulated = History(label="simulated", time=result.time, values=force)
        rows.append([Panel(title=one.name, axis="axial force", histories=(simulated,))])
    caption = "Axial force of the rotor on the face of the race, positive towards higher nodes."
    figure = Figure(time_panels(rows, 1.0, "N"), caption, "axial force")
    note = (
        "Travel of the rotor is from the middle between its axial magnets and counts for impellers; against "
        "the race it is longer than the gap by what shoulder and face give way. Contacts without a hop of "
        f"{percent(HOP)} of the gap between them are one landing. The edge of the contact is how far up its "
        "groove the contact of a ball reaches; the groove ends at the shoulder."
    )
    return Section("Axial landing", figures=(figure,), tables=(table(landed, LANDINGS, note=note),))
