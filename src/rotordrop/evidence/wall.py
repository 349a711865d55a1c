"""The wall round the shaft in a sensor plane: centre and radius, from the motion of one drop alone.

Where the rotor floated is a poor centre: a controller holds it some hundredths of the gap beside. What
touches lies on the circle: the place of the first touch, the reversals of impacts, the arc of the swing.
A reversal lies beyond the circle by ``β v``, with v the velocity of approach and ``β`` the inverse natural
frequency of the rotor on its contact; at rest it lies beyond by ``g β²``, and where it runs round with the
angular velocity w by ``w² r β²`` more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.events import INDEPENDENT
from rotordrop.evidence.impacts import Impacts, find_impacts
from rotordrop.evidence.touch import Touch, first_touch
from rotordrop.known import NINETY
from rotordrop.series import noise_by_differences
from rotordrop.units import GRAVITY, fall_speed

CENTRED = 0.08
"""Standard deviation of where a rotor floats from the centre, per axis, over the gap [1] (chosen)."""

_UNLIKE = 0.2
"""Standard deviation of the gap over the way from floating to rest, less one [1] (chosen)."""

LEVER_DOUBT = 0.06
_LEVER = (0.05, LEVER_DOUBT)
"""How far a bearing lies outside its sensor plane over the distance of the planes, and its standard deviation
[1] (chosen)."""

_ROUND = 0.01
"""Standard deviation of a place at the wall over the gap [1]: races that move, shafts that bend (chosen)."""

_STRAYS = 0.35
"""Standard deviation of the depth of a reversal over ``β v`` [1] (chosen)."""

_WHIRLED = 0.3
"""Standard deviation of the gap of a rotor that ends in a whirl over how far it is pressed beyond it [1]
(chosen): a shaft that runs round bends."""

_USUAL_BETA = (6e-4, 1.2)
"""Inverse frequency of rotor on contact [s] and the standard deviation of its logarithm: 5 kg have 2e-4, 6 t
4e-3."""

_SAG_DOUBT = 0.4
"""Standard deviation of the logarithm of the static depth over ``g β²`` [1] (chosen)."""

_STEP, _SHORTEST, _MOST_STEPS = 1.0, 3e-3, 30
"""Steps of radius in which the fits are averaged: over the standard error at the best fit, over the gap at
least [1], and how many to either side at most (all chosen)."""

_UNLIKELY = 7.0
"""Sum of squares beyond the least from which a radius is passed over [1]: its weight is 3 %."""

GAIN = 0.01
"""Standard deviation of the gain of displacement sensors [1] (chosen; calibrated ones keep 1 %)."""

_DOUBTFUL = 0.25
"""An air gap whose 90 % interval reaches this share of it to either side is not determined [1] (chosen)."""

_OTHER_GAP = 2.5
"""In how many standard deviations, its own and those of what is stated, a gap that a record shows by itself
lies off a stated one that it contradicts [1] (chosen)."""

_BIN = 5e-3
"""Length of a stretch that shows where a swinging rotor lies [s] (chosen)."""

_MOST_BINS = 400
_STEPS = np.array([1e-5, 1e-5, 1e-5, 0.3, 0.3, 0.05])
"""Sizes of the unknowns of a wall: centre [m], radius [m], logarithms of ``β`` and sag, lever [1]."""

_MOST_FITS, _MOST_DAMPED = 200, 40
"""Steps of a fit, and tries of one step, at most [1]: a fit takes some ten (chosen)."""

_ALL, _BUT_RADIUS = (0, 1, 2, 3, 4, 5), (0, 1, 3, 4, 5)
"""Unknowns that a fit may move."""

_SEARCHED = 2.0
"""How long after the fall impacts are looked for to find the wall [s] (chosen)."""

_LYING = 0.75
"""A rotor further from a centre that is not yet sure than this share of the gap may lie on its race [1]."""


@dataclass(frozen=True, kw_only=True)
class Wall:
    """The circle in which the shaft moves in one plane."""

    centre: Array
    """Its centre, from the origin of the readings [m], shape (2,)."""
    centre_error: Array
    """Standard error of the centre [m], shape (2,)."""
    gap: float
    """Its radius [m]."""
    gap_error: float
    """Standard error of the radius, gain of the sensors included [m]; 0 where it was given."""
    lever: float
    """How far the touchdown bearing lies outside, over the distance of the planes [1]."""
    touch: Touch | None
    """First touch of the race; None where the fall is not seen to end."""

    @property
    def distance_error(self) -> float:
        """Half the 90 % interval of how far beyond the gap a place is [m], by centre and gap."""
        return NINETY * math.hypot(self.gap_error, float(self.centre_error.max()))

    @property
    def interval_90(self) -> tuple[float, float]:
        """Interval that holds the radius with 90 % probability [m]."""
        half = NINETY * self.gap_error
        return max(self.gap - half, 0.1 * self.gap), self.gap + half

    @property
    def determined(self) -> bool:
        """Whether the record, or who gave it, tells the radius to `_DOUBTFUL` of itself."""
        return NINETY * self.gap_error < _DOUBTFUL * self.gap

    def contradicts(self, stated: tuple[float, float]) -> bool:
        """Whether a radius that the record shows by itself is none that is stated, with its error [m]."""
        gap, doubt = stated
        return abs(self.gap - gap) > _OTHER_GAP * math.hypot(self.gap_error, doubt)


def find_wall(
    place: Array,
    other: Array,
    rate: float,
    fall: tuple[int, int],
    given: tuple[float, float] | None = None,
) -> Wall:
    """Find the circle of one plane.

    Parameters
    ----------
    place : array, shape (N, 2)
        Readings of the plane [m].
    other : array, shape (N, 2)
        Readings of a plane at the other end [m]; those of the plane where there is none.
    rate : float
        Samples per second [Hz].
    fall : tuple of int
        Last sample that surely floats, and first sample by which the rotor lies away from it.
    given : tuple of float, optional
        Radius that is known and its standard error [m].

    Notes
    -----
    Damped least squares with robust weights over centre, radius, ``β``, static depth and the lever of the
    bearing outside the sensor plane; what the record leaves open, the priors named above hold. Centre, radius
    and errors are those of `_moments`; none of it was fitted to known gaps.
    """
    begin, sunk = fall
    until = min(len(place), sunk + int(_SEARCHED * rate))
    place, other = place[:until], other[:until]
    noise = noise_by_differences(place, 3)
    floated = np.mean(place[:begin], axis=0)
    apart = (place - floated) - (other - np.mean(other[:begin], axis=0))
    # how far the rotor lies from where it floated, or strays where it ends in a whirl
    late = slice(min(sunk + 3 * (len(place) - sunk) // 4, len(place) - 1), None)
    lies = math.hypot(*(np.median(place[late], axis=0) - floated))
    size = max(lies, 0.9 * float(np.percentile(np.hypot(*(place[sunk:] - floated).T), 80)))
    down = (place[sunk] - floated) / math.hypot(*(place[sunk] - floated))
    touch = first_touch(place, floated, rate, begin, size, noise)
    touched = None
    if touch is not None and touch.by_kink:
        touched = touch.at(place), touch.at(apart)
        # a touch that is dated so well is placed by the speed of the fall as well
        astray = math.hypot(_ROUND * size, touch.error * fall_speed(size))

    def residual(sought: Array, hits: Impacts, lying: NDArray[np.int64], outward: Array) -> Array:
        centre, gap, beta, lever = sought[:2], sought[2], math.exp(sought[3]), sought[5]

        def beyond(here: Array, aside: Array) -> Array:
            return np.asarray(np.hypot(*(here + lever * aside - centre).T) - gap)

        deepest = sunk + hits.deepest
        pressed = outward[deepest] * beta**2
        depth = pressed + np.hypot(pressed, beta * hits.approach)
        strays = _STRAYS * depth / (_ROUND * size)
        impacts = (beyond(place[deepest], apart[deepest]) - depth) / np.hypot(1.0, strays) / (_ROUND * size)
        pressed = outward[lying] * beta**2
        rest = beyond(place[lying], apart[lying]) - pressed - GRAVITY * beta**2 * math.exp(sought[4])
        rest = rest / np.hypot(1.0, _STRAYS * pressed / (_ROUND * size))
        parts = [
            _robust(impacts),
            np.sqrt(np.log1p(strays**2)),  # of the likelihood: errors that are expected larger cost
            _robust(rest / (_ROUND * size)) / math.sqrt(max(len(lying) / INDEPENDENT, 1.0)),
            (centre - floated) / (CENTRED * size),
            [
                (sought[3] - math.log(_USUAL_BETA[0])) / _USUAL_BETA[1],
                sought[4] / _SAG_DOUBT,
                (lever - _LEVER[0]) / _LEVER[1],
                ((gap + np.median(outward[late]) * beta**2) / size - 1.0) / _UNLIKE,
            ],
        ]
        if touched is not None:
            parts.append(_robust(np.atleast_1d(beyond(*touched) / astray)))
        if given is not None:
            parts.append([(gap - given[0]) / max(given[1], 1e-9)])
        return np.concatenate(parts)

    start = size if given is None else given[0]
    sought = np.array([*floated, start, math.log(_USUAL_BETA[0]), 0.0, _LEVER[0]])
    low = np.array([*(floated - size), 0.2 * size, -10.0, -3.0, -0.5])
    high = np.array([*(floated + size), 1.6 * size, -4.0, 3.0, 0.5])
    for _ in range(10):
        path = place + sought[5] * apart
        radius = np.hypot(*(path - sought[:2]).T)
        hits = find_impacts(path[sunk:] - sought[:2], rate, float(sought[2]), noise, down)
        lying = _lying(
            radius, sunk + (int(hits.deepest[-1]) if len(hits.deepest) else 0), rate, sought[2], noise
        )
        outward = _outward(path - sought[:2], rate)
        frozen = partial(residual, hits=hits, lying=lying, outward=outward)
        before, (sought, slopes) = sought, _least_squares(frozen, sought, low, high)
        if np.max(np.abs(sought[:3] - before[:3])) < 1e-7:
            break
    exact = given is not None and given[1] == 0.0
    mean, error = _moments(frozen, sought, slopes, low, high, len(hits.deepest))
    gap = given[0] if given is not None and exact else float(mean[2])
    doubt = _WHIRLED * max(size - gap, 0.0) if np.median(outward[late]) > GRAVITY else 0.0
    doubt = doubt if given is None else min(doubt, given[1])
    return Wall(
        centre=mean[:2].copy(),
        centre_error=error[:2],
        gap=gap,
        gap_error=0.0 if exact else math.hypot(float(error[2]), GAIN * gap, doubt),
        lever=float(mean[5]),
        touch=touch,
    )


def _moments(
    residual: Callable[[Array], Array], best: Array, slopes: Array, low: Array, high: Array, impacts: int
) -> tuple[Array, Array]:
    """Means and standard errors of the unknowns: the fit at each likely radius, with its marginal likelihood.

    A soft contact in a narrow circle and a hard one in a wide circle explain few impacts alike, which the
    slopes at one of them do not say. Where the ``impacts``, the first of the residuals, lie further from any
    circle than chance lets them in 95 of 100 cases, all errors grow by as much.
    """
    by_chance = impacts + math.sqrt(8.0 * impacts)

    def judged(fit: Array) -> tuple[float, float]:
        rest = residual(fit)
        return float(rest @ rest), max(float(np.sum(rest[:impacts] ** 2)) / max(by_chance, 1.0), 1.0)

    least, misfit = judged(best)
    step = max(_STEP * math.sqrt(misfit * np.linalg.inv(slopes.T @ slopes)[2, 2]), _SHORTEST * best[2])
    costs, fits, inverses = [], [], []
    for side in (-1, 1):
        fit = best
        for number in range(side < 0, _MOST_STEPS):
            fit = fit.copy()
            fit[2] = best[2] + side * number * step
            if not low[2] <= fit[2] <= high[2]:
                break
            fit, inner = _least_squares(residual, fit, low, high, _BUT_RADIUS)
            cost, fit_misfit = judged(fit)
            if cost < least:
                least, misfit = cost, fit_misfit
            if cost - least > _UNLIKELY * misfit:
                break
            costs.append(cost)
            fits.append(fit)
            inverses.append(np.linalg.inv(inner.T @ inner))
    volumes = np.linalg.slogdet(np.array(inverses))[1]
    weight = 0.5 * (volumes - (np.array(costs) - least) / misfit)
    weight = np.exp(weight - np.max(weight))
    weight /= np.sum(weight)
    own = misfit * np.insert(np.diagonal(np.array(inverses), axis1=1, axis2=2), 2, 0.0, axis=1)
    mean = weight @ np.array(fits)
    return mean, np.sqrt(weight @ (own + (np.array(fits) - mean) ** 2))


def _least_squares(
    residual: Callable[[Array], Array], start: Array, low: Array, high: Array, free: Sequence[int] = _ALL
) -> tuple[Array, Array]:
    """Unknowns within bounds at which the sum of squares is least, and the slopes of the residuals there.

    Those that are not free keep their values. Damped Gauss-Newton steps by forward differences; SciPy's take
    half a second to load.
    """
    sought, damping, unit = np.clip(start, low, high), 1e-3, _STEPS[list(free)]
    rest = residual(sought)
    for _ in range(_MOST_FITS):
        steps = 1e-4 * _STEPS * np.where(sought + 1e-4 * _STEPS > high, -1.0, 1.0)
        rows = np.diag(steps)
        slopes = np.column_stack([(residual(sought + rows[k]) - rest) / steps[k] for k in free])
        scaled = slopes * unit
        for _ in range(_MOST_DAMPED):
            square = scaled.T @ scaled + damping * np.eye(len(unit))
            step = np.zeros(len(sought))
            step[list(free)] = unit * np.linalg.solve(square, scaled.T @ rest)
            tried = np.clip(sought - step, low, high)
            there, moved = residual(tried), np.max(np.abs(tried - sought) / _STEPS)
            if there @ there <= rest @ rest or moved < 1e-3:
                break
            damping *= 10.0
        sought, rest, damping = tried, there, max(0.1 * damping, 1e-9)
        if moved < 1e-3:
            break
    return sought, slopes


def _robust(error: Array) -> Array:
    """Errors over their standard deviations whose squares grow like a line when large (pseudo-Huber)."""
    return np.asarray(np.sign(error) * np.sqrt(2.0 * (np.sqrt(1.0 + error**2) - 1.0)))


def _outward(place: Array, rate: float) -> Array:
    """Centrifugal acceleration of a motion (N, 2) about a centre [m/s²], by its turn over a stretch."""
    half = min(max(int(0.5 * _BIN * rate), 2), (len(place) - 1) // 2)
    angle = np.pad(np.unwrap(np.arctan2(place[:, 1], place[:, 0])), half, mode="edge")
    turning = (angle[2 * half :] - angle[: -2 * half]) * rate / (2.0 * half)
    return np.asarray(turning**2 * np.hypot(*place.T))


def _lying(radius: Array, since: int, rate: float, gap: float, noise: float) -> NDArray[np.int64]:
    """Middles of the stretches after the last impact in which the rotor keeps its distance to the centre."""
    length = max(int(_BIN * rate), 4)
    since = max(min(since + int(2e-3 * rate), len(radius) - 8 * length), 0)
    count = (len(radius) - since) // length
    stretches = radius[since : since + count * length].reshape(count, length)
    # about a centre that is not yet right a rotor on its race seems to come and go, evenly; a flight bends
    ramp = np.linspace(-0.5, 0.5, length)
    even = stretches - stretches.mean(axis=1, keepdims=True)
    even = even - np.outer(even @ ramp / (ramp @ ramp), ramp)
    calm = (even.std(axis=1) < 0.015 * gap + noise) & (stretches.mean(axis=1) > _LYING * gap)
    middles = since + length * np.flatnonzero(calm) + length // 2
    return np.asarray(middles[:: max(len(middles) // _MOST_BINS, 1)], dtype=np.int64)
