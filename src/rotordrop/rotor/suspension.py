"""What holds a machine's rotor, made linear: its AMBs, or the touchdown bearings it has settled in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.support import support_deflection
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.contact import contact_tangent
from rotordrop.require import numbers, require
from rotordrop.rotor.statics import bearing_load_shares

SUSPENSIONS = ("free-free", "AMBs", "touchdown bearings")
FORMULAS = ("tangent", "simple")


@dataclass(frozen=True, kw_only=True)
class Relaxing:
    """A spring in series with a damper, in both directions alike."""

    stiffness: float
    """Stiffness of its spring [N/m]."""
    time: float
    """Time in which its force relaxes [s]."""

    def stiffness_at(self, s: complex) -> complex:
        """Complex stiffness [N/m] of motion that goes with ``e^(st)``."""
        return self.stiffness * s * self.time / (1.0 + s * self.time)


@dataclass(frozen=True, kw_only=True)
class EquivalentStiffness:
    """How stiff one touchdown bearing holds the settled rotor, vertically, part by part."""

    bearing: str
    """Name of the touchdown bearing."""
    node: int
    """Its node, counted from 1."""
    load: float
    """Static load [N]."""
    tangent: float
    simple: float
    """Radial stiffness of the bearing at that load [N/m]: slope of its forces with any preload, and the
    simple engineering formula, which knows no preload."""
    support: float
    """Stiffness of the support [N/m]: its spring, a ribbon that sticks, a stop that the load presses shut."""
    contact: float
    """Slope of the contact law between rotor and race at that load [N/m]; infinite without a race, where the
    bearing is the contact."""
    beside: tuple[str, ...] = ()
    """What of the mount is in that stiffness."""
    branches: tuple[Relaxing, ...] = ()
    """Branches of the mount that relax: nothing at rest, stiffer the faster the rotor moves."""

    def at(self, frequency: float) -> EquivalentStiffness:
        """The same where the support moves at a frequency [Hz]: its storage stiffness."""
        return replace(self, support=self.dynamic(frequency).real, branches=())

    def dynamic(self, frequency: float) -> complex:
        """Complex stiffness of the support at a frequency [Hz], [N/m]."""
        s = 2j * math.pi * frequency
        return complex(self.support + sum(branch.stiffness_at(s) for branch in self.branches))

    def equivalent(self, formula: str = "tangent", *, contact: bool = False) -> float:
        """Bearing and support in series [N/m], with the contact if asked (Neisi 2020, section 5.4)."""
        if formula not in FORMULAS:
            raise UsageError(f"unknown bearing stiffness {formula!r}; choose one of {', '.join(FORMULAS)}")
        parts = [self.tangent if formula == "tangent" else self.simple, self.support]
        return in_series(*parts, *([self.contact] if contact else []))


def equivalent_stiffness(machine: Machine) -> tuple[EquivalentStiffness, ...]:
    """Stiffness of each touchdown bearing under its share of the weight."""
    pairs = list(zip(machine.touchdown_bearings, bearing_load_shares(machine), strict=True))
    for bearing, load in pairs:
        if load <= 0.0:
            raise UsageError(
                f"touchdown bearing {bearing.name!r} carries {load:.3g} N of the rotor's weight and is not "
                "loaded; its stiffness is not defined"
            )
    return tuple(stiffness_of(bearing, float(load)) for bearing, load in pairs)


def stiffness_of(bearing: TouchdownBearing, load: float) -> EquivalentStiffness:
    """Stiffness of one touchdown bearing under a load [N], part by part."""
    numbers, mount = numbers_of(bearing), bearing.mount
    contact = contact_tangent(bearing.contact.law, load)
    contact, tangent, simple = numbers.in_series(contact, load)
    held, stuck = _held_by(bearing, load)[1], mount.stiffnesses.get("ribbon", 0.0)
    return EquivalentStiffness(
        bearing=bearing.name,
        node=bearing.node,
        load=load,
        tangent=tangent,
        simple=simple,
        support=float(bearing.support.stiffness) + held,
        beside=("a ribbon that sticks",) * (stuck > 0.0) + ("a stop pressed shut",) * (held > stuck),
        contact=contact,
        branches=tuple(Relaxing(stiffness=float(b.stiffness), time=float(b.time)) for b in mount.maxwell),
    )


def _held_by(bearing: TouchdownBearing, load: float) -> tuple[float, float]:
    """Stiffness [N/m], horizontal and vertical, that a mount adds to its spring in small motion about a load
    [N].

    A ribbon sticks, and a stop holds where the load presses it shut; branches are apart.
    """
    ribbon, stop = bearing.mount.ribbon, bearing.mount.stop
    stuck = 0.0 if ribbon is None else float(ribbon.friction_stiffness)
    if stop is None:
        return stuck, stuck
    row = np.zeros(L.N_BEARING_COLUMNS)
    bearing.mount.fill(row)
    bearing.support.fill(row)
    deflection = support_deflection(row, load)
    depth = deflection - float(stop.gap)
    if depth <= 0.0:
        return stuck, stuck
    pressed = float(stop.stiffness)
    return stuck + pressed * depth / deflection, stuck + pressed


def suspension_of(machine: Machine, name: str) -> tuple[Support, ...]:
    """Supports of a machine's rotor by the name of what holds it, one of `SUSPENSIONS`."""
    require(name, "suspension", str, among=SUSPENSIONS)
    if name == "free-free":
        return ()
    if name == "AMBs":
        return amb_supports(machine)
    return touchdown_supports(machine)


