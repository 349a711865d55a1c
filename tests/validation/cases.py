"""The public validation cases: one file per case, one function per case that computes its numbers.

A test module holds ``CASES``, a mapping from the name of a case to ``compute(inputs) -> {name: value}``, by
functions of the library. `check` compares every expected number within the tolerance of the case itself; the
validation page of the docs is made from the same files and functions.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).resolve().parent / "cases"
KINDS = ("analytical", "published code", "catalogue", "paper", "own reference", "metamorphic")

Compute = Callable[[Mapping[str, Any]], Mapping[str, float]]


@dataclass(frozen=True, kw_only=True)
class Expected:
    """One number of a case with its tolerance, relative or absolute."""

    name: str
    value: float
    unit: str
    tolerance: float
    relative: bool
    source: str | None

    def deviation(self, value: float) -> float:
        """Deviation in the terms of the tolerance: relative or in the unit."""
        error = abs(float(value) - self.value)
        return error / abs(self.value) if self.relative else error

    def holds(self, value: float) -> bool:
        """Whether a number is within the tolerance; NaN is not."""
        return self.deviation(value) <= self.tolerance


@dataclass(frozen=True, kw_only=True)
class Case:
    """A validation case as its file describes it."""

    id: str
    title: str
    category: str
    kind: str
    source: str
    inputs: Mapping[str, Any]
    expected: tuple[Expected, ...]
    notes: str

    def with_inputs(self, **changes: Any) -> Case:
        """The same case with some inputs changed: its numbers must then no longer come out."""
        inputs = copy.deepcopy(dict(self.inputs))
        for path, value in changes.items():
            *folders, last = path.split("__")
            place = inputs
            for folder in folders:
                place = place[int(folder) if isinstance(place, list) else folder]
            if last not in place:
                raise KeyError(f"case {self.id} has no input {path}: {sorted(place)}")
            place[last] = value
        return Case(**{**self.__dict__, "inputs": inputs})


def case_names() -> tuple[str, ...]:
    """Names of all cases that have a file."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.json")))


def load_case(name: str) -> Case:
    """Read one case."""
    raw = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    if raw["kind"] not in KINDS:
        raise ValueError(f"case {name}: kind of reference {raw['kind']!r}, expected one of {KINDS}")
    expected = tuple(
        Expected(
            name=e["name"],
            value=e["value"],
            unit=e["unit"],
            tolerance=e["tol_rel"] if "tol_rel" in e else e["tol_abs"],
            relative="tol_rel" in e,
            source=e.get("value_from"),
        )
        for e in raw["expected"]
    )
    return Case(**{**raw, "expected": expected})


def check(case: Case, computed: Mapping[str, float]) -> None:
    """Compare every expected number of a case; one that was not computed, or not asked for, is an error."""
    names = {e.name for e in case.expected}
    assert set(computed) == names, (
        f"{case.id}: computed and expected differ in {sorted(set(computed) ^ names)}"
    )
    wrong = [_disagreement(e, computed[e.name]) for e in case.expected if not e.holds(computed[e.name])]
    assert not wrong, f"{case.id} ({case.title}):\n  " + "\n  ".join(wrong)


def checks_of(
    compute: Mapping[str, Compute], changes: Iterable[tuple[str, Mapping[str, Any]]]
) -> tuple[Callable[[str], None], Callable[[str, Mapping[str, Any]], None]]:
    """The tests of a module: each of its cases holds, and fails where one of its inputs is changed."""

    @pytest.mark.parametrize("name", compute)
    def test_case(name: str) -> None:
        case = load_case(name)
        check(case, compute[name](case.inputs))

    @pytest.mark.parametrize(("name", "change"), changes)
    def test_a_changed_input_is_noticed(name: str, change: Mapping[str, Any]) -> None:
        case = load_case(name).with_inputs(**change)
        with pytest.raises(AssertionError, match=rf"{name} .*\n.*deviation .* tolerance"):
            check(case, compute[name](case.inputs))

    return test_case, test_a_changed_input_is_noticed


def _disagreement(expected: Expected, value: float) -> str:
    unit = "relative" if expected.relative else expected.unit
    return (
        f"{expected.name}: {value:.9g} {expected.unit}, expected {expected.value:.9g}, "
        f"deviation {expected.deviation(value):.3g} {unit}, tolerance {expected.tolerance:.3g}"
    )
