"""Extended, relinearised, sigma-point or ensemble filter? The same drops, model and noise for all.

Usage: python studies/tracked/filter_kinds.py [SEED ...]

The machine is the true one, its parameters are still states with their priors, so that only the filter
differs. Compared are filtered (not smoothed) ball forces: the error of the largest force of each bearing,
the rms error of the force history over its rms, the mean normalised innovation squared, and processor time.
The extended filter and its relinearised second pass are shown smoothed as well, which is what the product
does.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from pathlib import Path
from typing import Any

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np
from numba import njit

from rotordrop.arrays import Array
from rotordrop.evidence.evidence import read_evidence
from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.track import _filter as F
from rotordrop.track import _propagation as P
from rotordrop.track import forces
from rotordrop.track.problem import DropProblem, private_copy
from rotordrop.track.smoother import PassSettings, fastest_frequency, forward, smooth
from rotordrop.twin.problems import drop_problem
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.recording import SyntheticDrop

HERE = Path(__file__).parent
SPREAD = math.sqrt(3.0)
"""Distance of the sigma points in standard deviations: the right one for a normal distribution."""


@njit(cache=False)
def moved(t, x, s, n_p, targets, p, settings, k, work, contact, impulses):
    """A whole estimate one sample on: the state by the drop model, all else as it was."""
    P.apply_parameters(x[s : s + n_p].copy(), targets, p)
    y = np.zeros(s + 2)
    y[:s] = x[:s]
    h = settings.dt / settings.substeps
    impulses[:] = 0.0
    for step in range(settings.substeps):
        P.rk4_step(t + step * h, h, y, p, k[:5], k[5], work)
        for b in range(p.bearing.shape[0]):
            P.contact_at(b, k[4], p, contact)
            impulses[b] += h * contact[1]
    x[:s] = y[:s]


@njit(cache=False)
def update(mean, covariance, readings, speed, rows, variances, speed_variance, s, n_p, e, S):
    """All readings of one sample, one after the other, by the product's own measurement update."""
    n = mean.shape[0]
    n_c = rows.shape[0]
    row = np.zeros(n)
    gain = np.empty(n)
    for c in range(n_c + 1):
        value = speed if c == n_c else readings[c]
        e[c] = np.nan
        S[c] = np.nan
        if not math.isfinite(value):
            continue
        if c < n_c:
            predicted = F.measurement_row(c, mean, mean[s - 1], rows[c], s + n_p, n_c, row)
            variance = variances[c]
        else:
            row[:] = 0.0
            row[s - 2] = 1.0
            predicted = mean[s - 2]
            variance = speed_variance
        e[c] = value - predicted
        S[c] = F.scalar_update(mean, covariance, row, e[c], variance, gain)


@njit(cache=False)
def sigma_point_pass(
    mean,
    covariance,
    times,
    readings,
    speed,
    rows,
    variances,
    speed_variance,
    targets,
    p,
    settings,
    n_p,
    means,
    E,
    S,
):
    """Divided-difference filter (Nørgaard 2000, first order with the second-order mean)."""
    n = mean.shape[0]
    s = rows.shape[1]
    k = np.empty((6, s + 2))
    work = P.scratch_of(p)
    contact = np.empty(6)
    impulses = np.zeros(p.bearing.shape[0])
    spare = np.zeros(p.bearing.shape[0])
    for i in range(times.shape[0]):
        if i > 0:
            scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
            normal = covariance / np.outer(scale, scale) + 1e-9 * np.eye(n)
            root = np.linalg.cholesky(normal)
            middle = mean.copy()
            moved(times[i - 1], middle, s, n_p, targets, p, settings, k, work, contact, impulses)
            shift = np.zeros(n)
            columns = np.empty((n, n))
            for j in range(n):
                step = SPREAD * scale * root[:, j]
                above = mean + step
                below = mean - step
                moved(times[i - 1], above, s, n_p, targets, p, settings, k, work, contact, spare)
                moved(times[i - 1], below, s, n_p, targets, p, settings, k, work, contact, spare)
                columns[:, j] = (above - below) / (2.0 * SPREAD)
                shift += (above + below - 2.0 * middle) / (2.0 * SPREAD * SPREAD)
            mean = middle + shift
            covariance = np.dot(columns, columns.T)
            P.apply_parameters(mean[s : s + n_p].copy(), targets, p)
            drift = targets.late_drift if times[i] > settings.learning_end else targets.drift
            P.add_process_noise(covariance, p, settings, impulses, drift)
        update(mean, covariance, readings[i], speed[i], rows, variances, speed_variance, s, n_p, E[i], S[i])
        F.symmetrise(covariance)
        means[i] = mean
        if not math.isfinite(mean[0]):
            return i
    return times.shape[0]


