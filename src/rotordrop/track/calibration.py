"""One fit of a drop model to several recorded drops of a machine, by repeated filter and smoother passes.

Each pass linearises at the smoothed trajectory of the pass before: a Gauss–Newton step of the whole
problem. The window grows, because a long chaotic window has no use for a start that is wrong. The drops are
chained: what belongs to the machine is carried from the end of one drop to the beginning of the next, what
belongs to a drop is not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError
from rotordrop.progress import Progress
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import (
    REFERENCE_STEP,
    Forward,
    PassSettings,
    Smoothed,
    forward,
    has_diverged,
    smooth,
    smooth_means,
)
from rotordrop.units import fall_time


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One stage: window after power-off [s], unknown forces, their share, passes, steps per 50 µs.

    A window that ends before `WHOLE_DROP` is written for a first contact at 7.5 ms and a free fall of 7.1 ms;
    `window_end` says where it ends for a drop.

    ``force`` is the unknown force at each bearing and axis as a part of the weight on a bearing, ``share`` as
    a part of the force of the contact [1]; both are new every `STEP` of a free fall through the gap.

    ``damping`` holds the parameters to where the pass before had them, that many times as strongly [1] as the
    prior holds them to the guesses (Levenberg–Marquardt): the first impacts alone leave some of them so free
    that an undamped step lands in another minimum.
    """

    until: float
    force: float
    share: float
    passes: int
    substeps: int = 4
    damping: float = 0.0


BLIND_SCHEDULE: tuple[Stage, ...] = (
    Stage(until=0.012, force=0.7, share=0.05, passes=1),
    Stage(until=0.012, force=0.35, share=0.03, passes=2),
    Stage(until=0.016, force=0.2, share=0.03, passes=2),
    Stage(until=0.020, force=0.2, share=0.02, passes=2),
    Stage(until=0.030, force=0.14, share=0.02, passes=2),
    Stage(until=0.045, force=0.14, share=0.02, passes=2),
    Stage(until=0.060, force=0.14, share=0.02, passes=2),
)
"""From nominal guesses."""

DAMPED_SCHEDULE: tuple[Stage, ...] = (
    *(replace(stage, damping=3.0 if stage.until < 0.02 else 1.0) for stage in BLIND_SCHEDULE[:-1]),
    BLIND_SCHEDULE[-1],
)
"""The same windows in short steps: another way to the record."""

CALIBRATED_SCHEDULE: tuple[Stage, ...] = (
    Stage(until=0.02, force=0.07, share=0.01, passes=1),
    Stage(until=0.06, force=0.07, share=0.01, passes=1),
)
"""With a calibrated machine: what is left is the state, the sensors and the drop's own unknowns."""

QUICK_SCHEDULE: tuple[Stage, ...] = (Stage(until=0.2, force=0.07, share=0.01, passes=1, substeps=3),)
"""With a calibrated machine: one pass, linearised at the filter's own estimate."""

STEP = 0.007
"""Time over which unknown forces are alike, over the time of a free fall through the air gap [1]."""
SPIN = 0.07
"""Unknown friction on races and rotor as a coefficient of friction under the weight [1]."""
LEARNING = 7.0
"""Time at which a race turns with the rotor, over the time of a free fall [1]; see `PassSettings`."""
REFERENCE_CONTACT = 0.0075
REFERENCE_FALL = fall_time(0.25e-3)
"""First contact and time of a free fall that the windows of the schedules are written for [s]."""
WHOLE_DROP = 0.1
"""Windows from here on are parts of the drop, not of its first contacts [s]."""
FITTING_NIS = 1.25
"""Mean normalised innovation squared up to which a model fits its record [1]."""
LOOSER = (1.0, 8.0, 32.0)
"""Factors on the unknown impulses with which a pass that diverged is repeated [1]."""
MOST_REPEATS, SMALL_CHANGE = 6, 5.0
"""Repeats of a window, and the change of the log likelihood that ends them [1].

A fall does not end them: on a rotor of 6 t it fell by 48 in one pass of the whole drop and rose by 194 in the
next three, and the peak moved by 9 %.
"""
FIT_MEMORY = 120_000_000
"""Memory [B] for the segments that the passes of a fit keep, shared by its drops (chosen): three fifths of a
whole drop at 20 kHz, 128 estimated; the rest is filtered again."""
THREADS = 2
"""Passes over the same drops that run side by side [1]."""


