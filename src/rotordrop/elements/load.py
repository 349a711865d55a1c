"""What pushes the rotor beside gravity: forces at a node, and the motion of the ground under the machine."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.description import Description, Misfit, Placed
from rotordrop.elements.parameter import Entry, Extension, Parameter, Values, in_words, itself, of_one_unknown
from rotordrop.elements.values import Angle, Force, NonNegative, Physical, Time, default
from rotordrop.known import NINETY, Known
from rotordrop.physics import columns as L

SignedForce = Annotated[Known, Physical("force")]
SignedAcceleration = Annotated[Known, Physical("acceleration")]
Frequency = Annotated[Known, Physical("frequency", above=0.0)]

AXIAL = "an axial acceleration of the ground"
_NOT_ESTIMATED = (
    ": the fall before the first contact is taken as one under gravity alone. Leave it out to estimate "
    "without it; simulations and studies know it"
)


DIRECTIONS = (
    'write "axial" (along the axis, towards higher nodes), "-axial" (towards lower ones), or across it an '
    'angle from +x towards y, such as "-90 deg"'
)


class LoadPoint(Description):
    """A load at a time."""

    time: Time
    """Time from power-off [s]."""
    force: Force
    """Force then [N]."""


class Load(Placed):
    """A force on the rotor, from before the release on."""

    direction: Angle | None = None
    """Direction of the force, from +x towards y [rad]; or "axial", towards higher nodes, or "-axial"."""
    along: Literal["axial", "-axial"] | None = None
    """Sense along the axis, where the direction was given so."""
    force: SignedForce | None = None
    """Force [N], against the direction where it is negative; with an exponent that at nominal speed."""
    speed_exponent: NonNegative = default(0.0, "the same at every speed")
    """Power of the speed with which the force goes [1]."""
    over_time: tuple[LoadPoint, ...] = ()
    """In place of the force: its course, straight between points, constant before and after them."""

    written_as: ClassVar[Mapping[str, str]] = {"along": "direction"}

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Read a direction along the axis."""
        said = raw.get("direction")
        if said in ("axial", "-axial"):
            raw["along"] = raw.pop("direction")
        elif isinstance(said, str) and not re.search(r"\d", said):
            raise Misfit(f"{said!r} is no direction; {DIRECTIONS}", ("direction",))
        return raw

    def check(self) -> None:
        """Refuse a load without direction or force or with two, and a course that does not go on."""
        super().check()
        if (self.direction is None) == (self.along is None):
            raise Misfit(f"a load needs a 'direction'; {DIRECTIONS}")
        if (self.force is None) == (not self.over_time):
            raise Misfit("a load needs either 'force' or 'over_time', and only one of them")
        if self.over_time and "speed_exponent" in self.model_fields_set:
            raise Misfit("a course over time does not go with the speed; leave out one", ("speed_exponent",))
        check_times(self.over_time)

    @property
    def unit(self) -> tuple[float, float]:
        """Its direction across the axis, x and y; that of an axial load stands in the place of x."""
        if self.along is not None:
            return self.sense, 0.0
        return math.cos(float(self.direction or 0.0)), math.sin(float(self.direction or 0.0))

    @property
    def sense(self) -> float:
        """Sense along the axis, 1 towards higher nodes or -1; zero across it."""
        return {None: 0.0, "axial": 1.0, "-axial": -1.0}[self.along]

    def course(self, nominal: float) -> tuple[Array, Array]:
        """Entries of the load and the points of its course, shape (R, 3): time [s], force in x and y [N].

        That of an axial load stands in the place of x.
        """
        row, (c, s) = np.zeros(L.N_LOAD_COLUMNS), self.unit
        row[L.LOAD_AXIAL] = float(self.along is not None)
        points = np.array([[float(p.time), c * float(p.force), s * float(p.force)] for p in self.over_time])
        if self.force is not None:
            row[[L.LOAD_X, L.LOAD_Y]] = c * float(self.force), s * float(self.force)
            row[[L.LOAD_EXPONENT, L.LOAD_NOMINAL]] = float(self.speed_exponent), nominal
        return row, points.reshape(-1, 3)


