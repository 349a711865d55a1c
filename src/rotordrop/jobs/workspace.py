"""The folder of all drops: what was given of each, and who may read it.

Names from elsewhere are labels. Files lie under names made here, all but a file that another one names (a
shaft table), whose name must be a plain one.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, Literal, TypeAlias

from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import (
    atomic_folder,
    clear_after_killed_runs,
    digest_at,
    read_sealed,
    write_json,
    write_text,
)

Role: TypeAlias = Literal["machine", "profile", "record", "tail", "beside"]
ROLES: tuple[Role, ...] = ("machine", "profile", "record", "tail", "beside")

LONGEST_NAME = 120
"""Characters of a name that are kept; chosen, not measured."""

_JOB = re.compile(r"[0-9a-f]{16}")
_SUFFIX = re.compile(r"(?:\.[a-z0-9]{1,8})?\.[a-z0-9]{1,8}")
_PLAIN = re.compile(r"[\w(][\w .()+-]*")


@dataclass(frozen=True)
class Workspace:
    """Where the drops lie."""

    path: Path

    def prepare(self) -> None:
        """Make the folder, for nobody else to read, and remove what a killed process left half written.

        A folder that held other things before keeps its permissions; drops and token are closed all the same.
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

    @property
    def jobs_folder(self) -> Path:
        """Folder of all drops."""
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

    def beside(self) -> list[str]:
        """Roles of the files that others name."""
        return [role for role in self.read()["files"] if role.startswith("beside ")]

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


def labelled(name: str) -> str:
    """A name for people: one line, not too long."""
    line = "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in name)
    return line[:LONGEST_NAME] or "unnamed"


def stored_as(role: Role, name: str) -> str:
    """Name under which a file lies that was sent as ``name``."""
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
