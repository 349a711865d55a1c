"""The kept list of faults: of the sources as they are, where the commands run, and enough are caught."""

from __future__ import annotations

import ast
import json
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KEPT = json.loads((ROOT / "tests" / "mutation" / "mutants.json").read_text(encoding="utf-8"))
EQUIVALENT = json.loads((ROOT / "tests" / "mutation" / "equivalent.json").read_text(encoding="utf-8"))
PACKAGES = ("measurement", "identification", "tracking", "estimation", "spectrum")
TRIED = [entry for entry in KEPT["mutants"] if "caught" in entry]
ENOUGH = 0.85
CHANGED = 1 / 3
"""Share of a package's faults whose functions may have changed since they were tried."""


def package(entry: dict[str, str]) -> str:
    return entry["place"].split("/")[0]


@pytest.fixture(scope="module")
def mutations():
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        import mutations

        yield mutations
    finally:
        sys.path.remove(str(ROOT / "tools"))


def test_faults_are_drawn_from_every_package_that_an_estimate_rests_on():
    drawn = Counter(package(entry) for entry in KEPT["mutants"])
    assert len(KEPT["mutants"]) == len({entry["mutant"] for entry in KEPT["mutants"]}) >= 150
    assert all(drawn[name] >= 25 for name in PACKAGES), drawn
    assert len(set(drawn) - set(PACKAGES)) >= 4


@pytest.mark.parametrize("name", PACKAGES)
def test_most_faults_of_a_package_are_caught(name):
    """Of those that can be caught at all."""
    drawn = [entry for entry in KEPT["mutants"] if package(entry) == name]
    waiting = [entry for entry in drawn if "caught" not in entry]
    if waiting:
        pytest.skip(f"{len(waiting)} of {len(drawn)} faults are not tried yet: python tools/mutate.py try")
    own = [entry for entry in drawn if entry["mutant"] not in EQUIVALENT]
    missed = [f"{entry['place']} {entry['mutant']}" for entry in own if not entry["caught"]]
    assert len(own) - len(missed) >= ENOUGH * len(own), missed


def test_a_reason_is_given_only_for_what_survived():
    assert set(EQUIVALENT) <= {entry["mutant"] for entry in TRIED if not entry["caught"]}
    assert all(len(reason) > 60 for reason in EQUIVALENT.values())


def test_the_list_is_of_the_sources_as_they_are(mutations):
    """An outcome counts while its function is as it was: what changed must be tried again."""
    present = {fault.key: fault.digest for fault in mutations.every(ROOT / "src" / "rotordrop")}
    drawn, changed = Counter(), Counter()
    for entry in KEPT["mutants"]:
        drawn[package(entry)] += 1
        changed[package(entry)] += present.get(entry["mutant"]) != entry["digest"]
    old = {
        name: f"{changed[name]} of {drawn[name]}"
        for name in PACKAGES
        if changed[name] > CHANGED * drawn[name]
    }
    assert not old, f"functions changed since their faults were tried: {old}; see tools/mutate.py"


def test_the_tests_that_caught_the_faults_are_still_there():
    functions = {}
    gone = []
    for entry in TRIED:
        if not entry["caught"] or "::" not in entry["by"]:
            continue
        file, *_, name = entry["by"].split(" of ")[-1].split(" in ")[-1].split("::")
        if file not in functions:
            path = ROOT / file
            tree = ast.parse(path.read_text(encoding="utf-8") if path.exists() else "")
            functions[file] = {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
        if name.split("[")[0] not in functions[file]:
            gone.append(f"{entry['mutant']} was caught by {entry['by']}")
    assert len(gone) <= 0.1 * len(KEPT["mutants"]), f"run tools/mutate.py again for these: {gone}"


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
