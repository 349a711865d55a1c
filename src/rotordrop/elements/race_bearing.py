"""What every kind of touchdown bearing describes: how its race fits and weighs, what looks odd in it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator

from rotordrop.elements.description import Description

Oddity = tuple[str, float, float, str]
"""Name of an entry, its value and the limit it is compared with [SI], and what to say."""


class RaceBearing(Description):
    """The bearing that carries the race of a touchdown bearing, of whatever kind.

    The numbers that follow from it are in `rotordrop.elements.bearing_numbers`.
    """

    @abstractmethod
    def check_bore(self, radius: float) -> None:
        """Refuse a bore [m] that the race has no room for, with a `Misfit`."""

    @abstractmethod
    def usual_race_width(self) -> tuple[float, str]:
        """Width of the race [m] where none is given, and why."""

    @abstractmethod
    def race_radius(self) -> tuple[float, str]:
        """Outer radius of what spins with the race [m], and why."""

    def oddities(self, bore_radius: float) -> Iterator[Oddity]:
        """What looks odd in the description, which can be used all the same."""
        yield from ()
