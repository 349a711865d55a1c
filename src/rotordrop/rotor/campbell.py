"""Campbell diagram: damped whirling frequencies of a machine against its speed, line by line."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array, ComplexArray
from rotordrop.document import stated
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.one_thread import one_thread
from rotordrop.require import numbers, require
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.critical_speeds import CriticalSpeedMap
from rotordrop.rotor.reduction import Reduction, RotorBasis, reduce_rotor
from rotordrop.rotor.suspension import Support, suspension_of
from rotordrop.rotor.whirl import WhirlModes, direction_name, matrices_of, whirl_modes
from rotordrop.units import FASTEST_SPIN

TURN = 2.0 * math.pi
REDUCTION = Reduction(modes=16, attachment=True)
BEYOND_NOMINAL = 1.3
"""Highest speed of a diagram over the nominal one [1]: past the largest margin that API 617 asks for."""
SPEEDS, MOST_SPEEDS = 61, 10_000
"""Speeds of a diagram by default, and at most, as their shapes fill some 100 MB; chosen, not measured."""
_SPARE_MODES = 4
"""Modes computed beyond those asked for (chosen): a line that sinks with the speed comes from above."""
_STANDSTILL = 1e-3
"""Share of the first speed that stands for zero [1] (chosen): at rest forward and backward are one line."""


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """A critical speed: where a line of the diagram meets the rotor's own speed."""

    speed: float
    """Speed of the rotor [rad/s]."""
    line: int
    """Index of the line."""
    direction: str
    """``"forward"``, ``"backward"`` or ``"mixed"``."""
    damping_ratio: float
    """Damping ratio there [1]."""

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON, with its amplification."""
        return stated(
            self,
            "speed_Hz line direction damping_ratio amplification_factor",
            speed_Hz=self.speed / TURN,
            amplification_factor=amplification_factor(self.damping_ratio),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class CampbellDiagram:
    """Damped modes of a rotor against its speed; a line keeps its shape from one speed to the next."""

    suspension: str
    """What holds the rotor: ``"free-free"``, ``"AMBs"``, ``"touchdown bearings"`` or a description."""
    speed: Array
    """Speeds [rad/s], increasing, shape (S,)."""
    frequency: Array
    """Damped frequencies [Hz]; NaN where a line has left the lowest modes or is overdamped, shape (S, K)."""
    damping_ratio: Array
    """Damping ratios [1], shape (S, K)."""
    whirl: Array
    """+1 circular forward, −1 circular backward, 0 on a line, shape (S, K)."""
    shapes: ComplexArray
    """Displacement (x, y) at the nodes, largest displacement 1, shape (S, K, N, 2)."""
    node_positions: Array
    """Positions along z [m], shape (N,)."""
    crossings: tuple[Crossing, ...]
    """Critical speeds between the first and the last speed."""

    def __repr__(self) -> str:
        """What holds the rotor, lines, speeds and critical speeds."""
        met = ", ".join(f"{one.speed / TURN:.4g}" for one in self.crossings) or "none"
        lines, low, high = self.frequency.shape[1], self.speed[0] / TURN, self.speed[-1] / TURN
        return (
            f"<CampbellDiagram, {self.suspension}: {lines} lines from {low:.4g} to {high:.4g} Hz, critical "
            f"speeds {met} Hz>"
        )

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON, SI units, with the shapes at the lowest speed."""
        shapes = self.shapes[0]
        return stated(
            self,
            "speed_Hz frequency_Hz damping_ratio whirl node_positions_m shapes_at_lowest_speed "
            "critical_speeds=crossings",
            speed_Hz=self.speed / TURN,
            shapes_at_lowest_speed={"real": shapes.real, "imaginary": shapes.imag},
        )

    def direction(self, line: int) -> str:
        """Direction of a line, by the mean over its speeds."""
        return direction_name(float(np.nanmean(self.whirl[:, line])))


def speed_grid(machine: Machine, highest: float | None = None) -> Array:
    """Speeds of a Campbell diagram from standstill to the highest [rad/s], shape (S,)."""
    end = BEYOND_NOMINAL * float(machine.speed.nominal) if highest is None else highest
    return np.linspace(0.0, end, SPEEDS)


