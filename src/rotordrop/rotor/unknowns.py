"""The unknowns of a machine and a drop: rows of the parameter table bound to their owner, with priors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from operator import attrgetter
from typing import Any, Literal

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.air import PARAMETERS as AERO
from rotordrop.elements.contact import EXPONENT
from rotordrop.elements.magnet import REMANENCE, REMANENCE_TIME
from rotordrop.elements.parameter import (
    SMALLEST_GAP,
    Entry,
    Measure,
    Owner,
    Parameter,
    Rule,
    guess,
    parts_of,
)
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.support import TURNED_ANISOTROPY
from rotordrop.elements.table import row_of, rows, structure_rows
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.linear_algebra import solve
from rotordrop.rotor.parameters import DropModel

Scope = Literal["machine", "drop"]

LEAST_SHARE = 0.01
"""Share of the described value down to which one that is estimated by another number is followed [1]: rows of
balls without any preload carry a small load in another way (chosen, not measured)."""

CENTRED = 1e-6
"""Distance of value and middle of its range, in standard deviations, below which they are one [1]."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A kernel entry that an unknown sets: which, in which row, the factor on the value, what is added."""

    entry: Entry
    row: int
    factor: float = 1.0
    shift: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """One unknown parameter of a machine or a drop with its prior."""

    parameter: Parameter
    """Its row in the parameter table."""
    owner: str = ""
    """Name of the bearing or magnet, number of the unbalance, or nothing for a drop."""
    mean: float
    sigma: float
    """Prior mean and standard deviation, of the logarithm where the parameter is logarithmic."""
    targets: tuple[Target, ...]
    """Kernel entries it sets."""
    start: float | None = None
    """Where a search begins, in the measure of the mean: the value of the machine file."""
    calibrated: bool = False
    """Whether its prior is an estimate made before, not a guess."""
    published: Callable[[float], float] | None = None
    """The published value [SI] of the number that is estimated, where they differ: preload for the axial
    offset of the ball rows, anisotropy for its ratio to the one described."""
    common_variance: float = 0.0
    """Prior covariance with the same unknown of the other sensors of its group."""
    limits: tuple[float, float] | None = None
    """Bounds that depend on the machine, in the measure of the mean; those of the row when left out."""

    @property
    def path(self) -> str:
        """Path in the machine, such as ``"NDE.support.stiffness"``."""
        return self.parameter.path_of(self.owner)

    def sets(self, array: str, column: int | None = None, row: int | None = None) -> bool:
        """Whether it sets an entry of the kernel, in any column or row where none is named."""
        return any(
            one.entry.array == array and column in (None, one.entry.column) and row in (None, one.row)
            for one in self.targets
        )

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
        return "machine" if self.parameter.shared else "drop"

    @property
    def drift(self) -> float:
        """Random walk per square root of a second, in the measure it is estimated in."""
        row = self.parameter
        return row.drift if row.logarithmic else row.drift * abs(self.begin)

    @property
    def begin(self) -> float:
        """Where a search begins, in the measure it is estimated in."""
        return self.mean if self.start is None else self.start

    @property
    def bounds(self) -> tuple[float, float]:
        """Between what the model follows it, in the measure it is estimated in."""
        row = self.parameter
        if self.limits is not None:
            return self.limits
        if row.reach is not None:
            return self.mean - math.log(row.reach), self.mean + math.log(row.reach)
        if not row.logarithmic:
            return row.lower, row.upper
        return (math.log(row.lower) if row.lower > 0.0 else -math.inf), math.log(row.upper)

    def kernel_value(self, theta: float) -> float:
        """What is written into the kernel for an estimated number: within its bounds."""
        within = min(max(theta, self.bounds[0]), self.bounds[1])
        return math.exp(within) if self.logarithmic else within

    def value_of(self, theta: float) -> float:
        """Published SI value of an estimated number, within its bounds."""
        if self.published is None:
            return self.kernel_value(theta)
        return self.published(min(max(theta, self.bounds[0]), self.bounds[1]))

    def standard_error(self, theta: float, sigma: float) -> float:
        """Standard error of the published value for that of an estimated number."""
        if self.published is not None:
            half = NINETY * sigma
            return (self.published(theta + half) - self.published(theta - half)) / (2.0 * NINETY)
        return sigma * self.kernel_value(theta) if self.logarithmic else sigma


