"""Ways in which a hidden machine breaks what an estimator takes for granted, by name or from a case file."""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field

from rotordrop.elements.description import Channel, Description, Misfit, Name, Node
from rotordrop.elements.values import (
    Angle,
    ContactExponent,
    Force,
    Length,
    NonNegative,
    Physical,
    Positive,
    PositiveForce,
    PositiveFrequency,
    PositiveLength,
    PositiveMass,
    PositiveTime,
    Share,
    Stiffness,
    Time,
    Unbalance,
    default,
)
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.loading import load_description
from rotordrop.machine.schema import description_schema

CrossAxis = Annotated[Known, Physical("dimensionless", least=-0.5, most=0.5)]
Lift = Annotated[Known, Physical("dimensionless", least=0.0, most=0.95)]
ClockError = Annotated[Known, Physical("dimensionless", least=-0.1, most=0.1)]
AboveOne = Annotated[Known, Physical("dimensionless", above=1.0)]
Energy = Annotated[Known, Physical("energy", above=0.0)]
MOST_POINTS = 9
"""Points of a contact law: the kernel keeps eight pieces, by definition of its columns."""
NO_CHANGE = "as the machine has it"


class Violation(Description):
    """One group of violations; what is left out is as the machine has it."""

    together: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Keys of which none says anything without the others."""

    def check(self) -> None:
        """Refuse half of what belongs together."""
        for group in self.together:
            given = [key for key in group if key in self.model_fields_set]
            missing = [key for key in group if key not in self.model_fields_set]
            if given and missing:
                words = f"{given[0]!r} needs {missing[0]!r} beside it; add it or leave out both"
                raise Misfit(words, (given[0],))

    def values(self) -> dict[str, Any]:
        """What was given, by key [SI]."""
        given = (key for key in type(self).model_fields if key in self.model_fields_set)
        return {key: _plain(getattr(self, key)) for key in given}


def _plain(value: Any) -> Any:
    if isinstance(value, Violation):
        return value.values()
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    return float(value) if isinstance(value, Known) else value


class SupportViolation(Violation):
    """A support that is no spring and damper alike in x and y."""

    axes_angle: Angle = default(0.0, "axes horizontal and vertical")
    """Angle from horizontal to the first principal axis of stiffness and damping [rad], from x towards y."""
    stiffness_ratio: Positive = default(1.0, NO_CHANGE)
    damping_ratio: Positive = default(1.0, NO_CHANGE)
    """Factors on stiffness and damping along the first axis, which at angle zero is horizontal [1]."""
    damping: NonNegative = default(1.0, NO_CHANGE)
    """Factor on the damping along both axes [1]."""
    hardening: NonNegative = default(0.0, "a linear spring")
    """How much the spring force exceeds that of the linear spring, at the force below [1]."""
    hardening_force: PositiveForce = default(1.0, "of no effect without hardening")
    """Force of the linear spring at which that holds [N]."""
    hardening_radial: bool = False
    """Whether the whole deflection hardens both axes, instead of each axis its own."""
    slip_force: Force = default(0.0, "no friction in the support")
    """Friction that slips in the support [N]; it makes its force lag the deflection by a hysteresis."""
    slip_travel: PositiveLength = default(1e-6, "of no effect without slip")
    """Deflection over which that friction builds up [m]."""

    stop_gap: PositiveLength | None = None
    """Travel of the support up to a stop [m]."""
    stop_stiffness: Stiffness | None = None
    """Stiffness of the stop [N/m]."""
    stop_damping: NonNegative = default(0.0, "a stop without loss")
    """Damping ratio of the mass of the support on its stop [1]."""
    ribbon_stiffness: Stiffness | None = None
    """Stiffness of a ribbon before it slips [N/m]."""
    ribbon_slip: PositiveForce | None = None
    """Force at which all of it slips [N]."""

    together: ClassVar = (
        ("hardening", "hardening_force"),
        ("slip_force", "slip_travel"),
        ("stop_gap", "stop_stiffness"),
        ("ribbon_stiffness", "ribbon_slip"),
    )


class FoundationViolation(Violation):
    """A mode of the foundation on which the support stands."""

    mass: PositiveMass | None = None
    """Modal mass at the support [kg]."""
    frequency: PositiveFrequency | None = None
    """Vertical natural frequency without support [Hz]."""
    frequency_horizontal: PositiveFrequency | None = None
    """Horizontal natural frequency without support [Hz]; the vertical one when left out."""
    damping_ratio: NonNegative = default(0.03, "a bolted steel frame")
    """Damping ratio of the mode [1]."""

    together: ClassVar = (("mass", "frequency"),)

    def check(self) -> None:
        """Refuse a foundation without mass or frequency."""
        super().check()
        if self.model_fields_set and self.mass is None:
            raise Misfit("a foundation needs 'mass' and 'frequency'; add them or leave out the table")


class LawPoint(Violation):
    """A point of a contact law."""

    depth: PositiveLength
    """Indentation [m]."""
    force: PositiveForce
    """Normal force at rest [N]."""


class ContactViolation(Violation):
    """Another contact of rotor and race."""

    stiffness: Positive = default(1.0, NO_CHANGE)
    damping: NonNegative = default(1.0, NO_CHANGE)
    """Factors on contact stiffness and contact damping [1]."""
    exponent: ContactExponent | None = None
    """Another exponent [1]; equally deep at five times the mean load of a bearing."""
    law: tuple[LawPoint, ...] = ()
    """A law through these points, straight between them where both scales are logarithmic."""

    def check(self) -> None:
        """Refuse a law that falls, has too few or too many points, or a second law beside it."""
        super().check()
        if not self.law:
            return
        if self.exponent is not None:
            raise Misfit("the contact has both 'law' and 'exponent'; keep one of them", ("law",))
        if not 2 <= len(self.law) <= MOST_POINTS:
            raise Misfit(f"a law has 2 to {MOST_POINTS} points, not {len(self.law)}", ("law",))
        for key in ("depth", "force"):
            for index, (low, high) in enumerate(pairwise(float(getattr(point, key)) for point in self.law)):
                if not high > low:
                    raise Misfit(
                        f"{key} {high:g} at point {index + 2} does not exceed {low:g} before it; order the "
                        "points so that depth and force grow",
                        ("law", index + 1, key),
                    )


class RaceViolation(Violation):
    """Another race, or one that tilts under the contact force."""

    mass: Positive = default(1.0, NO_CHANGE)
    """Factor on its mass, and on its inertia with it, as of a carrier that turns along [1]."""
    inertia: Positive = default(1.0, NO_CHANGE)
    """Factor on its polar moment of inertia [1]."""
    tilt_stiffness: Stiffness | None = None
    """Stiffness of the tilt where the rotor touches, in series with the contact [N/m]."""
    tilt_frequency: PositiveFrequency | None = None
    """Natural frequency of the tilt [Hz]."""
    tilt_damping_ratio: NonNegative = default(0.02, "steel on balls")
    """Damping ratio of the tilt [1]."""

    together: ClassVar = (("tilt_stiffness", "tilt_frequency"),)


class FrictionViolation(Violation):
    """Friction outside the range the owner states, or of another shape."""

    dynamic: Positive | None = None
    """Dynamic coefficient [1]; the static one keeps its ratio to it."""
    static: Positive = default(1.0, NO_CHANGE)
    stribeck_speed: Positive = default(1.0, NO_CHANGE)
    """Factors on static coefficient and Stribeck speed [1]."""
    wear: Share = default(0.0, "no wear")
    """Share of the friction that is lost as the surfaces run in [1]."""
    wear_heat: Energy = default(1.0, "of no effect without wear")
    """Heat of friction at which 63 % of that is lost [J]."""

    together: ClassVar = (("wear", "wear_heat"),)


class GapViolation(Violation):
    """An air gap that changes during the drop."""

    drift: Length = default(0.0, "a gap that stays")
    """Change of the gap that stays [m], at an even rate within the time below."""
    drift_time: PositiveTime = default(1.0, "of no effect without drift")
    """Time it takes [s]."""
    closing: Length = default(0.0, "no growth by heat")
    """Largest closing by the heat of friction [m]; gone when all is cold again."""
    heat: Energy = default(1.0, "of no effect without closing")
    """Heat of friction that closes 63 % of it [J]."""

    together: ClassVar = (("drift", "drift_time"), ("closing", "heat"))


class BallsViolation(Violation):
    """Balls that stand elsewhere, or move on."""

    first_ball_angle: Angle | None = None
    """Where the first ball stands [rad]."""
    turn: bool = False
    """Whether the balls turn with the cage as the race spins up."""
    held_preload: bool = False
    """Whether the preload is a force that holds whatever the race does, as that of long springs."""
    inertia: bool = False
    """Whether the centrifugal force of the balls acts."""
    seat_play: Length = default(0.0, "no play")
    """Way of the bearing in its seat, from the middle, before the seat holds it [m]."""

    @property
    def tabulated(self) -> int:
        """How many of these give the balls a load of their own over the deflection of the race."""
        return self.held_preload + self.inertia + (float(self.seat_play) > 0.0)

    def check(self) -> None:
        """Refuse two of what a table holds one of."""
        super().check()
        if self.tabulated > 1:
            raise Misfit("balls have one of 'held_preload', 'inertia' and 'seat_play'; leave out the others")


class FaceViolation(Violation):
    """An axial force that no magnet holds after power-off, and the face that the rotor lands on."""

    thrust: Force = default(0.0, "none")
    """Axial force on the rotor from power-off on [N]."""
    gap: Length = default(0.0, "of no effect without thrust")
    """Way of the rotor before it lands [m]."""
    arm: PositiveLength = default(1.0, "of no effect without thrust")
    """Radius at which the face rubs [m]."""
    stiffness: Stiffness = default(1e9, "a steel shoulder on a ring, chosen")
    """Stiffness of the face [N/m]."""
    damping: NonNegative = default(0.05, "steel on steel, chosen")
    """Damping ratio of the race on it [1]."""
    friction: NonNegative = default(0.1, "as between rotor and race")
    """Friction coefficient of the face [1]."""

    together: ClassVar = (("thrust", "gap", "arm"),)


class SleeveViolation(Violation):
    """A landing sleeve on the rotor that is not round and centred."""

    eccentricity: Length = default(0.0, "centred")
    """Its centre off the axis of the rotor [m]."""
    ovality: Length = default(0.0, "round")
    """Amplitude of its radius twice per turn [m]."""
    angle: Angle = default(0.0, "as any other")
    """Angle of both from +x at rotor angle zero [rad]."""


class CentreViolation(Violation):
    """A bearing that does not stand in the line of the magnets."""

    x: Length = default(0.0, "in line")
    y: Length = default(0.0, "in line")
    """Its centre in the axes of magnets and sensors [m]."""


class BearingViolations(Violation):
    """What is violated at a touchdown bearing."""

    support: SupportViolation = SupportViolation()
    foundation: FoundationViolation = FoundationViolation()
    contact: ContactViolation = ContactViolation()
    race: RaceViolation = RaceViolation()
    friction: FrictionViolation = FrictionViolation()
    gap: GapViolation = GapViolation()
    balls: BallsViolation = BallsViolation()
    face: FaceViolation = FaceViolation()
    sleeve: SleeveViolation = SleeveViolation()
    centre: CentreViolation = CentreViolation()


class SensorViolation(Violation):
    """What is violated at a sensor."""

    time_constant: Time = default(0.0, "at once")
    """Time constant of first order with which the reading follows the shaft [s]."""
    cross_axis: CrossAxis = default(0.0, "none")
    """Reading per motion across the sensor, a quarter turn ahead of its direction [1]. For all sensors at
    once: its size, drawn between half and all of it with either sign."""
    plane_shift: Length = default(0.0, "where it is stated")
    """How much nearer to the middle of the rotor the sensor stands than stated [m]."""
    follows_housing: Share = default(0.0, "a bracket on the ground")
    """Share of the motion of the bearing's housing that the bracket of the sensor follows [1]."""
    curvature: Share = default(0.0, "a straight line")
    """Share by which it reads too little at the displacement below; it grows with the square [1]."""
    curvature_at: PositiveLength = default(1.0, "of no effect without curvature")
    """That displacement [m]."""

    together: ClassVar = (("curvature", "curvature_at"),)


