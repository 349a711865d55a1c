"""One search over candidate models of a machine, scored by the marginal likelihood of the readings.

A candidate is a machine with a way to fit it: the base model, one with an extension more, the same from
another start. A coarse basis extends its fit window by window, the half with the worse score is dropped after
each, and the fine basis refines what is left. Beside what follows the record there, every extension is
weighed once more: a slight departure shows in nothing but the likelihood.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Extension, Values
from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import IdentificationError
from rotordrop.estimate.published import Structure
from rotordrop.evidence.evidence import Evidence
from rotordrop.files import finite
from rotordrop.machine import Machine
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.track.calibration import (
    BLIND_SCHEDULE,
    CALIBRATED_SCHEDULE,
    DAMPED_SCHEDULE,
    LOOSER,
    MOST_REPEATS,
    QUICK_SCHEDULE,
    THREADS,
    Stage,
    TrackedDrops,
    converged,
    is_inconsistent,
    track,
)
from rotordrop.track.consistency import DIRECTIONS, consistency_checks, reference_pass
from rotordrop.track.noise_size import forward_passes, likeliest_noise, likelihood_of
from rotordrop.track.prior import fall_time
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, Smoothed
from rotordrop.twin.mixture import Alternative, worth_keeping
from rotordrop.twin.problems import Drops, recorded_drop
from rotordrop.twin.rises import LogLikelihoodGains, initial_guess_from
from rotordrop.twin.rotor_search import with_found_rotor
from rotordrop.twin.steps import DESCRIBED, FORM, GUESSES, WEIGHED, WHOLE, Steps

CALIBRATION_STAGE = Stage(until=0.06, force=0.07, share=0.01, passes=1)
WHOLE_STAGE = replace(CALIBRATION_STAGE, until=0.2)
"""Windows of the fine basis: the first impacts, the whole drop."""

PLAUSIBLE_MOVE = 2.25
"""Way of a parameter from what the first impacts say to what the whole drop says, over the standard deviation
of the former [1], beyond which the fit is begun again: it may lie in another minimum.

Source: of eight drops of DropBench it was 2.0 at most on the six that were right, 2.6 and 3.8 on two whose
peaks were off by 5 and 3 %; another minimum had a likelihood higher by 250, and peaks within 1 %.
"""
PLAUSIBLE_WAY = 2.5
"""The same for the way of an unknown from its prior, over the standard deviation of the prior [1].

Source: 14 of 73 drops of DropBench end beyond it. On a rotor of 5 kg, silently 6 % off, the damping of a
contact had gone 3.3; begun again from its prior the likelihood was higher by 60, and the peak right.
"""

_WINDOWS = (slice(0, 2), *(slice(k, k + 1) for k in range(2, len(BLIND_SCHEDULE))))
"""Stages of each window from guesses; of the two of the first, one only finds where to linearise."""
OTHER_START_SPREAD = 0.8
"""Spread of other starts, in standard deviations of the prior [1]."""

ROTOR_SEEN = 6.0
"""Part of the drop from which the form of a rotor is found, over the time of a free fall [1]."""

LEAST_RISE = 40.0
"""Rise of the logarithm of the marginal likelihood from which an extension is kept [1].

Source: one structure each on drops of one machine: without departure all were within 28, the right one was
172 and more before the next best; an extension has about three unknowns for each bearing.
"""

ASSUMED_SHARE = 0.05
"""Share of machines that depart from the base model in the way of one extension [1] (assumed)."""
RISE_OF_NOTHING = 6.0
"""Rise of the log likelihood by an extension that the machine does not have, for each drop [1]: what the base
model leaves out of any machine is evidence too.

In the fine basis, where a fit has come to rest, all ten fell on drops of the bench without a departure; on
two drops of a foreign code cross-axis sensitivity rose by 12, with friction 11 % off. The right ones
rose by 16 to 570 on one drop (study `structure`).
"""

NAMED_RISE = 20.0
"""Rise of the log likelihood from which an extension is named [1]: of 40 right ones the least rose by 23, two
wrong ones by 12 and 19 (study `structure`)."""

LEAST_INFERRED = -1.0
"""Rise by the first impacts from which what a file leaves to be inferred is widened over the whole drop [1].

