"""Support of a touchdown bearing: a mass on a spring and a damper per direction (Neisi 2020, Fig. 3)."""

from __future__ import annotations

import math

from rotordrop.physics._compile import kernel


@kernel
def support_force(x: float, v: float, K_sup: float, C_sup: float) -> float:
    """Force [N] of the support on its mass at a displacement [m] and velocity [m/s], one direction.

    Stiffness [N/m], damping [N s/m]. Source: Neisi 2020, Fig. 3 and section 3.2.
    """
    return -K_sup * x - C_sup * v


def damping_from_ratio(zeta: float, K_sup: float, m_sup: float) -> float:
    """Support damping [N s/m] ``C = 2 ζ sqrt(K m)`` of a damping ratio [1], stiffness [N/m] and support mass
    [kg].

    Source: Neisi 2020, section 3.2 (ratio 0.025 for steel structures).
    """
    return 2.0 * zeta * math.sqrt(K_sup * m_sup)


def ratio_from_damping(C_sup: float, K_sup: float, m_sup: float) -> float:
    """Damping ratio [1] of a support damping [N s/m], stiffness [N/m] and support mass [kg].

    Source: Neisi 2020, section 3.2.
    """
    return C_sup / (2.0 * math.sqrt(K_sup * m_sup))
