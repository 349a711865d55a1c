"""Arguments and options that several verbs share, and the parser of quantities with units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

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


def refuse_beside(option: str, others: Mapping[str, object]) -> None:
    """Refuse what has no meaning beside an option that makes another command of a verb."""
    given = [name for name, value in others.items() if value is not None]
    if given:
        raise UsageError(f"{option} does not go with {', '.join(given)}; leave out the one or the other")


MachineArgument = Annotated[
    Path, typer.Argument(metavar="MACHINE", help="Machine description, a .toml file.", show_default=False)
]

JsonOption = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="Write the result as JSON to FILE; '-' prints it in place of the summary.",
        show_default=False,
    ),
]

DataOption = Annotated[
    Path | None,
    typer.Option(
        "--data",
        metavar="FOLDER",
        help="Write every table and figure of the report as CSV.",
        file_okay=False,
        show_default=False,
    ),
]

ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite what stands there already.")]

ProfileOption = Annotated[
    Path | None, typer.Option("--profile", metavar="FILE", help="Channel map of the recorder.")
]

PlanesOption = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="PLANE", help='A plane and its channels: "NDE: X1 0 deg, Y1 90 deg".'),
]

ReportOption = Annotated[
    Path | None, typer.Option("--report", metavar="FILE", help="Write the report, one offline HTML file.")
]

ThreadsOption = Annotated[
    int | None, typer.Option("--threads", min=1, metavar="N", help="Threads; all cores by default.")
]
