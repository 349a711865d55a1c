"""Nominal speed of the machine and what slows it down."""

from __future__ import annotations

from pydantic import Field

from rotordrop.elements.description import Description
from rotordrop.elements.parameter import Entry, Parameter
from rotordrop.elements.values import Drag, PositiveSpeed, PositiveTime, QuadraticDrag
from rotordrop.physics import columns as L


class SpeedDescription(Description):
    """Nominal speed and aerodynamic drag.

    Attributes
    ----------
    nominal : Known
        Nominal speed [rad/s].
    aero_time_constant : Known, optional
        Time constant [s] of the exponential fall of speed by aerodynamic drag alone.
    aero_linear, aero_quadratic : Known, optional
        Aerodynamic torque as a function of speed: linear [N m s] and quadratic [N m s²] coefficients.
    """

    nominal: PositiveSpeed
    aero_time_constant: PositiveTime | None = Field(
        default=None, description="Time constant of the fall of speed by aerodynamic drag alone"
    )
    aero_linear: Drag | None = Field(default=None, description="Aerodynamic torque per speed")
    aero_quadratic: QuadraticDrag | None = Field(
        default=None, description="Aerodynamic torque per speed squared"
    )


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="speed.aero_time_constant",
        owner="drop",
        label="aerodynamic time constant",
        kind="time",
        shown_as="duration",
        guess_sigma=0.7,
        entries=(Entry(array="spin", column=L.AERO_TIME_CONSTANT),),
        truth=("tau_aero",),
    ),
)
"""Unknowns of the drag of the air, in every drop anew."""