@dataclass(frozen=True, kw_only=True)
class Prior:
    """What is known of a parameter before a record is read, in the measure it is estimated in."""

    mean: float
    sigma: float
    """Normal distribution, of the logarithm where the parameter is logarithmic."""
    start: float
    """The value of the machine file, where a search begins."""


def prior(row: Parameter, quantity: Known, scale: float = 1.0, *, logarithmic: bool | None = None) -> Prior:
    """Prior of a parameter from what the machine file says of it; ``scale`` is what a row's deviations are
    shares of.

    A range, or the interval of an estimate, is the 90 % interval of the prior: its centre is the middle of
    the range (of its logarithms), wherever in it the guess lies. Without either, the value is the centre.
    """
    log = row.logarithmic if logarithmic is None else logarithmic
    value = float(quantity)
    start = math.log(value) if log else value
    known = quantity.interval_90 or quantity.range
    if known is not None and (known[0] > 0.0 or not log):
        low, high = (math.log(end) if log else end for end in known)
        sigma = max((high - low) / (2.0 * NINETY), row.least_sigma)
        middle = 0.5 * (low + high)
        centred = abs(middle - start) < CENTRED * sigma
        return Prior(mean=start if centred else middle, sigma=sigma, start=start)
    if known is not None and known[1] > value:
        # From zero on a logarithm has no lower limit; the upper one is left above by one in twenty.
        return Prior(mean=start, sigma=(math.log(known[1]) - start) / NINETY, start=start)
    if quantity.standard_error is not None:
        error = quantity.standard_error / value if log else quantity.standard_error
        return Prior(mean=start, sigma=max(error, row.least_sigma), start=start)
    usual = row.given_sigma if quantity.status == "given" else row.guess_sigma
    return Prior(mean=start, sigma=usual * (1.0 if log else scale), start=start)


def bearing_unknowns(model: DropModel, index: int) -> Iterator[Unknown]:
    """Unknown parameters of one touchdown bearing of a model.

    What the machine does not have, such as the preload of a bearing with clearance, is no unknown.
    """
    bearing = model.machine.touchdown_bearings[index]
    for row in rows("bearing"):
        if not row.entries or float(quantity := row.described(bearing)) == 0.0:
            continue
        if row.estimated_by is not None:
            if model.play_sigma(index) > 0.0:
                continue  # the preload of a race that is only held lightly is nobody's
            measure = row.estimated_by(bearing)
            known = _by_measure(row, quantity, measure)
            least = measure.of_value(LEAST_SHARE * float(quantity))
            limits = (least, math.inf) if least < measure.start else (-math.inf, least)
            yield _unknown(
                model, row, bearing.name, index, quantity, known, published=measure.value_of, limits=limits
            )
        elif row.ratio is not None:  # by its factor on the described ratio
            wider = TURNED_ANISOTROPY if bearing.support.has_guessed_axes else prior(row, quantity).sigma
            known = Prior(mean=0.0, sigma=wider, start=0.0)

            def at_ratio(theta: float, described: float = float(quantity)) -> float:
                return described * math.exp(theta)

            yield _unknown(model, row, bearing.name, index, quantity, known, published=at_ratio)
        else:
            known = prior(row, quantity, scale=float(quantity))
            yield _unknown(model, row, bearing.name, index, quantity, known)


