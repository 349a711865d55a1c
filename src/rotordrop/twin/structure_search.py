"""Which extension of the usual model pays: tried one at a time, kept by marginal likelihood."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.extension import Extension
from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import IdentificationError
from rotordrop.machine import Machine
from rotordrop.track.calibration import THREADS, TrackedDrops, beside_the_record
from rotordrop.track.problem import DropProblem

Array = NDArray[np.float64]

PENALTY = 40.0
"""Rise of the logarithm of the marginal likelihood from which an extension is kept [1].

Source: one structure each on drops of one machine: without departure all were within 28, the right one was
172 and more before the next best; an extension has about three unknowns for each bearing.
"""

PAYS_BESIDE = 10.0
"""The same for an extension of a model that fits, from where that one ended [1].

Nothing else changes there, so that less tells: on drops without departure the best of ten extensions rose by
7 at most, while long remanence brought 24 to 31 and cross-axis sensitivity 11 to 202 (``studies/structure``).
"""

MOST_EXTENSIONS = 2

USUAL, DAMPED, FIRST_OTHER_START = range(3)
"""How a fit is attempted: in the usual way, in short steps, and from then on from other starts."""
OTHER_STARTS = 6
BACK_PASSES = 3

FIRST_CHOICE = 2
"""Window after which the half that follows the record worse stays behind, and after each one from then on.

Before, the windows hold little more than the first contact. After it the right one of ten extensions was in
the better half, and first from the next window on (three structures, both ways: ``studies/structure``).
"""
FEWEST = 2

Rank = tuple[bool, float, float]
"""Lost, unknown impulses over the usual ones [1], improbability: what is smaller fits better, and
likelihoods compare at equal unknown impulses only."""


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
    def rank(self) -> Rank:
        """How it follows the record."""
        return rank_of(self.fit)


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a fit from guesses is after some windows: less than the fit, of which many are on their way.

    Attributes
    ----------
    problems : tuple of DropProblem
        The drops.
    trajectories : tuple of ndarray
        Smoothed means of each drop, shape (M, n).
    rank : tuple
        How the fit follows the record.
    """

    problems: tuple[DropProblem, ...]
    trajectories: tuple[Array, ...]
    rank: Rank


class Search(Protocol):
    """Fits of machines to the same drops."""

    @property
    def windows(self) -> int:
        """Number of windows from guesses to the first impacts whole."""

    def window(self, machine: Machine, attempt: int, number: int, before: Place | None) -> Place:
        """A fit of a machine over one window more; from its guesses where nothing is before."""

    def settled(self, place: Place) -> TrackedDrops:
        """The fit over the last window, repeated while that pays."""

    def judge(self, known: TrackedDrops, machine: Machine) -> float:
        """Improbability of the readings with a machine, linearised at a fit."""

    def look(self, known: TrackedDrops, machine: Machine, passes: int) -> TrackedDrops:
        """Passes over the last window with a machine, linearised at a fit."""


def rank_of(fit: TrackedDrops) -> Rank:
    """How a fit follows the record."""
    return any(fit.diverged), max(fit.noise_factors), fit.improbability


def gain_of(candidate: Candidate, before: Candidate) -> float:
    """Rise of the log marginal likelihood [1]; without limit where the other needed larger impulses."""
    if candidate.rank[:2] != before.rank[:2]:
        return math.inf if candidate.rank < before.rank else -math.inf
    return before.rank[2] - candidate.rank[2]


def found_structure(usual: Candidate, search: Search) -> Candidate:
    """The best of the usual model and its extensions, one on top of the other while that pays.

    The windows of a search leave it a few passes short, and an extension may have only led to a better start.
    So the model without it is given what both have found, and the rise of the likelihood counts from there.

    Parameters
    ----------
    usual : Candidate
        The usual model, which does not fit the record.
    search : Search
        Fits machines to the record.
    """
    best = _given_back(usual, usual, search)
    for _ in range(MOST_EXTENSIONS):
        if (better := _best_extension(best, search)) is None:
            break
        best = _given_back(best, better, search)
        if (gain := gain_of(better, best)) < PENALTY:
            break
        kept = replace(better.kept[-1], gain=gain)
        better = replace(better, kept=(*better.kept[:-1], kept))
        best = _given_back(better, better, search)
        if not best.beside:
            break
    return found_start(best, search)


