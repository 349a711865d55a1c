"""What a machine may have beyond the usual model: each extension a few values its description then names."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine

Values = dict[str, Known]


def _guess(value: float) -> Known:
    return Known(value=value, status="guess")


def _of_bearings(**values: float) -> Callable[[Machine], Values]:
    def named(machine: Machine) -> Values:
        bearings = machine.touchdown_bearings
        if any(getattr(b.support, key) is not None for b in bearings for key in values):
            return {}
        names = [bearing.name for bearing in bearings]
        return {f"{name}.support.{key}": _guess(value) for name in names for key, value in values.items()}

    return named


def _of_sensors(key: str, value: float) -> Callable[[Machine], Values]:
    def named(machine: Machine) -> Values:
        if any(getattr(sensor, key) is not None for sensor in machine.sensors):
            return {}
        return {f"sensors.{sensor.name}.{key}": _guess(value) for sensor in machine.sensors}

    return named


FOUNDATION_FREQUENCY = 0.4
"""Natural frequency of a foundation over that of the support on it, to begin with [1]."""


def _foundation(machine: Machine) -> Values:
    values = _of_bearings(foundation_share=0.02, foundation_damping_ratio=0.03)(machine)
    for bearing in machine.touchdown_bearings if values else ():
        own = math.sqrt(float(bearing.support.stiffness) / float(bearing.support.mass))
        values[f"{bearing.name}.support.foundation_frequency"] = _guess(FOUNDATION_FREQUENCY * own)
    return values


REMANENCE_SIGMA = 1.2
"""Standard deviation of the logarithm of the time in which a remanent force decays [1]."""


def _remanence(machine: Machine) -> Values:
    if not machine.ambs or machine.remanence_time_constant is not None:
        return {}
    reach = math.exp(NINETY * REMANENCE_SIGMA)
    long = (REMANENCE_TIME / reach, REMANENCE_TIME * reach)
    return {"remanence_time_constant": Known(value=REMANENCE_TIME, status="guess", range=long)}


BEYOND_GRADE = 3.0
"""Factor on the unbalance that the grade permits [1]."""


def _usual_remanence(machine: Machine) -> Values:
    return {"remanence_time_constant": _guess(REMANENCE_TIME)} if machine.ambs else {}


def _as_described(_: Machine) -> Values:
    return {}


def _unbalance(machine: Machine) -> Values:
    if any(unbalance.beyond_described is not None for unbalance in machine.unbalances):
        return {}
    amounts = {
        f"unbalance.{i}.amount": _guess(BEYOND_GRADE * float(unbalance.amount))
        for i, unbalance in enumerate(machine.unbalances)
    }
    factors = {f"unbalance.{i}.beyond_described": _guess(BEYOND_GRADE) for i in range(len(amounts))}
    return amounts | factors


def _modulus(machine: Machine) -> Values:
    return {} if machine.rotor.stiffness_factor is not None else {"rotor.stiffness_factor": _guess(1.0)}


@dataclass(frozen=True, kw_only=True)
class Extension:
    """Something a machine may have beyond the usual model.

    Attributes
    ----------
    name : str
        What it is called.
    values : callable
        Values that the description of a machine then names, neutral ones to begin with; none where it names
        them already.
    usual : callable
        Values with which a machine says what the usual model says and is followed as with this extension:
        smaller unknown impulses in the fall are no evidence of a long remanence.
    shows_beside : bool
        Whether it can show beside a usual model that fits.
    """

    name: str
    values: Callable[[Machine], Values]
    usual: Callable[[Machine], Values] = _as_described
    shows_beside: bool = True

    def added_to(self, machine: Machine) -> Machine:
        """The machine with this extension."""
        return machine.with_values(self.values(machine))

    def saying_the_usual(self, machine: Machine) -> Machine:
        """The machine followed as with this extension, which says nothing."""
        return machine.with_values(self.usual(machine))


EXTENSIONS: tuple[Extension, ...] = (
    Extension(name="turned support axes", values=_of_bearings(coupling=0.0)),
    Extension(name="cubic support", values=_of_bearings(cubic=0.0)),
    Extension(name="foundation mode", values=_foundation),
    # Stiffness and mass of the supports take a lag up: the likelihood rose by 5 to 16 without one (eight
    # drops of 60 kg rotors), and by 10 at most with one of 2 kHz.
    Extension(name="sensor lag", values=_of_sensors("time_constant", 1e-5), shows_beside=False),
    Extension(name="cross-axis sensitivity", values=_of_sensors("cross_axis", 0.0)),
    Extension(name="brackets that follow the housing", values=_of_sensors("follows_housing", 0.0)),
    Extension(name="sensor planes elsewhere", values=_of_sensors("plane_offset", 0.0)),
    Extension(name="long remanence", values=_remanence, usual=_usual_remanence),
    Extension(name="unbalance beyond its grade", values=_unbalance),
    Extension(name="rotor stiffness", values=_modulus),
)
