"""How far a replay follows its record: distances in windows, contact times, bounces, horizon."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rotordrop.estimation.agreement import Agreement
from rotordrop.report.content import Cell, Table
from rotordrop.report.quantity import Quantity


def window_table(agreement: Agreement, bearings: Sequence[str]) -> Table:
    """State the distance of the orbits by window, the bounce heights and the horizon of every bearing."""
    rows: list[tuple[Cell, ...]] = [
        (
            f"distance of the orbits, {window.name}",
            *(Quantity(value=float(value), kind="length", digits=3) for value in window.rms),
        )
        for window in agreement.windows
    ]
    for label, field in (
        ("first bounce, measured", "measured_bounce"),
        ("first bounce, simulated", "simulated_bounce"),
    ):
        rows.append(
            (label, *(Quantity(value=getattr(b, field), kind="length", digits=3) for b in agreement.bearings))
        )
    rows.append(
        ("comparable up to", *(Quantity(value=b.horizon, kind="time", digits=3) for b in agreement.bearings))
    )
    return Table(
        columns=("agreement", *bearings),
        rows=tuple(rows),
        caption="Agreement in windows",
        note="Distances are root mean square; a bounce counts from the rest position; comparable means "
        "closer than a tenth of the air gap.",
    )


def contact_time_table(agreement: Agreement, bearings: Sequence[str]) -> Table:
    """Set begin and end of the first contacts side by side, measured and simulated."""
    rows: list[tuple[Cell, ...]] = []
    for name, bearing in zip(bearings, agreement.bearings, strict=True):
        seen, made = bearing.measured_contacts, bearing.simulated_contacts
        for k in range(max(len(seen), len(made))):
            cells = [
                Quantity(value=float(times[k][i]) if k < len(times) else math.nan, kind="time", digits=4)
                for times in (seen, made)
                for i in (0, 1)
            ]
            rows.append((f"{name}, contact {k + 1}", *cells))
    return Table(
        columns=("contact", "measured begin", "measured end", "simulated begin", "simulated end"),
        rows=tuple(rows),
        caption="Contact times",
    )
