"""The routes of the page: jobs, their files, and what was found."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import time
from collections.abc import AsyncIterator
from functools import partial
from importlib import import_module, resources
from pathlib import Path
from typing import Any, cast

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError
from rotordrop.web import histories
from rotordrop.web.desk import Desk, NotThereError, Operation, of_file, options_of, order_of, verb_of
from rotordrop.web.guard import App, Guard, Receive, Scope, Send
from rotordrop.web.kept_drops import label, row_of_job
from rotordrop.web.numbers import machine_of_numbers, schema_of_numbers
from rotordrop.web.running import OF_MACHINE, VERBS, Runner, published, state_of
from rotordrop.web.workspace import LARGEST, ROLES, Job, Role, TooLargeError, Workspace, labelled, receive

ASSETS = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
"""What of the folder of the page is sent, by its ending."""
STATIC = resources.files("rotordrop.web") / "static"
EXAMPLE = "lp400"
"""The example to try the page with."""
BETWEEN_LOOKS_S = 0.25
"""Pause between two looks at what waits and what ended [s]; chosen, not measured."""
OWN_LOG = "drops.db"
"""Log in the folder of the page, where no other is named."""
TICKET_S = 120.0
"""How long an address of a report waits to be opened [s]; chosen, not measured."""
LINGER_S = 30.0
"""How long an upload that was refused may go on [s]; chosen, not measured."""
REPORT_HEADERS = {
    "content-security-policy": "sandbox allow-scripts allow-downloads allow-modals",
    "cross-origin-opener-policy": "unsafe-none",  # a sandboxed page must not claim an opener policy
    "x-frame-options": "SAMEORIGIN",  # the tabs of a machine show it in a frame
}


async def page(desk: Desk, request: Request) -> Response:
    """The page itself."""
    return Response((STATIC / "index.html").read_bytes(), media_type="text/html")


async def static(desk: Desk, request: Request) -> Response:
    """A file that the page needs."""
    known = {file.name: file for file in STATIC.iterdir()}
    name = request.path_params["name"]
    kind = ASSETS.get(Path(name).suffix)
    if name not in known or kind is None:
        raise NotThereError("there is no such file")
    return Response(known[name].read_bytes(), media_type=kind)


async def example(desk: Desk, request: Request) -> Response:
    """A file of the bundled machine or of its simulated drop, to try the page with."""
    from rotordrop.record.examples import example_files

    name, known = request.path_params["name"], example_files(EXAMPLE)
    if name not in known:
        raise NotThereError(f"there is no such example; there are {', '.join(known)}")
    return Response(known[name].read_bytes(), media_type="application/octet-stream")


def _told(job: Job) -> dict[str, Any]:
    try:
        told = job.read()
    except DamagedFileError as error:
        named = {
            "name": f"damaged drop {job.number[:6]}",
            "created": job.created(),
            "options": {},
            "files": {},
        }
        return {"id": job.number, **named, "states": {}, "damaged": without_folder(str(error), job.path)}
    states: dict[str, Any] = {}
    for verb in VERBS:
        state = state_of(job, verb)
        if state is not None:
            spent = (state.get("ended") or time.time()) - state.get("started", time.time())
            states[verb] = {
                key: state.get(key) for key in ("state", "stage", "fraction", "error", "options", "run")
            }
            # between two words of a computation its time goes on falling
            until = state.get("until")
            left = None if until is None else max(until - time.time(), 0.0)
            states[verb] |= {"spent": max(spent, 0.0), "left": left, "result": None}
            try:
                found = published(job, verb)
                states[verb]["result"] = found and found["run"]
            except DamagedFileError as error:
                states[verb] |= {"state": "failed", "error": str(error)}
            if states[verb]["error"]:
                states[verb]["error"] = without_folder(states[verb]["error"], job.path)
    return {"id": job.number, **told, "states": states}


async def jobs(desk: Desk, request: Request) -> Response:
    """All jobs with what is known of each, and what room is left."""

    def listed() -> list[dict[str, Any]]:
        told = []
        for job in desk.space.jobs():
            with contextlib.suppress(FileNotFoundError):  # one that is removed meanwhile hides no other
                told.append({**_told(job), "row": row_of_job(job)})
        return told

    told = await asyncio.to_thread(listed)
    return JSONResponse({"jobs": told, "used": desk.space.used(), "quota": desk.space.quota})


async def new_job(desk: Desk, request: Request) -> Response:
    """Make a job for a drop."""
    order = await order_of(request)
    job = desk.space.new_job(labelled(str(order.get("name", ""))), options_of(order.get("options", {})))
    return JSONResponse(_told(job), status_code=201)


async def job(desk: Desk, request: Request) -> Response:
    """One job."""
    return JSONResponse(_told(desk.job(request)))


async def remove(desk: Desk, request: Request) -> Response:
    """Stop what a job computes and remove it."""
    await asyncio.to_thread(desk.runner.remove, desk.job(request))
    return Response(status_code=204)


async def upload(desk: Desk, request: Request) -> Response:
    """Take a file of a job while it comes in."""
    job, role = desk.job(request), request.path_params["role"]
    if role not in ROLES:
        raise NotThereError(f"there is no {labelled(role)!r}; a file is one of {', '.join(ROLES)}")
    declared = request.headers.get("content-length", "")
    length = int(declared) if declared.isascii() and declared.isdigit() else None
    name = request.query_params.get("name", "")
    entry = await receive(desk.space, job, cast("Role", role), name, length, request.stream())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


async def sent_file(desk: Desk, request: Request) -> Response:
    """A file of a job as it was sent or made, so that what the page computes can be computed elsewhere."""
    job, role = desk.job(request), request.path_params["role"]
    place = await asyncio.to_thread(job.file, role) if role in ROLES else None
    if place is None:
        raise NotThereError("the job has no such file")
    return await of_file(place, "application/octet-stream")


async def set_options(desk: Desk, request: Request) -> Response:
    """Change what is said of a recording beside its files; what was found without it is dropped."""
    job, given = desk.job(request), options_of(await order_of(request))
    await asyncio.to_thread(desk.runner.forget, job)
    told = job.read()
    job.write({**told, "options": {**told["options"], **given}})
    return JSONResponse(_told(job))


async def ask(desk: Desk, request: Request) -> Response:
    """Ask for a computation."""
    job, verb = desk.job(request), verb_of(request)
    options = {**job.read()["options"], **options_of(await order_of(request))}
    if verb in OF_MACHINE and "machine" not in job.read()["files"]:
        raise UsageError("no machine file was sent; drop one on the page")
    if verb not in OF_MACHINE and "record" not in job.read()["files"]:
        raise UsageError("no record was sent; drop one on the page")
    await asyncio.to_thread(desk.runner.ask, job, verb, options)
    return JSONResponse(_told(job), status_code=202)


async def cancel(desk: Desk, request: Request) -> Response:
    """Stop a computation."""
    job = desk.job(request)
    await asyncio.to_thread(desk.runner.cancel, job, verb_of(request))
    return JSONResponse(_told(job))


async def found_page(desk: Desk, request: Request) -> Response:
    """What the page draws of a result."""
    return await of_file(await desk.found(request) / "page.json", "application/json")


async def found_document(desk: Desk, request: Request) -> Response:
    """The document of a result."""
    return await of_file(await desk.found(request) / "document.json", "application/json")


async def ticket(desk: Desk, request: Request) -> Response:
    """An address for the report that works once and soon: a page that is opened carries no token."""
    place = await desk.found(request) / "report.html"
    if not place.is_file():
        raise NotThereError("there is no report of this; make an estimate first")
    now = time.monotonic()
    desk.tickets = {key: kept for key, kept in desk.tickets.items() if now - kept[1] < TICKET_S}
    ticket = secrets.token_urlsafe(24)
    desk.tickets[ticket] = (place, now)
    return JSONResponse({"address": f"/report/{ticket}"}, status_code=201)


async def report(desk: Desk, request: Request) -> Response:
    """A report, as a page of nobody: it brings a policy of its own and may not speak with this server."""
    place, made = desk.tickets.pop(request.path_params["ticket"], (None, 0.0))
    if place is None or time.monotonic() - made > TICKET_S:
        raise NotThereError("this address of the report has been used; open the report from the page again")
    return await of_file(place, "text/html", REPORT_HEADERS)


async def numbers(desk: Desk, request: Request) -> Response:
    """The schema of the twelve numbers, from which the page makes its form."""
    return Response(await asyncio.to_thread(schema_of_numbers), media_type="application/json")


async def twelve_numbers(desk: Desk, request: Request) -> Response:
    """Make the machine file of a job of twelve numbers."""
    job, given = desk.job(request), await order_of(request)
    text = await asyncio.to_thread(machine_of_numbers, given)

    async def body() -> AsyncIterator[bytes]:
        yield text.encode()

    entry = await receive(desk.space, job, "machine", "twelve_numbers.toml", None, body())
    await asyncio.to_thread(desk.runner.forget, job)
    return JSONResponse(entry, status_code=201)


async def formats(desk: Desk, request: Request) -> Response:
    """Endings of the recordings that can be read, and how many bytes are taken of what."""
    readers = await asyncio.to_thread(import_module, "rotordrop.record.readers")
    return JSONResponse({"formats": readers.known_formats(), "largest": LARGEST})


async def label_job(desk: Desk, request: Request) -> Response:
    """Name a drop, note something of it, tag it, put it away; what was found of it stays."""
    job = desk.job(request)
    label(job, await order_of(request))
    return JSONResponse(_told(job))


async def read_log(desk: Desk, request: Request) -> Response:
    """The log: its drops, what they are allowed, and what rises from drop to drop."""
    logs = await asyncio.to_thread(import_module, "rotordrop.web.log")
    told = await asyncio.to_thread(logs.log_told, desk.log, desk.own_log)
    place = Path(desk.log).absolute().parent
    return JSONResponse({**told, "problem": without_folder(told["problem"], place)})


async def add_to_log(desk: Desk, request: Request) -> Response:
    """Add the estimate of a drop to the log."""
    logs = await asyncio.to_thread(import_module, "rotordrop.web.log")
    return JSONResponse(
        await asyncio.to_thread(logs.add_to_log, desk.job(request), desk.log), status_code=201
    )


async def take_out_of_log(desk: Desk, request: Request) -> Response:
    """Take a drop out of the log."""
    logs = await asyncio.to_thread(import_module, "rotordrop.web.log")
    await asyncio.to_thread(logs.take_out_of_log, desk.job(request), desk.log)
    return Response(status_code=204)


_RESULT = "/api/jobs/{job}/{verb}"
_WINDOW = ("column", "start", "end", "points")
OPERATIONS = (
    Operation("GET", "/", page),
    Operation("GET", "/static/{name}", static),
    Operation("GET", "/report/{ticket}", report),
    Operation("GET", "/api/jobs", jobs),
    Operation("POST", "/api/jobs", new_job),
    Operation("GET", "/api/jobs/{job}", job),
    Operation("DELETE", "/api/jobs/{job}", remove),
    Operation("POST", "/api/jobs/{job}/options", set_options),
    Operation("PUT", "/api/jobs/{job}/files/{role}", upload, ("name",)),
    Operation("GET", "/api/jobs/{job}/files/{role}", sent_file),
    Operation("GET", "/api/formats", formats),
    Operation("GET", "/api/example/{name}", example),
    Operation("POST", "/api/jobs/{job}/label", label_job),
    Operation("GET", "/api/log", read_log),
    Operation("POST", "/api/jobs/{job}/log", add_to_log),
    Operation("DELETE", "/api/jobs/{job}/log", take_out_of_log),
    Operation("GET", "/api/numbers", numbers),
    Operation("POST", "/api/jobs/{job}/numbers", twelve_numbers),
    Operation("POST", _RESULT, ask),
    Operation("POST", f"{_RESULT}/cancel", cancel),
    Operation("GET", f"{_RESULT}/page", found_page),
    Operation("GET", f"{_RESULT}/document", found_document),
    Operation("GET", f"{_RESULT}/window", histories.window, _WINDOW),
    Operation("GET", f"{_RESULT}/field", histories.field, ("plane", "part")),
    Operation("GET", f"{_RESULT}/between", histories.between, _WINDOW[:3]),
    Operation("GET", f"{_RESULT}/csv", histories.csv, _WINDOW[:3]),
    Operation("POST", f"{_RESULT}/report", ticket),
)


def make_app(space: Workspace, *, port: int, log: str | None = None) -> App:
    """Make the application for a folder and a log of drops, guarded for the port it will listen at.

    Without a log the folder has one of its own, which is made with the first drop that is added.
    """
    space.prepare()
    desk = Desk(space, Runner(space), log or str(space.path / OWN_LOG), log is None)
    desk.runner.take_over()

    @contextlib.asynccontextmanager
    async def tended(app: Starlette) -> AsyncIterator[None]:
        async def tend() -> None:
            while True:
                with contextlib.suppress(
                    OSError, RotordropError
                ):  # a folder that may only be read, or is full
                    await asyncio.to_thread(desk.runner.tend)
                await asyncio.sleep(BETWEEN_LOOKS_S)

        task = asyncio.create_task(tend())
        yield
        task.cancel()

    return Guard(
        Starlette(
            routes=[Route(one.path, partial(one.handler, desk), methods=[one.method]) for one in OPERATIONS],
            exception_handlers=dict.fromkeys(STATUS, partial(refused, space)),
            lifespan=tended,
        ),
        port=port,
        token=space.token(),
    )


STATUS: dict[Any, int] = {
    NotThereError: 404,
    TooLargeError: 413,
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
    answer = PlainTextResponse(without_folder(words, space.path), status_code=STATUS[kind])
    return Lingering(answer) if kind is TooLargeError else answer


class Lingering(Response):
    """An answer to an upload that is still sent: given at once, and what comes is thrown away for a while.

    A connection that is closed with bytes unread is reset, and many a sender then never reads the answer.
    """

    def __init__(self, answer: Response) -> None:
        super().__init__(answer.body, answer.status_code, {"connection": "close"}, "text/plain")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the answer, then wait for the sender to end."""
        start = {"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers}
        await send(start)
        await send({"type": "http.response.body", "body": self.body, "more_body": True})
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(LINGER_S):
                while (await receive()).get("more_body", False):
                    pass
        await send({"type": "http.response.body", "body": b"", "more_body": False})