Chosen: on a rotor of 140 kg with rings 3.5 times heavier than inferred it was -0.01, both peaks 8 % low.
"""

MOST_LOG_ODDS = 100.0
"""Logarithm of the odds from which a model is as good as certain [1]: larger ones overflow."""
MOST_EXTENSIONS = 2
MOST_TRIED = 2
"""Extensions fitted beside a fit at most, those of the largest rise: the right one was first (chosen)."""

UNDAMPED, DAMPED, FIRST_OTHER_START = range(3)
"""How a fit is attempted: in the usual way, in short steps, and from then on from other starts."""
OTHER_STARTS = 6
RELINEARISED_PASSES = 3

FIRST_CHOICE = 2
"""Window after which the half that follows the record worse stays behind, and after each one from then on.

Before, the windows hold little more than the first contact. After it the right one of ten extensions was in
the better half, and first from the next window on (three structures, both ways: study `structure`).
"""
FEWEST = 2

Score = tuple[bool, float, float]
"""Lost, process noise over that of the schedule [1], negative log likelihood: what is smaller fits better;
likelihoods compare at equal process noise only."""


@dataclass(frozen=True, kw_only=True)
class Accepted:
    """An accepted extension, and the rise of the log marginal likelihood that it brought [1]."""

    extension: Extension
    gain: float

    def structure(self, machine: Machine, values: Values, *, believed: bool) -> Structure:
        """What it says of the machine, with 90 % intervals; no numbers of a model that is not believed."""
        if not believed:
            sentence = f"Tried beyond the base model, and not enough: {self.extension.name}."
        else:
            load = float(sum(bearing_load_shares(machine))) / len(machine.touchdown_bearings)
            found = "Found" if self.extension.shows(machine, values) else "Tried, and not told from none"
            sentence = f"{found}: {self.extension.found(machine, values, load)}."
        rise = finite(self.gain)
        return Structure(
            name=self.extension.name, log_likelihood_rise=rise, sentence=sentence, probability=None
        )


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A machine, the extensions it has beyond the description, and how it follows the record."""

    machine: Machine
    fit: TrackedDrops
    accepted: tuple[Accepted, ...] = ()
    baseline: tuple[Forward, ...] = ()
    """The drops filtered with process noise of the baseline, where the fit has that of the likeliest."""

    alternatives: tuple[Alternative, ...] = ()
    """Models that the readings do not tell from this one."""

    @property
    def noise_factor(self) -> float:
        """Process noise of the fit over the baseline [1]."""
        return max(self.fit.noise_factors)

    @property
    def inconsistent(self) -> bool:
        """Whether it ended inconsistent with the record."""
        return is_inconsistent(self.fit)

    @property
    def score(self) -> Score:
        """How it follows the record, with process noise that was not sized."""
        return score_of(self.fit)

    @property
    def sized_score(self) -> tuple[bool, float]:
        """Whether it was lost, and the negative log likelihood, with process noise of the likeliest size."""
        return any(self.fit.diverged), self.fit.negative_log_likelihood

    @property
    def judged(self) -> tuple[Smoothed, ...]:
        """The drops with the pass by whose innovations a model is judged."""
        return tuple(
            replace(smoothed, filtered=reference_pass(problem, smoothed.filtered, one))
            for problem, smoothed, one in zip(
                self.fit.problems, self.fit.smoothed, self.baseline, strict=True
            )
        )


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """Where a fit from guesses is after some windows: less than the fit, of which many are on their way."""

    problems: tuple[DropProblem, ...]
    """The drops."""
    trajectories: tuple[Array, ...]
    """Smoothed means of each drop, shape (M, n)."""
    score: Score
    """How the fit follows the record."""


def is_calibrated(machine: Machine) -> bool:
    """Whether the supports of all bearings are estimates, not guesses."""
    return all(
        quantity.status == "estimated"
        for bearing in machine.touchdown_bearings
        for quantity in (bearing.support.stiffness, bearing.support.mass)
    )


