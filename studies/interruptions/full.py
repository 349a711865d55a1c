"""Give the commands that compute for long a full disk for each of their outputs.

Usage: python studies/interruptions/full.py PLACE

PLACE is an empty, small file system (`mount -t tmpfs -o size=1m none PLACE`). All but 4 kB are filled before
every run, and all where a command writes less than that. It has to end with exit code 6 and a sentence, never
with a half file or a traceback. `tests/unit/cli/test_files_kept.py` does so with the other commands.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from tests.unit.evidence.test_clearance import pushed, record_of_paths

from rotordrop import example_machine, load_machine, save_machine
from rotordrop.record.examples import example_record_path
from rotordrop.record.recording import recording_of
from rotordrop.record.writers import write_hdf5

HERE = Path(__file__).parent
STUDY = 'machine = "lp400.toml"\nduration = "9 ms"\nreduction = "quick"\nspeed = "100 Hz"\n'
DESIGN = (
    STUDY + "candidates = 2\nrounds = 0\nrepeats = 2\nagain = 2\n"
    '[choose]\n"*.support.damping" = {log_uniform = ["2e3 N s/m", "5e4 N s/m"]}\n'
)
RARE = STUDY + 'drops = 2\nvary."*.friction.dynamic" = {uniform = [0.05, 0.25]}\n'
DROP = "estimate calibrated.toml drop.h5 --tail tail.csv --quick"
RUNS = (
    *(f"{DROP} {option} PLACE/{name}" for option, name in {"--json": "e.json", "--report": "e.html"}.items()),
    *(f"{DROP} -o PLACE/e.{ending}" for ending in ("h5", "csv", "mat", "parquet")),
    f"{DROP} --data PLACE/data",
    "clearance lift.h5 --machine lp400.toml -o PLACE/m.toml",
    "clearance lift.h5 --machine lp400.toml --json PLACE/c.json",
    "study rare rare.toml --column NDE.peak_force --above 1kN --samples 100 --repeats 4 --json PLACE/r.json",
    *(
        f"study design design.toml --folder {folder} {output}"
        for folder, output in (("PLACE/d", ""), ("d", "--json PLACE/d.json"), ("d", "--report PLACE/d.html"))
    ),
    *(
        f"study repeat calibrated.toml --speed 60Hz --drops 20 --folder {folder} {output}"
        for folder, output in (("PLACE/s", ""), ("s", "--json PLACE/s.json"), ("s", "--report PLACE/s.html"))
    ),
    "calibrate calibrated.toml drop.h5 --tail tail.csv --even-if-inconsistent -o PLACE/n.toml",
    "calibrate calibrated.toml drop.h5 --tail tail.csv --even-if-inconsistent -o n.toml --json PLACE/n.json",
)
LEFT = (4096, 0)
"""What is left on the disk [B]."""


def _fill(place: Path, left: int) -> None:
    with (place / "filling").open("wb", buffering=0) as stream:
        try:
            while stream.write(bytes(max(LEFT))):
                pass
        except OSError:
            stream.truncate(stream.tell() - left)


def main() -> None:
    """Run all, print a line for each."""
    place = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        machine = example_machine("lp400")
        save_machine(machine, folder / "lp400.toml")
        save_machine(
            load_machine(HERE / "lp400_calibrated.toml"),
            folder / "calibrated.toml",
        )
        (folder / "drop.h5").write_bytes(example_record_path("lp400_drop_060").read_bytes())
        (folder / "tail.csv").write_bytes(example_record_path("lp400_drop_060_tail").read_bytes())
        lift = record_of_paths([pushed(np.random.default_rng(1), 280e-6, 0.0)] * 2, machine)
        write_hdf5(recording_of(lift.time, lift.signals, lift.channel_names), folder / "lift.h5")
        (folder / "design.toml").write_text(DESIGN)
        (folder / "rare.toml").write_text(RARE)
        for words in RUNS:
            for left in LEFT:
                _fill(place, left)
                begun = time.monotonic()
                called = [sys.executable, "-m", "rotordrop", *words.replace("PLACE", str(place)).split()]
                done = subprocess.run(called, cwd=folder, capture_output=True, text=True, check=False)
                written = {
                    str(one.relative_to(place)): one.stat().st_size
                    for one in place.rglob("*")
                    if one.is_file() and one.name != "filling"
                }
                print(f"{words}\n  {time.monotonic() - begun:.0f} s, exit {done.returncode}, wrote {written}")
                print(f"  {done.stderr[-300:].strip()}", flush=True)
                for one in place.iterdir():
                    shutil.rmtree(one) if one.is_dir() else one.unlink()
                if done.returncode:
                    break


if __name__ == "__main__":
    main()
