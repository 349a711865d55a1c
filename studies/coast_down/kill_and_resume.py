"""Kill a coast-down at random moments with SIGKILL, resume it, and compare the file byte by byte."""

from __future__ import annotations

import hashlib
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from common import arguments, keep, machine_with_drag

from rotordrop.machine.saving import save_machine

SEED, KILLS, SECONDS = 4, 3, 12


def command(machine: Path, output: Path, *, resume: bool) -> list[str]:
    verb = [sys.executable, "-m", "rotordrop", "coast-down", str(machine), "--speed", "60 Hz"]
    more = ["--until", f"{SECONDS} s", "--output", str(output)]
    return [*verb, *more, *(["--resume"] if resume else [])]


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def main() -> None:
    options = arguments(__doc__).parse_args()
    dice = random.Random(SEED)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        machine = folder / "machine.toml"
        save_machine(machine_with_drag(options.machine, options.record), machine)
        whole, cut = folder / "whole.h5", folder / "cut.h5"
        subprocess.run(command(machine, whole, resume=False), check=True, stdout=subprocess.DEVNULL)
        parts, resume = [], False
        for _ in range(KILLS):
            run = subprocess.Popen(command(machine, cut, resume=resume), stdout=subprocess.DEVNULL)
            wanted = len(parts) * 3 + 2
            work = cut.with_name("cut.h5.partial")
            while run.poll() is None and len(list(work.glob("part-*.h5"))) < wanted:
                time.sleep(0.01)
            time.sleep(dice.uniform(0.0, 0.15))
            run.kill()
            run.wait()
            parts.append(len(list(work.glob("part-*.h5"))))
            resume = work.exists()
        assert not cut.exists(), "a killed run left an output behind"
        subprocess.run(command(machine, cut, resume=True), check=True, stdout=subprocess.DEVNULL)
        keep(
            "kill_and_resume",
            {
                "seed": SEED,
                "simulated_s": SECONDS,
                "parts_on_disk_at_each_kill": parts,
                "sha256_without_kill": digest(whole),
                "sha256_after_kills": digest(cut),
                "bit_identical": digest(whole) == digest(cut),
            },
        )


if __name__ == "__main__":
    main()
