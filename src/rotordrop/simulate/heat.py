"""Heat beside the time loop: temperatures stand still for a stretch, and what it lost warms the nodes.

Preload and air gap follow the temperatures between stretches. A race warms by a kelvin in 10 ms at most, so
the stretches are long against an impact; the work that growth does on balls and contacts is booked, so that
the balance of energy closes as before. Bearings that stay cold cost nothing: no kernel knows of heat.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.physics import ball_set, ball_table, ring, thermal
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.simulate import _rhs as R
from rotordrop.simulate._histories import stored_energy
from rotordrop.units import format_quantity

WARMED = 0.05
"""Kelvins by which a node may warm within a stretch, by the stretch before: a hundredth of the preload of a
70 mm pair."""
SHORTEST, LONGEST = 5e-4, 1.0
"""Bounds of a stretch [s]: half a millisecond is an impact."""
CALMED = 0.7
"""What is left of a rate of warming after a stretch, at least [1]: a rotor in flight comes back."""
Grade = Literal["good", "warning", "bad"]
NODES = ("landing sleeve", "skin of the race", "race", "balls", "outer race", "housing")
SOFTENS = 130.0
"""Warming [K] of a race from which bearing steel, tempered at 150 to 200 °C, loses hardness."""
SHIFTED = 1.5
"""Factor on a preload, either way, from which it is a warning [1]; chosen, not measured."""
STIFFEST = 1e4
"""Rate [1/s] at which the drag of a preload stops a race at most: that of a runaway would be stiff, and the
scheme for settled rotors lost its balance of energy at 5e4. Below some tenths of a rad/s a race creeps."""
LOOSE = 0.02
"""Share of the preload of the start below which balls count as loose [1]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Heat:
    """How the bearings of a drop or coast-down warmed; axes: instant S, bearing B, node.

    Temperatures are above those of the start. A bearing without a table 'thermal' has NaN.
    """

    time: Array
    """Instants [s], shape (S,)."""
    temperature: Array
    """Temperatures of the `NODES` above the start [K], shape (S, B, 6)."""
    growth: Array
    """Way by which every ball is pressed further into its grooves [m], shape (S, B)."""
    gap: Array
    """Air gap [m], shape (S, B)."""
    preload: Array
    """Axial force of a row with the race in the middle [N], shape (S, B)."""
    taken: Array
    gone: Array
    held: Array
    """Heat that the bearings took up, that went on to rotor and surroundings, and that their nodes hold at
    the end [J], shape (B,)."""

    @property
    def warmed(self) -> tuple[int, ...]:
        """Bearings that warm."""
        return tuple(int(b) for b in np.flatnonzero(np.isfinite(self.taken)))

    def race(self, b: int) -> Array:
        """Mean temperature of a race with its skin above the start [K], shape (S,)."""
        skin, rest = self.temperature[:, b, thermal.SKIN], self.temperature[:, b, thermal.RACE]
        return thermal.SKIN_SHARE * skin + (1.0 - thermal.SKIN_SHARE) * rest

    def hottest(self, b: int) -> tuple[float, float, float]:
        """Largest mean temperature of a race [K above the start], when [s], and over its housing then [K]."""
        race = self.race(b)
        at = int(np.argmax(race))
        over = float(race[at] - self.temperature[at, b, thermal.HOUSING])
        return float(race[at]), float(self.time[at]), over

    def sentence(self, b: int, name: str) -> tuple[str, Grade]:
        """What the heat of one bearing did, and how it is to be taken."""
        race, when, over = self.hottest(b)
        start, end = float(self.preload[0, b]), float(self.preload[-1, b])
        most = int(np.argmax(self.preload[:, b]))
        least, largest = float(np.min(self.preload[:, b])), float(self.preload[most, b])
        hot, instant = format_quantity(over, "temperature"), format_quantity(when, "time")
        text = f"{name}: the race reaches {hot} above the housing {instant} after power-off"
        grade: Grade = "good"
        if largest > 0.0:
            first, last = (format_quantity(one, "force") for one in (start, end))
            text += f"; preload of a row {first} → {last}"
            if not start / SHIFTED <= least <= largest <= SHIFTED * start:
                grade = "warning"
        if largest > SHIFTED * max(start, end):
            peak, at = format_quantity(largest, "force"), format_quantity(self.time[most], "time")
            text += f", {peak} at {at}"
        if start > 0.0 and (loose := np.flatnonzero(self.preload[:, b] < LOOSE * start)).size:
            text += f"; without any from {format_quantity(self.time[loose[0]], 'time')} on: balls lie loose"
            grade = "bad"
        if race >= SOFTENS:
            text += f"; at {format_quantity(race, 'temperature')} above the start its steel loses hardness"
            grade = "bad"
        return f"{text}.", grade

    def sentences(self, names: tuple[str, ...]) -> Iterator[tuple[str, Grade]]:
        """What the heat of each bearing did, by the names of all."""
        return (self.sentence(b, names[b]) for b in self.warmed)

    def as_json(self, names: tuple[str, ...]) -> dict[str, Any]:
        """Numbers of every bearing that warms, SI units."""
        return {names[b]: self._numbers(b, names[b]) for b in self.warmed}

    def _numbers(self, b: int, name: str) -> dict[str, Any]:
        nodes, preload = {}, self.preload[:, b]
        for over, called in zip(self.temperature[:, b].T, NODES, strict=True):
            at = int(np.argmax(over))
            nodes[called] = {"largest_K": over[at], "time_s": self.time[at], "end_K": over[-1]}
        race, when, over_housing = self.hottest(b)
        most = int(np.argmax(preload))
        return stated(
            self,
            "race_K nodes preload_N air_gap_end_m heat_J statement",
            race_K={"largest": race, "time_s": when, "above_housing": over_housing},
            nodes=nodes,
            preload_N={
                "start": preload[0],
                "largest": preload[most],
                "time_s": self.time[most],
                "end": preload[-1],
            },
            air_gap_end_m=self.gap[-1, b],
            heat_J={"taken": self.taken[b], "gone": self.gone[b], "held": self.held[b]},
            statement=self.sentence(b, name)[0],
        )


