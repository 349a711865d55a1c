"""The routes of the page: jobs, their files, and what was found."""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import math
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import import_module, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError
from rotordrop.jobs.runner import VERBS, Runner, Verb, published, result_folder, state_of
from rotordrop.jobs.workspace import ROLES, Job, Role, Workspace, labelled
from rotordrop.web.desk import Desk, NotThereError, options_of, order_of, receive, verb_of
from rotordrop.web.guard import App, Guard

if TYPE_CHECKING:
    from rotordrop.jobs.traces import Traces

CSV_ROWS = 20_000
"""Rows of a table that are made at once; chosen, not measured."""


async def window(desk: Desk, request: Request) -> Response:
    """Few samples that show a window of histories, in single precision."""
    folder = await desk.found(request)

    def shown() -> bytes:
        from rotordrop.jobs.traces import MOST_POINTS, sent

        traces, rows, start, end = _asked_window(folder, request)
        points = min(max(int(_number(request, "points", MOST_POINTS)), 2), MOST_POINTS)
        return sent(traces, rows, traces.window(rows, start, end, points))

    return Response(await asyncio.to_thread(shown), media_type="application/octet-stream")


async def csv(desk: Desk, request: Request) -> Response:
    """Every sample of a window as a table, in SI units."""
    import numpy as np

    from rotordrop.estimate.histories import SIMULATED_COLUMN

    folder = await desk.found(request)
    traces, rows, start, end = await asyncio.to_thread(_asked_window, folder, request)
    page = _page_of(folder)
    first, last = np.searchsorted(traces.time, start), np.searchsorted(traces.time, end, side="right")

    def table() -> Iterator[str]:
        heads = ["time [s]", *(page["labels"][traces.columns[row]] for row in rows)]
        yield ",".join([*heads, SIMULATED_COLUMN] if page["simulated"] else heads) + "\n"
        for begin in range(int(first), int(last), CSV_ROWS):
            stop = min(begin + CSV_ROWS, int(last))
            columns = [[repr(float(time)) for time in traces.time[begin:stop]]]
            columns += [[f"{value:.9g}" for value in traces.values[row, begin:stop].tolist()] for row in rows]
            if page["simulated"]:
                columns.append(["yes"] * (stop - begin))
            yield "".join(",".join(line) + "\n" for line in zip(*columns, strict=True))

    headers = {"content-disposition": 'attachment; filename="rotordrop.csv"'}
    return StreamingResponse(table(), media_type="text/csv; charset=utf-8", headers=headers)


def _asked_window(folder: Path, request: Request) -> tuple[Traces, list[int], float, float]:
    from rotordrop.jobs.traces import open_traces

    told = _page_of(folder).get("traces")
    if told is None:
        raise NotThereError("this result has no histories")
    traces = open_traces(folder, told["name"], tuple(told["columns"]))
    rows = traces.chosen(tuple(request.query_params.getlist("column")))
    start, end = _number(request, "start", told["start"]), _number(request, "end", told["end"])
    if not start < end:
        raise UsageError(
            f"the window from {start:g} s to {end:g} s holds nothing; give an end after its start"
        )
    return traces, rows, start, end


