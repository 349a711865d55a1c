"""The page of a look at a recorded drop."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, floor, inf, log10
from typing import TYPE_CHECKING

from rotordrop.estimate.bearing_drop import AirGap, BearingMotions, Motion
from rotordrop.evidence.held import LEAST_PERIODS, LINE_ABOVE, LINE_AROUND
from rotordrop.evidence.impacts import AFTER_LAST
from rotordrop.evidence.paths import DROWNED, TOO_SLOW
from rotordrop.evidence.quality.motion import LOUD
from rotordrop.evidence.rest import STANDSTILL
from rotordrop.report.content import (
    SIMULATED_RECORD,
    Card,
    Column,
    Figure,
    KeyFigure,
    ReportContent,
    Section,
    Statement,
    Table,
    table,
)
from rotordrop.report.drop_sections import (
    impact_rule,
    motion_section,
    orbit_section,
    quality_statements,
    record_quality_section,
)
from rotordrop.report.origin import UsedFile, machine_facts
from rotordrop.report.quantity import Quantity, shown, written
from rotordrop.report.style import TURN, axis_title, curve, panels
from rotordrop.units import format_moment

if TYPE_CHECKING:
    from rotordrop.evidence.look import HeldContact, Impact, Level, Look, PlaneLook
    from rotordrop.machine import Machine

MOST_LISTED = 40
"""Impacts listed on the page; the JSON has all."""
FEW = 2
"""Lines of a channel that a terminal has room for."""
ORBIT_BEFORE, ORBIT_UNTIL = 0.05, 0.5
"""Part of the record that the orbits are drawn of, from the release [s]: those of a minute are one blot."""
COUPLED = "AC coupling"
RELEASE = "the release"
"""What a look counts time from."""
SENSOR_PLANES = f"Displacement in the planes of the sensors; time counts from {RELEASE}."


def look_page(seen: Look, machine: Machine | None = None, *, drawn: bool = True) -> ReportContent:
    """Build the page of a look at a record, with figures where they are wanted; the machine is named."""
    told, facts = (_of_drop if seen.drops else _without_drop)(seen, drawn=drawn), _facts(seen)
    notes = tuple(map(Statement, seen.notes))
    # the terminal shows neither the facts nor the sections
    read = f"Read: {dict(facts)['channels']}; samples: {dict(facts)['samples']}."
    said = Statement(" ".join((read, *(note.sentence for note in notes))))
    quality = record_quality_section(seen.findings, seen.not_seen)
    return replace(
        told,
        facts=(*(() if machine is None else machine_facts(machine)), *facts),
        simulated=SIMULATED_RECORD if seen.record.is_simulated else "",
        verdict=told.verdict if drawn else (*told.verdict, said),
        sections=(*told.sections, quality, Section("What was read and guessed", statements=notes)),
    )


def _of_drop(seen: Look, *, drawn: bool) -> ReportContent:
    """Impacts, motion and indices of the first drop of a record."""
    figures = _figures(seen) if drawn else ()
    speed = "" if seen.speed is None else f" at {shown(seen.speed / TURN, 'frequency', 3)}"
    given = any(plane.gap_interval_90 is None for plane in seen.planes)
    # what a gap that was given makes false, or the speed of the headline, stands before the numbers
    false = {"wrong speed", "wrong speed unit", *(("wrong air gap",) if given else ())}
    doubted = [one for one in seen.findings if one.kind in false]
    released, *told = _verdict(seen)
    rest = [*quality_statements([one for one in seen.findings if one not in doubted]), *told]
    rest.sort(key=lambda one: one.level not in ("bad", "warning"))  # what makes numbers doubtful first
    return ReportContent(
        title=f"A look at {seen.record.name}",
        # figures of a page count from the release
        subtitle=f"{len(seen.drops)} drop{'s' if len(seen.drops) > 1 else ''}{speed}"
        + ("" if drawn else f", times as in the record (from {format_moment(seen.record.time[0])})"),
        verdict=(*quality_statements(doubted), released, *rest),
        cards=tuple(card for card in (_card(seen, plane) for plane in seen.planes) if card.figures),
        counted_from=RELEASE,
        lead=1 if drawn else 0,
        summary=(_timeline(seen),) if drawn else (),
        sections=(
            *figures[:2],
            *(() if _hidden_by(seen) else (Section("Impacts", tables=(_impacts(seen),)),)),
            *figures[2:],
        ),
    )


def _without_drop(seen: Look, *, drawn: bool) -> ReportContent:
    """Contacts of a held rotor, levels and spectra of a record in which nothing falls."""
    doubted = seen.unit_doubted
    if doubted:
        said = [Statement("No number of a drop is shown before the unit is right.")]
    elif seen.contacts:
        ends = dict.fromkeys(one.plane for one in seen.contacts)
        parts = [f"{sum(one.plane == end for one in seen.contacts)} at {end}" for end in ends]
        said = [
            Statement(f"The rotor touched while its magnets hold or pull it: {', '.join(parts)}.", "warning")
        ]
    elif seen.motion.paths:
        said = [Statement(f"No contact and {seen.no_fall}")]
    else:
        said = [Statement(seen.no_fall)]
    said += [
        Statement(f"From {format_moment(whirl.start)}: {whirl.words}.", "warning")
        for whirl in seen.whirls[:3]
    ]
    levels = (
        Column("channel", lambda row: f"{row.channel} [{_scale(row)[1]}]"),
        Column("mean", lambda row: f"{_scale(row)[0] * row.mean:.4g}"),
        Column("r.m.s. about it", lambda row: f"{_scale(row)[0] * row.rms:.3g}"),
        Column("peak to peak", lambda row: f"{_scale(row)[0] * row.peak_to_peak:.3g}"),
        Column(
            "lines [Hz] (amplitude), strongest first",
            lambda row: _lines(row, len(row.lines) if drawn else FEW),
        ),
    )
    stands_out = (
        f"A line is at least {LINE_ABOVE:g} times the median of the spectrum within {LINE_AROUND} points to "
        f"either side (chosen), from {LEAST_PERIODS} periods in a stretch on: below, a step looks like a "
        "tone. Amplitudes are zero to peak; the frequency is known to half the spacing of the points (±)."
    )
    unit = "as it was read, which is doubted" if doubted else "of each channel"
    summary = [table(seen.levels, levels, f"Levels, in the unit {unit}", stands_out)]
    if seen.contacts:
        summary.insert(0, _contact_table(seen))
    spectra = [Section("Spectrum", figures=tuple(map(_spectrum, seen.levels)))] if drawn else []
    return ReportContent(
        title=f"A look at {seen.record.name}",
        subtitle=(
            "a drop is not determined: the unit of the readings is in doubt"
            if doubted
            else "no drop seen in this record"
            if seen.motion.paths
            else "a drop is not determined: no pair of channels shows a plane"
        ),
        verdict=(
            *(quality_statements(seen.findings) if doubted else ()),
            *said,
            *(() if doubted else quality_statements(seen.findings)),
        ),
        counted_from="the start of the record",
        summary=tuple(summary),
        sections=(*spectra, Section("What happened when", tables=(_timeline(seen),))),
    )


def _timeline(seen: Look) -> Table:
    columns = (
        Column("record time", lambda row: format_moment(row[0])),
        Column("event", lambda row: row[1]),
    )
    return table(seen.timeline(), columns, "What happened when")


def _scale(level: Level) -> tuple[float, str]:
    """Factor and unit in which a channel is shown: metres as micrometres."""
    return (1e6, "µm") if level.unit == "m" else (1.0, level.unit or "?")


def _lines(level: Level, count: int) -> str:
    """The lines of a channel: frequency with as many places as its error, and amplitude."""
    places = max(1 - floor(log10(level.resolution)), 0)
    known = f" ± {level.resolution:.{places}f}"
    lines = (f"{at:.{places}f}{known} ({_scale(level)[0] * size:.3g})" for at, size in level.lines[:count])
    return ", ".join(lines) or "–"


def _contact_table(seen: Look) -> Table:
    def bounds(row: HeldContact) -> str:
        low, high = row.velocity_change if row.impulse is None else row.impulse
        return f"{low:.2g} to {high:.2g}"

    def speed(value: float, interval: tuple[float, float]) -> str:
        return f"{value:.3f} ({interval[0]:.3f} to {interval[1]:.3f})"

    described = seen.contacts[0].impulse is not None
    columns = (
        Column("plane", "plane"),
        Column("record time", lambda row: format_moment(row.time)),
        Column("direction", lambda row: f"{written(degrees(row.azimuth), 0)}°"),
        Column("from the usual place", "distance", "length"),
        Column("approaches with [m/s] (90 %)", lambda row: speed(row.approach, row.approach_interval_90)),
        Column("departs with [m/s] (90 %)", lambda row: speed(row.departure, row.departure_interval_90)),
        Column("impulse [N s]" if described else "impulse per kg of moving mass [N s/kg]", bounds),
    )
    note = (
        "A contact turns the rotor back at least three times as sharply as it came, far outside of its usual "
        "orbit; further ones are as stiff. Direction counter-clockwise from +x, −90° is the bottom. "
        "Velocities at the contact, by a fit of the flight beside it and half the contact. "
        + (
            "Impulse between the mass that a rigid rotor has at the plane and all of it."
            if described
            else "The moving mass is what of the rotor takes part at this plane; a machine file bounds it."
        )
    )
    more = f" The first {MOST_LISTED} of {len(seen.contacts)}." if len(seen.contacts) > MOST_LISTED else ""
    return table(
        seen.contacts[:MOST_LISTED], columns, "Contacts while the magnets hold the rotor", note + more
    )


def _spectrum(level: Level) -> Figure:
    factor, unit = _scale(level)
    figure = panels([level.channel], height=260)
    curve(figure, level.frequency[1:], factor * level.amplitude[1:], level.channel, legend=False, hover=None)
    figure.update_xaxes(title_text=axis_title("frequency", "Hz"))
    figure.update_yaxes(title_text=axis_title("amplitude, zero to peak", unit), type="log")
    words = f"Spectrum of {level.channel}: Hann windows, averaged over the record."
    return Figure(figure, words)


def _facts(seen: Look) -> tuple[tuple[str, str], ...]:
    record = seen.record
    between = {path.name for path in seen.motion.paths if not path.at_bearing}
    ends = {", ".join(plane.names): plane.bearing for plane in record.planes}
    planes = [f"{'between' if names in between else end}: {names}" for names, end in ends.items()]
    span = f"{record.time[0]:.4g} to {record.time[-1]:.4g} s"
    return (
        UsedFile(
            role="record", name=record.path.name if record.path else record.name, sha256=record.sha256
        ).fact,
        ("channels", "; ".join(planes) or ", ".join(level.channel for level in seen.levels)),
        ("samples", f"{len(record.time)} at {record.sampling_rate:.6g} Hz, {span}"),
    )


def _verdict(seen: Look) -> list[Statement]:
    drop = seen.drops[0]
    contact, between = drop.permanent_contact, drop.permanent_contact_interval_90
    ends = "."
    if contact is not None and between is not None:
        ends = (
            f", the last at {format_moment(contact)} ({' to '.join(map(format_moment, between))}); "
            f"{AFTER_LAST}."
        )
    low, high = drop.count_interval_90
    half = 1e3 * (drop.release_interval_90[1] - drop.release)
    release = f"{format_moment(drop.release)} (± {half:.2g} ms)"
    count = len(seen.impacts)
    hits = f"{count} impact{'' if count == 1 else 's'} ({low} to {high})"
    if hidden := _hidden_by(seen):
        hits, ends = f"{hidden} hides its impacts", "."
    if hidden == COUPLED:
        return [Statement(f"Released at {release}; {hits} and its air gap.")]
    touched = " First end: not determined." if len(seen.planes) > 1 else ""
    if seen.first_end is not None:
        at = next(plane.touch for plane in seen.planes if plane.plane == seen.first_end)
        touched = f" {seen.first_end} touched first, at {format_moment(at or 0.0)}."
    whirl = "" if seen.whirls else " No whirl."
    said = [f"Released at {release}; {hits}{ends}{touched}{whirl}"]
    said += [
        f"{plane.plane}: {shown(plane.excess, 'length', 3)} (90 %: "
        f"{' to '.join(shown(end, 'length', 3) for end in plane.excess_interval_90)}) beyond the air gap of "
        f"{shown(plane.gap, 'length', 3)} at {format_moment(plane.largest_time)}, at the sensors."
        for plane in seen.planes
        if plane.excess > 0 and plane.gap_interval_90 is None
    ]
    if seen.standstill is not None:
        slow = shown(STANDSTILL, "speed")
        said.append(f"Its speed readings stay below {slow} from {format_moment(seen.standstill)} on.")
    if forward := [whirl for whirl in seen.whirls if whirl.turns > 0]:
        said.append(f"From {format_moment(forward[0].start)}: {forward[0].words}.")
    grave = [
        f"From {format_moment(whirl.start)}: {whirl.words}." for whirl in seen.whirls if whirl.turns < 0
    ][:3]
    if len(seen.drops) > 1:
        grave.append(f"The record holds {len(seen.drops)} drops; the numbers are those of the first.")
    return [*map(Statement, said), *(Statement(text, "warning") for text in grave)]


def _hidden_by(seen: Look) -> str:
    """What makes impacts of its own or moves them: a high-pass, noise; empty where nothing does."""
    if any(one.kind == COUPLED for one in seen.findings):
        return COUPLED
    return "noise" if any(plane.noise > LOUD for plane in seen.planes) else ""


def _card(seen: Look, plane: PlaneLook) -> Card:
    note = f"at the sensors, at {format_moment(plane.largest_time)}"
    hits = _found(len(plane.settling.touched), plane.settling.count_interval_90, "count")
    largest = _found(plane.largest, plane.largest_interval_90)
    index = _found(plane.position_index, plane.position_index_interval_90, "dimensionless")
    gap_up_to = inf if plane.gap_interval_90 is None else DROWNED
    with_noise = (  # each up to so much of it
        (inf, KeyFigure("largest distance from the centre", largest, note)),
        (LOUD, KeyFigure("impacts by displacement alone", hits)),
        (gap_up_to, _gap_figure(plane)),
        (gap_up_to, KeyFigure("position index (mean distance over gap)", index)),
    )
    figures = [figure for most, figure in with_noise if plane.noise <= most]
    if _hidden_by(seen) == COUPLED:  # no place of the rotor is known, nor the gap
        figures = []
    elif plane.velocity_index is not None:
        label = "velocity index (r.m.s. over speed × gap)"
        velocity = _found(plane.velocity_index, plane.velocity_index_interval_90, "dimensionless")
        figures.append(KeyFigure(label, velocity))
    for found in seen.synchronous:
        if found.plane == plane.plane:
            note = f"of {found.turns} turns before the release, runout of the sensors included"
            amplitude = _found(found.amplitude, found.amplitude_interval_90)
            phase = _found(found.phase, found.phase_interval_90, "angle")
            figures += [
                KeyFigure("1X amplitude", amplitude, note),
                KeyFigure("1X high spot at the mark, from +y with the spin", phase, note),
            ]
    return Card(plane.plane, tuple(figures))


def _gap_figure(plane: PlaneLook) -> KeyFigure:
    if plane.gap_interval_90 is None:
        return KeyFigure("air gap", Quantity(value=plane.gap, kind="length", digits=3), "as given")
    note = "by where the rotor touched" if plane.gap_determined else "not determined by this record"
    return KeyFigure("air gap and any play", _found(plane.gap, plane.gap_interval_90), note)


def _found(value: float, interval: tuple[float, float] | None, kind: str = "length") -> Quantity:
    return Quantity(value=value, kind=kind, interval_90=interval, digits=3)


def _figures(seen: Look) -> tuple[Section, ...]:
    time = seen.motion.time - seen.drops[0].release
    bearings = [
        BearingMotions(
            name=path.name,
            motions=(Motion(label="measured", time=time, displacement=path.position, role="measured"),),
            air_gap=AirGap(lower=path.wall.interval_90[0], upper=path.wall.interval_90[1]),
        )
        for path in seen.motion.paths
    ]
    kept = (time >= -ORBIT_BEFORE) & (time <= ORBIT_UNTIL)
    first = [
        replace(one, motions=(replace(motion, time=time[kept], displacement=motion.displacement[kept]),))
        for one in bearings
        for motion in one.motions
    ]
    until = f" until {ORBIT_UNTIL:g} s after the release" if time[-1] > ORBIT_UNTIL else ""
    sections = (
        orbit_section(bearings, first, until),
        motion_section(bearings, "measured", SENSOR_PLANES),
    )
    for figure in (figure for section in sections for figure in section.figures):
        for axis in figure.chart.select_xaxes():
            axis.title.text = (axis.title.text or "").replace("power-off", RELEASE) or None
    return sections


def _impacts(seen: Look) -> Table:
    def touch(one: Impact) -> str:
        return f"{format_moment(one.time)} ± {1e3 * (one.time_interval_90[1] - one.time):.2g} ms"

    def azimuth(one: Impact) -> str:
        half = one.azimuth_interval_90[1] - one.azimuth
        return f"{written(degrees(one.azimuth), 0)}° ± {degrees(half):.0f}°"

    columns = (
        Column("plane", "plane"),
        Column("touches at (record time, 90 %)", touch),
        Column("azimuth (90 %)", azimuth),
        Column("beyond the air gap", lambda one: one.depth if one.depth > 0.0 else None, "length"),
        Column("radial velocity before", "approach", "velocity"),
        Column("and after", "rebound", "velocity"),
    )
    note = f"The first {MOST_LISTED} of {len(seen.impacts)}." if len(seen.impacts) > MOST_LISTED else ""
    rule = impact_rule([path.gap for path in seen.motion.paths], seen=True)
    known = ", ".join(
        f"{path.name} ± {shown(path.wall.distance_error, 'length', 2)}" for path in seen.motion.paths
    )
    rule += (
        f" Distances beyond the air gap are known to {known} (90 %), – where none shows; velocities are up "
        f"to {1e3 * TOO_SLOW:g} mm/s too small."
    )
    return table(
        seen.impacts[:MOST_LISTED], columns, "Impacts by displacement alone", f"{rule} {note}".strip()
    )
