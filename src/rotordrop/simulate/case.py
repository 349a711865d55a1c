"""What is simulated: speed, start, duration, accuracy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.errors import SimulationError
from rotordrop.rotor.reduction import Reduction
from rotordrop.units import InSI

Array = NDArray[np.float64]
SpinMode: TypeAlias = Literal["dynamic", "prescribed", "function of speed", "coasting", "constant"]
IntegratorName: TypeAlias = Literal["tsit5", "dp5"]


@dataclass(frozen=True, kw_only=True)
class CentredStart:
    """The rotor starts straight, at rest and in the centre of all bearings."""


@dataclass(frozen=True, kw_only=True)
class PlacedStart:
    """The rotor starts straight, from given positions and velocities at the first and last bearing's nodes.

    Attributes
    ----------
    displacement : ndarray, shape (B, 2)
        Rotor centre at the bearing nodes [m], (x, y); two bearings fix the line, more must lie on it.
    velocity : ndarray, shape (B, 2)
        Velocity there [m/s].
    """

    displacement: Array
    velocity: Array


@dataclass(frozen=True, kw_only=True)
class StateStart:
    """The drop starts from a complete state vector, shape (n,), in the order of the model's layout."""

    state: Array


@dataclass(frozen=True, kw_only=True)
class LevitatedStart:
    """The rotor floats in its AMBs on a synchronous orbit and with its sag, then the power goes off.

    Attributes
    ----------
    rotor_angle : float
        Rotor angle at the power-off command [rad].
    delay : float
        Time the magnets keep holding after the command [s].
    remanent_force : ndarray, shape (A, 2), optional
        Force of each AMB left at the end of the delay [N], (x, y).
    remanence_time_constant : float
        Decay of that force [s].
    offset : ndarray, shape (A, 2), optional
        Position in which the controller holds the rotor at each AMB [m]; centre by default.
    orbit : ndarray of complex, shape (A,), optional
        Circular synchronous orbit at each AMB [m], ``x + jy`` at rotor angle zero, as a controller that
        follows the runout of its sensors makes it; by default the response to the unbalance alone.
    """

    rotor_angle: float = 0.0
    delay: float = 0.0
    remanent_force: Array | None = None
    remanence_time_constant: float = REMANENCE_TIME
    offset: Array | None = None
    orbit: NDArray[np.complex128] | None = None


Start: TypeAlias = CentredStart | PlacedStart | StateStart | LevitatedStart


@dataclass(frozen=True, kw_only=True)
class DropCase:
    """One drop to simulate; speed and times are floats in SI units, or texts such as ``"60 Hz"``.

    Attributes
    ----------
    speed : float
        Rotor speed at power-off [rad/s]; positive from x to y.
    duration : float
        Length of the simulation [s].
    output_step : float
        Distance of the output grid [s].
    tolerance : float
        Relative accuracy of one step of the integrator [1].
    reduction : str or Reduction
        Basis of the rotor; ignored when a ready model is simulated.
    start : Start
        How the drop starts.
    spin : {"dynamic", "prescribed", "function of speed", "coasting", "constant"}
        What changes the speed: aerodynamic deceleration in time plus friction; the measured profile as it is,
        friction or not; drag as a function of speed plus friction; friction alone; nothing at all.
    integrator : {"tsit5", "dp5"}
        Runge–Kutta pair.
    largest_step : float
        Bound of the step [s].
    most_steps : int
        Bound of the number of steps [1].
    """

    speed: InSI = InSI("speed")  # noqa: RUF009 - a descriptor, read by the dataclass
    duration: InSI = InSI("time", 0.2)  # noqa: RUF009
    output_step: InSI = InSI("time", 1e-5)  # noqa: RUF009
    tolerance: float = 1e-6
    reduction: str | Reduction = "accurate"
    start: Start = field(default_factory=CentredStart)
    spin: SpinMode = "dynamic"
    integrator: IntegratorName = "tsit5"
    largest_step: InSI = InSI("time", 1e-3)  # noqa: RUF009
    most_steps: int = 50_000_000

    def __post_init__(self) -> None:
        for name in ("duration", "output_step", "tolerance", "largest_step"):
            value = getattr(self, name)
            if not value > 0.0 or not np.isfinite(value):
                raise SimulationError(
                    f"{name} is {value!r}; expected a positive, finite number. Give another value."
                )
        if not np.isfinite(self.speed):
            raise SimulationError(
                f"speed is {self.speed!r} rad/s; expected a finite number. Give another value."
            )

    @property
    def output_times(self) -> Array:
        """Output grid [s], shape (T,), from zero to the duration."""
        count = round(self.duration / self.output_step)
        return np.arange(count + 1, dtype=np.float64) * self.output_step
