"""What a record shows in which nothing falls: levels and lines of its channels, and contacts of a held rotor.

A rotor touches while its magnets hold it under an overload, a surge, an earthquake, a rub or a failed lift.
No air gap need be known: a magnet turns the rotor back as gently as it came, a race much more sharply.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.impacts import SMOOTHING, peaks, slope
from rotordrop.known import NINETY
from rotordrop.series import noise_by_differences
from rotordrop.units import GRAVITY

if TYPE_CHECKING:
    from rotordrop.machine import Machine

_FEWEST = 9
"""Samples of a flight and half a contact that five unknowns are fitted to, at least [1] (chosen)."""

_PHASES = (0.3 * math.pi, 1.1 * math.pi)
"""Phase of the harmonic motion at its deepest point: a quarter of a period, earlier where the contact is
damped, later where the rotor is pressed on, at most about half a period [rad] (chosen)."""

_COARSE, _FINE, _REFINED = (25, 9), (7, 7), 3
"""Times and phases tried, the same about the best of them, and how often; every step is a third of the one
before (chosen for time)."""

_LINEAR = 3
"""Unknowns in which the motion is linear: place and velocity at the touch, and pull."""


@dataclass(frozen=True, kw_only=True)
class HalfContact:
    """How a rotor enters a contact."""

    begin: float
    """When it touches, in samples before the deepest point (negative)."""
    velocity: float
    """Velocity with which it touches [m/s], positive towards the race."""
    velocity_error: float
    """Standard error by what the fit leaves over [m/s]; that of its form comes on top."""
    pull: float
    """Acceleration towards the race without the contact [m/s²]."""
    frequency: float
    """Angular frequency of the rotor on its race [rad/s]."""


def half_contact(outward: Array, rate: float, noise: float) -> HalfContact | None:
    """Fit a flight and the half contact at its end.

    Parameters
    ----------
    outward : array, shape (N,)
        Distance towards the race [m], from somewhere in the flight to the deepest point, the last sample. The
        end of a contact is the begin of the one that runs backwards in time.
    rate : float
        Samples per second [Hz].
    noise : float
        Standard deviation of a reading [m].

    Returns
    -------
    HalfContact or None
        None where there are too few samples, or none of the flight.

    Notes
    -----
    With τ from the touch on: ``x = r + v τ + a τ²/2`` before it, ``x = r + v sin(ωτ)/ω + a (1 − cos ωτ)/ω²``
    after it: a mass on an undamped spring that a constant force pulls along.
    """
    count = len(outward)
    if count < _FEWEST:
        return None
    time, place = np.arange(1.0 - count, 1.0) / rate, outward - outward[-1]
    earliest, latest = float(time[0]) + (_LINEAR + 1) / rate, -1.0 / rate
    begins, step = np.linspace(earliest, latest, _COARSE[0], retstep=True)
    phases, turn = np.linspace(*_PHASES, _COARSE[1], retstep=True)
    for _ in range(_REFINED + 1):
        tried = np.meshgrid(np.clip(begins, earliest, latest), np.clip(phases, *_PHASES), indexing="ij")
        at, phase = (one.ravel() for one in tried)
        left = _left_over(time, place, at, -phase / at)
        best = int(np.argmin(left))
        begins = at[best] + step * np.linspace(-1.0, 1.0, _FINE[0])
        phases = phase[best] + turn * np.linspace(-1.0, 1.0, _FINE[1])
        step, turn = step / 3.0, turn / 3.0
    begin, frequency = float(at[best]), float(-phase[best] / at[best])
    motion = _motions(time, np.array([begin]), np.array([frequency]))[0]
    found = np.linalg.lstsq(motion, place, rcond=None)[0]
    spread = max(noise, math.sqrt(float(np.mean((place - motion @ found) ** 2)) * count / max(count - 5, 1)))
    small = 1e-3 * abs(begin), 1e-3 * frequency
    beside = _motions(
        time,
        np.array([begin + small[0], begin - small[0], begin, begin]),
        np.array([frequency, frequency, frequency + small[1], frequency - small[1]]),
    )
    moved = beside @ found
    slopes = np.column_stack(
        [motion, (moved[0] - moved[1]) / (2.0 * small[0]), (moved[2] - moved[3]) / (2.0 * small[1])]
    )
    size = np.linalg.norm(slopes, axis=0)
    spreads = spread * np.sqrt(np.diag(np.linalg.pinv((slopes / size).T @ (slopes / size)))) / size
    return HalfContact(
        begin=begin * rate,
        velocity=float(found[1]),
        velocity_error=float(spreads[1]),
        pull=float(found[2]),
        frequency=frequency,
    )


def _motions(time: Array, begin: Array, frequency: Array) -> Array:
    """Motion per place, velocity and pull at the touch, shape (K, N, 3), for K touches and frequencies."""
    since = time - begin[:, None]
    free, on = np.minimum(since, 0.0), frequency[:, None] * np.maximum(since, 0.0)
    scale = frequency[:, None]
    moved = (free + np.sin(on) / scale, 0.5 * free**2 + (1.0 - np.cos(on)) / scale**2)
    return np.stack([np.ones_like(since), *moved], axis=-1)


def _left_over(time: Array, place: Array, begin: Array, frequency: Array) -> Array:
    """Sum of squares that the best motion leaves, for K touches and frequencies, shape (K,)."""
    columns = np.linalg.qr(_motions(time, begin, frequency))[0]
    explained = np.einsum("kni,n->ki", columns, place)
    return np.asarray(np.sum((place - np.einsum("kni,ki->kn", columns, explained)) ** 2, axis=1))


_AWAY, _LEAST_AWAY = 3.0, 40e-6
"""A contact lies this many times further from where the rotor usually is than its orbit reaches [1], and at
least this far [m] (chosen; smaller air gaps are not built)."""

_NEAR_RACE = 0.8
"""With a known air gap, a contact lies at least this share of it away [1] (chosen)."""

_SHARPER, _SHARPER_AGAIN = 3.0, 1.5
"""A race turns the rotor back with at least so many times the largest acceleration of its approach [1], and
where one contact has shown where the race is (chosen; a swing turns as it came, a scratch under a sensor
twice as sharply)."""

_BACK_AT_RACE = 0.85
"""Share of the distance of a contact from which on a turn is one at the same race [1] (chosen)."""

_RETURNED = 0.25
"""Least ratio of the velocities after and before the first contact, or before and after [1] (chosen)."""

_LEAST_TURN = 1.0
"""Least acceleration of a turn at a race over gravity [1] (chosen)."""

_ABOVE_USUAL = 4.0
"""A contact turns the rotor this many times more sharply than its orbit does around [1] (chosen)."""

_ABOVE_CALM, _CALM, _CALM_SPAN = 1.5, 99.8, 2.0
"""A first contact turns the rotor this many times more sharply than all but the sharpest 0.2 % of turns in
the nearest two seconds in which it is nowhere near a race: a scratch under a sensor is as sharp there, at
like speed [1, %, s] (set on seeds 0, 1, 3 and 5 of study `look`)."""

_TURN = 4e-3
"""The turn lasts up to this long on either side of the furthest point [s] (chosen)."""

_APPROACH, _AROUND = 30e-3, 0.15
"""How far back an approach is followed, and what counts as around [s] (chosen)."""

_FLIGHT = 1.5e-3
"""How much of a flight before a contact, and after it, is fitted with it [s] (chosen: what drives a rotor on
its way, such as a surge of 20 ms, is constant over that)."""

_FORM = ((0.04, 0.5), (0.06, 1.0))
"""Standard error of a velocity by the form of its fit, before a contact and after it: its share of the
velocity, and of the square of the speed that the pull gives within the inverse frequency on the race over
the velocity [1]. A race dampens, more so on the way out, and a rotor pressed on it hardly leaves (set with
seeds 300000 to 300039 of study `look`)."""

_SURELY = 3.0
"""A velocity so many standard errors from zero is one [1] (chosen)."""

_AS_STIFF = (0.7, 1.4)
"""What turns a rotor with such a share of the angular frequency of its first contacts is their race [1]
(chosen): magnets that hold it are ten times as soft."""

_POINTS = 8192
"""Samples of a stretch whose spectrum is taken; stretches overlap by half (chosen)."""

_LINES = 5
"""Lines listed of a channel (chosen)."""

LEAST_PERIODS = 3
"""A line has at least so many periods in a stretch [1]: below that its window does not part it from a step,
such as that of a drop, or from a drift."""

LINE_ABOVE, LINE_AROUND = 5.0, 64
"""A line is at least so many times the median of the spectrum within so many points to either side [1]
(chosen: noise reaches that less than once in a million points, even in a single stretch)."""


@dataclass(frozen=True, kw_only=True)
class HeldContact:
    """A rotor that its magnets hold, turned back by a race."""

    plane: str
    """Sensor plane."""
    time: float
    """When it touches, by the kink of its velocity [s]."""
    azimuth: float
    """Direction in which it is turned back, from where it usually is [rad], counter-clockwise from +x."""
    distance: float
    """Distance from where it usually is [m]."""
    approach: float
    departure: float
    """Radial velocities at the first and the last instant of the contact [m/s], both positive outwards and
    inwards: by a fit of flight and half a contact, by straight lines over 1 ms where that fails."""
    approach_interval_90: tuple[float, float]
    departure_interval_90: tuple[float, float]
    """Intervals that hold them with 90 % probability [m/s]."""
    velocity_change: tuple[float, float]
    """Bounds of the change of velocity by the race, which is its impulse per mass that takes part [m/s]:
    noise, what the magnets can have done during the turn, and above also what drove the rotor out."""
    impulse: tuple[float, float] | None
    """Bounds of the impulse [N s], between the mass that a rigid rotor has at this plane and all of it; None
    without a machine."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """What one channel reads on average, and its strongest lines."""

    channel: str
    unit: str
    mean: float
    rms: float
    """About the mean."""
    peak_to_peak: float
    """Largest less smallest reading."""
    lines: tuple[tuple[float, float], ...]
    """Frequency [Hz] and amplitude, zero to peak, of the lines that stand out, the strongest first."""
    resolution: float
    """Half the spacing of the spectrum [Hz], within which the frequency of a line is known."""
    frequency: Array
    amplitude: Array
    """The whole spectrum, shape (K,)."""


def level_of(channel: str, unit: str, values: Array, rate: float) -> Level:
    """Levels and spectrum of a channel: Hann windows, amplitudes averaged by their squares."""
    values = np.asarray(values, dtype=np.float64)
    values = values[np.isfinite(values)]
    points = min(_POINTS, len(values))
    window = np.hanning(points + 1)[:-1]
    starts = range(0, len(values) - points + 1, max(points // 2, 1))
    frames = (values[start : start + points] for start in starts)
    power = np.mean([np.abs(np.fft.rfft((one - one.mean()) * window)) ** 2 for one in frames], axis=0)
    amplitude: Array = 2.0 * np.sqrt(power) / max(window.sum(), 1e-12)
    frequency: Array = np.asarray(np.fft.rfftfreq(points, 1.0 / rate), dtype=np.float64)
    inner = np.flatnonzero((amplitude[1:-1] > amplitude[:-2]) & (amplitude[1:-1] >= amplitude[2:])) + 1
    inner = inner[inner >= LEAST_PERIODS]
    around = sliding_window_view(np.pad(amplitude, LINE_AROUND, mode="reflect"), 2 * LINE_AROUND + 1)
    lines = [
        _between_points(frequency, amplitude, at)
        for at in inner[np.argsort(amplitude[inner])[::-1]][: 4 * _LINES].tolist()
        if amplitude[at] >= LINE_ABOVE * np.median(around[at])
    ]
    return Level(
        channel=channel,
        unit=unit,
        mean=float(np.mean(values)),
        rms=float(np.std(values)),
        peak_to_peak=float(np.ptp(values)),
        lines=tuple(sorted(lines, key=itemgetter(1), reverse=True)[:_LINES]),
        resolution=0.5 * float(frequency[1]),
        frequency=frequency,
        amplitude=amplitude,
    )


def _between_points(frequency: Array, amplitude: Array, at: int) -> tuple[float, float]:
    """Frequency [Hz] and amplitude of a line whose largest point is `at`, by the shape of a Hann window.

    A steady tone δ points off gives its larger neighbour the share ``(1 + δ) / (2 − δ)`` of the largest
    point, and that the share ``sin(πδ) / (πδ (1 − δ²))`` of its amplitude.
    """
    side = 1 if amplitude[at + 1] >= amplitude[at - 1] else -1
    share = float(amplitude[at + side] / amplitude[at])
    off = min(max((2.0 * share - 1.0) / (share + 1.0), 0.0), 0.5)
    return (
        float(frequency[at] + side * off * frequency[1]),
        float(amplitude[at] * (1.0 - off**2) / np.sinc(off)),
    )


def held_contacts(
    plane: str,
    time: Array,
    position: Array,
    rate: float,
    *,
    gap: float | None = None,
    masses: tuple[float, float] | None = None,
) -> tuple[HeldContact, ...]:
    """Find where a race turned a held rotor back, in one plane.

    Parameters
    ----------
    plane : str
        Name of the plane.
    time : array, shape (N,)
        [s].
    position : array, shape (N, 2)
        Displacement [m], y up.
    rate : float
        Samples per second [Hz].
    gap : float, optional
        Air gap, where it is known [m].
    masses : tuple of float, optional
        Mass that a rigid rotor has at this plane, and all of it [kg].

    Notes
    -----
    A contact is a turn far outside of the usual orbit that is at least three times as sharp as any on the way
    to it, four times as sharp as the orbit around, sharper than any while nothing is near a race, and above
    the acceleration of gravity. Further turns at the same distance that are half as sharp, or as stiff as
    those, are contacts too. Velocities are those of `half_contact`, at the contact. A scratch under a sensor
    rises nearly as sharply as it turns, and is as sharp wherever the rotor is; a swing on the magnets turns
    as it rises. Not validated on measured contacts.
    """
    usual = np.median(position, axis=0)
    away = position - usual
    distance = np.hypot(*away.T)
    noise = noise_by_differences(position, 3)
    orbit = float(np.percentile(distance, 90))
    floor = max(_AWAY * orbit, _LEAST_AWAY) if gap is None else _NEAR_RACE * gap
    floor = max(floor, 20.0 * noise)
    if not len(distance) or float(distance.max()) < floor:
        return ()
    velocity = slope(position, rate)
    accelerated = slope(velocity, rate)
    usual_turn = np.hypot(*accelerated.T)
    window = max(2 * int(0.5 * SMOOTHING * rate) + 1, 3)
    doubt = noise * rate * math.sqrt(12.0 / window**3)  # of a velocity by a straight line
    turn, back, around, flight = (max(round(span * rate), 2) for span in (_TURN, _APPROACH, _AROUND, _FLIGHT))

    scratch = _scratches(distance >= floor, usual_turn, turn, rate)

    def contacts(floor: float, sharper: float, returned: float, like: _Like) -> Iterator[_Found]:
        tops = peaks(distance, floor, max(0.1 * floor, 6.0 * noise))
        # between two turns the rotor is furthest from the race: what is beyond belongs to the other turn
        parted = [before + int(np.argmin(distance[before:then])) for before, then in pairwise(tops)]
        for at, came_from, goes_to in zip(tops, [0, *parted], [*parted, len(distance)], strict=False):
            outward, begin = away[at] / distance[at], max(at - back, 0)
            speed, here = velocity[begin : min(at + turn, goes_to) + 1] @ outward, at - begin
            fastest = max(here - turn, came_from - begin, 0)
            fastest += int(np.argmax(speed[fastest : here + 1]))
            leaves = here + int(np.argmin(speed[here:]))
            outwards = accelerated[begin : at + turn + 1] @ outward
            lines = (
                _Side(float(speed[fastest]), begin + fastest),
                _Side(float(-speed[leaves]), begin + leaves),
            )
            turned = float(-np.min(outwards[fastest : leaves + 1]))
            came = float(np.max(outwards[: fastest + 1]))
            usually = float(np.median(usual_turn[max(at - around, 0) : at + around]))
            most = max(sharper * came, _ABOVE_USUAL * usually, _LEAST_TURN * GRAVITY, like.marred(at))
            low, high = sorted(one.velocity for one in lines)
            gentle = turned <= most or low <= max(returned * high, 0.0) or high + low <= 10.0 * doubt
            if gentle and like.frequency is None:
                continue
            first = max(came_from, lines[0].sample - flight)
            path = away[first : min(goes_to, lines[1].sample + flight) + 1] @ outward
            into = half_contact(path[: at - first + 1], rate, noise)
            if gentle and not like.is_race(into):
                continue
            out = half_contact(path[at - first :][::-1], rate, noise)
            drove = max(usually, came)
            sides = (
                lines[0].by(into, at, 1, NINETY * doubt, drove),
                lines[1].by(out, at, -1, NINETY * doubt, drove),
            )
            yield _contact(plane, time, away[at], sides, (usually, drove), masses), into

    sure = tuple(contacts(floor, _SHARPER, _RETURNED, _Like(None, scratch)))
    if not sure:
        return ()
    race = min(one.distance for one, _ in sure)
    stiff = [half.frequency for _, half in sure if half is not None]
    like = _Like(float(np.median(stiff)) if stiff else None, lambda _: 0.0)
    return tuple(one for one, _ in contacts(_BACK_AT_RACE * race, _SHARPER_AGAIN, 0.0, like))


def _scratches(near: NDArray[np.bool_], usual_turn: Array, turn: int, rate: float) -> Callable[[int], float]:
    """How sharply a scratch under a sensor may turn a rotor at a sample [m/s²]: as where no race is near."""
    far = np.cumsum(np.pad(near, turn + 1))
    calm = np.flatnonzero(far[2 * turn + 1 : -1] == far[: len(near)])
    beside = round(0.5 * _CALM_SPAN * rate)

    def scratch(at: int) -> float:
        here = int(np.searchsorted(calm, at))
        turns = usual_turn[calm[max(here - beside, 0) : here + beside]]
        return _ABOVE_CALM * float(np.percentile(turns, _CALM)) if len(turns) else 0.0

    return scratch


_Found = tuple[HeldContact, HalfContact | None]


@dataclass(frozen=True)
class _Like:
    """What a contact is known by: its frequency [rad/s], or what else turns a rotor as sharply [m/s²]."""

    frequency: float | None
    marred: Callable[[int], float]

    def is_race(self, into: HalfContact | None) -> bool:
        """Whether a turn is as stiff as the contacts before, and the rotor came with a velocity."""
        if into is None or self.frequency is None or into.velocity <= _SURELY * into.velocity_error:
            return False
        return _AS_STIFF[0] < into.frequency / self.frequency < _AS_STIFF[1]


@dataclass(frozen=True)
class _Side:
    """Velocity on one side of a contact [m/s], when [samples], and its interval."""

    velocity: float
    sample: float
    interval: tuple[float, float] = (math.nan, math.nan)

    def by(self, half: HalfContact | None, at: int, sign: int, doubt: float, drove: float) -> _Side:
        """That of a fit about the deepest point, or itself with the interval of a straight line."""
        if half is None or half.velocity <= _SURELY * half.velocity_error:
            # a line rounds off half its length, in which what drove the rotor goes on
            high = self.velocity + doubt + drove * 0.5 * SMOOTHING
            return _Side(self.velocity, self.sample, (max(self.velocity - doubt, 0.0), high))
        share, pressed = _FORM[0 if sign > 0 else 1]
        pressed *= (half.pull / half.frequency) ** 2 / half.velocity
        wide = NINETY * math.hypot(half.velocity_error, share * half.velocity, pressed)
        interval = (max(half.velocity - wide, 0.0), half.velocity + wide)
        return _Side(half.velocity, at + sign * half.begin, interval)


def _contact(
    plane: str,
    time: Array,
    away: Array,
    sides: tuple[_Side, _Side],
    drives: tuple[float, float],
    masses: tuple[float, float] | None,
) -> HeldContact:
    """A contact by its two sides, with what usually drives the rotor, and did at most [m/s²]."""
    into, out = sides
    begin, end = np.interp([into.sample, out.sample], np.arange(len(time)), time)
    # what drove the rotor on its way, a surge say, may drive it against the race too, ever harder
    change = (
        max(into.interval[0] + out.interval[0] - drives[0] * (end - begin), 0.0),
        into.interval[1] + out.interval[1] + drives[1] * (end - begin + SMOOTHING),
    )
    return HeldContact(
        plane=plane,
        time=float(begin),
        azimuth=float(np.arctan2(away[1], away[0])),
        distance=float(np.hypot(*away)),
        approach=into.velocity,
        departure=out.velocity,
        approach_interval_90=into.interval,
        departure_interval_90=out.interval,
        velocity_change=(float(change[0]), float(change[1])),
        impulse=None if masses is None else (masses[0] * float(change[0]), masses[1] * float(change[1])),
    )


def masses_at(machine: Machine, node: int) -> tuple[float, float]:
    """Mass [kg] that a rigid rotor opposes to a push at a node, and all of it."""
    from rotordrop.rotor.assembly import build_rotor_fe

    fe = build_rotor_fe(machine)
    arm = machine.rotor.node_positions[node - 1] - fe.centre_of_gravity
    return 1.0 / (1.0 / fe.total_mass + arm**2 / fe.diametral_inertia), fe.total_mass
