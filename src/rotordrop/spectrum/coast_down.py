"""A whole coast-down taken apart: waterfalls, lines, orders, resonances, displacement, speed law.

Of the displacement: its envelope, the largest indentation and when it came, impacts (Fig. 17).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.errors import RecordError
from rotordrop.evidence.impacts import Settling, find_impacts
from rotordrop.files import new_hdf5
from rotordrop.known import NINETY, Known
from rotordrop.one_thread import one_thread
from rotordrop.progress import Progress
from rotordrop.require import each, require
from rotordrop.series import in_parts, noise_by_differences
from rotordrop.spectrum.candidates import Candidate
from rotordrop.spectrum.lines import MOST_LINES, Line, find_lines
from rotordrop.spectrum.orders import OrderTrack, PassedResonance, find_resonances, track_orders, tracking_for
from rotordrop.spectrum.speed import (
    DragFit,
    ExponentialFit,
    SpeedProfile,
    find_standstill,
    fit_drag,
    fit_exponential,
)
from rotordrop.spectrum.waterfall import (
    FEWEST_POINTS,
    PAPER_OVERLAP,
    AmplitudeKind,
    Component,
    PlanarSignal,
    Waterfall,
    points_for,
    waterfalls,
)
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


ORDERS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
BOUNCE_MARGIN = 0.15
"""Time [s] after the last impact from which lines are looked for (chosen)."""
LONGEST_BOUNCE = 0.1
"""Share of the signal [1] that is left out at most."""
RACES_SPUN_UP = 1.0
"""Time [s] from which the speed law is fitted: before it the rotor hands spin to the races."""
SHORTEST_LAW = 3.0
"""Time [s] that is left for the fit at least (chosen)."""
SENSOR_NOISE = 4e-7
"""Noise of a usual displacement sensor [m rms], added to a simulation before lines and orders are looked for:
without it the search would find arithmetic, with less than a recording has what no recording shows."""
LINES_OF_A_SIMULATION = 24
"""Lines looked for at most in a simulation (chosen)."""
_SEED = 2020
"""Of the noise that is added, the same for every simulation, so that its lines come out again."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CoastDownSignal:
    """Displacement and speed of a coast-down, recorded or simulated."""

    planes: Mapping[str, PlanarSignal]
    """Displacement (x, y) [m] by name of the plane, from power-off on, from the centre of the race."""
    air_gap: Mapping[str, float]
    """Radius of the air-gap window of each plane [m]."""
    sampling_rate: float
    """[Hz]."""
    start_time: float
    """Time of the first sample after power-off [s]."""
    profile: SpeedProfile | None
    """Rotor speed."""
    speed_time: Array | None
    speed: Array | None
    """Speed as it was recorded or simulated [s], [rad/s], shape (K,)."""
    recorded: bool
    """False for a simulation."""
    air_gap_error: Mapping[str, float] | None = None
    """Standard error of the air gaps, and of distances from the centre [m], where the signal shows them."""
    centre: str = "the centre of the bearing"
    """Where the displacements count from, in words."""
    standstill: float | None = None
    """When the rotor stopped [s], where that is known and need not be found, as in a simulation."""
    settling: Mapping[str, Settling] = field(default_factory=dict)
    """Impacts in the planes in which a look at the record has found them; sought in the others."""
    force_and_stress: tuple[Mapping[str, Any], ...] = ()
    """When indentation, force and stress were largest, one entry per bearing and quantity, as a simulation
    knows it; empty for a recording, which shows displacement only."""


