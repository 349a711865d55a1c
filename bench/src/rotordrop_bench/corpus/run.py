"""Rows of cases: of a version that is run by its own command line, or of estimates that anybody made."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.files import make_folder, write_json
from rotordrop_bench.corpus.cases import VERSION, Case, digest, made
from rotordrop_bench.corpus.table import ALWAYS, SHORT, Row, judged, name_of, said_of, scored
from rotordrop_bench.recording import truth_path
from rotordrop_bench.score import read_truth, score_estimate

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
        asked = ["git", "-C", str(path), "describe", "--always", "--dirty", "--exclude=*"]
        said = subprocess.run(asked, capture_output=True, text=True)
        return cls(
            name=name or said.stdout.strip() or path.name,
            python=str(own if own.is_file() else sys.executable),
            environment=environment | {"PYTHONPATH": str(path / "src")},
        )


def run(
    version: Version,
    cases: Sequence[Case],
    folder: Path,
    report: Callable[[list[Row]], None] = lambda rows: None,
) -> list[Row]:
    """Run what is not yet there of these cases, and score all of them.

    ``folder/drops`` keeps what a version is given, ``folder/said/NAME`` what it said; a run that was stopped
    goes on where it was. ``report`` is called with all rows so far.
    """
    rows: list[Row] = []
    for case in cases:
        place = made(case, folder)
        said = folder / "said" / version.name / case.name
        make_folder(said)
        machine, record, tail = (str(place / name) for name in ("machine.toml", "record.csv", "tail.csv"))
        looked = _said(version, ["look", machine, record], said / "look")
        estimated: dict[str, Any] = {}
        if case.plan["estimated"]:
            more = ["--tail", tail] if case.tail else []
            estimated = _said(version, ["estimate", machine, record, *more], said / "estimate")
        truth = read_truth(truth_path(folder, case.name))
        rows.append(scored(case.name, digest(place), truth, looked, estimated))
        report(rows)
    return rows


def _said(version: Version, command: list[str], stem: Path) -> dict[str, Any]:
    """Document, exit code and processor time [s] of a command, from the folder where it ran before."""
    kept, document = stem.with_suffix(".run.json"), stem.with_suffix(".json")
    if not kept.is_file():
        document.unlink(missing_ok=True)
        before = os.times()
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
        write_json(kept, {"code": code, "seconds": round(spent, 2), "stderr": words})
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    if document.is_file():
        found["document"] = json.loads(document.read_text(encoding="utf-8"))
    return found


def score_all(
    estimates: Path, truths: Path, drop: str | None = None
) -> tuple[dict[str, list[Row]], dict[str, dict[str, Any] | str]]:
    """Compare estimates with the truth of their recordings: a file each, or folders with ``NAME.json``.

    An estimate is the JSON of ``rotordrop estimate``, or at least
    ``{"bearings": {"NDE": {"peak_force_N": {"value": …, "interval_90": [low, high]}}}}``; ``drop`` is the
    recording meant of a single one. What is stated of one drop is missing where another has it not.

    Returns
    -------
    dict of list of Row
        Rows of all drops and of each family.
    dict
        By drop its scores (`rotordrop_bench.score`), or why its estimate cannot be used.
    """
    several = truths.is_dir()
    read = [read_truth(file) for file in (sorted(truths.glob("*.json")) if several else [truths])]
    if several and not estimates.is_dir():
        raise UsageError(f"{estimates} is no folder; give the one with the estimates, NAME.json each")
    if not read:
        raise UsageError(f"{truths} holds no truth; make some with 'rotordrop-bench make'")
    rows: dict[str, Row] = {}
    found: dict[str, dict[str, Any] | str] = {}
    for truth in read:
        if (version := truth.values.get("bench_version", VERSION)) != VERSION:
            raise UsageError(
                f"{truth.path} is of version {version!r} of the bench, this is version {VERSION!r}; make "
                "the bench again in another folder"
            )
        name, file = truth.name, estimates / f"{truth.name}.json" if several else estimates
        if several:
            scores = judged(file, truth) if file.is_file() else f"there is no {file.name}"
        else:
            scores = score_estimate(file, truth, drop=drop)
        found[name], rows[name] = scores, Row(case=name, digest="", violated=truth.violated)
        if not isinstance(scores, str):
            code, named = (7 if scores["consistent"] is False else 0), tuple(scores["named"])
            rows[name] = replace(rows[name], code=code, estimates=said_of(scores), named=named)
    stated = {name_of(key) for row in rows.values() for key in row.estimates}
    groups: dict[str, list[Row]] = {"all drops": []}
    for truth in read:
        due = [
            f"{SHORT.get(path, path)} {bearing}"
            for bearing in truth.bearing_names
            for path in truth.of_bearing(bearing)
            if path in ALWAYS or SHORT.get(path, path) in stated
        ]
        row = rows[truth.name]
        row = replace(row, estimates=dict.fromkeys(due, ()) | dict(row.estimates))
        groups["all drops"].append(row)
        if several and (family := truth.values.get("family")):
            groups.setdefault(family, []).append(row)
    return groups, found
