"""What the handlers of the page share: the folder, what runs, and how a request is read."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import json
from collections.abc import AsyncIterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from starlette.requests import Request

from rotordrop.errors import RotordropError, UsageError
from rotordrop.files import atomic_path, clear_of_no_file
from rotordrop.jobs.runner import VERBS, Runner, Verb, result_folder
from rotordrop.jobs.workspace import Job, Role, Workspace, labelled, stored_as

OPTIONS = ("gap", "speed", "planes", "operator", "method")
METHODS = ("tracked", "replay")


class NotThereError(RotordropError):
    """What an address names does not exist."""


@dataclass
class Desk:
    """What the handlers share."""

    space: Workspace
    runner: Runner
    token: str

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

    def report_of(self, job: str, verb: str, run: str) -> str:
        """Address of one report, which opens that report alone: a page that is opened carries no token."""
        key = hmac.new(self.token.encode(), f"{job} {verb} {run}".encode(), hashlib.sha256).hexdigest()
        return f"/report/{job}/{verb}/{run}/{key}"


def verb_of(request: Request) -> Verb:
    """The computation an address names."""
    verb = request.path_params["verb"]
    if verb not in VERBS:
        raise NotThereError(f"there is no {labelled(verb)!r}; there are {', '.join(VERBS)}")
    return cast("Verb", verb)


async def order_of(request: Request) -> dict[str, Any]:
    """The body of a request as a table of JSON."""
    try:
        order = json.loads(await request.body() or b"{}")
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
        if not isinstance(value, str):
            raise UsageError(f"the option {name} is {labelled(str(value))!r}; expected a text")
    if given.get("method", "tracked") not in METHODS:
        raise UsageError(f"the method is {labelled(given['method'])!r}; there are {', '.join(METHODS)}")
    return {name: value for name, value in given.items() if value != ""}


async def receive(job: Job, role: Role, name: str, body: AsyncIterable[bytes]) -> dict[str, Any]:
    """Write a file of a job while it comes in; it stands there whole or not at all.

    The name at the client is a label.
    """
    label, stored = labelled(name), stored_as(role, name)
    key = role if role != "beside" else f"beside {stored}"
    _refuse_clash(job, key, label, stored)
    counted, digest, file = 0, hashlib.sha256(), job.path / "files" / stored
    clear_of_no_file(file)
    with atomic_path(file) as place, place.open("wb") as stream:
        async for part in body:
            counted += len(part)
            digest.update(part)
            stream.write(part)
        if counted == 0:
            raise UsageError(f"{label} is empty")
        # From here to the new name nothing else runs: of uploads side by side only one gets a name.
        _refuse_clash(job, key, label, stored)
    told = job.read()
    entry = {"name": label, "stored": stored, "bytes": counted, "sha256": digest.hexdigest()}
    before = told["files"].get(key)
    told["files"][key] = entry
    job.write(told)
    if before is not None and before["stored"] != stored:
        clear_of_no_file(job.path / "files" / before["stored"])
        (job.path / "files" / before["stored"]).unlink(missing_ok=True)
    return entry


def _refuse_clash(job: Job, key: str, label: str, stored: str) -> None:
    """Two files of a job that would lie under one name, whatever the case of its letters."""
    for other, entry in job.read()["files"].items():
        if other != key and entry["stored"].lower() == stored.lower():
            raise UsageError(
                f"{label} would lie where {entry['name']} lies; send it to a job of its own, or as what it is"
            )
