"""How far a ball stress is known where the balls of a bearing are inferred from its designation."""

from __future__ import annotations

import math

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.known import NINETY, Known
from rotordrop.physics.hertz import race_contact


def inferred_stress_sigma(bearing: BallBearing) -> float:
    """Relative standard deviation [1] of the largest Hertz stress at a force, by balls not known exactly.

    Diameter and conformity set the stress of a loaded ball, the count shares the load: stress goes with its
    third root. They are taken as independent, which is a little too wide: fewer balls are larger ones. Zero
    where the balls are listed.
    """
    parts = [
        _change(bearing, diameters=_ends(bearing.ball_diameter)),
        _change(bearing, conformities=_ends(bearing.conformity_inner)),
    ]
    if bearing.ball_count_range is not None:
        fewest, most = bearing.ball_count_range
        parts.append(math.log(most / fewest) / 3.0)
    return math.hypot(*parts) / (2.0 * NINETY)


def _ends(value: Known) -> tuple[float, float]:
    """Ends of the range of an inferred value; a value twice where it is not inferred."""
    inferred = value.status == "inferred" and value.range is not None
    return value.range if inferred and value.range else (value.value, value.value)


def _change(
    bearing: BallBearing,
    diameters: tuple[float, float] | None = None,
    conformities: tuple[float, float] | None = None,
) -> float:
    """Change of the logarithm of the stress of a ball under a given load between two ends [1]."""
    D_w, f = bearing.ball_diameter.value, bearing.conformity_inner.value
    pairs = zip(diameters or (D_w, D_w), conformities or (f, f), strict=True)
    pitch, angle = bearing.pitch_diameter.value, bearing.contact_angle.value
    low, high = (
        float(race_contact(D, pitch, share, angle, 1.0, inner=True).stress_coefficient) for D, share in pairs
    )
    return abs(math.log(high / low))
