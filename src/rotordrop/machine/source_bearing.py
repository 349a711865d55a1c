"""A bearing of a rotor from another program: its coefficients, at one speed or over speeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A bearing of the source."""

    node: int
    """Node here."""
    name: str
    """Its name."""
    stiffness: tuple[float, float]
    damping: tuple[float, float]
    """In x and y [N/m], [N s/m]; where the source has them by speed, the first of its table."""
    cross_stiffness: tuple[float, float] = (0.0, 0.0)
    cross_damping: tuple[float, float] = (0.0, 0.0)
    """Force in x against motion in y, and in y against motion in x."""
    kind: str = "BearingElement"
    """What it is in the source; seals are held in the same way."""
    told: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """All coefficients of the source by its own names, over ``frequency`` [rad/s]; written back as they are.
    """

    @property
    def stiffness_matrix(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Force in (x, y) against displacement in (x, y) [N/m]."""
        return _matrix(self.stiffness, self.cross_stiffness)

    @property
    def damping_matrix(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Force in (x, y) against velocity in (x, y) [N s/m]."""
        return _matrix(self.damping, self.cross_damping)

    def at_speed(self, speed: float) -> Spring:
        """The bearing with its coefficients at a speed [rad/s], straight between those of its table."""
        speeds = self.told.get("frequency", ())
        if len(speeds) < 2:
            return self

        def between(key: str, otherwise: float) -> float:
            values = self.told.get(key)
            return otherwise if values is None or len(values) < 2 else _between(speed, speeds, values)

        def pair(kind: str, keys: tuple[str, str], now: tuple[float, float]) -> tuple[float, float]:
            first, second = (between(f"{kind}{key}", value) for key, value in zip(keys, now, strict=True))
            return first, second

        own, cross = ("xx", "yy"), ("xy", "yx")
        return replace(
            self,
            stiffness=pair("k", own, self.stiffness),
            damping=pair("c", own, self.damping),
            cross_stiffness=pair("k", cross, self.cross_stiffness),
            cross_damping=pair("c", cross, self.cross_damping),
        )


def _between(at: float, places: tuple[float, ...], values: tuple[float, ...]) -> float:
    """Value on the straight line between two of a table; the end one beyond it."""
    for (a, u), (b, v) in pairwise(zip(places, values, strict=True)):
        if at <= b:
            return u if at <= a else u + (v - u) * (at - a) / (b - a)
    return values[-1]


def _matrix(
    own: tuple[float, float], cross: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    return (own[0], cross[0]), (cross[1], own[1])
