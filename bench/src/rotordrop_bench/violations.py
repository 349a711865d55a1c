"""Ways in which a hidden machine breaks what an estimator takes for granted, by name or from a case file."""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field

from rotordrop.arrays import Array
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
from rotordrop_bench import departure as D

CrossAxis = Annotated[Known, Physical("dimensionless", least=-0.5, most=0.5)]
Lift = Annotated[Known, Physical("dimensionless", least=0.0, most=0.95)]
ClockError = Annotated[Known, Physical("dimensionless", least=-0.1, most=0.1)]
AboveOne = Annotated[Known, Physical("dimensionless", above=1.0)]
Energy = Annotated[Known, Physical("energy", above=0.0)]
MOST_POINTS = D.MOST_PIECES + 1
"""Points of a contact law."""


def key(value: Any, meaning: str) -> Any:
    """Give a key the value at which nothing is violated [SI], and what it is."""
    return default(value, meaning) if isinstance(value, float) else Field(default=value, description=meaning)


class Violation(Description):
    """One group of violations; what is left out is as the machine has it."""

    together: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Keys of which none says anything without the others, nor where the first is zero."""

    def check(self) -> None:
        """Refuse half of what belongs together."""
        for group in self.together:
            given = [key for key in group if key in self.model_fields_set]
            missing = [key for key in group if key not in self.model_fields_set]
            if given and missing:
                words = f"{given[0]!r} needs {missing[0]!r} beside it; add it or leave out both"
                raise Misfit(words, (given[0],))

    def fill(self, row: Array) -> None:
        """Write the columns of a departure that are of any effect."""
        still = [group for group in self.together if float(getattr(self, group[0]) or 0.0) == 0.0]
        for key, column in self.columns.items():
            if not any(key in group for group in still):
                row[column] = float(getattr(self, key))

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

    axes_angle: Angle = key(0.0, "from horizontal to the first principal axis, from x towards y [rad]")
    stiffness_ratio: Positive = key(1.0, "factor on the stiffness along the first axis [1]")
    damping_ratio: Positive = key(1.0, "factor on the damping along the first axis [1]")
    damping: NonNegative = key(1.0, "factor on the damping along both axes [1]")
    hardening: NonNegative = key(0.0, "by how much the spring exceeds a linear one at the force below [1]")
    hardening_force: PositiveForce = key(1.0, "force of the linear spring at which that holds [N]")
    hardening_radial: bool = key(False, "the whole deflection hardens both axes, instead of each its own")
    slip_force: Force = key(0.0, "friction that slips in the support: a hysteresis [N]")
    slip_travel: PositiveLength = key(1.0, "deflection over which that friction builds up [m]")

    together: ClassVar = (("hardening", "hardening_force"), ("slip_force", "slip_travel"))
    columns: ClassVar = {"slip_force": D.SLIP_FORCE, "slip_travel": D.SLIP_TRAVEL}


class FoundationViolation(Violation):
    """A mode of the foundation on which the support stands."""

    mass: PositiveMass | None = key(None, "modal mass at the support [kg]")
    frequency: PositiveFrequency | None = key(None, "vertical natural frequency without support [Hz]")
    frequency_horizontal: PositiveFrequency | None = key(None, "the same horizontally; as vertically [Hz]")
    damping_ratio: NonNegative = key(0.03, "damping ratio of the mode; of a bolted steel frame [1]")

    together: ClassVar = (("mass", "frequency"),)

    def check(self) -> None:
        """Refuse a foundation without mass or frequency."""
        super().check()
        if self.model_fields_set and self.mass is None:
            raise Misfit("a foundation needs 'mass' and 'frequency'; add them or leave out the table")


class LawPoint(Violation):
    """A point of a contact law."""

    depth: PositiveLength = key(..., "indentation [m]")
    force: PositiveForce = key(..., "normal force at rest [N]")


class ContactViolation(Violation):
    """Another contact of rotor and race."""

    stiffness: Positive = key(1.0, "factor on the contact stiffness [1]")
    damping: NonNegative = key(1.0, "factor on the contact damping [1]")
    exponent: ContactExponent | None = key(
        None, "another exponent, equally deep at five times the mean load [1]"
    )
    law: tuple[LawPoint, ...] = key((), "points of a law, straight between them where both scales are log")

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

    mass: Positive = key(1.0, "factor on its mass and inertia, as of a carrier that turns along [1]")
    inertia: Positive = key(1.0, "factor on its polar moment of inertia [1]")
    tilt_stiffness: Stiffness | None = key(
        None, "stiffness of the tilt where the rotor touches, in series with the contact [N/m]"
    )
    tilt_frequency: PositiveFrequency | None = key(None, "natural frequency of the tilt [Hz]")
    tilt_damping_ratio: NonNegative = key(0.02, "damping ratio of the tilt; of steel on balls [1]")

    together: ClassVar = (("tilt_stiffness", "tilt_frequency"),)


class FrictionViolation(Violation):
    """Friction outside the range the owner states, or of another shape."""

    dynamic: Positive | None = key(None, "dynamic coefficient; the static one keeps its ratio to it [1]")
    static: Positive = key(1.0, "factor on the static coefficient [1]")
    stribeck_speed: Positive = key(1.0, "factor on the Stribeck speed [1]")
    wear: Share = key(0.0, "share of the friction that is lost as the surfaces run in [1]")
    wear_heat: Energy = key(1.0, "heat of friction at which 63 % of that is lost [J]")

    together: ClassVar = (("wear", "wear_heat"),)
    columns: ClassVar = {"wear": D.WEAR, "wear_heat": D.WEAR_HEAT}


class GapViolation(Violation):
    """An air gap that changes during the drop."""

    drift: Length = key(0.0, "change of the gap that stays, at an even rate within the time below [m]")
    drift_time: PositiveTime = key(1.0, "time it takes [s]")
    closing: Length = key(0.0, "largest closing by the heat of friction, gone when all is cold again [m]")
    heat: Energy = key(1.0, "heat of friction that closes 63 % of it [J]")

    together: ClassVar = (("drift", "drift_time"), ("closing", "heat"))
    columns: ClassVar = {
        "drift": D.GAP_DRIFT,
        "drift_time": D.GAP_DRIFT_TIME,
        "closing": D.GAP_CLOSING,
        "heat": D.GAP_HEAT,
    }


class BallsViolation(Violation):
    """Balls that stand elsewhere, or move on."""

    first_ball_angle: Angle | None = key(None, "where the first ball stands [rad]")
    turn: bool = key(False, "the balls turn with the cage as the race spins up")
    seat_play: Length = key(0.0, "way of the bearing in its seat, from the middle, before it holds [m]")

    columns: ClassVar = {"seat_play": D.LOOSE_WAY}


class SleeveViolation(Violation):
    """A landing sleeve on the rotor that is not round and centred."""

    eccentricity: Length = key(0.0, "its centre off the axis of the rotor [m]")
    ovality: Length = key(0.0, "amplitude of its radius twice per turn [m]")
    angle: Angle = key(0.0, "of both from +x at rotor angle zero [rad]")

    columns: ClassVar = {"eccentricity": D.SLEEVE_OFF, "ovality": D.SLEEVE_OVAL, "angle": D.SLEEVE_ANGLE}


class CentreViolation(Violation):
    """A bearing that does not stand in the line of the magnets."""

    x: Length = key(0.0, "its centre in the axes of magnets and sensors [m]")
    y: Length = key(0.0, "its centre in the axes of magnets and sensors [m]")

    columns: ClassVar = {"x": D.CENTRE_X, "y": D.CENTRE_Y}


class BearingViolations(Violation):
    """What is violated at a touchdown bearing."""

    support: SupportViolation = SupportViolation()
    foundation: FoundationViolation = FoundationViolation()
    contact: ContactViolation = ContactViolation()
    race: RaceViolation = RaceViolation()
    friction: FrictionViolation = FrictionViolation()
    gap: GapViolation = GapViolation()
    balls: BallsViolation = BallsViolation()
    sleeve: SleeveViolation = SleeveViolation()
    centre: CentreViolation = CentreViolation()


class SensorViolation(Violation):
    """What is violated at a sensor."""

    time_constant: Time = key(0.0, "time constant of first order with which it follows the shaft [s]")
    cross_axis: CrossAxis = key(
        0.0,
        "reading per motion a quarter turn ahead of its direction [1]; of all sensors at once the size, "
        "drawn between half and all of it with either sign",
    )
    plane_shift: Length = key(0.0, "how much nearer to the middle of the rotor it stands than stated [m]")
    follows_housing: Share = key(0.0, "share of the motion of the housing that its bracket follows [1]")
    curvature: Share = key(0.0, "share by which it reads too little at the displacement below, squared [1]")
    curvature_at: PositiveLength = key(1.0, "that displacement [m]")

    together: ClassVar = (("curvature", "curvature_at"),)


class ChainViolation(SensorViolation):
    """What is violated at all sensors."""

    anti_alias_frequency: PositiveFrequency | None = key(
        None, "corner of a filter before the sampling that nobody mentions [Hz]"
    )
    flicker: Length = key(0.0, "noise whose power falls as one over the frequency, beside the white [m rms]")
    clock_error: ClockError = key(0.0, "how much longer seconds of the recorder are than true ones [1]")
    speed_delay: Time = key(0.0, "how late the speed signal is [s]")


class MagnetViolation(Violation):
    """What the magnets do after power-off."""

    remanence_time: PositiveTime | None = key(None, "time constant of the remanent lift [s]")
    remanent_lift: Lift | None = key(None, "vertical remanent lift of all over their share of the weight [1]")
    pull: Lift = key(0.0, "horizontal pull of all at power-off over their share of the weight, besides [1]")
    pull_time: PositiveTime = key(1.0, "time constant with which that decays [s]")
    stays_on: tuple[Name, ...] = key((), "magnets that hold on: a drop of one end, of which there is no tail")

    together: ClassVar = (("pull", "pull_time"),)


class RotorViolation(Violation):
    """A rotor that differs from its drawing."""

    youngs_modulus: Positive = key(1.0, "factor on Young's modulus of every section [1]")
    unbalance: Positive = key(1.0, "factor on the drawn unbalances, which may leave the grade [1]")
    bow: Length = key(0.0, "middle of the shaft off the line of its ends, towards +x at rotor angle zero [m]")
    bow_speed: PositiveFrequency = key(
        1.0, "speed at which it bends as a bowed shaft does; elsewhere it goes as an unbalance [Hz]"
    )

    together: ClassVar = (("bow", "bow_speed"),)


class StandViolation(Violation):
    """How the machine stands."""

    tilt: Angle = key(0.0, "by which it is turned about its axis: gravity has a part towards +x [rad]")


class SideForce(Violation):
    """A force on the rotor that stays, as of a belt or of the pressure round an impeller."""

    node: Node = key(..., "node it acts at, counted from 1")
    force: Force = key(..., "force [N]")
    direction: Angle = key(0.0, "its direction, from +x towards y [rad]")


class Seal(Violation):
    """A seal that the rotor rubs on."""

    node: Node = key(..., "node it sits at, counted from 1")
    gap: AboveOne = key(..., "its gap over the widest air gap of the touchdown bearings [1]")
    stiffness: Stiffness = key(..., "stiffness of its housing [N/m]")


class UnbalanceJump(Violation):
    """Something comes off the rotor during the drop."""

    node: Node = key(..., "node of the new unbalance, counted from 1")
    amount: Unbalance = key(..., "amount [kg m]")
    phase: Angle = key(0.0, "phase, counted from +y at rotor angle zero [rad]")
    time: Time | None = key(None, "when, from power-off; at the first contact when left out [s]")


class Violations(BearingViolations):
    """What is true of the hidden machine and unknown to the estimator."""

    bearing: dict[Name, BearingViolations] = key({}, "at one touchdown bearing, before what all have")
    sensors: ChainViolation = ChainViolation()
    sensor: dict[Channel, SensorViolation] = key({}, "at one sensor, before what all have")
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
