"""How far the statistics of a coast-down move: tighter tolerance, settled scheme, more modes."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from common import arguments, keep, machine_with_drag

from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.coast_down import simulate_coast_down
from rotordrop.simulate.coast_down_case import CoastDownCase
from rotordrop.simulate.coast_down_certificate import compare_coast_downs

SECONDS = 10.0


def main() -> None:
    options = arguments(__doc__).parse_args()
    machine = machine_with_drag(options.machine, options.record)
    model = build_drop_model(machine, "quick")
    case = CoastDownCase(speed=2.0 * math.pi * 60.0, duration=SECONDS)
    result = simulate_coast_down(model, case)
    others = {
        "settled scheme against Runge-Kutta, same tolerance": (model, replace(case, settled_scheme=False)),
        "tolerance 1e-7, Runge-Kutta": (model, replace(case, settled_scheme=False, tolerance=1e-7)),
        "tolerance 1e-8, Runge-Kutta": (model, replace(case, settled_scheme=False, tolerance=1e-8)),
        "14 + 2 modes": (build_drop_model(machine, "accurate"), replace(case, reduction="accurate")),
    }
    found = {"machine": machine.name, "simulated_s": SECONDS}
    for name, (other_model, other) in others.items():
        found[name] = compare_coast_downs(result, simulate_coast_down(other_model, other)).as_json()
    settled = result.windows.settled
    found["settled_scheme_over_2_ms"] = {
        "displacement_m": float(settled[:, 1].max()),
        "ball_force_N": float(settled[:, 2].max()),
    }
    keep("error_of_the_statistics", found)


if __name__ == "__main__":
    main()
