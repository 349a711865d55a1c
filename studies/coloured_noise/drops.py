"""Drops recorded by sensors with 1/f noise, estimated.

    python studies/coloured_noise/drops.py FOLDER [DROP ...]

Nine hidden machines (seeds 96100 to 96108, drops 96110 to 96118) of seven sizes, 1 and 3 µm of noise whose
power falls as one over the frequency beside the white one, on every sensor. Prints one row for each drop.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Any

from rotordrop import estimate_drop
from rotordrop.document import read_json
from rotordrop.errors import RotordropError
from rotordrop.files import make_folder, write_json
from rotordrop.machine import load_machine
from rotordrop.machine.saving import machine_text
from rotordrop.record.record import read_record
from rotordrop_bench import score_estimate
from rotordrop_bench.event import hidden_machine
from rotordrop_bench.files import write_synthetic
from rotordrop_bench.recording import synthesize_drop
from rotordrop_bench.rotors import bench_rotor
from rotordrop_bench.sensor_chain import SensorChain

FIRST_MACHINE, FIRST_DROP = 96100, 96110
DROPS = (
    ("5 kg", "1 um", 150.0),
    ("13 kg", "3 um", 150.0),
    ("30 kg", "1 um", 120.0),
    ("60 kg", "3 um", 120.0),
    ("140 kg", "3 um", 100.0),
    ("500 kg", "1 um", 60.0),
    ("13 kg", "1 um", 200.0),
    ("1.6 t", "3 um", 50.0),
    ("30 kg", "3 um", 80.0),
)
"""Rotor, size of the 1/f noise and speed [Hz]."""
SHOWN = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N", "air_gap_m")


def make(folder: Path, number: int) -> Path:
    """Machine file, recording, tail and truth of one drop; where they are."""
    place = folder / f"f{number}"
    if (place / "truth" / "record.json").is_file():
        return place
    rotor, size, speed = DROPS[number]
    machine = bench_rotor(rotor)
    make_folder(place)
    (place / "hidden.toml").write_text(f'sensors.flicker = "{size}"\n')
    hidden = hidden_machine(machine, FIRST_MACHINE + number, str(place / "hidden.toml"))
    largest = max(float(bearing.air_gap) for bearing in hidden.machine.touchdown_bearings)
    chain = SensorChain(sampling_rate=20e3, full_scale=max(600e-6, 2.0 * largest))
    (place / "machine.toml").write_text(machine_text(machine))
    made = synthesize_drop(
        hidden, 2.0 * math.pi * speed, FIRST_DROP + number, sensor_chain=chain, name="record"
    )
    write_synthetic(made, place, name="record", histories=False)
    return place


def estimate(place: Path) -> dict[str, Any]:
    """One estimate, or why there is none; kept beside the recording."""
    file = place / "estimate.json"
    if not file.is_file():
        began = time.process_time()
        machine = load_machine(place / "machine.toml")
        record, tail = (read_record(place / f"{one}.csv", machine) for one in ("record", "record_tail"))
        try:
            found: dict[str, Any] = estimate_drop(machine, record, tail, name="record").to_dict()
        except RotordropError as error:
            found = {"failed": f"{type(error).__name__}: {error}"}
        write_json(file, found | {"took_s": time.process_time() - began}, sealed=True)
    return dict(read_json(file, "studies/coloured_noise/drops.py"))


def row(number: int, place: Path) -> str:
    """One line of the table."""
    rotor, size, _ = DROPS[number]
    found = estimate(place)
    took = found.pop("took_s")
    if "failed" in found:
        return f"| {number} | {rotor} | {size} | {found['failed']} |"
    score = score_estimate(found, place / "truth" / "record.json", drop="record")
    of_bearings = score["bearings"].values()
    cells = []
    for field in SHOWN:
        own = [bearing[field] for bearing in of_bearings if field in bearing]
        cells.append(
            ", ".join(
                f"{100 * one['relative_error']:+.1f} ± {100 * one['half_width']:.1f}"
                f"{'' if one['covered'] else ' !'}"
                for one in own
            )
        )
    numbers = [
        one for bearing in of_bearings for one in bearing.values() if one.get("half_width") is not None
    ]
    held = f"{sum(one['covered'] for one in numbers)} of {len(numbers)}"
    verdict = "yes" if score["consistent"] else "no"
    return f"| {number} | {rotor} | {size} | {verdict} | {' | '.join(cells)} | {held} | {took:.0f} |"


def main() -> None:
    """Make and estimate the drops, all of them or those named."""
    folder = Path(sys.argv[1])
    print("Errors ± half widths of 90 % intervals in per cent, NDE and DE; ! outside.\n")
    print("| drop | rotor | 1/f noise | consistent | force | stress | mean force | gap | held | time in s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for number in [int(one) for one in sys.argv[2:]] or range(len(DROPS)):
        print(row(number, make(folder, number)), flush=True)


if __name__ == "__main__":
    main()
