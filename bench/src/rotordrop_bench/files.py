"""Write a synthetic drop: recording and tail for the estimator, the truth in a folder of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rotordrop.files import digest_of_file, make_folder, write_json, write_text
from rotordrop.machine import Machine
from rotordrop.machine.saving import save_machine
from rotordrop.record.record import Record, as_recording, write_hdf5
from rotordrop.record.recording import Recording
from rotordrop_bench.recording import SyntheticDrop

Format = Literal["csv", "h5"]
TRUTH_FOLDER = "truth"


def write_synthetic(
    drop: SyntheticDrop,
    folder: str | Path,
    *,
    name: str | None = None,
    formats: Sequence[Format] = ("csv",),
) -> tuple[Path, ...]:
    """Write the files of a synthetic drop into a folder, and give them, the recording first.

    The truth goes into a subfolder of its own; the tail is always text. The stem of the files is the name of
    the drop by default.
    """
    folder, stem = Path(folder), name or str(drop.truth["name"])
    make_folder(folder / TRUTH_FOLDER)
    paths = [folder / f"{stem}.{kind}" for kind in formats]
    for path in paths:
        write_record(drop.record, path)
    hashes = {path.name: digest_of_file(path) for path in paths}
    if drop.tail is not None:
        paths.append(folder / f"{stem}_tail.csv")
        write_record(drop.tail, paths[-1])
    paths.append(folder / TRUTH_FOLDER / f"{stem}.json")
    write_json(paths[-1], {**drop.truth, "name": stem, "record_sha256": hashes}, sealed=True)
    return tuple(paths)


def write_drop(drop: SyntheticDrop, known: Machine, place: Path, truth: Path, **more: Any) -> None:
    """Write ``machine.toml``, ``record.csv`` and ``tail.csv`` of a drop into a folder, then its truth.

    A drop whose truth is there is complete.
    """
    make_folder(place)
    make_folder(truth.parent)
    save_machine(known, place / "machine.toml")
    write_record(drop.record, place / "record.csv")
    if drop.tail is not None:
        write_record(drop.tail, place / "tail.csv")
    sums = {"record.csv": digest_of_file(place / "record.csv")}
    write_json(truth, {**drop.truth, **more, "record_sha256": sums}, sealed=True)


def write_record(record: Record, path: Path) -> None:
    """Write a record, as HDF5 where the file ends so, else as text."""
    recording = as_recording(replace(record, marks=None, notes=(), warnings=()))
    (write_hdf5 if path.suffix == ".h5" else write_delimited)(recording, path)


def write_delimited(recording: Recording, path: Path) -> None:
    """Write a recording as text, displacements in micrometres; a speed that is read less often is held."""
    clock = recording.channels[0].time
    step = float(np.median(np.diff(clock)))
    # two digits beyond the step, so that the even clock is found again on reading
    names, columns, formats = ["Time [s]"], [clock], [f"%.{max(int(np.ceil(-np.log10(step))) + 2, 3)}f"]
    for channel in recording.channels:
        length = channel.unit == "m"
        held = np.clip(np.searchsorted(channel.time, clock, side="right") - 1, 0, len(channel.time) - 1)
        names.append(f"{channel.name} [{'um' if length else channel.unit}]")
        columns.append(channel.values[held] * (1e6 if length else 1.0))
        formats.append("%.3f" if length else "%.4f")
    lines = [";".join(formats) % tuple(row) for row in np.column_stack(columns)]
    header = [f"# {key}: {value}" for key, value in recording.metadata.items()]
    write_text(path, "\n".join([*header, ";".join(names), *lines]) + "\n")
