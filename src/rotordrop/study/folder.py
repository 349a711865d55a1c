"""A study on disk: plan, claimed shards, finished shards. The folder is the truth; whoever sees it may work.

A shard is claimed by making a file that must not exist yet, and published by renaming a whole file. Claims
only save work: a shard computed twice has the same bits, so that a lost or stolen claim can spoil nothing.
"""

from __future__ import annotations

import io
import json
import os
import secrets
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.errors import OutputError, UsageError
from rotordrop.files import atomic_path, write_json, write_text
from rotordrop.machine import load_machine
from rotordrop.machine.saving import machine_text
from rotordrop.study.plan import Study, planned_study
from rotordrop.study.quantities import columns_of

Array = NDArray[np.float64]

FORMAT = "rotordrop study 2"
REASON = 160
"""Characters kept of why a drop failed; chosen, not measured."""
LEASE = 120.0
"""Time after which a claim without a sign of life may be taken over [s]; drops are signs of life."""


@dataclass(frozen=True, kw_only=True)
class Shard:
    """Finished drops of a shard, in order."""

    first: int
    """Number of the first drop."""
    varied: Array
    """Values drawn [SI], shape (n, V)."""
    numbers: Array
    """Quantities [SI]; all NaN where a drop failed, shape (n, Q)."""
    reasons: tuple[str, ...]
    """Why a drop failed; empty where it did not."""


@dataclass(frozen=True)
class StudyFolder:
    """Where the parts of a study lie."""

    path: Path

    @property
    def shards(self) -> Path:
        """Folder of the finished shards."""
        return self.path / "shards"

    @property
    def claims(self) -> Path:
        """Folder of the claims."""
        return self.path / "claims"

    def shard_path(self, shard: int) -> Path:
        """File of a finished shard."""
        return self.shards / f"{shard:06d}.npy"

    def finished(self) -> list[int]:
        """Numbers of the finished shards, rising."""
        return sorted(int(file.stem) for file in self.shards.glob("[0-9]*.npy"))


def open_folder(study: Study, path: str | Path) -> StudyFolder:
    """Make the folder of a study, or continue in one that holds the same study."""
    folder = StudyFolder(Path(path))
    existing = folder.path / "plan.json"
    if existing.exists():
        there = read_plan(folder.path)
        if there["digest"] != study.digest:
            raise UsageError(
                f"{folder.path} holds another study ({there['study'].get('name')!r}, digest "
                f"{there['digest'][:12]}; this one has {study.digest[:12]}); name another folder, or "
                "undo the change of study or machine"
            )
        return folder
    plan = {
        "format": FORMAT,
        "rotordrop": __version__,
        "digest": study.digest,
        "study": study.document(),
        "columns": [
            {"name": q.name, "unit": q.unit, "meaning": q.meaning} for q in columns_of(study.machine)
        ],
    }
    try:
        for part in (folder.path, folder.shards, folder.claims):
            part.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder.path}: cannot make the study folder: {error.strerror}") from error
    write_text(folder.path / "machine.toml", machine_text(study.machine))
    write_json(existing, plan)  # last: a folder with a plan is complete
    return folder


def read_plan(path: str | Path) -> dict[str, Any]:
    """Plan of a study folder; refuses what is none."""
    file = Path(path) / "plan.json"
    try:
        plan = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{Path(path)} is not a study folder ({file.name}: {error}); name a folder that 'rotordrop study "
            "run' has made"
        ) from error
    if not isinstance(plan, dict) or plan.get("format") != FORMAT:
        raise UsageError(f"{file} has format {plan.get('format')!r}; expected {FORMAT!r}")
    return plan


def study_of(path: str | Path) -> Study:
    """The study that a folder holds, for whoever joins the work with nothing but the folder."""
    plan = read_plan(path)
    machine = load_machine(Path(path) / "machine.toml")
    study = planned_study(plan["study"], machine)
    if study.digest != plan["digest"]:
        raise UsageError(
            f"{Path(path)}: plan and machine file do not belong together (digest {study.digest[:12]}, "
            f"expected {plan['digest'][:12]}); one of them was changed after the study began"
        )
    return study


