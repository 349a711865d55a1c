"""Compare drops: which was worst, and how sure that is; or what changed between two of them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured, refuse_beside
from rotordrop.cli._output import deliver
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.estimate.changed import Changes


def compare(
    estimates: Annotated[
        list[Path], Argument(metavar="ESTIMATE...", help="Estimates (.json) of one or more drops each.")
    ],
    scatter: Annotated[
        float | None,
        measured(
            "force", 'Scatter of the peak force between equal drops (1 s.d.), "400 N", to judge speeds.'
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        Option(metavar="LIMIT", help='Limit to judge by, "peak_stress=2.5 GPa"; repeat it.'),
    ] = None,
    allowed: Annotated[int | None, Option(metavar="N", help="Drops that somebody allows.")] = None,
    changed: Annotated[
        bool,
        Option(
            "--changes",
            help="Say what changed on the machine between two estimates of it, the earlier one first.",
        ),
    ] = False,
    report: options.Report = None,
    data: options.Data = None,
    json: options.Json = None,
) -> None:
    """Compare several drops: which was worst, and how sure that is; or what changed between two.

    Example: rotordrop compare drop1.json drop2.json
    """
    if changed:
        others = {
            "--scatter": scatter,
            "--limit": limit,
            "--allowed": allowed,
            "--report": report,
            "--data": data,
        }
        refuse_beside("--changes", others)
        _deliver_changes(estimates, json)
        return
    from rotordrop.estimate.published import read_drops
    from rotordrop.report.compare_page import compare_page, rankings
    from rotordrop.report.compared_drop import ComparedDrop, left_out
    from rotordrop.report.limits import limit_statement, read_limits

    drops: list[ComparedDrop] = []
    for path in estimates:
        for name, drop in read_drops(path).items():
            taken = any(name == other.name for other in drops)
            alike = sum(other.stem == path.stem for other in estimates) > 1
            called = f"{path.resolve().parent.name}/{path.stem}" if alike else path.stem
            drops.append(ComparedDrop(f"{called}: {name}" if taken or alike else name, drop))
    if len(drops) < 2:
        raise UsageError(
            f"{len(drops)} drop to compare; at least two are needed. "
            "Give several estimates, or one of several drops."
        )
    drop_scatter = None if scatter is None else {"peak_force_N": scatter}
    limits = read_limits(limit or ())
    page = compare_page(
        drops,
        machine_name=", ".join(sorted({one.drop.machine for one in drops})),
        drop_scatter=drop_scatter,
        limits=limits,
        allowed=allowed,
    )
    ranked: dict[str, Any] = {}
    for (bearing, key), ranking in rankings(drops, list(drops[0].drop.bearings), drop_scatter or {}).items():
        condition = ranking.worst_condition
        ranked.setdefault(bearing, {})[key] = {
            "worst_first": list(ranking.names),
            "values": list(ranking.values),
            "probability_worst_drop": list(ranking.worst_drop),
            "probability_worse_than_next": list(ranking.worse_than_next),
            "probability_worst_condition": None if condition is None else list(condition),
            "statement": ranking.statement,
        }
    verdict = limit_statement(drops, limits, allowed).text
    numbers = {"left_out": left_out(drops), "bearings": ranked, "verdict": verdict}
    deliver(numbers, json, page, report=report, data=data)


def _deliver_changes(estimates: list[Path], json: Path | None) -> None:
    from rotordrop.estimate.changed import changes
    from rotordrop.estimate.published import read_drop
    from rotordrop.report.spread import finite

    if len(estimates) != 2:
        raise UsageError(f"--changes compares two estimates, and {len(estimates)} are given; name two files.")
    before, after = (read_drop(path) for path in estimates)
    if before.record_sha256 and before.record_sha256 == after.record_sha256:
        raise UsageError(
            f"{estimates[0]} and {estimates[1]} are of one recording, so nothing changed; name the "
            "estimate of another drop"
        )
    found = changes(before, after)
    content = asdict(found) | {"sentence": found.sentence()}
    deliver(finite(content), json, lambda out: _print_changes(found, out))


def _print_changes(found: Changes, out: Console) -> None:
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
