"""What the mark of the shaft says: amplitude and phase of 1X before a drop, and the rotor angle at one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotordrop.arrays import Array

FEWEST_TURNS = 4
"""Turns from which the scatter between them gives an interval [1] (chosen)."""

CONFIDENCE = 0.95
"""Quantile of Student's t of a two-sided 90 % interval [1]."""

FEWEST_MARKS, FEWEST_FOR_SLOWING = 3, 8
"""Passages of the mark from which an angle, and from which an even slowing too, is fitted [1]."""

MISSED_MARKS = 3.0
"""Turns after the last passage beyond which the angle is not stated [1] (chosen)."""

MARK_SPAN = 0.5
"""Passages up to this long before an instant say where the shaft stands at it [s] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Synchronous:
    """1X of a plane: the circle that runs with the spin, electrical runout included."""

    plane: str
    """Plane of the sensors."""
    amplitude: float
    """Radius of the circle [m]."""
    phase: float
    """Direction of the high spot when the mark passes, from +y, positive with the spin [rad]."""
    amplitude_interval_90: tuple[float, float]
    phase_interval_90: tuple[float, float]
    """90 % intervals from the scatter between turns [m], [rad]; the phase that of the whole circle where the
    amplitude is within its noise."""
    turns: int
    """Turns used [1]."""


def synchronous_motion(
    plane: str, time: Array, position: Array, marks: Array, until: float
) -> Synchronous | None:
    """Amplitude and phase of 1X in a plane before a drop; None where too few turns lie before it.

    By times (N,) [s], the path of the shaft (N, 2) [m], the passages of the mark (M,) [s] and the end of the
    levitated part [s].
    """
    usual = float(np.median(np.diff(marks)))
    path, per_turn = position[:, 0] + 1j * position[:, 1], []
    for begin, end in pairwise(marks):
        if begin < time[0] or end > until or end - begin >= 1.5 * usual:
            continue  # a mark was missed in a turn that lasts longer than others
        inside = (time >= begin) & (time < end)
        angle = 2.0 * np.pi * (time[inside] - begin) / (end - begin)
        design = np.column_stack([np.exp(1j * angle), np.exp(-1j * angle), np.ones(len(angle))])
        per_turn.append(complex(np.linalg.lstsq(design, path[inside], rcond=None)[0][0]))
    if len(per_turn) < FEWEST_TURNS:
        return None
    from scipy.special import stdtrit

    vectors = np.array(per_turn)
    mean, n = complex(np.mean(vectors)), len(vectors)
    # along and across the mean vector: the one is the error of the amplitude, the other that of the phase
    turned = vectors * np.conj(mean) / max(abs(mean), 1e-300)
    wide = float(stdtrit(n - 1, CONFIDENCE)) / math.sqrt(n)
    along, across = wide * float(np.std(turned.real, ddof=1)), wide * float(np.std(turned.imag, ddof=1))
    phase = math.remainder(math.atan2(mean.imag, mean.real) - 0.5 * math.pi, 2.0 * math.pi)
    spread = math.asin(across / abs(mean)) if across < abs(mean) else math.pi
    return Synchronous(
        plane=plane,
        amplitude=abs(mean),
        phase=phase,
        amplitude_interval_90=(max(abs(mean) - along, 0.0), abs(mean) + along),
        phase_interval_90=(phase - spread, phase + spread),
        turns=n,
    )


@dataclass(frozen=True, kw_only=True)
class MarkAngle:
    """How far the shaft has turned since its mark passed, and the standard error of that [rad]."""

    angle: float
    error: float


def angle_since_mark(marks: Array, when: float) -> MarkAngle | None:
    """How far the shaft has turned at an instant [s] since the mark passed last, from the passages (M,)
    before.

    Passages up to `MARK_SPAN` before it count. Friction changes the speed within a fraction of a turn after
    the first contact, so those after it are not asked; before it a levitated rotor turns evenly, or slows
    evenly where that shows. None where fewer than three passages lie before, or the last one far before
    the instant.
    """
    used = marks[(marks <= when) & (marks >= when - MARK_SPAN)]
    if len(used) < FEWEST_MARKS or when - used[-1] > MISSED_MARKS * float(np.median(np.diff(used))):
        return None
    turns = np.cumsum(np.append(0.0, np.round(np.diff(used) / float(np.median(np.diff(used))))))
    degree = 2 if len(used) > FEWEST_FOR_SLOWING else 1
    since = (used - when) / MARK_SPAN
    design = np.vander(since, degree + 1, increasing=True)
    fitted, *_ = np.linalg.lstsq(design, 2.0 * np.pi * turns, rcond=None)
    rest = 2.0 * np.pi * turns - design @ fitted
    scatter = float(np.sqrt(np.sum(rest**2) / max(len(used) - degree - 1, 1)))
    error = scatter * math.sqrt(float(np.linalg.pinv(design.T @ design)[0, 0]))
    return MarkAngle(angle=math.remainder(float(fitted[0]), 2.0 * math.pi), error=error)
