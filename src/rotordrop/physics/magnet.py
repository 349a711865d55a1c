"""A radial magnet with its coils and sampled controller: force, flux, current, and what is remembered.

Each axis has two coils, one that pulls towards + and one towards -, driven with bias plus and minus a control
current. The flux of each follows from the same energy as its force, so that the electrical work put in is the
change of field energy, the mechanical work and the heat of the resistance, to the last digit.
"""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel, kernel, lean_kernel
from rotordrop.physics.elementary import exp


@kernel
def remanent_fraction(t: float, delay: float, tau: float) -> float:
    """Fraction [1] of the remanent force left at a time [s] after the command.

    One at the end of the delay [s], decaying with the time constant [s]; zero during the delay.

    Source: the "small lift right after the AMB shutdown" of Neisi 2020, section 5.1; the exponential law is
    ours.
    """
    if t < delay or tau <= 0.0:
        return 0.0
    return exp(-(t - delay) / tau)


VACUUM = 4e-7 * math.pi
"""Permeability of vacuum [H/m]."""

MOST_STATES = 8
"""Most states that a controller of one axis may have."""
MOST_PENDING = 8
"""Most samples whose outputs may be on their way at once."""

# Numbers of a magnet and its controller; SI units. FEED is what the controller puts out beside its own
# states, x and y; INPUT, OUTPUT and UNWIND are vectors over its states, STEP is the matrix that moves them.
FORCE, GAP, BIAS, LEAKAGE, RESISTANCE, VOLTAGE, CURRENT_LIMIT, BANDWIDTH, SAMPLE_TIME, DELAY = range(10)
OUTPUT_LIMIT, ORDER, FEED = range(10, 13)
DIRECT = 14
INPUT = 15
OUTPUT = INPUT + MOST_STATES
UNWIND = OUTPUT + MOST_STATES
STEP = UNWIND + MOST_STATES
N_NUMBERS = STEP + MOST_STATES * MOST_STATES

# What is remembered of an axis: what it does, the control current that is asked for [A], the last output [A],
# the states of the controller, outputs on their way.
MODE, REFERENCE, LAST, STATES = range(4)
PENDING = STATES + MOST_STATES
N_AXIS = PENDING + MOST_PENDING
N_MEMORY = 2 * N_AXIS

# What an axis does: nothing; hold the rotor; put out what it put out last; nothing but bias; its coils are
# short-circuited. The second and third have a control current.
OFF, LEVITATES, HOLDS, LOST, DECAYS = range(5)

# The clock of all magnets: samples taken, outputs made, events past, time since when the rotor is quiet [s].
SAMPLES, OUTPUTS, EVENTS, QUIET, N_CLOCK = range(5)


def force_constant(turns: float, pole_area: float, angle: float) -> float:
    """Constant κ [N m²/A²] of the force ``κ (I/s)²`` of a pair of poles with turns [1], area [m²], angle
    [rad].

    Source: Schweitzer and Maslen 2009, ``κ = μ0 N² A cos χ / 4``.
    """
    return 0.25 * VACUUM * turns * turns * pole_area * math.cos(angle)


def coil_inductance(turns: float, pole_area: float, gap: float) -> float:
    """Inductance [H] of one coil with turns [1] and poles of an area [m²] at its gap [m].

    Source: Schweitzer and Maslen 2009, ``L = μ0 N² A / (2 s0)``.
    """
    return 0.5 * VACUUM * turns * turns * pole_area / gap


@inner_kernel
def magnet_force(
    force: float, gap: float, x: float, plus: float, minus: float
) -> tuple[float, float, float, float]:
    """Force [N] of an axis at a displacement x [m] with two currents [A], and its three slopes.

    Parameters
    ----------
    force : float
        Constant κ [N m²/A²].
    gap : float
        Gap s0 of both coils with the rotor in the middle [m].
    x : float
        Displacement of the rotor [m].
    plus, minus : float
        Currents of the coils that pull towards + and - [A].

    Returns
    -------
    tuple of float
        ``κ [(I₊/(s0 − x))² − (I₋/(s0 + x))²]`` [N]; its slope by x [N/m] and by each current [N/A].

    Notes
    -----
    Source: Schweitzer and Maslen 2009. Iron saturates and stray flux grows where the gap is narrow; neither
    is in it. Not validated against a measured magnet.
    """
    up, down = gap - x, gap + x
    by_plus, by_minus = 2.0 * force * plus / (up * up), -2.0 * force * minus / (down * down)
    value = 0.5 * (by_plus * plus + by_minus * minus)
    return value, by_plus * plus / up - by_minus * minus / down, by_plus, by_minus


def negative_stiffness(force: float, gap: float, bias: float) -> tuple[float, float]:
    """Force by current k_i [N/A] and by displacement k_s [N/m] of an axis in the middle.

    From the constant κ [N m²/A²], the gap [m] and the bias [A]. Source: slopes of `magnet_force`.
    """
    return 4.0 * force * bias / gap**2, 4.0 * force * bias**2 / gap**3


