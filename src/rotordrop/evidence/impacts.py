"""Impacts of a drop, one rule for all that tell of it: by its contacts, or by displacement alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.known import NINETY
from rotordrop.series import in_parts
from rotordrop.units import GRAVITY, fall_time

SMOOTHING = 1e-3
"""Window of velocities [s]."""

DOWN = np.array([0.0, -1.0])
"""Direction of gravity where y points up."""

_NEAR = 0.85
"""A contact turns the rotor back at this share of the gap or beyond [1]."""

HOP = 0.05
"""A flight is at least as long as a hop of this height over the gap under gravity, and leaves the race by
half of it [1] (chosen)."""

BEGUN = 0.3e-3
"""Standard error of where displacement shows that a contact begins or ends [s]."""

_FREE, _FREE_DOUBT, _LEAST_FREE = 0.8, 0.2, 0.3
"""Least mean acceleration in a flight over that of a free body, how far 90 % of flights stray from that, and
least of that over gravity [1] (chosen on the drops that study `look` scores)."""

_LONGEST_FALL = 20e-3
"""The first approach is looked for so long before the first reversal [s]."""

_SHARPEST_SWING = 0.7
"""Radial acceleration over gravity above which a reversal is an impact [1]: a swing along the race and the
wrong centre of a circle give less."""

_WINDOWED = 0.9 * SMOOTHING
"""From the highest velocity to the lowest of a contact that lasts no time [s]: straight lines through
`SMOOTHING` show it so, of impacts of 0.015 to 0.06 m/s (0.92 to 1.08 ms for one of 0.3 ms)."""

_STRETCH = 256
"""Samples that are looked at together; chosen for time."""

LASTING = 0.05
"""Contact without an impact for this long lasts [s] (chosen)."""

CONTACT_FROM = "mostly in contact from"
"""What the begin of the last impact is called: shorter hops than those that end in an impact may follow."""

AFTER_LAST = f"{CONTACT_FROM} then on"
"""The same behind a sentence on the last impact."""


def shortest_flight(gap: float) -> float:
    """Shortest flight that ends in an impact [s]: as long as a hop of `HOP` of the gap under gravity."""
    return 2.0 * fall_time(HOP * gap)


def after_flights(
    begun: Array, ended: Array, gap: float, gravity: float | Array = GRAVITY
) -> NDArray[np.bool_]:
    """Which of the contacts of a bearing end a flight, where contacts are known; the first one does.

    Their times in the order of their beginning [s], shape (K,), and the air gap [m]; what brings the rotor
    back, of gravity or of another force [m/s²], of each flight where it changes, shape (K - 1,).
    """
    flown = np.sqrt(gravity / GRAVITY) * (begun[1:] - ended[:-1])  # under gravity, for a hop as high
    return np.append(True, flown >= shortest_flight(gap))[: len(begun)]


@dataclass(frozen=True, kw_only=True)
class Impacts:
    """Where a bearing turned the rotor back; K impacts, as samples of the path."""

    deepest: NDArray[np.int64]
    """Deepest point, shape (K,)."""
    touched: NDArray[np.int64]
    """Begin of the contact before it, with a standard error of `BEGUN`, shape (K,)."""
    approach: Array
    rebound: Array
    """Largest radial velocity before and after, by straight lines over `SMOOTHING` [m/s], shape (K,)."""
    surely: NDArray[np.int64]
    perhaps: NDArray[np.int64]
    """Begins of those that are impacts, and that may be, with 90 % probability: how long a flight lasted and
    how freely the rotor flew are known to `BEGUN` and `_FREE_DOUBT`."""


def find_impacts(
    path: Array, rate: float, gap: float, noise: float, down: Array = DOWN, *, falls: bool = True
) -> Impacts:
    """Find the impacts of a path (N, 2) from the centre: back on the race after a flight, and turned sharply.

    A flight lasts at least as long as a hop of `HOP` of the gap under gravity, leaves the race by half of
    that, and is accelerated like that of a free body. Shorter hops belong to the impact before; a rotor that
    swings along its race, or shakes with it, makes none. The first reversal of a path that begins with the
    fall is one.
    """
    radius = np.hypot(*path.T)
    speed = in_parts(slope, radius, rate, beside=int(SMOOTHING * rate) + 1)
    turns = _turns_of(radius, speed, rate, gap, noise)
    contact = _Contact.of(turns)
    found: list[tuple[_Turn, float, float]] = []
    for number, turn in enumerate(turns):
        touched = turn.fastest / rate + contact.aside(turn.approach)
        if number == 0 and falls:
            found.append((turn, touched, math.inf))
            continue
        if not turn.sharp or turn.hop < 0.5 * HOP * gap or turn.fastest <= turn.left:
            continue
        departed = max(-float(speed[turn.left]), 0.0)
        flew = touched - turn.left / rate + contact.aside(departed)
        gained = float(speed[turn.fastest] - speed[turn.left]) * rate / (turn.fastest - turn.left)
        free = _free_acceleration(path, rate, gap, down, slice(turn.left, turn.fastest + 1))
        longer = (flew - shortest_flight(gap)) / (NINETY * math.sqrt(2.0) * BEGUN)
        freer = (gained / max(free, _LEAST_FREE * GRAVITY) - _FREE) / _FREE_DOUBT
        found.append((turn, touched, min(longer, freer)))

    def begun(above: float) -> NDArray[np.int64]:
        return np.array(
            [min(round(at * rate), turn.at) for turn, at, sure in found if sure >= above], dtype=np.int64
        )

    hits = [turn for turn, _, sure in found if sure >= 0.0]
    return Impacts(
        deepest=np.array([turn.at for turn in hits], dtype=np.int64),
        touched=begun(0.0),
        approach=np.array([turn.approach for turn in hits], dtype=np.float64),
        rebound=np.array([turn.rebound for turn in hits], dtype=np.float64),
        surely=begun(1.0),
        perhaps=begun(-1.0),
    )


@dataclass(frozen=True, kw_only=True)
class _Turn:
    """A maximum of the distance from the centre, with the way to it."""

    at: int
    """Where [sample]."""
    left: int
    fastest: int
    """Where the velocity is lowest, then highest, since the maximum before [samples]."""
    approach: float
    rebound: float
    """Largest velocity before it, and after it [m/s]."""
    hop: float
    """How far the distance fell since the maximum before [m]."""
    lasts: float
    """From the highest velocity beside it to the lowest [s]."""
    sharp: bool
    """Whether it is turned more sharply than a swing."""


def _turns_of(radius: Array, speed: Array, rate: float, gap: float, noise: float) -> list[_Turn]:
    """The maxima near the race."""
    reach = max(int(max(2e-3, 1.5 * shortest_flight(gap)) * rate), 1)
    beside = max(int(0.5 * SMOOTHING * rate), 1)
    found: list[_Turn] = []
    for at in peaks(radius, _NEAR * gap, max(0.5 * HOP * gap, 6.0 * noise)):
        begin = found[-1].at if found else max(at - round(_LONGEST_FALL * rate), 0)
        fastest = begin + int(np.argmax(speed[begin : at + 1]))
        left = begin + int(np.argmin(speed[begin : fastest + 1])) if found else begin
        first = at - _until_turned(speed[at::-1], -1.0, beside)
        last = at + _until_turned(speed[at:], 1.0, beside)
        lasts = (last - first) / rate
        rebound = float(-np.min(speed[at : at + reach + 1]))
        turned = max(float(speed[first]), 0.0) + max(float(-speed[last]), 0.0)
        found.append(
            _Turn(
                at=at,
                left=left,
                fastest=fastest,
                approach=max(float(speed[fastest]), 0.0),
                rebound=max(rebound, 0.0),
                hop=float(radius[at] - np.min(radius[left : at + 1])),
                lasts=lasts,
                sharp=turned > _SHARPEST_SWING * GRAVITY * max(lasts, 1.0 / rate),
            )
        )
    return found


def _until_turned(values: Array, sign: float, beside: int) -> int:
    """Where signed values that fall from the first on are lowest before they rise for `beside` samples."""
    at = 0
    while at + 1 < len(values):
        ahead = at + 1 + int(np.argmin(sign * values[at + 1 : at + 1 + beside]))
        if sign * values[ahead] >= sign * values[at]:
            break
        at = ahead
    return at


@dataclass(frozen=True, kw_only=True)
class _Contact:
    """How long the contacts of a path last: a rotor on its race swings about where it would rest there.

    The velocity is largest where the rotor passes that place, ``asin(β g / v) β`` after a soft contact has
    begun, with the inverse frequency ``β``; the window of the velocities brings it forward before a hard one.
    """

    beta: float
    """Inverse frequency of the rotor on its contact [s]."""
    forward: float
    """How much earlier than without its window the velocity is largest [s]."""

    @classmethod
    def of(cls, turns: list[_Turn]) -> _Contact:
        """That of the middle one of all sharp turns: half a period, with the window on either side."""
        spans = [turn.lasts for turn in turns if turn.sharp]
        lasts = float(np.median(spans)) if spans else _WINDOWED
        half_period = math.sqrt(max(lasts**2 - _WINDOWED**2, 0.0))
        return cls(beta=half_period / math.pi, forward=0.5 * (lasts - half_period))

    def aside(self, velocity: float) -> float:
        """How much later than the largest velocity [m/s] a contact begins, or earlier it ends [s]."""
        share = min(self.beta * GRAVITY / max(velocity, 1e-9), 1.0)
        return self.forward - self.beta * math.asin(share)


def _free_acceleration(path: Array, rate: float, gap: float, down: Array, flight: slice) -> float:
    """Mean outward acceleration of a free body that moves as the path does in a flight [m/s²]."""
    begin = max(flight.start - round(SMOOTHING * rate), 0)
    near = slice(begin, flight.stop + round(SMOOTHING * rate))
    inside = slice(flight.start - begin, flight.stop - begin)
    place, velocity = path[flight], slope(path[near], rate)[inside]
    along = place / np.maximum(np.hypot(*place.T), 1e-12)[:, None]
    across = along[:, 0] * velocity[:, 1] - along[:, 1] * velocity[:, 0]
    return float(np.mean(GRAVITY * (along @ down) + across**2 / gap))


def slope(values: Array, rate: float) -> Array:
    """Velocity by a straight line through `SMOOTHING` around every sample [m/s], shape of the values."""
    half = max(int(0.5 * SMOOTHING * rate), 1)
    index = np.arange(-half, half + 1)
    weights = -index * rate / float(np.sum(index**2))  # numpy turns the kernel round
    columns = [
        np.convolve(np.pad(column, half, mode="edge"), weights, mode="valid")
        for column in np.atleast_2d(values.T)
    ]
    return np.stack(columns, axis=-1).reshape(values.shape)


def peaks(values: Array, floor: float, least: float) -> list[int]:
    """Maxima above a floor between which the values fall by at least `least`."""
    starts = np.arange(0, len(values), _STRETCH)
    spans = zip(
        starts.tolist(),
        np.maximum.reduceat(values, starts).tolist(),
        np.minimum.reduceat(values, starts).tolist(),
        strict=True,
    )
    found: list[int] = []
    sign, at, extreme = 1.0, 0, float(values[0])
    for begin, top, bottom in spans:
        stretch = values[begin : begin + _STRETCH]
        furthest, nearest = (top, bottom) if sign > 0.0 else (-bottom, -top)
        # a stretch in which nothing can turn is passed at once: a rotor lies on its race for most of a minute
        if max(extreme, furthest) - nearest <= least:
            if furthest > extreme:
                at, extreme = begin + int(np.argmax(sign * stretch)), furthest
            continue
        for i, value in enumerate(stretch.tolist(), begin):
            if sign * value > extreme:
                at, extreme = i, sign * value
            elif extreme - sign * value > least:
                if sign > 0.0 and extreme >= floor:
                    found.append(at)
                sign, at, extreme = -sign, i, -sign * value
    return found


@dataclass(frozen=True, kw_only=True)
class Settling:
    """The impacts on one bearing by displacement, and from when on the rotor stayed in contact."""

    touched: Array
    """When each impact began [s], shape (K,)."""
    count_interval_90: tuple[int, int]
    """Interval that holds their number with 90 % probability."""
    contact_from: float | None
    """When the last one began, from which on it stayed in contact [s]; None where it did not."""
    contact_from_interval_90: tuple[float, float] | None
    """Interval that holds that with 90 % probability [s]."""

    @classmethod
    def of(cls, touched: Array, surely: Array, perhaps: Array, end: float) -> Settling:
        """By the times [s] of impacts, sure and possible ones, and the end of the part looked at [s]."""
        last = lasting_from(touched, end)
        between = None
        if last is not None:
            early = surely[-1] if len(surely) else touched[0]
            between = (float(early) - NINETY * BEGUN, float(perhaps[-1]) + NINETY * BEGUN)
        return cls(
            touched=touched,
            count_interval_90=(len(surely), len(perhaps)),
            contact_from=last,
            contact_from_interval_90=between,
        )

    def after(self, start: float) -> Settling:
        """The same, in time from a start [s]."""
        last, between = self.contact_from, self.contact_from_interval_90
        return replace(
            self,
            touched=self.touched - start,
            contact_from=None if last is None else last - start,
            contact_from_interval_90=None if between is None else (between[0] - start, between[1] - start),
        )


def lasting_from(touched: Array, end: float) -> float | None:
    """When the last of all impacts began [s]; None where that is within `LASTING` of the end."""
    return float(touched[-1]) if len(touched) and end - touched[-1] >= LASTING else None
