"""Filter and smoother over one recorded drop, and over several drops of one machine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.physics import ring
from rotordrop.track import _filter
from rotordrop.track import _propagation as P
from rotordrop.track._arrays import unpack
from rotordrop.track._filter import Measurements, Segment, backward_pass, forward_pass
from rotordrop.track.problem import DropProblem, private_copy

REFERENCE_STEP = 50e-6
"""Time for which the numbers of `PassSettings` hold [s]."""
LARGEST_PHASE = 0.8
"""Largest phase [rad] by which the fastest mode may turn in one integration step of the filter.

Source: of 28 corpus cases at 10 kHz one was silently wrong with 1.0, where passes went to and fro over a race
of 17 kHz (6.2 kN of a peak of 3.6); none with 0.8, in 6 % less time."""
FROZEN = 2
"""Integration steps over which a Jacobian is held, where there is more than one in a sample."""
THIRD_ORDER_PHASE = 1.2
"""Largest phase [rad] of the fastest mode in these steps for which the exponential of the Jacobian is taken
to third order, which turns that mode by 9 % too little then; beyond it is taken to fourth, which is within
9 % up to the largest phase in two steps.

Source: at 1.15 the errors of the peaks of seven drops of DropBench moved by 0.1 % in the median.
"""
LOADED = 2.0
"""Stiffness of balls at eight times their load at rest over that at rest [1]: sprung rings swing on them.

