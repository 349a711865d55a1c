"""Heat of a touchdown bearing: nodes along the way of the heat, growth that presses the balls, its balance.

The landing sleeve of the rotor, the skin of the race under it, the rest of the race, balls, outer race and
housing stand in a row. Temperatures are above those of the start [K], where all parts are alike. What a drop
without them leaves out is estimated beside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics.elementary import exp
from rotordrop.physics.whirl import race_spin_up_time

if TYPE_CHECKING:
    from collections.abc import Callable


# Nodes, in the row in which heat flows.
SLEEVE, SKIN, RACE, BALLS, OUTER, HOUSING = range(6)
N_NODES = 6

# Entries of the heat of a bearing; SI units. Capacities of the nodes (zero: the bearing stays cold), then the
# conductances between neighbours, then those of sleeve and housing to what stays as it was; the shares of the
# heat of sliding that the race takes and of the friction of the balls that they take themselves; expansion of
# rings and balls [1/K]; radii of the contacts on inner and outer groove, ``D cos α``; rows and their balls.
CAPACITY = 0
CONDUCTANCE = CAPACITY + N_NODES
SLEEVE_OUT = CONDUCTANCE + N_NODES - 1
HOUSING_OUT, SLIP_SHARE, BALL_SHARE, EXPANSION, BALL_EXPANSION = range(SLEEVE_OUT + 1, SLEEVE_OUT + 6)
INNER_RADIUS, OUTER_RADIUS, BALL_REACH, ROWS, ROW_BALLS, N_ENTRIES = range(SLEEVE_OUT + 6, SLEEVE_OUT + 12)

# What is remembered of every bearing that warms: temperatures of its nodes [K], heat taken up and gone
# outwards [J], how fast its temperatures last changed [K/s].
TAKEN, GONE, CHANGE, N_MEMORY = range(N_NODES, N_NODES + 4)

SKIN_SHARE = 0.25
"""Share of the race that is its skin [1]: the two halves of the row then follow the slowest wave of heat
through a plate heated from one side to 7 %, ``L²/(π² a)`` against ``s (1 − s) L²/(2 a)``."""

STEEL_HEAT_CAPACITY = 460.0
"""Specific heat of bearing steel [J/(kg K)]."""

STEEL_EXPANSION = 12e-6
"""Thermal expansion of bearing steel [1/K]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HeatNetwork:
    """Nodes in a row that exchange heat, first and last one also with what stays as it was: its modes.

    ``C dT/dt = P − K T``, exact for a constant power.
    """

    capacity: Array
    """Capacities [J/K], shape (N,)."""
    out: Array
    """Conductance of each node to what stays as it was [W/K], shape (N,)."""
    conductance: Array
    """Matrix K [W/K], shape (N, N)."""
    rates: Array
    """Rates of the modes [1/s], slowest first, shape (N,)."""
    shapes: Array
    """Modes in columns [√(K/J)], shape (N, N)."""

    @classmethod
    def of(cls, capacity: Array, neighbours: Array, out: Array) -> HeatNetwork:
        """Network of capacities (N,) [J/K], conductances of neighbours (N − 1,) and outwards (N,) [W/K].

        Source: balance of heat, node by node.
        """
        from rotordrop.physics.linear_algebra import symmetric_eigen  # none that reads entries needs it

        K = np.diag(out)
        for j, G in enumerate(neighbours):
            K[j : j + 2, j : j + 2] += G * np.array([[1.0, -1.0], [-1.0, 1.0]])
        root = 1.0 / np.sqrt(capacity)
        rates, shapes = symmetric_eigen(root[:, None] * K * root)
        return cls(
            capacity=capacity,
            out=out,
            conductance=K,
            rates=np.maximum(rates, 0.0),
            shapes=root[:, None] * shapes,
        )

    @classmethod
    def of_entries(cls, entries: Array) -> HeatNetwork:
        """Network of the heat of a bearing. Source: the entries of this module."""
        out = np.zeros(N_NODES)
        out[SLEEVE], out[HOUSING] = entries[SLEEVE_OUT], entries[HOUSING_OUT]
        return cls.of(
            entries[CAPACITY : CAPACITY + N_NODES], entries[CONDUCTANCE : CONDUCTANCE + N_NODES - 1], out
        )

    def steady(self, power: Array) -> Array:
        """Temperatures [K] that constant powers (N,) [W] end at. Source: ``K T = P``."""
        from rotordrop.physics.linear_algebra import solve

        return solve(self.conductance, power)

    def after(self, temperature: Array, power: Array, time: float) -> tuple[Array, float]:
        """Temperatures [K] after a time [s] under constant powers (N,) [W], and the heat [J] gone outwards.

        Source: the modes, each ``z' = f − λ z``.
        """
        from rotordrop.physics.linear_algebra import product

        z = product(self.shapes.T, self.capacity * temperature)
        f = product(self.shapes.T, power)
        left = np.array([exp(-rate * time) for rate in self.rates])
        slow = self.rates * time < 1e-6  # where the closed form has no digits left
        rates = np.where(slow, 1.0, self.rates)
        gained = np.where(slow, time * (1.0 - 0.5 * self.rates * time), (1.0 - left) / rates)
        summed = np.where(slow, 0.5 * time * time, (time - gained) / rates)
        gone = float(np.sum(self.out * product(self.shapes, z * gained + f * summed)))
        return product(self.shapes, z * left + f * gained), gone


def race_temperature(temperature: Array) -> float:
    """Mean temperature [K] of the race with its skin. Source: `SKIN_SHARE`."""
    return float(SKIN_SHARE * temperature[SKIN] + (1.0 - SKIN_SHARE) * temperature[RACE])


