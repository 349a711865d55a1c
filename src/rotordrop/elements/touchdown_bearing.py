"""A touchdown bearing: its clearance, contact, friction, race and support."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, WrapValidator

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.contact import Contact
from rotordrop.elements.description import Description, Misfit, Name, Placed
from rotordrop.elements.face import Face
from rotordrop.elements.friction import Friction
from rotordrop.elements.landing_sleeve import LandingSleeve
from rotordrop.elements.mount import Mount, mounted
from rotordrop.elements.parameter import Entry, Parameter, Role, Rule, bearing_entries
from rotordrop.elements.race import Race
from rotordrop.elements.race_bearing import RaceBearing
from rotordrop.elements.sleeve import Sleeve
from rotordrop.elements.support import Support
from rotordrop.elements.thermal import Thermal
from rotordrop.elements.values import PositiveLength, Time, default, scaled
from rotordrop.known import Known
from rotordrop.physics import columns as L

_MOUNTING = frozenset(
    ("arrangement", "first_ball_angle", "second_row_offset", "preload_class", "clearance_class")
)

WITHOUT_BALLS: Mapping[str, type[RaceBearing]] = {"sleeve": Sleeve}
"""Kinds of touchdown bearings whose table 'bearing' describes no ball bearing."""


def _of_its_kind(raw: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
    """Read a table 'bearing' as the kind of touchdown bearing says."""
    kind = WITHOUT_BALLS.get(info.data.get("kind", ""))
    if kind is None:
        return handler(raw)
    return raw if isinstance(raw, kind) else kind.model_validate(raw)


class TouchdownBearing(Placed):
    """One touchdown bearing with its clearance and all that the rotor meets when it drops."""

    name: Name
    """Name, such as "NDE" or "DE"."""
    kind: Literal["ball bearing", "sleeve"] = Field(
        default="ball bearing",
        description='a ball bearing; say "sleeve" where the rotor lands in a plain ring',
    )
    """What catches the rotor."""
    air_gap: PositiveLength
    """Radial clearance between rotor and inner race [m]."""
    bore_radius: PositiveLength
    """Radius of the bore of the inner race [m]; the rotor's radius is smaller by the air gap."""
    damping_time: Time = default(1e-5, "within (0.25–2.5)·10⁻⁵ s of Neisi 2020", (0.25e-5, 2.5e-5))
    """Bearing damping over tangent stiffness, C_b/K_b [s]."""
    bearing: Annotated[BallBearing, WrapValidator(_of_its_kind)]
    """The rolling bearing that carries the race, or the sleeve."""
    contact: Contact = Field(default_factory=Contact)
    """Contact between rotor and inner race."""
    friction: Friction = Field(default_factory=Friction)
    """Friction between rotor and inner race."""
    race: Race = Field(default_factory=Race)
    """The inner race."""
    support: Support = Field(default_factory=Support)
    """What carries the outer ring."""
    mount: Mount = Field(default_factory=Mount)
    """What lies in parallel to spring and damper of the support: ribbon, branches that relax, stop."""
    landing_sleeve: LandingSleeve = Field(default_factory=LandingSleeve)
    """Part of the rotor that lands in the bearing, where it is eccentric or oval."""
    face: Face | None = None
    """Faces of the race, on which the rotor lands when it moves along its axis."""
    thermal: Thermal | None = None
    """Heat of the bearing; without this table its race stays cold."""

    columns: ClassVar[Mapping[str, int]] = {"air_gap": L.AIR_GAP, "bore_radius": L.BORE_RADIUS}

    @property
    def masses(self) -> dict[str, float]:
        """What moves between rotor and ground, from the rotor outwards, and its mass [kg]."""
        race = {} if self.bearing.no_race else {"race": float(self.race.mass)}
        return race | {"support": float(self.support.mass)}

    @property
    def parts(self) -> tuple[Description, ...]:
        """Its parts, in the order in which they write their columns: a support asks for that of its mount."""
        others = (part for part in (self.face, self.thermal) if part is not None)
        usual = self.bearing, self.contact, self.friction, self.race, self.mount, self.support
        return *usual, self.landing_sleeve, *others

    def fill(self, row: NDArray[np.float64]) -> None:
        """Write the columns of clearance and parts."""
        super().fill(row)
        # the bore is measured, so an error of the gap is one of the rotor's radius
        row[L.ROTOR_RADIUS] = row[L.BORE_RADIUS] - row[L.AIR_GAP]
        for part in self.parts:
            part.fill(row)
        if self.thermal is not None:
            self.thermal.fill_arms(row, self.bearing)

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Read a mount as a list of elements in parallel, and a sleeve that says nothing of itself."""
        if raw.get("kind") == "planetary":
            told = (
                'kind = "planetary" is reserved for bearings of several rollers, which are not yet supported'
            )
            raise Misfit(f'{told}; there are "ball bearing" and "sleeve"', ("kind",))
        return mounted({"bearing": {}} | raw if raw.get("kind") in WITHOUT_BALLS else raw)

    def check(self) -> None:
        """Refuse a clearance that leaves no rotor and a bore outside the balls."""
        super().check()
        gap, bore = self.air_gap.value, self.bore_radius.value
        if gap >= bore:
            raise Misfit(
                f"the air gap {gap * 1e3:.4g} mm must be smaller than the bore radius {bore * 1e3:.4g} mm",
                ("air_gap",),
            )
        self.landing_sleeve.check_gap(gap)
        self.bearing.check_bore(bore)
        if self.thermal is not None and self.bearing.no_race:
            raise Misfit(
                f"the touchdown bearing {self.name} cannot have a table 'thermal': heat is computed of a "
                "race and its balls, of which it has none; leave the table out",
                ("thermal",),
            )
        if self.face is not None and self.bearing.no_face:
            raise Misfit(
                f"the touchdown bearing {self.name} cannot have a face: {self.bearing.no_face}, which is not "
                "yet supported; leave the face out, or describe a preloaded pair between rigid spacers or a "
                "bearing with clearance",
                ("face",),
            )
        if self.bearing.no_race and self.race.model_fields_set:
            raise Misfit(self.bearing.no_race, ("race",))

    def with_designation(self, designation: str) -> TouchdownBearing:
        """Give the same touchdown bearing around another rolling bearing, with its catalogue values.

        How it is mounted stays: arrangement, angles of the balls, classes of preload and clearance. Forces
        and lengths of the bearing before it do not. Mass and inertia of the race change as those of steel
        rings of both sizes do.
        """
        if self.kind != "ball bearing":
            raise ValueError(f'it is a {self.kind}; give the file kind = "ball bearing" and a bearing')
        kept = self.bearing.model_fields_set & _MOUNTING
        mounted = {name: getattr(self.bearing, name) for name in kept}
        inside = BallBearing.model_validate({"designation": designation} | mounted)
        race: dict[str, Any] = {name: getattr(self.race, name) for name in self.race.model_fields_set}
        rings = Race.model_validate({"width": race["width"]} if "width" in race else {})
        before, sized = self.changed(race=rings), self.changed(race=rings, bearing=inside)
        for name in race.keys() & {"mass", "inertia"}:
            factor = getattr(sized.race, name).value / getattr(before.race, name).value
            why = f"that of {self.bearing.designation or 'the described bearing'}, by the size of both"
            race[name] = scaled(race[name], factor, why, race[name].unit)
        return self.changed(bearing=inside, race=Race.model_validate(race))

    def left_out(self) -> dict[str, Any]:
        """Give race and contact what was left out, from the size of the bearing."""
        if "width" in self.race.model_fields_set:
            width = self.race.width
        elif self.contact.length is not None:
            of_line = "the length of the line contact"
            width = replace(self.contact.length, status="inferred", source=of_line)
        else:
            value, why = self.bearing.usual_race_width()
            width = Known(value=value, status="default", source=f"{why}; a sleeve differs", unit="m")
        race = self.bearing.race_of_size(self.race, width, self.bore_radius.value)
        heat = {} if self.thermal is None else {"thermal": self.thermal.beside(self, race)}
        contact, mount = self.contact.over(width.value), self.mount.beside(self.support.stiffness)
        return {"race": race, "contact": contact, "mount": mount, **heat}

    def under(self, rotor_mass: float) -> TouchdownBearing:
        """The bearing under a rotor of a mass [kg], for values of its support that were left out."""
        support = self.support.under(rotor_mass)
        if support is self.support:
            return self
        return self.completed_with({"support": support, "mount": self.mount.beside(support.stiffness)})


MODEL_GAP_ERROR = 0.008
"""Standard deviation of a gap, over it, by what confounds it with gains and offsets beyond the fit [1].