@dataclass(frozen=True, kw_only=True)
class TrackedDrops:
    """Smoothed estimates of all drops of a fit."""

    problems: tuple[DropProblem, ...]
    """The drops, in the order of the chain."""
    filtered: tuple[Forward, ...]
    """Their last passes."""
    trajectories: tuple[Array, ...]
    """Smoothed means of each drop, shape (M, n)."""
    noise_factors: tuple[float, ...]
    """Process noise of the last pass over the baseline, as each drop needed it to be followed [1]."""

    @property
    def nis(self) -> tuple[float, ...]:
        """Mean normalised innovation squared of each drop [1]."""
        return tuple(one.nis for one in self.filtered)

    @property
    def diverged(self) -> tuple[bool, ...]:
        """Whether the filter diverged, drop by drop."""
        return tuple(map(has_diverged, self.filtered))

    @property
    def negative_log_likelihood(self) -> float:
        """Negative logarithm of the marginal likelihood of all drops, up to a constant [1]."""
        return sum(one.negative_log_likelihood for one in self.filtered)

    @cached_property
    def smoothed(self) -> tuple[Smoothed, ...]:
        """Smoothed estimates with their covariances: most fits of a search are never asked for them."""
        return tuple(smoothed_chain(self.problems, self.filtered))


def window_end(stage: Stage, first_contact: float, fall: float) -> float:
    """End of a window [s] with the first contact [s] of a drop and the time [s] of a free fall through its
    air gap: rebounds last longer with it.
    """
    if stage.until >= WHOLE_DROP:
        return stage.until
    return first_contact + (stage.until - REFERENCE_CONTACT) * fall / REFERENCE_FALL


def track(
    problems: Sequence[DropProblem],
    schedule: Sequence[Stage],
    *,
    references: Sequence[Array] | None = None,
    noise_factor: float = 1.0,
    progress: Progress | None = None,
) -> TrackedDrops:
    """Fit the drop model to recorded drops of one machine; the prior of the first one holds for the machine.

    The first pass is linearised at the ``references`` (M, n) of the drops, where there are any. The unknown
    impulses of every stage are larger by the ``noise_factor`` [1]. ``progress`` is called with a sentence and
    the fraction done.
    """
    # A pass from the guesses gives a place to linearise at, no estimate yet: it needs a second one.
    from_guesses = references is None and sum(stage.passes for stage in schedule) > 1
    contact, fall = max(one.first_contact for one in problems), problems[0].fall_time
    ends = [window_end(stage, contact, fall) for stage in schedule]
    total = sum(end * stage.passes for end, stage in zip(ends, schedule, strict=True))
    done = 0.0
    at: Sequence[Array | None] = references or [None] * len(problems)
    for end, stage in zip(ends, schedule, strict=True):
        settings = stage_settings(problems[0], stage, noise_factor)
        for _ in range(stage.passes):
            if progress is not None:
                progress(f"fitting the first {1e3 * end:.0f} ms", done / total)
            damped = [_damped(*one, stage) for one in zip(problems, at, strict=True)]
            filtered = filtered_chain(damped, settings, at, end, from_guesses=from_guesses)
            at = smoothed_means_of_chain(problems, filtered)
            from_guesses = False
            done += end
    return TrackedDrops(
        problems=tuple(problems),
        filtered=tuple(filtered),
        trajectories=tuple(one for one in at if one is not None),
        noise_factors=tuple(noise_factor * one.impulse / settings.impulse for one in filtered),
    )


def converged(
    problems: Sequence[DropProblem],
    stage: Stage,
    references: Sequence[Array],
    *,
    passes: int = MOST_REPEATS,
    noise_factor: float = 1.0,
    progress: Progress | None = None,
) -> TrackedDrops:
    """A fit after as many passes over a window as still change the likelihood, or as are allowed.

    Where the likelihood falls, the next pass begins half way, unless a drop has diverged in one of the two.
    The window is that of the stage; the rest is as for `track`.
    """
    once = (replace(stage, passes=1),)

    def passed(number: int, references: Sequence[Array]) -> TrackedDrops:
        def report(words: str, share: float) -> None:
            if progress is not None:
                progress(words, (number + share) / passes)

        return track(problems, once, references=references, noise_factor=noise_factor, progress=report)

    fit = passed(0, references)
    at: Sequence[Array] = fit.trajectories
    for number in range(1, passes):
        before, fit = fit.negative_log_likelihood, passed(number, at)
        rise = before - fit.negative_log_likelihood
        if abs(rise) < SMALL_CHANGE:
            break
        # Full steps may jump to and fro across the best fit.
        known, at = at, fit.trajectories
        if rise < 0.0 and all(len(one) == len(other) for one, other in zip(known, at, strict=True)):
            at = [0.5 * (one + other) for one, other in zip(known, at, strict=True)]
    return fit


