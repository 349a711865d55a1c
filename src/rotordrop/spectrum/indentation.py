"""Displacement over a whole coast-down: envelope, largest indentation and when, end of bouncing (Fig. 17)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import RecordError
from rotordrop.series import noise_by_differences
from rotordrop.spectrum.waterfall import PlanarSignal
from rotordrop.units import format_moment

Array = NDArray[np.float64]

BLOCK = 65536
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
    largest_time: float
    """When [s]."""
    largest_indentation: float
    """``largest`` less the air gap [m]."""
    largest_later: float
    """Largest magnitude after ``window`` [m]; nan when the signal ends before."""
    largest_later_time: float
    """When [s]."""
    window: float
    """The time after power-off that a simulation would cover [s]."""
    noise: float
    """Noise of the displacement [m], which lifts every maximum by some four times itself."""
    statement: str
    """Whether the window held the maximum."""


@dataclass(frozen=True, kw_only=True)
class Settling:
    """When the rotor stopped bouncing, and how it lay and swung then."""

    last_lift_off: float
    """Last time the rotor was off the race [s]; from then on it stayed in contact."""
    contact_radius: float
    """Magnitude of displacement in contact [m]."""
    margin: float
    """By how much the magnitude must fall below ``contact_radius`` to count as off the race [m]."""
    settled: bool
    """False when the rotor was still lifting off in the last second of the signal."""
    statement: str


def displacement_history(
    displacement: PlanarSignal,
    sampling_rate: float,
    *,
    air_gap: float,
    start_time: float = 0.0,
    window: float = PAPER_WINDOW,
    intervals: int = 2000,
) -> DisplacementHistory:
    """Give the envelope of a displacement over the whole coast-down and say when the largest indentation
    came.

    Parameters
    ----------
    displacement : shape (N, 2)
        Displacement (x, y) [m] from the centre of the race, in one plane; read in blocks.
    sampling_rate : float
        [Hz].
    air_gap : float
        Radial clearance between rotor and race [m].
    start_time : float
        Time of the first sample after power-off [s].
    window : float
        The time [s] that is asked about: did the maximum fall into it?
    intervals : int
        Length of the envelope [1].

    Returns
    -------
    DisplacementHistory

    Notes
    -----
    Source: Neisi 2020, section 5.4 and Fig. 17. Differs from the paper: it says whether 0.2 s held the
    maximum.
    """
    samples = displacement.shape[0]
    if samples < 2:
        raise RecordError(f"displacement: {samples} samples, at least 2 are needed")
    per_interval = max(1, -(-samples // intervals))
    envelope = _Envelope(per_interval)
    boundary = int(np.ceil((window - start_time) * sampling_rate))
    early, late = (-np.inf, 0), (-np.inf, 0)
    noise: list[float] = []
    for start, xy in _blocks(displacement, per_interval):
        radius = np.hypot(xy[:, 0], xy[:, 1])
        envelope.add(xy, radius)
        cut = min(max(boundary - start, 0), radius.size)
        early = max(early, _peak(radius[:cut], start))
        late = max(late, _peak(radius[cut:], start + cut))
        noise.append(_block_noise(xy))
    largest, at = max(early, late)
    largest_time = start_time + at / sampling_rate
    later_time = start_time + late[1] / sampling_rate
    later = float(late[0]) if np.isfinite(late[0]) else float("nan")
    lowest, highest = envelope.radius()
    lowest_xy, highest_xy = envelope.directions()
    spread = float(np.median(noise))
    middles = (np.arange(lowest.size, dtype=np.float64) + 0.5) * per_interval / sampling_rate
    return DisplacementHistory(
        time=start_time + middles,
        lowest=lowest,
        highest=highest,
        lowest_xy=lowest_xy,
        highest_xy=highest_xy,
        air_gap=air_gap,
        largest=float(largest),
        largest_time=largest_time,
        largest_indentation=float(largest) - air_gap,
        largest_later=later,
        largest_later_time=later_time if np.isfinite(later) else float("nan"),
        window=window,
        noise=spread,
        statement=_window_statement(
            (float(largest), largest_time), (later, later_time), air_gap, window, spread
        ),
    )


def find_settling(
    displacement: PlanarSignal,
    sampling_rate: float,
    *,
    contact_radius: float | None = None,
    margin: float = 8e-6,
    start_time: float = 0.0,
) -> Settling:
    """Find the last time the rotor left the race.

    Parameters
    ----------
    displacement : shape (N, 2)
        Displacement (x, y) [m] from the centre of the race, in one plane.
    sampling_rate : float
        [Hz].
    contact_radius : float, optional
        Magnitude of displacement in contact [m]; the median of the last second if not given.
    margin : float
        By how much the magnitude must be smaller to count as off the race [m]: noise, sensor offset, and
        bending between sensor and bearing make it larger than zero.
    start_time : float
        Time of the first sample [s].

    Returns
    -------
    Settling
    """
    samples = displacement.shape[0]
    last_second = np.asarray(displacement[max(0, samples - int(sampling_rate)) : samples], dtype=np.float64)
    tail = np.hypot(last_second[:, 0], last_second[:, 1])
    radius = float(np.median(tail)) if contact_radius is None else contact_radius
    last = -1
    for start, xy in _blocks(displacement, 1):
        off = np.flatnonzero(np.hypot(xy[:, 0], xy[:, 1]) < radius - margin)
        if off.size:
            last = start + int(off[-1])
    time = start_time + last / sampling_rate
    settled = last < samples - int(sampling_rate)
    if settled:
        text = (
            f"in contact without interruption from {format_moment(time)} on, at {radius * 1e6:.1f} µm from "
            f"the centre; bounces below {margin * 1e6:.0f} µm count as contact"
        )
    else:
        text = (
            f"still lifting off at {format_moment(time)}, within the last second of the signal: "
            "it did not settle"
        )
    return Settling(last_lift_off=time, contact_radius=radius, margin=margin, settled=settled, statement=text)


class _Envelope:
    """Smallest and largest values per interval, gathered block by block."""

    def __init__(self, per_interval: int) -> None:
        self._per = per_interval
        self._low: list[Array] = []
        self._high: list[Array] = []

    def add(self, xy: Array, radius: Array) -> None:
        values = np.column_stack([radius, xy])
        for start in range(0, len(values), self._per):
            cut = values[start : start + self._per]
            self._low.append(cut.min(axis=0))
            self._high.append(cut.max(axis=0))

    def radius(self) -> tuple[Array, Array]:
        return np.array(self._low)[:, 0], np.array(self._high)[:, 0]

    def directions(self) -> tuple[Array, Array]:
        return np.array(self._low)[:, 1:], np.array(self._high)[:, 1:]


def _blocks(displacement: PlanarSignal, per_interval: int) -> Iterator[tuple[int, Array]]:
    step = max(BLOCK // per_interval, 1) * per_interval
    for start in range(0, displacement.shape[0], step):
        yield start, np.asarray(displacement[start : start + step], dtype=np.float64)


def _peak(radius: Array, start: int) -> tuple[float, int]:
    if radius.size == 0:
        return -np.inf, start
    at = int(radius.argmax())
    return float(radius[at]), start + at


def _block_noise(xy: Array) -> float:
    """Noise of one direction [m], from third differences, which a smooth motion leaves near zero."""
    if len(xy) < 8:
        return 0.0
    return noise_by_differences(xy, 3)


def _window_statement(
    maximum: tuple[float, float], after: tuple[float, float], air_gap: float, window: float, noise: float
) -> str:
    (largest, time), (later, later_time) = maximum, after
    first = (
        f"largest displacement {largest * 1e6:.1f} µm ({(largest - air_gap) * 1e6:+.1f} µm beyond the air "
        f"gap) at {format_moment(time, 4)}"
    )
    if not np.isfinite(later):
        return f"{first}; the signal ends within {window:g} s"
    second = f"later than {window:g} s at most {later * 1e6:.1f} µm (at {format_moment(later_time, 2)})"
    if abs(largest - later) <= 2.0 * noise and time <= window:
        return f"{first}; {second}: the noise of {noise * 1e6:.2f} µm leaves open which was larger"
    held = "held the maximum" if time <= window else "did not hold the maximum"
    return f"{first}; {second}: the first {window:g} s {held}"


def held_maximum(history: DisplacementHistory) -> bool:
    """True when the largest displacement fell into the first window (0.2 s in the paper)."""
    return history.largest_time <= history.window
