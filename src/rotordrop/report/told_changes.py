"""What changed on a machine between two estimated drops, in words and as a table.

Apart from the comparison of drops, which loads no table of the elements.
"""

from __future__ import annotations

from rotordrop.elements.table import row_of
from rotordrop.estimate.changed import Change, Changes, asked_for
from rotordrop.report.content import Column, ReportContent, Statement, table
from rotordrop.report.quantity import Quantity, written
from rotordrop.units import format_chance

CHANGES_NOTE = (
    f"{asked_for()}, with the probability of at least that; found from: what shows in 19 of 20 cases."
)


def changes_page(found: Changes) -> ReportContent:
    """What changed in a sentence, and every parameter as it was, with its change by both records."""
    columns = (
        Column("parameter", lambda one: spoken_path(one.path)),
        Column("before", lambda one: Quantity.of(one.before, row_of(one.path).display_kind)),
        Column("change (90 %)", _change),
        Column("that much", lambda one: format_chance(one.probability)),
        Column("found from", lambda one: one.smallest_text.replace("of any size", "–")),
    )
    statement = Statement(found.sentence(spoken_path), "warning" if found.named else "good")
    told = [one for one in found.found if one.determined]  # the sentence names the others
    return ReportContent(
        title=f"{found.second} against {found.first}",
        verdict=(statement, Statement(CHANGES_NOTE)),
        summary=(table(told, columns, note=CHANGES_NOTE),),
    )


def spoken_path(path: str) -> str:
    """Name of a parameter for people: what it belongs to, and what it is."""
    return f"{path.partition('.')[0]}: {row_of(path).label}"


def _change(one: Change) -> str:
    low, high = one.interval_90
    if one.factor:
        return f"× {one.change:.3g} ({low:.3g} to {high:.3g})"
    return "{} µm ({} to {} µm)".format(*(written(1e6 * end, 1) for end in (one.change, low, high)))
