"""A touchdown bearing: its clearance, contact, friction, race and support."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from pydantic import Field

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.description import Description, Misfit, Name, Placed
from rotordrop.elements.values import (
    ContactDamping,
    ContactExponent,
    ContactStiffness,
    Coupling,
    CubicTerm,
    Damping,
    NonNegative,
    Positive,
    PositiveInertia,
    PositiveLength,
    PositiveMass,
    PositiveSpeed,
    Stiffness,
    Time,
    Velocity,
    default,
    follows,
)
from rotordrop.known import Known

LINE_CONTACT = 10.0 / 9.0
"""Exponent of a line contact (Palmgren)."""

_UNIT_EXPONENT = re.compile(r"m\s*(?:\^|\*\*)\s*([\d.]+)\s*$")
_STATIC_OVER_DYNAMIC = 1.3
_DAMPING_RATIO = 0.025
_STEEL_DENSITY = 7800.0
_MOUNTING = frozenset(
    ("arrangement", "first_ball_angle", "second_row_offset", "preload_class", "clearance_class")
)


class Contact(Description):
    """Contact between rotor and inner race, F = K δⁿ (1 + 1.5 λ δ̇).

    Attributes
    ----------
    stiffness : Known
        Contact stiffness K [N/m^n].
    exponent : Known
        Exponent n [1].
    damping : Known
        Contact damping λ [s/m].
    length : Known, optional
        Length of the line contact [m], from which Palmgren's formula gives the stiffness.
    """

    stiffness: ContactStiffness = follows("8e8 N/m^1.11, or Palmgren's line contact where 'length' is given")
    exponent: ContactExponent = default(LINE_CONTACT, "line contact (Palmgren), as in Neisi 2020")
    damping: ContactDamping = default(0.08, "contact damping of steel at low speed", (0.0, 0.5))
    length: PositiveLength | None = Field(default=None, description="Length of the line contact")

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {"stiffness": ("length",)}

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Refuse a stiffness whose unit holds another exponent than the contact."""
        exponent = raw.get("exponent", LINE_CONTACT)
        written = raw.get("stiffness")
        if isinstance(written, Mapping):
            written = written.get("value", written.get("guess"))
        found = _UNIT_EXPONENT.search(written) if isinstance(written, str) else None
        if found and isinstance(exponent, int | float) and abs(float(found.group(1)) - exponent) > 0.01:
            raise Misfit(
                f"{written!r} belongs to the exponent {found.group(1)}, but the contact has the exponent "
                f"{exponent:.4g}; change the unit or give 'exponent'",
                ("stiffness",),
            )
        return raw

    def check(self) -> None:
        """Refuse a stiffness given twice."""
        if self.length is None:
            return
        if "stiffness" in self.model_fields_set:
            raise Misfit("the contact has both 'stiffness' and 'length'; keep one of them", ("length",))
        if abs(self.exponent.value - LINE_CONTACT) > 1e-3:
            raise Misfit(
                f"the stiffness of a line contact goes with the exponent 10/9, not {self.exponent.value:g}; "
                "leave out 'exponent' or give the 'stiffness'",
                ("exponent",),
            )

    def left_out(self) -> dict[str, Any]:
        """Give a stiffness that was left out."""
        if "stiffness" in self.model_fields_set:
            return {}
        if self.length is not None:
            value = palmgren_stiffness(self.length.value)
            why = f"Palmgren line contact over {self.length.value * 1e3:.4g} mm"
            return {"stiffness": Known(value=value, status="inferred", source=why, unit="N/m^n")}
        why = "about a fifth of Palmgren's value for 32 mm: edges and waviness leave part of the length"
        bounds = (2e8, 4e9)
        return {"stiffness": Known(value=8e8, status="default", range=bounds, source=why, unit="N/m^n")}


def palmgren_stiffness(length: float) -> float:
    """Contact stiffness [N/m^(10/9)] of a line contact [m]: δ = 3.84e-5 Q^0.9 / l^0.8 in mm and N."""
    per_mm = math.pow(3.84e-5, -LINE_CONTACT) * math.pow(1e3 * length, 0.8 * LINE_CONTACT)
    return per_mm * math.pow(1e3, LINE_CONTACT)


