"""The rotor that nothing holds, under forces at nodes: the one model of fall, flight and first contacts.

Without bearings the rotor is linear: modes with gyroscopic coupling and damping. With displacements and
forces as complex numbers x + j y, ``q̈ + (D − jωG) q̇ + Λ q = shapesᵀ f``; its motion is a matrix exponential.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array, ComplexArray
from rotordrop.machine import Machine
from rotordrop.record.axes import Plane
from rotordrop.rotor.assembly import N_RIGID, RotorFE, build_rotor_fe
from rotordrop.rotor.reduction import Reduction, RotorBasis, modes_that_sag, reduce_rotor
from rotordrop.rotor.statics import load_vectors, rest_on

GROWN = 5e-3
"""Time in which the force of a magnet that stays on grows to its size [s]: most of a fall (chosen)."""

POWERS = 5
"""Powers of the time in which that force is written [1]. The release of hidden rotors of 13, 60 and 500 kg is
19, 32 and 32 µs off (standard errors of 20, 15 and 23 µs); 3 leave 48 on 60 kg, and 6 leave 17 but run away
behind the fall."""

GRID = 1e-5
"""Step of the tabulated responses [s]: straight lines between them are off by 0.1 nm in a fall."""


def motion_of(basis: RotorBasis, speed: float) -> ComplexArray:
    """Rates of displacements and velocities of the modes by themselves [1/s], shape (2m, 2m).

    The modes are damped each by itself, as the time loop of a drop takes them.
    """
    m = basis.size
    system = np.zeros((2 * m, 2 * m), dtype=np.complex128)
    system[:m, m:] = np.eye(m)
    system[m:, :m] = -np.diag(basis.eigenvalues)
    system[m:, m:] = -np.diag(np.diag(basis.damping)) + 1j * speed * basis.polar
    return system


@dataclass(frozen=True, kw_only=True)
class Held:
    """What holds the levitated rotor; A magnetic bearings or places that stand for them."""

    nodes: tuple[int, ...]
    """Where, counted from 1."""
    lift: Array
    """Static lift [N], shape (A,)."""
    aside: Array
    """Horizontal force that kept loads from pushing the rotor aside [N], shape (A,)."""
    words: str
    """By what, in words."""
    by_magnets: bool
    """Whether the machine file says where its magnetic bearings are."""


def held_by(machine: Machine, planes: tuple[Plane, ...], fe: RotorFE) -> Held:
    """Say what holds the levitated rotor: its AMBs, or where they are not known its sensor planes.

    Sensors stand beside the magnets that they control. Holding lp400 at its sensor planes dates a fall to
    0.03 ms, each plane falling by itself to 0.1 ms.
    """
    gravity, ambs = float(machine.gravity), machine.ambs
    across, upright = load_vectors(fe, machine, 0.0, float(machine.speed.nominal))
    if len({amb.node for amb in ambs}) >= 2:
        compliance = [0.0 if amb.integral_action else 1.0 / float(amb.stiffness) for amb in ambs]
        nodes = tuple(amb.node for amb in ambs)
        lift = rest_on(fe, nodes, gravity, compliance, upright)[1]
        aside = rest_on(fe, nodes, 0.0, compliance, across)[1]
        words = f"{len(nodes)} magnetic bearings"
        return Held(nodes=nodes, lift=lift, aside=aside, words=words, by_magnets=True)
    bearings = tuple(bearing.node for bearing in machine.touchdown_bearings)
    guesses = (tuple(plane.node for plane in planes), bearings, (1, len(machine.rotor.node_positions)))
    nodes = next(guess for guess in guesses if len(set(guess)) >= 2)
    lift = rest_on(fe, nodes, gravity, beside=upright)[1]
    aside = rest_on(fe, nodes, 0.0, beside=across)[1]
    words = f"forces at nodes {', '.join(map(str, nodes))} (the AMB planes are not known)"
    return Held(nodes=nodes, lift=lift, aside=aside, words=words, by_magnets=False)


@dataclass(frozen=True, kw_only=True)
class FreeRotor:
    """A rotor without bearings, seen at the sensor planes and pushed at some nodes."""

    basis: RotorBasis
    """Its modes."""
    plane_rows: Array
    """Displacement at the sensor planes per modal amplitude [1/sqrt(kg)], shape (P, m)."""
    force_rows: Array
    """The same where forces act, shape (A, m)."""
    lift: Array
    """Static lift that acted there before the release and has gone [N], 0 where a magnet stays on, (A,)."""
    aside: Array
    """The same of the horizontal force that kept loads from pushing it aside."""
    held: tuple[tuple[int, float, float], ...] = ()
    """Magnets that stay on: place among them, stiffness [N/m] and damping [N s/m] as described."""
    mass: float
    """Mass [kg]."""
    description: str
    """The model in words."""

    def table(self, speed: float, exponent: complex, span: float) -> ComplexArray:
        """Displacement of the planes (K, P, A) [m/N] at 0, `GRID`, 2 `GRID`, … after a unit force at each
        place.

        At a speed [rad/s], over a span from the release on [s]. The force goes as ``exp(−exponent · t)``: 0
        for a step, 1/τ for a fading force, −jω for a turning one [1/s].
        """
        m, inputs = self.basis.size, len(self.force_rows)
        system = np.zeros((2 * m + inputs, 2 * m + inputs), dtype=np.complex128)
        system[: 2 * m, : 2 * m] = motion_of(self.basis, speed)
        system[m : 2 * m, 2 * m :] = self.force_rows.T
        system[2 * m :, 2 * m :] = -exponent * np.eye(inputs)
        states = _stepped(system, np.eye(2 * m + inputs)[:, 2 * m :], span)
        return np.asarray(self.plane_rows @ states[:, :m])

    def table_of_start(self, speed: float, span: float) -> ComplexArray:
        """Displacement of the planes (K, P, 2m) by unit displacements and velocities of the modes."""
        m = self.basis.size
        states = _stepped(motion_of(self.basis, speed), np.eye(2 * m), span)
        return np.asarray(self.plane_rows @ states[:, :m])


def free_rotor(machine: Machine, planes: tuple[Plane, ...]) -> FreeRotor:
    """Model the rotor that is released by what held it."""
    fe = build_rotor_fe(machine)
    held = held_by(machine, planes, fe)
    modes = modes_that_sag(fe)
    basis = reduce_rotor(fe, Reduction(modes=modes, attachment=False))
    words = f"free rotor with {modes - N_RIGID} bending modes, released by {held.words}"
    released = _pushed(fe, basis, planes, held.nodes, (held.lift, held.aside), words)
    stay = tuple(
        (place, float(amb.stiffness), float(amb.damping))
        for place, amb in enumerate(machine.ambs)
        if held.by_magnets and amb.stays_on
    )
    if not stay:
        return released
    gone = np.array([held.lift, held.aside])
    gone[:, [place for place, *_ in stay]] = 0.0
    return replace(released, lift=gone[0], aside=gone[1], held=stay)


def rotor_pushed_at_bearings(machine: Machine, planes: tuple[Plane, ...]) -> FreeRotor:
    """Model the free rotor with forces at the touchdown bearings, local flexibility there included."""
    fe = build_rotor_fe(machine)
    nodes = [bearing.node for bearing in machine.touchdown_bearings]
    basis = reduce_rotor(fe, Reduction(modes=modes_that_sag(fe) + 2, attachment=True), nodes)
    words = f"free rotor, {basis.description}, pushed at {len(nodes)} touchdown bearings"
    return _pushed(fe, basis, planes, nodes, (np.zeros(len(nodes)), np.zeros(len(nodes))), words)


def _pushed(
    fe: RotorFE,
    basis: RotorBasis,
    planes: tuple[Plane, ...],
    nodes: Sequence[int],
    gone: tuple[Array, Array],
    description: str,
) -> FreeRotor:
    return FreeRotor(
        basis=basis,
        plane_rows=np.array([basis.node_row(plane.node) for plane in planes]),
        force_rows=np.array([basis.node_row(node) for node in nodes]),
        lift=gone[0],
        aside=gone[1],
        mass=float(fe.total_mass),
        description=description,
    )


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


def response_at(table: ComplexArray | Array, since: Array) -> ComplexArray:
    """Look up a tabulated response (K, ...) at times since the release [s], shape (T,): zero before it."""
    place = np.minimum(np.maximum(since / GRID, 0.0), len(table) - 1.001)
    low = place.astype(np.int64)
    share = (place - low).reshape(-1, *[1] * (table.ndim - 1))
    return np.asarray(table[low] * (1.0 - share) + table[low + 1] * share)


@dataclass(frozen=True, kw_only=True)
class Responses:
    """What a released rotor answers to forces that stay, turn with it or fade, tabulated once for a span."""

    table: ComplexArray
    """Displacement of the planes (K, P, 3A + 2m): by forces that stay, turn with the shaft and against it
    [m/N], then left to themselves, by displacements and velocities of the modes."""
    system: ComplexArray
    inputs: Array
    """Derivative of those by themselves and by unit forces at the places of the rotor."""

    held: ComplexArray
    """Displacement of the planes (K, P, H · `POWERS`) by forces at magnets that stay on which grow with
    powers of the time over `GROWN`, magnet after magnet [m/N]."""

    @classmethod
    def of(cls, rotor: FreeRotor, speed: float, span: float) -> Responses:
        """Tabulate a rotor at a speed [rad/s] over a time from the release on [s]."""
        fixed = [rotor.table(speed, s, span) for s in (0.0, -1j * speed, 1j * speed)]
        growing: list[ComplexArray] = []
        of_step: ComplexArray = fixed[0][..., [place for place, *_ in rotor.held]]
        for power in range(1, POWERS + 1):  # a force that is the integral of the one before
            middle = 0.5 * (of_step[1:] + of_step[:-1])
            summed = np.concatenate([np.zeros_like(of_step[:1]), np.cumsum(middle, axis=0)])
            of_step = np.asarray(power * GRID / GROWN * summed, dtype=np.complex128)
            growing.append(of_step)
        return cls(
            held=np.stack(growing, axis=-1).reshape(*of_step.shape[:2], -1),
            table=np.concatenate([*fixed, rotor.table_of_start(speed, span)], axis=-1),
            system=motion_of(rotor.basis, speed),
            inputs=np.vstack([np.zeros_like(rotor.force_rows.T), rotor.force_rows.T]),
        )

    def reaches(self, span: float) -> bool:
        """Whether the table goes as far as a time from the release on [s]."""
        return (len(self.table) - 1) * GRID >= span

    def at(self, since: Array) -> tuple[ComplexArray, ComplexArray]:
        """Displacement of the planes left to themselves, shape (T, P, 2m), and by forces that stay, turn with
        the shaft and against it, shape (T, P, 3A), at times from the release on [s].
        """
        response, forces = response_at(self.table, since), 3 * self.inputs.shape[1]
        return response[..., forces:], response[..., :forces]

    def growing(self, since: Array) -> ComplexArray:
        """Response (T, P, ·) to what magnets that stay on add to their force, by time from release."""
        return response_at(self.held, since)

    def fading(self, decay: float, since: Array, free: ComplexArray) -> ComplexArray:
        """Response (T, P, A) to forces that fade with a time constant [s], at times from the release [s].

        With x' = A x + B exp(−t/τ) and x(0) = 0, x = (exp(A t) − exp(−t/τ)) (A + 1/τ)⁻¹ B; `free` is what the
        table says of those times for a rotor left to itself. Only the rows that are asked for are multiplied:
        the whole table is ten times as long, and a product of that size is handed to several threads, which
        on a busy computer cost ten times the work.
        """
        rate = 1.0 / decay
        share = np.linalg.solve(self.system + rate * np.eye(len(self.system)), self.inputs)
        fades = np.exp(-rate * GRID * np.arange(len(self.table)))
        released = (free.reshape(-1, free.shape[-1]) @ share).reshape(*free.shape[:2], -1)
        begun = self.table[0, :, -len(share) :] @ share
        return np.asarray(released - response_at(fades, since)[:, None, None] * begun)
