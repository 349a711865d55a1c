"""The public validation cases: one file per case, one function per case that computes its numbers.

A test module holds ``CASES``, a mapping from the name of a case to ``compute(inputs) -> {name: value}``, by
functions of the library. `check` compares every expected number within the tolerance of the case itself; the
validation page of the docs is made from the same files and functions.
"""

import copy
import tomllib
from collections.abc import Callable, Mapping
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

    def deviation(self, value):
        """Deviation in the terms of the tolerance: relative or in the unit."""
        error = abs(float(value) - self.value)
        return error / abs(self.value) if self.relative else error

    def holds(self, value):
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
    notes: str = ""
    changes: tuple[Mapping[str, Any], ...] = ()

    def with_inputs(self, **changes):
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


def case_names():
    """Names of all cases that have a file."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


def load_case(name):
    """Read one case."""
    raw = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    if raw["kind"] not in KINDS:
        raise ValueError(f"case {name}: kind of reference {raw['kind']!r}, expected one of {KINDS}")
    common = raw.pop("common", {})
    expected = tuple(_expected(entry, common | row) for entry, row in raw.pop("expected").items())
    return Case(id=name, expected=expected, **raw)


def _expected(name, row):
    """One number from its row, with what all rows have in common."""
    tolerance = row["tol_rel"] if "tol_rel" in row else row["tol_abs"]
    return Expected(
        name=name,
        value=row["value"],
        unit=row["unit"],
        tolerance=tolerance,
        relative="tol_rel" in row,
        source=row.get("value_from"),
    )


def check(case, computed):
    """Compare every expected number of a case; one that was not computed, or not asked for, is an error."""
    names = {e.name for e in case.expected}
    assert set(computed) == names, (
        f"{case.id}: computed and expected differ in {sorted(set(computed) ^ names)}"
    )
    wrong = [_disagreement(e, computed[e.name]) for e in case.expected if not e.holds(computed[e.name])]
    assert not wrong, f"{case.id} ({case.title}):\n  " + "\n  ".join(wrong)


def checks_of(compute):
    """The tests of a module: each of its cases holds, and fails where an input changes as its file says."""
    changes = [(name, change) for name in compute for change in load_case(name).changes]

    @pytest.mark.acceptance
    @pytest.mark.parametrize("name", compute)
    def test_case(name):
        case = load_case(name)
        check(case, compute[name](case.inputs))

    @pytest.mark.acceptance
    @pytest.mark.parametrize(("name", "change"), changes)
    def test_a_changed_input_is_noticed(name, change):
        case = load_case(name)
        found = compute[name](case.with_inputs(**change).inputs)
        in_order = zip((entry.name for entry in case.expected), found.values(), strict=True)
        same = {entry.name for entry in case.expected} == set(found)
        with pytest.raises(AssertionError, match=rf"{name} .*\n.*deviation .* tolerance"):
            check(case, found if same else dict(in_order))

    return test_case, test_a_changed_input_is_noticed


def _disagreement(expected, value):
    unit = "relative" if expected.relative else expected.unit
    return (
        f"{expected.name}: {value:.9g} {expected.unit}, expected {expected.value:.9g}, "
        f"deviation {expected.deviation(value):.3g} {unit}, tolerance {expected.tolerance:.3g}"
    )
