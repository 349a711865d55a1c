"""The drop as one writes it down from the paper: numpy over the balls, scipy's RK45, the paper's settings.

The equations are those of the package and the numbers come from the same machine, so that the trajectories
can be compared. Vectors are arrays, the balls of a row are one array with their contact angles (eqs. 2 to 6),
everything that does not depend on the state is prepared once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.physics import columns as L
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.levitation import start_of_drop

MAX_STEP = 5e-6
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Run:
    """What one run gives: time [s], ball force on the races [N], shape (T, B, 2), and what it took."""

    time: np.ndarray
    force: np.ndarray
    calls: int


class Bearing:
    """Contact, friction and balls of one touchdown bearing."""

    def __init__(self, bearing: TouchdownBearing, stiffness: float):
        constants = bearing_constants(bearing.bearing)
        self.rows = [(np.cos(a), np.sin(a)) for a in map(np.asarray, constants.row_ball_angles)]
        self.K, self.A0 = constants.ball_stiffness, constants.groove_distance
        self.radial_offset, self.axial_offset = constants.radial_offset, constants.axial_offset
        self.K_c, self.n = float(bearing.contact.stiffness), float(bearing.contact.exponent)
        self.lam, self.c_r = float(bearing.contact.damping), float(bearing.air_gap)
        self.R_i = float(bearing.bore_radius)
        self.r_r = self.R_i - self.c_r
        self.mu_s, self.mu_d = float(bearing.friction.static), float(bearing.friction.dynamic)
        self.v_stribeck = float(bearing.friction.stribeck_speed)
        self.v_smooth = float(bearing.friction.smoothing_speed)
        self.m_i, self.I_i = float(bearing.race.mass), float(bearing.race.inertia)
        self.drag, self.drag_speed = float(bearing.race.drag_coefficient), float(bearing.race.drag_speed)
        self.D_pw = float(bearing.bearing.pitch_diameter)
        self.C_b = float(bearing.damping_time) * stiffness
        support = bearing.support
        self.m_sup = np.array([float(support.mass_horizontal), float(support.mass)])
        self.K_sup = np.array([float(support.stiffness_horizontal), float(support.stiffness)])
        self.C_sup = np.array([float(support.damping_horizontal), float(support.damping)])

    def ball_force(self, e: np.ndarray) -> np.ndarray:
        """Restoring force [N] of all balls of both rows, eqs. (2) to (6)."""
        force = np.zeros(2)
        for cosines, sines in self.rows:
            e_r = self.radial_offset + e[0] * cosines + e[1] * sines
            phi = np.arctan2(self.axial_offset, e_r)
            delta = np.maximum(e_r / np.cos(phi) - self.A0, 0.0)
            F_r = self.K * delta**1.5 * np.cos(phi)
            force += np.array([np.sum(F_r * cosines), np.sum(F_r * sines)])
        return force

    def contact(self, u: np.ndarray, v: np.ndarray, omega: float, omega_i: float) -> tuple[np.ndarray, float]:
        """Force of the rotor on the race [N] and friction force [N], eqs. (8) to (11)."""
        e_r = np.linalg.norm(u)
        delta = e_r - self.c_r
        if delta <= 0.0:
            return np.zeros(2), 0.0
        normal = u / e_r
        tangent = np.array([-normal[1], normal[0]])
        F_r = max(0.0, self.K_c * delta**self.n * (1.0 + 1.5 * self.lam * (v @ normal)))
        F_mu = self.coefficient(v @ tangent + omega * self.r_r - omega_i * self.R_i) * F_r
        return F_r * normal + F_mu * tangent, F_mu

    def coefficient(self, v_t: float) -> float:
        """Signed Stribeck coefficient."""
        speed, fall = abs(v_t), self.mu_s - self.mu_d
        if speed >= self.v_smooth:
            mu = self.mu_d + fall * np.exp(-(speed - self.v_smooth) / self.v_stribeck)
        else:
            s = speed / self.v_smooth
            slope = -fall * self.v_smooth / self.v_stribeck
            mu = s * (1.5 * self.mu_s - 0.5 * slope + s**2 * (0.5 * slope - 0.5 * self.mu_s))
        return np.sign(v_t) * mu


class NaiveDrop:
    """Right-hand side and run of one drop."""

    def __init__(self, model: DropModel, case: DropCase):
        start, p = start_of_drop(model, case)
        self.layout, self.m = model.layout, model.layout.n_modes
        self.start = start[: model.layout.rotor_angle + 1]
        self.bearings = [
            Bearing(bearing, p.bearing[b, L.BEARING_DAMPING] / float(bearing.damping_time))
            for b, bearing in enumerate(model.machine.touchdown_bearings)
        ]
        self.shape, self.polar = p.bearing_shape, p.polar
        self.stiffness, self.damping = p.eigenvalue, p.damping
        self.gravity = np.array([np.zeros(self.m), p.gravity])
        self.unbalance = np.array([p.unbalance_cos, p.unbalance_sin])
        self.omega_0, self.tau = case.speed, float(model.machine.speed.aero_time_constant)
        self.I_p = model.fe.polar_inertia

    def derivative(self, t: float, y: np.ndarray) -> np.ndarray:
        """Derivative of the state, up to the rotor angle."""
        m, n_b, n_q = self.m, len(self.bearings), self.layout.n_coordinates
        q, q_dot = y[: 2 * m].reshape(2, m), y[n_q : n_q + 2 * m].reshape(2, m)
        race, support = y[2 * m : n_q].reshape(2, n_b, 2)
        race_dot, support_dot = y[n_q + 2 * m : 2 * n_q].reshape(2, n_b, 2)
        spins, omega, angle = y[2 * n_q : 2 * n_q + n_b], y[2 * n_q + n_b], y[2 * n_q + n_b + 1]
        rate = np.empty_like(y)
        race_rate, support_rate = rate[n_q + 2 * m : 2 * n_q].reshape(2, n_b, 2)
        force = self.gravity - self.stiffness * q - self.damping * q_dot
        torque = 0.0
        for b, bearing in enumerate(self.bearings):
            row = self.shape[b]
            F_c, F_mu = bearing.contact(q @ row - race[b], q_dot @ row - race_dot[b], omega, spins[b])
            F_b = bearing.ball_force(race[b] - support[b])
            M_drag = (
                bearing.drag * np.linalg.norm(F_b) * bearing.D_pw / 2 * np.tanh(spins[b] / bearing.drag_speed)
            )
            F_b += bearing.C_b * (race_dot[b] - support_dot[b])
            race_rate[b] = (F_c - F_b) / bearing.m_i
            support_rate[b] = (
                F_b - bearing.C_sup * support_dot[b] - bearing.K_sup * support[b]
            ) / bearing.m_sup
            rate[2 * n_q + b] = (F_mu * bearing.R_i - M_drag) / bearing.I_i
            force -= np.outer(F_c, row)
            torque -= F_mu * bearing.r_r
        omega_dot = -self.omega_0 / self.tau * np.exp(-t / self.tau) + torque / self.I_p
        c, s = np.cos(angle), np.sin(angle)
        along, across = omega**2 * c + omega_dot * s, omega**2 * s - omega_dot * c
        force += np.array([[along, -across], [across, along]]) @ self.unbalance
        turning = (omega * q_dot + omega_dot * q) @ self.polar
        force += np.array([-turning[1], turning[0]])
        rate[:n_q] = y[n_q : 2 * n_q]
        rate[n_q : n_q + 2 * m] = force.ravel()
        rate[-2:] = omega_dot, omega
        return rate

    def run(self, duration: float, times: np.ndarray | None = None) -> Run:
        """Integrate with RK45 at a largest step of 5e-6 s and both tolerances 1e-5."""
        solution = solve_ivp(
            self.derivative,
            (0.0, duration),
            self.start,
            method="RK45",
            t_eval=times,
            max_step=MAX_STEP,
            rtol=TOLERANCE,
            atol=TOLERANCE,
        )
        return Run(solution.t, self.forces(solution.y), solution.nfev)

    def forces(self, states: np.ndarray) -> np.ndarray:
        """Ball force on the races [N], shape (T, B, 2)."""
        away = (states[self.layout.race] - states[self.layout.support]).T.reshape(-1, len(self.bearings), 2)
        return np.array([[-b.ball_force(e) for b, e in zip(self.bearings, es, strict=True)] for es in away])
