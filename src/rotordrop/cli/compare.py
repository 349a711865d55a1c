"""Compare drops: which was worst, and how sure that is.

Reads what 'rotordrop estimate --json' wrote, one file per drop or one of several drops.
"""

from __future__ import annotations

import json as json_module
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import DataOption, JsonOption, ReportOption, quantity, refuse_beside
from rotordrop.cli._output import deliver, require_places
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.estimate.changed import Changes
    from rotordrop.report.compared_drop import ComparedDrop


def compare(
    estimates: Annotated[
        list[Path], typer.Argument(metavar="ESTIMATE...", help="Estimates (.json) of one or more drops each.")
    ],
    scatter: Annotated[
        float | None,
        typer.Option(
            "--scatter",
            parser=quantity("force"),
            metavar="FORCE",
            help='Scatter of the peak force between equal drops (1 s.d.), "400 N", to judge speeds.',
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="LIMIT", help='Limit to judge by, "peak_stress=2.5 GPa"; repeat it.'),
    ] = None,
    allowed: Annotated[int | None, typer.Option(metavar="N", help="Drops that somebody allows.")] = None,
    changed: Annotated[
        bool,
        typer.Option(
            "--changes",
            help="Say what changed on the machine between two estimates of it, the earlier one first.",
        ),
    ] = False,
    report: ReportOption = None,
    data: DataOption = None,
    json: JsonOption = None,
) -> None:
    """Compare several drops: which was worst, and how sure that is; or what changed between two."""
    if changed:
        others = {
            "--scatter": scatter,
            "--limit": limit,
            "--allowed": allowed,
            "--report": report,
            "--data": data,
        }
        refuse_beside("--changes", others)
        _say_changes(estimates, json)
        return
    from rotordrop.report.compare_page import compare_page
    from rotordrop.report.limits import limit_statement, read_limits
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary

    require_places(json, report)
    documents = _documents(estimates)
    drops = _compared(documents)
    if len(drops) < 2:
        raise UsageError(
            f"{len(drops)} drop to compare; at least two are needed. "
            "Give several estimates, or one of several drops."
        )
    machines = {str(document.get("machine", "")) for document in documents.values()}
    drop_scatter = None if scatter is None else {"peak_force_N": scatter}
    limits = read_limits(limit or ())
    page = compare_page(
        drops,
        machine_name=", ".join(sorted(machines - {""})),
        drop_scatter=drop_scatter,
        limits=limits,
        allowed=allowed,
    )
    if report is not None:
        write_page(page, report)
    if data is not None:
        from rotordrop.report.csv_files import write_data

        write_data(page, data)

    def summarise(out: Console) -> None:
        print_summary(page, out)
        if report is not None:
            out.print(f"Report: {report}")

    verdict = limit_statement(drops, limits, allowed).text
    deliver(_ranked(drops, drop_scatter) | {"verdict": verdict}, json, summarise)


def _documents(paths: list[Path]) -> dict[str, dict[str, Any]]:
    """Every drop of every file, by name; the same name in two files gets the file's name before it."""
    found: dict[str, dict[str, Any]] = {}
    for path in paths:
        content = read_estimate(path)
        drops = content.get("drops", {path.stem: content})
        for name, drop in drops.items():
            found[name if name not in found else f"{path.stem}: {name}"] = drop
    return found


def read_estimate(path: Path) -> dict[str, Any]:
    """Content of a file that the estimate command wrote, of one drop or several."""
    try:
        content = json_module.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(
            f"{path} cannot be read ({error.strerror}); give a file of 'rotordrop estimate --json'."
        ) from error
    except ValueError as error:
        raise UsageError(
            f"{path} is not JSON ({error}); give a file written by 'rotordrop estimate --json'."
        ) from error
    if not isinstance(content, dict):
        raise UsageError(f"{path} holds a {type(content).__name__}; expected the object of an estimate.")
    return content


def _compared(documents: Mapping[str, dict[str, Any]]) -> list[ComparedDrop]:
    from rotordrop.report.compared_drop import ComparedDrop

    return [
        ComparedDrop.of_document(name, document, simulated=bool(document.get("simulated_record", False)))
        for name, document in documents.items()
    ]


def _ranked(drops: list[ComparedDrop], scatter: Mapping[str, float] | None) -> dict[str, Any]:
    from rotordrop.report.compare_page import rankings
    from rotordrop.report.compared_drop import left_out

    tree: dict[str, Any] = {}
    for (bearing, key), ranking in rankings(drops, list(drops[0].numbers), scatter or {}).items():
        condition = ranking.worst_condition
        tree.setdefault(bearing, {})[key] = {
            "worst_first": list(ranking.names),
            "values": list(ranking.values),
            "probability_worst_drop": list(ranking.worst_drop),
            "probability_worse_than_next": list(ranking.worse_than_next),
            "probability_worst_condition": None if condition is None else list(condition),
            "statement": ranking.statement,
        }
    return {"left_out": left_out(drops), "bearings": tree}


def _say_changes(estimates: list[Path], json: Path | None) -> None:
    from dataclasses import asdict

    from rotordrop.estimate.changed import changes
    from rotordrop.report.repeat_page import finite

    if len(estimates) != 2:
        raise UsageError(f"--changes compares two estimates, and {len(estimates)} are given; name two files.")
    require_places(json)
    found = changes(*(read_estimate(path) for path in estimates))
    content = {**asdict(found), "sentence": found.sentence()}
    deliver(finite(content), json, lambda out: _changes_table(out, found))


def _changes_table(out: Console, found: Changes) -> None:
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
