"""Static flexibility of a rotor and of its reduction; what is left of a shape without its rigid modes."""

import numpy as np

from rotordrop.physics.linear_algebra import product
from rotordrop.rotor.assembly import N_RIGID, free_free_modes, rigid_modes


def elastic_flexibility(fe, nodes, omega=0.0):
    """Displacement at each node per unit force there by bending alone, shape (P,) [m/N].

    The rotor is free and its rigid motion is left out; ``omega`` is the frequency of the force [rad/s].
    """
    modes = free_free_modes(fe)
    return _modal_flexibility(
        modes.shapes, modes.omega**2, np.array([fe.node_index(n) for n in nodes]), omega
    )


def residual_flexibility(fe, basis, nodes, omega=0.0):
    """What a reduced rotor gives way too little per unit force at each node, shape (P,) [m/N].

    Times the contact stiffness it estimates the relative truncation error of a contact force whose time
    scale is 1/omega [rad/s]; zero at standstill for nodes with an attachment mode.
    """
    index = np.array([fe.node_index(n) for n in nodes])
    reduced = _modal_flexibility(basis.shapes, basis.eigenvalues, index, omega)
    return elastic_flexibility(fe, nodes, omega) - reduced


def _modal_flexibility(shapes, eigenvalues, index, omega):
    rows = shapes[index, N_RIGID:]
    return np.asarray(np.sum(rows**2 / (eigenvalues[N_RIGID:] - omega**2), axis=1))


def bending_part(fe, shape):
    """What is left of a shape (2N,) without its rigid modes [m, rad]: how far it is from a straight rotor."""
    rigid = rigid_modes(fe)
    return shape - product(rigid, product(rigid.T, product(fe.mass, shape)))
