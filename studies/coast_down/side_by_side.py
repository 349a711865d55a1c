"""Simulated against recorded coast-down of the same machine: lines, amplitudes, maxima, standstill.

Drag is fitted to the recorded speed. Air gaps are those of the machine where they were calibrated, else the
settled radius of the record less the sag; all else is as the machine file has it.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from common import keep

from rotordrop.estimate.recorded_coast_down import recorded_coast_down, with_recorded_drag
from rotordrop.estimate.simulated_coast_down import simulated_coast_down
from rotordrop.machine import load_machine
from rotordrop.record.record import read_record
from rotordrop.simulate.case import LevitatedStart
from rotordrop.simulate.coast_down import simulate_coast_down
from rotordrop.simulate.coast_down_case import CoastDownCase
from rotordrop.spectrum.coast_down import WaterfallChoice, analyse_coast_down
from rotordrop.spectrum.machine_candidates import machine_candidates, swing_ranges

CHOICE = WaterfallChoice(components=("x", "y"))


def lines_of(analysis):
    return [
        {
            "label": line.label,
            "frequency_hz": round(line.frequency, 3),
            "order": None if line.order is None else round(line.order, 4),
            "amplitude_zero_to_peak_um": round(1e6 * line.amplitude, 4),
            "seen_s": [round(line.first_seen, 1), round(line.last_seen, 1)],
        }
        for line in analysis.lines
    ]


def maxima_of(analysis):
    return {
        name: {
            "largest_um": round(1e6 * plane.history.largest, 2),
            "at_s": round(plane.history.largest_time, 4),
            "later_um": round(1e6 * plane.history.largest_later, 2),
            "contact_from_s": plane.settling.contact_from,
            "statement": plane.history.statement,
        }
        for name, plane in analysis.planes.items()
    }


def kind_of(label):
    """Name of a line without the bearing, which pendulums of nearly equal bearings leave open."""
    return re.sub(r"pendulum \w+( or pendulum \w+)*", "pendulum", label)


def pairs(recorded, simulated):
    """Every named line of the record beside the strongest simulated one of the same kind."""

    def strongest(lines, name, key):
        same = [line for line in lines if kind_of(line["label"]) == name]
        return max(same, key=lambda line: line["amplitude_zero_to_peak_um"])[key] if same else None

    found = []
    named = [line["label"] for line in recorded if not line["label"].startswith("unnamed")]
    for name in dict.fromkeys(map(kind_of, named)):
        sides = {
            key: [strongest(lines, name, key) for lines in (recorded, simulated)]
            for key in ("frequency_hz", "amplitude_zero_to_peak_um")
        }
        found.append({"line": name, **sides})
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("machine", type=Path)
    parser.add_argument("record", type=Path)
    options = parser.parse_args()
    machine = load_machine(options.machine)
    record = recorded_coast_down(machine, read_record(options.record, machine))
    same = with_recorded_drag(machine, record)
    guessed = [b.name for b in machine.touchdown_bearings if b.air_gap.status != "estimated"]
    same = same.with_values({f"{name}.air_gap": record.air_gap[name] for name in guessed})
    speed = float(record.profile.speed_at(0.0))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "c.h5"
        case = CoastDownCase(speed=speed, rest=5.0, start=LevitatedStart())
        result = simulate_coast_down(same, case, output=file)
        candidates = machine_candidates(same)
        measured = analyse_coast_down(record, candidates, CHOICE)
        computed = analyse_coast_down(simulated_coast_down(file, same), candidates, CHOICE)
    keep(
        "side_by_side",
        {
            "machine": machine.name,
            "speed_hz": speed / (2.0 * math.pi),
            "air_gap_um": {name: round(1e6 * gap, 2) for name, gap in record.air_gap.items()},
            "drag": {
                "linear_torque_N_m_s": float(same.speed.aero_linear),
                "quadratic_torque_N_m_s2": float(same.speed.aero_quadratic),
                "race_drag_coefficient": float(same.touchdown_bearings[0].race.drag_coefficient),
            },
            "pendulum_small_hz": {swing.bearing: round(swing.small, 3) for swing in swing_ranges(same)},
            "recorded against simulated": pairs(lines_of(measured), lines_of(computed)),
            "recorded": {
                "standstill_s": measured.speed_law.standstill.as_json(),
                "time_constant_s": measured.speed_law.exponential.time_constant.value,
                "lines": lines_of(measured),
                "maxima": maxima_of(measured),
            },
            "simulated": {
                "standstill_s": result.standstill_time,
                "time_constant_s": computed.speed_law.exponential.time_constant.value,
                "lines": lines_of(computed),
                "maxima": maxima_of(computed),
                "force_and_stress": [maximum.as_json() for maximum in result.maxima()],
            },
        },
    )


if __name__ == "__main__":
    main()
