"""Ways in which a hidden machine breaks what an estimator takes for granted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rotordrop.errors import UsageError
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.physics.contact import contact_law, stiffness_of_exponent

TYPICAL_CONTACT_FORCE = 1500.0
"""Force [N] at which a contact with another exponent is as deep as the one it replaces."""


@dataclass(frozen=True, kw_only=True)
class Violations:
    """What is true of the hidden machine and unknown to the estimator.

    Attributes
    ----------
    contact_stiffness, contact_damping, race_inertia : float
        Factors on the drawn values [1].
    contact_exponent : float, optional
        Another exponent of the contact [1]; equally deep at 1500 N.
    horizontal_support : float
        Horizontal over vertical support stiffness [1].
    stribeck_speed, static_friction : float
        Factors on the Stribeck speed and on the static friction coefficient [1].
    sensor_plane_shift : float
        Every sensor plane lies this much nearer to the middle of the rotor than stated [m].
    anti_alias_frequency : float, optional
        Corner frequency of a filter before the sampling [Hz] that nobody mentions.
    """

    contact_stiffness: float = 1.0
    contact_damping: float = 1.0
    race_inertia: float = 1.0
    contact_exponent: float | None = None
    horizontal_support: float = 1.0
    stribeck_speed: float = 1.0
    static_friction: float = 1.0
    sensor_plane_shift: float = 0.0
    anti_alias_frequency: float | None = None


VIOLATIONS: dict[str, Violations] = {
    "none": Violations(),
    "contact stiffness +25 %": Violations(contact_stiffness=1.25),
    "contact stiffness -25 %": Violations(contact_stiffness=0.75),
    "contact exponent 1.5": Violations(contact_exponent=1.5),
    "contact damping +50 %": Violations(contact_damping=1.5),
    "race inertia +25 %": Violations(race_inertia=1.25),
    "race inertia -25 %": Violations(race_inertia=0.75),
    "sharper friction": Violations(stribeck_speed=0.2, static_friction=1.3),
    "anisotropic support 0.6": Violations(horizontal_support=0.6),
    "sensor planes 30 mm off": Violations(sensor_plane_shift=0.03),
    "anti-alias filter": Violations(anti_alias_frequency=4000.0),
}


def named_violations(choice: str | Violations) -> Violations:
    """The violations of a name, or the violations themselves."""
    if isinstance(choice, Violations):
        return choice
    if choice not in VIOLATIONS:
        raise UsageError(f"unknown violation {choice!r}; choose one of {', '.join(map(repr, VIOLATIONS))}")
    return VIOLATIONS[choice]


def violated(machine: Machine, violations: Violations) -> Machine:
    """The machine with the violations of its mechanics; those of the sensors belong to the sensor chain."""
    values: dict[str, float] = {}
    for bearing in machine.touchdown_bearings:
        values |= {
            f"{bearing.name}.{path}": value for path, value in _of_bearing(bearing, violations).items()
        }
    return machine.with_values(values) if values else machine


def _of_bearing(bearing: TouchdownBearing, violations: Violations) -> Mapping[str, float]:
    v, contact, support = violations, bearing.contact, bearing.support
    stiffness = float(contact.stiffness) * v.contact_stiffness
    values: dict[str, float] = {}
    if v.contact_exponent is not None:
        law = contact_law(stiffness, float(contact.exponent), float(contact.damping))
        stiffness = stiffness_of_exponent(law, TYPICAL_CONTACT_FORCE, v.contact_exponent)
        values["contact.exponent"] = v.contact_exponent
    factors = {
        "contact.damping": (float(contact.damping), v.contact_damping),
        "race.inertia": (float(bearing.race.inertia), v.race_inertia),
        "friction.stribeck_speed": (float(bearing.friction.stribeck_speed), v.stribeck_speed),
        "friction.static": (float(bearing.friction.static), v.static_friction),
        "support.stiffness_horizontal": (float(support.stiffness_horizontal), v.horizontal_support),
    }
    values |= {path: value * factor for path, (value, factor) in factors.items() if factor != 1.0}
    if stiffness != float(contact.stiffness):
        values["contact.stiffness"] = stiffness
    return values
