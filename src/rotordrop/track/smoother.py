"""Filter and smoother over one recorded drop, and over several drops of one machine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.physics import ring
from rotordrop.track import _filter as F
from rotordrop.track import _propagation as P
from rotordrop.track._covariance import unpack
from rotordrop.track.problem import DropProblem, private_copy

Compact = NDArray[np.float32]
"""What a pass stores of covariances and transitions for the smoother: seven digits of them are plenty."""

Number = TypeVar("Number", np.float32, np.float64)

Keep = Literal["all", "means", "nothing"]
"""What a pass keeps: what the smoother needs, what smoothed means alone need, or nothing."""

REFERENCE_STEP = 50e-6
"""Time for which the numbers of `PassSettings` hold [s]."""
STEP = 0.007
"""Time over which unknown forces are alike, over the time of a free fall through the air gap [1]."""
SPIN = 0.07
"""Unknown friction on races and rotor as a coefficient of friction under the weight [1]."""
LEARNING = 7.0
"""Time at which a race turns with the rotor, over the time of a free fall [1]; see `PassSettings`."""
PASS_MEMORY = 64_000_000
"""Memory [B] for what a pass keeps of its samples for the smoother; what does not fit is filtered again."""
LARGEST_PHASE = 1.0
"""Largest phase [rad] by which the fastest mode may turn in one integration step of the filter."""
FROZEN = 2
"""Integration steps over which a Jacobian is held, where there is more than one in a sample."""
THIRD_ORDER_PHASE = 1.2
"""Largest phase [rad] of the fastest mode in these steps for which the exponential of the Jacobian is taken
to third order, which turns that mode by 9 % too little then; beyond it is taken to fourth, which is stable up
to 2.8 and within 14 % at 2, where no more than the residual flexibility of a basis lies.

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

    def for_sampling(
        self, dt: float, fastest: float = 0.0, contact: float = 0.0, impulse_in_fall: float = math.inf
    ) -> P.FilterSettings:
        """Settings of the kernel for a sample distance [s]; noise grows with the square root of time.

        ``fastest`` is the highest natural frequency of the model [rad/s]; it sets a least number of steps.
        Before the first ``contact`` [s] unknown impulses are at most ``impulse_in_fall`` [N s] per 50 µs.
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
            fall_end=contact,
            fall_impulse=impulse_in_fall * growth,
        )


def pass_settings(problem: DropProblem, *, force: float, share: float, substeps: int = 4) -> PassSettings:
    """Settings of a pass by the size of the machine: weight on a bearing, air gap, friction of a race.

    Parameters
    ----------
    problem : DropProblem
        Gives the machine.
    force, share : float
        Unknown force as a part of the mean weight on a bearing and of the force of the contact [1]; a new one
        every `STEP` of a free fall.
    substeps : int
        Integration steps per 50 µs.
    """
    model = problem.model
    weight, bearings = float(np.mean(model.load_shares)), model.machine.touchdown_bearings
    growth = math.sqrt(STEP * problem.fall_time / REFERENCE_STEP)
    impulse = weight * REFERENCE_STEP * growth
    race = max(float(bearing.bore_radius) / float(bearing.race.inertia) for bearing in bearings)
    rotor = sum(float(bearing.bore_radius) for bearing in bearings) / model.fe.polar_inertia
    return PassSettings(
        substeps=substeps,
        impulse=force * impulse,
        share=share * growth,
        spin_noise=SPIN * impulse * race,
        speed_noise=SPIN * impulse * rotor,
        learning_end=LEARNING * problem.fall_time,
    )


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """What the smoother needs of some samples of a pass beside its means; K samples, n estimated.

    It begins with the sample ``first`` of the pass, or goes on from it. Covariances are stored packed; there
    are none where only means are wanted.
    """

    first: int
    covariances: Compact
    transitions: Compact
    rows: Array
    gains: Array
    impulse_sigmas: Array

    @property
    def has_covariances(self) -> bool:
        """Whether it is enough for smoothed covariances."""
        return bool(self.covariances.shape[1] > 0)


class Storage:
    """Memory for stretches of a pass: what a pass writes to it is overwritten by the next.

    Memory asked of the system anew is as slow to fill for the first time as the filter.

    Parameters
    ----------
    memory : int
        How much is taken [B]; that of two stretches in any case.
    """

    def __init__(self, memory: int = PASS_MEMORY) -> None:
        self._memory = memory
        self._blocks: dict[str, NDArray[Any]] = {}
        self._held: dict[int, tuple[Array, Stretch]] = {}

    def slots(self, size: int) -> int:
        """Places for stretches of a size [B]: stretches that follow one another have different ones."""
        return max(2, self._memory // size)

    def array(self, name: str, shape: tuple[int, ...], kind: type[Number]) -> NDArray[Number]:
        """An array of any content; those of the same name share their memory."""
        size = math.prod(shape)
        block = self._blocks.get(name)
        if block is None or block.size < size or block.dtype != kind:
            self._blocks[name] = block = np.empty(size, dtype=kind)
        return block[:size].reshape(shape)

    @property
    def size(self) -> int:
        """Memory taken [B]."""
        return sum(block.nbytes for block in self._blocks.values())

    def begin(self, slot: int, means: Array, keep: Keep) -> None:
        """Forget what a slot holds, and what other passes, or passes that kept something else, have left."""
        self._held = {
            place: one
            for place, one in self._held.items()
            if place != slot and one[0] is means and one[1].has_covariances == (keep == "all")
        }

    def hold(self, slot: int, means: Array, stretch: Stretch) -> None:
        """Remember which pass, told by its means, and which stretch of it a slot of the memory holds."""
        self._held[slot] = means, stretch

    def held(self, means: Array, first: int) -> Stretch | None:
        """The stretch of a pass that begins at a sample, if nothing was written over it."""
        for known, stretch in self._held.values():
            if known is means and stretch.first == first:
                return stretch
        return None


@dataclass(frozen=True, kw_only=True)
class _Course:
    """What every stretch of a pass starts from: the problem, where it begins, where it is linearised.

    ``resumed`` is 1 where the first sample is the last one of the pass before, else 0.
    """

    problem: DropProblem
    settings: P.FilterSettings
    mean: Array
    reference: Array
    length: int
    resumed: int

    def stretch(self, number: int, count: int, keep: Keep, storage: Storage) -> tuple[int, Stretch]:
        """Room for the samples of a stretch, and its place in the memory."""
        n, s, updates = len(self.mean), self.problem.n_dynamic, self.problem.n_channels + 1
        columns, bearings = s + len(self.problem.unknowns), len(self.problem.model.bearing_names)
        packed = n * (n + 1) // 2 if keep == "all" else 0
        size = (self.length + 1) * (4 * (packed + s * columns) + 8 * (2 * updates * n + bearings))
        slots = (
            1 if keep == "nothing" else min(storage.slots(size), len(self.problem.time) // self.length + 1)
        )
        slot, kept = number % slots, 0 if keep == "nothing" else self.length + 1

        def room(name: str, kind: type[Number], *shape: int) -> NDArray[Number]:
            # one block for all slots: the system gets a large one back at once
            return storage.array(name, (slots, kept, *shape), kind)[slot, :count]

        return slot, Stretch(
            first=number * self.length,
            covariances=room("covariances", np.float32, packed),
            transitions=room("transitions", np.float32, s, columns),
            rows=room("rows", np.float64, updates, n),
            gains=room("gains", np.float64, updates, n),
            impulse_sigmas=room("impulse sigmas", np.float64, bearings),
        )

    def followed(
        self, number: int, covariance: Array, filled: tuple[Array, Array, Array], keep: Keep, storage: Storage
    ) -> tuple[int, Stretch]:
        """Filter a stretch; gives the sample reached, and ``covariance`` becomes that of the last one.

        ``filled`` are means, innovations and their variances of the whole pass.
        """
        problem, means, first = self.problem, filled[0], number * self.length
        chosen = slice(first, min(first + self.length, len(means) - 1) + 1)
        slot, stretch = self.stretch(number, chosen.stop - first, keep, storage)
        storage.begin(slot, means, keep)
        done = F.forward_pass(
            min(first + self.resumed, 1),
            means[first].copy() if first else self.mean,
            covariance,
            problem.time[chosen],
            np.ascontiguousarray(problem.readings[chosen]),
            problem.speed[chosen],
            problem.reading_rows,
            problem.white_variances,
            problem.speed_variance,
            problem.targets,
            private_copy(problem.model.parameters),
            self.settings,
            problem.sensor_form,
            self.reference[chosen],
            means[chosen],
            stretch.covariances,
            stretch.transitions,
            stretch.rows,
            stretch.gains,
            stretch.impulse_sigmas,
            filled[1][chosen],
            filled[2][chosen],
        )
        if keep != "nothing":
            storage.hold(slot, means, stretch)
        return first + int(done), stretch


@dataclass(frozen=True, kw_only=True)
class Forward:
    """What a forward pass leaves; N samples, n estimated.

    ``done`` is the number of samples reached; ``innovations`` and ``innovation_variances`` have one column
    per channel and one for the speed, NaN where nothing was measured; ``impulse`` is the size of the
    unknown impulses of the pass [N s]; ``reached`` is the
    covariance (n, n) where the pass ended: of the last sample, or of the one that lost the drop. What
    the smoother needs besides is filtered again from ``starts``, the covariances at the beginning of every
    stretch: kept for all samples it would be hundreds of megabytes.
    """

    done: int
    impulse: float
    means: Array
    innovations: Array
    innovation_variances: Array
    reached: Array
    course: _Course
    starts: tuple[Array, ...]

    def stretch(self, number: int, storage: Storage, keep: Keep = "all") -> Stretch:
        """What the smoother needs of a stretch: as it is held, or filtered again with the same bits."""
        held = storage.held(self.means, number * self.course.length)
        if held is not None and held.has_covariances == (keep == "all"):
            return held
        filled = (self.means, self.innovations, self.innovation_variances)
        return self.course.followed(number, self.starts[number].copy(), filled, keep, storage)[1]

    def covariance(self, sample: int) -> Array:
        """Filtered covariance at a sample, shape (n, n); single precision."""
        number = min(sample // self.course.length, len(self.starts) - 1)
        stretch = self.stretch(number, Storage(0))
        return _unpacked(stretch, sample, self.means.shape[1])

    @property
    def parameter_sample(self) -> int:
        """Sample at which parameters are read: shortly after the first contacts."""
        return min(self.course.problem.parameter_sample, max(self.done - 1, 0))

    @property
    def last(self) -> Array:
        """Covariance (n, n) of the last sample that was followed."""
        whole = self.done == len(self.means)
        return self.reached if whole else self.covariance(max(self.done - 1, 0))

    @property
    def nis(self) -> float:
        """Mean normalised innovation squared [1]; about one when model and noise are right."""
        values = self.innovations[: self.done] ** 2 / self.innovation_variances[: self.done]
        return float(np.nanmean(values))

    @property
    def negative_log_likelihood(self) -> float:
        """Negative logarithm of the likelihood of the readings, up to a constant [1]."""
        S = self.innovation_variances[: self.done]
        values = self.innovations[: self.done] ** 2 / S + np.log(S)
        return 0.5 * float(np.nansum(values))


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
    keep: Keep = "all",
    storage: Storage | None = None,
    after: Forward | None = None,
) -> Forward:
    """Run the filter over the first samples of a problem.

    Parameters
    ----------
    mean, covariance : ndarray, optional
        Start estimate, shapes (n,), (n, n); the problem's prior by default.
    reference : ndarray, shape (M, n), optional
        Trajectory to linearise at for the first M samples; the filter's own mean afterwards.
    samples : int, optional
        Number of samples; all by default.
    keep : {"all", "means", "nothing"}
        Keep what the smoother needs, what smoothed means alone need, or nothing.
    storage : Storage, optional
        Where to keep it: what an earlier pass left there is overwritten.
    after : Forward, optional
        A pass to go on from with its settings, in place of a start estimate: its last sample is the first of
        the problem.
    """
    count = len(problem.time) if samples is None else min(samples, len(problem.time))
    if after is not None:
        mean, covariance = after.means[after.done - 1], after.reached
    mean = problem.mean if mean is None else mean
    P = np.array(problem.covariance if covariance is None else covariance)
    n, updates = len(mean), problem.n_channels + 1
    dt = float(problem.time[1] - problem.time[0])
    course = _Course(
        problem=problem,
        settings=settings.for_sampling(
            dt, fastest_frequency(problem), problem.first_contact, problem.impulse_in_fall
        )
        if after is None
        else after.course.settings,
        mean=np.ascontiguousarray(mean),
        reference=np.zeros((0, n)) if reference is None else np.ascontiguousarray(reference[:count]),
        length=count if keep == "nothing" else _stretch_length(problem),
        resumed=0 if after is None else 1,
    )
    filled = np.empty((count, n)), np.empty((count, updates)), np.empty((count, updates))
    if after is not None:  # its readings have been taken already
        filled[0][0], filled[1][0], filled[2][0] = mean, np.nan, np.nan
    storage, starts = storage or Storage(), []
    for number in range(max(math.ceil((count - 1) / course.length), 1)):
        starts.append(P.copy())
        done, _stretch = course.followed(number, P, filled, keep, storage)
        if done <= min((number + 1) * course.length, count - 1):
            break
    return Forward(
        done=done,
        impulse=settings.impulse,
        means=filled[0],
        innovations=filled[1],
        innovation_variances=filled[2],
        reached=P,
        course=course,
        starts=tuple(starts),
    )


def _stretch_length(problem: DropProblem) -> int:
    """Samples of a stretch: a free fall through the air gap, for rounding grows from impact to impact.

    Smoothed means go forward from the first sample of a stretch. Through the first impacts of the bundled
    drop, in single precision, they err by 6e-4 standard deviations after 200 samples, by 4e-3 after 500.
    """
    dt = float(problem.time[1] - problem.time[0])
    return max(2, math.ceil(problem.fall_time / dt))


def _unpacked(stretch: Stretch, sample: int, n: int) -> Array:
    """Filtered covariance (n, n) at a sample of a stretch."""
    P = np.empty((n, n))
    unpack(stretch.covariances[sample - stretch.first], P)
    return P


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
    spread: Array
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
        P = self.spread[found[0]]
        return np.asarray(P - P @ self.information[found[0]] @ P)


def smooth(
    filtered: Forward,
    score: Array | None = None,
    information: Array | None = None,
    *,
    watched: Array | None = None,
    kept: Sequence[int] | None = None,
    storage: Storage | None = None,
    part: tuple[int, int] | None = None,
    carried: bool = False,
) -> Smoothed:
    """Run the backward pass.

    Parameters
    ----------
    score, information : ndarray, shapes (n,), (n, n), optional
        What later drops, or later samples, say about the last sample.
    watched : ndarray, shape (G, n), optional
        Linear functions of the estimate whose covariance is wanted at every sample.
    kept : sequence of int, optional
        Samples whose whole covariance is wanted; by default the first, the one that parameters are read at
        and the last.
    storage : Storage, optional
        That of the forward pass, whose last stretch is at hand there.
    part : tuple of int, optional
        Samples from the first to before the second are smoothed; all by default. Others are left empty.
    carried : bool
        Carry back what later readings say, and leave all samples empty.
    """
    n, course = filtered.means.shape[1], filtered.course
    begin, done = part or (course.resumed, filtered.done)
    wanted = (0, min(filtered.parameter_sample, done - 1), done - 1) if kept is None else kept
    chosen = np.unique(np.asarray(wanted, dtype=np.int64))
    rows = np.zeros((0, n)) if watched is None else np.ascontiguousarray(watched)
    means = np.empty((done, n))
    blocks = np.empty((done, len(rows), len(rows)))
    spread, stored = np.empty((len(chosen), n, n)), np.empty((len(chosen), n, n))
    lam = np.zeros(n) if score is None else score.copy()
    Lam = np.zeros((n, n)) if information is None else information.copy()
    last = _stretch_before(filtered, done)
    for stretch in _from_the_last(filtered, storage or Storage(0), last, "all"):
        first = stretch.first
        samples = slice(first, min(first + course.length + 1, done))
        held, own = slice(0, samples.stop - first), max(begin - first, min(first, 1))
        if own >= samples.stop - first:
            break
        inside = slice(*np.searchsorted(chosen, (first + own, samples.stop)))
        F.backward_pass(
            own,
            filtered.means[samples],
            stretch.covariances[held],
            stretch.transitions[held],
            stretch.rows[held],
            stretch.gains[held],
            filtered.innovations[samples],
            filtered.innovation_variances[samples],
            course.problem.sensor_form.noise_decay,
            rows,
            chosen[inside] - first,
            means[:0] if carried else means[samples],
            blocks[samples],
            spread[inside],
            stored[inside],
            lam,
            Lam,
        )
    return Smoothed(
        filtered=filtered,
        means=means,
        watched=blocks,
        kept=chosen,
        spread=spread,
        information=stored,
        score_0=lam,
        information_0=Lam,
    )


def smooth_means(
    filtered: Forward, score: Array | None = None, *, storage: Storage | None = None
) -> tuple[Array, Array]:
    """Smoothed means (N, n) alone, and λ before the first measurement, without any covariance.

    Where a pass goes on from another, the sample they share is left empty. ``score`` (n,) is what later drops
    say about the last sample, ``storage`` that of the forward pass.
    """
    n, course = filtered.means.shape[1], filtered.course
    means = np.empty((filtered.done, n))
    lam = np.zeros(n) if score is None else score.copy()
    parameters, last = private_copy(course.problem.model.parameters), _stretch_before(filtered, filtered.done)
    for stretch in _from_the_last(filtered, storage or Storage(0), last, "means"):
        samples = slice(stretch.first, min(stretch.first + course.length + 1, filtered.done))
        held, own = slice(0, samples.stop - stretch.first), min(stretch.first + course.resumed, 1)
        F.smooth_means(
            own,
            course.mean,
            filtered.starts[stretch.first // course.length],
            course.problem.time[samples],
            course.problem.targets,
            parameters,
            course.settings,
            course.problem.sensor_form,
            course.reference[samples],
            filtered.means[samples],
            stretch.transitions[held],
            stretch.rows[held],
            stretch.gains[held],
            stretch.impulse_sigmas[held],
            filtered.innovations[samples],
            filtered.innovation_variances[samples],
            means[samples],
            lam,
        )
    return means, lam


def _stretch_before(filtered: Forward, stop: int) -> int:
    """Number of the stretch that has the last sample before one."""
    return min(max(stop - 2, 0) // filtered.course.length, len(filtered.starts) - 1)


def _from_the_last(filtered: Forward, storage: Storage, number: int, keep: Keep) -> Iterator[Stretch]:
    """The stretches of a pass from one backwards; while one is used, the one before it is filtered again."""
    if number == 0:  # a thread would take as long to begin as a short pass
        yield filtered.stretch(0, storage, keep)
        return
    with ThreadPoolExecutor(max_workers=1) as ahead:
        coming = ahead.submit(filtered.stretch, number, storage, keep)
        while number > 0:
            stretch, number = coming.result(), number - 1
            coming = ahead.submit(filtered.stretch, number, storage, keep)
            yield stretch
        yield coming.result()
