"""How much likelier each extension would make the readings, linearised at a fit: which are worth fitting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Extension
from rotordrop.machine import Machine
from rotordrop.track.calibration import THREADS, Stage, TrackedDrops, window_end
from rotordrop.track.noise_size import forward_passes, likelihood_of
from rotordrop.track.problem import DropProblem, transferred
from rotordrop.twin.problems import Drops

LogLikelihoodGain = tuple[float, Extension]
"""Rise of the log likelihood [1] with an extension."""


def initial_guess_from(known: TrackedDrops, problems: Sequence[DropProblem]) -> list[Array]:
    """Trajectories of a fit in the coordinates of other problems of the same drops."""
    drops = zip(known.problems, problems, known.trajectories, strict=True)
    return [transferred(one, two, means) for one, two, means in drops]


@dataclass(frozen=True, kw_only=True)
class LogLikelihoodGains:
    """Gains of the log likelihood beside a fit of a machine to drops."""

    drops: Drops
    machine: Machine
    fit: TrackedDrops
    stage: Stage
    """Window and process noise of the passes."""
    noise: float
    """Process noise over that of the stage [1]."""

    def of_all(self, extensions: Sequence[Extension]) -> list[LogLikelihoodGain]:
        """The rise with each of some extensions.

        One that says nothing costs what its unknowns leave open, so that most fall.
        """
        together = [one for one in extensions if one.begins_as_base_model]
        apart = [one for one in extensions if not one.begins_as_base_model]
        with ThreadPoolExecutor(max_workers=1) as pool:
            at_once = pool.submit(self.at_once, together)
            return [*self.apart(apart), *at_once.result()]

    def apart(self, extensions: Sequence[Extension]) -> list[LogLikelihoodGain]:
        """The same by one pass for each extension."""
        with ThreadPoolExecutor(max_workers=THREADS) as pool:
            described = pool.submit(self._negative_log_likelihood, self.machine)

            def rise(one: Extension) -> float:
                with_it = self._negative_log_likelihood(one.added_to(self.machine))
                return described.result() - with_it

            return list(zip(pool.map(rise, extensions), extensions, strict=True))

    def at_once(self, extensions: Sequence[Extension]) -> list[LogLikelihoodGain]:
        """The same by one pass with the unknowns of all extensions, which begin as the base model.

        Around the fit these are normal before the readings and after them. The others held where they begin,
        the likelihood with one extension over that without any is the density of the place where its unknowns
        begin, before over after: the density ratio of Savage and Dickey (Dickey, Ann. Math. Stat. 42, 1971).
        """
        if not extensions:
            return []
        machine = self.machine
        for extension in extensions:
            machine = extension.added_to(machine)
        problems = self.drops.fine(machine)
        found = forward_passes(problems, self._references(problems), self.stage, self.noise)
        had = {one.path for one in self.fit.problems[0].unknowns}
        rises = np.zeros(len(extensions))
        for number, (problem, drop) in enumerate(zip(problems, found, strict=True), start=1):
            new = [k for k, one in enumerate(problem.unknowns) if one.path not in had]
            at = problem.n_dynamic + np.array(new)
            begin = np.array([problem.unknowns[k].begin for k in new])
            before = problem.mean[at] - begin, problem.covariance[np.ix_(at, at)]
            # what does not change is known in the end as well as a smoother would know it
            after = drop.means[drop.done - 1][at] - begin, drop.last[np.ix_(at, at)]
            for e, extension in enumerate(extensions):
                # what all drops say of the machine has come to the last one
                if number == len(problems) or extension.owner == "drop":
                    others = np.array([problem.unknowns[k].parameter not in extension.rows for k in new])
                    rises[e] += _density_beside(*before, others) - _density_beside(*after, others)
        return list(zip(rises.tolist(), extensions, strict=True))

    @property
    def _end(self) -> float:
        first = self.fit.problems[0]
        return window_end(self.stage, first.first_contact, first.fall_time)

    def _references(self, problems: Sequence[DropProblem]) -> list[Array]:
        means = initial_guess_from(self.fit, problems)
        return [
            one[: int(np.searchsorted(problem.time, self._end, side="right"))]
            for one, problem in zip(means, problems, strict=True)
        ]

    def _negative_log_likelihood(self, machine: Machine) -> float:
        problems = self.drops.fine(machine)
        passes = forward_passes(problems, self._references(problems), self.stage, self.noise)
        return sum(likelihood_of(one) for one in passes)


def _density_beside(mean: Array, covariance: Array, others: Array) -> float:
    """Logarithm of the normal density of zero, where the ``others`` (n,) are zero; mean (n,)."""
    return _log_density(mean, covariance) - _log_density(mean[others], covariance[np.ix_(others, others)])


def _log_density(mean: Array, covariance: Array) -> float:
    """Logarithm of the normal density of zero."""
    sigma = np.sqrt(np.diag(covariance))
    way, correlation = mean / sigma, covariance / np.outer(sigma, sigma)
    sign, determinant = np.linalg.slogdet(correlation)
    if sign <= 0.0:
        return -math.inf
    square = float(way @ np.linalg.solve(correlation, way))
    scale = float(determinant + 2.0 * np.log(sigma).sum()) + len(mean) * math.log(2.0 * math.pi)
    return -0.5 * (square + scale)
