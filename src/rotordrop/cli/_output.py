"""What the verbs print: summaries for people, JSON for programs, progress on anything that takes time."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from rotordrop.errors import OutputError, UsageError
from rotordrop.files import require_place, write_json, write_text

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.study.run import Report, StudyProgress

STANDARD_OUTPUT = Path("-")
_PLAIN_WIDTH = 110

Progress = Callable[[str, float], None]

_inputs: list[Path] = []


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
        whole = (sys.stdout.encoding or "utf-8").lower().replace("-", "") == "utf8"
        sys.stdout.write(json.dumps(content, indent=2, ensure_ascii=not whole, allow_nan=False) + "\n")
        return
    if json_file is not None:
        write_json(json_file, content)
    out = console()
    summarise(out)
    if json_file is not None:
        out.print(f"JSON: {json_file}")


def read_by_this_command(files: Iterable[Path]) -> None:
    """Tell which files the command reads; `require_places` keeps its outputs away from them."""
    _inputs[:] = [*files, *(beside for file in files for beside in _read_beside(file))]


def _read_beside(file: Path) -> list[Path]:
    """Files that are read because another one names them: the shaft table of a machine, COMTRADE samples."""
    if file.suffix.lower() == ".cfg":
        return [file.with_suffix(suffix) for suffix in (".dat", ".DAT")]
    if file.suffix.lower() != ".toml" or not file.is_file():
        return []
    import tomllib

    from rotordrop.elements.description import LARGEST_FILE

    try:
        with file.open(encoding="utf-8-sig") as stream:
            rotor = tomllib.loads(stream.read(LARGEST_FILE)).get("rotor")
        return [file.parent / str(rotor["shaft_table"])] if isinstance(rotor, dict) else []
    except (OSError, ValueError, RecursionError, KeyError):
        return []  # whoever reads the file says what is wrong with it


def require_places(*files: Path | None) -> None:
    """Refuse outputs that cannot be written, or would replace an input or another output, before any work."""
    places: dict[object, Path] = {}
    for file in files:
        if file is None or file == STANDARD_OUTPUT:
            continue
        require_place(file)
        if file.exists() and not file.is_file():
            continue  # a device or a pipe takes more than one
        for read in _inputs:
            if _identity(read) == _identity(file):
                raise UsageError(f"{file} is read by this command and would be replaced; name another file")
        if _identity(file) in places:
            raise UsageError(f"{places[_identity(file)]} and {file} are one file; give each output its own")
        places[_identity(file)] = file


def _identity(file: Path) -> object:
    """What two names of one file have in common, also where it does not exist yet."""
    try:
        found = file.stat()
    except (OSError, ValueError):
        return os.path.normcase(os.path.realpath(file))
    return found.st_dev, found.st_ino


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


def drops_shown(bar: Progress) -> Report:
    """Make what a study calls with its progress, to be shown by a bar."""

    def show(progress: StudyProgress) -> None:
        bar(f"{progress.drops} of {progress.of} drops, {progress.rate:.1f}/s", progress.drops / progress.of)

    return show
