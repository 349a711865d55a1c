"""Active magnetic bearing planes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, Strict

from rotordrop.elements.description import Description, Name, Placed
from rotordrop.elements.parameter import Entry, Extension, Parameter, Values, guess, in_words, itself
from rotordrop.elements.values import Damping, Stiffness, follows
from rotordrop.known import NINETY, Known
from rotordrop.physics import columns as L

RIGID_FREQUENCY = 40.0
"""Rigid-body frequency [Hz] that the AMBs are taken to give the rotor when their stiffness is left out
(chosen)."""

DAMPING_RATIO = 0.3
"""Damping ratio [1] of that motion when the AMB damping is left out (chosen)."""

REMANENCE_TIME = 2e-3
"""Time in which the remanent force of a magnet decays, where nothing is known of it [s]."""


class ActiveMagneticBearing(Placed):
    """A radial active magnetic bearing, near its operating point."""

    name: Name
    """Name, of which no two are the same."""
    stiffness: Stiffness = follows("a rigid-body frequency of 40 Hz of the mass this AMB carries")
    """Stiffness of the closed loop [N/m]."""
    damping: Damping = follows("30 % of critical for the mass this AMB carries")
    """Damping of the closed loop [N s/m]."""
    integral_action: Annotated[bool, Strict()] = Field(
        default=True, description="The controller holds the rotor centred against gravity"
    )
    """Whether the controller holds the rotor centred against gravity."""

    columns: ClassVar[Mapping[str, int]] = {"stiffness": L.AMB_STIFFNESS, "damping": L.AMB_DAMPING}

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


class AxialMagneticBearing(Description):
    """An axial active magnetic bearing, near its operating point; it holds the rotor until the release."""

    name: Name
    """Name, of which no two are the same."""
    stiffness: Stiffness
    """Stiffness of the closed loop [N/m]."""
    damping: Damping
    """Damping of the closed loop [N s/m]."""


REMANENCE_SIGMA = 1.2
"""Standard deviation of the logarithm of the time in which a remanent force decays [1]."""

FORCES: tuple[Parameter, ...] = (
    *(
        Parameter(
            path=f"remanent_force.{axis}",
            owner="magnet",
            label=f"remanent force, {axis}",
            kind="force",
            logarithmic=False,
            guess_sigma=0.2,
            given_sigma=0.0,
            scale="weight a magnet carries",
            entries=(Entry(array="magnet", column=column),),
        )
        for column, axis in ((L.REMANENT_X, "x"), (L.REMANENT_Y, "y"))
    ),
)
"""Unknowns of a magnet, in every drop anew."""

REMANENCE = Parameter(
    path="remanence.time_constant",
    owner="drop",
    label="time constant of the remanent force",
    kind="time",
    shown_as="duration",
    guess_sigma=0.4,
    given_sigma=0.0,
    entries=(Entry(array="spin", column=L.REMANENCE_TIME_CONSTANT),),
)
"""Unknown of all magnets together, in every drop anew."""


def _long(machine: Any) -> dict[str, Known]:
    if not machine.ambs:
        return {}
    reach = math.exp(NINETY * REMANENCE_SIGMA)
    long = (REMANENCE_TIME / reach, REMANENCE_TIME * reach)
    return {"remanence_time_constant": Known(value=REMANENCE_TIME, status="guess", range=long)}


def _decay(_machine: Any, found: Values, _load: float) -> str:
    time = itself(found["remanence.time_constant"])
    usual = f"the usual {1e3 * REMANENCE_TIME:g} ms"
    side = f"longer than {usual}" if time[1] > REMANENCE_TIME else f"shorter than {usual}"
    return f"the lift of the magnets decays in {in_words(time, 'ms', 1e-3)}, {side}"


EXTENSIONS: tuple[Extension, ...] = (
    Extension(
        name="long remanence",
        owner="drop",
        names=("remanence_time_constant",),
        neutral=_long,
        nothing={"remanence.time_constant": REMANENCE_TIME},
        sentence=_decay,
        base=lambda machine: {"remanence_time_constant": guess(REMANENCE_TIME)} if machine.ambs else {},
    ),
)