A ring of 15 g that did not count, with little damping, made a peak of 1.7 kN into one of 4.5 (0 to 9.2).
"""


@dataclass(frozen=True, kw_only=True)
class PassSettings:
    """Numbers of one pass."""

    substeps: int = 4
    """Integration steps per sample."""
    impulse: float = 2e-4
    """Standard deviation of an unknown impulse per 50 µs at each bearing and axis [N s]."""
    share: float = 0.01
    """The same as a fraction of the contact impulse of 50 µs [1]."""
    spin_noise: float = 0.1
    """Standard deviation of the race spin per 50 µs [rad/s]."""
    speed_noise: float = 1e-3
    """Standard deviation of the rotor speed per 50 µs [rad/s]."""
    learning_end: float = 0.05
    """Time [s] after which friction and race may drift faster: once a race turns with the rotor, the friction
    law near zero speed decides, which no record of positions shows, and must not rewrite what the first
    impacts said."""

    def for_sampling(self, dt: float, fastest: float = 0.0) -> P.FilterSettings:
        """Settings of the kernel for a sample distance [s]; noise grows with the square root of time.

        ``fastest`` is the highest natural frequency of the model [rad/s]; it sets a least number of steps.
        """
        growth = math.sqrt(dt / REFERENCE_STEP)
        phase = fastest * dt
        substeps = max(1, round(self.substeps * dt / REFERENCE_STEP), math.ceil(phase / LARGEST_PHASE))
        frozen = FROZEN if substeps > 1 else 1
        substeps += substeps % frozen
        return P.FilterSettings(
            dt=dt,
            substeps=substeps,
            frozen=frozen,
            terms=3 if frozen * phase <= THIRD_ORDER_PHASE * substeps else 4,
            impulse=self.impulse * growth,
            share=self.share / growth,
            spin_noise=self.spin_noise * growth,
            speed_noise=self.speed_noise * growth,
            learning_end=self.learning_end,
        )


@dataclass(frozen=True, kw_only=True)
class Forward:
    """A forward pass over a drop, in segments; N samples, n estimated, C channels.

    Of every segment the covariance that it begins with is kept as a checkpoint. What the smoother needs
    besides is filtered again from there, with the same bits: kept for all samples it would be hundreds of
    megabytes. The last segments are kept as far as memory goes, until the means are smoothed.
    """

    problem: DropProblem
    settings: P.FilterSettings
    impulse: float
    """Size of the unknown impulses of the pass [N s]."""
    prior: Array
    """Prior mean of the first sample, shape (n,)."""
    reference: Array
    """Trajectory to linearise at, shape (M, n)."""
    length: int
    """Samples of a segment."""
    done: int = 0
    """Number of samples before the filter diverged, or all."""
    means: Array
    """Posterior mean of every sample, shape (N, n)."""
    innovations: Array
    innovation_variances: Array
    """One column for each channel and one for the speed, NaN where missing, shape (N, C + 1)."""
    covariance_at_end: Array
    """Covariance where the pass ended: of the last sample, or of the one that diverged, shape (n, n)."""
    checkpoints: list[Array] = field(default_factory=list)
    """Covariance at the beginning of every segment, shape (n, n)."""
    segments: dict[int, Segment] = field(default_factory=dict)
    """Segments kept for the smoothed means, by number."""

    def filter_segment(
        self, number: int, P: Array, *, keep: bool, covariances: bool = False
    ) -> tuple[int, Segment]:
        """Filter a segment from the covariance ``P`` (n, n) at its beginning, which becomes that of its end.

        Gives the number of samples done from the first of the pass on, and the segment, filled.
        """
        problem, start = self.problem, number * self.length
        chosen = slice(start, min(start + self.length, len(self.means) - 1) + 1)
        n, s, updates = self.means.shape[1], problem.n_dynamic, problem.n_channels + 1
        count = chosen.stop - start if keep else 0
        segment = Segment(
            first=min(start, 1),
            reference=self.reference[chosen],
            x=self.means[chosen],
            e=self.innovations[chosen],
            S=self.innovation_variances[chosen],
            P=np.empty((count, n * (n + 1) // 2 if covariances else 0), dtype=np.float32),
            F=np.empty((count, s, s + len(problem.unknowns)), dtype=np.float32),
            H=np.zeros((count, updates, n)),
            K=np.empty((count, updates, n)),
            sigma=np.empty((count, len(problem.model.bearing_names))),
        )
        measured = Measurements(
            time=problem.time[chosen],
            readings=np.ascontiguousarray(problem.readings[chosen]),
            speed=problem.speed[chosen],
            H=problem.reading_rows,
            R=problem.white_variances,
            speed_R=problem.speed_variance,
        )
        x_0, p = self.means[start] if start else self.prior, private_copy(problem.model.parameters)
        done = p.form.of(forward_pass)(
            x_0, P, measured, problem.targets, p, self.settings, problem.sensor_form, segment
        )
        return start + int(done), segment

    def from_the_last(self, *, covariances: bool) -> Iterator[tuple[slice, Segment]]:
        """The segments of the samples that were followed, backwards, and where their samples stand."""
        last = min(max(self.done - 2, 0) // self.length, len(self.checkpoints) - 1)
        for number in range(last, -1, -1):
            samples = slice(number * self.length, min((number + 1) * self.length + 1, self.done))
            segment = None if covariances else self.segments.pop(number, None)
            segment = segment or self._recomputed(number, covariances=covariances)
            yield samples, segment.cut(samples.stop - samples.start)

    def _recomputed(self, number: int, *, covariances: bool) -> Segment:
        """A segment filtered again from its checkpoint."""
        P = self.checkpoints[number].copy()
        return self.filter_segment(number, P, keep=True, covariances=covariances)[1]

    def covariance(self, sample: int) -> Array:
        """Filtered covariance at a sample, shape (n, n); single precision."""
        number = min(sample // self.length, len(self.checkpoints) - 1)
        P = np.empty_like(self.covariance_at_end)
        unpack(self._recomputed(number, covariances=True).P[sample - number * self.length], P)
        return P

    @property
    def size_of_segments(self) -> int:
        """Memory of the segments that are kept [B]."""
        kept = (array for one in self.segments.values() for array in (one.P, one.F, one.H, one.K, one.sigma))
        return sum(array.nbytes for array in kept)

    @property
    def parameter_sample(self) -> int:
        """Sample at which parameters are read: shortly after the first contacts."""
        return min(self.problem.parameter_sample, max(self.done - 1, 0))

    @property
    def last(self) -> Array:
        """Covariance (n, n) of the last valid sample."""
        return self.covariance(max(self.done - 1, 0)) if has_diverged(self) else self.covariance_at_end

    @property
    def nis(self) -> float:
        """Mean normalised innovation squared [1]; about one when model and noise are right."""
        return float(np.nanmean(self.innovations[: self.done] ** 2 / self.innovation_variances[: self.done]))

    @property
    def negative_log_likelihood(self) -> float:
        """Negative logarithm of the marginal likelihood of the readings, up to a constant [1]."""
        S = self.innovation_variances[: self.done]
        return 0.5 * float(np.nansum(self.innovations[: self.done] ** 2 / S + np.log(S)))


def has_diverged(filtered: Forward) -> bool:
    """Whether the filter diverged before the last sample."""
    return filtered.done < len(filtered.means)


def fastest_frequency(problem: DropProblem) -> float:
    """Highest natural frequency [rad/s] of the model: of rotor, race or sprung ring on its balls."""
    p = problem.model.parameters
    races = p.bearing[:, L.BEARING_DAMPING] / np.array(
        [float(b.damping_time) for b in problem.model.machine.touchdown_bearings]
    )
    race = np.sqrt(np.max(races / p.bearing[:, L.RACE_MASS]))
    rings = p.bearing[p.bearing[:, L.RING + ring.MASS] > 0.0, L.RING : L.RING_END]
    stiffness = LOADED * rings[:, ring.STOP] / ring.STOP_STIFFNESS
    light = np.sqrt(np.max(stiffness / rings[:, ring.MASS], initial=0.0))
    return float(max(np.sqrt(np.max(p.eigenvalue)), race, light))


def forward(
    problem: DropProblem,
    settings: PassSettings,
    *,
    mean: Array | None = None,
    covariance: Array | None = None,
    reference: Array | None = None,
    samples: int | None = None,
    memory: int | None = None,
) -> Forward:
    """Run the filter over the first samples of a problem; by default over all.

    The prior has a mean (n,) and a covariance (n, n), the problem's by default. The first M samples are
    linearised at a ``reference`` (M, n), the others at the filter's own mean. Segments are kept for the
    smoothed means up to a ``memory`` [B], by default none.
    """
    count = len(problem.time) if samples is None else min(samples, len(problem.time))
    mean = problem.mean if mean is None else mean
    P = np.array(problem.covariance if covariance is None else covariance)
    n, updates = len(mean), problem.n_channels + 1
    dt = float(problem.time[1] - problem.time[0])
    found = Forward(
        problem=problem,
        settings=settings.for_sampling(dt, fastest_frequency(problem)),
        impulse=settings.impulse,
        prior=np.ascontiguousarray(mean),
        reference=np.zeros((0, n)) if reference is None else np.ascontiguousarray(reference[:count]),
        length=_segment_length(problem),
        means=np.empty((count, n)),
        innovations=np.empty((count, updates)),
        innovation_variances=np.empty((count, updates)),
        covariance_at_end=P,
    )
    done = 0
    for number in range(max(math.ceil((count - 1) / found.length), 1)):
        found.checkpoints.append(P.copy())
        done, segment = found.filter_segment(number, P, keep=memory is not None)
        if memory is not None:
            found.segments[number] = segment
            while len(found.segments) > 1 and found.size_of_segments > memory:
                del found.segments[min(found.segments)]
        if done <= min((number + 1) * found.length, count - 1):
            break
    return replace(found, done=done)


def _segment_length(problem: DropProblem) -> int:
    """Samples of a segment: a free fall through the air gap, for rounding grows from impact to impact.

    Smoothed means go forward from the first sample of a segment. Through the first impacts of the bundled
    drop, in single precision, they err by 6e-4 standard deviations after 200 samples, by 4e-3 after 500.
    """
    dt = float(problem.time[1] - problem.time[0])
    return max(2, math.ceil(problem.fall_time / dt))


@dataclass(frozen=True, kw_only=True)
class Smoothed:
    """Smoothed estimate of one drop."""

    filtered: Forward
    means: Array
    """Smoothed estimate at each sample, shape (N, n)."""
    watched: Array
    """Smoothed covariance of the watched linear functions at each sample, shape (N, G, G)."""
    kept: NDArray[np.int64]
    """Samples whose whole covariance can be asked for, shape (K,)."""
    posterior: Array
    information: Array
    """Filtered P and Λ of these samples: the smoothed covariance is ``P − P Λ P``, shape (K, n, n)."""
    score_0: Array
    information_0: Array
    """λ and Λ before the first measurement."""

    def covariance(self, sample: int) -> Array:
        """Smoothed covariance at a kept sample, shape (n, n)."""
        found = np.flatnonzero(self.kept == sample)
        if len(found) == 0:
            raise IndexError(f"the covariance of sample {sample} was not kept; kept are {self.kept.tolist()}")
        P = self.posterior[found[0]]
        return np.asarray(P - P @ self.information[found[0]] @ P)


def smooth(
    filtered: Forward,
    score: Array | None = None,
    information: Array | None = None,
    *,
    watched: Array | None = None,
    kept: Sequence[int] | None = None,
) -> Smoothed:
    """Run the backward pass.

    ``score`` (n,) and ``information`` (n, n) are what later drops say about the last sample, ``watched``
    (G, n) linear functions of the estimate whose covariance is wanted at every sample. The whole covariance
    is ``kept`` of some samples; by default of the first, the one that parameters are read at and the last.
    """
    n, done = filtered.means.shape[1], filtered.done
    wanted = (0, min(filtered.parameter_sample, done - 1), done - 1) if kept is None else kept
    chosen = np.unique(np.asarray(wanted, dtype=np.int64))
    rows = np.zeros((0, n)) if watched is None else np.ascontiguousarray(watched)
    means, blocks = np.empty((done, n)), np.empty((done, len(rows), len(rows)))
    posterior, stored = np.empty((len(chosen), n, n)), np.empty((len(chosen), n, n))
    lam = np.zeros(n) if score is None else score.copy()
    Lam = np.zeros((n, n)) if information is None else information.copy()
    noise_decay = filtered.problem.sensor_form.noise_decay
    for samples, segment in filtered.from_the_last(covariances=True):
        own = slice(*np.searchsorted(chosen, (samples.start + segment.first, samples.stop)))
        backward_pass(
            segment,
            noise_decay,
            rows,
            chosen[own] - samples.start,
            means[samples],
            blocks[samples],
            posterior[own],
            stored[own],
            lam,
            Lam,
        )
    return Smoothed(
        filtered=filtered,
        means=means,
        watched=blocks,
        kept=chosen,
        posterior=posterior,
        information=stored,
        score_0=lam,
        information_0=Lam,
    )


def smooth_means(filtered: Forward, score: Array | None = None) -> tuple[Array, Array]:
    """Smoothed means (N, n) alone, and λ before the first measurement, without any covariance.

    ``score`` (n,) is what later drops say about the last sample. The segments that the pass kept are given
    back.
    """
    n, problem = filtered.means.shape[1], filtered.problem
    means, p = np.empty((filtered.done, n)), private_copy(problem.model.parameters)
    lam = np.zeros(n) if score is None else score.copy()
    for samples, segment in filtered.from_the_last(covariances=False):
        _filter.smooth_means(
            filtered.prior,
            filtered.checkpoints[samples.start // filtered.length],
            problem.time[samples],
            problem.targets,
            p,
            filtered.settings,
            problem.sensor_form,
            segment,
            means[samples],
            lam,
        )
    return means, lam
