"""What becomes of an estimate when all sensors read too much or too little alike.

Usage: python studies/gate/gains.py FACTOR TOLERANCE ...

The bundled drop and its tail, all readings times FACTOR, estimated with gains within TOLERANCE stated in the
machine file, or with none stated (0). One line of ``results/gains.jsonl`` each: what the gate says, the
verdict, and whether the intervals of the peak forces hold the truth.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop
from rotordrop.evidence.quality import check_record
from rotordrop.known import Known
from rotordrop.machine import example_machine
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import Record, read_record

RESULTS = Path(__file__).parent / "results" / "gains.jsonl"
TRUE_PEAKS = {"NDE": 3333.1, "DE": 3618.5}
"""Peak forces of the bundled drop [N]."""


def one(factor: float, tolerance: float) -> dict[str, Any]:
    """Estimate with readings times a factor."""
    machine = example_machine("lp400")
    if tolerance:
        stated = Known(value=1.0, status="guess", range=(1.0 - tolerance, 1.0 + tolerance))
        machine = machine.with_values({f"sensors.{sensor.name}.gain": stated for sensor in machine.sensors})

    def read(name: str) -> Record:
        record = read_record(example_record_path(name), machine)
        return replace(record, signals=np.ascontiguousarray(factor * record.signals))

    record, tail = read("lp400_drop_060"), read("lp400_drop_060_tail")
    line: dict[str, Any] = {"factor": factor, "tolerance": tolerance}
    line["gate"] = [[found.kind, found.severity] for found in check_record(record, machine, tail)]
    try:
        estimate = estimate_drop(machine, record, tail)
    except RotordropError as error:
        return line | {"refused": str(error)[:200]}
    line["verdict"] = estimate.verdict.name
    for bearing in estimate.bearings:
        known = bearing.peak_force.known
        low, high = known.interval_90 or (known.value, known.value)
        line[bearing.name] = {
            "peak_N": round(known.value),
            "interval_90": [round(low), round(high)],
            "held": bool(low <= TRUE_PEAKS[bearing.name] <= high),
        }
    line["gain_errors"] = [round(s.gain_error.value, 4) for s in estimate.sensors]
    return line


def main() -> None:
    """Run what the command line says."""
    RESULTS.parent.mkdir(exist_ok=True)
    for factor, tolerance in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        with RESULTS.open("a") as out:
            line = json.dumps(one(float(factor), float(tolerance)))
            print(line, flush=True)
            out.write(line + "\n")


if __name__ == "__main__":
    main()
