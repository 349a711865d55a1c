"""The loop that watches a folder: take what is stable, compute it in a limited child, log it, report it.

Every step leaves its mark in the drop it belongs to, after it is done, and may be repeated: a watcher that is
killed at any moment, or a disk that is full, delays a record and loses none. A drop is worked on by whoever
holds its lock, which the system takes back from a dead one.
"""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotordrop.errors import OutputError, RecordError, RotordropError, UsageError
from rotordrop.estimate.published import read_drop
from rotordrop.files import clear_of_no_file
from rotordrop.jobs.runner import Runner, Verb, published_run, result_folder, state_of, take_lock
from rotordrop.jobs.workspace import Job
from rotordrop.ledger.book import LoggedAlreadyError, add_drop, drop_of_estimate, logged_drops, remove_drop
from rotordrop.watch.fleet import Fleet, read_fleet
from rotordrop.watch.kept import (
    Arrived,
    Kept,
    arrived,
    is_part,
    keep_status,
    put,
    record_of,
    status_of,
)
from rotordrop.watch.overview import write_overview
from rotordrop.watch.scalars import REPLACED, VERBS, line_of, scalars_of

SETTLES_S = 2.0
"""How long size and date of a file must stay the same [s]; chosen, not measured."""
EVERY_S = 5.0
"""How often the folder is looked at [s]; chosen, not measured."""
BUSY_S = 0.2
"""Pause between two turns while something is computed [s]; chosen, not measured."""
ROOM = 2 + (os.cpu_count() or 2)
"""Records that are taken before others are done: the folder itself is the queue; chosen, not measured."""
CRASHES = 3
"""Computations of a record that may be ended from outside before a person must look; chosen, not measured."""
AGAIN_S, LATEST_S = 5.0, 3600.0
"""First and longest pause before what failed is tried again [s]; chosen, not measured."""
CUT_SHORT = "the file was taken before it was complete, and is kept whole since"
HOOK_S = 60.0
"""How long a hook may take [s]; chosen, not measured."""
OVERVIEW_SHARE = 0.05
"""Most of the time that is spent on the overview [1]; chosen, not measured."""


