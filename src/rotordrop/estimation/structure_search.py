"""Which extension of the usual model pays: tried one at a time, kept by marginal likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce

from rotordrop.errors import IdentificationError
from rotordrop.estimation.structure import EXTENSIONS, Extension
from rotordrop.machine import Machine
from rotordrop.tracking.calibration import TrackedDrops, beside_the_record

PENALTY = 40.0
"""Rise of the logarithm of the marginal likelihood from which an extension is kept [1].

Source: one structure each on drops of one machine: without departure all were within 28, the right one was
172 and more before the next best; an extension has about three unknowns for each bearing.
"""

MOST_EXTENSIONS = 2
THREADS = 2


@dataclass(frozen=True, kw_only=True)
class Kept:
    """An extension that was kept, and the rise of the log marginal likelihood that it brought [1]."""

    extension: Extension
    gain: float


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A machine, the extensions it has beyond the description, and how it follows the record."""

    machine: Machine
    fit: TrackedDrops
    kept: tuple[Kept, ...] = ()

    @property
    def beside(self) -> bool:
        """Whether it ended beside the record."""
        return beside_the_record(self.fit)

    @property
    def rank(self) -> tuple[bool, float, float]:
        """What is smaller fits better: likelihoods compare at equal unknown impulses only."""
        return any(self.fit.diverged), max(self.fit.noise_factors), improbability(self.fit)


USUAL, DAMPED, FIRST_OTHER_START = range(3)
"""How a fit is attempted: in the usual way, in short steps, and from then on from other starts."""
OTHER_STARTS = 6
BACK_PASSES = 3

Fit = Callable[[Machine, int], TrackedDrops]
"""A fit from guesses to the record: of a machine, and which attempt."""

Judge = Callable[[TrackedDrops, Machine], float]
"""Improbability of the readings with a machine, linearised at a fit."""

Look = Callable[[TrackedDrops, Machine, int], TrackedDrops]
"""Passes over the record, linearised at a fit: the fit, a machine, and how many."""


def improbability(fit: TrackedDrops) -> float:
    """Negative logarithm of the marginal likelihood of all drops, up to a constant [1]."""
    return sum(one.filtered.negative_log_likelihood for one in fit.smoothed)


def gain_of(candidate: Candidate, before: Candidate) -> float:
    """Rise of the log marginal likelihood [1]; without limit where the other needed larger impulses."""
    if candidate.rank[:2] != before.rank[:2]:
        return math.inf if candidate.rank < before.rank else -math.inf
    return before.rank[2] - candidate.rank[2]


def found_structure(usual: Candidate, fit: Fit, look: Look) -> Candidate:
    """The best of the usual model and its extensions, one on top of the other while that pays.

    The windows of a search leave it a few passes short, and an extension may have only led to a better start.
    So the model without it is given what both have found, and the rise of the likelihood counts from there.

    Parameters
    ----------
    usual : Candidate
        The usual model, which ended beside the record.
    fit : callable
        Fits a machine to the record.
    look : callable
        Passes with another machine, linearised at what was found.
    """
    best = _given_back(usual, usual, look)
    for _ in range(MOST_EXTENSIONS):
        better = _best_extension(best, fit)
        if better is best:
            break
        best = _given_back(best, better, look)
        if (gain := gain_of(better, best)) < PENALTY:
            break
        kept = replace(better.kept[-1], gain=gain)
        better = replace(better, kept=(*better.kept[:-1], kept))
        best = _given_back(better, better, look)
        if not best.beside:
            break
    return _other_starts(best, fit) if best.beside else best


def _best_extension(base: Candidate, fit: Fit) -> Candidate:
    """The best candidate with one extension more, in short steps too where none ends at the record."""
    best = base
    for attempt in (USUAL, DAMPED):
        tried = [one for one in _tried(base, _left(base), fit, attempt) if one is not None]
        best = min((best, *tried), key=lambda one: one.rank)
        if not best.beside:
            break
    return best


def _given_back(base: Candidate, better: Candidate, look: Look) -> Candidate:
    """The base, or what it makes of the place that an extension has found."""
    try:
        back = replace(base, fit=look(better.fit, base.machine, BACK_PASSES))
    except IdentificationError:
        return base
    return min(base, back, key=lambda one: one.rank)


def _other_starts(best: Candidate, fit: Fit) -> Candidate:
    """The same machine from other places in its prior, where the objective has several minima."""
    tried = [best]
    for attempt in range(FIRST_OTHER_START, FIRST_OTHER_START + OTHER_STARTS):
        with suppress(IdentificationError):
            tried.append(replace(best, fit=fit(best.machine, attempt)))
        if not tried[-1].beside:
            break
    return min(tried, key=lambda one: one.rank)


def _left(best: Candidate) -> list[Extension]:
    return [one for one in EXTENSIONS if one.values(best.machine)]


def _tried(
    base: Candidate, extensions: Iterable[Extension], fit: Fit, attempt: int
) -> Sequence[Candidate | None]:
    """Each extension on top of a candidate; None for one with which the filter lost the record."""

    def one(extension: Extension) -> Candidate | None:
        machine = extension.added_to(base.machine)
        try:
            found = Candidate(machine=machine, fit=fit(machine, attempt))
        except IdentificationError:
            return None
        kept = Kept(extension=extension, gain=gain_of(found, base))
        return Candidate(machine=machine, fit=found.fit, kept=(*base.kept, kept))

    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        return list(pool.map(one, extensions))


def found_sensors(usual: Candidate, judge: Judge, look: Look) -> Candidate:
    """The usual model that fits, with the extension of its sensors that pays all the same, if one does.

    What sensors do may not show in the size of the innovations, and bias the air gap.

    Parameters
    ----------
    usual : Candidate
        The usual model, which follows the record.
    judge : callable
        What the likelihood of another machine is, linearised at what was found.
    look : callable
        Passes with another machine, linearised at what was found.
    """
    plain = judge(usual.fit, usual.machine)
    of_sensors = [one for one in EXTENSIONS if one.of_sensors and one.values(usual.machine)]
    together = reduce(lambda machine, one: one.added_to(machine), of_sensors, usual.machine)
    if plain - judge(usual.fit, together) < 0.5 * PENALTY:  # one pass in place of one for each
        return usual
    extended = [(one, one.added_to(usual.machine)) for one in of_sensors]
    gains = [plain - judge(usual.fit, machine) for _, machine in extended]
    if max(gains, default=0.0) < PENALTY:
        return usual
    extension, machine = extended[gains.index(max(gains))]
    found = Candidate(machine=machine, fit=look(usual.fit, machine, BACK_PASSES))
    again = replace(usual, fit=look(usual.fit, usual.machine, BACK_PASSES))
    gain = gain_of(found, again)
    kept = (Kept(extension=extension, gain=gain),)
    return replace(found, kept=kept) if gain >= PENALTY else usual
