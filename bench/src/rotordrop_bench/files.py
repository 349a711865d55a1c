"""Write a synthetic drop: recording and tail for the estimator, the truth in a folder of its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from rotordrop.files import atomic_path, make_folder, write_json
from rotordrop.record.record import Record, sha256_of
from rotordrop.record.recording import recording_of
from rotordrop.record.writers import write_delimited, write_hdf5
from rotordrop_bench.recording import SyntheticDrop

Format = Literal["csv", "h5"]
TRUTH_FOLDER = "truth"


def write_synthetic(
    drop: SyntheticDrop,
    folder: str | Path,
    *,
    name: str | None = None,
    formats: Sequence[Format] = ("csv",),
    histories: bool = True,
) -> tuple[Path, ...]:
    """Write the files of a synthetic drop.

    Parameters
    ----------
    drop : SyntheticDrop
        What to write.
    folder : path-like
        Where to; it is made when it does not exist. The truth goes into its subfolder ``truth``.
    name : str, optional
        Stem of the files; the name of the drop by default.
    formats : sequence of {"csv", "h5"}
        Formats of the recording; the tail is always text.
    histories : bool
        Whether the true histories are written beside the truth.

    Returns
    -------
    tuple of Path
        The files, the recording first.
    """
    folder, stem = Path(folder), name or str(drop.truth["name"])
    make_folder(folder / TRUTH_FOLDER)
    paths = []
    for kind in formats:
        paths.append(folder / f"{stem}.{kind}")
        write_record(drop.record, paths[-1])
    if drop.tail is not None:
        paths.append(folder / f"{stem}_tail.csv")
        write_record(drop.tail, paths[-1])
    hashes = {f"{stem}.{kind}": sha256_of(folder / f"{stem}.{kind}") for kind in formats}
    paths.append(folder / TRUTH_FOLDER / f"{stem}.json")
    write_json(paths[-1], {**drop.truth, "name": stem, "record_sha256": hashes}, sealed=True)
    if histories:
        paths.append(folder / TRUTH_FOLDER / f"{stem}.npz")
        # forces and stresses in single precision, displacements in double, as in the supplied files
        precise = ("t0", "fs", "first_250ms_t0", "bearing_displacement", "sensor_plane_displacement")
        stored = {k: v if k in precise else v.astype(np.float32) for k, v in drop.histories.items()}
        with atomic_path(paths[-1]) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, **stored)  # type: ignore[arg-type]
    return tuple(paths)


def write_record(record: Record, path: Path) -> None:
    """Write a record, as HDF5 where the file ends so, else as text."""
    recording = recording_of(
        record.time,
        record.signals,
        record.channel_names,
        speed_time=record.speed_time,
        speed=record.speed_readings,
        metadata=record.metadata,
    )
    if path.suffix == ".h5":
        write_hdf5(recording, path)
    else:
        write_delimited(recording, path)