def track_drops(search: Search, machine: Machine, *, quick: bool = False) -> Candidate:
    """Follow recorded drops of one machine with the drop model.

    From guesses, a coarse basis finds the parameters in growing windows and a finer one refines them; a
    calibrated machine needs the finer one only (with ``quick``, a single pass of it). The extensions that the
    readings ask for beside that are added. What still does not follow the record is tried with extensions
    from guesses on.
    """
    drops = search.drops
    base: Candidate | None = None
    if is_calibrated(machine) and not drops.calibrate_only:
        schedule = QUICK_SCHEDULE if quick else CALIBRATED_SCHEDULE
        search.begins(WHOLE, (WHOLE,) if quick else (WHOLE, WEIGHED))
        fit = track(drops.fine(machine), schedule, progress=search.progress)
        if quick:
            return search.followed(Candidate(machine=machine, fit=fit, baseline=fit.filtered))
        first = Candidate(machine=machine, fit=fit)
        noise = likeliest_noise(fit, CALIBRATED_SCHEDULE[-1])
        found: Candidate | None = search.at_rest(first, fit.trajectories, noise)
    else:
        search.begins(GUESSES)
        base = Candidate(machine=machine, fit=search.fit_base(machine))
        search.begins(WHOLE)
        # First: the coarse basis alone may not fit a record that the finer one fits, or lose it there.
        found = search.refine_if_followed(base)
    # Where a beam stands for a rotor, its form is what does not fit: no extension stands for that.
    if found is not None and (not machine.rotor.form_errs or fits(found)):
        search.begins(WEIGHED)
        found = search.weighed(found)
    if found is None or not fits(found):
        search.begins("trying extensions of the base model, and other starts")
        base = base or Candidate(machine=machine, fit=search.fit_base(machine))
        other = best_start(base, search) if machine.rotor.form_errs else best_structure(base, search)
        again = None if other.fit is base.fit else search.refine_if_followed(other)
        followed = [one for one in (found, again) if one is not None]
        if not followed:
            return search.followed(search.refine(other))  # says where it was lost
        found = min(followed, key=lambda one: one.sized_score)
    return search.followed(found)


def evidence_threshold(extension: Extension, drops: int) -> float:
    """Rise of the log likelihood with which an extension is as probable as the model without it [1]."""
    if extension.inferred:
        return 0.0
    return math.log((1.0 - ASSUMED_SHARE) / ASSUMED_SHARE) + drops * RISE_OF_NOTHING


def bayes_factor(one: Candidate, other: Candidate) -> float:
    """Marginal likelihood of the readings by a candidate over that by another one [1]; nothing where lost."""
    (diverged, of_one), (other_diverged, of_other) = one.sized_score, other.sized_score
    if diverged or other_diverged:
        return 0.0 if diverged else math.exp(MOST_LOG_ODDS)
    return math.exp(min(of_other - of_one, MOST_LOG_ODDS))


def score_of(fit: TrackedDrops) -> Score:
    """How a fit follows the record."""
    return any(fit.diverged), max(fit.noise_factors), fit.negative_log_likelihood


def gain_of(candidate: Candidate, before: Candidate) -> float:
    """Rise of the log marginal likelihood [1]; without limit where the other needed larger process noise."""
    if candidate.score[:2] != before.score[:2]:
        return math.inf if candidate.score < before.score else -math.inf
    return before.score[2] - candidate.score[2]


def best_structure(base: Candidate, search: Search) -> Candidate:
    """The best of the base model and its extensions, one on top of the other while that pays.

    The windows of a search leave it a few passes short, and an extension may have only led to a better start.
    So the model without it is given what both have found, and the rise of the likelihood counts from there.
    """
    best = _base_again(base, base, search)
    for _ in range(MOST_EXTENSIONS):
        if (better := _best_extension(best, search)) is None:
            break
        best = _base_again(best, better, search)
        if (gain := gain_of(better, best)) < LEAST_RISE:
            break
        accepted = replace(better.accepted[-1], gain=gain)
        better = replace(better, accepted=(*better.accepted[:-1], accepted))
        best = _base_again(better, better, search)
        if not best.inconsistent:
            break
    return best_start(best, search)


