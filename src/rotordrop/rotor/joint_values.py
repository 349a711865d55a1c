"""Calibrated values that err together: as a machine file has them, and as an estimation takes them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.table import row_of
from rotordrop.physics.linear_algebra import solve
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import Unknown

Array = NDArray[np.float64]


def file_path(path: str) -> str:
    """Where a file has a value: the horizontal support in place of its ratio to the vertical one."""
    row = row_of(path)
    return path.removesuffix(row.path) + row.file_path


def is_logarithmic(unknown: Unknown) -> bool:
    """Whether the logarithm of the value in the file is normal, or the value itself."""
    return unknown.logarithmic or unknown.published is not None


def is_of_a_bearing(unknown: Unknown) -> bool:
    """Whether it is a value of a touchdown bearing: these err together in a calibrated file."""
    return unknown.scope == "machine" and unknown.parameter.owner == "bearing"


def slope_signs(unknowns: Sequence[Unknown], theta: Array, sigma: Array) -> Array:
    """Whether a value rises (1) or falls (-1) with its estimate: an axial offset falls as preload rises."""
    return np.array(
        [
            math.copysign(1.0, u.value_of(t + 0.1 * s) - u.value_of(t - 0.1 * s))
            for u, t, s in zip(unknowns, theta, sigma, strict=True)
        ]
    )


def file_of_fitted(model: DropModel, unknowns: Sequence[Unknown], exponents: Sequence[float]) -> Array:
    """What a change of each fitted value changes of those in the file, shape (n, n).

    Parameters
    ----------
    model : DropModel
        Drop model of the machine.
    unknowns : sequence of Unknown
        The values, of touchdown bearings.
    exponents : sequence of float
        Their values [SI], of which only those of contact exponents are read.
    """
    places = {(unknown.owner, unknown.parameter.path): k for k, unknown in enumerate(unknowns)}
    bearings = {bearing.name: bearing for bearing in model.machine.touchdown_bearings}
    through, load = np.eye(len(unknowns)), float(np.mean(model.load_shares))
    for (owner, _), k in places.items():
        row = unknowns[k].parameter
        slope = exponents[k] if is_logarithmic(unknowns[k]) else 1.0
        for path, change in row.changes.items():
            if (owner, path) in places:
                through[places[owner, path], k] = change(bearings[owner], load, slope)
        if row.ratio is not None and (owner, row.ratio[1]) in places:
            through[k, places[owner, row.ratio[1]]] = 1.0
    return through


def correlate(model: DropModel, unknowns: Sequence[Unknown], block: Array) -> None:
    """Let calibrated values err together in a prior covariance (P, P), as their machine file says.

    The variances stay: the file's intervals say them. A value that was changed since is no estimate any more
    and errs alone.
    """
    origin = model.machine.calibration
    if origin is None or origin.joint is None:
        return
    spread = origin.joint
    listed = [
        k for k, one in enumerate(unknowns) if is_of_a_bearing(one) and file_path(one.path) in spread.paths
    ]
    chosen = [unknowns[k] for k in listed]
    order = [spread.paths.index(file_path(one.path)) for one in chosen]
    theta, sigma = np.array([(one.begin, one.sigma) for one in chosen]).reshape(-1, 2).T
    through = file_of_fitted(model, chosen, [one.value_of(one.begin) for one in chosen])
    signs = slope_signs(chosen, theta, sigma)
    half = solve(through, spread.matrix[np.ix_(order, order)])
    fitted = signs[:, None] * solve(through, half.T) * signs
    own = np.sqrt(np.diag(fitted))
    known = [i for i, one in enumerate(chosen) if one.calibrated and own[i] > 0.0]
    places = [listed[i] for i in known]
    variance = np.diag(block)[places]
    correlated = fitted[np.ix_(known, known)] * np.outer(
        np.sqrt(variance) / own[known], np.sqrt(variance) / own[known]
    )
    np.fill_diagonal(correlated, variance)
    block[np.ix_(places, places)] = correlated