class Friction(Description):
    """Stribeck friction between rotor and inner race.

    Attributes
    ----------
    static, dynamic : Known
        Friction coefficients at rest and when sliding fast [1].
    stribeck_speed : Known
        Sliding speed over which static falls to dynamic [m/s].
    smoothing_speed : Known
        Sliding speed below which the friction is smoothed [m/s].
    """

    static: NonNegative = follows("1.3 times the dynamic coefficient")
    dynamic: NonNegative = default(0.1, "the range swept in Neisi 2020 lies around it", (0.05, 0.2))
    stribeck_speed: Velocity = default(0.5, "as in the reference machine", (0.1, 2.0))
    smoothing_speed: Velocity = default(0.02, "small against any sliding speed that matters in a drop")

    def left_out(self) -> dict[str, Any]:
        """Let the static coefficient follow the dynamic one."""
        if "static" in self.model_fields_set:
            return {}
        why = f"{_STATIC_OVER_DYNAMIC:g} times the dynamic coefficient, the ratio of Neisi 2020"
        return {"static": _scaled(self.dynamic, _STATIC_OVER_DYNAMIC, why, "")}


class Race(Description):
    """The inner race with everything that spins with it.

    Attributes
    ----------
    mass : Known
        Mass [kg].
    inertia : Known
        Polar moment of inertia [kg m²].
    width : Known
        Width over which the rotor lies in the race [m]; the pressure between them follows from it.
    drag_coefficient : Known
        Drag torque over bearing force and half the pitch diameter [1].
    drag_speed : Known
        Race speed over which the drag builds up [rad/s].
    """

    mass: PositiveMass = follows("from the size of the bearing")
    inertia: PositiveInertia = follows("from the size of the bearing")
    width: PositiveLength = follows("the length of the contact, or from the size of the bearing")
    drag_coefficient: NonNegative = default(
        0.002, "rolling friction of angular-contact bearings", (0.001, 0.005)
    )
    drag_speed: PositiveSpeed = default(1.0, "small against any race speed that matters in a drop")


