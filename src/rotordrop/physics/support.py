"""A support beyond mass on two springs: turned axes, a cubic term, friction, a foundation that gives way.

A form is a short array of numbers that only this module reads; a row of `rotordrop.physics.columns` holds
it. It says how the force of a support differs from the plain one, ``k_x x + c_x ẋ`` and ``k_y y + c_y ẏ``.
"""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel

# Entries of a form; SI units. All at zero is the plain support.
PRESENT, COUPLING, CUBIC, FOUNDATION_SHARE, FOUNDATION_SPEED, FOUNDATION_DAMPING = range(6)
FRICTION, N_ENTRIES = range(6, 8)

SLOW = 1e-3
"""Speed [m/s] below which friction in a support gives way like a damper: small against the 10 to 100 mm/s of
a support under impacts, which follow from the speed of a fall through the air gap (chosen)."""

LARGEST_SOFTENING = 0.3
"""Part of the linear force that a softening cubic term may take away [1]: the slope stays positive."""


@inner_kernel
def support_force(
    form: Array, k_x: float, k_y: float, c_x: float, c_y: float, x: float, y: float, v_x: float, v_y: float
) -> tuple[float, float, float]:
    """Force [N] of spring and damper of a support against a deflection, and the power that it takes [W].

    Parameters
    ----------
    form : ndarray, shape (7,)
        Whether there is one, coupling κ [1], cubic term [1/m²], support mass over foundation mass [1],
        natural frequency [rad/s] and damping ratio [1] of the foundation, friction [N].
    k_x, k_y, c_x, c_y : float
        Stiffness [N/m] and damping [N s/m] along x and y.
    x, y, v_x, v_y : float
        Deflection [m] and its rate [m/s], against the foundation where that gives way.

    Returns
    -------
    tuple of float
        Force along x and y [N], power lost [W].

    Notes
    -----
    Source: linear elasticity, ``k_xy = κ √(k_x k_y)``, which is positive for every ``|κ| < 1``; the cubic
    term is the first one of a symmetric spring, Duffing 1918; friction is Coulomb's against the direction of
    motion, smoothed by ``v/√(v² + SLOW²)``. Not validated.
    """
    k_c = form[COUPLING] * math.sqrt(k_x * k_y)
    rubbing = form[FRICTION] / math.sqrt(v_x * v_x + v_y * v_y + SLOW * SLOW)
    d_x, d_y = (c_x + rubbing) * v_x, (c_y + rubbing) * v_y
    f_x = k_x * x * (1.0 + cubic_share(form[CUBIC], x)) + k_c * y + d_x
    f_y = k_y * y * (1.0 + cubic_share(form[CUBIC], y)) + k_c * x + d_y
    return f_x, f_y, d_x * v_x + d_y * v_y


@inner_kernel
def cubic_share(cubic: float, u: float) -> float:
    """Part [1] by which the cubic term [1/m²] adds to the linear force at a deflection [m].

    Source: Duffing 1918; a softening one ends where the spring would pull.
    """
    return max(cubic * u * u, -LARGEST_SOFTENING)


@inner_kernel
def support_energy(form: Array, k_x: float, k_y: float, x: float, y: float) -> float:
    """Energy [J] stored in the springs of a support at a deflection [m].

    Source: integral of `support_force` from the middle, where the cubic term is not at its limit.
    """
    k_c = form[COUPLING] * math.sqrt(k_x * k_y)
    quartic: float = 0.25 * form[CUBIC]
    linear: float = 0.5 * (k_x * x * x + k_y * y * y) + k_c * x * y
    return linear + quartic * (k_x * x**4 + k_y * y**4)
