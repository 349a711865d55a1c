"""The search for lines: take the clearest, take it out of the signal, look again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from rotordrop.arrays import Array, Mask
from rotordrop.series import closed
from rotordrop.spectrum._views import (
    BANDWIDTH,
    BESIDE,
    FIVE_MOMENTS,
    LOWEST_FREQUENCY,
    Clock,
    Envelope,
    FoundLine,
    Near,
    Offset,
    View,
    drift_phase,
    mean_offset,
    path_range,
    power_share,
    radius,
    smooth,
)
from rotordrop.spectrum.candidates import LineKind
from rotordrop.spectrum.waterfall import (
    FALSE_ALARM,
    Peak,
    clearest_peak,
    frame_power,
    median_of_known,
    stretches_of,
)

LASTING = 4
"""Fewest frames [1] in which a line must be seen (chosen)."""

LAGS = (0.2, 0.2, 0.4, 0.8)
"""Times [s] over which the turning of an envelope is measured; 0.2 s is unambiguous to ± 2.5 Hz."""

SHORT_FRAME = 0.25
"""Share [1] of the usual frame in which brief lines are looked for."""

BRIEF = 0.2
"""Share of the signal [1] below which a line is brief (chosen)."""

DECIDED = 2.0
"""Lines of resolution [1] by which an order must move for it to be told from a steady line
(chosen)."""

LEFT_OVER = 0.25
"""Share of a peak's power [1] that may be left when its line is taken out."""

CLOSE = 5.0
"""Bandwidths [1] by which an order may move for a steady line to hold part of its power, and the reverse."""

HARMLESS = 30.0
"""Amplitude over the floor [1] up to which nothing is left of a line that was taken out."""

BLURRED = 0.1
"""Error of a frequency [Hz] from which a line may be the skirt of another."""
SKIRT = 0.03
"""Amplitude of a skirt at 1 Hz from its line, over that of the line [1]; it falls with the distance."""

MOST_REFUSED = 60
"""Peaks that turn out to be no lines, after which the search ends (chosen)."""
BURST = 30.0
"""Amplitude over the usual one [1] from which a brief line is taken out before all others."""

STEADY_PARTNERS = 3
"""Strongest steady lines whose sums and differences with orders are looked for (chosen)."""
SURE_COMBINATION = 25.0
"""Minus the logarithm of the chance of noise [1] for a sum or difference to be believed."""

EVEN, HALF_TURN = 1.0 / math.sqrt(12.0), 0.5
"""Least error of a mean frequency, in resolutions [1]: of what may lie anywhere in one; of an order, whose
phase a resonance turns."""

COMBINED_ORDERS = (-2.0, -1.0, 1.0, 2.0)
"""Orders they are combined with: what 1X and 2X make in a contact that is not linear."""


@dataclass(frozen=True)
class _Refused:
    """A peak that turned out to be no line, and when."""

    of_orders: bool
    coordinate: float
    first: float
    last: float


