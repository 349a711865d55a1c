"""Where a report comes from: who made it, when, by which command, from which files, on which arithmetic."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from rotordrop._version import __version__

if TYPE_CHECKING:
    from rotordrop.machine import Machine


@dataclass(frozen=True, kw_only=True)
class UsedFile:
    """A file that went into a result: what for, its name, and the SHA-256 of its bytes, empty if unknown."""

    role: str
    name: str
    sha256: str

    @property
    def fact(self) -> tuple[str, str]:
        """Its line in a report."""
        return self.role, f"{self.name}, SHA-256 {self.sha256}" if self.sha256 else self.name


@dataclass(frozen=True, kw_only=True)
class Origin:
    """What a report says of its own making, beside the result."""

    command: str = ""
    """The command, or the lines of Python, that make the same numbers again."""
    files: tuple[UsedFile, ...] = ()
    """Machine, record, tail and whatever else was read."""
    operator: str = ""
    """Who made it; empty where nobody said."""
    made: str = field(default_factory=lambda: datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"))
    """When."""
    fingerprint: str = ""
    """That of the arithmetic of this computer; empty where it was not taken."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Lines for a report; what is not known is left out."""
        facts = (
            ("report made", f"{self.made} by rotordrop {__version__}"),
            ("operator", self.operator),
            ("command", self.command),
            *(file.fact for file in self.files),
            ("arithmetic", f"fingerprint {self.fingerprint[:16]}" if self.fingerprint else ""),
        )
        return tuple((name, text) for name, text in facts if text)


def machine_facts(machine: Machine) -> tuple[tuple[str, str], ...]:
    """Lines for a report on a machine: its name with its file, and its serial number where it has one."""
    path = machine.source_path
    named = ("machine", machine.name if path is None else f"{machine.name} ({path.name})")
    return (named, ("serial number", machine.serial_number)) if machine.serial_number else (named,)


def command_line(arguments: Sequence[str]) -> str:
    """The command as it can be typed again."""
    return shlex.join(["rotordrop", *arguments])
