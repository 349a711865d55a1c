"""Materials of the shaft."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from rotordrop.elements.description import Description, Usual
from rotordrop.elements.values import Density, PoissonRatio, Pressure

ELASTIC = Usual(least=20e9, most=700e9, kind="pressure", look="E of steel is 210 GPa; check the unit")
DENSITY = Usual(least=800.0, most=2.3e4, kind="density", look="steel has 7850 kg/m^3; check the unit")
POISSON = Usual(least=0.05, most=0.499, kind="dimensionless", look="metals have 0.25 to 0.35")


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

    usual: ClassVar[Mapping[str, Usual]] = {
        "youngs_modulus": ELASTIC,
        "density": DENSITY,
        "poisson_ratio": POISSON,
    }


STEEL = {"youngs_modulus": "210 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}
"""What a shaft is made of when the file names no material."""