Sensors that read 1 % of the motion across, as mounted 0.6° aside, moved gaps of lone drops by up to 2 %.
"""

AIR_GAP = Parameter(
    path="air_gap",
    label="air gap",
    kind="length",
    measured_by="a lift check at {owner}",
    logarithmic=False,
    role=Role.SOUGHT,
    guess_sigma=0.08,
    scale="air gap",
    least_sigma=1e-12,
    lower=0.0,
    drift=0.032,
    entries=bearing_entries(L.AIR_GAP),
    separated_by={"offset": "a lift test of the rotor in its magnets gives the diametral clearance"},
)

PARAMETERS: tuple[Parameter, ...] = (
    AIR_GAP,
    Parameter(
        path="equivalent_stiffness",
        label="equivalent stiffness, bearing and support",
        kind="stiffness",
        role=Role.DERIVED,
    ),
)
"""Unknowns of the clearance, and of bearing and support together."""

DAMPING: tuple[Parameter, ...] = (
    Parameter(
        path="damping_time",
        label="damping time of the balls",
        kind="time",
        shown_as="short_time",
        guess_sigma=0.5,
        drift=0.2,
        entries=(Entry(array="bearing", column=L.BEARING_DAMPING, rule=Rule.RATIO),),
    ),
)
"""Unknowns of the damping of the bearing."""
