"""A record for others: the samples, and nothing that says whose machine it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.document import parse_toml
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import UsageError
from rotordrop.files import digest_of_file, require_place, write_text
from rotordrop.machine import Machine
from rotordrop.machine.saving import machine_text, save_machine
from rotordrop.record.profile import Profile
from rotordrop.record.record import BY_HAND, SPEED_SOURCE, open_record
from rotordrop.record.recording import called, recording_of
from rotordrop.record.writers import write_hdf5

LICENCES = ("CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0")
"""Licences for data, by their SPDX names, under which a record may be shared."""
LONGEST_CLOCK = 86_400.0
"""Times beyond a day [s] are a date, which says when a machine tripped; they then count from the first."""
TELLING = ("source", "notes", "part", "calibration")
"""Entries of a machine file that people write for people."""


@dataclass(frozen=True, kw_only=True)
class SharedRecord:
    """What was written for others, and what was not."""

    files: Mapping[Path, str]
    """The files and their SHA-256."""
    channels: Mapping[str, str]
    """Old names of the channels by their new ones."""
    left_out: tuple[str, ...]
    """What the record holds and the shared one does not."""


def share_record(
    path: Path,
    output: Path,
    licence: str,
    *,
    machine: Machine | None = None,
    channels: Sequence[str] = (),
    profile: Profile | None = None,
) -> SharedRecord:
    """Write a record without names, header and paths, as HDF5, with its checksum beside it.

    Parameters
    ----------
    path, output : Path
        The record, and the file to write, ``.h5``.
    licence : str
        One of `LICENCES`.
    machine : Machine, optional
        The machine, written beside the record without names, sources and remarks.
    channels : sequence of str
        Displacement channels to share, by the names of the sensors or of the record; all when left out.
    profile : Profile, optional
        Channel map and reading rules.
    """
    if licence not in LICENCES:
        raise UsageError(f"the licence is {licence!r}; choose one of {', '.join(LICENCES)}")
    if output.suffix != ".h5":
        raise UsageError(
            f"a shared record is HDF5; name it {output.with_suffix('.h5').name}, not {output.name}"
        )
    record, _ = open_record(path, machine, profile=profile or Profile())
    absent = [name for name in channels if name not in record.channel_names]
    if absent:
        raise UsageError(f"{path} has no channel {absent[0]!r}; it has {', '.join(record.channel_names)}")
    names = _plain_names(record.sensors)
    kept = [i for i, name in enumerate(record.channel_names) if not channels or name in channels]
    shared = record.of_channels(kept)
    time, turned = shared.time, shared.speed_time
    if abs(float(time[0])) > LONGEST_CLOCK:
        time, turned = time - time[0], None if turned is None else turned - shared.time[0]
    metadata = {"licence": licence, "shared_by": "rotordrop look --share"}
    if record.is_simulated:
        metadata["origin"] = "simulated"
    if record.speed_by_hand:
        metadata[SPEED_SOURCE] = BY_HAND
    recording = recording_of(
        time,
        shared.signals,
        [names[name] for name in shared.channel_names],
        speed_time=turned,
        speed=shared.speed_readings,
        marks=None if shared.marks is None else shared.marks - (shared.time[0] - time[0]),
        metadata=metadata,
    )
    *files, sums = shared_files(output, with_machine=machine is not None)
    for place in (*files, sums):
        require_place(place)
    described = None if machine is None else nameless(machine, names, shared.channel_names)
    write_hdf5(recording, output)
    if described is not None:
        save_machine(described, files[1])
    digests = {file: digest_of_file(file) for file in files}
    write_text(sums, "".join(f"{digest}  {file.name}\n" for file, digest in digests.items()))
    dropped = [name for i, name in enumerate(record.channel_names) if i not in kept]
    return SharedRecord(
        files=digests,
        channels={names[name]: name for name in shared.channel_names},
        left_out=(
            *(called("channel", name) for name in dropped),
            *(f"entry {key}" for key in record.metadata),
            path.name,
        ),
    )


def shared_files(output: Path, *, with_machine: bool) -> tuple[Path, ...]:
    """The files that are written: record, machine if there is one, checksums."""
    machine = (output.with_suffix(".toml"),) if with_machine else ()
    return (output, *machine, output.with_name(f"{output.name}.sha256"))


def _plain_names(sensors: Sequence[Sensor]) -> dict[str, str]:
    """Names that say plane and direction only, X1, Y1, X2, …, by the names of the sensors."""
    planes = sorted({sensor.node for sensor in sensors})
    names = {}
    for number, node in enumerate(planes, start=1):
        inside = [sensor.name for sensor in sensors if sensor.node == node]
        for k, name in enumerate(inside):
            names[name] = f"{'XYZUVW'[k % 6]}{number}{'' if k < 6 else f'_{k // 6}'}"
    return names


def nameless(machine: Machine, sensors: Mapping[str, str], shared: Sequence[str]) -> Machine:
    """The machine without names, sources and remarks; sensors whose names are not among the shared ones count
    as lost.

    The new names of its sensors come by their old ones.
    """
    raw = _untold(parse_toml(machine_text(machine)))
    raw["name"] = "shared machine"
    bearings = {one["name"]: f"B{k}" for k, one in enumerate(raw["touchdown_bearings"], start=1)}
    for one in raw["touchdown_bearings"]:
        one["name"] = bearings[one["name"]]
    for k, one in enumerate(raw.get("ambs", ()), start=1):
        one["name"] = f"A{k}"
    for one in raw.get("sensors", ()):
        if one["name"] not in shared:
            one["lost"] = True
        one["name"] = sensors[one["name"]]
        if "bearing" in one:
            one["bearing"] = bearings[one["bearing"]]
    for one in raw["rotor"].get("discs", ()):
        one.pop("name", None)
    return Machine.model_validate(raw)


def _untold(value: Any) -> Any:
    """A table of a machine file without what people wrote for people, in every table below too."""
    if isinstance(value, dict):
        return {key: _untold(item) for key, item in value.items() if key not in TELLING}
    return [_untold(item) for item in value] if isinstance(value, list) else value
