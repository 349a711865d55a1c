"""A study on disk: plan and finished shards. The folder is the truth.

A shard is published by renaming a whole file, and one that is computed twice has the same bits: a repeated
shard is harmless. One lock a folder keeps two runs apart. Plan and shards carry digests: what has changed on
the disk is named, kept aside and computed again.
"""

from __future__ import annotations

import hashlib
import io
import re
import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.arrays import Array
from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import (
    atomic_path,
    clear_of_no_file,
    digest_of_file,
    read_sealed,
    require_file,
    write_json,
    write_text,
)
from rotordrop.machine import load_machine
from rotordrop.machine.saving import machine_text
from rotordrop.study.plan import Study, planned_study
from rotordrop.study.quantities import columns_of

FORMAT = "rotordrop study 4"
REASON = 160
"""Characters kept of why a drop failed; chosen, not measured."""

_SHARD = re.compile(r"[0-9]{6}|[1-9][0-9]{6,}")
_SEAL = hashlib.sha256().digest_size


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

    def shard_path(self, shard: int) -> Path:
        """File of a finished shard."""
        return self.shards / f"{shard:06d}.npy"

    def finished(self) -> list[int]:
        """Numbers of the finished shards, rising."""
        return sorted(int(file.stem) for file in self.shards.glob("*.npy") if _SHARD.fullmatch(file.stem))

    def aside(self) -> list[str]:
        """Names of the damaged shards that were kept."""
        return sorted(file.name for file in self.shards.glob("*.damaged"))


def open_folder(study: Study, path: str | Path) -> StudyFolder:
    """Make the folder of a study, or continue in one that holds the same study.

    One of another version is refused unless all its drops are there: numbers may differ between versions.
    """
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
        if len(folder.finished()) < study.shards:
            require_same_version(there, folder.path)
        return folder
    try:
        folder.shards.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder.path}: cannot make the study folder: {error.strerror}") from error
    require_file(folder.path / "machine.toml", "remove it, and run the study again")
    write_text(folder.path / "machine.toml", machine_text(study.machine))
    plan = {
        "format": FORMAT,
        "rotordrop": __version__,
        "digest": study.digest,
        "study": study.document(),
        "columns": [
            {"name": q.name, "unit": q.unit, "meaning": q.meaning} for q in columns_of(study.machine)
        ],
        "machine_sha256": digest_of_file(folder.path / "machine.toml"),
    }
    write_json(existing, plan, sealed=True)  # last: a folder with a plan is complete
    return folder


@contextmanager
def alone_in(folder: StudyFolder) -> Iterator[None]:
    """Hold the lock of a folder, so that no other run computes there; the system frees that of a dead one."""
    file = folder.path / "lock"
    clear_of_no_file(file)
    lock = FileLock(file)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise UsageError(
            f"another run computes the study in {folder.path}; wait for it, or name another folder"
        ) from None
    except OSError as error:
        raise OutputError(f"{file}: the study cannot be locked: {error.strerror}") from error
    try:
        yield
    finally:
        lock.release()


def read_plan(path: str | Path) -> dict[str, Any]:
    """Plan of a study folder; refuses what is none."""
    file = Path(path) / "plan.json"
    try:
        plan = read_sealed(
            file, "remove it, and run the study again with its study file: finished shards stay"
        )
    except OSError as error:
        raise UsageError(
            f"{Path(path)} is not a study folder ({file.name}: {error}); name a folder that 'rotordrop study "
            "run' has made"
        ) from error
    if plan.get("format") != FORMAT:
        raise UsageError(
            f"{Path(path)} has format {plan.get('format')!r}, and rotordrop {__version__} reads {FORMAT!r}: "
            "another version has made it. Go on with that version, or name another folder"
        )
    return plan


def require_same_version(plan: Mapping[str, Any], path: Path) -> None:
    """Refuse to compute drops for a study that another version of rotordrop began."""
    if plan["rotordrop"] != __version__:
        raise UsageError(
            f"{path} was begun by rotordrop {plan['rotordrop']}, and this is {__version__}: numbers may "
            "differ between versions. Go on with that version, or name another folder"
        )


