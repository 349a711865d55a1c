"""What the rest of a record says after the part that was estimated: did the rotor go further out?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotordrop.arrays import Array
from rotordrop.estimate.published import LaterMotion

RESOLVED = 4.0
"""Difference of two largest distances that counts, in standard deviations of the noise [1]."""


def later_motion(
    names: Sequence[str], time: Array, motion: Array, until: float, noise: float
) -> tuple[LaterMotion, ...]:
    """Compare the rest of a record with its estimated part, bearing by bearing; empty where nothing follows.

    The motion (N, B, 2) is the measured displacement from the centres of the bearings [m], the noise its
    standard deviation [m]; times (N,) and the end of the estimated part count from power-off [s].
    """
    radius = np.hypot(motion[..., 0], motion[..., 1])
    parts = ((time >= 0.0) & (time <= until), time > until)
    found = []
    for b, name in enumerate(names):
        inside = [np.flatnonzero(part & np.isfinite(radius[:, b])) for part in parts]
        if not all(len(samples) for samples in inside):
            continue
        first, later = (samples[np.argmax(radius[samples, b])] for samples in inside)
        before, after, resolved = float(radius[first, b]), float(radius[later, b]), RESOLVED * noise
        found.append(
            LaterMotion(
                bearing=name,
                first=before,
                first_time=float(time[first]),
                later=after,
                later_time=float(time[later]),
                resolved=resolved,
                larger=after > before + resolved,
            )
        )
    return tuple(found)
