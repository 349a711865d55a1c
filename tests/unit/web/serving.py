"""A server of the page in a thread, and a client that says exactly what it is told to."""

from __future__ import annotations

import http.client
import json
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.jobs.workspace import Workspace
from rotordrop.web.server import listening_at, server_of


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def told(self) -> Any:
        return json.loads(self.body)

    @property
    def text(self) -> str:
        return self.body.decode()


class Served:
    """A running server; `ask` carries host, origin and token of the own page unless told otherwise."""

    def __init__(self, space: Workspace, port: int = 0) -> None:
        socket = listening_at(port)
        self.space, self.port = space, socket.getsockname()[1]
        self._server = server_of(space, socket)
        self._server.config.timeout_graceful_shutdown = 1
        self.token = space.token()
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [socket]}, daemon=True)
        self._thread.start()
        while not self._server.started:
            time.sleep(0.01)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/#token={self.token}"

    def ask(
        self,
        method: str,
        path: str,
        body: bytes | None = None,
        *,
        headers: list[tuple[str, str]] | None = None,
        **more: str,
    ) -> Answer:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=600)
        own = [("Host", f"127.0.0.1:{self.port}"), ("X-Rotordrop-Token", self.token)]
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in [*(own if headers is None else headers), *more.items()]:
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return Answer(answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read())
        finally:
            connection.close()

    def order(self, path: str, told: object = None) -> Answer:
        return self.ask("POST", path, json.dumps(told or {}).encode())

    def new_job(self, files: dict[str, Path | tuple[str, bytes]], **options: str) -> str:
        """A job with its files: role to a file, or to a name and its content."""
        number = self.order("/api/jobs", {"name": "drop", "options": options}).told["id"]
        for role, file in files.items():
            name, content = (file.name, file.read_bytes()) if isinstance(file, Path) else file
            done = self.put(number, role, name, content)
            assert done.status == 201, done.text
        return str(number)

    def settled(self, number: str, verb: str, patience: float = 600.0) -> dict[str, Any]:
        """Wait until a computation has ended, whatever the end."""
        until = time.monotonic() + patience
        while time.monotonic() < until:
            state = self.ask("GET", f"/api/jobs/{number}").told["states"][verb]
            if state["state"] not in ("waiting", "running"):
                return dict(state)
            time.sleep(0.05)
        raise TimeoutError(f"{verb} of {number}")

    def done(self, number: str, verb: str, told: object = None) -> Any:
        """Ask for a computation, wait until it is done, and give its page, where it has one."""
        assert self.order(f"/api/jobs/{number}/{verb}", told).status == 202
        state = self.settled(number, verb)
        assert state["state"] == "done", state
        page = self.ask("GET", f"/api/jobs/{number}/{verb}/page")
        return page.told if page.status == 200 else None

    def failed(self, number: str, verb: str, told: object = None) -> str:
        """Ask for a computation that cannot be done; what it says."""
        self.order(f"/api/jobs/{number}/{verb}", told)
        state = self.settled(number, verb)
        assert state["state"] == "failed", state
        return str(state["error"])

    def document(self, number: str, verb: str) -> Any:
        return self.ask("GET", f"/api/jobs/{number}/{verb}/document").told

    def put(self, number: str, role: str, name: str, content: bytes) -> Answer:
        return self.ask("PUT", f"/api/jobs/{number}/files/{role}?name={name}", content)

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(10)
