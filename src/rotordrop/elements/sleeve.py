"""A sleeve: a plain ring in which the rotor lands and slides, without rolling elements and without a race."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.race import Race
from rotordrop.elements.race_bearing import BearingFigure, BearingNumbers, Excess, RaceBearing
from rotordrop.elements.values import PoissonRatio, PositiveLength, Pressure, default
from rotordrop.known import Known
from rotordrop.physics import ball_set


class Sleeve(RaceBearing):
    """A sleeve that stands still: the rotor meets its support through one contact."""

    length: PositiveLength = default(0.04, "usual of rotors of some tens of kilograms, chosen", (0.01, 0.1))
    """Length over which the rotor lies in it [m]; the pressure between them follows from it."""
    youngs_modulus: Pressure = default(110e9, "bronze", (3e9, 210e9))
    """Young's modulus [Pa]."""
    poisson_ratio: PoissonRatio = default(0.34, "bronze", (0.27, 0.4))
    """Poisson's ratio [1]."""

    no_race: ClassVar[str] = (
        "a sleeve has no race; leave out the table 'race': the length of the sleeve stands under 'bearing', "
        "its mass belongs to the support"
    )
    ring_travel: ClassVar[None] = None
    beyond_estimates: ClassVar[tuple[str, str]] = (
        "is a sleeve",
        "; simulations and studies know it",
    )
    no_face: ClassVar[str] = "a sleeve has no race that could give way axially"

    def numbers(self) -> SleeveNumbers:
        """Give the numbers that follow from it."""
        return SleeveNumbers(self)

    def check_bore(self, radius: float) -> None:
        """Take any bore: nothing lies around it."""

    def usual_race_width(self) -> tuple[float, str]:
        """Its length."""
        return self.length.value, "the length of the sleeve"

    def race_of_size(self, race: Race, width: Known, bore: float) -> Race:
        """Nothing spins with it."""
        none = Known(value=0.0, status="default", source="a sleeve does not spin", unit="kg")
        return race.completed_with({"width": width, "mass": none, "inertia": replace(none, unit="kg m^2")})


@dataclass(frozen=True)
class SleeveNumbers(BearingNumbers):
    """The numbers of a sleeve: rigid, held, without rolling elements."""

    sleeve: Sleeve

    held: ClassVar[bool] = True
    play: ClassVar[float] = 0.0
    drag_diameter: ClassVar[float] = 0.0

    @property
    def ring_material(self) -> tuple[float, float]:
        """Young's modulus [Pa] and Poisson's ratio [1] of the sleeve."""
        return self.sleeve.youngs_modulus.value, self.sleeve.poisson_ratio.value

    def entries(self) -> Array:
        """No ball set."""
        return np.zeros(ball_set.N_ENTRIES)

    def places(self, least: int = 0, facing: float = 0.0) -> Array:
        """No places but padding, which bears nothing."""
        return np.zeros((3, least))

    def deflection(self, load: float) -> tuple[float, float]:
        """Nothing gives way between rotor and support but the contact."""
        return 0.0, math.inf

    def seat(self, load: float) -> tuple[float, float]:
        """It stays in the middle."""
        return 0.0, 0.0

    def simple_stiffness(self, load: float) -> float:
        """Rigid."""
        return math.inf

    def in_series(self, contact: float, load: float) -> tuple[float, float, float]:
        """The contact is all that lies on the support."""
        return math.inf, contact, contact

    def damping(self, time: float, load: float) -> float:
        """None but that of contact and support."""
        return 0.0

    def figures(self, load: float) -> tuple[BearingFigure, ...]:
        """Nothing holds it but its support."""
        return ()

    def excesses(self, omega: float, load: float) -> Iterator[Excess]:
        """Nothing turns."""
        yield from ()

    def room_to_grow(self) -> tuple[float, str]:
        """Nothing is compared: heat of a sleeve is not reckoned."""
        return math.inf, "nothing"
