"""Touchdown-bearing force and stress from a smoothed drop, with their standard deviations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError
from rotordrop.physics import columns as L
from rotordrop.physics._compile import kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.simulate._loop import contact_at, deflected_loads
from rotordrop.simulate._rhs import (
    Scratch,
    deflected_force,
    race_deflection,
    race_travel,
    ring_travel,
    scratch_of,
)
from rotordrop.track._arrays import copy_into
from rotordrop.track._filter import LARGEST_DEFLECTION
from rotordrop.track._propagation import ParameterTargets, apply_parameters, rk4_step
from rotordrop.track.problem import WATCHED, DropProblem, parameters_at, private_copy
from rotordrop.track.smoother import Smoothed

LOOSE_FORCE_SIGMA, LOOSE_STRESS_SIGMA = 0.04, 0.025
"""Relative standard deviations of force and stress of a loose race, which was followed as a held one [1]."""

FORCE_X, FORCE_Y, FORCE, STRESS = range(4)
N_VALUES = 4


@kernel
def bearing_values(
    dx: float,
    dy: float,
    axial: float,
    b: int,
    p: KernelParameters,
    work: Scratch,
    out: Array,
    along: float = 0.0,
    spin: float = 0.0,
) -> None:
    """Ball force on the race in x and y and its magnitude [N] and the stress [Pa] at a deflection [m].

    The axial offset of the balls is set to ``axial`` [m] and stays so. ``along`` [m] is how far a race with
    faces has moved axially, ``spin`` [rad/s] what balls with inertia turn with; the stress is that of the
    race that has the larger one.
    """
    p.bearing[b, L.SET_UNKNOWN] = axial
    F_x, F_y, _by_spin = deflected_force(b, dx, dy, 0.0, along, spin, p, work)
    _load, inner, outer = deflected_loads(b, dx, dy, 0.0, along, spin, p)
    out[FORCE_X] = -F_x
    out[FORCE_Y] = -F_y
    out[FORCE] = np.sqrt(F_x * F_x + F_y * F_y)
    out[STRESS] = max(inner, outer)


@kernel
def states_between(
    times: Array, means: Array, targets: ParameterTargets, p: KernelParameters, substeps: int, fine: Array
) -> None:
    """Fill ``fine`` (1 + (N - 1) ``substeps``, n) with estimates (N, n) at ``times`` (N,) [s] and between.

    Between samples the rotor moves by the model. What the next sample has beside that has come evenly. Where
    the explicit step does not bear the estimated numbers, a model that lost the record, lies a straight line.
    """
    s, count, work = p.rotor_at[L.N_DYNAMIC], p.rotor_at[L.N_STATES], scratch_of(p)
    y, trial, rates = np.zeros(count), np.empty(count), np.zeros((5, count))
    copy_into(means[-1], fine[-1])
    for i in range(means.shape[0] - 1):
        apply_parameters(means[i, s : s + targets.logarithmic.shape[0]], targets, p)
        h = (1.0 + p.spin[L.CLOCK_ERROR]) * (times[i + 1] - times[i]) / substeps
        copy_into(means[i, :s], y)
        for k in range(substeps):
            copy_into(means[i], fine[i * substeps + k])
            copy_into(y[:s], fine[i * substeps + k, :s])
            rk4_step(times[i] + k * h, h, y, p, rates, trial, work)
        largest, unstable = np.max(np.abs(means[i + 1, :s])), False
        for j in range(s):
            unstable |= not abs(y[j]) < 10.0 * largest
        for k in range(1, substeps):
            for j in range(s):
                if unstable:
                    fine[i * substeps + k, j], y[j] = means[i, j], means[i, j]
                fine[i * substeps + k, j] += k / substeps * (means[i + 1, j] - y[j])


@kernel
def force_values(
    times: Array,
    means: Array,
    s: int,
    targets: ParameterTargets,
    p: KernelParameters,
    n_parameters: int,
    values: Array,
    gradients: Array,
    contacts: Array,
) -> None:
    """Fill values (N, B, 4), their gradients (N, B, 4, 3) and contacts (N, B, 6) at ``times`` (N,) [s].

    Gradients are by race deflection x, y and axial offset, less the way of sprung rings. Values are ball
    force on the race x, y, its magnitude [N] and inner-race stress [Pa]; contacts as in `contact_at`.
    """
    work = scratch_of(p)
    above = np.empty(N_VALUES)
    below = np.empty(N_VALUES)
    y = np.zeros(p.rotor_at[L.N_STATES])
    step_d = 1e-9
    for i in range(means.shape[0]):
        apply_parameters(means[i, s : s + n_parameters], targets, p)
        copy_into(means[i, :s], y)
        for b in range(p.bearing.shape[0]):
            dx, dy = race_deflection(b, y, p)
            described = p.bearing[b, L.SET_UNKNOWN]
            axial = described - ring_travel(b, y, p)
            contact_at(times[i], p.bearing_at[b, L.CONTACTS], y, p, contacts[i, b])
            along, spin = race_travel(b, y, p), y[p.bearing_at[b, L.RACE_SPIN]]
            bearing_values(dx, dy, axial, b, p, work, values[i, b], along, spin)
            for c in range(3):
                ex = step_d if c == 0 else 0.0
                ey = step_d if c == 1 else 0.0
                es = step_d if c == 2 else 0.0
                bearing_values(dx + ex, dy + ey, axial + es, b, p, work, above, along, spin)
                bearing_values(dx - ex, dy - ey, axial - es, b, p, work, below, along, spin)
                for v in range(N_VALUES):
                    gradients[i, b, v, c] = (above[v] - below[v]) / (2.0 * step_d)
            p.bearing[b, L.SET_UNKNOWN] = described


@dataclass(frozen=True, kw_only=True)
class ForceHistory:
    """Forces of a smoothed drop; N steps, B bearings."""

    time: Array
    """Time from power-off [s], shape (N,)."""
    substeps: int
    """Steps for each sample of the record [1]."""
    force: Array
    """Elastic ball force on the race [N], shape (N, B, 2)."""
    magnitude: Array
    magnitude_sigma: Array
    """Its magnitude and standard deviation [N], shape (N, B)."""
    stress: Array
    stress_sigma: Array
    """Largest Hertz stress at the inner race and standard deviation [Pa], shape (N, B)."""
    indentation: Array
    contact_force: Array
    contact_power: Array
    """Indentation [m], normal force [N], power lost in the contact [W], shape (N, B)."""
    indentation_sigma: Array
    """Standard deviation of the indentation [m], that of a bearing centre left out, shape (N, B)."""
    azimuth: Array
    """Direction of the contact normal from race to rotor [rad ccw from +x]; NaN in flight, shape (N, B)."""
    displacement: Array
    displacement_sigma: Array
    """Rotor at the bearing nodes and standard deviation [m], shape (N, B, 2)."""
    friction_sigma: Array
    """Relative standard deviation of the dynamic friction coefficient [1], shape (B,); zero where it is not
    estimated."""


def _values_at(problem: DropProblem, times: Array, means: Array) -> tuple[Array, Array, Array]:
    """What `force_values` fills, at ``times`` (N,) [s] and estimates (N, n)."""
    n_b, p = problem.model.layout.n_bearings, private_copy(problem.model.parameters)
    values, contacts = np.empty((len(means), n_b, N_VALUES)), np.empty((len(means), n_b, 6))
    gradients, s = np.empty((len(means), n_b, N_VALUES, 3)), problem.n_dynamic
    count = len(problem.unknowns)
    p.form.of(force_values)(times, means, s, problem.targets, p, count, values, gradients, contacts)
    return values, gradients, contacts


def force_history(problem: DropProblem, smoothed: Smoothed) -> ForceHistory:
    """Force and stress histories of a smoothed drop with standard deviations from the smoothed covariance.

    They have the steps of the filter and the variances of its samples: at 10 kHz a race rings so fast that
    the largest force of a rotor of 5 to 30 kg is up to 12 % higher between samples.
    """
    substeps, samples = smoothed.filtered.settings.substeps, len(smoothed.means)
    steps = np.arange(1 + (samples - 1) * substeps)
    time = np.interp(steps / substeps, np.arange(samples), problem.time[:samples])
    means, p = np.empty((len(steps), smoothed.means.shape[1])), private_copy(problem.model.parameters)
    p.form.of(states_between)(problem.time, smoothed.means, problem.targets, p, substeps, means)
    smoothed = replace(smoothed, means=means, watched=smoothed.watched[steps // substeps])
    values, gradients, contacts = _values_at(problem, time, means)
    sigma = _standard_deviations(smoothed, gradients)
    for b in range(values.shape[1]):
        if problem.model.play_sigma(b) > 0.0:
            for part, share in ((FORCE, LOOSE_FORCE_SIGMA), (STRESS, LOOSE_STRESS_SIGMA)):
                sigma[:, b, part] = np.hypot(sigma[:, b, part], share * values[:, b, part])
    displacement, displacement_sigma = displacements_of(problem, smoothed)
    touching = contacts[..., 0] > 0.0
    return ForceHistory(
        time=time,
        substeps=substeps,
        force=values[..., FORCE_X : FORCE_Y + 1],
        magnitude=values[..., FORCE],
        magnitude_sigma=sigma[..., FORCE],
        stress=values[..., STRESS],
        stress_sigma=sigma[..., STRESS],
        indentation=contacts[..., 0],
        contact_force=contacts[..., 1],
        contact_power=contacts[..., 5],
        indentation_sigma=_indentation_sigma(problem, smoothed),
        azimuth=np.where(touching, np.arctan2(contacts[..., 4], contacts[..., 3]), np.nan),
        displacement=displacement,
        displacement_sigma=displacement_sigma,
        friction_sigma=_friction_sigma(problem, smoothed),
    )


def force_gradient(problem: DropProblem, mean: Array, b: int) -> Array:
    """Derivative of the force [N] of bearing ``b`` by the whole estimate ``mean`` (n,), shape (n,)."""
    _, gradients, _ = _values_at(problem, np.zeros(1), mean[None].copy())
    rows = problem.watched_rows(problem.model.bearing_names[b])[:3]
    return np.asarray(gradients[0, b, FORCE] @ rows)


def stress_at_force(problem: DropProblem, theta: Array, b: int, force: Array) -> float:
    """Largest Hertz stress [Pa] at the inner race of bearing ``b`` under a static force (2,) [N].

    The preload is that of the parameters ``theta`` (P,); the deflection is along the force, the race stands.
    """
    from scipy.optimize import brentq

    p = parameters_at(problem, theta)
    size = float(np.hypot(force[0], force[1]))
    along = np.asarray(force) / max(size, 1e-300)
    work, out = scratch_of(p), np.empty(N_VALUES)

    fill_values = p.form.of(bearing_values)

    def lacking(deflection: float) -> float:
        fill_values(
            deflection * along[0], deflection * along[1], p.bearing[b, L.SET_UNKNOWN], b, p, work, out
        )
        return float(out[FORCE]) - size

    if lacking(0.0) >= 0.0:  # no force beyond the rounding of the preload's balance
        return float(out[STRESS])
    largest = LARGEST_DEFLECTION * p.bearing[b, L.AIR_GAP]
    if lacking(largest) < 0.0:
        raise IdentificationError(
            f"{problem.model.bearing_names[b]}: a bearing force of {size:.0f} N was found, which deflects "
            f"its race by more than {1e3 * largest:.1f} mm; expected less. The record and the "
            "machine do not belong together, or a sensor is wrong; check units, sensors and bearing data."
        )
    lacking(brentq(lacking, 0.0, largest, xtol=1e-12))  # leaves the stress at the root in `out`
    return float(out[STRESS])


def _standard_deviations(smoothed: Smoothed, gradients: Array) -> Array:
    sigma = np.empty(gradients.shape[:3])
    for b in range(gradients.shape[1]):
        block = _block(smoothed, b)[:, :3, :3]
        g = gradients[:, b]
        sigma[:, b] = np.sqrt(np.maximum(np.einsum("nvi,nij,nvj->nv", g, block, g), 0.0))
    return sigma


def _block(smoothed: Smoothed, b: int) -> Array:
    """Covariance of the watched functions of one bearing, shape (N, `WATCHED`, `WATCHED`)."""
    own = slice(WATCHED * b, WATCHED * (b + 1))
    return smoothed.watched[:, own, own]


def _indentation_sigma(problem: DropProblem, smoothed: Smoothed) -> Array:
    """Standard deviation of the distance between rotor and race less the air gap [m], shape (N, B)."""
    found = []
    for b, name in enumerate(problem.model.bearing_names):
        apart = smoothed.means @ problem.watched_rows(name)[5:7].T
        along = np.column_stack([apart / np.hypot(*apart.T)[:, None], np.full(len(apart), -1.0)])
        variance = np.einsum("ni,nij,nj->n", along, _block(smoothed, b)[:, 5:, 5:], along)
        found.append(np.sqrt(np.maximum(variance, 0.0)))
    return np.stack(found, axis=1)


def _friction_sigma(problem: DropProblem, smoothed: Smoothed) -> Array:
    bearings = range(problem.model.layout.n_bearings)
    places = [problem.entries_that_set("bearing", b, L.FRICTION_DYNAMIC) for b in bearings]
    if not any(places):
        return np.zeros(len(places))
    variances = np.diag(smoothed.covariance(smoothed.filtered.parameter_sample))
    return np.sqrt(np.maximum(variances[[entries[0] for entries in places]], 0.0))


def predicted_readings(problem: DropProblem, smoothed: Smoothed) -> Array:
    """Readings that the smoothed motion gives, without the noise of the sensors [m], shape (N, C)."""
    means, form, s, n_c = smoothed.means, problem.sensor_form, problem.n_dynamic, problem.n_channels
    seen = means[:, :s] @ problem.reading_rows.T
    if len(form.lag) == 0:  # what a sensor lags behind of has its terms
        for (c, unknown), row in zip(form.term, form.term_row, strict=True):
            seen[:, c] += means[:, s + unknown] * (means[:, :s] @ row)
    first, angle = s + len(problem.unknowns), means[:, problem.model.layout.rotor_angle, None]
    gain, offset, cosine, sine = (means[:, first + k * n_c : first + (k + 1) * n_c] for k in range(4))
    return np.asarray((1.0 + gain) * seen + offset + cosine * np.cos(angle) + sine * np.sin(angle))


def displacements_of(problem: DropProblem, smoothed: Smoothed) -> tuple[Array, Array]:
    """Displacement at the bearings and its standard deviation [m]."""
    values, sigma = [], []
    for b, name in enumerate(problem.model.bearing_names):
        values.append(smoothed.means @ problem.watched_rows(name)[3:5].T)
        variance = np.diagonal(_block(smoothed, b), axis1=1, axis2=2)[:, 3:5]
        sigma.append(np.sqrt(np.maximum(variance, 0.0)))
    return np.stack(values, axis=1), np.stack(sigma, axis=1)
