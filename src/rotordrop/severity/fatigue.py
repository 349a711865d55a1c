"""Rolling contact fatigue of a drop: finite segments of the raceways, ISO/TS 16281, rainflow.

All three give the share of the basic rating life that a drop uses: at one, a tenth of new bearings fails. A
drop of a second uses next to nothing of it; what dents a race is the static load.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.race_bearing import Ratings

LIFE = 1e6
"""Revolutions of the basic rating life at the basic dynamic load rating, its definition in ISO 281."""
LOAD_EXPONENT = 3.0
"""Power of the load with which the life of ball bearings falls [1]; ISO 281."""
WEIBULL = 10.0 / 9.0
"""Slope of the distribution of lives [1]: how segments add up to a ring, and rings to a bearing;
for ball bearings Lundberg and Palmgren 1947."""
SEGMENTS = 720
"""Segments of a raceway, half a degree each; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class BallRow:
    """One row of balls."""

    balls: int
    """Number of balls."""
    gamma: float
    """Ball diameter times cosine of the contact angle over pitch diameter [1]."""
    inner: float
    outer: float
    """Ball loads at which a raceway reaches the basic rating life [N]."""


def ball_row(
    rating: float, balls: int, gamma: float, cosine: float, conformity_inner: float, conformity_outer: float
) -> BallRow:
    """Ratings of both raceways of a row from its basic dynamic load rating C [N].

    Source: ISO/TS 16281:2008, basic dynamic load rating of a rolling element, for one row.
    """
    osculation = (
        conformity_inner / conformity_outer * (2.0 * conformity_outer - 1.0) / (2.0 * conformity_inner - 1.0)
    )
    ratio = 1.044 * ((1.0 - gamma) / (1.0 + gamma)) ** 1.72 * osculation**0.41
    radial = rating / (balls * cosine)
    return BallRow(
        balls=balls,
        gamma=gamma,
        inner=radial / 0.407 * (1.0 + ratio ** (10.0 / 3.0)) ** 0.3,
        outer=radial / 0.389 * (1.0 + ratio ** (-10.0 / 3.0)) ** 0.3,
    )


def joined(shares: Array) -> float:
    """Share of the rating life used by several rings together [1]. Source: Weibull 1939, product law."""
    return float(np.sum(np.asarray(shares) ** WEIBULL) ** (1.0 / WEIBULL))


def share_by_segments(
    row: BallRow, time: Array, loads: Array, spin: Array, segments: int = SEGMENTS
) -> float:
    """Share of the rating life that a row uses, counted ball by ball over finite segments of both raceways.

    Time (T,) [s] rises; loads (T, Z) [N] are those at Z equal steps of azimuth, straight between them; spin
    (T,) [rad/s] is that of the inner ring, the outer one stands.

    Source: idea of Menck 2023, The finite segment method, Journal of Tribology 145: a ball that rolls over a
    segment harms it by the cube of its load; segments add up to a ring as pieces of one Weibull body. For a
    ring that turns on and on under a steady load this is ISO/TS 16281.
    Not validated: against a fatigue test of oscillating or dropped bearings.
    """
    step = np.diff(time)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (spin[1:] + spin[:-1]) * step)])
    # balls that roll on both races turn with the mean of their surface speeds; the outer race stands
    cage = 0.5 * (1.0 - row.gamma) * turned
    at = np.linspace(0.0, 2.0 * np.pi, row.balls, endpoint=False)
    place = cage[:, None] + at  # where each ball is in space
    load = _around(loads, place)
    cubed = 0.5 * (load[1:] ** LOAD_EXPONENT + load[:-1] ** LOAD_EXPONENT)
    found = []
    for angle, rating, over in (
        (place - turned[:, None], row.inner, 0.5 * (1.0 + row.gamma)),
        (place, row.outer, 0.5 * (1.0 - row.gamma)),
    ):
        harm = _on_segments(angle, cubed, segments) / (rating**LOAD_EXPONENT * LIFE * row.balls * over)
        found.append(float(np.mean(harm**WEIBULL) ** (1.0 / WEIBULL)))
    return joined(np.array(found))


def _around(loads: Array, place: Array) -> Array:
    """Loads (T, Z) given at equal steps of azimuth, read at other azimuths (T, n), straight between them."""
    count = loads.shape[1]
    share = np.mod(place / (2.0 * np.pi), 1.0) * count
    low = np.floor(share).astype(np.int64) % count
    rest = share - np.floor(share)
    rows = np.arange(len(loads))[:, None]
    return np.asarray((1.0 - rest) * loads[rows, low] + rest * loads[rows, (low + 1) % count])


