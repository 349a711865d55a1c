"""The numbers of an estimate: headline per bearing, identified values with verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from rotordrop.estimated import IdentifiedValue
from rotordrop.report.content import Card, Cell, KeyFigure, Table
from rotordrop.report.quantity import Quantity

Values = Mapping[str, IdentifiedValue]

HEADLINE = (
    ("peak_force_N", "Peak bearing force", "force"),
    ("peak_stress_Pa", "Peak Hertz stress", "pressure"),
    ("mean_force_0p15_0p2_N", "Mean force, 150 to 200 ms", "force"),
    ("mean_stress_Pa", "Mean Hertz stress", "pressure"),
)
IDENTIFIED = (
    ("air_gap_m", "air gap", "length"),
    ("equivalent_stiffness_N_per_m", "equivalent stiffness, bearing and support", "stiffness"),
    ("support.stiffness_N_per_m", "support stiffness", "stiffness"),
    ("support.damping_N_s_per_m", "support damping", "damping"),
    ("support.mass_kg", "support mass", "mass"),
    ("friction.static", "static friction coefficient", "dimensionless"),
    ("friction.dynamic", "dynamic friction coefficient", "dimensionless"),
)
MEANS = (
    "A mean force is the mean of the magnitude; the magnitude of the mean force would be smaller where its "
    "direction changes. The mean Hertz stress covers 0 to 200 ms, or what the record has of them."
)
"""What the mean numbers of an estimate are means of."""
KIND_OF_UNIT = {
    "m": "length",
    "N/m": "stiffness",
    "kg": "mass",
    "N s/m": "damping",
    "N/m^n": "contact_stiffness",
    "s/m": "contact_damping",
    "kg m^2": "inertia",
    "m/s": "velocity",
    "s": "duration",
    "kg m": "unbalance",
    "N": "force",
    "Pa": "pressure",
    "rad": "angle",
    "rad/s": "speed",
}


def kind_of_unit(unit: str, path: str = "") -> str:
    """Kind in which a report shows a parameter by its SI unit and path; no unit counts as a pure number."""
    if path.endswith("damping_time"):
        return "short_time"
    return KIND_OF_UNIT.get(unit, "dimensionless")


def headline_card(bearing: str, values: Values, peak_times: Mapping[str, float]) -> Card:
    """Headline numbers of one bearing, peaks first, with the time of a peak where it is known.

    Parameters
    ----------
    bearing : str
        Name of the bearing.
    values : mapping
        Identified values by the field names of the estimate's JSON.
    peak_times : mapping
        Time [s] of the peaks by field name.
    """
    figures = []
    for field, label, kind in HEADLINE:
        if field not in values:
            continue
        value = Quantity.of(values[field], kind)
        note = "" if value.interval_90 or not value.status else f"no interval: {value.status}"
        if field in peak_times:
            moment = Quantity(value=peak_times[field], kind="time", digits=3).text
            note = f"at {moment}{f'; {note}' if note else ''}"
        figures.append(KeyFigure(label=label, value=value, note=note))
    return Card(title=f"{bearing} touchdown bearing", figures=tuple(figures))


def identified_table(bearings: Mapping[str, Values], *, taken_over: str = "") -> Table:
    """Identified values of every bearing side by side, each with its interval and verdict.

    Parameters
    ----------
    bearings : mapping
        Identified values of every bearing.
    taken_over : str
        File from which supports and friction were taken over; empty when they were identified.
    """
    rows: list[tuple[Cell, ...]] = []
    for field, label, kind in IDENTIFIED:
        if any(field in values for values in bearings.values()):
            cells: list[Cell] = []
            for values in bearings.values():
                value = values.get(field)
                cells += [Quantity.of(value, kind), _status(field, value, taken_over)]
            rows.append((label, *cells))
    columns = [text for bearing in bearings for text in (bearing, f"{bearing}: verdict")]
    return Table(
        columns=("identified", *columns),
        rows=tuple(rows),
        caption="Identified values",
        note=f"Below a value: its 90 % interval, or the limits the record itself sets. {MEANS}",
    )


def _status(field: str, value: IdentifiedValue | None, taken_over: str) -> str:
    if value is None:
        return "not estimated"
    if taken_over and value.status == "prior" and field.startswith(("support.", "friction.")):
        return f"taken over from {Path(taken_over).name}"
    return value.status


def half_width(value: IdentifiedValue) -> float:
    """Half width of the 90 % interval relative to the value [1]; NaN without an interval."""
    if value.interval_90 is None or not value.value:
        return math.nan
    return 0.5 * (value.interval_90[1] - value.interval_90[0]) / abs(value.value)
