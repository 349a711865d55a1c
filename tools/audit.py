"""Look the locked versions up in a database of known vulnerabilities, where one is in reach.

    python tools/audit.py [REQUIREMENTS]

pip-audit goes into an environment of its own, so that nobody else installs what it needs. It calls a version
that its database does not hold "no vulnerability"; here that is counted and said as "not looked up". The exit
status is 1 where a known vulnerability is found, and 0 where nothing could be looked up: an absent network is
no fault of the code.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Any

PATIENCE = 300.0
"""Time [s] for pip-audit to be had, and for its answer: a network that swallows packets gives none."""
LOCK = Path(__file__).resolve().parent.parent / "requirements.lock"


def audited(requirements: Path, folder: Path) -> list[dict[str, Any]]:
    """What pip-audit says of each version; empty where it cannot be had or reaches no database."""
    venv.create(folder / "env", with_pip=True)
    python, found = str(folder / "env" / "bin" / "python"), folder / "found.json"
    options = ["--disable-pip", "--require-hashes", "-r", str(requirements), "-f", "json", "-o", str(found)]
    for module in (
        ["pip", "install", "--quiet", "pip-audit"],
        ["pip_audit", "--progress-spinner", "off", *options],
    ):
        try:
            done = subprocess.run(
                [python, "-m", *module], capture_output=True, text=True, timeout=PATIENCE, check=False
            )
        except subprocess.TimeoutExpired:
            print(f"{module[0]}: no answer within {PATIENCE:g} s", file=sys.stderr)
            return []
        if done.returncode and not found.exists():
            print(f"{module[0]}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}", file=sys.stderr)
            return []
    dependencies: list[dict[str, Any]] = json.loads(found.read_text())["dependencies"]
    return dependencies


def lines(versions: list[dict[str, Any]], locked: int) -> list[str]:
    """One line per known vulnerability, and a last one that says how much was looked up."""
    looked_up = [version for version in versions if "skip_reason" not in version]
    known = [
        f"{one['name']} {one['version']}: {each['id']}, mended in {', '.join(each['fix_versions']) or 'none'}"
        for one in looked_up
        for each in one["vulns"]
    ]
    missed = locked - len(looked_up)
    left = f"; {missed} could not be looked up from here" if missed else ""
    return [
        *known,
        f"{len(looked_up)} of {locked} locked versions looked up, {len(known)} known vulnerabilities{left}",
    ]


def main() -> int:
    """Print what is known; 1 where a vulnerability is."""
    requirements = Path(sys.argv[1]) if len(sys.argv) > 1 else LOCK
    locked = sum(line[:1].isalnum() and "==" in line for line in requirements.read_text().splitlines())
    with tempfile.TemporaryDirectory() as folder:
        told = lines(audited(requirements, Path(folder)), locked)
    print("\n".join(told))
    return len(told) > 1


if __name__ == "__main__":
    raise SystemExit(main())
