"""What is simulated, of a drop and of a coast-down: speed, start, duration, accuracy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.elements.values import MOST_TURNS
from rotordrop.errors import SimulationError, UsageError
from rotordrop.require import each, numbers, require
from rotordrop.rotor.reduction import Reduction, reduction_of
from rotordrop.units import FASTEST_SPIN, InSI, parse_quantity

SpinMode: TypeAlias = Literal["dynamic", "prescribed", "function of speed", "coasting", "constant"]
IntegratorName: TypeAlias = Literal["tsit5", "dp5"]
MOST_OUTPUTS, LONGEST = 1e7, 3600.0
"""Steps of the output grid and length [s] of a drop that a memory holds (chosen)."""


@dataclass(frozen=True, kw_only=True)
class CentredStart:
    """The rotor starts straight, at rest and in the centre of all bearings."""


FARTHEST, FASTEST, STRONGEST = 0.02, 100.0, 1e7
"""Displacement [m], velocity [m/s] and force [N] at a start beyond which a unit is wrong (chosen)."""


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

    def __post_init__(self) -> None:
        for name, most in (("displacement", FARTHEST), ("velocity", FASTEST)):
            values = numbers(getattr(self, name), name, finite=True)
            if values.ndim != 2 or values.shape[1] != 2:
                raise UsageError(f"{name} has the shape {values.shape}; expected (bearings, 2)")
            largest = np.abs(values).max(initial=0.0)
            require(float(largest), f"the largest {name}", float, most=most)


@dataclass(frozen=True, kw_only=True)
class StateStart:
    """The drop starts from a complete state vector, shape (n,), in the order of the model's layout."""

    state: Array

    def __post_init__(self) -> None:
        numbers(self.state, "state", finite=True)


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

    def __post_init__(self) -> None:
        orbit = None if self.orbit is None else np.asarray(self.orbit)
        read = {"remanent_force": self.remanent_force, "offset": self.offset}
        read["orbit"] = None if orbit is None else np.stack([orbit.real, orbit.imag])
        for name, values in read.items():
            if values is not None:
                largest = np.abs(numbers(values, name, finite=True)).max(initial=0.0)
                require(float(largest), f"the largest {name}", float, most=STRONGEST)
        require(self.rotor_angle, "rotor_angle", float, least=-MOST_TURNS, most=MOST_TURNS)
        require(self.delay, "delay", float, least=0.0)
        require(self.remanence_time_constant, "remanence_time_constant", float, above=0.0)


MOST_UNBALANCE = 10.0
"""Unbalance that comes [kg m], beyond which a unit is mistyped (chosen): a blade of 20 kg at 0.5 m."""


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

    def __post_init__(self) -> None:
        require(self.node, "node", int, least=1)
        require(self.amount, "amount [kg m]", float, above=0.0, most=MOST_UNBALANCE)
        require(self.phase, "phase", float, least=-MOST_TURNS, most=MOST_TURNS)
        require(self.time, "time", float, least=0.0)


MagnetAction: TypeAlias = Literal["off", "levitate", "hold", "lost", "bias decays"]


