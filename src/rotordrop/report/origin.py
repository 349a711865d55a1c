"""Where a report comes from: who made it, when, by which command, from which files, on which arithmetic."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rotordrop.files import digest_of_file


@dataclass(frozen=True, kw_only=True)
class UsedFile:
    """A file that went into a result: what for, its name, and the SHA-256 of its bytes."""

    role: str
    name: str
    sha256: str

    @classmethod
    def of(cls, role: str, path: Path) -> UsedFile:
        """Take the hash of a file."""
        return cls(role=role, name=path.name, sha256=digest_of_file(path))


@dataclass(frozen=True, kw_only=True)
class Origin:
    """What a report says of its own making, beside the result."""

    command: str = ""
    """The command, or the lines of Python, that make the same numbers again."""
    files: tuple[UsedFile, ...] = ()
    """Machine, record, tail and whatever else was read."""
    operator: str = ""
    """Who made it; empty where nobody said."""
    made: str = ""
    """When, in UTC."""
    fingerprint: str = ""
    """That of the arithmetic of this computer; empty where it was not taken."""

    def facts(self, stated: str = "") -> tuple[tuple[str, str], ...]:
        """Lines for a report; what is not known is left out, and a file whose hash is stated already."""
        facts = [("report made", self.made), ("by", self.operator), ("command", self.command)]
        files = (file for file in self.files if file.sha256 != stated)
        facts += [(file.role, f"{file.name}, SHA-256 {file.sha256}") for file in files]
        facts.append(("arithmetic", f"fingerprint {self.fingerprint[:16]}" if self.fingerprint else ""))
        return tuple((name, text) for name, text in facts if text)


def origin_here(arguments: Sequence[str], files: Sequence[tuple[str, Path]], operator: str = "") -> Origin:
    """What a report says of a result that a command makes here and now from files, each with what for."""
    from rotordrop.simulate.fingerprint import fingerprint

    return Origin(
        command=command_line(arguments),
        files=tuple(UsedFile.of(role, path) for role, path in files),
        operator=operator,
        made=now(),
        fingerprint=fingerprint(),
    )


def now() -> str:
    """Give this minute in UTC, as a report writes it."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")


def command_line(arguments: Sequence[str]) -> str:
    """The command as it can be typed again."""
    return shlex.join(["rotordrop", *arguments])
