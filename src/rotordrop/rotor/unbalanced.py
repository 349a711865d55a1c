"""Response of a machine to its unbalance: amplitude and phase at its sensors and bearings over the speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array, ComplexArray
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.campbell import REDUCTION, response_peaks
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import suspension_of
from rotordrop.rotor.whirl import unbalance_response, unbalance_run_up

RUN_UP_REDUCTION = Reduction(modes=8, attachment=True)
"""Basis of a run-up: every step takes a matrix exponential."""
TURN_PER_STEP = 0.5
"""Turn of the rotor in a step of a run-up [rad]: no beat is faster than the rotor; chosen, not measured."""
FEWEST_STEPS, MOST_STEPS = 400, 60_000
"""Steps of a run-up; the most take half a minute."""

SPEEDS, PEAK_SPEEDS, CLOSEST = 2001, 81, 200
"""Speeds of the even grid and across a sharp peak, and how many times closer two may lie than on the grid."""

SHARP = 20.0
"""Steps of the even grid in the half-power width of a peak below which it is sharp [1]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MachineResponse:
    """Synchronous response of a rotor to its unbalance."""

    suspension: str
    """What holds the rotor."""
    speed: Array
    """Speeds [rad/s], shape (S,)."""
    displacement: ComplexArray
    """Displacement (x, y) at the nodes [m], ``Re(value · e^(jωt))``, shape (S, N, 2)."""
    node_positions: Array
    """Positions along z [m], shape (N,)."""
    places: tuple[tuple[str, int], ...]
    """Planes of interest with their nodes, counted from 1."""
    unbalance: tuple[tuple[int, float, float], ...]
    """Node, amount [kg m] and phase from +y [rad] of every unbalance."""
    run_up: float | None = None
    """Time [s] in which the speed rose evenly over `speed`; None where it was steady at each."""

    def at(self, node: int) -> ComplexArray:
        """Displacement (x, y) at a node [m], shape (S, 2)."""
        return np.asarray(self.displacement[:, node - 1])

    def major_axis(self, node: int) -> Array:
        """Half the major axis of the orbit at a node [m], shape (S,)."""
        return orbit_axis(self.at(node))


def orbit_axis(displacement: ComplexArray) -> Array:
    """Half the major axis [m] of orbits given by their displacements (x, y), last axis 2.

    Source: an ellipse is a forward and a backward circle; the axis is the sum of their radii.
    """
    x, y = displacement[..., 0], displacement[..., 1]
    forward, backward = 0.5 * np.abs(x + 1j * y), 0.5 * np.abs(np.conj(x) + 1j * np.conj(y))
    return np.asarray(forward + backward)


def machine_response(machine: Machine, speeds: ArrayLike, suspension: str) -> MachineResponse:
    """Response at speeds [rad/s], (S,), to the unbalance of a machine, in the AMBs or settled in its
    bearings.

    The machine needs unbalances, or a balance grade, which says nothing of their phases.
    """
    known, forces = _unbalances_of(machine)
    supports = suspension_of(machine, suspension)
    fe = build_rotor_fe(machine)
    basis = reduce_rotor(fe, REDUCTION, [*(support.node for support in supports), *forces])
    grid = np.atleast_1d(np.asarray(speeds, dtype=np.float64))
    return MachineResponse(
        suspension=suspension,
        speed=grid,
        displacement=unbalance_response(basis, grid, forces, supports),
        node_positions=fe.node_positions,
        places=_places(machine),
        unbalance=known,
    )


def run_up_response(
    machine: Machine, top: float, duration: float, suspension: str, start: float = 0.0
) -> MachineResponse:
    """Synchronous response while the speed rises evenly from `start` to `top` [rad/s] in a time [s].

    It begins as at the steady start speed. Behind a critical speed the free vibration that is left beats with
    the unbalance: the value turns with the rotor, as a tracking filter of any width would show it.
    """
    if not (0.0 <= start < top and duration > 0.0):
        raise UsageError(
            f"a run-up from {start:g} to {top:g} rad/s in {duration:g} s is none; expected a rise of "
            "the speed in a time above zero"
        )
    steps = max(FEWEST_STEPS, math.ceil(top * duration / TURN_PER_STEP))
    if steps > MOST_STEPS:
        raise UsageError(
            f"a run-up of {duration:g} s to {top:g} rad/s takes {steps} steps, more than "
            f"{MOST_STEPS}; the response to so slow a rise is the steady one"
        )
    known, forces = _unbalances_of(machine)
    supports = suspension_of(machine, suspension)
    fe = build_rotor_fe(machine)
    basis = reduce_rotor(fe, RUN_UP_REDUCTION, [*(support.node for support in supports), *forces])
    speed = np.linspace(start, top, steps + 1)
    return MachineResponse(
        suspension=suspension,
        speed=speed,
        displacement=unbalance_run_up(basis, speed, duration, forces, supports),
        node_positions=fe.node_positions,
        places=_places(machine),
        unbalance=known,
        run_up=duration,
    )


def _unbalances_of(machine: Machine) -> tuple[tuple[tuple[int, float, float], ...], dict[int, complex]]:
    """Node, amount and phase of every unbalance, and their complex sums by node from +x [kg m]."""
    if not machine.unbalances:
        raise UsageError(
            f"machine {machine.name!r} has no unbalance; add [balance_grade] or [[unbalances]] to its file"
        )
    known = tuple((one.node, float(one.amount), float(one.phase)) for one in machine.unbalances)
    forces: dict[int, complex] = {}
    for node, amount, phase in known:
        forces[node] = forces.get(node, 0.0) + amount * complex(np.exp(1j * (0.5 * math.pi + phase)))
    return known, forces


def resolved_response(machine: Machine, top: float, suspension: str) -> MachineResponse:
    """Response up to a speed [rad/s], with more speeds wherever a peak is too sharp for an even grid.

    Arguments as of `machine_response`. On an even grid alone a peak of lightly damped modes is too low and,
    by its half-power width, too broad.
    """
    step = top / SPEEDS
    grid = step * np.arange(1, SPEEDS + 1)
    first = machine_response(machine, grid, suspension)
    wanted = [grid]
    for _, node in first.places:
        for peak in response_peaks(first.speed, first.major_axis(node)):
            width = peak.speed / peak.factor
            if width < SHARP * step:
                reach = max(width, 2.0 * step)
                wanted.append(np.linspace(peak.speed - reach, peak.speed + reach, PEAK_SPEEDS))
    finest = step / CLOSEST  # speeds nearer to each other would differ by rounding only
    speeds = finest * np.unique(np.round(np.concatenate(wanted) / finest))
    return machine_response(machine, speeds[(speeds > 0.0) & (speeds <= top)], suspension)


def _places(machine: Machine) -> tuple[tuple[str, int], ...]:
    """Sensor planes and touchdown bearings; a plane of several sensors once."""
    planes: dict[int, str] = {}
    for sensor in machine.sensors:
        planes.setdefault(sensor.node, f"sensors {sensor.bearing}")
    bearings = [(f"touchdown bearing {bearing.name}", bearing.node) for bearing in machine.touchdown_bearings]
    return (*((name, node) for node, name in planes.items()), *bearings)
