"""What the machines of the bench have and their descriptions do not, in the measure of the machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
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


@dataclass(frozen=True, kw_only=True)
class _Measures:
    """Typical sizes of a machine, of its bearing with the larger load."""

    weight: float
    support_stiffness: float
    support_mass: float
    gap: float
    surface_speed: float
    race_mass: float
    length: float
    unbalance: float
    speed: float
    middle: int
    contact: Any

    @property
    def fall_time(self) -> float:
        """Time of a free fall through the air gap [s]."""
        return math.sqrt(2.0 * self.gap / standard_gravity)

    @property
    def support_frequency(self) -> float:
        """Natural frequency of support mass on support spring [Hz]."""
        return math.sqrt(self.support_stiffness / self.support_mass) / (2.0 * math.pi)


def _si(value: float, unit: str) -> str:
    return f"{value:.6g} {unit}".strip()


def _contact_law(m: _Measures, size: int) -> Parts:
    """Softer when light, stiffer when heavy, as a race that is not round comes to bear."""
    softer, stiffer = ((1.25, 0.95), (1.6, 0.85))[size]
    points = [(1.0, softer), (PEAK_LOADS, 1.0), (4.0 * PEAK_LOADS, stiffer)]
    law = [
        {
            "depth": _si(factor * float(depth_at(m.contact, loads * m.weight)), "m"),
            "force": _si(loads * m.weight, "N"),
        }
        for loads, factor in points
    ]
    return {"contact": {"law": law}}


def _tilt(m: _Measures, size: int) -> Parts:
    stiffness = (4.0, 1.5)[size] * float(contact_tangent(m.contact, PEAK_LOADS * m.weight))
    frequency = math.sqrt(stiffness / (0.5 * m.race_mass)) / (2.0 * math.pi)
    return {"race": {"tilt_stiffness": _si(stiffness, "N/m"), "tilt_frequency": _si(frequency, "Hz")}}


DEPARTURES: dict[str, Callable[[_Measures, int], Parts]] = {
    "turned support axes": lambda m, size: {
        "support": {
            "axes_angle": "30 deg",
            "stiffness_ratio": (0.8, 0.65)[size],
            "damping_ratio": (0.8, 0.65)[size],
        }
    },
    "cubic support": lambda m, size: {
        "support": {
            "hardening": (0.15, 0.5)[size],
            "hardening_force": _si(PEAK_LOADS * m.weight, "N"),
            "hardening_radial": True,
        }
    },
    "hysteretic support": lambda m, size: {
        "support": {
            "slip_force": _si((0.2, 0.6)[size] * m.weight, "N"),
            "slip_travel": _si(m.weight / m.support_stiffness, "m"),
        }
    },
    "foundation mode": lambda m, size: {
        "foundation": {
            "mass": _si((20.0, 9.0)[size] * m.support_mass, "kg"),
            "frequency": _si(0.35 * m.support_frequency, "Hz"),
            "frequency_horizontal": _si(0.8 * (0.35 * m.support_frequency), "Hz"),
        }
    },
    "contact exponent": lambda m, size: {"contact": {"exponent": (1.25, 1.5)[size]}},
    "contact law": _contact_law,
    "race tilt": _tilt,
    "friction": lambda m, size: {"friction": {"dynamic": (0.23, 0.3)[size]}},
    "gap drift": lambda m, size: {
        "gap": {"drift": _si(-(0.01, 0.04)[size] * m.gap, "m"), "drift_time": "0.2 s"}
    },
    "thermal gap": lambda m, size: {
        "gap": {
            "closing": _si((0.01, 0.04)[size] * m.gap, "m"),
            "heat": _si(0.1 * m.weight * m.surface_speed * 0.1, "J"),
        }
    },
    "ball phase": lambda m, size: {"balls": {"turn": True}},
    "bearing centres": lambda m, size: {
        "centre": {"x": _si((0.04, 0.1)[size] * m.gap, "m"), "y": _si(-(0.03, 0.07)[size] * m.gap, "m")}
    },
    "sensor lag": lambda m, size: {"sensors": {"time_constant": ("16 us", "80 us")[size]}},
    "cross-axis sensitivity": lambda m, size: {"sensors": {"cross_axis": (0.01, 0.05)[size]}},
    "sensor planes elsewhere": lambda m, size: {
        "sensors": {"plane_shift": _si((0.005, 0.02)[size] * m.length, "m")}
    },
    "brackets that follow the housing": lambda m, size: {"sensors": {"follows_housing": (0.1, 0.3)[size]}},
    "anti-alias filter": lambda m, size: {"sensors": {"anti_alias_frequency": ("8 kHz", "4 kHz")[size]}},
    "long remanence": lambda m, size: {"magnets": {"remanence_time": ("10 ms", "50 ms")[size]}},
    "unbalance beyond its grade": lambda m, size: {"rotor": {"unbalance": (1.5, 3.0)[size]}},
    "rotor stiffness": lambda m, size: {"rotor": {"youngs_modulus": (0.99, 0.97)[size]}},
}
"""Every departure by the name of its kind, in the order of the list of drops."""


LATER_DEPARTURES: dict[str, Callable[[_Measures, int], Parts]] = {
    "ring masses": lambda m, size: {"race": {"mass": (1.5, 2.3)[size]}},
    "side force": lambda m, size: {
        "side_force": {"node": m.middle, "force": _si((0.05, 0.15)[size] * 2.0 * m.weight, "N")}
    },
    "tilted machine": lambda m, size: {"stand": {"tilt": ("1 deg", "3 deg")[size]}},
    "coloured noise": lambda m, size: {"sensors": {"flicker": ("1 um", "3 um")[size]}},
    "sampling clock": lambda m, size: {"sensors": {"clock_error": (0.001, 0.005)[size]}},
    "late speed signal": lambda m, size: {"sensors": {"speed_delay": ("20 ms", "50 ms")[size]}},
    "curved sensors": lambda m, size: {
        "sensors": {"curvature": (0.01, 0.03)[size], "curvature_at": _si(m.gap, "m")}
    },
    "asymmetric magnet decay": lambda m, size: {
        "magnets": {"pull": (0.1, 0.2)[size], "pull_time": _si((1.0, 3.0)[size] * m.fall_time, "s")}
    },
    "rubbing seal": lambda m, size: {
        "seal": {
            "node": m.middle,
            "gap": 1.02,
            "stiffness": _si((0.05, 0.25)[size] * m.support_stiffness, "N/m"),
        }
    },
    "eccentric sleeve": lambda m, size: {"sleeve": {"eccentricity": _si((0.01, 0.04)[size] * m.gap, "m")}},
    "oval sleeve": lambda m, size: {"sleeve": {"ovality": _si((0.006, 0.018)[size] * m.gap, "m")}},
    "wear": lambda m, size: {
        "friction": {
            "wear": (0.3, 0.6)[size],
            "wear_heat": _si(0.1 * m.weight * m.surface_speed * 0.1, "J"),
        }
    },
    "bowed shaft": lambda m, size: {
        "rotor": {
            "bow": _si((0.01, 0.04)[size] * m.gap, "m"),
            "bow_speed": _si(m.speed / (2.0 * math.pi), "Hz"),
        }
    },
}
"""Departures that came with version 2 of the list. Sizes are chosen, not measured, beside those found when
recordings of other code were estimated: masses of rings, speed signal, clock, noise and tilt."""


LATEST_DEPARTURES: dict[str, Callable[[_Measures, int], Parts]] = {
    "seat play": lambda m, size: {"balls": {"seat_play": _si((0.01, 0.04)[size] * m.gap, "m")}},
}
"""Departures that came with version 3; sizes are chosen: those of fits from h6/H7 to worn seats."""


def departures(machine: Machine, speed: float, kinds: tuple[tuple[str, int], ...]) -> Parts:
    """Violations of a machine [file units] that hold all the departures named, each in its size.

    The machine is as its owner knows it; a kind is a name from `DEPARTURES`, `LATER_DEPARTURES`,
    `LATEST_DEPARTURES`, or "unbalance jump".
    """
    shares = [float(share) for share in bearing_load_shares(machine)]
    bearing = machine.touchdown_bearings[shares.index(max(shares))]
    contact = bearing.contact
    m = _Measures(
        weight=max(shares),
        support_stiffness=float(bearing.support.stiffness),
        support_mass=float(bearing.support.mass),
        gap=float(bearing.air_gap),
        surface_speed=speed * float(bearing.bore_radius),
        race_mass=float(bearing.race.mass),
        length=machine.rotor.node_positions[-1],
        unbalance=sum(float(unbalance.amount) for unbalance in machine.unbalances),
        speed=speed,
        middle=(len(machine.rotor.node_positions) + 1) // 2,
        contact=contact_law(float(contact.stiffness), float(contact.exponent), float(contact.damping)),
    )
    parts: Parts = {}
    known = {**DEPARTURES, **LATER_DEPARTURES, **LATEST_DEPARTURES, "unbalance jump": _jump}
    for kind, size in kinds:
        for part, keys in known[kind](m, size).items():
            parts[part] = parts.get(part, {}) | keys
    if "centre" in parts:  # the bearings stand apart from each other, or nothing would change
        parts["bearing"] = {machine.touchdown_bearings[0].name: {"centre": parts.pop("centre")}}
    return parts


def _jump(m: _Measures, size: int) -> Parts:
    """A piece comes off in the middle of the rotor at the first contact."""
    return {"unbalance_jump": {"node": m.middle, "amount": _si((4.0, 15.0)[size] * m.unbalance, "kg m")}}
