"""What is true of the structures of a hidden machine, by the paths that a machine file would give them."""

from __future__ import annotations

import math
from typing import Any

from rotordrop.machine import TouchdownBearing
from rotordrop_bench.event import DropConditions, HiddenMachine
from rotordrop_bench.sensor_chain import SensorErrors, true_places
from rotordrop_bench.structure import support_matrices
from rotordrop_bench.violation_parts import BearingViolations
from rotordrop_bench.violations import Violations

KINDS: dict[str, tuple[str, ...]] = {
    "turned support axes": (
        "support.axes_angle",
        "support.stiffness_ratio",
        "support.damping_ratio",
    ),
    "support damping": ("support.damping",),
    "cubic support": ("support.hardening",),
    "hysteretic support": ("support.slip_force",),
    "foundation mode": ("foundation.mass",),
    "contact stiffness": ("contact.stiffness",),
    "contact damping": ("contact.damping",),
    "contact exponent": ("contact.exponent",),
    "contact law": ("contact.law",),
    "race inertia": ("race.inertia",),
    "race tilt": ("race.tilt_stiffness",),
    "friction": ("friction.dynamic", "friction.static", "friction.stribeck_speed"),
    "gap drift": ("gap.drift",),
    "thermal gap": ("gap.closing",),
    "ball phase": ("balls.first_ball_angle", "balls.turn"),
    "bearing centres": ("centre.x", "centre.y"),
    "sensor lag": ("sensors.time_constant",),
    "cross-axis sensitivity": ("sensors.cross_axis",),
    "sensor planes elsewhere": ("sensors.plane_shift",),
    "brackets that follow the housing": ("sensors.follows_housing",),
    "anti-alias filter": ("sensors.anti_alias_frequency",),
    "long remanence": ("magnets.remanence_time", "magnets.remanent_lift"),
    "unbalance beyond its grade": ("rotor.unbalance",),
    "rotor stiffness": ("rotor.youngs_modulus",),
    "unbalance jump": ("unbalance_jump.node",),
}
"""Names of the kinds of violations, with the keys of a case file that make them."""


def violated_kinds(violations: Violations) -> tuple[str, ...]:
    """Names of the kinds of violations that a case holds, in the order of `KINDS`."""
    given = {f"{part}.{key}" for part, keys in _given(violations) for key in keys}
    return tuple(kind for kind, keys in KINDS.items() if given & set(keys))


def _given(violations: Violations) -> list[tuple[str, Any]]:
    values = violations.values()
    found = [(part, keys) for part, keys in values.items() if part not in ("bearing", "sensor")]
    for bearing in values.get("bearing", {}).values():
        found += list(bearing.items())
    return found + [("sensors", sensor) for sensor in values.get("sensor", {}).values()]


def true_structure(
    hidden: HiddenMachine, conditions: DropConditions, errors: SensorErrors
) -> dict[str, float]:
    """True values of all structures [SI] by path, absent ones with the value that means absent."""
    values: dict[str, float] = {}
    for bearing in hidden.machine.touchdown_bearings:
        mine = _of_bearing(bearing, hidden.violations.of_bearing(bearing.name))
        values |= {f"{bearing.name}.{path}": value for path, value in mine.items()}
    stated = hidden.machine.rotor.node_positions
    places = true_places(hidden.machine, errors)
    for i, sensor in enumerate(hidden.machine.sensors):
        mine = {
            "time_constant": errors.time_constant[i],
            "cross_axis": errors.cross_axis[i],
            "follows_housing": errors.follows_housing[i],
            "plane_offset": places[i] - stated[sensor.node - 1],
        }
        values |= {f"sensors.{sensor.name}.{path}": float(value) for path, value in mine.items()}
    values["rotor.stiffness_factor"] = float(hidden.violations.rotor.youngs_modulus)
    values["remanence.time_constant"] = conditions.start.remanence_time_constant
    return values


def _of_bearing(bearing: TouchdownBearing, v: BearingViolations) -> dict[str, float]:
    matrix = support_matrices(bearing, v)
    support, foundation = bearing.support, v.foundation
    deflection = float(v.support.hardening_force) / float(support.stiffness)
    values = {
        "support.coupling": matrix["K_xy"] / math.sqrt(matrix["K_xx"] * matrix["K_yy"]),
        "support.damping_coupling": matrix["C_xy"] / math.sqrt(matrix["C_xx"] * matrix["C_yy"])
        if matrix["C_xx"] * matrix["C_yy"] > 0.0
        else 0.0,
        "support.axes_angle": float(v.support.axes_angle),
        "support.axes_ratio": float(support.stiffness_horizontal) / float(support.stiffness),
        "support.cubic": float(v.support.hardening) / deflection**2,
        "support.slip_force": float(v.support.slip_force),
        "support.foundation_share": 0.0,
        "gap.drift": float(v.gap.drift),
        "gap.closing": float(v.gap.closing),
        "centre.x": float(v.centre.x),
        "centre.y": float(v.centre.y),
    }
    if foundation.mass is not None and foundation.frequency is not None:
        values |= {
            "support.foundation_share": float(support.mass) / float(foundation.mass),
            "support.foundation_frequency": 2.0 * math.pi * float(foundation.frequency),
            "support.foundation_damping_ratio": float(foundation.damping_ratio),
            "foundation.mass": float(foundation.mass),
        }
    if v.race.tilt_stiffness is not None:
        values["race.tilt_stiffness"] = float(v.race.tilt_stiffness)
    return values


def without_powers(hidden: HiddenMachine, values: dict[str, Any]) -> dict[str, Any]:
    """Truth without stiffness and exponent of a contact whose law is no power: it has neither."""
    bent = [hidden.violations.of_bearing(b.name).contact.law for b in hidden.machine.touchdown_bearings]
    names = [b.name for b in hidden.machine.touchdown_bearings]
    stiffness = {name: values["contact_K"][name] for name, law in zip(names, bent, strict=True) if not law}
    contact = [
        {key: value for key, value in row.items() if not (law and key in ("K", "n"))}
        for row, law in zip(values["contact"], bent, strict=True)
    ]
    return values | {"contact_K": stiffness, "contact": contact}


def turned_supports(hidden: HiddenMachine) -> dict[str, Any]:
    """Fields of the truth that turned axes change: the stiffness and damping that act in y, the ratio."""
    found: dict[str, dict[str, float]] = {
        "support_stiffness": {},
        "support_damping": {},
        "support_anisotropy": {},
    }
    turned = False
    for bearing in hidden.machine.touchdown_bearings:
        v = hidden.violations.of_bearing(bearing.name)
        matrix = support_matrices(bearing, v)
        turned |= float(v.support.axes_angle) != 0.0
        found["support_stiffness"][bearing.name] = matrix["K_yy"]
        found["support_damping"][bearing.name] = matrix["C_yy"]
        found["support_anisotropy"][bearing.name] = matrix["K_xx"] / matrix["K_yy"]
    return found if turned else {}
