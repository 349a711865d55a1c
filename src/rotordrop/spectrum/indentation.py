"""Displacement over a whole coast-down: envelope, largest indentation and when, impacts (Fig. 17)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.evidence.impacts import Settling, find_impacts
from rotordrop.known import NINETY
from rotordrop.series import noise_by_differences
from rotordrop.spectrum.waterfall import PlanarSignal
from rotordrop.units import format_moment, percent

BLOCK = 65536
LONGEST_FLIGHT = 0.1
"""A rotor is back on its race within this time [s]: across a gap of 2 mm and back gravity takes 0.04 s."""
PAPER_WINDOW = 0.2
"""How long the paper simulates [s] (Neisi 2020, section 5.4)."""


@dataclass(frozen=True, kw_only=True)
class DisplacementHistory:
    """Magnitude of displacement over a coast-down in one plane, with its air-gap window."""

    time: Array
    """Middle of each interval [s], shape (K,)."""
    lowest: Array
    highest: Array
    """Smallest and largest magnitude of displacement within each interval [m], zero-to-peak from the centre,
    shape (K,)."""
    lowest_xy: Array
    highest_xy: Array
    """Smallest and largest displacement (x, y) within each interval [m], shape (K, 2)."""
    air_gap: float
    """Radius of the air-gap window [m]."""
    largest: float
    """Largest magnitude [m]."""
    largest_interval_90: tuple[float, float] | None
    """Interval that holds it with 90 % probability [m]; None where the centre is not estimated."""
    largest_time: float
    """When [s]."""
    largest_indentation: float
    """``largest`` less the air gap [m]."""
    largest_later: float
    """Largest magnitude after `PAPER_WINDOW` [m]; nan when the signal ends before."""
    largest_later_time: float
    """When [s]."""
    largest_indentation_interval_90: tuple[float, float] | None
    largest_later_interval_90: tuple[float, float] | None
    """Intervals that hold the two with 90 % probability [m], the former by gap and centre."""
    noise: float
    """Noise of the displacement [m], which lifts every maximum by some four times itself."""
    statement: str
    """Whether the window held the maximum."""

    @property
    def held_maximum(self) -> bool:
        """Whether the largest displacement fell into `PAPER_WINDOW`."""
        return self.largest_time <= PAPER_WINDOW

    @property
    def held_clearly(self) -> bool:
        """The same where the signal goes on after the window and noise leaves no doubt."""
        return self.held_maximum and self.largest - self.largest_later > 2.0 * self.noise


def displacement_history(
    displacement: PlanarSignal,
    sampling_rate: float,
    *,
    air_gap: float,
    error: float | None = None,
    start_time: float = 0.0,
    intervals: int = 2000,
) -> DisplacementHistory:
    """Give the envelope of a displacement over the whole coast-down and say when the largest indentation
    came.

    The displacement (N, 2) [m] counts from the centre of the race, in one plane, and is read in blocks;
    ``error`` is the standard error of that distance [m], where it is estimated.

    Source: Neisi 2020, section 5.4 and Fig. 17. Differs from the paper: it says whether 0.2 s held the
    maximum.
    """
    samples = displacement.shape[0]
    if samples < 2:
        raise RecordError(f"displacement: {samples} samples, at least 2 are needed")
    per_interval = max(1, -(-samples // intervals))
    boundary = int(np.ceil((PAPER_WINDOW - start_time) * sampling_rate))
    early, late = (-np.inf, 0), (-np.inf, 0)
    noise: list[float] = []
    ends: list[list[Array]] = [[], []]
    block = max(BLOCK // per_interval, 1) * per_interval
    for start in range(0, samples, block):
        xy = np.asarray(displacement[start : start + block], dtype=np.float64)
        radius = np.hypot(xy[:, 0], xy[:, 1])
        values, first = np.column_stack([radius, xy]), np.arange(0, len(xy), per_interval)
        for kept, of in zip(ends, (np.minimum, np.maximum), strict=True):
            kept.append(of.reduceat(values, first))
        cut = min(max(boundary - start, 0), radius.size)
        early = max(early, _peak(radius[:cut], start))
        late = max(late, _peak(radius[cut:], start + cut))
        # from third differences, which a smooth motion leaves near zero
        noise.append(noise_by_differences(xy, 3) if len(xy) >= 8 else 0.0)
    largest, at = max(early, late)
    largest_time = start_time + at / sampling_rate
    later_time = start_time + late[1] / sampling_rate
    later = float(late[0]) if np.isfinite(late[0]) else float("nan")
    lowest, highest = map(np.concatenate, ends)
    spread = float(np.median(noise))
    half = None if error is None else NINETY * error

    def between(value: float, wide: float = 1.0) -> tuple[float, float] | None:
        if half is None or not math.isfinite(value):
            return None
        return value - wide * half, value + wide * half

    middles = (np.arange(len(lowest), dtype=np.float64) + 0.5) * per_interval / sampling_rate
    return DisplacementHistory(
        time=start_time + middles,
        lowest=lowest[:, 0],
        highest=highest[:, 0],
        lowest_xy=lowest[:, 1:],
        highest_xy=highest[:, 1:],
        air_gap=air_gap,
        largest=float(largest),
        largest_interval_90=between(float(largest)),
        largest_time=largest_time,
        largest_indentation=float(largest) - air_gap,
        largest_later=later,
        largest_later_time=later_time if np.isfinite(later) else float("nan"),
        largest_indentation_interval_90=between(float(largest) - air_gap, math.sqrt(2.0)),
        largest_later_interval_90=between(later),
        noise=spread,
        statement=_window_statement(
            (early[0], start_time + early[1] / sampling_rate), (late[0], later_time), spread
        ),
    )


def find_settling(
    displacement: PlanarSignal, sampling_rate: float, *, air_gap: float, start_time: float = 0.0
) -> Settling:
    """Find the impacts of a coast-down and the begin of lasting contact.

    The displacement (N, 2) [m] counts from the centre of the race, in one plane, y up, and begins with the
    fall.
    """
    samples = displacement.shape[0]
    around = int(LONGEST_FLIGHT * sampling_rate)
    found: list[list[NDArray[np.int64]]] = [[], [], []]
    for start in range(0, samples, BLOCK):
        before = max(start - around, 0)
        part = np.asarray(displacement[before : start + BLOCK + around], dtype=np.float64)
        hits = find_impacts(part, sampling_rate, air_gap, noise_by_differences(part, 3), falls=start == 0)
        for kept, touched in zip(found, (hits.touched, hits.surely, hits.perhaps), strict=True):
            at = before + touched
            kept.append(at[(at >= start) & (at < start + BLOCK)])
    begun, surely, perhaps = (start_time + np.concatenate(one) / sampling_rate for one in found)
    return Settling.of(begun, surely, perhaps, start_time + samples / sampling_rate)


def _peak(radius: Array, start: int) -> tuple[float, int]:
    if radius.size == 0:
        return -np.inf, start
    at = int(radius.argmax())
    return float(radius[at]), start + at


def _window_statement(early: tuple[float, float], late: tuple[float, float], noise: float) -> str:
    """When the largest displacement came, and what share of it stood in the other part."""
    held = early[0] >= late[0]
    (largest, time), (other, then) = (early, late) if held else (late, early)
    first = f"largest displacement at {format_moment(time)}"
    if not np.isfinite(other):
        return f"{first}; the signal ends within {PAPER_WINDOW:g} s"
    share = percent(other / (largest or 1.0))
    part = "later than" if held else "until"
    second = f"{part} {PAPER_WINDOW:g} s at most {share} of it (at {format_moment(then)})"
    if held and largest - other <= 2.0 * noise:
        return f"{first}; {second}: the noise of {noise * 1e6:.2f} µm leaves open which was larger"
    did = "held" if held else "did not hold"
    return f"{first}; {second}: the first {PAPER_WINDOW:g} s {did} the largest displacement"
