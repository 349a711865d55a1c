"""Count contacts that `rotordrop look` invents in levitated records, and those it finds in rubs.

Usage: python studies/look/levitated.py [--seconds 10000] [--seed 0]

Levitated: planes of rotors whose orbits, runout with scratches, hum, noise, steps of load and speed sweeps
through resonances are drawn here; no race is touched. Rubs: a mass on two magnets with a limit of force,
thrown against a race by a pulse; its contacts are counted. Prints the counts, writes results/levitated.json.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from rotordrop.evidence.held import held_contacts

RATES = (2000.0, 5000.0, 10_000.0)
SPAN = 50.0
"""Length of one record [s]."""


def levitated(random: np.random.Generator, rate: float) -> tuple[np.ndarray, float]:
    """Readings of one plane [m], shape (N, 2), and its air gap [m]."""
    clock = np.arange(int(SPAN * rate)) / rate
    gap = np.exp(random.uniform(np.log(60e-6), np.log(600e-6)))
    low, high = np.sort(np.exp(random.uniform(np.log(5.0), np.log(min(500.0, rate / 8.0)), 2)))
    kind = random.integers(4)  # steady, run-up, coast-down, up and down
    share = clock / SPAN
    speed = (
        np.full(len(clock), high),
        low + (high - low) * share,
        high * np.exp(-3.0 * share),
        low + (high - low) * np.sin(np.pi * share) ** 2,
    )[kind]
    angle = 2.0 * np.pi * np.cumsum(speed) / rate
    critical, damping = random.uniform(0.3, 1.3) * high, random.uniform(0.02, 0.3)
    ratio = speed / critical
    gain = ratio**2 / (1.0 - ratio**2 + 2j * damping * ratio)
    unbalance = gap * random.uniform(0.005, 0.05)
    orbit = unbalance * gain * np.exp(1j * angle) * (1.0 + random.uniform(0.0, 0.6))
    orbit += random.uniform(0.0, 0.4) * np.conj(orbit)
    peak = np.abs(orbit).max()
    orbit *= min(1.0, 0.45 * gap / peak)  # more, and the rotor would touch
    place = np.column_stack([orbit.real, orbit.imag])
    for axis in range(2):
        turn = angle - axis * np.pi / 2
        for order in range(1, 13):
            place[:, axis] += (
                random.exponential(2e-6) / order * np.cos(order * turn + random.uniform(0, 2 * np.pi))
            )
        width = random.uniform(0.02, 0.2)  # scratch [rad]
        since = np.angle(np.exp(1j * (turn - random.uniform(0, 2 * np.pi))))
        place[:, axis] += random.choice([0.0, 3e-6, 15e-6]) * np.exp(-((since / width) ** 2))
        for frequency in (50.0, 100.0, 150.0):
            place[:, axis] += random.exponential(1e-6) * np.cos(2 * np.pi * frequency * clock)
    for begin in random.uniform(0.0, SPAN, random.integers(0, 12)):  # steps and pulses of load
        natural, loss = (
            2.0 * np.pi * np.exp(random.uniform(np.log(15.0), np.log(150.0))),
            random.uniform(0.1, 0.7),
        )
        since = np.maximum(clock - begin, 0.0)
        damped = natural * np.sqrt(1.0 - loss**2)
        answer = 1.0 - np.exp(-loss * natural * since) * (
            np.cos(damped * since) + loss / np.sqrt(1.0 - loss**2) * np.sin(damped * since)
        )
        if random.uniform() < 0.5:  # a pulse, gone after a while
            after = np.maximum(since - random.uniform(5e-3, 0.5), 0.0)
            answer -= 1.0 - np.exp(-loss * natural * after) * (
                np.cos(damped * after) + loss / np.sqrt(1.0 - loss**2) * np.sin(damped * after)
            )
        direction = random.uniform(0, 2 * np.pi)
        size = gap * random.uniform(0.03, 0.35)
        place += size * answer[:, None] * np.array([np.cos(direction), np.sin(direction)])
    place *= min(1.0, 0.75 * gap / np.hypot(*place.T).max())
    place += random.uniform(0.1e-6, 1.5e-6) * random.standard_normal(place.shape)
    return place, gap


def rub(random: np.random.Generator, rate: float) -> tuple[np.ndarray, float, list[float]]:
    """Readings of a mass thrown against its race [m], the air gap [m], and when it touches [s]."""
    fine, gap = 200_000.0, np.exp(random.uniform(np.log(100e-6), np.log(400e-6)))
    count = int(2.0 * fine)
    natural, most = 2.0 * np.pi * random.uniform(20.0, 60.0), random.uniform(1.0, 2.5) * 9.81
    wall, lost = (2.0 * np.pi * random.uniform(250.0, 700.0)) ** 2, random.uniform(0.02, 0.2)
    pulse, begin = random.uniform(2.0, 5.0) * 9.81, 1.0
    long, direction = random.uniform(8e-3, 30e-3), random.uniform(0, 2 * np.pi)
    push = pulse * np.exp(1j * direction)
    spin, turn = random.uniform(30.0, 200.0), 0.02 * gap
    place, speed, touching = turn + 0j, 0j, False
    kept, touched = [], []
    every = round(fine / rate)
    for step in range(count):
        now = step / fine
        held = -(natural**2) * place - 2.0 * 0.4 * natural * speed
        if abs(held) > most:
            held *= most / abs(held)
        force = held + turn * natural**2 * np.exp(2j * np.pi * spin * now)
        if begin < now < begin + long:
            force += push
        depth = abs(place) - gap
        if depth > 0.0:
            outward = place / abs(place)
            rate_in = (speed * outward.conjugate()).real
            force -= outward * max(wall * depth + 2.0 * lost * np.sqrt(wall) * rate_in, 0.0)
            if not touching:
                touched.append(now)
        touching = depth > 0.0
        speed += force / fine
        place += speed / fine
        if step % every == 0:
            kept.append((place.real, place.imag))
    readings = np.array(kept)
    return readings + 0.5e-6 * random.standard_normal(readings.shape), gap, touched


def main() -> None:
    """Run what the command line says."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--seconds", type=float, default=10_000.0)
    words.add_argument("--rubs", type=int, default=12)
    words.add_argument("--seed", type=int, default=0)
    told = words.parse_args()
    random = np.random.default_rng(told.seed)
    began = time.process_time()
    counts = {"alone": 0, "with the gap": 0}
    records = round(told.seconds / SPAN)
    for number in range(records):
        rate = RATES[number % len(RATES)]
        place, gap = levitated(random, rate)
        clock = np.arange(len(place)) / rate
        for name, known in (("alone", None), ("with the gap", gap)):
            found = held_contacts("A", clock, place, rate, gap=known)
            counts[name] += len(found)
            for one in found[:2]:
                print(number, rate, name, f"gap {1e6 * gap:.0f} µm", one)
    row = {
        "seconds": records * SPAN,
        "false_contacts": counts,
        "per_hour": {name: 3600.0 * count / (records * SPAN) for name, count in counts.items()},
    }
    made, right, wrong = 0, {"alone": 0, "with the gap": 0}, {"alone": 0, "with the gap": 0}
    for number in range(told.rubs):
        rate = (5000.0, 10_000.0, 20_000.0)[number % 3]
        place, gap, touched = rub(random, rate)
        clock = np.arange(len(place)) / rate
        apart = [t for k, t in enumerate(touched) if k == 0 or t - touched[k - 1] > 3e-3]
        made += len(apart)
        for name, known in (("alone", None), ("with the gap", gap)):
            found = [one.time for one in held_contacts("A", clock, place, rate, gap=known)]
            right[name] += sum(any(abs(t - one) < 3e-3 for one in found) for t in apart)
            wrong[name] += sum(all(abs(t - one) > 3e-3 for t in touched) for one in found)
    row |= {
        "touches": made,
        "found": right,
        "not_there": wrong,
        "cpu_s": round(time.process_time() - began, 1),
    }
    results = Path(__file__).parent / "results"
    (results / "levitated.json").write_text(json.dumps(row, indent=1) + "\n")
    print(json.dumps(row))


if __name__ == "__main__":
    main()
