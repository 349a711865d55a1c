"""Balls at speed: equilibrium of one ball between grooves under centrifugal force, its energy and stiffness.

The outer groove centre is the origin, the inner one stands at (A1, A2), axial and radial; the ball centre X
lies where its energy is least. Everything is an array over balls; the drop model reads tables made of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics.ball_bearing import BearingConstants
from rotordrop.physics.ball_bearing_geometry import BallBearingDescription

_STEPS = 400
_FLOOR = 1e-10
"""Newton steps at most; share of a ball's stiffness added to what may be loose [1]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FastBalls:
    """Grooves, contacts and mass of the balls of one row."""

    inner_groove: float
    outer_groove: float
    """Distance of the groove centre from that of a ball that just touches, ``(f − ½) D`` [m]."""
    inner_stiffness: float
    outer_stiffness: float
    """Stiffness of the ball on one race [N/m^1.5]."""
    diameter: float
    pitch_diameter: float
    """Ball and pitch circle [m]."""
    mass: float
    """Mass of a ball [kg]."""
    radial_offset: float
    axial_offset: float
    """Inner groove centre with the race centred, from the outer one [m]."""

    @classmethod
    def of(cls, bearing: BallBearingDescription, constants: BearingConstants) -> FastBalls:
        """Balls of a bearing. Source: definition."""
        D = float(bearing.ball_diameter)
        return cls(
            inner_groove=(float(bearing.conformity_inner) - 0.5) * D,
            outer_groove=(float(bearing.conformity_outer) - 0.5) * D,
            inner_stiffness=constants.inner_stiffness,
            outer_stiffness=constants.outer_stiffness,
            diameter=D,
            pitch_diameter=float(bearing.pitch_diameter),
            mass=float(bearing.ball_density) * math.pi / 6.0 * D * D * D,
            radial_offset=constants.radial_offset,
            axial_offset=constants.axial_offset,
        )

    def orbit(self, omega: Array | float, alpha_i: Array | float, alpha_o: Array | float) -> Array:
        """Speed of the ball set [rad/s] while the race turns at ω [rad/s], at contact angles [rad].

        ``½ ω (1 − (D/d_m) cos((α_i + α_o)/2))``. Source: Harris, Rolling Bearing Analysis, with the mean of
        both angles; 2 to 5 % from either race control.
        """
        share = self.diameter / self.pitch_diameter * np.cos(0.5 * np.add(alpha_i, alpha_o))
        return np.asarray(0.5 * omega * (1.0 - share))

    def centrifugal_force(self, orbit: Array | float) -> Array:
        """Centrifugal force [N] of a ball that orbits at a speed [rad/s]. Source: ``½ m d_m ω_c²``."""
        return np.asarray(0.5 * self.mass * self.pitch_diameter * np.square(orbit))


@dataclass(frozen=True, kw_only=True, eq=False)
class BallState:
    """Balls in equilibrium; arrays of one shape."""

    inner_load: Array
    outer_load: Array
    """Load on the two races [N]."""
    inner_angle: Array
    outer_angle: Array
    """Contact angles [rad]."""
    radial: Array
    axial: Array
    """Ball centre [m]."""
    energy: Array
    """Elastic energy less ``F_c X2`` [J]: the force on the race is its gradient."""
    radial_force: Array
    axial_force: Array
    """Force on the inner race [N], against its displacement."""
    radial_stiffness: Array
    """Slope of the radial force by the radial place of the groove [N/m]."""
    inner_slope: Array
    outer_slope: Array
    """Slopes of both loads by the radial place of the groove [N/m]."""