def _unknown(
    model: DropModel, row: Parameter, owner: str, index: int, quantity: Known, known: Prior, **rest: Any
) -> Unknown:
    def factor(entry: Entry) -> float:
        if entry.array == "load":
            return model.machine.loads[index].unit[(L.LOAD_X, L.LOAD_Y).index(entry.column)]
        if entry.rule is Rule.RATIO:
            described = model.parameters.bearing[index, entry.column] if entry.array == "bearing" else 1.0
            return float(described) / float(quantity)
        if entry.rule is Rule.AT_TYPICAL_DEPTH:
            contact = model.machine.touchdown_bearings[index].contact
            return contact.typical_depth(float(np.mean(model.load_shares)))
        return 1.0

    def shift(entry: Entry) -> float:
        if (entry.array, entry.column) != ("bearing", L.AIR_GAP):
            return 0.0
        return float(model.parameters.bearing[index, L.AIR_GAP]) - float(quantity)  # play of a held race

    targets = tuple(Target(entry=e, row=index, factor=factor(e), shift=shift(e)) for e in row.entries)
    calibrated = quantity.status == "estimated"
    return Unknown(parameter=row, owner=owner, targets=targets, calibrated=calibrated, **vars(known), **rest)


def _by_measure(row: Parameter, quantity: Known, measure: Measure) -> Prior:
    """Prior of a parameter estimated by another number, on which the forces depend.

    The ends of the 90 % interval are those of the parameter; between them the prior is normal in the number.
    """
    known = prior(row, quantity, logarithmic=True)
    low, high = (measure.of_value(math.exp(known.mean + side * NINETY * known.sigma)) for side in (-1, 1))
    stated = quantity.interval_90 or quantity.range
    middle = measure.start if stated is None else 0.5 * (low + high)
    return Prior(mean=middle, sigma=(high - low) / (2.0 * NINETY), start=measure.start)


def sensor_prior(row: Parameter, quantity: Known, smallest_gap: float) -> Prior:
    """Prior of gain or offset of a sensor; an unknown offset is a share of the smallest air gap [m].

    The range of a default says what is thinkable, not usual.
    """
    if quantity.status == "default":
        quantity = replace(quantity, range=None)
    return prior(row, quantity, scale=smallest_gap if row.scale == SMALLEST_GAP else 1.0)


def smallest_gap(machine: Machine) -> float:
    """Smallest air gap of a machine as described [m]."""
    return min(float(bearing.air_gap) for bearing in machine.touchdown_bearings)


def weight_per_magnet(machine: Machine) -> float:
    """Weight of the rotor over the number of its magnet planes [N], by which remanent forces are measured."""
    return machine.rotor.mass * float(machine.gravity) / max(len(machine.ambs), 1)


def drop_unknowns(model: DropModel) -> Iterator[Unknown]:
    """Unknowns of one drop: unbalance against an unknown mark, remanent forces, aerodynamic constant."""
    machine = model.machine

    def of_drop(row: Parameter, owner: str, index: int, mean: float, sigma: float) -> Unknown:
        targets = tuple(Target(entry=entry, row=index) for entry in row.entries)
        return Unknown(parameter=row, owner=owner, mean=mean, sigma=sigma, targets=targets)

    for plane, unbalance in enumerate(machine.unbalances):
        for row in rows("unbalance"):
            yield of_drop(row, str(plane), plane, 0.0, max(float(unbalance.amount), 1e-9))
    share = weight_per_magnet(machine)
    for a, amb in enumerate(machine.ambs):
        of_magnet = () if amb.stays_on else rows("magnet")
        yield from (of_drop(row, amb.name, a, 0.0, row.guess_sigma * share) for row in of_magnet)
    yield from _held_magnets(model)
    if machine.ambs:
        described = machine.remanence_time_constant
        known = prior(REMANENCE, guess(REMANENCE_TIME) if described is None else described)
        yield of_drop(REMANENCE, "", 0, known.mean, known.sigma)
    for row in structure_rows("drop"):
        if (quantity := row.stated(machine)) is not None:
            yield _unknown(model, row, "", 0, quantity, prior(row, quantity))
    yield from _of_loads(model)
    yield from _from_mark(model)
    for row in AERO:
        yield of_drop(row, "", 0, math.log(aero_time_constant(machine)), row.guess_sigma)


