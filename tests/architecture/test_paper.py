"""Every equation, figure and table of the paper has a function and a test that are there (``paper.toml``)."""

import pkgutil
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAPER = tomllib.loads((ROOT / "paper.toml").read_text(encoding="utf-8"))
ROWS = [(kind[:-1], number, *names) for kind, rows in PAPER.items() for number, names in rows.items()]


def test_nothing_of_the_paper_is_left_out_but_the_photograph():
    numbers = {kind: {int(number) for number in rows} for kind, rows in PAPER.items()}
    assert numbers == {
        "equations": set(range(1, 18)),
        "figures": set(range(1, 20)) - {6},
        "tables": set(range(1, 6)),
    }


@pytest.mark.parametrize(("kind", "number", "function", "test"), ROWS, ids=lambda value: str(value)[:12])
def test_a_part_of_the_paper_has_its_function_and_its_test(kind, number, function, test):
    try:
        assert callable(pkgutil.resolve_name(function))
    except (ImportError, AttributeError) as gone:
        pytest.fail(f"{kind} {number} of the paper has no function {function} any more: {gone}")
    file, _, name = test.partition("::")
    source = (ROOT / file).read_text(encoding="utf-8") if (ROOT / file).is_file() else ""
    there = re.search(rf"^def {name}\(", source, re.MULTILINE) if name else source
    assert there, f"{kind} {number} of the paper has no test {test} any more; name another in paper.toml"
