"""A sleeve: a plain ring in which the rotor lands and slides, without rolling elements and without a race."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from rotordrop.elements.race import Race
from rotordrop.elements.race_bearing import RaceBearing
from rotordrop.elements.values import PoissonRatio, PositiveLength, Pressure, default
from rotordrop.known import Known

if TYPE_CHECKING:
    from rotordrop.elements.bearing_numbers import BearingNumbers


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

    def numbers(self) -> BearingNumbers:
        """Give the numbers that follow from it."""
        from rotordrop.elements.bearing_numbers import BearingNumbers  # loads the laws of balls

        return BearingNumbers((self.youngs_modulus.value, self.poisson_ratio.value))

    def check_bore(self, radius: float) -> None:
        """Take any bore: nothing lies around it."""

    def usual_race_width(self) -> tuple[float, str]:
        """Its length."""
        return self.length.value, "the length of the sleeve"

    def race_of_size(self, race: Race, width: Known, bore: float) -> Race:
        """Nothing spins with it."""
        none = Known(value=0.0, status="default", source="a sleeve does not spin", unit="kg")
        return race.completed_with({"width": width, "mass": none, "inertia": replace(none, unit="kg m^2")})
