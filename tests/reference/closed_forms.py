"""Closed forms only tests compare with: contact of spheres, pendulum, lift-off, equilibrium of a bearing."""

import numpy as np

from rotordrop.physics.ball_bearing import row_axial_force
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.physics.hertz import point_contact
from rotordrop.physics.pendulum import period_ratio, small_frequency

_MOST_STEPS = 500


def circular_contact(R_1, R_2, eta):
    """Contact of two spheres of radius [m] and compliance [1/Pa]; an infinite radius is a plane.

    Source: Johnson, Contact Mechanics, ch. 4.
    """
    return point_contact(2.0 * (1.0 / R_1 + 1.0 / R_2), 0.0, eta)


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
