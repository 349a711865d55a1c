"""Unbalance by plane from a followed drop: amount, and phase against the mark of the shaft."""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array
from rotordrop.estimate.unbalance import PlaneUnbalance
from rotordrop.evidence.synchronous import MarkAngle, angle_since_mark
from rotordrop.known import NINETY, Known
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Smoothed
from rotordrop.twin.tracked_loads import INCONSISTENT
from rotordrop.twin.tracked_parameters import determination, parameter_widening

NO_MARK = "not determined against a mark (the record carries no pulses of a tacho or keyphasor)"
NO_PASSAGE = "not determined against a mark (its pulses end before power-off, or are too few)"
NO_DIRECTION = "not determined (this drop does not tell a direction)"


def plane_unbalances(
    problem: DropProblem,
    smoothed: Smoothed,
    marks: Array | None,
    power_off: float,
    *,
    fits: bool,
    widening: float,
) -> tuple[PlaneUnbalance, ...]:
    """Unbalance of every plane of the machine, from its two components and their joint covariance.

    The filter counts the rotor angle from its first sample, so that instant is where the shaft stands
    against its mark, which passed at ``marks`` (M,) in record time [s], like power-off. Without agreement of
    model and record (``fits``) nothing is known but what was before; the widening is a factor on standard
    errors [1].
    """
    first = power_off + float(problem.time[0])
    turned = None if marks is None else angle_since_mark(marks, first)
    at = smoothed.filtered.parameter_sample
    mean, covariance = smoothed.means[at], smoothed.covariance(at)
    found = []
    for plane, unbalance in enumerate(problem.model.machine.unbalances):
        entries = np.array(problem.entries_that_set("unbalance", plane), dtype=np.intp)
        first = problem.unknowns[entries[0] - problem.n_dynamic]
        prior = first.sigma
        (a, b), (_, d) = covariance[np.ix_(entries, entries)]
        largest = math.sqrt(max(0.5 * (a + d) + math.hypot(0.5 * (a - d), b), 0.0))  # in any direction
        factor = parameter_widening(first, largest, widening)
        joint = factor**2 * covariance[np.ix_(entries, entries)]
        amount, phase = polar_of(complex(*mean[entries]), joint, prior, turned, fits)
        reason = NO_MARK if marks is None else NO_PASSAGE if turned is None else NO_DIRECTION
        found.append(
            PlaneUnbalance(
                node=unbalance.node, amount=amount, phase=phase, reason="" if phase is not None else reason
            )
        )
    return tuple(found)


def polar_of(
    vector: complex, covariance: Array, prior: float, turned: MarkAngle | None, fits: bool
) -> tuple[Known, Known | None]:
    """Amount and phase of a vector: its error along itself is that of the amount, the other of the phase."""
    size, direction = abs(vector), math.atan2(vector.imag, vector.real)
    along = np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    error = math.sqrt(max(float(along @ covariance @ along), 0.0))
    sideways = NINETY * math.sqrt(max(float(across @ covariance @ across), 0.0))
    highest = size + NINETY * error
    amount = Known(
        value=size,
        status=determination(error / prior) if fits else INCONSISTENT,
        standard_error=error,
        interval_90=(max(size - NINETY * error, 0.0), highest) if fits else (0.0, highest + NINETY * prior),
        unit="kg m",
    )
    if turned is None or not fits or max(NINETY * error, sideways) >= size:
        return amount, None
    half = min(math.hypot(math.asin(sideways / size), NINETY * turned.error), math.pi)
    phase = math.remainder(direction - turned.angle - 0.5 * math.pi, 2.0 * math.pi)
    return amount, Known(
        value=phase,
        status=determination(2.0 * half / math.pi),
        standard_error=half / NINETY,
        interval_90=(phase - half, phase + half),
        unit="rad",
    )
