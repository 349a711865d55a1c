"""Constants of an angular-contact ball bearing: grooves, Hertz stiffness, preload, rigidity, lift-off.

One row under axial load carries everything a catalogue prints: the preload sets the axial offset of the
grooves, the pair's rigidity is twice the slope of a row, the lift-off force empties the unloaded row.
Forces of a displaced race are in `ball_bearing_response` (five degrees of freedom) and `ball_set`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.physics.ball_bearing_geometry import BallBearingDescription
from rotordrop.physics.elementary import acos, asin, cos_each, cube_root_each, magnitude, sin_each
from rotordrop.physics.hertz import compliance, contacts_in_series, race_contact

ArrayLike = float | Array

_AXIAL_SIGNS: dict[str, tuple[float, ...]] = {
    "X": (-1.0, 1.0),
    "O": (1.0, -1.0),
    "tandem": (1.0, 1.0),
    "single": (1.0,),
}
_NEWTON_STEPS = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class BearingConstants:
    """Everything about a preloaded ball bearing that does not change during a drop.

    Notes
    -----
    Source: Neisi 2020, eqs. (2)–(7). Differs from the paper: its equations are those of a deep-groove
    bearing; an angular-contact row has an axial offset of the groove centres.
    """

    groove_distance: float
    """Distance of the groove centres A₀ of an unloaded row [m]."""
    contact_angle: float
    """Nominal contact angle α₀ [rad]; of deep grooves the free contact angle ``acos(1 − P_d / (2 A₀))``."""
    radial_offset: float
    axial_offset: float
    """``A₀ cos α₀`` and ``A₀ sin α₀ + preload_approach`` [m]; without preload that of deep grooves is zero,
    as under a radial load, and that of a pair with play is smaller by its axial half."""
    pitch_radius: float
    """``D_pw / 2`` [m], the arm of the tilt in kinematics and in moment."""
    inner_stiffness: float
    outer_stiffness: float
    ball_stiffness: float
    """Stiffness of the ball on one race and of both contacts in series, K_tot [N/m^1.5]."""
    stress_coefficient_inner: float
    stress_coefficient_outer: float
    """``σ = coefficient · Q^(1/3)`` [Pa/N^(1/3)]."""
    ball_angles: Array
    """Angles of the balls of the first row from +x towards +y [rad], shape (Z,)."""
    second_row_offset: float
    """Angle of the second row against the first, as a fraction of the ball pitch [1]."""
    axial_signs: tuple[float, ...]
    """For each row: +1 if an axial displacement of the race along +z loads it, else −1 [1]."""
    preload: float
    preload_approach: float
    preload_ball_load: float
    """Axial force of each row [N], its axial approach [m], the load of each ball [N]."""

    @property
    def preloaded(self) -> bool:
        """Whether the balls are loaded without any load on the bearing. Source: definition."""
        return self.preload_ball_load > 0.0

    @property
    def radial_play(self) -> float:
        """Way of the race from the centre until the first ball touches, straight towards it [m].

        Half the clearance of deep grooves, ``√(A₀² − axial_offset²) − radial_offset``. Source: definition.
        """
        if self.preloaded:
            return 0.0
        A_0, axial = self.groove_distance, self.axial_offset
        return max(math.sqrt(max(A_0 * A_0 - axial * axial, 0.0)) - self.radial_offset, 0.0)

    @property
    def axial_play(self) -> float:
        """Way of the race of one row from one axial end to the other, ``2 A₀ sin α₀`` [m].

        Source: Harris, Rolling Bearing Analysis, free endplay of a bearing with radial clearance.
        """
        return 2.0 * self.groove_distance * float(sin_each(self.contact_angle))

    @property
    def radial_contact_angle(self) -> float:
        """Contact angle at which a radial load meets the balls [rad]: that of the first touch.

        Source: definition.
        """
        return self.contact_angle if self.preloaded else asin(self.axial_offset / self.groove_distance)

    @property
    def row_count(self) -> int:
        """Number of rows [1]. Source: definition."""
        return len(self.axial_signs)

    @property
    def ball_count(self) -> int:
        """Balls of one row [1]. Source: definition."""
        return len(self.ball_angles)

    @property
    def row_ball_angles(self) -> Array:
        """Angles of all balls from +x towards +y [rad]; shape (rows, Z). Source: definition."""
        shift = self.second_row_offset * 2.0 * math.pi / self.ball_count
        shifts = shift * np.arange(self.row_count, dtype=np.float64)
        return np.add(self.ball_angles, shifts[:, None])


def row_axial_force(s: ArrayLike, ZK: ArrayLike, A_0: ArrayLike, alpha_0: ArrayLike) -> Any:
    """Axial force [N] of one row at an axial approach s ≥ 0 of its rings.

    Parameters
    ----------
    s : float or ndarray
        Axial approach from the position in which the balls just touch [m].
    ZK : float or ndarray
        Number of balls times K_tot [N/m^1.5].
    A_0 : float or ndarray
        Distance of the unloaded groove centres [m].
    alpha_0 : float or ndarray
        Nominal contact angle [rad].

    Returns
    -------
    float or ndarray
        ``Z K δ^1.5 sin φ`` [N] with the contact angle φ under load.

    Notes
    -----
    Source: Neisi 2020, eqs. (3)–(6), for an axial displacement.
    """
    axial = A_0 * sin_each(alpha_0) + s
    A = magnitude(A_0 * cos_each(alpha_0), axial)
    delta = _elongation(s, A, A_0, alpha_0)
    return ZK * delta * np.sqrt(delta) * axial / A


def row_axial_stiffness(s: ArrayLike, ZK: ArrayLike, A_0: ArrayLike, alpha_0: ArrayLike) -> Any:
    """Slope dF/ds [N/m] of `row_axial_force`, with the same arguments.

    Source: Neisi 2020, eqs. (3)–(6), differentiated; the change of the contact angle is included.
    """
    axial = A_0 * sin_each(alpha_0) + s
    A = magnitude(A_0 * cos_each(alpha_0), axial)
    delta = _elongation(s, A, A_0, alpha_0)
    square = (axial / A) * (axial / A)
    return ZK * np.sqrt(delta) * (1.5 * square + delta / A * (1.0 - square))


def row_approach(F: ArrayLike, ZK: ArrayLike, A_0: ArrayLike, alpha_0: ArrayLike) -> Any:
    """Axial approach [m] at which one row carries an axial force F ≥ 0 [N].

    The other arguments are those of `row_axial_force`. Newton's method on
    ``F^(2/3)``, nearly a straight line, from a bound above the root.
    Source: inverse of Neisi 2020, eqs. (3)–(6), for an axial displacement.
    """
    F, ZK, A_0, alpha_0 = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (F, ZK, A_0, alpha_0)))
    sine = np.maximum(sin_each(alpha_0), 1e-9)
    steep = cube_root_each(F / (ZK * sine * sine * np.sqrt(sine)))
    flat = np.sqrt(np.sqrt(F / ZK * A_0 * (2.0 * A_0) * np.sqrt(2.0 * A_0)))
    s, root = np.minimum(steep * steep, flat), cube_root_each(F)
    for _ in range(_NEWTON_STEPS):
        force = row_axial_force(s, ZK, A_0, alpha_0)
        slope = row_axial_stiffness(s, ZK, A_0, alpha_0)
        gain = 1.5 * (force - cube_root_each(force) * root * root)
        step = np.divide(gain, slope, out=np.zeros_like(s), where=slope > 0.0)
        s = np.maximum(s - step, 0.0)
        if np.all(np.abs(step) <= 1e-15 * s):
            break
    return s[()]


def preload_of_offset(constants: BearingConstants, axial_offset: float) -> float:
    """Axial force of one row [N] whose grooves are offset by a distance [m] with the race centred.

    Source: Neisi 2020, eqs. (3)–(6), for an axial displacement; the inverse of what the preload sets.
    """
    distance = math.sqrt(constants.radial_offset * constants.radial_offset + axial_offset * axial_offset)
    approach = max(distance - constants.groove_distance, 0.0)
    load = constants.ball_stiffness * approach * math.sqrt(approach)
    return float(len(constants.ball_angles) * load * axial_offset / distance)


def bearing_constants(bearing: BallBearingDescription) -> BearingConstants:
    """Constants of a touchdown bearing: groove offsets, contact stiffness, stress coefficients, preload.

    Returns SI values; array shapes in `BearingConstants`.
    Source: Neisi 2020, eqs. (2)–(7), in the algebraic form ``δ = A − A₀``.
    """
    D_w, D_pw = float(bearing.ball_diameter), float(bearing.pitch_diameter)
    f_i, f_o = float(bearing.conformity_inner), float(bearing.conformity_outer)
    Z, A_0, F_V = int(bearing.ball_count), (f_i + f_o - 1.0) * D_w, float(bearing.preload)
    alpha, radial_play = _angle_and_play(bearing, A_0)
    eta = compliance(
        float(bearing.ring_youngs_modulus),
        float(bearing.ring_poisson_ratio),
        float(bearing.ball_youngs_modulus),
        float(bearing.ball_poisson_ratio),
    )
    radial = A_0 * float(cos_each(alpha))
    # The load of a loose bearing meets the balls at the angle of the first touch, in deep grooves at none.
    touching = alpha if F_V > 0.0 or radial_play == 0.0 else acos(min((radial + radial_play) / A_0, 1.0))
    inner = race_contact(D_w, D_pw, f_i, touching, eta, inner=True)
    outer = race_contact(D_w, D_pw, f_o, touching, eta, inner=False)
    K = float(contacts_in_series(inner.stiffness, outer.stiffness))
    s = float(row_approach(F_V, Z * K, A_0, alpha))
    axial = A_0 * float(sin_each(touching)) + s
    return BearingConstants(
        groove_distance=A_0,
        contact_angle=alpha,
        radial_offset=radial,
        axial_offset=axial,
        pitch_radius=0.5 * D_pw,
        inner_stiffness=float(inner.stiffness),
        outer_stiffness=float(outer.stiffness),
        ball_stiffness=K,
        stress_coefficient_inner=float(inner.stress_coefficient),
        stress_coefficient_outer=float(outer.stress_coefficient),
        ball_angles=np.arange(Z, dtype=np.float64) * (2.0 * math.pi / Z)
        + (0.5 * math.pi + float(bearing.first_ball_angle)),
        second_row_offset=float(bearing.second_row_offset),
        axial_signs=_AXIAL_SIGNS[bearing.arrangement],
        preload=F_V,
        preload_approach=s,
        preload_ball_load=F_V * math.sqrt(radial * radial + axial * axial) / (Z * axial)
        if F_V > 0.0
        else 0.0,
    )


def _angle_and_play(bearing: BallBearingDescription, A_0: float) -> tuple[float, float]:
    """Free contact angle [rad] and the radial way [m] of the centred race to its first ball."""
    alpha = float(bearing.contact_angle)
    if bearing.clearance is None:
        return alpha, 0.0
    half = 0.5 * float(bearing.clearance)
    if alpha == 0.0:
        return free_contact_angle(2.0 * half, A_0), half
    return alpha, half


def free_contact_angle(P_d: float, A_0: float) -> float:
    """Contact angle [rad] of a row of deep grooves pushed to its axial end without load.

    ``α₀ = acos(1 − P_d / (2 A₀))`` from the radial clearance P_d, across the diameter [m], and the distance
    of the groove centres A₀ [m]. Source: Harris, Rolling Bearing Analysis, free contact angle.
    """
    return acos(1.0 - 0.5 * P_d / A_0)


def axial_rigidity(constants: BearingConstants) -> float:
    """Axial rigidity [N/m] of a preloaded X or O pair, as catalogues print it: 2 dF/ds of a row.

    Source: tangent at zero external load; reproduces the FAG and GMN spindle bearing tables.
    """
    _require_pair(constants, "axial rigidity")
    return 2.0 * float(row_axial_stiffness(constants.preload_approach, *_row(constants)))


def ball_centrifugal_force(bearing: BallBearingDescription, omega_i: ArrayLike) -> Any:
    """Centrifugal force [N] of one ball while the inner race turns at ω_i [rad/s].

    ``½ m_b D_pw ω_c²`` with the cage speed ``ω_c = ½ ω_i (1 − γ)``. It loads the outer race only.
    Source: Harris, Rolling Bearing Analysis. Differs from the paper, which neglects it; our drops neglect it
    too, and `rotordrop check` compares it with the preload ball load.
    """
    D_w, D_pw = float(bearing.ball_diameter), float(bearing.pitch_diameter)
    mass = float(bearing.ball_density) * math.pi / 6.0 * D_w * D_w * D_w
    gamma = D_w * float(cos_each(float(bearing.contact_angle))) / D_pw
    return 0.5 * mass * D_pw * np.square(0.5 * omega_i * (1.0 - gamma))


def _elongation(s: ArrayLike, A: ArrayLike, A_0: ArrayLike, alpha_0: ArrayLike) -> Any:
    """``A − A₀`` [m] without the cancellation of the difference; zero where the balls are loose."""
    return np.maximum(s * (2.0 * A_0 * sin_each(alpha_0) + s) / (A + A_0), 0.0)


def _row(constants: BearingConstants) -> tuple[float, float, float]:
    stiffness = constants.ball_count * constants.ball_stiffness
    return stiffness, constants.groove_distance, constants.contact_angle


def _require_pair(constants: BearingConstants, quantity: str) -> None:
    if sum(constants.axial_signs) != 0.0:
        arrangement = "a single row" if constants.row_count == 1 else "a tandem pair"
        raise UsageError(
            f"the {quantity} is defined for a preloaded pair in X or O arrangement, not for {arrangement}; "
            'set the arrangement of the bearing to "X" or "O"'
        )
