"""How probable readings are with a rotor, whatever forces act at its bearings: no contact law enters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.rotor.parameters import DropModel
from rotordrop.track.input_state import USUAL_PEAK, corrections_by_record, forward_pass, rotor_of
from rotordrop.track.problem import DropProblem, RecordedDrop, build_problem


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Readings with their errors taken out, and when no force can act; N samples, C channels, B bearings."""

    along: Array
    """Displacement along every sensor [m], shape (N, C)."""
    closed: NDArray[np.bool_]
    """Whether rotor and race cannot touch, shape (N, 2 B)."""


def readings_of(problem: DropProblem) -> Readings:
    """The readings of a problem by what settled tail and machine file say of its sensors."""
    corrections = corrections_by_record(problem)
    return Readings(
        along=((problem.readings - corrections.offsets) / (1.0 + corrections.gain_errors))[
            : len(corrections.radius)
        ],
        closed=np.repeat(corrections.radius < corrections.reach, 2, axis=1),
    )


def rotor_likelihood_of(model: DropModel, drop: RecordedDrop, readings: Readings) -> float:
    """Negative logarithm of the likelihood of readings with a rotor under any forces at its bearings [1].

    Parameters
    ----------
    model : DropModel
        Gives the rotor; its touchdown bearings only say where forces act.
    drop : RecordedDrop
        What the record says; a tail in it costs time and changes nothing here.
    readings : Readings
        Its readings, by what is known of the sensors.
    """
    problem = build_problem(model, replace(drop, tail_level=None), until=float(drop.time[-1]))
    rotor = rotor_of(problem)
    local = np.broadcast_to(USUAL_PEAK * rotor.weight, readings.closed.shape)
    turn = USUAL_PEAK / problem.fall_time
    return forward_pass(rotor, readings.along, readings.closed, local, turn).negative_log_likelihood
