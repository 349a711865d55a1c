"""Files appear complete or not at all: written beside their place, synced, then renamed."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rotordrop.errors import OutputError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path to write to; it takes the place of `path` when the block ends well.

    When the block is left by an exception, Ctrl-C included, the temporary file is removed and whatever stood
    at `path` before stands there still.

    Parameters
    ----------
    path : path-like
        Where the finished file shall stand. Its folder must exist.

    Yields
    ------
    Path
        Temporary path in the same folder, with the same suffix.
    """
    target = Path(path)
    require_place(target)
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        yield temporary
        if not temporary.exists():
            raise OutputError(f"nothing was written for {target}")
        _sync(temporary)
        temporary.replace(target)
    except OSError as error:
        if error.filename not in (None, str(temporary), temporary):
            raise
        raise OutputError(
            f"cannot write {target}: {error.strerror or error}; choose another place"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
    _sync_folder(target.parent)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, complete or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: str | os.PathLike[str], content: Any) -> None:
    """Write a JSON file in UTF-8, complete or not at all.

    Numbers that JSON cannot hold (NaN, infinity) are refused before anything is written.
    """
    try:
        text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise OutputError(f"cannot write {path} as JSON: {error}") from error
    write_text(path, text + "\n")


def require_place(path: str | os.PathLike[str]) -> None:
    """Refuse a place where no file can be written, before a long computation rather than after it."""
    target = Path(path)
    if target.is_dir():
        raise OutputError(f"cannot write {target}: it is a folder; name a file in it")
    if not target.parent.is_dir():
        raise OutputError(
            f"cannot write {target}: the folder {target.parent} does not exist; create it first"
        )


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable where the system allows to sync a folder (not on Windows)."""
    if os.name == "posix":
        _sync(folder)
