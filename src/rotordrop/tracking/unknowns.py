"""What the tracked twin does not know: parameters estimated with the state, and their priors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import Estimated
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.model import layout as L
from rotordrop.model.parameters import DropModel
from rotordrop.physics.ball_bearing import BearingConstants, bearing_constants
from rotordrop.tracking import _propagation as P

Array = NDArray[np.float64]
Scope = Literal["machine", "drop"]
NINETY = 1.6448536269514722
"""Half width of a 90 % interval in standard deviations of a normal distribution [1]."""


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """One unknown parameter with its prior.

    Attributes
    ----------
    path : str
        Path in the machine, such as ``"NDE.support.stiffness"``, or a name for what belongs to a drop.
    mean, sigma : float
        Prior mean and standard deviation, of the logarithm when ``logarithmic``; SI unit.
    logarithmic : bool
        Whether the parameter is estimated by its logarithm (positive quantities).
    scope : {"machine", "drop"}
        Whether all drops of a machine share it.
    targets : tuple
        Kernel entries it sets: (kind, row, column, factor).
    calibrated : bool
        Whether its prior is an estimate made before, not a guess.
    """

    path: str
    mean: float
    sigma: float
    logarithmic: bool
    scope: Scope
    targets: tuple[tuple[int, int, int, float], ...]
    unit: str = ""
    calibrated: bool = False

    def value_of(self, theta: float) -> float:
        """SI value of an estimated number."""
        return math.exp(theta) if self.logarithmic else theta


RELATIVE_PRIOR: dict[str, tuple[float, float]] = {
    "support.stiffness": (0.5, 0.05),
    "support.mass": (0.4, 0.05),
    "support.damping": (0.7, 0.3),
    "contact.stiffness": (0.3, 0.3),
    "contact.damping": (0.6, 0.6),
    "friction.dynamic": (0.4, 0.4),
    "friction.stribeck_speed": (0.4, 0.4),
    "race.inertia": (0.12, 0.12),
    "race.drag_coefficient": (0.5, 0.5),
    "damping_time": (0.5, 0.5),
    "preload": (0.15, 0.15),
}
"""Prior standard deviation of the logarithm [1]: of a guess without a range, and of a given value."""

DRIFT: dict[str, float] = {
    "friction.dynamic": 1.0,
    "friction.stribeck_speed": 1.0,
    "race.drag_coefficient": 0.2,
    "contact.stiffness": 0.2,
    "support.stiffness": 0.02,
    "support.mass": 0.02,
    "support.damping": 0.1,
    "damping_time": 0.2,
    "race.inertia": 0.1,
    "air_gap": 8e-6,
}
"""Random walk of a parameter per square root of a second, most of its logarithm.

It keeps what the model gets wrong late in a drop from spoiling what the first impacts say."""

LATE_FACTOR = 5.0

FARTHEST: dict[str, float] = {
    "friction.dynamic": 3.0,
    "friction.stribeck_speed": 5.0,
    "race.drag_coefficient": 6.0,
    "race.inertia": 2.0,
}
"""Factor on its prior value up to which the model follows a parameter of friction and race spin [1].

