"""What a machine may have beyond the usual model, one row each, as in the parameter table."""

from __future__ import annotations

from collections.abc import Iterator

from rotordrop.elements.parameter import Entry, Owner, Parameter, Rule
from rotordrop.physics import columns as L


def _bearing(column: int) -> tuple[Entry, ...]:
    return (Entry(array="bearing", column=column),)


STRUCTURE: tuple[Parameter, ...] = (
    Parameter(
        path="support.coupling",
        label="coupling of horizontal and vertical support stiffness",
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=0.25,
        given_sigma=0.05,
        lower=-0.85,
        upper=0.85,
        entries=_bearing(L.SUPPORT_COUPLING),
    ),
    Parameter(
        path="support.cubic",
        label="cubic term of the support stiffness",
        kind="cubic_term",
        logarithmic=False,
        guess_sigma=0.4,
        given_sigma=0.1,
        scale="one over the deflection under ten mean loads, squared",
        entries=_bearing(L.SUPPORT_CUBIC),
    ),
    Parameter(
        path="support.foundation_share",
        label="support mass over foundation mass",
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=0.06,
        given_sigma=0.01,
        lower=0.0,
        entries=_bearing(L.FOUNDATION_SHARE),
    ),
    Parameter(
        path="support.foundation_frequency",
        label="natural frequency of the foundation",
        kind="speed",
        guess_sigma=0.3,
        given_sigma=0.05,
        reach=5.0,
        entries=_bearing(L.FOUNDATION_SPEED),
    ),
    Parameter(
        path="support.foundation_damping_ratio",
        label="damping ratio of the foundation",
        kind="dimensionless",
        guess_sigma=0.5,
        given_sigma=0.2,
        reach=8.0,
        entries=_bearing(L.FOUNDATION_DAMPING),
    ),
    Parameter(
        path="time_constant",
        owner="sensor",
        label="time constant of the sensor",
        kind="time",
        shown_as="short_time",
        guess_sigma=0.1,
        given_sigma=0.1,
        reach=300.0,
        common_sigma=1.2,
    ),
    Parameter(
        path="cross_axis",
        owner="sensor",
        label="cross-axis sensitivity",
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=0.03,
        given_sigma=0.003,
        lower=-0.3,
        upper=0.3,
        # what both sensors of a plane have in common is a turn of the plane, which friction looks like
        common_sigma=0.003,
        group="plane",
    ),
    Parameter(
        path="follows_housing",
        owner="sensor",
        label="part of the motion of the housing that the bracket makes",
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=0.03,
        given_sigma=0.03,
        lower=-0.5,
        upper=1.5,
        common_sigma=0.3,
        group="plane",
    ),
    Parameter(
        path="plane_offset",
        owner="sensor",
        label="distance of the sensor from its node",
        kind="length",
        logarithmic=False,
        guess_sigma=0.001,
        given_sigma=0.001,
        scale="one",
        common_sigma=0.015,
        group="plane",
    ),
    Parameter(
        path="stiffness_factor",
        owner="rotor",
        label="bending stiffness of the rotor over the described one",
        kind="dimensionless",
        measured_by="the first bending frequency of the free rotor, from a hammer test",
        guess_sigma=0.03,
        given_sigma=0.01,
        reach=1.3,
        entries=(Entry(array="modes", column=0, rule=Rule.RATIO),),
    ),
)
"""What a machine may have beyond the usual model; an unknown only where its description names it."""


def structure_rows(owner: Owner) -> Iterator[Parameter]:
    """Rows of one kind of owner that a machine may have beyond the usual model."""
    return (row for row in STRUCTURE if row.owner == owner)
