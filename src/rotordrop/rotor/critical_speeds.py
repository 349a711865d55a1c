"""Critical speed map: natural frequencies and critical speeds against the stiffness of the supports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.one_thread import one_thread
from rotordrop.require import numbers, require
from rotordrop.rotor.assembly import RotorFE, build_rotor_fe
from rotordrop.rotor.reduction import RotorBasis
from rotordrop.rotor.suspension import (
    FORMULAS,
    EquivalentStiffness,
    Support,
    equivalent_stiffness,
    link,
    planar_matrices,
    spring,
)
from rotordrop.sketch import sketch

WHIRLS = {"standstill": 0, "forward": 1, "backward": -1}
DEFAULT_STIFFNESS = (1e5, 1e10)
_SUPPORT_RIGID = 0.999
MOST_ITERATIONS, CONVERGED = 200, 1e-9
"""How often a line is followed to the stiffness of its own frequency, and how far [1]."""
Held = Callable[[Sequence[EquivalentStiffness]], list[Support]]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CriticalSpeedMap:
    """Undamped map of a machine on its touchdown bearings (Neisi 2020, Fig. 19)."""

    machine_name: str
    """The machine."""
    whirl: str
    """``"standstill"``: natural frequencies without spin, as in the paper; ``"forward"`` or ``"backward"``:
    critical speeds, at which the whirl keeps step with the spin."""
    stiffness: Array
    """Equivalent stiffness of bearing and support, the same at all bearings [N/m], shape (S,)."""
    massless: Array
    """Frequencies with supports that have no mass, as in the paper [Hz], shape (S, K)."""
    with_support_mass: Array
    """Frequencies with the masses of the supports, and the bearings' tangent stiffness fixed [Hz]; NaN where
    the stiffness exceeds what a bearing on a rigid support would have, shape (S, K)."""
    lines: tuple[EquivalentStiffness, ...]
    """The machine's own stiffness per bearing, of mounts that relax at rest: the vertical lines."""
    at_lines: Mapping[str, Array]
    """Frequencies [Hz], shape (K,), with every bearing at its own equivalent stiffness: ``"tangent"``,
    ``"simple"``, ``"with contact"`` (massless) and ``"with support mass"``. A mount that relaxes has in every
    line the storage stiffness of its frequency."""

    def __repr__(self) -> str:
        """Machine, whirl and the frequencies on its own bearings."""
        own = ", ".join(f"{one:.4g}" for one in self.at_lines["tangent"])
        return f"<CriticalSpeedMap of {self.machine_name}, {self.whirl}: {own} Hz at its own stiffness>"

    def _repr_html_(self) -> str:
        lines = {str(k): (np.log10(self.stiffness), of) for k, of in enumerate(self.massless.T, 1)}
        return sketch(repr(self), "log10 of the stiffness [N/m]", "frequency [Hz]", lines)

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON, SI units; null where there is no line."""
        bearings = {
            part.bearing: stated(
                part,
                "load_N tangent_N_m simple_N_m support_N_m contact_N_m equivalent_tangent_N_m "
                "equivalent_simple_N_m",
                equivalent_tangent_N_m=part.equivalent("tangent"),
                equivalent_simple_N_m=part.equivalent("simple"),
            )
            | (self._relaxing(part) if part.branches else {})
            for part in self.lines
        }
        return stated(
            self,
            "whirl stiffness_N_m massless_Hz with_support_mass_Hz bearings at_the_machine_Hz=at_lines",
            bearings=bearings,
        )

    def _relaxing(self, part: EquivalentStiffness) -> dict[str, Any]:
        """Stiffness and loss factor of a support at the lines with the mass of the supports."""
        lines = self.at_lines["with support mass"]
        dynamic = [part.dynamic(float(hertz)) for hertz in lines if np.isfinite(hertz)]
        return {
            "support_at_lines_N_m": [stiffness.real for stiffness in dynamic],
            "loss_factor_at_lines": [stiffness.imag / stiffness.real for stiffness in dynamic],
        }


@one_thread()
def critical_speed_map(
    machine: Machine,
    stiffness: ArrayLike | None = None,
    *,
    whirl: str = "standstill",
    count: int = 6,
) -> CriticalSpeedMap:
    """Critical speed map of a machine on its touchdown bearings, K lines over equivalent stiffnesses [N/m],
    (S,); by default 121 from 1e5 to 1e10 N/m.
    """
    require(machine, "machine", Machine)
    require(count, "count", int, least=1, most=1000)
    given = np.geomspace(*DEFAULT_STIFFNESS, 121) if stiffness is None else stiffness
    grid = numbers(given, "stiffness", finite=True)
    if grid.ndim != 1 or not len(grid):
        raise UsageError("stiffness is no list of numbers [N/m]; give one at least")
    if not np.all(grid > 0.0):
        raise UsageError(f"stiffness must be positive, got {grid.min():g} N/m")
    require(len(grid), "number of stiffnesses", int, most=10_000)
    require(float(grid.max()), "largest stiffness [N/m]", float, most=1e20)
    fe = build_rotor_fe(machine)
    parts = equivalent_stiffness(machine)
    masses = [float(bearing.support.mass) for bearing in machine.touchdown_bearings]
    massless = [_on(fe, [spring(p.node, k) for p in parts], whirl, count) for k in grid]
    massive = [_on(fe, _with_mass(parts, masses, k), whirl, count) for k in grid]
    return CriticalSpeedMap(
        machine_name=machine.name,
        whirl=whirl,
        stiffness=grid,
        massless=np.array(massless),
        with_support_mass=np.array(massive),
        lines=parts,
        at_lines=_at_lines(fe, parts, masses, whirl, count),
    )


def critical_speeds(
    rotor: RotorFE | RotorBasis,
    supports: Sequence[Support],
    *,
    whirl: str = "forward",
    count: int | None = None,
) -> Array:
    """Undamped critical speeds of a rotor on supports, lowest first, shape (K,) [Hz]; vertical stiffness
    counts in both directions.

    ``"forward"`` or ``"backward"``: the whirl keeps step with the spin; ``"standstill"``: natural frequencies
    without spin. Point masses on a shaft without mass are allowed.
    """
    require(whirl, "whirl", str, among=WHIRLS)
    rows = [rotor.node_row(support.node) for support in supports]
    zero = np.zeros_like(rotor.mass)
    system = planar_matrices(rotor.mass, rotor.stiffness, zero, rotor.polar, rows, supports)
    n = system.plane_size
    inertia = system.mass[n:, n:] - WHIRLS[whirl] * system.gyroscopic[:n, n:]
    return _frequencies(system.stiffness[n:, n:], inertia)[:count]


def _frequencies(stiffness: Array, inertia: Array) -> Array:
    """Finite real frequencies of ``K q = ω² J q`` [Hz]; J may be singular or indefinite."""
    from scipy.linalg import LinAlgError, eigh

    try:
        inverse = eigh(inertia, stiffness, eigvals_only=True)[::-1]
    except LinAlgError:
        raise UsageError(
            "the supports do not hold the rotor: it can drift or turn without force. Critical speeds need "
            "springs at two nodes at least."
        ) from None
    inverse = inverse[inverse > 1e-12 * inverse[0]]
    return np.asarray(1.0 / (2.0 * np.pi * np.sqrt(inverse)))


def _on(fe: RotorFE, supports: list[Support] | None, whirl: str, count: int) -> Array:
    found = np.full(count, np.nan)
    if supports is not None:
        frequencies = critical_speeds(fe, supports, whirl=whirl, count=count)
        found[: len(frequencies)] = frequencies
    return found


def _with_mass(
    parts: Sequence[EquivalentStiffness], masses: list[float], equivalent: float
) -> list[Support] | None:
    """Bearings on supports with mass, all of one equivalent stiffness [N/m]; None where none is so rigid."""
    if equivalent >= _SUPPORT_RIGID * min(p.tangent for p in parts):
        return None
    return [
        Support(
            node=p.node,
            links=(link(p.tangent), link(equivalent * p.tangent / (p.tangent - equivalent))),
            masses=(mass,),
        )
        for p, mass in zip(parts, masses, strict=True)
    ]


def _at_lines(
    fe: RotorFE, parts: Sequence[EquivalentStiffness], masses: list[float], whirl: str, count: int
) -> dict[str, Array]:
    def sprung(stiffness: Callable[[EquivalentStiffness], float]) -> Held:
        return lambda held: [spring(p.node, stiffness(p)) for p in held]

    def massive(held: Sequence[EquivalentStiffness]) -> list[Support]:
        return [
            Support(node=p.node, links=(link(p.tangent), link(p.support)), masses=(mass,))
            for p, mass in zip(held, masses, strict=True)
        ]

    ways: dict[str, Held] = {
        formula: sprung(partial(EquivalentStiffness.equivalent, formula=formula)) for formula in FORMULAS
    }
    ways["with contact"] = sprung(partial(EquivalentStiffness.equivalent, contact=True))
    ways["with support mass"] = massive
    return {name: _followed(fe, parts, held, whirl, count) for name, held in ways.items()}


def _followed(fe: RotorFE, parts: Sequence[EquivalentStiffness], held: Held, whirl: str, count: int) -> Array:
    """Frequencies [Hz], shape (K,), of a rotor whose supports depend on the frequency of each line.

    From the stiffness at rest, so that a line rises to its lowest fixed point: supports that relax are the
    stiffer the faster, and so are all lines.
    """
    found = _on(fe, held(parts), whirl, count)
    if not any(part.branches for part in parts):
        return found
    for k in np.flatnonzero(np.isfinite(found)):
        for _ in range(MOST_ITERATIONS):
            before = float(found[k])
            found[k] = _on(fe, held([part.at(before) for part in parts]), whirl, count)[k]
            if abs(found[k] - before) <= CONVERGED * before:
                break
    return found
