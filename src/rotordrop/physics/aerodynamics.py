"""Aerodynamic torque that slows the rotor (Neisi 2020, eq. 13)."""

from __future__ import annotations

from rotordrop.physics._compile import kernel
from rotordrop.physics.elementary import exp

OFF, EXPONENTIAL_IN_TIME, PRESCRIBED_SPEED, FUNCTION_OF_SPEED = range(4)


@kernel
def exponential_deceleration(t: float, omega_0: float, tau: float) -> float:
    """Deceleration [rad/s²] ``−(ω_0/τ) e^(−t/τ)`` of the exponential speed profile.

    Time from power-off [s], initial speed [rad/s], time constant [s]. Source: Neisi 2020, eq. (13).
    Valid for windows up to about 1 s: with race drag on top it would drive a rotor backwards in a coast-down.
    """
    return -(omega_0 / tau) * exp(-t / tau)


@kernel
def speed_dependent_deceleration(omega: float, linear: float, quadratic: float) -> float:
    """Deceleration [rad/s²] ``−(linear + quadratic |ω|) ω`` against the spin ω [rad/s].

    ``linear`` [1/s] is laminar drag, ``quadratic`` [1/rad] turbulent drag, both per polar inertia.
    Source: drag laws behind Neisi 2020, eq. (13). Differs from the paper: a function of speed, not of time.
    """
    return -(linear + quadratic * abs(omega)) * omega


@kernel
def speed_dependent_slope(omega: float, linear: float, quadratic: float) -> float:
    """Derivative of `speed_dependent_deceleration` by the spin [1/s]. Source: differentiated."""
    return -(linear + 2.0 * quadratic * abs(omega))
