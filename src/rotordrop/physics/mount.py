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

# Entries of a mount; SI units. All at zero is none: no stop, no ribbon, no branch that relaxes.
PRESENT, STATES, GAP, STOP = range(4)
STOP_END = STOP + contact.N_ENTRIES
RIBBON = STOP_END
SLIP, SHARPNESS, BRANCHES = range(STOP_END + 1, STOP_END + 4)
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