class ChainViolation(SensorViolation):
    """What is violated at all sensors."""

    anti_alias_frequency: PositiveFrequency | None = None
    """Corner of a filter before the sampling that nobody mentions [Hz]."""
    flicker: Length = default(0.0, "white noise alone")
    """Noise with a power that falls as one over the frequency, beside the white one [m rms]."""
    clock_error: ClockError = default(0.0, "right")
    """How much longer the seconds of the recorder are than true ones [1]."""
    speed_delay: Time = default(0.0, "at once")
    """How late the speed signal is [s]."""


class MagnetViolation(Violation):
    """What the magnets do after power-off."""

    remanence_time: PositiveTime | None = None
    """Time constant of the remanent lift [s]."""
    remanent_lift: Lift | None = None
    """Vertical remanent lift of every magnet over its share of the weight [1]."""
    pull: Lift = default(0.0, "none")
    """Horizontal pull of every magnet at power-off, over its share of the weight, beside what remains [1]."""
    pull_time: PositiveTime = default(1.0, "of no effect without pull")
    """Time constant with which that decays [s]."""

    stays_on: tuple[Name, ...] = ()
    """Magnets that hold on while the others let go: a drop of one end, of which there is no tail."""

    together: ClassVar = (("pull", "pull_time"),)


class RotorViolation(Violation):
    """A rotor that differs from its drawing."""

    youngs_modulus: Positive = default(1.0, NO_CHANGE)
    """Factor on Young's modulus of every section [1]."""
    unbalance: Positive = default(1.0, NO_CHANGE)
    """Factor on the drawn unbalances, which may leave the grade [1]."""
    bow: Length = default(0.0, "straight")
    """How far the middle of the shaft stands off the line of its ends [m], towards +x at rotor angle zero."""
    bow_speed: PositiveFrequency = default(1.0, "of no effect without bow")
    """Speed [Hz] at which it bends as a bowed shaft does. It goes with the square of the speed, as an
    unbalance, so that it is exact there only."""

    together: ClassVar = (("bow", "bow_speed"),)