@dataclass
class Watcher:
    """Watches one folder; any number of them may share folder, kept records and log."""

    folder: Path
    machines: Path
    kept: Kept
    log: str
    hook: str | None = None
    quick: bool = False
    """One pass for calibrated machines."""
    every: float = EVERY_S
    say: Callable[[str], None] = lambda line: None
    complain: Callable[[str], None] = lambda line: None
    _fleet: Fleet = field(init=False)
    _machine_files: set[Arrived] = field(default_factory=set)
    _machines: str = ""
    """Digest of how they stand."""
    _mine: dict[str, int] = field(default_factory=dict)
    """Drops that are worked on, and the lock of each."""
    _ended: set[str] = field(default_factory=set)
    _quarantined: set[str] = field(default_factory=set)
    _seen: dict[Path, Arrived] = field(default_factory=dict)
    """Files as they were taken."""
    _of_file: defaultdict[Path, set[str]] = field(default_factory=lambda: defaultdict(set))
    """Drops that were taken from each file."""
    _announced: set[str] = field(default_factory=set)
    """Drops whose estimate was said to have begun."""
    _standing: dict[Path, tuple[Arrived, float]] = field(default_factory=dict)
    """Files that were not taken, and since when they are as they are."""
    _queue: list[Arrived] = field(default_factory=list)
    _later: dict[str, tuple[float, float]] = field(default_factory=dict)
    """What failed: when it is tried again, and the pause before."""
    _next_look: float = 0.0
    _next_overview: float = 0.0
    _news: bool = True

    def prepare(self) -> None:
        """Refuse what cannot work, before anything is taken."""
        if not self.folder.is_dir():
            raise UsageError(f"{self.folder} is no folder; name the one in which records arrive")
        self._fleet = read_fleet(self.machines)
        self._machine_files = _standing_in(self.machines)
        self._machines = _digest_of(self._machine_files)
        self.kept.prepare()
        self._runner = Runner(self.kept.space)

    def run(self, *, once: bool) -> None:
        """Watch until interrupted, or once: until everything that stands there is done."""
        try:
            while (busy := self.turn()) or self._standing or not once:
                time.sleep(BUSY_S if busy else min(self.every, SETTLES_S) if self._standing else self.every)
            self._next_overview = 0.0
            self._show()
        finally:
            while self._mine:
                os.close(self._mine.popitem()[1])

    def turn(self) -> bool:
        """Do what can be done now; whether something is under way."""
        now = time.monotonic()
        if now >= self._next_look:
            self._reload_machines()
            self._pick_up()
            self._look_round(now)
            self._next_look = time.monotonic() + (
                min(self.every, SETTLES_S) if self._standing else self.every
            )
        while self._queue and len(self._mine) - len(self._later) < ROOM and self._due("", now):
            self._take(self._queue.pop())
        for number in [number for number in self._mine if self._due(number, now)]:
            if self._with_patience(number, lambda number=number: self._tend(number)):  # type: ignore[misc]
                self._release(number)
        self._show()
        return bool(self._queue or self._mine.keys() - self._later.keys())

    def _due(self, number: str, now: float) -> bool:
        return now >= self._later.get(number, (0.0, 0.0))[0]

    def _with_patience(self, number: str, work: Callable[[], bool]) -> bool:
        """Do something that a full disk, a share that is away, a log or a hook may refuse, now or later."""
        try:
            done = work()
        except (RotordropError, OSError) as error:
            pause = min(2.0 * self._later.get(number, (0.0, AGAIN_S / 2.0))[1], LATEST_S)
            self._later[number] = (time.monotonic() + pause, pause)
            self.complain(f"{error}; tried again in {pause:.0f} s")
            return False
        self._later.pop(number, None)
        return done

    def _reload_machines(self) -> None:
        """Read the machine files again where one has changed; what has a machine now is tried again."""
        if (now := _standing_in(self.machines)) == self._machine_files:
            return
        self._machine_files, self._machines = now, _digest_of(now)
        try:
            self._fleet = read_fleet(self.machines)
            self._ended.clear()
        except RotordropError as error:
            self.complain(f"{error}; the machine files stay as they were read before")

    def _pick_up(self) -> None:
        """Lock drops that nobody works on: of killed watchers, and those that are to be tried again."""
        for number in self._quarantined.copy():
            if not self.kept.quarantined(self.kept.job(number)).is_dir():
                self._quarantined.discard(number)
                self._ended.discard(number)
        for number in self.kept.numbers():
            if number in self._ended or number in self._mine:
                continue
            job = self.kept.job(number)
            status = status_of(job)
            if status is not None and "size" in status:
                source = Path(status["source"])
                self._seen.setdefault(source, Arrived(source, status["size"], status["mtime_ns"]))
                self._of_file[source].add(number)
            if status is None or (status.get("done") and not self._is_to_be_tried_again(job, status)):
                self._end(number, status)
            else:
                self._lock(job)

    def _lock(self, job: Job) -> None:
        with suppress(FileNotFoundError):  # removed on the page
            clear_of_no_file(job.path / "watch.lock")
            lock = os.open(job.path / "watch.lock", os.O_RDWR | os.O_CREAT, 0o600)
            if take_lock(lock):
                self._mine[job.number] = lock
            else:
                os.close(lock)

    def _release(self, number: str) -> None:
        os.close(self._mine.pop(number))
        self._end(number, status_of(self.kept.job(number)))
        self._news = True

    def _end(self, number: str, status: dict[str, Any] | None) -> None:
        self._ended.add(number)
        if status is not None and status["outcome"] == "quarantined":
            self._quarantined.add(number)

    def _is_to_be_tried_again(self, job: Job, status: dict[str, Any]) -> bool:
        if status["outcome"] == "quarantined":
            return not self.kept.quarantined(job).is_dir()
        if status["outcome"] != "looked" or status.get("machines") == self._machines:
            return False  # to ask the head of every record again took half a minute of 4,700
        return self._fleet.of(*self._names(job, status))[0] is not None

    def _names(self, job: Job, status: dict[str, Any]) -> tuple[Path, Path]:
        """A record as it lay under the folder, and where it is kept."""
        source = Path(status["source"])
        name = source.relative_to(self.folder) if source.is_relative_to(self.folder) else source
        return name, record_of(job)

    def _look_round(self, now: float) -> None:
        """Queue files that have stood still long enough and are not taken."""
        standing = {}
        for one in arrived(self.folder, self.kept.path.resolve()):
            if self._seen.get(one.path) == one:
                continue
            before, since = self._standing.get(one.path, (one, now))
            standing[one.path] = (one, since if before == one else now)
        stable = [one for one, since in standing.values() if now - since >= SETTLES_S]
        self._standing = standing
        self._queue = sorted(stable, key=lambda one: -one.mtime_ns)  # the oldest is popped first

    def _take(self, one: Arrived) -> None:
        """Keep a record that stands still."""

        def taken() -> bool:
            number = self.kept.take(one)
            self._seen[one.path] = one
            self._of_file[one.path].add(number)
            self._standing.pop(one.path, None)
            job = self.kept.job(number)
            status = status_of(job)
            if status is not None and status["outcome"] == REPLACED:  # its content is back
                keep_status(job, _anew(status))
                self._ended.discard(number)
            if number not in self._ended and number not in self._mine:
                self._lock(job)
            return True

        self._with_patience("", taken)

    def _tend(self, number: str) -> bool:
        """Do the next step of a drop; whether it was the last."""
        job = self.kept.job(number)
        status = status_of(job)
        if status is None:
            return True  # removed on the page
        if status.get("done"):
            if not self._is_to_be_tried_again(job, status):
                return True
            status = _anew(status)
            keep_status(job, status)
        if not status["outcome"]:
            status = self._computed(job, status)
        if not status["outcome"]:
            return False
        return self._deliver(job, status)

    def _computed(self, job: Job, status: dict[str, Any]) -> dict[str, Any]:
        """What came of the computation of a drop, which is begun where it has not been."""
        verb: Verb | None = status.get("verb")
        state = None if verb is None else state_of(job, verb)
        if verb is None or state is None or state["run"] == status.get("counted"):
            return self._begun(job, status)
        if state["state"] in ("waiting", "running"):
            self._ask(job, status, state["options"])
            return status
        if state["state"] == "done" and (folder := result_folder(job, verb, "document.json")) is not None:
            status = status | _judged(verb, folder)
        else:
            status = status | _failed(job, status, state)
        keep_status(job, status)
        return status

    def _begun(self, job: Job, status: dict[str, Any]) -> dict[str, Any]:
        """Ask for the estimate of a drop whose machine is known, or for a look at it."""
        watched, why = self._fleet.of(*self._names(job, status))
        common = self._fleet.profile
        files = {"profile": common} if common is not None else {}
        content = job.read()
        for role in ("machine", "profile"):
            content["files"].pop(role, None)
        content["files"] |= put(job, files if watched is None else watched.files)
        job.write(content)
        verb: Verb = "look" if watched is None else "estimate"
        status = status | {"verb": verb, "serial": "" if watched is None else watched.serial, "why": why}
        keep_status(job, status)
        self._ask(job, status, {"quick": True} if self.quick and watched is not None else {})
        return status

    def _ask(self, job: Job, status: dict[str, Any], options: dict[str, Any]) -> None:
        """Ask for a computation that may wait; say it when an estimate runs, which takes its time."""
        state = self._runner.ask(job, status["verb"], options)
        if status["verb"] == "estimate" and state["state"] == "running" and job.number not in self._announced:
            self._announced.add(job.number)
            self.say(f"{job.read()['files']['record']['name']}: {status['serial']}, estimate begun")

    def _deliver(self, job: Job, status: dict[str, Any]) -> bool:
        """Quarantine, log and report a drop, each once, whatever was done before; whether that is done."""
        if status["outcome"] != REPLACED:
            for number in sorted(self._of_file[Path(status["source"])] - {job.number}):
                other = self.kept.job(number)
                if (of_other := status_of(other)) is None:
                    continue  # removed on the page
                if of_other["outcome"] != REPLACED and is_part(record_of(job), record_of(other)):
                    status = status | {"outcome": REPLACED, "why": CUT_SHORT}
                    break
                if is_part(record_of(other), record_of(job)) and not self._withdrawn(other, of_other):
                    return False
        watched = self._fleet.machines.get(status.get("serial", ""))
        if status["outcome"] == "quarantined":
            self.kept.quarantine(job, status["why"])
        if "logged" not in status:
            status["logged"] = None
            if status["outcome"] == "estimated":
                bearings = status["serial"] if watched is None else watched.bearings
                status["logged"] = self._logged(job, bearings)
            status["scalars"] = scalars_of(job, status, watched)
            _tell_page(job, status)
            keep_status(job, status)
        if self.hook is not None and status["outcome"] != REPLACED and not status.get("hooked"):
            run_hook(self.hook, status["scalars"])
            status["hooked"] = True
        keep_status(job, status | {"machines": self._machines, "done": True})
        self.say(line_of(status["scalars"], status["logged"]))
        return True

    def _withdrawn(self, cut: Job, status: dict[str, Any]) -> bool:
        """Take a drop back whose file grew: from the log, the quarantine and the hook; whether that is done.

        It is not while somebody works on it: then its file is found to have grown.
        """
        if status.get("withdrawn") or not status.get("done") or cut.number in self._mine:
            return bool(status.get("withdrawn"))
        self._lock(cut)
        if cut.number not in self._mine:
            return False
        try:
            status = status | {"outcome": REPLACED, "why": CUT_SHORT}
            status["scalars"] = scalars_of(cut, status, None)
            keep_status(cut, status)
            if status.get("logged") is not None:
                for number, drop in logged_drops(self.log).items():
                    if drop.sha256 == status["scalars"]["sha256"]:
                        remove_drop(self.log, number)
            if (place := self.kept.quarantined(cut)).is_dir():
                shutil.rmtree(place)
            if self.hook is not None and status.get("hooked"):
                run_hook(self.hook, status["scalars"])
            keep_status(cut, status | {"withdrawn": True})
            self.say(line_of(status["scalars"], None))
        finally:
            os.close(self._mine.pop(cut.number))
        self._news = True
        return True

    def _logged(self, job: Job, bearings: str) -> int:
        folder = result_folder(job, "estimate", "document.json")
        assert folder is not None
        drop = drop_of_estimate(read_drop(folder / "document.json"), bearings)
        try:
            return add_drop(self.log, drop)
        except LoggedAlreadyError as error:
            return error.number

    def _show(self) -> None:
        """Write the overview where something is new and the last one is long enough ago."""
        now = time.monotonic()
        if not self._news or now < self._next_overview:
            return
        self._news = False
        page = self.kept.path / "overview.html"
        self._with_patience(
            "overview", lambda: write_overview(self.kept, self._fleet, self.log, page) is None
        )
        ended = time.monotonic()
        self._next_overview = ended + max(self.every, (ended - now) / OVERVIEW_SHARE)