def warms(p: KernelParameters) -> NDArray[np.int64]:
    """Bearings that warm, shape (H,)."""
    return np.flatnonzero(p.bearing[:, L.THERMAL + thermal.CAPACITY] > 0.0)


def remembered(p: KernelParameters, memory: Array) -> Array:
    """What the memory holds of bearings that warm, a view of shape (H, 9): see `physics.thermal`."""
    return memory[: len(warms(p)) * thermal.N_MEMORY].reshape(-1, thermal.N_MEMORY)


def preload_of(b: int, p: KernelParameters, y: Array) -> tuple[float, float]:
    """Axial force of a row of a bearing with its race in the middle [N], and the force that brakes it [N]."""
    row = p.bearing[b]
    entries, count = row[L.ROLLING : L.ROLLING_END], float(row[L.THERMAL + thermal.ROW_BALLS])
    if row[L.FAST_SPEED_STEP] > 0.0:
        spin = float(y[p.bearing_at[b, L.RACE_SPIN]])
        grid = row[L.FAST : L.FAST_END]
        axial, load = ball_table.fast_centred_row(grid, p.ball_table[b], spin, count)
    elif p.bearing_at[b, L.RING_STATES] >= 0:
        way = float(y[p.bearing_at[b, L.RING_STATES]])
        axial = load = float(ring.spring_force(row[L.RING : L.RING_END], entries, way)[0])
    else:
        axial, load = ball_set.centred_row(entries, 0.0, count)
    rows = float(row[L.THERMAL + thermal.ROWS])
    # rows whose play the heat closes are pressed all around without any axial force
    return axial, rows * (axial if row[L.AXIAL_OFFSET] > 0.0 else load)


def warmed(p: KernelParameters, memory: Array, y: Array) -> KernelParameters:
    """Parameters of a machine as its temperatures make them, at a state (n,); the same where all is cold."""
    hot = warms(p)
    if not hot.size:
        return p
    bearing = p.bearing.copy()
    now = p._replace(bearing=bearing)
    for b, kept in zip(hot, remembered(p, memory), strict=True):
        row, heat, nodes = bearing[b], bearing[b, L.THERMAL : L.THERMAL_END], kept[: thermal.N_NODES]
        grown = thermal.growth(heat, nodes)
        row[L.RADIAL_OFFSET] += grown
        row[L.FAST + ball_table.TOUCH] -= grown
        row[L.RING + ring.GROWN] = grown
        row[L.AIR_GAP] += thermal.gap_growth(heat, nodes, row[L.BORE_RADIUS], row[L.ROTOR_RADIUS])
        row[L.PRESSED] = preload_of(int(b), now, y)[1]
        stops = 0.5 * row[L.DRAG_COEFFICIENT] * row[L.PITCH_DIAMETER] * row[L.PRESSED] / row[L.RACE_INERTIA]
        row[L.DRAG_SPEED] = max(row[L.DRAG_SPEED], stops / STIFFEST)
    return now