@dataclass(frozen=True, kw_only=True)
class WaterfallChoice:
    """Which waterfalls are wanted."""

    components: tuple[Component, ...] = ("x", "y", "full")
    """Directions, or forward and backward."""
    amplitude_kind: AmplitudeKind = "zero-to-peak"
    """Said in every label."""
    highest_frequency: float = 600.0
    """[Hz]."""
    points: int | None = None
    """Samples per frame; the paper's when left out, less for a short signal."""
    overlap: float = PAPER_OVERLAP
    """Share of a frame that is used again [1]."""

    def __post_init__(self) -> None:
        for one in each(self.components, "components", str):
            require(one, "a component", str, among=get_args(Component))
        require(self.amplitude_kind, "amplitude_kind", str, among=get_args(AmplitudeKind))
        require(self.highest_frequency, "highest_frequency", float, above=0.0)
        require(self.points, "points", int, least=FEWEST_POINTS, none=True)
        require(self.overlap, "overlap", float, least=0.0, most=0.99)


@dataclass(frozen=True, kw_only=True)
class SpeedLaw:
    """How the rotor slowed down."""

    exponential: ExponentialFit
    """One time constant, as in the paper."""
    drag: DragFit
    """Dry, linear and quadratic drag."""
    standstill: Known
    """When it stopped [s]."""

    def as_json(self) -> dict[str, Any]:
        """Everything known of it, ready for JSON."""
        return stated(
            self,
            "time_constant_s=exponential.time_constant "
            "exponential_residual_rms_rad_s=exponential.residual_rms "
            "exponential_statement=exponential.statement dry_rad_s2=drag.constant linear_1_s=drag.linear "
            "quadratic_1_rad=drag.quadratic drag_residual_rms_rad_s=drag.residual_rms "
            "drag_statement=drag.statement standstill_s",
        )


@dataclass(frozen=True, kw_only=True)
class PlaneAnalysis:
    """What one plane shows."""

    waterfalls: tuple[Waterfall, ...]
    history: DisplacementHistory
    track: OrderTrack | None
    resonances: tuple[PassedResonance, ...]


@dataclass(frozen=True, kw_only=True)
class CoastDownAnalysis:
    """What a coast-down shows, plane by plane and line by line."""

    signal: CoastDownSignal = field(repr=False)
    planes: Mapping[str, PlaneAnalysis] = field(repr=False)
    lines: tuple[Line, ...]
    speed_law: SpeedLaw | None

    def as_json(self) -> dict[str, Any]:
        """All findings, ready for JSON; amplitudes are zero-to-peak in m unless the name says otherwise."""
        return stated(
            self,
            "recorded=signal.recorded sampling_rate_hz=signal.sampling_rate centre=signal.centre "
            "air_gap_m=signal.air_gap speed_law lines planes force_and_stress=signal.force_and_stress "
            "force_and_stress_statements",
            planes={name: _plane_json(plane) for name, plane in self.planes.items()},
            force_and_stress_statements=[str(one["statement"]) for one in self.signal.force_and_stress],
        )


@one_thread()
def analyse_coast_down(
    signal: CoastDownSignal,
    candidates: Sequence[Candidate],
    choice: WaterfallChoice | None = None,
    *,
    progress: Progress | None = None,
) -> CoastDownAnalysis:
    """Take a coast-down apart; the same for a recording and for a simulation.

    The candidates are what lines could be, e.g. from `machine_candidates`; progress is called with a stage
    and the fraction done.
    """
    if not signal.planes:
        raise RecordError("coast-down: no plane given; at least one displacement (x, y) is needed")
    choice, tell = choice or WaterfallChoice(), progress or (lambda stage, fraction: None)
    tell("lines", 0.05)
    read = signal.planes
    if not signal.recorded:  # as a sensor reads it
        dice = np.random.default_rng(_SEED)
        read = {
            name: np.asarray(plane[0 : plane.shape[0]]) + SENSOR_NOISE * dice.standard_normal(plane.shape)
            for name, plane in signal.planes.items()
        }
    settled = [
        signal.settling[name]
        if name in signal.settling
        else find_settling(
            moved, signal.sampling_rate, air_gap=signal.air_gap[name], start_time=signal.start_time
        )
        for name, moved in signal.planes.items()
    ]
    # how long the rotor bounces at the beginning; nothing if it does not settle soon
    last = max((one.contact_from for one in settled if one.contact_from is not None), default=0.0)
    duration = next(iter(signal.planes.values())).shape[0] / signal.sampling_rate
    lines = find_lines(
        read,
        signal.sampling_rate,
        signal.profile,
        start_time=signal.start_time,
        skip=last + BOUNCE_MARGIN - signal.start_time if last < LONGEST_BOUNCE * duration else 0.0,
        candidates=candidates,
        air_gap=float(np.mean(list(signal.air_gap.values()))),
        most_lines=MOST_LINES if signal.recorded else LINES_OF_A_SIMULATION,
    )
    tell("orders and waterfalls", 0.5)
    planes = {  # one after the other: side by side they fill the memory of two
        name: _plane(signal, name, read[name], lines, candidates, choice) for name in signal.planes
    }
    tell("speed", 0.95)
    return CoastDownAnalysis(signal=signal, planes=planes, lines=lines, speed_law=_speed_law(signal))


