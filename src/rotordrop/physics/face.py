"""A shoulder of the rotor on the face of a race: axial force, friction, the torque that spins the race."""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics import contact
from rotordrop.physics._compile import lean_kernel
from rotordrop.physics.contact import contact_energy, contact_force
from rotordrop.physics.elementary import sine_cosine
from rotordrop.physics.friction import SMOOTHING_SPEED, stribeck_coefficient

# Entries of an axial face; SI units. A side of zero is a face on both sides, of one and minus one a face that
# stops the rotor towards +z and -z.
GAP, SIDE, RADIUS, FRICTION, LAW = range(5)
N_ENTRIES = LAW + contact.N_ENTRIES

POINTS = 8
"""Points of the ring at which sliding is taken [1]: chosen, as good as a ring."""


def mean_friction_radius(inner: float, outer: float) -> float:
    """Arm [m] of the friction torque of a ring under even pressure between two radii [m].

    ``⅔ (b³ − a³) / (b² − a²)``. Source: integral of the friction over the ring.
    """
    return 2.0 / 3.0 * (outer * outer + outer * inner + inner * inner) / (outer + inner)


@lean_kernel
def face_contact(
    numbers: Array, z: float, vz: float, vx: float, vy: float, slip: float
) -> tuple[float, float, float, float, float, float, float]:
    """Contact of a shoulder with the face of a race, on one side or on both.

    Parameters
    ----------
    numbers : ndarray, shape (7,)
        Gap [m], side [1], mean radius of friction [m], coefficient [1], law.
    z, vz : float
        Axial displacement [m] and velocity [m/s] of the rotor against the race.
    vx, vy : float
        Velocity of the rotor against the race across the axis [m/s].
    slip : float
        Spin of the rotor less that of the race [rad/s].

    Returns
    -------
    tuple of float
        Indentation [m]; force on the race along z, x and y [N] and torque that spins it [N m]; power that
        sliding takes and that the law takes along the axis [W]. The rotor gets the opposite.

    Notes
    -----
    The ring stays parallel to the face: pressure and friction do not know its tilt. Friction acts against
    sliding at points of the mean radius. Source: Neisi 2020, eqs. (8) and (11), on a flat ring.
    Not validated against a measured landing.
    """
    side = numbers[SIDE] if numbers[SIDE] != 0.0 else math.copysign(1.0, z)
    depth = side * z - numbers[GAP]
    if depth <= 0.0:
        return depth, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    push, elastic = contact_force(numbers[LAW:N_ENTRIES], depth, side * vz)
    radius, mu = numbers[RADIUS], numbers[FRICTION]
    F_x = F_y = torque = sliding = 0.0
    for i in range(POINTS):
        s, c = sine_cosine(2.0 * math.pi * i / POINTS)
        tx, ty = vx - slip * radius * s, vy + slip * radius * c
        speed = math.sqrt(tx * tx + ty * ty)
        if speed > 0.0:
            # of one coefficient the Stribeck speed changes nothing
            pull = push / POINTS * stribeck_coefficient(speed, mu, mu, 1.0, SMOOTHING_SPEED) / speed
            F_x += pull * tx
            F_y += pull * ty
            torque += pull * radius * (c * ty - s * tx)
            sliding += pull * speed * speed
    return depth, side * push, F_x, F_y, torque, sliding, (push - elastic) * side * vz


@lean_kernel
def face_energy(numbers: Array, z: float) -> float:
    """Energy [J] in the contact of a shoulder that has moved by z [m] against its race.

    Source: integral of the elastic force of `face_contact`.
    """
    side = numbers[SIDE] if numbers[SIDE] != 0.0 else math.copysign(1.0, z)
    depth = side * z - numbers[GAP]
    return contact_energy(numbers[LAW:N_ENTRIES], depth) if depth > 0.0 else 0.0
