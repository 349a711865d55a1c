"""What is true of a hidden machine and stands in no description: a table of keys, and case files of them."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, get_args

from rotordrop.elements.values import (
    Angle,
    ContactExponent,
    Force,
    Length,
    NonNegative,
    Physical,
    Positive,
    PositiveForce,
    PositiveFrequency,
    PositiveLength,
    PositiveMass,
    PositiveTime,
    Share,
    Stiffness,
    Time,
    Unbalance,
)
from rotordrop.errors import UsageError, unknown_key
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop_bench import departure as D

CrossAxis = Annotated[Known, Physical("dimensionless", least=-0.5, most=0.5)]
Pull = Annotated[Known, Physical("dimensionless", least=0.0, most=0.95)]
ClockError = Annotated[Known, Physical("dimensionless", least=-0.1, most=0.1)]
AboveOne = Annotated[Known, Physical("dimensionless", above=1.0)]
Energy = Annotated[Known, Physical("energy", above=0.0)]
MOST_POINTS = D.MOST_PIECES + 1
"""Points of a contact law."""

LAW = {"depth": PositiveLength, "force": PositiveForce}
"""A point of a contact law: indentation [m] and normal force at rest [N]."""

Keys = dict[str, tuple[Any, Any, str]]

OF_BEARINGS: dict[str, Keys] = {
    "support": {
        "axes_angle": (Angle, 0.0, "from horizontal to the first principal axis, from x towards y"),
        "stiffness_ratio": (Positive, 1.0, "factor on the stiffness along the first axis"),
        "damping_ratio": (Positive, 1.0, "factor on the damping along the first axis"),
        "hardening": (NonNegative, 0.0, "by how much a spring exceeds a linear one at the force below"),
        "hardening_force": (PositiveForce, 1.0, "force of the linear spring at which that holds"),
        "slip_force": (Force, 0.0, "friction that slips in the support: a hysteresis"),
        "slip_travel": (PositiveLength, 1.0, "deflection over which that friction builds up"),
    },
    "foundation": {
        "mass": (PositiveMass, None, "modal mass of a mode of the foundation at the support"),
        "frequency": (PositiveFrequency, None, "its vertical natural frequency without support"),
        "frequency_horizontal": (PositiveFrequency, None, "the same horizontally; as vertically"),
        "damping_ratio": (NonNegative, 0.03, "its damping ratio; of a bolted steel frame"),
    },
    "contact": {
        "exponent": (ContactExponent, None, "another exponent, equally deep at five times the mean load"),
        "law": (LAW, (), "points of a law, straight between them where both scales are log"),
    },
    "race": {
        "mass": (Positive, 1.0, "factor on mass and inertia, as of a carrier that turns along"),
        "tilt_stiffness": (Stiffness, None, "of a tilt where the rotor touches, in series with the contact"),
        "tilt_frequency": (PositiveFrequency, None, "natural frequency of the tilt"),
        "tilt_damping_ratio": (NonNegative, 0.02, "damping ratio of the tilt; of steel on balls"),
    },
    "friction": {
        "dynamic": (Positive, None, "dynamic coefficient; the static one keeps its ratio to it"),
        "wear": (Share, 0.0, "share of the friction that is lost as the surfaces run in"),
        "wear_heat": (Energy, 1.0, "heat of friction at which 63 % of that is lost"),
    },
    "gap": {
        "drift": (Length, 0.0, "change of the gap that stays, at an even rate within the time below"),
        "drift_time": (PositiveTime, 1.0, "time it takes"),
        "closing": (Length, 0.0, "largest closing by the heat of friction, gone when all is cold again"),
        "heat": (Energy, 1.0, "heat of friction that closes 63 % of it"),
    },
    "balls": {
        "turn": (bool, False, "the balls turn with the cage as the race spins up"),
        "seat_play": (Length, 0.0, "way of the bearing in its seat, from the middle, before it holds"),
    },
    "sleeve": {
        "eccentricity": (Length, 0.0, "centre of the landing sleeve off the axis of the rotor"),
        "ovality": (Length, 0.0, "amplitude of its radius twice per turn"),
        "angle": (Angle, 0.0, "of both from +x at rotor angle zero"),
    },
    "centre": {
        "x": (Length, 0.0, "centre of the bearing in the axes of magnets and sensors"),
        "y": (Length, 0.0, "centre of the bearing in the axes of magnets and sensors"),
    },
}
"""Keys of what may be violated at touchdown bearings: how a value is written, the value at which nothing is
violated [SI], and what it is."""

SENSORS: Keys = {
    "time_constant": (Time, 0.0, "time constant of first order with which they follow the shaft"),
    "cross_axis": (CrossAxis, 0.0, "reading per motion across; drawn from half of it on, with either sign"),
    "plane_shift": (Length, 0.0, "how much nearer to the middle of the rotor they stand than stated"),
    "follows_housing": (Share, 0.0, "share of the motion of the housing that a bracket follows"),
    "curvature": (Share, 0.0, "share by which they read too little at the displacement below, squared"),
    "curvature_at": (PositiveLength, 1.0, "that displacement"),
}
CHAIN: Keys = {
    "anti_alias_frequency": (PositiveFrequency, None, "corner of a filter that nobody mentions"),
    "flicker": (Length, 0.0, "noise (rms) whose power falls as one over the frequency, beside the white"),
    "clock_error": (ClockError, 0.0, "how much longer seconds of the recorder are than true ones"),
    "speed_delay": (Time, 0.0, "how late the speed signal is"),
}
"""Keys of all sensors alike, and of what is behind them."""

KEYS: dict[str, Keys] = {
    **OF_BEARINGS,
    "sensors": {**SENSORS, **CHAIN},
    "magnets": {
        "remanence_time": (PositiveTime, None, "time constant of the remanent lift"),
        "pull": (Pull, 0.0, "horizontal pull at power-off over the magnet's share of the weight, besides"),
        "pull_time": (PositiveTime, 1.0, "time constant with which that decays"),
        "stays_on": (tuple, (), "magnets that hold on: a drop of one end, of which there is no tail"),
    },
    "rotor": {
        "youngs_modulus": (Positive, 1.0, "factor on Young's modulus of every section"),
        "unbalance": (Positive, 1.0, "factor on the drawn unbalances, which may leave the grade"),
        "bow": (Length, 0.0, "middle of the shaft off the line of its ends, towards +x at rotor angle zero"),
        "bow_speed": (PositiveFrequency, 1.0, "speed at which it bends so; elsewhere it is an unbalance"),
    },
    "stand": {"tilt": (Angle, 0.0, "of the machine about its axis: gravity has a part towards +x")},
    "unbalance_jump": {
        "node": (int, None, "node of an unbalance that comes during the drop, counted from 1"),
        "amount": (Unbalance, None, "its amount"),
        "phase": (Angle, 0.0, "its phase, counted from +y at rotor angle zero"),
        "time": (Time, None, "when it comes, from power-off; at the first contact when left out"),
    },
    "side_force": {
        "node": (int, None, "node of a force towards +x that stays, as of a belt"),
        "force": (Force, None, "the force"),
    },
    "seal": {
        "node": (int, None, "node of a seal that the rotor rubs on"),
        "gap": (AboveOne, None, "its gap over the widest air gap of the touchdown bearings"),
        "stiffness": (Stiffness, None, "stiffness of its housing"),
    },
}
"""Keys of everything that may be violated, by part."""

PLACED = {"unbalance_jump": "unbalance comes", "side_force": "side force acts", "seal": "seal sits"}
TOGETHER: tuple[tuple[str, ...], ...] = (
    ("support", "hardening", "hardening_force"),
    ("support", "slip_force", "slip_travel"),
    ("foundation", "mass", "frequency"),
    ("race", "tilt_stiffness", "tilt_frequency"),
    ("friction", "wear", "wear_heat"),
    ("gap", "drift", "drift_time"),
    ("gap", "closing", "heat"),
    ("sensors", "curvature", "curvature_at"),
    ("magnets", "pull", "pull_time"),
    ("rotor", "bow", "bow_speed"),
    ("unbalance_jump", "node", "amount"),
    ("side_force", "node", "force"),
    ("seal", "node", "gap", "stiffness"),
)
"""Parts and keys of which none says anything without the others."""
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
    for part, *group in TOGETHER:
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
