"""The validation page shows every case with its computed numbers; what it calls a disagreement is one."""

import importlib.util
import sys
from pathlib import Path

import pytest
from cases import Expected, case_names, load_case
from disagreements import DISAGREEMENTS

ROOT = Path(__file__).resolve().parents[2]
QUICK = ("H12", "P01", "R01", "R07", "R18", "X01")


spec = importlib.util.spec_from_file_location("generate_validation", ROOT / "docs" / "generate_validation.py")
script = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(script)


def test_every_case_file_is_computed_by_one_function():
    assert set(script.computations()) == set(case_names())


@pytest.mark.parametrize("name", case_names())
def test_a_case_is_shown_with_its_kind_and_a_row_for_every_number(name):
    case = load_case(name)
    lines = script.case_section(case, {entry.name: entry.value for entry in case.expected})
    assert lines[0] == f"### {case.id} {case.title}"
    assert lines[2].startswith(f"Reference: {case.kind}. ")
    assert len([line for line in lines if line.startswith("| ")]) == 1 + len(case.expected)


@pytest.mark.parametrize("name", QUICK)
def test_the_numbers_shown_are_computed_ones(name):
    case = load_case(name)
    computed = script.computations()[name](case.inputs)
    section = "\n".join(script.case_section(case, computed))
    assert all(f"| {computed[entry.name]:.6g} | {entry.unit} |" in section for entry in case.expected)
    assert "**outside**" not in section


def test_numbers_outside_are_marked_and_all_are_counted():
    entry = Expected(name="force", value=100.0, unit="N", tolerance=0.01, relative=True, source=None)
    assert script.row(entry, 102.0) == "| force | 100 | 102 | N | 2 % **outside** | 1 % |"
    assert script.row(entry, 100.5) == "| force | 100 | 100.5 | N | 0.5 % | 1 % |"
    entry = Expected(name="mode", value=20.5, unit="Hz", tolerance=1e-4, relative=True, source=None)
    exact = script.row(entry, 20.5)
    assert script.row(entry, 20.5 * (1.0 + 3e-15)) == exact
    assert script.row(entry, 20.5 * (1.0 + 3e-11)) == exact.replace("| 0 % |", "| 3e-09 % |")
    case = load_case("R18")
    (line,) = script.summary([case], {"R18": {e.name: e.value * (1 + 5e-5) for e in case.expected}})[2:-1]
    assert line.startswith("| analytical |")
    assert line.endswith("| 1 | 7 | 50% |")


@pytest.mark.parametrize("one", DISAGREEMENTS, ids=lambda one: one.what)
def test_a_disagreement_is_more_than_rounding(one):
    _, _, decimals = f"{one.printed:.10g}".partition(".")
    rounding = 0.5 * 10.0 ** -len(decimals) / one.printed
    assert rounding < abs(one.deviation()) < 0.2
