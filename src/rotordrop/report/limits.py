"""One line that judges drops against limits which somebody gives; without any it says so."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rotordrop.elements.description import unknown_key
from rotordrop.errors import UsageError
from rotordrop.known import NINETY
from rotordrop.report.compared_drop import LESS_IS_WORSE, NUMBERS, ComparedDrop
from rotordrop.report.content import Level, Statement
from rotordrop.report.quantity import Quantity
from rotordrop.units import format_chance, parse_quantity

SURE = 0.95
"""Probability from which a limit counts as kept, or as passed [1]."""
_UNITS = ("_N_s", "_N", "_Pa", "_J")


def _short(field: str) -> str:
    """How a limit is called: the field without group and unit, ``"peak_stress"``."""
    name = field.rpartition(".")[2]
    return next((name.removesuffix(unit) for unit in _UNITS if name.endswith(unit)), name)


def read_limits(written: Sequence[str]) -> dict[str, float]:
    """Limits [SI] by field of an estimate document, of texts such as ``"peak_stress=2.5 GPa"``.

    Raises
    ------
    UsageError
        If there is no such number, or its limit has another unit.
    """
    known = {_short(field): (field, kind) for field, _, kind in NUMBERS}
    found = {}
    for text in written:
        name, equals, limit = (part.strip() for part in text.partition("="))
        if not equals:
            raise UsageError(f'limit {text!r}; expected a number and its limit, "peak_stress=2.5 GPa"')
        if name not in known:
            raise UsageError(f"limit: {unknown_key(name, tuple(known))}")
        field, kind = known[name]
        found[field] = parse_quantity(limit, kind)
    return found


def limit_statement(
    drops: Sequence[ComparedDrop], limits: Mapping[str, float], allowed: int | None = None
) -> Statement:
    """The verdict: which limits are kept, passed or open, by the intervals of the drops."""
    if not limits and allowed is None:
        return Statement(text="No limit given: the numbers are compared with each other alone.")
    parts: list[str] = []
    found: list[bool | None] = []
    if allowed is not None:
        parts.append(f"{len(drops)} of {allowed} drops allowed")
        found.append(len(drops) <= allowed)
    for field, limit in limits.items():
        text, kept = _against(drops, field, limit)
        parts.append(text)
        found.append(kept)
    level: Level = "bad" if False in found else "warning" if None in found else "good"
    return Statement(text=f"By the limits given: {'; '.join(parts)}.", level=level)


def _against(drops: Sequence[ComparedDrop], field: str, limit: float) -> tuple[str, bool | None]:
    """What to say of one limit, and whether it is kept; None while that is open."""
    name, kind = next((label, kind) for key, label, kind in NUMBERS if key == field)
    shown = f"{name} {Quantity(value=limit, kind=kind).text}"
    beyond = [
        (probability, f"{drop.name} at {bearing}")
        for drop in drops
        for bearing, numbers in drop.numbers.items()
        if (probability := _beyond(numbers.get(field), limit, less=field in LESS_IS_WORSE)) is not None
    ]
    if not beyond:
        return f"{shown}: no drop states it with an interval", None
    over = [f"{who} ({format_chance(p)})" for p, who in beyond if p >= SURE]
    if over:
        return f"{shown}: passed by {', '.join(over)}", False
    worst, who = max(beyond)
    if worst > 1.0 - SURE:
        return f"{shown}: open, passed by {who} with a probability of {format_chance(worst)}", None
    return f"{shown}: kept by all drops (passed by {who} with {worst:.1%} at most)", True


def _beyond(quantity: Quantity | None, limit: float, *, less: bool) -> float | None:
    """Probability that a number lies beyond its limit, by its interval [1]; None without one."""
    if quantity is None or quantity.interval_90 is None or not math.isfinite(quantity.value):
        return None
    low, high = quantity.interval_90
    sigma = max((high - low) / (2.0 * NINETY), 1e-12 * max(abs(quantity.value), 1e-300))
    above = 0.5 * math.erfc((limit - quantity.value) / (math.sqrt(2.0) * sigma))  # scipy takes longer to load
    return 1.0 - above if less else above