class StandViolation(Violation):
    """How the machine stands."""

    tilt: Angle = default(0.0, "level")
    """Angle by which it is turned about its axis [rad]: gravity has a part towards +x."""


class SideForce(Violation):
    """A force on the rotor that stays, as of a belt or of the pressure round an impeller."""

    node: Node
    """Node it acts at, counted from 1."""
    force: Force
    """Force [N]."""
    direction: Angle = default(0.0, "horizontal")
    """Its direction, from +x towards y [rad]."""
    growth: Share = default(0.0, "a force that stays")
    """Share by which it grows at an even rate from power-off on [1]."""
    growth_time: PositiveTime = default(1.0, "of no effect without growth")
    """Time it takes [s]."""

    together: ClassVar = (("growth", "growth_time"),)


class Seal(Violation):
    """A seal that the rotor rubs on."""

    node: Node
    """Node it sits at, counted from 1."""
    gap: AboveOne
    """Its gap over the widest air gap of the touchdown bearings [1]."""
    stiffness: Stiffness
    """Stiffness of its housing [N/m]."""


class UnbalanceJump(Violation):
    """Something comes off the rotor during the drop."""

    node: Node
    """Node of the new unbalance, counted from 1."""
    amount: Unbalance
    """Amount [kg m]."""
    phase: Angle = default(0.0, "as any other")
    """Phase, counted from +y at rotor angle zero [rad]."""
    time: Time | None = None
    """When, from power-off [s]; at the first contact when left out."""


