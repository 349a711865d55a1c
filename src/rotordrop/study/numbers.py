"""The documents of a study and of repeats: what is asked of their drops and which varied values matter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.simulate.result import fingerprint
from rotordrop.study.plan import Study
from rotordrop.study.quantities import LIFT
from rotordrop.study.repeat import Repeat
from rotordrop.study.summary import COVER, StudyResults, cells_of

RESAMPLED = 300
"""Bootstrap samples behind an interval; chosen, not measured."""
DROPS_OF_A_CELL = 10
"""Drops that a cell must hold at least, where shares are read off any study."""
MOST_CELLS = 20
"""Cells that drops are sorted into at most; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class Influence:
    """What one varied value does to a quantity."""

    name: str
    """The varied value."""
    alone: Known
    """Known of the variance that would be gone if the value were known (first-order Sobol index)."""
    total: Known | None
    """Known that would be left if all others were known; None unless the study has the design
    ``"sensitivity"``."""


def influences(results: StudyResults, column: str) -> tuple[Influence, ...]:
    """Influence of every varied value on a quantity, the largest first.

    Drops of another design than ``"sensitivity"`` are sorted into cells by value. Intervals by bootstrap.
    Source: Sobol 1993; estimators of Saltelli and others, Computer Physics Communications 181, 2010 (alone)
    and Jansen 1999 (total); from any sample, Plischke, Borgonovo and Smith, European Journal of Operational
    Research 226, 2013, less what cells of pure chance would explain.
    """
    find = _from_blocks if results.study.design == "sensitivity" else _from_cells
    found = find(results, column)
    return tuple(sorted(found, key=lambda one: -(one.total or one.alone).value))


