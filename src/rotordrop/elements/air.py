"""Nominal speed of the machine and what slows it down."""

from __future__ import annotations

from rotordrop.elements.description import Description
from rotordrop.elements.parameter import Entry, Parameter
from rotordrop.elements.values import Drag, PositiveSpeed, PositiveTime, QuadraticDrag
from rotordrop.physics import columns as L


class SpeedDescription(Description):
    """Nominal speed and aerodynamic drag."""

    nominal: PositiveSpeed
    """Nominal speed [rad/s]."""
    aero_time_constant: PositiveTime | None = None
    """Time constant [s] of the exponential fall of speed by aerodynamic drag alone."""
    aero_linear: Drag | None = None
    """Aerodynamic torque per speed."""
    aero_quadratic: QuadraticDrag | None = None
    """Aerodynamic torque per speed squared."""


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="speed.aero_time_constant",
        owner="drop",
        label="aerodynamic time constant",
        kind="time",
        shown_as="duration",
        guess_sigma=0.7,
        given_sigma=0.0,
        entries=(Entry(array="spin", column=L.AERO_TIME_CONSTANT),),
    ),
)
"""Unknowns of the drag of the air, in every drop anew."""