class Support(Description):
    """What carries the outer ring: mass on a spring and a damper, vertical (y) and horizontal (x).

    Attributes
    ----------
    mass, stiffness, damping : Known
        Vertical support mass [kg], stiffness [N/m] and damping [N s/m].
    damping_ratio : Known, optional
        In place of the damping: C = 2 ζ √(K m).
    mass_horizontal, stiffness_horizontal, damping_horizontal : Known
        The same in the horizontal direction; equal to the vertical ones when left out.
    damping_ratio_horizontal : Known, optional
        In place of the horizontal damping.
    coupling : Known, optional
        Coupling of x and y over the geometric mean of horizontal and vertical stiffness [1]: principal axes
        that are turned.
    cubic : Known, optional
        Cubic term k₃ of the spring, F = K h (1 + k₃ h²) along x and along y [1/m²].
    foundation_share : Known, optional
        Support mass over modal mass of a foundation that gives way under the support [1].
    foundation_frequency, foundation_damping_ratio : Known, optional
        Natural frequency [rad/s] and damping ratio [1] of that foundation.
    """

    mass: PositiveMass = default(
        40.0, "the housing parts around the bearing of the reference machine", (4.0, 400.0)
    )
    stiffness: Stiffness = default(1e8, "a first guess for a bearing housing", (1e7, 2e9))
    damping: Damping = follows("2.5 % of critical, or from the damping ratio")
    damping_ratio: NonNegative | None = Field(default=None, description="")
    mass_horizontal: PositiveMass = follows("equal to the vertical one")
    stiffness_horizontal: Stiffness = follows("equal to the vertical one")
    damping_horizontal: Damping = follows("from the damping ratio, or equal to the vertical one")
    damping_ratio_horizontal: NonNegative | None = Field(default=None, description="")
    coupling: Coupling | None = Field(
        default=None, description="Coupling of x and y over the geometric mean of both stiffnesses"
    )
    cubic: CubicTerm | None = Field(default=None, description="Cubic term k3 of F = K h (1 + k3 h^2)")
    foundation_share: NonNegative | None = Field(
        default=None, description="Support mass over modal mass of a foundation that gives way"
    )
    foundation_frequency: PositiveSpeed | None = Field(
        default=None, description="Natural frequency of that foundation"
    )
    foundation_damping_ratio: Positive | None = Field(
        default=None, description="Damping ratio of that foundation"
    )

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "damping": ("damping_ratio",),
        "damping_ratio": ("damping",),
        "damping_horizontal": ("damping_ratio_horizontal",),
        "damping_ratio_horizontal": ("damping_horizontal",),
    }

    def check(self) -> None:
        """Refuse damping given twice."""
        for end in ("", "_horizontal"):
            if {f"damping{end}", f"damping_ratio{end}"} <= self.model_fields_set:
                raise Misfit(
                    f"the support has both 'damping{end}' and 'damping_ratio{end}'; keep one of them",
                    (f"damping_ratio{end}",),
                )
        parts = ("foundation_share", "foundation_frequency", "foundation_damping_ratio")
        given = [name for name in parts if getattr(self, name) is not None]
        if given and len(given) < len(parts):
            missing = next(name for name in parts if name not in given)
            raise Misfit(
                f"the support has {given[0]!r} but no {missing!r}; a foundation needs {', '.join(parts)}",
                (given[0],),
            )

    def left_out(self) -> dict[str, Any]:
        """Let damping follow its ratio and the horizontal values follow the vertical ones."""
        values: dict[str, Any] = {}
        given = self.model_fields_set
        for name in ("mass", "stiffness"):
            if f"{name}_horizontal" not in given:
                vertical = getattr(self, name)
                values[f"{name}_horizontal"] = _scaled(
                    vertical, 1.0, "equal to the vertical one", vertical.unit
                )
        if "damping" not in given:
            values["damping"] = _from_ratio(self.damping_ratio, self.mass, self.stiffness)
        if "damping_horizontal" not in given:
            values["damping_horizontal"] = self._horizontal_damping(values)
        return values

    def _horizontal_damping(self, values: dict[str, Any]) -> Known:
        mass = values.get("mass_horizontal", self.mass_horizontal)
        stiffness = values.get("stiffness_horizontal", self.stiffness_horizontal)
        if self.damping_ratio_horizontal is not None:
            return _from_ratio(self.damping_ratio_horizontal, mass, stiffness)
        if "damping" in self.model_fields_set:
            return _scaled(self.damping, 1.0, "equal to the vertical one", "N s/m")
        why = "the damping ratio of the vertical direction"
        return replace(_from_ratio(self.damping_ratio, mass, stiffness), status="default", source=why)


def _from_ratio(ratio: Known | None, mass: Known, stiffness: Known) -> Known:
    critical = 2.0 * math.sqrt(stiffness.value * mass.value)
    if ratio is None:
        why = f"{_DAMPING_RATIO:.1%} of critical"
        value = _DAMPING_RATIO * critical
        bounds = (0.1 * value, 10.0 * value)
        return Known(value=value, status="default", range=bounds, source=why, unit="N s/m")
    scaled = _scaled(ratio, critical, f"damping ratio {ratio.value:g}", "N s/m")
    return replace(scaled, status=ratio.status)


def _scaled(value: Known, factor: float, why: str, unit: str) -> Known:
    """Another value that follows from one by a factor, with its range."""
    bounds = None if value.range is None else (value.range[0] * factor, value.range[1] * factor)
    return Known(value=value.value * factor, status="default", range=bounds, source=why, unit=unit)


