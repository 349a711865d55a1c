"""What every kind of touchdown bearing describes: how its race fits and weighs, what looks odd in it."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

from rotordrop.elements.description import Description, Text
from rotordrop.known import Known

if TYPE_CHECKING:
    from rotordrop.elements.bearing_numbers import BearingNumbers
    from rotordrop.elements.race import Race

Oddity = tuple[str, float, float, str]
"""Name of an entry, its value and the limit it is compared with [SI], and what to say."""


class RaceBearing(Description):
    """The bearing that carries the race of a touchdown bearing, of whatever kind.

    The numbers that follow from it are its `BearingNumbers`.
    """

    designation: Text | None = None
    """What its maker calls it."""

    no_race: ClassVar[str] = ""
    """Why no table 'race' goes with it, where none spins between rotor and support; empty where one does."""

    @property
    @abstractmethod
    def no_face(self) -> str:
        """Why its race cannot have a face on which the rotor lands; empty where it can."""

    @abstractmethod
    def numbers(self) -> BearingNumbers:
        """Give the numbers that follow from it."""

    @abstractmethod
    def check_bore(self, radius: float) -> None:
        """Refuse a bore [m] that the race has no room for, with a `Misfit`."""

    @abstractmethod
    def usual_race_width(self) -> tuple[float, str]:
        """Width of the race [m] where none is given, and why."""

    @abstractmethod
    def race_of_size(self, race: Race, width: Known, bore: float) -> Race:
        """Give a race its width, and mass and inertia that were left out, around a bore radius [m]."""

    @property
    def rim_radius(self) -> float:
        """Radius at which the inner ring ends [m]; that of what has none is anywhere."""
        return math.inf

    def oddities(self, bore_radius: float) -> Iterator[Oddity]:
        """What looks odd in the description, which can be used all the same."""
        yield from ()
