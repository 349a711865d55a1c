"""The joint distribution of calibrated values, in the numbers that a machine file holds."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import NINETY, IdentifiedValue
from rotordrop.machine import JointSpread
from rotordrop.model.parameter_table import parameter, row_of
from rotordrop.model.unknowns import typical_depth
from rotordrop.tracking.problem import DropProblem

Array = NDArray[np.float64]


def joint_spread(
    problem: DropProblem, mean: Array, covariance: Array, known: Mapping[str, IdentifiedValue]
) -> JointSpread:
    """Joint distribution of the calibrated values of the touchdown bearings.

    Parameters
    ----------
    problem : DropProblem
        Of the last drop: the unknowns with their measures.
    mean, covariance : ndarray, shapes (n,), (n, n)
        What the fit holds of all states and unknowns.
    known : mapping
        The values as the machine file states them, with the intervals it states.

    Returns
    -------
    JointSpread
        Correlations as the fit holds them, spreads as wide as the stated intervals: a study of drops must not
        believe a value more than the file says.
    """
    chosen = [
        (problem.n_dynamic + k, unknown)
        for k, unknown in enumerate(problem.unknowns)
        if unknown.scope == "machine" and unknown.parameter.owner == "bearing"
    ]
    places = [place for place, _ in chosen]
    paths = [unknown.path for _, unknown in chosen]
    logs = [unknown.logarithmic or unknown.published is not None for _, unknown in chosen]
    block = covariance[np.ix_(places, places)]
    fitted = np.sqrt(np.maximum(np.diag(block), 1e-300))
    rising = [
        math.copysign(1.0, u.value_of(mean[i] + 0.1 * s) - u.value_of(mean[i] - 0.1 * s))
        for (i, u), s in zip(chosen, fitted, strict=True)
    ]  # an axial offset falls where the preload rises
    stated = [_spread(known[path], log) for path, log in zip(paths, logs, strict=True)]
    scale = np.array(rising) * np.array(stated) / fitted
    through = _as_in_file(problem, known, paths, logs)
    matrix = through @ (scale[:, None] * block * scale) @ through.T
    return JointSpread(
        paths=tuple(_file_path(path) for path in paths),
        logarithmic=tuple(logs),
        covariance=tuple(matrix[np.tril_indices(len(paths))].tolist()),
    )


def _spread(value: IdentifiedValue, logarithmic: bool) -> float:
    """Standard deviation that belongs to a stated 90 % interval, of the logarithm where that is normal."""
    low, high = value.interval_90 or (value.value, value.value)
    if not logarithmic:
        return (high - low) / (2.0 * NINETY)
    if low <= 0.0:
        return math.log(high / value.value) / NINETY
    return math.log(high / low) / (2.0 * NINETY)


def _as_in_file(
    problem: DropProblem, known: Mapping[str, IdentifiedValue], paths: list[str], logs: list[bool]
) -> Array:
    """What a change of each fitted value changes of those in the file, shape (n, n)."""
    through = np.eye(len(paths))
    for bearing in problem.model.machine.touchdown_bearings:
        at = {row: paths.index(p) for row in _COUPLED if (p := parameter(row).path_of(bearing.name)) in paths}
        if {"contact.stiffness", "contact.exponent"} <= at.keys():
            # the file's stiffness belongs to the fitted exponent: equal force at the typical indentation
            depth = typical_depth(bearing, float(np.mean(problem.model.load_shares)))
            n = at["contact.exponent"]
            slope = known[paths[n]].value if logs[n] else 1.0
            through[at["contact.stiffness"], n] = -slope * math.log(depth)
        if {"support.stiffness", "support.anisotropy"} <= at.keys():
            through[at["support.anisotropy"], at["support.stiffness"]] = 1.0
    return through


_COUPLED = ("contact.stiffness", "contact.exponent", "support.stiffness", "support.anisotropy")


def _file_path(path: str) -> str:
    """Where the file has it: the horizontal support in place of its ratio to the vertical one."""
    if row_of(path) is parameter("support.anisotropy"):
        return path.removesuffix("support.anisotropy") + "support.stiffness_horizontal"
    return path
