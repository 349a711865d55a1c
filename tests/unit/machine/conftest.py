"""A small machine, as text of a file, for tests that change it."""

from pathlib import Path

import pytest

SMALL = (Path(__file__).parents[2] / "machines" / "eight_elements.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def small_text():
    """Text of the small machine."""
    return SMALL


@pytest.fixture(scope="session")
def changed():
    """Text of the small machine with replacements, each where its text stands first."""

    def replaced(*changes):
        text = SMALL
        for old, new in changes:
            assert old in text, f"{old!r} is not in the text"
            text = text.replace(old, new, 1)
        return text

    return replaced
