"""Order tracking: amplitude of 1X, 2X, … along a coast-down, without the smear of fixed frames.

Where an amplitude rises on the way down, a resonance was passed; which mode that is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.ndimage import label

from rotordrop.arrays import Array, ComplexArray
from rotordrop.document import stated
from rotordrop.errors import RecordError, UsageError
from rotordrop.spectrum.candidates import Candidate, LineEvidence, Name, name_line
from rotordrop.spectrum.speed import FrequencyPath, SpeedProfile
from rotordrop.spectrum.waterfall import PASSED, PlanarSignal, reduce_rate

FEWEST_TURNS = 4.0
"""Turns of the rotor in the shortest window [1] (chosen)."""

LEAST_APART = 3.0
"""Turns per window by which two orders must differ to be told apart [1]."""

STEADY_APART = 6.0
"""The same for an order and a steady line, which may be a thousand times stronger [1]."""

STEADY_EXTRA = 2
"""How much higher the degree of a steady line's amplitude is: two swings may beat in it."""


REVOLUTIONS = 24.0
"""Turns of the rotor per window [1]: more average away more noise, fewer follow faster changes."""
LONGEST_WINDOW = 3.0
"""Limit of the window at low speed [s]."""
STEP, STEP_SHARE = 0.1, 0.125
"""Time from one amplitude to the next at least [s], also over the length of the window [1]: what changes
faster no window shows (chosen)."""
DEGREE = 2
"""Degree of the polynomial an amplitude may follow within a window [1]."""

_FEWEST_WINDOWS = 2.0
"""Windows that lie in a signal side by side, at least, as long as they can be shortened [1] (chosen): of one
alone no change of an amplitude is seen."""

_FEWEST_CENTRES = 4
"""Amplitudes that are taken along a short signal, about [1] (chosen)."""


def tracking_for(turns: float, orders: Sequence[float]) -> tuple[tuple[float, ...], float]:
    """Orders for a signal of so many turns of the rotor, and the turns per window.

    Windows are halved until a short signal holds two, down to the turns that tell the orders apart. A signal
    that is too short for one window of all orders has the whole ones left, which 4 turns tell apart.
    """
    wanted = tuple(orders)
    if turns < _least_turns(wanted):
        wanted = tuple(order for order in wanted if float(order).is_integer()) or wanted
    revolutions, least = REVOLUTIONS, _least_turns(wanted)
    while revolutions > least and turns < _FEWEST_WINDOWS * revolutions:
        revolutions = max(0.5 * revolutions, least)
    return wanted, revolutions


def _least_turns(orders: Sequence[float] | Array) -> float:
    """Turns per window below which some of the orders are not told apart [1]."""
    closest = float(np.diff(np.concatenate([[0.0], np.sort(orders)])).min())
    return max(LEAST_APART / closest, FEWEST_TURNS)


@dataclass(frozen=True, kw_only=True)
class OrderTrack:
    """Complex amplitude of each order along the coast-down."""

    time: Array
    """[s], shape (F,)."""
    speed: Array
    """Rotor speed [rad/s], shape (F,)."""
    orders: Array
    """Multiples of the rotor speed [1], shape (O,)."""
    amplitude: ComplexArray
    """Complex zero-to-peak amplitude [m] of (x, y): the motion is its real part times e^(j order angle),
    shape (F, O, 2)."""
    standard_error: Array
    """Of the magnitude [m], from what the window left unexplained, shape (F, O, 2)."""
    window: Array
    """Length of the window each row was taken from [s], shape (F,)."""
    revolutions: float
    """Turns of the rotor in a window that the longest one does not shorten [1]."""
    separable: NDArray[np.bool_]
    """False where a steady line lies within the window's resolution of the order: the amplitude then holds
    both, shape (F, O)."""

    @property
    def forward(self) -> Array:
        """Radius of the forward turning part of each order [m], shape (F, O)."""
        return np.abs(self.amplitude[..., 0] + 1j * self.amplitude[..., 1]) / 2.0

    @property
    def backward(self) -> Array:
        """Radius of the backward turning part of each order [m], shape (F, O)."""
        return np.abs(self.amplitude[..., 0] - 1j * self.amplitude[..., 1]) / 2.0

    @property
    def major_axis(self) -> Array:
        """Longest half axis of each order's ellipse [m], zero-to-peak, shape (F, O)."""
        return self.forward + self.backward

    def of(self, order: float) -> int:
        """Column of an order."""
        found = np.flatnonzero(np.isclose(self.orders, order))
        if not found.size:
            have = ", ".join(f"{k:g}X" for k in self.orders)
            raise UsageError(f"order {order:g}X was not tracked; tracked are {have}")
        return int(found[0])


