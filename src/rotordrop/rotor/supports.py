"""What holds a rotor at its nodes: springs, dampers and masses between the shaft and the ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotordrop.errors import UsageError

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """A spring with a damper, in both directions and coupled if need be."""

    stiffness: Array
    """Force in (x, y) against displacement in (x, y) [N/m], shape (2, 2)."""
    damping: Array
    """Force in (x, y) against velocity in (x, y) [N s/m], shape (2, 2)."""


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


def link(stiffness: ArrayLike, damping: ArrayLike = 0.0) -> Link:
    """Link from numbers: one for both directions, two for (x, y), or a 2 × 2 matrix [N/m], [N s/m]."""
    return Link(stiffness=_planar(stiffness), damping=_planar(damping))


def spring(node: int, stiffness: ArrayLike, damping: ArrayLike = 0.0) -> Support:
    """Spring and damper from a node (counted from 1) straight to the ground; numbers as in `link`."""
    return Support(node=node, links=(link(stiffness, damping),))


def in_series(*stiffness: float) -> float:
    """Stiffness of springs in series [N/m]; zero when one of them is."""
    if any(k == 0.0 for k in stiffness):
        return 0.0
    return 1.0 / sum(1.0 / k for k in stiffness)


def _planar(value: ArrayLike) -> Array:
    array = np.asarray(value, dtype=np.float64)
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
    body = m
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
            inner = outer
    return PlanarMatrices(mass=M, stiffness=K, damping=C, gyroscopic=G, rotor_size=m)