class TouchdownBearing(Placed):
    """One touchdown bearing with its clearance and all that the rotor meets when it drops.

    Attributes
    ----------
    name : str
        Name, such as "NDE" or "DE".
    node : int
        Node number, counted from 1.
    air_gap : Known
        Radial clearance between rotor and inner race [m].
    bore_radius : Known
        Radius of the bore of the inner race [m]; the rotor's radius is smaller by the air gap.
    damping_time : Known
        Bearing damping over tangent stiffness, C_b/K_b [s].
    """

    name: Name
    air_gap: PositiveLength
    bore_radius: PositiveLength
    damping_time: Time = default(1e-5, "within (0.25–2.5)·10⁻⁵ s of Neisi 2020", (0.25e-5, 2.5e-5))
    bearing: BallBearing
    contact: Contact = Field(default_factory=Contact, description="Contact between rotor and inner race")
    friction: Friction = Field(default_factory=Friction, description="Friction between rotor and inner race")
    race: Race = Field(default_factory=Race, description="The inner race")
    support: Support = Field(default_factory=Support, description="What carries the outer ring")

    reserved: ClassVar[Mapping[str, str]] = {
        "kind": "another kind of touchdown bearing than a ball bearing (sleeve, planetary)",
        "mount": "a soft mount with a stop",
        "thermal": "the heat of the bearing",
    }

    def check(self) -> None:
        """Refuse a clearance that leaves no rotor and a bore outside the balls."""
        super().check()
        gap, bore = self.air_gap.value, self.bore_radius.value
        if gap >= bore:
            raise Misfit(
                f"the air gap {gap * 1e3:.4g} mm must be smaller than the bore radius {bore * 1e3:.4g} mm",
                ("air_gap",),
            )
        self.bearing.check_bore(bore)

    def with_designation(self, designation: str) -> TouchdownBearing:
        """Give the same touchdown bearing around another rolling bearing, with its catalogue values.

        How it is mounted stays: arrangement, angles of the balls, classes of preload and clearance. Forces
        and lengths of the bearing before it do not. Mass and inertia of the race change as those of steel
        rings of both sizes do.
        """
        kept = self.bearing.model_fields_set & _MOUNTING
        mounted = {name: getattr(self.bearing, name) for name in kept}
        inside = BallBearing.model_validate({"designation": designation} | mounted)
        race: dict[str, Any] = {name: getattr(self.race, name) for name in self.race.model_fields_set}
        rings = Race.model_validate({"width": race["width"]} if "width" in race else {})
        before, sized = self.changed(race=rings), self.changed(race=rings, bearing=inside)
        for name in race.keys() & {"mass", "inertia"}:
            factor = getattr(sized.race, name).value / getattr(before.race, name).value
            why = f"that of {self.bearing.designation or 'the described bearing'}, by the size of both"
            race[name] = _scaled(race[name], factor, why, race[name].unit)
        return self.changed(bearing=inside, race=Race.model_validate(race))

    def left_out(self) -> dict[str, Any]:
        """Give the race a width, mass and inertia that were left out, from the size of the bearing."""
        given = self.race.model_fields_set
        width = self.race.width if "width" in given else self._race_width()
        mass, inertia = self._race_from_size(width.value)
        why = self.bearing.race_radius()[1]
        values: dict[str, Known] = {"width": width}
        if "mass" not in given:
            bounds = (0.5 * mass, 2.0 * mass)
            values["mass"] = Known(value=mass, status="inferred", range=bounds, source=why, unit="kg")
        else:
            inertia *= self.race.mass.value / mass
        if "inertia" not in given:
            bounds = (0.5 * inertia, 2.0 * inertia)
            values["inertia"] = Known(
                value=inertia, status="inferred", range=bounds, source=why, unit="kg m^2"
            )
        return {"race": self.race.completed_with(values)}

    def _race_width(self) -> Known:
        if self.contact.length is not None:
            return replace(self.contact.length, status="inferred", source="the length of the line contact")
        value, why = self.bearing.usual_race_width()
        return Known(value=value, status="default", source=f"{why}; a sleeve differs", unit="m")

    def _race_from_size(self, width: float) -> tuple[float, float]:
        inner = self.bore_radius.value
        outer = max(self.bearing.race_radius()[0], 1.05 * inner)
        mass = _STEEL_DENSITY * math.pi * (outer**2 - inner**2) * width
        return mass, 0.5 * mass * (outer**2 + inner**2)
