"""The search for lines: take the clearest, take it out of the signal, look again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rotordrop.spectrum.detection import Peak, clearest_peak, stretches_of
from rotordrop.spectrum.frequency_path import FrequencyPath
from rotordrop.spectrum.line_extraction import Envelope, Offset, drift_phase, extract, mean_offset, smooth
from rotordrop.spectrum.line_settings import LineSettings
from rotordrop.spectrum.line_spectra import FramePower, frequency_power, offset_power, order_power
from rotordrop.spectrum.naming import LineKind
from rotordrop.spectrum.speed_profile import SpeedProfile

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TURN = 2.0 * math.pi

LASTING = 4
"""Frames [1] in which a line must be seen to be looked for first; what lasts shorter is looked for last."""

LAG = 0.2
"""Time [s] over which the turning of an envelope is measured; unambiguous to ± 2.5 Hz."""

STEADY_PARTNERS = 3
COMBINED_ORDERS = (-2.0, -1.0, 1.0, 2.0)
BESIDE = 25.0
"""Band [Hz] on either side of a moving path whose power is its floor."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundLine:
    """A line that was found, before it has a name; fields as in `rotordrop.spectrum.lines.Line`."""

    kind: LineKind
    frequency: float
    frequency_error: float
    order: float | None
    order_error: float | None
    drift: tuple[float, float]
    width: float
    amplitude: Array
    forward: Array
    backward: Array
    floor: float
    ratio: float
    first_seen: float
    last_seen: float
    existence: float
    phase: Array
    time: Array
    path: Array
    strength: float
    parent: FoundLine | None = None
    multiple: float = 0.0

    def path_of_frequency(self) -> FrequencyPath:
        """Frequency over time, about twenty values per second."""
        step = max(round(0.05 / (self.time[1] - self.time[0])), 1)
        return FrequencyPath(time=self.time[::step], frequency=self.path[::step])


