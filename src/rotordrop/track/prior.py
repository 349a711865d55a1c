"""What is known of a drop before its readings: rotor by its first readings, machine by its description."""

from __future__ import annotations

import math

import numpy as np

from rotordrop import units
from rotordrop.arrays import Array
from rotordrop.elements.table import parameter
from rotordrop.evidence.colour import SlowNoise
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import levitated_sag
from rotordrop.rotor.unknowns import Unknown, correlate, inferred_together, sensor_prior, smallest_gap
from rotordrop.track.sensor_form import begin_caught_up, share_in_groups

RUNOUT_SIGMA = 0.5e-6
START_POSITION_SIGMA, BENDING_POSITION_SIGMA, RACE_POSITION_SIGMA = 0.12, 6e-3, 4e-4
"""How far the rotor, its first bending and a race may be from where they were seen, over the air gap [1]."""
START_VELOCITY_SIGMA, BENDING_VELOCITY_SIGMA, RACE_VELOCITY_SIGMA = 0.28, 0.021, 1.4e-3
"""Their velocities at power-off over that of a free fall through the air gap [1]."""
START_ORBIT_SIGMA = 0.03
"""Radius of the orbit of the levitated rotor over the air gap [1]; slower modes bend as far on it."""
RACE_SPIN_SIGMA = 0.3
"""Spin of a race at power-off [rad/s]."""
SPEED_SIGMA = 0.5
"""Error of the rotor speed at power-off, besides its standard error [rad/s]."""
OWN_SIGMA = (0.3e-6, 0.3e-6, 1e-4, 1e-4)
"""How far a foundation may be from rest at power-off, displacement [m] and velocity [m/s], x and y."""
AXIAL_SIGMA = (1e-6, 1e-4)
"""The same of axial motion [m], [m/s]: no sensor shows it, and it is as the machine file simulates it."""
RING_SIGMA = (0.3e-6, 1e-3)
"""The same of rings that springs press on: way [m] and speed [m/s] at power-off, where they rest."""


def fall_time(machine: Machine, gap: float | None = None) -> float:
    """Time [s] of a free fall through a gap [m], the narrowest of a machine by default."""
    return units.fall_time(smallest_gap(machine) if gap is None else gap, float(machine.gravity))


def prior_at_power_off(
    model: DropModel,
    unknowns: tuple[Unknown, ...],
    rows: Array,
    level: Array,
    speed: tuple[float, float],
    noise: SlowNoise,
) -> tuple[Array, Array]:
    """Prior mean (n,) and covariance (n, n) of the whole estimate at power-off.

    ``rows`` (C, s) are the displacements along the sensors by the dynamic state, ``level`` (C,) the first
    readings [m], NaN where there is none; ``speed`` is that of the rotor and its standard error [rad/s]. One
    part of the slow noise of the sensors is as likely as another at power-off.
    """
    layout = model.layout
    s, n_p, n_c = layout.n_dynamic, len(unknowns), rows.shape[0]
    mean = np.zeros(s + n_p + 4 * n_c + len(noise.channel))
    sigma = np.zeros_like(mean)
    mean[:s] = model.at_rest()[:s]
    gap, fall = smallest_gap(model.machine), fall_time(model.machine)
    for part in (layout.race, layout.support):
        sigma[part] = RACE_POSITION_SIGMA * gap
        sigma[layout.velocity_of(part)] = RACE_VELOCITY_SIGMA * float(model.machine.gravity) * fall
    sigma[layout.race_spin] = RACE_SPIN_SIGMA
    mean[layout.rotor_speed] = speed[0]
    sigma[layout.rotor_speed] = math.hypot(SPEED_SIGMA, speed[1])
    for i, unknown in enumerate(unknowns):
        mean[s + i], sigma[s + i] = unknown.mean, unknown.sigma
    for c, sensor in enumerate(model.machine.sensors, start=s + n_p):
        known = sensor_prior(parameter("gain", "sensor"), sensor.gain, gap)
        mean[c], sigma[c] = 1.0 / known.mean - 1.0, known.sigma
        known = sensor_prior(parameter("offset", "sensor"), sensor.offset, gap)
        mean[n_c + c], sigma[n_c + c] = sensor.polarity * known.mean, known.sigma
    gains, offsets = mean[s + n_p : s + n_p + n_c], mean[s + n_p + n_c : s + n_p + 2 * n_c]
    _rotor_prior(model, rows, (level - offsets) / (1.0 + gains), speed[0], mean, sigma)
    sigma[s + n_p + 2 * n_c : s + n_p + 4 * n_c] = RUNOUT_SIGMA
    sigma[s + n_p + 4 * n_c :] = np.sqrt(noise.variance)
    sigma[layout.further_at(L.MOUNT_STATES)] = RACE_POSITION_SIGMA * gap
    own = ((L.RING_STATES, RING_SIGMA), (L.FACE_STATES, AXIAL_SIGMA), (L.BEARING_OWN, OWN_SIGMA))
    for place, sigmas in own:
        at = layout.further_at(place)
        sigma[at] = np.resize(sigmas, at.stop - at.start)
    if layout.moves_axially:
        sigma[layout.axial : layout.axial + 2] = AXIAL_SIGMA
    covariance = np.diag(sigma**2)
    for related in (share_in_groups, inferred_together, correlate):
        related(model, unknowns, covariance[s : s + n_p, s : s + n_p])
    _hold(model, unknowns, mean, covariance)
    if layout.sensor_own:
        begin_caught_up(layout, rows, mean, covariance)
    return mean, covariance