def _plane(
    signal: CoastDownSignal,
    name: str,
    read: PlanarSignal,
    lines: Sequence[Line],
    candidates: Sequence[Candidate],
    choice: WaterfallChoice,
) -> PlaneAnalysis:
    moved, rate, start = signal.planes[name], signal.sampling_rate, signal.start_time
    error = None if signal.air_gap_error is None else signal.air_gap_error[name]
    track = None
    resonances: tuple[PassedResonance, ...] = ()
    if signal.profile is not None:
        # Where an order crosses another line, a sum or difference included, the sum of both is no resonance.
        others = [
            line.path for line in lines if line.kind in ("steady", "combination") and name in line.forward
        ]
        ends = np.array([start, start + (moved.shape[0] - 1) / rate])
        turns = abs(float(np.diff(signal.profile.angle_at(ends))[0])) / math.tau
        orders, revolutions = tracking_for(turns, ORDERS)
        track = track_orders(
            read,
            rate,
            signal.profile,
            orders=orders,
            start_time=start,
            steady_lines=others,
            revolutions=revolutions,
        )
        resonances = find_resonances(track, name, candidates)
    return PlaneAnalysis(
        waterfalls=_waterfalls(signal, moved, choice),
        history=displacement_history(
            moved,
            rate,
            air_gap=signal.air_gap[name],
            error=error,
            start_time=start,
        ),
        track=track,
        resonances=resonances,
    )


def _waterfalls(
    signal: CoastDownSignal, moved: PlanarSignal, choice: WaterfallChoice
) -> tuple[Waterfall, ...]:
    points = choice.points or points_for(moved.shape[0])
    if moved.shape[0] < points:
        return ()
    speed, profile = None, signal.profile
    if profile is not None:  # a minute at once takes four times its own size
        time = signal.start_time + np.arange(moved.shape[0]) / signal.sampling_rate
        speed = in_parts(profile.speed_at, time)
    return waterfalls(
        moved,
        signal.sampling_rate,
        components=choice.components,
        speed=speed,
        points=points,
        overlap=choice.overlap,
        amplitude_kind=choice.amplitude_kind,
        start_time=signal.start_time,
        highest_frequency=choice.highest_frequency,
    )


def _speed_law(signal: CoastDownSignal) -> SpeedLaw | None:
    time, speed = signal.speed_time, signal.speed
    if time is None or speed is None or time[-1] < RACES_SPUN_UP + SHORTEST_LAW:
        return None
    stopped = signal.standstill
    return SpeedLaw(
        exponential=fit_exponential(time, speed, start=RACES_SPUN_UP),
        drag=fit_drag(time, speed, start=RACES_SPUN_UP),
        standstill=find_standstill(time, speed)
        if stopped is None
        else Known(value=stopped, status="determined", lower=stopped, upper=stopped, unit="s"),
    )


