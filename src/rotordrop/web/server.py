"""Start the server of the page on this computer."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rotordrop.errors import UsageError, needing
from rotordrop.jobs.runner import running
from rotordrop.jobs.workspace import Workspace

if TYPE_CHECKING:
    import uvicorn


def data_folder() -> Path:
    """Folder for data of this user that outlives a restart, by the custom of the system."""
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "rotordrop" / "serve"
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "rotordrop" / "serve"


def serve(folder: Path, port: int, announce: Callable[[str], None], tell: Callable[[str], None]) -> None:
    """Serve the page until it is interrupted; computations that run go on without it.

    It listens on the loopback address only, port 0 takes a free one. ``announce`` hears the address with its
    token once the server listens, ``tell`` what goes on when it ends.
    """
    listening = listening_at(port)
    space = Workspace(folder)
    server = server_of(space, listening)
    announce(f"http://127.0.0.1:{listening.getsockname()[1]}/#token={space.token()}")
    try:
        server.run(sockets=[listening])
    finally:
        if left := running(space):
            tell(
                f"Still computing: {', '.join(left)}. That goes on without the server; start it again to see "
                "or to cancel it."
            )


def server_of(space: Workspace, listening: socket.socket) -> uvicorn.Server:
    """The server of a folder, for a socket that listens."""
    with needing("serve"):
        import uvicorn

        from rotordrop.web.app import make_app
    app = make_app(space, port=listening.getsockname()[1])
    configured = uvicorn.Config(
        app, log_level="warning", access_log=False, ws="none", server_header=False, date_header=False,
        timeout_graceful_shutdown=2, proxy_headers=False,
    )  # fmt: skip
    return uvicorn.Server(configured)


def listening_at(port: int) -> socket.socket:
    """A socket that listens on this computer alone."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(("127.0.0.1", port))
        listening.listen(128)  # whoever asks before the server has begun waits for it
    except OSError as error:
        listening.close()
        raise UsageError(
            f"port {port} cannot be used: {error.strerror}; a server may be running there already, or name "
            "another with --port"
        ) from None
    return listening
