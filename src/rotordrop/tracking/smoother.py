"""Filter and smoother over one recorded drop, and over several drops of one machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotordrop.model import layout as L
from rotordrop.tracking import _filter as F
from rotordrop.tracking import _propagation as P
from rotordrop.tracking._covariance import unpack
from rotordrop.tracking.problem import DropProblem, Fall, private_copy

Array = NDArray[np.float64]
Compact = NDArray[np.float32]
"""What a pass stores for the smoother: hundreds of megabytes, of which seven digits are plenty."""

Number = TypeVar("Number", np.float32, np.float64)

REFERENCE_STEP = 50e-6
"""Time for which the numbers of `PassSettings` hold [s]."""
STEP = 0.007
"""Time over which unknown forces are alike, over the time of a free fall through the air gap [1]."""
SPIN = 0.07
"""Unknown friction on races and rotor as a coefficient of friction under the weight [1]."""
LEARNING = 7.0
"""Time at which a race turns with the rotor, over the time of a free fall [1]; see `PassSettings`."""
LARGEST_PHASE = 1.0
"""Largest phase [rad] by which the fastest mode may turn in one integration step of the filter."""


@dataclass(frozen=True, kw_only=True)
class PassSettings:
    """Numbers of one pass.

    Attributes
    ----------
    substeps : int
        Integration steps per sample.
    impulse : float
        Standard deviation of an unknown impulse per 50 µs at each bearing and axis [N s].
    share : float
        The same as a fraction of the contact impulse of 50 µs [1].
    spin_noise : float
        Standard deviation of the race spin per 50 µs [rad/s].
    speed_noise : float
        Standard deviation of the rotor speed per 50 µs [rad/s].
    learning_end : float
        Time [s] after which friction and race may drift faster: once a race turns with the rotor, the
        friction law near zero speed decides, which no record of positions shows, and must not rewrite what
        the first impacts said.
    """

    substeps: int = 4
    impulse: float = 2e-4
    share: float = 0.01
    spin_noise: float = 0.1
    speed_noise: float = 1e-3
    learning_end: float = 0.05

    def for_sampling(self, dt: float, fastest: float = 0.0, fall: Fall | None = None) -> P.FilterSettings:
        """Settings of the kernel for a sample distance [s]; noise grows with the square root of time.

        ``fastest`` is the highest natural frequency of the model [rad/s]; it sets a least number of steps.
        ``fall`` limits the unknown impulses before the first contact.
        """
        growth = math.sqrt(dt / REFERENCE_STEP)
        return P.FilterSettings(
            dt=dt,
            substeps=max(
                1, round(self.substeps * dt / REFERENCE_STEP), math.ceil(fastest * dt / LARGEST_PHASE)
            ),
            impulse=self.impulse * growth,
            share=self.share / growth,
            spin_noise=self.spin_noise * growth,
            speed_noise=self.speed_noise * growth,
            learning_end=self.learning_end,
            fall_end=-math.inf if fall is None else fall.end,
            fall_impulse=math.inf if fall is None else fall.impulse * growth,
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


class Storage:
    """Memory of the passes over one drop: each writes where the one before it did.

    Hundreds of megabytes asked of the system anew are as slow to fill for the first time as the filter.
    """

    def __init__(self) -> None:
        self._blocks: dict[str, NDArray[Any]] = {}

    @classmethod
    def of(cls, past: Forward) -> Storage:
        """The memory that a pass wrote to."""
        storage = cls()
        for name in ("covariances", "transitions", "rows", "gains"):
            storage._blocks[name] = getattr(past, name).reshape(-1)
        return storage

    def array(self, name: str, shape: tuple[int, ...], kind: type[Number]) -> NDArray[Number]:
        """An array of any content; those of the same name share their memory."""
        size = math.prod(shape)
        block = self._blocks.get(name)
        if block is None or block.size < size or block.dtype != kind:
            self._blocks[name] = block = np.empty(size, dtype=kind)
        return block[:size].reshape(shape)


@dataclass(frozen=True, kw_only=True)
class Forward:
    """What a forward pass leaves: filtered estimates and what the smoother needs; N samples, n estimated.

    ``done`` is the number of samples reached; ``innovations`` and ``innovation_variances`` have one column
    per channel and one for the speed, NaN where nothing was measured; ``impulse`` is the size of the
    unknown impulses of the pass [N s]; ``parameter_sample`` is where parameters are read. The covariances
    are stored packed; `covariance` gives one.
    """

    done: int
    impulse: float
    means: Array
    covariances: Compact
    transitions: Compact
    rows: Array
    gains: Array
    innovations: Array
    innovation_variances: Array
    parameter_sample: int

    def covariance(self, sample: int) -> Array:
        """Filtered covariance at a sample, shape (n, n); single precision."""
        n = self.means.shape[1]
        P = np.empty((n, n))
        unpack(self.covariances[sample], P)
        return P

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
    """Highest natural frequency [rad/s] of the model: of the rotor's basis or of a race on its balls."""
    p = problem.model.parameters
    races = p.bearing[:, L.BEARING_DAMPING] / np.array(
        [float(b.damping_time) for b in problem.model.machine.touchdown_bearings]
    )
    race = np.sqrt(np.max(races / p.bearing[:, L.RACE_MASS]))
    return float(max(np.sqrt(np.max(p.eigenvalue)), race))


