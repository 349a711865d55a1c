"""What the machines of the bench have and their descriptions do not, in the measure of the machine."""

from __future__ import annotations

import math
from typing import Any

from scipy.constants import g as standard_gravity

from rotordrop.machine import Machine
from rotordrop.physics.contact import contact_law, contact_tangent, depth_at
from rotordrop.rotor.statics import bearing_load_shares

Parts = dict[str, dict[str, Any]]

SLIGHT, LARGE = 0, 1
"""Sizes of a departure: as many machines have it, and as only some do."""

PEAK_LOADS = 10.0
"""A typical peak force over the static load of a bearing [1]; chosen, not measured."""

MIDDLE, LAW = "middle node", "law"

DEPARTURES: dict[str, dict[str, Any]] = {
    "turned support axes": {
        "support.axes_angle": "30 deg",
        "support.stiffness_ratio": (0.8, 0.65),
        "support.damping_ratio": (0.8, 0.65),
    },
    "cubic support": {
        "support.hardening": (0.15, 0.5),
        "support.hardening_force": (PEAK_LOADS, PEAK_LOADS, "load"),
    },
    "hysteretic support": {
        "support.slip_force": (0.2, 0.6, "load"),
        "support.slip_travel": (1.0, 1.0, "static travel"),
    },
    "foundation mode": {
        "foundation.mass": (20.0, 9.0, "support mass"),
        "foundation.frequency": (0.35, 0.35, "support frequency"),
        "foundation.frequency_horizontal": (0.28, 0.28, "support frequency"),
    },
    "contact exponent": {"contact.exponent": (1.25, 1.5)},
    "contact law": {"contact.law": ((1.25, 0.95), (1.6, 0.85), LAW)},
    "race tilt": {
        "race.tilt_stiffness": (4.0, 1.5, "tangent"),
        "race.tilt_frequency": (2.0, math.sqrt(1.5), "tilt frequency"),
    },
    "friction": {"friction.dynamic": (0.23, 0.3)},
    "gap drift": {"gap.drift": (-0.01, -0.04, "gap"), "gap.drift_time": "0.2 s"},
    "thermal gap": {"gap.closing": (0.01, 0.04, "gap"), "gap.heat": (1.0, 1.0, "heat")},
    "ball phase": {"balls.turn": True},
    "bearing centres": {"centre.x": (0.04, 0.1, "gap"), "centre.y": (-0.03, -0.07, "gap")},
    "sensor lag": {"sensors.time_constant": ("16 us", "80 us")},
    "cross-axis sensitivity": {"sensors.cross_axis": (0.01, 0.05)},
    "sensor planes elsewhere": {"sensors.plane_shift": (0.005, 0.02, "length")},
    "brackets that follow the housing": {"sensors.follows_housing": (0.1, 0.3)},
    "anti-alias filter": {"sensors.anti_alias_frequency": ("8 kHz", "4 kHz")},
    "long remanence": {"magnets.remanence_time": ("10 ms", "50 ms")},
    "unbalance beyond its grade": {"rotor.unbalance": (1.5, 3.0)},
    "rotor stiffness": {"rotor.youngs_modulus": (0.99, 0.97)},
    # a piece comes off in the middle of the rotor at the first contact
    "unbalance jump": {"unbalance_jump.node": MIDDLE, "unbalance_jump.amount": (4.0, 15.0, "unbalance")},
    "ring masses": {"race.mass": (1.5, 2.3)},
    "side force": {"side_force.node": MIDDLE, "side_force.force": (0.1, 0.3, "load")},
    "tilted machine": {"stand.tilt": ("1 deg", "3 deg")},
    "coloured noise": {"sensors.flicker": ("1 um", "3 um")},
    "sampling clock": {"sensors.clock_error": (0.001, 0.005)},
    "late speed signal": {"sensors.speed_delay": ("20 ms", "50 ms")},
    "curved sensors": {"sensors.curvature": (0.01, 0.03), "sensors.curvature_at": (1.0, 1.0, "gap")},
    "asymmetric magnet decay": {"magnets.pull": (0.1, 0.2), "magnets.pull_time": (1.0, 3.0, "fall")},
    "rubbing seal": {
        "seal.node": MIDDLE,
        "seal.gap": 1.02,
        "seal.stiffness": (0.05, 0.25, "support stiffness"),
    },
    "eccentric sleeve": {"sleeve.eccentricity": (0.01, 0.04, "gap")},
    "oval sleeve": {"sleeve.ovality": (0.006, 0.018, "gap")},
    "wear": {"friction.wear": (0.3, 0.6), "friction.wear_heat": (1.0, 1.0, "heat")},
    "bowed shaft": {"rotor.bow": (0.01, 0.04, "gap"), "rotor.bow_speed": (1.0, 1.0, "speed")},
    "seat play": {"balls.seat_play": (0.01, 0.04, "gap")},
}
"""Every departure by the name of its kind, in the order of the list of drops: keys of a case file with a
value, one for each size, or one for each size as a share of a measure of the machine. Sizes are chosen, not
measured, but for those found when recordings of other code were estimated (masses of rings, speed signal,
clock, noise, tilt) and for play (from fits h6/H7 to worn seats)."""


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
        if value == MIDDLE:
            return (nodes + 1) // 2
        if not isinstance(value, tuple):
            return value
        if len(value) == 2:
            return value[size]
        if value[2] != LAW:
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
        for path, value in DEPARTURES[kind].items():
            part, key = path.split(".")
            parts.setdefault(part, {})[key] = written(size, value)
    if "centre" in parts:  # the bearings stand apart from each other, or nothing would change
        parts["bearing"] = {machine.touchdown_bearings[0].name: {"centre": parts.pop("centre")}}
    return parts
