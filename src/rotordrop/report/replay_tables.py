"""Tables of the paper's route: first contact (Table 3), supports (Table 4), what is confounded."""

from __future__ import annotations

from collections.abc import Mapping

from rotordrop.estimated import IdentifiedValue
from rotordrop.identification.first_contact import FirstContact
from rotordrop.model.parameter_table import row_of
from rotordrop.report.content import Table
from rotordrop.report.parameters import ParameterRow, parameter_table
from rotordrop.report.quantity import Quantity

CONFOUNDED = 0.9
"""Correlation from which two parameters count as confounded [1]."""


def first_contact_table(contacts: Mapping[str, FirstContact]) -> Table:
    """State first contact and equivalent stiffness of every bearing (Neisi 2020, Table 3)."""
    rows = tuple(
        (
            name,
            Quantity(value=contact.start, kind="time", digits=4),
            Quantity(value=contact.end, kind="time", digits=4),
            Quantity(value=contact.duration, kind="time", digits=3),
            Quantity(value=contact.indentation, kind="length", digits=3),
            Quantity(value=contact.mass, kind="mass"),
            Quantity(
                value=contact.equivalent_stiffness,
                kind="stiffness",
                standard_error=contact.standard_error,
                digits=3,
            ),
            Quantity(value=contact.corrected_stiffness, kind="stiffness", digits=3),
        )
        for name, contact in contacts.items()
    )
    return Table(
        columns=(
            "bearing",
            "t₁",
            "t₂",
            "T",
            "beyond the gap",
            "mass",
            "stiffness, eq. (17)",
            "gravity-corrected",
        ),
        rows=rows,
        caption="First contact (Neisi 2020, Table 3)",
        note=f"{_timing(contacts)}Eq. (17) takes the contact for half a period; gravity lengthens it, and "
        "one contact can be two. Both stiffnesses serve as a start of the search only.",
    )


def _timing(contacts: Mapping[str, FirstContact]) -> str:
    """Standard error of the contact times, the largest of all bearings."""
    if not contacts:
        return ""
    error = Quantity(value=max(contact.timing_error for contact in contacts.values()), kind="time", digits=2)
    return f"Standard error of t₁ and t₂: {error.text} or less. "


def support_table(values: Mapping[str, IdentifiedValue]) -> Table:
    """State the supports with start, interval and verdict (Neisi 2020, Table 4)."""
    rows = []
    for path, value in values.items():
        kind = row_of(path).display_kind
        rows.append(
            ParameterRow(
                name=path,
                prior=Quantity.of(value.start, kind),
                estimate=Quantity.of(value, kind),
                verdict=value.status,
            )
        )
    return parameter_table(rows, caption="Supports (Neisi 2020, Table 4)")


def correlation_table(correlations: Mapping[str, float]) -> Table:
    """Say which parameters the record cannot tell apart."""
    rows = tuple(
        (
            pair,
            Quantity(value=value, kind="dimensionless", digits=2),
            "confounded: only their combination is known" if abs(value) >= CONFOUNDED else "told apart",
        )
        for pair, value in sorted(correlations.items(), key=lambda item: -abs(item[1]))
    )
    return Table(columns=("parameters", "correlation", "meaning"), rows=rows, caption="Correlations")
