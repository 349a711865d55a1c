"""Where each state and each bearing parameter lives in the flat arrays of the compiled drop model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Columns of `KernelParameters.bearing`, one row per touchdown bearing; SI units.
AIR_GAP = 0
ROTOR_RADIUS = 1
BORE_RADIUS = 2
CONTACT_STIFFNESS = 3
CONTACT_EXPONENT = 4
CONTACT_DAMPING = 5
FRICTION_STATIC = 6
FRICTION_DYNAMIC = 7
STRIBECK_SPEED = 8
SMOOTHING_SPEED = 9
RACE_MASS = 10
RACE_INERTIA = 11
DRAG_COEFFICIENT = 12
DRAG_SPEED = 13
PITCH_DIAMETER = 14
BALL_STIFFNESS = 15
GROOVE_DISTANCE = 16
RADIAL_OFFSET = 17
AXIAL_OFFSET = 18
BEARING_DAMPING = 19
STRESS_COEFFICIENT = 20
SUPPORT_MASS_X = 21
SUPPORT_MASS_Y = 22
SUPPORT_STIFFNESS_X = 23
SUPPORT_STIFFNESS_Y = 24
SUPPORT_DAMPING_X = 25
SUPPORT_DAMPING_Y = 26
RACE_WEIGHT = 27
N_BEARING_COLUMNS = 28

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


class KernelParameters(NamedTuple):
    """Everything the right-hand side reads, as flat arrays in SI units; m modes, B bearings, A magnets, Z
    balls.

    Columns and entries are named in this module.
    """

    eigenvalue: Array
    damping: Array
    polar: Array
    gravity: Array
    unbalance_cos: Array
    unbalance_sin: Array
    bearing_shape: Array
    bearing: Array
    ball_cos: Array
    ball_sin: Array
    ball_weight: Array
    magnet_shape: Array
    magnet: Array
    spin: Array
    flags: NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class StateLayout:
    """Slices of the state vector: coordinates, their velocities in the same order, then spins and work.

    The coordinates are modal amplitudes in x, modal amplitudes in y [sqrt(kg) m], then per bearing the race
    (x, y) and after all races the supports (x, y) [m]. After the velocities come the race spins [rad/s], the
    rotor speed [rad/s], the rotor angle [rad], the energy dissipated [J] and the work put in from outside
    [J].
    """

    n_modes: int
    n_bearings: int

    @property
    def n_coordinates(self) -> int:
        """Number of displacement coordinates."""
        return 2 * self.n_modes + 4 * self.n_bearings

    @property
    def size(self) -> int:
        """Length of the state vector."""
        return 2 * self.n_coordinates + self.n_bearings + 4

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
        start = 2 * self.n_modes + 2 * self.n_bearings
        return slice(start, start + 2 * self.n_bearings)

    def velocity_of(self, coordinates: slice) -> slice:
        """Slice of the velocities that belong to a slice of coordinates."""
        return slice(coordinates.start + self.n_coordinates, coordinates.stop + self.n_coordinates)

    @property
    def race_spin(self) -> slice:
        """Race spins."""
        start = 2 * self.n_coordinates
        return slice(start, start + self.n_bearings)

    @property
    def rotor_speed(self) -> int:
        """Index of the rotor speed."""
        return 2 * self.n_coordinates + self.n_bearings

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
        return (
            *coordinates,
            *rates,
            *spins,
            "rotor speed",
            "rotor angle",
            "dissipated energy",
            "work put in",
        )

    def zeros(self) -> Array:
        """State with everything at zero."""
        return np.zeros(self.size)