def amb_supports(machine: Machine) -> tuple[Support, ...]:
    """Springs and dampers of the AMBs.

    Not validated: a controller's stiffness depends on frequency; the machine file knows one number.
    """
    if not machine.ambs:
        raise UsageError(f"machine {machine.name!r} has no AMBs; add their nodes to the machine file")
    return tuple(spring(amb.node, float(amb.stiffness), float(amb.damping)) for amb in machine.ambs)


def touchdown_supports(machine: Machine) -> tuple[Support, ...]:
    """Contact, race, bearing and support under the settled rotor, with their masses and damping.

    The bearing damping is the machine's damping time times the tangent stiffness.
    Differs from the paper: its critical speed map has neither the contact nor the masses. The contact holds
    the rotor in both directions here; the slow swing along the race is the pendulum's, not a mode.
    """
    supports = []
    for bearing, parts in zip(machine.touchdown_bearings, equivalent_stiffness(machine), strict=True):
        ground = bearing.support
        beside, below = _held_by(bearing, parts.load)
        links = (
            *((link(parts.contact),) if parts.contact < math.inf else ()),
            link(parts.tangent, numbers_of(bearing).damping(float(bearing.damping_time), parts.load)),
            link(
                (float(ground.stiffness_horizontal) + beside, float(ground.stiffness) + below),
                (float(ground.damping_horizontal), float(ground.damping)),
                parts.branches,
            ),
        )
        supports.append(Support(node=bearing.node, links=links, masses=tuple(bearing.masses.values())))
    return tuple(supports)


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """A spring with a damper, in both directions and coupled if need be."""

    stiffness: Array
    """Force in (x, y) against displacement in (x, y) [N/m], shape (2, 2)."""
    damping: Array
    """Force in (x, y) against velocity in (x, y) [N s/m], shape (2, 2)."""
    branches: tuple[Relaxing, ...] = ()
    """What relaxes beside spring and damper."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """A chain of links from a node of the rotor to the ground, with a mass between each link and the next."""

    node: int
    """Node of the rotor, counted from 1."""
    links: tuple[Link, ...]
    """From the rotor outwards; the last one ends at the ground."""
    masses: tuple[float, ...] = ()
    """Masses between the links [kg], one fewer than links; they move in x and y."""

    def __post_init__(self) -> None:
        if len(self.masses) != len(self.links) - 1:
            raise UsageError(
                f"the support at node {self.node} has {len(self.links)} links and {len(self.masses)} masses; "
                "there is one mass between each link and the next"
            )
        if any(mass <= 0.0 for mass in self.masses):
            raise UsageError(
                f"the support at node {self.node} has the masses {self.masses} kg; they must be positive. "
                "Join links without a mass between them with in_series()."
            )


def link(stiffness: ArrayLike, damping: ArrayLike = 0.0, branches: tuple[Relaxing, ...] = ()) -> Link:
    """Link from numbers: one for both directions, two for (x, y), or a 2 × 2 matrix [N/m], [N s/m]."""
    return Link(stiffness=_planar(stiffness), damping=_planar(damping), branches=branches)


def spring(node: int, stiffness: ArrayLike, damping: ArrayLike = 0.0) -> Support:
    """Spring and damper from a node (counted from 1) straight to the ground; numbers as in `link`."""
    require(node, "node", int, least=1)
    return Support(node=node, links=(link(stiffness, damping),))


def in_series(*stiffness: float) -> float:
    """Stiffness of springs in series [N/m]; zero when one of them is."""
    if any(k == 0.0 for k in stiffness):
        return 0.0
    return 1.0 / sum(1.0 / k for k in stiffness)


def _planar(value: ArrayLike) -> Array:
    array = numbers(value, "stiffness or damping of a link", finite=True)
    if array.shape == (2, 2):
        return array
    if array.shape not in ((), (2,)):
        raise UsageError(f"a link is given by one number, two or a 2 × 2 matrix, not by shape {array.shape}")
    return np.diag(np.broadcast_to(array, (2,)))


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarMatrices:
    """Second-order matrices of rotor and supports in both planes: ``M q̈ + (C + ω G) q̇ + K q = f``.

    The coordinates are those of the rotor in x, the masses of the supports in x, then the same in y.
    """

    mass: Array
    stiffness: Array
    damping: Array
    gyroscopic: Array
    """M, K, C and G; G is skew, shape (2n, 2n)."""
    rotor_size: int
    """Coordinates of the rotor per plane."""
    relaxing: tuple[tuple[Array, Relaxing], ...] = ()
    """What relaxes, with the rows of its stretch in x and y, shape (2, 2n)."""

    def stiffness_at(self, s: complex) -> NDArray[np.complex128]:
        """Stiffness of motion that goes with ``e^(st)``, with what relaxes, shape (2n, 2n)."""
        total = self.stiffness.astype(np.complex128)
        for rows, branch in self.relaxing:
            total += branch.stiffness_at(s) * (rows.T @ rows)
        return total

    @property
    def plane_size(self) -> int:
        """Coordinates per plane."""
        return len(self.mass) // 2


def planar_matrices(
    mass: Array,
    stiffness: Array,
    damping: Array,
    polar: Array,
    node_rows: Sequence[Array],
    supports: Sequence[Support],
) -> PlanarMatrices:
    """Put a rotor (matrices of one plane, shape (m, m)) on supports whose node rows (m,) are given."""
    m = len(mass)
    n = m + sum(len(support.masses) for support in supports)
    M, K, C, G = (np.zeros((2 * n, 2 * n)) for _ in range(4))
    for plane in (slice(0, m), slice(n, n + m)):
        M[plane, plane] = mass
        K[plane, plane] = stiffness
        C[plane, plane] = damping
    G[:m, n : n + m] = polar
    G[n : n + m, :m] = -polar
    body, relaxing = m, []
    for row, support in zip(node_rows, supports, strict=True):
        inner = np.zeros((2, 2 * n))
        inner[0, :m] = inner[1, n : n + m] = row
        for step, part in enumerate(support.links):
            outer = np.zeros((2, 2 * n))
            if step < len(support.masses):
                outer[0, body] = outer[1, n + body] = 1.0
                M[body, body] = M[n + body, n + body] = support.masses[step]
                body += 1
            stretch = inner - outer
            K += stretch.T @ part.stiffness @ stretch
            C += stretch.T @ part.damping @ stretch
            relaxing += [(stretch, branch) for branch in part.branches]
            inner = outer
    return PlanarMatrices(
        mass=M, stiffness=K, damping=C, gyroscopic=G, rotor_size=m, relaxing=tuple(relaxing)
    )