@njit(cache=False)
def drawn(random, covariance):
    """A normal deviate of a covariance whose entries differ by many orders of magnitude."""
    n = covariance.shape[0]
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(size > 0.0, size, 1.0)
    factor = np.linalg.cholesky(covariance / np.outer(unit, unit) + 1e-9 * np.eye(n))
    return size * np.dot(factor, random.standard_normal(n))


@njit(cache=False)
def ensemble_update(random, x, value, seen, variance):
    """One reading, perturbed for each member; returns innovation and its variance."""
    members, n = x.shape
    average = seen.mean()
    centre = np.zeros(n)
    for m in range(members):
        centre += x[m] / members
    cross = np.zeros(n)
    own = variance
    for m in range(members):
        cross += (x[m] - centre) * (seen[m] - average) / (members - 1)
        own += (seen[m] - average) ** 2 / (members - 1)
    for m in range(members):
        wanted = value + math.sqrt(variance) * random.standard_normal()
        x[m] += cross * (wanted - seen[m]) / own
    return value - average, own


@njit(cache=False)
def ensemble_step(random, t, x, late, s, n_p, targets, p, settings, k, work, contact):
    """All members one sample on, each with its own noise."""
    members, n = x.shape
    impulses = np.zeros(p.bearing.shape[0])
    total = np.zeros(p.bearing.shape[0])
    for m in range(members):
        moved(t, x[m], s, n_p, targets, p, settings, k, work, contact, impulses)
        total += impulses / members
    noise = np.zeros((n, n))
    P.add_process_noise(noise, p, settings, total, targets.late_drift if late else targets.drift)
    for m in range(members):
        x[m] += drawn(random, noise)


@njit(cache=False)
def ensemble_pass(
    mean,
    covariance,
    times,
    readings,
    speed,
    rows,
    variances,
    speed_variance,
    targets,
    p,
    settings,
    n_p,
    random,
    members,
    means,
    E,
    S,
):
    """Stochastic ensemble filter with perturbed readings, without localisation."""
    n, s, n_c = mean.shape[0], rows.shape[1], rows.shape[0]
    k = np.empty((6, s + 2))
    work = P.scratch_of(p)
    contact = np.empty(6)
    row = np.zeros(n)
    seen = np.empty(members)
    x = np.empty((members, n))
    for m in range(members):
        x[m] = mean + drawn(random, covariance)
    E[:, :] = np.nan
    S[:, :] = np.nan
    for i in range(times.shape[0]):
        if i > 0:
            late = times[i] > settings.learning_end
            ensemble_step(random, times[i - 1], x, late, s, n_p, targets, p, settings, k, work, contact)
        for c in range(n_c + 1):
            value = speed[i] if c == n_c else readings[i, c]
            if not math.isfinite(value):
                continue
            variance = speed_variance if c == n_c else variances[c]
            for m in range(members):
                seen[m] = (
                    x[m, s - 2]
                    if c == n_c
                    else F.measurement_row(c, x[m], x[m, s - 1], rows[c], s + n_p, n_c, row)
                )
            E[i, c], S[i, c] = ensemble_update(random, x, value, seen, variance)
        for j in range(n):
            means[i, j] = x[:, j].mean()
        if not math.isfinite(means[i, 0]):
            return i
    return times.shape[0]


def ball_forces(problem: DropProblem, means: Array) -> Array:
    """Magnitude of the ball force (N, B) [N] at estimates (N, n)."""
    n_b = problem.model.layout.n_bearings
    values = np.empty((len(means), n_b, forces.N_VALUES))
    forces.force_values(
        means,
        problem.n_dynamic,
        problem.targets,
        private_copy(problem.model.parameters),
        len(problem.unknowns),
        values,
        np.empty((len(means), n_b, forces.N_VALUES, 3)),
        np.empty((len(means), n_b, 6)),
    )
    return values[..., forces.FORCE]


