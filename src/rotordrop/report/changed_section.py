"""What changed on the machine since an earlier drop, parameter by parameter."""

from __future__ import annotations

from rotordrop.elements.table import row_of
from rotordrop.errors import UsageError
from rotordrop.estimate.changed import Change, asked_for, changes
from rotordrop.estimate.document import published_drop
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.published import Drop
from rotordrop.report.content import Cell, Section, Statement, Table
from rotordrop.report.quantity import Quantity, written
from rotordrop.units import format_chance

HEADING = "Since the last drop"
NOTHING_GIVEN = "No earlier estimate of this machine was given to compare with."
NOTE = (
    f"{asked_for()}, with the probability of at least that; "
    "the last column is the change that shows in 19 of 20 cases."
)


def changed_section(estimate: Estimate, since: Drop | None) -> Section:
    """Compare a drop with an earlier one.

    Parameters
    ----------
    estimate : Estimate
        The drop.
    since : Drop, optional
        The earlier estimate, as published.
    """
    if since is None:
        return Section(heading=HEADING, text=(NOTHING_GIVEN,))
    try:
        found = changes(since, published_drop(estimate))
    except UsageError as error:
        return Section(heading=HEADING, text=(f"{since.record}: {error}.",))
    sentence = found.sentence()
    for one in found.found:
        sentence = sentence.replace(one.path, spoken_path(one.path))
    table = Table(
        columns=("parameter", "before", "now", "change (90 % interval)", "changed that much", "found from"),
        rows=tuple(_row(one) for one in found.found),
        caption=f"Changes since {found.first}",
        note=NOTE,
    )
    statement = Statement(text=sentence, level="warning" if found.named else "good")
    return Section(heading=HEADING, statements=(statement,), tables=(table,) if found.found else ())


def spoken_path(path: str) -> str:
    """Name of a parameter for people: what it belongs to, and what it is."""
    return f"{path.partition('.')[0]}: {row_of(path).label}"


def _row(one: Change) -> tuple[Cell, ...]:
    kind = row_of(one.path).display_kind
    before, after = (Quantity(value=value, kind=kind) for value in (one.before, one.after))
    if not one.determined:
        return (spoken_path(one.path), before, after, "the records do not say", "–", one.found_from)
    low, high = one.interval_90
    if one.factor:
        text = f"× {one.change:.3g} ({low:.3g} to {high:.3g})"
    else:
        ends = (written(1e6 * end, 1) for end in (one.change, low, high))
        text = "{} µm ({} to {} µm)".format(*ends)
    return (spoken_path(one.path), before, after, text, format_chance(one.probability), one.found_from)
