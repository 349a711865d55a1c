"""What a study varies and how: read from its file, and the values of every drop by number."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import UsageError
from rotordrop.machine import Machine, load_machine
from rotordrop.machine.amb import REMANENCE_TIME
from rotordrop.machine.description import unknown_key
from rotordrop.machine.parameter_paths import kind_of_path
from rotordrop.machine.saving import machine_text
from rotordrop.simulation.case import DropCase, LevitatedStart
from rotordrop.study.distributions import Distribution, read_distribution
from rotordrop.units import parse_quantity

Array = NDArray[np.float64]

DESIGNS = ("random", "latin hypercube", "sobol", "grid")
CASE_KINDS: Mapping[str, str] = {
    "speed": "speed",
    "rotor_angle": "angle",
    "remanent_share": "dimensionless",
    "remanence_time": "time",
    "offset_x": "length",
    "offset_y": "length",
}
"""What of a case may be varied beside the machine, with its kind; ``remanent_share`` counts in weights."""

TURN = Distribution(shape="uniform", numbers=(0.0, 2.0 * math.pi))
_KEYS = (
    "name", "machine", "drops", "seed", "duration", "output_step", "tolerance", "reduction", "start",
    "design", "shard", "speed", "vary", "until",
)  # fmt: skip
_QUANTITIES = {
    "duration": "time",
    "output_step": "time",
    "speed": "speed",
    "tolerance": "dimensionless",
}
_AS_WRITTEN = ("name", "drops", "seed", "tolerance", "reduction", "design", "shard")


@dataclass(frozen=True, kw_only=True)
class Until:
    """When a study may end early: a quantile known well enough.

    Attributes
    ----------
    column : str
        Column of the results, such as ``"NDE.peak_force"``.
    quantile : float
        Which quantile [1].
    within : float
        Half width of its 90 % interval relative to its value [1].
    """

    column: str
    quantile: float
    within: float


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study: a machine, what varies, how many drops, in shards.

    Attributes
    ----------
    name : str
        What the study is about.
    machine : Machine
        The machine around which values vary.
    drops : int
        Drops at most.
    seed : int
        Key of the random numbers; drop ``i`` uses ``(seed, i)``, whatever shard or computer it runs on.
    duration, output_step : float
        Length of each drop and step of its histories [s].
    tolerance : float
        Accuracy of the integrator [1].
    reduction : str
        Preset of the rotor's reduction.
    levitated : bool
        Whether drops start floating in the AMBs; else straight in the centre.
    design : str
        One of `DESIGNS`.
    shard : int
        Drops of a shard.
    speed : float
        Speed of drops whose speed does not vary [rad/s].
    vary : dict of Distribution
        Spread by path (``"NDE.support.stiffness"``, ``"*.friction.dynamic"`` for all touchdown bearings with
        one value) or by a name of `CASE_KINDS`.
    until : Until or None
        When to end early.
    """

    name: str
    machine: Machine
    drops: int
    seed: int = 1
    duration: float = 0.2
    output_step: float = 1e-5
    tolerance: float = 1e-6
    reduction: str = "accurate"
    levitated: bool = True
    design: str = "random"
    shard: int = 200
    speed: float = math.nan
    vary: Mapping[str, Distribution] = field(default_factory=dict)
    until: Until | None = None

    def __post_init__(self) -> None:
        _check(self)

    @cached_property
    def varied(self) -> Mapping[str, Distribution]:
        """Everything that varies, by name in order; the unknown rotor angle of a levitated start included."""
        spread = dict(sorted(self.vary.items()))
        if self.levitated and "rotor_angle" not in spread:
            spread["rotor_angle"] = TURN
        return spread

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
        share = self._shares(first, last)
        columns = [spread(share[:, j]) for j, spread in enumerate(self.varied.values())]
        return np.column_stack(columns) if columns else np.zeros((last - first, 0))

    def _shares(self, first: int, last: int) -> Array:
        width = len(self.varied)
        if self.design == "random":
            return np.array([_uniform(self.seed, i, width) for i in range(first, last)]).reshape(-1, width)
        if self.design == "grid":
            return self._grid_shares(first, last)
        from scipy.stats import qmc

        random = np.random.Generator(np.random.Philox(np.random.SeedSequence(self.seed)))
        if self.design == "sobol":
            sequence = qmc.Sobol(width, scramble=True, rng=random)
            if first:
                sequence.fast_forward(first)
            return np.asarray(sequence.random(last - first))
        return np.asarray(self._hypercube[first:last])

    @cached_property
    def _hypercube(self) -> Array:
        from scipy.stats import qmc

        random = np.random.Generator(np.random.Philox(np.random.SeedSequence(self.seed)))
        return np.asarray(qmc.LatinHypercube(len(self.varied), rng=random).random(self.drops))

    def _grid_shares(self, first: int, last: int) -> Array:
        """Cells in the order of the product, again and again until all drops are placed."""
        names = list(self.varied)
        grids = [name for name in names if self.varied[name].shape == "grid"]
        cells = list(itertools.product(*(range(len(self.varied[name].numbers)) for name in grids)))
        share = np.array([_uniform(self.seed, i, len(names)) for i in range(first, last)])
        for row, drop in enumerate(range(first, last)):
            for name, place in zip(grids, cells[drop % len(cells)], strict=True):
                share[row, names.index(name)] = (place + 0.5) / len(self.varied[name].numbers)
        return share

    def machine_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Machine values by full path [SI]; a star stands for every touchdown bearing."""
        found: dict[str, float] = {}
        for path, value in values.items():
            if path not in CASE_KINDS:
                found |= dict.fromkeys(_starred(self.machine, path), value)
        return found

    def case(self, values: Mapping[str, float]) -> DropCase:
        """Case of a drop whose varied values are given [SI]."""
        speed = values.get("speed", self.speed)
        settings: dict[str, Any] = {
            "duration": self.duration,
            "output_step": self.output_step,
            "tolerance": self.tolerance,
            "reduction": self.reduction,
        }
        if not self.levitated:
            return DropCase(speed=speed, **settings)
        magnets = len(self.machine.ambs)
        weight = self.machine.rotor.mass * float(self.machine.gravity)
        lift = np.zeros((magnets, 2))
        lift[:, 1] = values.get("remanent_share", 0.0) * weight / max(magnets, 1)
        offset = np.tile([values.get("offset_x", 0.0), values.get("offset_y", 0.0)], (magnets, 1))
        start = LevitatedStart(
            rotor_angle=values["rotor_angle"],
            remanent_force=lift if "remanent_share" in values else None,
            remanence_time_constant=values.get("remanence_time", REMANENCE_TIME),
            offset=offset,
        )
        return DropCase(speed=speed, start=start, **settings)

    def document(self) -> dict[str, Any]:
        """Everything that decides a number, ready for JSON."""
        return {
            **{key: getattr(self, key) for key in _AS_WRITTEN},
            "duration_s": self.duration,
            "output_step_s": self.output_step,
            "start": "levitated" if self.levitated else "centred",
            "speed_rad_per_s": None if math.isnan(self.speed) else self.speed,
            "vary": {name: {spread.shape: list(spread.numbers)} for name, spread in self.vary.items()},
            "until": None if self.until is None else dict(self.until.__dict__),
        }

    @cached_property
    def digest(self) -> str:
        """SHA-256 of plan and machine: two studies with the same one give the same numbers."""
        plan = json.dumps(self.document(), sort_keys=True, allow_nan=False)
        return hashlib.sha256((plan + "\n" + machine_text(self.machine)).encode()).hexdigest()


def _uniform(seed: int, drop: int, width: int) -> Array:
    """Random numbers of one drop: a block of the counter that no other drop reaches."""
    bits = np.random.Philox(key=seed, counter=[0, 0, drop & (2**64 - 1), 0])
    return np.random.Generator(bits).random(width)


def _starred(machine: Machine, path: str) -> list[str]:
    head, _, rest = path.partition(".")
    if head != "*":
        return [path]
    return [f"{bearing.name}.{rest}" for bearing in machine.touchdown_bearings]


def _check(study: Study) -> None:
    for name in ("drops", "shard"):
        if not getattr(study, name) >= 1:
            raise UsageError(f"{name} = {getattr(study, name)!r}; expected a whole number above zero")
    if not 0 <= study.seed < 2**64:
        raise UsageError(f"seed = {study.seed}; expected a whole number from 0 to 2^64 - 1")
    if study.design not in DESIGNS:
        raise UsageError(f"design = {study.design!r}; expected one of {', '.join(DESIGNS)}")
    if not 0.0 < study.tolerance <= 1e-3:
        raise UsageError(f"tolerance = {study.tolerance!r}; expected a number up to 1e-3, such as 1e-6")
    _check_vary(study)


def _check_vary(study: Study) -> None:
    if math.isnan(study.speed) and "speed" not in study.vary:
        raise UsageError('the study has no speed; write speed = "60 Hz", or vary it under [vary]')
    if study.levitated and not study.machine.ambs:
        raise UsageError(
            'the drops start levitated, but the machine has no AMBs; describe them or write start = "centred"'
        )
    for name in study.vary:
        if name in CASE_KINDS:
            if name != "speed" and not study.levitated:
                raise UsageError(f'{name} is varied, which needs start = "levitated"')
            continue
        for path in _starred(study.machine, name):
            kind_of_path(study.machine, path)
    gridded = [name for name, spread in study.vary.items() if spread.shape == "grid"]
    if bool(gridded) != (study.design == "grid"):
        raise UsageError(
            f"design = {study.design!r} with {len(gridded)} values varied by 'grid'; a design \"grid\" needs "
            "at least one of them, and other designs none ('choices' draws from a list)"
        )


def read_study(table: Mapping[str, Any], machine: Machine) -> Study:
    """Make a study of what a study file holds; ``machine`` is already read."""
    for key in table:
        if key not in _KEYS:
            raise UsageError(unknown_key(key, _KEYS))
    if "drops" not in table:
        raise UsageError("the study does not say how many drops; write drops = 1000")
    settings: dict[str, Any] = {"name": machine.name}
    settings |= {key: table[key] for key in ("name", "design", "reduction") if key in table}
    settings |= {key: _whole(key, table[key]) for key in ("drops", "seed", "shard") if key in table}
    settings |= {key: _quantity(key, table[key], kind) for key, kind in _QUANTITIES.items() if key in table}
    if table.get("start", "levitated") not in ("levitated", "centred"):
        raise UsageError(f'start = {table["start"]!r}; expected "levitated" or "centred"')
    settings["levitated"] = table.get("start", "levitated") == "levitated"
    settings["vary"] = {
        name: read_distribution(name, spread, _reader(machine, name))
        for name, spread in dict(table.get("vary", {})).items()
    }
    if "until" in table:
        settings["until"] = _until(table["until"])
    return Study(machine=machine, **settings)


def planned_study(document: Mapping[str, Any], machine: Machine) -> Study:
    """The study of a plan, as `Study.document` wrote it: all numbers are SI already."""
    speed, until = document["speed_rad_per_s"], document["until"]
    return Study(
        machine=machine,
        duration=document["duration_s"],
        output_step=document["output_step_s"],
        levitated=document["start"] == "levitated",
        speed=math.nan if speed is None else speed,
        vary={
            name: Distribution(shape=shape, numbers=tuple(numbers))
            for name, spread in document["vary"].items()
            for shape, numbers in spread.items()
        },
        until=None if until is None else Until(**until),
        **{key: document[key] for key in _AS_WRITTEN},
    )


def _whole(key: str, raw: Any) -> int:
    if isinstance(raw, bool) or not isinstance(raw, int):
        raise UsageError(f"{key} = {raw!r}; expected a whole number")
    return raw


def _quantity(key: str, raw: Any, kind: str) -> float:
    try:
        return parse_quantity(raw, kind)
    except UsageError as error:
        raise UsageError(f"{key}: {error}") from error


def _reader(machine: Machine, name: str) -> Any:
    if name in CASE_KINDS:
        kind = CASE_KINDS[name]
    else:
        kind = kind_of_path(machine, _starred(machine, name)[0])
    return lambda raw: _quantity(name, raw, kind)


def _until(raw: Any) -> Until:
    if not isinstance(raw, Mapping) or set(raw) != {"column", "quantile", "within"}:
        raise UsageError(
            f'until = {raw!r}; expected {{column = "NDE.peak_force", quantile = 0.99, within = 0.05}}'
        )
    until = Until(column=str(raw["column"]), quantile=float(raw["quantile"]), within=float(raw["within"]))
    if not 0.0 < until.quantile < 1.0 or not until.within > 0.0:
        raise UsageError(
            f"until: quantile {until.quantile:g} within {until.within:g}; expected a quantile between 0 and "
            "1 and a half width above zero, such as 0.99 and 0.05"
        )
    return until


def load_study(path: str | Path) -> Study:
    """Read a study file (TOML); its machine file counts from its folder.

    Raises
    ------
    UsageError
        If the study cannot be used; the message names the file.
    """
    file = Path(path)
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UsageError(f"{file}: cannot read the study file: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{file}: not valid TOML: {error}") from error
    named = table.get("machine")
    if not isinstance(named, str):
        raise UsageError(f'{file}: machine = {named!r}; expected the name of a machine file, "machine.toml"')
    machine = load_machine(file.parent / named)
    try:
        return read_study(table, machine)
    except UsageError as error:
        raise UsageError(f"{file}: {error}") from error
