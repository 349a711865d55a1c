"""Elements of a soft mount beside its spring: a stop, a ribbon that slips, branches that relax.

The numbers of a mount are a short array that only this module reads; a row of `rotordrop.physics.columns`
holds it. What a ribbon and the branches remember is the stretch of their springs [m], x and y, the ribbon's
first. `rotordrop.elements.mount` describes them.
"""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics import contact
from rotordrop.physics._compile import inner_kernel
from rotordrop.physics.elementary import power

Matrix = tuple[float, float, float, float]
"""Of x and y: xx, xy, yx, yy."""

# Entries of a mount; SI units. All at zero is none: no stop, no ribbon, no branch that relaxes.
PRESENT = 0
STATES = 1
GAP = 2
STOP = 3
STOP_END = STOP + contact.N_ENTRIES
RIBBON = STOP_END
SLIP = STOP_END + 1
SHARPNESS = STOP_END + 2
BRANCHES = STOP_END + 3
BRANCH_ENTRIES = 2
MOST_BRANCHES = 3
N_ENTRIES = BRANCHES + BRANCH_ENTRIES * MOST_BRANCHES


@inner_kernel
def stop_force(numbers: Array, x: float, y: float, vx: float, vy: float) -> tuple[float, float, float]:
    """Force [N] of a circular stop against a deflection, x and y, and the power that its law takes [W].

    Parameters
    ----------
    numbers : ndarray, shape (MOUNT_N_ENTRIES,)
        The mount, in SI units; without a stop its gap [m] is zero.
    x, y, vx, vy : float
        Deflection of the support [m] and its rate [m/s].

    Notes
    -----
    The law is that of `rotordrop.physics.contact`, without friction. Source: Hunt & Crossley 1975.
    """
    r = math.sqrt(x * x + y * y)
    depth = r - numbers[GAP]
    if numbers[GAP] <= 0.0 or depth <= 0.0:
        return 0.0, 0.0, 0.0
    rate = (x * vx + y * vy) / r
    force, elastic = contact.contact_force(numbers[STOP:STOP_END], depth, rate)
    return force * x / r, force * y / r, (force - elastic) * rate


@inner_kernel
def stop_tangent(numbers: Array, x: float, y: float, vx: float, vy: float) -> tuple[Matrix, Matrix]:
    """Slopes of the force of a stop by deflection [N/m] and by its rate [N s/m].

    Source: `stop_force`, differentiated.
    """
    r = math.sqrt(x * x + y * y)
    depth = r - numbers[GAP]
    if numbers[GAP] <= 0.0 or depth <= 0.0:
        return (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)
    nx, ny = x / r, y / r
    force, by_depth, by_rate = contact.contact_gradient(numbers[STOP:STOP_END], depth, vx * nx + vy * ny)
    turning = by_rate * (vy * nx - vx * ny) / r  # the rate of depth changes as the normal turns
    side = force / r
    return (
        (
            by_depth * nx * nx - turning * nx * ny + side * ny * ny,
            by_depth * nx * ny + turning * nx * nx - side * nx * ny,
            by_depth * nx * ny - turning * ny * ny - side * nx * ny,
            by_depth * ny * ny + turning * nx * ny + side * nx * nx,
        ),
        (by_rate * nx * nx, by_rate * nx * ny, by_rate * nx * ny, by_rate * ny * ny),
    )


@inner_kernel
def stop_energy(numbers: Array, x: float, y: float) -> float:
    """Energy [J] stored in a stop at a deflection [m]. Source: integral of the elastic `stop_force`."""
    depth = math.sqrt(x * x + y * y) - numbers[GAP]
    if numbers[GAP] <= 0.0 or depth <= 0.0:
        return 0.0
    return contact.contact_energy(numbers[STOP:STOP_END], depth)


@inner_kernel
def ribbon_slip(numbers: Array, ex: float, ey: float, vx: float, vy: float) -> tuple[float, float]:
    """Speed [m/s] at which a ribbon slips, x and y, from its stretch [m] and the rate of deflection [m/s].

    The stretch follows the deflection less the slip and never exceeds slip force over stiffness; it slips
    along its stretch, so that no axis is preferred.

    Source: Bouc 1967 and Wen 1976 in the plane, ``e (|e|/e_y)^(n−1) max(0, e·v) / (|e| e_y)``; sharp slip
    (Jenkins) in the limit of a large n. Not validated against a measured ribbon.
    """
    along = ex * vx + ey * vy
    if along <= 0.0:
        return 0.0, 0.0
    rate = _slip_factor(numbers, math.sqrt(ex * ex + ey * ey)) * along
    return rate * ex, rate * ey


@inner_kernel
def _slip_factor(numbers: Array, stretch: float) -> float:
    """``|e|^(n-2) / e_y^n`` [1/m²]."""
    n, limit = numbers[SHARPNESS], numbers[SLIP] / numbers[RIBBON]
    if stretch <= 0.0:
        return 0.0
    return power(stretch / limit, n) / (stretch * stretch)


