"""Serve a local page: look at drops, estimate, read reports.

Jobs are kept in a folder; what was computed is found again after a restart.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._output import console

USUAL_PORT = 8737


def serve(
    folder: Annotated[
        Path | None,
        typer.Option("--folder", metavar="FOLDER", help="Where jobs are kept; your data folder by default."),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Where to listen; 0 takes a free port.")
    ] = USUAL_PORT,
    log: Annotated[
        str | None,
        typer.Option("--log", metavar="LOG", help="Log of drops that the page compares with."),
    ] = None,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
) -> None:
    """Serve a local page: look at drops, estimate, read reports."""
    from rotordrop.web.server import serve as serve_page

    place = folder or data_folder()

    def announce(address: str) -> None:
        out = console()
        out.print(f"The page is {address}\nJobs are kept in {place}. Ctrl-C ends the server.", soft_wrap=True)
        sys.stdout.flush()
        if open_page:
            typer.launch(address)

    serve_page(place, port, announce, log)


def data_folder() -> Path:
    """Folder for data of this user that outlives a restart, by the custom of the system."""
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "rotordrop" / "serve"
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "rotordrop" / "serve"
