"""What the figures draw: histories, motions in the plane, bands, air gaps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Role: TypeAlias = Literal["measured", "simulated", "simulated, lower gap", "estimated", "cross-check"]


@dataclass(frozen=True, kw_only=True)
class History:
    """A quantity against time.

    Attributes
    ----------
    label : str
        Name in the legend.
    time : ndarray, shape (T,)
        Time from power-off [s].
    values : ndarray, shape (T,)
        Values in SI units.
    role : Role
        Where the history comes from; decides colour and line.
    """

    label: str
    time: Array
    values: Array
    role: Role = "simulated"


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Movement of the rotor in the plane of one bearing.

    Attributes
    ----------
    label : str
        Name in the legend.
    time : ndarray, shape (T,)
        Time from power-off [s].
    displacement : ndarray, shape (T, 2)
        Displacement (x, y) from the bearing centre [m].
    role : Role
        Where the motion comes from; decides colour and line.
    """

    label: str
    time: Array
    displacement: Array
    role: Role = "simulated"

    @property
    def horizontal(self) -> History:
        """Displacement in x."""
        return self._history(self.displacement[:, 0])

    @property
    def vertical(self) -> History:
        """Displacement in y."""
        return self._history(self.displacement[:, 1])

    @property
    def radial(self) -> History:
        """Distance from the centre."""
        return self._history(np.hypot(self.displacement[:, 0], self.displacement[:, 1]))

    def _history(self, values: Array) -> History:
        return History(label=self.label, time=self.time, values=np.asarray(values), role=self.role)


@dataclass(frozen=True, kw_only=True)
class Band:
    """Lower and upper limit of a history, shape (T,) each, time [s] from power-off."""

    time: Array
    lower: Array
    upper: Array
    label: str = "90 % interval"


@dataclass(frozen=True, kw_only=True)
class AirGap:
    """Lower and upper limit of the air gap of one bearing [m]; equal where there is one value only."""

    lower: float
    upper: float

    @classmethod
    def of(cls, value: float) -> AirGap:
        """A gap known as one value."""
        return cls(lower=value, upper=value)


@dataclass(frozen=True, kw_only=True)
class BearingMotions:
    """All motions to be drawn for one bearing, with its air gap [m] as the limit of free movement."""

    bearing: str
    motions: tuple[Motion, ...]
    air_gap: AirGap | None = None


@dataclass(frozen=True, kw_only=True)
class BearingHistories:
    """All histories of one quantity to be drawn for one bearing, with the band of the first."""

    bearing: str
    histories: tuple[History, ...]
    band: Band | None = None


def between(history: History, start: float, end: float) -> History:
    """The part of a history from `start` to `end` [s]."""
    inside = (history.time >= start) & (history.time <= end)
    return History(
        label=history.label, time=history.time[inside], values=history.values[inside], role=history.role
    )