def ball_equilibrium(
    balls: FastBalls,
    axial: Array | float,
    radial: Array | float,
    F_c: Array | float,
    M_g: Array | float = 0.0,
) -> BallState:
    """Where balls rest between grooves under a centrifugal force.

    Parameters
    ----------
    balls : FastBalls
        Grooves and contacts.
    axial, radial : float or ndarray
        Inner groove centre A1, A2 from the outer one [m].
    F_c : float or ndarray
        Centrifugal force [N], not negative.
    M_g : float or ndarray
        Gyroscopic moment [N m], held by friction at the outer race; positive as ``J ω_c ω_R sin β``.

    Notes
    -----
    Source: Jones 1960; the minimum of ``2/5 K_i δ_i^2.5 + 2/5 K_o δ_o^2.5 − F_c X2``, which is convex.
    Differs from Harris' printed balance: the sign of the moment is derived, ``−2 M_g/D`` acts on the ball
    along the outer contact. Not validated: dry balls that slide, accelerate or are held by a cage.
    """
    A1, A2, F, M = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (axial, radial, F_c, M_g)))
    A1, A2, F, M = (np.array(v, dtype=np.float64, ndmin=1) for v in (A1, A2, F, M))
    X1, X2 = _first_guess(balls, A1, A2, F)
    loose = np.zeros_like(F)
    push = 2.0 * M / balls.diameter
    spring = balls.outer_stiffness * math.sqrt(1e-3 * balls.outer_groove)
    for _ in range(_STEPS):
        s = _contacts(balls, A1, A2, X1, X2)
        # the friction has no potential; it turns with the ball, which its share of the stiffness leaves out
        g1 = s.o1 * s.Q_o - s.i1 * s.Q_i + push * s.o2
        g2 = s.o2 * s.Q_o - s.i2 * s.Q_i - F - push * s.o1
        h11, h12, h22 = s.h11, s.h12, s.h22
        floor = (_FLOOR + loose) * spring
        det = (h11 + floor) * (h22 + floor) - h12 * h12
        d1 = ((h22 + floor) * g1 - h12 * g2) / det
        d2 = ((h11 + floor) * g2 - h12 * g1) / det
        before = s.energy - F * X2
        size = np.maximum(1.0, np.sqrt(d1 * d1 + d2 * d2) / (0.2 * balls.outer_groove))
        d1, d2 = d1 / size, d2 / size
        trial = _contacts(balls, A1, A2, X1 - d1, X2 - d2)
        better = (trial.energy - F * (X2 - d2) <= before + 1e-13 * np.abs(before)) | (M != 0.0)
        X1, X2 = np.where(better, X1 - d1, X1), np.where(better, X2 - d2, X2)
        loose = np.where(better, 0.1 * loose, np.maximum(4.0 * loose, 1e-6))
        if float(np.max(np.abs(d1) + np.abs(d2))) < 1e-15 * balls.outer_groove:
            break
    return _state(balls, A1, A2, X1, X2, F)


def centred_balls(balls: FastBalls, omega: float, axial: float | None = None) -> tuple[BallState, float]:
    """A ball of a row whose race turns centred at ω [rad/s], and the speed of its orbit [rad/s].

    ``axial`` [m] is the axial offset of the grooves, else that of the preload. The orbit goes by the angles
    it makes: a fixed point. Source: `ball_equilibrium`, `FastBalls.orbit`.
    """
    offset = balls.axial_offset if axial is None else axial
    orbit = balls.orbit(omega, 0.0, 0.0)
    while True:
        state = ball_equilibrium(balls, offset, balls.radial_offset, balls.centrifugal_force(orbit))
        following = balls.orbit(omega, state.inner_angle[0], state.outer_angle[0])
        if abs(following - orbit) <= 1e-12 * abs(omega):
            return state, float(orbit)
        orbit = following


def offset_on_springs(balls: FastBalls, ball_count: int, force: float, omega: float) -> float:
    """Axial offset [m] at which a centred row of so many balls keeps an axial force [N] at ω [rad/s].

    Source: bisection of the axial force of `centred_balls`: springs keep it, and the ring gives way.
    """
    low, high = 0.0, balls.axial_offset + 0.1 * balls.outer_groove
    for _ in range(60):
        middle = 0.5 * (low + high)
        pushed = ball_count * centred_balls(balls, omega, middle)[0].axial_force[0]
        low, high = (middle, high) if pushed < force else (low, middle)
    return middle


