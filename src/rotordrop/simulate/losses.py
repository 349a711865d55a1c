"""Where the energy of a simulated drop goes: contact, friction, ball set, support, ring, bending."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.physics import support
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.result import DropResult

Array = NDArray[np.float64]

FINE_ENOUGH = 5e-5
"""Step [s] of the sums over the output: the power of the race on its balls turns over at twice some 7 kHz,
and an alias does not shift its mean. Sums five times finer differ by at most 1 % of any part."""


@dataclass(frozen=True, kw_only=True)
class Losses:
    """Energy that a drop dissipated, by place [J]; shape (B,) where it belongs to a bearing.

    Attributes
    ----------
    sliding : ndarray
        Heat of sliding between rotor and race.
    contact : ndarray
        Lost in the normal direction of the contacts.
    ball_set : ndarray
        Damping between race and support.
    support : ndarray
        Damping of support and foundation.
    drag : ndarray
        Friction inside the bearing that brakes the race.
    spin_up : ndarray
        Work of friction on the spin of the race: its kinetic energy and what drag took of it. No loss of its
        own: the drag is counted above, the rest is still in the race.
    bending : float
        Damping of the rotor's modes.
    """

    sliding: Array
    contact: Array
    ball_set: Array
    support: Array
    drag: Array
    spin_up: Array
    bending: float

    @property
    def total(self) -> float:
        """Sum of all that is lost; equals the book of the time loop but for the step of the output."""
        parts = (self.sliding, self.contact, self.ball_set, self.support, self.drag)
        return float(sum(part.sum() for part in parts)) + self.bending


def losses(model: DropModel, result: DropResult) -> Losses:
    """Split the energy that a drop dissipated.

    Parameters
    ----------
    model : DropModel
        The model that was simulated.
    result : DropResult
        Its drop. Contacts are summed within the integrator's steps, all else by the trapezoidal rule over the
        output grid.

    Notes
    -----
    Source: the powers of the right-hand side (Neisi 2020, eqs. 1, 9 and 11), place by place.
    """
    layout, row, log = model.layout, model.parameters.bearing, result.contacts
    n_b = layout.n_bearings
    every = max(1, round(FINE_ENOUGH / float(result.time[1] - result.time[0])))
    chosen = np.append(np.arange(0, len(result.time) - 1, every), len(result.time) - 1)
    time, state, spin = result.time[chosen], result.state[chosen], result.race_speed[chosen]
    sliding: Array = np.bincount(log.bearing, log.sliding_energy, n_b).astype(np.float64)
    both: Array = np.bincount(log.bearing, log.dissipated_energy, n_b).astype(np.float64)
    race = state[:, layout.velocity_of(layout.race)].reshape(-1, n_b, 2)
    mount = state[:, layout.velocity_of(layout.support)].reshape(-1, n_b, 2)
    force = np.linalg.norm(result.bearing_force[chosen], axis=-1)
    torque = row[:, L.DRAG_COEFFICIENT] * 0.5 * row[:, L.PITCH_DIAMETER] * force
    drag = _sum(time, torque * np.tanh(spin / row[:, L.DRAG_SPEED]) * spin)
    squared = np.sum((race - mount) ** 2, axis=-1)
    gained = 0.5 * row[:, L.RACE_INERTIA] * (spin[-1] ** 2 - spin[0] ** 2)
    n_q, m = layout.n_coordinates, layout.n_modes
    rates = state[:, n_q : n_q + 2 * m]
    bending = np.einsum("tk,tk,k->t", rates, rates, np.tile(model.parameters.damping, 2), optimize=True)
    return Losses(
        sliding=sliding,
        contact=both - sliding,
        ball_set=row[:, L.BEARING_DAMPING] * _sum(time, squared),
        support=np.array([_of_support(model, time, state, b) for b in range(n_b)]),
        drag=drag,
        spin_up=gained + drag,
        bending=float(_sum(time, bending)),
    )


def _sum(time: Array, power: Array) -> Array:
    return np.asarray(np.trapezoid(power, time, axis=0))


def _of_support(model: DropModel, time: Array, state: Array, b: int) -> float:
    """Energy lost in a support and, where it gives way, in its foundation [J]."""
    row, own = model.parameters.bearing[b], int(model.parameters.bearing_at[b, L.BEARING_OWN])
    velocity = state[:, model.layout.velocity_of(model.layout.support)][:, 2 * b : 2 * b + 2]
    moved = velocity if own < 0 else velocity - state[:, own + 2 : own + 4]
    damping = row[[L.SUPPORT_DAMPING_X, L.SUPPORT_DAMPING_Y]]
    lost = float(_sum(time, moved**2) @ damping)
    form = row[L.SUPPORT_FORM : L.SUPPORT_FORM_END]
    if own >= 0 and form[support.FOUNDATION_SHARE] > 0.0:
        mass = row[L.SUPPORT_MASS_Y] / form[support.FOUNDATION_SHARE]
        damper = 2.0 * form[support.FOUNDATION_DAMPING] * form[support.FOUNDATION_SPEED] * mass
        lost += damper * float(_sum(time, state[:, own + 2 : own + 4] ** 2).sum())
    return lost
