"""Drops of one end of hidden machines, and how their estimates hold.

Usage: python studies/one_end/drops.py FOLDER [--score]

Makes machine file, recording and truth of each drop in FOLDER, with one magnet on; `rotordrop estimate
FOLDER/NAME/machine.toml FOLDER/NAME/record.csv --json FOLDER/NAME/estimate.json` estimates one. With --score
it writes ``results/table.md`` over the estimates there are.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotordrop.files import make_folder, write_json
from rotordrop.machine.saving import save_machine
from rotordrop.record.record import sha256_of
from rotordrop_bench import score_estimate
from rotordrop_bench.files import write_record
from rotordrop_bench.rotors import bench_rotor
from rotordrop_bench.violations import Violations

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "further"))
from hidden_drops import cell, hidden_drop

CASES = {
    "60kg": ("60 kg", 120.0, 1500, "NDE"),
    "13kg": ("13 kg", 260.0, 1501, "DE"),
    "500kg": ("500 kg", 70.0, 1502, "NDE"),
}
"""Rotor, speed at power-off [Hz], seed of the hidden machine (that of the drop: 9500 more), magnet on."""
SHOWN = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N", "air_gap_m")


def make(folder: Path, name: str) -> None:
    """Record one drop."""
    rotor, speed, seed, on = CASES[name]
    machine = bench_rotor(rotor)
    broken = Violations.model_validate({"magnets": {"stays_on": [on]}})
    made = hidden_drop(machine, speed, (seed, 9500 + seed), broken, rotor)
    place = folder / name
    make_folder(place)
    save_machine(machine, place / "machine.toml")
    write_record(made.record, place / "record.csv")
    truth = made.truth | {"record_sha256": {"record.csv": sha256_of(place / "record.csv")}}
    write_json(place / "truth.json", truth, sealed=True)


def row(folder: Path, name: str) -> str:
    """Errors ± half widths of the end that fell; ! where the interval does not hold the truth."""
    scored = score_estimate(folder / name / "estimate.json", folder / name / "truth.json", drop=name)
    on = CASES[name][3]
    cells = [name, on, str(scored["consistent"])]
    for end, own in scored["bearings"].items():
        if end == on:
            continue
        cells += [cell(own[quantity], " %") for quantity in SHOWN]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Make what is missing, or score."""
    folder = Path(sys.argv[1])
    for name in CASES:
        if not (folder / name / "truth.json").is_file():
            make(folder, name)
    if "--score" not in sys.argv:
        return
    lines = [
        "End that fell: error ± half width of the 90 % interval.",
        "",
        "| drop | magnet on | consistent | peak force | peak stress | mean force, 150 to 200 ms | air gap |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [row(folder, name) for name in CASES if (folder / name / "estimate.json").is_file()]
    results = Path(__file__).parent / "results"
    results.mkdir(exist_ok=True)
    (results / "table.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
