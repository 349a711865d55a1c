"""What the handlers of the page share: the folder, what runs, and how an order is read."""

from __future__ import annotations

import asyncio
import json
import math
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from rotordrop.errors import RotordropError, UsageError
from rotordrop.web.running import VERBS, Runner, Verb, result_folder
from rotordrop.web.workspace import LONGEST_OPTION, Job, TooLargeError, Workspace, in_time, labelled

LARGEST_ORDER = 16 * 2**10
"""Bytes of an order; chosen, not measured: options are short texts."""
OPTIONS = {
    "gap": str,
    "speed": str,
    "planes": str,
    "operator": str,
    "method": str,
    "quick": bool,
    "plan": str,
}
LONGEST_PLAN = 8000
"""Characters of the plan of a study or a design; chosen, not measured."""
METHODS = ("tracked", "replay")

Handler = Callable[["Desk", Request], Awaitable[Response]]


@dataclass(frozen=True)
class Operation:
    """One thing the page may ask for: method, address with its placeholders, and questions after it."""

    method: str
    path: str
    handler: Handler
    query: tuple[str, ...] = ()


@dataclass
class Desk:
    """What the handlers share: the folder, what runs, the log of drops, and tickets for reports."""

    space: Workspace
    runner: Runner
    log: str
    own_log: bool
    """The log of drops; whether it is that of the folder, which is made when it is first written."""
    tickets: dict[str, tuple[Path, float]] = field(default_factory=dict)

    def job(self, request: Request) -> Job:
        """The job an address names."""
        job = self.space.job(request.path_params["job"])
        if job is None:
            raise NotThereError("there is no such job; it may have been removed")
        return job

    async def found(self, request: Request) -> Path:
        """The folder of the result an address names, whose files are what was computed."""
        folder = await asyncio.to_thread(result_folder, self.job(request), verb_of(request))
        if folder is None or not folder.is_dir():
            raise NotThereError("there is no result yet")
        return folder


class NotThereError(RotordropError):
    """What an address names does not exist."""


def verb_of(request: Request) -> Verb:
    """The computation an address names."""
    verb = request.path_params["verb"]
    if verb not in VERBS:
        raise NotThereError(f"there is no {labelled(verb)!r}; there are {', '.join(VERBS)}")
    return cast("Verb", verb)


def number(request: Request, name: str, usual: float) -> float:
    """A number that follows an address, or its usual value."""
    text = request.query_params.get(name)
    try:
        value = float(usual if text is None else text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise UsageError(f"{name} is {labelled(str(text))!r}; expected a number")
    return value


async def of_file(place: Path, kind: str, headers: Mapping[str, str] | None = None) -> Response:
    """A file as an answer, opened first: what another tab removes meanwhile is sent whole, or it is gone."""
    stream = await asyncio.to_thread(place.open, "rb")

    async def pieces() -> AsyncIterator[bytes]:
        with stream:
            while part := await asyncio.to_thread(stream.read, 2**20):
                yield part

    length = {"content-length": str(os.fstat(stream.fileno()).st_size)}
    return StreamingResponse(pieces(), media_type=kind, headers={**(headers or {}), **length})


async def order_of(request: Request) -> dict[str, Any]:
    """The body of a request as a table of JSON."""
    body = b""
    async for part in in_time(request.stream(), "the order"):
        body += part
        if len(body) > LARGEST_ORDER:
            raise TooLargeError(f"more than {LARGEST_ORDER} bytes are no order")
    try:
        order = json.loads(body or b"{}")
    except (ValueError, RecursionError):
        order = None
    if not isinstance(order, dict):
        raise UsageError("expected a table in JSON")
    return order


def options_of(given: Any) -> dict[str, Any]:
    """Options of a computation."""
    if not isinstance(given, dict):
        raise UsageError("expected options as a table in JSON")
    for name, value in given.items():
        if name not in OPTIONS:
            raise UsageError(f"there is no option {labelled(name)!r}; there are {', '.join(OPTIONS)}")
        most = LONGEST_PLAN if name == "plan" else LONGEST_OPTION
        if type(value) is not OPTIONS[name] or (isinstance(value, str) and len(value) > most):
            raise UsageError(
                f"the option {name} is {labelled(str(value))!r}; expected {OPTIONS[name].__name__}"
            )
    if given.get("method", "tracked") not in METHODS:
        raise UsageError(f"the method is {labelled(given['method'])!r}; there are {', '.join(METHODS)}")
    return {name: value for name, value in given.items() if value != ""}