def track_orders(
    displacement: PlanarSignal,
    sampling_rate: float,
    profile: SpeedProfile,
    *,
    orders: Sequence[float] = (1.0, 2.0, 3.0),
    start_time: float = 0.0,
    steady_lines: Sequence[FrequencyPath] = (),
    revolutions: float = REVOLUTIONS,
) -> OrderTrack:
    """Follow the orders of a displacement through a coast-down.

    In each window all orders and all steady lines are fitted together by weighted least squares, in the
    angle the rotor really turned through, each with an amplitude that may bend over the window. A falling
    speed therefore smears nothing, and a strong steady line next to an order is explained instead of leaking
    into it.

    The displacement (N, 2) [m] of one plane is read window by window; the profile is on the clock of
    ``start_time`` [s]; steady lines do not follow the speed (pendulum, hum) and are explained besides the
    orders; a window holds so many revolutions, at low speed fewer.

    Source: own method. Differs from the paper: section 5.4 uses fixed frames, in which 1X at 60 Hz reads 41
    % of its amplitude.
    """
    wanted = np.asarray(orders, dtype=np.float64)
    if wanted.size == 0 or wanted.min() <= 0.0:
        raise UsageError(
            f"order tracking: orders {list(orders)} given, expected positive multiples of the speed"
        )
    centres = _centres(displacement.shape[0], sampling_rate, start_time, profile, wanted, revolutions)
    if not centres:
        duration = displacement.shape[0] / sampling_rate
        raise RecordError(
            f"order tracking: the signal of {duration:.2f} s holds no whole window"
            f" of {revolutions:g} turns; give a longer signal or fewer turns per window"
        )
    fastest = float(np.abs(profile.speed).max()) / math.tau
    highest = max([wanted.max() * fastest, *(float(line.frequency.max()) for line in steady_lines)])
    thin, thin_rate = reduce_rate(displacement, sampling_rate, highest)
    signal = _Signal(thin, thin_rate, start_time, profile, PASSED if thin_rate < sampling_rate else 1.0)
    rows = [_window_fit(signal, wanted, steady_lines, t, w) for t, w in centres]
    time = np.array([t for t, _ in centres])
    window = np.array([w for _, w in centres])
    speed = profile.speed_at(time)
    return OrderTrack(
        time=time,
        speed=speed,
        orders=wanted,
        amplitude=np.array([row[0] for row in rows]),
        standard_error=np.array([row[1] for row in rows]),
        window=window,
        revolutions=revolutions,
        separable=_separable(wanted, time, profile, window, steady_lines),
    )


