"""A vector of unknown parameters over the flat arrays of the drop model: set fast, from many threads."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.model import layout as L
from rotordrop.model.layout import KernelParameters
from rotordrop.model.parameters import DropModel
from rotordrop.tracking.unknowns import Unknown, bearing_unknowns

Array = NDArray[np.float64]

SUPPORT = ("support.stiffness", "support.mass", "support.damping")
FRICTION = "friction.dynamic"
NUISANCE = (
    "contact.stiffness",
    "contact.damping",
    FRICTION,
    "race.inertia",
    "damping_time",
    "axial_offset",
)
"""What the fit of the support takes from the machine file and marginalises: contact stiffness and λ,
friction, race inertia, bearing damping, preload (as the axial offset of the rows it sets)."""


@dataclass(frozen=True, kw_only=True)
class ParameterVector:
    """Unknown parameters in a fixed order; most are counted by their logarithm.

    Attributes
    ----------
    unknowns : tuple of Unknown
        The parameters with prior and the kernel entries they set.
    """

    unknowns: tuple[Unknown, ...]

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(unknown.path for unknown in self.unknowns)

    @property
    def mean(self) -> Array:
        """Prior mean, shape (P,)."""
        return np.array([unknown.mean for unknown in self.unknowns])

    @property
    def sigma(self) -> Array:
        """Prior standard deviation, shape (P,)."""
        return np.array([unknown.sigma for unknown in self.unknowns])

    def __len__(self) -> int:
        return len(self.unknowns)

    def place(self, path: str) -> int:
        """Index of a parameter."""
        return self.paths.index(path)

    def value(self, theta: Array, path: str) -> float:
        """SI value of a parameter."""
        place = self.place(path)
        return self.unknowns[place].value_of(float(theta[place]))

    def set(self, theta: Array, bearing: Array) -> None:
        """Write the values into rows of bearing parameters, shape (B, columns), in place."""
        for unknown, number in zip(self.unknowns, theta, strict=True):
            value = unknown.value_of(float(number))
            for _, row, column, factor in unknown.targets:
                bearing[row, column] = factor * value


def with_bearing(parameters: KernelParameters, bearing: Array) -> KernelParameters:
    """The same kernel parameters with other rows of bearings; the rotor radius follows the air gap."""
    bearing[:, L.ROTOR_RADIUS] = bearing[:, L.BORE_RADIUS] - bearing[:, L.AIR_GAP]
    return parameters._replace(bearing=bearing)


def support_vector(model: DropModel) -> ParameterVector:
    """Stiffness, mass and damping of every support."""
    return ParameterVector(unknowns=tuple(_chosen(model, SUPPORT)))


def nuisance_vector(model: DropModel) -> ParameterVector:
    """What is not sought but not known exactly either; friction is one unknown for all bearings."""
    chosen = list(_chosen(model, NUISANCE))
    frictions = [unknown for unknown in chosen if unknown.path.endswith(FRICTION)]
    others = [unknown for unknown in chosen if not unknown.path.endswith(FRICTION)]
    return ParameterVector(unknowns=(*others, _shared(frictions)))


def friction_vector(model: DropModel) -> ParameterVector:
    """Dynamic friction of all bearings as one unknown; the static one follows at its ratio."""
    return ParameterVector(unknowns=(_shared(list(_chosen(model, (FRICTION,)))),))


def joined(*vectors: ParameterVector) -> ParameterVector:
    """One vector after the other."""
    return ParameterVector(unknowns=tuple(unknown for vector in vectors for unknown in vector.unknowns))


def _chosen(model: DropModel, wanted: tuple[str, ...]) -> Iterable[Unknown]:
    for row, bearing in enumerate(model.machine.touchdown_bearings):
        for unknown in bearing_unknowns(bearing, row):
            if unknown.path.removeprefix(f"{bearing.name}.") in wanted:
                yield _resolved(model, unknown)


def _resolved(model: DropModel, unknown: Unknown) -> Unknown:
    """Bearing damping counts by its time constant: put the stiffness it multiplies in as factor."""
    targets = []
    for kind, row, column, factor in unknown.targets:
        if math.isnan(factor):
            factor = float(model.parameters.bearing[row, column]) / unknown.value_of(unknown.mean)
        targets.append((kind, row, column, factor))
    return _changed(unknown, targets=tuple(targets))


def _shared(unknowns: list[Unknown]) -> Unknown:
    first = unknowns[0]
    targets = tuple(target for unknown in unknowns for target in unknown.targets)
    return _changed(first, path=FRICTION, targets=targets)


def _changed(unknown: Unknown, **changes: object) -> Unknown:
    from dataclasses import replace

    return replace(unknown, **changes)  # type: ignore[arg-type]
