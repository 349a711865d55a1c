"""Landing sleeve of the rotor that is eccentric or oval: where it reaches deepest, and what that turns.

Its radius is ``r(χ) = r_0 + h(χ)`` with ``h = a_1 cos χ + b_1 sin χ + a_2 cos 2χ + b_2 sin 2χ`` and χ the
angle from the mark of the rotor. It touches the bore at the azimuth ψ at which ``u·n(ψ) + h(ψ - θ)`` is
largest, where ``u`` is the displacement of the rotor against the bore, ``n`` the unit vector and θ the angle
of the rotor: exact but for the square of the gap over the radius. There the normal is ``n(ψ)``.
"""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics._compile import lean_kernel
from rotordrop.physics.elementary import sine_cosine

# Entries of a landing sleeve; SI units. PRESENT is one where a machine describes it, though it were round.
PRESENT, ONCE_COSINE, ONCE_SINE, TWICE_COSINE, TWICE_SINE, N_ENTRIES = range(6)

LARGEST_OVAL = 1.0 / 12.0
"""Largest amplitude twice a turn over the air gap [1]: up to a quarter there is one place of contact, and up
to this three steps of Newton find it to 2e-10 of a radian."""
NEWTON_STEPS = 3


@lean_kernel
def deepest(s: Array, angle: float, x: float, y: float) -> tuple[float, float, float, float]:
    """Where a sleeve reaches deepest at a rotor angle [rad] and a displacement against the bore [m].

    Returns how far it reaches beyond ``r_0`` [m], the normal there (x, y) [1], and the slope of its radius
    there [m]. Source: largest ``u·n(ψ) + h(ψ - θ)`` by Newton's method, from the azimuth of the
    displacement of the eccentric circle.
    """
    sine, cosine = sine_cosine(angle)
    # once a turn: an exact circle about another centre
    wx = x + cosine * s[ONCE_COSINE] - sine * s[ONCE_SINE]
    wy = y + sine * s[ONCE_COSINE] + cosine * s[ONCE_SINE]
    r = math.sqrt(wx * wx + wy * wy)
    nx, ny = (wx / r, wy / r) if r > 0.0 else (1.0, 0.0)
    c = z = 0.0
    even = odd = 0.0
    for step in range(NEWTON_STEPS + 1):
        c, z = cosine * nx + sine * ny, cosine * ny - sine * nx  # of χ, from the mark to the contact
        cosine_2, sine_2 = c * c - z * z, 2.0 * c * z
        even = s[TWICE_COSINE] * cosine_2 + s[TWICE_SINE] * sine_2
        odd = s[TWICE_SINE] * cosine_2 - s[TWICE_COSINE] * sine_2
        if step == NEWTON_STEPS:
            break
        slope, curved = wy * nx - wx * ny + 2.0 * odd, wx * nx + wy * ny + 4.0 * even
        # deep in flight a displacement smaller than the oval has no one place
        turn = slope / max(curved, 4.0 * (abs(s[TWICE_COSINE]) + abs(s[TWICE_SINE])), 1e-12)
        tx, ty = nx - turn * ny, ny + turn * nx
        length = math.sqrt(tx * tx + ty * ty)
        nx, ny = tx / length, ty / length
    once, across = s[ONCE_COSINE] * c + s[ONCE_SINE] * z, s[ONCE_SINE] * c - s[ONCE_COSINE] * z
    return x * nx + y * ny + once + even, nx, ny, across + 2.0 * odd


@lean_kernel
def as_round(
    s: Array, angle: float, spin: float, x: float, y: float, vx: float, vy: float
) -> tuple[float, float, float, float]:
    """Displacement [m] and velocity [m/s] with which a round rotor would touch as this one does.

    ``spin`` [rad/s] is that of the rotor. Source: `deepest`; of a maximum ``d/dt (u·n + h) = v·n - h' ω``.
    """
    reach, nx, ny, slope = deepest(s, angle, x, y)
    rate = -slope * spin
    return reach * nx, reach * ny, vx + rate * nx, vy + rate * ny


@lean_kernel
def turning_arm(s: Array, angle: float, x: float, y: float) -> tuple[float, float, float]:
    """Arm [m] with which the normal force turns the rotor in the sense of its spin, and the normal.

    Source: virtual work of a force along ``n`` on ``u·n + h(ψ - θ)``: the line of the force passes the axis
    of the rotor at ``h'`` and meets that of the bore, which it does not turn.
    """
    _reach, nx, ny, slope = deepest(s, angle, x, y)
    return slope, nx, ny
