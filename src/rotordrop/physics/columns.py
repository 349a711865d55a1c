"""The flat arrays the compiled drop model reads: which column holds what, and where each state stands."""

from __future__ import annotations

from typing import NamedTuple

from rotordrop.arrays import Array, Integers
from rotordrop.physics import (
    ball_set,
    ball_table,
    contact,
    face,
    landing_sleeve,
    magnet,
    mount,
    ring,
    support,
    thermal,
    touch,
)
from rotordrop.physics._compile import FULL, PLAIN, Form, by_reference

# Columns of `KernelParameters.bearing`, one row per touchdown bearing; SI units. The contact law and the ball
# set are blocks of columns that only their own modules read.
TOUCH = 0
TOUCH_END = TOUCH + touch.N_ENTRIES
AIR_GAP = TOUCH + touch.AIR_GAP
ROTOR_RADIUS = TOUCH + touch.ROTOR_RADIUS
BORE_RADIUS = TOUCH + touch.BORE_RADIUS
FRICTION_STATIC = TOUCH + touch.FRICTION_STATIC
FRICTION_DYNAMIC = TOUCH + touch.FRICTION_DYNAMIC
STRIBECK_SPEED = TOUCH + touch.STRIBECK_SPEED
SMOOTHING_SPEED = TOUCH + touch.SMOOTHING_SPEED
CONTACT = TOUCH + touch.LAW
CONTACT_END = CONTACT + contact.N_ENTRIES
CONTACT_STIFFNESS = CONTACT + contact.STIFFNESS
CONTACT_EXPONENT = CONTACT + contact.EXPONENT
CONTACT_DAMPING = CONTACT + contact.DAMPING
RACE_MASS, RACE_INERTIA, RACE_WEIGHT, ROLLING = range(TOUCH_END, TOUCH_END + 4)
ROLLING_END = ROLLING + ball_set.ROLLING_N_ENTRIES
BALL_SET = ROLLING
BALL_SET_END = BALL_SET + ball_set.N_ENTRIES
BALL_STIFFNESS = BALL_SET + ball_set.BALL_STIFFNESS
GROOVE_DISTANCE = BALL_SET + ball_set.GROOVE_DISTANCE
RADIAL_OFFSET = BALL_SET + ball_set.RADIAL_OFFSET
AXIAL_OFFSET = BALL_SET + ball_set.AXIAL_OFFSET
STRESS_COEFFICIENT = BALL_SET + ball_set.STRESS_COEFFICIENT
# What is estimated of the set behind the race: of balls the axial offset of their rows [m].
SET_UNKNOWN = AXIAL_OFFSET
DRAG_COEFFICIENT = ROLLING + ball_set.DRAG_COEFFICIENT
DRAG_SPEED = ROLLING + ball_set.DRAG_SPEED
PITCH_DIAMETER = ROLLING + ball_set.PITCH_DIAMETER
BEARING_DAMPING = ROLLING + ball_set.DAMPING
PRESSED = ROLLING + ball_set.PRESSED
LINES = ROLLING + ball_set.LINES
SUPPORT_MASS_X, SUPPORT_MASS_Y, SUPPORT_STIFFNESS_X = range(ROLLING_END, ROLLING_END + 3)
SUPPORT_STIFFNESS_Y, SUPPORT_DAMPING_X, SUPPORT_DAMPING_Y = range(ROLLING_END + 3, ROLLING_END + 6)
SUPPORT_FORM = ROLLING_END + 6
SUPPORT_FORM_END = SUPPORT_FORM + support.N_ENTRIES
MOUNT = SUPPORT_FORM_END
MOUNT_END = MOUNT + mount.N_ENTRIES
RING = MOUNT_END
RING_END = RING + ring.N_ENTRIES
FAST = RING_END
FAST_END = FAST + ball_table.N_ENTRIES
FAST_SPEED_STEP = FAST + ball_table.SPEED_STEP
FACE = FAST_END
FACE_END = FACE + face.N_ENTRIES
THERMAL = FACE_END
THERMAL_END = THERMAL + thermal.N_ENTRIES
LANDING_SLEEVE = THERMAL_END
LANDING_SLEEVE_END = LANDING_SLEEVE + landing_sleeve.N_ENTRIES
NOT_ROUND = LANDING_SLEEVE + landing_sleeve.PRESENT
N_BEARING_COLUMNS = LANDING_SLEEVE_END

# Entries of `KernelParameters.spin`: of the rotor as a whole, how it turns, what holds it along its axis
# and what pushes it sideways.
POLAR_INERTIA, INITIAL_SPEED, AERO_TIME_CONSTANT, AERO_LINEAR, AERO_QUADRATIC, POWER_OFF_DELAY = range(6)
REMANENCE_TIME_CONSTANT, ROTOR_MASS, AXIAL_STIFFNESS, AXIAL_DAMPING, AXIAL_HOLDING, CLOCK_ERROR = range(6, 12)
SIDE_FORCE, N_SPIN_ENTRIES = range(12, 14)

# Entries of `KernelParameters.flags`.
SPIN_MODE, MAGNETS_ACT, LOADS_ACT, LOOPS_ACT, N_FLAGS = range(5)

# Columns of `KernelParameters.magnet`, one row per AMB: remanent force, holding force [N], spring, damper,
# reference, whether it holds on when the others let go.
REMANENT_X, REMANENT_Y, HOLDING_X, HOLDING_Y, AMB_STIFFNESS, AMB_DAMPING, AMB_REFERENCE_X = range(7)
AMB_REFERENCE_Y, AMB_STAYS, N_MAGNET_COLUMNS = range(7, 10)

