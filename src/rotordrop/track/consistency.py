"""Does the model fit the record? Checks that decide whether intervals hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.magnet import REMANENCE
from rotordrop.elements.table import STRUCTURE
from rotordrop.track.calibration import FITTING_NIS
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, Smoothed, parameter_sample

Array = NDArray[np.float64]

NIS_RANGE = (0.6, FITTING_NIS)
DIRECTIONS = "directions"
"""Name of the check without which nothing can cross-check an estimate."""
CORRELATION_LIMIT = 0.25
SENSOR_LIMIT = 3.5
PARAMETER_LIMIT = 3.5
NOISE_FACTOR_LIMIT = 8.0
BEAM_GAIN_SIGMA = 0.03
"""Relative standard deviation of what a beam in place of the rotor gets wrong between bearing and sensor [1]:
gains take it up. Such a gain went 5 % off on a rotor whose forces came out within 4 %."""
LONGEST_REMANENCE = 0.2
"""Time constant [s] from which on a remanent force is none: eddy currents fade within milliseconds."""
LEAST_SECOND_DIRECTION = 0.05
"""Smallest singular value of the directions of a plane's sensors that still counts as two directions [1]."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One consistency check: what was compared, whether it passed, and what to look at when it did not."""

    name: str
    passed: bool
    message: str
    """What was compared; of one unknown it is said what that unknown does."""
    note: str = ""
    """What is worth knowing although it passed; empty where there is nothing."""
    path: str = ""
    """The unknown that message and note are about, where they are about one."""

    def said(self, name_of: Callable[[str], str] = str) -> str:
        """What was compared, with the unknown by its path or by another name."""
        return f"{name_of(self.path)} {self.message}" if self.path else self.message

    def noted(self, name_of: Callable[[str], str] = str) -> str:
        """What is worth knowing, with the unknown by its path or by another name."""
        return f"{name_of(self.path)} {self.note}" if self.note and self.path else self.note


def judged_by(problem: DropProblem, likeliest: Forward, usual: Forward) -> Forward:
    """The pass by whose innovations a model is judged: with unknown impulses of the usual size.

    A beam in place of the rotor leaves more unexplained than a described rotor does, and its loads are stated
    with that error: it is judged with the impulses that were likeliest, up to their limit.
    """
    return likeliest if problem.model.machine.rotor.is_beam else usual


def consistency_checks(problem: DropProblem, smoothed: Smoothed, noise_factor: float) -> tuple[Check, ...]:
    """Check innovations, sensor errors, parameters and process noise of a smoothed drop."""
    innovations = _innovation_checks(problem, smoothed)
    white = all(check.passed for check in innovations)
    return (
        *innovations,
        _sensor_check(problem, smoothed),
        direction_check(problem, smoothed),
        _parameter_check(problem, smoothed),
        _nuisance_check(problem, smoothed, white),
        _remanence_check(problem, smoothed),
        Check(
            name="process noise",
            passed=noise_factor < NOISE_FACTOR_LIMIT,
            message=f"unknown impulses {noise_factor:.3g} × their usual size "
            f"(limit {NOISE_FACTOR_LIMIT:g} ×)",
            note=_of_a_beam(noise_factor) if problem.model.machine.rotor.is_beam else "",
        ),
        Check(
            name="filter",
            passed=smoothed.filtered.done == len(smoothed.filtered.means),
            message=f"the filter followed {smoothed.filtered.done} of {len(smoothed.filtered.means)} samples",
        ),
    )


def _of_a_beam(noise_factor: float) -> str:
    return (
        "a beam stands for the rotor: whether it follows the record is judged with unknown impulses "
        f"{noise_factor:.3g} × their usual size, and the error of a beam stands in every interval"
    )


def normalised_innovations(smoothed: Smoothed) -> Array:
    """Innovations of the displacement channels over their standard deviation [1], shape (N, C)."""
    done = smoothed.filtered.done
    return np.asarray(
        smoothed.filtered.innovations[:done, :-1]
        / np.sqrt(smoothed.filtered.innovation_variances[:done, :-1])
    )


def _innovation_checks(problem: DropProblem, smoothed: Smoothed) -> tuple[Check, ...]:
    e = normalised_innovations(smoothed)
    heard = np.flatnonzero(np.isfinite(e).any(axis=0))
    e = e[:, heard]
    names = [problem.model.machine.sensors[c].name for c in heard]
    nis = np.nanmean(e**2, axis=0)
    worst = int(np.argmax(np.abs(np.log(nis))))
    lag = np.array([_lag_one(e[:, c]) for c in range(e.shape[1])])
    reddest = int(np.argmax(np.abs(lag)))
    return (
        Check(
            name="innovation size",
            passed=bool(NIS_RANGE[0] <= nis[worst] <= NIS_RANGE[1]),
            message=(
                f"mean squared innovation {np.nanmean(nis):.2f} × expected, "
                f"{names[worst]} {nis[worst]:.2f} × "
                f"(usual {NIS_RANGE[0]:g} to {NIS_RANGE[1]:g})"
            ),
        ),
        Check(
            name="innovation whiteness",
            passed=bool(abs(lag[reddest]) < CORRELATION_LIMIT),
            message=(
                f"neighbouring innovations of channel {names[reddest]} correlate by {lag[reddest]:.2f} "
                f"(limit {CORRELATION_LIMIT:g})"
            ),
        ),
    )


