"""What the verbs print: summaries for people, JSON for programs, progress on anything that takes time."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from rotordrop.atomic_file import require_place, write_json, write_text
from rotordrop.errors import OutputError

if TYPE_CHECKING:
    from rich.console import Console

STANDARD_OUTPUT = Path("-")
_PLAIN_WIDTH = 110

Progress = Callable[[str, float], None]


def console(stream: TextIO | None = None) -> Console:
    """Give a console that colours terminals only, and not even those when ``NO_COLOR`` is set."""
    from rich.console import Console

    target = stream or sys.stdout
    terminal = target.isatty()
    return Console(
        file=target,
        force_terminal=terminal,
        width=None if terminal else _PLAIN_WIDTH,
        highlight=False,
        soft_wrap=not terminal,
        emoji=False,
        markup=False,
    )


def deliver(content: Any, json_file: Path | None, summarise: Callable[[Console], None]) -> None:
    """Print the summary, and write the JSON where it was asked for.

    Parameters
    ----------
    content : object
        The result as JSON-ready dictionaries, lists, numbers and text.
    json_file : Path or None
        Where the JSON goes; ``-`` prints it and leaves the summary out.
    summarise : callable
        Prints the summary on the console it is given.
    """
    if json_file == STANDARD_OUTPUT:
        sys.stdout.write(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
        return
    if json_file is not None:
        write_json(json_file, content)
    out = console()
    summarise(out)
    if json_file is not None:
        out.print(f"JSON: {json_file}")


def require_places(*files: Path | None) -> None:
    """Refuse output files that cannot be written before anything is computed for them."""
    for file in files:
        if file is not None and file != STANDARD_OUTPUT:
            require_place(file)


def deliver_text(text: str, file: Path | None, *, overwrite: bool) -> None:
    """Print a text, or write it to a file that must not exist yet unless `overwrite` says so."""
    if file is None or file == STANDARD_OUTPUT:
        sys.stdout.write(text)
        return
    if file.exists() and not overwrite:
        raise OutputError(f"{file} exists already; name another file or add --force")
    write_text(file, text)
    console(sys.stderr).print(f"written: {file}")


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """Show a bar with the time left on standard error while a long computation runs.

    Yields a function to call with the name of the present stage and the fraction done (0 to 1). Where
    standard error is not a terminal nothing is shown.
    """
    if not sys.stderr.isatty():
        yield lambda stage, fraction: None
        return
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Bars(*columns, TimeRemainingColumn(), console=console(sys.stderr), transient=True) as bars:
        task = bars.add_task(title, total=1.0)

        def report(stage: str, fraction: float) -> None:
            bars.update(task, completed=fraction, description=stage or title)

        yield report
