"""What every kind of touchdown bearing describes: how its race fits and weighs, what looks odd in it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.description import Description, Text
from rotordrop.known import Known
from rotordrop.physics import ring
from rotordrop.physics.hertz import LineContact, compliance, cylinder_in_bore

if TYPE_CHECKING:
    from rotordrop.elements.race import Race
    from rotordrop.elements.touchdown_bearing import TouchdownBearing
    from rotordrop.physics.ball_table import BallTable

Oddity = tuple[str, float, float, str]
"""Name of an entry, its value and the limit it is compared with [SI], and what to say."""


class RaceBearing(Description):
    """The bearing that carries the race of a touchdown bearing, of whatever kind.

    The numbers that follow from it are its `BearingNumbers`.
    """

    designation: Text | None = None
    """What its maker calls it."""

    no_race: ClassVar[str] = ""
    """Why no table 'race' goes with it, where none spins between rotor and support; empty where one does."""

    @property
    @abstractmethod
    def no_face(self) -> str:
        """Why its race cannot have a face on which the rotor lands; empty where it can."""

    @abstractmethod
    def numbers(self) -> BearingNumbers:
        """Give the numbers that follow from it."""

    @abstractmethod
    def check_bore(self, radius: float) -> None:
        """Refuse a bore [m] that the race has no room for, with a `Misfit`."""

    @abstractmethod
    def usual_race_width(self) -> tuple[float, str]:
        """Width of the race [m] where none is given, and why."""

    @abstractmethod
    def race_of_size(self, race: Race, width: Known, bore: float) -> Race:
        """Give a race its width, and mass and inertia that were left out, around a bore radius [m]."""

    @property
    def rim_radius(self) -> float:
        """Radius at which the inner ring ends [m]; that of what has none is anywhere."""
        return math.inf

    def oddities(self, bore_radius: float) -> Iterator[Oddity]:
        """What looks odd in the description, which can be used all the same."""
        yield from ()


THROWN = "ball centrifugal force"
"""Kind of excess of rolling elements that turn fast."""


@dataclass(frozen=True, kw_only=True)
class BearingFigure:
    """A number that a bearing states of itself at rest."""

    field: str
    """Its field in a document, unit included."""
    label: str
    """What it is called."""
    kind: str
    """Kind of quantity, which sets the unit it is shown in."""
    value: float
    """Its value [SI]."""
    described: Known | None = None
    """The same as the machine file describes it, with its range."""
    note: str = ""
    """What to add when it is shown."""


@dataclass(frozen=True, kw_only=True)
class Excess:
    """Something beyond a limit: what it is, the two numbers compared [SI], the text.

    ``doubtful`` says that the description looks wrong; else the drop model ends there.
    """

    kind: str
    value: float
    limit: float
    text: str
    doubtful: bool = False


@dataclass(frozen=True, kw_only=True)
class RollingElements:
    """What cage and defects turn with: rolling elements of a row [1], lengths [m], angle [rad]."""

    ball_count: int
    ball_diameter: float
    pitch_diameter: float
    contact_angle: float


@dataclass(frozen=True, kw_only=True)
class Spread:
    """How far a parameter of a hidden machine may lie: by a factor on what is described, or in a range."""

    path: str
    low: float
    high: float
    described: Known | None = None


@dataclass(frozen=True, kw_only=True)
class Ratings:
    """What a bearing bears by the standards, and what follows from its balls."""

    static: float
    """Static radial load rating C_0 of the whole bearing [N], ISO 76."""
    dynamic: float
    """Basic dynamic radial load rating C of one row [N], ISO 281."""
    rows: int
    balls: int
    """Rows, and balls of each."""
    gamma: float
    cosine: float
    """Ball diameter times cosine of the contact angle over pitch diameter, and that cosine [1]."""
    conformity_inner: float
    conformity_outer: float
    """Groove radius over ball diameter [1]."""
    source: str
    """Where the load ratings come from."""


SHOULDER = "shoulder of the race"
"""Kind of excess of rolling elements that climb out of their grooves."""


@dataclass(frozen=True, kw_only=True)
class Climb:
    """How far rolling elements climb in their grooves [rad from the middle of the groove], shape (T,)."""

    angle: Array
    edge: Array
    """Largest contact angle of a loaded element, and that of the edge of its contact ellipse."""
    shoulder: float
    """Angle at which the groove ends."""

    @property
    def highest(self) -> int:
        """Index of the instant at which an edge lies highest."""
        return int(np.argmax(self.edge))

    @property
    def excess(self) -> Excess | None:
        """What lies beyond the shoulder, where a contact reaches over it."""
        edge, angle = float(self.edge[self.highest]), float(self.angle[self.highest])
        if edge <= self.shoulder:
            return None
        reach, at, room = (f"{math.degrees(one):.3g}°" for one in (edge, angle, self.shoulder))
        text = (
            f"the contact of a ball reaches {reach} up its groove (contact angle {at}), and the shoulder "
            f"stands at {room}; the model takes the groove to go on: force and stress are not those of a "
            "contact cut off there"
        )
        return Excess(kind=SHOULDER, value=edge, limit=self.shoulder, text=text)


class BearingNumbers(ABC):
    """The numbers of one kind of bearing; a kind that has none of something says so."""

    @property
    @abstractmethod
    def held(self) -> bool:
        """Whether the race is held in the middle without any load on it."""

    @property
    @abstractmethod
    def play(self) -> float:
        """Way of the race from the middle to where it first meets a force [m]."""

    @property
    @abstractmethod
    def drag_diameter(self) -> float:
        """Twice the arm of the drag on the race [m]."""

    @property
    @abstractmethod
    def ring_material(self) -> tuple[float, float]:
        """Young's modulus [Pa] and Poisson's ratio [1] of the race."""

    def rotor_contact(self, bearing: TouchdownBearing, shaft: tuple[float, float]) -> LineContact:
        """Line contact with a rotor over the width of the race; Young's modulus [Pa], Poisson's ratio [1]."""
        bore, eta = float(bearing.bore_radius), compliance(*shaft, *self.ring_material)
        return cylinder_in_bore(bore - float(bearing.air_gap), bore, float(bearing.race.width), eta)

    @abstractmethod
    def entries(self) -> Array:
        """Numbers of the force law, shape (N,), in the order of `rotordrop.physics.ball_set`."""

    @property
    def lines_of_contact(self) -> float:
        """Dashpots along the lines of contact of all rolling elements over the radial damping [1]; none."""
        return 0.0

    def rings(self) -> Array:
        """Numbers of outer rings that springs press on, in the order of `rotordrop.physics.ring`; no such."""
        return np.zeros(ring.N_ENTRIES)

    def speed_table(self, fastest: float) -> BallTable | None:
        """Table of rolling elements whose inertia counts, for a race up to a speed [rad/s]; None without."""
        return None

    @abstractmethod
    def places(self, least: int = 0, facing: float = 0.0) -> Array:
        """Where the force acts around the race, shape (3, Z), padded to ``least`` places.

        With ``facing`` only the rows that axial motion towards +z (1) or -z (-1) loads.
        """

    @abstractmethod
    def deflection(self, load: float) -> tuple[float, float]:
        """Way of the race downwards under a load [N]: the way [m] and the tangent stiffness there [N/m]."""

    @abstractmethod
    def seat(self, load: float) -> tuple[float, float]:
        """Where the race comes to rest under a downward load [N]: x and y [m]."""

    def tangent_stiffness(self, load: float) -> float:
        """Radial stiffness [N/m] under a static load [N] downwards."""
        return self.deflection(load)[1]

    @abstractmethod
    def simple_stiffness(self, load: float) -> float:
        """Radial stiffness [N/m] under a load [N] by the engineering formula of handbooks."""

    def in_series(self, contact: float, load: float) -> tuple[float, float, float]:
        """Stiffness [N/m] under a load [N] of a contact, given, and behind its race, tangent and simple."""
        return contact, self.tangent_stiffness(load), self.simple_stiffness(load)

    def damping(self, time: float, load: float) -> float:
        """Its damping [N s/m] under a static load [N] where damping over tangent stiffness is given [s]."""
        return time * self.tangent_stiffness(load)

    @abstractmethod
    def figures(self, load: float) -> tuple[BearingFigure, ...]:
        """What holds the race without a load, and how it lies under a rotor at rest of a load [N]."""

    @abstractmethod
    def excesses(self, omega: float, load: float) -> Iterator[Excess]:
        """What is beyond a limit when the race turns at ω [rad/s] under a static load [N]."""

    @abstractmethod
    def room_to_grow(self) -> tuple[float, str]:
        """What the growth of a hot race is compared with [m], and a text with the place ``{room}`` for it."""

    @property
    def stress_sigma(self) -> float:
        """Relative standard deviation [1] of its stress at a force, by what is inferred of it."""
        return 0.0

    def element_loads(self, moved: Array, rings: Array, along: Array) -> Array:
        """Load of every rolling element [N], (T, rows, Z); none here.

        The race has moved (x, y) [m], (T, 2), and along the axis, (T,), sprung rings from it, (T,).
        """
        return np.zeros((len(moved), 0, 0))

    def climb(self, moved: Array, along: Array) -> Climb:
        """How far rolling elements climb; without any they meet no shoulder. Arguments as `element_loads`."""
        nothing = np.zeros(len(moved))
        return Climb(angle=nothing, edge=nothing, shoulder=math.inf)

    def axial_figures(self, law: Array, gap: float, push: float) -> Iterator[BearingFigure]:
        """What holds the race along the axis, and a landing through a gap [m] under a push [N]."""
        yield from ()

    def landing_excess(self, law: Array, gap: float, push: float) -> Excess | None:
        """What of such a landing is beyond a limit; nothing without rolling elements."""
        return None

    def element_loads_under(self, force: Array) -> Array:
        """The same under a force of the elements on the race (x, y) [N], (T, 2); none here."""
        return np.zeros((len(force), 0, 0))

    def load_of_stress(self, stress: Array) -> Array:
        """Load [N] of the element whose largest Hertz stress is given [Pa]; NaN without rolling elements."""
        return np.full_like(stress, np.nan)

    def ratings(self) -> Ratings | None:
        """Load ratings; None without rolling elements."""
        return None

    def rolling_elements(self) -> RollingElements | None:
        """What defects may show in a spectrum; None without rolling elements."""
        return None

    def spreads(self) -> Iterator[Spread]:
        """How far its own parameters may lie in a hidden machine."""
        yield from ()


def numbers_of(bearing: TouchdownBearing) -> BearingNumbers:
    """The numbers of a touchdown bearing, whatever its kind."""
    return bearing.bearing.numbers()


def places_of(bearings: Sequence[TouchdownBearing]) -> Array:
    """Places of every bearing, shape (B, 3, Z), padded to the longest.

    Where a bearing has a face, its rows stand apart: those that motion towards +z loads in its own place, the
    others B places behind, (2 B, 3, Z).
    """
    apart = [float(bearing.face is not None) for bearing in bearings]
    asked = [(numbers_of(bearing), face) for bearing, face in zip(bearings, apart, strict=True)]
    if any(apart):
        asked += [(one, -face) for one, face in asked]
    longest = max((one.places(0, facing).shape[1] for one, facing in asked), default=0)
    return np.array([one.places(longest, facing) for one, facing in asked]).reshape(len(asked), 3, -1)
