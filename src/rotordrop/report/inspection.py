"""What to do next at the machine, and why: a suggestion from the numbers of one drop, never an acceptance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.estimate.bearing_drop import AirGap, BearingDrop
from rotordrop.estimate.estimate import Estimate
from rotordrop.report.content import Column, Section, Statement, table
from rotordrop.report.quantity import Quantity, shown

if TYPE_CHECKING:
    from rotordrop.restart.card import RestartCard

SCOPE = (
    "A suggestion from this drop alone. How many drops a set of touchdown bearings may take, and what is "
    "inspected after each, is for maker and operator to agree (ISO 14839-5:2022, condition monitoring and "
    "inspection); no such limit was given here."
)


SETTLE_FIRST = (
    "Before anything is concluded from force or stress: check machine file and record against each other "
    "(data quality, sensors, air gap), and estimate again. The loads of this drop are known as ranges only."
)


def inspection_section(estimate: Estimate, card: RestartCard | None = None) -> Section:
    """Suggest the next step of inspection, the gravest reason first, in keeping with a restart card."""
    said = [] if estimate.consistent else [Statement(SETTLE_FIRST, "bad")]
    runs = card is not None and card.answer in ("restart", "restart with limits")
    when = "at the next standstill" if runs else "before the next start"
    if card is not None:
        told = f"{card.answer.capitalize()}: the answer of the restart card, by expected cost; see its part."
        said.append(Statement(told, "notice" if runs else "warning"))
    for bearing in estimate.bearings:
        highest = bearing.peak_stress.known.high
        if highest >= STATIC_STRESS:
            text = (
                f"{bearing.name}: look at balls and raceways for indentations {when}. The "
                f"peak stress may be as high as {shown(highest, 'pressure', 3)}; from "
                f"{shown(STATIC_STRESS, 'pressure')} on ISO 76 expects a permanent indentation of a "
                "ten-thousandth of the ball diameter."
            )
            said.append(Statement(text, "warning"))
    for one in estimate.later:
        if one.larger:
            text = (
                f"{one.bearing}: look at the rest of the record before the next start. The rotor went "
                f"further out at {one.later_time:.3g} s than in the part that was estimated, so that the "
                "largest load may not be among these numbers."
            )
            said.append(Statement(text, "warning"))
    gaps = "; ".join(
        f"{bearing.name} {_gap(bearing, bearing.air_gap, certain=estimate.consistent)}"
        for bearing in estimate.bearings
        if bearing.air_gap is not None
    )
    text = (
        "At the next standstill: a lift check (push the rotor round its touchdown bearings and record it). "
        f"A gap that differs from the one found here ({gaps}) is wear or a sensor that has moved; "
        "turning each bearing by hand shows whether it still runs."
    )
    return Section("What to do", (), (*said, Statement(text), Statement(SCOPE)))


def _gap(bearing: BearingDrop, limits: AirGap, *, certain: bool) -> str:
    """The air gap with its 90 % interval, that alone where single numbers do not hold, or its limits."""
    if (known := bearing.values.get("air_gap_m")) is None:
        low, high = 1e6 * limits.lower, 1e6 * limits.upper
        return f"{high:.0f} µm" if low == high else f"{low:.0f} to {high:.0f} µm"
    gap = Quantity.of(known, "length", range_only=not certain)
    return f"{gap.text} ({gap.interval_text})" if gap.interval_text else gap.text


def limits_section(estimate: Estimate) -> Section:
    """What the numbers were compared with, and where each limit comes from."""
    rows = [
        (
            "stress at which ISO 76 defines the static load rating of ball bearings",
            Quantity.of(STATIC_STRESS, "pressure"),
            "information; no acceptance limit was given",
        )
    ]
    if estimate.innovations is not None:
        low, high = estimate.innovations.limits
        rows.append(
            (
                "mean normalised innovation squared of a model that fits its record",
                Quantity(value=high, kind="dimensionless", interval_90=(low, high), range_only=True),
                "whether single numbers are stated",
            )
        )
    rows += [
        (
            f"difference from the independent cross-check, {check.name}",
            Quantity.of(check.accuracy, "share", 2),
            "its known accuracy; beyond it a warning is given",
        )
        for check in estimate.cross_check
        if not check.replaced
    ]
    columns = (
        Column("limit", lambda row: row[0]),
        Column("value", lambda row: row[1]),
        Column("what it decides", lambda row: row[2]),
    )
    return Section("Limits used", tables=(table(rows, columns, "Limits used"),))


ASSUMED = (
    "The rotor is linear: beam elements, reduced to its lowest modes and its shapes under bearing loads.",
    "Rotor and touchdown bearings move in the planes of the bearings; tilt of the races and axial motion are "
    "left out.",
    "The contact of rotor and race follows a Hertzian law with losses, friction a Stribeck law; their "
    "parameters are among the unknowns.",
    "The magnets carry nothing after power-off but a decaying remanent force.",
    "Parameters the record does not determine keep their prior, inside every interval of force and stress.",
)
"""What every estimate takes for granted."""


def assumptions_section() -> Section:
    """What the estimate takes for granted."""
    return Section("Assumptions", statements=tuple(map(Statement, ASSUMED)))
