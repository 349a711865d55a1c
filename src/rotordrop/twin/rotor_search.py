"""The rotor of a machine of twelve numbers, found from how its readings move together.

Between its contacts a rotor swings freely, and a contact moves every sensor plane at once by its mass, its
inertia and its bending. None of that needs a contact law: the filter of the cross-check says how probable the
readings are with a rotor under any forces at its bearings, and the rotor that makes them likeliest is taken.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Parameter
from rotordrop.errors import RotordropError
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.progress import Progress
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.reduction import Reduction, modes_that_sag
from rotordrop.rotor.unknowns import prior
from rotordrop.track.input_state import corrections_by_record, rotor_likelihood_of
from rotordrop.track.problem import RecordedDrop, build_problem

STEP = 2e-4
"""Step of the derivatives, in standard deviations of the prior [1]; the readings tell thousandths of one."""
FARTHEST = 2.5
"""How far from the middle of its prior a number may be found, in standard deviations [1]."""
ROUNDS = 25
SCANNED = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Where the bending stiffness, the first of the numbers, may begin, in standard deviations [1]."""
USUAL_TRIALS = 150
"""Rotors that a search tries, about: 66, 138 and 174 of three machines of 60, 5 and 386 kg."""
REMAINING = 0.03
"""Standard deviation of the logarithm of the bending stiffness after the search [1]: a beam is not the rotor,
so the readings seem to say more of it than they do."""
REMAINING_FORM = 0.1
"""The same of the other numbers of the form [1]."""


@dataclass(frozen=True, kw_only=True)
class _Unknown:
    """A number of the rotor with its prior, in the measure it is searched in."""

    row: Parameter
    path: str
    mean: float
    sigma: float

    def value(self, deviation: float) -> float:
        """The number at a deviation, in standard deviations."""
        theta = self.mean + self.sigma * deviation
        return math.exp(theta) if self.row.logarithmic else float(theta)


def with_found_rotor(
    machine: Machine, drops: Sequence[RecordedDrop], progress: Progress | None = None
) -> Machine:
    """The machine with the rotor that makes its records likeliest, where a beam stands for it; else itself.

    Of the rotor, what has a range is sought; the records have the readings of the time that is looked at.
    """
    unknowns = []
    for row in machine.rotor.sought():
        known = prior(row, row.described(machine.rotor))
        unknowns.append(_Unknown(row=row, path=row.path_of(""), mean=known.mean, sigma=known.sigma))
    if not unknowns:
        return machine
    # the search asks for the motion of the sensor planes; as many modes throughout, else the likelihood jumps
    basis = Reduction(modes=modes_that_sag(build_rotor_fe(machine)), attachment=False)
    model = build_drop_model(machine, basis)
    corrections = [
        corrections_by_record(build_problem(model, drop, until=float(drop.time[-1]))) for drop in drops
    ]

    trials = itertools.count(1)

    def with_values(deviations: Array) -> Machine:
        return machine.with_values({u.path: u.value(d) for u, d in zip(unknowns, deviations, strict=True)})

    def cost(free: Array) -> float:
        if progress is not None:
            progress("finding the form of the rotor", min(next(trials) / USUAL_TRIALS, 1.0))
        deviations = _within(free)
        try:
            tried = build_drop_model(with_values(deviations), basis)
            total = sum(rotor_likelihood_of(tried, *one) for one in zip(drops, corrections, strict=True))
        except RotordropError:  # no rotor can be so
            return math.inf
        return total + 0.5 * float(np.sum(deviations**2))

    # from the middle of the prior the way down ended in another minimum where a hollow rotor is stiffer
    starts = [np.eye(len(unknowns))[0] * deviation for deviation in SCANNED]
    options = {"eps": STEP, "maxiter": ROUNDS, "gtol": 2.0}
    found = _within(minimize(cost, min(starts, key=cost), method="BFGS", options=options).x)
    return machine.with_values({u.path: _known(u, u.value(d)) for u, d in zip(unknowns, found, strict=True)})


def _within(free: Array) -> Array:
    """Deviations from the prior that stay within the farthest, without an edge on which a search stumbles."""
    return np.asarray(FARTHEST * np.tanh(free / FARTHEST))


def _known(unknown: _Unknown, value: float) -> Known:
    if unknown.row.logarithmic:
        reach = math.exp(NINETY * REMAINING)
        interval = (value / reach, value * reach)
    else:
        interval = (value - NINETY * REMAINING_FORM, value + NINETY * REMAINING_FORM)
    return Known(
        value=value,
        status="estimated",
        interval_90=interval,
        source="likeliest by the readings, without a contact law",
    )
