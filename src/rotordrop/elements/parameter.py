"""What a row of the parameter table says of a parameter."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal, TypeVar, cast

from rotordrop.known import Known
from rotordrop.units import si_unit

if TYPE_CHECKING:
    from rotordrop.elements.sensor import Seen

Owner = Literal["bearing", "sensor", "unbalance", "magnet", "load", "drop", "rotor"]
_OF_A_MACHINE = ("bearing", "sensor", "rotor")
SMALLEST_GAP = "smallest air gap"
"""Scale of the prior of an offset."""


Values = Mapping[str, Known]
"""Values by path."""


class Role(Enum):
    """What the identification does with a parameter; nuisances are fitted beside what is sought."""

    SOUGHT = "sought"
    NUISANCE = "nuisance"
    DERIVED = "follows from other parameters"


class Rule(Enum):
    """How a parameter sets an entry of the kernel."""

    VALUE = "the value itself"
    RATIO = "value times the ratio that entry and value have in the machine description"
    SCALE = "the entry times the value, after all others"
    AT_TYPICAL_DEPTH = "the entry changed so that the force at a typical indentation stays, after all others"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """An entry of the kernel that a parameter sets: array of `KernelParameters`, column, and how."""

    array: Literal["bearing", "unbalance", "magnet", "load", "spin", "modes"]
    column: int
    rule: Rule = Rule.VALUE


@dataclass(frozen=True, kw_only=True)
class Measure:
    """Another number by which a parameter is estimated, because the forces depend on it more simply."""

    name: str
    """What it is."""
    start: float
    """The number for the part described."""
    of_value: Callable[[float], float]
    """The number for a value of the parameter [SI]."""
    value_of: Callable[[float], float]
    """And back."""


def bearing_entries(*columns: int) -> tuple[Entry, ...]:
    """Entries of a bearing: the first column takes the value, the others follow at their ratio."""
    first, *others = columns
    return (
        Entry(array="bearing", column=first),
        *(Entry(array="bearing", column=column, rule=Rule.RATIO) for column in others),
    )


def path_of(owner: Owner, name: str, path: str) -> str:
    """Path in the machine of a path below an owner of a name."""
    if owner == "rotor":
        return f"rotor.{path}"
    group = {"sensor": "sensors.", "unbalance": "unbalance.", "load": "loads."}.get(owner, "")
    return f"{group}{name}.{path}" if name else path


@dataclass(frozen=True, kw_only=True, eq=False)
class Parameter:
    """One row of the table."""

    path: str
    """Path below its owner, such as ``"support.stiffness"`` of a touchdown bearing."""
    owner: Owner = "bearing"
    """What has such a parameter; all drops share those of bearings and sensors."""
    label: str
    """Name for people."""
    kind: str
    """Kind of quantity, a key of `rotordrop.units.KINDS`."""
    shown_as: str = ""
    """Kind a report shows it as; the same when empty."""
    logarithmic: bool = True
    """Whether it is estimated by its logarithm (positive quantities)."""
    role: Role = Role.NUISANCE
    """What the identification does with it."""
    guess_sigma: float = 0.0
    given_sigma: float = math.nan
    """Prior standard deviation of a guess without a range and of a given value, the same when left out: of
    the logarithm, or as a share of ``scale`` [1]."""
    scale: str = ""
    """What it is a share of, where it is not that of a logarithm."""
    least_sigma: float = 1e-4
    """Prior standard deviation that an interval in the machine file cannot go below."""
    lower: float = -math.inf
    upper: float = math.inf
    """Limits between which the model follows it [SI unit]."""
    reach: float | None = None
    """Factor on its prior value up to which the model follows it [1]: what no record shows drifts, and a race
    that is braked a thousand times harder is no race."""
    drift: float = 0.0
    """Random walk per square root of a second, in the measure or share of the prior. It keeps what the model
    gets wrong late in a drop from spoiling what the first impacts say."""
    late_drift_factor: float = 1.0
    """Factor on the drift late in a drop [1], when creep decides between rotor and race."""
    entries: tuple[Entry, ...] = ()
    """Kernel entries it sets; empty where it is no parameter of the drop model."""
    spin_up_only: bool = False
    """Whether it only says when a race catches up with the rotor: it may go far without moving a force."""
    common_sigma: float = 0.0
    """For a value of each sensor: prior standard deviation of what the sensors of a group have in common,
    where it differs from that of one of them."""
    group: Literal["plane", "machine"] = "machine"
    """Sensors that have it in common."""
    measured_by: str = ""
    """What measurement would make it known, with ``{owner}`` for what has it; empty where none is usual."""
    separated_by: dict[str, str] = dataclasses.field(default_factory=dict)
    """What measurement would tell it from another parameter, by the path of the other."""
    stored: str = ""
    """Where the description of a part has it, if not at its path; a part of a kind without it has none."""
    estimated_by: Callable[[Any], Measure] | None = None
    """Another number of a part by which the parameter is estimated."""
    ratio: tuple[str, str] | None = None
    """Two values of the description whose ratio it is; estimated by its factor on the described ratio. A
    machine file has the first of the two in its place."""
    scaled: Callable[[Any, float], tuple[float, tuple[float, float]]] | None = None
    """Scale of the prior of a part and its limits [SI], for the mean load of a bearing [N]."""
    follows: tuple[str, Callable[[Any, Known], Known]] | None = None
    """Path of the value of the same part that it follows, and how: from part and value."""
    seen: Callable[[Any], Seen] | None = None
    """What a sensor reads per unit of it."""
    amount: str = ""
    """Path below its owner of the amount of which it is the part along a mark of the rotor: it is as large,
    and unknown in every drop anew, because nobody knows where the mark stands when a drop begins."""
    way_of: Literal["", "support"] = ""
    """What moves up to it, of a way to a stop: one never used up is larger than the largest motion seen."""

    def __post_init__(self) -> None:
        if math.isnan(self.given_sigma):
            object.__setattr__(self, "given_sigma", self.guess_sigma)

    @property
    def unit(self) -> str:
        """SI unit; ``"1"`` for a pure number."""
        return si_unit(self.kind) or "1"

    @property
    def field(self) -> str:
        """Field of the JSON document, unit included, such as ``"support.stiffness_N_per_m"``."""
        unit = si_unit(self.kind).replace("/", "_per_").replace(" ", "_").replace("^2", "2")
        return f"{self.path}_{unit.replace('^', '_')}" if unit else self.path

    @property
    def display_kind(self) -> str:
        """Kind a report shows it as."""
        return self.shown_as or self.kind

    @property
    def shared(self) -> bool:
        """Whether all drops of a machine share it."""
        return self.owner in _OF_A_MACHINE and not self.amount

    def named(self, owner: str) -> str:
        """Name for people, with what it belongs to."""
        if self.owner in ("unbalance", "load"):
            return f"{self.label} of {self.owner} {int(owner) + 1}" if owner.isdigit() else self.label
        return f"{owner}: {self.label}" if owner else self.label

    def path_of(self, owner: str) -> str:
        """Path in the machine: ``"NDE.support.stiffness"``, ``"sensors.X1.gain"``, ``"unbalance.0.sine"``."""
        return path_of(self.owner, owner, self.path)

    @property
    def file_path(self) -> str:
        """Where a machine file has it, below its owner."""
        return self.path if self.ratio is None else self.ratio[0]

    def within(self, value: float) -> float:
        """The value, or the limit of the model it lies beyond."""
        return min(max(value, self.lower), self.upper)

    def stated(self, part: Any) -> Known | None:
        """The value as the description has it; None where it leaves it out."""
        value = _at(part, self.path)
        return value if isinstance(value, Known) else None

    def described(self, part: Any) -> Known:
        """The value as the machine description has it."""
        if self.ratio is not None:
            above, below = (float(_at(part, path)) for path in self.ratio)
            return Known(value=above / below, status="default")
        value = _at(part, self.stored or self.path)
        if value is None and self.stored:
            why = "this kind of bearing has none"
            return Known(value=0.0, status="default", source=why, unit=self.unit)
        assert isinstance(value, Known)
        return value


def stated_only(path: str, label: str, kind: str, sigma: float, *columns: int, **more: Any) -> Parameter:
    """An unknown of a bearing that a description names or that is none; without a range it is as given."""
    entries = bearing_entries(*columns)
    return Parameter(
        path=path, label=label, kind=kind, guess_sigma=sigma, given_sigma=1e-4, entries=entries, **more
    )


def _at(part: Any, path: str) -> Any:
    for name in path.split("."):
        if name.isdecimal():  # one of several parts of a kind, of which there may be fewer
            part = part[int(name)] if part is not None and int(name) < len(part) else None
        else:
            # another kind of bearing or support need not have the field at all
            part = getattr(part, name, None)
    return part


def below(values: Values, prefix: str) -> dict[str, Known]:
    """The values whose path in the machine begins with a prefix, by the rest of it."""
    return {path[len(prefix) :]: one for path, one in values.items() if path.startswith(prefix)}


M = TypeVar("M")  # a machine, which stands above the elements


def parts_of(machine: Any, owner: Owner) -> list[tuple[str, Any]]:
    """The parts of a machine that may own a parameter, with the name each has in a path."""
    if owner in ("bearing", "sensor"):
        parts = machine.touchdown_bearings if owner == "bearing" else machine.sensors
        return [(part.name, part) for part in parts]
    if owner in ("unbalance", "load"):
        parts = machine.unbalances if owner == "unbalance" else machine.loads
        return [(str(i), part) for i, part in enumerate(parts)]
    return [("", machine.rotor if owner == "rotor" else machine)]


def guess(value: float) -> Known:
    """A value to begin with."""
    return Known(value=value, status="guess")


@dataclass(frozen=True, kw_only=True)
class Extension:
    """Something that parts of one kind may have beyond the base model."""

    name: str
    """What it is called."""
    owner: Owner
    """Kind of part that has it."""
    rows: tuple[Parameter, ...] = ()
    """Its unknowns, of a machine that names them."""
    names: tuple[str, ...]
    """Fields below the part that a description with this extension fills; one of them filled, it is there."""
    neutral: Callable[[Any], dict[str, Known]]
    """Values of a part to begin with, by field: the base model says the same."""
    sentence: Callable[[Any, Values, float], str]
    """What the values found say of a part, by field; the last argument is the mean load of a bearing [N]."""
    joined: str = "; "
    """What stands between the words on two parts."""
    frame: str = "{}"
    """What stands around the words on all parts."""
    begins_as_base_model: bool = False
    """Whether a machine with the values to begin with computes what it does without, and knows of everything
    else what it does without."""
    inferred: bool = False
    """Whether it widens what a silent file leaves to be inferred: it is as probable as not, and as another
    minimum may lie there its search begins from guesses too."""

    def values(self, machine: Any) -> dict[str, Known]:
        """Values that a description with this extension names; none where it names some already."""
        if self.owner == "unbalance" and any(one.stays_on for one in machine.ambs):
            return {}  # such a magnet answers to the turning rotor like an unbalance
        parts = [part for _, part in parts_of(machine, self.owner)]
        if any(_at(part, name) is not None for part in parts for name in self.names):
            return {}
        return {
            path_of(self.owner, name, key): one
            for name, part in parts_of(machine, self.owner)
            for key, one in self.neutral(part).items()
        }

    def added_to(self, machine: M) -> M:
        """The machine with this extension."""
        changed: M = cast(Any, machine).with_values(self.values(machine))
        return changed

    def shows(self, machine: Any, values: Values) -> bool:
        """Whether the 90 % interval of any of its unknowns that may be zero leaves zero out."""
        rows = [row for row in self.rows if not row.logarithmic]
        paths = (row.path_of(name) for row in rows for name, _ in parts_of(machine, self.owner))
        known = [values[path] for path in paths if path in values]
        return not known or any(not one.low <= 0.0 <= one.high for one in known)

    def found(self, machine: Any, values: Values, mean_load: float) -> str:
        """What the values found say, by path in the machine; in brackets 90 % intervals."""
        words = []
        for name, part in parts_of(machine, self.owner):
            prefix = path_of(self.owner, name, "")
            words.append(self.sentence(part, below(values, prefix), mean_load))
        return self.frame.format(self.joined.join(word for word in words if word))


def of_one_unknown(
    row: Parameter,
    name: str,
    neutral: float,
    sentence: Callable[[Any, Values, float], str] | tuple[str, float],
    frame: str = "",
    *,
    alone: bool = True,
) -> Extension:
    """An extension whose one unknown has a value with which it says what the base model says.

    The words on a part, or a unit and its size [SI] for name and value; a frame lists the parts in it. With
    ``alone`` nothing else is known less with it.
    """

    def said(part: Any, found: Values, load: float) -> str:
        if callable(sentence):
            return sentence(part, found, load)
        known = found.get(row.path)
        return "" if known is None else f"{part.name} {in_words(itself(known), *sentence)}"

    return Extension(
        name=name,
        owner=row.owner,
        names=(row.path,),
        neutral=lambda _: {row.path: guess(neutral)},
        sentence=said,
        joined=", " if frame else "; ",
        frame=frame or "{}",
        rows=(row,),
        begins_as_base_model=alone,
    )


def derived(
    function: Callable[..., float], *known: Known, least: float = -math.inf, most: float = math.inf
) -> tuple[float, float, float]:
    """A number that follows from values, with its 90 % interval; their errors count as independent.

    The interval ends where the number must, at ``least`` and ``most``.
    """
    middle = [one.value for one in known]
    square = 0.0
    for k, one in enumerate(known):
        # by its ends and not by a slope: intervals are wide where a function bends
        low, high = one.interval_90 or (one.value, one.value)
        ends = [function(*middle[:k], end, *middle[k + 1 :]) for end in (low, high)]
        square += (0.5 * (ends[1] - ends[0])) ** 2
    value, half = function(*middle), math.sqrt(square)
    return value, max(value - half, least), min(value + half, most)


def itself(known: Known) -> tuple[float, float, float]:
    """A value with its 90 % interval."""
    return known.value, known.low, known.high


def quotient(above: Known, below: Known) -> tuple[float, float, float]:
    """The quotient of two positive values with its 90 % interval, which has no upper end where zero is not
    excluded below.

    By logarithms: a straight line through the values would cross zero where the lower one is not known well.
    """

    def reach(one: Known, end: float) -> float:
        return abs(math.log(end / one.value)) if end > 0.0 < one.value else math.inf

    value = above.value / below.value if below.value > 0.0 else math.inf
    down = math.hypot(reach(above, above.low), reach(below, below.high))
    up = math.hypot(reach(above, above.high), reach(below, below.low))
    if math.isinf(value):  # at the limit itself only a least value can be told
        return value, above.low / below.high if below.high > 0.0 else math.inf, math.inf
    return value, value * math.exp(-down), value * math.exp(up)


def in_words(number: tuple[float, float, float], unit: str, scale: float = 1.0) -> str:
    """A number with its interval, in a unit of a size [SI], with as many digits as the interval leaves."""
    value, low, high = (one / scale for one in number)
    gap = "" if unit in ("", "°") else " "
    if math.isinf(high):
        return f"more than {low:.2g}{gap}{unit}"
    digits = max(0, min(4, 1 - math.floor(math.log10(max(high - low, 1e-12)))))
    return f"{value:.{digits}f}{gap}{unit} ({low:.{digits}f} to {high:.{digits}f})"
