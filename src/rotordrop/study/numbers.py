"""The documents of a study and of repeats: what is asked of their drops, ready for JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rotordrop._version import __version__
from rotordrop.document import stated
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study.plan import Study
from rotordrop.study.quantities import LIFT
from rotordrop.study.repeat import Repeat
from rotordrop.study.sensitivity import Influence, influences
from rotordrop.study.summary import StudyResults

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