def growth(entries: Array, temperature: Array) -> float:
    """Way [m] by which every ball is pressed further into its grooves by the heat of rings and balls.

    ``α (T_i r_i − T_o r_o) + α_b T_b D cos α``: it adds to the radial place of the inner groove, so that a
    race and balls that grow press, a warm outer race frees. Source: thermal expansion of free rings. Not
    validated: rings in tight fits; rows that spacers of another temperature move apart.
    """
    rings = race_temperature(temperature) * entries[INNER_RADIUS] - temperature[OUTER] * entries[OUTER_RADIUS]
    balls = entries[BALL_EXPANSION] * temperature[BALLS] * entries[BALL_REACH]
    return float(entries[EXPANSION] * rings + balls)


def gap_growth(entries: Array, temperature: Array, bore_radius: float, rotor_radius: float) -> float:
    """Way [m] by which the air gap grows: a warm race opens it, a warm landing sleeve closes it.

    Source: thermal expansion of free rings; radii in [m].
    """
    hot = race_temperature(temperature) * bore_radius - temperature[SLEEVE] * rotor_radius
    return float(entries[EXPANSION] * hot)


def node_powers(entries: Array, slip: float, rolling: float, mount: float) -> Array:
    """Heat of every node, shape (N,), from that of sliding, of the balls and of the mount [J], or powers [W].

    Source: sliding splits between skin and sleeve as two bodies in fast contact do, by ``√(k ρ c)``; half of
    the friction of balls goes into the race, half into them; what the mount takes stays in the housing. Not
    validated: against a measured temperature.
    """
    power = np.zeros(N_NODES)
    power[SKIN] = entries[SLIP_SHARE] * slip
    power[SLEEVE] = slip - power[SKIN]
    power[BALLS] = entries[BALL_SHARE] * rolling
    power[RACE] = rolling - power[BALLS]
    power[HOUSING] = mount
    return power


def least_conductance(
    axial_force: Callable[[float], float], share: float, arm: float, omega: float, by_warmth: float
) -> tuple[float, float]:
    """Conductance [W/K] from race to outer race below which a rigid pair has no steady state, and where [K].

    Parameters
    ----------
    axial_force : callable
        Axial force of all rows [N] at a growth [m].
    share : float
        Share of the friction of the balls that warms the race [1].
    arm : float
        Friction torque over that force [m]: coefficient times half the pitch diameter.
    omega : float
        Speed of the race [rad/s].
    by_warmth : float
        Growth by a kelvin between the races [m/K].

    Notes
    -----
    ``min over ΔT of share · arm · ω F(ΔT)/ΔT``: the straight line of conduction just touches the heat of a
    preload that rises with its own heat. Source: definition; by a scan and golden sections of the logarithm.
    """

    def needed(log_warmth: float) -> float:
        warmth = math.exp(log_warmth)
        return share * arm * omega * axial_force(by_warmth * warmth) / warmth

    places = np.linspace(math.log(0.1), math.log(1e3), 60)
    best = int(np.argmin([needed(float(place)) for place in places]))
    low, high = float(places[max(best - 1, 0)]), float(places[min(best + 1, len(places) - 1)])
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > 1e-6:
        one, other = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, other) if needed(one) < needed(other) else (one, high)
    return needed(low), math.exp(low)


def friction_heat(
    *,
    F_r: float,
    mu: float,
    omega_r: float,
    R_i: float,
    race_inertia: float,
    drag_coefficient: float,
    D_pw: float,
    duration: float,
) -> tuple[float, float]:
    """Heat [J] of the rotor sliding on the race, and of the balls rolling, from rest of the race.

    Parameters
    ----------
    F_r : float
        Steady normal force between rotor and race [N].
    mu : float
        Dynamic friction coefficient [1].
    omega_r : float
        Rotor speed, taken as constant [rad/s].
    R_i : float
        Bore radius [m].
    race_inertia : float
        Polar inertia of the race with what spins with it [kg m²].
    drag_coefficient : float
        Drag torque of the race over force and half the pitch diameter [1].
    D_pw : float
        Pitch diameter [m].
    duration : float
        Time from the first contact [s].

    Returns
    -------
    tuple of float
        Heat of sliding and heat of rolling [J].

    Notes
    -----
    Sliding: ``μ F (ω R t − ½ α R t²)`` with the race's angular acceleration ``α = μ F R / I``, until the race
    has spun up; then ``½ I ω²`` in all. Rolling: ``k F D_pw/2 ω_i`` summed over the race's spin.
    Source: energy balance of Neisi 2020, eqs. (11) and (12), at constant rotor speed and without bounce.
    Not validated: against a measured temperature.
    """
    if mu * F_r <= 0.0:
        return 0.0, 0.0
    spin_up = race_spin_up_time(race_inertia, mu, F_r, R_i, omega_r)
    slip_time = min(duration, spin_up)
    acceleration = omega_r / spin_up
    sliding = mu * F_r * R_i * (omega_r * slip_time - 0.5 * acceleration * slip_time**2)
    turned = 0.5 * acceleration * slip_time**2 + omega_r * (duration - slip_time)
    return sliding, drag_coefficient * F_r * 0.5 * D_pw * turned


def growth_of_race(heat: float, mass: float, R_i: float) -> tuple[float, float]:
    """Warming [K] and radial growth [m] of a steel race of a mass [kg] and bore radius [m] by a heat [J].

    All of the heat stays in the race.
    Source: heat capacity and thermal expansion of bearing steel, 460 J/(kg K) and 12e-6 1/K.
    """
    warming = heat / (mass * STEEL_HEAT_CAPACITY)
    return warming, STEEL_EXPANSION * warming * R_i
