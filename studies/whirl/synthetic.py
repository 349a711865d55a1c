"""Whirl told from made motions: sense, frequency, and what is none.

    python studies/whirl/synthetic.py --motions 400 --out studies/whirl/synthetic.json

Forward and backward whirl of 10 to 200 Hz with bounces and noise, pendulum motion at the bottom, and both one
after the other; spin in either sense, 20 kHz, gap 250 µm, 1 µm of noise.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics.whirl_spells import WhirlSpell, whirl_spells

RATE, GAP, NOISE, LENGTH = 20_000.0, 250e-6, 1e-6, 0.5


def motion(kind: str, random: np.random.Generator) -> tuple[Array, Array, float, float]:
    """Time, orbit, spin [rad/s], and the true whirl frequency (positive with the spin) [Hz]."""
    time = np.arange(0.0, LENGTH, 1.0 / RATE)
    spin = random.choice([-1.0, 1.0]) * 2.0 * np.pi * random.uniform(30.0, 500.0)
    frequency = {"forward": 1.0, "backward": -1.0}.get(kind, 0.0) * random.uniform(10.0, 200.0)
    swing = np.radians(random.uniform(5.0, 100.0))
    bottom = -0.5 * np.pi + swing * np.sin(2.0 * np.pi * random.uniform(20.0, 40.0) * time)
    angle = bottom
    if kind == "mixed":
        frequency = random.choice([-1.0, 1.0]) * random.uniform(20.0, 200.0)
    if frequency:
        turning = 2.0 * np.pi * np.sign(spin) * frequency
        begin = 0.5 * LENGTH if kind == "mixed" else 0.0
        at = int(begin * RATE)
        angle = np.where(time < begin, bottom, bottom[at] + turning * (time - begin))
    bounce = random.uniform(0.0, 0.25) * np.abs(np.sin(2.0 * np.pi * random.uniform(50.0, 400.0) * time))
    radius = GAP * (1.02 - bounce)
    orbit = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return time, orbit + NOISE * random.standard_normal(orbit.shape), spin, frequency


def judged(kind: str, spells: tuple[WhirlSpell, ...], frequency: float) -> dict[str, Any]:
    """Whether the sense is right and how far the frequency is off [Hz]."""
    if not spells or not frequency:
        return {"right": not spells and not frequency, "error": None, "duration": None}
    whole = sum(one.duration for one in spells)
    mean = sum(one.frequency * one.duration for one in spells) / whole
    expected = 0.5 * LENGTH if kind == "mixed" else LENGTH
    return {
        "right": bool(all(np.sign(one.frequency) == np.sign(frequency) for one in spells)),
        "error": abs(mean - frequency),
        "duration": whole / expected,
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--motions", type=int, default=400)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    random = np.random.default_rng(1)
    summary: dict[str, Any] = {"motions_of_each_kind": asked.motions}
    for kind in ("forward", "backward", "pendulum", "mixed"):
        rows = []
        for _ in range(asked.motions):
            time, orbit, spin, frequency = motion(kind, random)
            rows.append(judged(kind, whirl_spells(time, orbit, GAP, spin=spin), frequency))
        errors = [row["error"] for row in rows if row["error"] is not None]
        summary[kind] = {
            "sense_right": float(np.mean([row["right"] for row in rows])),
            "within_1_Hz": float(np.mean(np.array(errors) <= 1.0)) if errors else None,
            "largest_error_Hz": max(errors) if errors else None,
            "duration_5_95": np.quantile(
                [r["duration"] for r in rows if r["duration"]], [0.05, 0.95]
            ).tolist()
            if errors
            else None,
        }
    print(json.dumps(summary, indent=1))
    if asked.out:
        asked.out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
