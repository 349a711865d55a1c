"""Give the cases of the corpus to a version, by its own command line in its own environment."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.files import make_folder, write_json
from rotordrop_bench.corpus.cases import Case, digest, made
from rotordrop_bench.corpus.table import Row, scored

LONGEST = 1800.0
"""Time after which a command is given up [s]."""


@dataclass(frozen=True, kw_only=True)
class Version:
    """A version of the program: a Python that has it installed, or a checkout."""

    name: str
    python: str
    environment: dict[str, str]

    @classmethod
    def at(cls, place: str, name: str | None = None) -> Version:
        """The version of a Python or of a checkout; a checkout is named by its commit."""
        path = Path(place).absolute()
        # one thread, so that a result does not depend on the computer's cores and the time counted is work
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        if path.is_file():
            return cls(name=name or path.parents[1].name, python=str(path), environment=environment)
        if not (path / "src" / "rotordrop").is_dir():
            raise UsageError(
                f"{place} is neither a Python nor a checkout with src/rotordrop; give one of them"
            )
        own = path / ".venv" / "bin" / "python"
        said = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--exclude=*"],
            cwd=path,
            capture_output=True,
            text=True,
        )
        return cls(
            name=name or said.stdout.strip() or path.name,
            python=str(own if own.is_file() else sys.executable),
            environment=environment | {"PYTHONPATH": str(path / "src")},
        )


def run(
    version: Version,
    cases: Sequence[Case],
    folder: Path,
    known: Iterable[Row] = (),
    report: Callable[[list[Row]], None] = lambda rows: None,
) -> list[Row]:
    """Run what is not yet there of these cases, and score all of them.

    ``folder/cases`` keeps what a version is given, ``folder/said/NAME`` what it said; a run that was stopped
    goes on where it was, or from the ``known`` rows of its table. ``report`` is called with all rows so far.
    """
    rows = {row.case: row for row in known}
    for case in cases:
        if case.name in rows:
            continue
        place = made(case, folder)
        said = folder / "said" / version.name / case.name
        make_folder(said)
        machine, record, tail = (str(place / name) for name in ("machine.toml", "record.csv", "tail.csv"))
        looked = _said(version, ["look", machine, record], said / "look")
        estimated: dict[str, Any] = {}
        if case.plan["estimated"]:
            more = ["--tail", tail] if case.has_tail else []
            estimated = _said(version, ["estimate", machine, record, *more], said / "estimate")
        rows[case.name] = scored(case.name, digest(place), place / "truth.json", looked, estimated)
        report(list(rows.values()))
    return [rows[case.name] for case in cases]


def _said(version: Version, command: list[str], stem: Path) -> dict[str, Any]:
    """Document, exit code and processor time [s] of a command, from the folder where it ran before."""
    kept, document = stem.with_suffix(".run.json"), stem.with_suffix(".json")
    if not kept.is_file():
        document.unlink(missing_ok=True)
        begun, before = time.monotonic(), os.times()
        try:
            done = subprocess.run(
                [version.python, "-m", "rotordrop", *command, "--json", str(document)],
                env=version.environment,
                capture_output=True,
                text=True,
                timeout=LONGEST,
            )
            code, words = done.returncode, done.stderr[-2000:]
        except subprocess.TimeoutExpired:
            code, words = -1, f"given up after {LONGEST:g} s"
        after = os.times()
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        ran = {"code": code, "seconds": round(spent, 2), "lasted_s": round(time.monotonic() - begun, 1)}
        write_json(kept, {**ran, "stderr": words})
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    if document.is_file():
        found["document"] = json.loads(document.read_text(encoding="utf-8"))
    return found
