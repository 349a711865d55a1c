"""Compare drops: which was worst, and how sure that is; or what changed between two of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured, refuse_beside
from rotordrop.cli._output import deliver
from rotordrop.errors import UsageError


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
    changed: Annotated[
        bool,
        Option(
            "--changes",
            help="Say what changed on the machine between two estimates of it, the earlier one first.",
        ),
    ] = False,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Compare several drops: which was worst, and how sure that is; or what changed between two.

    Example: rotordrop compare drop1.json drop2.json
    """
    if changed:
        refuse_beside("--changes", {"--scatter": scatter, "--limit": limit, "--report": report})
        _deliver_changes(estimates, json)
        return
    from rotordrop.estimate.published import read_drops
    from rotordrop.report.compare_page import (
        ComparedDrop,
        compare_page,
        left_out,
        limit_statement,
        rankings,
    )
    from rotordrop.severity.numbers import read_limits

    found = [(path, name, drop) for path in estimates for name, drop in read_drops(path).items()]
    records = Counter(drop.record for *_, drop in found)
    stems = Counter(path.stem for path in estimates)
    drops: list[ComparedDrop] = []
    for path, name, drop in found:
        place = path.stem if stems[path.stem] == 1 else f"{path.resolve().parent.name}/{path.stem}"
        of_place = place if name == path.stem else f"{place}: {name}"
        drops.append(ComparedDrop(drop.record if records[drop.record] == 1 else of_place, drop))
    drop_scatter = None if scatter is None else {"peak_force_N": scatter}
    limits = read_limits(limit or ())
    page = compare_page(drops, drop_scatter=drop_scatter, limits=limits)
    ranked: dict[str, Any] = {}
    for (bearing, key), ranking in rankings(drops, list(drops[0].drop.bearings), drop_scatter or {}).items():
        ranked.setdefault(bearing, {})[key] = ranking.as_json()
    verdict = limit_statement(drops, limits).text
    numbers = {"left_out": left_out(drops), "bearings": ranked, "verdict": verdict}
    deliver(numbers, json, page, report=report)


def _deliver_changes(estimates: list[Path], json: Path | None) -> None:
    from rotordrop.estimate.changed import changes
    from rotordrop.estimate.published import read_drop
    from rotordrop.files import finite
    from rotordrop.report.told_changes import changes_page

    if len(estimates) != 2:
        raise UsageError(f"--changes compares two estimates, and {len(estimates)} are given; name two files.")
    before, after = (read_drop(path) for path in estimates)
    if before.record_sha256 and before.record_sha256 == after.record_sha256:
        raise UsageError(
            f"{estimates[0]} and {estimates[1]} are of one recording, so nothing changed; name the "
            "estimate of another drop"
        )
    found = changes(before, after)
    deliver(finite(asdict(found) | {"sentence": found.sentence()}), json, changes_page(found))