def stage_settings(problem: DropProblem, stage: Stage, factor: float = 1.0) -> PassSettings:
    """Settings of the passes of a stage by the size of the machine: weight, air gap, friction of a race.

    ``factor`` is that on its unknown forces [1].
    """
    model = problem.model
    weight, bearings = float(np.mean(model.load_shares)), model.machine.touchdown_bearings
    growth = math.sqrt(STEP * problem.fall_time / REFERENCE_STEP)
    impulse = weight * REFERENCE_STEP * growth
    race = max(float(bearing.bore_radius) / float(bearing.race.inertia) for bearing in bearings)
    rotor = sum(float(bearing.bore_radius) for bearing in bearings) / model.fe.polar_inertia
    return PassSettings(
        substeps=stage.substeps,
        impulse=factor * stage.force * impulse,
        share=factor * stage.share * growth,
        spin_noise=SPIN * impulse * race,
        speed_noise=SPIN * impulse * rotor,
        learning_end=LEARNING * problem.fall_time,
    )


def _damped(problem: DropProblem, reference: Array | None, stage: Stage) -> DropProblem:
    """The problem with its parameters held to a reference (M, n), as strongly as a stage says."""
    if stage.damping == 0.0:
        return problem
    chosen, held = problem.parameter_slice, 1.0 + stage.damping
    known = np.atleast_2d(problem.start if reference is None else reference)
    before = known[min(problem.parameter_sample, len(known) - 1)]
    mean, start = problem.mean.copy(), problem.start.copy()
    for values in (mean, start):
        values[chosen] = (values[chosen] + stage.damping * before[chosen]) / held
    narrower = np.ones(len(mean))
    narrower[chosen] = 1.0 / math.sqrt(held)
    return replace(
        problem, mean=mean, start=start, covariance=problem.covariance * np.outer(narrower, narrower)
    )


def is_inconsistent(tracked: TrackedDrops) -> bool:
    """Whether innovations or unknown impulses of a drop are larger than a fitting model leaves."""
    return any(tracked.diverged) or max(tracked.noise_factors) > 1.0 or max(tracked.nis) > FITTING_NIS


def filtered_chain(
    problems: Sequence[DropProblem],
    settings: PassSettings,
    references: Sequence[Array | None],
    until: float,
    *,
    from_guesses: bool = False,
) -> list[Forward]:
    """One forward pass through the chain of drops."""
    filtered: list[Forward] = []
    for problem, reference in zip(problems, references, strict=True):
        mean, covariance = prior_of_next(filtered[-1] if filtered else None, problem)
        if from_guesses and not filtered:
            mean = problem.start
        samples = int(np.searchsorted(problem.time, until, side="right"))
        passed = partial(
            forward,
            problem,
            mean=mean,
            covariance=covariance,
            samples=samples,
            memory=FIT_MEMORY // len(problems),
        )
        result = passed(settings, reference=reference)
        # One that diverges is repeated without the reference, then more loosely.
        for factor in LOOSER if reference is not None else LOOSER[1:]:
            if result.done == samples:
                break
            result.segments.clear()
            looser = replace(settings, impulse=factor * settings.impulse, share=factor * settings.share)
            result = max(result, passed(looser, reference=None), key=lambda one: one.done)
        if result.done < min(samples, 10):
            raise IdentificationError(
                f"the filter diverged after {result.done} of {samples} samples; the machine's guesses are "
                "too far from the record. Check air gap, bearing nodes, sensor angles and support guesses."
            )
        filtered.append(result)
    return filtered


def smoothed_chain(problems: Sequence[DropProblem], filtered: Sequence[Forward]) -> list[Smoothed]:
    """The backward pass through the chain of drops."""
    smoothed: list[Smoothed] = []
    score, information = None, None
    for problem, one in zip(reversed(problems), reversed(filtered), strict=True):
        smoothed.append(smooth(one, score, information, watched=problem.watched))
        score = _shared(problem, smoothed[-1].score_0)
        information = _shared(problem, smoothed[-1].information_0)
    return smoothed[::-1]


def smoothed_means_of_chain(problems: Sequence[DropProblem], filtered: Sequence[Forward]) -> list[Array]:
    """The smoothed means of `smoothed_chain` alone."""
    trajectories: list[Array] = []
    score = None
    for problem, one in zip(reversed(problems), reversed(filtered), strict=True):
        means, before = smooth_means(one, score)
        trajectories.append(means)
        score = _shared(problem, before)
    return trajectories[::-1]


def _shared(problem: DropProblem, array: Array) -> Array:
    """An array (n,) or (n, n) with what all drops share, and zero elsewhere."""
    found, places = np.zeros_like(array), np.ix_(*[problem.machine_indices] * array.ndim)
    found[places] = array[places]
    return found


def prior_of_next(before: Forward | None, problem: DropProblem) -> tuple[Array, Array]:
    """Prior of a drop: its own state, and the machine as known after the drop before, if there is one."""
    mean, covariance = problem.mean.copy(), problem.covariance.copy()
    if before is not None:
        shared = problem.machine_indices
        mean[shared] = before.means[before.done - 1][shared]
        covariance[shared, :] = 0.0
        covariance[:, shared] = 0.0
        covariance += _shared(problem, before.last)
    return mean, covariance
