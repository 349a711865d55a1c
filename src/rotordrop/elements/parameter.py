"""What a row of the parameter table says of a parameter, and what is said of a load."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from enum import Enum
from typing import Literal

from rotordrop.elements.rotor import Rotor
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.known import Known
from rotordrop.units import si_unit

Owner = Literal["bearing", "sensor", "unbalance", "magnet", "drop", "rotor"]


class Role(Enum):
    """What the identification does with a parameter.

    Nuisances are fitted beside what is sought; considered ones keep their prior in the replay. The errors of
    both enter the intervals.
    """

    SOUGHT = "sought"
    NUISANCE = "nuisance"
    CONSIDERED = "considered"
    DERIVED = "follows from other parameters"


class Step(Enum):
    """Step of the replay that finds a parameter (Neisi 2020, Fig. 4)."""

    TAIL = "settled tail"
    FIRST_CONTACT = "first contact"
    IMPACTS = "first impacts"
    SWEEP = "friction sweep"
    NONE = "tracked twin only"


class Rule(Enum):
    """How a parameter sets an entry of the kernel."""

    VALUE = "the value itself"
    RATIO = "value times the ratio that entry and value have in the machine description"
    SCALE = "the entry times the value, after all others"
    AT_TYPICAL_DEPTH = "the entry changed so that the force at a typical indentation stays, after all others"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """An entry of the kernel that a parameter sets: array of `KernelParameters`, column, and how."""

    array: Literal["bearing", "unbalance", "magnet", "spin", "modes"]
    column: int
    rule: Rule = Rule.VALUE


@dataclass(frozen=True, kw_only=True, eq=False)
class Parameter:
    """One row of the table.

    Attributes
    ----------
    path : str
        Path below its owner, such as ``"support.stiffness"`` of a touchdown bearing.
    owner : {"bearing", "sensor", "unbalance", "magnet", "drop", "rotor"}
        What has such a parameter; all drops share those of bearings and sensors.
    label : str
        Name for people.
    kind : str
        Kind of quantity, a key of `rotordrop.units.KINDS`.
    shown_as : str
        Kind a report shows it as; the same when empty.
    logarithmic : bool
        Whether it is estimated by its logarithm (positive quantities).
    role : Role
        What the identification does with it.
    guess_sigma, given_sigma : float
        Prior standard deviation of a guess without a range and of a given value: of the logarithm, or as a
        share of ``scale`` [1].
    scale : str
        What it is a share of, where it is not that of a logarithm.
    least_sigma : float
        Prior standard deviation that an interval in the machine file cannot go below.
    lower, upper : float, optional
        Limits between which the model follows it [SI unit].
    reach : float, optional
        Factor on its prior value up to which the model follows it [1]: what no record shows drifts, and a
        race that is braked a thousand times harder is no race.
    drift : float
        Random walk per square root of a second, in the measure or share of the prior. It keeps what the model
        gets wrong late in a drop from spoiling what the first impacts say.
    late_drift_factor : float
        Factor on the drift late in a drop [1], when creep decides between rotor and race.
    entries : tuple of Entry
        Kernel entries it sets; empty where it is no parameter of the drop model.
    step : Step
        Step of the replay that finds it.
    decisive, leading : bool
        Whether the fit of the first impacts tells minima apart by it; whether the first window shows it.
    spin_up_only : bool
        Whether it only says when a race catches up with the rotor: it may go far without moving a force.
    field : str
        Field of the JSON document, unit included.
    truth : tuple of str
        Where a truth file has it: a field with a number or one number per bearing, or a list of bearings and
        a key.
    taken_over : {"needed", "welcome", "no"}
        Whether an earlier estimate must have, or may have, it to stand for the identification.
    common_sigma : float
        For a value of each sensor: prior standard deviation of what the sensors of a group have in common,
        where it differs from that of one of them.
    group : {"plane", "machine"}
        Sensors that have it in common.
    measured_by : str
        What measurement would make it known, with ``{owner}`` for what has it; empty where none is usual.
    separated_by : dict
        What measurement would tell it from another parameter, by the path of the other.
    """

    path: str
    owner: Owner = "bearing"
    label: str
    kind: str
    shown_as: str = ""
    logarithmic: bool = True
    role: Role = Role.NUISANCE
    guess_sigma: float = 0.0
    given_sigma: float = 0.0
    scale: str = ""
    least_sigma: float = 1e-4
    lower: float | None = None
    upper: float | None = None
    reach: float | None = None
    drift: float = 0.0
    late_drift_factor: float = 1.0
    entries: tuple[Entry, ...] = ()
    step: Step = Step.NONE
    decisive: bool = False
    leading: bool = False
    spin_up_only: bool = False
    field: str = ""
    truth: tuple[str, ...] = ()
    taken_over: Literal["needed", "welcome", "no"] = "no"
    common_sigma: float = 0.0
    group: Literal["plane", "machine"] = "machine"
    measured_by: str = ""
    separated_by: dict[str, str] = dataclasses.field(default_factory=dict)

    @property
    def unit(self) -> str:
        """SI unit; ``"1"`` for a pure number."""
        return si_unit(self.kind) or "1"

    @property
    def display_kind(self) -> str:
        """Kind a report shows it as."""
        return self.shown_as or self.kind

    def path_of(self, owner: str) -> str:
        """Path in the machine: ``"NDE.support.stiffness"``, ``"sensors.X1.gain"``, ``"unbalance.0.sine"``."""
        if self.owner == "rotor":
            return f"rotor.{self.path}"
        group = {"sensor": "sensors.", "unbalance": "unbalance."}.get(self.owner, "")
        return f"{group}{owner}.{self.path}" if owner else self.path

    def within(self, value: float) -> float:
        """The value, or the limit of the model it lies beyond."""
        lowest = -math.inf if self.lower is None else self.lower
        return min(max(value, lowest), math.inf if self.upper is None else self.upper)

    def stated(self, part: TouchdownBearing | Sensor | Rotor) -> Known | None:
        """The value as the description has it; None where it leaves it out."""
        value: object = part
        for name in self.path.split("."):
            value = getattr(value, name)
        return value if isinstance(value, Known) else None

    def described(self, part: TouchdownBearing | Sensor) -> Known:
        """The value as the machine description has it, of a bearing or a sensor."""
        if self.path == "support.anisotropy":
            assert isinstance(part, TouchdownBearing)
            support = part.support
            ratio = float(support.stiffness_horizontal) / float(support.stiffness)
            return Known(value=ratio, status="default")
        value: object = part
        if self.path == "preload":
            assert isinstance(part, TouchdownBearing)
            return getattr(part.bearing, "preload", NO_PRELOAD)
        for name in self.path.split("."):
            value = getattr(value, name)
        assert isinstance(value, Known)
        return value


NO_PRELOAD = Known(value=0.0, status="default", source="this kind of bearing has none", unit="N")
"""What a bearing without rows to press against each other has: no unknown."""


@dataclass(frozen=True, kw_only=True)
class Load:
    """A force or stress of one bearing that every estimate gives beside the parameters.

    Attributes
    ----------
    field : str
        Field of the JSON document, unit included.
    label : str
        Name for people.
    kind : str
        Kind of quantity, a key of `rotordrop.units.KINDS`.
    truth : str
        Field of a truth file.
    truth_unit : float
        SI value of one unit of that field.
    """

    field: str
    label: str
    kind: str
    truth: str
    truth_unit: float = 1.0
