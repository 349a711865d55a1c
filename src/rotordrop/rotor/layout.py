"""Where each state lives in the state vector of the compiled drop model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics.columns import (
    ANGLE,
    AUDIT,
    BEARING_OWN,
    CONTACTS,
    CONTACTS_END,
    DISSIPATED,
    INTERNAL,
    MODES_X,
    MODES_Y,
    N_BEARING_PLACES,
    N_CONTROLLED,
    N_COORDINATES,
    N_DYNAMIC,
    N_MAGNET_PLACES,
    N_ROTOR_PLACES,
    N_STATES,
    POSITION,
    RACE,
    RACE_SPIN,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    SPIN,
    SUPPORT,
    VELOCITY,
    WORK_IN,
)

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class StateLayout:
    """Slices of the state vector: coordinates, their velocities in the same order, then spins and work.

    The coordinates are modal amplitudes in x, modal amplitudes in y [sqrt(kg) m], then per bearing the race
    (x, y) and after all races the supports (x, y) [m]. After the velocities come the race spins [rad/s], the
    further states of bearings and AMBs that have some, the rotor speed [rad/s], the rotor angle [rad], the
    energy dissipated [J] and the work put in from outside [J].
    """

    n_modes: int
    n_bearings: int
    """Modes per plane, touchdown bearings."""
    bearing_own: tuple[int, ...] = ()
    magnet_own: tuple[int, ...] = ()
    """Number of further states of each touchdown bearing and of each AMB; empty where none has any. Those of
    a bearing are displacement (x, y) and velocity (x, y) of its foundation."""
    sensor_own: int = 0
    """Number of sensors that lag behind, each with the reading that it has got to [m]."""

    @property
    def n_coordinates(self) -> int:
        """Number of displacement coordinates."""
        return 2 * self.n_modes + 4 * self.n_bearings

    @property
    def size(self) -> int:
        """Length of the state vector."""
        return self.rotor_speed + 4

    @property
    def n_controlled(self) -> int:
        """Number of states that the step control looks at: all before the rotor angle."""
        return self.rotor_angle

    @property
    def n_dynamic(self) -> int:
        """Number of states that the filter estimates: all before the books of energy."""
        return self.dissipated

    @property
    def modal_x(self) -> slice:
        """Modal amplitudes in x."""
        return slice(0, self.n_modes)

    @property
    def modal_y(self) -> slice:
        """Modal amplitudes in y."""
        return slice(self.n_modes, 2 * self.n_modes)

    @property
    def race(self) -> slice:
        """Race displacements, (x, y) per bearing."""
        return slice(2 * self.n_modes, 2 * self.n_modes + 2 * self.n_bearings)

    @property
    def support(self) -> slice:
        """Support displacements, (x, y) per bearing."""
        return slice(self.race.stop, self.race.stop + 2 * self.n_bearings)

    @property
    def velocities(self) -> slice:
        """Velocities of all coordinates."""
        return slice(self.n_coordinates, 2 * self.n_coordinates)

    def velocity_of(self, coordinates: slice) -> slice:
        """Slice of the velocities that belong to a slice of coordinates."""
        return slice(coordinates.start + self.n_coordinates, coordinates.stop + self.n_coordinates)

    @property
    def race_spin(self) -> slice:
        """Race spins."""
        return slice(self.velocities.stop, self.velocities.stop + self.n_bearings)

    @property
    def own(self) -> slice:
        """Further states of bearings, then of AMBs."""
        return slice(self.race_spin.stop, self.race_spin.stop + sum(self.bearing_own) + sum(self.magnet_own))

    @property
    def sensors(self) -> slice:
        """What sensors that lag behind have got to; only the filter moves them."""
        return slice(self.own.stop, self.own.stop + self.sensor_own)

    @property
    def rotor_speed(self) -> int:
        """Index of the rotor speed."""
        return int(self.sensors.stop)

    @property
    def rotor_angle(self) -> int:
        """Index of the rotor angle."""
        return self.rotor_speed + 1

    @property
    def dissipated(self) -> int:
        """Index of the energy dissipated since the start."""
        return self.rotor_speed + 2

    @property
    def work_in(self) -> int:
        """Index of the work put in from outside since the start."""
        return self.rotor_speed + 3

    @property
    def kinds(self) -> Integers:
        """Kind of every state, shape (n,): ``POSITION`` and the names beside it."""
        kinds = np.full(self.size, AUDIT, dtype=np.int64)
        kinds[: self.n_coordinates] = POSITION
        kinds[self.velocities] = VELOCITY
        kinds[self.own.start : self.sensors.stop] = INTERNAL
        kinds[self.race_spin] = SPIN
        kinds[self.rotor_speed] = SPIN
        kinds[self.rotor_angle] = ANGLE
        return kinds

    def rotor_at(self) -> Integers:
        """Places of the rotor's states, the books and the whole, see ``MODES_X`` and the names beside it."""
        places = np.empty(N_ROTOR_PLACES, dtype=np.int64)
        places[MODES_X], places[MODES_Y] = self.modal_x.start, self.modal_y.start
        places[ROTOR_SPEED], places[ROTOR_ANGLE] = self.rotor_speed, self.rotor_angle
        places[DISSIPATED], places[WORK_IN] = self.dissipated, self.work_in
        places[N_COORDINATES], places[N_CONTROLLED] = self.n_coordinates, self.n_controlled
        places[N_DYNAMIC], places[N_STATES] = self.n_dynamic, self.size
        return places

    def bearing_at(self) -> Integers:
        """Places of the states of each bearing, shape (B, 6), see ``RACE`` and the names beside it."""
        places = np.empty((self.n_bearings, N_BEARING_PLACES), dtype=np.int64)
        count = np.arange(self.n_bearings)
        places[:, RACE] = self.race.start + 2 * count
        places[:, SUPPORT] = self.support.start + 2 * count
        places[:, RACE_SPIN] = self.race_spin.start + count
        places[:, BEARING_OWN] = _first_of(self.bearing_own, self.own.start, self.n_bearings)
        places[:, CONTACTS], places[:, CONTACTS_END] = count, count + 1
        return places

    def contact_at(self) -> Integers:
        """Bodies of each contact, shape (C, 3), see ``CONTACT_BODY``: the rotor touches each race."""
        bodies = self.bearing_at()[:, [RACE, RACE_SPIN]]
        return np.column_stack([np.arange(self.n_bearings), bodies]).astype(np.int64)

    def magnet_at(self, n_magnets: int) -> Integers:
        """Places of the states of each AMB, shape (A, 1), see ``MAGNET_OWN``."""
        start = self.own.start + sum(self.bearing_own)
        return _first_of(self.magnet_own, start, n_magnets).reshape(n_magnets, N_MAGNET_PLACES)

    def names(self, bearing_names: tuple[str, ...]) -> tuple[str, ...]:
        """Name of every state, in order."""
        m, axes = self.n_modes, ("x", "y")
        modal = [f"mode {k + 1} {axis}" for axis in axes for k in range(m)]
        ends = [
            f"{part} {name} {axis}" for part in ("race", "support") for name in bearing_names for axis in axes
        ]
        coordinates = modal + ends
        rates = [f"{name} velocity" for name in coordinates]
        spins = [f"race {name} spin" for name in bearing_names]
        own = [f"further state {k + 1}" for k in range(self.sensors.stop - self.own.start)]
        return (
            *coordinates,
            *rates,
            *spins,
            *own,
            "rotor speed",
            "rotor angle",
            "dissipated energy",
            "work put in",
        )

    def zeros(self) -> Array:
        """State with everything at zero."""
        return np.zeros(self.size)


def _first_of(counts: tuple[int, ...], start: int, owners: int) -> Integers:
    """Place of the first state of each owner, shape (owners,); -1 for an owner without any."""
    first = np.full(owners, -1, dtype=np.int64)
    for owner, count in enumerate(counts):
        if count > 0:
            first[owner] = start + sum(counts[:owner])
    return first
