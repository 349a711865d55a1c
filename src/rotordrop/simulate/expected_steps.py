"""How many steps a drop will take at least, known before it is simulated.

The integrator is explicit: its step times the fastest rate of the machine stays below a bound, however small
the forces. A support of a milligram or a ring without inertia therefore costs millions of steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.physics.contact import contact_tangent
from rotordrop.rotor.statics import bearing_load_shares

STABLE = 3.3
"""Largest rate times step of the fifth-order pairs on the negative real axis [1]; Hairer & Wanner, II.4."""

MANY_STEPS = 2_000_000
"""Steps from which a drop is worth a warning [1]: some ten seconds of computing."""


@dataclass(frozen=True, kw_only=True)
class ExpectedSteps:
    """The fastest rate of a machine and what it costs."""

    steps: float
    """Least number of steps [1]."""
    rate: float
    """The fastest rate [1/s]."""
    cause: str
    """What is so fast."""

    def __str__(self) -> str:
        """One sentence."""
        return (
            f"at least {self.steps / 1e6:.3g} million steps are needed, because {self.cause} answers within "
            f"{1e6 / self.rate:.2g} µs"
        )


def expected_steps(machine: Machine, duration: float) -> ExpectedSteps:
    """Least number of steps of a drop.

    Parameters
    ----------
    machine : Machine
        The machine.
    duration : float
        Length of the drop [s].
    """
    pairs = zip(machine.touchdown_bearings, bearing_load_shares(machine), strict=True)
    rate, cause = max(found for bearing, load in pairs for found in _rates(bearing, abs(float(load))))
    return ExpectedSteps(steps=duration * rate / STABLE, rate=rate, cause=cause)


def long_run(machine: Machine, duration: float, most_steps: int) -> str | None:
    """Sentence on a simulation that takes millions of steps, None on any other.

    Parameters
    ----------
    machine : Machine
        The machine.
    duration : float
        Time that is simulated [s].
    most_steps : int
        Steps after which the simulation ends unfinished [1].
    """
    expected = expected_steps(machine, duration)
    if expected.steps <= MANY_STEPS:
        return None
    # the steps taken were half of those expected at least
    hopeless = expected.steps > 2.0 * most_steps
    unfinished = f"; it will end unfinished after {most_steps / 1e6:.3g} million" if hopeless else ""
    return f"this will take long: {expected}{unfinished}; Ctrl-C stops it"


def _rates(bearing: TouchdownBearing, load: float) -> Iterator[tuple[float, str]]:
    """Rates [1/s] of what a bearing is made of under a static load [N]; impacts make them somewhat higher."""
    numbers, name = numbers_of(bearing), bearing.name
    _, stiffness, _ = numbers.in_series(contact_tangent(bearing.contact.law, load), load)
    damping = numbers.damping(float(bearing.damping_time), load)
    race, support, friction = bearing.race, bearing.support, bearing.friction
    for what, mass in bearing.masses.items():
        own = stiffness + (float(support.stiffness) if what == "support" else 0.0)
        yield math.sqrt(own / mass), f"the mass of {name}'s {what} ({mass:.3g} kg) on its springs"
        yield damping / mass, f"the bearing damping of {name} on the mass of its {what} ({mass:.3g} kg)"
    yield (
        float(support.damping) / float(support.mass),
        f"the support damping of {name} on its mass ({float(support.mass):.3g} kg)",
    )
    if "race" not in bearing.masses:
        return
    if bearing.face is not None:
        pressed = contact_tangent(bearing.face.law, max(load, 1.0)) / float(race.mass)
        yield math.sqrt(pressed), f"the mass of {name}'s race ({float(race.mass):.3g} kg) on its face"
    grip = float(friction.static) * load * float(bearing.bore_radius) ** 2
    yield (
        grip / (float(friction.smoothing_speed) * float(race.inertia)),
        f"friction on the inertia of {name}'s race ({float(race.inertia):.3g} kg m²)",
    )
