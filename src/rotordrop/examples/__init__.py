"""The recordings that come with the package; they are simulated, and say so."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from rotordrop.errors import OutputError, UsageError
from rotordrop.files import atomic_path, make_folder
from rotordrop.require import require

_FOLDER, _SUFFIXES = Path(__file__).parent, (".h5", ".csv")


def example_record_path(name: str) -> Path:
    """Give the file of a recording that comes with the package, for example ``"lp400_drop_060"``.

    Raises
    ------
    UsageError
        When there is none of this name; says which there are.
    """
    paths = _paths()
    if require(name, "name", str) not in paths:
        raise UsageError(f"no example recording {name!r}; there are {', '.join(sorted(paths))}")
    return paths[name]


def example_files(name: str) -> dict[str, Path]:
    """Files of an example by their names: machine file first, shaft table, recordings where there are any.

    Raises
    ------
    UsageError
        When there is no example machine of this name.
    """
    from rotordrop.machine import example_path

    machine = example_path(name)
    found = (machine, *sorted(machine.parent.glob(f"{name}_*.csv")), *sorted((_FOLDER / name).glob("*")))
    return {file.name: file for file in found}


def copy_example(name: str, folder: Path, *, overwrite: bool = False) -> list[Path]:
    """Copy the machine file of an example, its shaft table and recordings; or none where one stands there.

    Raises
    ------
    OutputError
        When one stands there and shall not be replaced.
    """
    machine, *others = example_files(name).values()
    contents = {folder / "machine.toml": machine} | {folder / one.name: one for one in others}
    standing = [file for file in contents if file.exists()]
    if standing and not overwrite:
        raise OutputError(f"{standing[0]} exists already; name another folder or add --force")
    make_folder(folder)
    for file, source in contents.items():
        with atomic_path(file) as temporary:
            temporary.write_bytes(source.read_bytes())
    return [*contents]


@lru_cache(maxsize=1)
def example_hashes() -> frozenset[str]:
    """SHA-256 of the recordings that come with the package."""
    return frozenset(hashlib.sha256(path.read_bytes()).hexdigest() for path in _paths().values())


def _paths() -> dict[str, Path]:
    found = sorted(path for path in _FOLDER.glob("*/*") if path.suffix in _SUFFIXES)
    return {f"{path.parent.name}_{path.stem}": path for path in found}