def _best_extension(base: Candidate, search: Search) -> Candidate | None:
    """The best candidate with one extension more, by either way from guesses; None where all were lost."""
    entrants = [
        _Entrant(
            machine=extension.added_to(base.machine),
            attempt=attempt,
            kept=(*base.kept, Kept(extension=extension, gain=math.inf)),
        )
        for extension in EXTENSIONS
        if extension.values(base.machine)
        for attempt in (USUAL, DAMPED)
    ]
    return _winner(entrants, search)


def _given_back(base: Candidate, better: Candidate, search: Search) -> Candidate:
    """The base, or what it makes of the place that an extension has found."""
    try:
        back = replace(base, fit=search.look(better.fit, base.machine, BACK_PASSES))
    except IdentificationError:
        return base
    return min(base, back, key=lambda one: one.rank)


def found_start(best: Candidate, search: Search) -> Candidate:
    """The same machine from other places in its prior, where it ended beside the record.

    The objective has several minima.
    """
    if not best.beside:
        return best
    starts = range(FIRST_OTHER_START, FIRST_OTHER_START + OTHER_STARTS)
    entrants = [_Entrant(machine=best.machine, attempt=start, kept=best.kept) for start in starts]
    found = _winner(entrants, search)
    return best if found is None else min(best, found, key=lambda one: one.rank)


@dataclass(frozen=True, kw_only=True)
class _Entrant:
    """A machine on its way from guesses to the record."""

    machine: Machine
    attempt: int
    kept: tuple[Kept, ...]
    place: Place | None = None

    @property
    def rank(self) -> Rank:
        return (True, math.inf, math.inf) if self.place is None else self.place.rank


def _winner(entrants: Sequence[_Entrant], search: Search) -> Candidate | None:
    """Who follows the record best of those that many short windows and few long ones leave.

    Successive halving: Jamieson & Talwalkar, AISTATS 2016.
    """

    def further(entrant: _Entrant) -> _Entrant | None:
        try:
            place = search.window(entrant.machine, entrant.attempt, window, entrant.place)
        except IdentificationError:
            return None
        return replace(entrant, place=place)

    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        for window in range(search.windows):
            there = [one for one in pool.map(further, entrants) if one is not None]
            entrants = sorted(there, key=lambda one: one.rank)
            if window >= FIRST_CHOICE:
                entrants = entrants[: max(FEWEST, (len(there) + 1) // 2)]
    found = []
    for one in entrants[:FEWEST]:
        with suppress(IdentificationError):
            assert one.place is not None
            found.append(Candidate(machine=one.machine, fit=search.settled(one.place), kept=one.kept))
    return min(found, key=lambda one: one.rank, default=None)


def found_beside_the_usual(usual: Candidate, search: Search) -> Candidate:
    """The usual model that fits, with the extension that pays all the same, if one does.

    A mild departure may not show in the size of the innovations, which nobody knows to a tenth, and yet move
    peaks and gaps: a rotor 3 % softer moved a peak by 4.6 %, cross-axis sensitivity a gap by 30 µm.

    Parameters
    ----------
    usual : Candidate
        The usual model, which follows the record.
    search : Search
        Fits machines to the record.
    """
    able = [one for one in EXTENSIONS if one.shows_beside and one.values(usual.machine)]
    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        described = pool.submit(search.judge, usual.fit, usual.machine)

        def rise(one: Extension) -> float:
            with_it = search.judge(usual.fit, one.added_to(usual.machine))
            if not one.usual(usual.machine):
                return described.result() - with_it
            return search.judge(usual.fit, one.saying_the_usual(usual.machine)) - with_it

        rises = list(pool.map(rise, able))
    if not math.isfinite(described.result()):
        return usual
    promising = [pair for pair in zip(rises, able, strict=True) if pair[0] >= PAYS_BESIDE]
    for _, extension in sorted(promising, key=lambda pair: -pair[0]):
        machine, plain = extension.added_to(usual.machine), extension.saying_the_usual(usual.machine)
        found = Candidate(machine=machine, fit=search.look(usual.fit, machine, BACK_PASSES))
        again = replace(usual, fit=search.look(usual.fit, plain, BACK_PASSES))
        if (gain := gain_of(found, again)) >= PAYS_BESIDE:
            return replace(found, kept=(Kept(extension=extension, gain=gain),))
    return usual