def _plane_json(plane: PlaneAnalysis) -> dict[str, Any]:
    history, track = plane.history, plane.track
    later = {} if np.isfinite(history.largest_later) else {"largest_later_time_s": None}
    found = stated(
        history,
        "largest_displacement_m=largest largest_displacement_interval_90_m=largest_interval_90 "
        "largest_displacement_time_s=largest_time largest_indentation_m "
        "largest_indentation_interval_90_m largest_later_m largest_later_interval_90_m largest_later_time_s "
        "first_0.2_s_held_the_maximum statement",
        **{"first_0.2_s_held_the_maximum": history.held_maximum},
        **later,
    ) | stated(
        plane,
        "resonances waterfalls",
        waterfalls=[
            stated(  # the whole field is in the figure and the record
                fall,
                "component amplitude_kind points overlap resolution_hz "
                "frames frequency_hz rms_over_frames_m=average",
                frames=len(fall.time),
            )
            for fall in plane.waterfalls
        ],
    )
    if track is not None:
        keys = "time_s speed_hz orders turns_per_window=revolutions major_axis_zero_to_peak_m=major_axis"
        found["orders"] = stated(track, keys, speed_hz=track.speed / (2.0 * np.pi))
    return found


FORMAT = "rotordrop frequencies 1"


def write_findings(analysis: CoastDownAnalysis, path: Path) -> None:
    """Write waterfalls, displacement envelopes, tracked orders and speed; the file appears complete or not.

    Every data set carries its ``units``, a waterfall its ``amplitude_kind``. Lines, resonances and statements
    are in the JSON.
    """
    with new_hdf5(path) as file:
        file.attrs["format"] = FORMAT
        file.attrs["recorded"] = analysis.signal.recorded
        for name, plane in analysis.planes.items():
            _write_plane(file.create_group(f"planes/{name}"), plane)
        time, speed = analysis.signal.speed_time, analysis.signal.speed
        if time is not None and speed is not None:
            _put(file, "speed/time", time, "s")
            _put(file, "speed/speed", speed, "rad/s")
            law = analysis.speed_law
            for name, fit in () if law is None else (("exponential", law.exponential), ("drag", law.drag)):
                inside = (time >= fit.start) & (time <= fit.end)
                fitted = np.full(len(time), np.nan)
                fitted[inside] = fit.speed_at(time[inside])
                _put(file, f"speed/{name}_fit", fitted, "rad/s")


def _put(group: Any, name: str, values: Any, unit: str) -> None:
    group.create_dataset(name, data=np.asarray(values)).attrs["units"] = unit


def _write_plane(group: Any, plane: PlaneAnalysis) -> None:
    history, track = plane.history, plane.track
    for name in ("time", "lowest", "highest", "lowest_xy", "highest_xy", "air_gap"):
        called = name.replace("lowest", "smallest").replace("highest", "largest")
        _put(group, f"displacement/{called}", getattr(history, name), "s" if name == "time" else "m")
    for fall in plane.waterfalls:
        place = group.create_group(f"waterfall_{fall.component}")
        place.attrs["points"], place.attrs["overlap"] = fall.points, fall.overlap
        _put(place, "time", fall.time, "s")
        _put(place, "frequency", fall.frequency, "Hz")
        _put(place, "amplitude", fall.amplitude, "m")
        place["amplitude"].attrs["amplitude_kind"] = fall.amplitude_kind
        if fall.speed is not None:
            _put(place, "speed", fall.speed, "rad/s")
    if track is not None:
        _put(group, "orders/time", track.time, "s")
        _put(group, "orders/speed", track.speed, "rad/s")
        _put(group, "orders/order", track.orders, "1")
        _put(group, "orders/major_axis", track.major_axis, "m")
        _put(group, "orders/separable", track.separable, "1")
        group["orders/major_axis"].attrs["amplitude_kind"] = "zero-to-peak"
