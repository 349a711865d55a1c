"""Drops recorded by sensors with 1/f noise, estimated.

    python studies/coloured_noise/drops.py FOLDER [DROP ...]

Nine hidden machines (seeds 96100 to 96108, drops 96110 to 96118) of seven sizes, 1 and 3 µm of noise whose
power falls as one over the frequency beside the white one, on every sensor. Prints one row for each drop.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotordrop.machine.saving import machine_text
from rotordrop_bench.rotors import bench_rotor

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "further"))
from hidden_drops import cell, estimate, scored, truth_of, write_drop

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
    if not truth_of(place).is_file():
        rotor, size, speed = DROPS[number]
        machine, seeds = bench_rotor(rotor), (FIRST_MACHINE + number, FIRST_DROP + number)
        owned = {"machine": machine_text(machine)}
        write_drop(place, machine, speed, seeds, f'sensors.flicker = "{size}"', owned)
    return place


def row(number: int, place: Path) -> str:
    """One line of the table; the estimate is kept beside the recording."""
    rotor, size, _ = DROPS[number]
    file = place / "estimate.json"
    if not file.is_file():
        estimate(place, "machine.toml", file)
    score = scored(file)
    if "failed" in score:
        return f"| {number} | {rotor} | {size} | {score['failed']} |"
    of_bearings = score["bearings"].values()
    cells = [
        ", ".join(cell(bearing[field]) for bearing in of_bearings if field in bearing) for field in SHOWN
    ]
    numbers = [
        one for bearing in of_bearings for one in bearing.values() if one.get("half_width") is not None
    ]
    held = f"{sum(one['covered'] for one in numbers)} of {len(numbers)}"
    verdict = "yes" if score["consistent"] else "no"
    cells += [held, f"{score['took_s']:.0f}"]
    return f"| {number} | {rotor} | {size} | {verdict} | {' | '.join(cells)} |"


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
