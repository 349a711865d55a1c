"""The routes of the page: jobs, their files, and what was found."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import lru_cache
from importlib import resources
from typing import Any, cast

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from rotordrop.errors import RotordropError, UsageError
from rotordrop.web import histories
from rotordrop.web.desk import Desk, Handler, NotThereError, Operation, options_of, order_of, verb_of
from rotordrop.web.guard import App, Guard
from rotordrop.web.numbers import machine_of_numbers, schema_of_numbers
from rotordrop.web.running import VERBS, Runner, published_run, state_of
from rotordrop.web.workspace import ROLES, Job, Role, TooLargeError, Workspace, labelled, receive

ASSETS = {
    **dict.fromkeys(
        (
            "page.js",
            "state.js",
            "panels.js",
            "cursor.js",
            "sending.js",
            "compare.js",
            "rotor.js",
            "server.js",
            "plots.js",
            "orbit.js",
            "tables.js",
            "figures.js",
            "units.js",
            "waterfall.js",
            "uplot.js",
        ),
        "text/javascript",
    ),
    "page.css": "text/css",
    "uplot.css": "text/css",
    "icon.svg": "image/svg+xml",
}
BETWEEN_LOOKS_S = 0.25
TICKET_S = 120.0
REPORT_HEADERS = {
    "content-security-policy": "sandbox allow-scripts allow-downloads allow-modals",
    "cross-origin-opener-policy": "unsafe-none",  # a sandboxed page must not claim an opener policy
}


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
    order = await order_of(request)
    job = desk.space.new_job(labelled(str(order.get("name", ""))), options_of(order.get("options", {})))
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


async def _sent_file(desk: Desk, request: Request) -> Response:
    """A file of a job as it was sent or made, so that what the page computes can be computed elsewhere."""
    job, role = desk.job(request), request.path_params["role"]
    place = job.file(role) if role in ROLES else None
    if place is None:
        raise NotThereError("the job has no such file")
    return FileResponse(place, media_type="application/octet-stream")


async def _set_options(desk: Desk, request: Request) -> Response:
    """Change what is said of a recording beside its files; what was found without it is dropped."""
    job, given = desk.job(request), options_of(await order_of(request))
    await asyncio.to_thread(desk.runner.forget, job)
    told = job.read()
    job.write({**told, "options": {**told["options"], **given}})
    return JSONResponse(_told(job))


async def _ask(desk: Desk, request: Request) -> Response:
    job, verb = desk.job(request), verb_of(request)
    options = {**job.read()["options"], **options_of(await order_of(request))}
    if job.file("record") is None:
        raise UsageError("no record was sent; drop one on the page")
    await asyncio.to_thread(desk.runner.ask, job, verb, options)
    return JSONResponse(_told(job), status_code=202)


async def _cancel(desk: Desk, request: Request) -> Response:
    job = desk.job(request)
    await asyncio.to_thread(desk.runner.cancel, job, verb_of(request))
    return JSONResponse(_told(job))


async def _found_page(desk: Desk, request: Request) -> Response:
    return FileResponse(desk.found(request) / "page.json", media_type="application/json")


async def _found_document(desk: Desk, request: Request) -> Response:
    return FileResponse(desk.found(request) / "document.json", media_type="application/json")


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


async def _numbers(desk: Desk, request: Request) -> Response:
    """The schema of the twelve numbers, from which the page makes its form."""
    return Response(await asyncio.to_thread(schema_of_numbers), media_type="application/json")


async def _machine_of_numbers(desk: Desk, request: Request) -> Response:
    """Make the machine file of a job of twelve numbers."""
    job, given = desk.job(request), await order_of(request)
    text = await asyncio.to_thread(machine_of_numbers, given)

    async def body() -> AsyncIterator[bytes]:
        yield text.encode()

    entry = await receive(desk.space, job, "machine", "twelve_numbers.toml", None, body())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


async def _formats(desk: Desk, request: Request) -> Response:
    """Endings of the recordings that can be read."""

    def known() -> tuple[str, ...]:
        from rotordrop.record.readers import known_formats

        return known_formats()

    return JSONResponse({"formats": await asyncio.to_thread(known)})


async def _drops(desk: Desk, request: Request) -> Response:
    """Drops to compare with: estimates that are here, and entries of the log."""

    def found() -> list[dict[str, Any]]:
        from rotordrop.web.compared import compared_drops

        return compared_drops(desk.space, desk.log)

    return JSONResponse({"drops": await asyncio.to_thread(found), "log": desk.log is not None})


_RESULT = "/api/jobs/{job}/{verb}"
_WINDOW = ("column", "start", "end", "points")
OPERATIONS = (
    Operation("GET", "/", _page),
    Operation("GET", "/static/{name}", _static),
    Operation("GET", "/report/{ticket}", _report),
    Operation("GET", "/api/jobs", _jobs),
    Operation("POST", "/api/jobs", _new_job),
    Operation("GET", "/api/jobs/{job}", _job),
    Operation("DELETE", "/api/jobs/{job}", _remove),
    Operation("POST", "/api/jobs/{job}/options", _set_options),
    Operation("PUT", "/api/jobs/{job}/files/{role}", _upload, ("name",)),
    Operation("GET", "/api/jobs/{job}/files/{role}", _sent_file),
    Operation("GET", "/api/formats", _formats),
    Operation("GET", "/api/drops", _drops),
    Operation("GET", "/api/numbers", _numbers),
    Operation("POST", "/api/jobs/{job}/numbers", _machine_of_numbers),
    Operation("POST", _RESULT, _ask),
    Operation("POST", f"{_RESULT}/cancel", _cancel),
    Operation("GET", f"{_RESULT}/page", _found_page),
    Operation("GET", f"{_RESULT}/document", _found_document),
    Operation("GET", f"{_RESULT}/window", histories.window, _WINDOW),
    Operation("GET", f"{_RESULT}/field", histories.field, ("plane", "part")),
    Operation("GET", f"{_RESULT}/csv", histories.csv, _WINDOW[:3]),
    Operation("POST", f"{_RESULT}/report", _ticket),
)


def make_app(space: Workspace, *, port: int, log: str | None = None) -> App:
    """Make the application for a folder and a log of drops, guarded for the port it will listen at."""
    space.prepare()
    desk = Desk(space, Runner(space), log)
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
