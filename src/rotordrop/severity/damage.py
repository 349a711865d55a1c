"""What a drop costs the touchdown bearing, as information: rolling exposure and distance to the limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import trapezoid

from rotordrop.errors import UsageError

STATIC_LIMIT = 4.2e9
"""Contact stress [Pa] at which a ball dents the race by 1e-4 of its diameter (ISO 76, ball bearings)."""

LIFE_EXPONENT = 3.0
"""Exponent of load in the life of a ball bearing [1] (ISO 281)."""


@dataclass(frozen=True, kw_only=True)
class BearingExposure:
    """What one touchdown bearing went through in a drop; for comparison, not a life.

    Attributes
    ----------
    equivalent_load : float
        Constant load that would tire the bearing as much over the same turns [N].
    turns : float
        Turns of the race [1].
    exposure : float
        Load cubed times turns [N³]: adds up over drops of the same bearing.
    exponent : float
        [1].
    maximum_stress : float
        [Pa].
    static_ratio : float
        Maximum stress over 4200 MPa [1].
    static_load_ratio : float
        The same in terms of load, which grows with the cube of the stress [1].
    statement : str
    """

    equivalent_load: float
    turns: float
    exposure: float
    exponent: float
    maximum_stress: float
    static_ratio: float
    static_load_ratio: float
    statement: str

    def as_json(self) -> dict[str, Any]:
        """All numbers (SI) and the statement, ready for JSON."""
        return dict(self.__dict__)


def bearing_exposure(
    time: ArrayLike,
    force: ArrayLike,
    race_speed: ArrayLike,
    stress: ArrayLike,
    *,
    exponent: float = LIFE_EXPONENT,
) -> BearingExposure:
    """Sum up what a touchdown bearing went through.

    Parameters
    ----------
    time : shape (T,)
        [s], rising.
    force : shape (T,)
        Force on the bearing [N].
    race_speed : shape (T,)
        Speed of the inner race [rad/s].
    stress : shape (T,)
        Largest contact stress at the inner race [Pa].
    exponent : float
        Exponent of load [1].

    Returns
    -------
    BearingExposure

    Notes
    -----
    Source: ISO 281 (exponent 3 for balls), ISO 76 (4200 MPa). Not validated: ISO 281 life needs thousands of
    turns under lubrication; a drop is some hundred turns with impacts, so only drops of one bearing can be
    compared.
    """
    t, load, speed, sigma = (np.asarray(a, dtype=np.float64) for a in (time, force, race_speed, stress))
    if not t.shape == load.shape == speed.shape == sigma.shape or t.ndim != 1 or t.size < 2:
        raise UsageError(
            f"bearing exposure: time {t.shape}, force {load.shape}, race speed {speed.shape} and stress "
            f"{sigma.shape}; expected four equal (T,) with at least two values"
        )
    rate = np.abs(speed) / (2.0 * math.pi)
    turns = float(trapezoid(rate, t))
    exposure = float(trapezoid(np.abs(load) ** exponent * rate, t))
    largest = float(sigma.max())
    ratio = largest / STATIC_LIMIT
    return BearingExposure(
        equivalent_load=(exposure / turns) ** (1.0 / exponent) if turns > 0.0 else 0.0,
        turns=turns,
        exposure=exposure,
        exponent=exponent,
        maximum_stress=largest,
        static_ratio=ratio,
        static_load_ratio=ratio**3,
        statement=_static_statement(largest, ratio),
    )


def _static_statement(stress: float, ratio: float) -> str:
    text = (
        f"largest contact stress {stress / 1e6:.0f} MPa, {ratio:.0%} of the static limit of 4200 MPa (ISO 76)"
    )
    if ratio < 1.0:
        return text
    return f"{text}: the race is dented by more than 1e-4 of the ball diameter; inspect the bearing"