def _hold(model: DropModel, unknowns: tuple[Unknown, ...], mean: Array, covariance: Array) -> None:
    """Let a magnet that stays on hold the rotor where it is at power-off, but for its orbit."""
    layout, orbit = model.layout, START_ORBIT_SIGMA * smallest_gap(model.machine)
    for i, unknown in enumerate(unknowns, start=layout.n_dynamic):
        for axis, modes in ((L.AMB_REFERENCE_X, layout.modal_x), (L.AMB_REFERENCE_Y, layout.modal_y)):
            if not unknown.sets("magnet", axis):
                continue
            seen = np.zeros(len(mean))
            seen[modes] = model.parameters.magnet_shape[unknown.targets[0].row]
            mean[i] = seen @ mean
            covariance[i, :] = covariance[:, i] = covariance @ seen
            covariance[i, i] = seen @ covariance @ seen + orbit**2


def start_of(mean: Array, model: DropModel, unknowns: tuple[Unknown, ...]) -> Array:
    """The prior mean with the unknowns at the guesses of the machine file, which need not be the centre."""
    start = mean.copy()
    first = model.layout.n_dynamic
    start[first : first + len(unknowns)] = [unknown.begin for unknown in unknowns]
    return start


def _rotor_prior(
    model: DropModel, rows: Array, level: Array, omega: float, mean: Array, sigma: Array
) -> None:
    layout, basis = model.layout, model.basis
    gap = smallest_gap(model.machine)
    falling = float(model.machine.gravity) * fall_time(model.machine)
    weight = np.sqrt(model.fe.total_mass)
    frequency = np.sqrt(np.maximum(basis.eigenvalues, 0.0))
    softer = np.where(frequency > 0.0, frequency[2] / np.maximum(frequency, 1.0), 1.0)
    turning = max(abs(omega), 1e-9)  # 0 at standstill, where no mode bends on an orbit
    orbit = START_ORBIT_SIGMA * gap * weight * (omega / np.maximum(frequency, turning)) ** 2
    sag = np.zeros(basis.shapes.shape[0])
    if len(model.machine.ambs) >= 2:
        sag = np.asarray(levitated_sag(model.fe, model.machine), dtype=np.float64)
    amplitude = basis.shapes.T @ (model.fe.mass @ sag)
    amplitude[: basis.n_rigid] = 0.0
    mean[layout.modal_y] = amplitude
    rigid = slice(0, basis.n_rigid)
    observed = level - rows[:, : mean.size][:, layout.modal_y] @ amplitude
    design = np.hstack([rows[:, layout.modal_x][:, rigid], rows[:, layout.modal_y][:, rigid]])
    seen = np.isfinite(observed)
    fitted, *_ = np.linalg.lstsq(design[seen], observed[seen], rcond=None)
    mean[layout.modal_x][rigid] = fitted[: basis.n_rigid]
    mean[layout.modal_y][rigid] += fitted[basis.n_rigid :]
    for part in (layout.modal_x, layout.modal_y):
        position = BENDING_POSITION_SIGMA * gap * weight * softer**2 + 0.2 * np.abs(amplitude)
        velocity = BENDING_VELOCITY_SIGMA * falling * weight * softer
        position[rigid] = START_POSITION_SIGMA * gap * weight
        velocity[rigid] = START_VELOCITY_SIGMA * falling * weight
        sigma[part] = np.hypot(position, orbit)
        sigma[layout.velocity_of(part)] = np.hypot(velocity, omega * orbit)