def _of_loads(model: DropModel) -> Iterator[Unknown]:
    """Forces across the axis; those along it no sensor shows, and a course over time is as described."""
    weight = model.machine.rotor.mass * float(model.machine.gravity)
    for index, (name, load) in enumerate(parts_of(model.machine, "load")):
        for row in structure_rows("load"):
            if load.along is None and (force := row.stated(load)) is not None:
                yield _unknown(model, row, name, index, force, prior(row, force, weight))


def _from_mark(model: DropModel) -> Iterator[Unknown]:
    """What turns with the rotor at its bearings, against a mark of which no record says where it stands."""
    load = float(np.mean(model.load_shares))
    for index, (name, part) in enumerate(parts_of(model.machine, "bearing")):
        for row in structure_rows("bearing"):
            amount = attrgetter(row.amount)(part) if row.amount else None
            if amount is not None:
                limits = None if row.scaled is None else row.scaled(part, load)[1]
                known = Prior(mean=0.0, sigma=max(row.guess_sigma * float(amount), 1e-9), start=0.0)
                yield _unknown(model, row, name, index, amount, known, limits=limits)


def _held_magnets(model: DropModel) -> Iterator[Unknown]:
    """Unknowns of the magnets that stay on: their closed loop, and where they hold the rotor."""
    gap = smallest_gap(model.machine)
    for index, amb in enumerate(model.machine.ambs):
        for row in structure_rows("magnet") if amb.stays_on else ():
            loop = row.stated(amb)
            known = prior(row, guess(0.0) if loop is None else loop, gap)
            yield _unknown(model, row, amb.name, index, guess(known.start), known)


def aero_time_constant(machine: Machine) -> float:
    """Time constant [s] of the aerodynamic deceleration to start from; 10 s when the machine does not say."""
    constant = machine.speed.aero_time_constant
    return 10.0 if constant is None else float(constant)


def structure_unknowns(model: DropModel) -> Iterator[Unknown]:
    """Unknowns beyond the base model: those that the machine description names."""
    machine, load = model.machine, float(np.mean(model.load_shares))
    owners: tuple[Owner, ...] = ("bearing", "sensor", "rotor")
    for owner in owners:
        for index, (name, part) in enumerate(parts_of(machine, owner)):
            for row in structure_rows(owner):
                quantity = row.stated(part)
                if quantity is None or (row.logarithmic and not float(quantity)):
                    continue
                scale, limits = (1.0, None) if row.scaled is None else row.scaled(part, load)
                known = prior(row, quantity, scale=scale)
                one = _unknown(model, row, name, index, quantity, known, limits=limits)
                yield _in_common(one, machine, part) if owner == "sensor" and not one.calibrated else one


def _in_common(one: Unknown, machine: Machine, sensor: Sensor) -> Unknown:
    """The unknown of a sensor with what is known of it and the sensors of its group together."""
    row = one.parameter
    group = [s for s in machine.sensors if row.group == "machine" or s.node == sensor.node]
    alone, count = one.sigma**2, len([s for s in group if row.stated(s) is not None])
    # the mean of independent errors has a variance too, which is not counted twice
    common = row.common_sigma**2 - alone / count
    return replace(one, sigma=math.sqrt(alone + common), common_variance=common)


def all_unknowns(model: DropModel) -> tuple[Unknown, ...]:
    """Every unknown, machine first, then those of the drop."""
    bearings = range(len(model.machine.touchdown_bearings))
    of_bearings = chain.from_iterable(bearing_unknowns(model, index) for index in bearings)
    return (*of_bearings, *structure_unknowns(model), *drop_unknowns(model))


def file_path(path: str) -> str:
    """Where a file has a value: the horizontal support in place of its ratio to the vertical one."""
    row = row_of(path)
    return path.removesuffix(row.path) + row.file_path


def is_logarithmic(unknown: Unknown) -> bool:
    """Whether the logarithm of the value in the file is normal, or the value itself."""
    return unknown.logarithmic or unknown.published is not None


