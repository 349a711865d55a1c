"""What is true of a hidden machine and stands in no description: case files of the keys of a table."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, get_args

from rotordrop.elements import values
from rotordrop.elements.values import Physical, PositiveForce, PositiveLength
from rotordrop.errors import UsageError, unknown_key
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop_bench.departing import MOST_PIECES

MOST_POINTS = MOST_PIECES + 1
"""Points of a contact law."""

LAW = {"depth": PositiveLength, "force": PositiveForce}
"""A point of a contact law: indentation [m] and normal force at rest [N]."""
OWN: dict[str, Any] = {
    "CrossAxis": Annotated[Known, Physical("dimensionless", least=-0.5, most=0.5)],
    "Pull": Annotated[Known, Physical("dimensionless", least=0.0, most=0.95)],
    "ClockError": Annotated[Known, Physical("dimensionless", least=-0.1, most=0.1)],
    "AboveOne": Annotated[Known, Physical("dimensionless", above=1.0)],
    "Energy": Annotated[Known, Physical("energy", above=0.0)],
    "law": LAW,
    "names": tuple,
    "bool": bool,
    "int": int,
}
"""Ways to write a value that no machine file has."""

Keys = dict[str, tuple[Any, Any, str]]

TABLE = tomllib.loads(resources.files(__package__).joinpath("violations.toml").read_text(encoding="utf-8"))


def _keys(part: str) -> Keys:
    """Keys of a part: how a value is written, the value at which nothing is violated [SI], and what it is."""
    found = {}
    at: Mapping[str, Any] = TABLE["bearing"].get(part) or TABLE[part]
    for key, (kind, *default, words) in at.items():
        found[key] = (OWN.get(kind) or getattr(values, kind), default[0] if default else None, words)
    return found


OF_BEARINGS: dict[str, Keys] = {part: _keys(part) for part in TABLE["bearing"]}
SENSORS, CHAIN = _keys("sensors"), _keys("chain")
KEYS: dict[str, Keys] = {
    **OF_BEARINGS,
    **{part: _keys(part) for part in TABLE if part not in ("bearing", "chain", "together")},
    "sensors": SENSORS | CHAIN,
}
"""Keys of everything that may be violated, by part: what may be at touchdown bearings, then the rest."""

PLACED = {"unbalance_jump": "unbalance comes", "side_force": "side force acts", "seal": "seal sits"}
WHOLE = (*PLACED, "foundation")
"""Parts of which nothing says anything without these keys."""


@dataclass(frozen=True)
class Violations:
    """What is true of the hidden machine and unknown to the estimator, by key such as ``"gap.drift"``."""

    given: Mapping[str, Any] = field(default_factory=dict)
    """Keys of each part [SI]; below ``bearing`` those of single bearings, which go before what all have."""

    @classmethod
    def of(cls, parts: Mapping[str, Any]) -> Violations:
        """Read what a case file has: numbers with units, by part and key."""
        shared = {part: keys for part, keys in parts.items() if part != "bearing"}
        given: dict[str, Any] = _read(shared, KEYS, "")
        if alone := parts.get("bearing"):
            given["bearing"] = {b: _read(own, OF_BEARINGS, f"bearing.{b}.") for b, own in alone.items()}
        return cls(given)

    def __getitem__(self, path: str) -> Any:
        part, key = path.split(".")
        return self.given.get(part, {}).get(key, KEYS[part][key][1])

    def of_bearing(self, name: str) -> Violations:
        """What holds at one bearing: what is said of it, then what is said of all."""
        own = self.given.get("bearing", {}).get(name, {})
        return Violations({part: self.given.get(part, {}) | own.get(part, {}) for part in OF_BEARINGS})

    def check_names(self, machine: Machine) -> None:
        """Refuse names of bearings that the machine does not have, and a node outside it."""
        there = [bearing.name for bearing in machine.touchdown_bearings]
        if missing := [name for name in self.given.get("bearing", {}) if name not in there]:
            raise UsageError(
                f"the violations name the bearing {missing[0]!r}, which the machine does not have; "
                f"it has {', '.join(there)}"
            )
        nodes = len(machine.rotor.node_positions)
        for part, what in PLACED.items():
            node = self[f"{part}.node"]
            if node is not None and not 1 <= node <= nodes:
                raise UsageError(f"the {what} at node {node}, outside the rotor; its nodes are 1 to {nodes}")


def _read(parts: Mapping[str, Any], known: Mapping[str, Keys], place: str) -> dict[str, Any]:
    """Keys of each part in SI, refused where one is unknown, is not written so or stands alone."""
    given: dict[str, dict[str, Any]] = {}
    for part, keys in parts.items():
        if part not in known or not isinstance(keys, Mapping):
            raise UsageError(f"{place}{part}: {unknown_key(part, tuple(known))}; a part is a table")
        given[part] = {}
        for key, raw in keys.items():
            try:
                if key not in known[part]:
                    raise UsageError(unknown_key(key, tuple(known[part])))
                given[part][key] = _value(known[part][key][0], raw)
            except UsageError as error:
                raise UsageError(f"{place}{part}.{key}: {error}") from None
    for part, *group in TABLE["together"]:
        there = [key for key in group if key in given.get(part, {})]
        missing = [key for key in group if key not in there]
        if missing and (there or (part in WHOLE and given.get(part))):
            first = (there or list(given[part]))[0]
            words = f"{first!r} needs {missing[0]!r} beside it; add it or leave out both"
            raise UsageError(f"{place}{part}.{first}: {words}")
    if {"law", "exponent"} <= given.get("contact", {}).keys():
        raise UsageError(f"{place}contact.law: the contact has both 'law' and 'exponent'; keep one of them")
    return given


def _value(kind: Any, raw: Any) -> Any:
    """One value in SI, as its key wants it."""
    if kind is LAW:
        return _law(raw)
    if not isinstance(kind, type):
        return float(get_args(kind)[1].read(raw))
    if kind is tuple and isinstance(raw, list | tuple):
        return tuple(raw)
    if type(raw) is not kind:
        raise UsageError(f"{raw!r} is no {'list' if kind is tuple else kind.__name__}; write one")
    return raw


def _law(raw: Any) -> tuple[dict[str, float], ...]:
    """Points of a law in SI, refused where it falls or has too few or too many."""
    points = tuple({key: _value(kind, one.get(key)) for key, kind in LAW.items()} for one in raw)
    if not 2 <= len(points) <= MOST_POINTS:
        raise UsageError(f"a law has 2 to {MOST_POINTS} points, not {len(points)}")
    for key in LAW:
        for index, (low, high) in enumerate(pairwise(point[key] for point in points)):
            if not high > low:
                raise UsageError(
                    f"{key} {high:g} at point {index + 2} does not exceed {low:g} before it; order the "
                    "points so that depth and force grow"
                )
    return points


def load_violations(path: str | os.PathLike[str]) -> Violations:
    """Read violations from a TOML file; every refusal says which key and what to do."""
    try:
        return Violations.of(tomllib.loads(Path(path).read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise UsageError(f"cannot read the case file {path}: {error}; give a TOML file in UTF-8") from None
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from None
