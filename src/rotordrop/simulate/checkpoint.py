"""Where a long simulation stands, so that it can be killed at any moment and taken up again.

Beside the output ``coast.h5`` a folder ``coast.h5.partial`` holds one file per window of time and one
checkpoint. Every file in it appears complete or not at all, and the checkpoint is written after the window it
stands for; what a kill leaves behind is at worst a window that the checkpoint does not know, and it is
computed again. The output itself appears only when the run has ended.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.errors import OutputError, SimulationError
from rotordrop.files import new_hdf5, read_hdf5, require_file
from rotordrop.rotor.parameters import DropModel

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