def _on_segments(angle: Array, cubed: Array, segments: int) -> Array:
    """Passes over every segment times the cube of their load, shape (segments,).

    A step of a ball is spread over the segments it crosses: a coarse step must not leave some untouched.
    """
    begin, end = angle[:-1], angle[1:]
    pieces = max(1, int(np.ceil(np.max(np.abs(end - begin), initial=0.0) * segments / (2.0 * np.pi))))
    found = np.zeros(segments)
    for k in range(pieces):
        middle = begin + (k + 0.5) / pieces * (end - begin)
        place = np.floor(np.mod(middle / (2.0 * np.pi), 1.0) * segments).astype(np.int64) % segments
        passes = np.abs(end - begin) / pieces * segments / (2.0 * np.pi)
        found += np.bincount(place.ravel(), weights=(passes * cubed).ravel(), minlength=segments)
    return found


def share_by_16281(row: BallRow, time: Array, loads: Array, spin: Array) -> float:
    """Share of the rating life by ISO/TS 16281 at every instant, summed over the revolutions (Palmgren 1924).

    As if every instant's load zone had been rolled over whole turns. Shapes as in `share_by_segments`.
    """
    # every point of the turning ring meets all loads; the standing ring fails first where its load is highest
    inner = np.mean(loads**LOAD_EXPONENT, axis=1) ** (1.0 / LOAD_EXPONENT) / row.inner
    outer = (
        np.mean(loads ** (LOAD_EXPONENT * WEIBULL), axis=1) ** (1.0 / (LOAD_EXPONENT * WEIBULL)) / row.outer
    )
    weakest = LOAD_EXPONENT * WEIBULL
    harm = (inner**weakest + outer**weakest) ** (1.0 / WEIBULL)
    return float(np.trapezoid(np.abs(spin) / (2.0 * np.pi) * harm, time)) / LIFE


def share_by_rainflow(row: BallRow, load: Array) -> float:
    """Share of the rating life by rainflow of one load history, that of the most loaded ball [N], shape (T,).

    Every closed swing of the load counts as one ball passing. A load that stays counts nothing, however many
    balls roll under it; so it tells impacts from each other, and no life.
    """
    counts = rainflow(load)
    passes = LIFE * row.balls * 0.5 * (1.0 + row.gamma)
    harm = float(np.sum(counts[:, 1] * counts[:, 0] ** LOAD_EXPONENT))
    return harm / (float(row.inner**LOAD_EXPONENT) * passes)


def rainflow(values: Array) -> Array:
    """Ranges of the swings of a history and how often each is counted (1 or 1/2), shape (n, 2).

    Source: ASTM E1049-85, section 5.4.4.
    """
    x = np.asarray(values, dtype=np.float64)
    slope = np.sign(np.diff(x))
    keep = slope != 0.0
    x = np.append(x[:-1][keep], x[-1]) if keep.any() else x[:1]
    turning = np.flatnonzero(np.diff(np.sign(np.diff(x))) != 0.0) + 1
    points = x[np.concatenate([[0], turning, [len(x) - 1]])] if len(x) > 1 else x
    found: list[tuple[float, float]] = []
    stack: list[float] = []
    for point in points.tolist():
        stack.append(point)
        while len(stack) >= 3:
            last, before = abs(stack[-1] - stack[-2]), abs(stack[-2] - stack[-3])
            if last < before:
                break
            if len(stack) == 3:
                found.append((before, 0.5))
                stack.pop(0)
            else:
                found.append((before, 1.0))
                del stack[-3:-1]
    found += [(abs(b - a), 0.5) for a, b in pairwise(stack)]
    return np.array(found).reshape(-1, 2)


def fatigue_shares(ratings: Ratings, time: Array, loads: Array, spin: Array) -> tuple[float, float, float]:
    """Shares of the rating life that a drop uses: by segments, by ISO/TS 16281, by rainflow [1].

    Time (T,) [s] rises; ball loads (T, rows, Z) [N] are those at equal steps of azimuth, spin (T,) [rad/s]
    that of the inner ring.
    """
    row = ball_row(
        ratings.dynamic,
        ratings.balls,
        ratings.gamma,
        ratings.cosine,
        ratings.conformity_inner,
        ratings.conformity_outer,
    )
    each = [loads[:, k] for k in range(loads.shape[1])]
    return (
        joined(np.array([share_by_segments(row, time, one, spin) for one in each])),
        joined(np.array([share_by_16281(row, time, one, spin) for one in each])),
        joined(np.array([share_by_rainflow(row, one.max(axis=1)) for one in each])),
    )
