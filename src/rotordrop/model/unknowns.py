"""The unknowns of a machine and a drop: rows of the parameter table bound to their owner, with priors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

from rotordrop.estimated import NINETY, Estimated
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.model.parameter import Entry, Parameter, Rule
from rotordrop.model.parameter_table import parameter, rows
from rotordrop.model.parameters import DropModel
from rotordrop.physics.ball_bearing import bearing_constants, preload_of_offset

Scope = Literal["machine", "drop"]

TYPICAL_FORCE = 1500.0
"""Contact force at whose indentation the stiffness keeps its meaning when the exponent differs [N]."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A kernel entry that an unknown sets: which, in which row, and the factor on the value."""

    entry: Entry
    row: int
    factor: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """One unknown parameter of a machine or a drop with its prior.

    Attributes
    ----------
    parameter : Parameter
        Its row in the parameter table.
    owner : str
        Name of the bearing or magnet, number of the unbalance, or nothing for a drop.
    mean, sigma : float
        Prior mean and standard deviation, of the logarithm where the parameter is logarithmic.
    targets : tuple of Target
        Kernel entries it sets.
    calibrated : bool
        Whether its prior is an estimate made before, not a guess.
    published : callable, optional
        The published value [SI] of the number that is estimated, where they differ: preload for the axial
        offset of the ball rows, anisotropy for its ratio to the one described.
    """

    parameter: Parameter
    owner: str = ""
    mean: float
    sigma: float
    targets: tuple[Target, ...]
    calibrated: bool = False
    published: Callable[[float], float] | None = None

    @property
    def path(self) -> str:
        """Path in the machine, such as ``"NDE.support.stiffness"``."""
        return self.parameter.path_of(self.owner)

    @property
    def logarithmic(self) -> bool:
        """Whether it is estimated by its logarithm."""
        return self.parameter.logarithmic

    @property
    def unit(self) -> str:
        """SI unit of the published value."""
        return self.parameter.unit

    @property
    def scope(self) -> Scope:
        """Whether all drops of a machine share it."""
        return "machine" if self.parameter.owner == "bearing" else "drop"

    @property
    def bounds(self) -> tuple[float, float]:
        """Between what the model follows it, in the measure it is estimated in."""
        row = self.parameter
        if row.reach is not None:
            return self.mean - math.log(row.reach), self.mean + math.log(row.reach)
        low, high = (
            end if limit is None else math.log(limit) if row.logarithmic else limit
            for limit, end in ((row.lower, -math.inf), (row.upper, math.inf))
        )
        return low, high

    def kernel_value(self, theta: float) -> float:
        """What is written into the kernel for an estimated number."""
        return math.exp(theta) if self.logarithmic else theta

    def value_of(self, theta: float) -> float:
        """Published SI value of an estimated number."""
        return self.kernel_value(theta) if self.published is None else self.published(theta)

    def standard_error(self, theta: float, sigma: float) -> float:
        """Standard error of the published value for that of an estimated number."""
        if self.published is not None:
            half = NINETY * sigma
            return (self.published(theta + half) - self.published(theta - half)) / (2.0 * NINETY)
        return sigma * self.kernel_value(theta) if self.logarithmic else sigma


def prior_sigma(row: Parameter, quantity: Estimated) -> float:
    """Prior standard deviation of what the machine file says, of the logarithm where the row is logarithmic.

    Parameters
    ----------
    row : Parameter
        Row of the parameter.
    quantity : Estimated
        The value with what is known about it.
    """
    logarithmic = row.logarithmic or row.path == "preload"
    value = float(quantity)
    for interval in (quantity.interval_90, quantity.range):
        if interval is not None and (interval[0] > 0.0 or not logarithmic):
            low, high = interval
            width = math.log(high / low) if logarithmic else high - low
            return max(width / (2.0 * NINETY), row.least_sigma)
    if quantity.standard_error is not None and (value > 0.0 or not logarithmic):
        return quantity.standard_error / value if logarithmic else quantity.standard_error
    return row.given_sigma if quantity.status == "given" else row.guess_sigma


def bearing_unknowns(model: DropModel, index: int) -> Iterator[Unknown]:
    """Unknown parameters of one touchdown bearing of a model."""
    bearing = model.machine.touchdown_bearings[index]
    for row in rows("bearing"):
        if row.path == "preload" and float(row.described(bearing)) == 0.0:
            continue  # loose: nothing to find, and the air gap takes up an error of the play
        if row.path == "preload":
            yield _preload(row, bearing, index)
        elif row.path == "support.anisotropy":
            yield _anisotropy(row, bearing, index)
        elif row.entries:
            yield _unknown(model, row, row.described(bearing), index)


