"""One line that judges drops against limits which somebody gives; without any it says so."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rotordrop.errors import UsageError, unknown_key
from rotordrop.known import NINETY
from rotordrop.report.compared_drop import ComparedDrop
from rotordrop.report.content import Level, Statement
from rotordrop.report.quantity import Quantity, shown
from rotordrop.severity.numbers import NUMBERS, Number
from rotordrop.units import format_chance, parse_quantity, percent

SURE = 0.95
"""Probability from which a limit counts as kept, or as passed [1]; chosen, not measured."""
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
    known = {_short(number.field): number for number in NUMBERS}
    found = {}
    for text in written:
        name, equals, limit = (part.strip() for part in text.partition("="))
        if not equals:
            raise UsageError(f'limit {text!r}; expected a number and its limit, "peak_stress=2.5 GPa"')
        if name not in known:
            raise UsageError(f"limit: {unknown_key(name, tuple(known))}")
        found[known[name].field] = parse_quantity(limit, known[name].kind)
    return found


def limit_statement(
    drops: Sequence[ComparedDrop], limits: Mapping[str, float], allowed: int | None = None
) -> Statement:
    """The verdict: which limits are kept, passed or open, by the intervals of the drops."""
    if not limits and allowed is None:
        return Statement("No limit given: the numbers are compared with each other alone.")
    parts: list[str] = []
    found: list[bool | None] = []
    if allowed is not None:
        parts.append(f"{len(drops)} of {allowed} drops allowed")
        found.append(len(drops) <= allowed)
    known = {number.field: number for number in NUMBERS}
    for field, limit in limits.items():
        text, kept = _against(drops, known[field], limit)
        parts.append(text)
        found.append(kept)
    level: Level = "bad" if False in found else "warning" if None in found else "good"
    return Statement(f"By the limits given: {'; '.join(parts)}.", level)


def _against(drops: Sequence[ComparedDrop], number: Number, limit: float) -> tuple[str, bool | None]:
    """What to say of one limit, and whether it is kept; None while that is open."""
    words = f"{number.label} {shown(limit, number.kind)}"
    beyond = [
        (probability, f"{one.name} at {bearing}")
        for one in drops
        for bearing in one.drop.bearings
        if (probability := _beyond(one.number(bearing, number), limit, number)) is not None
    ]
    if not beyond:
        return f"{words}: no drop states it with an interval", None
    over = [f"{who} ({format_chance(p)})" for p, who in beyond if p >= SURE]
    if over:
        return f"{words}: passed by {', '.join(over)}", False
    worst, who = max(beyond)
    if worst > 1.0 - SURE:
        return f"{words}: open, passed by {who} with a probability of {format_chance(worst)}", None
    return f"{words}: kept by all drops (passed by {who} with {percent(worst, 1)} at most)", True


def _beyond(quantity: Quantity, limit: float, number: Number) -> float | None:
    """Probability that a number lies beyond its limit, by its interval [1]; None without one."""
    if quantity.interval_90 is None or not math.isfinite(quantity.value):
        return None
    low, high = quantity.interval_90
    sigma = max((high - low) / (2.0 * NINETY), 1e-12 * max(abs(quantity.value), 1e-300))
    above = 0.5 * math.erfc((limit - quantity.value) / (math.sqrt(2.0) * sigma))  # scipy takes longer to load
    return above if number.more_is_worse else 1.0 - above
