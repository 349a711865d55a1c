"""The folder of the page: one folder per job, with what was dropped on it and what was found.

Names from a client are labels. Files lie under names made here, all but a file that another one names (a
shaft table), whose name must be a plain one.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import re
import secrets
import shutil
import time
from collections.abc import AsyncIterable, AsyncIterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, Literal, TypeAlias

from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import (
    DIGEST,
    atomic_folder,
    atomic_path,
    clear_after_killed_runs,
    clear_of_no_file,
    digest_at,
    digest_of_file,
    read_sealed,
    write_json,
    write_text,
)

Role: TypeAlias = Literal["machine", "profile", "record", "tail", "beside"]
ROLES: tuple[Role, ...] = ("machine", "profile", "record", "tail", "beside")

QUOTA = 8 * 2**30
"""Bytes the folder may hold before uploads are refused; chosen, not measured."""

LARGEST: dict[str, int] = {
    "machine": 16 * 2**20,
    "profile": 2**20,
    "record": 2**30,
    "tail": 2**30,
    "beside": 2**30,
}
"""Bytes of one upload; of recordings what their readers take."""

STALLED_S, SLOWEST = 30.0, 20_000.0
"""How long an upload may pause [s], and how fast it must come after that on average [byte/s]; chosen, not
measured."""

MOST_JOBS, MOST_BESIDE = 500, 8
"""Jobs in the folder, and files of a job that another one names; chosen, not measured."""
LONGEST_NAME, LONGEST_OPTION = 120, 200
"""Characters of a name that are kept, and of an option that are taken; chosen, not measured."""

_JOB = re.compile(r"[0-9a-f]{16}")
_SUFFIX = re.compile(r"(?:\.[a-z0-9]{1,8})?\.[a-z0-9]{1,8}")
_PLAIN = re.compile(r"[\w(][\w .()+-]*")


class TooLargeError(OutputError):
    """An upload is larger than allowed, or the folder is full."""


@dataclass
class Room:
    """What uploads that run side by side take of the room that is left [byte]."""

    kept: int = 0
    """What lies in the folder, uploads that still come in left out."""
    coming: dict[object, int] = field(default_factory=dict)
    """What each of these has brought, or said it will bring."""


@dataclass(frozen=True)
class Workspace:
    """Where the jobs lie."""

    path: Path
    quota: int = QUOTA
    room: Room = field(default_factory=Room, compare=False)

    def prepare(self) -> None:
        """Make the folder, for nobody else to read, and remove what a killed server left half written.

        A folder that held other things before keeps its permissions; jobs and token are closed all the same.
        """
        try:
            fresh = not self.path.exists() or not any(self.path.iterdir())
            self.jobs_folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"{self.path} cannot be the folder of the page: {error.strerror}; name another one with "
                "--folder"
            ) from error
        for folder in (self.path, self.jobs_folder) if fresh else (self.jobs_folder,):
            with suppress(OSError):
                folder.chmod(folder.stat().st_mode & 0o700)
        clear_after_killed_runs(self.jobs_folder)
        for folder in list(self.jobs_folder.iterdir()):
            if folder.suffix == ".removed":
                shutil.rmtree(folder, ignore_errors=True)
            for part in (folder, folder / "files"):
                clear_after_killed_runs(part)
            if not (folder / "job.json").exists():
                for part in (folder / "files", folder):  # empty: killed while it made a job
                    with suppress(OSError):
                        part.rmdir()
        with suppress(OSError, OutputError):  # a folder that may only be read
            self._give_digests()

    def _give_digests(self) -> None:
        """Give the files of an earlier version of the page digests, once."""
        mark = self.path / "jobs have digests"
        if mark.exists():
            return
        for file in filter(Path.is_file, self.jobs_folder.glob("*/*.json")):
            with suppress(ValueError, RecursionError):
                told = json.loads(file.read_bytes())
                if isinstance(told, dict) and DIGEST not in told:
                    verb = file.name.removesuffix(".result.json")
                    found = file.with_name(f"{verb}.{told.get('run')}")
                    more = {"files": digests_in(found)} if verb != file.name and found.is_dir() else {}
                    write_json(file, told | more, sealed=True)
        mark.touch()

    @property
    def jobs_folder(self) -> Path:
        """Folder of all jobs."""
        return self.path / "jobs"

    def token(self) -> str:
        """Secret of the page, kept so that a page that is open outlives its server."""
        file = self.path / "token"
        if file.exists() and not file.is_file():
            raise OutputError(f"{file} is no file; remove it, and start the page again")
        with suppress(OSError, ValueError):  # whatever is no token is replaced by one
            kept = file.read_text(encoding="ascii").strip()
            if re.fullmatch(r"[\w-]{43}", kept):
                return kept
        made = secrets.token_urlsafe(32)
        write_text(file, made)
        file.chmod(0o600)
        return made

    def new_job(self, name: str, options: dict[str, str]) -> Job:
        """Make a job for a drop."""
        if len(self.jobs()) >= MOST_JOBS:
            raise UsageError(f"there are {MOST_JOBS} jobs; remove some before adding another")
        job = Job(self.jobs_folder / secrets.token_hex(8))
        with atomic_folder(job.path) as folder:
            (folder / "files").mkdir()
            Job(folder).write({"name": name, "created": time.time(), "options": options, "files": {}})
        return job

    def job(self, number: str) -> Job | None:
        """The job of a number; None where there is none."""
        if not _JOB.fullmatch(number):
            return None
        job = Job(self.jobs_folder / number)
        return job if job.path.is_dir() else None

    def jobs(self) -> list[Job]:
        """All jobs, the newest first."""
        found = []
        for name in os.listdir(self.jobs_folder):  # noqa: PTH208
            with suppress(FileNotFoundError):  # removed meanwhile
                if (job := self.job(name)) is not None:
                    found.append((-job.created(), job.number, job))
        return [job for _, _, job in sorted(found, key=lambda entry: entry[:2])]

    def used(self) -> int:
        """Bytes in the folder, what uploads have brought so far left out."""
        total = 0
        for folder, _, names in os.walk(self.path):
            for name in names:
                if not (name.startswith(".") and ".part" in name):
                    with suppress(OSError):
                        total += (Path(folder) / name).lstat().st_size
        return total


@dataclass(frozen=True)
class Job:
    """One drop: machine, record, tail, and what was found."""

    path: Path

    @property
    def number(self) -> str:
        """Sixteen hexadecimal digits."""
        return self.path.name

    def read(self) -> dict[str, Any]:
        """Name, options and files of the job."""
        remedy = "remove the drop, and send its files again"
        try:
            return read_sealed(self.path / "job.json", remedy)
        except FileNotFoundError:
            if not self.path.is_dir():
                raise
            raise DamagedFileError(f"{self.path / 'job.json'} is damaged: it is gone; {remedy}") from None

    def created(self) -> float:
        """When the job was made [s of the clock of the system], as far as that is known."""
        try:
            return float(self.read()["created"])
        except DamagedFileError:
            return self.path.stat().st_mtime

    def write(self, told: dict[str, Any]) -> None:
        """Keep name, options and files."""
        write_json(self.path / "job.json", told, sealed=True)

    def digests(self) -> dict[str, str]:
        """Which files the job has, by their content."""
        return {role: entry["sha256"] for role, entry in self.read()["files"].items()}

    def file(self, role: str) -> Path | None:
        """Where the file of a role lies; None where none was sent.

        One that leads out of the folder of the job, or that is not what was sent, is refused.
        """
        told = self.read()["files"].get(role)
        if told is None:
            return None
        place: Path = self.path / "files" / told["stored"]
        if place.resolve() != self.path.parent.resolve() / self.number / "files" / told["stored"]:
            raise DamagedFileError(f"{told['name']} lies outside the folder of this drop; send it again")
        if digest_at(place) != told["sha256"]:
            raise DamagedFileError(
                f"{told['name']} is damaged: it has changed on the disk since it was sent; send it again"
            )
        return place

    def remove(self) -> None:
        """Remove the job with everything; it is gone at once, whatever happens to its files."""
        away = self.path.with_name(f"{self.number}.removed")
        self.path.rename(away)
        shutil.rmtree(away, ignore_errors=True)


def digests_in(folder: Path) -> dict[str, str]:
    """Digest of every file of a folder, by name."""
    return {file.name: digest_of_file(file) for file in sorted(folder.iterdir())}


async def in_time(body: AsyncIterable[bytes], label: str) -> AsyncIterator[bytes]:
    """The pieces of an upload, as long as they come fast enough: what stalls keeps others from the room."""
    begun, counted, parts = time.monotonic(), 0, aiter(body)
    while True:
        try:
            async with asyncio.timeout(STALLED_S):
                part = await anext(parts)
        except StopAsyncIteration:
            return
        except TimeoutError:
            raise UsageError(f"nothing of {label} came for {STALLED_S:g} s; send it again") from None
        counted += len(part)
        if counted < SLOWEST * (time.monotonic() - begun - STALLED_S):
            raise UsageError(f"{label} comes too slowly, below {SLOWEST / 1e3:g} kB/s; send it again")
        yield part


async def receive(
    space: Workspace, job: Job, role: Role, name: str, declared: int | None, body: AsyncIterable[bytes]
) -> dict[str, Any]:
    """Write an upload, counted while it comes in; it stands there whole or not at all.

    The name at the client is a label; ``declared`` are the bytes that it says will come.
    """
    label, stored = labelled(name), stored_as(role, name)
    key = role if role != "beside" else f"beside {stored}"
    _refuse_clash(job, key, label, stored)
    if role == "beside" and len(beside(job)) >= MOST_BESIDE:
        raise UsageError(f"a job takes {MOST_BESIDE} files beside machine and record")
    counted, digest, room, mine = 0, hashlib.sha256(), space.room, object()
    room.kept = space.used()

    def claim(length: int) -> None:
        """Let nothing in that does not fit beside what the other uploads have brought or will bring."""
        others = sum(length for one, length in room.coming.items() if one is not mine)
        limit = min(LARGEST[role], space.quota - room.kept - others)
        if length > limit:
            raise TooLargeError(
                f"{label} is larger than the {max(limit, 0) / 1e6:.0f} MB that may still be sent; remove "
                "jobs that are no longer needed, or cut the record to the drop"
            )
        room.coming[mine] = max(length, declared or 0)

    try:
        claim(declared or 0)
        clear_of_no_file(job.path / "files" / stored)
        with atomic_path(job.path / "files" / stored) as place, place.open("wb") as stream:
            async for part in in_time(body, label):
                counted += len(part)
                claim(counted)
                digest.update(part)
                stream.write(part)
            if counted == 0:
                raise UsageError(f"{label} is empty")
            # From here to the new name nothing else runs: of uploads side by side only one gets a name.
            _refuse_clash(job, key, label, stored)
        room.kept += counted
    finally:
        room.coming.pop(mine, None)
    told = job.read()
    entry = {"name": label, "stored": stored, "bytes": counted, "sha256": digest.hexdigest()}
    before = told["files"].get(key)
    told["files"][key] = entry
    job.write(told)
    if before is not None and before["stored"] != stored:
        clear_of_no_file(job.path / "files" / before["stored"])
        (job.path / "files" / before["stored"]).unlink(missing_ok=True)
    return entry


def _refuse_clash(job: Job, key: str, label: str, stored: str) -> None:
    """Two files of a job that would lie under one name, whatever the case of its letters."""
    for other, entry in job.read()["files"].items():
        if other != key and entry["stored"].lower() == stored.lower():
            raise UsageError(
                f"{label} would lie where {entry['name']} lies; send it to a job of its own, or as what it is"
            )


def beside(job: Job) -> list[str]:
    """Roles of the files that others name."""
    return [role for role in job.read()["files"] if role.startswith("beside ")]


def labelled(name: str) -> str:
    """A name for people: one line, not too long."""
    line = "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in name)
    return line[:LONGEST_NAME] or "unnamed"


def stored_as(role: Role, name: str) -> str:
    """Name under which an upload lies."""
    if role in ("machine", "profile"):
        return f"{role}.toml"
    if role == "beside" and name.lower().endswith(".dat"):
        return "record.dat"  # the samples of a COMTRADE recording, whose configuration is the record
    if role == "beside":
        plain = _PLAIN.fullmatch(name) and len(name) <= LONGEST_NAME and not is_path(name)
        if not plain or name.split(".")[0].lower() in ROLES or name.endswith((" ", ".")):
            raise UsageError(
                f"{labelled(name)!r} cannot be the name of a file beside; use letters and digits"
            )
        return name
    suffix = "".join(PurePosixPath(name).suffixes[-2:]).lower()
    if not suffix.endswith(".gz"):
        suffix = PurePosixPath(name).suffix.lower()
    if not _SUFFIX.fullmatch(suffix):
        raise UsageError(f"{labelled(name)!r} has no suffix that tells its format; name it for example .csv")
    return f"{role}{suffix}"


def is_path(name: str) -> bool:
    """Whether a name means more than a file in its folder, on any system."""
    return (
        name in ("", ".", "..")
        or PurePosixPath(name).name != name
        or PureWindowsPath(name).name != name
        or PureWindowsPath(name).is_reserved()
    )
