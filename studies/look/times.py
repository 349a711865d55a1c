"""Look at every record of a folder as a user does, and note the processor time.

Usage: python studies/look/times.py FOLDER PAGES

One line of ``results/times.csv`` for each record: exit status, user and system time [s], largest memory [MB],
drops and impacts seen. The pages are written to PAGES.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

RESULTS = Path(__file__).parent / "results" / "times.csv"
RECORDS = (".csv", ".txt", ".h5", ".mat", ".tdms", ".uff")


def looked_at(record: Path, pages: Path) -> list[object]:
    """One run of the command line in a process of its own."""
    page, found = pages / f"{record.name}.html", pages / f"{record.name}.json"
    command = [sys.executable, "-m", "rotordrop", "look", str(record), "--gap", "270um"]
    command += ["--report", str(page), "--json", str(found)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    seen = json.loads(found.read_text()) if found.is_file() else {"drops": [], "impacts": []}
    times = [round(used.ru_utime, 2), round(used.ru_stime, 2), round(used.ru_maxrss / 1024)]
    return [record.name, os.waitstatus_to_exitcode(status), *times, len(seen["drops"]), len(seen["impacts"])]


def main() -> None:
    """Run what the command line says."""
    pages = Path(sys.argv[2])
    pages.mkdir(parents=True, exist_ok=True)
    RESULTS.parent.mkdir(exist_ok=True)
    with RESULTS.open("w", newline="") as out:
        table = csv.writer(out)
        table.writerow(["record", "exit", "user_s", "system_s", "memory_MB", "drops", "impacts"])
        for record in sorted(Path(sys.argv[1]).iterdir()):
            if record.suffix in RECORDS:
                table.writerow(looked_at(record, pages))
                out.flush()


if __name__ == "__main__":
    main()
