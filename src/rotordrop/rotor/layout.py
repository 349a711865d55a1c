"""Where each state lives in the state vector of the compiled drop model."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.physics import columns as L


@dataclass(frozen=True, kw_only=True)
class StateLayout:
    """Slices of the state vector: coordinates, their velocities in the same order, then spins and work."""

    n_modes: int
    n_bearings: int
    """Modes per plane, touchdown bearings."""
    further: tuple[tuple[int, tuple[tuple[int, ...], ...]], ...] = ()
    """Further states of touchdown bearings: column of `bearing_at` of what has them, their kinds at each
    bearing; nothing where none has any."""
    magnet_own: tuple[int, ...] = ()
    """Number of further states of each AMB; empty where none has any."""
    sensor_own: int = 0
    """Number of sensors that lag behind, each with the reading that it has got to [m]; only the filter moves
    these."""
    raceless: tuple[bool, ...] = ()
    """Whether each bearing has no race, where one has none; the states of what is not there stay zero."""
    moves_axially: bool = False
    """Whether the rotor moves along its axis."""
    modal_x: slice = field(init=False)
    modal_y: slice = field(init=False)
    """Modal amplitudes [sqrt(kg) m]."""
    race: slice = field(init=False)
    support: slice = field(init=False)
    """Displacements of races and supports [m], (x, y) per bearing."""
    velocities: slice = field(init=False)
    """Velocities of all coordinates."""
    race_spin: slice = field(init=False)
    """Race spins [rad/s]."""
    magnets: slice = field(init=False)
    """Further states of AMBs, behind those of bearings."""
    sensors: slice = field(init=False)
    """What sensors that lag behind have got to [m]."""
    axial: int = field(init=False, default=-1)
    """Axial displacement of the rotor [m], its velocity behind it; -1 where it has none."""
    rotor_speed: int = field(init=False)
    rotor_angle: int = field(init=False)
    """Speed [rad/s] and angle [rad] of the rotor."""
    dissipated: int = field(init=False)
    work_in: int = field(init=False)
    """Energy dissipated and work put in from outside since the start [J]."""
    kinds: Integers = field(init=False, repr=False, compare=False)
    """Kind of every state, shape (n,): ``POSITION`` and the names beside it."""

    def __post_init__(self) -> None:
        m, b = self.n_modes, self.n_bearings
        further = [kind for _, each in self.further for kinds in each for kind in kinds]
        blocks: dict[str, tuple[int | None, int]] = {
            "modal_x": (m, L.POSITION),
            "modal_y": (m, L.POSITION),
            "race": (2 * b, L.POSITION),
            "support": (2 * b, L.POSITION),
            "velocities": (2 * m + 4 * b, L.VELOCITY),
            "race_spin": (b, L.SPIN),
            **{f"further {k}": (1, kind) for k, kind in enumerate(further)},
            "magnets": (sum(self.magnet_own), L.INTERNAL),
            "sensors": (self.sensor_own, L.INTERNAL),
            **(
                {"axial": (None, L.POSITION), "axial_velocity": (None, L.VELOCITY)}
                if self.moves_axially
                else {}
            ),
            "rotor_speed": (None, L.SPIN),
            "rotor_angle": (None, L.ANGLE),
            "dissipated": (None, L.AUDIT),
            "work_in": (None, L.AUDIT),
        }
        sizes = [1 if size is None else size for size, _ in blocks.values()]
        for (name, (size, _)), stop in zip(blocks.items(), accumulate(sizes), strict=True):
            if not name.startswith("further") and name != "axial_velocity":
                object.__setattr__(self, name, stop - 1 if size is None else slice(stop - size, stop))
        kinds = np.repeat([kind for _, kind in blocks.values()], sizes).astype(np.int64)
        object.__setattr__(self, "kinds", kinds)

    @classmethod
    def of_machine(cls, machine: Machine, n_modes: int, *, loops: bool = False) -> StateLayout:
        """Give the layout that the elements of a machine ask for, its magnets with ``loops`` only."""
        bearings = machine.touchdown_bearings
        asked = [
            {
                part.states_at: tuple(part.further_states.values())
                for part in bearing.parts
                if part.further_states
            }
            for bearing in bearings
        ]
        # by column, not by part: who lists the parts of a bearing otherwise moves no state
        places = sorted({place for states in asked for place in states})
        raceless = tuple("race" not in one.masses for one in bearings)
        return cls(
            n_modes=n_modes,
            n_bearings=len(bearings),
            further=tuple((place, tuple(one.get(place, ()) for one in asked)) for place in places),
            magnet_own=tuple(len(amb.further_states) for amb in machine.ambs) if loops else (),
            raceless=raceless if any(raceless) else (),
            sensor_own=sum(len(sensor.further_states) for sensor in machine.sensors),
            moves_axially=machine.axial,
        )

    @property
    def n_coordinates(self) -> int:
        """Number of displacement coordinates."""
        return 2 * self.n_modes + 4 * self.n_bearings

    @property
    def size(self) -> int:
        """Length of the state vector."""
        return len(self.kinds)

    @property
    def n_controlled(self) -> int:
        """Number of states that the step control looks at: all before the rotor angle."""
        return self.rotor_angle

    @property
    def n_dynamic(self) -> int:
        """Number of states that the filter estimates: all before the books of energy."""
        return self.dissipated

    def further_at(self, place: int) -> slice:
        """Slice of the further states of all bearings of one column of `bearing_at`; empty without any."""
        stop = self.race_spin.stop
        for at, each in self.further:
            start, stop = stop, stop + sum(map(len, each))
            if at == place:
                return slice(start, stop)
        return slice(stop, stop)

    def velocity_of(self, coordinates: slice) -> slice:
        """Slice of the velocities that belong to a slice of coordinates."""
        return slice(coordinates.start + self.n_coordinates, coordinates.stop + self.n_coordinates)

    def rotor_at(self) -> Integers:
        """Places of the rotor's states, the books and the whole, see ``MODES_X`` and the names beside it."""
        places = np.empty(L.N_ROTOR_PLACES, dtype=np.int64)
        places[L.MODES_X], places[L.MODES_Y] = self.modal_x.start, self.modal_y.start
        places[L.ROTOR_SPEED], places[L.ROTOR_ANGLE] = self.rotor_speed, self.rotor_angle
        places[L.DISSIPATED], places[L.WORK_IN] = self.dissipated, self.work_in
        places[L.N_COORDINATES], places[L.N_CONTROLLED] = self.n_coordinates, self.n_controlled
        places[L.N_DYNAMIC], places[L.N_STATES] = self.n_dynamic, self.size
        places[L.AXIAL] = self.axial
        return places

    def bearing_at(self) -> Integers:
        """Places of the states of each bearing, shape (B, 9), see ``RACE`` and the names beside it."""
        places = np.full((self.n_bearings, L.N_BEARING_PLACES), -1, dtype=np.int64)
        count = np.arange(self.n_bearings)
        places[:, L.RACE] = self.race.start + 2 * count
        places[:, L.SUPPORT] = self.support.start + 2 * count
        places[:, L.RACE_SPIN] = self.race_spin.start + count
        for place, each in self.further:
            counts = tuple(map(len, each))
            places[:, place] = _first_of(counts, self.further_at(place).start, self.n_bearings)
        places[np.array(self.raceless, dtype=bool).nonzero(), L.RACE] = -1
        places[:, L.CONTACTS], places[:, L.CONTACTS_END] = count, count + 1
        return places

    def contact_at(self) -> Integers:
        """Bodies of each contact, shape (C, 3), see ``CONTACT_BODY``: the rotor touches a race or sleeve."""
        bodies = self.bearing_at()[:, [L.RACE, L.RACE_SPIN]]
        for b in np.flatnonzero(bodies[:, 0] < 0):  # a sleeve: the rotor touches the support, which stands
            bodies[b] = self.support.start + 2 * b, -1
        # C order, as all arrays of the kernels: another order of one compiles every kernel once more.
        return np.column_stack([np.arange(self.n_bearings), bodies]).astype(np.int64, order="C")

    def magnet_at(self, remembered: tuple[int, ...], first: int) -> Integers:
        """Places of each AMB, shape (A, 2), see ``MAGNET_OWN``: of its states and what it has remembered.

        Their numbers of entries in the memory, whose ``first`` of magnets is given.
        """
        own = _first_of(self.magnet_own, self.magnets.start, len(remembered))
        return np.column_stack([own, _first_of(remembered, first, len(remembered))]).astype(
            np.int64, order="C"
        )

    def names(self, bearings: tuple[TouchdownBearing, ...]) -> tuple[str, ...]:
        """Name of every state, in order."""
        axes, bearing_names = ("x", "y"), [bearing.name for bearing in bearings]
        coordinates = [f"mode {k + 1} {axis}" for axis in axes for k in range(self.n_modes)]
        coordinates += [
            f"{part} {name} {axis}" for part in ("race", "support") for name in bearing_names for axis in axes
        ]
        return (
            *coordinates,
            *(f"{name} velocity" for name in coordinates),
            *(f"race {name} spin" for name in bearing_names),
            *self._names_of_further(bearings),
            *((ROTOR_AXIAL, f"{ROTOR_AXIAL} velocity") if self.moves_axially else ()),
            *("rotor speed", "rotor angle", "dissipated energy", "work put in"),
        )

    def _names_of_further(self, bearings: tuple[TouchdownBearing, ...]) -> tuple[str, ...]:
        names = [f"further state {k + 1}" for k in range(self.sensors.stop - self.race_spin.stop)]
        for bearing, first in zip(bearings, self.bearing_at(), strict=True):
            for part in bearing.parts:
                called = [name.format(bearing.name) for name in part.further_states]
                at = first[part.states_at] - self.race_spin.stop
                names[at : at + len(called)] = called
        return tuple(names)

    def bore(self, states: Array) -> Array:
        """Displacement [m] of what the rotor meets in states (T, n): race, or support where none is."""
        race: Array = states[:, self.race].reshape(len(states), -1, 2)
        if not self.raceless:
            return race
        support = states[:, self.support].reshape(len(states), -1, 2)
        return np.where(np.array(self.raceless)[:, None], support, race)

    def support_deflection(self, states: Array, b: int) -> Array:
        """Deflection [m] of a support, shape (T, 2), against its foundation in states (T, n)."""
        at = self.bearing_at()[b]
        moved, own = states[:, at[L.SUPPORT] : at[L.SUPPORT] + 2], at[L.BEARING_OWN]
        return moved if own < 0 else moved - states[:, own : own + 2]

    def zeros(self) -> Array:
        """State with everything at zero."""
        return np.zeros(self.size)


ROTOR_AXIAL = "rotor axial"
"""Name of the state that holds the axial displacement of the rotor."""


def _first_of(counts: tuple[int, ...], start: int, owners: int) -> Integers:
    """Place of the first state of each owner, shape (owners,); -1 for an owner without any."""
    first = np.full(owners, -1, dtype=np.int64)
    for owner, count in enumerate(counts):
        if count > 0:
            first[owner] = start + sum(counts[:owner])
    return first
