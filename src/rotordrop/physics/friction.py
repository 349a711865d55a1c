"""Stribeck friction between rotor and inner race (Neisi 2020, eq. 11 and Fig. 2)."""

from __future__ import annotations

import math

from rotordrop.physics._compile import inner_kernel
from rotordrop.physics.elementary import exp

SMOOTHING_SPEED = 0.02
"""Sliding speed [m/s] below which friction is smoothed where none is given: chosen, small against any that
matters in a drop."""


@inner_kernel
def stribeck_coefficient(v: float, mu_s: float, mu_d: float, v_stribeck: float, v_smooth: float) -> float:
    """Signed friction coefficient [1] at a relative surface speed; it has the sign of the speed.

    Parameters
    ----------
    v : float
        Relative surface speed [m/s].
    mu_s, mu_d : float
        Static and dynamic coefficient [1].
    v_stribeck : float
        Decay speed of the Stribeck curve [m/s].
    v_smooth : float
        Speed [m/s] below which an odd cubic replaces the jump at zero; value and slope continue at it.

    Returns
    -------
    float
        μ(v) [1], odd in v.

    Notes
    -----
    Source: Neisi 2020, eq. (11) and Fig. 2; the law is
    ``μ_d + (μ_s − μ_d) exp(−(|v| − v_smooth)/v_stribeck)``.
    Not validated: below ``v_smooth`` the regularised law creeps where true stiction would hold.
    """
    speed = abs(v)
    if speed >= v_smooth:
        mu = mu_d + (mu_s - mu_d) * exp(-(speed - v_smooth) / v_stribeck)
    else:
        s = speed / v_smooth
        slope = -(mu_s - mu_d) * v_smooth / v_stribeck
        mu = s * (1.5 * mu_s - 0.5 * slope + s * s * (0.5 * slope - 0.5 * mu_s))
    return math.copysign(mu, v)