def _tell_page(job: Job, status: dict[str, Any]) -> None:
    """Keep with a drop why the result that was found needs a person, for the page to say it."""
    if (verb := VERBS.get(status["outcome"])) is not None:
        told = {"run": published_run(job, verb), "text": status["scalars"]["needs_person"]}
        job.write(job.read() | {"judged": told})


def _digest_of(files: set[Arrived]) -> str:
    """Digest of names, sizes and dates."""
    told = sorted((one.path.name, one.size, one.mtime_ns) for one in files)
    return hashlib.sha256(repr(told).encode()).hexdigest()


def _standing_in(folder: Path) -> set[Arrived]:
    """Files of a folder as they stand."""
    with suppress(OSError):
        return {one for path in folder.iterdir() if (one := Arrived.at(path)) is not None}
    return set()


def _anew(status: dict[str, Any]) -> dict[str, Any]:
    """Of a drop that is begun again only where it came from is known."""
    return {"outcome": "", **{key: status[key] for key in ("source", "size", "mtime_ns")}}


def _judged(verb: Verb, folder: Path) -> dict[str, Any]:
    """What a finished computation means: the outcome, with the reason."""
    if verb == "estimate":
        return {"outcome": "estimated"}
    findings = json.loads((folder / "document.json").read_bytes())["findings"]
    stops = [one for one in findings if one["severity"] == "stop"]
    if stops:
        worst = stops[0]
        where = f"{worst['channel']}: " if worst["channel"] else ""
        return {"outcome": "quarantined", "why": f"{where}{worst['message']}; {worst['remedy']}"}
    return {"outcome": "looked"}


