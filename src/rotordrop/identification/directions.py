"""Directions of a fall's uncertainty that move the drop after it most.

The fit of the fall leaves some sixty unknowns with their covariance. A few combinations of them matter to the
impacts; the fit of the supports follows those, and the draws of its uncertainty add the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.evidence.initial_state import InitialState, covariance_root
from rotordrop.identification.replica import Replica

Array = NDArray[np.float64]

DIRECTIONS = 16
"""Directions of the initial state's uncertainty that are fitted along."""

TANGENT = 1e-3
"""Step of the tangent of the start state, in standard deviations of each unknown of the fall."""


@dataclass(frozen=True, kw_only=True)
class Directions:
    """Directions of the fall's unknowns, one standard deviation each, that which matters most first."""

    unknowns: Array
    """Change of the unknowns of the fall, shape (u, K)."""
    states: Array
    """Change of the state at the start of the simulation, shape (n, K)."""
    unbalances: Array
    """Change of the modal unbalance, shape (2, m, K)."""
    remaining: Array
    """A square root of what is left of the covariance, shape (u, u)."""


def influential_directions(replica: Replica, count: int = DIRECTIONS) -> Directions:
    """Directions of the fall's unknowns that move the drop most.

    They follow from the covariance and from the tangent of the start state, so they are the same whichever
    square root of the covariance stands between: along secants over its columns they would not be, because
    the remanent force decays with one of the unknowns.
    """
    initial = replica.initial
    root = initial.square_root()
    state_slope, unbalance_slope = _start_slopes(replica)
    changes, unbalances = state_slope @ root, unbalance_slope @ root
    effects = np.vstack([*_effects(replica, changes, unbalances), *_told_by_sensors(initial, root)])
    _, _, turned = np.linalg.svd(effects, full_matrices=True)
    leading = turned[:count].T
    unknowns, left = root @ leading, root @ turned[count:].T
    largest = np.argmax(np.abs(unknowns) / np.sqrt(np.diag(initial.covariance))[:, None], axis=0)
    signs = np.sign(unknowns[largest, np.arange(count)])
    unknowns, leading = unknowns * signs, leading * signs
    return Directions(
        unknowns=unknowns,
        states=changes @ leading,
        unbalances=unbalances @ leading,
        remaining=covariance_root(left @ left.T),
    )


def _start_slopes(replica: Replica) -> tuple[Array, Array]:
    """Change of the start state (n, u) and of the modal unbalance (2, m, u) per unknown of the fall."""
    initial = replica.initial
    states, unbalances = [], []
    for k, sigma in enumerate(np.sqrt(np.diag(initial.covariance))):
        step = np.zeros(len(initial.mean))
        step[k] = TANGENT * sigma
        above, below = (replica.start_state(initial.mean + s) for s in (step, -step))
        states.append((above[0] - below[0]) / (2.0 * step[k]))
        unbalances.append((above[1] - below[1]) / (2.0 * step[k]))
    return np.column_stack(states), np.stack(unbalances, axis=-1)


def _effects(replica: Replica, changes: Array, unbalances: Array) -> list[Array]:
    """What directions change at the bearings, in the low modes and by unbalance, over what is seen of it."""
    layout, p, speed = replica.model.layout, replica.model.parameters, replica.initial.fall.speed
    reach = np.max(np.abs(p.bearing_shape), axis=0)[:, None]
    effects = []
    for place in (layout.modal_x, layout.modal_y):
        rate = layout.velocity_of(place)
        effects += [p.bearing_shape @ changes[place] / 1e-6, p.bearing_shape @ changes[rate] / 3e-4]
        effects += [(reach * changes[place])[2:5] / 1e-6, (reach * changes[rate])[2:5] / 1e-3]
    answer = speed**2 / np.maximum(np.abs(p.eigenvalue - speed**2), 0.2 * speed**2)
    return effects + [(reach * answer[:, None] * part)[:5] / 1e-6 for part in unbalances]


def _told_by_sensors(initial: InitialState, root: Array) -> list[Array]:
    return [root[initial.unknowns.gain] / 5e-3, root[initial.unknowns.rest] / 5e-6]
