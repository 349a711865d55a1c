"""What the rest of a record says after the part that was estimated: did the rotor go further out?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.units import format_moment

RESOLVED = 4.0
"""Difference of two largest distances that counts, in standard deviations of the noise [1]."""


@dataclass(frozen=True, kw_only=True)
class LaterMotion:
    """How far the rotor moved at one bearing after the part that was estimated, beside the part itself."""

    bearing: str
    """Name of the bearing."""
    first: float
    first_time: float
    """Largest measured distance from the bearing centre [m] in the estimated part, and when [s]."""
    later: float
    later_time: float
    """The same in the rest of the record."""
    resolved: float
    """Difference that the readings show [m]."""

    @property
    def larger(self) -> bool:
        """Whether the rotor went further out after the estimated part than in it."""
        return self.later > self.first + self.resolved

    def sentence(self) -> str:
        """What this means for the stated peaks."""
        beyond = 1e6 * (self.later - self.first)
        return (
            f"{self.bearing}: the rotor went {beyond:.1f} µm further out at {format_moment(self.later_time)} "
            "than in the part of the record that was estimated; the largest force of this drop may be there, "
            "and the stated peak is not it"
        )


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
        found.append(
            LaterMotion(
                bearing=name,
                first=float(radius[first, b]),
                first_time=float(time[first]),
                later=float(radius[later, b]),
                later_time=float(time[later]),
                resolved=RESOLVED * noise,
            )
        )
    return tuple(found)