class LineSearch:
    """What is left of the signal while lines are found one after the other."""

    def __init__(self, signal: Array, clock: Clock, most_lines: int) -> None:
        self._clock, self._most = clock, most_lines
        self._rest = signal - smooth(signal, round(clock.signal_rate / LOWEST_FREQUENCY))
        self._refused: list[_Refused] = []
        self._views: dict[tuple[bool, float], View] = {}
        self._after: tuple[Array, View] | None = None
        self._phases: list[tuple[FoundLine, Array]] = []
        self._reach: dict[tuple[int, bool, float], tuple[Array, Array]] = {}
        self.found: list[FoundLine] = []

    def run(self) -> list[FoundLine]:
        """Strong bursts first, since they blur all else; then lasting lines, sums and differences, the
        rest.
        """
        self._bursts()
        self._single_lines(speed_change=0.4, shares=(1.0,))
        self._combinations()
        self._phases.clear()
        self._single_lines(speed_change=0.0, shares=(1.0, SHORT_FRAME))
        return self.found

    def _bursts(self) -> None:
        """Take out what is strong for a moment only, against what the same frequency usually shows."""
        while len(self._refused) < MOST_REFUSED and self._clock.angle is not None:
            view = self._view(SHORT_FRAME, of_orders=False)
            assert view is not None
            usual = np.median(view.power, axis=0)
            peak = self._clearest(view, 0.0, usual)
            if peak is None or peak.ratio < BURST:
                break
            line, taken = self._follow(peak, view)
            moved = math.inf if line is None else abs(line.frequency - peak.coordinate)
            if line is not None and line.brief and line.kind == "steady" and moved < 0.3 * view.resolution:
                self._keep(line, taken)
            else:
                self._refuse(peak, view)
        self._refused = []

    def _single_lines(self, *, speed_change: float, shares: tuple[float, ...]) -> None:
        """Take lines out as long as any is seen while the speed falls by such a share of itself."""
        while len(self.found) < self._most and len(self._refused) < MOST_REFUSED:
            views = [self._view(share, of_orders) for share in shares for of_orders in (False, True)]
            peaks = [(self._clearest(view, speed_change), view) for view in views if view is not None]
            seen = [(peak, view) for peak, view in peaks if peak is not None]
            if not seen:
                return
            peak, view = max(seen, key=lambda one: one[0].score)
            line, taken = self._follow(peak, view)
            if line is None:
                self._refuse(peak, view)
            else:
                self._keep(line, taken)

    def _view(self, share: float, of_orders: bool) -> View | None:
        """What is left of the signal, seen in frames of a share of the usual length; None if none fits."""
        if (of_orders, share) not in self._views:
            view = (self._clock.order_view if of_orders else self._clock.frequency_view)(self._rest, share)
            if view is None:
                return None
            self._views[of_orders, share] = view
        return self._views[of_orders, share]

    def _keep(self, line: FoundLine, taken: Array) -> None:
        self.found.append(line)
        self._rest = self._rest - taken
        self._views.clear()
        if self._after is not None and self._after[0] is taken:
            seen = self._after[1]  # what was looked at to judge the line is what is left now
            self._views[seen.of_orders, seen.share] = seen
        self._after = None

    def _refuse(self, peak: Peak, view: View) -> None:
        first, last = view.time[[peak.first, peak.last - 1]]
        self._refused.append(_Refused(view.of_orders, peak.coordinate, float(first), float(last)))

    def _clearest(self, view: View, speed_change: float, usual: Array | None = None) -> Peak | None:
        speed = self._clock.at(view.time, self._clock.speed)
        stretches = [
            (first, last)
            for first, last in stretches_of(len(speed), LASTING)
            if speed[first] - speed[last - 1] >= speed_change * speed[first:last].mean()
        ]
        return clearest_peak(view, self._free(view), stretches, usual)

    def _free(self, view: View) -> Mask:
        """Where a new line may be: not at low frequency, not on the path of a line already taken out."""
        time, place, reach = view.time, view.coordinate, self._reach
        unit = np.ones((len(time), len(FIVE_MOMENTS)))
        if view.of_orders:
            moments = [
                self._clock.at(time + share * view.length, self._clock.speed) for share in FIVE_MOMENTS
            ]
            unit = np.maximum(np.column_stack(moments), 0.1)
        middle = unit[:, 2]
        free = place * middle[:, None] >= LOWEST_FREQUENCY
        width = np.maximum(BANDWIDTH, 1.0 / view.length) / middle
        for k, line in enumerate(self.found):
            of_orders = line.kind == "order" or (line.kind == "undecided" and line.order is not None)
            if of_orders != view.of_orders and line.ratio < HARMLESS:
                continue
            apart = width * (2.0 if of_orders == view.of_orders else line.skirt)
            # Within a frame the speed changes, and with it the path moves across the view.
            key = (k, view.of_orders, view.share)  # such frames lie at the same times in every view
            if key not in reach:
                reach[key] = path_range(line, time, view.length, unit)
            low, high = reach[key]
            free &= (
                (place < (low - apart)[:, None]) | (place > (high + apart)[:, None]) | np.isinf(low)[:, None]
            )
        for refused in self._refused:
            if refused.of_orders == view.of_orders:
                then = (time >= refused.first) & (time <= refused.last)
                free &= ~(then[:, None] & (np.abs(place - refused.coordinate) < 2.0 * width[:, None]))
        return free

    def _follow(self, peak: Peak, view: View) -> tuple[FoundLine | None, Array]:
        """Follow a peak through the signal, with the part it takes of it; None if a line only swept past."""
        clock = self._clock
        near = clock.near(self._rest, peak.coordinate * self._advance(view.of_orders, of_signal=True))
        advance = self._advance(view.of_orders)
        spoken = self._spoken(peak, view)
        offset, shift = Offset(value=0.0, error=math.inf), 0.0
        for lag in LAGS:
            envelope = clock.extract(near, shift * advance)
            present = self._present(envelope, peak, spoken)
            used = self._undisturbed(envelope, peak, present, spoken)
            offset = mean_offset(envelope.value, advance, lag=round(lag * clock.rate), present=used)
            shift += offset.value
        coordinate, turn = peak.coordinate + shift, shift * advance
        if not view.of_orders and peak.ratio > 6.0:
            envelope = clock.extract(near, turn)
            turn = turn + drift_phase(envelope.value, clock.rate, present, span=1.0)
        envelope = clock.extract(near, turn)
        present = self._present(envelope, peak, spoken)
        part = self._part(envelope, present)
        taken = clock.line(envelope, part)
        if not self._explained(peak, view, taken) or self._better_otherwise(
            envelope, view, coordinate, spoken
        ):
            return None, taken
        line = self._describe(envelope, present, part, peak, view, coordinate, offset.error)
        if self._skirt(line):
            return None, taken
        if line.kind == "steady":
            self._phases.append((line, envelope.phase))
        return line, taken

    def _advance(self, of_orders: bool, *, of_signal: bool = False) -> Array:
        """What an order, or a frequency [Hz], is multiplied with to be a phase [rad]."""
        clock = self._clock
        if of_orders:
            return cast(Array, clock.signal_angle if of_signal else clock.angle)
        return math.tau * (clock.signal_time if of_signal else clock.time)

    def _skirt(self, line: FoundLine) -> bool:
        """Whether a line is blurred and small beside a strong one: what is left of that one, not a line."""
        if line.kind == "order" or line.frequency_error < BLURRED:
            return False
        size = float(line.amplitude.max())
        return any(
            size < SKIRT * float(strong.amplitude.max()) / max(abs(line.frequency - strong.frequency), 1.0)
            for strong in self.found
            if strong.kind == "steady"
        )

    def _explained(self, peak: Peak, view: View, taken: Array) -> bool:
        """Whether a line taken out is what made the peak: a line that only sweeps past leaves most of it."""
        row = slice(peak.first, peak.last)
        seen = self._clock.same_view(view, self._rest - taken)
        self._after = (taken, seen)
        after = seen.power[row, :, peak.channel]
        line = int(np.argmin(np.abs(view.coordinate - peak.coordinate)))
        near = slice(max(line - 1, 0), line + 2)
        left = median_of_known(after[:, near].max(axis=1))
        whole = median_of_known(view.power[row, near, peak.channel].max(axis=1))
        return bool(left < LEFT_OVER * whole)

    def _better_otherwise(self, envelope: Envelope, view: View, coordinate: float, spoken: Mask) -> bool:
        """Whether the other kind of line, steady or order, holds more of the power where the peak was
        seen.
        """
        if self._clock.angle is None:
            return False
        speed = float(np.mean(self._clock.speed[spoken]))
        order = coordinate if view.of_orders else coordinate / speed
        if order * float(np.ptp(self._clock.speed[spoken])) > CLOSE * BANDWIDTH:
            return False
        other = coordinate * speed if view.of_orders else order
        path = other * self._advance(not view.of_orders, of_signal=True)
        rival = self._clock.extract(self._clock.near(self._rest, path))
        usual = 4.0 * np.median(np.abs(envelope.value[spoken]) ** 2, axis=0)
        own, others = (np.minimum(np.abs(e.value[spoken]) ** 2, usual).sum() for e in (envelope, rival))
        return bool(others > 1.05 * own)

    def _spoken(self, peak: Peak, view: View) -> Mask:
        """The part of the signal in which a peak was seen."""
        times, length = view.time, view.length
        first = times[peak.first] - 0.5 * length[peak.first]
        last = times[peak.last - 1] + 0.5 * length[peak.last - 1]
        return np.asarray((self._clock.time >= first) & (self._clock.time <= last))

    def _undisturbed(self, envelope: Envelope, peak: Peak, present: Mask, spoken: Mask) -> Mask:
        """Where no bang swells the line, and no line taken out before, of which a rest stays, comes near."""
        frequency = np.abs(self._clock.rate_of(envelope.phase))
        size = np.abs(envelope.value[:, peak.channel])
        seen = present & spoken if (present & spoken).any() else present
        alone = seen & (size < 5.0 * float(np.median(size[seen])))
        for line in self.found:
            alone &= ~(np.abs(frequency - line.frequency_at(self._clock.time)) < 2.0 * BANDWIDTH)
            if line.brief and line.ratio > BURST:
                # The start and end of a burst spread over all frequencies.
                alone &= (self._clock.time < line.first_seen) | (self._clock.time > line.last_seen)
        return alone if alone.sum() > 0.3 * seen.sum() else seen

    def _present(self, envelope: Envelope, peak: Peak, spoken: Mask) -> Mask:
        """Where the line stands clear of the floor; where it was detected if it hardly does."""
        size = np.abs(envelope.value[:, peak.channel])
        reachable = self._clock.reachable(envelope.phase)
        clear = (size > 2.0 * peak.floor) & reachable
        if spoken.mean() < BRIEF:
            clear &= _connected(clear, spoken, round(0.5 * self._clock.rate))
        return clear if clear[spoken].mean() > 0.2 else spoken & reachable

    def _part(self, envelope: Envelope, present: Mask) -> NDArray[np.complex128]:
        """The amplitude of the line where it is present [m], fading in and out."""
        reach = round(self._clock.rate / BANDWIDTH)
        near = smooth(present.astype(np.float64), reach) > 0.02
        fade = smooth((near & self._clock.reachable(envelope.phase)).astype(np.float64), max(reach // 4, 1))
        return fade[:, None] * envelope.value

    def _describe(
        self,
        envelope: Envelope,
        present: Mask,
        part: NDArray[np.complex128],
        peak: Peak,
        view: View,
        coordinate: float,
        error: float,
    ) -> FoundLine:
        weight = power_share(envelope, present)
        frequency = self._clock.rate_of(envelope.phase)
        mean = float(np.sum(weight * frequency))
        speed = float(np.sum(weight * self._clock.speed))
        decided = self._decided(weight, mean, view.resolution)
        width = math.sqrt(max(peak.width**2 - (1.44 * view.spacing) ** 2, 0.0))
        order: tuple[float | None, float | None] = (None, None)
        scale, drift, least = 1.0, self._drift(frequency, present), EVEN
        if view.of_orders:
            scale, drift, least = mean / coordinate, (mean, mean), HALF_TURN
        known = self._error(weight, error * scale, least)
        if view.of_orders:
            order = (coordinate, known / scale)
        elif not decided and speed > 0.0:
            order = (mean / speed, known / speed)
        kind: LineKind = ("order" if view.of_orders else "steady") if decided else "undecided"
        seen = {"kind": kind, "frequency": mean, "frequency_error": known, "width": width * scale}
        return self._line(envelope, present, part, peak, order=order, drift=drift, **seen)

    def _error(self, weight: Array, error: float, least: float = EVEN) -> float:
        """Standard error of a mean frequency [Hz], no less than a share of the resolution of its power."""
        return max(error, least * self._clock.rate * float(weight @ weight))

    def _line(
        self,
        envelope: Envelope,
        present: Mask,
        part: NDArray[np.complex128],
        peak: Peak,
        *,
        order: tuple[float | None, float | None] = (None, None),
        **known: Any,
    ) -> FoundLine:
        """A line of which the further fields are known; ``order`` comes with its error."""
        there = envelope.value[present]
        when = self._clock.time[present]
        return FoundLine(
            order=order[0],
            order_error=order[1],
            amplitude=np.sqrt(np.mean(np.abs(there) ** 2, axis=0)),
            forward=radius(there, 1.0),
            backward=radius(there, -1.0),
            floor=peak.floor,
            ratio=peak.ratio,
            first_seen=float(when[0]),
            last_seen=float(when[-1]),
            existence=1.0 - FALSE_ALARM,
            time=self._clock.time,
            path=np.abs(self._clock.rate_of(envelope.phase)),
            power=0.5 * np.sum(np.abs(part) ** 2, axis=1),
            brief=bool(when[-1] - when[0] < BRIEF * (self._clock.time[-1] - self._clock.time[0])),
            **known,
        )

    def _drift(self, frequency: Array, present: Mask) -> tuple[float, float]:
        """Lowest and highest frequency of a line [Hz] where it is present, extremes left out."""
        low, high = np.percentile(frequency[present], [5.0, 95.0])
        return float(low), float(high)

    def _decided(self, weight: Array, frequency: float, resolution: float) -> bool:
        """Whether the speed changed enough, while the line was seen, to say whether the line follows it."""
        if self._clock.angle is None:
            return False
        ends = np.searchsorted(np.cumsum(weight), [0.1, 0.9])
        early, late = self._clock.speed[np.minimum(ends, len(weight) - 1)].tolist()
        middle = 0.5 * (early + late)
        return bool(middle <= 0.0 or frequency / middle * abs(late - early) > DECIDED * resolution)

    def _combinations(self) -> None:
        """Lines at a steady one plus or minus an order: look along every such path."""
        if self._clock.angle is None:
            return
        kept = [entry for entry in self._phases if entry[0] in self.found]  # not a burst that was refused
        steady = sorted(kept, key=lambda entry: -entry[0].strength)
        pairs = [(line, phase, k) for line, phase in steady[:STEADY_PARTNERS] for k in COMBINED_ORDERS]
        seen: list[list[Peak | None]] = []
        while pairs and len(self.found) < self._most:
            # what is seen along the paths stays as it is until a line is taken out
            seen = seen or [self._along(self._combined(phase, k)) for _, phase, k in pairs]
            scored = [(peak, index) for index, peaks in enumerate(seen) for peak in peaks]
            peak, index = max(scored, key=lambda entry: entry[0].score if entry[0] else 0.0)
            if peak is None:
                return
            line, phase, k = pairs.pop(index)
            del seen[index]
            if peak.amplitude < float(line.amplitude.max()):
                self._take_combination(peak, line, phase, k)
                seen = []

    def _combined(self, phase: Array, k: float) -> Near:
        """What the signal holds near a sum of a steady line, whose phase [rad] is known, and an order."""
        clock = self._clock
        path = np.interp(clock.signal_time, clock.time, phase) + k * cast(Array, clock.signal_angle)
        return clock.near(self._rest, path)

    def _along(self, near: Near) -> list[Peak | None]:
        """The peak on a moving path against what lies beside it, in long frames and in short ones."""
        path = np.abs(self._clock.rate_of(near.phase))
        reachable = self._clock.reachable(near.phase).astype(np.float64)
        return [self._beside(near.value, path, reachable, share) for share in (1.0, 0.5)]

    def _beside(
        self, turned: NDArray[np.complex128], path: Array, reachable: Array, share: float
    ) -> Peak | None:
        length = share * self._clock.frame
        view = frame_power(
            turned, self._clock.rate, start_time=self._clock.start, frame=length, highest=BESIDE
        )
        usable = self._clock.at(view.time, reachable) > 0.99
        for line in self.found:
            moments = [view.time + share * length for share in FIVE_MOMENTS]
            apart = np.abs([self._clock.at(when, path) - line.frequency_at(when) for when in moments])
            usable &= apart.min(axis=0) > 2.0 * BANDWIDTH * max(line.skirt, 1.0)
        allowed = usable[:, None] & (np.abs(view.coordinate) < 2.5 * view.spacing)
        stretches = [
            (first, last)
            for first, last in stretches_of(len(view.time), LASTING)
            if usable[first:last].mean() >= 0.75
        ]
        peak = clearest_peak(view, allowed, stretches)
        if peak is None or peak.score < SURE_COMBINATION or abs(peak.coordinate) > 1.5 * view.spacing:
            return None
        return peak

    def _take_combination(self, peak: Peak, partner: FoundLine, partner_phase: Array, k: float) -> None:
        envelope = self._clock.extract(self._combined(partner_phase, k))
        present = self._present(envelope, peak, self._clock.reachable(envelope.phase))
        frequency = np.abs(self._clock.rate_of(envelope.phase))
        part, weight = self._part(envelope, present), power_share(envelope, present)
        line = self._line(
            envelope,
            present,
            part,
            peak,
            kind="combination",
            frequency=float(np.sum(weight * frequency)),
            frequency_error=self._error(weight, partner.frequency_error),
            drift=self._drift(frequency, present),
            width=0.0,
            parent=partner,
            multiple=k,
        )
        self._keep(line, self._clock.line(envelope, part))


def _connected(clear: Mask, spoken: Mask, gap: int) -> Mask:
    """Stretches of samples that touch the part in which a line was detected, joined over shorter gaps."""
    stretch, _ = label(closed(clear, gap) | spoken)
    return np.asarray(np.isin(stretch, np.unique(stretch[spoken])))
