"""Simulated coast-downs with 1 and 8 times the unbalance and with much friction: contacts, whirl, maxima."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from common import arguments, keep, machine_with_drag

from rotordrop.simulate.coast_down import simulate_coast_down
from rotordrop.simulate.coast_down_case import CoastDownCase

SECONDS = 5.0
CASES = [(speed, factor, mu) for speed in (60.0, 210.0) for factor in (1.0, 8.0) for mu in (None, 0.35)]


def main() -> None:
    options = arguments(__doc__).parse_args()
    machine = machine_with_drag(options.machine, options.record)
    found = {"machine": machine.name, "simulated_s": SECONDS, "cases": []}
    for speed, factor, mu in CASES:
        values = {
            f"unbalance.{k}.amount": factor * float(unbalance.amount)
            for k, unbalance in enumerate(machine.unbalances)
        }
        if mu is not None:
            for bearing in machine.touchdown_bearings:
                values[f"{bearing.name}.friction.dynamic"] = mu
                values[f"{bearing.name}.friction.static"] = 1.3 * mu
        before = time.process_time()
        case = CoastDownCase(speed=2.0 * math.pi * speed, duration=SECONDS)
        result = simulate_coast_down(machine.with_values(values), case)
        found["cases"].append(
            {
                "speed_hz": speed,
                "unbalance_times": factor,
                "friction": mu or float(machine.touchdown_bearings[0].friction.dynamic),
                "times_real_time": round(SECONDS / (time.process_time() - before), 1),
                "contacts": result.contacts.astype(int).tolist(),
                "contact_share_at_the_end": [round(float(x), 3) for x in result.windows.contact_share[-1]],
                "whirl_forward_backward_s": [[round(float(x), 3) for x in row] for row in result.whirl_time],
                "settled_share": [round(float(x), 2) for x in result.windows.settled[:, 0]],
                "energy_residual_J": result.energy_residual,
                "maxima": [maximum.sentence() for maximum in result.maxima()],
            }
        )
    keep("unbalance_and_whirl", found)


if __name__ == "__main__":
    main()
