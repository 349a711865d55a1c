"""A vector of unknown parameters over the flat arrays of the drop model: set fast, from many threads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Role, Step
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import Unknown, bearing_unknowns

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ParameterVector:
    """Unknown parameters in a fixed order; most are counted by their logarithm."""

    unknowns: tuple[Unknown, ...]
    """The parameters with prior and the kernel entries they set."""

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

    @property
    def friction(self) -> int:
        """Index of the friction that the sweep finds, one for all bearings."""
        return next(k for k, unknown in enumerate(self.unknowns) if unknown.parameter.step is Step.SWEEP)

    def value(self, theta: Array, path: str) -> float:
        """SI value of a parameter."""
        place = self.place(path)
        return self.unknowns[place].value_of(float(theta[place]))

    def set(self, theta: Array, bearing: Array) -> None:
        """Write the values into rows of bearing parameters, shape (B, columns), in place."""
        for unknown, number in zip(self.unknowns, theta, strict=True):
            value = unknown.kernel_value(float(number))
            for target in unknown.targets:
                bearing[target.row, target.entry.column] = target.factor * value


def with_bearing(parameters: KernelParameters, bearing: Array) -> KernelParameters:
    """The same kernel parameters with other rows of bearings; the rotor radius follows the air gap."""
    bearing[:, L.ROTOR_RADIUS] = bearing[:, L.BORE_RADIUS] - bearing[:, L.AIR_GAP]
    return parameters._replace(bearing=bearing)


def support_vector(model: DropModel) -> ParameterVector:
    """What is sought in the first impacts: stiffness, mass and damping of every support."""
    return ParameterVector(unknowns=tuple(u for u in _of_impacts(model) if u.parameter.role is Role.SOUGHT))


def nuisance_vector(model: DropModel) -> ParameterVector:
    """What is not sought there but not known exactly either; friction is one unknown for all bearings."""
    others = (u for u in _of_impacts(model) if u.parameter.role is not Role.SOUGHT)
    frictions = [u for u in _unknowns(model) if u.parameter.step is Step.SWEEP]
    return ParameterVector(unknowns=(*others, _shared(frictions)))


def joined(*vectors: ParameterVector) -> ParameterVector:
    """One vector after the other."""
    return ParameterVector(unknowns=tuple(unknown for vector in vectors for unknown in vector.unknowns))


def _unknowns(model: DropModel) -> Iterator[Unknown]:
    for index in range(len(model.machine.touchdown_bearings)):
        yield from bearing_unknowns(model, index)


def _of_impacts(model: DropModel) -> Iterator[Unknown]:
    return (unknown for unknown in _unknowns(model) if unknown.parameter.step is Step.IMPACTS)


def _shared(unknowns: list[Unknown]) -> Unknown:
    targets = tuple(target for unknown in unknowns for target in unknown.targets)
    return replace(unknowns[0], owner="", targets=targets)