@inner_kernel
def ribbon_slip_gradient(numbers: Array, ex: float, ey: float, vx: float, vy: float) -> tuple[Matrix, Matrix]:
    """Slopes of the speed of slip by stretch [1/s] and by the rate of deflection [1].

    Source: `ribbon_slip`, differentiated.
    """
    along, square = ex * vx + ey * vy, ex * ex + ey * ey
    if along <= 0.0 or square <= 0.0:
        return (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)
    q = _slip_factor(numbers, math.sqrt(square))
    grown = (numbers[SHARPNESS] - 2.0) * q / square * along
    return (
        (
            q * along + ex * (grown * ex + q * vx),
            ex * (grown * ey + q * vy),
            ey * (grown * ex + q * vx),
            q * along + ey * (grown * ey + q * vy),
        ),
        (q * ex * ex, q * ex * ey, q * ey * ex, q * ey * ey),
    )


@inner_kernel
def mount_force(
    numbers: Array, x: float, y: float, vx: float, vy: float, stretch: Array, rate: Array
) -> tuple[float, float, float]:
    """Force [N] of a mount beside its spring, x and y, and the power that it takes [W].

    Parameters
    ----------
    numbers : ndarray, shape (MOUNT_N_ENTRIES,)
        The mount, in SI units: stiffnesses [N/m], forces [N], times [s].
    x, y, vx, vy : float
        Deflection of the support [m] and its rate [m/s].
    stretch, rate : ndarray, shape (n,)
        Stretch [m] of the springs that slip and relax; its rate [m/s] is filled in.

    Notes
    -----
    A branch is Maxwell's: its spring stretches with the deflection and relaxes over its time.
    Source: Maxwell 1867, ``ė = v − e/τ``; `stop_force`, `ribbon_slip`.
    """
    fx, fy, lost = stop_force(numbers, x, y, vx, vy)
    at = 0
    k = numbers[RIBBON]
    if k > 0.0:
        sx, sy = ribbon_slip(numbers, stretch[0], stretch[1], vx, vy)
        rate[0] = vx - sx
        rate[1] = vy - sy
        fx += k * stretch[0]
        fy += k * stretch[1]
        lost += k * (stretch[0] * sx + stretch[1] * sy)
        at = 2
    for j in range(BRANCHES, N_ENTRIES, BRANCH_ENTRIES):
        k = numbers[j]
        if k > 0.0:
            ex, ey, tau = stretch[at], stretch[at + 1], numbers[j + 1]
            rate[at] = vx - ex / tau
            rate[at + 1] = vy - ey / tau
            fx += k * ex
            fy += k * ey
            lost += k * (ex * ex + ey * ey) / tau
            at += 2
    return fx, fy, lost


@inner_kernel
def mount_energy(numbers: Array, x: float, y: float, stretch: Array) -> float:
    """Energy [J] stored in stop, ribbon and branches at a deflection [m] and a stretch [m], shape (n,).

    Source: ½ k e² of each spring; `stop_energy`.
    """
    energy = stop_energy(numbers, x, y)
    at = 0
    k = numbers[RIBBON]
    if k > 0.0:
        energy += 0.5 * k * (stretch[0] * stretch[0] + stretch[1] * stretch[1])
        at = 2
    for j in range(BRANCHES, N_ENTRIES, BRANCH_ENTRIES):
        k = numbers[j]
        if k > 0.0:
            energy += 0.5 * k * (stretch[at] * stretch[at] + stretch[at + 1] * stretch[at + 1])
            at += 2
    return energy


@inner_kernel
def stiffness_of_state(numbers: Array, state: int) -> float:
    """Stiffness [N/m] of the spring whose stretch is a state, counted from the first of the mount.

    Source: `mount_force`, the order of its springs.
    """
    stiffness: float = numbers[RIBBON]
    at = 2 if stiffness > 0.0 else 0
    for j in range(BRANCHES, N_ENTRIES, BRANCH_ENTRIES):
        if numbers[j] > 0.0:
            if at <= state < at + 2:
                stiffness = numbers[j]
            at += 2
    return stiffness


@inner_kernel
def stretch_gradient(
    numbers: Array, state: int, ex: float, ey: float, vx: float, vy: float
) -> tuple[Matrix, Matrix]:
    """Slopes of the rate of a stretch by that stretch [1/s] and by the rate of deflection [1].

    Source: `mount_force`, differentiated.
    """
    if numbers[RIBBON] > 0.0 and state < 2:
        a, b = ribbon_slip_gradient(numbers, ex, ey, vx, vy)
        return (-a[0], -a[1], -a[2], -a[3]), (1.0 - b[0], -b[1], -b[2], 1.0 - b[3])
    at = 2 if numbers[RIBBON] > 0.0 else 0
    relaxing = 0.0
    for j in range(BRANCHES, N_ENTRIES, BRANCH_ENTRIES):
        if numbers[j] > 0.0:
            if state == at:
                relaxing = -1.0 / numbers[j + 1]
            at += 2
    return (relaxing, 0.0, 0.0, relaxing), (1.0, 0.0, 0.0, 1.0)
