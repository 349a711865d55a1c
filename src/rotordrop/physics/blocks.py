"""Entries of the blocks of numbers that one law each reads; apart from the laws, which need a compiler."""

from __future__ import annotations

# Entries of a contact law; SI units.
CONTACT_STIFFNESS = 0
CONTACT_EXPONENT = 1
CONTACT_DAMPING = 2
CONTACT_N_ENTRIES = 3

# Entries of a contact; SI units.
TOUCH_AIR_GAP = 0
TOUCH_ROTOR_RADIUS = 1
TOUCH_BORE_RADIUS = 2
TOUCH_FRICTION_STATIC = 3
TOUCH_FRICTION_DYNAMIC = 4
TOUCH_STRIBECK_SPEED = 5
TOUCH_SMOOTHING_SPEED = 6
TOUCH_LAW = 7
TOUCH_N_ENTRIES = TOUCH_LAW + CONTACT_N_ENTRIES

# Entries of a ball set; SI units.
BALLS_BALL_STIFFNESS = 0
BALLS_GROOVE_DISTANCE = 1
BALLS_RADIAL_OFFSET = 2
BALLS_AXIAL_OFFSET = 3
BALLS_STRESS_COEFFICIENT = 4
BALLS_N_ENTRIES = 5

# Entries of a rolling bearing: its ball set, then its drag and damping; SI units.
ROLLING_DRAG_COEFFICIENT = BALLS_N_ENTRIES
ROLLING_DRAG_SPEED = BALLS_N_ENTRIES + 1
ROLLING_PITCH_DIAMETER = BALLS_N_ENTRIES + 2
ROLLING_DAMPING = BALLS_N_ENTRIES + 3
ROLLING_N_ENTRIES = BALLS_N_ENTRIES + 4

# Entries of the rings that springs press on; SI units. Mass zero is a preload by rigid spacers.
RING_MASS = 0
RING_RATE = 1
RING_TRAVEL = 2
RING_STOP = 3
RING_FRICTION = 4
RING_BALLS = 5
RING_ROWS = 6
RING_N_ENTRIES = 7

# Entries of a table of balls at speed; SI units. A step of the speed of zero is balls without inertia.
FAST_SPEED_STEP = 0
FAST_TOUCH = 1
FAST_FIRST = 2
FAST_STEP = 3
FAST_OUTER_STRESS = 4
FAST_N_ENTRIES = 5

# Entries of an axial face; SI units. A side of zero is a face on both sides, of one and minus one a face that
# stops the rotor towards +z and -z.
FACE_GAP = 0
FACE_SIDE = 1
FACE_RADIUS = 2
FACE_FRICTION = 3
FACE_LAW = 4
FACE_N_ENTRIES = FACE_LAW + CONTACT_N_ENTRIES

# Entries of a form; SI units. All at zero is the plain support.
SUPPORT_PRESENT = 0
SUPPORT_COUPLING = 1
SUPPORT_CUBIC = 2
SUPPORT_FOUNDATION_SHARE = 3
SUPPORT_FOUNDATION_SPEED = 4
SUPPORT_FOUNDATION_DAMPING = 5
SUPPORT_N_ENTRIES = 6

# Entries of a mount; SI units. All at zero is none: no stop, no ribbon, no branch that relaxes.
MOUNT_PRESENT = 0
MOUNT_STATES = 1
MOUNT_STOP_GAP = 2
MOUNT_STOP = 3
MOUNT_STOP_END = MOUNT_STOP + CONTACT_N_ENTRIES
MOUNT_RIBBON_STIFFNESS = MOUNT_STOP_END
MOUNT_RIBBON_SLIP = MOUNT_STOP_END + 1
MOUNT_RIBBON_SHARPNESS = MOUNT_STOP_END + 2
MOUNT_BRANCHES = MOUNT_STOP_END + 3
MOUNT_BRANCH_ENTRIES = 2
MOUNT_MOST_BRANCHES = 3
MOUNT_N_ENTRIES = MOUNT_BRANCHES + MOUNT_BRANCH_ENTRIES * MOUNT_MOST_BRANCHES
