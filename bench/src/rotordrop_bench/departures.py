"""What the machines of the bench have and their descriptions do not, in the measure of the machine."""

from __future__ import annotations

import math
import tomllib
from importlib import resources
from typing import Any

from scipy.constants import g as standard_gravity

from rotordrop.machine import Machine
from rotordrop.physics.contact import contact_law, contact_tangent, depth_at
from rotordrop.rotor.statics import bearing_load_shares

Parts = dict[str, dict[str, Any]]

SIZES = ("slight", "large")
"""Sizes of a departure: as many machines have it, and as only some do."""

PEAK_LOADS = 10.0
"""A typical peak force over the static load of a bearing [1]; chosen, not measured."""

DEPARTURES: dict[str, Parts] = tomllib.loads(
    resources.files(__package__).joinpath("departures.toml").read_text(encoding="utf-8")
)
"""Every departure by the name of its kind, in the order of the list of drops."""


def departures(machine: Machine, speed: float, kinds: tuple[tuple[str, int], ...]) -> Parts:
    """Violations of a machine [file units] that hold all the departures named, each in its size.

    The machine is as its owner knows it, its bearing with the larger load gives the measure; a kind is a name
    from `DEPARTURES`, the speed is that of the drop [rad/s].
    """
    shares = [float(share) for share in bearing_load_shares(machine)]
    load, bearing = max(shares), machine.touchdown_bearings[shares.index(max(shares))]
    support, gap, described = bearing.support, float(bearing.air_gap), bearing.contact
    contact = contact_law(float(described.stiffness), float(described.exponent), float(described.damping))
    stiffness, mass = float(support.stiffness), float(support.mass)
    tangent = float(contact_tangent(contact, PEAK_LOADS * load))
    measures = {
        "load": (load, "N"),
        "static travel": (load / stiffness, "m"),
        "support mass": (mass, "kg"),
        "support stiffness": (stiffness, "N/m"),
        "support frequency": (math.sqrt(stiffness / mass) / (2.0 * math.pi), "Hz"),
        "tangent": (tangent, "N/m"),
        "tilt frequency": (math.sqrt(tangent / (0.5 * float(bearing.race.mass))) / (2.0 * math.pi), "Hz"),
        "gap": (gap, "m"),
        "heat": (0.01 * load * speed * float(bearing.bore_radius), "J"),
        "length": (machine.rotor.node_positions[-1], "m"),
        "unbalance": (sum(float(unbalance.amount) for unbalance in machine.unbalances), "kg m"),
        "fall": (math.sqrt(2.0 * gap / standard_gravity), "s"),
        "speed": (speed / (2.0 * math.pi), "Hz"),
    }
    nodes = len(machine.rotor.node_positions)

    def written(size: int, value: Any) -> Any:
        if value == "middle node":
            return (nodes + 1) // 2
        if not isinstance(value, list):
            return value
        if len(value) == 2:
            return value[size]
        if value[2] != "law":
            measure, unit = measures[value[2]]
            return f"{value[size] * measure:.6g} {unit}"
        # softer when light, stiffer when heavy, as a race that is not round comes to bear
        points = ((1.0, value[size][0]), (PEAK_LOADS, 1.0), (4.0 * PEAK_LOADS, value[size][1]))
        return [
            {"depth": f"{part * float(depth_at(contact, n * load)):.6g} m", "force": f"{n * load:.6g} N"}
            for n, part in points
        ]

    parts: Parts = {}
    for kind, size in kinds:
        for part, keys in DEPARTURES[kind].items():
            own = {key: written(size, value) for key, value in keys.items()}
            parts[part] = parts.get(part, {}) | own
    if "centre" in parts:  # the bearings stand apart from each other, or nothing would change
        parts["bearing"] = {machine.touchdown_bearings[0].name: {"centre": parts.pop("centre")}}
    return parts
