"""Compile into a folder the kernels that the commands call on the bundled examples: what a wheel carries.

``python tools/kernels.py FOLDER [VERB ...]`` compiles for any x86-64 processor with AVX2 and FMA, since about
2015; with verbs these only are called. What the folder holds for these sources, this compiler and this Python
stays; what it holds for others goes.
"""

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from rotordrop.physics._compile import kernel_digest
from rotordrop.physics._numba import PORTABLE

LOAD = """
[[loads]]
node = 9
direction = "-90 deg"
force = "1 N"
"""
"""Few machines have an optional part; with one, kernels are compiled whole."""
COMMANDS = """
check lp400/machine.toml
critical-speeds lp400/machine.toml
simulate lp400/machine.toml --speed 60Hz --output drop.h5
look lp400/machine.toml lp400/drop_060.h5
estimate lp400/machine.toml lp400/drop_060.h5 --tail lp400/drop_060_tail.csv --json drop.json
coast-down paper/machine.toml --speed 60Hz --until 1s --output coast_down.h5
waterfall paper/machine.toml coast_down.h5
simulate lp400/loaded.toml --speed 60Hz --output drop.h5
estimate lp400/loaded.toml lp400/drop_060.h5 --tail lp400/drop_060_tail.csv
coast-down paper/loaded.toml --speed 60Hz --until 1s
"""


def main(folder: Path, verbs: list[str]) -> None:
    """Run the commands with their kernels in the folder."""
    if (here := platform.machine()) not in ("x86_64", "AMD64"):
        sys.exit(f"kernels are carried for x86-64, and this is {here}; call: pip wheel --no-deps .")
    digest = kernel_digest()
    for other in folder.glob("*"):
        if other.name != digest:
            shutil.rmtree(other)
    name, features = PORTABLE
    environment = {"NUMBA_CACHE_DIR": str(folder), "NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features}
    with tempfile.TemporaryDirectory() as place:

        def run(command: str) -> None:
            subprocess.run(
                [sys.executable, "-m", "rotordrop", *command.split()],
                cwd=place,
                env=os.environ | environment,
                stdout=subprocess.DEVNULL,
                check=True,
            )

        for example in ("lp400", "paper"):
            run(f"init --example {example} {example}")
            machine = Path(place, example, "machine.toml")
            machine.with_name("loaded.toml").write_text(machine.read_text("utf-8") + LOAD, "utf-8")
        for command in COMMANDS.strip().splitlines():
            if not verbs or command.split()[0] in verbs:
                run(command)
    files = list((folder / digest).glob("*.object"))
    print(f"{len(files)} kernels, {sum(file.stat().st_size for file in files) / 1e6:.1f} MB, for {name}")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), sys.argv[2:])
