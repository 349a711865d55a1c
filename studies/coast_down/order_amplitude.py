"""Amplitude of 1X of a falling speed: by order tracking with exact and recorded speed, and in frames.

The edges, where a frame of turns does not fit any more, are excluded by the tracking itself.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))
from common import keep
from tests.unit.spectrum.synthetic import CoastDown

from rotordrop.spectrum.orders import track_orders
from rotordrop.spectrum.waterfall import smear_factor, waterfalls

SEEDS = range(8)
TIME_CONSTANT = 5.9
LOWEST = 8.0
"""Speed [Hz] down to which 1X stands clear of zero in a frame."""


def chirp(rate: float = 2500.0, seed: int = 0) -> CoastDown:
    down = CoastDown(sampling_rate=rate, duration=20.0, time_constant=TIME_CONSTANT, noise=0.0, seed=seed)
    down.xy += 20e-6 * np.column_stack([np.cos(down.angle), np.sin(down.angle)])
    return down


def worst(track) -> float:
    return float(np.max(np.abs(np.abs(track.amplitude[:, 0, 0]) / 20e-6 - 1.0)))


def main() -> None:
    exact = chirp()
    recorded = [chirp(seed=seed) for seed in SEEDS]
    framed = chirp(rate=20000.0)
    (frames,) = waterfalls(framed.xy, framed.sampling_rate, components=("x",), speed=framed.speed)
    seen = np.array([row[frames.frequency > 5.0].max() for row in frames.amplitude]) / 20e-6
    length = frames.settings.points / framed.sampling_rate
    change = np.abs(frames.speed_change) / (2.0 * np.pi * length)
    clear = frames.speed > 2.0 * np.pi * LOWEST
    expected = np.array([smear_factor(rate, framed.sampling_rate) for rate in change])
    keep(
        "order_amplitude",
        {
            "time_constant_s": TIME_CONSTANT,
            "exact speed, largest error": worst(track_orders(exact.xy, 2500.0, exact.exact())),
            "recorded speed, largest error by seed": [
                worst(track_orders(down.xy, 2500.0, down.recorded(step=0.1))) for down in recorded
            ],
            "paper's frames, share of the amplitude seen": [round(float(x), 4) for x in seen[clear]],
            "paper's frames, share expected of a linear sweep": [round(float(x), 4) for x in expected[clear]],
        },
    )


if __name__ == "__main__":
    main()
