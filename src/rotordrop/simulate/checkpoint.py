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
from rotordrop.files import atomic_path, require_file
from rotordrop.rotor.parameters import DropModel

Arrays = dict[str, NDArray[np.float64]]

_CHECKPOINT = "checkpoint.npz"
_DIGEST, _SEAL = "digest", "digest of what follows"


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
    with atomic_path(folder / _CHECKPOINT) as temporary, temporary.open("wb") as file:
        marks = {_DIGEST: np.array(digest), _SEAL: np.array(_digest_of(arrays))}
        np.savez(file, **marks, **arrays)  # type: ignore[arg-type]


def _digest_of(arrays: Mapping[str, NDArray[np.float64]]) -> str:
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def load_checkpoint(folder: Path, digest: str) -> Arrays | None:
    """Read where a run stands; None when it was killed before its first checkpoint.

    A checkpoint of another machine, other settings or another version is refused.
    """
    path = folder / _CHECKPOINT
    require_file(path, f"remove {folder} and start the run again")
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        found, seal = str(arrays.pop(_DIGEST)), str(arrays.pop(_SEAL))
        if seal != _digest_of(arrays):
            raise ValueError("it is not what was written")
    except Exception as error:
        # zipfile and numpy raise a dozen kinds of errors for a damaged file
        raise SimulationError(
            f"{path} cannot be read ({error}); remove {folder} and start the run again"
        ) from error
    if found != digest:
        raise SimulationError(
            f"{folder} belongs to another run (fingerprint {found[:8]}, this one has {digest[:8]}): machine, "
            "speed, settings or version differ. Resume with the same ones, or remove the folder."
        )
    return arrays


def remove_work_folder(folder: Path) -> None:
    """Remove the parts once the output stands."""
    shutil.rmtree(folder, ignore_errors=True)
