"""Initial state the paper's way: displacements and smoothed velocities, expanded to all freedoms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError
from rotordrop.evidence.contacts import local_polynomial
from rotordrop.rotor.parameters import DropModel

SMOOTHING = 2e-3
"""Width of the window from which displacement and velocity at power-off are taken [s]."""


@dataclass(frozen=True, kw_only=True)
class ExpandedState:
    """Initial state by modal expansion; m modes per plane, B bearings."""

    amplitudes: Array
    """Amplitudes (x, y) and their velocities; zero beyond the modes used, shape (2, m, 2)."""
    at_bearings: Array
    """Displacement [m] and velocity [m/s] at the bearing nodes, shape (2, B, 2)."""


def expansion_matrix(rows: Array, modes: int) -> Array:
    """Amplitudes of the lowest modes per measured displacement, ``(QΦ)^+``, shape (2·modes, S).

    ``rows`` (S, 2m) is the displacement along each sensor per amplitude, QΦ of all modes, x amplitudes before
    y; of the modes per plane at most half the number of sensors can be used.

    Source: Neisi 2020, eqs. (14)–(16). Differs from the paper: pseudo-inverse with a rank check instead of
    the normal equations.

    Raises
    ------
    IdentificationError
        If the sensors cannot tell these modes apart.
    """
    m = rows.shape[1] // 2
    chosen = rows[:, [*range(modes), *range(m, m + modes)]]
    strength = np.linalg.svd(chosen / np.maximum(np.linalg.norm(chosen, axis=0), 1e-300), compute_uv=False)
    if len(chosen) < 2 * modes or strength[-1] < 0.02:
        weakest = strength[-1] if len(chosen) >= 2 * modes else 0.0
        raise IdentificationError(
            f"{len(chosen)} sensors cannot tell {modes} modes per plane apart: smallest singular value "
            f"{weakest:.2g}, "
            "at least 0.02 is needed. The sensor planes coincide or lie in a node of a mode: give the "
            "sensors' true nodes, or use fewer modes."
        )
    return np.asarray(np.linalg.pinv(chosen), dtype=np.float64)


def expand_initial_state(
    time: Array, along: Array, rows: Array, model: DropModel, *, modes: int = 2
) -> ExpandedState:
    """Initial displacement and velocity at all degrees of freedom by modal expansion.

    Displacements along the sensors (N, S) [m] have their zeros taken off, times (N,) count from power-off
    [s], ``rows`` (S, s) give the former from the states; 2 modes per plane are the rigid ones of the paper.

    Source: Neisi 2020, section 3.1. The velocity comes from a local polynomial through samples on both sides
    of power-off. Sensors need not sit at the bearing nodes.
    """
    live = np.isfinite(along).any(axis=0)
    known = np.isfinite(along[:, live]).all(axis=1)
    seen = local_polynomial(time[known], along[known][:, live], 0.0, width=SMOOTHING, order=2)
    x, y = model.layout.modal_x, model.layout.modal_y
    inverse = expansion_matrix(np.hstack([rows[live][:, x], rows[live][:, y]]), modes)
    amplitudes = np.zeros((2, model.basis.size, 2))
    amplitudes[:, :modes] = [(inverse @ one).reshape(2, modes).T for one in seen]
    return ExpandedState(amplitudes=amplitudes, at_bearings=model.parameters.bearing_shape @ amplitudes)