def _number(request: Request, name: str, usual: float) -> float:
    """A number that follows an address, or its usual value."""
    text = request.query_params.get(name)
    try:
        value = float(usual if text is None else text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise UsageError(f"{name} is {labelled(str(text))!r}; expected a number")
    return value


@lru_cache(maxsize=64)
def _page_of(folder: Path) -> dict[str, Any]:
    """What the routes need of the content of a page."""
    file = folder / "page.json"
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return {key: found[key] for key in ("traces", "labels", "simulated") if key in found}


ASSETS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
"""What of the folder of the page is sent, by its ending."""
STATIC = resources.files("rotordrop.web") / "static"
EXAMPLE = "lp400"
"""The example to try the page with."""
BETWEEN_LOOKS_S = 0.25
"""Pause between two looks at what waits and what ended [s]; chosen, not measured."""
REPORT_HEADERS = {
    "content-security-policy": "sandbox allow-scripts allow-downloads allow-modals",
    "cross-origin-opener-policy": "unsafe-none",  # a sandboxed page must not claim an opener policy
    "x-frame-options": "SAMEORIGIN",  # the page shows it in a frame
}

Handler = Callable[[Desk, Request], Awaitable[Response]]


@dataclass(frozen=True)
class Operation:
    """One thing the page may ask for: method, address with its placeholders, and questions after it."""

    method: str
    path: str
    handler: Handler
    query: tuple[str, ...] = ()


async def static(desk: Desk, request: Request) -> Response:
    """The page itself, or a file that it needs."""
    known = {file.name: file for file in STATIC.iterdir()}
    name = request.path_params.get("name", "index.html")
    kind = ASSETS.get(Path(name).suffix)
    if name not in known or kind is None:
        raise NotThereError("there is no such file")
    return Response(known[name].read_bytes(), media_type=kind)


async def example(desk: Desk, request: Request) -> Response:
    """A file of the bundled machine or of its simulated drop, to try the page with."""
    from rotordrop.examples import example_files

    name, known = request.path_params["name"], example_files(EXAMPLE)
    if name not in known:
        raise NotThereError(f"there is no such example; there are {', '.join(known)}")
    return Response(known[name].read_bytes(), media_type="application/octet-stream")


def _told(desk: Desk, job: Job) -> dict[str, Any]:
    """A job with its states and the row of what was found."""
    try:
        told = job.read()
    except DamagedFileError as error:
        named = {
            "name": f"damaged drop {job.number[:6]}",
            "created": job.created(),
            "options": {},
            "files": {},
        }
        damaged = without_folder(str(error), job.path)
        return {"id": job.number, **named, "states": {}, "row": None, "damaged": damaged}
    states = {verb: state for verb in VERBS if (state := _state_told(desk, job, verb)) is not None}
    return {"id": job.number, **told, "states": states, "row": row_of(job)}


def _state_told(desk: Desk, job: Job, verb: Verb) -> dict[str, Any] | None:
    state = state_of(job, verb)
    if state is None:
        return None
    spent = (state.get("ended") or time.time()) - state.get("started", time.time())
    told = {key: state.get(key) for key in ("state", "stage", "fraction", "error", "options", "run")}
    told |= {"spent": max(spent, 0.0), "result": None, "report": None}
    try:
        found = published(job, verb)
        told["result"] = found and found["run"]
        if found and "report.html" in found["files"]:
            told["report"] = desk.report_of(job.number, verb, found["run"])
    except DamagedFileError as error:
        told |= {"state": "failed", "error": str(error)}
    if told["error"]:
        told["error"] = without_folder(told["error"], job.path)
    return told


def row_of(job: Job) -> dict[str, Any] | None:
    """What is known of a drop: by its estimate, else by the look at it; None where neither is there.

    What cannot be read of them is named under ``damaged``.
    """
    damaged: dict[str, Any] = {}
    verbs: tuple[Verb, ...] = ("estimate", "look")
    for verb in verbs:
        try:
            folder = result_folder(job, verb)
            if folder is not None:
                return {**_row_in(folder), **damaged, "verb": verb}
        except DamagedFileError as error:
            damaged = {"damaged": str(error).replace(f"{job.path}/", "")}
    return damaged or None


@lru_cache(maxsize=2048)
def _row_in(folder: Path) -> dict[str, Any]:
    row: dict[str, Any] = json.loads((folder / "page.json").read_bytes())["row"]
    return row


async def jobs(desk: Desk, request: Request) -> Response:
    """All jobs with what is known of each."""

    def listed() -> list[dict[str, Any]]:
        told = []
        for job in desk.space.jobs():
            with contextlib.suppress(FileNotFoundError):  # one that is removed meanwhile hides no other
                told.append(_told(desk, job))
        return told

    return JSONResponse({"jobs": await asyncio.to_thread(listed)})


async def new_job(desk: Desk, request: Request) -> Response:
    """Make a job for a drop."""
    order = await order_of(request)
    job = desk.space.new_job(labelled(str(order.get("name", ""))), options_of(order.get("options", {})))
    return JSONResponse(_told(desk, job), status_code=201)


async def job(desk: Desk, request: Request) -> Response:
    """One job."""
    return JSONResponse(_told(desk, desk.job(request)))


async def remove(desk: Desk, request: Request) -> Response:
    """Stop what a job computes and remove it."""
    await asyncio.to_thread(desk.runner.remove, desk.job(request))
    return Response(status_code=204)


async def upload(desk: Desk, request: Request) -> Response:
    """Take a file of a job while it comes in."""
    job, role = desk.job(request), request.path_params["role"]
    if role not in ROLES:
        raise NotThereError(f"there is no {labelled(role)!r}; a file is one of {', '.join(ROLES)}")
    name = request.query_params.get("name", "")
    entry = await receive(job, cast("Role", role), name, request.stream())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


async def sent_file(desk: Desk, request: Request) -> Response:
    """A file of a job as it was sent or made, so that what the page computes can be computed elsewhere."""
    job, role = desk.job(request), request.path_params["role"]
    place = await asyncio.to_thread(job.file, role) if role in ROLES else None
    if place is None:
        raise NotThereError("the job has no such file")
    return Response(await asyncio.to_thread(place.read_bytes), media_type="application/octet-stream")


async def set_options(desk: Desk, request: Request) -> Response:
    """Change what is said of a recording beside its files; what was found without it is dropped."""
    job, given = desk.job(request), options_of(await order_of(request))
    await asyncio.to_thread(desk.runner.forget, job)
    told = job.read()
    job.write({**told, "options": {**told["options"], **given}})
    return JSONResponse(_told(desk, job))


async def ask(desk: Desk, request: Request) -> Response:
    """Ask for a computation."""
    job, verb = desk.job(request), verb_of(request)
    options = {**job.read()["options"], **options_of(await order_of(request))}
    await asyncio.to_thread(desk.runner.ask, job, verb, options)
    return JSONResponse(_told(desk, job), status_code=202)


async def cancel(desk: Desk, request: Request) -> Response:
    """Stop a computation."""
    job = desk.job(request)
    await asyncio.to_thread(desk.runner.cancel, job, verb_of(request))
    return JSONResponse(_told(desk, job))


async def found_file(name: str, desk: Desk, request: Request) -> Response:
    """What the page draws of a result, or its document."""
    place = await desk.found(request) / name
    return Response(await asyncio.to_thread(place.read_bytes), media_type="application/json")


async def report(desk: Desk, request: Request) -> Response:
    """A report, as a page of nobody: it brings a policy of its own and may not speak with this server."""
    asked = request.path_params
    address = desk.report_of(asked["job"], asked["verb"], asked["run"])
    known = hmac.compare_digest(request.url.path.encode(), address.encode())
    folder = await desk.found(request) if known else None
    if folder is None or folder.suffix != f".{asked['run']}":
        raise NotThereError("there is no such report; open it from the page again")
    content = await asyncio.to_thread((folder / "report.html").read_bytes)
    return Response(content, headers=REPORT_HEADERS, media_type="text/html")


async def numbers(desk: Desk, request: Request) -> Response:
    """The schema of the twelve numbers, from which the page makes its form."""
    simple = await asyncio.to_thread(import_module, "rotordrop.machine.simple")
    return JSONResponse(simple.simple_schema())


async def twelve_numbers(desk: Desk, request: Request) -> Response:
    """Make the machine file of a job of twelve numbers."""
    job, given = desk.job(request), await order_of(request)
    for name, value in given.items():
        if not isinstance(value, str):
            raise UsageError(f"{labelled(name)} is {labelled(str(value))!r}; expected a text with a unit")
    simple = await asyncio.to_thread(import_module, "rotordrop.machine.simple")
    text: str = await asyncio.to_thread(simple.simple_text, given)

    async def body() -> AsyncIterator[bytes]:
        yield text.encode()

    entry = await receive(job, "machine", "twelve_numbers.toml", body())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


async def formats(desk: Desk, request: Request) -> Response:
    """Endings of the recordings that can be read."""
    readers = await asyncio.to_thread(import_module, "rotordrop.record.readers")
    return JSONResponse({"formats": readers.known_formats()})


_RESULT = "/api/jobs/{job}/{verb}"
_WINDOW = ("column", "start", "end", "points")
OPERATIONS = (
    Operation("GET", "/", static),
    Operation("GET", "/static/{name}", static),
    Operation("GET", "/report/{job}/{verb}/{run}/{key}", report),
    Operation("GET", "/api/formats", formats),
    Operation("GET", "/api/numbers", numbers),
    Operation("GET", "/api/example/{name}", example),
    Operation("GET", "/api/jobs", jobs),
    Operation("POST", "/api/jobs", new_job),
    Operation("GET", "/api/jobs/{job}", job),
    Operation("DELETE", "/api/jobs/{job}", remove),
    Operation("POST", "/api/jobs/{job}/options", set_options),
    Operation("POST", "/api/jobs/{job}/numbers", twelve_numbers),
    Operation("PUT", "/api/jobs/{job}/files/{role}", upload, ("name",)),
    Operation("GET", "/api/jobs/{job}/files/{role}", sent_file),
    Operation("POST", _RESULT, ask),
    Operation("POST", f"{_RESULT}/cancel", cancel),
    Operation("GET", f"{_RESULT}/page", partial(found_file, "page.json")),
    Operation("GET", f"{_RESULT}/document", partial(found_file, "document.json")),
    Operation("GET", f"{_RESULT}/window", window, _WINDOW),
    Operation("GET", f"{_RESULT}/csv", csv, _WINDOW[:3]),
)


def make_app(space: Workspace, *, port: int) -> App:
    """Make the application for a folder, guarded for the port it will listen at."""
    space.prepare()
    desk = Desk(space, Runner(space), space.token())
    desk.runner.take_over()

    @contextlib.asynccontextmanager
    async def tended(app: Starlette) -> AsyncIterator[None]:
        async def tend() -> None:
            while True:
                # a folder that may only be read, or is full
                with contextlib.suppress(OSError, RotordropError):
                    await asyncio.to_thread(desk.runner.tend)
                await asyncio.sleep(BETWEEN_LOOKS_S)

        task = asyncio.create_task(tend())
        yield
        task.cancel()

    routes = [Route(one.path, partial(one.handler, desk), methods=[one.method]) for one in OPERATIONS]
    handlers = dict.fromkeys(STATUS, partial(refused, space))
    app = Starlette(routes=routes, exception_handlers=handlers, lifespan=tended)
    return Guard(app, port=port, token=desk.token)


STATUS: dict[Any, int] = {
    NotThereError: 404,
    DamagedFileError: 409,
    RotordropError: 400,
    FileNotFoundError: 404,
    OSError: 400,
    ClientDisconnect: 400,
}
"""Refusals that become sentences, with their status."""
_SENTENCES: dict[type, str] = {
    FileNotFoundError: "it has been removed",  # by another tab meanwhile
    ClientDisconnect: "the upload broke off",
}


def without_folder(words: str, folder: Path) -> str:
    """Words that do not say where the server keeps its files."""
    return words.replace(f"{folder}/", "").replace(str(folder), "the folder of the page")


async def refused(space: Workspace, request: Request, error: Exception) -> Response:
    """A refusal as a sentence with a status."""
    kind = next(kind for kind in type(error).__mro__ if kind in STATUS)
    words = _SENTENCES.get(kind, str(error))
    if kind is OSError or type(error) is OutputError:  # nothing but what is written by the server itself
        cause = error if kind is OSError else error.__cause__
        reason = getattr(cause, "strerror", None) or "it is read-only"
        words = (
            f"the folder of the page cannot be written: {reason}; make room in it, or let it be written, on "
            "the computer that serves the page"
        )
    words = without_folder(words, space.jobs_folder / request.path_params.get("job", ""))
    return PlainTextResponse(without_folder(words, space.path), status_code=STATUS[kind])