# Behind these, in a model whose magnets are in the loop: numbers of coils and controller, then the shape (m,)
# of the plane that the controller measures.
LOOP = N_MAGNET_COLUMNS
LOOP_END = LOOP + magnet.N_NUMBERS

# Columns of `KernelParameters.load`, one row per load, that of the ground last: value along x and y, power of
# the speed and its nominal, speed and phase of a sine, first point of its course and the one behind its last,
# whether it is the acceleration of the ground, whether its value along x is one along the axis of the rotor.
LOAD_X, LOAD_Y, LOAD_EXPONENT, LOAD_NOMINAL, LOAD_TURN, LOAD_PHASE, LOAD_FIRST, LOAD_END = range(8)
LOAD_OF_BASE, LOAD_AXIAL, N_LOAD_COLUMNS = range(8, 11)

# Entries of `KernelParameters.rotor_at`: where the states of the rotor, its books and the whole vector stand.
# The velocity of a coordinate stands N_COORDINATES behind it. The step control looks at the first
# N_CONTROLLED states, the filter estimates the first N_DYNAMIC. AXIAL is the place of the axial displacement
# of the rotor, its velocity behind it; -1 where it does not move along its axis.
MODES_X, MODES_Y, ROTOR_SPEED, ROTOR_ANGLE, DISSIPATED, WORK_IN, N_COORDINATES, N_CONTROLLED = range(8)
N_DYNAMIC, N_STATES, AXIAL, N_ROTOR_PLACES = range(8, 12)

# Columns of `KernelParameters.bearing_at`, one row per touchdown bearing: place of its race and of its
# support (x, then y), of the spin of its race and of the first of its further states; -1 where it has none.
# Then its first contact and the one behind its last, and the first state of its mount, of its sprung rings
# and of the axial motion of its race; -1 without one.
RACE, SUPPORT, RACE_SPIN, BEARING_OWN, CONTACTS, CONTACTS_END, MOUNT_STATES, RING_STATES = range(8)
FACE_STATES, N_BEARING_PLACES = range(8, 10)

# Columns of `KernelParameters.contact_at`, one row per contact, those of a bearing side by side: the bearing
# whose row holds its numbers, place of the body that the rotor touches (x, then y), place of the spin of that
# body; -1 where it does not turn.
CONTACT_BEARING, CONTACT_BODY, CONTACT_SPIN = range(3)

# Columns of `KernelParameters.magnet_at`, one row per AMB in the loop: place of the first of its currents
# (x+, x-, y+, y-), and of the first entry that it has in the memory, behind the clock of all.
MAGNET_OWN, MAGNET_MEMORY = range(2)

# Kinds of states: they set error scale, process noise and prior.
POSITION, VELOCITY, SPIN, INTERNAL, ANGLE, HEAT, AUDIT = range(7)
N_KINDS = 7


@by_reference
class KernelParameters(NamedTuple):
    """Everything the right-hand side reads, as flat arrays in SI units; m modes, B bearings, A magnets, Z
    balls.

    Columns and entries are named in this module. ``balls`` (B, 3, Z8) are the balls of `physics.ball_set`,
    where a race moves axially (2 B, 3, Z8), first the rows that motion towards +z loads, then the others,
    ``ball_table`` (B, ·, ·, ·, ·) or (0, ·, ·, ·, ·) what `physics.ball_table` reads of balls at speed;
    ``rotor_at``, ``bearing_at`` (B, ·), ``contact_at`` (C, ·) and ``magnet_at`` (A, ·) say where the states
    of each owner stand, so that no kernel computes a place from numbers of modes and bearings. ``load``
    (K, ·), ``load_shape`` (K, m) and ``load_points`` (R, 3) are what pushes the rotor (`physics.load`).
    ``rub`` (N, · + m) are the contacts of the rotor with its housing, numbers of `physics.touch` and then
    shape, ``stops`` (S,) the bearings whose mount has a stop, ``faces`` (F,) those with an axial face; the
    log has all three behind the contacts with races. ``memory`` is what is remembered beside the state: a
    right-hand side reads it. Bearings that warm have their temperatures first in it, which `simulate.heat`
    writes between stretches of time; then come the clock and the controllers of magnets, which
    `simulate._sampled` writes where a step has ended on a sample. A package whose machines have more derives
    from this class, with rows of ``bearing`` and ``bearing_at`` that are longer.
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
    ball_table: Array
    magnet_shape: Array
    magnet: Array
    spin: Array
    flags: Integers
    rotor_at: Integers
    bearing_at: Integers
    contact_at: Integers
    magnet_at: Integers
    load: Array
    load_shape: Array
    load_points: Array
    rub: Array
    stops: Integers
    faces: Integers
    memory: Array

    @property
    def form(self) -> Form:
        """The form of the kernels for this machine: plain where it has no optional part."""
        at, row = self.bearing_at, self.bearing
        optional = (
            max(len(self.rub), len(self.stops), len(self.faces), *self.flags[[LOOPS_ACT, LOADS_ACT]]) > 0
            or self.rotor_at[AXIAL] >= 0
            or bool((at[:, RACE] < 0).any())
            or bool((at[:, [FACE_STATES, RING_STATES, MOUNT_STATES]] >= 0).any())
            or bool((row[:, [FAST_SPEED_STEP, MOUNT]] != 0.0).any())
        )
        return FULL if optional else PLAIN
