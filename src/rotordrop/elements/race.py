"""The inner race of a touchdown bearing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from rotordrop.elements import values as V
from rotordrop.elements.description import Description
from rotordrop.elements.parameter import (
    Extension,
    Parameter,
    Values,
    bearing_entries,
    in_words,
    itself,
)
from rotordrop.elements.values import default, follows
from rotordrop.known import Known
from rotordrop.physics import columns as L

STEEL_DENSITY = 7800.0
"""Of bearing steel, rings and balls [kg/m³]."""

RACE_MASS, RACE_FORM = 1.25, 1.3
"""Factors within which mass and form, inertia over mass, of a race lie that are inferred from its size [1].

Grooves and shoulders make up a fifth of a ring. A mass within a factor of 2 moved peaks of ordinary rings by
up to 6 % (five drops of DropBench, rings within 10 % of the inferred mass): what spins along is an extension.
"""

CARRIED, MOST_CARRIED = 2.0, 5.0
"""Mass of a race with its carrier over that inferred from its size, where its search begins and at most [1].

Source: carriers of 2.3 and 2.5 were met; begun at 1 the search of the second ended in another minimum.
"""


class Race(Description):
    """The inner race with everything that spins with it."""

    mass: V.PositiveMass = follows("from the size of the bearing")
    """Mass [kg]."""
    inertia: V.PositiveInertia = follows("from the size of the bearing")
    """Polar moment of inertia [kg m²]."""
    width: V.PositiveLength = follows("the length of the contact, or from the size of the bearing")
    """Width over which the rotor lies in the race [m]; the pressure between them follows from it."""
    drag_coefficient: V.NonNegative = default(
        0.002, "rolling friction of angular-contact bearings", (0.001, 0.005)
    )
    """Drag torque over bearing force and half the pitch diameter [1]."""
    drag_speed: V.PositiveSpeed = default(1.0, "small against any race speed that matters in a drop")
    """Race speed over which the drag builds up [rad/s]."""

    columns: ClassVar[Mapping[str, int]] = {
        "mass": L.RACE_MASS,
        "inertia": L.RACE_INERTIA,
        "drag_coefficient": L.DRAG_COEFFICIENT,
        "drag_speed": L.DRAG_SPEED,
    }

    def sized(self, width: Known, inner: float, outer: float, why: str) -> Race:
        """Give the race a width, and where left out the mass and inertia of a steel ring of two radii [m]."""
        outer = max(outer, 1.05 * inner)
        mass = STEEL_DENSITY * math.pi * (outer**2 - inner**2) * width.value
        inertia = 0.5 * mass * (outer**2 + inner**2)
        values, spread = {"width": width}, RACE_FORM
        if "mass" not in self.model_fields_set:
            bounds = (mass / RACE_MASS, mass * RACE_MASS)
            values["mass"] = Known(value=mass, status="inferred", range=bounds, source=why, unit="kg")
            spread = math.exp(math.hypot(math.log(RACE_MASS), math.log(RACE_FORM)))
        else:
            inertia *= self.mass.value / mass
        if "inertia" not in self.model_fields_set:
            bounds = (inertia / spread, inertia * spread)
            values["inertia"] = Known(
                value=inertia, status="inferred", range=bounds, source=why, unit="kg m^2"
            )
        return self.completed_with(values)


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="race.mass",
        label="race mass",
        kind="mass",
        measured_by="the inner race of {owner} with all that spins with it, weighed",
        guess_sigma=0.4,
        given_sigma=0.05,
        reach=4.0,
        drift=0.02,
        entries=bearing_entries(L.RACE_MASS),
    ),
    Parameter(
        path="race.inertia",
        label="race inertia",
        kind="inertia",
        measured_by="a speed sensor on the inner race of {owner}",
        guess_sigma=0.12,
        # Rings that carry a sleeve have 2.5 times the inertia inferred from the bearing alone: the end of the
        # inferred range is no bound.
        reach=4.0,
        drift=0.1,
        late_drift_factor=5.0,
        entries=bearing_entries(L.RACE_INERTIA),
        spin_up_only=True,
    ),
    Parameter(
        path="race.drag_coefficient",
        label="drag coefficient of the race",
        kind="dimensionless",
        guess_sigma=0.5,
        reach=6.0,
        drift=0.2,
        entries=bearing_entries(L.DRAG_COEFFICIENT),
        spin_up_only=True,
    ),
)
"""Unknowns of a race."""


def _with_carrier(bearing: Any) -> dict[str, Known]:
    """Mass and inertia of a race that carries more than the size of the bearing tells, where nobody said.

    What the mass of a loose race is found to be stands in for its play.
    """
    race: Race | None = bearing.race
    if race is None or race.mass.status != "inferred" or not bearing.bearing.numbers().held:
        return {}
    values = {}
    for name, least in (("mass", RACE_MASS), ("inertia", RACE_MASS * RACE_FORM)):
        own: Known = getattr(race, name)
        within = (own.value / least, own.value * MOST_CARRIED * least / RACE_MASS)
        begun = CARRIED * own.value
        values[f"race.{name}"] = Known(value=begun, status="guess", range=within, unit=own.unit)
    return values


def _carried(bearing: Any, found: Values, _load: float) -> str:
    mass = found.get("race.mass")
    return "" if mass is None else f"{bearing.name} {in_words(itself(mass), 'kg')}"


EXTENSIONS: tuple[Extension, ...] = (
    Extension(
        name="ring masses",
        owner="bearing",
        names=(),
        neutral=_with_carrier,
        sentence=_carried,
        joined=", ",
        frame="races heavier than the size of their bearings tells, with all that spins along: {}",
        inferred=True,
    ),
)
