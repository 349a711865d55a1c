"""The face of a race, on which a shoulder of the rotor lands when it moves along its axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, Literal

from pydantic import Field

from rotordrop.arrays import Array
from rotordrop.elements.contact import refuse_other_unit
from rotordrop.elements.description import Description, Misfit, Usual
from rotordrop.elements.friction import SLIDING
from rotordrop.elements.values import (
    ContactDamping,
    ContactExponent,
    ContactStiffness,
    NonNegative,
    PositiveLength,
    default,
)
from rotordrop.physics import columns as L
from rotordrop.physics import face as law
from rotordrop.physics.contact import contact_law

SIDES: Mapping[str, float] = {"both": 0.0, "+z": 1.0, "-z": -1.0}
"""Side of a face as the kernels know it; +z points to higher nodes."""


AXIAL_STATE = "race {} axial"
"""State that holds the axial displacement of the race of a bearing."""

UNPRESSED = (
    "no load along the axis presses the rotor to it, so it bears nothing; describe the thrust as [[loads]] "
    'with direction = "axial" (towards higher nodes) or "-axial", the weight of a vertical rotor too'
)
"""What a face without any load along the axis means, and the way out."""


class Face(Description):
    """The faces of an inner race and the shoulders of the rotor before them, F = K δⁿ (1 + 1.5 λ δ̇)."""

    gap: PositiveLength
    """Axial clearance between shoulder and face, of each side with the rotor in its magnets [m]."""
    inner_radius: PositiveLength
    outer_radius: PositiveLength
    """Radii between which they touch [m]."""
    side: Literal["both", "+z", "-z"] = Field(
        default="both",
        description='a shoulder on either side; say "+z" or "-z" where only motion that way stops',
    )
    """Motion that it stops: towards higher nodes, "+z", towards lower ones, "-z", or both."""
    stiffness: ContactStiffness = default(
        1e9, "a steel shoulder on a ring, chosen and not measured", (1e8, 1e10)
    )
    """Contact stiffness K [N/m^n]."""
    exponent: ContactExponent = default(1.0, "flat on flat")
    """Exponent n [1]."""
    damping: ContactDamping = default(0.08, "contact damping of steel at low speed", (0.0, 0.5))
    """Contact damping λ [s/m]."""
    friction: NonNegative = default(0.1, "as between rotor and race", (0.05, 0.2))
    """Friction coefficient there [1], whose torque spins the race."""

    states_at: ClassVar[int] = L.FACE_STATES

    usual: ClassVar[Mapping[str, Usual]] = {"friction": replace(SLIDING, label="friction of the face")}

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Refuse a stiffness whose unit holds another exponent than the contact."""
        refuse_other_unit(raw, 1.0)
        return raw

    def check(self) -> None:
        """Refuse a ring without a width."""
        inner, outer = self.inner_radius.value, self.outer_radius.value
        if inner >= outer:
            raise Misfit(
                f"the inner radius of the face, {inner * 1e3:.4g} mm, must be smaller than the outer one, "
                f"{outer * 1e3:.4g} mm; interchanged?",
                ("inner_radius",),
            )

    @property
    def further_states(self) -> Mapping[str, int]:
        """Axial displacement and velocity of the race."""
        return {AXIAL_STATE: L.POSITION, f"{AXIAL_STATE} velocity": L.VELOCITY}

    @property
    def law(self) -> Array:
        """The law for the functions of `physics.contact`."""
        return contact_law(self.stiffness.value, self.exponent.value, self.damping.value)

    def stops(self, sense: float) -> bool:
        """Whether it stops motion in a sense, 1 towards higher nodes or -1."""
        return SIDES[self.side] in (0.0, sense)

    def fill(self, row: Array) -> None:
        """Write the columns of the face."""
        numbers = row[L.FACE : L.FACE_END]
        numbers[law.GAP], numbers[law.SIDE] = self.gap.value, SIDES[self.side]
        radius = law.mean_friction_radius(self.inner_radius.value, self.outer_radius.value)
        numbers[law.RADIUS], numbers[law.FRICTION] = radius, self.friction.value
        numbers[law.LAW :] = self.law
