"""The heat of a touchdown bearing: what its parts take up and pass on, and how they grow."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

from rotordrop.arrays import Array
from rotordrop.elements import values as V
from rotordrop.elements.ball_bearing import BallBearing, outer_ring
from rotordrop.elements.bearing_numbers import BearingFigure, Excess, numbers_of
from rotordrop.elements.description import Description
from rotordrop.elements.race import STEEL_DENSITY, Race
from rotordrop.elements.values import default, follows
from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.physics import thermal as law
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.elements.touchdown_bearing import TouchdownBearing

_STEEL_CONDUCTIVITY = 45.0
"""Of bearing steel [W/(m K)]."""
_BALL_HEAT = {"silicon nitride": (800.0, 3.2e-6), "steel": (law.STEEL_HEAT_CAPACITY, law.STEEL_EXPANSION)}
"""Specific heat [J/(kg K)] and expansion [1/K] of balls."""
_LYING, _FITTED = 1.1e3, 13e3
"""Conductance over area [W/(m² K)] of a rotor that lies in a race and of outer rings in their housing.

Chosen, not measured: 8 and 120 W/K of a pair of 70 mm bore.
"""
RUNAWAY = "thermal runaway"
"""Kind of excess of a pair whose preload rises with its own heat."""


class Thermal(Description):
    """Heat of a bearing, from the landing sleeve of the rotor through race and balls to the housing."""

    sleeve_capacity: V.HeatCapacity = follows("steel of the rotor's radius, as long as the race is wide")
    """Heat capacity of the landing sleeve [J/K]."""
    race_capacity: V.HeatCapacity = follows("steel of the mass of the race")
    """Heat capacity of the inner race with its skin [J/K]."""
    ball_capacity: V.HeatCapacity = follows("all balls, by their material")
    """Heat capacity of all balls and their cages [J/K]."""
    outer_capacity: V.HeatCapacity = follows("steel rings of their size")
    """Heat capacity of the outer races [J/K]."""
    housing_capacity: V.HeatCapacity = follows("steel of the mass of the support")
    """Heat capacity of the housing [J/K]."""
    sleeve_conductance: V.HeatConductance = follows("1.1 kW/(m² K) over the bore, chosen and not measured")
    """Conductance from the landing sleeve to the race [W/K]."""
    skin_conductance: V.HeatConductance = follows("steel over half the height of the race")
    """Conductance from the skin of the race to the rest of it [W/K]."""
    ball_conductance: V.HeatConductance = follows("4 W/K a row")
    """Conductance from the race to the balls, and from them to the outer races [W/K]."""
    outer_conductance: V.HeatConductance = follows("13 kW/(m² K) over the outer rings, chosen, not measured")
    """Conductance from the outer races to the housing [W/K]."""
    sleeve_to_rotor: V.HeatConductance = default(2.0, "along the shaft, chosen and not measured", (0.5, 8.0))
    """Conductance from the landing sleeve to the rotor beside it, which stays as it was [W/K]."""
    housing_to_ambient: V.HeatConductance = default(
        15.0, "a housing in a frame, chosen and not measured", (5.0, 50.0)
    )
    """Conductance from the housing to what stays as it was [W/K]."""
    slip_share: V.Share = default(0.5, "steel on steel, by the root of k ρ c", (0.3, 0.7))
    """Share of the heat of sliding that goes into the race [1]; the landing sleeve takes the rest."""
    ball_share: V.Share = default(0.5, "half of the friction of balls goes into them, as usual", (0.3, 0.7))
    """Share of the friction of the balls that warms them [1]; the race takes the rest."""
    expansion: V.Expansion = default(law.STEEL_EXPANSION, "bearing steel", (11e-6, 13e-6))
    """Thermal expansion of races and landing sleeve [1/K]."""
    ball_expansion: V.Expansion = follows("from the ball material")
    """Thermal expansion of the balls [1/K]."""

    columns: ClassVar[Mapping[str, int]] = {
        "sleeve_capacity": L.THERMAL + law.CAPACITY + law.SLEEVE,
        "ball_capacity": L.THERMAL + law.CAPACITY + law.BALLS,
        "outer_capacity": L.THERMAL + law.CAPACITY + law.OUTER,
        "housing_capacity": L.THERMAL + law.CAPACITY + law.HOUSING,
        "sleeve_conductance": L.THERMAL + law.CONDUCTANCE + law.SLEEVE,
        "skin_conductance": L.THERMAL + law.CONDUCTANCE + law.SKIN,
        "ball_conductance": L.THERMAL + law.CONDUCTANCE + law.RACE,
        "outer_conductance": L.THERMAL + law.CONDUCTANCE + law.OUTER,
        "sleeve_to_rotor": L.THERMAL + law.SLEEVE_OUT,
        "housing_to_ambient": L.THERMAL + law.HOUSING_OUT,
        "slip_share": L.THERMAL + law.SLIP_SHARE,
        "ball_share": L.THERMAL + law.BALL_SHARE,
        "expansion": L.THERMAL + law.EXPANSION,
        "ball_expansion": L.THERMAL + law.BALL_EXPANSION,
    }

    beyond_estimates: ClassVar[tuple[str, str]] = (
        "warms",
        ": a drop determines next to nothing of its heat. Leave out its table 'thermal'; simulations "
        "and studies know it",
    )

    @property
    def remembered(self) -> int:
        """Temperatures of the nodes, heat taken up and gone, and how fast they last changed."""
        return law.N_MEMORY

    def beside(self, bearing: TouchdownBearing, race: Race) -> Thermal:
        """The table with what it leaves out, from the size of its bearing and race."""
        balls, given = bearing.bearing, self.model_fields_set
        radius, width, mass = bearing.bore_radius.value, race.width.value, race.mass.value
        rows = balls.rows
        specific, expansion = _BALL_HEAT[balls.ball_material]
        ball = balls.ball_density.value * math.pi / 6.0 * balls.ball_diameter.value**3
        ring, ring_radius, ring_width = outer_ring(balls)
        steel, bore = law.STEEL_HEAT_CAPACITY, 2.0 * math.pi * radius * width
        height = mass / (STEEL_DENSITY * bore)
        fitted = 2.0 * math.pi * ring_radius * ring_width * rows
        sized = (
            ("sleeve_capacity", steel * STEEL_DENSITY * 0.5 * bore * radius, 3.0, "J/K"),
            ("race_capacity", steel * mass, 1.3, "J/K"),
            ("ball_capacity", specific * ball * rows * balls.ball_count, 1.3, "J/K"),
            ("outer_capacity", steel * ring * rows, 1.5, "J/K"),
            ("housing_capacity", steel * bearing.support.mass.value, 2.0, "J/K"),
            ("sleeve_conductance", _LYING * bore, 4.0, "W/K"),
            ("skin_conductance", 2.0 * _STEEL_CONDUCTIVITY * bore / height, 1.5, "W/K"),
            ("ball_conductance", 4.0 * rows, 2.5, "W/K"),
            ("outer_conductance", _FITTED * fitted, 4.0, "W/K"),
            ("ball_expansion", expansion, 1.1, "1/K"),
        )
        values = {}
        for name, value, by, unit in sized:
            why = (type(self).model_fields[name].description or "").removeprefix("When left out: ")
            bounds = (value / by, value * by)
            values[name] = Known(value=value, status="default", range=bounds, source=why, unit=unit)
        return self.completed_with({name: one for name, one in values.items() if name not in given})

    def fill(self, row: Array) -> None:
        """Write the columns of the heat; the race is split into its skin and the rest."""
        super().fill(row)
        for node, share in ((law.SKIN, law.SKIN_SHARE), (law.RACE, 1.0 - law.SKIN_SHARE)):
            row[L.THERMAL + law.CAPACITY + node] = share * float(self.race_capacity)
        row[L.THERMAL + law.CONDUCTANCE + law.BALLS] = float(self.ball_conductance)

    @staticmethod
    def fill_arms(row: Array, balls: BallBearing) -> None:
        """Write what grows: radii of the contacts, and the rows of the bearing."""
        entries, pitch = row[L.THERMAL : L.THERMAL_END], float(balls.pitch_diameter)
        across = _across(balls)
        entries[law.INNER_RADIUS], entries[law.OUTER_RADIUS] = 0.5 * (pitch - across), 0.5 * (pitch + across)
        entries[law.BALL_REACH], entries[law.ROW_BALLS] = across, balls.ball_count
        entries[law.ROWS] = balls.rows


def _across(balls: BallBearing) -> float:
    """Radial distance of the two contacts of a ball [m]."""
    return float(balls.ball_diameter) * math.cos(float(balls.contact_angle))


def _force_at(bearing: TouchdownBearing, omega: float) -> Callable[[float], float]:
    """Axial force of all rows of a rigid pair [N] at a growth [m], its race at ω [rad/s]."""
    from rotordrop.physics.ball_set import RADIAL_OFFSET, ball_set_entries, centred_row
    from rotordrop.physics.fast_balls import FastBalls, centred_balls

    balls, numbers = bearing.bearing, numbers_of(bearing)
    constants = numbers.constants
    count, rows = constants.ball_count, constants.row_count

    def slow(growth: float) -> float:
        entries = ball_set_entries(constants)
        entries[RADIAL_OFFSET] += growth
        return float(rows * centred_row(entries, 0.0, count)[0])

    def fast(growth: float) -> float:
        at_rest = FastBalls.of(balls, constants)
        grown = replace(at_rest, radial_offset=at_rest.radial_offset + growth)
        return float(rows * count * centred_balls(grown, omega)[0].axial_force[0])

    return fast if balls.ball_inertia else slow


@lru_cache(maxsize=8)
def steady_limit(bearing: TouchdownBearing, omega: float) -> tuple[float, float] | None:
    """Conductance [W/K] from race to outer race below which a pair has no steady state at ω [rad/s].

    With the kelvins between the races there; None where springs keep the preload, or there is none. Found
    once for equal bearings: what is shown and what is warned of ask both.
    """
    heat, balls = bearing.thermal, bearing.bearing
    if heat is None or balls.sprung or not numbers_of(bearing).held:
        return None
    arm = 0.5 * float(bearing.race.drag_coefficient) * float(balls.pitch_diameter)
    by_warmth = float(heat.expansion) * 0.5 * (float(balls.pitch_diameter) - _across(balls))
    share = 1.0 - float(heat.ball_share)
    if share * arm * omega * by_warmth == 0.0:
        return None
    return law.least_conductance(_force_at(bearing, omega), share, arm, omega, by_warmth)


def heat_figures(bearing: TouchdownBearing, omega: float) -> tuple[BearingFigure, ...]:
    """What `check` says of the heat of a bearing whose race reaches ω [rad/s]."""
    heat = bearing.thermal
    if heat is None or (limit := steady_limit(bearing, omega)) is None:
        return ()
    has = format_quantity(0.5 * float(heat.ball_conductance), "heat_conductance")
    note = f"from race to outer race through the balls, which have {has}, at nominal speed"
    label, unit = "conductance for a steady state", "heat_conductance"
    return (BearingFigure("steady_conductance_W_per_K", label, unit, limit[0], note=note),)


def runaway(bearing: TouchdownBearing, omega: float) -> Excess | None:
    """A pair whose balls conduct less than its heat at ω [rad/s] needs for a steady state."""
    heat = bearing.thermal
    if heat is None or (limit := steady_limit(bearing, omega)) is None:
        return None
    has = 0.5 * float(heat.ball_conductance)
    if limit[0] <= has:
        return None
    speed, needed, held = (
        format_quantity(omega, "speed"),
        format_quantity(limit[0], "heat_conductance"),
        format_quantity(has, "heat_conductance"),
    )
    text = (
        f"a race that keeps turning at {speed} has no steady state: its balls conduct {held} to the outer "
        f"race and would need {needed}, so that preload and heat raise one another until it slows down; "
        "springs in place of spacers keep the preload"
    )
    return Excess(kind=RUNAWAY, value=has, limit=limit[0], text=text)
