"""What the bearing of a race states of itself: the numbers of balls, or of a sleeve, which has none."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.ball_bearing import STATIC_STRESS, BallBearing
from rotordrop.elements.catalog.inference import dynamic_rating, static_rating
from rotordrop.errors import UsageError
from rotordrop.known import NINETY, Known
from rotordrop.physics import ball_set, ring
from rotordrop.physics.ball_bearing import BearingConstants, ball_centrifugal_force, bearing_constants
from rotordrop.physics.ball_bearing_response import bearing_response, simple_radial_stiffness
from rotordrop.physics.ball_loads import ball_loads, displacement_under, loads_and_angles
from rotordrop.physics.ball_set import (
    ball_set_entries,
    ball_set_gradient,
    balls_of,
    lines_of_contact,
    loose_race_seat,
    static_deflection,
)
from rotordrop.physics.ball_table import BallTable, ball_table
from rotordrop.physics.contact import contact_energy, depth_at
from rotordrop.physics.fast_balls import FastBalls, centred_balls, offset_on_springs
from rotordrop.physics.hertz import LineContact, compliance, cylinder_in_bore, race_contact
from rotordrop.physics.ring import STOP_STIFFNESS, row_rigidity, seat_on_springs
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.elements.touchdown_bearing import TouchdownBearing

CENTRIFUGAL_SHARE = 0.1
"""Ball centrifugal force over preload ball load from which it counts: chosen, not measured."""

SHOULDER_HEIGHT = 0.2
"""Height of a shoulder over the ball diameter [1]: that of rings 0.6 ball diameters apart, chosen."""

_STEEL = (208e9, 0.3)
_HARD_PUSH, _PUSHES = 10.0, 101
"""Load over that at rest [1] for which rigid and sprung preload are compared, as of a first impact; forces
tried up to it."""


THROWN = "ball centrifugal force"
"""Kind of excess of rolling elements that turn fast."""


@dataclass(frozen=True)
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


@lru_cache(maxsize=64)
def _constants(balls: BallBearing) -> BearingConstants:
    """Found once for equal bearings: a study asks for them six times a drop, and they cost milliseconds."""
    return bearing_constants(balls)


@lru_cache(maxsize=8)
def _speed_table(balls: BallBearing, fastest: float) -> BallTable:
    """Found once for equal bearings: it takes a second."""
    constants = _constants(balls)
    return ball_table(FastBalls.of(balls, constants), fastest, constants.stress_coefficient_outer)


@dataclass(frozen=True, eq=False)
class BearingNumbers:
    """The numbers of a ball bearing, or of a sleeve: rigid, held, without balls."""

    ring_material: tuple[float, float]
    """Young's modulus [Pa] and Poisson's ratio [1] of the rings, or of the sleeve."""
    balls: BallBearing | None = None
    """The ball bearing; None for a sleeve."""

    @property
    def rolling(self) -> BallBearing:
        """The ball bearing, of one that is no sleeve."""
        assert self.balls is not None
        return self.balls

    @cached_property
    def constants(self) -> BearingConstants:
        """What does not change during a drop, of balls."""
        return _constants(self.rolling)

    @property
    def held(self) -> bool:
        """Whether the race is held in the middle without any load on it: by preload."""
        return self.balls is None or self.constants.preloaded

    @property
    def play(self) -> float:
        """Way of the race from the middle to where it first meets a force [m]: half the clearance."""
        return 0.0 if self.balls is None else self.constants.radial_play

    def rotor_contact(self, bearing: TouchdownBearing, shaft: tuple[float, float]) -> LineContact:
        """Line contact with a rotor over the width of the race; Young's modulus [Pa], Poisson's ratio [1]."""
        bore, eta = float(bearing.bore_radius), compliance(*shaft, *self.ring_material)
        return cylinder_in_bore(bore - float(bearing.air_gap), bore, float(bearing.race.width), eta)

    def element_loads(self, moved: Array, rings: Array, along: Array) -> Array:
        """Load of every ball [N], (T, rows, Z); a sleeve has none.

        The race has moved (x, y) [m], (T, 2), and along the axis, (T,), sprung rings from it, (T,).

        Raises
        ------
        UsageError
            With ball_inertia: the load depends on the speed of the race, and differs between the races.
        """
        if self.balls is None:
            return np.zeros((len(moved), 0, 0))
        if self.balls.ball_inertia:
            raise UsageError(
                "the load of every ball is not known with ball_inertia = true, where it differs between the "
                "races; max_ball_load and race_stress of the drop hold the largest"
            )
        return loads_and_angles(self.constants, moved, rings, along)[0]

    def element_loads_under(self, force: Array) -> Array:
        """Load of every ball [N], (T, rows, Z), where they push the race with a force (x, y) [N], (T, 2)."""
        if self.rolling.sprung:
            seats = seat_on_springs(self.constants, self.rings(), force)
            return ball_loads(self.constants, seats[:, :2], seats[:, 2])
        return ball_loads(self.constants, displacement_under(self.constants, force))

    def climb(self, moved: Array, along: Array) -> Climb:
        """How far the balls climb in the race that has less room for them; arguments as `element_loads`."""
        balls, constants = self.rolling, self.constants
        diameter, angle = float(balls.ball_diameter), constants.radial_contact_angle
        height = SHOULDER_HEIGHT * diameter if balls.shoulder_height is None else float(balls.shoulder_height)
        load, angles = loads_and_angles(constants, moved, 0.0, along)
        eta = compliance(
            *self.ring_material, float(balls.ball_youngs_modulus), float(balls.ball_poisson_ratio)
        )
        found = []
        for conformity, inner in ((balls.conformity_inner, True), (balls.conformity_outer, False)):
            radius = float(conformity) * diameter
            ellipse = race_contact(
                diameter, float(balls.pitch_diameter), float(conformity), angle, eta, inner=inner
            )
            edge = np.where(load > 0.0, angles + ellipse.semi_axes(load)[0] / radius, 0.0)
            found.append((np.max(edge, axis=(1, 2)), math.acos(max(1.0 - height / radius, 0.0))))
        edge, shoulder = max(found, key=lambda one: float(np.max(one[0])) - one[1])
        return Climb(
            angle=np.max(np.where(load > 0.0, angles, 0.0), axis=(1, 2)), edge=edge, shoulder=shoulder
        )

    def axial_figures(self, law: Array, gap: float, push: float) -> Iterator[BearingFigure]:
        """Stiffness along the axis and against tilt; force of a landing through a gap [m] by a push [N]."""
        constants, balls = self.constants, self.rolling
        if self.held:
            # rows without a given distance stand as far apart as they are wide
            apart = balls.row_spacing or balls.usual_race_width()[0] / constants.row_count
            rest = bearing_response(constants, np.zeros(5), row_spacing=float(apart))
            yield BearingFigure(
                "axial_stiffness_N_per_m", "axial stiffness", "stiffness", float(rest.stiffness[2, 2])
            )
            yield BearingFigure(
                "tilt_stiffness_N_m_per_rad",
                "tilt stiffness",
                "rotational_stiffness",
                float(rest.stiffness[3, 3]),
                note=f'arrangement "{balls.arrangement}"; a drop has no tilt of the race',
            )
        if push > 0.0:
            force, way = self.landing(law, gap, push)
            angle = math.degrees(float(self.climb(np.zeros((1, 2)), np.array([way])).angle[0]))
            thrust, through = format_quantity(push, "force"), format_quantity(gap, "length")
            note = f"of {thrust} through {through}, without any loss, contact angle {angle:.3g}°"
            yield BearingFigure("landing_force_N", "axial force of a landing", "force", force, note=note)

    def landing(self, law: Array, gap: float, push: float) -> tuple[float, float]:
        """Largest axial force [N] and way of the race [m] where a constant push [N] closes a gap [m].

        Its work goes into face and balls, nothing is lost, the race has no mass, the housing does not move.
        """
        from scipy.optimize import brentq  # slow to load, and few machines have a face

        rest = bearing_response(self.constants, np.zeros(5)).energy

        def pressed(way: float) -> tuple[float, float]:
            balls = bearing_response(self.constants, [0.0, 0.0, way, 0.0, 0.0])
            force = max(-float(balls.force[2]), 0.0)
            depth = depth_at(law, force)
            return force, push * (gap + way + depth) - (balls.energy - rest + contact_energy(law, depth))

        furthest = self.constants.groove_distance
        while pressed(furthest)[1] > 0.0:
            furthest *= 2.0
        way: float = brentq(lambda way: pressed(way)[1], 0.0, furthest, xtol=1e-16)
        return pressed(way)[0], way

    def landing_excess(self, law: Array, gap: float, push: float) -> Excess | None:
        """A contact that a landing without any loss takes over the shoulder."""
        _force, way = self.landing(law, gap, push)
        found = self.climb(np.zeros((1, 2)), np.array([way])).excess
        if found is None:
            return None
        thrust, through = format_quantity(push, "force"), format_quantity(gap, "length")
        return replace(found, text=f"in a landing of {thrust} through {through} {found.text}")

    def load_of_stress(self, stress: Array) -> Array:
        """Load [N] of the ball with a stress at the inner race."""
        return np.asarray((stress / self.constants.stress_coefficient_inner) ** 3)

    def ratings(self) -> Ratings:
        """Load ratings as given, else by ISO 76 and ISO 281 from the balls."""
        b = self.rolling
        angle, rows = float(b.contact_angle), b.rows
        row = (b.ball_count, float(b.ball_diameter), float(b.pitch_diameter), angle)
        given = [b.static_load_rating, b.dynamic_load_rating]
        static, dynamic = (
            rule(*row) if one is None else float(one)
            for one, rule in zip(given, (static_rating, dynamic_rating), strict=True)
        )
        both = all(one is not None for one in given)
        return Ratings(
            static=rows * static,
            dynamic=dynamic,
            rows=rows,
            balls=b.ball_count,
            gamma=float(b.ball_diameter) * math.cos(angle) / float(b.pitch_diameter),
            cosine=math.cos(angle),
            conformity_inner=float(b.conformity_inner),
            conformity_outer=float(b.conformity_outer),
            source="as given" if both else "from the balls by ISO 76 and ISO 281",
        )

    @property
    def drag_diameter(self) -> float:
        """Twice the arm of the drag on the race [m]: the pitch diameter."""
        return 0.0 if self.balls is None else float(self.balls.pitch_diameter)

    def entries(self) -> Array:
        """Numbers of the force law, shape (N,), in the order of `rotordrop.physics.ball_set`."""
        return np.zeros(ball_set.N_ENTRIES) if self.balls is None else ball_set_entries(self.constants)

    @property
    def lines_of_contact(self) -> float:
        """Dashpots along the lines of contact of all balls over the radial damping [1]."""
        return 0.0 if self.balls is None else lines_of_contact(self.constants)

    def rings(self) -> Array:
        """Numbers of outer rings that springs press on, in the order of `rotordrop.physics.ring`."""
        numbers, balls = np.zeros(ring.N_ENTRIES), self.balls
        if balls is not None and balls.sprung:
            numbers[ring.MASS], numbers[ring.RATE] = balls.ring_mass, balls.spring_rate
            numbers[ring.TRAVEL], numbers[ring.FRICTION] = balls.ring_travel, balls.fit_friction
            numbers[ring.DAMPING] = balls.ring_damping
            numbers[ring.STOP] = STOP_STIFFNESS * row_rigidity(self.constants)
            numbers[ring.BALLS] = self.constants.ball_count
            numbers[ring.ROWS] = self.constants.row_count
        return numbers

    def speed_table(self, fastest: float) -> BallTable | None:
        """Balls up to a speed of the race [rad/s], where their inertia counts."""
        inert = self.balls is not None and self.balls.ball_inertia
        return _speed_table(self.rolling, fastest) if inert else None

    def places(self, least: int = 0, facing: float = 0.0) -> Array:
        """Where the force acts around the race, shape (3, Z), padded to ``least`` places.

        With ``facing`` only the rows that axial motion towards +z (1) or -z (-1) loads.
        """
        if self.balls is None:
            return np.zeros((3, least))
        return balls_of(self.constants, least, facing)

    def deflection(self, load: float) -> tuple[float, float]:
        """Way of the race downwards under a load [N]: the way [m] and the tangent stiffness there [N/m]."""
        if self.balls is None:
            return 0.0, math.inf
        if self.balls.sprung:
            _, y, q = seat_on_springs(self.constants, self.rings(), np.array([[0.0, load]]))[0]
            # small and fast motion does not slide the rings in their fits: the tangent is that of held ones
            return -y, float(ball_set_gradient(self.entries(), self.places(), 0.0, y, q)[4])
        return static_deflection(self.constants, load)

    def seat(self, load: float) -> tuple[float, float]:
        """Where the race comes to rest under a downward load [N]: x and y [m].

        Straight below the middle with preload; else in the gap of the lowest balls.
        """
        if self.held:
            return 0.0, -self.deflection(load)[0]
        return loose_race_seat(self.constants, load)

    def tangent_stiffness(self, load: float) -> float:
        """Radial stiffness [N/m] under a static load [N] downwards."""
        return self.deflection(load)[1]

    def in_series(self, contact: float, load: float) -> tuple[float, float, float]:
        """Stiffness [N/m] under a load [N] of a contact, given, and behind its race, tangent and simple.

        On a sleeve the contact is all that lies on the support.
        """
        if self.balls is None:
            return math.inf, contact, contact
        return contact, self.tangent_stiffness(load), self._simple_stiffness(self.balls, load)

    def damping(self, time: float, load: float) -> float:
        """Its damping [N s/m] under a static load [N] where damping over tangent stiffness is given [s]."""
        return 0.0 if self.balls is None else time * self.tangent_stiffness(load)

    def _simple_stiffness(self, bearing: BallBearing, load: float) -> float:
        """Radial stiffness [N/m] by Palmgren's formula, which knows no preload."""
        balls = (float(bearing.ball_youngs_modulus), float(bearing.ball_poisson_ratio))
        return simple_radial_stiffness(
            float(bearing.ball_diameter),
            self.constants.row_count * self.constants.ball_count,
            self.constants.radial_contact_angle,
            load,
            compliance(*self.ring_material, *balls) / compliance(*_STEEL, *_STEEL),
        )

    @property
    def _preload_stress(self) -> float:
        """Hertz stress of a ball on the inner race from the preload alone [Pa]."""
        return self.constants.stress_coefficient_inner * math.cbrt(self.constants.preload_ball_load)

    def ball_loads(self, load: float) -> Array:
        """Load of every ball [N] with the race at rest under a load [N]."""
        return bearing_response(self.constants, [*self.seat(load), 0.0, 0.0, 0.0]).ball_loads

    def figures(self, load: float) -> tuple[BearingFigure, ...]:
        """What holds the race without a load, and how it lies under a rotor at rest of a load [N]."""
        if (balls := self.balls) is None:
            return ()
        constants = self.constants
        if self.held:
            return (
                BearingFigure("preload_N", "preload of a row", "force", float(balls.preload), balls.preload),
                BearingFigure("preload_stress_Pa", "stress by preload", "pressure", self._preload_stress),
                *self._on_springs(balls, load),
            )
        loads, clearance = self.ball_loads(load), 2.0 * self.play
        shared = f"on {np.count_nonzero(loads)} balls"
        axial = BearingFigure("axial_play_m", "axial play", "length", constants.axial_play)
        return (
            BearingFigure("clearance_m", "radial clearance", "length", clearance, balls.clearance),
            *((axial,) if constants.row_count == 1 else ()),
            BearingFigure("contact_angle_rad", "free contact angle", "angle", constants.contact_angle),
            BearingFigure(
                "ball_load_N", "largest ball load at rest", "force", float(np.max(loads)), note=shared
            ),
        )

    def _on_springs(self, balls: BallBearing, load: float) -> Iterator[BearingFigure]:
        """What springs in place of spacers would leave of the force, at a push of many times a load [N]."""
        if balls.sprung or load <= 0.0:
            return
        springs = balls.changed(preload_kind="spring", ball_inertia=False).numbers()
        heavy = _HARD_PUSH * load
        pushes = np.column_stack([np.zeros(_PUSHES), np.linspace(0.0, heavy, _PUSHES)])
        way = -seat_on_springs(springs.constants, springs.rings(), pushes)[:, 1]
        left = float(np.interp(static_deflection(self.constants, heavy)[0], way, pushes[:, 1])) / heavy
        note = f"of {_HARD_PUSH:g} times this load; the preload is rigid, by preload_kind"
        yield BearingFigure(
            "force_on_springs",
            "peak force if preloaded by springs, ≈ ×",
            "dimensionless",
            left,
            note=note,
        )

    def excesses(self, omega: float, load: float) -> Iterator[Excess]:
        """What is beyond a limit when the race turns at ω [rad/s] under a static load [N].

        Speed beyond what the maker allows, stress by preload, centrifugal force of the balls.
        """
        if (balls := self.balls) is None:
            return
        speed, limit = format_quantity(omega, "speed"), balls.limiting_speed
        if limit is not None and omega > float(limit):
            allowed = format_quantity(float(limit), "speed")
            text = f"a race that reaches the rotor's {speed} turns faster than the {allowed} its maker allows"
            yield Excess(kind="limiting speed", value=omega, limit=float(limit), text=text)
        stress = self._preload_stress
        if stress > STATIC_STRESS:
            pressed, rated = (format_quantity(value, "pressure") for value in (stress, STATIC_STRESS))
            text = (
                f"the preload alone presses the balls with {pressed}, and ISO 76 rates bearings up to {rated}"
            )
            yield Excess(kind="preload", value=stress, limit=STATIC_STRESS, text=text, doubtful=True)
        if balls.ball_inertia:
            return
        force = float(ball_centrifugal_force(balls, omega))
        carried = self.constants.preload_ball_load if self.held else float(np.max(self.ball_loads(load)))
        if force > CENTRIFUGAL_SHARE * carried:
            thrown, against = format_quantity(force, "force"), format_quantity(carried, "force")
            what = "its load by the preload," if self.held else "the load of the lowest ball at rest,"
            text = (
                f"at {speed} of the race each ball is thrown outwards with {thrown}, not small against {what}"
            )
            text = f"{text} {against}; {self._at_speed(balls, omega)}the drop model leaves this out"
            yield Excess(kind=THROWN, value=force, limit=carried, text=text)

    def _at_speed(self, bearing: BallBearing, omega: float) -> str:
        """What the inertia of the balls makes of a preloaded pair that turns at ω [rad/s]."""
        if not self.held:
            return ""
        constants = self.constants
        balls = FastBalls.of(bearing, constants)
        offset = constants.axial_offset
        if bearing.sprung:
            offset = offset_on_springs(balls, constants.ball_count, constants.preload, omega)
        state, _orbit = centred_balls(balls, omega, offset)
        load = float(state.outer_load[0])
        stress = constants.stress_coefficient_outer * math.cbrt(load)
        still, _ = centred_balls(balls, 0.0)
        softer = 1.0 - float(state.radial_stiffness[0] / still.radial_stiffness[0])
        loaded, pressed = format_quantity(load, "force"), format_quantity(stress, "pressure")
        return (
            f"before any impact it loads the outer race with {loaded} a ball ({pressed}) and takes "
            f"{100.0 * softer:.0f} % off the radial stiffness; "
        )

    def room_to_grow(self) -> tuple[float, str]:
        """What the growth of a hot race is compared with [m], and a text with the place ``{room}`` for it.

        Elastic approach of a preloaded ball, or the play that closes.
        """
        if not self.held:
            return self.play, "its radial play of {room}, which closes"
        approach = (self.constants.preload_ball_load / self.constants.ball_stiffness) ** (2.0 / 3.0)
        return approach, "the {room} a preloaded ball is pressed in, so that the preload rises"

    @property
    def stress_sigma(self) -> float:
        """Relative standard deviation [1] of the stress at a force by balls inferred from a designation."""
        return inferred_stress_sigma(self.rolling)


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


def inferred_stress_sigma(bearing: BallBearing) -> float:
    """Relative standard deviation [1] of the largest Hertz stress at a force, by balls not known exactly.

    Diameter and conformity set the stress of a loaded ball, the count shares the load: stress goes with its
    third root. They are taken as independent, which is a little too wide: fewer balls are larger ones. Zero
    where the balls are listed.
    """
    pitch, angle = bearing.pitch_diameter.value, bearing.contact_angle.value
    listed = [bearing.ball_diameter.value, bearing.conformity_inner.value]
    parts = []
    for place, known in enumerate((bearing.ball_diameter, bearing.conformity_inner)):
        ends = known.range if known.status == "inferred" and known.range else (known.value, known.value)
        pairs = [[*listed[:place], end, *listed[place + 1 :]] for end in ends]
        low, high = (
            float(race_contact(D, pitch, share, angle, 1.0, inner=True).stress_coefficient)
            for D, share in pairs
        )
        parts.append(abs(math.log(high / low)))
    if bearing.ball_count_range is not None:
        fewest, most = bearing.ball_count_range
        parts.append(math.log(most / fewest) / 3.0)
    return math.hypot(*parts) / (2.0 * NINETY)
