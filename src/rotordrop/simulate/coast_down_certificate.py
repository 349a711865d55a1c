"""How far the statistics of a coast-down move at a tighter tolerance; its histories cannot be compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.machine import Machine
from rotordrop.progress import Shown
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate.case import FIRST_WINDOW, CoastDownCase
from rotordrop.simulate.coast_down import simulate_coast_down
from rotordrop.simulate.coast_down_result import QUANTILES, CoastDownResult

TIGHTER = 0.1
_MEDIAN = QUANTILES.index(0.5)
_FORCE = 1
AGREED_FORCE, AGREED_SPEED = 0.02, 0.005


@dataclass(frozen=True, kw_only=True)
class CoastDownCertificate:
    """Differences between a coast-down and the same one with a tighter tolerance and no settled scheme."""

    tolerance: float
    tighter_tolerance: float
    """Of both runs [1]."""
    peak_change: Array
    """Relative change of the largest indentation, force and stress [1], shape (B, 3)."""
    median_force_change: float
    high_force_change: float
    """Root mean square over the seconds after 0.2 s of the relative change of the median and of the 99 %
    quantile of the bearing force [1]."""
    speed_change: float
    """Largest change of the rotor speed at the end of a window, over the initial speed [1]."""
    standstill_change: float | None
    """Change of the time of standstill [s]."""
    dissipated_change: float
    """Relative change of the energy dissipated [1]."""
    contacts: Array
    """Contacts of both runs, shape (2, B)."""

    @property
    def agrees(self) -> bool:
        """Whether the statistics moved little enough to be believed as they stand."""
        return self.high_force_change <= AGREED_FORCE and self.speed_change <= AGREED_SPEED

    def sentence(self) -> str:
        """The certificate in words."""
        text = (
            f"At a tolerance of {self.tighter_tolerance:g} instead of {self.tolerance:g}, without the "
            f"settled scheme, the largest values move by up to "
            f"{100 * float(np.max(self.peak_change)):.2g} %, the "
            f"median force of a second by {100 * self.median_force_change:.2g} % and its 99 % quantile by "
            f"{100 * self.high_force_change:.2g} % (rms), the speed by {100 * self.speed_change:.2g} % of "
            f"its start, the energy dissipated by {100 * self.dissipated_change:.2g} %"
        )
        if self.standstill_change is not None:
            text += f", standstill by {self.standstill_change:.2g} s"
        return text + "."

    def as_json(self) -> dict[str, Any]:
        """All fields, ready for JSON."""
        return stated(
            self,
            "tolerance tighter_tolerance peak_change median_force_change high_force_change speed_change "
            "standstill_change dissipated_change contacts agrees statement=sentence",
            contacts=self.contacts.astype(int),
        )


def certify_coast_down(
    machine: Machine | DropModel,
    case: CoastDownCase,
    result: CoastDownResult,
    *,
    progress: Shown = None,
) -> CoastDownCertificate:
    """Repeat a coast-down with a ten times tighter tolerance and compare the statistics.

    Parameters
    ----------
    machine : Machine or DropModel
        What was simulated.
    case : CoastDownCase
        The case of the result.
    result : CoastDownResult
        What came of it.
    progress : callable or False, optional
        As for `simulate_coast_down`.
    """
    model = machine if isinstance(machine, DropModel) else build_drop_model(machine, case.reduction)
    tighter = replace(case, tolerance=TIGHTER * case.tolerance, settled_scheme=False)
    other = simulate_coast_down(model, tighter, progress=progress)
    return compare_coast_downs(result, other)


def compare_coast_downs(result: CoastDownResult, other: CoastDownResult) -> CoastDownCertificate:
    """Compare the statistics of two coast-downs, the second being the more accurate one."""
    common = min(len(result.windows.end), len(other.windows.end))
    same = np.isclose(result.windows.end[:common], other.windows.end[:common])
    later = same & (result.windows.start[:common] >= FIRST_WINDOW - 1e-9)
    speeds = result.windows.speed[:common] - other.windows.speed[:common]
    stops = (result.standstill_time, other.standstill_time)
    return CoastDownCertificate(
        tolerance=result.tolerance,
        tighter_tolerance=other.tolerance,
        peak_change=_relative(result.peak_value, other.peak_value),
        median_force_change=_force_change(result, other, later, _MEDIAN),
        high_force_change=_force_change(result, other, later, len(QUANTILES) - 1),
        speed_change=float(np.max(np.abs(speeds[same]), initial=0.0)) / abs(result.initial_speed),
        standstill_change=None if stops[0] is None or stops[1] is None else abs(stops[0] - stops[1]),
        dissipated_change=abs(result.dissipated / other.dissipated - 1.0),
        contacts=np.array([result.contacts, other.contacts]),
    )


def _relative(value: Array, reference: Array) -> Array:
    return np.asarray(np.abs(value - reference) / np.maximum(np.abs(reference), 1e-12))


def _force_change(
    result: CoastDownResult, other: CoastDownResult, chosen: NDArray[np.bool_], level: int
) -> float:
    if not np.any(chosen):
        return 0.0
    count = len(chosen)
    one = result.windows.quantile[:count][chosen][:, :, _FORCE, level]
    two = other.windows.quantile[:count][chosen][:, :, _FORCE, level]
    return float(np.sqrt(np.mean(_relative(one, two) ** 2)))
