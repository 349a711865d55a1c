"""Watch a folder into which records arrive."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from rotordrop.cli._options import text_option
from rotordrop.cli._output import console


def watch(
    folder: Annotated[
        Path, Argument(metavar="FOLDER", help="Where records arrive; nothing in it is changed.")
    ],
    machines: Annotated[
        Path,
        text_option("DIR", "Machine files by serial number: 4711.toml, 4711.profile.toml, 4711.limits.toml."),
    ],
    log: Annotated[str, text_option("LOG", "Log of drops: SQLite file, or postgresql://….")],
    keep: Annotated[
        Path | None,
        text_option("DIR", "Where records and results are kept; beside the log by default, drops.kept."),
    ] = None,
    hook: Annotated[
        str | None, text_option("CMD", "Command that takes the numbers of a drop as JSON on its input.")
    ] = None,
    quick: Annotated[bool, Option("--quick", help="One pass for machines that are calibrated.")] = False,
    once: Annotated[bool, Option("--once", help="Do what stands there, then end.")] = False,
) -> None:
    """Watch a folder: estimate, log and report every record that arrives in it, once.

    Example: rotordrop watch /share/drops --machines machines --log drops.db
    """
    from rotordrop.watch.kept import kept_of
    from rotordrop.watch.watcher import Watcher

    out, notes = console(), console(sys.stderr)

    def say(line: str) -> None:
        out.print(line, markup=False, soft_wrap=True)
        sys.stdout.flush()

    watcher = Watcher(
        folder=folder,
        machines=machines,
        kept=kept_of(log, keep),
        log=log,
        hook=hook,
        quick=quick,
        say=say,
        complain=lambda line: notes.print(f"note: {line}", markup=False, soft_wrap=True),
    )
    watcher.prepare()
    say(f"Watching {folder}; kept in {watcher.kept.path}, overview {watcher.kept.path / 'overview.html'}")
    watcher.run(once=once)
