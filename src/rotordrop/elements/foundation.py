"""A foundation that gives way under a support: a mode of its own, told in the description of the support."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.extension import Extension, Values, derived, guess, in_words, itself
from rotordrop.elements.parameter import Parameter, bearing_entries
from rotordrop.known import Known
from rotordrop.physics import columns as L

Array = NDArray[np.float64]

FOUNDATION_FREQUENCY = 0.4
"""Natural frequency of a foundation over that of the support on it, to begin with [1]."""


def foundation_sag(row: Array, load: float) -> float:
    """Deflection [m] of a foundation under a static load [N]."""
    speed, share = float(row[L.FOUNDATION_SPEED]), max(float(row[L.FOUNDATION_SHARE]), 0.0)
    return 0.0 if share == 0.0 else load * share / (float(row[L.SUPPORT_MASS_Y]) * speed**2)


def foundation_states(bearing: Any) -> int:
    """Number of further states of a touchdown bearing: displacement and velocity (x, y), or none."""
    return L.FOUNDATION_STATES if bearing.support.foundation_share is not None else 0


def _neutral(bearing: Any) -> dict[str, Known]:
    natural = math.sqrt(float(bearing.support.stiffness) / float(bearing.support.mass))
    return {
        "support.foundation_share": guess(0.02),
        "support.foundation_damping_ratio": guess(0.03),
        "support.foundation_frequency": guess(FOUNDATION_FREQUENCY * natural),
    }


def _mode(bearing: Any, found: Values, _load: float) -> str:
    frequency = itself(found["support.foundation_frequency"])
    modal = derived(
        lambda m, part: m / max(part, 1e-9), found["support.mass"], found["support.foundation_share"]
    )
    return (
        f"under {bearing.name} a foundation mode at {in_words(frequency, 'Hz', 2.0 * math.pi)} with a modal "
        f"mass of {in_words(modal, 'kg')}"
    )


EXTENSIONS: tuple[Extension, ...] = (
    Extension(
        name="foundation mode",
        owner="bearing",
        names=("support.foundation_share", "support.foundation_damping_ratio"),
        neutral=_neutral,
        sentence=_mode,
        rows=(
            Parameter(
                path="support.foundation_share",
                label="support mass over foundation mass",
                kind="dimensionless",
                logarithmic=False,
                guess_sigma=0.06,
                given_sigma=0.01,
                lower=0.0,
                entries=bearing_entries(L.FOUNDATION_SHARE),
            ),
            Parameter(
                path="support.foundation_frequency",
                label="natural frequency of the foundation",
                kind="speed",
                guess_sigma=0.3,
                given_sigma=0.05,
                reach=5.0,
                entries=bearing_entries(L.FOUNDATION_SPEED),
            ),
            Parameter(
                path="support.foundation_damping_ratio",
                label="damping ratio of the foundation",
                kind="dimensionless",
                guess_sigma=0.5,
                given_sigma=0.2,
                reach=8.0,
                entries=bearing_entries(L.FOUNDATION_DAMPING),
            ),
        ),
    ),
)