def _from_blocks(results: StudyResults, column: str) -> list[Influence]:
    names = list(results.study.varied)
    size = len(names) + 2
    values = results.column(column)
    blocks = values[: len(values) // size * size].reshape(-1, size)
    blocks = blocks[np.isfinite(blocks).all(axis=1)]
    if len(blocks) < 2 * DROPS_OF_A_CELL:
        raise UsageError(
            f"{len(blocks)} whole blocks of {size} drops have {column}; at least {2 * DROPS_OF_A_CELL} are "
            f"needed: compute {2 * DROPS_OF_A_CELL * size} drops or more"
        )

    def shares(chosen: Array) -> Array:
        centred = chosen - chosen[:, :2].mean()
        a, b, mixed = centred[:, 0], centred[:, 1], centred[:, 2:]
        variance = max(float(0.5 * (a.var() + b.var())), 1e-300)
        alone = np.mean(b[:, None] * (mixed - a[:, None]), axis=0) / variance
        total = 0.5 * np.mean((a[:, None] - mixed) ** 2, axis=0) / variance
        return np.concatenate([alone, total])

    known = _with_intervals(blocks, shares)
    count = len(names)
    return [Influence(name=names[j], alone=known[j], total=known[count + j]) for j in range(count)]


def _from_cells(results: StudyResults, column: str) -> list[Influence]:
    values = results.column(column)
    whole = np.isfinite(values)
    if np.count_nonzero(whole) < 5 * DROPS_OF_A_CELL:
        raise UsageError(
            f"{np.count_nonzero(whole)} drops have {column}; at least {5 * DROPS_OF_A_CELL} are needed to "
            "say what matters"
        )
    y = values[whole]
    found = []
    for name, drawn in results.varied.items():
        x = drawn[whole]
        if len(np.unique(x)) < 2:
            continue
        cells = cells_of(x, min(MOST_CELLS, len(x) // DROPS_OF_A_CELL))
        known = _with_intervals(np.column_stack([cells.astype(np.float64), y]), _explained)
        found.append(Influence(name=name, alone=known[0], total=None))
    return found


def _explained(pairs: Array) -> Array:
    """Known of the variance between cells (first column), less what chance alone would give, shape (1,)."""
    cell, y = pairs[:, 0].astype(np.int64), pairs[:, 1]
    n, cells = len(y), int(cell.max()) + 1
    count = np.bincount(cell, minlength=cells)
    mean = np.bincount(cell, weights=y, minlength=cells) / np.maximum(count, 1)
    between = float(np.sum(count * (mean - y.mean()) ** 2))
    whole = max(float(np.sum((y - y.mean()) ** 2)), 1e-300)
    share = between / whole
    return np.array([1.0 - (1.0 - share) * (n - 1) / max(n - cells, 1)])


def _with_intervals(rows: Array, shares: Callable[[Array], Array]) -> list[Known]:
    """Knowns with bootstrap intervals, centred on the estimate: a row that is drawn twice explains itself."""
    value = shares(rows)
    random = np.random.Generator(np.random.Philox(np.random.SeedSequence(len(rows))))
    again = np.array([shares(rows[random.integers(0, len(rows), len(rows))]) for _ in range(RESAMPLED)])
    tail = 0.5 * (1.0 - COVER)
    low, high = np.quantile(again - again.mean(axis=0), (tail, 1.0 - tail), axis=0) + value
    return [
        Known(value=v, status="estimated", interval_90=(a, b))
        for v, a, b in zip(value.tolist(), low.tolist(), high.tolist(), strict=True)
    ]


SHARES = (0.5, 0.9, 0.99)
"""Quantiles that are given [1]."""
MAPPED = ("peak_force", "peak_stress", "settling_time")
"""Quantities of a bearing whose quantiles are given against what varies."""
MATTERS = ("peak_force", "peak_stress")
"""Quantities of a bearing that stand beside the verdict, and whose influences are found."""
WHIRL = {"backward_whirl": 0.0}
"""A time above none [s] that counts as an event."""


def asked(results: StudyResults, limits: Mapping[str, float]) -> Iterator[tuple[list[str], float | None]]:
    """Columns that are shown against a varied value, with the limit [SI] that they may exceed."""
    bearings = [bearing.name for bearing in results.study.machine.touchdown_bearings]
    wanted: dict[str, float | None] = dict.fromkeys(MAPPED)
    for quantity, limit in (*wanted.items(), *(WHIRL | dict(limits)).items()):
        yield [f"{bearing}.{quantity}" for bearing in bearings], limit
    if results.study.looped:
        yield [LIFT], 0.5


def influences_of(results: StudyResults) -> dict[str, tuple[Influence, ...]]:
    """How much every varied value matters to every quantity; nothing where there are too few drops."""
    names = [bearing.name for bearing in results.study.machine.touchdown_bearings]
    columns = [f"{name}.{quantity}" for name in names for quantity in MATTERS]
    try:
        return {column: influences(results, column) for column in columns}
    except UsageError:
        return {}


def study_numbers(
    results: StudyResults, by: Sequence[str] = (), limits: Mapping[str, float] | None = None
) -> dict[str, Any]:
    """Numbers of a study [SI], against what varies ``by``, with chances to exceed limits; open ends null."""

    def mapped(name: str, column: str, limit: float | None) -> list[dict[str, Any]]:
        return [
            {
                "from": cell["from"],
                "to": cell["to"],
                **({"quantile": share} if limit is None else {}),
                **(ends(cell["known"]) or {}),
            }
            for share in (SHARES if limit is None else SHARES[:1])
            for cell in results.map(column, name, share=share, above=limit)
        ]

    wanted = {
        column if limit is None else f"{column} > {limit:g}": (column, limit)
        for columns, limit in asked(results, limits or {})
        for column in columns
    }
    return study_numbers_of(results.study) | {
        "drops": len(results),
        "failed": dict(results.failed),
        "quantiles": {
            q.name: {
                "unit": q.unit,
                "meaning": q.meaning,
                **{f"{share:g}": ends(results.quantile(q.name, share)) for share in (0.05, *SHARES)},
            }
            for q in results.columns
        },
        "maps": {name: {key: mapped(name, *one) for key, one in wanted.items()} for name in by},
        "influences": {
            column: [{"name": one.name, "alone": ends(one.alone), "total": ends(one.total)} for one in every]
            for column, every in influences_of(results).items()
        },
    }


def repeat_numbers(results: StudyResults, found: Sequence[Repeat]) -> dict[str, Any]:
    """Numbers of a virtual repeat [SI]; an open end of an interval is null."""

    def quantity(one: Repeat) -> dict[str, Any]:
        known = {name: ends(getattr(one, name)) for name in ("median", "low", "high", "worst", "place")}
        recorded = one.recorded and {"value": one.recorded.value, "interval": one.recorded.interval_90}
        return stated(one, "column median low high worst of recorded place", recorded=recorded, **known)

    made = study_numbers_of(results.study)
    del made["digest"]
    return made | {
        "drops": len(results),
        "failed": dict(results.failed),
        "quantities": [quantity(one) for one in found],
    }


def ends(known: Known | None) -> dict[str, Any] | None:
    """A number with its interval, ready for JSON."""
    if known is None:
        return None
    return stated(known, "value interval_90 drops", interval_90=[*(known.interval_90 or (None, None))])


def study_numbers_of(study: Study) -> dict[str, Any]:
    """What makes the same drops again, ready for JSON."""
    return {
        "study": study.document(),
        "machine": study.machine.name,
        "digest": study.digest,
        "rotordrop": __version__,
        "fingerprint": fingerprint(),
    }