@dataclass(kw_only=True)
class Warming:
    """What goes on beside the time loop while bearings warm; all that a run goes on from is in the memory."""

    cold: KernelParameters
    networks: tuple[thermal.HeatNetwork, ...] = field(init=False)

    def __post_init__(self) -> None:
        rows = self.cold.bearing[warms(self.cold), L.THERMAL : L.THERMAL_END]
        self.networks = tuple(thermal.HeatNetwork.of_entries(row) for row in rows)

    def stretch(self, memory: Array) -> float:
        """How long the temperatures may stand still [s]."""
        change = float(np.max(remembered(self.cold, memory)[:, thermal.CHANGE]))
        return min(max(WARMED / change, SHORTEST), LONGEST) if change else SHORTEST

    def until(self, memory: Array, t: float, end: float) -> float:
        """Until when they may, from a time on, at most to an end [s]."""
        stop = t + self.stretch(memory)
        return end if stop > end - 0.5 * SHORTEST else stop

    def take(self, memory: Array, lost: Array, time: float) -> None:
        """Warm the nodes by what a stretch of a time [s] lost by place, (B + 1, 5) [J]."""
        kept = remembered(self.cold, memory)
        for b, network, entry in zip(warms(self.cold), self.networks, kept, strict=True):
            heat, place = self.cold.bearing[b, L.THERMAL : L.THERMAL_END], lost[b]
            slip, rolling = place[R.SLIDING] + place[R.IN_CONTACT], place[R.BALL_SET] + place[R.DRAG]
            joules = thermal.node_powers(heat, float(slip), float(rolling), float(place[R.SUPPORT]))
            before = entry[: thermal.N_NODES].copy()
            after, gone = network.after(before, joules / time, time)
            entry[: thermal.N_NODES] = after
            entry[thermal.TAKEN] += float(np.sum(joules))
            entry[thermal.GONE] += gone
            # of what makes the balls grow; the skin is there and gone
            change = max(
                abs(thermal.race_temperature(after) - thermal.race_temperature(before)),
                float(np.max(np.abs(after - before)[thermal.BALLS :])),
            )
            expected = CALMED * (entry[thermal.CHANGE] or WARMED / SHORTEST)
            entry[thermal.CHANGE] = max(change / time, expected, WARMED / LONGEST)

    def grow(self, memory: Array, t: float, y: Array, before: KernelParameters) -> KernelParameters:
        """Parameters with the temperatures of now; the work of the growth is booked in the state."""
        now = warmed(self.cold, memory, y)
        gained = stored_energy(t, y, now, True) - stored_energy(t, y, before, True)
        y[self.cold.rotor_at[L.WORK_IN]] += gained
        return now

    def row(self, memory: Array, t: float, y: Array, now: KernelParameters) -> Array:
        """One instant for `heat_of`: time, and temperatures, growth, gap and preload of every bearing."""
        values = np.full((len(now.bearing), thermal.N_NODES + 3), np.nan)
        for b, kept in zip(warms(self.cold), remembered(self.cold, memory), strict=True):
            nodes = kept[: thermal.N_NODES]
            values[b, : thermal.N_NODES] = nodes
            grown = thermal.growth(now.bearing[b, L.THERMAL : L.THERMAL_END], nodes)
            axial, _ = preload_of(int(b), now, y)
            values[b, thermal.N_NODES :] = grown, now.bearing[b, L.AIR_GAP], axial
        return np.concatenate([[t], values.ravel()])

    def heat_of(self, rows: list[Array], memory: Array) -> Heat:
        """The history of instants, with where the heat is."""
        table = np.array(rows)
        n_b, n = len(self.cold.bearing), thermal.N_NODES
        values = table[:, 1:].reshape(len(table), n_b, n + 3)
        kept, books = remembered(self.cold, memory), np.full((3, n_b), np.nan)
        books[0, warms(self.cold)], books[1, warms(self.cold)] = kept[:, thermal.TAKEN], kept[:, thermal.GONE]
        books[2, warms(self.cold)] = [
            float(np.sum(network.capacity * entry[:n]))
            for network, entry in zip(self.networks, kept, strict=True)
        ]
        return Heat(
            time=table[:, 0], temperature=values[..., :n], growth=values[..., n], gap=values[..., n + 1],
            preload=values[..., n + 2], taken=books[0], gone=books[1], held=books[2],
        )  # fmt: skip
