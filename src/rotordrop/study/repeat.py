"""The virtual repeat: what else could have happened, and what the next drop will be.

A recorded drop is one draw. With what is known of the machine, and with the chances that no drop shares with
another (rotor angle, remanent lift), many draws are simulated: among them lies the recorded one, and the
worst of them is worse.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.elements.table import parameter
from rotordrop.errors import UsageError
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.rotor.unknowns import smallest_gap
from rotordrop.study.between_drops import next_draw
from rotordrop.study.distributions import Distribution
from rotordrop.study.plan import Study
from rotordrop.study.summary import COVER, StudyResults, quantile, share_of

Array = NDArray[np.float64]

COMPARED: Mapping[str, str] = {
    "peak_force_N": "peak_force",
    "peak_stress_Pa": "peak_stress",
    "severity.impulse_N_s": "impulse",
    "severity.skid_energy_J": "contact_energy",
}
"""Numbers of an estimate, and the column of a study below its bearing that is the same."""
RAYLEIGH_MEDIAN, RAYLEIGH_SPREAD = math.sqrt(2.0 * math.log(2.0)), math.pi / math.sqrt(24.0)
"""Median and standard deviation of the logarithm of the length of two normal parts of unit spread [1]."""
OFF_CENTRE, LARGEST_ORBIT = 0.05, 0.05
"""Standard deviation of where a magnet holds the rotor, and largest synchronous orbit there, over the
smallest air gap [1]."""


@dataclass(frozen=True, kw_only=True)
class Repeat:
    """One quantity among the drops that could have happened."""

    column: str
    """Column of the study."""
    median: Known
    """Half of the drops stay below."""
    low: Known
    high: Known
    """Between them lie 90 % of the drops: the prediction of the next one."""
    worst: Known
    """Half of all sets of `of` drops have a worst one below this."""
    of: int
    """Drops of such a set."""
    recorded: Known | None = None
    """The number of the recorded drop."""
    place: Known | None = None
    """Share of the drops that were milder than the recorded one [1]."""


def repeat_study(
    machine: Machine, speed: float, *, duration: float, drops: int = 500, seed: int = 1, **settings: Any
) -> Study:
    """Study of the drops that could have happened at a speed [rad/s].

    What is calibrated varies by its joint distribution, the rotor angle over the whole turn. The remanent
    lift of each magnet is that of another drop, as `next_draw` has it from the drops of the calibration; its
    time and the unbalances are as a filter takes them before it reads a record. Each magnet holds the rotor
    beside its centre, on an orbit of its own.
    """
    if not machine.ambs:
        raise UsageError("a virtual repeat starts levitated, but the machine has no AMBs; describe them")
    origin = machine.calibration
    joint = origin is not None and origin.joint is not None
    described = machine.remanence_time_constant
    time = REMANENCE_TIME if described is None else float(described)
    row = parameter("remanence.time_constant", "drop")
    vary = {"remanence_time": Distribution(shape="log_normal", numbers=(time, row.guess_sigma))}
    lifts = () if origin is None else [lift for drop in origin.drops for lift in drop.lift]
    spread = parameter("remanent_force.y", "magnet").guess_sigma
    up = next_draw([(lift.up, lift.up_error) for lift in lifts], spread)
    sideways = next_draw([(lift.sideways, lift.sideways_error) for lift in lifts], spread)
    gap = smallest_gap(machine)
    for amb in machine.ambs:
        vary |= {f"{amb.name}.remanent_share": up, f"{amb.name}.remanent_share_x": sideways}
        beside = Distribution(shape="normal", numbers=(0.0, OFF_CENTRE * gap))
        vary |= {f"{amb.name}.{name}": beside for name in ("offset_x", "offset_y")}
        vary[f"{amb.name}.orbit"] = Distribution(shape="uniform", numbers=(0.0, LARGEST_ORBIT * gap))
        vary[f"{amb.name}.orbit_phase"] = Distribution(shape="uniform", numbers=(0.0, 2.0 * math.pi))
    for k, unbalance in enumerate(machine.unbalances):
        median = RAYLEIGH_MEDIAN * max(float(unbalance.amount), 1e-9)
        vary[f"unbalance.{k}.amount"] = Distribution(shape="log_normal", numbers=(median, RAYLEIGH_SPREAD))
        vary[f"unbalance.{k}.phase"] = Distribution(shape="uniform", numbers=(0.0, 2.0 * math.pi))
    return Study(
        name=f"virtual repeat of {machine.name} at {speed / (2.0 * math.pi):.4g} Hz",
        machine=machine,
        drops=drops,
        seed=seed,
        duration=duration,
        speed=speed,
        vary=vary,
        calibrated=joint,
        **({"shard": 20} | settings),
    )


def repeats(
    results: StudyResults, recorded: Mapping[str, Known] | None = None, *, worst_of: int = 100
) -> tuple[Repeat, ...]:
    """Every compared quantity of every bearing among the drops of a study.

    Parameters
    ----------
    results : StudyResults
        Of a `repeat_study`.
    recorded : mapping, optional
        Numbers of the recorded drop by column.
    worst_of : int
        How many drops the worst one is of.
    """
    if worst_of < 2:
        raise UsageError(f"worst of {worst_of}; expected two drops or more")
    told = recorded or {}
    tail = 0.5 * (1.0 - COVER)
    found = []
    for bearing in results.study.machine.touchdown_bearings:
        for name in COMPARED.values():
            column = f"{bearing.name}.{name}"
            values = results.column(column)
            mine = told.get(column)
            found.append(
                Repeat(
                    column=column,
                    median=quantile(values, 0.5),
                    low=quantile(values, tail),
                    high=quantile(values, 1.0 - tail),
                    worst=quantile(values, 0.5 ** (1.0 / worst_of)),
                    of=worst_of,
                    recorded=mine,
                    place=None if mine is None else place_among(values, mine),
                )
            )
    return tuple(found)


def place_among(values: ArrayLike, recorded: Known) -> Known:
    """Share of simulated drops below a recorded number [1], with the interval of their number and its error.

    Each simulated drop counts with the probability that it was milder, by the interval of the recorded one;
    Clopper and Pearson's interval for that count, at the ends of the recorded one.
    """
    x = np.asarray(values, dtype=np.float64)
    x = x[np.isfinite(x)]
    n = len(x)
    if n == 0:
        return share_of(math.nan, 0, 0, 0)
    low, high = recorded.low, recorded.high
    sigma = max((high - low) / (2.0 * NINETY), 1e-12 * max(abs(recorded.value), 1e-300))
    least, most = int(np.count_nonzero(x < low)), int(np.count_nonzero(x < high))
    return share_of(float(np.mean(ndtr((recorded.value - x) / sigma))), least, most, n)


def recorded_numbers(document: Mapping[str, Any]) -> dict[str, Known]:
    """Numbers of a recorded drop by column of a study, from the document of its estimate.

    Raises
    ------
    UsageError
        If it is no estimate of one drop.
    """
    if "bearings" not in document or "speed_Hz" not in document:
        raise UsageError(
            "the file is no estimate of one drop; give one that 'rotordrop estimate --json' wrote"
        )
    found = {}
    for bearing, numbers in document["bearings"].items():
        for key, column in COMPARED.items():
            entry: Any = numbers
            for part in key.split("."):
                entry = entry.get(part) if isinstance(entry, Mapping) else None
            if entry is not None and entry.get("value") is not None:
                interval = entry.get("interval_90")
                found[f"{bearing}.{column}"] = Known(
                    value=float(entry["value"]),
                    interval_90=None if interval is None else (float(interval[0]), float(interval[1])),
                )
    return found