class Violations(BearingViolations):
    """What is true of the hidden machine and unknown to the estimator."""

    bearing: dict[Name, BearingViolations] = Field(default_factory=dict)
    """At one touchdown bearing, before what is said for all."""
    sensors: ChainViolation = ChainViolation()
    sensor: dict[Channel, SensorViolation] = Field(default_factory=dict)
    """At one sensor, before what is said for all."""
    magnets: MagnetViolation = MagnetViolation()
    rotor: RotorViolation = RotorViolation()
    stand: StandViolation = StandViolation()
    unbalance_jump: UnbalanceJump | None = None
    side_force: SideForce | None = None
    seal: Seal | None = None

    def of_bearing(self, name: str) -> BearingViolations:
        """What holds at one bearing: what is said of it, then what is said of all."""
        every = {key: getattr(self, key) for key in BearingViolations.model_fields}
        own = self.bearing.get(name)
        return BearingViolations(
            **{key: _over(part, own and getattr(own, key)) for key, part in every.items()}
        )

    def of_sensor(self, name: str) -> SensorViolation:
        """What holds at one sensor: what is said of it, then what is said of all."""
        said = self.sensors.model_fields_set & SensorViolation.model_fields.keys()
        every = SensorViolation(**{key: getattr(self.sensors, key) for key in said})
        found: SensorViolation = _over(every, self.sensor.get(name))
        return found

    def check_names(self, machine: Machine) -> None:
        """Refuse names of bearings and sensors that the machine does not have, and a node outside it."""
        for what, named, there in (
            ("bearing", self.bearing, [b.name for b in machine.touchdown_bearings]),
            ("sensor", self.sensor, [s.name for s in machine.sensors]),
        ):
            if missing := [name for name in named if name not in there]:
                raise UsageError(
                    f"the violations name the {what} {missing[0]!r}, which the machine does not have; "
                    f"it has {', '.join(there)}"
                )
        landing = [b.name for b in machine.touchdown_bearings if float(self.of_bearing(b.name).face.thrust)]
        if len(landing) > 1:
            raise UsageError(
                f"the violations have a thrust at {' and '.join(landing)}; the rotor lands on one face: give "
                f"'face' to one of them, as bearing.{landing[0]}.face"
            )
        nodes = len(machine.rotor.node_positions)
        placed = {
            "unbalance comes": self.unbalance_jump,
            "side force acts": self.side_force,
            "seal sits": self.seal,
        }
        for what, part in placed.items():
            if part is not None and part.node > nodes:
                raise UsageError(
                    f"the {what} at node {part.node}, outside the rotor; its nodes are 1 to {nodes}"
                )