def is_of_a_bearing(unknown: Unknown) -> bool:
    """Whether it is a value of a touchdown bearing: these err together in a calibrated file."""
    return unknown.parameter.owner == "bearing" and unknown.parameter.shared


def slope_signs(unknowns: Sequence[Unknown], theta: Array, sigma: Array) -> Array:
    """Whether a value rises (1) or falls (-1) with its estimate: an axial offset falls as preload rises."""
    return np.array(
        [
            math.copysign(1.0, u.value_of(t + 0.1 * s) - u.value_of(t - 0.1 * s))
            for u, t, s in zip(unknowns, theta, sigma, strict=True)
        ]
    )


def file_of_fitted(model: DropModel, unknowns: Sequence[Unknown], exponents: Sequence[float]) -> Array:
    """What a change of each fitted value of bearings changes of those in the file, shape (n, n).

    ``exponents`` [SI] holds the value of each; only those of contact exponents are read.
    """
    places = {(unknown.owner, unknown.parameter.path): k for k, unknown in enumerate(unknowns)}
    bearings = {bearing.name: bearing for bearing in model.machine.touchdown_bearings}
    through, load = np.eye(len(unknowns)), float(np.mean(model.load_shares))
    for (owner, _), k in places.items():
        row, stiffness = unknowns[k].parameter, places.get((owner, "contact.stiffness"))
        slope = exponents[k] if is_logarithmic(unknowns[k]) else 1.0
        if row is EXPONENT and stiffness is not None:
            # the file's stiffness belongs to the fitted exponent: equal force at the typical indentation
            through[stiffness, k] = -slope * math.log(bearings[owner].contact.typical_depth(load))
        if row.ratio is not None and (owner, row.ratio[1]) in places:
            through[k, places[owner, row.ratio[1]]] = 1.0
    return through


def inferred_together(model: DropModel, unknowns: Sequence[Unknown], block: Array) -> None:
    """Let mass and inertia inferred from one size err together in a prior covariance (P, P).

    The error of the mass is part of that of the inertia.
    """
    places = {one.path: k for k, one in enumerate(unknowns)}
    for bearing in model.machine.touchdown_bearings:
        m, i = (places.get(f"{bearing.name}.race.{name}") for name in ("mass", "inertia"))
        inferred = bearing.race.mass.status == bearing.race.inertia.status == "inferred"
        if inferred and m is not None and i is not None and block[m, m] < block[i, i]:
            block[i, m] = block[m, i] = block[m, m]


def correlate(model: DropModel, unknowns: Sequence[Unknown], block: Array) -> None:
    """Let calibrated values err together in a prior covariance (P, P), as their machine file says.

    The variances stay: the file's intervals say them. A value that was changed since is no estimate any more
    and errs alone.
    """
    origin = model.machine.calibration
    if origin is None or origin.joint is None:
        return
    spread = origin.joint
    listed = [
        k for k, one in enumerate(unknowns) if is_of_a_bearing(one) and file_path(one.path) in spread.paths
    ]
    chosen = [unknowns[k] for k in listed]
    order = [spread.paths.index(file_path(one.path)) for one in chosen]
    theta, sigma = np.array([(one.begin, one.sigma) for one in chosen]).reshape(-1, 2).T
    through = file_of_fitted(model, chosen, [one.value_of(one.begin) for one in chosen])
    signs = slope_signs(chosen, theta, sigma)
    # the file's covariance is of the file's values; the fit holds others, such as a stiffness at one exponent
    half = solve(through, spread.matrix[np.ix_(order, order)])
    fitted = signs[:, None] * solve(through, half.T) * signs
    own = np.sqrt(np.diag(fitted))
    known = [i for i, one in enumerate(chosen) if one.calibrated and own[i] > 0.0]
    places = [listed[i] for i in known]
    variance = np.diag(block)[places]
    correlated = fitted[np.ix_(known, known)] * np.outer(
        np.sqrt(variance) / own[known], np.sqrt(variance) / own[known]
    )
    np.fill_diagonal(correlated, variance)
    block[np.ix_(places, places)] = correlated
