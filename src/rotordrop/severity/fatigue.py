"""Rolling contact fatigue of a drop by ISO/TS 16281: the share of the basic rating life that it uses.

At one, a tenth of new bearings fails. A drop of a second uses next to nothing of it; what dents a race is the
static load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import Ratings

LIFE = 1e6
"""Revolutions of the basic rating life at the basic dynamic load rating, its definition in ISO 281."""
LOAD_EXPONENT = 3.0
"""Power of the load with which the life of ball bearings falls [1]; ISO 281."""
WEIBULL = 10.0 / 9.0
"""Slope of the distribution of lives [1]: how rings add up to a bearing;
for ball bearings Lundberg and Palmgren 1947."""


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


def joined(shares: Sequence[float]) -> float:
    """Share of the rating life used by several rings together [1]. Source: Weibull 1939, product law."""
    return float(np.sum(np.asarray(shares) ** WEIBULL) ** (1.0 / WEIBULL))


def share_by_16281(row: BallRow, time: Array, loads: Array, spin: Array) -> float:
    """Share of the rating life by ISO/TS 16281 at every instant, summed over the revolutions (Palmgren 1924).

    As if every instant's load zone had been rolled over whole turns. Time (T,) [s] rises; loads (T, Z) [N]
    are those at Z equal steps of azimuth; spin (T,) [rad/s] is that of the inner ring, the outer one stands.
    """
    # every point of the turning ring meets all loads; the standing ring fails first where its load is highest
    inner = np.mean(loads**LOAD_EXPONENT, axis=1) ** (1.0 / LOAD_EXPONENT) / row.inner
    outer = (
        np.mean(loads ** (LOAD_EXPONENT * WEIBULL), axis=1) ** (1.0 / (LOAD_EXPONENT * WEIBULL)) / row.outer
    )
    weakest = LOAD_EXPONENT * WEIBULL
    harm = (inner**weakest + outer**weakest) ** (1.0 / WEIBULL)
    return float(np.trapezoid(np.abs(spin) / (2.0 * np.pi) * harm, time)) / LIFE


def fatigue_share(ratings: Ratings, time: Array, loads: Array, spin: Array) -> float:
    """Share of the rating life that a drop uses [1].

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
    return joined([share_by_16281(row, time, loads[:, k], spin) for k in range(loads.shape[1])])
