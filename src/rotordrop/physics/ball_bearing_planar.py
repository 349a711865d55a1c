"""Ball forces of a touchdown bearing whose race moves in x and y only: the inner loop of a drop.

The algebraic form of Neisi 2020, eqs. (2)–(6): distance of the groove centres instead of contact angles, so
that no ``atan`` and no ``cos`` is left. Balls of all rows that sit at the same angle are one entry with a
weight.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics._compile import inner_kernel, lean_kernel

Array = NDArray[np.float64]


@inner_kernel
def lane_sum(values: Array) -> float:
    """Sum of an array whose length is a multiple of eight, in eight partial sums of fixed order.

    Unit of the values; shape (8 k,). Source: explicit partial sums keep strict floating point and vectorise.
    """
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    for k in range(0, values.shape[0], 8):
        s0 += values[k]
        s1 += values[k + 1]
        s2 += values[k + 2]
        s3 += values[k + 3]
        s4 += values[k + 4]
        s5 += values[k + 5]
        s6 += values[k + 6]
        s7 += values[k + 7]
    return ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7))


@inner_kernel
def planar_ball_force(
    dx: float,
    dy: float,
    radial_offset: float,
    axial_offset: float,
    groove_distance: float,
    K: float,
    cosines: Array,
    sines: Array,
    weights: Array,
    work: Array,
) -> tuple[float, float]:
    """Elastic force [N] of all balls against a race displaced from the outer ring.

    Parameters
    ----------
    dx, dy : float
        Displacement of the inner race relative to the outer ring [m].
    radial_offset, axial_offset : float
        ``A0 cos α0`` and ``A0 sin α0`` + preload approach [m].
    groove_distance : float
        ``A0`` of the unloaded row [m].
    K : float
        Total contact stiffness of a ball [N/m^1.5].
    cosines, sines, weights : ndarray, shape (Z8,)
        Direction of each ball [1] and number of balls there, padded with weight zero to a multiple of eight.
    work : ndarray, shape (2, Z8)
        Scratch [N].

    Returns
    -------
    tuple of float
        Restoring force of the race against its displacement, x and y [N]; the force *on* the race is its
        negative.

    Notes
    -----
    Source: Neisi 2020, eqs. (2)–(6). Differs from the paper: axial offset of an angular-contact row,
    algebraic form.
    """
    axial2 = axial_offset * axial_offset
    for j in range(cosines.shape[0]):
        radial = radial_offset + dx * cosines[j] + dy * sines[j]
        A = math.sqrt(radial * radial + axial2)
        delta = max(A - groove_distance, 0.0)
        q = weights[j] * K * delta * math.sqrt(delta) * radial / A
        work[0, j] = q * cosines[j]
        work[1, j] = q * sines[j]
    return lane_sum(work[0]), lane_sum(work[1])


@lean_kernel
def planar_ball_gradient(
    dx: float,
    dy: float,
    radial_offset: float,
    axial_offset: float,
    groove_distance: float,
    K: float,
    cosines: Array,
    sines: Array,
    weights: Array,
) -> tuple[float, float, float, float, float]:
    """Restoring force [N] with its stiffness: ``F_x, F_y`` [N] and ``k_xx, k_xy, k_yy`` [N/m].

    Arguments as in `planar_ball_force`. Source: Neisi 2020, eqs. (2)–(6), differentiated.
    """
    f_x = f_y = k_xx = k_xy = k_yy = 0.0
    axial2 = axial_offset * axial_offset
    for j in range(cosines.shape[0]):
        radial = radial_offset + dx * cosines[j] + dy * sines[j]
        A = math.sqrt(radial * radial + axial2)
        delta = A - groove_distance
        if delta <= 0.0:
            continue
        root = math.sqrt(delta)
        cos_phi = radial / A
        q = weights[j] * K * delta * root
        k = weights[j] * K * 1.5 * root * cos_phi * cos_phi + q * (1.0 - cos_phi * cos_phi) / A
        q *= cos_phi
        f_x += q * cosines[j]
        f_y += q * sines[j]
        k_xx += k * cosines[j] * cosines[j]
        k_xy += k * cosines[j] * sines[j]
        k_yy += k * sines[j] * sines[j]
    return f_x, f_y, k_xx, k_xy, k_yy


@inner_kernel
def largest_ball_load(
    dx: float,
    dy: float,
    radial_offset: float,
    axial_offset: float,
    groove_distance: float,
    K: float,
    cosines: Array,
    sines: Array,
    weights: Array,
) -> float:
    """Largest load of a single ball [N]; arguments as in `planar_ball_force`.

    Source: Neisi 2020, eq. (6).
    """
    largest = 0.0
    for j in range(cosines.shape[0]):
        if weights[j] > 0.0:
            radial = radial_offset + dx * cosines[j] + dy * sines[j]
            largest = max(largest, radial * radial)
    delta = max(math.sqrt(largest + axial_offset * axial_offset) - groove_distance, 0.0)
    return K * delta * math.sqrt(delta)


@lean_kernel
def planar_ball_energy(
    dx: float,
    dy: float,
    radial_offset: float,
    axial_offset: float,
    groove_distance: float,
    K: float,
    cosines: Array,
    sines: Array,
    weights: Array,
) -> float:
    """Elastic energy [J] in all balls at fixed axial offset, ``Σ 2/5 K δ^(5/2)``; arguments as in
    `planar_ball_force`.

    Source: integral of Neisi 2020, eq. (6).
    """
    energy = 0.0
    for j in range(cosines.shape[0]):
        radial = radial_offset + dx * cosines[j] + dy * sines[j]
        delta = math.sqrt(radial * radial + axial_offset * axial_offset) - groove_distance
        if delta > 0.0:
            energy += weights[j] * 0.4 * K * delta * delta * math.sqrt(delta)
    return energy
