"""A coast-down on disk: parts and a checkpoint while it runs, one HDF5 file when it has ended.

Beside the output ``coast.h5`` a folder ``coast.h5.partial`` holds one file per window of time and one
checkpoint. Every file in it appears complete or not at all, and the checkpoint is written after the window it
stands for; what a kill leaves behind is at worst a window that the checkpoint does not know, and it is
computed again. The output itself appears only when the run has ended.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.arrays import Array
from rotordrop.errors import OutputError, SimulationError
from rotordrop.files import new_hdf5, read_hdf5, require_file
from rotordrop.labelled import read, write
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.coast_down_result import CoastDownResult
from rotordrop.simulate.result import HISTORIES, fingerprint, opened

Arrays = dict[str, NDArray[np.float64]]

_CHECKPOINT = "checkpoint.h5"


def work_folder(output: Path) -> Path:
    """Folder beside an output file in which its unfinished parts lie."""
    return output.with_name(output.name + ".partial")


def part_path(folder: Path, number: int) -> Path:
    """File of one window of time, numbered from 0."""
    return folder / f"part-{number:06d}.h5"


def run_digest(model: DropModel, settings: str) -> str:
    """Fingerprint of everything a run depends on: every number of the model, the settings, the version."""
    digest = hashlib.sha256(f"{__version__}\n{settings}\n{model.bearing_names}".encode())
    for array in model.parameters:
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(model.basis.shapes.tobytes())
    return digest.hexdigest()


def open_work_folder(output: Path, *, resume: bool) -> Path:
    """Make the folder for the parts of an output, or find the one to resume.

    A folder left behind by a killed run is neither overwritten nor resumed unless that was asked for.
    """
    folder = work_folder(output)
    if not output.parent.is_dir():
        raise OutputError(
            f"cannot write {output}: the folder {output.parent} does not exist; create it first"
        )
    if resume and not folder.is_dir():
        raise OutputError(
            f"there is nothing to resume: {folder} does not exist. Leave out --resume to start the run."
        )
    if not resume and folder.exists():
        raise OutputError(
            f"{folder} holds an unfinished run; add --resume to go on with it, or remove the folder"
        )
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot make the folder {folder}: {error.strerror}; name another output"
        ) from error
    return folder


def save_checkpoint(folder: Path, digest: str, arrays: Mapping[str, NDArray[np.float64]]) -> None:
    """Write where the run stands; the checkpoint before it stays until the new one is complete."""
    with new_hdf5(folder / _CHECKPOINT) as file:
        file.attrs["run"] = digest
        for name, array in arrays.items():
            file.create_dataset(name, data=array)


def load_checkpoint(folder: Path, digest: str) -> Arrays | None:
    """Read where a run stands; None when it was killed before its first checkpoint.

    A checkpoint of another machine, other settings or another version is refused.
    """
    path, remedy = folder / _CHECKPOINT, f"remove {folder} and start the run again"
    require_file(path, remedy)
    if not path.exists():
        return None
    try:
        with read_hdf5(path, remedy) as file:
            found, arrays = str(file.attrs["run"]), {name: np.array(file[name]) for name in file}
    except (OSError, KeyError) as error:
        raise SimulationError(f"{path} cannot be read ({error}); {remedy}") from error
    if found != digest:
        raise SimulationError(
            f"{folder} belongs to another run (fingerprint {found[:8]}, this one has {digest[:8]}): machine, "
            "speed, settings or version differ. Resume with the same ones, or remove the folder."
        )
    return arrays


def remove_work_folder(folder: Path) -> None:
    """Remove the parts once the output stands."""
    shutil.rmtree(folder, ignore_errors=True)


FORMAT = "rotordrop coast-down 1"
SAMPLES = {name: (said.unit, said.label) for name, said in HISTORIES.items()} | {
    "sensor_displacement": ("m", "rotor at the sensor planes, (x, y)"),
    "bearing_force": ("N", "magnitude of the ball force on the race"),
}
"""Unit and label; single precision but for the speed, whose integral is the rotor angle."""
CONTACT_LOG = "contact_log"
_FILE = FORMAT, "coast-down", "coast-down"


def write_part(path: Path, samples: Mapping[str, NDArray[Any]], contact_log: Array) -> None:
    """Write the samples and the ended contacts of one window, complete or not at all."""
    require_file(path, f"remove {path.parent} and start the run again")
    with new_hdf5(path) as file:
        for name, values in samples.items():
            file.create_dataset(name, data=values)
        file.create_dataset(CONTACT_LOG, data=contact_log)


def write_coast_down(result: CoastDownResult, digest: str, folder: Path, parts: int, output: Path) -> None:
    """Join the parts of a run to one file with its statistics; the file appears complete or not at all."""
    with new_hdf5(output) as file:
        file.attrs["format"] = FORMAT
        file.attrs["run"] = digest
        file.attrs["fingerprint"] = fingerprint()
        write(result, file)
        file.attrs["standstill_time"] = np.nan if result.standstill_time is None else result.standstill_time
        _join(file, [part_path(folder, number) for number in range(parts)])
        count = file["speed"].shape[0]
        file.create_dataset("time", data=np.arange(count) * result.output_step)
        file["time"].attrs["units"] = "s"


def _join(file: Any, parts: list[Path]) -> None:
    remedy = f"remove {parts[0].parent} and start the run again" if parts else ""
    lengths: dict[str, int] = {}
    for path in parts:
        with read_hdf5(path, remedy) as part:
            for name in part:
                lengths[name] = lengths.get(name, 0) + part[name].shape[0]
    filled = dict.fromkeys(lengths, 0)
    for path in parts:
        with read_hdf5(path, remedy) as part:
            for name in part:
                if name not in file:
                    shape = (lengths[name], *part[name].shape[1:])
                    file.create_dataset(name, shape=shape, dtype=part[name].dtype)
                    unit, words = SAMPLES.get(name, ("", "contacts, columns as in the contact log"))
                    file[name].attrs["units"], file[name].attrs["long_name"] = unit, words
                count = part[name].shape[0]
                file[name][filled[name] : filled[name] + count] = part[name][()]
                filled[name] += count


def load_coast_down(path: str | Path) -> CoastDownResult:
    """Read the statistics of a coast-down file; a file of another kind or a damaged one is refused."""
    with opened(path, *_FILE) as file:
        values = read(CoastDownResult, file) | {"path": Path(path)}
    if np.isnan(values["standstill_time"]):
        values["standstill_time"] = None
    return CoastDownResult(**values)


def is_coast_down(path: str | Path) -> bool:
    """Whether a file is a simulated coast-down."""
    import h5py

    path = Path(path)
    if not path.is_file() or not h5py.is_hdf5(path):
        return False
    with h5py.File(path, "r") as file:
        return bool(file.attrs.get("format") == FORMAT)


def ended_run(path: Path, digest: str) -> CoastDownResult | None:
    """What a file holds if it is the whole of just this run, as a run killed behind its end left it."""
    if not is_coast_down(path):
        return None
    with opened(path, *_FILE) as file:
        mine = file.attrs.get("run") == digest
    return load_coast_down(path) if mine else None


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaneInFile:
    """Displacement (x, y) [m] of one plane of a coast-down file, shape (N, 2), read piece by piece."""

    path: Path
    dataset: str
    index: int
    shape: tuple[int, int]

    def __getitem__(self, wanted: slice) -> Array:
        with opened(self.path, *_FILE) as file:
            return np.asarray(file[self.dataset][wanted, self.index], dtype=np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class CoastDownSamples:
    """Samples of a coast-down file as the frequency analysis wants them."""

    planes: dict[str, PlaneInFile]
    """Displacement at each bearing, and at each sensor plane as ``"node 5"``; they stay in the file."""
    speed: Array
    """Rotor speed [rad/s], shape (N,)."""
    sampling_rate: float
    """Samples per second [Hz]."""
    air_gap: dict[str, float]
    """Air gap of each bearing [m]."""


def open_samples(path: str | Path) -> CoastDownSamples:
    """Open the samples of a coast-down file without reading the displacements into memory."""
    path, result = Path(path), load_coast_down(path)
    with opened(path, *_FILE) as file:
        speed = file["speed"][()]
    named = {"displacement": result.bearing_names}
    named["sensor_displacement"] = tuple(f"node {node}" for node in result.sensor_nodes)
    return CoastDownSamples(
        planes={
            label: PlaneInFile(path=path, dataset=dataset, index=index, shape=(len(speed), 2))
            for dataset, labels in named.items()
            for index, label in enumerate(labels)
        },
        speed=speed,
        sampling_rate=1.0 / result.output_step,
        air_gap=dict(zip(result.bearing_names, result.air_gap.tolist(), strict=True)),
    )
