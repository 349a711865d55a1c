"""How far a simulated drop follows the record: windows, contacts, bounces, sweep of the friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.known import Known

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class WindowAgreement:
    """Agreement over one window; B bearings."""

    name: str
    """The window in words."""
    start: float
    """From power-off [s]."""
    end: float
    """From power-off [s]."""
    rms: Array
    """Root mean square distance of the orbits, shape (B,) [m]."""


@dataclass(frozen=True, kw_only=True)
class BearingAgreement:
    """Contacts and bounces of one bearing; K contacts."""

    measured_contacts: Array
    """Begin and end of the first contacts, shape (K, 2) [s from power-off]."""
    simulated_contacts: Array
    """The same in the simulated drop."""
    measured_bounce: float
    """Height of the first bounce above the rest position [m]; NaN where none is seen."""
    simulated_bounce: float
    """The same in the simulated drop [m]."""
    horizon: float
    """Time up to which the orbits differ by less than a tenth of the air gap [s from power-off]."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Agreement of a simulated drop with the record."""

    windows: tuple[WindowAgreement, ...]
    """First contact, 20, 50 and 200 ms."""
    bearings: tuple[BearingAgreement, ...]
    """Contacts, bounces, horizon of every bearing."""
    disagreement: float
    """Weighted distance of the orbits, the number that the friction sweep minimises [m]."""
    expected_horizon: float | None = None
    """Time up to which draws of all uncertain values stay within a tenth of the air gap of each other [s]:
    beyond it a point-by-point comparison means nothing even with a right model."""

    @property
    def horizon(self) -> Array:
        """Time up to which the orbits differ by less than a tenth of the air gap [s], shape (B,)."""
        return np.array([bearing.horizon for bearing in self.bearings])


@dataclass(frozen=True, kw_only=True)
class FrictionSweep:
    """Agreement of the orbits over friction coefficients; K coefficients, D draws."""

    coefficients: Array
    """Dynamic coefficients, shape (K,) [1]."""
    disagreement: Array
    """Weighted distance of simulated and measured orbit, shape (K,) [m rms]."""
    best: Array
    """Best coefficient with the best parameters, then with each draw of them, shape (D + 1,) [1]."""
    value: Known
    """The dynamic coefficient."""
    window: tuple[float, float]
    """Compared part of the drop [s from power-off]."""
