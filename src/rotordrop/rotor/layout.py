"""Where each state and each bearing parameter lives in the flat arrays of the compiled drop model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import ball_set, contact, support

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of `KernelParameters.bearing`, one row per touchdown bearing; SI units. The contact law and the ball
# set are blocks of columns that only their own modules read.
AIR_GAP = 0
ROTOR_RADIUS = 1
BORE_RADIUS = 2
FRICTION_STATIC = 3
FRICTION_DYNAMIC = 4
STRIBECK_SPEED = 5
SMOOTHING_SPEED = 6
RACE_MASS = 7
RACE_INERTIA = 8
DRAG_COEFFICIENT = 9
DRAG_SPEED = 10
PITCH_DIAMETER = 11
BEARING_DAMPING = 12
SUPPORT_MASS_X = 13
SUPPORT_MASS_Y = 14
SUPPORT_STIFFNESS_X = 15
SUPPORT_STIFFNESS_Y = 16
SUPPORT_DAMPING_X = 17
SUPPORT_DAMPING_Y = 18
RACE_WEIGHT = 19
CONTACT = 20
CONTACT_END = CONTACT + contact.N_ENTRIES
CONTACT_STIFFNESS = CONTACT + contact.STIFFNESS
CONTACT_EXPONENT = CONTACT + contact.EXPONENT
CONTACT_DAMPING = CONTACT + contact.DAMPING
BALL_SET = CONTACT_END
BALL_SET_END = BALL_SET + ball_set.N_ENTRIES
BALL_STIFFNESS = BALL_SET + ball_set.BALL_STIFFNESS
GROOVE_DISTANCE = BALL_SET + ball_set.GROOVE_DISTANCE
RADIAL_OFFSET = BALL_SET + ball_set.RADIAL_OFFSET
AXIAL_OFFSET = BALL_SET + ball_set.AXIAL_OFFSET
STRESS_COEFFICIENT = BALL_SET + ball_set.STRESS_COEFFICIENT
SUPPORT_FORM = BALL_SET_END
SUPPORT_FORM_END = SUPPORT_FORM + support.N_ENTRIES
SUPPORT_COUPLING = SUPPORT_FORM + support.COUPLING
SUPPORT_CUBIC = SUPPORT_FORM + support.CUBIC
FOUNDATION_SHARE = SUPPORT_FORM + support.FOUNDATION_SHARE
FOUNDATION_SPEED = SUPPORT_FORM + support.FOUNDATION_SPEED
FOUNDATION_DAMPING = SUPPORT_FORM + support.FOUNDATION_DAMPING
N_BEARING_COLUMNS = SUPPORT_FORM_END
FOUNDATION_STATES = 4

# Entries of `KernelParameters.spin`.
POLAR_INERTIA = 0
INITIAL_SPEED = 1
AERO_TIME_CONSTANT = 2
AERO_LINEAR = 3
AERO_QUADRATIC = 4
POWER_OFF_DELAY = 5
REMANENCE_TIME_CONSTANT = 6
N_SPIN_ENTRIES = 7

# Entries of `KernelParameters.flags`.
SPIN_MODE = 0
MAGNETS_ACT = 1
N_FLAGS = 2

# Columns of `KernelParameters.magnet`, one row per AMB: remanent force, holding force [N], spring, damper,
# reference.
REMANENT_X = 0
REMANENT_Y = 1
HOLDING_X = 2
HOLDING_Y = 3
AMB_STIFFNESS = 4
AMB_DAMPING = 5
AMB_REFERENCE_X = 6
AMB_REFERENCE_Y = 7
N_MAGNET_COLUMNS = 8

# Entries of `KernelParameters.rotor_at`: where the states of the rotor, its books and the whole vector stand.
# The velocity of a coordinate stands N_COORDINATES behind it. The step control looks at the first
# N_CONTROLLED states, the filter estimates the first N_DYNAMIC.
MODES_X = 0
MODES_Y = 1
ROTOR_SPEED = 2
ROTOR_ANGLE = 3
DISSIPATED = 4
WORK_IN = 5
N_COORDINATES = 6
N_CONTROLLED = 7
N_DYNAMIC = 8
N_STATES = 9
N_ROTOR_PLACES = 10

# Columns of `KernelParameters.bearing_at`, one row per touchdown bearing: place of its race and of its
# support (x, then y), of the spin of its race and of the first of its further states; -1 where it has none.
RACE = 0
SUPPORT = 1
RACE_SPIN = 2
BEARING_OWN = 3
N_BEARING_PLACES = 4

# Columns of `KernelParameters.magnet_at`, one row per AMB: place of the first of its states; -1 without any.
MAGNET_OWN = 0
N_MAGNET_PLACES = 1

# Kinds of states: they set error scale, process noise and prior.
POSITION, VELOCITY, SPIN, INTERNAL, ANGLE, AUDIT = range(6)


class KernelParameters(NamedTuple):
    """Everything the right-hand side reads, as flat arrays in SI units; m modes, B bearings, A magnets, Z
    balls.

    Columns and entries are named in this module. ``balls`` (B, 3, Z8) are the balls of `physics.ball_set`;
    ``rotor_at``, ``bearing_at`` (B, ·) and ``magnet_at`` (A, ·) say where the states of each owner stand, so
    that no kernel computes a place from the numbers of modes and bearings.
    """

    eigenvalue: Array
    damping: Array
    polar: Array
    gravity: Array
    unbalance_cos: Array
    unbalance_sin: Array
    bearing_shape: Array
    bearing: Array
    balls: Array
    magnet_shape: Array
    magnet: Array
    spin: Array
    flags: Integers
    rotor_at: Integers
    bearing_at: Integers
    magnet_at: Integers


@dataclass(frozen=True, kw_only=True)
class StateLayout:
    """Slices of the state vector: coordinates, their velocities in the same order, then spins and work.

    The coordinates are modal amplitudes in x, modal amplitudes in y [sqrt(kg) m], then per bearing the race
    (x, y) and after all races the supports (x, y) [m]. After the velocities come the race spins [rad/s], the
    further states of bearings and AMBs that have some, the rotor speed [rad/s], the rotor angle [rad], the
    energy dissipated [J] and the work put in from outside [J].

    Attributes
    ----------
    n_modes, n_bearings : int
        Modes per plane, touchdown bearings.
    bearing_own, magnet_own : tuple of int
        Number of further states of each touchdown bearing and of each AMB; empty where none has any. Those
        of a bearing are displacement (x, y) and velocity (x, y) of its foundation.
    sensor_own : int
        Number of sensors that lag behind, each with the reading that it has got to [m].
    """

    n_modes: int
    n_bearings: int
    bearing_own: tuple[int, ...] = ()
    magnet_own: tuple[int, ...] = ()
    sensor_own: int = 0

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
        """Places of the states of each bearing, shape (B, 4), see ``RACE`` and the names beside it."""
        places = np.empty((self.n_bearings, N_BEARING_PLACES), dtype=np.int64)
        count = np.arange(self.n_bearings)
        places[:, RACE] = self.race.start + 2 * count
        places[:, SUPPORT] = self.support.start + 2 * count
        places[:, RACE_SPIN] = self.race_spin.start + count
        places[:, BEARING_OWN] = _first_of(self.bearing_own, self.own.start, self.n_bearings)
        return places

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
