"""The child process of the page: sets its own limits, reads the files of a job, computes.

It writes what it is at into the state file and what it found into a folder that appears whole; it answers to
nobody, so that neither page nor server has to be there when it ends.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotordrop.child import limit
from rotordrop.document import parse_toml
from rotordrop.errors import (
    DamagedFileError,
    MachineFileError,
    OutputError,
    RotordropError,
    UnmatchedError,
    UsageError,
)
from rotordrop.files import write_json
from rotordrop.web.running import (
    OF_MACHINE,
    Verb,
    clear,
    process_file,
    publish,
    result_folder,
    state_of,
    write_state,
)
from rotordrop.web.workspace import Job, Workspace, beside, is_path

if TYPE_CHECKING:
    from rotordrop.arrays import Array
    from rotordrop.estimate.published import Drop
    from rotordrop.machine import Machine
    from rotordrop.record.profile import Profile
    from rotordrop.record.record import Record

MEMORY: dict[str, int] = {
    "channels": 2 * 2**30,
    "look": 2 * 2**30,
    "estimate": 8 * 2**30,
    "waterfall": 8 * 2**30,
    **dict.fromkeys(OF_MACHINE, 8 * 2**30),
}
MEMORY_PER_BYTE = 40
"""Memory a computation may take beside that, for each byte of its files [1]; chosen, not measured."""
CPU_S: dict[str, int] = {"channels": 300, "look": 300, "estimate": 4 * 3600, "waterfall": 4 * 3600}
CPU_S |= dict.fromkeys(OF_MACHINE, 4 * 3600)
TRACE_POINTS = 80
"""Points of the small trace of a channel; chosen, not measured."""
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
        limit(MEMORY[verb] + MEMORY_PER_BYTE * size, CPU_S[verb])
        of = job.digests()
        made = job.path / f"{verb}.part-{told['run']}"
        made.mkdir()
        _WORK[verb](job, made, told)
        publish(job, verb, told["run"], made, of)
        ended = {"state": "done", "fraction": 1.0, "stage": ""}
    except RotordropError as error:
        said = (
            f"{error.seen}; say which channel is which" if isinstance(error, UnmatchedError) else str(error)
        )
        ended = {"state": "failed", "error": _without_folder(said, job), "code": error.exit_code}
    except MemoryError:
        ended = {
            "state": "failed",
            "error": "there is not enough memory for this; cut the record to the drop",
        }
    except OSError as error:
        wrong = f"cannot write the result: {error.strerror or error}; make room on the disk"
        ended = {"state": "failed", "error": wrong, "code": OutputError.exit_code}
    except Exception as error:  # noqa: BLE001 - whatever it is, the page must say that it happened
        wrong = f"this should not happen: {type(error).__name__}: {error}"
        ended = {"state": "failed", "error": wrong, "code": RotordropError.exit_code}
    clear(job, verb)
    write_state(job, verb, {**(state_of(job, verb) or told), **ended, "ended": time.time()})


def _without_folder(message: str, job: Job) -> str:
    """A message that names files as the user does, not where the page keeps them."""
    with suppress(RotordropError):  # one that is damaged itself has no names
        files = sorted(job.read()["files"].values(), key=lambda entry: -len(entry["stored"]))
        for entry in files:  # the longest first: record.csv is part of record.csv.gz
            message = message.replace(str(job.path / "files" / entry["stored"]), entry["name"])
    return message.replace(f"{job.path}/", "")


def machine_of(job: Job) -> Machine | None:
    """Read the machine file of a job; None where none was sent."""
    from rotordrop.machine import load_machine

    file = job.file("machine")
    if file is None:
        return None
    for role in beside(job):
        job.file(role)  # refuses what has changed on the disk
    with suppress(ValueError, OSError):  # whoever reads it properly says what is wrong with it
        rotor = parse_toml(file.read_text(encoding="utf-8-sig")).get("rotor")
        table = rotor.get("shaft_table") if isinstance(rotor, dict) else None
        if isinstance(table, str) and (is_path(table) or not (file.parent / table).is_file()):
            raise MachineFileError(
                f"the machine file needs the shaft table {table!r}; drop that file alone on the page, under "
                "this plain name",
                file=file,
            )
    machine = load_machine(file)
    machine._source_path = Path(job.read()["files"]["machine"]["name"])
    return machine


def profile_of(job: Job, options: dict[str, Any]) -> Profile:
    """Reading rules of a job: of the profile that was sent, and the speed where it was given by hand."""
    from rotordrop.record.profile import Profile, SpeedSource, load_profile
    from rotordrop.units import parse_quantity

    file = job.file("profile")
    rules = Profile() if file is None else load_profile(file)
    if options.get("speed"):
        turning = parse_quantity(options["speed"], "speed")
        rules = rules.model_copy(update={"speed": SpeedSource(constant=f"{turning!r} rad/s")})
    return rules


def record_of(job: Job, machine: Machine, role: str, options: dict[str, Any]) -> Record | None:
    """Read the record or the tail of a job; None where none was sent."""
    from rotordrop.record.record import read_record

    file = job.file(role)
    if file is None:
        return None
    record = read_record(file, machine, profile=profile_of(job, options), tail=role == "tail")
    return named(record, job, role)


def named(record: Record, job: Job, role: str) -> Record:
    """A record under the name that its file has for the user."""
    return replace(record, path=Path(job.read()["files"][role]["name"]))


def _record_file(job: Job) -> Path:
    file = job.file("record")
    if file is None:
        raise UsageError("no record was sent; drop one on the page")
    return file


def _trace(values: Array) -> list[float | None]:
    """A channel in few points as shares of its range; None where a sample is missing."""
    import numpy as np

    if not np.isfinite(values).any():
        return []
    few = values[np.linspace(0, len(values) - 1, min(len(values), TRACE_POINTS)).astype(int)]
    low, span = float(np.nanmin(values)), float(np.nanmax(values) - np.nanmin(values)) or 1.0
    return [None if np.isnan(value) else round((value - low) / span, 3) for value in few.tolist()]


def _range(values: Array, unit: str) -> dict[str, str]:
    """The least and the largest reading of a channel, a length as the page shows lengths."""
    import numpy as np

    from rotordrop.report.quantity import Quantity
    from rotordrop.units import parse_quantity
    from rotordrop.web.rows import SYSTEMS

    if not np.isfinite(values).any():
        return dict.fromkeys(SYSTEMS, "empty")
    ends = float(np.nanmin(values)), float(np.nanmax(values))
    try:
        low, high = (end * parse_quantity(f"1 {unit}", "length") for end in ends)
    except RotordropError:
        numbers = " to ".join(f"{end:.3g}" for end in ends).replace("-", "−")
        return dict.fromkeys(SYSTEMS, f"{numbers} {unit or 'without a unit'}")
    both = Quantity(value=high, kind="length", interval_90=(low, high))
    return {system: replace(both, system=system).interval_text for system in SYSTEMS}


def _channels(job: Job, made: Path, told: dict[str, Any]) -> None:
    """What a recording holds, which sensors look for a channel, and what could be guessed."""
    from rotordrop.record.columns import RULE, guess_profile
    from rotordrop.record.readers import read_recording

    machine, given = machine_of(job), profile_of(job, told["options"])
    recording = read_recording(_record_file(job), given)
    guess = guess_profile(recording, given, () if machine is None else machine.sensors)
    units = [given.units.get(one.label) or one.unit or given.unit or "" for one in recording.channels]
    found = [
        {
            "label": channel.label,
            "unit": unit,
            "range": _range(channel.values, unit),
            "trace": _trace(channel.values),
        }
        for channel, unit in zip(recording.channels, units, strict=True)
    ]
    sensors = [
        {"name": sensor.name, "plane": sensor.bearing or f"node {sensor.node}", "angle": float(sensor.angle)}
        for sensor in (() if machine is None else machine.sensors)
    ]
    write_json(
        made / "page.json",
        {
            "channels": found,
            "sensors": sensors,
            "profile": guess.profile.model_dump(exclude_defaults=True, exclude_none=True),
            "missing": list(guess.missing),
            "likely": dict(guess.likely),
            "likely_by": RULE if sensors else "channels in their order, two of each plane",
        },
    )


def _look(job: Job, made: Path, told: dict[str, Any]) -> None:
    from rotordrop.evidence.look import look
    from rotordrop.evidence.quality import Kind
    from rotordrop.units import parse_quantity
    from rotordrop.web.drawn import write_look

    options = told["options"]
    gap = options.get("gap")
    machine = machine_of(job)
    seen = look(
        _record_file(job),
        machine=machine,
        gap=parse_quantity(gap, "length") if gap else None,
        mapping=tuple(filter(None, map(str.strip, options.get("planes", "").split(";")))),
        profile=profile_of(job, options),
    )
    if not seen.motion.paths:  # the page asks which channels make a plane
        raise UnmatchedError(seen.no_fall, "say which channels look at one plane")
    answered = (Kind.ENDS_TURNING,) if "tail" in job.read()["files"] else ()
    seen = replace(
        seen,
        record=named(seen.record, job, "record"),
        findings=tuple(one for one in seen.findings if one.kind not in answered),
    )
    write_look(seen, job, made, options, machine)


class Pace:
    """How long a computation still takes by what it has done since its first step, which loads and compiles.

    The time left falls or stays. A fit that begins again has a pace anew.
    """

    def __init__(self) -> None:
        self._steps: list[tuple[float, float]] = []
        self._left: float | None = None

    def left(self, spent: float, fraction: float) -> float | None:
        """Time left [s] after so much time with such a fraction done; None before two steps are done."""
        if self._steps and fraction < self._steps[-1][1]:
            self._steps, self._left = [], None
        if not self._steps or fraction > self._steps[-1][1]:
            self._steps.append((spent, fraction))
            if len(self._steps) >= 3:
                began, first = self._steps[1]
                expected = (spent - began) * (1.0 - fraction) / (fraction - first)
                self._left = expected if self._left is None else min(expected, self._left)
        return self._left


def _told_progress(job: Job, verb: Verb, told: dict[str, Any]) -> Callable[[str, float], None]:
    """A function that keeps stage, share and time left in the state file, now and then."""
    running, last = state_of(job, verb) or told, 0.0
    pace = Pace()

    def progress(stage: str, fraction: float) -> None:
        nonlocal last
        now = time.monotonic()
        left = pace.left(now, fraction)
        if now - last >= BETWEEN_WORDS_S:
            last = now
            until = None if left is None else time.time() + left
            told = {**running, "stage": stage, "fraction": round(fraction, 4), "until": until}
            write_state(job, verb, told)

    return progress


def _machine_and_record(job: Job, options: dict[str, Any]) -> tuple[Machine, Record]:
    machine = machine_of(job)
    if machine is None:
        raise UsageError("this needs the machine file; drop it on the page beside the record")
    record = record_of(job, machine, "record", options)
    if record is None:
        raise UsageError("no record was sent; drop one on the page")
    return machine, record


def _estimate(job: Job, made: Path, told: dict[str, Any]) -> None:
    from rotordrop.estimation import Replay, Tracked, estimate_drop
    from rotordrop.twin.search import is_calibrated
    from rotordrop.web.drawn import write_estimate

    progress = _told_progress(job, "estimate", told)
    progress("reading machine and record", 0.0)
    options = told["options"]
    machine, record = _machine_and_record(job, options)
    tail = record_of(job, machine, "tail", options)
    method = (
        Replay()
        if options.get("method") == "replay"
        else Tracked(quick=bool(options.get("quick")) and is_calibrated(machine))
    )
    name = job.read()["name"]
    estimate = estimate_drop(machine, record, tail, method=method, name=name, progress=progress)
    progress("drawing", 1.0)
    write_estimate(estimate, job, made, options, _since(job))


def _since(job: Job) -> Drop | None:
    """The estimate of the last drop that came before with the same machine file."""
    from rotordrop.estimate.published import read_drop

    told = job.read()
    machine = told["files"]["machine"]["sha256"]
    for other in Workspace(job.path.parent.parent).jobs():  # the newest first
        with suppress(UsageError, DamagedFileError, FileNotFoundError):  # whoever opens that drop is told
            known = other.read()
            same = known["files"].get("machine", {}).get("sha256") == machine
            if same and known["created"] < told["created"]:
                folder = result_folder(other, "estimate", "document.json")
                if folder is not None:
                    return read_drop(folder / "document.json")
    return None


def _waterfall(job: Job, made: Path, told: dict[str, Any]) -> None:
    from rotordrop.estimate.recorded_coast_down import recorded_coast_down, with_found_air_gaps
    from rotordrop.spectrum.coast_down import analyse_coast_down
    from rotordrop.spectrum.machine_candidates import machine_candidates
    from rotordrop.web.drawn import write_waterfall

    progress = _told_progress(job, "waterfall", told)
    progress("reading machine and record", 0.0)
    machine, record = _machine_and_record(job, told["options"])
    signal = recorded_coast_down(machine, record)
    planes = {name: name for name in signal.planes}
    candidates = machine_candidates(with_found_air_gaps(machine, signal), planes)
    found = analyse_coast_down(signal, candidates, progress=progress)
    progress("drawing", 1.0)
    write_waterfall(found, machine, record, job, made, told["options"])


def _of_machine(verb: Verb, job: Job, made: Path, told: dict[str, Any]) -> None:
    from rotordrop.web.machine_pages import write_machine_page

    write_machine_page(job, verb, made, told, MEMORY[verb], CPU_S[verb])


_WORK = {"channels": _channels, "look": _look, "estimate": _estimate, "waterfall": _waterfall}
_WORK |= {verb: partial(_of_machine, verb) for verb in OF_MACHINE}
