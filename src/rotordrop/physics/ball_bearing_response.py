"""Forces, moments, ball loads, stresses, stiffness of a ball bearing: its race moves in five directions.

Displacements and forces are ordered (x, y, z, ψ_x, ψ_y). The elastic energy of the balls is the source of
everything: the force on the race is minus its gradient, the stiffness its second derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.physics.ball_bearing import BearingConstants

_PALMGREN_RADIAL = 4.36e-8
"""Palmgren's ``δ_r cos α = 4.36e-8 (Q²/D_w)^(1/3)`` for steel, in metre and newton."""
_STRIBECK_LOAD_FACTOR = 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class BearingResponse:
    """What a ball bearing does at a displacement of its inner race.

    Notes
    -----
    Source: Neisi 2020, eqs. (2)–(7).
    """

    force: Array
    """Force and moment *on the race* (F_x, F_y, F_z [N], M_x, M_y [N m]), shape (5,)."""
    stiffness: Array
    """Tangent stiffness, minus the derivative of the force [N/m, N, N m]; symmetric, shape (5, 5)."""
    energy: float
    """Elastic energy in all balls [J]."""
    ball_loads: Array
    """Load of each ball [N], shape (rows, Z)."""
    contact_angles: Array
    """Contact angle of each ball under load [rad]; positive if the ball pushes the race towards −z, shape
    (rows, Z)."""
    stress_inner: Array
    stress_outer: Array
    """Largest Hertz pressure of each ball on the two races [Pa], shape (rows, Z)."""


def bearing_response(
    constants: BearingConstants, displacement: ArrayLike, *, row_spacing: float = 0.0
) -> BearingResponse:
    """Forces and stiffness of a ball bearing at a displacement of its inner race against the outer one.

    Parameters
    ----------
    constants : BearingConstants
        The bearing.
    displacement : array_like, shape (5,)
        e_x, e_y, e_z [m] and ψ_x, ψ_y [rad] of the inner race.
    row_spacing : float
        Axial distance of the two rows [m]; zero where only radial and axial motion matters.

    Returns
    -------
    BearingResponse
        Everything at that displacement, SI units.

    Notes
    -----
    Source: Neisi 2020, eqs. (2)–(7). Differs from the paper: the sign of ψ_y in eq. (2) is that of
    right-handed axes, the rows have an axial offset, the arm of the tilt is D_pw/2 in kinematics and moment.
    Not validated: tilt, beyond being the gradient of the elastic energy.
    """
    q = np.asarray(displacement, dtype=float)
    radial_rows, axial_rows = _kinematics(constants, row_spacing)
    signs = np.asarray(constants.axial_signs)[:, None]
    radial = constants.radial_offset + radial_rows @ q
    axial = signs * constants.axial_offset + axial_rows @ q
    A = np.hypot(radial, axial)
    delta = np.maximum(A - constants.groove_distance, 0.0)
    K = constants.ball_stiffness
    Q = K * delta**1.5
    cosine, sine = (radial / A)[..., None], (axial / A)[..., None]
    along = cosine * radial_rows + sine * axial_rows
    across = cosine * axial_rows - sine * radial_rows
    slope = 1.5 * K * np.sqrt(delta)
    stiffness = np.einsum("rz,rzi,rzj->ij", slope, along, along)
    stiffness += np.einsum("rz,rzi,rzj->ij", Q / A, across, across)
    root = np.cbrt(Q)
    return BearingResponse(
        force=-np.einsum("rz,rzi->i", Q, along),
        stiffness=stiffness,
        energy=0.4 * K * float(np.sum(delta**2.5)),
        ball_loads=Q,
        contact_angles=np.arctan2(axial, radial),
        stress_inner=constants.stress_coefficient_inner * root,
        stress_outer=constants.stress_coefficient_outer * root,
    )


def simple_radial_stiffness(
    ball_diameter: float,
    ball_count: int,
    contact_angle: float,
    radial_load: float,
    compliance_ratio: float = 1.0,
) -> float:
    """Radial stiffness [N/m] of a ball bearing by the engineering formula, for comparison with the tangent.

    Parameters
    ----------
    ball_diameter : float
        D_w [m].
    ball_count : int
        All balls, both rows of a pair [1].
    contact_angle : float
        α [rad].
    radial_load : float
        Radial load [N].
    compliance_ratio : float
        Compliance of the material pair over that of steel on steel [1], see `hertz.compliance`.

    Returns
    -------
    float
        ``1.5 F / δ_r`` with ``δ_r = 4.36e-8 (Q²/D_w)^(1/3) / cos α`` and ``Q = 5 F/(Z cos α)`` [N/m].

    Notes
    -----
    Source: Palmgren's deflection formula with Stribeck's load factor, the form of Gargiulo (1980),
    ``1.18e7 (D_w F Z² cos⁵ α)^(1/3)``; a "simple method" as in Neisi 2020, section 5.4. It knows no preload:
    at the static load of a preloaded pair it is far below the tangent stiffness.
    Not validated: which simple method the paper used.
    """
    if radial_load == 0.0:  # without weight across the axis; the limit of the formula
        return 0.0
    Q = _STRIBECK_LOAD_FACTOR * radial_load / (ball_count * math.cos(contact_angle))
    delta = _PALMGREN_RADIAL * (compliance_ratio * Q) ** (2.0 / 3.0) / ball_diameter ** (1.0 / 3.0)
    return float(1.5 * radial_load * math.cos(contact_angle) / delta)


def _kinematics(constants: BearingConstants, row_spacing: float) -> tuple[Array, Array]:
    """Rows of ``e_r`` and ``e_t`` of every ball against (x, y, z, ψ_x, ψ_y); shape (rows, Z, 5)."""
    beta = constants.row_ball_angles
    cosine, sine = np.cos(beta), np.sin(beta)
    zero, one = np.zeros_like(beta), np.ones_like(beta)
    position = row_spacing * (np.arange(constants.row_count) - 0.5 * (constants.row_count - 1))[:, None]
    arm = constants.pitch_radius
    radial = np.stack([cosine, sine, zero, -position * sine, position * cosine], axis=-1)
    axial = np.stack([zero, zero, one, arm * sine, -arm * cosine], axis=-1)
    return radial, axial
