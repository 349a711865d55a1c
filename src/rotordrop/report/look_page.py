"""The page of a look at a recorded drop."""

from __future__ import annotations

from dataclasses import replace
from math import degrees
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.estimate.bearing_drop import AirGap, BearingMotions, Motion
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Card,
    KeyFigure,
    ReportContent,
    Section,
    Statement,
    Table,
)
from rotordrop.report.drop_sections import motion_section, orbit_section
from rotordrop.report.quantity import Quantity
from rotordrop.report.record_quality import quality_statements, record_quality_section
from rotordrop.units import format_moment

if TYPE_CHECKING:
    from rotordrop.evidence.look import Look, Synchronous

MOST_LISTED = 40
"""Impacts listed on the page; the JSON has all."""


ORBIT_BEFORE, ORBIT_UNTIL = 0.05, 0.5
"""Part of the record that the orbits are drawn of, from the release [s]: those of a minute are one blot."""


def look_page(seen: Look, *, drawn: bool = True) -> ReportContent:
    """Build the page of a look at a recorded drop.

    Parameters
    ----------
    seen : Look
        What was found.
    drawn : bool
        Whether figures are wanted; a terminal needs none.
    """
    record = seen.record
    speed = "" if seen.speed is None else f" at {_text(seen.speed, 'speed', 4)}"
    return ReportContent(
        title=f"A look at {record.name}",
        subtitle=f"{len(seen.drops)} drop{'s' if len(seen.drops) > 1 else ''}{speed}",
        facts=_facts(seen),
        simulated=SIMULATED_RECORD if record.is_simulated else "",
        verdict=(*_verdict(seen), *quality_statements(seen.findings)),
        cards=tuple(_card(seen, number) for number in range(len(seen.planes))),
        summary=(_timeline(seen),),
        sections=(
            *(_figures(seen) if drawn else ()),
            _impacts(seen),
            record_quality_section(seen.findings),
            Section(
                heading="What was read and guessed",
                statements=tuple(Statement(text=note) for note in seen.notes),
            ),
        ),
    )


def _text(value: float, kind: str, digits: int = 3) -> str:
    return Quantity(value=value, kind=kind, digits=digits).text


def _facts(seen: Look) -> tuple[tuple[str, str], ...]:
    record, names = seen.record, [path.name for path in seen.motion.paths]
    planes = [
        f"{plane}: {', '.join(s.name for s in record.sensors if s.bearing == plane)}" for plane in names
    ]
    span = f"{record.time[0]:.4g} to {record.time[-1]:.4g} s"
    return (
        ("record", str(record.path.name if record.path else record.name)),
        ("SHA-256", record.sha256 or "-"),
        ("channels", "; ".join(planes)),
        ("samples", f"{len(record.time)} at {record.sampling_rate:.6g} Hz, {span}"),
        ("program", f"rotordrop {__version__}"),
    )


def _verdict(seen: Look) -> list[Statement]:
    drop = seen.drops[0]
    contact = drop.permanent_contact
    ends = "." if contact is None else f"; from {format_moment(contact)} on it stayed in contact."
    told = [
        f"The rotor was released at {format_moment(drop.release)} of the record (± 2 ms), "
        f"{len(seen.impacts)} impacts{ends}"
    ]
    told += [
        f"{plane.plane}: {_text(plane.excess, 'length')} beyond the air gap of {_text(plane.gap, 'length')} "
        f"at {format_moment(plane.largest_time)}."
        for plane in seen.planes
        if plane.excess > 0
    ]
    if seen.standstill is not None:
        told.append(f"The shaft came to rest {seen.standstill - drop.release:.3g} s after the release.")
    grave = [f"From {whirl.start:.4g} s: {whirl.words}." for whirl in seen.whirls if whirl.turns < 0][:3]
    if len(seen.drops) > 1:
        grave.append(f"The record holds {len(seen.drops)} drops; the numbers are those of the first.")
    return [*(Statement(text=text) for text in told), *(Statement(text=t, level="warning") for t in grave)]


def _card(seen: Look, number: int) -> Card:
    plane = seen.planes[number]
    hits = sum(impact.plane == plane.plane for impact in seen.impacts)
    figures = [
        KeyFigure(
            label="largest distance from the centre",
            value=Quantity(value=plane.largest, kind="length", digits=4),
            note=f"at {plane.largest_time:.4g} s, {hits} impacts",
        ),
        KeyFigure(label="air gap used", value=Quantity(value=plane.gap, kind="length", digits=4)),
        KeyFigure(
            label="position index (mean distance over gap)",
            value=Quantity(value=plane.position_index, kind="dimensionless"),
        ),
    ]
    if plane.velocity_index is not None:
        figures.append(
            KeyFigure(
                label="velocity index (r.m.s. over speed × gap)",
                value=Quantity(value=plane.velocity_index, kind="dimensionless"),
            )
        )
    for found in seen.synchronous:
        if found.plane == plane.plane:
            figures += _synchronous(found)
    return Card(title=plane.plane, figures=tuple(figures))


def _synchronous(found: Synchronous) -> list[KeyFigure]:
    note = f"of {found.turns} turns before the release, runout of the sensors included"
    amplitude = Quantity(
        value=found.amplitude, kind="length", interval_90=found.amplitude_interval_90, digits=3
    )
    phase = Quantity(value=found.phase, kind="angle", interval_90=found.phase_interval_90, digits=3)
    return [
        KeyFigure(label="1X amplitude", value=amplitude, note=note),
        KeyFigure(label="1X high spot at the mark, from +y with the spin", value=phase, note=note),
    ]


def _timeline(seen: Look) -> Table:
    rows = tuple((format_moment(time, 4), words) for time, words in seen.timeline())
    return Table(columns=("record time", "event"), rows=rows, caption="What happened when")


def _figures(seen: Look) -> tuple[Section, ...]:
    start = seen.drops[0].release
    time = seen.motion.time - start
    bearings = [
        BearingMotions(
            name=path.name,
            motions=(Motion(label="measured", time=time, displacement=path.position, role="measured"),),
            air_gap=AirGap.of(path.gap),
        )
        for path in seen.motion.paths
    ]
    note = "Displacement in the planes of the sensors; time counts from the release."
    first = (time >= -ORBIT_BEFORE) & (time <= ORBIT_UNTIL)
    begin = [
        replace(bearing, motions=tuple(_part(m, first) for m in bearing.motions)) for bearing in bearings
    ]
    until = f" until {ORBIT_UNTIL:g} s after the release" if time[-1] > ORBIT_UNTIL else ""
    return motion_section(bearings, "measured", note), orbit_section(bearings, begin, until)


def _part(motion: Motion, kept: NDArray[np.bool_]) -> Motion:
    return replace(motion, time=motion.time[kept], displacement=motion.displacement[kept])


def _impacts(seen: Look) -> Section:
    rows = tuple(
        (
            impact.plane,
            format_moment(impact.time, 4),
            f"{degrees(impact.azimuth):.0f}°",
            Quantity(value=impact.depth, kind="length"),
            Quantity(value=impact.approach, kind="velocity"),
            Quantity(value=impact.rebound, kind="velocity"),
        )
        for impact in seen.impacts[:MOST_LISTED]
    )
    columns = ("plane", "record time", "azimuth", "beyond the air gap", "radial velocity before", "and after")
    note = f"The first {MOST_LISTED} of {len(seen.impacts)}." if len(seen.impacts) > MOST_LISTED else ""
    table = Table(columns=columns, rows=rows, caption="Impacts by displacement alone", note=note)
    return Section(heading="Impacts", tables=(table,))
