"""How far a long computation is: told to a function, or shown by a bar in a terminal or a notebook."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from time import monotonic
from typing import Literal

from rotordrop.errors import UsageError

Progress = Callable[[str, float], None]
"""Called with the name of the present stage and the fraction done (0 to 1)."""

Shown = Progress | Literal[False] | None
"""What a caller may ask for: to be told; nothing; by default a bar where somebody sees it."""


def is_shown() -> bool:
    """Whether somebody sees a bar: standard error is a terminal, or a notebook has it."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return (sys.stderr is not None and sys.stderr.isatty()) or hasattr(shell, "kernel")


@contextmanager
def shown(progress: Shown, title: str) -> Iterator[Progress]:
    """Give the function that a long computation tells its progress."""
    if not callable(progress) and progress is not None and progress is not False:
        raise UsageError(f"progress is {progress!r}; expected a function, False or None.")
    if callable(progress):
        yield progress
    elif progress is None and is_shown():
        with _bar(title) as told:
            yield told
    else:
        yield lambda stage, fraction: None


BETWEEN_LINES_S = 5.0
"""Pause between two lines where there is no terminal [s]; chosen, not measured."""


@contextmanager
def told_in_lines(title: str, pause: float = BETWEEN_LINES_S) -> Iterator[Progress]:
    """Tell stage, fraction and time so far on standard error, for a log: a line after each pause [s]."""
    ended, latest, begun = Event(), [title], monotonic()

    def say() -> None:
        while not ended.wait(pause):
            with suppress(OSError, ValueError):  # whoever read it has gone
                sys.stderr.write(f"{latest[0]}, {monotonic() - begun:.0f} s so far\n")

    def tell(stage: str, fraction: float) -> None:
        latest[0] = f"{title}: {stage} ({100.0 * fraction:.0f} %)"

    lines = Thread(target=say, daemon=True)
    lines.start()
    try:
        yield tell
    finally:
        ended.set()
        lines.join()


@contextmanager
def _bar(title: str) -> Iterator[Progress]:
    """Draw a bar with the time so far on standard error while a long computation runs."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
    )
    # a notebook draws what a terminal does; widgets, which rich would take there, need another package
    console = Console(stderr=True, force_terminal=True, force_jupyter=False)
    log, handler = logging.getLogger("rotordrop"), logging.Handler(logging.INFO)
    with Bars(*columns, console=console, transient=sys.stderr.isatty()) as bars:
        task = bars.add_task(title, total=1.0)
        # such as that kernels are compiled, which from Python nobody else says; a warning is said in full
        handler.emit = lambda record: bars.update(task, description=record.getMessage())  # type: ignore[method-assign]
        handler.addFilter(lambda record: record.levelno < logging.WARNING)
        log.addHandler(handler)
        log.setLevel(logging.INFO)
        try:
            yield lambda stage, fraction: bars.update(task, completed=fraction, description=stage or title)
        finally:
            log.removeHandler(handler)
