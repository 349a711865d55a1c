"""Records and settled tails given on the command line."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.record.record import Record


def require_own_names(records: Sequence[Path]) -> None:
    """Refuse two records of the same file stem: results are listed by it."""
    name, count = Counter(path.stem for path in records).most_common(1)[0]
    if count > 1:
        raise UsageError(
            f"{count} records are named {name!r}; expected a name of its own for each, because results are "
            "listed by it. Rename the files, or give each record once."
        )


def require_own_content(paths: Sequence[Path]) -> None:
    """Refuse the same recording given twice: one drop would count as two, its errors would look smaller."""
    seen: dict[str, Path] = {}
    for path in paths:
        try:
            with path.open("rb") as stream:
                digest = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError:
            continue  # the reader says what is wrong with it
        if digest in seen:
            raise UsageError(
                f"{seen[digest]} and {path} are the same recording (equal content); expected another drop in "
                "each. Leave one of them out."
            )
        seen[digest] = path


def tails_of(paths: list[Path], count: int, read: Callable[[Path], Record]) -> list[Record | None]:
    """Settled tail of every record: one for all, one for each in order, or none."""
    if len(paths) not in (0, 1, count):
        raise UsageError(
            f"{len(paths)} tails for {count} records; expected one for all, one for each, or none. "
            "Repeat --tail in the order of the records."
        )
    found: list[Record | None] = [read(path) for path in paths]
    if not found:
        return [None] * count
    return found * count if len(found) == 1 else found
