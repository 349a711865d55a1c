"""Radial internal clearance of deep-groove ball bearings by class."""

from __future__ import annotations

from typing import Literal

ClearanceClass = Literal["C2", "CN", "C3", "C4", "C5"]

CLASSES: tuple[ClearanceClass, ...] = ("C2", "CN", "C3", "C4", "C5")

# Bore up to and including [mm]; least and largest clearance of C2, CN, C3, C4, C5 [µm].
_RANGES = (
    (10, (0, 7), (2, 13), (8, 23), (14, 29), (20, 37)),
    (18, (0, 9), (3, 18), (11, 25), (18, 33), (25, 45)),
    (24, (0, 10), (5, 20), (13, 28), (20, 36), (28, 48)),
    (30, (1, 11), (5, 20), (13, 28), (23, 41), (30, 53)),
    (40, (1, 11), (6, 20), (15, 33), (28, 46), (40, 64)),
    (50, (1, 11), (6, 23), (18, 36), (30, 51), (45, 73)),
    (65, (1, 15), (8, 28), (23, 43), (38, 61), (55, 90)),
    (80, (1, 15), (10, 30), (25, 51), (46, 71), (65, 105)),
    (100, (1, 18), (12, 36), (30, 58), (53, 84), (75, 120)),
    (120, (2, 20), (15, 41), (36, 66), (61, 97), (90, 140)),
    (140, (2, 23), (18, 48), (41, 81), (71, 114), (105, 160)),
    (160, (2, 23), (18, 53), (46, 91), (81, 130), (120, 180)),
    (180, (2, 25), (20, 61), (53, 102), (91, 147), (135, 200)),
    (200, (2, 30), (25, 71), (63, 117), (107, 163), (150, 230)),
)
_LEAST_BORE = 6e-3


def clearance_range(group: ClearanceClass, bore: float) -> tuple[float, float] | None:
    """Least and largest radial internal clearance [m] of a class for a bore [m]; None beyond the table.

    It is the play of the free bearing across its diameter; a tight fit takes part of it away.
    Source: ISO 5753-1, deep-groove ball bearings with cylindrical bore, 6 to 200 mm.
    """
    if bore < _LEAST_BORE:
        return None
    for upper, *ranges in _RANGES:
        if bore <= 1e-3 * upper * (1.0 + 1e-9):
            least, largest = ranges[CLASSES.index(group)]
            return 1e-6 * least, 1e-6 * largest
    return None
