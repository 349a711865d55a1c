"""What a line in a coast-down could be: orders, mains hum, pendulum, modes, bearing defects."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Kind = Literal["order", "steady"]
OrbitShape = Literal["any", "flat", "round"]

EQUAL_ORDER = 0.002
"""Relative tolerance of a rotor order [1] (chosen)."""

MAINS_TOLERANCE = 0.003
"""How far the mains frequency may be off [1]."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One possible source of a line, with where it would be and why."""

    name: str
    """What the line would be called."""
    family: str
    """Sources of one family are not told apart when both fit ("pendulum" of either end)."""
    kind: Kind
    """Whether it follows the rotor speed or stands still."""
    value: float
    """Order [1] or frequency [Hz]."""
    tolerance: float
    """How far the true place may be from ``value`` [same unit]."""
    reason: str
    """Where the value comes from."""
    shape: OrbitShape = "any"
    """Form of the orbit that the source would make."""
    weight: float = 1.0
    """How likely the source is before the line is looked at, against other candidates [1]."""
    planes: tuple[str, ...] = ()
    """Planes in which it would be strongest; empty when it may be in any."""
    narrow: bool = False
    """Whether the source holds its frequency, as a power grid does: a broad line is then something else."""


def order_candidates(highest: int = 6) -> tuple[Candidate, ...]:
    """Whole orders up to the highest, and the half orders between them as the sign of rub.

    Source: Neisi 2020, section 5.4: 1X, 2X, 3X in all tests; 1.5X, 2.5X, 3.5X, 4.5X as rub impact.
    """
    whole = [
        Candidate(
            name=f"{k}X",
            family=f"{k}X",
            kind="order",
            value=float(k),
            tolerance=EQUAL_ORDER * k,
            reason="unbalance and runout"
            if k == 1
            else "harmonic of the rotor speed: runout, misalignment, contact",
        )
        for k in range(1, highest + 1)
    ]
    half = [
        Candidate(
            name=f"{k + 0.5:g}X",
            family=f"{k + 0.5:g}X",
            kind="order",
            value=k + 0.5,
            tolerance=EQUAL_ORDER * (k + 0.5),
            reason="odd multiple of half the rotor speed: sign of rub",
        )
        for k in range(highest)
    ]
    return (*whole, *half)


def mains_candidates(frequencies: Sequence[float] = (50.0, 60.0), highest: int = 6) -> tuple[Candidate, ...]:
    """Hum of the electrical supply [Hz] and its multiples."""
    return tuple(
        Candidate(
            name=f"mains hum {k * f:g} Hz",
            family=f"mains {f:g} Hz",
            kind="steady",
            value=k * f,
            tolerance=MAINS_TOLERANCE * k * f,
            reason=f"{'' if k == 1 else f'{k} times '}mains frequency {f:g} Hz",
            weight=1.0 if k == 1 else 0.3,
            narrow=True,
        )
        for f in frequencies
        for k in range(1, highest + 1)
    )


def pendulum_candidate(
    name: str, lowest: float, highest: float, *, planes: Sequence[str] = (), reason: str = ""
) -> Candidate:
    """Swing of the settled rotor in a race, between its frequencies [Hz] at large and small amplitude."""
    return Candidate(
        name=name,
        family="pendulum",
        kind="steady",
        value=0.5 * (lowest + highest),
        tolerance=0.5 * (highest - lowest),
        reason=reason or f"swing in the race, {lowest:.2f} to {highest:.2f} Hz by amplitude",
        shape="flat",
        planes=tuple(planes),
    )


def mode_candidate(name: str, frequency: float, tolerance: float, *, reason: str = "") -> Candidate:
    """A mode of the rotor on its touchdown bearings or of a support, at a frequency ± tolerance [Hz]."""
    return Candidate(
        name=name,
        family=name,
        kind="steady",
        value=frequency,
        tolerance=tolerance,
        reason=reason or f"model: {frequency:.1f} ± {tolerance:.1f} Hz",
    )


def bearing_defect_candidates(
    bearing: str,
    *,
    ball_count: int,
    ball_diameter: float,
    pitch_diameter: float,
    contact_angle: float,
    race_speed_ratio: tuple[float, float] = (0.98, 1.0),
    slip: float = 0.01,
    harmonics: int = 2,
) -> tuple[Candidate, ...]:
    """Ball-pass and cage frequencies of a touchdown bearing whose inner race turns, as orders of the rotor
    speed.

    Lengths are in [m], the contact angle in [rad]. The race speed ratio is its lowest and highest speed over
    that of the rotor once it rolls along, the slip how much the balls may lag behind pure rolling [1].

    Source: kinematics of rolling bearings, outer race at rest (ISO 15243 gives the same formulas).
    """
    gamma = ball_diameter / pitch_diameter * math.cos(contact_angle)
    z = ball_count
    factors: Iterable[tuple[str, float]] = (
        ("cage", 0.5 * (1.0 - gamma)),
        ("outer-race defect", 0.5 * z * (1.0 - gamma)),
        ("inner-race defect", 0.5 * z * (1.0 + gamma)),
        ("ball defect", pitch_diameter / ball_diameter * (1.0 - gamma**2)),
    )
    low, high = race_speed_ratio
    return tuple(
        Candidate(
            name=f"{bearing} {what}{'' if k == 1 else f', harmonic {k}'}",
            family=f"{bearing} {what}",
            kind="order",
            value=k * factor * 0.5 * (low + high),
            tolerance=k * factor * (0.5 * (high - low) + slip),
            reason=f"{k * factor:.3f} times the race speed, {low:.3f} to {high:.3f} of the rotor speed",
            weight=0.5,
        )
        for what, factor in factors
        for k in range(1, (1 if what == "cage" else harmonics) + 1)
    )


def harmonic_candidates(name: str, frequency: float, error: float, highest: int = 5) -> tuple[Candidate, ...]:
    """Multiples of a steady line that was found and named, e.g. of a large pendulum swing."""
    return tuple(
        Candidate(
            name=f"{name}, harmonic {k}",
            family=f"{name} harmonic",
            kind="steady",
            value=k * frequency,
            tolerance=k * error,
            reason=f"{k} times the {name} found at {frequency:.2f} Hz",
            weight=0.5 ** (k - 2),
        )
        for k in range(2, highest + 1)
    )
