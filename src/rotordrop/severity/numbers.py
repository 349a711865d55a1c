"""The numbers that say how severe a drop was at one bearing, beside force and stress themselves."""

from __future__ import annotations

from dataclasses import dataclass

from rotordrop.elements.ball_bearing import STATIC_STRESS


@dataclass(frozen=True)
class SeverityNumber:
    """A number of the table: key under ``severity``, name for people, kind, whether more is worse."""

    key: str
    label: str
    kind: str
    more_is_worse: bool = True

    @property
    def field(self) -> str:
        """Its field in a document."""
        return f"severity.{self.key}"


_PURE = "dimensionless"
SEVERITY: tuple[SeverityNumber, ...] = (
    SeverityNumber("static_safety", "static safety factor by the peak stress", _PURE, more_is_worse=False),
    SeverityNumber("static_safety_of_rating", "static safety factor by C0", _PURE, more_is_worse=False),
    SeverityNumber("impulse_N_s", "impulse of all impacts", "impulse"),
    SeverityNumber("skid_energy_J", "energy lost in the contact", "energy"),
    SeverityNumber("position_index", "position index (mean distance over gap)", _PURE),
    SeverityNumber("velocity_index", "velocity index (velocity over speed times gap)", _PURE),
    SeverityNumber("fatigue_by_segments", "share of rating life, segments", _PURE),
    SeverityNumber("fatigue_by_16281", "share of rating life, ISO/TS 16281", _PURE),
    SeverityNumber("fatigue_by_rainflow", "share of rating life, rainflow", _PURE),
)
"""Severity of a drop at a bearing, in the order in which it is shown."""

NOTE = (
    "Static safety (ISO 76): by the peak stress, which counts the preload, against 4 200 MPa; by C0 over the "
    "peak force. Shares of the basic rating life (at one a tenth of new bearings fails): finite segments of "
    "the raceways (after Menck 2023), ISO/TS 16281 at every instant, rainflow of the most loaded ball; the "
    "first two as if the race turned with the rotor from the first impact on, as upper ends. None is a limit."
)
"""What stands beneath a table of these numbers."""


def static_safety_of_stress(stress: float) -> float:
    """Static safety factor s0 of a largest Hertz stress [Pa], ``(4200 MPa / σ)³`` [1].

    Source: ISO 76, which defines the static load rating of ball bearings by that stress at the most loaded
    ball; its load goes with the cube of the stress.
    """
    return (STATIC_STRESS / stress) ** 3


def static_safety_of_load(rating: float, force: float) -> float:
    """Static safety factor s0 of a radial force [N] for a static load rating C0 [N], ``C0 / P0`` [1].

    Source: ISO 76, with the radial force as equivalent load P0 where no axial one acts from outside. The
    preload counts in the stress, not here.
    """
    return rating / force
