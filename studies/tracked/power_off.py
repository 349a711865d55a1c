"""Is power-off found at 200 Hz, in the mean of 28 ms of fall? 120 drops of 40 machines.

Usage: python studies/tracked/power_off.py [MACHINES]

Every machine is drawn around the paper's rotor and recorded at 200 Hz three times; what is written is the
error of the instant and its stated standard error. Once, 4 of 28 drops at this speed were 1.0 ms early.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np

from rotordrop.evidence.evidence import Evidence
from rotordrop.machine import example_machine
from rotordrop_bench import hidden_machine, synthesize_drop

HERE = Path(__file__).parent
SPEED_HZ = 200.0
FIRST_SEED = 5001
DROPS = 3


def main() -> None:
    """Record, look, and write errors."""
    known = example_machine("lp400")
    rows = []
    for seed in range(FIRST_SEED, FIRST_SEED + int(sys.argv[1] if len(sys.argv) > 1 else 40)):
        hidden = hidden_machine(known, seed)
        for i in range(DROPS):
            drop = synthesize_drop(
                hidden, 2.0 * math.pi * SPEED_HZ, 10 * seed + i, duration=0.05, tail=False, tolerance=1e-6
            )
            found = Evidence(record=drop.record, machine=known).power_off
            rows.append([seed, i, found.value - drop.truth["t_off_in_record_s"], found.standard_error])
    errors = np.array([row[2] for row in rows])
    result = {
        "speed_Hz": SPEED_HZ,
        "drops": len(rows),
        "early_by_more_than_0.3_ms": int(np.sum(errors < -0.3e-3)),
        "late_by_more_than_0.3_ms": int(np.sum(errors > 0.3e-3)),
        "rms_us": 1e6 * float(np.sqrt(np.mean(errors**2))),
        "worst_us": 1e6 * float(errors[np.argmax(np.abs(errors))]),
        "columns": ["seed of the machine", "drop", "error s", "stated standard error s"],
        "rows": rows,
    }
    (HERE / "results" / "power_off_200_Hz.json").write_text(json.dumps(result, indent=1) + "\n")
    print({key: value for key, value in result.items() if key != "rows"})


if __name__ == "__main__":
    main()
