"""No long files, short functions, names that mean something."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "rotordrop"
FILES = sorted(PACKAGE.rglob("*.py"))

LONGEST_FILE = 500
SHORT_FUNCTION = 35
SHARE_SHORT = 0.9
EMPTY_NAMES = re.compile(r"(^|_)(utils?|helpers?|managers?|process(ing|or)?|data|misc|common)($|_)")


def _lines(file: Path) -> int:
    return len(file.read_text(encoding="utf-8").splitlines())


def _functions(file: Path) -> list[tuple[str, int]]:
    """List the functions of a file with their number of lines, docstring left out."""
    found = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            length = node.end_lineno - node.lineno + 1
            first = node.body[0]
            if ast.get_docstring(node) and first.end_lineno is not None:
                length -= first.end_lineno - first.lineno + 1
            found.append((f"{file.relative_to(PACKAGE)}:{node.name}", length))
    return found


def test_no_file_is_long():
    lengths = {str(file.relative_to(PACKAGE)): _lines(file) for file in FILES}
    assert len(lengths) > 20
    assert {name: length for name, length in lengths.items() if length >= LONGEST_FILE} == {}


def test_nine_of_ten_functions_are_short():
    functions = [function for file in FILES for function in _functions(file)]
    long = sorted((length, name) for name, length in functions if length >= SHORT_FUNCTION)
    assert len(long) <= (1 - SHARE_SHORT) * len(functions), long


@pytest.mark.parametrize("path", [*FILES, *(file.parent for file in FILES)], ids=str)
def test_a_module_is_named_after_what_it_is_about(path):
    assert not EMPTY_NAMES.search(path.stem), path


@pytest.mark.parametrize("name", ["utils", "plot_utils", "data", "helper", "process", "drop_manager"])
def test_names_that_say_nothing_are_found(name):
    assert EMPTY_NAMES.search(name)


@pytest.mark.parametrize("name", ["database", "processor_free", "metadata", "handling"])
def test_names_that_only_sound_like_it_pass(name):
    assert bool(EMPTY_NAMES.search(name)) == (name == "processor_free")
