"""Active magnetic bearing planes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, Strict

from rotordrop.arrays import Array
from rotordrop.elements import values as V
from rotordrop.elements.description import Description, Misfit, Name, Placed
from rotordrop.elements.parameter import (
    SMALLEST_GAP,
    Entry,
    Extension,
    Parameter,
    Values,
    in_words,
    itself,
)
from rotordrop.elements.values import Damping, Stiffness, default, follows
from rotordrop.known import NINETY, Known
from rotordrop.physics import columns as L
from rotordrop.physics import magnet as law
from rotordrop.physics.magnet_loop import SampledController, sampled_pid
from rotordrop.units import format_quantity, percent

RIGID_FREQUENCY = 40.0
"""Rigid-body frequency [Hz] that the AMBs are taken to give the rotor when their stiffness is left out
(chosen)."""

DAMPING_RATIO = 0.3
"""Damping ratio [1] of that motion when the AMB damping is left out (chosen)."""

REMANENCE_TIME = 2e-3
"""Time in which the remanent force of a magnet decays, where nothing is known of it [s]."""


class Magnet(Description):
    """Coils and poles of one plane, each axis with a coil on either side, and their amplifiers."""

    turns: V.Positive
    """Turns of one coil [1]."""
    pole_area: V.Area
    """Area of one pole [m²]."""
    gap: V.PositiveLength
    """Gap between rotor and poles with the rotor in the middle [m]."""
    bias: V.Current
    """Bias current of every coil [A]."""
    angle: V.PoleAngle = default(math.radians(22.5), "eight poles")
    """Angle between a pole and the axis of its force [rad]."""
    resistance: V.Resistance
    """Resistance of one coil [ohm]."""
    voltage: V.Voltage
    """Largest voltage at a coil, either way [V]."""
    current_limit: V.Current = follows("the bias")
    """Largest control current, which is added to the bias of one coil and taken from the other [A]."""
    bandwidth: V.PositiveFrequency = default(1e3, "usual of amplifiers, chosen", (5e2, 3e3))
    """Bandwidth of the current loop of the amplifiers [Hz]."""

    def left_out(self) -> dict[str, Any]:
        """The control current may be as large as the bias."""
        if "current_limit" in self.model_fields_set:
            return {}
        return {"current_limit": Known(value=self.bias.value, status="default", source="the bias", unit="A")}

    @property
    def force(self) -> float:
        """Constant κ of the force of a coil [N m²/A²]."""
        return law.force_constant(self.turns.value, self.pole_area.value, self.angle.value)

    @property
    def inductance(self) -> float:
        """Inductance of one coil with the rotor in the middle [H]."""
        return law.coil_inductance(self.turns.value, self.pole_area.value, self.gap.value)

    @property
    def slopes(self) -> tuple[float, float]:
        """Force by current [N/A] and by displacement [N/m] with the rotor in the middle."""
        return law.negative_stiffness(self.force, self.gap.value, self.bias.value)

    def pull(self, x: float, control: float) -> float:
        """Force [N] of an axis at a displacement [m] with a control current [A]."""
        bias = self.bias.value
        plus, minus = max(bias + control, 0.0), max(bias - control, 0.0)
        return float(law.magnet_force(self.force, self.gap.value, x, plus, minus)[0])

    def fill(self, row: Array) -> None:
        """Write what the kernels read of it."""
        row[law.FORCE], row[law.GAP], row[law.BIAS] = self.force, self.gap.value, self.bias.value
        # the rest of the flux does not pass the gap in the direction of the force
        row[law.LEAKAGE] = self.inductance - 2.0 * self.force / self.gap.value
        row[law.RESISTANCE], row[law.VOLTAGE] = self.resistance.value, self.voltage.value
        row[law.CURRENT_LIMIT] = self.current_limit.value
        row[law.BANDWIDTH] = 2.0 * math.pi * self.bandwidth.value


_PID = ("proportional", "integral", "derivative", "filter", "anti_windup")
_MATRICES = ("a", "b", "c", "d")


class Controller(Description):
    """The controller of one plane, the same in x and y: sampled, held, delayed.

    Its input is the deviation of the rotor from the middle at the measured plane [m], its output a control
    current [A].
    """

    kind: Literal["pid", "state_space"] = Field(default="pid", description="the usual law")
    """Law: "pid", or "state_space" with matrices in discrete time, x ← a x + b e, u = c x + d e."""
    proportional: V.ProportionalGain | None = None
    """Proportional gain P [A/m]."""
    integral: V.IntegralGain = default(0.0, "no integral")
    """Integral gain I [A/(m s)]."""
    derivative: V.DerivativeGain = default(0.0, "no derivative")
    """Derivative gain D [A s/m]."""
    filter: V.PositiveFrequency = default(2500.0, "usual, chosen", (1e3, 5e3))
    """Frequency up to which the derivative acts [Hz]."""
    anti_windup: V.PositiveTime = default(0.01, "chosen", (1e-3, 0.1))
    """Time in which the integral follows an output at its limit [s]."""
    a: tuple[tuple[float, ...], ...] = ()
    """Matrix a of a state space, rows of numbers [1]."""
    b: tuple[float, ...] = ()
    """Column b [1]."""
    c: tuple[float, ...] = ()
    """Row c [A/m]."""
    d: float = 0.0
    """Direct gain d [A/m]."""
    sample_time: V.PositiveTime = default(1e-4, "usual, chosen", (2e-5, 2e-4))
    """Time between two samples [s]."""
    delay: V.Time = follows("one sample time")
    """Time from a sample until its output acts [s]."""
    sensor: str | None = None
    """Name of the sensor whose plane is measured; the plane of the AMB when left out."""
    output_limit: V.Current | None = None
    """Largest output [A]; that of the magnet when left out."""

    def check(self) -> None:
        """Refuse entries of the other law, matrices that do not fit, and more than can be on its way."""
        others = _MATRICES if self.kind == "pid" else _PID
        stray = [name for name in others if name in self.model_fields_set]
        if stray:
            raise Misfit(f"{stray[0]!r} does not belong to a controller of kind {self.kind!r}", (stray[0],))
        if self.kind == "pid" and self.proportional is None:
            raise Misfit(
                'a controller of kind "pid" needs a gain, such as proportional = "15 kA/m"', ("kind",)
            )
        n = len(self.a)
        if len(self.b) != n or len(self.c) != n or any(len(row) != n for row in self.a):
            raise Misfit(
                f"a has {n} rows, b {len(self.b)} and c {len(self.c)} entries; a must be square, and b and c "
                "have one entry for each of its rows",
                ("a",),
            )
        if n > law.MOST_STATES:
            raise Misfit(f"a has {n} states; {law.MOST_STATES} are the most", ("a",))
        longest = (law.MOST_PENDING - 1) * self.sample_time.value
        if "delay" in self.model_fields_set and self.delay.value > longest:
            shown = [format_quantity(one, "time") for one in (self.delay.value, longest)]
            raise Misfit(
                f"a delay of {shown[0]} is longer than {law.MOST_PENDING - 1} sample times, {shown[1]}",
                ("delay",),
            )

    def left_out(self) -> dict[str, Any]:
        """A delay of one sample time."""
        if "delay" in self.model_fields_set:
            return {}
        why = "one sample time"
        return {"delay": Known(value=self.sample_time.value, status="default", source=why, unit="s")}

    @property
    def gains(self) -> tuple[float, float, float]:
        """P [A/m], I [A/(m s)] and D [A s/m] of a PID."""
        assert self.proportional is not None
        return self.proportional.value, self.integral.value, self.derivative.value

    @property
    def sampled(self) -> SampledController:
        """The law in discrete time."""
        if self.kind == "pid":
            cutoff = 2.0 * math.pi * self.filter.value
            return sampled_pid(self.gains, cutoff, self.sample_time.value, self.anti_windup.value)
        n = len(self.a)
        step = np.array(self.a, dtype=np.float64).reshape(n, n)
        return SampledController(step, np.array(self.b), np.array(self.c), self.d, np.zeros(n))

    def fill(self, row: Array) -> None:
        """Write what the kernels read of it, behind its magnet."""
        sampled = self.sampled
        n = len(sampled.step)
        row[law.SAMPLE_TIME], row[law.DELAY] = self.sample_time.value, self.delay.value
        limit = self.output_limit
        row[law.OUTPUT_LIMIT] = row[law.CURRENT_LIMIT] if limit is None else limit.value
        row[law.ORDER], row[law.DIRECT] = n, sampled.direct
        for place, vector in (
            (law.INPUT, sampled.input),
            (law.OUTPUT, sampled.output),
            (law.UNWIND, sampled.unwind),
        ):
            row[place : place + n] = vector
        matrix = row[law.STEP : law.N_NUMBERS].reshape(law.MOST_STATES, law.MOST_STATES)
        matrix[:n, :n] = sampled.step


class ActiveMagneticBearing(Placed):
    """A radial active magnetic bearing, near its operating point."""

    name: Name
    """Name, of which no two are the same."""
    stiffness: Stiffness = follows("a rigid-body frequency of 40 Hz of the mass this AMB carries")
    """Stiffness of the closed loop [N/m]."""
    damping: Damping = follows("30 % of critical for the mass this AMB carries")
    """Damping of the closed loop [N s/m]."""
    integral_action: Annotated[bool, Strict()] = Field(
        default=True, description="The controller holds the rotor centred against gravity"
    )
    """Whether the controller holds the rotor centred against gravity."""
    stays_on: Annotated[bool, Strict()] = Field(
        default=False, description="It keeps holding when the others let go: a drop of one end"
    )
    """Whether it keeps holding when the others let go: a drop of one end."""
    magnet: Magnet | None = None
    """Its coils and poles, for a simulation of the control loop."""
    controller: Controller | None = None
    """Its controller, for a simulation of the control loop."""

    columns: ClassVar[Mapping[str, int]] = {
        "stiffness": L.AMB_STIFFNESS,
        "damping": L.AMB_DAMPING,
        "stays_on": L.AMB_STAYS,
    }

    def check(self) -> None:
        """Refuse a controller without a magnet, and one that does not hold its magnet."""
        super().check()
        if self.controller is None:
            return
        if self.magnet is None:
            raise Misfit(
                "a controller needs its magnet; give the table 'magnet', or leave the controller out",
                ("controller",),
            )
        by_current, by_way = self.magnet.slopes
        proportional = self.controller.proportional
        if proportional is not None and proportional.value * by_current <= by_way:
            shown = [
                format_quantity(one, "proportional_gain") for one in (proportional.value, by_way / by_current)
            ]
            raise Misfit(
                f"a proportional gain of {shown[0]} does not hold the rotor: it must be larger than k_s/k_i "
                f"of the magnet, {shown[1]}",
                ("controller", "proportional"),
            )

    @property
    def loop_is_given(self) -> bool:
        """Whether stiffness and damping were given, or follow from a given PID controller."""
        if self.controller is not None and self.controller.kind == "pid":
            return True
        return "default" not in (self.stiffness.status, self.damping.status)

    @property
    def further_states(self) -> Mapping[str, int]:
        """The currents of its four coils."""
        return {f"current {{}} {coil}": L.INTERNAL for coil in ("x+", "x-", "y+", "y-")}

    @property
    def remembered(self) -> int:
        """What its controllers of both axes hold between samples."""
        return law.N_MEMORY

    def fill_loop(self, row: Array) -> None:
        """Write the numbers of magnet and controller that the kernels read."""
        assert self.magnet is not None
        assert self.controller is not None
        self.magnet.fill(row)
        self.controller.fill(row)

    def completed(self, carried_mass: float) -> dict[str, Known]:
        """Values for a stiffness and damping that were left out, from the mass carried [kg]."""
        values: dict[str, Known] = {}
        stiffness = self.stiffness
        if self.magnet is not None and self.controller is not None and self.controller.kind == "pid":
            (by_current, by_way), (gain, _integral, derivative) = self.magnet.slopes, self.controller.gains
            followed = {"stiffness": by_current * gain - by_way, "damping": by_current * derivative}
            units = {"stiffness": "N/m", "damping": "N s/m"}
            why = "the gain of the controller and the magnet at its operating point"
            return {
                name: Known(value=value, status="default", source=why, unit=units[name])
                for name, value in followed.items()
                if name not in self.model_fields_set
            }
        if "stiffness" not in self.model_fields_set:
            value = carried_mass * (2.0 * math.pi * RIGID_FREQUENCY) ** 2
            why = f"{RIGID_FREQUENCY:g} Hz as a rigid body, equal shares of the mass, {carried_mass:.3g} kg"
            stiffness = Known(value=value, status="default", source=why, unit="N/m")
            values["stiffness"] = stiffness
        if "damping" not in self.model_fields_set:
            value = 2.0 * DAMPING_RATIO * math.sqrt(stiffness.value * carried_mass)
            why = f"{percent(DAMPING_RATIO)} of critical for an equal share, {carried_mass:.3g} kg"
            values["damping"] = Known(value=value, status="default", source=why, unit="N s/m")
        return values


class AxialMagneticBearing(Description):
    """An axial active magnetic bearing, near its operating point; it holds the rotor until the release."""

    name: Name
    """Name, of which no two are the same."""
    stiffness: Stiffness
    """Stiffness of the closed loop [N/m]."""
    damping: Damping
    """Damping of the closed loop [N s/m]."""


REMANENCE_SIGMA = 1.2
"""Standard deviation of the logarithm of the time in which a remanent force decays [1]."""

FORCES: tuple[Parameter, ...] = (
    *(
        Parameter(
            path=f"remanent_force.{axis}",
            owner="magnet",
            label=f"remanent force, {axis}",
            kind="force",
            logarithmic=False,
            guess_sigma=0.2,
            given_sigma=0.0,
            scale="weight a magnet carries",
            entries=(Entry(array="magnet", column=column),),
        )
        for column, axis in ((L.REMANENT_X, "x"), (L.REMANENT_Y, "y"))
    ),
)
"""Unknowns of a magnet, in every drop anew."""

LOOP_SIGMA = 0.5
"""Standard deviation of the logarithm of a stiffness or damping of the closed loop that is a guess [1]: nine
in ten within a factor of 2.3 (chosen; machine files have 40 Hz and 30 % where nothing is known)."""

GIVEN_LOOP_SIGMA = 0.15
"""The same of one that is given [1] (chosen): a loop is stiffer at one frequency than at another."""

STATED: tuple[Parameter, ...] = (
    *(
        Parameter(
            path=path,
            owner="magnet",
            label=f"magnet {path}",
            kind=path,
            guess_sigma=LOOP_SIGMA,
            given_sigma=GIVEN_LOOP_SIGMA,
            entries=(Entry(array="magnet", column=column),),
        )
        for path, column in (("stiffness", L.AMB_STIFFNESS), ("damping", L.AMB_DAMPING))
    ),
    *(
        Parameter(
            path=f"reference.{axis}",
            owner="magnet",
            label=f"place in which the magnet holds the rotor, {axis}",
            kind="length",
            logarithmic=False,
            guess_sigma=0.12,
            given_sigma=0.0,
            scale=SMALLEST_GAP,
            entries=(Entry(array="magnet", column=column),),
        )
        for axis, column in (("x", L.AMB_REFERENCE_X), ("y", L.AMB_REFERENCE_Y))
    ),
)
"""Unknowns of a magnet that stays on, in every drop anew."""

REMANENCE = Parameter(
    path="remanence.time_constant",
    owner="drop",
    label="time constant of the remanent force",
    kind="time",
    shown_as="duration",
    guess_sigma=0.4,
    given_sigma=0.0,
    entries=(Entry(array="spin", column=L.REMANENCE_TIME_CONSTANT),),
)
"""Unknown of all magnets together, in every drop anew."""


def _long(machine: Any) -> dict[str, Known]:
    if not machine.ambs:
        return {}
    reach = math.exp(NINETY * REMANENCE_SIGMA)
    long = (REMANENCE_TIME / reach, REMANENCE_TIME * reach)
    return {"remanence_time_constant": Known(value=REMANENCE_TIME, status="guess", range=long)}


def _decay(_machine: Any, found: Values, _load: float) -> str:
    time = itself(found["remanence.time_constant"])
    usual = f"the usual {1e3 * REMANENCE_TIME:g} ms"
    side = f"longer than {usual}" if time[1] > REMANENCE_TIME else f"shorter than {usual}"
    return f"the lift of the magnets decays in {in_words(time, 'ms', 1e-3)}, {side}"


EXTENSIONS: tuple[Extension, ...] = (
    Extension(
        name="long remanence",
        owner="drop",
        names=("remanence_time_constant",),
        neutral=_long,
        sentence=_decay,
    ),
)
