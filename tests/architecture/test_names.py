"""Names of modules that mean something."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(file for source in ("src", "bench/src") for file in (ROOT / source).rglob("*.py"))

EMPTY_NAMES = re.compile(r"(^|_)(utils?|helpers?|managers?|process(ing|or)?|data|misc|common)($|_)")


@pytest.mark.parametrize("path", [*FILES, *(file.parent for file in FILES)], ids=str)
def test_a_module_is_named_after_what_it_is_about(path):
    assert not EMPTY_NAMES.search(path.stem), path


@pytest.mark.parametrize("name", ["utils", "plot_utils", "data", "helper", "process", "drop_manager"])
def test_names_that_say_nothing_are_found(name):
    assert EMPTY_NAMES.search(name)


@pytest.mark.parametrize("name", ["database", "processor_free", "metadata", "handling"])
def test_names_that_only_sound_like_it_pass(name):
    assert bool(EMPTY_NAMES.search(name)) == (name == "processor_free")
