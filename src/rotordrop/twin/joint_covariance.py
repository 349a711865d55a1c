"""The joint distribution of calibrated values, in the numbers that a machine file holds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from rotordrop.arrays import Array
from rotordrop.known import NINETY, Known
from rotordrop.machine.calibration import JointSpread
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import (
    Unknown,
    file_of_fitted,
    file_path,
    is_logarithmic,
    is_of_a_bearing,
    slope_signs,
)


def joint_covariance(
    model: DropModel,
    fitted: Mapping[str, Unknown],
    mean: Sequence[float],
    covariance: Array,
    known: Mapping[str, Known],
) -> JointSpread:
    """Joint distribution of the calibrated values of the touchdown bearings.

    The correlations are those of the fit, with mean (n,) and covariance (n, n) of the unknowns by path; the
    spreads are as wide as the intervals that the machine file states: a study of drops must not believe a
    value more than the file says.
    """
    chosen = [
        (place, unknown)
        for place, (path, unknown) in enumerate(fitted.items())
        # a value that came out as zero has no logarithm to correlate
        if is_of_a_bearing(unknown) and not (is_logarithmic(unknown) and known[path].value <= 0.0)
    ]
    places, unknowns = [place for place, _ in chosen], [unknown for _, unknown in chosen]
    logs = [is_logarithmic(unknown) for unknown in unknowns]
    block = covariance[np.ix_(places, places)]
    errors = np.sqrt(np.maximum(np.diag(block), 1e-300))
    stated = [_spread(known[one.path], log) for one, log in zip(unknowns, logs, strict=True)]
    scale = slope_signs(unknowns, np.array(mean)[places], errors) * np.array(stated) / errors
    through = file_of_fitted(model, unknowns, [known[one.path].value for one in unknowns])
    matrix = through @ (scale[:, None] * block * scale) @ through.T
    return JointSpread(
        paths=tuple(file_path(one.path) for one in unknowns),
        logarithmic=tuple(logs),
        covariance=tuple(matrix[np.tril_indices(len(unknowns))].tolist()),
    )


def _spread(value: Known, logarithmic: bool) -> float:
    """Standard deviation that belongs to a stated 90 % interval, of the logarithm where that is normal."""
    low, high = value.interval_90 or (value.value, value.value)
    if not logarithmic:
        return (high - low) / (2.0 * NINETY)
    if low <= 0.0:
        return math.log(high / value.value) / NINETY
    return math.log(high / low) / (2.0 * NINETY)
