"""Recordings given on the command line: one drop must not count as two."""

from __future__ import annotations

from pathlib import Path

import pytest

from rotordrop.cli._recordings import require_own_content
from rotordrop.errors import UsageError


def test_equal_files_under_two_names_are_refused(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.csv", "b.csv", "c.csv")]
    for path, content in zip(paths, ("t,x", "t,y", "t,x"), strict=True):
        path.write_text(content)
    require_own_content(paths[:2])
    with pytest.raises(UsageError, match=r"a\.csv and .*c\.csv are the same recording .* Leave one"):
        require_own_content(paths)


def test_a_missing_file_is_left_to_the_reader(tmp_path: Path) -> None:
    require_own_content([tmp_path / "none.csv", tmp_path / "none.csv"])