def _centres(
    samples: int,
    sampling_rate: float,
    start: float,
    profile: SpeedProfile,
    orders: Array,
    revolutions: float,
) -> list[tuple[float, float]]:
    """Middle [s] and length [s] of every window that fits into the signal and holds enough turns."""
    end = start + (samples - 1) / sampling_rate
    least = _least_turns(orders)
    turns = max(revolutions, least)
    fastest = max(float(np.abs(profile.speed).max()) / math.tau, 1e-300)
    room = end - start - min(turns / fastest, LONGEST_WINDOW)
    most = room / _FEWEST_CENTRES if room > 0.0 else math.inf
    step = min(STEP, most)
    times = np.arange(start + step, end, step)
    speed = np.abs(profile.speed_at(times)) / math.tau
    fitting: list[tuple[float, float]] = []
    for t, n in zip(times.tolist(), speed.tolist(), strict=True):
        if n <= 0.0:
            continue
        window = min(turns / n, LONGEST_WINDOW)
        inside = t - window / 2 >= start and t + window / 2 <= end
        if fitting and t - fitting[-1][0] < min(STEP_SHARE * window, most) - 1e-9:
            continue
        if inside and window * n >= least:
            fitting.append((t, window))
    return fitting


@dataclass(frozen=True)
class _Signal:
    displacement: Array
    sampling_rate: float
    start_time: float
    profile: SpeedProfile
    band: float

    def cut(self, centre: float, window: float) -> tuple[Array, Array]:
        """Times [s] and displacement [m] within a window [s]."""
        first = max(math.ceil((centre - window / 2 - self.start_time) * self.sampling_rate), 0)
        last = math.floor((centre + window / 2 - self.start_time) * self.sampling_rate) + 1
        values = self.displacement[first:last]
        return self.start_time + (first + np.arange(len(values))) / self.sampling_rate, values


def _window_fit(
    signal: _Signal, orders: Array, steady: Sequence[FrequencyPath], centre: float, window: float
) -> tuple[ComplexArray, Array]:
    time, cut = signal.cut(centre, window)
    angle = signal.profile.angle_at(time)
    beside = _distinct(steady, orders, signal.profile, centre, window)
    u = 2.0 * (time - centre) / window
    weight = np.cos(0.5 * np.pi * u)[:, None]
    phases = [(k * angle, DEGREE) for k in orders]
    phases += [(line.phase_over(time), DEGREE + STEADY_EXTRA) for line in beside]
    basis = _basis(phases, u)
    basis *= weight
    measured = (cut - cut.mean(axis=0)) * weight
    inverse = np.linalg.pinv(basis.T @ basis, rcond=1e-13, hermitian=True)
    coefficients = inverse @ (basis.T @ measured)
    first = (DEGREE + 1) * 2 * np.arange(orders.size)
    amplitude = coefficients[first] - 1j * coefficients[first + DEGREE + 1]
    residual = measured - basis @ coefficients
    # what was thinned out has lost part of its noise, none of it at the orders
    freedom = max(signal.band * float(np.sum(weight**2)) * (1.0 - basis.shape[1] / len(basis)), 1.0)
    spread = np.sqrt(np.sum(residual**2, axis=0) / freedom)
    # Equal noise in all samples, unequal weights: the weights enter the variance once more.
    basis *= weight
    variance = np.sum((basis @ inverse[first].T) ** 2, axis=0)
    return amplitude, np.sqrt(variance)[:, None] * spread


def _distinct(
    steady: Sequence[FrequencyPath], orders: Array, profile: SpeedProfile, centre: float, window: float
) -> list[FrequencyPath]:
    """Steady lines that differ enough from every order and from rest to be fitted beside them."""
    speed = float(profile.speed_at(centre)) / math.tau
    sweep = orders * abs(float(profile.change_at(centre))) / math.tau * window
    chosen = []
    for line in steady:
        frequency = float(line.frequency_at(centre))
        apart = (np.abs(frequency - orders * speed) + sweep) * window
        if apart.min() > 2.0 and frequency * window > 2.0:
            chosen.append(line)
    return chosen


def _basis(phases: list[tuple[Array, int]], u: Array) -> Array:
    """Cosine and sine of every phase times powers of the place in the window up to its degree; the powers."""
    powers = u[:, None] ** np.arange(DEGREE + STEADY_EXTRA + 1)
    # filled in place: a window has thousands of samples and up to a hundred columns
    basis = np.empty((u.size, sum(2 * (highest + 1) for _, highest in phases) + DEGREE + 1))
    column = 0
    for phase, highest in phases:
        for part in (np.cos(phase), np.sin(phase)):
            np.multiply(part[:, None], powers[:, : highest + 1], out=basis[:, column : column + highest + 1])
            column += highest + 1
    basis[:, column:] = powers[:, : DEGREE + 1]
    return basis