def errors(
    problem: DropProblem, means: Array, drop: SyntheticDrop, nis: float, seconds: float
) -> dict[str, Any]:
    """Errors of forces against the truth."""
    mine = ball_forces(problem, means)
    found: dict[str, Any] = {"nis": nis, "cpu_s": seconds, "samples": len(means), "peak": {}, "history": {}}
    for b, name in enumerate(problem.model.bearing_names):
        true = np.interp(
            problem.time[: len(means)], drop.result.time, drop.result.bearing_force_magnitude[:, b]
        )
        found["peak"][name] = float(mine[:, b].max() / true.max() - 1.0)
        found["history"][name] = float(np.sqrt(np.mean((mine[:, b] - true) ** 2) / np.mean(true**2)))
    return found


def study(seed: int, hz: float, members: int = 300) -> dict[str, Any]:
    """All filters on one drop."""
    hidden = hidden_machine(example_machine("lp400"), seed)
    drop = synthesize_drop(hidden, 2.0 * math.pi * hz, seed)
    machine = hidden.machine.model_copy(update={"sensors": example_machine("lp400").sensors})
    problem = drop_problem(
        build_drop_model(machine, Reduction(modes=10, attachment=True)),
        read_evidence(build_drop_model(machine), drop.record, drop.tail),
    )
    settings = PassSettings(impulse=1e-3, share=0.01)
    result: dict[str, Any] = {"seed": seed, "speed_Hz": hz}
    forward(problem, settings, samples=3)  # compiled before the clock runs
    started = time.process_time()
    extended = forward(problem, settings)
    spent = time.process_time() - started
    result["extended"] = errors(problem, extended.means[: extended.done], drop, extended.nis, spent)
    started = time.process_time()
    once = smooth(extended)
    spent += time.process_time() - started
    result["extended, smoothed"] = errors(problem, once.means, drop, extended.nis, spent)
    started = time.process_time()
    again = forward(problem, settings, reference=once.means)
    spent += time.process_time() - started
    result["relinearised"] = errors(problem, again.means[: again.done], drop, again.nis, spent)
    started = time.process_time()
    twice = smooth(again)
    spent += time.process_time() - started
    result["relinearised, smoothed"] = errors(problem, twice.means, drop, again.nis, spent)
    for kind in ("sigma points", f"ensemble of {members}"):
        result[kind] = _other(kind, problem, settings, drop, members)
    return result


def _other(
    kind: str, problem: DropProblem, settings: PassSettings, drop: SyntheticDrop, members: int
) -> dict[str, Any]:
    n, n_c = len(problem.mean), problem.n_channels
    numbers = settings.for_sampling(float(problem.time[1] - problem.time[0]), fastest_frequency(problem))
    nis, spent, done, means = math.nan, 0.0, 0, np.empty((0, n))
    for count in (2, len(problem.time)):
        means, E, S = np.empty((count, n)), np.empty((count, n_c + 1)), np.empty((count, n_c + 1))
        head = (
            problem.mean.copy(),
            problem.covariance.copy(),
            problem.time[:count],
            problem.readings[:count],
            problem.speed[:count],
            problem.sensor_rows,
            problem.variances,
            problem.speed_variance,
            problem.targets,
            private_copy(problem.model.parameters),
            numbers,
            len(problem.unknowns),
        )
        started = time.process_time()
        try:
            if kind == "sigma points":
                done = sigma_point_pass(*head, means, E, S)
            else:
                done = ensemble_pass(*head, np.random.default_rng(1), members, means, E, S)
        except np.linalg.LinAlgError as error:
            return {"error": f"covariance lost: {error}"}
        spent = time.process_time() - started
        nis = float(np.nanmean(E[:done] ** 2 / S[:done]))
    return errors(problem, means[:done], drop, nis, spent)


def main() -> None:
    """Run the drops and keep the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="*", default=[4101, 4102, 4103])
    parser.add_argument("--out", type=Path, default=HERE / "results" / "filter_kinds.json")
    arguments = parser.parse_args()
    results = [
        study(seed, hz) for seed, hz in zip(arguments.seeds, (60.0, 100.0, 150.0, 210.0), strict=False)
    ]
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(results, indent=1))
    for result in results:
        print(result["seed"], result["speed_Hz"], "Hz")
        for kind, found in result.items():
            if isinstance(found, dict):
                print("  ", kind, json.dumps(found))


if __name__ == "__main__":
    main()
