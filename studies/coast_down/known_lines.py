"""Synthetic coast-downs with known lines: what is found, how exactly, and what is named wrongly.

Three kinds: light unbalance with a swing, eight times the unbalance, and a passing whirl.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))
from common import keep
from tests.unit.spectrum.synthetic import CoastDown

from rotordrop.spectrum.candidates import (
    mains_candidates,
    mode_candidate,
    order_candidates,
    pendulum_candidate,
)
from rotordrop.spectrum.lines import find_lines

SEEDS = range(3)
CANDIDATES = (
    *order_candidates(),
    *mains_candidates(),
    pendulum_candidate("pendulum", 27.0, 31.0),
    mode_candidate("bending mode 1", 134.0, 3.0),
    mode_candidate("bending mode 2", 235.0, 4.0),
)
STEADY = {50.0: "mains hum 50 Hz", 134.0: "bending mode 1", 235.0: "bending mode 2", 171.3: None}


def built(kind: str, seed: int) -> CoastDown:
    coast = CoastDown(seed=seed)
    unbalance = 8.0 if kind == "8 x unbalance" else 1.0
    coast.add_order(1.0, 3e-6 * unbalance, growth=1.0)
    coast.add_order(2.0, 0.6e-6)
    coast.add_order(3.0, 0.3e-6)
    coast.add_order(1.5, 0.25e-6)
    coast.add_steady(50.0, 0.3e-6)
    coast.add_steady(134.0, 0.4e-6)
    coast.add_steady(235.0, 0.3e-6)
    coast.add_steady(171.3, 0.25e-6)
    if kind == "whirl":
        coast.add_whirl(-95.0, 40e-6, 0.5, 2.5)
    return coast


def judged(coast: CoastDown) -> dict:
    recorded = coast.recorded()
    lines = find_lines({"DE": coast.xy}, coast.sampling_rate, recorded, candidates=CANDIDATES, air_gap=285e-6)
    orders, steadies, missed, wrong = {}, {}, [], []
    for order, amplitude in coast.orders.items():
        near = [x for x in lines if x.order is not None and abs(x.order / order - 1.0) < 0.01]
        if not near:
            missed.append({"order": order, "over_floor": amplitude / coast.floor()})
            continue
        best = max(near, key=lambda line: line.amplitude)
        orders[order] = best.order / order - 1.0
        wrong += [best.label] if best.named and best.label != f"{order:g}X" else []
    for frequency in coast.steady:
        near = [x for x in lines if x.order is None and abs(x.frequency - frequency) < 1.0]
        if not near:
            missed.append({"frequency": frequency, "over_floor": coast.steady[frequency] / coast.floor()})
            continue
        best = max(near, key=lambda line: line.amplitude)
        steadies[frequency] = best.frequency - frequency
        wrong += [best.label] if best.named and best.label != STEADY[frequency] else []
    return {
        "known": len(coast.orders) + len(coast.steady),
        "found": len(orders) + len(steadies),
        "missed": missed,
        "named_wrongly": wrong,
        "largest_order_error": max(map(abs, orders.values()), default=None),
        "largest_frequency_error_hz": max(map(abs, steadies.values()), default=None),
        "others": [
            {"label": x.label, "frequency_hz": round(x.frequency, 2), "amplitude_m": x.amplitude}
            for x in lines
            if not _known(x, coast)
        ],
    }


def _known(line, coast: CoastDown) -> bool:
    if line.order is not None:
        return any(abs(line.order / order - 1.0) < 0.01 for order in coast.orders)
    return any(abs(line.frequency - frequency) < 1.0 for frequency in coast.steady)


def main() -> None:
    found = {}
    for kind in ("light unbalance", "8 x unbalance", "whirl"):
        cases = [judged(built(kind, seed)) for seed in SEEDS]
        errors = [case["largest_order_error"] for case in cases]
        shifts = [case["largest_frequency_error_hz"] for case in cases]
        found[kind] = {
            "seeds": list(SEEDS),
            "known": sum(case["known"] for case in cases),
            "found": sum(case["found"] for case in cases),
            "named_wrongly": sum(len(case["named_wrongly"]) for case in cases),
            "largest_order_error": float(np.max(errors)),
            "largest_frequency_error_hz": float(np.max(shifts)),
            "cases": cases,
        }
    keep("known_lines", found)


if __name__ == "__main__":
    main()
