"""Arguments and options that several verbs share, and the parser of quantities with units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from rotordrop.errors import UsageError
from rotordrop.units import parse_quantity


def quantity(kind: str) -> Callable[[str | float], float]:
    """Make a parser for a command-line value with a unit; the value arrives in SI units.

    A default given as a number is taken as SI already.

    Examples
    --------
    >>> quantity("speed")("3600 rpm") == quantity("speed")("60 Hz")
    True
    """

    def parse(text: str | float) -> float:
        if isinstance(text, float):
            return text
        try:
            return parse_quantity(text, kind)
        except UsageError as error:
            raise typer.BadParameter(str(error)) from error

    parse.__name__ = kind.replace("_", " ")
    return parse


def measured(kind: str, text: str, default: str = "") -> Any:
    """An option with a unit; ``default`` says it as people write it."""
    text += f"  [default: {default}]" if default else ""
    return Option(parser=quantity(kind), metavar=kind.upper(), help=text, show_default=False)


def text_option(metavar: str, text: str) -> Any:
    """An option that takes a text as it is."""
    return Option(metavar=metavar, help=text, show_default=False)


def file_option(name: str, text: str, short: str | None = None) -> Any:
    """An option that names a file."""
    return Option(name, *([short] if short else []), metavar="FILE", help=text, show_default=False)


def pairs(texts: Sequence[str] | None, expected: str) -> dict[str, str]:
    """What texts such as ``"mass=60 kg"`` say, by name."""
    found: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or found.setdefault(name, value) != value:
            raise UsageError(f"{text!r}; expected {expected}, each once")
    return found


def refuse_beside(option: str, others: Mapping[str, object]) -> None:
    """Refuse what has no meaning beside an option that makes another command of a verb."""
    if given := [name for name, value in others.items() if value is not None]:
        raise UsageError(f"{option} does not go with {', '.join(given)}; leave out the one or the other")


def machine_first(*files: Path) -> list[Path]:
    """A machine file before its records, in whichever order they were given: machine files are .toml."""
    return sorted(files, key=lambda file: file.suffix.lower() != ".toml")


Reduction = StrEnum("Reduction", ["accurate", "quick", "full"])
"""Presets of the reduction of the rotor."""
FEWEST_DROPS = 20
"""Drops below which the 95 % that next drops stay below is not known."""


Machine = Annotated[
    Path, Argument(metavar="MACHINE", help="Machine description, a .toml file.", show_default=False)
]
Records = Annotated[
    list[Path], Argument(metavar="RECORD...", help="Recorded drops of this machine.", show_default=False)
]
PowerOffSpeed = Annotated[float, measured("speed", 'Speed at power-off, "60 Hz".')]
Levitated = Annotated[
    bool, Option("--levitated", help="Start floating in the AMBs: synchronous orbit and sag.")
]
ReductionChoice = Annotated[Reduction, Option(help="Modes of the rotor.")]
Tolerance = Annotated[float, Option(min=1e-12, max=1e-3, metavar="NUMBER", help="Accuracy of a step.")]
Json = Annotated[
    Path | None,
    file_option("--json", "Write the result as JSON to FILE; '-' prints it in place of the summary."),
]
Force = Annotated[bool, Option("--force", help="Overwrite what stands there already.")]
Report = Annotated[Path | None, file_option("--report", "Write the report, one offline HTML file.")]
Profile = Annotated[Path | None, file_option("--profile", "Profile of the recorder, for its tails too.")]
Tail = Annotated[
    list[Path] | None,
    file_option("--tail", "Settled tail: one for all drops, or one for each in order."),
]
TailProfile = Annotated[Path | None, file_option("--tail-profile", "Another profile for the tails.")]
Planes = Annotated[
    list[str] | None,
    Option(
        "--map",
        metavar="TEXT",
        help='Channels of a plane, "NDE: X1 0 deg, Y1 90 deg", of a sensor, "S_NDE_A=X1"; or "likely".',
    ),
]
Threads = Annotated[
    int | None, Option("--threads", min=1, metavar="N", help="Threads; all cores by default.")
]