@one_thread()
def campbell_diagram(
    machine: Machine, speeds: ArrayLike, suspension: str = "touchdown bearings", *, count: int = 10
) -> CampbellDiagram:
    """Campbell diagram of a machine with K lines at increasing speeds [rad/s], (S,), in a suspension."""
    supports = suspension_of(require(machine, "machine", Machine), suspension)
    fe = build_rotor_fe(machine)
    nodes = [support.node for support in supports]
    basis = reduce_rotor(fe, REDUCTION, nodes)
    return campbell_lines(basis, fe.node_positions, speeds, supports, suspension=suspension, count=count)


def campbell_lines(
    rotor: RotorBasis,
    node_positions: Array,
    speeds: ArrayLike,
    supports: Sequence[Support],
    *,
    suspension: str = "given supports",
    count: int = 10,
) -> CampbellDiagram:
    """Campbell diagram of a reduced rotor on any supports; arguments as in `campbell_diagram`."""
    grid = np.atleast_1d(numbers(speeds, "speeds", finite=True))
    require(count, "count", int, least=1, most=1000)
    if grid.ndim != 1 or not len(grid) or np.any(np.diff(grid) <= 0.0) or grid[0] < 0.0:
        raise UsageError("the speeds of a Campbell diagram must increase and not be negative")
    require(float(grid[-1]), "highest speed [rad/s]", float, above=0.0, most=FASTEST_SPIN)
    require(len(grid), "number of speeds", int, most=MOST_SPEEDS)
    mass = matrices_of(rotor, supports).mass
    slowest = _STANDSTILL * grid[grid > 0.0][0]
    followed: list[WhirlModes] = []
    for speed in grid:
        modes = whirl_modes(rotor, max(float(speed), slowest), supports, count + _SPARE_MODES)
        followed.append(_in_order(followed[-1], modes, mass) if followed else modes)
    frequency = _stack([modes.frequency for modes in followed], count)
    damping_ratio = _stack([modes.damping_ratio for modes in followed], count)
    whirl = _stack([modes.whirl for modes in followed], count)
    shapes = np.full((len(grid), count, *followed[0].shapes.shape[1:]), np.nan, dtype=np.complex128)
    for s, modes in enumerate(followed):
        shown = min(count, len(modes.shapes))
        shapes[s, :shown] = modes.shapes[:shown]
    return CampbellDiagram(
        suspension=suspension,
        speed=grid,
        frequency=frequency,
        damping_ratio=damping_ratio,
        whirl=whirl,
        shapes=shapes,
        node_positions=node_positions,
        crossings=_crossings(grid, frequency, damping_ratio, whirl),
    )


def _in_order(before: WhirlModes, now: WhirlModes, mass: Array) -> WhirlModes:
    """Modes of this speed in the order of the last one: nearest eigenvalue among the most alike shapes."""
    from scipy.optimize import linear_sum_assignment

    likeness = np.abs(before.vectors.conj().T @ mass @ now.vectors) ** 2
    change = np.abs(before.eigenvalue[:, None] - now.eigenvalue)
    cost = (1.0 - np.minimum(likeness, 1.0)) + change / np.maximum(np.abs(before.eigenvalue[:, None]), 1.0)
    rows, columns = linear_sum_assignment(cost)
    order = np.full(len(before.eigenvalue), -1)
    order[rows] = columns
    kept = np.concatenate([order[order >= 0], np.setdiff1d(np.arange(len(now.eigenvalue)), columns)])
    return WhirlModes(
        speed=now.speed,
        eigenvalue=now.eigenvalue[kept],
        whirl=now.whirl[kept],
        shapes=now.shapes[kept],
        vectors=now.vectors[:, kept],
    )


def _stack(rows: list[Array], count: int) -> Array:
    table = np.full((len(rows), count), np.nan)
    for s, row in enumerate(rows):
        shown = min(count, len(row))
        table[s, :shown] = row[:shown]
    return table


