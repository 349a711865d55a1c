"""Which machine a record is of: a folder holds one machine file per serial number, with profile and limits.

``4711.toml`` describes the machine 4711; ``4711.profile.toml`` says how its recorder writes, and
``4711.limits.toml`` which limits its owner set. ``profile.toml`` and ``limits.toml`` are for all others.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rotordrop.document import parse_toml, read_toml
from rotordrop.errors import UsageError
from rotordrop.files import require_file
from rotordrop.machine import load_machine
from rotordrop.record.profile import load_profile
from rotordrop.severity.numbers import read_limits

HEAD = 2**16
"""Bytes of a record in which a serial number is looked for; chosen, not measured."""
HEAD_LINES = 60
"""Lines with a letter that count as the head of a text; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class Watched:
    """One machine of the folder."""

    serial: str
    """As its file is called."""
    name: str
    """As its file calls the machine."""
    files: Mapping[str, Path]
    """Machine file, profile and shaft table by the role they have in a drop of the page."""
    bearings: str
    """Set of touchdown bearings under which the log counts its drops."""
    limits: Mapping[str, float]
    """Limits [SI] by field of an estimate document."""


@dataclass(frozen=True, kw_only=True)
class Fleet:
    """All machines of the folder."""

    folder: Path
    machines: Mapping[str, Watched]
    profile: Path | None
    """Reading rules of records whose machine is not known."""

    def of(self, name: Path, record: Path) -> tuple[Watched | None, str]:
        """The machine of a record, or why there is none.

        ``name`` is the record under the folder that is watched: the name of the file counts first, then the
        folders it lies in, then the head of the ``record`` itself.
        """
        for where, text in (
            ("name", name.name),
            ("folder", str(name.parent)),
            ("head", head_of(record)),
        ):
            found = [one for one in self.machines.values() if _holds(text, one.serial)]
            found = [one for one in found if not any(_within(one, other) for other in found)]
            if len(found) == 1:
                return found[0], ""
            if found:
                serials = " and ".join(one.serial for one in found)
                return None, f"its {where} holds the serial numbers {serials}; expected one"
        return None, (
            f"neither its name nor its head holds a serial number of {self.folder} "
            f"(machine files: {len(self.machines)})"
        )


def _holds(text: str, serial: str) -> bool:
    return re.search(rf"(?<![^\W_]){re.escape(serial)}(?![^\W_])", text, re.IGNORECASE) is not None


def _within(one: Watched, other: Watched) -> bool:
    return one is not other and _holds(other.serial, one.serial)


def head_of(record: Path) -> str:
    """The lines with a letter at the beginning of a record, whatever its encoding; empty where unreadable."""
    with suppress(OSError, EOFError):
        if not record.is_file():
            return ""
        with gzip.open(record) if record.suffix == ".gz" else record.open("rb") as stream:
            text = stream.read(HEAD).replace(b"\0", b"").decode("latin-1")
        lines = [line for line in text.splitlines() if any(sign.isalpha() for sign in line)]
        return "\n".join(lines[:HEAD_LINES])
    return ""


def read_fleet(folder: Path) -> Fleet:
    """Read every machine file of a folder with its profile and limits.

    Raises
    ------
    UsageError
        If the folder is none, holds no machine file, or limits that nobody knows.
    MachineFileError, RecordError
        If a machine file or a profile cannot be used; says where.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder} is no folder; make one with a machine file per serial number, 4711.toml")
    files = {file.name: file for file in sorted(folder.glob("*.toml"))}
    machines = {}
    for name, file in files.items():
        require_file(file, "put a machine file, a profile or limits there, or remove it")
        serial = name.removesuffix(".toml")
        if serial.endswith((".profile", ".limits")) or serial in ("profile", "limits"):
            continue
        profile = files.get(f"{serial}.profile.toml") or files.get("profile.toml")
        limits = files.get(f"{serial}.limits.toml") or files.get("limits.toml")
        machines[serial] = _watched(serial, file, profile, limits)
    if not machines:
        raise UsageError(f"{folder} holds no machine file; name one after its serial number, 4711.toml")
    return Fleet(folder=folder, machines=machines, profile=files.get("profile.toml"))


def _watched(serial: str, file: Path, profile: Path | None, limits: Path | None) -> Watched:
    read = {"machine": file}
    name = load_machine(file).name
    if profile is not None:
        load_profile(profile)
        read["profile"] = profile
    rotor = parse_toml(file.read_text(encoding="utf-8-sig")).get("rotor")
    if isinstance(rotor, dict) and "shaft_table" in rotor:
        read[f"beside {rotor['shaft_table']}"] = file.parent / rotor["shaft_table"]
    stated = {} if limits is None else dict(read_toml(limits, "limits"))
    bearings = stated.pop("bearings", serial)
    if not isinstance(bearings, str):
        raise UsageError(f'{limits}: bearings = {bearings!r}; expected a name in quotes, "2026"')
    try:
        known = read_limits([f"{key} = {value}" for key, value in stated.items()])
    except UsageError as error:
        raise UsageError(f"{limits}: {error}") from None
    return Watched(serial=serial, name=name, files=read, bearings=bearings, limits=known)
