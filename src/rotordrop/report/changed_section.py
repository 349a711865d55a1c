"""What changed on the machine since an earlier drop, parameter by parameter."""

from __future__ import annotations

from rotordrop.elements.table import row_of
from rotordrop.errors import UsageError
from rotordrop.estimate.changed import Change, asked_for, changes
from rotordrop.estimate.document import published_drop
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.published import Drop
from rotordrop.report.content import Column, Section, Statement, table
from rotordrop.report.quantity import Quantity, written
from rotordrop.units import format_chance

HEADING = "Since the last drop"
NOTHING_GIVEN = "No earlier estimate of this machine was given to compare with."
NOTE = (
    f"{asked_for()}, with the probability of at least that; "
    "the last column is the change that shows in 19 of 20 cases."
)


def changed_section(estimate: Estimate, since: Drop | None) -> Section:
    """Compare a drop with an earlier estimate of the machine, as published."""
    if since is None:
        return Section(HEADING, (NOTHING_GIVEN,))
    try:
        found = changes(since, published_drop(estimate))
    except UsageError as error:
        return Section(HEADING, (f"{since.record}: {error}.",))
    columns = (
        Column("parameter", lambda one: spoken_path(one.path)),
        Column("before", lambda one: Quantity.of(one.before, row_of(one.path).display_kind)),
        Column("now", lambda one: Quantity.of(one.after, row_of(one.path).display_kind)),
        Column("change (90 % interval)", _change),
        Column("changed that much", lambda one: format_chance(one.probability) if one.determined else "–"),
        Column("found from", "found_from"),
    )
    tables = (table(found.found, columns, f"Changes since {found.first}", NOTE),) if found.found else ()
    statement = Statement(found.sentence(spoken_path), "warning" if found.named else "good")
    return Section(HEADING, statements=(statement,), tables=tables)


def spoken_path(path: str) -> str:
    """Name of a parameter for people: what it belongs to, and what it is."""
    return f"{path.partition('.')[0]}: {row_of(path).label}"


def _change(one: Change) -> str:
    if not one.determined:
        return "the records do not say"
    low, high = one.interval_90
    if one.factor:
        return f"× {one.change:.3g} ({low:.3g} to {high:.3g})"
    return "{} µm ({} to {} µm)".format(*(written(1e6 * end, 1) for end in (one.change, low, high)))
