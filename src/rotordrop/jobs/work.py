"""What is computed of a drop, by the functions of the commands, from the files of a job."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import parse_toml
from rotordrop.errors import MachineFileError, RotordropError, UnmatchedError, UsageError
from rotordrop.files import write_json
from rotordrop.jobs.results import SYSTEMS, write_check, write_estimate, write_look, write_waterfall
from rotordrop.jobs.runner import Verb
from rotordrop.jobs.workspace import Job, is_path
from rotordrop.machine import load_machine
from rotordrop.machine.machine import Machine
from rotordrop.progress import Progress
from rotordrop.record.profile import Profile, SpeedSource, load_profile
from rotordrop.record.record import Record, read_record
from rotordrop.report.quantity import Quantity
from rotordrop.units import parse_quantity

TRACE_POINTS = 80
"""Points of the small trace of a channel; chosen, not measured."""


def machine_of(job: Job) -> Machine:
    """Read the machine file of a job."""
    file = job.file("machine")
    if file is None:
        raise UsageError("this needs the machine file; drop it on the page beside the record")
    for role in job.beside():
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
    file = job.file("profile")
    rules = Profile() if file is None else load_profile(file)
    if options.get("speed"):
        turning = parse_quantity(options["speed"], "speed")
        rules = rules.model_copy(update={"speed": SpeedSource(constant=f"{turning!r} rad/s")})
    return rules


def record_file(job: Job) -> Path:
    """Where the record of a job lies."""
    file = job.file("record")
    if file is None:
        raise UsageError("no record was sent; drop one on the page")
    return file


def record_of(job: Job, machine: Machine, options: dict[str, Any]) -> Record:
    """Read the record of a job."""
    return named(read_record(record_file(job), machine, profile=profile_of(job, options)), job, "record")


def named(record: Record, job: Job, role: str) -> Record:
    """A record under the name that its file has for the user."""
    return replace(record, path=Path(job.read()["files"][role]["name"]))


def _trace(values: Array) -> list[float | None]:
    """A channel in few points as shares of its range; None where a sample is missing."""
    if not np.isfinite(values).any():
        return []
    few = values[np.linspace(0, len(values) - 1, min(len(values), TRACE_POINTS)).astype(int)]
    low, span = float(np.nanmin(values)), float(np.nanmax(values) - np.nanmin(values)) or 1.0
    return [None if np.isnan(value) else round((value - low) / span, 3) for value in few.tolist()]


def _range(values: Array, unit: str) -> dict[str, str]:
    """The least and the largest reading of a channel, a length as the page shows lengths."""
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


def _channels(job: Job, made: Path, options: dict[str, Any], progress: Progress) -> None:
    """What a recording holds, which sensors look for a channel, and what could be guessed."""
    from rotordrop.evidence.unsaid import guess_profile
    from rotordrop.record.columns import RULE
    from rotordrop.record.readers import read_recording

    sensors = machine_of(job).sensors if job.file("machine") else ()
    given = profile_of(job, options)
    recording = read_recording(record_file(job), given)
    guess = guess_profile(recording, given, sensors)
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
    looking = [
        {"name": sensor.name, "plane": sensor.bearing or f"node {sensor.node}", "angle": float(sensor.angle)}
        for sensor in sensors
    ]
    write_json(
        made / "page.json",
        {
            "channels": found,
            "sensors": looking,
            "profile": guess.profile.model_dump(exclude_defaults=True, exclude_none=True),
            "missing": list(guess.missing),
            "likely": dict(guess.likely),
            "likely_by": RULE if sensors else "channels in their order, two of each plane",
        },
    )


def _look(job: Job, made: Path, options: dict[str, Any], progress: Progress) -> None:
    from rotordrop.evidence.look import look

    gap = options.get("gap")
    machine = machine_of(job) if job.file("machine") else None
    seen = look(
        record_file(job),
        machine=machine,
        gap=parse_quantity(gap, "length") if gap else None,
        mapping=tuple(filter(None, map(str.strip, options.get("planes", "").split(";")))),
        profile=profile_of(job, options),
    )
    if not seen.motion.paths:  # the page asks which channels make a plane
        raise UnmatchedError(seen.no_fall, "say which channels look at one plane")
    answered = ("record ends before standstill",) if "tail" in job.read()["files"] else ()
    seen = replace(
        seen,
        record=named(seen.record, job, "record"),
        findings=tuple(one for one in seen.findings if one.kind not in answered),
    )
    write_look(seen, machine, job, made, options)


def _estimate(job: Job, made: Path, options: dict[str, Any], progress: Progress) -> None:
    from rotordrop.estimation import Replay, Tracked, estimate_drop
    from rotordrop.twin.search import is_calibrated

    progress("reading machine and record", 0.0)
    machine = machine_of(job)
    record, tail, file = record_of(job, machine, options), None, job.file("tail")
    if file is not None:
        tail = named(read_record(file, machine, profile=profile_of(job, options), tail=True), job, "tail")
    method = (
        Replay()
        if options.get("method") == "replay"
        else Tracked(quick=bool(options.get("quick")) and is_calibrated(machine))
    )
    name = job.read()["name"]
    estimate = estimate_drop(machine, record, tail, method=method, name=name, progress=progress)
    progress("drawing", 1.0)
    write_estimate(estimate, job, made, options)


def _waterfall(job: Job, made: Path, options: dict[str, Any], progress: Progress) -> None:
    from rotordrop.estimate.coast_down import waterfall

    progress("reading machine and record", 0.0)
    machine = machine_of(job)
    record = record_of(job, machine, options)
    found = waterfall(machine, record, progress=progress)
    progress("drawing", 1.0)
    write_waterfall(found, machine, record, job, made, options)


def _check(job: Job, made: Path, options: dict[str, Any], progress: Progress) -> None:
    write_check(machine_of(job), job, made, options)


WORK: dict[Verb, Callable[[Job, Path, dict[str, Any], Progress], None]] = {
    "channels": _channels,
    "look": _look,
    "estimate": _estimate,
    "waterfall": _waterfall,
    "check": _check,
}
"""By verb: write what was found of a job into a folder, with options, saying what is being done."""