def _lag_one(e: Array) -> float:
    pairs = np.isfinite(e[1:]) & np.isfinite(e[:-1])
    if np.count_nonzero(pairs) < 10:
        return 0.0
    return float(np.sum(e[1:][pairs] * e[:-1][pairs]) / np.sum(e[1:][pairs] ** 2))


def _sensor_check(problem: DropProblem, smoothed: Smoothed) -> Check:
    start, n_c = problem.n_dynamic + len(problem.unknowns), problem.n_channels
    chosen = slice(start, start + 2 * n_c)
    sigma = np.sqrt(np.diag(problem.covariance)[chosen])
    if problem.model.machine.rotor.is_beam:
        sigma[:n_c] = np.hypot(sigma[:n_c], BEAM_GAIN_SIGMA)
    departure = (smoothed.means[-1][chosen] - problem.mean[chosen]) / sigma
    worst = int(np.argmax(np.abs(departure)))
    channel = problem.model.machine.sensors[worst % n_c].name
    kind = "gain" if worst < n_c else "offset"
    return Check(
        name="sensor errors",
        passed=bool(abs(departure[worst]) < SENSOR_LIMIT),
        message=(
            f"{kind} of channel {channel} departs by {abs(departure[worst]):.1f} prior standard deviations "
            f"(limit {SENSOR_LIMIT:g})"
        ),
    )


def direction_check(problem: DropProblem, smoothed: Smoothed) -> Check:
    """Whether both directions are seen at every node with sensors; the rest follows from the model alone."""
    heard = np.flatnonzero(np.isfinite(normalised_innovations(smoothed)).any(axis=0))
    sensors = [problem.model.machine.sensors[c] for c in heard]
    blind = []
    for node in sorted({sensor.node for sensor in problem.model.machine.sensors}):
        angles = np.array([float(sensor.angle) for sensor in sensors if sensor.node == node])
        rows = np.column_stack([np.cos(angles), np.sin(angles)])
        if len(angles) < 2 or np.linalg.svd(rows, compute_uv=False)[1] < LEAST_SECOND_DIRECTION:
            blind.append(str(node))
    seen = "both directions are seen at every node with sensors"
    missing = f"only one direction or none is seen at node {', '.join(blind)}: a force across it is a guess"
    return Check(name=DIRECTIONS, passed=not blind, message=missing if blind else seen)


def _parameter_check(problem: DropProblem, smoothed: Smoothed) -> Check:
    """Parameters of the machine against what was known of them."""
    path, departure = _farthest(problem, smoothed, "machine")
    passed = departure < PARAMETER_LIMIT
    return Check(name="parameters", passed=passed, message=_departs(departure), path=path)


def _nuisance_check(problem: DropProblem, smoothed: Smoothed, white: bool) -> Check:
    """What belongs to this drop alone (unbalance, remanent lift, drag of the air) against what is usual.

    Forces do not depend on how large these are, only on whether the filter has found them: as long as the
    innovations are white it has, and an unusual value is news of the machine, not a fault of the estimate.
    """
    path, departure = _farthest(problem, smoothed, "drop")
    usual = departure < PARAMETER_LIMIT
    message = _departs(departure)
    note = "" if usual or not white else f"{message}; the readings are followed all the same"
    return Check(name="unknowns of the drop", passed=usual or white, message=message, note=note, path=path)


def _remanence_check(problem: DropProblem, smoothed: Smoothed) -> Check:
    """Whether the remanent force fades.

    One that stays is how a gain error that all sensors share looks: the rotor falls and flies with another
    gravity, every reading is followed, and every force and gap has the error.
    """
    theta = smoothed.means[parameter_sample(smoothed)][problem.parameter_slice]
    lasting = [
        unknown.value_of(float(t))
        for t, unknown in zip(theta, problem.unknowns, strict=True)
        if unknown.parameter is REMANENCE
    ]
    longest = max(lasting, default=0.0)
    return Check(
        name="remanent force",
        passed=longest < LONGEST_REMANENCE,
        message=(
            f"the remanent force of the magnets fades in {longest:.3g} s (limit {LONGEST_REMANENCE:g} s); "
            "one that stays looks like a gain error of all sensors, which forces and gaps would share"
        ),
    )


def _farthest(problem: DropProblem, smoothed: Smoothed, scope: str) -> tuple[str, float]:
    """Unknown of a scope that went farthest from its prior, and how far in standard deviations [1]."""
    theta = smoothed.means[parameter_sample(smoothed)][problem.parameter_slice]
    departures = [
        (0.0 if u.parameter.spin_up_only or u.parameter in STRUCTURE else abs(t - u.mean) / u.sigma, u.path)
        for t, u in zip(theta, problem.unknowns, strict=True)
        if u.scope == scope
    ]
    departure, path = max(departures, default=(0.0, "no unknown"))
    return path, float(departure)


def _departs(departure: float) -> str:
    return f"departs by {departure:.1f} prior standard deviations (limit {PARAMETER_LIMIT:g})"
