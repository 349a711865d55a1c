"""Faults for the mutation study: what one is, how it is told, how a sample is drawn."""

from __future__ import annotations

import ast
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def mutations():
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        import mutations

        yield mutations
    finally:
        sys.path.remove(str(ROOT / "tools"))


def test_a_fault_is_a_change_of_one_expression(mutations, tmp_path):
    source = (
        'def f(x, y):\n    """Größe."""\n    if not x < y[1:]:\n        return g(x, y)\n'
        "    return -2.5 * x ** 3 + (\n        x\n        + y)  # µ\n"
    )
    path = tmp_path / "kernel.py"
    path.write_text(source, encoding="utf-8")
    faults = list(mutations.of_file(path, "kernel.py"))
    kinds = {"sign", "factor", "exponent", "term", "comparison", "off by one", "swapped arguments"}
    assert kinds <= {fault.kind for fault in faults}
    for fault in faults:
        changed = fault.applied(source)
        assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(source)), fault.key
        assert changed.count("\n") == source.count("\n")


def test_a_fault_is_told_by_its_function_wherever_that_stands(mutations, tmp_path):
    source = 'def f(x):\n    """Text."""\n    return 2.0 * x + 2.0 * x\n'
    moved = "import math\n\n\ndef f(x):\n    # why\n    return (2.0 * x\n        + 2.0 * x)\n"
    path = tmp_path / "a.py"
    told = []
    for name, text in (("a/one.py", source), ("b/two.py", moved)):
        path.write_text(text, encoding="utf-8")
        told.append([(fault.key, fault.digest) for fault in mutations.of_file(path, name)])
    assert told[0] == told[1] and len(told[0]) == len(set(told[0]))
    path.write_text(source.replace("+", "-"), encoding="utf-8")
    assert {fault.digest for fault in mutations.of_file(path, "a.py")}.isdisjoint(d for _, d in told[0])


def test_the_draw_is_fixed_and_changes_only_with_what_it_is_drawn_from(mutations):
    faults = [f for f in mutations.every(ROOT / "src" / "rotordrop") if f.package in ("severity", "physics")]
    first = mutations.drawn(faults, {"physics": 20}, 5, 1)
    assert first == mutations.drawn(list(reversed(faults)), {"physics": 20}, 5, 1)
    assert first != mutations.drawn(faults, {"physics": 20}, 5, 2)
    assert Counter(fault.package for fault in first) == {"physics": 20, "severity": 5}
    fewer = [fault for fault in faults if fault.file != first[0].file]
    again = mutations.drawn(fewer, {"physics": 20}, 5, 1)
    assert len(set(first) & set(again)) >= 15