class BasePoint(Description):
    """Acceleration of the ground at a time."""

    time: Time
    """Time from power-off [s]."""
    x: SignedAcceleration = default(0.0, "none")
    y: SignedAcceleration = default(0.0, "none")
    """Horizontal and vertical acceleration [m/s²]."""

    reserved: ClassVar = {"z": AXIAL}


class Base(Description):
    """Acceleration of the ground on which the machine stands, from before the release on."""

    x: SignedAcceleration = default(0.0, "none")
    y: SignedAcceleration = default(0.0, "none")
    """Amplitude of a sine [m/s²], horizontal and vertical."""
    frequency: Frequency | None = None
    """Its frequency [Hz]."""
    phase: Angle = default(0.0, "zero at power-off, upwards after it")
    """Its phase at power-off [rad]."""
    over_time: tuple[BasePoint, ...] = ()
    """In place of a sine: its course, straight between points, constant before and after them."""

    reserved: ClassVar = {"z": AXIAL}

    def check(self) -> None:
        """Refuse neither or both of sine and course."""
        sine = self.model_fields_set - {"over_time"}
        if bool(sine) == bool(self.over_time):
            raise Misfit("a base needs either a sine ('x' or 'y' with 'frequency') or 'over_time', not both")
        if sine and (self.frequency is None or not sine & {"x", "y"}):
            raise Misfit("the sine of a base needs 'frequency' and an amplitude, 'x' or 'y'")
        check_times(self.over_time)

    @property
    def beyond_estimates(self) -> tuple[str, str]:
        """It acts during the fall."""
        return "has [base]", _NOT_ESTIMATED

    def course(self) -> tuple[Array, Array]:
        """Entries of the base as a load, and the points of its course, shape (R, 3) [s], [m/s²]."""
        row = np.zeros(L.N_LOAD_COLUMNS)
        row[L.LOAD_OF_BASE] = 1.0
        points = np.array([[float(p.time), float(p.x), float(p.y)] for p in self.over_time]).reshape(-1, 3)
        if self.frequency is not None:
            row[[L.LOAD_X, L.LOAD_Y]] = float(self.x), float(self.y)
            row[[L.LOAD_TURN, L.LOAD_PHASE]] = 2.0 * math.pi * float(self.frequency), float(self.phase)
        return row, points


def check_times(points: tuple[LoadPoint, ...] | tuple[BasePoint, ...]) -> None:
    """Refuse points whose times do not ascend."""
    for index in range(1, len(points)):
        before, time = float(points[index - 1].time), float(points[index].time)
        if not time > before:
            raise Misfit(
                f"time {time:g} s of point {index + 1} does not exceed {before:g} s before it; order them",
                ("over_time", index, "time"),
            )


def _pushed(_machine: Any, found: Values, _load: float) -> str:
    share, low, high = itself(found["side_force"])
    push = in_words((share, low, high), "% of the weight", 0.01)
    lean = in_words((math.atan(share), math.atan(low), math.atan(high)), "deg", math.pi / 180.0)
    less = 100.0 * (1.0 - math.cos(math.atan(share)))  # of a weight that then points aside
    return (
        f"a steady force in +x of {push}, or a machine out of level by {lean}, all forces {less:.1f} % less"
    )


STATED: tuple[Parameter, ...] = (
    Parameter(
        path="force",
        owner="load",
        label="force",
        kind="force",
        logarithmic=False,
        # who gives a guess without a range knows the direction and little else: half the weight either way
        guess_sigma=0.5 / NINETY,
        given_sigma=2e-3,
        scale="the weight of the rotor",
        measured_by="the load of the process at the time of the drop",
        entries=(Entry(array="load", column=L.LOAD_X), Entry(array="load", column=L.LOAD_Y)),
    ),
)
"""Unknowns of a load across the axis, of a machine that has it."""

EXTENSIONS: tuple[Extension, ...] = (
    of_one_unknown(
        Parameter(
            path="side_force",
            owner="drop",
            label="steady side force over the weight",
            kind="dimensionless",
            logarithmic=False,
            # belts, couplings and pumps push with up to a few tenths of the weight (chosen)
            guess_sigma=0.1,
            given_sigma=2e-3,
            lower=-1.0,
            upper=1.0,
            measured_by="a level on the machine, and the load of the process",
            entries=(Entry(array="spin", column=L.SIDE_FORCE),),
        ),
        "side force",
        0.0,
        _pushed,
    ),
)
