"""The recordings that come with the package; they are simulated, and say so."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from rotordrop.errors import UsageError

_FOLDER = "rotordrop.examples"
_SUFFIXES = (".h5", ".csv")


def example_record_names() -> tuple[str, ...]:
    """Name the recordings that come with the package."""
    items = files(_FOLDER).iterdir()
    return tuple(sorted(Path(item.name).stem for item in items if Path(item.name).suffix in _SUFFIXES))


def example_record_path(name: str) -> Path:
    """Give the file of a recording that comes with the package, for example ``"lp400_drop_060"``.

    Raises
    ------
    UsageError
        When there is none of this name; says which there are.
    """
    for suffix in _SUFFIXES:
        path = Path(str(files(_FOLDER).joinpath(name + suffix)))
        if path.is_file():
            return path
    raise UsageError(f"no example recording {name!r}; there are {', '.join(example_record_names())}")
