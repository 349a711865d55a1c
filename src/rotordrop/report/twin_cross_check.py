"""The tracked twin against the estimate that knows no contact law."""

from __future__ import annotations

import numpy as np

from rotordrop.estimation.tracked import TrackedDrop
from rotordrop.estimation.tracked_values import force_values
from rotordrop.report.cross_check import CrossCheck
from rotordrop.report.quantity import Quantity
from rotordrop.report.tracked_sections import widening
from rotordrop.tracking.input_state import (
    KNOWN_MEAN_ERROR,
    KNOWN_PEAK_ERROR,
    KNOWN_STRESS_ERROR,
    input_state_estimate,
)


def twin_cross_checks(drop: TrackedDrop) -> tuple[CrossCheck, ...]:
    """Peak force, peak stress and mean force of every bearing found in both ways.

    Empty where the sensors do not see both directions in two planes: no cross-check is possible then.
    """
    if not drop.can_be_cross_checked:
        return ()
    check = drop.cross_check or input_state_estimate(drop.problem, drop.smoothed)
    found = []
    late = drop.forces.time >= 0.15
    for b, name in enumerate(drop.values):
        values, _ = force_values(drop.forces, b, widening(drop))
        peak = values["peak_force_N"]
        found.append(
            CrossCheck(
                name=f"{name} peak force",
                estimate=Quantity(value=peak.value, kind="force", interval_90=peak.interval_90),
                check=Quantity(value=float(check.peak[b]), kind="force", digits=3),
                accuracy=KNOWN_PEAK_ERROR,
            )
        )
        stress = values["peak_stress_Pa"]
        found.append(
            CrossCheck(
                name=f"{name} peak stress",
                estimate=Quantity(value=stress.value, kind="pressure", interval_90=stress.interval_90),
                check=Quantity(value=float(check.peak_stress[b]), kind="pressure", digits=3),
                accuracy=KNOWN_STRESS_ERROR,
            )
        )
        if np.isfinite(check.mean_late[b]):
            mean = float(np.hypot(*drop.forces.force[late, b].mean(axis=0)))
            found.append(
                CrossCheck(
                    name=f"{name} force of the mean, 150 to 200 ms",
                    estimate=Quantity(value=mean, kind="force", digits=3),
                    check=Quantity(value=float(check.mean_late[b]), kind="force", digits=3),
                    accuracy=KNOWN_MEAN_ERROR,
                )
            )
    return tuple(found)
