"""The recorder, whose clock may be off."""

from __future__ import annotations

from typing import Any

from rotordrop.elements.parameter import Entry, Extension, Parameter, Values, in_words, itself, of_one_unknown
from rotordrop.physics import columns as L


def _clock(_machine: Any, found: Values, _load: float) -> str:
    slow = itself(found["clock_error"])
    return f"a second of the record lasts {in_words((1.0 + slow[0], 1.0 + slow[1], 1.0 + slow[2]), 's')}"


EXTENSIONS: tuple[Extension, ...] = (
    of_one_unknown(
        Parameter(
            path="clock_error",
            owner="drop",
            label="length of a second of the record beyond a second",
            kind="dimensionless",
            logarithmic=False,
            # clocks are right to 1e-4; what is off is a rate that was written down rounded (chosen)
            guess_sigma=0.005,
            given_sigma=1e-4,
            lower=-0.03,
            upper=0.03,
            measured_by="the sampling rate of the recorder, against a frequency that is known",
            entries=(Entry(array="spin", column=L.CLOCK_ERROR),),
        ),
        "sampling clock",
        0.0,
        _clock,
    ),
)