Where nothing shows them they drift, and a race that is braked a thousand times harder is no race."""

GAP_SIGMA = 20e-6
EXPONENTS = (1.0, 2.0)
"""Contact exponents that the model follows at most [1]."""

EXPONENT_SIGMA = 0.1
"""Prior standard deviation of the logarithm of the contact exponent [1]: 10/9 for a line, 3/2 for a point."""

LEAST_EXPONENT_SIGMA = 0.01
"""The same of an exponent that was calibrated [1]: no drop says more of it."""

TYPICAL_FORCE = 1500.0
"""Contact force at whose indentation the stiffness keeps its meaning when the exponent differs [N]."""

ANISOTROPY_SIGMA = 0.03
REMANENT_SIGMA = 60.0


def relative_sigma(quantity: Estimated, path: str) -> float:
    """Prior standard deviation [1] of the logarithm of a quantity, from what the machine file says."""
    value = float(quantity)
    for interval in (quantity.interval_90, quantity.range):
        if interval is not None and interval[0] > 0.0:
            return max(math.log(interval[1] / interval[0]) / (2.0 * NINETY), 1e-4)
    if quantity.standard_error is not None and value > 0.0:
        return quantity.standard_error / value
    loose, given = RELATIVE_PRIOR[path]
    return given if quantity.status == "given" else loose


def _absolute_sigma(quantity: Estimated, default: float) -> float:
    for interval in (quantity.interval_90, quantity.range):
        if interval is not None:
            return max((interval[1] - interval[0]) / (2.0 * NINETY), 1e-12)
    return quantity.standard_error if quantity.standard_error is not None else default


def bearing_unknowns(bearing: TouchdownBearing, row: int) -> Iterator[Unknown]:
    """Unknown parameters of one touchdown bearing."""

    def relative(path: str, quantity: Estimated, *columns: tuple[int, float], unit: str) -> Unknown:
        return Unknown(
            path=f"{bearing.name}.{path}",
            mean=math.log(float(quantity)),
            sigma=relative_sigma(quantity, path),
            logarithmic=True,
            scope="machine",
            targets=tuple((P.ON_BEARING, row, column, factor) for column, factor in columns),
            unit=unit,
            calibrated=quantity.status == "estimated",
        )

    support, contact, friction, race = bearing.support, bearing.contact, bearing.friction, bearing.race
    yield Unknown(
        path=f"{bearing.name}.air_gap",
        mean=float(bearing.air_gap),
        sigma=_absolute_sigma(bearing.air_gap, GAP_SIGMA),
        logarithmic=False,
        scope="machine",
        targets=((P.ON_BEARING, row, L.AIR_GAP, 1.0),),
        unit="m",
        calibrated=bearing.air_gap.status == "estimated",
    )
    sideways = float(support.stiffness_horizontal) / float(support.stiffness)
    yield relative(
        "support.stiffness",
        support.stiffness,
        (L.SUPPORT_STIFFNESS_Y, 1.0),
        (L.SUPPORT_STIFFNESS_X, sideways),
        unit="N/m",
    )
    yield Unknown(
        path=f"{bearing.name}.support.anisotropy",
        mean=0.0,
        sigma=ANISOTROPY_SIGMA,
        logarithmic=True,
        scope="machine",
        targets=((P.SCALE_BEARING, row, L.SUPPORT_STIFFNESS_X, 1.0),),
        unit="1",
    )
    yield relative(
        "support.mass",
        support.mass,
        (L.SUPPORT_MASS_Y, 1.0),
        (L.SUPPORT_MASS_X, float(support.mass_horizontal) / float(support.mass)),
        unit="kg",
    )
    yield relative(
        "support.damping",
        support.damping,
        (L.SUPPORT_DAMPING_Y, 1.0),
        (L.SUPPORT_DAMPING_X, float(support.damping_horizontal) / float(support.damping)),
        unit="N s/m",
    )
    yield relative("contact.stiffness", contact.stiffness, (L.CONTACT_STIFFNESS, 1.0), unit="N/m^n")
    yield _exponent(bearing, row)
    yield relative("contact.damping", contact.damping, (L.CONTACT_DAMPING, 1.0), unit="s/m")
    yield relative(
        "friction.dynamic",
        friction.dynamic,
        (L.FRICTION_DYNAMIC, 1.0),
        (L.FRICTION_STATIC, float(friction.static) / float(friction.dynamic)),
        unit="1",
    )
    yield relative("friction.stribeck_speed", friction.stribeck_speed, (L.STRIBECK_SPEED, 1.0), unit="m/s")
    yield relative("race.inertia", race.inertia, (L.RACE_INERTIA, 1.0), unit="kg m^2")
    yield relative("race.drag_coefficient", race.drag_coefficient, (L.DRAG_COEFFICIENT, 1.0), unit="1")
    yield _bearing_damping(bearing, row)
    yield _axial_offset(bearing, row)


def typical_depth(bearing: TouchdownBearing) -> float:
    """Indentation at the typical contact force [m]."""
    contact = bearing.contact
    return float((TYPICAL_FORCE / float(contact.stiffness)) ** (1.0 / float(contact.exponent)))


def _exponent(bearing: TouchdownBearing, row: int) -> Unknown:
    """Contact exponent; the stiffness is that of the prior exponent at a typical indentation.

    An exponent alone would change the force a hundredfold, and the stiffness would have to follow it.
    """
    quantity = bearing.contact.exponent
    known = quantity.interval_90 or quantity.range
    return Unknown(
        path=f"{bearing.name}.contact.exponent",
        mean=math.log(float(quantity)),
        sigma=EXPONENT_SIGMA if known is None else _known_sigma(known),
        logarithmic=True,
        scope="machine",
        targets=(
            (P.ON_BEARING, row, L.CONTACT_EXPONENT, 1.0),
            (P.AT_TYPICAL_DEPTH, row, L.CONTACT_STIFFNESS, typical_depth(bearing)),
        ),
        unit="1",
        calibrated=quantity.status == "estimated",
    )


def _known_sigma(interval: tuple[float, float]) -> float:
    """Prior standard deviation [1] of the logarithm; an interval that ends at a bound may have no width."""
    return max(math.log(interval[1] / interval[0]) / (2.0 * NINETY), LEAST_EXPONENT_SIGMA)


def _bearing_damping(bearing: TouchdownBearing, row: int) -> Unknown:
    """Bearing damping by its time constant C_b/K_b, with K_b at the static load."""
    return Unknown(
        path=f"{bearing.name}.damping_time",
        mean=math.log(float(bearing.damping_time)),
        sigma=relative_sigma(bearing.damping_time, "damping_time"),
        logarithmic=True,
        scope="machine",
        targets=((P.ON_BEARING, row, L.BEARING_DAMPING, math.nan),),
        unit="s",
        calibrated=bearing.damping_time.status == "estimated",
    )


def _axial_offset(bearing: TouchdownBearing, row: int) -> Unknown:
    """Preload, estimated by the axial offset of the rows, which is what the ball forces depend on."""
    constants = bearing_constants(bearing.bearing)
    preload = float(bearing.bearing.preload)
    spread = relative_sigma(bearing.bearing.preload, "preload")
    step = 1e-4
    slope = (
        preload_of_offset(constants, constants.axial_offset * (1 + step))
        - preload_of_offset(constants, constants.axial_offset * (1 - step))
    ) / (2 * step * constants.axial_offset)
    return Unknown(
        path=f"{bearing.name}.axial_offset",
        mean=constants.axial_offset,
        sigma=preload * spread / slope,
        logarithmic=False,
        scope="machine",
        targets=((P.ON_BEARING, row, L.AXIAL_OFFSET, 1.0),),
        unit="m",
        calibrated=bearing.bearing.preload.status == "estimated",
    )


def preload_of_offset(constants: BearingConstants, axial_offset: float) -> float:
    """Axial force of one row [N] whose grooves are offset by a distance [m] with the race centred."""
    distance = math.hypot(constants.radial_offset, axial_offset)
    approach = max(distance - constants.groove_distance, 0.0)
    load = constants.ball_stiffness * approach**1.5
    return float(len(constants.ball_angles) * load * axial_offset / distance)


def drift_of(unknown: Unknown) -> float:
    """Random walk of an unknown per square root of a second, in the unit it is estimated in."""
    for ending, drift in DRIFT.items():
        if unknown.path.endswith(ending):
            return drift
    return 0.0


def bounds(unknown: Unknown) -> tuple[float, float]:
    """Between what the model follows an unknown, in the unit it is estimated in."""
    if unknown.path.endswith("contact.exponent"):
        return math.log(EXPONENTS[0]), math.log(EXPONENTS[1])
    for ending, factor in FARTHEST.items():
        if unknown.path.endswith(ending):
            return unknown.mean - math.log(factor), unknown.mean + math.log(factor)
    return -math.inf, math.inf


def late_factor(unknown: Unknown) -> float:
    """Factor on the drift late in a drop [1], when creep decides between rotor and race."""
    late = ("friction.dynamic", "friction.stribeck_speed", "race.inertia")
    return LATE_FACTOR if unknown.path.endswith(late) else 1.0


def drop_unknowns(model: DropModel) -> Iterator[Unknown]:
    """Unknowns of one drop: unbalance against an unknown mark, remanent forces, aerodynamic constant."""
    machine = model.machine
    for plane, unbalance in enumerate(machine.unbalances):
        for column, part in enumerate(("cosine", "sine")):
            yield Unknown(
                path=f"unbalance.{plane}.{part}",
                mean=0.0,
                sigma=max(float(unbalance.amount), 1e-9),
                logarithmic=False,
                scope="drop",
                targets=((P.ON_UNBALANCE, plane, column, 1.0),),
                unit="kg m",
            )
    for a, amb in enumerate(machine.ambs):
        for column, axis in ((L.REMANENT_X, "x"), (L.REMANENT_Y, "y")):
            yield Unknown(
                path=f"{amb.name}.remanent_force.{axis}",
                mean=0.0,
                sigma=REMANENT_SIGMA,
                logarithmic=False,
                scope="drop",
                targets=((P.ON_MAGNET, a, column, 1.0),),
                unit="N",
            )
    if machine.ambs:
        yield _positive("remanence.time_constant", 2e-3, 0.4, L.REMANENCE_TIME_CONSTANT, "s")
    yield _positive("speed.aero_time_constant", aero_time_constant(machine), 0.7, L.AERO_TIME_CONSTANT, "s")


def _positive(path: str, value: float, sigma: float, entry: int, unit: str) -> Unknown:
    return Unknown(
        path=path,
        mean=math.log(value),
        sigma=sigma,
        logarithmic=True,
        scope="drop",
        targets=((P.ON_SPIN, 0, entry, 1.0),),
        unit=unit,
    )


def aero_time_constant(machine: Machine) -> float:
    """Time constant [s] of the aerodynamic deceleration to start from; 10 s when the machine does not say."""
    constant = machine.speed.aero_time_constant
    return 10.0 if constant is None else float(constant)


def all_unknowns(model: DropModel) -> tuple[Unknown, ...]:
    """Every unknown, machine first, then those of the drop."""
    found: list[Unknown] = []
    for row, bearing in enumerate(model.machine.touchdown_bearings):
        found.extend(bearing_unknowns(bearing, row))
    found.extend(drop_unknowns(model))
    return tuple(found)


def parameter_targets(model: DropModel, unknowns: tuple[Unknown, ...]) -> P.ParameterTargets:
    """Flat table of what the unknowns set in the kernel, in the order given."""
    rows, factors = [], []
    for index, unknown in enumerate(unknowns):
        for kind, row, column, factor in unknown.targets:
            rows.append((index, kind, row, column))
            factors.append(_stiffness_of_damping(model, unknown, row) if math.isnan(factor) else factor)
    order = sorted(range(len(rows)), key=lambda i: rows[i][1] in (P.SCALE_BEARING, P.AT_TYPICAL_DEPTH))
    planes = [model.basis.node_row(unbalance.node) for unbalance in model.machine.unbalances]
    shape = np.array(planes) if planes else np.zeros((0, model.layout.n_modes))
    return P.ParameterTargets(
        target=np.array([rows[i] for i in order], dtype=np.int64).reshape(-1, 4),
        factor=np.array([factors[i] for i in order]),
        logarithmic=np.array([int(u.logarithmic) for u in unknowns], dtype=np.int64),
        drift=np.array([drift_of(u) for u in unknowns]),
        late_drift=np.array([drift_of(u) * late_factor(u) for u in unknowns]),
        step=np.array([1e-5 if u.logarithmic else max(1e-3 * u.sigma, 1e-12) for u in unknowns]),
        plane_shape=np.ascontiguousarray(shape),
        lower=np.array([bounds(u)[0] for u in unknowns]),
        upper=np.array([bounds(u)[1] for u in unknowns]),
        mean=np.array([u.mean for u in unknowns]),
    )


def _stiffness_of_damping(model: DropModel, unknown: Unknown, row: int) -> float:
    return float(model.parameters.bearing[row, L.BEARING_DAMPING] / math.exp(unknown.mean))
