"""The errors a user can meet, one class per exit code of the command line.

A message names the thing, the value found, what was expected and the way out.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import ClassVar

_speaks = {"of options": False}


@contextmanager
def speaking_of_options() -> Iterator[None]:
    """While a command runs, a way out is an option of it, else an argument of a function."""
    before = _speaks["of options"]
    _speaks["of options"] = True
    try:
        yield
    finally:
        _speaks["of options"] = before


def mapped(*planes: str) -> str:
    """How one says which channels are which: ``--map "NDE: X1, Y1"``, or ``mapping=['NDE: X1, Y1']``."""
    if _speaks["of options"]:
        return " ".join(f"--map {plane}" if plane.isalpha() else f'--map "{plane}"' for plane in planes)
    return f"mapping={list(planes)}"


class RotordropError(Exception):
    """Anything rotordrop refuses to do, with a message that says why and what to do about it."""

    exit_code: ClassVar[int] = 1


class MachineFileError(RotordropError):
    """The machine description cannot be used as it stands; says where in the file.

    Parameters
    ----------
    message : str
        What is wrong, with the value, and the way out.
    file, line, column : optional
        Place of the error in the file; line and column count from 1.
    """

    exit_code: ClassVar[int] = 2

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        self.message = message
        self.file = None if file is None else str(file)
        self.line = line
        self.column = column
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        super().__init__(f"{place}: {message}" if place else message)


class RecordError(RotordropError):
    """A recording cannot be read or does not hold what is needed."""

    exit_code: ClassVar[int] = 3


class NoDropError(RecordError):
    """A record does not show a rotor that levitates and then falls.

    Parameters
    ----------
    record : str
        Name of the record.
    seen : str
        What it shows.
    remedy : str
        The way out.
    begins_late : bool
        Whether what is missing is the levitated part before the drop.
    """

    def __init__(self, record: str, seen: str, remedy: str, *, begins_late: bool) -> None:
        self.seen = seen
        self.remedy = remedy
        self.begins_late = begins_late
        what = "" if begins_late else "no drop in the record: "
        super().__init__(f"{record}: {what}{seen}; {remedy}")


class NothingFallsError(RecordError):
    """Nothing falls in a record: its rotor is held throughout, or lies on its bearings throughout.

    Parameters
    ----------
    seen : str
        What it does.
    remedy : str
        The way out.
    moved : tuple of float, optional
        How far the shaft goes [m] and with which acceleration [m/s²], where it leaves its place too slowly.
    """

    def __init__(self, seen: str, remedy: str, moved: tuple[float, float] | None = None) -> None:
        self.seen = seen
        self.remedy = remedy
        self.moved = moved
        super().__init__(f"no fall is seen in the record: {seen}; {remedy}")


class UnmatchedError(RecordError):
    """Which channel is which sensor is not told by their names; a page asks it in another way."""

    def __init__(self, seen: str, remedy: str) -> None:
        self.seen, self.remedy = seen, remedy
        super().__init__(f"{seen}; {remedy}")


class UnpairedError(UnmatchedError):
    """No two channels of a recording look at one plane."""


class UnsettledError(RecordError):
    """Readings do not show the rotor at rest on its touchdown bearings."""

    def __init__(self, record: str, seen: str) -> None:
        self.seen, self.remedy = f"{record} {seen}", "give the readings at standstill as the settled tail"
        super().__init__(f"{self.seen}; {self.remedy}")


class IdentificationError(RotordropError):
    """An unknown parameter cannot be found from the recording."""

    exit_code: ClassVar[int] = 4


class SimulationError(RotordropError):
    """A drop cannot be computed."""

    exit_code: ClassVar[int] = 5


class OutputError(RotordropError):
    """A result cannot be written."""

    exit_code: ClassVar[int] = 6


class DamagedFileError(OutputError):
    """A file that rotordrop wrote is not what it wrote."""


class ConsistencyError(RotordropError):
    """Model and record do not agree: what was asked for was made, but its single numbers do not hold."""

    exit_code: ClassVar[int] = 7


class UsageError(RotordropError, ValueError):
    """A command or function was called with a value it does not accept."""

    exit_code: ClassVar[int] = 64


@contextmanager
def needing(extra: str) -> Iterator[None]:
    """Refuse where a package of an extra, imported in here, is not installed: says what to install."""
    try:
        yield
    except ModuleNotFoundError as error:
        text = f"the package {error.name} is not installed; install it: pip install 'rotordrop[{extra}]'"
        raise UsageError(text) from None


def unknown_key(key: str, known: tuple[str, ...]) -> str:
    """Say that a key is not known, with the nearest one."""
    close = get_close_matches(key, known, 1, 0.6)
    way_out = f"did you mean {close[0]!r}?" if close else f"known here are {', '.join(known)}"
    return f"unknown key {key!r}; {way_out}"
