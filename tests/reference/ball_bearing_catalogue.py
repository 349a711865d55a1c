"""What a catalogue does not print about a ball bearing, from preload, rigidity and lift-off force.

All functions take arrays, one entry per bearing, so that a whole catalogue is one call.
"""

import numpy as np
from tests.plain_bearing import BallBearingGeometry

from rotordrop.physics.ball_bearing import row_approach, row_axial_force, row_axial_stiffness
from rotordrop.physics.hertz import contacts_in_series, race_contact

_LOWEST_CONFORMITY, _HIGHEST_CONFORMITY = 0.5 + 1e-6, 1.0
_BISECTIONS = 60
_FIT_STEPS = 100
_LOG_STEP = 1e-6


def pair_rigidity(F_V, ZK, A_0, alpha_0):
    """Axial rigidity [N/m] of an X or O pair of rows at a preload [N] per row.

    Number of balls times K_tot [N/m^1.5], groove distance [m] and contact angle [rad] of a row; any shape.
    Source: definition of the FAG and GMN catalogues, 2 dF/ds; rows after Neisi 2020, eqs. (3)–(6).
    """
    row = (np.asarray(ZK), np.asarray(A_0), np.asarray(alpha_0))
    return 2.0 * row_axial_stiffness(row_approach(np.asarray(F_V), *row), *row)


def pair_lift_off_force(F_V, ZK, A_0, alpha_0):
    """Axial load [N] that empties the unloaded row of an X or O pair; arguments as in `pair_rigidity`.

    Source: definition of the FAG catalogue; rows after Neisi 2020, eqs. (3)–(6).
    """
    row = (np.asarray(ZK), np.asarray(A_0), np.asarray(alpha_0))
    return row_axial_force(2.0 * row_approach(np.asarray(F_V), *row), *row)


def row_of_conformity(f, D_w, D_pw, Z, alpha_0, eta):
    """Lumped stiffness ``Z K_tot`` [N/m^1.5] and groove distance [m] of rows with equal conformities.

    Conformity of both races [1], ball and pitch diameter [m], balls per row [1], contact angle [rad],
    compliance of the materials [1/Pa]. Source: Harris, Rolling Bearing Analysis; Neisi 2020, eq. (6).
    """
    f, D_w, D_pw, alpha_0 = (np.asarray(v, dtype=float) for v in (f, D_w, D_pw, alpha_0))
    inner = race_contact(D_w, D_pw, f, alpha_0, eta, inner=True)
    outer = race_contact(D_w, D_pw, f, alpha_0, eta, inner=False)
    K = contacts_in_series(inner.stiffness, outer.stiffness)
    return np.asarray(Z) * K, (2.0 * f - 1.0) * D_w


def conformity_of_rigidity(rigidity, F_V, D_w, D_pw, Z, alpha_0, eta):
    """Conformity f = f_i = f_o [1] that gives a pair its catalogue rigidity [N/m] at a preload [N].

    Other arguments as in `row_of_conformity`; by bisection, since rigidity falls with the conformity. A
    rigidity out of reach returns the nearest end of 0.5 … 1.
    Source: inverse of `pair_rigidity` (validation case H06a).
    """
    wanted = np.asarray(rigidity, dtype=float)
    low = np.full_like(wanted, _LOWEST_CONFORMITY)
    high = np.full_like(wanted, _HIGHEST_CONFORMITY)
    for _ in range(_BISECTIONS):
        f = 0.5 * (low + high)
        stiffer = pair_rigidity(F_V, *row_of_conformity(f, D_w, D_pw, Z, alpha_0, eta), alpha_0) > wanted
        low, high = np.where(stiffer, f, low), np.where(stiffer, high, f)
    return 0.5 * (low + high)


def row_of_catalogue(preload, rigidity, lift_off, alpha_0):
    """Lumped stiffness and groove distance of rows whose ball complement is not published.

    Least squares of the relative errors of all printed numbers, by damped Gauss–Newton steps in logarithms.

    F_V [N], axial rigidity of the pair [N/m] and lift-off force [N] of B bearings at P preload classes, shape
    (B, P), and nominal contact angle [rad], shape (B,), to ``Z K_tot`` [N/m^1.5] and A₀ [m], shape (B,).
    Source: validation case H07a; rows after Neisi 2020, eqs. (3)–(6).
    """
    F_V, wanted = np.asarray(preload, dtype=float), np.hstack([rigidity, lift_off])
    alpha = np.asarray(alpha_0, dtype=float)[:, None]

    def errors(logs):
        ZK, A_0 = np.exp(logs[:, :1]), np.exp(logs[:, 1:])
        predicted = [pair_rigidity(F_V, ZK, A_0, alpha), pair_lift_off_force(F_V, ZK, A_0, alpha)]
        return np.asarray(np.hstack(predicted) / wanted - 1.0)

    logs = _rough_row(F_V, np.asarray(rigidity, dtype=float), alpha)
    damping, error = np.full((len(F_V), 1), 1e-3), errors(logs)
    for _ in range(_FIT_STEPS):
        step = _damped_step(errors, logs, error, damping)
        trial = errors(logs + step)
        better = np.sum(trial**2, axis=1, keepdims=True) < np.sum(error**2, axis=1, keepdims=True)
        logs, error = np.where(better, logs + step, logs), np.where(better, trial, error)
        damping = np.clip(np.where(better, 0.1, 10.0) * damping, 1e-9, 1e9)
        if np.max(np.abs(step)) < 1e-10:
            break
    return np.exp(logs[:, 0]), np.exp(logs[:, 1])


def _rough_row(F_V, rigidity, alpha):
    """Start of the fit [ln(N/m^1.5), ln(m)]: constant contact angle at the middle preload; shape (B, 2)."""
    middle = F_V.shape[1] // 2
    s = 3.0 * F_V[:, middle] / rigidity[:, middle]
    sine = np.sin(alpha[:, 0])
    return np.log(np.stack([F_V[:, middle] / (sine * (s * sine) ** 1.5), 30.0 * s], axis=1))


def _damped_step(errors, logs, error, damping):
    """Levenberg–Marquardt step of every bearing; shape (B, 2)."""
    columns = [(errors(logs + _LOG_STEP * unit) - error) / _LOG_STEP for unit in np.eye(2)]
    J = np.stack(columns, axis=-1)
    normal = np.einsum("bni,bnj->bij", J, J)
    diagonal = np.einsum("bii->bi", normal)
    damped = normal + np.einsum("bi,ij->bij", damping * diagonal, np.eye(2))
    gradient = np.einsum("bni,bn->bi", J, error)
    return np.asarray(-np.linalg.solve(damped, gradient[..., None])[..., 0])


def geometry_of(bearing, preload):
    """A listed bearing as the physics sees it, at a preload [N]."""
    balls, steel = bearing.complement, bearing.ball_material == "steel"
    return BallBearingGeometry(
        ball_diameter=balls.ball_diameter,
        ball_count=balls.ball_count,
        pitch_diameter=balls.pitch_diameter,
        contact_angle=bearing.contact_angle,
        conformity_inner=balls.conformity,
        conformity_outer=balls.conformity,
        ball_youngs_modulus=208e9 if steel else 315e9,
        ball_poisson_ratio=0.3 if steel else 0.26,
        preload=preload,
    )
