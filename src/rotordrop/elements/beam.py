"""How a beam in place of a rotor may differ from it: where along it mass and bending stiffness lie.

A rotor of known mass, length and centre of mass can still bend in many ways. Four numbers move mass and
bending stiffness along the beam; mass and centre of mass stay where they are.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Parameter
from rotordrop.elements.rotor import Rotor, element_mass
from rotordrop.errors import UsageError

Array = NDArray[np.float64]


def _form(path: str, label: str, sigma: float) -> Parameter:
    return Parameter(
        path=path,
        owner="rotor",
        label=label,
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=sigma,
        given_sigma=0.1,
        scale="one",
    )


FORM: tuple[Parameter, ...] = (
    _form("mass_to_ends", "mass at the ends of the beam over that at its middle", 0.8),
    _form("mass_to_de", "mass towards the DE of the beam, its centre of mass as it is", 0.6),
    _form("stiffness_to_de", "bending stiffness of the beam towards the DE", 0.6),
    _form("stiffness_to_ends", "bending stiffness at the ends of the beam over that at its middle", 0.7),
)
"""Rows of the form of a beam; found from a record before any contact law, and held from then on."""


def is_beam(rotor: Rotor) -> bool:
    """Whether a rotor is a beam in place of one that nobody has described."""
    return any(row.stated(rotor) is not None for row in FORM)


def element_factors(rotor: Rotor) -> tuple[Array, Array]:
    """Factors on density and bending stiffness of the elements by the form of the beam, shapes (E,), (E,).

    Raises
    ------
    UsageError
        If so much mass would have to move that some element had none left.
    """
    ends, de, stiff_de, stiff_ends = (
        0.0 if (value := row.stated(rotor)) is None else float(value) for row in FORM
    )
    middles = np.array([0.5 * (a + b) for a, b in pairwise(rotor.node_positions)])
    s = 2.0 * middles / rotor.node_positions[-1] - 1.0
    masses = np.array([element_mass(element) for element in rotor.elements])
    density = 1.0 + ends * _without_moment(s**2, s, masses) + de * _without_moment(s**3, s, masses)
    if density.min() <= 0.0:
        raise UsageError(
            f"rotor.mass_to_ends = {ends:.3g} and mass_to_de = {de:.3g} leave no mass at "
            f"{1e3 * middles[int(density.argmin())]:.4g} mm from the NDE end; expected smaller ones"
        )
    return density, np.exp(stiff_de * s + stiff_ends * (s**2 - 1.0 / 3.0))


def _without_moment(shape: Array, s: Array, masses: Array) -> Array:
    """A shape along the beam less what would change its mass or move its centre of mass."""
    rigid = np.stack([np.ones_like(s), s], axis=1)
    gram = rigid.T @ (masses[:, None] * rigid)
    return np.asarray(shape - rigid @ np.linalg.solve(gram, rigid.T @ (masses * shape)))