def _over(every: Any, own: Any) -> Any:
    """Violations of one part: its own values before those of all parts."""
    if own is None:
        return every
    return type(every)(**{key: getattr(one, key) for one in (every, own) for key in one.model_fields_set})


VIOLATIONS: dict[str, Violations] = {
    name: Violations.model_validate(parts)
    for name, parts in {
        "none": {},
        "contact stiffness +25 %": {"contact": {"stiffness": 1.25}},
        "contact stiffness -25 %": {"contact": {"stiffness": 0.75}},
        "contact exponent 1.5": {"contact": {"exponent": 1.5}},
        "contact damping +50 %": {"contact": {"damping": 1.5}},
        "race inertia +25 %": {"race": {"inertia": 1.25}},
        "race inertia -25 %": {"race": {"inertia": 0.75}},
        "sharper friction": {"friction": {"stribeck_speed": 0.2, "static": 1.3}},
        "anisotropic support 0.6": {"support": {"stiffness_ratio": 0.6}},
        "sensor planes 30 mm off": {"sensors": {"plane_shift": "30 mm"}},
        "anti-alias filter": {"sensors": {"anti_alias_frequency": "4 kHz"}},
    }.items()
}


def load_violations(path: str | os.PathLike[str]) -> Violations:
    """Read violations from a TOML file; every refusal says where and what to do."""
    return load_description(Violations, Path(path))


def violations_schema() -> dict[str, Any]:
    """Give the JSON Schema (draft 2020-12) of a file of violations."""
    return description_schema(Violations, "rotordrop violations of a hidden machine")


def named_violations(choice: str | Violations) -> Violations:
    """The violations of a name or of a case file (.toml), or the violations themselves."""
    if isinstance(choice, Violations):
        return choice
    if choice.endswith(".toml"):
        return load_violations(choice)
    if choice not in VIOLATIONS:
        raise UsageError(
            f"unknown violation {choice!r}; choose one of {', '.join(map(repr, VIOLATIONS))}, or give a "
            ".toml file"
        )
    return VIOLATIONS[choice]