def _crossings(speed: Array, frequency: Array, damping_ratio: Array, whirl: Array) -> tuple[Crossing, ...]:
    found = []
    above = frequency * 2.0 * np.pi - speed[:, None]
    for line in range(frequency.shape[1]):
        gap = above[:, line]
        for s in np.flatnonzero(gap[:-1] * gap[1:] < 0.0):
            part = gap[s] / (gap[s] - gap[s + 1])
            at = [float((1.0 - part) * a[s, line] + part * a[s + 1, line]) for a in (damping_ratio, whirl)]
            found.append(
                Crossing(
                    speed=float((1.0 - part) * speed[s] + part * speed[s + 1]),
                    line=line,
                    direction=direction_name(at[1]),
                    damping_ratio=at[0],
                )
            )
    return tuple(sorted(found, key=lambda crossing: crossing.speed))


LEAST_FACTOR = 2.5
"""Amplification factor below which a mode counts as critically damped and needs no margin [1]."""
MOST_MARGIN = 0.16
"""Most that API 617 asks for below the operating range, reached at an amplification factor of 18.5 [1]."""
MORE_ABOVE = 0.10
"""What it asks for above the operating range beyond that [1]."""


def amplification_factor(damping_ratio: float) -> float:
    """Amplification factor of a mode [1], 1/(2ζ), for light damping. Source: API RP 684."""
    return math.inf if damping_ratio <= 0.0 else 0.5 / damping_ratio


def required_margin(factor: float, *, above: bool) -> float:
    """Separation margin required of a critical speed, as a share of the operating speed [1].

    ``above``: the critical speed lies above the operating range, else below it.
    Source: API 617 (8th edition, part 1), ``17 (1 − 1/(AF − 1.5))`` % and at most 16 % below, 10 % more
    above; none up to an amplification factor of 2.5.
    """
    if factor < LEAST_FACTOR:
        return 0.0
    share = min(0.17 * (1.0 - 1.0 / (factor - 1.5)), MOST_MARGIN)
    return share + MORE_ABOVE if above else share


@dataclass(frozen=True, kw_only=True)
class Separation:
    """A critical speed set against a range of operating speeds."""

    factor: float
    """Amplification factor [1]."""
    margin: float
    """Distance from the nearer end of the range, as a share of that speed [1]; zero within the range."""
    required: float
    """Margin that API 617 asks for [1]."""

    @classmethod
    def of(cls, speed: float, factor: float, lowest: float, highest: float) -> Separation:
        """Set a critical speed with an amplification factor against operating speeds [rad/s]."""
        above = speed > highest
        edge = highest if above else lowest
        margin = 0.0 if lowest <= speed <= highest else abs(speed - edge) / edge
        return cls(factor=factor, margin=margin, required=required_margin(factor, above=above))

    @property
    def met(self) -> bool:
        """Whether the margin is as large as required."""
        return self.margin >= self.required

    @property
    def asked(self) -> str:
        """The margin required, in words."""
        return "none" if self.factor < LEAST_FACTOR else f"{100.0 * self.required:.1f} %"

    @property
    def verdict(self) -> str:
        """What follows, in words."""
        if self.factor < LEAST_FACTOR:
            return "critically damped"
        return "met" if self.met else "not met"


def separations(diagram: CampbellDiagram, lowest: float, highest: float) -> dict[Crossing, Separation]:
    """Set every forward or mixed critical speed of a diagram against operating speeds [rad/s].

    Critical speeds beyond the last speed of the diagram are not seen.
    Differs from the convention: the factor is that of the damped mode, not measured at half power of a
    response, which light damping makes the same.
    """
    return {
        one: Separation.of(one.speed, amplification_factor(one.damping_ratio), lowest, highest)
        for one in diagram.crossings
        if one.direction != "backward"
    }


def critical_speeds_json(
    maps: Mapping[str, CriticalSpeedMap], diagrams: Mapping[str, CampbellDiagram]
) -> dict[str, Any]:
    """Maps by whirl and diagrams by what holds the rotor, ready for JSON, SI units."""
    return {
        "maps": {name: found.as_json() for name, found in maps.items()},
        "campbell": {name: found.as_json() for name, found in diagrams.items()},
    }