def _unknown(model: DropModel, row: Parameter, quantity: Estimated, index: int) -> Unknown:
    bearing = model.machine.touchdown_bearings[index]
    value = float(quantity)
    mean = math.log(value) if row.logarithmic else value
    return Unknown(
        parameter=row,
        owner=bearing.name,
        mean=mean,
        sigma=prior_sigma(row, quantity),
        targets=tuple(
            Target(entry=entry, row=index, factor=_factor(model, entry, index, value, mean))
            for entry in row.entries
        ),
        calibrated=quantity.status == "estimated",
    )


def _factor(model: DropModel, entry: Entry, index: int, value: float, mean: float) -> float:
    described = float(model.parameters.bearing[index, entry.column])
    if entry.rule is Rule.RATIO:
        return described / value
    if entry.rule is Rule.PER_VALUE:
        return described / math.exp(mean)
    if entry.rule is Rule.AT_TYPICAL_DEPTH:
        return typical_depth(model.machine.touchdown_bearings[index])
    return 1.0


def typical_depth(bearing: TouchdownBearing) -> float:
    """Indentation at the typical contact force [m]."""
    contact = bearing.contact
    return float((TYPICAL_FORCE / float(contact.stiffness)) ** (1.0 / float(contact.exponent)))


def _anisotropy(row: Parameter, bearing: TouchdownBearing, index: int) -> Unknown:
    """Horizontal over vertical stiffness, estimated by its ratio to the one described."""
    described = row.described(bearing)

    def ratio(theta: float) -> float:
        return float(described) * math.exp(theta)

    return Unknown(
        parameter=row,
        owner=bearing.name,
        mean=0.0,
        sigma=prior_sigma(row, described),
        targets=tuple(Target(entry=entry, row=index) for entry in row.entries),
        published=ratio,
    )


def _preload(row: Parameter, bearing: TouchdownBearing, index: int) -> Unknown:
    """Preload, estimated by the axial offset of the rows, which is what the ball forces depend on."""
    constants = bearing_constants(bearing.bearing)
    quantity = row.described(bearing)
    step = 1e-4
    slope = (
        preload_of_offset(constants, constants.axial_offset * (1 + step))
        - preload_of_offset(constants, constants.axial_offset * (1 - step))
    ) / (2 * step * constants.axial_offset)
    return Unknown(
        parameter=row,
        owner=bearing.name,
        mean=constants.axial_offset,
        sigma=float(quantity) * prior_sigma(row, quantity) / slope,
        targets=tuple(Target(entry=entry, row=index) for entry in row.entries),
        calibrated=quantity.status == "estimated",
        published=partial(preload_of_offset, constants),
    )


def drop_unknowns(model: DropModel) -> Iterator[Unknown]:
    """Unknowns of one drop: unbalance against an unknown mark, remanent forces, aerodynamic constant."""
    machine = model.machine
    for plane, unbalance in enumerate(machine.unbalances):
        for row in rows("unbalance"):
            yield _of_drop(row, str(plane), 0.0, max(float(unbalance.amount), 1e-9), plane)
    for a, amb in enumerate(machine.ambs):
        for row in rows("magnet"):
            yield _of_drop(row, amb.name, 0.0, row.guess_sigma, a)
    if machine.ambs:
        yield _of_drop(parameter("remanence.time_constant", "drop"), "", math.log(2e-3))
    yield _of_drop(parameter("speed.aero_time_constant", "drop"), "", math.log(aero_time_constant(machine)))


def _of_drop(row: Parameter, owner: str, mean: float, sigma: float | None = None, index: int = 0) -> Unknown:
    return Unknown(
        parameter=row,
        owner=owner,
        mean=mean,
        sigma=row.guess_sigma if sigma is None else sigma,
        targets=tuple(Target(entry=entry, row=index) for entry in row.entries),
    )


def aero_time_constant(machine: Machine) -> float:
    """Time constant [s] of the aerodynamic deceleration to start from; 10 s when the machine does not say."""
    constant = machine.speed.aero_time_constant
    return 10.0 if constant is None else float(constant)


def all_unknowns(model: DropModel) -> tuple[Unknown, ...]:
    """Every unknown, machine first, then those of the drop."""
    of_bearings = (
        unknown
        for index in range(len(model.machine.touchdown_bearings))
        for unknown in bearing_unknowns(model, index)
    )
    return (*of_bearings, *drop_unknowns(model))
