"""Contacts of a held rotor that a surge presses against its race: which are found, and their velocities.

Usage: python studies/look/surges.py FIRST LAST

Masses on magnets, from rest, each with a race, a surge and noise of its own seed; a contact of the truth that
another follows within 0.5 ms is none. Prints the contacts found, how far their velocities are off, and how
often the 90 % intervals and the bounds of the impulse hold.
"""

from __future__ import annotations

import math
import sys

import numpy as np

from rotordrop.evidence.held import held_contacts

NEAR = 1e-3
"""How close to a contact of the truth one is the same [s]."""
SLOW = 0.02
"""Contacts with less velocity [m/s] are not counted."""


def surge(seed: int) -> tuple[np.ndarray, np.ndarray, float, list[tuple[float, float, float, float]]]:
    """Time, path and rate of a record; per contact its begin, velocities on either side, impulse per mass."""
    random = np.random.default_rng(seed)
    rate, steps = float(random.choice((10e3, 20e3, 50e3))), 10
    omega = 2.0 * math.pi * math.exp(random.uniform(math.log(20.0), math.log(80.0)))
    damping, gap = random.uniform(0.05, 0.5), random.uniform(120e-6, 400e-6)
    race = 2.0 * math.pi * random.uniform(250.0, 700.0)
    lost = 2.0 * random.uniform(0.02, 0.2) * race
    length = random.uniform(12e-3, 40e-3)
    size = 2.5 * gap * omega**2 * random.uniform(1.0, 2.0) + 400.0 * gap / length
    direction = np.exp(1j * random.uniform(0.0, 2.0 * math.pi))
    noise = math.exp(random.uniform(math.log(0.15e-6), math.log(1e-6)))
    time, path, touched = np.arange(int(1.25 * rate)) / rate, [], []
    place, speed, inside = 0.0, 0.0, None
    for now in time.tolist():
        path.append(place)
        for step in range(steps if now > 0.99 else 0):
            since = now + step / (rate * steps) - 1.0
            push = size * math.sin(math.pi * since / length) if 0.0 < since < length else 0.0
            depth = place - gap
            force = max(race**2 * depth + lost * speed, 0.0) if depth > 0.0 else 0.0
            if depth > 0.0:
                inside = inside or [now + step / (rate * steps), speed, 0.0]
                inside[2] += force / (rate * steps)
            elif inside is not None:
                touched.append((inside[0], inside[1], -speed, inside[2]))
                inside = None
            speed += (push - force - omega**2 * place - 2.0 * damping * omega * speed) / (rate * steps)
            place += speed / (rate * steps)
    turning = 2e-6 * np.exp(2j * np.pi * random.uniform(50.0, 300.0) * time)
    moved = np.array(path) * direction + turning
    readings = np.column_stack([moved.real, moved.imag])
    return time, readings + noise * random.standard_normal(readings.shape), rate, touched


def main(first: int, last: int) -> None:
    """Run the seeds and print one line."""
    real, found, extra, off, held, bounded = 0, 0, 0, [], [], []
    for seed in range(first, last):
        time, path, rate, touched = surge(seed)
        told = held_contacts("A", time, path, rate)
        true = [one for one in touched if one[1] > SLOW]
        real += len(true)
        for one in told:
            begin, into, out, impulse = min(touched, key=lambda row: abs(row[0] - one.time))
            if abs(begin - one.time) > NEAR:
                extra += 1
                continue
            if into <= SLOW:
                continue
            found += 1
            off += [one.approach / into - 1.0, one.departure / max(out, 1e-3) - 1.0]
            for value, between in ((into, "approach_interval_90"), (out, "departure_interval_90")):
                low, high = getattr(one, between, (math.nan, math.nan))
                held.append(low <= value <= high)
            bounded.append(one.velocity_change[0] <= impulse <= one.velocity_change[1])
    before, after = (np.array(off)[side::2] for side in (0, 1))
    spread = " / ".join(
        f"{np.median(one):+.1f} ({np.percentile(np.abs(one), 90):.1f})" for one in (100 * before, 100 * after)
    )
    print(
        f"{found} of {real} contacts found, {extra} that are none; velocities before / after off by "
        f"{spread} %, median (90 % of the sizes below); intervals hold {100 * np.mean(held[::2]):.0f} and "
        f"{100 * np.mean(held[1::2]):.0f} %, bounds of the impulse {100 * np.mean(bounded):.0f} %"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
