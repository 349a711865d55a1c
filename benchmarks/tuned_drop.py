"""The naive drop tuned as far as numpy goes: no angles, balls in one array, scalars as Python floats.

What someone who profiles `naive_drop` arrives at before leaving numpy; integrated in the same way.
"""

from __future__ import annotations

import math

import numpy as np
from naive_drop import NaiveDrop

from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.levitation import start_of_drop


class Bearing:
    """Contact, friction, balls, race and support of one touchdown bearing."""

    def __init__(self, values: np.ndarray, cosines: np.ndarray, sines: np.ndarray, weights: np.ndarray):
        self.value = [float(v) for v in values]
        present = weights > 0.0
        rows = np.repeat(np.arange(int(present.sum())), weights[present].astype(int))
        self.directions = np.array([cosines[present][rows], sines[present][rows]])

    def ball_force(self, dx: float, dy: float) -> tuple[float, float]:
        """Force [N] of all balls against a displaced race, one array entry per ball."""
        v = self.value
        across = v[L.RADIAL_OFFSET] + np.array([dx, dy]) @ self.directions
        distance = np.hypot(across, v[L.AXIAL_OFFSET])
        squeeze = np.maximum(distance - v[L.GROOVE_DISTANCE], 0.0)
        load = v[L.BALL_STIFFNESS] * squeeze * np.sqrt(squeeze) * across / distance
        x, y = self.directions @ load
        return float(x), float(y)

    def contact(self, ux, uy, vx, vy, omega, omega_i) -> tuple[float, float, float]:
        """Force of the rotor on the race [N] and friction force [N]."""
        v = self.value
        radius = math.hypot(ux, uy)
        depth = radius - v[L.AIR_GAP]
        if depth <= 0.0:
            return 0.0, 0.0, 0.0
        nx, ny = ux / radius, uy / radius
        rate = vx * nx + vy * ny
        growth = 1.0 + 1.5 * v[L.CONTACT_DAMPING] * rate
        normal = max(0.0, v[L.CONTACT_STIFFNESS] * depth ** v[L.CONTACT_EXPONENT] * growth)
        slip = vy * nx - vx * ny + omega * v[L.ROTOR_RADIUS] - omega_i * v[L.BORE_RADIUS]
        friction = normal * self.coefficient(slip)
        return normal * nx - friction * ny, normal * ny + friction * nx, friction

    def coefficient(self, slip: float) -> float:
        """Stribeck coefficient with the sign of the slip."""
        v = self.value
        speed, smooth = abs(slip), v[L.SMOOTHING_SPEED]
        static, dynamic = v[L.FRICTION_STATIC], v[L.FRICTION_DYNAMIC]
        if speed >= smooth:
            mu = dynamic + (static - dynamic) * math.exp(-(speed - smooth) / v[L.STRIBECK_SPEED])
        else:
            s = speed / smooth
            slope = -(static - dynamic) * smooth / v[L.STRIBECK_SPEED]
            mu = s * (1.5 * static - 0.5 * slope + s * s * (0.5 * slope - 0.5 * static))
        return math.copysign(mu, slip)


class TunedDrop(NaiveDrop):
    """The same right-hand side, written for speed."""

    def __init__(self, model: DropModel, case: DropCase):
        super().__init__(model, case)
        self.p = p = start_of_drop(model, case)[1]
        self.tuned = [Bearing(p.bearing[b], *p.balls[b]) for b in range(model.layout.n_bearings)]

    def derivative(self, t: float, y: np.ndarray) -> np.ndarray:
        """Derivative of the state, up to the rotor angle."""
        p, m = self.p, self.m
        n_b, n_q = len(self.tuned), self.layout.n_coordinates
        q, v = y[: 2 * m].reshape(2, m), y[n_q : n_q + 2 * m].reshape(2, m)
        ends, speeds = q @ p.bearing_shape.T, v @ p.bearing_shape.T
        rest = y[2 * m : n_q].reshape(2, n_b, 2)
        moving = y[n_q + 2 * m : 2 * n_q].reshape(2, n_b, 2)
        place, velocity = (ends.T - rest[0]).tolist(), (speeds.T - moving[0]).tolist()
        races, race_speeds = (rest[0] - rest[1]).tolist(), (moving[0] - moving[1]).tolist()
        supports, support_speeds = rest[1].tolist(), moving[1].tolist()
        spins = y[2 * n_q :].tolist()
        omega, angle = spins[n_b], spins[n_b + 1]
        on_race, race_rate, support_rate, spin_rate = [], [], [], []
        torque = 0.0
        for b, bearing in enumerate(self.tuned):
            value = bearing.value
            cx, cy, friction = bearing.contact(*place[b], *velocity[b], omega, spins[b])
            bx, by = bearing.ball_force(*races[b])
            drag = value[L.DRAG_COEFFICIENT] * math.hypot(bx, by) * 0.5 * value[L.PITCH_DIAMETER]
            drag *= math.tanh(spins[b] / value[L.DRAG_SPEED])
            damping = value[L.BEARING_DAMPING]
            bx += damping * race_speeds[b][0]
            by += damping * race_speeds[b][1]
            (hx, hy), (sx, sy) = supports[b], support_speeds[b]
            on_race.append((cx, cy))
            race_rate += [(cx - bx) / value[L.RACE_MASS], (cy - by) / value[L.RACE_MASS]]
            support_rate += [
                (bx - value[L.SUPPORT_DAMPING_X] * sx - value[L.SUPPORT_STIFFNESS_X] * hx)
                / value[L.SUPPORT_MASS_X],
                (by - value[L.SUPPORT_DAMPING_Y] * sy - value[L.SUPPORT_STIFFNESS_Y] * hy)
                / value[L.SUPPORT_MASS_Y],
            ]
            spin_rate.append((friction * value[L.BORE_RADIUS] - drag) / value[L.RACE_INERTIA])
            torque -= friction * value[L.ROTOR_RADIUS]
        omega_dot = -self.omega_0 / self.tau * math.exp(-t / self.tau) + torque / self.I_p
        rate = np.empty(len(y))
        rate[:n_q] = y[n_q : 2 * n_q]
        rate[n_q : n_q + 2 * m] = self.rotor(q, v, omega, omega_dot, angle, np.array(on_race)).ravel()
        rate[n_q + 2 * m : 2 * n_q] = race_rate + support_rate
        rate[2 * n_q :] = [*spin_rate, omega_dot, omega]
        return rate

    def rotor(self, q, v, omega, omega_dot, angle, on_race) -> np.ndarray:
        """Modal accelerations of both planes, shape (2, m)."""
        p = self.p
        c, s = math.cos(angle), math.sin(angle)
        along, across = omega * omega * c + omega_dot * s, omega * omega * s - omega_dot * c
        pull = np.array([[along, -across], [across, along]]) @ self.unbalance
        turning = (omega * v + omega_dot * q) @ p.polar
        force = pull - on_race.T @ p.bearing_shape - q * p.eigenvalue - v * p.damping
        force[0] -= turning[1]
        force[1] += turning[0] + p.gravity
        return force
