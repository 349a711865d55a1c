"""Synthetic coast-downs whose lines are known: orders, steady lines, a wandering pendulum, whirl, noise."""

import math
from dataclasses import dataclass, field

import numpy as np

from rotordrop.spectrum._views import FoundLine
from rotordrop.spectrum.coast_down import CoastDownSignal
from rotordrop.spectrum.lines import find_lines
from rotordrop.spectrum.orders import track_orders
from rotordrop.spectrum.speed import exact_speed_profile, fit_speed_profile

TURN = 2.0 * math.pi


@dataclass
class CoastDown:
    """A displacement built line by line, with the truth about every line."""

    sampling_rate: float = 2500.0
    duration: float = 40.0
    first_speed: float = 60.0
    time_constant: float = 8.0
    noise: float = 0.45e-6
    seed: int = 0
    orders: dict[float, float] = field(default_factory=dict)
    steady: dict[float, float] = field(default_factory=dict)

    def __post_init__(self):
        self.random = np.random.default_rng(self.seed)
        self.time = np.arange(int(self.duration * self.sampling_rate)) / self.sampling_rate
        decay = np.exp(-self.time / self.time_constant)
        self.speed = TURN * self.first_speed * decay
        self.angle = TURN * self.first_speed * self.time_constant * (1.0 - decay)
        self.xy = self.noise * self.random.standard_normal((self.time.size, 2))
        self.xy[:, 1] -= 285e-6

    def add_order(self, order, amplitude, *, growth=0.0, ellipse=0.7):
        """An order whose amplitude [m] goes with a power of the speed; growth 2 is unbalance."""
        a = amplitude * (self.speed / self.speed[0]) ** growth
        phase = order * self.angle + self.random.uniform(0.0, TURN)
        self.xy += np.column_stack([a * np.cos(phase), ellipse * a * np.sin(phase)])
        self.orders[order] = float(np.sqrt(np.mean(a**2)))

    def add_steady(self, frequency, amplitude, *, decay_time=math.inf):
        a = amplitude * np.exp(-self.time / decay_time)
        phase = TURN * frequency * self.time + self.random.uniform(0.0, TURN)
        share = self.random.uniform(0.2, 0.9)
        self.xy += np.column_stack([a * np.cos(phase), share * a * np.cos(phase + 0.4)])
        self.steady[frequency] = float(np.sqrt(np.mean(a**2)))

    def add_pendulum(self, start, end, amplitude, radius=285e-6):
        """A swing on a circle that dies down: once in x, twice in y; returns its mean frequency."""
        decay = np.exp(-self.time / 30.0)
        frequency = end + (start - end) * decay
        phase = TURN * np.cumsum(frequency) / self.sampling_rate
        swing = amplitude / radius * decay * np.cos(phase)
        self.xy += np.column_stack([radius * np.sin(swing), radius * (1.0 - np.cos(swing))])
        return float(np.sum(frequency * decay**2) / np.sum(decay**2))

    def add_whirl(self, frequency, radius, first, last):
        """A round orbit for a while; a negative frequency [Hz] turns backward."""
        inside = (self.time >= first) & (self.time <= last)
        fade = np.clip(np.minimum(self.time - first, last - self.time) / 0.05, 0.0, 1.0) * inside
        phase = TURN * frequency * self.time
        self.xy += radius * fade[:, None] * np.column_stack([np.cos(phase), np.sin(phase)])

    def signal(self, planes=("DE",), **changes):
        """It as a recorded signal, in every plane the same."""
        known = {"planes": dict.fromkeys(planes, self.xy), "air_gap": dict.fromkeys(planes, 285e-6)}
        known |= {"sampling_rate": self.sampling_rate, "start_time": 0.0, "profile": self.exact()}
        known |= {"speed_time": self.time, "speed": self.speed, "recorded": True}
        return CoastDownSignal(**(known | changes))

    def tracked(self, profile=None, **options):
        """Its orders."""
        return track_orders(self.xy, self.sampling_rate, profile or self.exact(), **options)

    def lines(self, profile=None, **options):
        """Its lines up to 450 Hz."""
        options = {"highest_frequency": 450.0} | options
        return find_lines({"DE": self.xy}, self.sampling_rate, profile or self.exact(), **options)

    def exact(self):
        step = max(int(self.sampling_rate * 0.005), 1)
        return exact_speed_profile(self.time[::step], self.speed[::step])

    def recorded(self, *, noise=0.05, step=1.0 / 60.0, rate=20.0):
        """As a recorder gives it: 20 values per second, noise, and steps of one turn per minute [Hz]."""
        every = int(self.sampling_rate / rate)
        hertz = self.speed[::every] / TURN
        hertz = hertz + noise * self.random.standard_normal(hertz.size)
        return fit_speed_profile(self.time[::every], TURN * np.maximum(np.round(hertz / step) * step, 0.0))

    def floor(self, frame=1.6384):
        """Root-mean-square amplitude [m] of the noise in one line of a Hann frame."""
        return self.noise * math.sqrt(4.0 * 1.5 / (frame * self.sampling_rate))


def found_line(kind, frequency, time, **changes):
    """A line that was found, at a frequency [Hz] that stands still."""
    nothing, quiet = np.zeros(1), np.zeros(len(time), dtype=np.float32)
    known = {"kind": kind, "frequency": frequency, "frequency_error": 0.01, "drift": (frequency, frequency)}
    known |= {"order": None, "order_error": None, "width": 0.0, "floor": 1e-8, "ratio": 30.0, "brief": False}
    known |= {"amplitude": np.zeros(2), "forward": nothing, "backward": nothing, "existence": 0.999}
    known |= {"first_seen": float(time[0]), "last_seen": float(time[-1]), "time": time, "power": quiet}
    return FoundLine(path=np.full(len(time), frequency), **(known | changes))
