"""Where records are kept: the folder of a page, in which every drop is called after the digest of its record.

A drop appears whole or not at all under that name, so whoever is second finds it there. Beside what the page
keeps lies ``watch.json``: where the record came from, what became of it, and which steps are done.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import (
    atomic_folder,
    atomic_path,
    clear_of_no_file,
    digest_of_file,
    make_folder,
    read_sealed,
    write_json,
    write_text,
)
from rotordrop.jobs.workspace import Job, Role, Workspace, labelled, stored_as
from rotordrop.ledger.book import is_url

STATUS_FILE = "watch.json"
QUARANTINE = "quarantine"
PASSED_OVER = ("thumbs.db", "desktop.ini")
UNFINISHED = (".part", ".tmp", ".temp", ".filepart", ".crdownload", ".swp", ".lock")
"""Ends of names under which programs write what is not finished."""
TAIL = ("_tail", "-tail", ".tail")
"""How the name of a settled tail ends, after that of its record."""
DIGITS = 16
"""Of a digest in the number of a drop: the number of a drop of the page."""


class ChangedMeanwhileError(OutputError):
    """A record changed while it was copied."""


@dataclass(frozen=True, order=True)
class Arrived:
    """A file as it stood in the folder at one moment."""

    path: Path
    size: int
    mtime_ns: int

    @classmethod
    def at(cls, path: Path) -> Arrived | None:
        """The file as it stands now; None where it is gone or no plain file."""
        with suppress(OSError):
            now = path.stat()
            if path.is_file():
                return cls(path, now.st_size, now.st_mtime_ns)
        return None


def arrived(folder: Path, leave: Path) -> Iterator[Arrived]:
    """Every record under a folder; what lies under ``leave``, tails and samples beside a record left out."""
    for place, folders, names in os.walk(folder):
        folders[:] = [
            name for name in folders if not name.startswith(".") and (Path(place) / name).resolve() != leave
        ]
        here = set(names)
        for name in names:
            if name.startswith((".", "~$")) or name.lower() in PASSED_OVER:
                continue
            path = Path(place) / name
            if path.suffix.lower() in UNFINISHED or path.stem.lower().endswith(TAIL):
                continue
            if path.suffix.lower() == ".dat" and {f"{path.stem}.cfg", f"{path.stem}.CFG"} & here:
                continue  # the samples of a COMTRADE configuration
            if (one := Arrived.at(path)) is not None:
                yield one


def parts_of(record: Path) -> dict[str, Path]:
    """A record with its settled tail and the samples of a COMTRADE configuration, where there are any."""
    found = {"record": record}
    if record.suffix.lower() == ".cfg":
        samples = (record.with_suffix(suffix) for suffix in (".dat", ".DAT"))
        found |= {f"beside {file.name}": file for file in samples if file.is_file()}
    stem = record.stem.lower()
    wanted = {f"{stem}{end}".lower() for end in TAIL}
    with suppress(OSError):
        # by plain strings: a folder may hold ten thousand records, and each is asked for its tail
        beside = [name for name in os.listdir(record.parent) if name.lower().startswith(stem)]  # noqa: PTH208
        for file in (record.parent / name for name in sorted(beside)):
            if file.stem.lower() in wanted and file.is_file():
                found["tail"] = file
    return found


def record_of(job: Job) -> Path:
    """Where the record of a drop is kept."""
    return job.path / "files" / str(job.read()["files"]["record"]["stored"])


def is_part(part: Path, whole: Path) -> bool:
    """Whether a file is the beginning of a longer one."""
    left = part.stat().st_size
    if left >= whole.stat().st_size:
        return False
    with part.open("rb") as one, whole.open("rb") as other:
        while left > 0 and (block := one.read(2**20)) == other.read(min(left, 2**20)):
            left -= len(block)
    return left == 0


@dataclass(frozen=True)
class Kept:
    """All records that were taken."""

    space: Workspace

    @property
    def path(self) -> Path:
        """The folder."""
        return self.space.path

    def prepare(self) -> None:
        """Make the folders, and remove what killed watchers left half written."""
        make_folder(self.path)
        self.space.prepare()
        make_folder(self.path / QUARANTINE)

    def job(self, number: str) -> Job:
        """The drop of a number."""
        return Job(self.space.jobs_folder / number)

    def numbers(self) -> list[str]:
        """Numbers of all drops, those made on the page included."""
        names = os.listdir(self.space.jobs_folder)  # noqa: PTH208
        return [name for name in names if len(name) == DIGITS and self.job(name).path.is_dir()]

    def take(self, one: Arrived) -> str:
        """Copy a record under the number of its content, if nobody has; its number.

        Raises
        ------
        ChangedMeanwhileError
            If it changed while it was copied.
        OutputError
            If there is no room.
        """
        try:
            digest = digest_of_file(one.path)
            number = digest[:DIGITS]
            if self.job(number).path.is_dir():
                return number
            with atomic_folder(self.job(number).path) as folder:
                (folder / "files").mkdir()
                job = Job(folder)
                entries = put(job, parts_of(one.path))
                if Arrived.at(one.path) != one or entries["record"]["sha256"] != digest:
                    raise ChangedMeanwhileError(f"{one.path} changed while it was copied; it is tried again")
                job.write(
                    {
                        "name": labelled(one.path.name),
                        "created": time.time(),
                        "options": {},
                        "files": entries,
                    }
                )
                keep_status(
                    job, {"source": str(one.path), "size": one.size, "mtime_ns": one.mtime_ns, "outcome": ""}
                )
            return number
        except OSError as error:
            if (place := self.job(number).path).is_dir():
                return number  # somebody else was faster
            raise OutputError(f"{one.path} cannot be kept in {place.parent}: {error.strerror}") from error

    def quarantined(self, job: Job) -> Path:
        """Where a record that cannot be used lies with the reason."""
        return self.path / QUARANTINE / job.number

    def quarantine(self, job: Job, why: str) -> None:
        """Put a record beside the sentence why, once; it is tried again when that folder is deleted."""
        place = self.quarantined(job)
        if place.is_dir():
            return
        entry = job.read()["files"]["record"]
        try:
            with atomic_folder(place) as folder:
                stored, copy = job.path / "files" / entry["stored"], folder / entry["name"]
                try:
                    os.link(stored, copy)
                except OSError:
                    shutil.copyfile(stored, copy)
                write_text(folder / "why.txt", f"{why}\n")
        except OSError as error:
            if not place.is_dir():  # else somebody was faster
                raise OutputError(f"{place} cannot be written: {error.strerror}") from error


def put(job: Job, files: Mapping[str, Path]) -> dict[str, Any]:
    """Copy files into a drop by role, synced; what a drop says of its files."""
    entries = {}
    for role, file in files.items():
        kind: Role = "beside" if role.startswith("beside ") else role  # type: ignore[assignment]
        name = role.removeprefix("beside ") if kind == "beside" else file.name
        try:
            stored = stored_as(kind, name)
        except UsageError:
            stored = kind  # without a suffix: the reader says so
        kept = job.path / "files" / stored
        clear_of_no_file(kept)
        with atomic_path(kept) as place:
            shutil.copyfile(file, place)
        entries[role] = {
            "name": labelled(name),
            "stored": stored,
            "bytes": kept.stat().st_size,
            "sha256": digest_of_file(kept),
        }
    return entries


def status_of(job: Job) -> dict[str, Any] | None:
    """What is known of a drop that a watcher took; None for one of the page. What is damaged has failed."""
    try:
        return read_sealed(job.path / STATUS_FILE, "remove this drop, and its record is taken again")
    except FileNotFoundError:
        return None
    except DamagedFileError as error:
        return {"source": job.number, "outcome": "failed", "why": str(error), "done": True}


def keep_status(job: Job, status: Mapping[str, Any]) -> None:
    """Keep what became of a drop."""
    write_json(job.path / STATUS_FILE, status, sealed=True)


def kept_of(log: str, folder: Path | None = None) -> Kept:
    """The records kept for a log, beside it unless a folder is named."""
    if folder is None and is_url(log):
        raise UsageError("a log in a data base has no folder beside it; name one for the records with --keep")
    return Kept(Workspace(folder or Path(log).with_suffix(".kept")))
