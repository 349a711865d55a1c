"""Say what changed on a machine between two recorded drops.

Reads two estimates that were made with one machine file.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import JsonOption
from rotordrop.cli._output import deliver, require_places

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.estimate.changed import Changes


def changed(
    first: Annotated[Path, typer.Argument(metavar="BEFORE", help="Estimate of the first drop (.json).")],
    second: Annotated[Path, typer.Argument(metavar="AFTER", help="Estimate of the later drop (.json).")],
    json: JsonOption = None,
) -> None:
    """Say what changed on a machine between two recorded drops."""
    from rotordrop.cli.compare import read_estimate
    from rotordrop.estimate.changed import changes

    require_places(json)
    found = changes(read_estimate(first), read_estimate(second))
    content = {**asdict(found), "sentence": found.sentence()}
    deliver(_finite(content), json, lambda out: _summary(out, found))


def _finite(content: dict[str, object]) -> dict[str, object]:
    from rotordrop.report.repeat_page import finite

    written: dict[str, object] = finite(content)
    return written


def _summary(out: Console, found: Changes) -> None:
    from rich.table import Table

    from rotordrop.elements.table import row_of
    from rotordrop.estimate.changed import asked_for
    from rotordrop.report.quantity import Quantity
    from rotordrop.units import format_chance

    columns = ("parameter", "before", "after", "change (90 %)", "changed that much", "found from")
    table = Table(*columns, box=None)
    for one in found.found:
        kind = row_of(one.path).display_kind
        low, high = one.interval_90
        text = "the records do not say"
        if one.determined and one.factor:
            text = f"× {one.change:.3g} ({low:.3g} to {high:.3g})"
        elif one.determined:
            text = f"{1e6 * one.change:+.3g} µm ({1e6 * low:+.3g} to {1e6 * high:+.3g})"
        before, after = (Quantity(value=value, kind=kind).text for value in (one.before, one.after))
        share = format_chance(one.probability) if one.determined else "–"
        table.add_row(one.path, before, after, text, share, one.found_from)
    out.print(table)
    out.print(found.sentence())
    out.print(
        f'{asked_for()}; "found from" is the change that these records show in 19 of 20 cases. '
        "A record that a model does not follow can show changes that are none."
    )
