"""What of a coast-down is simulated: from which speed, until when, how finely, how accurately."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rotordrop.errors import SimulationError
from rotordrop.rotor.reduction import Reduction
from rotordrop.simulate.case import CentredStart, DropCase, IntegratorName, Start

FIRST_WINDOW = 0.2
"""End of the first window of statistics [s]: what the paper simulates (Neisi 2020, section 5.4)."""
WINDOW = 1.0
STOP_SPEED = 0.01
"""Below this speed [rad/s], one turn in ten minutes, the rotor counts as standing and sticks."""


@dataclass(frozen=True, kw_only=True)
class CoastDownCase:
    """One coast-down to simulate."""

    speed: float
    """Rotor speed at power-off [rad/s]; positive from x to y."""
    duration: float | None = None
    """Length of the simulation [s]; None: until the rotor stands still."""
    rest: float = 0.0
    """Time simulated after standstill [s], in which the rotor only rocks."""
    longest: float = 600.0
    """A rotor that has not stopped by then [s] ends the simulation."""
    output_step: float = 5e-5
    """Distance of the samples [s]; a whole number of them must fit into 0.2 s."""
    tolerance: float = 1e-6
    """Relative accuracy of one step of the integrator [1]."""
    reduction: str | Reduction = "quick"
    """Basis of the rotor; ignored when a ready model is simulated."""
    start: Start = field(default_factory=CentredStart)
    """How the drop starts."""
    stop_speed: float = STOP_SPEED
    """The rotor stops and sticks when it turns no faster than this [rad/s]."""
    integrator: IntegratorName = "tsit5"
    """Runge–Kutta pair."""
    largest_step: float = 1e-3
    """Bound of the step [s]."""
    settled_scheme: bool = True
    """Use the cheaper scheme once every bearing has been in contact for a whole second."""
    settled_error: float = 1e-9
    """Difference of displacement [m] from the Runge–Kutta pair over 2 ms above which it is given up."""

    def __post_init__(self) -> None:
        positive = ("longest", "output_step", "tolerance", "stop_speed", "largest_step", "settled_error")
        for name in positive + (() if self.duration is None else ("duration",)):
            value = getattr(self, name)
            if not value > 0.0 or not np.isfinite(value):
                raise SimulationError(
                    f"{name} is {value!r}; expected a positive, finite number. Give another value."
                )
        if not np.isfinite(self.rest) or self.rest < 0.0:
            raise SimulationError(f"rest is {self.rest!r} s; expected a finite time of zero or more.")
        if not np.isfinite(self.speed) or abs(self.speed) <= self.stop_speed:
            raise SimulationError(
                f"speed is {self.speed!r} rad/s; a coast-down starts above {self.stop_speed:g} rad/s. "
                "Give another speed."
            )
        per_window = FIRST_WINDOW / self.output_step
        if per_window < 1.0 or abs(per_window - round(per_window)) > 1e-6:
            raise SimulationError(
                f"output_step is {self.output_step:g} s; a whole number of steps must fit into "
                f"{FIRST_WINDOW:g} s. Choose 5e-5 s (20 kHz) or 1e-4 s (10 kHz), for example."
            )

    @property
    def last_time(self) -> float:
        """Time [s] at which the simulation ends at the latest, rest after standstill left out."""
        return self.longest if self.duration is None else self.duration

    def window_end(self, index: int) -> int:
        """Sample at which a window of statistics ends: 0.2 s, 1 s, 2 s, …"""
        return round((FIRST_WINDOW if index == 0 else index * WINDOW) / self.output_step)

    def as_drop(self) -> DropCase:
        """The same start as a drop, whose speed falls by drag as a function of speed."""
        return DropCase(
            speed=self.speed,
            output_step=self.output_step,
            tolerance=self.tolerance,
            reduction=self.reduction,
            start=self.start,
            spin="function of speed",
            integrator=self.integrator,
            largest_step=self.largest_step,
        )
