"""Where the rotor of a machine with structures lies at rest, and the energy it holds on its way there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.physics.ball_set import ball_set_energy
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import contact_energy
from rotordrop.rotor.parameters import DropModel
from rotordrop_bench import _hidden_rhs as H
from rotordrop_bench.settled import coordinate_masses, lowest_energy, settled_coordinates, without_magnets

Array = NDArray[np.float64]

LONG_AFTER = 1e9
"""Time [s] at which all that drifts has come to its end."""

DIFFERENCE = 1e-9
"""Step of the difference quotients of the stiffness [√kg m, m]; small against every indentation."""


def hidden_rest(model: DropModel, rows: Array | None) -> Array:
    """Coordinates (modal amplitudes, races, supports) of the rotor at rest, shape (n_q,).

    Without structures those of `settled_coordinates`. With them the nearest lowest energy; slip in a support
    has crept to nothing, the cage stands where it stood.
    """
    plain = settled_coordinates(model)
    if rows is None:
        return plain
    parameters, n_q = without_magnets(model), model.layout.n_coordinates
    own = _own_places(model, rows)
    places = np.concatenate([np.arange(n_q), [place for place, _ in own]]).astype(int)
    mass = np.concatenate([coordinate_masses(model), [m for _, m in own]])
    template = np.zeros(model.layout.size + len(rows) * H.N_STATES)

    def completed(coordinates: Array) -> Array:
        state = template.copy()
        state[places] = coordinates
        return state

    def force(coordinates: Array) -> Array:
        rates = H.hidden_rates(LONG_AFTER, completed(coordinates), parameters, rows)
        # the rate of the velocity that belongs to each coordinate
        behind = np.where(places < n_q, places + n_q, places + 2)
        return np.asarray(mass * rates[behind])

    def force_and_stiffness(coordinates: Array) -> tuple[Array, Array]:
        stiffness = np.empty((len(coordinates), len(coordinates)))
        for i in range(len(coordinates)):
            step = np.zeros(len(coordinates))
            step[i] = DIFFERENCE
            stiffness[:, i] = (force(coordinates - step) - force(coordinates + step)) / (2.0 * DIFFERENCE)
        return force(coordinates), 0.5 * (stiffness + stiffness.T)

    found = lowest_energy(
        np.concatenate([plain, np.zeros(len(own))]),
        mass,
        float(np.max(np.abs(parameters.gravity))),
        lambda q: hidden_energy(LONG_AFTER, completed(q), parameters, rows),
        force_and_stiffness,
        model.machine.name,
    )
    return found[:n_q]


def _own_places(model: DropModel, rows: Array) -> list[tuple[int, float]]:
    """Places of the displacements that structures add, each with its mass [kg]."""
    found = []
    for b, row in enumerate(rows):
        first = model.layout.size + b * H.N_STATES
        for compliance, place in ((H.FOUNDATION_COMPLIANCE, H.FOUNDATION_X), (H.TILT_COMPLIANCE, H.TILT_X)):
            if row[compliance] > 0.0:
                found += [(first + place + axis, 1.0 / row[compliance]) for axis in (0, 1)]
    return found


def hidden_energy(t: float, y: Array, p: KernelParameters, rows: Array) -> float:
    """Energy [J] of a state: motion, bending, contacts, balls, supports, foundations, tilt, gravity, spin."""
    n_q, m = int(p.rotor_at[L.N_COORDINATES]), len(p.eigenvalue)
    x, z = int(p.rotor_at[L.MODES_X]), int(p.rotor_at[L.MODES_Y])
    qx, qy = y[x : x + m], y[z : z + m]
    sx, sy = y[n_q + x : n_q + x + m], y[n_q + z : n_q + z + m]
    energy = 0.5 * float(sx @ sx + sy @ sy) + 0.5 * float(
        p.eigenvalue @ (qx**2 + qy**2) - 2.0 * p.gravity @ qy
    )
    energy += 0.5 * float(p.spin[L.POLAR_INERTIA]) * float(y[p.rotor_at[L.ROTOR_SPEED]]) ** 2
    for b, s in enumerate(rows):
        first = len(y) - len(rows) * H.N_STATES + b * H.N_STATES
        own = y[first : first + H.N_STATES]
        energy += _bearing_energy(t, b, y, own, p, s)
    return energy


def _bearing_energy(t: float, b: int, y: Array, own: Array, p: KernelParameters, s: Array) -> float:
    n_q, row = int(p.rotor_at[L.N_COORDINATES]), p.bearing[b]
    r, h = int(p.bearing_at[b, L.RACE]), int(p.bearing_at[b, L.SUPPORT])
    m = len(p.eigenvalue)
    x, z = int(p.rotor_at[L.MODES_X]), int(p.rotor_at[L.MODES_Y])
    shape = p.bearing_shape[b]
    race, support = y[r : r + 2], y[h : h + 2]
    rotor = np.array([shape @ y[x : x + m], shape @ y[z : z + m]])
    apart = rotor - race - own[H.TILT_X : H.TILT_Y + 1] - s[[H.CENTRE_X, H.CENTRE_Y]]
    drift = s[H.GAP_DRIFT] * min(t / s[H.GAP_DRIFT_TIME], 1.0)
    gap = row[L.AIR_GAP] + drift - s[H.GAP_CLOSING] * (1.0 - math.exp(-own[H.HEAT] / s[H.GAP_HEAT]))
    energy = _stored_in_contact(math.hypot(*apart) - gap, row[L.CONTACT : L.CONTACT_END], s)
    c, sine = math.cos(own[H.CAGE_ANGLE]), math.sin(own[H.CAGE_ANGLE])
    dx, dy = race - support
    balls = row[L.BALL_SET : L.BALL_SET_END]
    energy += ball_set_energy(balls, p.balls[b], c * dx + sine * dy, c * dy - sine * dx)
    energy += row[L.RACE_WEIGHT] * race[1]
    energy += _support_energy(support - own[H.FOUNDATION_X : H.FOUNDATION_Y + 1], row, s)
    energy += 0.5 * s[H.SLIP_FORCE] * s[H.SLIP_TRAVEL] * float(np.sum(own[H.SLIP_X : H.SLIP_Y + 1] ** 2))
    energy += 0.5 * row[L.RACE_MASS] * float(np.sum(y[n_q + r : n_q + r + 2] ** 2))
    energy += 0.5 * float(row[[L.SUPPORT_MASS_X, L.SUPPORT_MASS_Y]] @ y[n_q + h : n_q + h + 2] ** 2)
    energy += 0.5 * row[L.RACE_INERTIA] * float(y[p.bearing_at[b, L.RACE_SPIN]]) ** 2
    squares = s[[H.FOUNDATION_SQUARE_X, H.FOUNDATION_SQUARE_Y]]
    for compliance, square, place in (
        (s[H.FOUNDATION_COMPLIANCE], squares, H.FOUNDATION_X),
        (s[H.TILT_COMPLIANCE], np.full(2, s[H.TILT_SQUARE]), H.TILT_X),
    ):
        if compliance > 0.0:
            energy += 0.5 * float(square @ own[place : place + 2] ** 2) / compliance
            energy += 0.5 * float(np.sum(own[place + 2 : place + 4] ** 2)) / compliance
    return float(energy)


def _support_energy(deflection: Array, row: Array, s: Array) -> float:
    """Energy of the springs of a support [J]."""
    c, sine, k = s[H.AXIS_COSINE], s[H.AXIS_SINE], s[H.HARDENING]
    x, y = deflection
    along, across = c * x + sine * y, c * y - sine * x
    first, second = row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y]
    if s[H.RADIAL] > 0.0:
        share = 1.0 + 0.5 * k * (x * x + y * y)
        return float(0.5 * (first * along**2 + second * across**2) * share)
    return float(
        0.5 * first * along**2 * (1.0 + 0.5 * k * along**2)
        + 0.5 * second * across**2 * (1.0 + 0.5 * k * across**2)
    )


def _stored_in_contact(delta: float, law: Array, s: Array) -> float:
    """Energy of the contact [J], piece by piece where its law has pieces."""
    if delta <= 0.0:
        return 0.0
    pieces = int(s[H.LAW_PIECES])
    if pieces == 0:
        return float(contact_energy(law, delta))
    energy, low = 0.0, 0.0
    for i in range(pieces):
        at = H.LAW + i * H.LAW_WIDTH
        piece, until = s[at : at + H.LAW_UNTIL], s[at + H.LAW_UNTIL]
        high = delta if i == pieces - 1 else min(delta, until)
        energy += contact_energy(piece, high) - (contact_energy(piece, low) if low > 0.0 else 0.0)
        if high == delta:
            break
        low = high
    return float(energy)
