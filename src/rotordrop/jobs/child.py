"""The child process of a computation: sets its own limits, reads the files of a job, computes.

It writes what it is at into the state file and what it found into a folder that appears whole; it answers to
nobody, so that neither page nor server has to be there when it ends.
"""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from rotordrop.child import limit
from rotordrop.errors import OutputError, RotordropError, UnmatchedError
from rotordrop.jobs.runner import Verb, clear, process_file, publish, state_of, write_state
from rotordrop.jobs.workspace import Job
from rotordrop.progress import Progress

LIMITS: dict[Verb, tuple[int, int]] = {
    "channels": (2 * 2**30, 300),
    "look": (2 * 2**30, 300),
    "estimate": (8 * 2**30, 4 * 3600),
    "waterfall": (8 * 2**30, 4 * 3600),
    "check": (8 * 2**30, 300),
}
"""Memory [byte] and processor time [s] a computation may take; chosen, not measured."""
MEMORY_PER_BYTE = 40
"""Memory it may take beside that, for each byte of its files [1]; chosen, not measured."""
BETWEEN_WORDS_S = 0.3
"""Pause between two words on the progress [s]; chosen, not measured."""


def main(folder: str, verb: Verb) -> None:
    """Do what was ordered of the job in a folder and say how it ended."""
    job = Job(Path(folder))
    told = state_of(job, verb)
    assert told is not None
    try:
        process_file(job, verb).write_text(str(os.getpid()), encoding="ascii")  # or nobody could cancel it
        size = sum(entry["bytes"] for entry in job.read()["files"].values())
        memory, seconds = LIMITS[verb]
        limit(memory + MEMORY_PER_BYTE * size, seconds)
        of = job.digests()
        made = job.path / f"{verb}.part-{told['run']}"
        made.mkdir()
        from rotordrop.jobs.work import WORK  # only now: its limits hold for what it imports

        WORK[verb](job, made, told["options"], _progress_of(job, verb, told))
        publish(job, verb, told["run"], made, of)
        ended = {"state": "done", "fraction": 1.0, "stage": ""}
    except RotordropError as error:
        said = (
            f"{error.seen}; say which channel is which" if isinstance(error, UnmatchedError) else str(error)
        )
        ended = _failed(_without_folder(said, job), error.exit_code)
    except MemoryError:
        ended = _failed("there is not enough memory for this; cut the record to the drop", None)
    except OSError as error:
        wrong = f"cannot write the result: {error.strerror or error}; make room on the disk"
        ended = _failed(wrong, OutputError.exit_code)
    except Exception as error:  # noqa: BLE001 - whatever it is, the page must say that it happened
        wrong = f"this should not happen: {type(error).__name__}: {error}"
        ended = _failed(wrong, RotordropError.exit_code)
    clear(job, verb)
    write_state(job, verb, {**(state_of(job, verb) or told), **ended, "ended": time.time()})


def _failed(error: str, code: int | None) -> dict[str, Any]:
    return {"state": "failed", "error": error, "code": code}


def _without_folder(message: str, job: Job) -> str:
    """A message that names files as the user does, not where they are kept."""
    with suppress(RotordropError):  # one that is damaged itself has no names
        files = sorted(job.read()["files"].values(), key=lambda entry: -len(entry["stored"]))
        for entry in files:  # the longest first: record.csv is part of record.csv.gz
            message = message.replace(str(job.path / "files" / entry["stored"]), entry["name"])
    return message.replace(f"{job.path}/", "")


def _progress_of(job: Job, verb: Verb, told: dict[str, Any]) -> Progress:
    """A function that keeps stage and share in the state file, now and then."""
    running, last = state_of(job, verb) or told, 0.0

    def progress(stage: str, fraction: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= BETWEEN_WORDS_S:
            last = now
            write_state(job, verb, {**running, "stage": stage, "fraction": round(fraction, 4)})

    return progress
