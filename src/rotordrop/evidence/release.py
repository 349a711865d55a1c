"""How a rotor leaves its levitated motion when the magnetic bearings let go.

Up to power-off the readings follow the levitated model. From then on the rotor is free, and its deviation
from the levitated motion is its answer to the force that has gone: the static lift of every magnetic bearing,
the synchronous force, and what remains of the lift for a few milliseconds. The deviation is linear in these
forces, so hum and electrical runout drop out, and so does the unbalance; the gravity sag needs no separate
treatment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.machine import Machine
from rotordrop.record.axes import Plane
from rotordrop.record.recording import Array
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.reduction import Reduction, RotorBasis, reduce_rotor
from rotordrop.rotor.statics import rest_on

ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

GRID = 1e-5
"""Step of the tabulated responses [s]."""

_MODES = 6


@dataclass(frozen=True, kw_only=True)
class FreeRotor:
    """A rotor without bearings, seen at the sensor planes, pushed at the magnetic bearings.

    Displacements and forces are complex, x + j y: ``q̈ + (D − jωG) q̇ + Λ q = force_rowsᵀ f``.
    """

    plane_rows: Array
    """Displacement at the sensor planes per modal amplitude [1/sqrt(kg)], shape (P, m)."""
    force_rows: Array
    """The same at the magnetic bearings, shape (A, m)."""
    stiffness: Array
    """Squares of the natural frequencies [rad²/s²], shape (m,)."""
    damping: Array
    gyroscopic: Array
    """Modal damping [1/s] and polar inertia [1], shape (m, m)."""
    lift: Array
    """Static lift of the magnetic bearings [N] (per unit of mass where `mass` is 1), shape (A,)."""
    mass: float
    """Mass that the synchronous force has to move at most [kg]."""
    description: str
    """The model in words."""


def free_rotor(machine: Machine, planes: tuple[Plane, ...]) -> FreeRotor:
    """Model the released rotor by its finite elements, or plane by plane where the AMB planes are unknown."""
    nodes = [amb.node for amb in machine.ambs]
    gravity = float(machine.gravity)
    if len(set(nodes)) < 2:
        return _points(len(planes), gravity)
    fe = build_rotor_fe(machine)
    compliance = [0.0 if amb.integral_action else 1.0 / float(amb.stiffness) for amb in machine.ambs]
    basis = reduce_rotor(fe, Reduction(modes=_MODES, attachment=False))
    return _pushed(
        basis,
        planes,
        nodes,
        lift=rest_on(fe, nodes, gravity, compliance)[1],
        mass=float(fe.total_mass),
        description=f"free rotor with {_MODES - 2} bending modes, released by {len(nodes)} magnetic bearings",
    )


def rotor_pushed_at_bearings(machine: Machine, planes: tuple[Plane, ...]) -> FreeRotor:
    """Model the free rotor with forces at the touchdown bearings, local flexibility there included."""
    fe = build_rotor_fe(machine)
    nodes = [bearing.node for bearing in machine.touchdown_bearings]
    basis = reduce_rotor(fe, Reduction(modes=_MODES + 2, attachment=True), nodes)
    return _pushed(
        basis,
        planes,
        nodes,
        lift=np.zeros(len(nodes)),
        mass=float(fe.total_mass),
        description=f"free rotor, {basis.description}, pushed at {len(nodes)} touchdown bearings",
    )


def _pushed(
    basis: RotorBasis,
    planes: tuple[Plane, ...],
    nodes: list[int],
    *,
    lift: Array,
    mass: float,
    description: str,
) -> FreeRotor:
    return FreeRotor(
        plane_rows=np.array([basis.node_row(plane.node) for plane in planes]),
        force_rows=np.array([basis.node_row(node) for node in nodes]),
        stiffness=basis.eigenvalues,
        damping=basis.damping,
        gyroscopic=basis.polar,
        lift=lift,
        mass=mass,
        description=description,
    )


def _points(count: int, gravity: float) -> FreeRotor:
    return FreeRotor(
        plane_rows=np.eye(count),
        force_rows=np.eye(count),
        stiffness=np.zeros(count),
        damping=np.zeros((count, count)),
        gyroscopic=np.zeros((count, count)),
        lift=np.full(count, gravity),
        mass=1.0,
        description="each sensor plane falling by itself (the AMB planes are not known)",
    )


def tabulate_response(rotor: FreeRotor, speed: float, exponent: complex, span: float) -> ComplexArray:
    """Displacement of the planes after a unit force ``exp(−exponent · t)`` at each magnetic bearing.

    Parameters
    ----------
    rotor : FreeRotor
        The rotor.
    speed : float
        Shaft speed [rad/s].
    exponent : complex
        0 for a step, 1/τ for a decaying force, −jω for a turning one [1/s].
    span : float
        Time covered from the release [s].

    Returns
    -------
    array, shape (K, P, A), complex
        Displacement [m/N] at 0, `GRID`, 2 `GRID`, …
    """
    m, inputs = len(rotor.stiffness), len(rotor.force_rows)
    system = np.zeros((2 * m + inputs, 2 * m + inputs), dtype=np.complex128)
    system[: 2 * m, : 2 * m] = _of_motion(rotor, speed)
    system[m : 2 * m, 2 * m :] = rotor.force_rows.T
    system[2 * m :, 2 * m :] = -exponent * np.eye(inputs)
    states = _stepped(system, np.eye(2 * m + inputs)[:, 2 * m :], span)
    return np.asarray(rotor.plane_rows @ states[:, :m])


def _of_motion(rotor: FreeRotor, speed: float) -> ComplexArray:
    """Derivative of displacements and velocities of the modes by themselves."""
    m = len(rotor.stiffness)
    system = np.zeros((2 * m, 2 * m), dtype=np.complex128)
    system[:m, m:] = np.eye(m)
    system[m:, :m] = -np.diag(rotor.stiffness)
    system[m:, m:] = -rotor.damping + 1j * speed * rotor.gyroscopic
    return system


def _stepped(system: ComplexArray, start: Array, span: float) -> ComplexArray:
    """States (K, N, C) at 0, `GRID`, 2 `GRID`, … from the columns of a start, by doubling."""
    from scipy.linalg import expm

    step = expm(GRID * system)
    states = start[None].astype(np.complex128)
    count = int(span / GRID) + 2
    while len(states) < count:
        states = np.concatenate([states, step @ states])
        step = step @ step
    return states[:count]


def response_to_start(rotor: FreeRotor, speed: float, span: float) -> ComplexArray:
    """Displacement of the planes (K, P, 2 M) by unit displacements and velocities of the modes."""
    m = len(rotor.stiffness)
    return np.asarray(rotor.plane_rows @ _stepped(_of_motion(rotor, speed), np.eye(2 * m), span)[:, :m])


@dataclass(frozen=True, kw_only=True)
class FallResponses:
    """What a released rotor answers to forces that stay, turn with it or fade, tabulated once for a span."""

    fixed: tuple[ComplexArray, ...]
    """Responses to a force that stays, turns with the shaft and against it [m/N], shape (K, P, A)."""
    free: ComplexArray
    """Displacement of the planes left to themselves, by displacements and velocities of the modes, shape (K,
    P, 2 M)."""
    system: ComplexArray
    inputs: Array
    """Derivative of those by themselves and by unit forces at the magnetic bearings."""

    @classmethod
    def of(cls, rotor: FreeRotor, speed: float, span: float) -> FallResponses:
        """Tabulate a rotor at a speed [rad/s] over a time from the release on [s]."""
        system = _of_motion(rotor, speed)
        return cls(
            fixed=tuple(tabulate_response(rotor, speed, s, span) for s in (0.0, -1j * speed, 1j * speed)),
            free=response_to_start(rotor, speed, span),
            system=system,
            inputs=np.vstack([np.zeros_like(rotor.force_rows.T), rotor.force_rows.T]),
        )

    def fading(self, decay: float, since: Array) -> ComplexArray:
        """Response (T, P, A) to forces that fade with a time constant [s], at times from the release [s].

        With x' = A x + B exp(−t/τ) and x(0) = 0, x = (exp(A t) − exp(−t/τ)) (A + 1/τ)⁻¹ B. Only the rows that
        are asked for are multiplied: the whole table is ten times as long, and a product of that size is
        handed to several threads, which on a busy computer cost ten times the work.
        """
        rate = 1.0 / decay
        share = np.linalg.solve(self.system + rate * np.eye(len(self.system)), self.inputs)
        fades = np.exp(-rate * GRID * np.arange(len(self.free)))[:, None, None]
        free = response_at(self.free, since)
        released = (free.reshape(-1, free.shape[-1]) @ share).reshape(*free.shape[:2], -1)
        return np.asarray(released - response_at(fades, since) * (self.free[0] @ share))


def response_at(table: ComplexArray | Array, since: Array) -> ComplexArray:
    """Look up a tabulated response at times since the release [s], shape (T,): zero before it."""
    place = np.clip(since / GRID, 0.0, len(table) - 1.001)
    low = place.astype(np.int64)
    share = (place - low)[:, None, None]
    return np.asarray(table[low] * (1.0 - share) + table[low + 1] * share)