def _separable(
    orders: Array, time: Array, profile: SpeedProfile, window: Array, steady: Sequence[FrequencyPath]
) -> NDArray[np.bool_]:
    """Whether every steady line stays ``STEADY_APART`` turns per window away from an order within its
    window.
    """
    place = orders * profile.speed_at(time)[:, None] / math.tau
    sweep = 0.5 * orders * np.abs(profile.change_at(time) * window)[:, None] / math.tau
    apart = np.ones((time.size, orders.size), dtype=np.bool_)
    for line in steady:
        distance = np.abs(place - line.frequency_at(time)[:, None]) - sweep
        apart &= distance * window[:, None] > STEADY_APART
    return apart


LEAST_RISE = 1.5
"""Amplitude over the level on both sides [1] from which it is a rise (chosen)."""
LOWEST_FREQUENCY, BAND = 5.0, 1000.0
"""Frequency [Hz] from which excitation is looked at, and width of the band in which modes may lie [Hz]."""


@dataclass(frozen=True, kw_only=True)
class PassedResonance:
    """One rise of an order's amplitude on the way down."""

    order: float
    """The order that rises [1]."""
    plane: str
    """Where it was seen."""
    time: float
    """When it was highest [s]."""
    speed: float
    """Rotor speed then [rad/s]."""
    frequency: float
    """Order times rotor speed then [Hz]: what was excited."""
    frequency_error: float
    """Half the distance over which the rise is within a tenth of its top [Hz]."""
    width: float
    """Full width of the rise at half of its height [Hz]."""
    amplitude: float
    """Longest half axis of the orbit [m], zero-to-peak; at least, where the rise is not certain."""
    rise: float
    """Amplitude over that beside the rise [1]."""
    certain: bool
    """False where the top is hidden under a steady line at the same frequency."""
    name: Name
    """The mode, if one is known there."""

    def as_json(self) -> dict[str, Any]:
        """Everything known about the resonance, ready for JSON; amplitudes are zero-to-peak in m."""
        return stated(
            self,
            "order plane time_s speed_hz frequency_hz frequency_error_hz width_hz "
            "amplitude_zero_to_peak_m=amplitude rise certain mode=name.label named=name.named "
            "confidence=name.confidence reason=name.reason",
            speed_hz=self.speed / math.tau,
        )


def find_resonances(
    track: OrderTrack,
    plane: str,
    candidates: Sequence[Candidate],
) -> tuple[PassedResonance, ...]:
    """Find where the amplitude of each tracked order rises and falls again while the speed falls.

    A rise counts when it stands `LEAST_RISE` times above the level on both sides and five standard errors
    clear of it. Where an order crosses a steady line (a pendulum swing, hum) its amplitude is unknown: there
    it is taken to be no higher than on the better known side, and a rise found so is reported as uncertain,
    with the least amplitude it must have had.

    Of the candidates those of kind "steady" are compared, mains hum left out. The result is in the order of
    time.
    """
    modes = [c for c in candidates if c.kind == "steady" and not c.family.startswith("mains")]
    found: list[PassedResonance] = []
    for column, order in enumerate(track.orders.tolist()):
        curve = _curve(track, column, order)
        if curve is not None:
            found += [_resonance(track, curve, order, plane, peak, modes) for peak in _peaks(curve)]
    return tuple(sorted(found, key=lambda resonance: resonance.time))


@dataclass(frozen=True)
class _Curve:
    """Amplitude of one order over time, with what is hidden under steady lines levelled off."""

    rows: NDArray[np.intp]
    frequency: Array
    amplitude: Array
    error: Array
    known: NDArray[np.bool_]


