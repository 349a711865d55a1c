"""The routes of the page: jobs, their files, what was found, and windows of the histories."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from rotordrop.errors import RotordropError, UsageError
from rotordrop.web.guard import App, Guard
from rotordrop.web.numbers import machine_of_numbers, schema_of_numbers
from rotordrop.web.running import VERBS, Runner, Verb, published_run, result_folder, state_of
from rotordrop.web.workspace import (
    LONGEST_OPTION,
    ROLES,
    Job,
    Role,
    TooLargeError,
    Workspace,
    labelled,
    receive,
)

if TYPE_CHECKING:
    from rotordrop.web.traces import Traces

ASSETS = {
    "page.js": "text/javascript",
    "server.js": "text/javascript",
    "plots.js": "text/javascript",
    "orbit.js": "text/javascript",
    "tables.js": "text/javascript",
    "figures.js": "text/javascript",
    "units.js": "text/javascript",
    "waterfall.js": "text/javascript",
    "page.css": "text/css",
    "uplot.js": "text/javascript",
    "uplot.css": "text/css",
    "icon.svg": "image/svg+xml",
}
LARGEST_ORDER = 16 * 2**10
BETWEEN_LOOKS_S = 0.25
TICKET_S = 120.0
OPTIONS = {"gap": str, "speed": str, "method": str, "quick": bool}
METHODS = ("tracked", "replay")
REPORT_HEADERS = {
    "content-security-policy": "sandbox allow-scripts allow-downloads allow-modals",
    "cross-origin-opener-policy": "unsafe-none",  # a sandboxed page must not claim an opener policy
}
CSV_ROWS = 20_000

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
    """What the handlers share: the folder, what runs, and tickets for reports."""

    space: Workspace
    runner: Runner
    tickets: dict[str, tuple[Path, float]] = field(default_factory=dict)

    def job(self, request: Request) -> Job:
        """The job an address names.

        Raises
        ------
        NotThereError
            When there is none.
        """
        job = self.space.job(request.path_params["job"])
        if job is None:
            raise NotThereError("there is no such job; it may have been removed")
        return job

    def found(self, request: Request) -> Path:
        """The folder of the result an address names.

        Raises
        ------
        NotThereError
            When there is none yet.
        """
        folder = result_folder(self.job(request), _verb(request))
        if folder is None or not folder.is_dir():
            raise NotThereError("there is no result yet")
        return folder


class NotThereError(RotordropError):
    """What an address names does not exist."""


def _verb(request: Request) -> Verb:
    verb = request.path_params["verb"]
    if verb not in VERBS:
        raise NotThereError(f"there is no {labelled(verb)!r}; there are {', '.join(VERBS)}")
    return cast("Verb", verb)


async def _page(desk: Desk, request: Request) -> Response:
    return Response(_asset("index.html"), media_type="text/html")


async def _static(desk: Desk, request: Request) -> Response:
    name = request.path_params["name"]
    if name not in ASSETS:
        raise NotThereError("there is no such file")
    return Response(_asset(name), media_type=ASSETS[name])


@lru_cache(maxsize=32)
def _asset(name: str) -> bytes:
    return resources.files("rotordrop.web").joinpath("static", name).read_bytes()


def _told(job: Job) -> dict[str, Any]:
    told = job.read()
    states: dict[str, Any] = {}
    for verb in VERBS:
        state = state_of(job, verb)
        if state is not None:
            spent = (state.get("ended") or time.time()) - state.get("started", time.time())
            states[verb] = {
                key: state.get(key) for key in ("state", "stage", "fraction", "error", "options", "run")
            }
            states[verb] |= {"spent": spent, "result": published_run(job, verb)}
    return {"id": job.number, **told, "states": states}


async def _jobs(desk: Desk, request: Request) -> Response:
    told = []
    for job in desk.space.jobs():
        with contextlib.suppress(FileNotFoundError):  # one that is removed meanwhile hides no other
            told.append(_told(job))
    return JSONResponse({"jobs": told, "used": desk.space.used(), "quota": desk.space.quota})


async def _new_job(desk: Desk, request: Request) -> Response:
    order = await _order(request)
    job = desk.space.new_job(labelled(str(order.get("name", ""))), _options(order.get("options", {})))
    return JSONResponse(_told(job), status_code=201)


async def _job(desk: Desk, request: Request) -> Response:
    return JSONResponse(_told(desk.job(request)))


async def _remove(desk: Desk, request: Request) -> Response:
    await asyncio.to_thread(desk.runner.remove, desk.job(request))
    return Response(status_code=204)


async def _upload(desk: Desk, request: Request) -> Response:
    job, role = desk.job(request), request.path_params["role"]
    if role not in ROLES:
        raise NotThereError(f"there is no {labelled(role)!r}; a file is one of {', '.join(ROLES)}")
    declared = request.headers.get("content-length", "")
    length = int(declared) if declared.isascii() and declared.isdigit() else None
    name = request.query_params.get("name", "")
    entry = await receive(desk.space, job, cast("Role", role), name, length, request.stream())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


async def _ask(desk: Desk, request: Request) -> Response:
    job, verb = desk.job(request), _verb(request)
    options = {**job.read()["options"], **_options(await _order(request))}
    if job.file("record") is None:
        raise UsageError("no record was sent; drop one on the page")
    await asyncio.to_thread(desk.runner.ask, job, verb, options)
    return JSONResponse(_told(job), status_code=202)


async def _cancel(desk: Desk, request: Request) -> Response:
    job = desk.job(request)
    await asyncio.to_thread(desk.runner.cancel, job, _verb(request))
    return JSONResponse(_told(job))


async def _found_page(desk: Desk, request: Request) -> Response:
    return FileResponse(desk.found(request) / "page.json", media_type="application/json")


async def _found_document(desk: Desk, request: Request) -> Response:
    return FileResponse(desk.found(request) / "document.json", media_type="application/json")


async def _field(desk: Desk, request: Request) -> Response:
    """Amplitudes of one waterfall [m], frame after frame, in single precision."""
    from rotordrop.web.drawn import field_name

    told = _page_of(desk.found(request))
    if "parts" not in told:
        raise NotThereError("this result has no waterfall")
    plane, part = _number(request, "plane", 0), request.query_params.get("part", told["parts"][0])
    if plane not in range(len(told["planes"])) or part not in told["parts"]:
        raise UsageError(
            f"there is no waterfall of plane {plane:g}, part {labelled(part)!r}; there are planes 0 to "
            f"{len(told['planes']) - 1} and parts {', '.join(told['parts'])}"
        )
    place = desk.found(request) / field_name(int(plane), part)
    return FileResponse(place, media_type="application/octet-stream")


async def _window(desk: Desk, request: Request) -> Response:
    folder = desk.found(request)
    traces, rows, start, end = await asyncio.to_thread(_asked_window, folder, request)
    return Response(
        await asyncio.to_thread(_samples, traces, rows, start, end, request),
        media_type="application/octet-stream",
    )


def _samples(traces: Traces, rows: list[int], start: float, end: float, request: Request) -> bytes:
    from rotordrop.web.traces import FEWEST_POINTS, MOST_POINTS, sent

    points = int(_number(request, "points", MOST_POINTS))
    if not FEWEST_POINTS <= points <= MOST_POINTS:
        raise UsageError(f"{points} points asked for; {FEWEST_POINTS} to {MOST_POINTS} are sent")
    return sent(traces, rows, traces.window(rows, start, end, points))


def _asked_window(folder: Path, request: Request) -> tuple[Traces, list[int], float, float]:
    from rotordrop.web.traces import open_traces

    told = _traces_of(folder)
    traces = open_traces(folder, told["name"], tuple(told["columns"]))
    rows = traces.chosen(tuple(request.query_params.getlist("column")))
    start, end = _number(request, "start", told["start"]), _number(request, "end", told["end"])
    if not start < end:
        raise UsageError(
            f"the window from {start:g} s to {end:g} s holds nothing; give an end after its start"
        )
    return traces, rows, start, end


def _traces_of(folder: Path) -> dict[str, Any]:
    found = _page_of(folder)
    if "traces" not in found:
        raise NotThereError("this result has no histories")
    return dict(found["traces"])


@lru_cache(maxsize=64)
def _page_of(folder: Path) -> dict[str, Any]:
    """What the routes need of the content of a page."""
    found: dict[str, Any] = json.loads((folder / "page.json").read_text(encoding="utf-8"))
    return {key: found[key] for key in ("traces", "planes", "parts") if key in found}


def _number(request: Request, name: str, usual: float) -> float:
    text = request.query_params.get(name)
    try:
        value = float(usual if text is None else text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise UsageError(f"{name} is {labelled(str(text))!r}; expected a number")
    return value


async def _csv(desk: Desk, request: Request) -> Response:
    """Every sample of a window as a table, in SI units."""
    traces, rows, start, end = await asyncio.to_thread(_asked_window, desk.found(request), request)
    headers = {"content-disposition": 'attachment; filename="rotordrop.csv"'}
    return StreamingResponse(
        _table(traces, rows, start, end), media_type="text/csv; charset=utf-8", headers=headers
    )


async def _table(traces: Traces, rows: list[int], start: float, end: float) -> AsyncIterator[str]:
    import numpy as np

    first = int(np.searchsorted(traces.time, start))
    last = int(np.searchsorted(traces.time, end, side="right"))
    yield ",".join(["time [s]", *(f"{traces.columns[row]} [SI]" for row in rows)]) + "\n"
    for begin in range(first, last, CSV_ROWS):
        stop = min(begin + CSV_ROWS, last)
        table = [[repr(float(time)) for time in traces.time[begin:stop]]]
        table += [[f"{value:.9g}" for value in traces.values[row, begin:stop].tolist()] for row in rows]
        yield "".join(",".join(line) + "\n" for line in zip(*table, strict=True))
        await asyncio.sleep(0)


async def _ticket(desk: Desk, request: Request) -> Response:
    """An address for the report that works once and soon: a page that is opened carries no token."""
    place = desk.found(request) / "report.html"
    if not place.is_file():
        raise NotThereError("there is no report of this; make an estimate first")
    now = time.monotonic()
    desk.tickets = {key: kept for key, kept in desk.tickets.items() if now - kept[1] < TICKET_S}
    ticket = secrets.token_urlsafe(24)
    desk.tickets[ticket] = (place, now)
    return JSONResponse({"address": f"/report/{ticket}"}, status_code=201)


async def _report(desk: Desk, request: Request) -> Response:
    """A report, as a page of nobody: it brings a policy of its own and may not speak with this server."""
    place, made = desk.tickets.pop(request.path_params["ticket"], (None, 0.0))
    if place is None or time.monotonic() - made > TICKET_S:
        raise NotThereError("this address of the report has been used; open the report from the page again")
    return FileResponse(place, media_type="text/html", headers=REPORT_HEADERS)


async def _order(request: Request) -> dict[str, Any]:
    """The body of a request as a table of JSON."""
    body = b""
    async for part in request.stream():
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


def _options(given: Any) -> dict[str, Any]:
    """Options of a computation.

    Raises
    ------
    UsageError
        When one is unknown or of the wrong kind.
    """
    if not isinstance(given, dict):
        raise UsageError("expected options as a table in JSON")
    for name, value in given.items():
        if name not in OPTIONS:
            raise UsageError(f"there is no option {labelled(name)!r}; there are {', '.join(OPTIONS)}")
        if type(value) is not OPTIONS[name] or (isinstance(value, str) and len(value) > LONGEST_OPTION):
            raise UsageError(
                f"the option {name} is {labelled(str(value))!r}; expected {OPTIONS[name].__name__}"
            )
    if given.get("method", "tracked") not in METHODS:
        raise UsageError(f"the method is {labelled(given['method'])!r}; there are {', '.join(METHODS)}")
    return {name: value for name, value in given.items() if value != ""}


async def _numbers(desk: Desk, request: Request) -> Response:
    """The schema of the twelve numbers, from which the page makes its form."""
    return Response(await asyncio.to_thread(schema_of_numbers), media_type="application/json")


async def _machine_of_numbers(desk: Desk, request: Request) -> Response:
    """Make the machine file of a job of twelve numbers."""
    job, given = desk.job(request), await _order(request)
    text = await asyncio.to_thread(machine_of_numbers, given)

    async def body() -> AsyncIterator[bytes]:
        yield text.encode()

    entry = await receive(desk.space, job, "machine", "twelve_numbers.toml", None, body())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


_RESULT = "/api/jobs/{job}/{verb}"
WINDOW = ("column", "start", "end", "points")
OPERATIONS = (
    Operation("GET", "/", _page),
    Operation("GET", "/static/{name}", _static),
    Operation("GET", "/report/{ticket}", _report),
    Operation("GET", "/api/jobs", _jobs),
    Operation("POST", "/api/jobs", _new_job),
    Operation("GET", "/api/jobs/{job}", _job),
    Operation("DELETE", "/api/jobs/{job}", _remove),
    Operation("PUT", "/api/jobs/{job}/files/{role}", _upload, ("name",)),
    Operation("GET", "/api/numbers", _numbers),
    Operation("POST", "/api/jobs/{job}/numbers", _machine_of_numbers),
    Operation("POST", _RESULT, _ask),
    Operation("POST", f"{_RESULT}/cancel", _cancel),
    Operation("GET", f"{_RESULT}/page", _found_page),
    Operation("GET", f"{_RESULT}/document", _found_document),
    Operation("GET", f"{_RESULT}/window", _window, WINDOW),
    Operation("GET", f"{_RESULT}/field", _field, ("plane", "part")),
    Operation("GET", f"{_RESULT}/csv", _csv, WINDOW[:3]),
    Operation("POST", f"{_RESULT}/report", _ticket),
)


def make_app(space: Workspace, *, port: int) -> App:
    """Make the application for a folder, guarded for the port it will listen at."""
    space.prepare()
    desk = Desk(space, Runner(space))
    desk.runner.take_over()

    @contextlib.asynccontextmanager
    async def tended(app: Starlette) -> AsyncIterator[None]:
        async def tend() -> None:
            while True:
                await asyncio.to_thread(desk.runner.tend)
                await asyncio.sleep(BETWEEN_LOOKS_S)

        task = asyncio.create_task(tend())
        yield
        task.cancel()

    routes = [Route(one.path, _answered(desk, one.handler), methods=[one.method]) for one in OPERATIONS]
    return Guard(Starlette(routes=routes, lifespan=tended), port=port, token=space.token())


def _answered(desk: Desk, handler: Handler) -> Callable[[Request], Awaitable[Response]]:
    """A handler whose refusals become sentences with a status."""

    async def endpoint(request: Request) -> Response:
        try:
            return await handler(desk, request)
        except NotThereError as error:
            return PlainTextResponse(str(error), status_code=404)
        except TooLargeError as error:
            return PlainTextResponse(str(error), status_code=413, headers={"connection": "close"})
        except RotordropError as error:
            return PlainTextResponse(str(error), status_code=400)
        except FileNotFoundError:  # a job that was removed by another tab meanwhile
            return PlainTextResponse("it has been removed", status_code=404)
        except ClientDisconnect:
            return PlainTextResponse("the upload broke off", status_code=400)

    return endpoint
