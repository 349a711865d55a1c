"""The independent cross-check beside the estimate: a linear input–state estimate without a contact law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rotordrop.report.content import Statement, Table
from rotordrop.report.quantity import Quantity, written


@dataclass(frozen=True, kw_only=True)
class CrossCheck:
    """One number found in two ways.

    Attributes
    ----------
    name : str
        What is compared, for example ``"NDE peak force"``.
    estimate, check : Quantity
        The number of the main estimate and of the cross-check.
    accuracy : float
        Known accuracy of the cross-check, relative [1]; a larger difference is a warning.
    """

    name: str
    estimate: Quantity
    check: Quantity
    accuracy: float

    @property
    def difference(self) -> float:
        """Relative difference of the cross-check from the estimate [1]."""
        if not self.estimate.value:
            return math.nan
        return self.check.value / self.estimate.value - 1.0

    @property
    def agrees(self) -> bool:
        """Whether the difference stays within the known accuracy."""
        return abs(self.difference) <= self.accuracy


def cross_check_table(checks: Sequence[CrossCheck]) -> Table:
    """Set estimate and cross-check side by side with their difference and the accuracy that is known."""
    return Table(
        columns=("quantity", "estimate", "cross-check", "difference", "known accuracy", "verdict"),
        rows=tuple(
            (
                check.name,
                check.estimate,
                check.check,
                Quantity(value=check.difference, kind="share", digits=2),
                f"± {100 * check.accuracy:.3g} %",
                "agrees" if check.agrees else "disagrees",
            )
            for check in checks
        ),
        caption="Independent cross-check",
        note="The cross-check knows the rotor only: no contact, friction or support parameter enters it. "
        "It takes sensor errors and air gaps from the estimate, and for the stress the preload.",
    )


def cross_check_statements(checks: Sequence[CrossCheck]) -> tuple[Statement, ...]:
    """One warning per disagreement, or one sentence that all agree."""
    warnings = tuple(
        Statement(
            text=f"{check.name}: the cross-check finds {check.check.text} against {check.estimate.text}, "
            f"a difference of {written(100 * check.difference, 0)} % where "
            f"± {100 * check.accuracy:.3g} % is known.",
            level="warning",
        )
        for check in checks
        if not check.agrees
    )
    return warnings or (
        Statement(text="The independent cross-check agrees within its known accuracy.", level="good"),
    )