def _best_extension(base: Candidate, search: Search) -> Candidate | None:
    """The best candidate with one extension more, by either way from guesses; None where all were lost."""
    attempts = [
        _Attempt(
            machine=extension.added_to(base.machine),
            start=start,
            accepted=(*base.accepted, Accepted(extension=extension, gain=math.inf)),
        )
        for extension in EXTENSIONS
        if extension.values(base.machine)
        for start in (UNDAMPED, DAMPED)
    ]
    return _successive_halving(attempts, search)


def _base_again(base: Candidate, better: Candidate, search: Search) -> Candidate:
    """The base, or what it makes of the checkpoint that an extension has found."""
    try:
        back = replace(base, fit=search.relinearise(better.fit, base.machine, RELINEARISED_PASSES))
    except IdentificationError:
        return base
    return min(base, back, key=lambda one: one.score)


def best_start(best: Candidate, search: Search) -> Candidate:
    """The same machine from other places in its prior, where it ended inconsistent with the record.

    The objective has several minima.
    """
    if not best.inconsistent:
        return best
    starts = range(FIRST_OTHER_START, FIRST_OTHER_START + OTHER_STARTS)
    attempts = [_Attempt(machine=best.machine, start=start, accepted=best.accepted) for start in starts]
    found = _successive_halving(attempts, search)
    return best if found is None else min(best, found, key=lambda one: one.score)


@dataclass(frozen=True, kw_only=True)
class _Attempt:
    """A machine on its way from guesses to the record."""

    machine: Machine
    start: int
    accepted: tuple[Accepted, ...]
    checkpoint: Checkpoint | None = None

    @property
    def score(self) -> Score:
        return (True, math.inf, math.inf) if self.checkpoint is None else self.checkpoint.score