def study_of(path: str | Path) -> Study:
    """The study that a folder holds, for a worker that knows nothing but the folder."""
    plan, file = read_plan(path), Path(path) / "machine.toml"
    if not file.is_file():
        raise DamagedFileError(f"{file} is gone; remove plan.json too, and run the study again")
    if digest_of_file(file) != plan["machine_sha256"]:
        raise DamagedFileError(
            f"{file} is damaged, or was changed after the study began: plan and machine file do not belong "
            f"together; remove {file.name} and plan.json, and run the study again with its study file"
        )
    study = planned_study(plan["study"], load_machine(file))
    if study.digest != plan["digest"]:
        raise UsageError(
            f"{Path(path)} was begun by rotordrop {plan['rotordrop']}, and this is {__version__}, which "
            "makes another study of its plan and machine file; use that version, or another folder"
        )
    return study


def publish(folder: StudyFolder, study: Study, shard: int, found: Shard) -> None:
    """Write a finished shard, complete or not at all; what is published already stays."""
    table = np.zeros(len(found.numbers), dtype=shard_type(study))
    table["drop"] = np.arange(found.first, found.first + len(table))
    table["varied"] = found.varied
    table["numbers"] = found.numbers
    table["reason"] = [
        reason.replace("µ", "u").encode("ascii", "replace")[:REASON] for reason in found.reasons
    ]
    target = folder.shard_path(shard)
    for left in folder.shards.glob(f".{target.stem}.*"):  # of a writer that was killed
        left.unlink(missing_ok=True)
    content = io.BytesIO()  # numpy's own way into a file drops the error of a full disk, and what did not fit
    np.lib.format.write_array(content, table, allow_pickle=False)
    with atomic_path(target) as temporary:
        raw = content.getvalue()
        temporary.write_bytes(raw + _seal(study, raw))  # behind the table, where readers do not look


def _seal(study: Study, content: bytes) -> bytes:
    """Digest of the values of a shard and of all that decides them."""
    return hashlib.sha256(study.digest.encode() + content).digest()


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


def read_shards(
    folder: StudyFolder, study: Study, shards: Sequence[int]
) -> Iterator[tuple[int, NDArray[Any] | DamagedFileError]]:
    """Finished shards one after the other; for one that is not what was computed the error that names it.

    The values that vary are drawn again, all at once: a Sobol sequence begins at its first point every time.
    """
    begin, expected = study.drops_of(min(shards, default=0)).start, shard_type(study)
    drawn = study.values(begin, max(study.drops_of(max(shards, default=-1)).stop, begin))
    for shard in shards:
        file, drops, problem = folder.shard_path(shard), study.drops_of(shard), ""
        try:
            raw = file.read_bytes() if file.is_file() else b""  # a pipe would keep its reader for ever
        except OSError as error:
            raise OutputError(f"{file} cannot be read: {error.strerror}") from error
        content = raw[:-_SEAL]
        if raw[-_SEAL:] != _seal(study, content):
            problem = "is damaged: it is not what was computed"
        else:
            table = np.load(io.BytesIO(content), allow_pickle=False)
            fits = table.dtype == expected and np.array_equal(table["drop"], np.asarray(drops))
            if not fits:
                problem = f"does not hold drops {drops.start} to {drops.stop - 1} of this study"
            elif not np.array_equal(table["varied"], drawn[drops.start - begin : drops.stop - begin]):
                problem = "holds other values than this version of rotordrop draws"
        if problem:
            remedy = f"'rotordrop study run {folder.path}' keeps it aside and computes its drops again"
            yield shard, DamagedFileError(f"{file} {problem}; {remedy}")
        else:
            yield shard, table


def put_damaged_aside(folder: StudyFolder, study: Study) -> None:
    """Rename finished shards that are not what was computed, so that they are computed again."""
    for shard, found in read_shards(folder, study, folder.finished()):
        if isinstance(found, DamagedFileError):
            file = folder.shard_path(shard)
            with suppress(FileNotFoundError):  # another process did
                file.rename(file.with_name(f"{file.name}.{secrets.token_hex(4)}.damaged"))
