"""Calibrated values that err together: as a machine file has them, and as an estimation takes them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics.linear_algebra import solve
from rotordrop.rotor.parameter_table import parameter, row_of
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import Unknown, typical_depth

Array = NDArray[np.float64]

_COUPLED = ("contact.stiffness", "contact.exponent", "support.stiffness", "support.anisotropy")


def file_path(path: str) -> str:
    """Where a file has a value: the horizontal support in place of its ratio to the vertical one."""
    if row_of(path) is parameter("support.anisotropy"):
        return path.removesuffix("support.anisotropy") + "support.stiffness_horizontal"
    return path


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
    paths = [unknown.path for unknown in unknowns]
    through = np.eye(len(paths))
    for bearing in model.machine.touchdown_bearings:
        at = {row: paths.index(p) for row in _COUPLED if (p := parameter(row).path_of(bearing.name)) in paths}
        if {"contact.stiffness", "contact.exponent"} <= at.keys():
            # the file's stiffness belongs to the fitted exponent: equal force at the typical indentation
            depth = typical_depth(bearing, float(np.mean(model.load_shares)))
            n = at["contact.exponent"]
            slope = exponents[n] if is_logarithmic(unknowns[n]) else 1.0
            through[at["contact.stiffness"], n] = -slope * math.log(depth)
        if {"support.stiffness", "support.anisotropy"} <= at.keys():
            through[at["support.anisotropy"], at["support.stiffness"]] = 1.0
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
