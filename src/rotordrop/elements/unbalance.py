"""Unbalance: by amount and phase, or by balance grade."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from rotordrop.elements.description import Description, Placed, Usual
from rotordrop.elements.parameter import Entry, Extension, Parameter, Values, derived, guess, in_words
from rotordrop.elements.values import Angle, Positive, PositiveSpeed
from rotordrop.elements.values import Unbalance as UnbalanceAmount
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.units import parse_quantity


class Unbalance(Placed):
    """An unbalance at a node."""

    amount: UnbalanceAmount
    """Mass times radius [kg m]."""
    phase: Angle
    """Angle from +y, positive with the spin [rad], when the rotor angle is zero."""
    beyond_described: Positive | None = None
    """Factor by which the amount stands above what was described, where a record asked for more [1]."""


class BalanceGrade(Description):
    """Balance quality after ISO 21940-11 (formerly ISO 1940): the permissible unbalance, of unknown phase."""

    grade_mm_s: float = Field(gt=0.0)
    """The grade G: permissible speed of the centre of gravity [mm/s]."""
    at_speed: PositiveSpeed
    """Speed for which the grade holds [rad/s]."""
    permissible: UnbalanceAmount | None = None
    """Permissible unbalance of the whole rotor [kg m], where it is given beside the grade."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "at_speed": Usual(least=1.0, most=2e4, look="check the unit"),
    }

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Read ``grade = "G 2.5"``."""
        if "grade" in raw:
            raw = {**raw, "grade_mm_s": _grade(raw["grade"])}
            del raw["grade"]
        return raw

    @classmethod
    def known_keys(cls) -> tuple[str, ...]:
        """Keys to suggest for a mistyped one."""
        return ("grade", "at_speed", "permissible")

    def permissible_unbalance(self, mass: float) -> float:
        """Permissible unbalance of a rotor of this mass [kg m]."""
        if self.permissible is not None:
            return self.permissible.value
        return 1e-3 * self.grade_mm_s * mass / self.at_speed.value


def _grade(raw: Any) -> float:
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        return float(raw)
    if not isinstance(raw, str):
        raise UsageError(f'grade = {raw!r} is not a balance grade; write grade = "G 2.5"')
    text = raw.strip().removeprefix("G").strip()
    return 1e3 * parse_quantity(text if text.endswith("/s") else f"{text} mm/s", "velocity")


def from_grade(
    grade: BalanceGrade, mass: float, centre_of_gravity: float, planes: tuple[tuple[int, float], ...]
) -> tuple[Unbalance, ...]:
    """Share the permissible unbalance of a rotor [kg, m from node 1] among planes (node, position [m]), NDE
    first.

    ISO 21940-11 gives each of two bearing planes the share of the weight it carries. The phase is not known
    to a balance grade: zero stands for it, with the whole turn as its range.
    """
    total = grade.permissible_unbalance(mass)
    shares = _shares(centre_of_gravity, [position for _, position in planes])
    why = f"grade G {grade.grade_mm_s:g} allows {total * 1e6:.4g} g mm in all; shared by weight"
    return tuple(
        Unbalance(
            node=node,
            amount=Known(value=share * total, status="inferred", range=(0.0, total), source=why),
            phase=Known(
                value=0.0,
                status="inferred",
                range=(-math.pi, math.pi),
                source="unknown: a balance grade says nothing of the phase",
            ),
        )
        for (node, _), share in zip(planes, shares, strict=True)
    )


def _shares(centre: float, positions: list[float]) -> list[float]:
    """Weight shares of the outermost two planes; a centre of gravity outside them loads the nearest only."""
    if len(positions) == 1:
        return [1.0]
    first, last = positions[0], positions[-1]
    far = min(1.0, max(0.0, (centre - first) / (last - first)))
    return [1.0 - far, *[0.0] * (len(positions) - 2), far]


PARAMETERS: tuple[Parameter, ...] = (
    *(
        Parameter(
            path=part,
            owner="unbalance",
            label=f"unbalance, {part} part",
            kind="unbalance",
            logarithmic=False,
            guess_sigma=1.0,
            given_sigma=0.0,
            scale="amount described",
            entries=(Entry(array="unbalance", column=column),),
        )
        for column, part in enumerate(("cosine", "sine"))
    ),
)
"""Unknowns of an unbalance, in every drop anew."""

BEYOND_GRADE = 3.0
"""Factor on the unbalance that the grade permits [1]."""


def _neutral(unbalance: Unbalance) -> dict[str, Known]:
    amount = guess(BEYOND_GRADE * float(unbalance.amount))
    return {"amount": amount, "beyond_described": guess(BEYOND_GRADE)}


def _amount(unbalance: Unbalance, found: Values, _load: float) -> str:
    amount = derived(math.hypot, found["cosine"], found["sine"], least=0.0)
    return f"{in_words(amount, 'g mm', 1e-6)} at node {unbalance.node}"


EXTENSIONS: tuple[Extension, ...] = (
    Extension(
        name="unbalance beyond its grade",
        owner="unbalance",
        names=("beyond_described",),
        neutral=_neutral,
        sentence=_amount,
        joined=", ",
        frame="an unbalance beyond the described one: {}",
    ),
)
