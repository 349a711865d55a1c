"""What a study varies and how: read from its file, and the values of every drop by number.

Every drop has random numbers of its own (Philox, key = seed, counter = drop), which say the share of the
probability that each varied value has, so that none depends on shards, threads or the order of work.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked_dataclass

from rotordrop.arrays import Array
from rotordrop.document import read_toml
from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.elements.table import fitted_row, following
from rotordrop.errors import UsageError, unknown_key
from rotordrop.known import Known
from rotordrop.machine import Machine, load_machine
from rotordrop.machine.machine import kind_of_path, value_of_path
from rotordrop.machine.saving import machine_text
from rotordrop.physics.elementary import exp_each, ln_each
from rotordrop.physics.linear_algebra import product, symmetric_eigen
from rotordrop.simulate.case import DropCase, LevitatedStart, MagnetEvent
from rotordrop.study.distributions import (
    Distribution,
    normal_score,
    read_distribution,
)
from rotordrop.units import parse_quantity

Design = Literal["random", "latin hypercube", "sobol", "grid", "sensitivity"]
DESIGNS: tuple[str, ...] = get_args(Design)


def independent(seed: int, first: int, last: int, width: int) -> Array:
    """Shares of drops ``first`` to ``last - 1``, shape (n, width), each drop on its own."""
    bits = np.random.Philox(key=seed, counter=0)
    generator, begin = np.random.Generator(bits), bits.state
    shares = np.empty((last - first, width))
    # each drop has a block of the counter that no other reaches; a new generator each took six times as long
    for row, drop in enumerate(range(first, last)):
        begin["state"]["counter"][2] = drop
        bits.state = begin
        generator.random(out=shares[row])
    return shares


def sobol(seed: int, first: int, last: int, width: int) -> Array:
    """Points of a scrambled Sobol sequence, shape (n, width)."""
    from scipy.stats import qmc

    if first == last:
        return np.empty((0, width))
    sequence = qmc.Sobol(width, scramble=True, rng=_generator(seed))
    if first:
        sequence.fast_forward(first)
        return np.asarray(sequence.random(last - first))
    # the first point by itself: a first draw that is no power of two is warned of, and pieces are meant here
    return np.asarray(np.concatenate([sequence.random(1), sequence.random(last - 1)]))


@lru_cache(maxsize=4)
def hypercube(seed: int, drops: int, width: int) -> Array:
    """All points of a Latin hypercube, shape (drops, width)."""
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(width, rng=_generator(seed)).random(drops))


def _generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed)))


def grid(seed: int, first: int, last: int, spreads: Mapping[str, Distribution]) -> Array:
    """Cells in the order of the product, again and again until all drops are placed, shape (n, V)."""
    names = list(spreads)
    grids = [name for name in names if spreads[name].shape == "grid"]
    sizes = [len(spreads[name].numbers) for name in grids]
    share = independent(seed, first, last, len(names))
    cells = np.unravel_index(np.arange(first, last) % math.prod(sizes), sizes)
    for name, size, places in zip(grids, sizes, cells, strict=True):
        share[:, names.index(name)] = (places + 0.5) / size
    return share


def sensitivity(seed: int, first: int, last: int, width: int) -> Array:
    """Blocks of ``width + 2`` drops that tell the values apart, shape (n, width).

    The first drop of a block is a point A, the second a point B, and each further one is A with one value
    taken from B. Source: Saltelli and others, Computer Physics Communications 181, 2010.
    """
    size = width + 2
    low, high = first // size, -(-last // size)
    points = sobol(seed, low, high, 2 * width)
    share = np.empty((last - first, width))
    for row, drop in enumerate(range(first, last)):
        block, place = divmod(drop, size)
        a, b = points[block - low, :width], points[block - low, width:]
        share[row] = b if place == 1 else a
        if place > 1:
            share[row, place - 2] = b[place - 2]
    return share


@dataclass(frozen=True, kw_only=True)
class Joint:
    """Joint distribution of calibrated values: normal in the values or in their logarithms."""

    paths: tuple[str, ...]
    """Values by path."""
    logarithmic: NDArray[np.bool_]
    """Whether the logarithm is normal, shape (n,)."""
    middle: Array
    """Mean of each, of the logarithm where that is normal [SI], shape (n,)."""
    root: Array
    """Root of the covariance, shape (n, n)."""

    def values(self, share: Array) -> Array:
        """Values [SI], shape (n, V), at independent shares of the probability, shape (n, V)."""
        drawn: Array = self.middle + product(normal_score(share), self.root.T)
        drawn[:, self.logarithmic] = exp_each(drawn[:, self.logarithmic])
        for k, path in enumerate(self.paths):
            if (row := fitted_row(path)) is not None:
                drawn[:, k] = [row.within(value) for value in drawn[:, k].tolist()]
        return drawn

    def marginal(self, k: int) -> Distribution:
        """Distribution of one value alone."""
        sigma = float(np.sqrt(np.sum(self.root[k] ** 2)))
        if self.logarithmic[k]:
            return Distribution(shape="log_normal", numbers=(float(np.exp(self.middle[k])), sigma))
        return Distribution(shape="normal", numbers=(float(self.middle[k]), sigma))


def joint_of(machine: Machine) -> Joint:
    """The joint distribution that a calibrated machine file holds; refuses a file that holds none."""
    origin = machine.calibration
    if origin is None or origin.joint is None:
        raise UsageError(
            f"{machine.name!r} holds no joint distribution of its values; expected a machine file that "
            "'rotordrop calibrate' wrote. Calibrate it on recorded drops, or vary its values one by one"
        )
    spread = origin.joint
    logs = np.array(spread.logarithmic)
    middle = np.array([value_of_path(machine, path) for path in spread.paths])
    middle[logs] = ln_each(middle[logs])
    size, turn = symmetric_eigen(spread.matrix)
    # rows of the symmetric root: the same numbers whatever sign an eigenvector has
    root = product(turn * np.sqrt(np.maximum(size, 0.0)), turn.T)
    return Joint(paths=spread.paths, logarithmic=logs, middle=middle, root=root)


CASE_KINDS: Mapping[str, str] = {
    "speed": "speed",
    "rotor_angle": "angle",
    "remanent_share": "dimensionless",
    "remanence_time": "time",
    "offset_x": "length",
    "offset_y": "length",
}
"""What of a case may be varied beside the machine, with its kind; ``remanent_share`` counts in weights."""

MAGNET_KINDS: Mapping[str, str] = {
    "remanent_share": "dimensionless",
    "remanent_share_x": "dimensionless",
    "offset_x": "length",
    "offset_y": "length",
    "orbit": "length",
    "orbit_phase": "angle",
}
"""What may be varied of the start at one magnet, after its name, ``"DE.offset_x"``: lift up and sideways in
shares of the weight it carries, where it holds the rotor, radius and angle of a synchronous orbit there."""

TURN = Distribution(shape="uniform", numbers=(0.0, 2.0 * math.pi))
_QUANTITIES = {"duration": "time", "output_step": "time", "speed": "speed", "tolerance": "dimensionless"}
_QUANTITIES |= {"relevitate": "time"}
_AS_WRITTEN = (
    "name", "drops", "seed", "tolerance", "reduction", "design", "shard", "calibrated"
)  # fmt: skip


@checked_dataclass(frozen=True, kw_only=True, config=ConfigDict(extra="forbid"))
class Until:
    """When a study may end early: a quantile known well enough."""

    column: str
    """Column of the results, such as ``"NDE.peak_force"``."""
    quantile: Annotated[float, Field(gt=0.0, lt=1.0)]
    """Which quantile [1]."""
    within: Annotated[float, Field(gt=0.0)]
    """Half width of its 90 % interval relative to its value [1]."""


_WHOLE = (TypeAdapter(Annotated[int, Field(strict=True, ge=1, le=10**8)]), "a whole number from 1 to 1e8")
_RULES: Mapping[str, tuple[TypeAdapter[Any], str]] = {
    "drops": _WHOLE,
    "shard": _WHOLE,
    "seed": (
        TypeAdapter(Annotated[int, Field(strict=True, ge=0, lt=2**64)]),
        "a whole number from 0 to 2^64 - 1",
    ),
    "design": (TypeAdapter(Design), f"one of {', '.join(DESIGNS)}"),
    "tolerance": (
        TypeAdapter(Annotated[float, Field(gt=0.0, le=1e-3)]),
        "a number up to 1e-3, such as 1e-6",
    ),
    "start": (TypeAdapter(Literal["levitated", "centred"]), '"levitated" or "centred"'),
    "calibrated": (TypeAdapter(Annotated[bool, Field(strict=True)]), "true or false"),
    "until": (
        TypeAdapter(Until | None),
        '{column = "NDE.peak_force", quantile = 0.99, within = 0.05}, with a quantile between 0 and 1 and a '
        "half width above zero",
    ),
}
"""What a setting of a study must be, for pydantic and in words."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study: a machine, what varies, how many drops, in shards."""

    name: str
    """What the study is about."""
    machine: Machine
    """The machine around which values vary."""
    drops: int
    """Drops at most."""
    seed: int = 1
    """Key of the random numbers; drop ``i`` uses ``(seed, i)``, whatever shard or computer it runs on."""
    duration: float = 0.2
    output_step: float = 1e-5
    """Length of each drop and step of its histories [s]."""
    tolerance: float = 1e-6
    """Accuracy of the integrator [1]."""
    reduction: str = "accurate"
    """Preset of the rotor's reduction."""
    start: str = "levitated"
    """How drops start: ``"levitated"`` in the AMBs, or ``"centred"``, straight in the centre."""
    relevitate: float | None = None
    """When magnets in the loop take the rotor up again [s], let go at the begin; None: they are springs and
    dampers that do not."""
    design: str = "random"
    """One of `DESIGNS`."""
    shard: int = 200
    """Drops of a shard."""
    speed: float = math.nan
    """Speed of drops whose speed does not vary [rad/s]."""
    vary: Mapping[str, Distribution] = field(default_factory=dict)
    """Spread by path (``"NDE.support.stiffness"``, ``"*.friction.dynamic"`` for all touchdown bearings with
    one value) or by a name of `CASE_KINDS`."""
    until: Until | None = None
    """When to end early."""
    calibrated: bool = False
    """Whether the values of a calibrated machine vary by their joint distribution."""

    def __post_init__(self) -> None:
        for name, (adapter, expected) in _RULES.items():
            given = getattr(self, name)
            try:
                object.__setattr__(self, name, adapter.validate_python(given))
            except ValidationError:
                raise UsageError(f"{name} = {given!r}; expected {expected}") from None
        if math.isnan(self.speed) and "speed" not in self.vary:
            raise UsageError('the study has no speed; write speed = "60 Hz", or vary it under [vary]')
        if self.levitated and not self.machine.ambs:
            raise UsageError(
                "the drops start levitated, but the machine has no AMBs; describe them or write start = "
                '"centred"'
            )
        if self.relevitate is not None and not 0.0 <= self.relevitate < self.duration:
            raise UsageError(
                f"relevitate = {self.relevitate:g} s; expected a time within the duration of "
                f"{self.duration:g} s"
            )
        _check_spreads(self)

    @property
    def looped(self) -> bool:
        """Whether the magnets are in the loop."""
        return self.relevitate is not None

    @property
    def levitated(self) -> bool:
        """Whether drops start floating in the AMBs."""
        return self.start == "levitated"

    @cached_property
    def varied(self) -> Mapping[str, Distribution]:
        """Everything that varies, by name in order; the unknown rotor angle of a levitated start included."""
        joint = (
            {} if self.joint is None else {p: self.joint.marginal(k) for k, p in enumerate(self.joint.paths)}
        )
        spread = dict(sorted({**joint, **self.vary}.items()))
        if self.levitated and "rotor_angle" not in spread:
            spread["rotor_angle"] = TURN
        return spread

    @cached_property
    def joint(self) -> Joint | None:
        """Joint distribution of the calibrated values, where they vary by it."""
        return joint_of(self.machine) if self.calibrated else None

    @property
    def shards(self) -> int:
        """Number of shards."""
        return -(-self.drops // self.shard)

    def drops_of(self, shard: int) -> range:
        """Numbers of the drops of a shard."""
        return range(shard * self.shard, min((shard + 1) * self.shard, self.drops))

    def values(self, first: int, last: int) -> Array:
        """Values of drops ``first`` to ``last - 1``, one column for each of `varied` [SI].

        Every drop has random numbers of its own (Philox, key = seed, counter = drop), so that no value
        depends on shards, threads or the order of work.
        """
        names = list(self.varied)
        if self.design == "grid":
            shares = grid(self.seed, first, last, self.varied)
        elif self.design == "latin hypercube":
            shares = hypercube(self.seed, self.drops, len(names))[first:last]
        else:
            draw = {
                "random": independent,
                "sobol": sobol,
                "sensitivity": sensitivity,
            }
            shares = draw[self.design](self.seed, first, last, len(names))
        columns = [spread(shares[:, j]) for j, spread in enumerate(self.varied.values())]
        values = np.column_stack(columns) if columns else np.zeros((len(shares), 0))
        if self.joint is not None:
            together = [names.index(path) for path in self.joint.paths]
            values[:, together] = self.joint.values(shares[:, together])
        return values

    def machine_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Machine values by full path [SI]; a star stands for every touchdown bearing."""
        found: dict[str, float] = {}
        for path, value in values.items():
            if case_kind(self.machine, path) is None:
                found |= dict.fromkeys(_starred(self.machine, path), value)
        if self.joint is not None:
            for bearing, (row, path, by) in itertools.product(self.machine.touchdown_bearings, following()):
                if (of := f"{bearing.name}.{path}") in self.joint.paths:
                    found.setdefault(row.path_of(bearing.name), by(bearing, Known(value=found[of])).value)
        return found

    def machine_of(self, values: Mapping[str, float]) -> Machine:
        """The machine of a drop with all varied values [SI]."""
        return self.machine.with_values(self.machine_values(values))

    def case(self, values: Mapping[str, float]) -> DropCase:
        """Case of a drop whose varied values are given [SI]."""
        speed = values.get("speed", self.speed)
        settings: dict[str, Any] = {
            "duration": self.duration,
            "output_step": self.output_step,
            "tolerance": self.tolerance,
            "reduction": self.reduction,
        }
        if self.relevitate is not None:
            off = [MagnetEvent(action="off", time=0.0)] if self.levitated else []
            settings["magnets"] = (*off, MagnetEvent(action="levitate", time=self.relevitate))
        if not self.levitated:
            return DropCase(speed=speed, **settings)
        magnets = len(self.machine.ambs)
        weight = self.machine.rotor.mass * float(self.machine.gravity)
        share = weight / max(magnets, 1)

        def each(name: str) -> Array:
            """A value at every magnet: its own, else that of all."""
            common = values.get(name, 0.0)
            return np.array([values.get(f"{amb.name}.{name}", common) for amb in self.machine.ambs])

        lift = share * np.column_stack([each("remanent_share_x"), each("remanent_share")])
        orbit = each("orbit") * np.exp(1j * each("orbit_phase"))
        start = LevitatedStart(
            rotor_angle=values["rotor_angle"],
            remanent_force=lift if np.any(lift) else None,
            remanence_time_constant=values.get("remanence_time", REMANENCE_TIME),
            offset=np.column_stack([each("offset_x"), each("offset_y")]),
            orbit=orbit if np.any(orbit) else None,
        )
        return DropCase(speed=speed, start=start, **settings)

    def document(self) -> dict[str, Any]:
        """Everything that decides a number, ready for JSON."""
        return {
            **{key: getattr(self, key) for key in _AS_WRITTEN},
            "duration_s": self.duration,
            "output_step_s": self.output_step,
            # only where it is asked for: studies without it keep their digest
            **({} if self.relevitate is None else {"relevitate_s": self.relevitate}),
            "start": self.start,
            "speed_rad_per_s": None if math.isnan(self.speed) else self.speed,
            "vary": {name: {spread.shape: list(spread.numbers)} for name, spread in self.vary.items()},
            "until": None if self.until is None else asdict(self.until),
        }

    @cached_property
    def digest(self) -> str:
        """SHA-256 of plan and machine: two studies with the same one give the same numbers."""
        plan = json.dumps(self.document(), sort_keys=True, allow_nan=False)
        return hashlib.sha256((plan + "\n" + machine_text(self.machine)).encode()).hexdigest()


def case_kind(machine: Machine, name: str) -> str | None:
    """Kind of a varied value of the case, such as ``"DE.offset_x"``; None for values of the machine."""
    owner, _, part = name.rpartition(".")
    if owner and any(amb.name == owner for amb in machine.ambs):
        return MAGNET_KINDS.get(part)
    return CASE_KINDS.get(name)


def _starred(machine: Machine, path: str) -> list[str]:
    head, _, rest = path.partition(".")
    if head != "*":
        return [path]
    return [f"{bearing.name}.{rest}" for bearing in machine.touchdown_bearings]


def _check_spreads(study: Study) -> None:
    for name in study.vary:
        if case_kind(study.machine, name) is not None:
            if name != "speed" and not study.levitated:
                raise UsageError(f'{name} is varied, which needs start = "levitated"')
            continue
        for path in _starred(study.machine, name):
            kind_of_path(study.machine, path)
    once = [*study.vary, *(() if study.joint is None else study.joint.paths)]
    paths = [path for name in once for path in _starred(study.machine, name)]
    twice = {path for path in paths if paths.count(path) > 1}
    if twice:
        raise UsageError(
            f"{', '.join(sorted(twice))}: drawn in two ways; expected each value once among [vary] and "
            "the calibrated values. Leave one of them out"
        )
    gridded = [name for name, spread in study.vary.items() if spread.shape == "grid"]
    if bool(gridded) != (study.design == "grid"):
        raise UsageError(
            f"design = {study.design!r} with {len(gridded)} values varied by 'grid'; a design \"grid\" needs "
            "at least one of them, and other designs none ('choices' draws from a list)"
        )


def read_study(table: Mapping[str, Any], machine: Machine) -> Study:
    """Make a study of what a study file holds; ``machine`` is already read."""
    known = ("machine", *(item.name for item in fields(Study) if item.name != "machine"))
    for key in table:
        if key not in known:
            raise UsageError(unknown_key(key, known))
    if "drops" not in table:
        raise UsageError("the study does not say how many drops; write drops = 1000")
    settings: dict[str, Any] = {"name": machine.name, **table, "machine": machine}
    for key in _QUANTITIES.keys() & table.keys():
        settings[key] = _quantity(key, table[key], _QUANTITIES[key])
    settings["vary"] = {
        name: _read_spread(machine, name, spread) for name, spread in dict(table.get("vary", {})).items()
    }
    return Study(**settings)


def _read_spread(machine: Machine, name: str, spread: Any) -> Distribution:
    kind = case_kind(machine, name) or kind_of_path(machine, _starred(machine, name)[0])
    return read_distribution(name, spread, lambda raw: _quantity(name, raw, kind))


def planned_study(document: Mapping[str, Any], machine: Machine) -> Study:
    """The study of a plan, as `Study.document` wrote it: all numbers are SI already."""
    speed = document["speed_rad_per_s"]
    return Study(
        machine=machine,
        duration=document["duration_s"],
        output_step=document["output_step_s"],
        relevitate=document.get("relevitate_s"),
        speed=math.nan if speed is None else speed,
        vary={
            name: Distribution(shape=shape, numbers=tuple(numbers))
            for name, spread in document["vary"].items()
            for shape, numbers in spread.items()
        },
        start=document["start"],
        until=document["until"],
        **{key: document[key] for key in _AS_WRITTEN},
    )


def _quantity(key: str, raw: Any, kind: str) -> float:
    try:
        return parse_quantity(raw, kind)
    except UsageError as error:
        raise UsageError(f"{key}: {error}") from error


def load_study(path: str | Path) -> Study:
    """Read a study file (TOML); its machine file counts from its folder.

    Raises
    ------
    UsageError
        If the study cannot be used; the message names the file.
    """
    table, file = read_toml(path, "study"), Path(path)
    named = table.get("machine")
    if not isinstance(named, str):
        raise UsageError(f'{file}: machine = {named!r}; expected the name of a machine file, "machine.toml"')
    machine = load_machine(file.parent / named)
    try:
        return read_study(table, machine)
    except UsageError as error:
        raise UsageError(f"{file}: {error}") from error