class LineSearch:
    """What is left of the signal while lines are found one after the other."""

    def __init__(
        self,
        signal: Array,
        sampling_rate: float,
        profile: SpeedProfile | None,
        *,
        start_time: float,
        settings: LineSettings,
        highest_frequency: float,
    ) -> None:
        self.settings = settings
        self.highest_frequency = highest_frequency
        self._rate = sampling_rate
        self._profile = profile
        self._start = start_time
        self._time = start_time + np.arange(len(signal)) / sampling_rate
        self._rest = signal - smooth(signal, round(sampling_rate / settings.lowest_frequency))
        self._angle = None if profile is None else profile.angle_at(self._time)
        self._speed = None if profile is None else profile.speed_at(self._time) / TURN
        self.found: list[FoundLine] = []

    def run(self) -> list[FoundLine]:
        """Lasting lines first, then sums and differences, then what is seen for a while, then for a
        moment.
        """
        self._single_lines(speed_change=0.4)
        self._combinations()
        self._single_lines(speed_change=0.0)
        return self.found

    def _single_lines(self, *, speed_change: float) -> None:
        """Take lines out as long as any is seen while the speed falls by such a share of itself."""
        while len(self.found) < self.settings.most_lines:
            steady, orders = self._frequency_view(), self._order_view()
            of_steady = self._clearest(steady, speed_change, order=False)
            of_orders = orders and self._clearest(orders, speed_change, order=True)
            if of_orders and orders and (not of_steady or of_orders.score > of_steady.score):
                self._take(of_orders, orders, order=True)
            elif of_steady:
                self._take(of_steady, steady, order=False)
            else:
                return

    def _clearest(self, view: FramePower, speed_change: float, *, order: bool) -> Peak | None:
        speed = self._at(view.time, self._speed)
        stretches = [
            (first, last)
            for first, last in stretches_of(len(view.time), LASTING)
            if speed[first] - speed[last - 1] >= speed_change * speed[first:last].mean()
        ]
        return clearest_peak(view, self._free(view, order), self.settings.detection, stretches)

    @property
    def _frame(self) -> float:
        """Length of a frame [s]: as set, or a third of a short signal."""
        return min(self.settings.frame, len(self._rest) / self._rate / 3.0)

    def _frequency_view(self) -> FramePower:
        return frequency_power(
            self._rest, self._rate, start_time=self._start, frame=self._frame, highest=self.highest_frequency
        )

    def _order_view(self) -> FramePower | None:
        if self._profile is None or self._speed is None:
            return None
        return order_power(
            self._rest,
            self._rate,
            self._profile,
            start_time=self._start,
            turns=self.settings.turns,
            highest_order=self.settings.highest_order,
            highest_frequency=self.highest_frequency,
            lowest_speed=max(TURN * self.settings.lowest_frequency / self.settings.highest_order, 0.5 * TURN),
        )

    def _free(self, view: FramePower, order: bool) -> Mask:
        """Where a new line may be looked for: not at low frequency, not on the path of a line already taken
        out.
        """
        speed = self._at(view.time, self._speed)
        place = view.coordinate * (speed[:, None] if order else 1.0)
        free = np.broadcast_to(place >= self.settings.lowest_frequency, view.power.shape[:2]).copy()
        length = (
            self.settings.turns / np.maximum(speed, 0.1) if order else np.full(len(view.time), self._frame)
        )
        apart = 2.0 * np.maximum(self.settings.bandwidth, 1.0 / length)
        unit = np.maximum(speed, 0.1) if order else np.ones(len(view.time))
        for line in self.found:
            # Within a frame the speed changes, and with it the path moves across the view.
            low, high = self._path_range(line, view.time, length, order)
            free &= (view.coordinate < (low - apart / unit)[:, None]) | (
                view.coordinate > (high + apart / unit)[:, None]
            )
        return free

    def _path_range(self, line: FoundLine, time: Array, length: Array, order: bool) -> tuple[Array, Array]:
        """Lowest and highest place of a line in each frame, as frequency [Hz] or order [1]."""
        places = []
        for share in (-0.4, -0.2, 0.0, 0.2, 0.4):
            when = time + share * length
            frequency = self._at(when, line.path)
            places.append(frequency / np.maximum(self._at(when, self._speed), 0.1) if order else frequency)
        return np.min(places, axis=0), np.max(places, axis=0)

    def _at(self, time: Array, values: Array | None) -> Array:
        """Values at other times; zero without any."""
        return np.zeros(len(time)) if values is None else np.interp(time, self._time, values)

    def _take(self, peak: Peak, view: FramePower, *, order: bool) -> None:
        """Follow a peak through the signal, note it, and take it out."""
        advance = cast(Array, self._angle if order else TURN * self._time)
        span = view.time[peak.first], view.time[peak.last - 1]
        half = 0.5 * float(np.median(np.diff(view.time))) if len(view.time) > 1 else self._time[-1]
        spoken = (self._time >= span[0] - 2 * half) & (self._time <= span[1] + 2 * half)
        coordinate, offset = peak.coordinate, Offset(value=0.0, error=math.inf)
        for _ in range(3):
            envelope = self._extract(coordinate * advance)
            present = self._present(envelope, peak, spoken)
            alone = present & self._alone(coordinate * advance)
            used = alone if alone.sum() > 0.3 * present.sum() else present
            offset = mean_offset(envelope.value, advance, lag=round(LAG * self._rate), present=used)
            coordinate += offset.value
        phase = coordinate * advance
        if not order and peak.ratio > 6.0:
            envelope = self._extract(phase)
            phase = phase + drift_phase(envelope.value, self._rate, present, span=1.0)
        envelope = self._extract(phase)
        present = self._present(envelope, peak, spoken)
        line = self._describe(envelope, present, peak, view, coordinate, offset.error, order=order)
        self.found.append(line)
        self._remove(envelope, present)

    def _extract(self, phase: Array) -> Envelope:
        return extract(self._rest, self._rate, phase, bandwidth=self.settings.bandwidth)

    def _rate_of(self, phase: Array) -> Array:
        """Frequency [Hz] of a phase at each sample."""
        return cast(Array, np.gradient(phase) * self._rate / TURN)

    def _reachable(self, phase: Array) -> Mask:
        frequency = np.abs(self._rate_of(phase))
        return (frequency >= self.settings.lowest_frequency) & (frequency <= self.highest_frequency)

    def _alone(self, phase: Array) -> Mask:
        """Where no line taken out before, of which something may be left, comes near."""
        frequency = np.abs(self._rate_of(phase))
        alone = np.ones(len(phase), dtype=np.bool_)
        for line in self.found:
            alone &= np.abs(frequency - line.path) > 2.0 * self.settings.bandwidth
        return alone

    def _present(self, envelope: Envelope, peak: Peak, spoken: Mask) -> Mask:
        """Where the line stands clear of the floor; where it was detected if it hardly does."""
        size = np.abs(envelope.value[:, peak.channel])
        clear = (size > 2.0 * peak.floor) & self._reachable(envelope.phase)
        if spoken.mean() < 0.2:
            clear &= spoken
        return clear if clear[spoken].mean() > 0.2 else spoken & self._reachable(envelope.phase)

    def _describe(
        self,
        envelope: Envelope,
        present: Mask,
        peak: Peak,
        view: FramePower,
        coordinate: float,
        error: float,
        *,
        order: bool,
    ) -> FoundLine:
        power = np.where(present[:, None], np.abs(envelope.value) ** 2, 0.0)
        weight = power.sum(axis=1) / power.sum()
        frequency = self._rate_of(envelope.phase)
        mean = float(np.sum(weight * frequency))
        when = self._time[present]
        decided = self._decided(weight, mean)
        resolution = 1.44 * view.spacing
        width = math.sqrt(max(peak.width**2 - resolution**2, 0.0))
        if order:
            speed = mean / coordinate
            kind: LineKind = "order" if decided else "undecided"
            drift = (mean, mean)
            scale = speed
        else:
            speed = self._mean_speed(weight)
            kind = "steady" if decided else "undecided"
            low, high = np.percentile(frequency[present], [5.0, 95.0])
            drift = (float(low), float(high))
            scale = 1.0
        follows = order or (not decided and speed > 0.0)
        return FoundLine(
            kind=kind,
            frequency=mean,
            frequency_error=error * scale,
            order=(coordinate if order else mean / speed) if follows else None,
            order_error=(error if order else error / speed) if follows else None,
            drift=drift,
            width=width * scale,
            amplitude=np.sqrt(power[present].mean(axis=0)),
            forward=_radius(envelope.value[present], 1.0),
            backward=_radius(envelope.value[present], -1.0),
            floor=peak.floor,
            ratio=peak.ratio,
            first_seen=float(when[0]),
            last_seen=float(when[-1]),
            existence=1.0 - self.settings.detection.false_alarm,
            phase=envelope.phase,
            time=self._time,
            path=np.abs(frequency),
            strength=float(power.sum()),
        )

    def _mean_speed(self, weight: Array) -> float:
        return 0.0 if self._speed is None else float(np.sum(weight * self._speed))

    def _decided(self, weight: Array, frequency: float) -> bool:
        """Whether the speed changed enough, while the line was seen, to say whether the line follows it."""
        if self._speed is None:
            return False
        cumulative = np.cumsum(weight)
        first, last = np.searchsorted(cumulative, [0.1, 0.9])
        early, late = float(self._speed[first]), float(self._speed[min(last, len(self._speed) - 1)])
        middle = 0.5 * (early + late)
        if middle <= 0.0:
            return True
        return frequency / middle * abs(late - early) > 2.0 / self._frame

    def _remove(self, envelope: Envelope, present: Mask) -> None:
        """Take a line out of the signal where it is present, fading in and out."""
        reach = round(self._rate / self.settings.bandwidth)
        near = smooth(present.astype(np.float64), reach) > 0.02
        fade = smooth((near & self._reachable(envelope.phase)).astype(np.float64), max(reach // 4, 1))
        self._rest = self._rest - fade[:, None] * envelope.line()

    def _combinations(self) -> None:
        """Lines at a steady one plus or minus an order: look along every such path."""
        if self._angle is None:
            return
        steady = sorted(
            (line for line in self.found if line.kind == "steady"), key=lambda line: -line.strength
        )
        pairs = [(line, k) for line in steady[:STEADY_PARTNERS] for k in COMBINED_ORDERS]
        while pairs and len(self.found) < self.settings.most_lines:
            scored = [(self._along(line.phase + k * self._angle), line, k) for line, k in pairs]
            peak, line, k = max(scored, key=lambda entry: entry[0].score if entry[0] else 0.0)
            if peak is None:
                return
            pairs.remove((line, k))
            if peak.amplitude < float(line.amplitude.max()):
                self._take_combination(peak, line, k)

    def _along(self, phase: Array) -> Peak | None:
        """The peak, if there is one, on a moving path against what lies beside it."""
        turned = 2.0 * self._rest * np.exp(-1j * phase)[:, None]
        view = offset_power(turned, self._rate, start_time=self._start, frame=self._frame, reach=BESIDE)
        usable = self._at(view.time, self._reachable(phase).astype(np.float64)) > 0.99
        length = np.full(len(view.time), self._frame)
        path = np.abs(self._rate_of(phase))
        for line in self.found:
            apart = np.abs([self._at(view.time + s * length, path - line.path) for s in (-0.4, 0.0, 0.4)])
            usable &= apart.min(axis=0) > 2.0 * self.settings.bandwidth * _skirt(line)
        allowed = usable[:, None] & (np.abs(view.coordinate) < 2.5 * view.spacing)
        peak = clearest_peak(
            view, allowed, self.settings.detection, list(stretches_of(len(view.time), LASTING))
        )
        return peak if peak is not None and abs(peak.coordinate) < 1.5 * view.spacing else None

    def _take_combination(self, peak: Peak, partner: FoundLine, k: float) -> None:
        phase = partner.phase + k * cast(Array, self._angle)
        envelope = self._extract(phase)
        present = self._present(envelope, peak, self._reachable(phase))
        power = np.where(present[:, None], np.abs(envelope.value) ** 2, 0.0)
        weight = power.sum(axis=1) / power.sum()
        frequency = np.abs(self._rate_of(phase))
        low, high = np.percentile(frequency[present], [5.0, 95.0])
        when = self._time[present]
        self.found.append(
            FoundLine(
                kind="combination",
                frequency=float(np.sum(weight * frequency)),
                frequency_error=partner.frequency_error,
                order=None,
                order_error=None,
                drift=(float(low), float(high)),
                width=0.0,
                amplitude=np.sqrt(power[present].mean(axis=0)),
                forward=_radius(envelope.value[present], 1.0),
                backward=_radius(envelope.value[present], -1.0),
                floor=peak.floor,
                ratio=peak.ratio,
                first_seen=float(when[0]),
                last_seen=float(when[-1]),
                existence=1.0 - self.settings.detection.false_alarm,
                phase=phase,
                time=self._time,
                path=frequency,
                strength=float(power.sum()),
                parent=partner,
                multiple=k,
            )
        )
        self._remove(envelope, present)


def _skirt(line: FoundLine) -> float:
    """How much more distance a strong line needs than a weak one: a little of it is always left [1]."""
    return 1.0 + max(math.log10(max(line.ratio, 1.0)) - 2.0, 0.0)


def _radius(value: NDArray[np.complex128], direction: float) -> Array:
    """Root-mean-square radius [m] of the forward (+1) or backward (−1) turning part in each plane, shape
    (P,).
    """
    turning = np.abs(value[:, 0::2] + direction * 1j * value[:, 1::2]) / 2.0
    return cast(Array, np.sqrt(np.mean(turning**2, axis=0)))