@dataclass(frozen=True, kw_only=True, eq=False)
class _Contacts:
    o1: Array
    o2: Array
    i1: Array
    i2: Array
    Q_o: Array
    Q_i: Array
    k_o: Array
    k_i: Array
    t_o: Array
    t_i: Array
    energy: Array

    @property
    def h11(self) -> Array:
        return self.k_o * self.o1**2 + self.t_o * self.o2**2 + self.k_i * self.i1**2 + self.t_i * self.i2**2

    @property
    def h22(self) -> Array:
        return self.k_o * self.o2**2 + self.t_o * self.o1**2 + self.k_i * self.i2**2 + self.t_i * self.i1**2

    @property
    def h12(self) -> Array:
        return (self.k_o - self.t_o) * self.o1 * self.o2 + (self.k_i - self.t_i) * self.i1 * self.i2


def _contacts(balls: FastBalls, A1: Array, A2: Array, X1: Array, X2: Array) -> _Contacts:
    """Both contacts of balls at X: directions, loads, stiffness along and across, elastic energy."""
    l_o = np.maximum(np.sqrt(X1 * X1 + X2 * X2), 1e-12)
    B1, B2 = A1 - X1, A2 - X2
    l_i = np.maximum(np.sqrt(B1 * B1 + B2 * B2), 1e-12)
    d_o, d_i = np.maximum(l_o - balls.outer_groove, 0.0), np.maximum(l_i - balls.inner_groove, 0.0)
    k_o, k_i = balls.outer_stiffness * np.sqrt(d_o), balls.inner_stiffness * np.sqrt(d_i)
    Q_o, Q_i = k_o * d_o, k_i * d_i
    return _Contacts(
        o1=X1 / l_o,
        o2=X2 / l_o,
        i1=B1 / l_i,
        i2=B2 / l_i,
        Q_o=Q_o,
        Q_i=Q_i,
        k_o=1.5 * k_o,
        k_i=1.5 * k_i,
        t_o=Q_o / l_o,
        t_i=Q_i / l_i,
        energy=0.4 * (Q_o * d_o + Q_i * d_i),
    )


def _first_guess(balls: FastBalls, A1: Array, A2: Array, F: Array) -> tuple[Array, Array]:
    """Ball on the line of the groove centres, pressed by its share of the approach and by F_c [N]."""
    A = np.sqrt(A1 * A1 + A2 * A2)
    approach = np.maximum(A - balls.inner_groove - balls.outer_groove, 0.0)
    ratio = np.cbrt(balls.inner_stiffness / balls.outer_stiffness) ** 2
    l_o = balls.outer_groove + approach * ratio / (1.0 + ratio)
    l_o = l_o + np.cbrt(F / balls.outer_stiffness) ** 2
    return l_o * A1 / A, l_o * A2 / A


def _state(balls: FastBalls, A1: Array, A2: Array, X1: Array, X2: Array, F: Array) -> BallState:
    s = _contacts(balls, A1, A2, X1, X2)
    # the ball gives way: what is stiff of its inner contact alone, less what the ball yields
    c11 = s.k_i * s.i1 * s.i2 - s.t_i * s.i1 * s.i2
    c22 = s.k_i * s.i2**2 + s.t_i * s.i1**2
    det = s.h11 * s.h22 - s.h12 * s.h12
    held = det > 0.0
    safe = np.where(held, det, 1.0)
    y1, y2 = (s.h22 * c11 - s.h12 * c22) / safe, (s.h11 * c22 - s.h12 * c11) / safe
    return BallState(
        inner_load=s.Q_i,
        outer_load=s.Q_o,
        inner_angle=np.arctan2(A1 - X1, A2 - X2),
        outer_angle=np.arctan2(X1, X2),
        radial=X2,
        axial=X1,
        energy=s.energy - F * X2,
        radial_force=s.Q_i * s.i2,
        axial_force=s.Q_i * s.i1,
        radial_stiffness=np.where(held, c22 - c11 * y1 - c22 * y2, 0.0),
        inner_slope=np.where(held, s.k_i * (s.i2 - s.i1 * y1 - s.i2 * y2), 0.0),
        outer_slope=np.where(held, s.k_o * (s.o1 * y1 + s.o2 * y2), 0.0),
    )
