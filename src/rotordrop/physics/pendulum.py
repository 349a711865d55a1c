"""Pendulum motion of a rotor that slides or rolls in the bottom of a touchdown bearing.

The rotor centre swings on a circle whose radius is the air gap and all that gives way under the weight.
Source of the idea: Neisi 2020, section 5.4, which reads 29 Hz in its records.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy

from rotordrop.arrays import Array

ArrayLike = float | Array


def effective_length(
    air_gap: float, indentation: float = 0.0, race_sag: float = 0.0, support_sag: float = 0.0
) -> float:
    """Pendulum length [m]: air gap, contact indentation, sag of race and of support under the weight [m].

    An isotropic spring under a rotating weight displaces the centre of the circle along the force, which
    lengthens the pendulum by the static deflection. Source: statics of Neisi 2020, Fig. 3.
    """
    return air_gap + indentation + race_sag + support_sag


def spin_participation(r_r: float, R_i: float, I_r: float, I_i: float) -> float:
    """Mass [kg] that swings along when the surfaces stick, because race and rotor must change their spin.

    Parameters
    ----------
    r_r, R_i : float
        Radius of the rotor and bore radius of the race [m].
    I_r, I_i : float
        Polar inertia of the rotor and of the race with what spins with it [kg m²].

    Returns
    -------
    float
        ``1 / (r_r²/I_r + R_i²/I_i)`` [kg], to be added to the swinging mass but not to the weight.

    Notes
    -----
    Source: rigid-body kinematics of Neisi 2020, eq. (12), with rolling instead of sliding contact.
    """
    return 1.0 / (r_r**2 / I_r + R_i**2 / I_i)


def small_frequency(length: ArrayLike, g: float = 9.81, inertia_ratio: float = 1.0) -> Any:
    """Frequency [Hz] of a small swing: ``sqrt(g / (c m_total/m)) / 2π``.

    Pendulum length c [m], gravity [m/s²], swinging over weighing mass [1] (1 while the surfaces slide).
    Source: Neisi 2020, section 5.4.
    """
    return np.sqrt(g / (np.asarray(length) * inertia_ratio)) / (2.0 * math.pi)


def period_ratio(amplitude: ArrayLike) -> Any:
    """Period [1] of a swing of a given amplitude [rad] over that of a small one, ``2 K(sin(θ/2)) / π``.

    Exact for amplitudes below π. Source: Beléndez et al., cited in Neisi 2020, section 5.4.
    """
    return 2.0 / math.pi * scipy.special.ellipk(np.sin(0.5 * np.asarray(amplitude)) ** 2)
