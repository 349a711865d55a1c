"""Computations of drops: each in a child process of its own that outlives whoever asked for it.

What a computation is at lies in its state file, what it found in a folder that appears whole. A child holds a
lock as long as it lives, so that the next server, too, knows whether it still runs.
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import subprocess
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

from rotordrop.child import Starter
from rotordrop.errors import DamagedFileError
from rotordrop.files import clear_of_no_file, digest_at, digest_of_file, read_sealed, write_json
from rotordrop.jobs.workspace import Job, Workspace

Verb: TypeAlias = Literal["channels", "look", "estimate", "waterfall", "check"]
Key: TypeAlias = tuple[str, Verb]
VERBS: tuple[Verb, ...] = get_args(Verb)
AT_ONCE: dict[Verb, int] = {
    "channels": 2,
    "look": 2,
    "estimate": max(1, (os.cpu_count() or 2) // 2),
    "waterfall": 1,
    "check": 1,
}
"""Computations of one verb that run beside each other; others wait."""
IMPORTS: dict[Verb, tuple[str, ...]] = {
    "look": ("rotordrop.evidence.look", "rotordrop.record.readers.delimited", "rotordrop.report.look_page"),
    "estimate": ("rotordrop.estimation", "rotordrop.twin.search"),
}
"""What is imported before a computation is begun, where that need not be done for each."""

_PATIENCE_S = 5.0
"""How long a killed child may take to end [s]; chosen, not measured."""


def state_file(job: Job, verb: Verb) -> Path:
    """Where a computation says what it is at."""
    return job.path / f"{verb}.state.json"


def write_state(job: Job, verb: Verb, told: dict[str, Any]) -> None:
    """Keep what a computation is at."""
    clear_of_no_file(state_file(job, verb))
    write_json(state_file(job, verb), told, sealed=True)


def state_of(job: Job, verb: Verb) -> dict[str, Any] | None:
    """What a computation is at; None where none was asked for, a failure where that is damaged."""
    try:
        return read_sealed(state_file(job, verb), _AGAIN)
    except FileNotFoundError:
        return None
    except DamagedFileError as error:
        return {"state": "failed", "error": str(error), "run": "", "options": {}}


_AGAIN = "ask for it again"


def result_folder(job: Job, verb: Verb, *names: str) -> Path | None:
    """What the last finished computation found; None where none has finished.

    Of the files named, or of all, the digests are compared: one that has changed on the disk is refused.
    """
    told = published(job, verb)
    if told is None:
        return None
    folder: Path = job.path / f"{verb}.{told['run']}"
    for name in names or told["files"]:
        if digest_at(folder / name) != told["files"].get(name, ""):
            raise DamagedFileError(
                f"{name} of {verb!r} is damaged: it is gone, or changed on the disk since it was computed; "
                f"{_AGAIN}"
            )
    return folder


def published(job: Job, verb: Verb) -> dict[str, Any] | None:
    """The last result: its run and the digests of its files; none where the files it was of were replaced."""
    with suppress(FileNotFoundError):
        told = read_sealed(job.path / f"{verb}.result.json", _AGAIN)
        if told["of"] == job.digests():
            return told
    return None


def published_run(job: Job, verb: Verb) -> str | None:
    """Which computation the last result is of; none where that cannot be read either."""
    with suppress(DamagedFileError):
        told = published(job, verb)
        return None if told is None else str(told["run"])
    return None


def running(space: Workspace) -> list[Verb]:
    """Computations that go on at this moment, whichever server began them."""
    return [verb for job in space.jobs() for verb in VERBS if _locked(job, verb)]


def publish(job: Job, verb: Verb, run: str, made: Path, of: dict[str, str]) -> None:
    """Make a finished folder the result of files by their content: its name first, then that it counts."""
    digests = {file.name: digest_of_file(file) for file in sorted(made.iterdir())}
    made.rename(job.path / f"{verb}.{run}")
    told = {"run": run, "of": of, "files": digests}
    clear_of_no_file(job.path / f"{verb}.result.json")
    write_json(job.path / f"{verb}.result.json", told, sealed=True)


@dataclass
class Runner:
    """Begins what waits, notices what ended; the files say all there is to know."""

    space: Workspace
    _starter: Starter = field(default_factory=Starter)
    _children: dict[Key, subprocess.Popen[bytes]] = field(default_factory=dict)
    """Children that are no copies: whether they run is not told by a lock everywhere."""
    _open: dict[Key, Job] = field(default_factory=dict)
    _one: threading.RLock = field(default_factory=threading.RLock)

    def take_over(self) -> None:
        """Find what an earlier server left waiting or running."""
        for job in self.space.jobs():
            for verb in VERBS:
                told = state_of(job, verb)
                if told is not None and told["state"] in ("waiting", "running"):
                    self._open[job.number, verb] = job

    def ask(self, job: Job, verb: Verb, options: dict[str, Any]) -> dict[str, Any]:
        """Ask for a computation; it begins when there is room. What waits or runs is not asked for twice."""
        with self._one:
            told = state_of(job, verb)
            self._open[job.number, verb] = job  # also what an earlier process asked for
            if told is None or told["state"] not in ("waiting", "running"):
                now = time.time()
                told = {"state": "waiting", "run": secrets.token_hex(8), "asked": now, "options": options}
                write_state(job, verb, told)
            self.tend()
            return state_of(job, verb) or told

    def tend(self) -> None:
        """Give whoever ended without a word one; let whoever waits longest begin where there is room."""
        with self._one:
            self._children = {key: child for key, child in self._children.items() if child.poll() is None}
            busy = dict.fromkeys(VERBS, 0)
            waiting: list[tuple[float, Key, dict[str, Any]]] = []
            for (number, verb), job in list(self._open.items()):
                told = state_of(job, verb) or {"state": ""}
                lives = (number, verb) in self._children or _locked(job, verb)
                if told["state"] == "waiting":
                    waiting.append((told["asked"], (number, verb), told))
                elif told["state"] == "running" and lives:
                    busy[verb] += 1
                else:
                    _settle(job, verb)
                    del self._open[number, verb]
            for _, (number, verb), told in sorted(waiting, key=lambda entry: entry[0]):
                if busy[verb] < AT_ONCE[verb]:
                    busy[verb] += 1
                    self._begin(self._open[number, verb], verb, told)

    def _begin(self, job: Job, verb: Verb, told: dict[str, Any]) -> None:
        clear_of_no_file(_lock_file(job, verb))
        lock = os.open(_lock_file(job, verb), os.O_RDWR | os.O_CREAT, 0o600)
        try:
            if not take_lock(lock):
                return
            write_state(job, verb, {**told, "state": "running", "started": time.time(), "fraction": 0.0})
            clear_of_no_file(process_file(job, verb))
            process_file(job, verb).write_text("", encoding="ascii")  # the child says who it is
            child = self._starter.start(
                *("rotordrop.jobs.child", "main", str(job.path.absolute()), verb),
                imports=("rotordrop.jobs.child", "rotordrop.jobs.work", *IMPORTS.get(verb, ())),
                held=lock,
            )
            if child is not None:
                self._children[job.number, verb] = child
        finally:
            os.close(lock)

    def cancel(self, job: Job, verb: Verb) -> None:
        """Stop a computation that waits or runs, with everything it has begun."""
        with self._one:
            told = state_of(job, verb)
            if told is None or told["state"] not in ("waiting", "running"):
                return
            if told["state"] == "running" and not self._stop(job, verb):
                return
            latest = state_of(job, verb) or told
            if latest["state"] in ("waiting", "running"):
                write_state(job, verb, {**latest, "state": "cancelled", "ended": time.time()})
            clear(job, verb)

    def _stop(self, job: Job, verb: Verb) -> bool:
        """Kill a child whose lock is held, and wait for it; whether it ended."""
        child = self._children.pop((job.number, verb), None)
        until = time.monotonic() + _PATIENCE_S
        while (child is not None and child.poll() is None) or _locked(job, verb):
            with suppress(OSError, ValueError):
                kept = process_file(job, verb)
                number = child.pid if child else kept.read_text(encoding="ascii") if kept.is_file() else ""
                if os.name == "posix":
                    os.killpg(int(number), signal.SIGKILL)
                else:
                    os.kill(int(number), signal.SIGTERM)
            if time.monotonic() > until:
                return False
            time.sleep(0.02)
        return True

    def forget(self, job: Job) -> None:
        """Stop what a job computes and drop what it found: it was of other files."""
        with self._one:
            self._cancel_all(job)
            for verb in VERBS:
                for file in (job.path / f"{verb}.result.json", state_file(job, verb)):
                    clear_of_no_file(file)
                    file.unlink(missing_ok=True)
                clear(job, verb)

    def remove(self, job: Job) -> None:
        """Stop what a job computes and remove it."""
        with self._one:
            self._cancel_all(job)
            job.remove()

    def _cancel_all(self, job: Job) -> None:
        for verb in VERBS:
            self.cancel(job, verb)
            self._open.pop((job.number, verb), None)


def _settle(job: Job, verb: Verb) -> None:
    """A child is gone without its last word: what it published counts, anything else is a failure."""
    told = state_of(job, verb)
    if told is None or told["state"] != "running":
        return
    ended: dict[str, Any] = {"state": "done", "fraction": 1.0}
    if published_run(job, verb) != told["run"]:
        ended = {
            "state": "failed",
            "error": "the computation was ended from outside before it was done; start it again",
        }
    write_state(job, verb, {**told, **ended, "ended": time.time()})
    clear(job, verb)


def clear(job: Job, verb: Verb) -> None:
    """Remove what a killed child had begun, and results that no longer count."""
    kept = published_run(job, verb)
    for left in job.path.glob(f"{verb}.*"):
        if left.is_dir() and left.name != f"{verb}.{kept}":
            shutil.rmtree(left, ignore_errors=True)


def _lock_file(job: Job, verb: Verb) -> Path:
    return job.path / f"{verb}.lock"


def process_file(job: Job, verb: Verb) -> Path:
    """Where a computation says which process it is."""
    return job.path / f"{verb}.process"


def take_lock(descriptor: int) -> bool:
    """Take the lock that the child inherits; elsewhere than on POSIX systems there is none to inherit."""
    if os.name != "posix":
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _locked(job: Job, verb: Verb) -> bool:
    """Whether a child holds the lock of a computation, whichever server began it."""
    if os.name != "posix":
        return False
    try:
        descriptor = os.open(_lock_file(job, verb), os.O_RDWR)
    except OSError:
        return False
    try:
        return not take_lock(descriptor)
    finally:
        os.close(descriptor)
