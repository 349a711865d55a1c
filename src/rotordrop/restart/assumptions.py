"""What the restart card takes for granted: kinds of damage, checks, costs. The owner may replace all of it.

None of these numbers is a limit and none was measured here; each names where it comes from. A file of the
owner holds only what differs (TOML, the same keys).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from rotordrop.document import Document, first_fault, read_toml
from rotordrop.errors import UsageError
from rotordrop.units import format_amount

Share = Field(ge=0.0, le=1.0)
Chance = Field(gt=0.0, lt=1.0)
Remedy = Literal["new bearings", "repair"]
ASSUMED = "assumed"


class Effect(Document):
    """How a kind of damage moves a parameter that an estimate finds."""

    median: float
    """Median change with its sign: of the logarithm, or [m] of a parameter that is no factor."""
    spread: float = Field(gt=0.0)
    """Standard deviation of the logarithm of its size [1]."""
    healthy: float = Field(ge=0.0)
    """Standard deviation of its value at one drop of a sound machine, in the unit of the median."""


class Damage(Document):
    """One kind of damage."""

    label: str
    """For people, after "a" or "an"."""
    prior: float = Chance
    """Chance that one drop does it to a bearing, before anything is known of the drop [1]."""
    risk: float = Share
    """Chance that the machine is damaged where it runs on with it until the next planned inspection [1]."""
    remedy: Remedy
    """What ends it once it is seen."""
    moves: dict[str, Effect]
    """Parameters that it moves, by their path at a bearing."""
    of_machine: bool = False
    """Whether it belongs to the rotor and not to one bearing."""
    source: str = ASSUMED


class Check(Document):
    """Something that can be done before a restart, and what it shows."""

    label: str
    days: float = Field(ge=0.0)
    """What it costs, in days of standstill [d]."""
    shows: dict[str, float]
    """Chance that it is bad with a kind of damage, by kind [1]."""
    false_alarm: float = Chance
    """Chance that it is bad though nothing is wrong [1]."""
    source: str = ASSUMED


class Assumptions(Document):
    """Everything the card takes for granted."""

    day_cost: float = Field(default=1.0, gt=0.0)
    """What a day of standstill costs [unit]."""
    bearing_set_cost: float = Field(default=3.0, gt=0.0)
    """What a set of touchdown bearings costs [unit]."""
    machine_cost: float = Field(default=60.0, gt=0.0)
    """What a damaged machine costs, its standstill included [unit]."""
    unit: str = "days of standstill"
    """Of these costs, such as "EUR"."""
    inspection_days: float = Field(default=1.0, gt=0.0)
    """Standstill to open the bearings, look, and close them again [d]."""
    exchange_days: float = Field(default=1.0, gt=0.0)
    """Standstill on top of that to exchange them, or to repair what was found [d]."""
    replace_days: float = Field(default=1.5, gt=0.0)
    """Standstill where they are exchanged in one go, without waiting for what an inspection finds [d]."""
    limited_days: float = Field(default=1.5, ge=0.0)
    """What running with limits costs until the next planned inspection, as days of standstill [d]."""
    limited_risk: float = Field(default=0.4, ge=0.0, le=1.0)
    """Share of the risk that is left where the machine runs with limits [1]."""
    sound_risk: float = Field(default=0.002, ge=0.0, le=1.0)
    """Chance that a machine with sound bearings is damaged until the next planned inspection [1]."""
    most_doubt: float = Field(default=0.01, ge=0.0, le=1.0)
    """Largest chance of a damage with which it may run without limits, checks included; 1 leaves the
    answer to the costs alone [1]."""
    most_beyond: float = Field(default=0.05, gt=0.0, lt=1.0)
    """Chance that the next drop passes a limit, to which a speed limit brings it down [1]."""
    another_drop: float = Field(default=0.2, ge=0.0, le=1.0)
    """Chance of another drop until then [1]."""
    brinelling_stress: float = Field(default=5.25e9, gt=0.0)
    """Hertz stress that dents every second race so that it matters [Pa]: 1.25 times the 4 200 MPa at which
    ISO 76 counts a dent of a ten-thousandth of the ball as bearable; the factor is assumed."""
    brinelling_spread: float = Field(default=0.1, gt=0.0)
    """Standard deviation of the logarithm of that stress [1]; assumed."""
    damages: dict[str, Damage]
    checks: dict[str, Check]
    source: str = ASSUMED
    """Whose the costs and chances are."""

    def cost(self, amount: float) -> str:
        """A cost [unit] in words, "1 day of standstill"."""
        number = format_amount(amount)
        return f"{number} {self.unit.replace('days', 'day', 1) if number == '1' else self.unit}"


BRINELLED = "brinelled"
"""The kind whose prior follows from the peak stress."""

_LOG = math.log
DEFAULT: Mapping[str, Any] = {
    "damages": {
        "worn": {
            "label": "worn landing surface",
            "prior": 0.02,
            "risk": 0.06,
            "remedy": "new bearings",
            "moves": {"air_gap": {"median": 15e-6, "spread": 0.6, "healthy": 2e-6}},
        },
        BRINELLED: {
            "label": "brinelled race",
            "prior": 0.005,
            "risk": 0.25,
            "remedy": "new bearings",
            "moves": {},
            "source": "chance beyond the prior by the peak stress and ISO 76; rest assumed",
        },
        "dragging": {
            "label": "dry or dragging ring",
            "prior": 0.02,
            "risk": 0.4,
            "remedy": "new bearings",
            "moves": {
                "race.drag_coefficient": {"median": _LOG(5.0), "spread": 0.5, "healthy": 0.3},
                "friction.dynamic": {"median": _LOG(1.4), "spread": 0.6, "healthy": 0.05},
            },
        },
        "loose": {
            "label": "loose support or mount",
            "prior": 0.01,
            "risk": 0.2,
            "remedy": "repair",
            "moves": {"support.stiffness": {"median": _LOG(0.6), "spread": 0.6, "healthy": 0.02}},
        },
        "unbalance": {
            "label": "changed unbalance",
            "prior": 0.01,
            "risk": 0.1,
            "remedy": "repair",
            "moves": {"unbalance": {"median": _LOG(2.5), "spread": 0.5, "healthy": 0.1}},
            "of_machine": True,
        },
    },
    "checks": {
        "lift": {
            "label": "lift check of the air gap",
            "days": 0.003,
            "shows": {"worn": 0.9, "loose": 0.3},
            "false_alarm": 0.03,
        },
        "coast-down": {
            "label": "coast-down time against the baseline",
            "days": 0.05,
            "shows": {"dragging": 0.7, "unbalance": 0.6},
            "false_alarm": 0.05,
        },
        "turning": {
            "label": "turning the rings by hand",
            "days": 0.1,
            "shows": {BRINELLED: 0.7, "dragging": 0.9},
            "false_alarm": 0.03,
        },
        "borescope": {
            "label": "borescope",
            "days": 0.2,
            "shows": {"worn": 0.7, BRINELLED: 0.2, "loose": 0.3},
            "false_alarm": 0.03,
        },
        "tail": {
            "label": "record of the rotor at rest in its bearings",
            "days": 0.01,
            "shows": {"worn": 0.6, "loose": 0.4},
            "false_alarm": 0.05,
        },
    },
}
"""Kinds of damage and checks; chances, sizes and durations are assumed where no source stands beside them."""


def assumptions_of(content: Mapping[str, Any], place: str) -> Assumptions:
    """The assumptions of the package with what somebody states otherwise.

    Raises
    ------
    UsageError
        If a key or a value is none of them.
    """
    found = _merged(DEFAULT, content)
    try:
        made = Assumptions.model_validate(found)
    except ValidationError as error:
        raise UsageError(
            f"{place}: {first_fault(error)}; 'rotordrop restart --json' shows all assumptions"
        ) from None
    for name, check in made.checks.items():
        for kind, share in check.shows.items():
            if kind not in made.damages:
                raise UsageError(
                    f"{place}: checks.{name}.shows.{kind}: there is no such damage; there are "
                    f"{', '.join(made.damages)}"
                )
            if not 0.0 <= share <= 1.0:
                raise UsageError(
                    f"{place}: checks.{name}.shows.{kind} = {share:g}; expected a chance from 0 to 1"
                )
    return made


def _merged(base: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """A table with what another one states otherwise, table in table."""
    found = dict(base)
    for key, value in more.items():
        before = found.get(key)
        if isinstance(before, Mapping) and isinstance(value, Mapping):
            value = _merged(before, value)
        found[key] = value
    return found


def load_assumptions(path: str | Path) -> Assumptions:
    """Read what an owner states otherwise (TOML).

    Raises
    ------
    UsageError
        If the file is not there, is no TOML, or states something that is no assumption.
    """
    return assumptions_of(read_toml(path, "assumptions"), str(path))
