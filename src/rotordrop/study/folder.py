"""A study on disk: plan, claimed shards, finished shards. The folder is the truth; whoever sees it may work.

A shard is claimed by making a file that must not exist yet, and published by renaming a whole file. Claims
only save work: a shard computed twice has the same bits, so that a lost or stolen claim can spoil nothing.
Plan and shards carry digests: what has changed on the disk is named, kept aside and computed again.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import secrets
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.arrays import Array
from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import (
    DIGEST,
    atomic_path,
    digest_of_file,
    process_runs,
    read_sealed,
    require_file,
    write_json,
    write_text,
)
from rotordrop.machine import load_machine
from rotordrop.machine.saving import machine_text
from rotordrop.study.plan import Study, planned_study
from rotordrop.study.quantities import columns_of

FORMAT = "rotordrop study 3"
WITHOUT_DIGESTS = "rotordrop study 2"
TAKEN_OVER = "taken over"
"""Member of a plan: shards that were given digests after they were written."""
REASON = 160
"""Characters kept of why a drop failed; chosen, not measured."""
LEASE = 120.0
"""Time after which a claim without a sign of life may be taken over [s]; drops are signs of life."""


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

    @property
    def claims(self) -> Path:
        """Folder of the claims."""
        return self.path / "claims"

    def shard_path(self, shard: int) -> Path:
        """File of a finished shard."""
        return self.shards / f"{shard:06d}.npy"

    def finished(self) -> list[int]:
        """Numbers of the finished shards, rising."""
        return sorted(int(file.stem) for file in self.shards.glob("*.npy") if _SHARD.fullmatch(file.stem))

    def aside(self) -> list[str]:
        """Names of the damaged shards that were kept."""
        return sorted(file.name for file in self.shards.glob("*.damaged"))

    def taken_over(self) -> set[int]:
        """Numbers of the shards that were given digests after they were written, not computed again since."""
        again = {int(name.partition(".")[0]) for name in self.aside() if _SHARD.fullmatch(name.split(".")[0])}
        return set(read_plan(self.path).get(TAKEN_OVER, ())) - again


def open_folder(study: Study, path: str | Path) -> StudyFolder:
    """Make the folder of a study, or continue in one that holds the same study.

    A folder without digests, as older versions made them, is given some; its plan says of which shards nobody
    knows whether they are as they were computed. One of another version is refused unless all its drops are
    there: numbers may differ between versions.
    """
    folder = StudyFolder(Path(path))
    existing = folder.path / "plan.json"
    plan: dict[str, Any] = {
        "format": FORMAT,
        "rotordrop": __version__,
        "digest": study.digest,
        "study": study.document(),
        "columns": [
            {"name": q.name, "unit": q.unit, "meaning": q.meaning} for q in columns_of(study.machine)
        ],
    }
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
        if there["format"] == FORMAT:
            return folder
        plan["rotordrop"] = there["rotordrop"]
        plan[TAKEN_OVER] = folder.finished()
        for shard in folder.finished():
            require_file(folder.shard_path(shard), "remove it, and run the study again")
            raw = folder.shard_path(shard).read_bytes()
            if raw[-_SEAL:] != _seal(study, raw[:-_SEAL]):
                _write_sealed(folder.shard_path(shard), study, raw)
    else:
        try:
            for part in (folder.path, folder.shards, folder.claims):
                part.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder.path}: cannot make the study folder: {error.strerror}") from error
        require_file(folder.path / "machine.toml", "remove it, and run the study again")
        write_text(folder.path / "machine.toml", machine_text(study.machine))
    plan["machine_sha256"] = digest_of_file(folder.path / "machine.toml")
    write_json(existing, plan, sealed=True)  # last: a folder with a plan is complete
    return folder


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
    except DamagedFileError:
        earlier = None
        with suppress(ValueError, RecursionError):
            earlier = json.loads(file.read_bytes()) if file.is_file() else None
        # what has a digest was not written without one
        if not isinstance(earlier, dict) or earlier.get("format") != WITHOUT_DIGESTS or DIGEST in earlier:
            raise
        return earlier
    if plan.get("format") != FORMAT:
        raise UsageError(
            f"{Path(path)} has format {plan.get('format')!r}, and rotordrop {__version__} reads {FORMAT!r}: "
            "a later version has made it. Go on with that version, or name another folder"
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
    """The study that a folder holds, for whoever joins the work with nothing but the folder."""
    plan, file = read_plan(path), Path(path) / "machine.toml"
    if not file.is_file():
        raise DamagedFileError(f"{file} is gone; remove plan.json too, and run the study again")
    if plan["format"] == FORMAT and digest_of_file(file) != plan["machine_sha256"]:
        raise DamagedFileError(
            f"{file} is damaged, or was changed after the study began: plan and machine file do not belong "
            f"together; remove {file.name} and plan.json, and run the study again with its study file"
        )
    machine = load_machine(file)
    try:
        study = planned_study(plan["study"], machine)
        if study.digest == plan["digest"]:
            return study
    except (KeyError, TypeError, ValueError):  # of a version that knew other settings
        pass
    raise UsageError(
        f"{Path(path)} was begun by rotordrop {plan.get('rotordrop')}, and this is {__version__}, which "
        "makes another study of its plan and machine file; use that version, or another folder"
    )


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
    _write_sealed(target, study, content.getvalue())


def _write_sealed(target: Path, study: Study, content: bytes) -> None:
    """Write a shard with its digest behind it, where readers of such files do not look."""
    with atomic_path(target) as temporary:
        temporary.write_bytes(content + _seal(study, content))


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
            table = _table_in(content)
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


def _table_in(content: bytes) -> NDArray[Any]:
    """The table of a shard; an empty one where it holds none, though sealed when an older folder was."""
    try:
        return np.asarray(np.load(io.BytesIO(content), allow_pickle=False))
    except (ValueError, EOFError):
        return np.zeros(0)


def put_damaged_aside(folder: StudyFolder, study: Study) -> None:
    """Rename finished shards that are not what was computed, so that they are computed again."""
    for shard, found in read_shards(folder, study, folder.finished()):
        if isinstance(found, DamagedFileError):
            file = folder.shard_path(shard)
            with suppress(FileNotFoundError):  # another process did
                file.rename(file.with_name(f"{file.name}.{secrets.token_hex(4)}.damaged"))


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
    require_file(file, "remove it, and run the study again: finished shards stay")
    try:
        age = time.time() - file.stat().st_mtime
        owner = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return False
    except (ValueError, RecursionError):  # killed between making and writing
        owner = None
    process = owner.get("process") if isinstance(owner, dict) else None
    if not isinstance(process, int):
        return age > 5.0
    # elsewhere than on POSIX there is no harmless way to ask whether a process runs: only the lease tells
    here = os.name == "posix" and owner.get("host") == socket.gethostname()
    return age > LEASE or (here and not process_runs(process))