def _failed(job: Job, status: dict[str, Any], state: dict[str, Any]) -> dict[str, Any]:
    """What a computation that failed means: no use, a person, or another try."""
    code, why = state.get("code"), state.get("error", "")
    if state["state"] == "cancelled":
        return {"outcome": "failed", "why": "the computation was cancelled on the page"}
    if code == RecordError.exit_code:
        return {"outcome": "quarantined", "why": why}
    crashes = status.get("crashes", 0) + (code is None)
    if code in (None, OutputError.exit_code) and crashes < CRASHES:
        keep_status(job, status | {"counted": state["run"], "crashes": crashes})
        raise OutputError(why)
    return {"outcome": "failed", "why": why}


def run_hook(command: str, scalars: dict[str, Any]) -> None:
    """Hand the numbers of a drop to a command, as JSON on its standard input.

    Raises
    ------
    OutputError
        If it cannot be run, fails, or takes too long; the record is reported again later.
    """
    try:
        ended = subprocess.run(
            shlex.split(command, posix=os.name == "posix"),
            input=(json.dumps(scalars, ensure_ascii=False) + "\n").encode(),
            capture_output=True,
            timeout=HOOK_S,
            check=False,
        )
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        raise OutputError(f"the hook {command!r} did not take {scalars['record']}: {error}") from error
    if ended.returncode != 0:
        said = ended.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise OutputError(
            f"the hook {command!r} did not take {scalars['record']}: exit code {ended.returncode}, {said}"
        )
