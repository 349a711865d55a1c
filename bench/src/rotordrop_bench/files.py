"""Write a synthetic drop: machine file, recording and tail for the estimator, the truth in a folder apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.files import digest_of_file, make_folder, write_json, write_text
from rotordrop.machine import Machine
from rotordrop.machine.saving import save_machine
from rotordrop.record.record import Record, as_recording
from rotordrop_bench.recording import SyntheticDrop


def drop_path(folder: Path, name: str) -> Path:
    """Where an estimator finds a drop."""
    return folder / "drops" / name


def truth_path(folder: Path, name: str) -> Path:
    """Where the truth of a drop stands."""
    return folder / "truth" / f"{name}.json"


def write_drop(drop: SyntheticDrop, known: Machine, folder: str | Path, name: str, **more: Any) -> Path:
    """Write a drop into a folder, its truth last, and give the folder for an estimator.

    That is ``drops/NAME`` with ``machine.toml``, ``record.csv`` and ``tail.csv``; ``truth/NAME.json`` gets
    ``more`` too.
    """
    place, truth = drop_path(Path(folder), name), truth_path(Path(folder), name)
    make_folder(place)
    make_folder(truth.parent)
    save_machine(known, place / "machine.toml")
    write_record(drop.record, place / "record.csv")
    if drop.tail is not None:
        write_record(drop.tail, place / "tail.csv")
    sums = {"record.csv": digest_of_file(place / "record.csv")}
    write_json(truth, {**drop.truth, **more, "name": name, "record_sha256": sums}, sealed=True)
    return place


def write_record(record: Record, path: Path) -> None:
    """Write a record as text, displacements in micrometres; a speed that is read less often is held."""
    recording = as_recording(replace(record, marks=None, notes=(), warnings=()))
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