@inner_kernel
def coil_rate(
    numbers: Array, asked: float, shorted: bool, gap: float, opening: float, current: float
) -> tuple[float, float]:
    """Rate of a coil current [A/s] and the voltage at the coil [V].

    Parameters
    ----------
    numbers : ndarray, shape (103,)
        Numbers of the magnet [SI].
    asked : float
        Current that the amplifier is asked for [A].
    shorted : bool
        Whether the coil is short-circuited [1].
    gap, opening : float
        Gap of this coil [m] and its rate [m/s].
    current : float
        Current [A].

    Notes
    -----
    ``u = R I + dλ/dt`` with ``λ = (L_σ + 2κ/s) I``. The amplifier closes its own current loop, of first order
    up to its bandwidth, as far as its voltage reaches. Source: derived from the energy of the force;
    Schweitzer and Maslen 2009 have its linear form.
    """
    flux = 2.0 * numbers[FORCE] / gap
    inductance = numbers[LEAKAGE] + flux
    resisted = numbers[RESISTANCE] * current
    induced = -flux / gap * opening * current
    voltage = 0.0
    if not shorted:
        wanted = resisted + induced + inductance * numbers[BANDWIDTH] * (asked - current)
        voltage = min(max(wanted, -numbers[VOLTAGE]), numbers[VOLTAGE])
    return (voltage - resisted - induced) / inductance, voltage


@inner_kernel
def axis_rates(
    numbers: Array, axis: Array, x: float, v: float, plus: float, minus: float
) -> tuple[float, float, float, float, float]:
    """Force of an axis [N], rates of its two currents [A/s], electrical power put in and heat [W].

    ``numbers`` of the magnet, ``axis`` what is remembered, displacement x [m], velocity v [m/s], currents
    [A]. Source: `magnet_force` and `coil_rate`.
    """
    mode, bias, control = axis[MODE], numbers[BIAS], 0.0
    if LEVITATES <= mode <= HOLDS:
        control = min(max(axis[REFERENCE], -numbers[CURRENT_LIMIT]), numbers[CURRENT_LIMIT])
    if mode == OFF:
        bias = 0.0
    shorted = mode == DECAYS
    gap = numbers[GAP]
    up, at_up = coil_rate(numbers, max(bias + control, 0.0), shorted, gap - x, -v, plus)
    down, at_down = coil_rate(numbers, max(bias - control, 0.0), shorted, gap + x, v, minus)
    force, _by_x, _by_plus, _by_minus = magnet_force(numbers[FORCE], gap, x, plus, minus)
    heat = numbers[RESISTANCE] * (plus * plus + minus * minus)
    return force, up, down, at_up * plus + at_down * minus, heat


@lean_kernel
def field_energy(numbers: Array, x: float, plus: float, minus: float) -> float:
    """Energy in the field of the two coils of an axis [J], at x [m] with two currents [A].

    Source: ``½ λ I`` of each, whose slope by x at constant flux is the force.
    """
    force, gap, leakage = numbers[FORCE], numbers[GAP], 0.5 * numbers[LEAKAGE]
    by_plus, by_minus = leakage + force / (gap - x), leakage + force / (gap + x)
    energy: float = by_plus * plus * plus + by_minus * minus * minus
    return energy


@lean_kernel
def take_sample(numbers: Array, axis: Array, feed: float, error: float, count: int) -> None:
    """Write what a controller makes of a sample, the deviation from its reference [m], into the memory.

    ``feed`` [A] is put out beside; ``count`` [1] is the number of the sample. Source: a state space in
    discrete time, whose states follow what the limited output leaves over (Åström and Hägglund 2006).
    """
    at = PENDING + count % MOST_PENDING
    if axis[MODE] == HOLDS:
        axis[at] = axis[LAST]
        return
    axis[at] = 0.0
    if axis[MODE] != LEVITATES:
        return
    n = int(numbers[ORDER])
    wanted = feed + numbers[DIRECT] * error
    for i in range(n):
        wanted += numbers[OUTPUT + i] * axis[STATES + i]
    put = min(max(wanted, -numbers[OUTPUT_LIMIT]), numbers[OUTPUT_LIMIT])
    before = (
        axis[STATES],
        axis[STATES + 1],
        axis[STATES + 2],
        axis[STATES + 3],
        axis[STATES + 4],
        axis[STATES + 5],
        axis[STATES + 6],
        axis[STATES + 7],
    )
    for i in range(n):
        moved = numbers[INPUT + i] * error + numbers[UNWIND + i] * (put - wanted)
        for j in range(n):
            moved += numbers[STEP + i * MOST_STATES + j] * before[j]
        axis[STATES + i] = moved
    axis[at] = put
    axis[LAST] = put


@kernel
def begin(axis: Array, mode: int) -> None:
    """Let an axis do something else [a mode, 1]; a controller that levitates begins with empty states.

    Source: a switch.
    """
    if mode != HOLDS:
        axis[REFERENCE:N_AXIS] = 0.0
    axis[MODE] = mode
