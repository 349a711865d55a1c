"""Names of modules that mean something."""

from __future__ import annotations

import ast
import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(file for source in ("src", "bench/src") for file in (ROOT / source).rglob("*.py"))

SCRIPTS = sorted(
    file for folder in ("studies", "benchmarks", "tools") for file in (ROOT / folder).rglob("*.py")
)

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


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_script_imports_names_that_are_there(path):
    """A study runs once in months, and no other test would tell that what it names has moved."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rotordrop"):
            module = import_module(str(node.module))
            for name in (alias.name for alias in node.names):
                assert hasattr(module, name) or find_spec(f"{node.module}.{name}"), f"{node.module}: {name}"
