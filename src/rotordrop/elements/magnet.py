"""Active magnetic bearing planes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field, Strict

from rotordrop.elements.description import Name, Placed
from rotordrop.elements.values import Damping, Stiffness, follows
from rotordrop.known import Known

RIGID_FREQUENCY = 40.0
"""Rigid-body frequency [Hz] that the AMBs are taken to give the rotor when their stiffness is left out."""

DAMPING_RATIO = 0.3
"""Damping ratio [1] of that motion when the AMB damping is left out."""

REMANENCE_TIME = 2e-3
"""Time in which the remanent force of a magnet decays, where nothing is known of it [s]."""


class ActiveMagneticBearing(Placed):
    """A radial active magnetic bearing, near its operating point.

    Attributes
    ----------
    node : int
        Node number, counted from 1.
    stiffness : Known
        Stiffness of the closed loop [N/m].
    damping : Known
        Damping of the closed loop [N s/m].
    integral_action : bool
        Whether the controller holds the rotor centred against gravity.
    """

    name: Name
    stiffness: Stiffness = follows("a rigid-body frequency of 40 Hz of the mass this AMB carries")
    damping: Damping = follows("30 % of critical for the mass this AMB carries")
    integral_action: Annotated[bool, Strict()] = Field(
        default=True, description="The controller holds the rotor centred against gravity"
    )

    reserved: ClassVar[Mapping[str, str]] = {"controller": "the controller of a closed loop"}

    def completed(self, carried_mass: float) -> dict[str, Known]:
        """Values for a stiffness and damping that were left out, from the mass carried [kg]."""
        values: dict[str, Known] = {}
        stiffness = self.stiffness
        if "stiffness" not in self.model_fields_set:
            value = carried_mass * (2.0 * math.pi * RIGID_FREQUENCY) ** 2
            why = (
                f"gives the {carried_mass:.3g} kg it carries a rigid-body frequency of {RIGID_FREQUENCY:g} Hz"
            )
            stiffness = Known(value=value, status="default", source=why, unit="N/m")
            values["stiffness"] = stiffness
        if "damping" not in self.model_fields_set:
            value = 2.0 * DAMPING_RATIO * math.sqrt(stiffness.value * carried_mass)
            why = f"{DAMPING_RATIO:.0%} of critical for the {carried_mass:.3g} kg it carries"
            values["damping"] = Known(value=value, status="default", source=why, unit="N s/m")
        return values
