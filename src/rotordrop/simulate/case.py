"""What is simulated: speed, start, duration, accuracy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.errors import SimulationError
from rotordrop.rotor.reduction import Reduction
from rotordrop.units import InSI

SpinMode: TypeAlias = Literal["dynamic", "prescribed", "function of speed", "coasting", "constant"]
IntegratorName: TypeAlias = Literal["tsit5", "dp5"]


@dataclass(frozen=True, kw_only=True)
class CentredStart:
    """The rotor starts straight, at rest and in the centre of all bearings."""


@dataclass(frozen=True, kw_only=True)
class PlacedStart:
    """The rotor starts straight, from given positions and velocities at the first and last
    bearing's nodes.
    """

    displacement: Array
    """Rotor centre at the bearing nodes [m], (x, y); two bearings fix the line, more must lie on it, shape
    (B, 2)."""
    velocity: Array
    """Velocity there [m/s], shape (B, 2)."""


@dataclass(frozen=True, kw_only=True)
class StateStart:
    """The drop starts from a complete state vector, shape (n,), in the order of the model's layout."""

    state: Array


@dataclass(frozen=True, kw_only=True)
class LevitatedStart:
    """The rotor floats in its AMBs on a synchronous orbit and with its sag, then the power goes off."""

    rotor_angle: float = 0.0
    """Rotor angle at the power-off command [rad]."""
    delay: float = 0.0
    """Time the magnets keep holding after the command [s]."""
    remanent_force: Array | None = None
    """Force of each AMB left at the end of the delay [N], (x, y), shape (A, 2)."""
    remanence_time_constant: float = REMANENCE_TIME
    """Decay of that force [s]."""
    offset: Array | None = None
    """Position in which the controller holds the rotor at each AMB [m]; centre by default, shape (A, 2)."""
    orbit: NDArray[np.complex128] | None = None
    """Circular synchronous orbit at each AMB [m], ``x + jy`` at rotor angle zero, as a controller that
    follows the runout of its sensors makes it; by default the response to the unbalance alone, shape (A,)."""


@dataclass(frozen=True, kw_only=True)
class UnbalanceJump:
    """An unbalance that comes during the drop, as when a blade is lost."""

    node: int
    """Node, counted from 1."""
    amount: float
    """Amount [kg m]."""
    phase: float = 0.0
    """Phase, counted from +y at rotor angle zero [rad]."""
    time: float
    """When it comes [s], from power-off."""


MagnetAction: TypeAlias = Literal["off", "levitate", "hold", "lost", "bias decays"]


@dataclass(frozen=True, kw_only=True)
class MagnetEvent:
    """What magnets in the loop do from some moment on: a time, a speed, or when the rotor has come to rest.

    Events happen in their order, none before the one ahead of it.
    """

    action: MagnetAction
    """Amplifiers drive the coils empty; controllers hold the rotor, beginning anew; outputs stay as they are;
    nothing but the bias is left; the coils are short-circuited."""
    time: float | None = None
    """At this time [s] after the start."""
    below_speed: float | None = None
    """At the first sample when the rotor turns no faster than this [rad/s]."""
    rest_velocity: float | None = None
    """At the first sample when it has moved no faster than this [m/s] at its touchdown bearings for 20 ms."""
    magnet: str | None = None
    """Name of the AMB; all when left out."""
    axis: Literal["x", "y"] | None = None
    """Its axis; both when left out."""

    def __post_init__(self) -> None:
        stated = [one for one in (self.time, self.below_speed, self.rest_velocity) if one is not None]
        if len(stated) != 1 or not 0.0 <= stated[0] < np.inf:
            raise SimulationError(
                f"the magnets' event {self.action!r} has the moments {stated}; give one of time, below_speed "
                "and rest_velocity, not negative"
            )

    def __str__(self) -> str:
        """What happens, and where."""
        where = f" {self.magnet or 'all'}" if self.magnet or self.axis else ""
        return f"{self.action}{where}{f' {self.axis}' if self.axis else ''}"


Start: TypeAlias = CentredStart | PlacedStart | StateStart | LevitatedStart


@dataclass(frozen=True, kw_only=True)
class DropCase:
    """One drop to simulate; speed and times are floats in SI units, or texts such as ``"60 Hz"``."""

    speed: InSI = InSI("speed")  # noqa: RUF009 - a descriptor, read by the dataclass
    """Rotor speed at power-off [rad/s]; positive from x to y."""
    duration: InSI = InSI("time", 0.2)  # noqa: RUF009
    """Length of the simulation [s]."""
    output_step: InSI = InSI("time", 1e-5)  # noqa: RUF009
    """Distance of the output grid [s]."""
    tolerance: float = 1e-6
    """Relative accuracy of one step of the integrator [1]."""
    reduction: str | Reduction = "accurate"
    """Basis of the rotor; ignored when a ready model is simulated."""
    start: Start = field(default_factory=CentredStart)
    """How the drop starts."""
    spin: SpinMode = "dynamic"
    """What changes the speed: aerodynamic deceleration in time plus friction; the measured profile as it is,
    friction or not; drag as a function of speed plus friction; friction alone; nothing at all."""
    integrator: IntegratorName = "tsit5"
    """Runge–Kutta pair."""
    largest_step: InSI = InSI("time", 1e-3)  # noqa: RUF009
    """Bound of the step [s]."""
    most_steps: int = 50_000_000
    """Bound of the number of steps [1]."""
    jump: UnbalanceJump | None = None
    """An unbalance that comes during the drop."""
    magnets: tuple[MagnetEvent, ...] | None = None
    """What magnets in the loop do and when; None: magnets are springs and dampers. A levitated start begins
    with controllers that hold the rotor, any other with dead coils."""

    def __post_init__(self) -> None:
        for name in ("duration", "output_step", "tolerance", "largest_step"):
            value = getattr(self, name)
            if not value > 0.0 or not np.isfinite(value):
                raise SimulationError(
                    f"{name} is {value!r}; expected a positive, finite number. Give another value."
                )
        if self.magnets is not None and isinstance(self.start, LevitatedStart):
            self._check_loop(self.start)
        if not np.isfinite(self.speed):
            raise SimulationError(
                f"speed is {self.speed!r} rad/s; expected a finite number. Give another value."
            )

    def _check_loop(self, start: LevitatedStart) -> None:
        """Refuse what is said of magnets that are no springs and dampers."""
        if start.delay or start.remanent_force is not None or start.orbit is not None:
            raise SimulationError(
                "the levitated start has a delay, a remanent force or an orbit, and the magnets are in the "
                "loop, which has its own; leave them out and say when the magnets go off as an event"
            )

    @property
    def output_times(self) -> Array:
        """Output grid [s], shape (T,), from zero to the duration."""
        count = round(self.duration / self.output_step)
        return np.arange(count + 1, dtype=np.float64) * self.output_step
