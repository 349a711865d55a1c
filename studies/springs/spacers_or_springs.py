"""What springs that hold the preload take off a drop, against rigid spacers, on rotors of 5 kg to 6 t.

Usage: python studies/springs/spacers_or_springs.py

One drop each from the nominal speed, described as its owner knows it; writes ``table.md``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult
from rotordrop_bench.rotors import ROTORS, bench_rotor

DURATION = 0.2
SLACK = 0.1
"""Rate of slack springs over the default one [1]."""

KINDS: dict[str, dict[str, Any]] = {
    "default rate, friction 0.15": {},
    "friction 0.4": {"fit_friction": 0.4},
    "friction 0": {"fit_friction": 0.0},
    "a tenth of the rate, friction 0": {"fit_friction": 0.0, "slack": True},
}


def on_springs(machine: Machine, fit_friction: float = 0.15, slack: bool = False) -> Machine:
    """The machine with springs in place of the spacers of both bearings."""
    bearings = []
    for bearing in machine.touchdown_bearings:
        pair = bearing.bearing.changed(preload_kind="spring", fit_friction=fit_friction)
        own = bearing.changed(bearing=pair)
        if slack:
            rate = SLACK * float(own.bearing.spring_rate)
            own = bearing.changed(bearing=pair.changed(spring_rate=f"{rate!r} N/m"))
        bearings.append(own)
    return machine.completed_with({"touchdown_bearings": tuple(bearings)})


def peaks(machine: Machine) -> Array:
    """Largest force on each bearing [N] and largest stress there [Pa], shape (2, B)."""
    speed = float(machine.speed.nominal)
    result: DropResult = simulate_drop(build_drop_model(machine), DropCase(speed=speed, duration=DURATION))
    return np.array([np.max(result.bearing_force_magnitude, axis=0), np.max(result.max_stress, axis=0)])


def signed(percent: float) -> str:
    """A change [%] with its sign."""
    return f"{percent:+.0f}".replace("-", "−")


def main() -> None:
    """Simulate all and write the table."""
    rows = [
        f"Change against rigid spacers in {DURATION:g} s [%]: "
        "largest force at NDE and DE; largest stress there.",
        "",
        "| rotor | " + " | ".join(KINDS) + " |",
        "| --- |" + " --- |" * len(KINDS),
    ]
    found: dict[str, list[Array]] = {kind: [] for kind in KINDS}
    for name in ROTORS:
        machine = bench_rotor(name)
        rigid = peaks(machine)
        cells = []
        for kind, how in KINDS.items():
            change = 100.0 * (peaks(on_springs(machine, **how)) / rigid - 1.0)
            found[kind].append(change)
            cells.append("; ".join(", ".join(map(signed, row)) for row in change))
        rows.append(f"| {name} | {' | '.join(cells)} |")
        print(rows[-1], flush=True)
    for i, words in enumerate(("force", "stress")):
        middle = []
        for changes in found.values():
            values = np.array(changes)[:, i].ravel()
            low, high, median = map(signed, (values.min(), values.max(), np.median(values)))
            middle.append(f"{low} to {high}, median {median}")
        rows.append(f"| all, {words} | {' | '.join(middle)} |")
    (Path(__file__).parent / "table.md").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
