"""Closed forms only tests compare with: whirl, line contact, pendulum, lift-off, equilibrium of a bearing."""

import numpy as np

from rotordrop.physics.ball_bearing import row_axial_force
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.physics.elementary import power
from rotordrop.physics.hertz import point_contact
from rotordrop.physics.pendulum import period_ratio, small_frequency

_PALMGREN = 3.84e-5
"""Palmgren's line contact ``δ = 3.84e-5 Q^0.9 / l^0.8`` in millimetre and newton."""
_MOST_STEPS = 500


def rolling_whirl_speed(omega_r, R_i, c_r):
    """Backward whirl speed [rad/s] of a rotor that rolls without sliding in a fixed bore, ``ω_r R_i / c_r``.

    Rotor speed [rad/s], bore radius [m], air gap [m]. Never reached in a drop: a real whirl locks to a
    coupled natural frequency of rotor and support far below.
    Source: Black 1968; Bartha 1998 (dry friction whirl).
    """
    return omega_r * R_i / c_r


def whirl_force(m, c_r, omega_w):
    """Contact force [N] that keeps a mass [kg] on a circle of radius c_r [m] at a whirl speed [rad/s].

    Source: ``m c ω²``.
    """
    return m * c_r * omega_w**2


def circular_contact(R_1, R_2, eta):
    """Contact of two spheres of radius [m] and compliance [1/Pa]; an infinite radius is a plane.

    Source: Johnson, Contact Mechanics, ch. 4.
    """
    return point_contact(2.0 * (1.0 / R_1 + 1.0 / R_2), 0.0, eta)


def line_contact_stiffness(length):
    """Stiffness [N/m^(10/9)] of a line contact of a given length [m], with the exponent 10/9 of Neisi 2020.

    Source: Palmgren, ``δ = 3.84e-5 Q^0.9 / l^0.8`` (mm, N). Differs from the paper: it says "Hertzian model".
    """
    per_load = 1e-3 * _PALMGREN / power(1e3 * length, 0.8)
    return float(power(per_load, -10.0 / 9.0))


def line_contact_approach(Q, length):
    """Approach [m] of a line contact under a load [N] and of a given length [m].

    Source: Palmgren, ``δ = 3.84e-5 Q^0.9 / l^0.8`` (mm, N).
    """
    return float(1e-3 * _PALMGREN * power(Q, 0.9) / power(1e3 * length, 0.8))


def rectangle_shear_coefficient(nu):
    """Shear coefficient κ [1] of a rectangular section by Cowper, from ν [1].

    Source: Cowper 1966, ``10 (1+ν)/(12+11ν)``.
    """
    return 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)


def period(length, amplitude=0.0, g=9.81, inertia_ratio=1.0):
    """Period [s] of a swing of any amplitude [rad] below π; other arguments as in `small_frequency`.

    Source: Beléndez et al., cited in Neisi 2020, section 5.4.
    """
    return period_ratio(amplitude) / small_frequency(length, g, inertia_ratio)


def lift_off_force(constants):
    """Axial load [N] on an X or O pair at which the unloaded row has lost its last contact force.

    The loaded row has then twice the approach of the preload.
    Source: definition in the FAG spindle bearing catalogue.
    """
    stiffness = constants.ball_count * constants.ball_stiffness
    row = stiffness, constants.groove_distance, constants.contact_angle
    return float(row_axial_force(2.0 * constants.preload_approach, *row))


def bearing_equilibrium(
    constants, load, *, free=(True, True, True, True, True), start=(0.0, 0.0, 0.0, 0.0, 0.0), row_spacing=0.0
):
    """Displacement (e_x, e_y, e_z [m], ψ_x, ψ_y [rad]) of the inner race at which the balls carry a load.

    External F_x, F_y, F_z [N], M_x, M_y [N m]; directions that are not free stay at the start; distance of
    two rows [m]. Source: equilibrium of Neisi 2020, eqs. (2)–(6), by damped Newton steps.
    """
    q, wanted = np.array(start, dtype=float), np.asarray(load, dtype=float)
    arm = constants.pitch_radius
    units, open_ = np.array([1.0, 1.0, 1.0, arm, arm]), np.array(free)
    scale = max(float(np.max(np.abs(wanted / units)[open_])), constants.preload, 1e-3)
    spring = 1.5 * constants.ball_stiffness ** (2.0 / 3.0) * scale ** (1.0 / 3.0) * units[open_] ** 2

    def residual(at):
        response = bearing_response(constants, at, row_spacing=row_spacing)
        return (wanted + response.force)[open_], response.stiffness[np.ix_(open_, open_)]

    damping, (r, H) = 1e-2, residual(q)
    for _ in range(_MOST_STEPS):
        if np.max(np.abs(r / units[open_])) <= 1e-11 * scale:
            return q
        trial = q.copy()
        trial[open_] += np.linalg.solve(H + damping * np.diag(spring), r)
        r_trial, H_trial = residual(trial)
        if np.linalg.norm(r_trial / units[open_]) < np.linalg.norm(r / units[open_]):
            q, r, H, damping = trial, r_trial, H_trial, 0.1 * damping
        else:
            damping = max(4.0 * damping, 1e-12)
    raise AssertionError(f"no equilibrium under {wanted}: {r} is left over")