def publish(folder: StudyFolder, study: Study, shard: int, found: Shard) -> None:
    """Write a finished shard, complete or not at all; what is published already stays."""
    table = np.zeros(len(found.numbers), dtype=shard_type(study))
    table["drop"] = np.arange(found.first, found.first + len(table))
    table["varied"] = found.varied
    table["numbers"] = found.numbers
    table["reason"] = [reason.encode("ascii", "replace")[:REASON] for reason in found.reasons]
    target = folder.shard_path(shard)
    for left in folder.shards.glob(f".{target.stem}.*"):  # of a writer that was killed
        left.unlink(missing_ok=True)
    content = io.BytesIO()  # numpy's own way into a file drops the error of a full disk, and what did not fit
    np.lib.format.write_array(content, table, allow_pickle=False)
    with atomic_path(target) as temporary, temporary.open("wb") as file:
        file.write(content.getbuffer())


def shard_type(study: Study) -> np.dtype[Any]:
    """Record type of a shard file."""
    return np.dtype(
        [
            ("drop", "<i8"),
            ("varied", "<f8", (len(study.varied),)),
            ("numbers", "<f8", (len(columns_of(study.machine)),)),
            ("reason", f"S{REASON}"),
        ]
    )


def read_shard(folder: StudyFolder, study: Study, shard: int) -> NDArray[Any]:
    """A finished shard; one that does not fit the plan is refused by name."""
    file = folder.shard_path(shard)
    try:
        table = np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise OutputError(f"{file} cannot be read ({error}); delete it, and run the study again") from error
    drops = study.drops_of(shard)
    if table.dtype != shard_type(study) or not np.array_equal(table["drop"], np.asarray(drops)):
        raise OutputError(
            f"{file} does not hold drops {drops.start} to {drops.stop - 1} of this study; delete it, and run "
            "the study again"
        )
    return np.asarray(table)


def tidy(folder: StudyFolder) -> None:
    """Remove claims of shards that are published: their worker died between publishing and letting go."""
    for shard in folder.finished():
        with suppress(OSError):
            (folder.claims / f"{shard:06d}.json").unlink()


class Claim:
    """A shard that somebody works on; `alive` is called while the work goes on."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._said = time.time()

    def alive(self) -> None:
        """Give a sign of life, at most every tenth of the lease."""
        now = time.time()
        if now - self._said > 0.1 * LEASE:
            self._said = now
            with suppress(OSError):  # somebody took over: both will publish the same bits
                os.utime(self._file)


@contextmanager
def claimed(folder: StudyFolder, shard: int) -> Iterator[Claim | None]:
    """Claim a shard for the time of the block; None where another one works on it."""
    file = folder.claims / f"{shard:06d}.json"
    mine = _made(file)
    if not mine and _abandoned(file):
        aside = file.with_name(f"{file.stem}.{secrets.token_hex(8)}.stale")
        with suppress(OSError):  # of several who put an abandoned claim aside, one succeeds
            file.rename(aside)
            mine = _made(file)
            aside.unlink()
    if not mine:
        yield None
        return
    try:
        yield Claim(file)
    finally:
        with suppress(OSError):
            file.unlink()


def _made(file: Path) -> bool:
    try:
        descriptor = os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644)
    except FileExistsError:
        return False
    except OSError as error:
        raise OutputError(
            f"{file}: cannot claim a shard: {error.strerror}; the study can be resumed"
        ) from error
    with os.fdopen(descriptor, "w", encoding="utf-8") as text:
        json.dump({"host": socket.gethostname(), "process": os.getpid(), "since": time.time()}, text)
    return True


def _abandoned(file: Path) -> bool:
    """Whether whoever made a claim is gone: a dead process of this computer, or no sign of life."""
    try:
        age = time.time() - file.stat().st_mtime
        owner = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return False
    except ValueError:  # killed between making and writing
        return age > 5.0
    if age > LEASE:
        return True
    # elsewhere than on POSIX there is no harmless way to ask whether a process runs: only the lease tells
    if os.name != "posix" or owner.get("host") != socket.gethostname():
        return False
    try:
        os.kill(int(owner.get("process", 0)), 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        pass
    return False