def forward(
    problem: DropProblem,
    settings: PassSettings,
    *,
    mean: Array | None = None,
    covariance: Array | None = None,
    reference: Array | None = None,
    samples: int | None = None,
    smoothing: bool = True,
    storage: Storage | None = None,
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
    smoothing : bool
        Keep what the smoother needs.
    storage : Storage, optional
        Where to keep it: what an earlier pass left there is overwritten.
    """
    count = len(problem.time) if samples is None else min(samples, len(problem.time))
    mean = problem.mean if mean is None else mean
    covariance = problem.covariance if covariance is None else covariance
    n, s, n_c = len(mean), problem.n_dynamic, problem.n_channels
    kept = count if smoothing else 0
    columns = s + len(problem.unknowns)
    dt = float(problem.time[1] - problem.time[0])
    array = (storage or Storage()).array
    result = Forward(
        done=0,
        impulse=settings.impulse,
        means=np.empty((count, n)),
        covariances=array("covariances", (count, n * (n + 1) // 2 if smoothing else 0), np.float32),
        transitions=array("transitions", (kept, s, columns), np.float32),
        rows=array("rows", (kept, n_c + 1, n), np.float64),
        gains=array("gains", (kept, n_c + 1, n), np.float64),
        innovations=np.empty((count, n_c + 1)),
        innovation_variances=np.empty((count, n_c + 1)),
        parameter_sample=problem.parameter_sample,
    )
    done = F.forward_pass(
        np.ascontiguousarray(mean),
        np.ascontiguousarray(covariance),
        problem.time[:count],
        np.ascontiguousarray(problem.readings[:count]),
        problem.speed[:count],
        problem.reading_rows,
        problem.variances,
        problem.speed_variance,
        problem.targets,
        private_copy(problem.model.parameters),
        settings.for_sampling(dt, fastest_frequency(problem), problem.fall),
        problem.sensor_form,
        np.zeros((0, n)) if reference is None else np.ascontiguousarray(reference[:count]),
        result.means,
        result.covariances,
        result.transitions,
        result.rows,
        result.gains,
        result.innovations,
        result.innovation_variances,
    )
    return replace(result, done=int(done))


@dataclass(frozen=True, kw_only=True)
class Smoothed:
    """Smoothed estimate of one drop.

    Attributes
    ----------
    means : ndarray, shape (N, n)
        Smoothed estimate at each sample.
    watched : ndarray, shape (N, G, G)
        Smoothed covariance of the watched linear functions at each sample.
    kept : ndarray, shape (K,)
        Samples whose whole covariance can be asked for.
    information : ndarray, shape (K, n, n)
        Λ of these samples: the smoothed covariance is ``P − P Λ P`` with the filtered P.
    score_0, information_0 : ndarray, shapes (n,), (n, n)
        λ and Λ before the first measurement.
    """

    filtered: Forward
    means: Array
    watched: Array
    kept: NDArray[np.int64]
    information: Array
    score_0: Array
    information_0: Array

    def covariance(self, sample: int) -> Array:
        """Smoothed covariance at a kept sample, shape (n, n)."""
        found = np.flatnonzero(self.kept == sample)
        if len(found) == 0:
            raise IndexError(f"the covariance of sample {sample} was not kept; kept are {self.kept.tolist()}")
        P = self.filtered.covariance(sample)
        return np.asarray(P - P @ self.information[found[0]] @ P)


def parameter_sample(smoothed: Smoothed) -> int:
    """Sample at which parameters are read: shortly after the first contacts."""
    return min(smoothed.filtered.parameter_sample, len(smoothed.means) - 1)


def smooth(
    filtered: Forward,
    score: Array | None = None,
    information: Array | None = None,
    *,
    watched: Array | None = None,
    kept: Sequence[int] | None = None,
) -> Smoothed:
    """Run the backward pass.

    Parameters
    ----------
    score, information : ndarray, shapes (n,), (n, n), optional
        What later drops say about the last sample.
    watched : ndarray, shape (G, n), optional
        Linear functions of the estimate whose covariance is wanted at every sample.
    kept : sequence of int, optional
        Samples whose whole covariance is wanted; by default the first, the one that parameters are read at
        and the last.
    """
    done, n = filtered.done, filtered.means.shape[1]
    samples = (0, min(filtered.parameter_sample, done - 1), done - 1) if kept is None else kept
    chosen = np.unique(np.asarray(samples, dtype=np.int64))
    rows = np.zeros((0, n)) if watched is None else np.ascontiguousarray(watched)
    means = np.empty((done, n))
    blocks = np.empty((done, len(rows), len(rows)))
    stored = np.empty((len(chosen), n, n))
    lam = np.zeros(n) if score is None else score.copy()
    Lam = np.zeros((n, n)) if information is None else information.copy()
    F.backward_pass(
        filtered.means[:done],
        filtered.covariances[:done],
        filtered.transitions[:done],
        filtered.rows[:done],
        filtered.gains[:done],
        filtered.innovations[:done],
        filtered.innovation_variances[:done],
        rows,
        chosen,
        means,
        blocks,
        stored,
        lam,
        Lam,
    )
    return Smoothed(
        filtered=filtered,
        means=means,
        watched=blocks,
        kept=chosen,
        information=stored,
        score_0=lam,
        information_0=Lam,
    )
