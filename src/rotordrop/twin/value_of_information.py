"""Which further number about a machine would narrow the intervals of a drop most, and by how much."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from rotordrop.arrays import Array
from rotordrop.estimate.published import Advice
from rotordrop.known import NINETY
from rotordrop.track.forces import ForceHistory, force_gradient
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Smoothed, smooth
from rotordrop.twin.allowances import MODEL_FORCE_SIGMA

DRAWING = "the rotor by its sections, from a drawing"
WORTH_SAYING = 0.95
"""Half width left over the one there is from which a further number is not worth its measurement
[1] (chosen)."""
MOST_NAMED = 3
"""Measurements that are named beside the best of every bearing (chosen)."""


def value_of_information(
    problem: DropProblem, smoothed: Smoothed, forces: ForceHistory, widening: float = 1.0
) -> tuple[Advice, ...]:
    """Measurements worth making, the one that narrows most first.

    A number that becomes known takes away the part of the variance of a force that it explains: of a normal
    distribution that is ``cᵀ P⁻¹ c`` with the covariance c of force and numbers, and P of the numbers. What
    every model here leaves out stays. The drop was estimated alone; the widening is a factor on all intervals
    [1].
    """
    names = problem.model.bearing_names
    peaks = np.argmax(forces.magnitude[:: forces.substeps], axis=0).tolist()
    at_peaks = smooth(smoothed.filtered, kept=peaks)
    form = problem.model.machine.rotor.force_sigma
    before: dict[str, float] = {}
    after: dict[str, dict[str, float]] = {name: {} for name, _ in _measurements(problem)}
    drawing: dict[str, float] = {}
    for b, (name, at) in enumerate(zip(names, peaks, strict=True)):
        covariance = at_peaks.covariance(at)
        gradient = force_gradient(problem, smoothed.means[at], b)
        shared = covariance @ gradient
        variance = max(float(gradient @ shared), 0.0)
        force = float(forces.magnitude[at * forces.substeps, b])
        rest = (MODEL_FORCE_SIGMA**2 + form**2) * force**2
        before[name] = NINETY * widening * math.sqrt(variance + rest)
        drawing[name] = NINETY * widening * math.hypot(math.sqrt(variance), MODEL_FORCE_SIGMA * force)
        for measurement, entries in _measurements(problem):
            known = explained(covariance[np.ix_(entries, entries)], shared[entries])
            left = max(variance - known, 0.0)
            after[measurement][name] = NINETY * widening * math.sqrt(left + rest)
    first = problem.n_dynamic + len(problem.unknowns)
    paths = {problem.n_dynamic + k: unknown.path for k, unknown in enumerate(problem.unknowns)}
    paths |= {first + c: f"sensors.{one.name}.gain" for c, one in enumerate(problem.model.machine.sensors)}
    listed = [
        advice_of(measurement, [paths[entry] for entry in entries], before, after[measurement])
        for measurement, entries in _measurements(problem)
    ]
    if form:
        listed.append(advice_of(DRAWING, ["rotor"], before, drawing))
    least = {one.measurement: min(map(one.left, names)) for one in listed}
    listed.sort(key=lambda one: least[one.measurement])
    best = [min(listed, key=lambda one: one.narrowed_N[name]) for name in names]
    named = (one for k, one in enumerate(listed) if k < MOST_NAMED or one in best)
    return tuple(one for one in named if least[one.measurement] < WORTH_SAYING)


def advice_of(
    measurement: str, paths: Sequence[str], before: Mapping[str, float], after: Mapping[str, float]
) -> Advice:
    """What a measurement of some parameters would bring: half widths of the peak forces by bearing [N]."""
    parts = [
        f"{name} from ± {half:.3g} N to ± {after[name]:.3g} N"
        for name, half in before.items()
        if after[name] < WORTH_SAYING * half
    ]
    sentence = f"{measurement} would narrow the peak force: {', '.join(parts)}"
    return Advice(
        measurement=measurement,
        paths=list(paths),
        half_widths_N=dict(before),
        narrowed_N=dict(after),
        sentence=sentence,
    )


def explained(covariance: Array, shared: Array) -> float:
    """Part of a variance that numbers explain, from their covariance and what they share with it."""
    sigma = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    scaled = covariance / np.outer(sigma, sigma)
    # Numbers that a record only knows together make the matrix singular: what they share counts once.
    return float((shared / sigma) @ np.linalg.pinv(scaled, rcond=1e-6, hermitian=True) @ (shared / sigma))


def _measurements(problem: DropProblem) -> Iterator[tuple[str, list[int]]]:
    """What can be measured, and the entries of the estimate it would make known."""
    groups: dict[str, list[int]] = {}
    for k, unknown in enumerate(problem.unknowns):
        if unknown.parameter.measured_by:
            name = unknown.parameter.measured_by.format(owner=unknown.owner)
            groups.setdefault(name, []).append(problem.n_dynamic + k)
    first = problem.n_dynamic + len(problem.unknowns)
    groups["a calibration of the displacement sensors"] = list(range(first, first + problem.n_channels))
    yield from groups.items()
