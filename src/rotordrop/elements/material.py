"""Materials of the shaft."""

from __future__ import annotations

from rotordrop.elements.description import Description
from rotordrop.elements.values import Density, PoissonRatio, Pressure


class Material(Description):
    """Elastic constants and density of a material.

    Attributes
    ----------
    youngs_modulus : Known
        Young's modulus [Pa].
    poisson_ratio : Known
        Poisson ratio [1].
    density : Known
        Density [kg/m³].
    """

    youngs_modulus: Pressure
    poisson_ratio: PoissonRatio
    density: Density


STEEL = {"youngs_modulus": "210 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}
"""What a shaft is made of when the file names no material."""