REST_VELOCITY = 5e-3
"""Velocity [m/s] below which a rotor at its touchdown bearings counts as at rest; chosen, that of a fall of a
micrometre."""


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
        require(self.action, "action", str, among=get_args(MagnetAction))
        require(self.magnet, "magnet", str, none=True)
        require(self.axis, "axis", str, none=True, among=("x", "y"))
        for name in ("time", "below_speed", "rest_velocity"):
            require(getattr(self, name), name, float, none=True)
        stated = [one for one in (self.time, self.below_speed, self.rest_velocity) if one is not None]
        if len(stated) != 1 or not 0.0 <= stated[0] < np.inf:
            raise SimulationError(
                f"the magnets' event {self.action!r} has the moments {stated}; give one of time, below_speed "
                "and rest_velocity, not negative"
            )

    @classmethod
    def read(cls, text: str) -> MagnetEvent:
        """Read an event such as ``"20 ms: off"``.

        Examples
        --------
        >>> from rotordrop.simulate.case import MagnetEvent
        >>> str(MagnetEvent.read("10 ms: lost NDE x"))
        'lost NDE x'
        """
        when, _, what = (part.strip() for part in require(text, "event", str).partition(":"))
        actions: tuple[MagnetAction, ...] = get_args(MagnetAction)
        said = next((one for one in actions if what == one or what.startswith(f"{one} ")), None)
        where = what.removeprefix(said or "").split()
        axes: dict[str, Literal["x", "y"]] = {"x": "x", "y": "y"}
        axis = axes[where.pop()] if where and where[-1] in axes else None
        if said is None or len(where) > 1:
            raise UsageError(
                f"{text!r} is not 'WHEN: ACTION [MAGNET] [AXIS]' with an action out of {', '.join(actions)}; "
                "write for example '20 ms: off', 'speed 50 Hz: levitate', 'rest: levitate' or "
                "'0 s: lost NDE x'"
            )
        if when == "rest":
            moment = {"rest_velocity": REST_VELOCITY}
        elif when.startswith("speed "):
            moment = {"below_speed": parse_quantity(when.removeprefix("speed "), "speed")}
        else:
            moment = {"time": parse_quantity(when, "time")}
        return cls(action=said, magnet=where[0] if where else None, axis=axis, **moment)

    def __str__(self) -> str:
        """What happens, and where."""
        where = f" {self.magnet or 'all'}" if self.magnet or self.axis else ""
        return f"{self.action}{where}{f' {self.axis}' if self.axis else ''}"


Start: TypeAlias = CentredStart | PlacedStart | StateStart | LevitatedStart


