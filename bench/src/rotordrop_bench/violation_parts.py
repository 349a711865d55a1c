"""What can be violated at a bearing, a sensor, the magnets and the rotor; units and limits of each."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field

from rotordrop.elements.description import Description, Misfit, Node
from rotordrop.elements.values import (
    Angle,
    ContactExponent,
    Force,
    Length,
    Physical,
    Positive,
    PositiveForce,
    PositiveLength,
    PositiveMass,
    PositiveTime,
    Stiffness,
    Time,
    Unbalance,
    default,
)
from rotordrop.known import Known

Share = Annotated[Known, Physical("dimensionless", least=0.0, most=1.0)]
CrossAxis = Annotated[Known, Physical("dimensionless", least=-0.5, most=0.5)]
Lift = Annotated[Known, Physical("dimensionless", least=0.0, most=0.95)]
Frequency = Annotated[Known, Physical("frequency", above=0.0)]
Energy = Annotated[Known, Physical("energy", above=0.0)]
NonNegativeNumber = Annotated[Known, Physical("dimensionless", least=0.0)]
MOST_POINTS = 9
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
                raise Misfit(
                    f"{given[0]!r} needs {missing[0]!r} beside it; add it or leave out both", (given[0],)
                )

    def values(self) -> dict[str, Any]:
        """What was given, by key [SI]."""
        return {
            key: _plain(getattr(self, key)) for key in type(self).model_fields if key in self.model_fields_set
        }


def _plain(value: Any) -> Any:
    if isinstance(value, Violation):
        return value.values()
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    return float(value) if isinstance(value, Known) else value


class SupportViolation(Violation):
    """A support that is no spring and damper alike in x and y.

    Attributes
    ----------
    axes_angle : Known
        Angle from horizontal to the first principal axis of stiffness and damping [rad], from x towards y.
    stiffness_ratio, damping_ratio : Known
        Factors on stiffness and damping along the first axis, which at angle zero is horizontal [1].
    damping : Known
        Factor on the damping along both axes [1].
    hardening : Known
        How much the spring force exceeds that of the linear spring, at the force below [1].
    hardening_force : Known
        Force of the linear spring at which that holds [N].
    hardening_radial : bool
        Whether the whole deflection hardens both axes, instead of each axis its own.
    slip_force : Known
        Friction that slips in the support [N]; it makes its force lag the deflection by a hysteresis.
    slip_travel : Known
        Deflection over which that friction builds up [m].
    """

    axes_angle: Angle = default(0.0, "axes horizontal and vertical")
    stiffness_ratio: Positive = default(1.0, NO_CHANGE)
    damping_ratio: Positive = default(1.0, NO_CHANGE)
    damping: NonNegativeNumber = default(1.0, NO_CHANGE)
    hardening: NonNegativeNumber = default(0.0, "a linear spring")
    hardening_force: PositiveForce = default(1.0, "of no effect without hardening")
    hardening_radial: bool = False
    slip_force: Force = default(0.0, "no friction in the support")
    slip_travel: PositiveLength = default(1e-6, "of no effect without slip")

    together: ClassVar = (("hardening", "hardening_force"), ("slip_force", "slip_travel"))


class FoundationViolation(Violation):
    """A mode of the foundation on which the support stands.

    Attributes
    ----------
    mass : Known
        Modal mass at the support [kg].
    frequency, frequency_horizontal : Known
        Natural frequency without support, vertical and horizontal [Hz].
    damping_ratio : Known
        Damping ratio of the mode [1].
    """

    mass: PositiveMass | None = None
    frequency: Frequency | None = None
    frequency_horizontal: Frequency | None = Field(
        default=None, description="When left out: the vertical one"
    )
    damping_ratio: NonNegativeNumber = default(0.03, "a bolted steel frame")

    together: ClassVar = (("mass", "frequency"),)

    def check(self) -> None:
        """Refuse a foundation without mass or frequency."""
        super().check()
        if self.model_fields_set and self.mass is None:
            raise Misfit("a foundation needs 'mass' and 'frequency'; add them or leave out the table")


class LawPoint(Violation):
    """A point of a contact law.

    Attributes
    ----------
    depth : Known
        Indentation [m].
    force : Known
        Normal force at rest [N].
    """

    depth: PositiveLength
    force: PositiveForce


class ContactViolation(Violation):
    """Another contact of rotor and race.

    Attributes
    ----------
    stiffness, damping : Known
        Factors on contact stiffness and contact damping [1].
    exponent : Known, optional
        Another exponent [1]; equally deep at five times the mean load of a bearing.
    law : tuple of LawPoint
        A law through these points, straight between them where both scales are logarithmic.
    """

    stiffness: Positive = default(1.0, NO_CHANGE)
    damping: NonNegativeNumber = default(1.0, NO_CHANGE)
    exponent: ContactExponent | None = None
    law: tuple[LawPoint, ...] = ()

    def check(self) -> None:
        """Refuse a law that falls, has too few or too many points, or a second law beside it."""
        super().check()
        if not self.law:
            return
        if self.exponent is not None:
            raise Misfit("the contact has both 'law' and 'exponent'; keep one of them", ("law",))
        if not 2 <= len(self.law) <= MOST_POINTS:
            raise Misfit(f"a law has 2 to {MOST_POINTS} points, not {len(self.law)}", ("law",))
        for index in range(1, len(self.law)):
            for key in ("depth", "force"):
                low, high = (float(getattr(self.law[i], key)) for i in (index - 1, index))
                if not high > low:
                    raise Misfit(
                        f"{key} {high:g} at point {index + 1} does not exceed {low:g} before it; order the "
                        "points so that depth and force grow",
                        ("law", index, key),
                    )


class RaceViolation(Violation):
    """Another race, or one that tilts under the contact force.

    Attributes
    ----------
    inertia : Known
        Factor on its polar moment of inertia [1].
    tilt_stiffness : Known, optional
        Stiffness of the tilt where the rotor touches, in series with the contact [N/m].
    tilt_frequency : Known, optional
        Natural frequency of the tilt [Hz].
    tilt_damping_ratio : Known
        Damping ratio of the tilt [1].
    """

    inertia: Positive = default(1.0, NO_CHANGE)
    tilt_stiffness: Stiffness | None = None
    tilt_frequency: Frequency | None = None
    tilt_damping_ratio: NonNegativeNumber = default(0.02, "steel on balls")

    together: ClassVar = (("tilt_stiffness", "tilt_frequency"),)


class FrictionViolation(Violation):
    """Friction outside the range the owner states, or of another shape.

    Attributes
    ----------
    dynamic : Known, optional
        Dynamic coefficient [1]; the static one keeps its ratio to it.
    static, stribeck_speed : Known
        Factors on static coefficient and Stribeck speed [1].
    """

    dynamic: Positive | None = None
    static: Positive = default(1.0, NO_CHANGE)
    stribeck_speed: Positive = default(1.0, NO_CHANGE)


class GapViolation(Violation):
    """An air gap that changes during the drop.

    Attributes
    ----------
    drift : Known
        Change of the gap that stays [m], at an even rate within the time below.
    drift_time : Known
        Time it takes [s].
    closing : Known
        Largest closing by the heat of friction [m]; gone when all is cold again.
    heat : Known
        Heat of friction that closes 63 % of it [J].
    """

    drift: Length = default(0.0, "a gap that stays")
    drift_time: PositiveTime = default(1.0, "of no effect without drift")
    closing: Length = default(0.0, "no growth by heat")
    heat: Energy = default(1.0, "of no effect without closing")

    together: ClassVar = (("drift", "drift_time"), ("closing", "heat"))


class BallsViolation(Violation):
    """Balls that stand elsewhere, or move on.

    Attributes
    ----------
    first_ball_angle : Known, optional
        Where the first ball stands [rad].
    turn : bool
        Whether the balls turn with the cage as the race spins up.
    """

    first_ball_angle: Angle | None = None
    turn: bool = False


class CentreViolation(Violation):
    """A bearing that does not stand in the line of the magnets.

    Attributes
    ----------
    x, y : Known
        Its centre in the axes of magnets and sensors [m].
    """

    x: Length = default(0.0, "in line")
    y: Length = default(0.0, "in line")


class BearingViolations(Violation):
    """What is violated at a touchdown bearing.

    Attributes
    ----------
    support : SupportViolation
        Its support.
    foundation : FoundationViolation
        The foundation under the support.
    contact : ContactViolation
        Contact of rotor and race.
    race : RaceViolation
        The race.
    friction : FrictionViolation
        Friction of rotor and race.
    gap : GapViolation
        The air gap.
    balls : BallsViolation
        The balls.
    centre : CentreViolation
        Its centre.
    """

    support: SupportViolation = SupportViolation()
    foundation: FoundationViolation = FoundationViolation()
    contact: ContactViolation = ContactViolation()
    race: RaceViolation = RaceViolation()
    friction: FrictionViolation = FrictionViolation()
    gap: GapViolation = GapViolation()
    balls: BallsViolation = BallsViolation()
    centre: CentreViolation = CentreViolation()


class SensorViolation(Violation):
    """What is violated at a sensor.

    Attributes
    ----------
    time_constant : Known
        Time constant of first order with which the reading follows the shaft [s].
    cross_axis : Known
        Reading per motion across the sensor, a quarter turn ahead of its direction [1]. For all sensors at
        once: its size, drawn between half and all of it with either sign.
    plane_shift : Known
        How much nearer to the middle of the rotor the sensor stands than stated [m].
    follows_housing : Known
        Share of the motion of the bearing's housing that the bracket of the sensor follows [1].
    """

    time_constant: Time = default(0.0, "at once")
    cross_axis: CrossAxis = default(0.0, "none")
    plane_shift: Length = default(0.0, "where it is stated")
    follows_housing: Share = default(0.0, "a bracket on the ground")


class ChainViolation(SensorViolation):
    """What is violated at all sensors.

    Attributes
    ----------
    time_constant, cross_axis, plane_shift, follows_housing : Known
        As of one sensor.
    anti_alias_frequency : Known, optional
        Corner of a filter before the sampling that nobody mentions [Hz].
    """

    anti_alias_frequency: Frequency | None = None


class MagnetViolation(Violation):
    """What the magnets do after power-off.

    Attributes
    ----------
    remanence_time : Known, optional
        Time constant of the remanent lift [s].
    remanent_lift : Known, optional
        Vertical remanent lift of every magnet over its share of the weight [1].
    """

    remanence_time: PositiveTime | None = None
    remanent_lift: Lift | None = None


class RotorViolation(Violation):
    """A rotor that differs from its drawing.

    Attributes
    ----------
    youngs_modulus : Known
        Factor on Young's modulus of every section [1].
    unbalance : Known
        Factor on the drawn unbalances, which may leave the grade [1].
    """

    youngs_modulus: Positive = default(1.0, NO_CHANGE)
    unbalance: Positive = default(1.0, NO_CHANGE)


class UnbalanceJump(Violation):
    """Something comes off the rotor during the drop.

    Attributes
    ----------
    node : int
        Node of the new unbalance, counted from 1.
    amount : Known
        Amount [kg m].
    phase : Known
        Phase, counted from +y at rotor angle zero [rad].
    time : Known, optional
        When, from power-off [s]; at the first contact when left out.
    """

    node: Node
    amount: Unbalance
    phase: Angle = default(0.0, "as any other")
    time: Time | None = None
