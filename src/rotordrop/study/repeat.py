"""The virtual repeat: what else could have happened, and what the next drop will be.

A recorded drop is one draw. With what is known of the machine, and with the chances that no drop shares with
another (rotor angle, remanent lift), many draws are simulated: among them lies the recorded one, and the
worst of them is worse.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from rotordrop.elements.magnet import FORCES, REMANENCE, REMANENCE_TIME
from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.require import require
from rotordrop.rotor.unknowns import smallest_gap
from rotordrop.study.distributions import Distribution
from rotordrop.study.plan import Study
from rotordrop.study.summary import COVER, StudyResults, quantile, share_of

COMPARED: Mapping[str, str] = {
    "peak_force_N": "peak_force",
    "peak_stress_Pa": "peak_stress",
    "severity.impulse_N_s": "impulse",
    "severity.skid_energy_J": "contact_energy",
}
"""Numbers of an estimate, and the column of a study below its bearing that is the same."""
RAYLEIGH_MEDIAN, RAYLEIGH_SPREAD = math.sqrt(2.0 * math.log(2.0)), math.pi / math.sqrt(24.0)
"""Median and standard deviation of the logarithm of the length of two normal parts of unit spread [1]."""
Estimate = tuple[float, float]
"""A value and its standard error, what was known before the record included."""
SHARES = 64
"""Points over the share that all drops have in common; chosen, not measured."""
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
    require(machine, "machine", Machine)
    require(speed, "speed [rad/s]", float)
    require(duration, "duration [s]", float, above=0.0)
    if not machine.ambs:
        raise UsageError("a virtual repeat starts levitated, but the machine has no AMBs; describe them")
    origin = machine.calibration
    joint = origin is not None and origin.joint is not None
    described = machine.remanence_time_constant
    time = REMANENCE_TIME if described is None else float(described)
    vary = {"remanence_time": Distribution(shape="log_normal", numbers=(time, REMANENCE.guess_sigma))}
    lifts = () if origin is None else [lift for drop in origin.drops for lift in drop.lift]
    spread = FORCES[1].guess_sigma
    up = next_draw([(lift.up, lift.up_error) for lift in lifts], spread)
    sideways = next_draw([(lift.sideways, lift.sideways_error) for lift in lifts], spread)
    gap = smallest_gap(machine)
    for amb in machine.ambs:
        vary |= {f"{amb.name}.remanent_share": up, f"{amb.name}.remanent_share_x": sideways}
        off_centre = Distribution(shape="normal", numbers=(0.0, OFF_CENTRE * gap))
        vary |= {f"{amb.name}.{name}": off_centre for name in ("offset_x", "offset_y")}
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
    """Every compared quantity of every bearing among the drops of a `repeat_study`."""
    if worst_of < 2:
        raise UsageError(f"worst of {worst_of}; expected two drops or more")
    tail = 0.5 * (1.0 - COVER)
    found = []
    for bearing in results.study.machine.touchdown_bearings:
        for name in COMPARED.values():
            column = f"{bearing.name}.{name}"
            values = results.column(column)
            mine = (recorded or {}).get(column)
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


def recorded_numbers(drop: Drop) -> dict[str, Known]:
    """Numbers of a recorded drop by column of a study, from its published estimate."""
    return {
        f"{name}.{column}": Known(value=found.value, interval_90=found.interval)
        for name, bearing in drop.bearings.items()
        for key, column in COMPARED.items()
        if (found := bearing.numbers.get(key)) is not None
    }


def next_draw(recorded: Sequence[Estimate], spread: float) -> Distribution:
    """Distribution of a value in the next drop, from value and standard error in each recorded drop.

    ``spread`` is the standard deviation of a value before any record, which stands in the errors too; all in
    one unit. Before any record each value is normal about zero; which part of that variance all drops share
    is not known. Values that agree speak for a large common part: the next one will then lie near them, and
    no nearer than they lie to one another. The result is normal, with mean and standard deviation of the
    mixture over the unknown common part.

    Source: the normal model of values that may be exchanged, Gelman and others, Bayesian Data Analysis, 2013,
    chapter 5, with the total variance given and the common share uniform between 0 and 1.
    """
    own = []
    for value, error in recorded:
        if error < spread:
            # what the record alone says: the quotient of estimate and prior about zero
            variance = 1.0 / (error**-2 - spread**-2)
            own.append((value * variance / error**2, variance))
    if not own:
        return Distribution(shape="normal", numbers=(0.0, spread))
    parts = [_given_share((k + 0.5) / SHARES, own, spread) for k in range(SHARES)]
    best = max(weight for weight, _, _ in parts)
    weights = [math.exp(weight - best) for weight, _, _ in parts]
    whole = math.fsum(weights)
    mean = math.fsum(w * m for w, (_, m, _) in zip(weights, parts, strict=True)) / whole
    square = math.fsum(w * (v + m * m) for w, (_, m, v) in zip(weights, parts, strict=True)) / whole
    return Distribution(shape="normal", numbers=(mean, math.sqrt(square - mean * mean)))


def _given_share(share: float, own: Sequence[Estimate], spread: float) -> tuple[float, float, float]:
    """Logarithm of the likelihood of a common share, and mean and variance of the next value with it.

    The covariance of the recorded values is diagonal but for the common part c in every entry, so that its
    inverse and determinant are sums.
    """
    common = share * spread**2
    alone = [(1.0 - share) * spread**2 + variance for _, variance in own]
    ones = math.fsum(1.0 / d for d in alone)
    sums = math.fsum(value / d for (value, _), d in zip(own, alone, strict=True))
    squares = math.fsum(value**2 / d for (value, _), d in zip(own, alone, strict=True))
    seen = 1.0 + common * ones
    misfit = squares - common * sums**2 / seen
    size = math.fsum(math.log(d) for d in alone) + math.log(seen)
    return -0.5 * (misfit + size), common * sums / seen, (1.0 - share) * spread**2 + common / seen
