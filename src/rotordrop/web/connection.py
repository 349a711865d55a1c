"""How the server of the page listens: connections end when nothing comes that could be answered."""

from __future__ import annotations

import asyncio
from typing import Any

import uvicorn
from uvicorn.protocols.http.auto import AutoHTTPProtocol

HEAD_S = 30.0
"""How long the head of a request may take [s]; chosen, not measured."""


class Connection(AutoHTTPProtocol):  # type: ignore[misc, valid-type]
    """A connection that is closed when the head of a request does not come, or does not end.

    uvicorn itself waits without end; bodies have their own limits, where they are read.
    """

    _closing: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        super().connection_made(transport)
        self._await_head()

    def data_received(self, data: bytes) -> None:
        """Take what came; the time of a head does not begin again with every piece of it."""
        super().data_received(data)
        self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the time."""
        super().connection_lost(exc)
        if self._closing is not None:
            self._closing.cancel()

    def _await_head(self) -> None:
        answering = self.cycle is not None and not self.cycle.response_complete
        if answering and self._closing is not None:
            self._closing.cancel()
            self._closing = None
        elif not answering and self._closing is None:
            self._closing = asyncio.get_running_loop().call_later(HEAD_S, self.transport.close)


def configured(app: Any) -> uvicorn.Config:
    """How the server of an application is run."""
    return uvicorn.Config(
        app, log_level="warning", access_log=False, ws="none", server_header=False, date_header=False,
        timeout_graceful_shutdown=2, proxy_headers=False, http=Connection,
    )  # fmt: skip