def _successive_halving(attempts: Sequence[_Attempt], search: Search) -> Candidate | None:
    """Who follows the record best of those that many short windows and few long ones leave.

    Successive halving: Jamieson & Talwalkar, AISTATS 2016.
    """

    def further(one: _Attempt) -> _Attempt | None:
        try:
            checkpoint = search.extend(one.machine, one.start, window, one.checkpoint)
        except IdentificationError:
            return None
        return replace(one, checkpoint=checkpoint)

    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        for window in range(len(_WINDOWS)):
            there = [one for one in pool.map(further, attempts) if one is not None]
            attempts = sorted(there, key=lambda one: one.score)
            if window >= FIRST_CHOICE:
                attempts = attempts[: max(FEWEST, (len(there) + 1) // 2)]
    found = []
    for one in attempts[:FEWEST]:
        with suppress(IdentificationError):
            assert one.checkpoint is not None
            found.append(
                Candidate(machine=one.machine, fit=search.converge(one.checkpoint), accepted=one.accepted)
            )
    return min(found, key=lambda one: one.score, default=None)


@dataclass(frozen=True, kw_only=True)
class Search:
    """Fits of machines to the same drops: a coarse basis finds the parameters, a finer one refines them."""

    drops: Drops
    progress: Steps | None

    def begins(self, step: str, of: tuple[str, ...] | None = None) -> None:
        """Say that a step begins."""
        if self.progress is not None:
            self.progress.begin(step, of)

    def with_rotor(self, machine: Machine) -> Machine:
        """The machine with its rotor as the records show it, where a beam stands for it."""
        if not machine.rotor.sought():
            return machine
        self.begins(FORM, (FORM, *DESCRIBED))
        until = ROTOR_SEEN * fall_time(machine)
        drops = [recorded_drop(item, until) for item in self.drops.evidence]
        return with_found_rotor(machine, drops, self.progress)

    def fit_base(self, machine: Machine) -> TrackedDrops:
        """Fit of a machine from its guesses by the coarse basis; where inconsistent, again in short steps."""
        problems, found = self.drops.coarse(machine), None
        with suppress(IdentificationError):
            found = track(problems, BLIND_SCHEDULE, progress=self.progress)
            if not is_inconsistent(found):
                return found
        try:
            again = track(problems, DAMPED_SCHEDULE, progress=self.progress)
            again = self.converge(_checkpoint_of(again))
        except IdentificationError:
            if found is None:
                raise
            return found
        return again if found is None else min(found, again, key=score_of)

    def extend(self, machine: Machine, start: int, number: int, before: Checkpoint | None) -> Checkpoint:
        """A fit of a machine by the coarse basis over one window more, after what was found before."""
        stages = (DAMPED_SCHEDULE if start == DAMPED else BLIND_SCHEDULE)[_WINDOWS[number]]
        problems = self.drops.coarse(machine) if before is None else before.problems
        if before is None and start >= FIRST_OTHER_START:
            problems = tuple(_other_start(problem, start) for problem in problems)
        references = None if before is None else before.trajectories
        return _checkpoint_of(track(problems, stages, references=references))

    def converge(self, checkpoint: Checkpoint) -> TrackedDrops:
        """The fit over the last window of the coarse basis, repeated while that pays."""
        return converged(checkpoint.problems, BLIND_SCHEDULE[-1], checkpoint.trajectories)

    def relinearise(self, known: TrackedDrops, machine: Machine, passes: int) -> TrackedDrops:
        """Passes with another machine over the first window whole, linearised at a fit that is known."""
        problems = self.drops.coarse(machine)
        last = replace(BLIND_SCHEDULE[-1], passes=passes)
        return track(problems, (last,), references=initial_guess_from(known, problems))

    def refine(self, first: Candidate) -> Candidate:
        """The same machine with the finer basis, from what the coarse one found."""
        fine = self.drops.fine(first.machine)
        there = initial_guess_from(first.fit, fine)
        # The finer basis may lie in the valley that the coarse one only came near: turned axes of a support
        # were found at one bearing by the coarse one and at both by the finer, some passes later.
        passes = MOST_REPEATS if first.accepted else 1

        start = converged(fine, CALIBRATION_STAGE, there, passes=passes)
        found = self.at_rest(first, start.trajectories, likeliest_noise(start, CALIBRATION_STAGE))
        if not self.drops.calibrate_only and is_doubtful(first.fit, found.fit):
            # With noise of the baseline size, which a whole drop seldom has, the same minimum is found again.
            noise, known = found.noise_factor, _with_prior_parameters(found.fit)
            start = converged(fine, CALIBRATION_STAGE, known, noise_factor=noise)
            again = self.at_rest(first, start.trajectories, noise)
            found = min(found, again, key=lambda one: one.sized_score)
        return found

    def at_rest(self, first: Candidate, references: Sequence[Array], noise: float) -> Candidate:
        """The candidate with a fit over its last window, repeated while that pays.

        ``references`` are where to linearise at first, shape (M, n) each, ``noise`` the size of process noise
        that made the first impacts likeliest, over the baseline [1].
        """
        problems = self.drops.fine(first.machine)
        stage = CALIBRATION_STAGE if self.drops.calibrate_only else WHOLE_STAGE
        fit = converged(problems, stage, references, noise_factor=noise, progress=self.progress)
        baseline = forward_passes(problems, fit.trajectories, stage, 1.0)
        if sum(map(likelihood_of, baseline)) < fit.negative_log_likelihood:
            # the whole drop leaves more unexplained than its first impacts
            noise = likeliest_noise(fit, stage)
            fit = converged(problems, stage, fit.trajectories, noise_factor=noise, progress=self.progress)
            baseline = forward_passes(problems, fit.trajectories, stage, 1.0)
        return replace(first, fit=fit, baseline=tuple(baseline))

    def weighed(self, found: Candidate) -> Candidate:
        """The candidate with the extensions that the readings ask for, one on top of the other.

        A slight departure does not show in the size of the innovations, which nobody knows to a tenth, and
        yet moves peaks and gaps: a rotor 3 % softer moved a peak by 4.6 %, a lag of 80 µs by 5.3 %.
        """
        while (kept := len(found.accepted)) < MOST_EXTENSIONS:
            for extension in self.rising(found):
                found = self._beside(found, extension)
                if len(found.accepted) > kept:
                    break
            else:
                break
        return found

    def rising(self, found: Candidate) -> list[Extension]:
        """The extensions worth fitting: they make the first impacts likelier more than all others, or widen
        what was inferred, linearised at a fit, and the whole drop likelier too.
        """
        able = [one for one in EXTENSIONS if one.values(found.machine)]
        rises = self.rises(found, CALIBRATION_STAGE).of_all(able)
        early = [pair for pair in rises if pair[0] > (LEAST_INFERRED if pair[1].inferred else 0.0)]
        ranked = [one for _, one in sorted(early, key=lambda pair: -pair[0])]
        most = [*ranked[:MOST_TRIED], *(one for one in ranked[MOST_TRIED:] if one.inferred)]
        if self.drops.calibrate_only or not most:
            return most
        return [one for rise, one in self.rises(found, WHOLE_STAGE).apart(most) if rise > 0.0]

    def rises(self, found: Candidate, stage: Stage) -> LogLikelihoodGains:
        """What every extension would bring over the window of a stage."""
        return LogLikelihoodGains(
            drops=self.drops,
            machine=found.machine,
            fit=found.fit,
            stage=stage,
            noise=found.noise_factor,
        )

    def _beside(self, found: Candidate, extension: Extension) -> Candidate:
        """The more probable one of a candidate and the same with an extension; the other is remembered."""
        had, without = tuple(one.extension for one in found.accepted), found
        against = math.exp(-evidence_threshold(extension, len(found.fit.problems)))
        try:
            other = self._with_it(found, extension)
        except IdentificationError:
            return found
        if against * bayes_factor(other, without) >= 1.0:
            # It may have only led to a better start: the model without it is given what it has found.
            with suppress(IdentificationError):
                back = self._again(other, found.machine)
                without = min(without, back, key=lambda one: one.sized_score)
        odds = against * bayes_factor(other, without)
        if odds < 1.0:
            stated, scale = without, bayes_factor(found, without)
            alternative = Alternative((*had, extension), odds, other.fit)
        else:
            scale, alternative = 1.0 / odds, Alternative(had, 1.0 / odds, without.fit)
            gain = math.inf if without.sized_score[0] else without.sized_score[1] - other.sized_score[1]
            stated = replace(other, accepted=(*found.accepted, Accepted(extension=extension, gain=gain)))
        before = [replace(one, odds=scale * one.odds) for one in found.alternatives]
        return replace(stated, alternatives=worth_keeping((*before, alternative)))

    def _with_it(self, found: Candidate, extension: Extension) -> Candidate:
        """A candidate with an extension more, from where it has come to rest or from guesses."""
        machine = extension.added_to(found.machine)
        other = self._again(found, machine)
        if extension.inferred:
            with suppress(IdentificationError):  # lost from guesses: what was found beside the fit stays
                anew = self.refine(replace(found, machine=machine, fit=self.fit_base(machine)))
                other = min(other, anew, key=lambda one: one.sized_score)
        return other

    def _again(self, found: Candidate, machine: Machine) -> Candidate:
        """The same with another machine, from where the candidate has come to rest."""
        references = initial_guess_from(found.fit, self.drops.fine(machine))
        return self.at_rest(replace(found, machine=machine), references, found.noise_factor)

    def refine_if_followed(self, first: Candidate) -> Candidate | None:
        """The same; None where the finer basis loses a record with which the coarse one was inconsistent."""
        try:
            return self.refine(first)
        except IdentificationError:
            if not first.inconsistent:
                raise
            return None

    def followed(self, found: Candidate) -> Candidate:
        """What was found, if the filter followed all drops to the end; what explains little has no name."""
        named = tuple(one for one in found.accepted if one.gain >= NAMED_RISE)
        return replace(found, fit=_refuse_diverged(found.fit, self.drops.evidence), accepted=named)


def _checkpoint_of(fit: TrackedDrops) -> Checkpoint:
    return Checkpoint(problems=fit.problems, trajectories=fit.trajectories, score=score_of(fit))


def fits(found: Candidate) -> bool:
    """Whether model and record agree, as far as another model could make them."""
    return all(
        check.passed or check.name == DIRECTIONS
        for problem, judged in zip(found.fit.problems, found.judged, strict=True)
        for check in consistency_checks(problem, judged, found.noise_factor)
    )


def is_doubtful(before: TrackedDrops, after: TrackedDrops) -> bool:
    """Whether a fit has an unknown where its prior or the first impacts hardly leave it, or at its bound."""
    if largest_move(before, after) > PLAUSIBLE_MOVE:
        return True
    for problem, means, filtered in zip(after.problems, after.trajectories, after.filtered, strict=True):
        chosen = problem.parameter_slice
        values = means[filtered.parameter_sample][chosen]
        sigma, low, high = _spread_and_bounds(problem)
        ways = np.abs(values - problem.mean[chosen]) / sigma
        if ((ways > PLAUSIBLE_WAY) | (values <= low) | (values >= high)).any():
            return True
    return False


def _with_prior_parameters(fit: TrackedDrops) -> list[Array]:
    """The motion of a fit with every parameter where its prior has it: the readings have shown the motion."""
    again = []
    for problem, means in zip(fit.problems, fit.trajectories, strict=True):
        means = means.copy()
        means[:, problem.parameter_slice] = problem.mean[problem.parameter_slice]
        again.append(means)
    return again


def largest_move(before: TrackedDrops, after: TrackedDrops) -> float:
    """Largest move of a parameter between two fits, over its standard deviation in the first [1].

    What the first does not have, such as unknowns of a sensor plane that it leaves out, has not moved.
    """
    moves = [0.0]
    drops = zip(
        before.problems, before.smoothed, after.problems, after.trajectories, after.filtered, strict=True
    )
    for problem, smoothed, fine, means, filtered in drops:
        at, chosen = smoothed.filtered.parameter_sample, problem.parameter_slice
        mean, variance = smoothed.means[at][chosen], np.diag(smoothed.covariance(at))[chosen]
        known = {one.path: pair for one, *pair in zip(problem.unknowns, mean, variance, strict=True)}
        values = means[filtered.parameter_sample][fine.parameter_slice]
        for unknown, value in zip(fine.unknowns, values, strict=True):
            if unknown.path in known:
                middle, spread = known[unknown.path]
                moves.append(abs(float(value - middle)) / math.sqrt(spread))
    return max(moves)


def _spread_and_bounds(problem: DropProblem) -> tuple[Array, Array, Array]:
    """Standard deviation of the prior and both bounds of the unknowns, shape (P,) each."""
    low, high = np.array([unknown.bounds for unknown in problem.unknowns]).T
    return np.array([unknown.sigma for unknown in problem.unknowns]), low, high


def _other_start(problem: DropProblem, number: int) -> DropProblem:
    """The problem with its unknowns starting at another point of their prior, one for each start."""
    start, chosen = problem.start.copy(), problem.parameter_slice
    sigma, low, high = _spread_and_bounds(problem)
    start[chosen] += OTHER_START_SPREAD * sigma * np.random.default_rng(number).standard_normal(len(sigma))
    start[chosen] = np.clip(start[chosen], low, high)
    start[problem.gap_entries] = problem.start[problem.gap_entries]
    return replace(problem, start=start)


def _refuse_diverged(tracked: TrackedDrops, evidence: Sequence[Evidence]) -> TrackedDrops:
    """The drops, if the filter followed all of them to the end: a part of a drop says nothing of its peak."""
    for item, problem, filtered in zip(evidence, tracked.problems, tracked.filtered, strict=True):
        done, samples = filtered.done, len(filtered.means)
        if done < samples:
            raise IdentificationError(
                f"the filter lost the drop {item.name} at {1e3 * problem.time[done]:.1f} ms of "
                f"{1e3 * problem.time[samples - 1]:.0f} ms, even with {LOOSER[-1]:g} × the usual process "
                "noise; the machine description is too far from the machine that was recorded. Check the "
                "sensors (planes, angles, signs), or calibrate anew with this drop."
            )
    return tracked
