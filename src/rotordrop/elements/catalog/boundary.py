"""Boundary dimensions and classes of radial ball bearings."""

from __future__ import annotations

from typing import Literal, get_args

PreloadClass = Literal["light", "medium", "heavy"]
PRELOAD_CLASSES: tuple[PreloadClass, ...] = get_args(PreloadClass)
PRELOAD_FACTOR = 2.0
"""Factor to which the preload of a class of one maker is known from that of others [1]."""

# Bore, outside diameter, width [mm] by dimension series of ISO 15. Widths of series 18, 19 and 10 are those
# of width series 1, those of series 02 of width series 0.
_SERIES_18 = """
3 7 2  4 9 2.5  5 11 3  6 13 3.5  7 14 3.5  8 16 4  9 17 4  10 19 5  12 21 5  15 24 5  17 26 5  20 32 7
25 37 7  30 42 7  35 47 7  40 52 7  45 58 7  50 65 7  55 72 9  60 78 10  65 85 10  70 90 10  75 95 10
80 100 10  85 110 13  90 115 13  95 120 13  100 125 13  105 130 13  110 140 16  120 150 16  130 165 18
140 175 18  150 190 20  160 200 20  170 215 22  180 225 22  190 240 24  200 250 24  220 270 24  240 300 28
260 320 28  280 350 33  300 380 38  320 400 38  340 420 38  360 440 38  400 500 46  420 520 46  440 540 46
460 580 56  480 600 56
"""
_SERIES_19 = """
3 8 3  4 11 4  5 13 4  6 15 5  7 17 5  8 19 6  9 20 6  10 22 6  12 24 6  15 28 7  17 30 7  20 37 9
25 42 9  30 47 9  35 55 10  40 62 12  45 68 12  50 72 12  55 80 13  60 85 13  65 90 13  70 100 16
75 105 16  80 110 16  85 120 18  90 125 18  95 130 18  100 140 20  105 145 20  110 150 20  120 165 22
130 180 24  140 190 24  150 210 28  160 220 28  170 230 28  180 250 33  190 260 33  200 280 38  220 300 38
240 320 38  260 360 46  280 380 46  300 420 56  320 440 56  340 460 56  360 480 56  380 520 65  400 540 65
420 560 65  440 600 74  460 620 74  480 650 78
"""
_SERIES_10 = """
3 9 3  4 12 4  5 14 5  6 17 6  7 19 6  8 22 7  9 24 7  10 26 8  12 28 8  15 32 9  17 35 10  20 42 12
22 44 12  25 47 12  28 52 12  30 55 13  32 58 13  35 62 14  40 68 15  45 75 16  50 80 16  55 90 18  60 95 18
65 100 18  70 110 20  75 115 20  80 125 22  85 130 22  90 140 24  95 145 24  100 150 24  105 160 26
110 170 28  120 180 28  130 200 33  140 210 33  150 225 35  160 240 38  170 260 42  180 280 46  190 290 46
200 310 51  220 340 56  240 360 56  260 400 65  280 420 65  300 460 74  320 480 74  340 520 82  360 540 82
380 560 82  400 600 90  420 620 90  440 650 94  460 680 100  480 700 100
"""
_SERIES_02 = """
3 10 4  4 13 5  5 16 5  6 19 6  7 22 7  8 24 8  9 26 8  10 30 9  12 32 10  15 35 11  17 40 12  20 47 14
22 50 14  25 52 15  28 58 16  30 62 16  32 65 17  35 72 17  40 80 18  45 85 19  50 90 20  55 100 21
60 110 22  65 120 23  70 125 24  75 130 25  80 140 26  85 150 28  90 160 30  95 170 32  100 180 34
105 190 36  110 200 38  120 215 40  130 230 40  140 250 42  150 270 45  160 290 48  170 310 52  180 320 52
190 340 55  200 360 58  220 400 65  240 440 72
"""
DIMENSION_SERIES = {
    "618": "18",
    "718": "18",
    "619": "19",
    "719": "19",
    "60": "10",
    "70": "10",
    "62": "02",
    "72": "02",
}
"""Dimension series of ISO 15 of a bearing series."""


def _table(text: str) -> dict[float, tuple[float, float]]:
    numbers = [float(word) for word in text.split()]
    return {d: (D, B) for d, D, B in zip(numbers[::3], numbers[1::3], numbers[2::3], strict=True)}


_TABLES = {
    "18": _table(_SERIES_18),
    "19": _table(_SERIES_19),
    "10": _table(_SERIES_10),
    "02": _table(_SERIES_02),
}


def boundary_dimensions(series: str, bore: float) -> tuple[float, float] | None:
    """Outside diameter and width [m] of a bearing series at a bore [m]; None where they are not known.

    Source: ISO 15, dimension series 18, 19, 10 and 02; bores of 3 to 480 mm (02: to 240 mm).
    """
    found = _TABLES[DIMENSION_SERIES[series]].get(round(1e3 * bore, 6))
    return None if found is None else (1e-3 * found[0], 1e-3 * found[1])


def known_bores(series: str) -> tuple[float, ...]:
    """Bores [m] at which the boundary dimensions of a series are known."""
    return tuple(1e-3 * bore for bore in _TABLES[DIMENSION_SERIES[series]])


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
LISTED_BORES = (6e-3, 200e-3)
"""Bores between which the table of clearances holds [m]."""


def clearance_range(group: ClearanceClass, bore: float) -> tuple[float, float] | None:
    """Least and largest radial internal clearance [m] of a class for a bore [m]; None beyond the table.

    It is the play of the free bearing across its diameter; a tight fit takes part of it away.
    Source: ISO 5753-1, deep-groove ball bearings with cylindrical bore, 6 to 200 mm.
    """
    if bore < LISTED_BORES[0]:
        return None
    for upper, *ranges in _RANGES:
        if bore <= 1e-3 * upper * (1.0 + 1e-9):
            least, largest = ranges[CLASSES.index(group)]
            return 1e-6 * least, 1e-6 * largest
    return None