@dataclass(frozen=True)
class _Rise:
    at: int
    first: int
    last: int
    base: float
    left: float
    right: float


def _curve(track: OrderTrack, column: int, order: float) -> _Curve | None:
    frequency = order * track.speed / math.tau
    known = track.separable[:, column]
    # Hidden ends say nothing about a rise: begin and end with amplitudes that are known.
    usable = np.flatnonzero(known & (frequency >= LOWEST_FREQUENCY))
    if usable.size < 5:
        return None
    rows = np.arange(usable[0], usable[-1] + 1)
    rows = rows[frequency[rows] >= LOWEST_FREQUENCY]
    amplitude = track.major_axis[rows, column].copy()
    known = known[rows]
    gaps, count = label(~known)
    for gap in range(1, count + 1):
        hidden = np.flatnonzero(gaps == gap)
        amplitude[hidden] = max(amplitude[hidden[0] - 1], amplitude[hidden[-1] + 1])
    error = np.linalg.norm(track.standard_error[rows, column], axis=1)
    return _Curve(rows, frequency[rows], amplitude, np.where(known, error, 0.0), known)


def _peaks(curve: _Curve) -> list[_Rise]:
    amplitude = curve.amplitude
    peaks, facts = scipy.signal.find_peaks(amplitude, prominence=1e-12, plateau_size=1)
    base = amplitude[peaks] - facts["prominences"]
    clear = amplitude[peaks] >= LEAST_RISE * base
    noise = [curve.error[first : last + 1].max() for first, last in _edges(facts)]
    clear &= facts["prominences"] >= 5.0 * np.asarray(noise, dtype=np.float64)
    _, _, left, right = scipy.signal.peak_widths(amplitude, peaks[clear], rel_height=0.5)
    edges = [edge for edge, good in zip(_edges(facts), clear, strict=True) if good]
    return [
        _Rise(int(at), *edge, float(low), float(start), float(end))
        for at, edge, low, start, end in zip(peaks[clear], edges, base[clear], left, right, strict=True)
    ]


def _edges(facts: Mapping[str, NDArray[np.intp]]) -> list[tuple[int, int]]:
    return [(int(a), int(b)) for a, b in zip(facts["left_edges"], facts["right_edges"], strict=True)]


def _resonance(
    track: OrderTrack,
    curve: _Curve,
    order: float,
    plane: str,
    rise: _Rise,
    modes: Sequence[Candidate],
) -> PassedResonance:
    row = int(curve.rows[rise.at])
    start, end = np.interp([rise.left, rise.right], np.arange(curve.rows.size), curve.frequency)
    width = abs(float(start - end))
    top = float(curve.frequency[rise.at])
    # The amplitude is taken over a window, in which the frequency moves: no rise is placed better than that;
    # nor better than the stretch in which it is hidden.
    sweep = abs(float(np.gradient(curve.frequency)[rise.at])) / float(np.median(np.diff(track.time)))
    hidden = 0.5 * abs(float(curve.frequency[rise.first] - curve.frequency[rise.last]))
    error = max(0.16 * width, 0.15 * sweep * float(track.window[row]), hidden)
    amplitude = float(curve.amplitude[rise.at])
    evidence = LineEvidence(
        kind="steady",
        frequency=top,
        frequency_error=error,
        order=order,
        order_error=0.0,
        roundness=0.0,
        radius=amplitude,
        plane=plane,
        band=BAND,
        order_band=BAND,
    )
    return PassedResonance(
        order=order,
        plane=plane,
        time=float(track.time[row]),
        speed=float(track.speed[row]),
        frequency=top,
        frequency_error=error,
        width=width,
        amplitude=amplitude,
        rise=amplitude / max(rise.base, 1e-300),
        certain=bool(curve.known[rise.first : rise.last + 1].all()),
        name=name_line(evidence, modes),
    )
