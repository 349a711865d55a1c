"""How much faster than real time a coast-down runs on one core, and how much memory it takes."""

from __future__ import annotations

import math
import resource
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from common import arguments, keep, machine_with_drag

from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.coast_down import simulate_coast_down
from rotordrop.simulate.coast_down_case import CoastDownCase

SPEED = 2.0 * math.pi * 60.0


def measured(model, case, output=None):
    before, clock = time.process_time(), time.perf_counter()
    result = simulate_coast_down(model, case, output=output)
    spent = time.process_time() - before
    return {
        "simulated_s": result.end_time,
        "processor_s": round(spent, 3),
        "clock_s": round(time.perf_counter() - clock, 3),
        "times_real_time": round(result.end_time / spent, 2),
        "runge_kutta_steps": result.steps,
        "standstill_s": result.standstill_time,
        "energy_residual_J": result.energy_residual,
        "energy_scale_J": result.energy_scale,
    }


def main() -> None:
    options = arguments(__doc__).parse_args()
    machine = machine_with_drag(options.machine, options.record)
    found = {"machine": machine.name}
    model = build_drop_model(machine, "quick")
    simulate_coast_down(model, CoastDownCase(speed=SPEED, duration=2.2))
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    whole = simulate_coast_down(model, CoastDownCase(speed=SPEED))
    rest = 75.0 - whole.end_time
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "c.h5"
        found["75 s to a file"] = measured(model, CoastDownCase(speed=SPEED, rest=rest), file)
        found["file_MB"] = round(file.stat().st_size / 1e6, 1)
    found["peak_memory_MB"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3, 1)
    found["of_it_before_the_run_MB"] = round(base / 1e3, 1)
    found["50 s, statistics only"] = measured(model, CoastDownCase(speed=SPEED, duration=50.0))
    found["10 s, Runge-Kutta only"] = measured(
        model, CoastDownCase(speed=SPEED, duration=10.0, settled_scheme=False)
    )
    found["10 s, settled scheme"] = measured(model, CoastDownCase(speed=SPEED, duration=10.0))
    keep("speed_and_memory", found)


if __name__ == "__main__":
    main()