COARSEST, FIXED_STEP = 1e-3, 1e-5
"""Tolerance [1] above which forces of impacts are no numbers any more: 0.1 gives meganewtons; bound of the
step [s] down to which it is asked for: below, the bound alone sets the step (both chosen)."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """What every simulation is told."""

    tolerance: float = 1e-6
    """Relative accuracy of one step of the integrator [1]."""
    start: Start = field(default_factory=CentredStart)
    """How the drop starts."""
    integrator: IntegratorName = "tsit5"
    """Runge–Kutta pair."""

    def _check(self, *positive: str) -> None:
        for name in (*positive, "largest_step"):
            step = require(getattr(self, name), name, float, above=0.0, error=SimulationError)
        coarsest = COARSEST if step > FIXED_STEP else np.inf
        require(self.tolerance, "tolerance", float, above=0.0, most=coarsest, error=SimulationError)
        require(self.integrator, "integrator", str, among=get_args(IntegratorName))
        require(self.start, "start", *get_args(Start))


@dataclass(frozen=True, kw_only=True)
class DropCase(Case):
    """One drop to simulate; speed and times are floats in SI units, or texts such as ``"60 Hz"``."""

    speed: InSI = InSI("speed")  # noqa: RUF009 - a descriptor, read by the dataclass
    """Rotor speed at power-off [rad/s]; positive from x to y."""
    duration: InSI = InSI("time", 0.2)  # noqa: RUF009
    """Length of the simulation [s]."""
    output_step: InSI = InSI("time", 1e-5)  # noqa: RUF009
    """Distance of the output grid [s]."""
    largest_step: InSI = InSI("time", 1e-3)  # noqa: RUF009
    """Bound of the step [s]."""
    reduction: str | Reduction = "accurate"
    """Basis of the rotor; ignored when a ready model is simulated."""
    spin: SpinMode = "dynamic"
    """What changes the speed: aerodynamic deceleration in time plus friction; the measured profile as it is,
    friction or not; drag as a function of speed plus friction; friction alone; nothing at all."""
    most_steps: int = 50_000_000
    """Bound of the number of steps [1]."""
    jump: UnbalanceJump | None = None
    """An unbalance that comes during the drop."""
    magnets: tuple[MagnetEvent, ...] | None = None
    """What magnets in the loop do and when; None: magnets are springs and dampers. A levitated start begins
    with controllers that hold the rotor, any other with dead coils."""

    def __post_init__(self) -> None:
        self._check("duration", "output_step")
        if not abs(self.speed) <= FASTEST_SPIN:
            raise SimulationError(
                f"speed is {self.speed!r} rad/s; expected a finite number up to {FASTEST_SPIN:g}."
            )
        require(self.spin, "spin", str, among=get_args(SpinMode))
        require(self.most_steps, "most_steps", int, least=1, most=10**12)
        require(self.jump, "jump", UnbalanceJump, none=True)
        reduction_of(self.reduction)
        if self.magnets is not None:
            each(self.magnets, "magnets", MagnetEvent)
        count = self.duration / self.output_step
        if not 1.0 - 1e-9 <= count <= MOST_OUTPUTS or self.duration > LONGEST:
            raise SimulationError(
                f"a duration of {self.duration:g} s in output steps of {self.output_step:g} s makes "
                f"{count:.3g} of them; expected 1 to {MOST_OUTPUTS:g}, and {LONGEST:g} s at most. Give "
                "others, or simulate a coast-down"
            )
        for event in self.magnets or ():
            require(event.time, "time of an event [s]", float, none=True, most=self.duration)
        start = self.start
        if self.magnets is None or not isinstance(start, LevitatedStart):
            return
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


FIRST_WINDOW = 0.2
"""End of the first window of statistics of a coast-down [s]: what the paper simulates (Neisi 2020, section
5.4)."""
WINDOW = 1.0
DAY, STOP_SPEED = 86_400.0, 0.01
"""Longest coast-down [s] (chosen); speed [rad/s], one turn in ten minutes, below which the rotor counts as
standing and sticks."""


@dataclass(frozen=True, kw_only=True)
class CoastDownCase(Case):
    """One coast-down to simulate: a drop in windows of statistics, until the rotor stands."""

    speed: InSI = InSI("speed")  # noqa: RUF009 - a descriptor, read by the dataclass
    """Rotor speed at power-off [rad/s]; positive from x to y; a float, or a text such as ``"60 Hz"``."""
    duration: float | None = None
    """Length of the simulation [s]; None: until the rotor stands still."""
    rest: float = 0.0
    """Time simulated after standstill [s], in which the rotor only rocks."""
    longest: float = 600.0
    """A rotor that has not stopped by then [s] ends the simulation."""
    output_step: float = 5e-5
    """Distance of the samples [s]; a whole number of them must fit into 0.2 s."""
    reduction: str | Reduction = "quick"
    """Basis of the rotor; ignored when a ready model is simulated."""
    largest_step: float = 1e-3
    """Bound of the step [s]."""
    stop_speed: float = STOP_SPEED
    """The rotor stops and sticks when it turns no faster than this [rad/s]."""
    settled_scheme: bool = True
    """Use the cheaper scheme once every bearing has been in contact for a whole second."""
    settled_error: float = 1e-9
    """Difference of displacement [m] from the Runge–Kutta pair over 2 ms above which it is given up."""
    spin: ClassVar[SpinMode] = "function of speed"
    magnets: ClassVar[None] = None

    def __post_init__(self) -> None:
        given = () if self.duration is None else ("duration",)
        self._check("longest", "output_step", "stop_speed", "settled_error", *given)
        reduction_of(self.reduction)
        require(self.rest, "rest", float, least=0.0, most=DAY, error=SimulationError)
        require(self.last_time, "longest or duration", float, most=DAY, error=SimulationError)
        require(self.settled_error, "settled_error", float, most=1e-6, error=SimulationError)
        require(self.settled_scheme, "settled_scheme", bool, error=SimulationError)
        if not self.stop_speed < abs(self.speed) <= FASTEST_SPIN:
            raise SimulationError(
                f"speed is {self.speed!r} rad/s; a coast-down starts above {self.stop_speed:g} rad/s and "
                f"below {FASTEST_SPIN:g}. Give another speed."
            )
        per_window = FIRST_WINDOW / self.output_step
        if not 1.0 <= per_window <= 1e5 or abs(per_window - round(per_window)) > 1e-6:
            raise SimulationError(
                f"output_step is {self.output_step:g} s; a whole number of steps, 1e5 at most, must fit into "
                f"{FIRST_WINDOW:g} s. Choose 5e-5 s (20 kHz) or 1e-4 s (10 kHz), for example."
            )

    @property
    def last_time(self) -> float:
        """Time [s] at which the simulation ends at the latest, rest after standstill left out."""
        return self.longest if self.duration is None else self.duration

    def window_end(self, index: int) -> int:
        """Sample at which a window of statistics ends: 0.2 s, 1 s, 2 s, …"""
        return round((FIRST_WINDOW if index == 0 else index * WINDOW) / self.output_step)


Simulated: TypeAlias = DropCase | CoastDownCase
