"""A narrow place beside the touchdown bearings, such as a seal or a lamination, that a drop may come to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.description import Misfit, Name, Placed, Usual
from rotordrop.elements.friction import SLIDING
from rotordrop.elements.rotor import Rotor
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.values import ContactDamping, NonNegative, PositiveLength, Stiffness
from rotordrop.known import Known
from rotordrop.physics import touch as law
from rotordrop.physics.contact import contact_law
from rotordrop.physics.friction import SMOOTHING_SPEED
from rotordrop.units import format_quantity

_OF_CONTACT: Mapping[str, tuple[float, tuple[float, float], str, str]] = {
    "friction": (0.2, (0.05, 0.4), "metals that rub dry, chosen and not measured", "1"),
    "damping": (0.1, (0.0, 0.5), "contact damping of steel at low speed", "s/m"),
}
"""What a contact is where the file gives its stiffness alone: value, range, why, unit."""

STRIBECK_SPEED = 1.0
"""Speed of the Stribeck curve [m/s], which changes nothing where static and dynamic coefficient are one."""


class Clearance(Placed):
    """A radial gap between rotor and housing: a drop is judged by how much it uses.

    With a stiffness the rotor touches the housing there; without one no force acts.
    """

    name: Name
    """Name of the place, such as "seal"."""
    gap: PositiveLength
    """Radial gap [m]."""
    stiffness: Stiffness | None = None
    """Stiffness of the housing where the rotor touches it [N/m]."""
    friction: NonNegative | None = None
    """With a stiffness: friction coefficient there [1]; 0.2."""
    damping: ContactDamping | None = None
    """With a stiffness: contact damping λ [s/m]; 0.1."""
    radius: PositiveLength | None = None
    """With a stiffness: radius of the rotor there [m]; that of the shaft."""

    usual: ClassVar[Mapping[str, Usual]] = {"friction": SLIDING}

    def check(self) -> None:
        """Refuse a contact without a stiffness."""
        super().check()
        for key in ("friction", "damping", "radius"):
            if self.stiffness is None and key in self.model_fields_set:
                raise Misfit(
                    f"the clearance {self.name!r} has a {key!r} but no 'stiffness', without which no force "
                    'acts; give it, such as stiffness = "4e7 N/m", or leave it out',
                    (key,),
                )

    @property
    def beyond_estimates(self) -> tuple[str, str] | None:
        """A housing that the rotor touches."""
        if self.stiffness is None:
            return None
        return (
            "has a 'stiffness'",
            ": the housing would pass for something else. Leave it out where the rotor did not touch there; "
            "simulations and studies know it",
        )

    def completed(self, rotor: Rotor) -> dict[str, Any]:
        """What its contact leaves out, on a rotor."""
        if self.stiffness is None:
            return {}
        given = self.model_fields_set
        values = {
            key: Known(value=value, status="default", range=bounds, source=why, unit=unit)
            for key, (value, bounds, why, unit) in _OF_CONTACT.items()
            if key not in given
        }
        if "radius" not in given:
            why, most = "the radius of the shaft there", max(rotor.radii_at(self.node))
            values["radius"] = Known(value=most, status="inferred", source=why, unit="m")
        return values

    def touch(self) -> NDArray[np.float64]:
        """The numbers of its contact for `rotordrop.physics.touch`."""
        assert self.stiffness and self.friction and self.damping and self.radius
        numbers = np.zeros(law.N_ENTRIES)
        numbers[law.AIR_GAP], numbers[law.ROTOR_RADIUS] = self.gap.value, self.radius.value
        numbers[law.BORE_RADIUS] = self.radius.value + self.gap.value
        numbers[[law.FRICTION_STATIC, law.FRICTION_DYNAMIC]] = self.friction.value
        numbers[law.STRIBECK_SPEED] = STRIBECK_SPEED
        numbers[law.SMOOTHING_SPEED] = SMOOTHING_SPEED
        numbers[law.LAW :] = contact_law(self.stiffness.value, 1.0, self.damping.value)
        return numbers


def check_clearances(
    clearances: Sequence[Clearance], bearings: Sequence[TouchdownBearing], nodes: Sequence[float]
) -> None:
    """Refuse a clearance that the rotor uses up before it reaches its touchdown bearings.

    ``nodes`` are the positions of the nodes [m]; between two bearings the air gap goes in a straight line.
    """
    ordered = sorted(bearings, key=lambda bearing: bearing.node)
    places = [nodes[bearing.node - 1] for bearing in ordered]
    gaps = [float(bearing.air_gap) for bearing in ordered]
    for index, clearance in enumerate(clearances):
        allowed = float(np.interp(nodes[clearance.node - 1], places, gaps))
        if float(clearance.gap) <= allowed:
            stated, reach = (format_quantity(gap, "length") for gap in (float(clearance.gap), allowed))
            raise Misfit(
                f"the clearance {clearance.name!r} of {stated} at node {clearance.node} is used up before "
                f"the rotor reaches its touchdown bearings, whose air gap is {reach} there; widen it",
                ("clearances", index, "gap"),
            )
