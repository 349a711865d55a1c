"""Write ``docs/generated/validation.md``: every public validation case, computed now, with its reference.

``make docs`` runs it; the cases are files under ``tests/validation/cases`` and
the functions that compute them stand in the test modules beside.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests" / "validation"
PAGE = ROOT / "docs" / "generated" / "validation.md"
sys.path[:0] = [str(FOLDER), str(ROOT)]

from cases import Case, Compute, Expected, case_names, load_case  # noqa: E402

ABOUT = {
    "analytical": "closed form or exact equation",
    "published code": "numbers of another program or a book",
    "catalogue": "tables of bearing makers",
    "paper": "numbers of Neisi 2020 that its text contains",
    "own reference": "a separate program written for the case",
    "metamorphic": "a property that must hold without a number from outside",
}

ROUNDING = 1e-11
"""Deviation, over the number, that is arithmetic: another processor has another, so it prints as 0."""


def computations() -> dict[str, Compute]:
    """The function that computes each case, from the ``CASES`` of every test module."""
    found: dict[str, Compute] = {}
    for file in sorted(FOLDER.glob("test_*_cases.py")):
        found |= importlib.import_module(file.stem).CASES
    return found


def case_section(case: Case, computed: Mapping[str, float]) -> list[str]:
    """Title, source and table of one case."""
    lines = [f"### {case.id} {case.title}", "", f"Reference: {case.kind}. Source: {case.source}.", ""]
    if case.notes:
        lines += [f"{case.notes}", ""]
    lines += [
        "| quantity | expected | computed | unit | deviation | tolerance |",
        "|---|---:|---:|---|---:|---:|",
    ]
    return [*lines, *(row(entry, computed[entry.name]) for entry in case.expected), ""]


def row(entry: Expected, value: float) -> str:
    """One line of a table."""
    mark = "" if entry.holds(value) else " **outside**"
    deviation, tolerance = (_in_terms(entry, x) for x in (_beyond_rounding(entry, value), entry.tolerance))
    name = entry.name.replace("|", "\\|")
    return f"| {name} | {entry.value:.6g} | {value:.6g} | {entry.unit} | {deviation}{mark} | {tolerance} |"


def summary(cases: list[Case], computed: Mapping[str, Mapping[str, float]]) -> list[str]:
    """How many numbers of each kind of reference there are, and how far off the worst one is."""
    lines = [
        "| kind of reference | what it is | cases | numbers | largest share of the tolerance |",
        "|---|---|---:|---:|---:|",
    ]
    for kind, about in ABOUT.items():
        chosen = [case for case in cases if case.kind == kind]
        if not chosen:
            continue
        shares = [_share(entry, computed[case.id][entry.name]) for case in chosen for entry in case.expected]
        lines.append(f"| {kind} | {about} | {len(chosen)} | {len(shares)} | {max(shares):.0%} |")
    return [*lines, ""]


def _share(entry: Expected, value: float) -> float:
    """Share of the tolerance that a number uses; a count must be exact, so it uses none."""
    deviation = entry.deviation(value)
    if entry.tolerance == 0.0:
        return 0.0 if deviation == 0.0 else float("inf")
    return deviation / entry.tolerance


def disagreement_table() -> list[str]:
    """Published numbers that we do not reproduce."""
    from disagreements import DISAGREEMENTS

    lines = [
        "| quantity | source | printed | ours | unit | deviation | why |",
        "|---|---|---:|---:|---|---:|---|",
    ]
    for one in DISAGREEMENTS:
        lines.append(
            f"| {one.what} | {one.source} | {one.printed:.6g} | {one.compute():.6g} | {one.unit} "
            f"| {one.deviation():+.2%} | {one.reason} |"
        )
    return [*lines, ""]


def page() -> str:
    """The whole page; computes every case."""
    functions = computations()
    cases = [load_case(name) for name in case_names()]
    computed = {case.id: functions[case.id](case.inputs) for case in cases}
    lines = [
        "# Validation",
        "",
        "Every case is a file of inputs and published numbers; the library computes the numbers, the tests",
        "compare them within the tolerance of the case and show that each case fails when an input moves.",
        "This page is written by `docs/generate_validation.py` from the same files and functions.",
        "",
        *summary(cases, computed),
        "## Where we and others disagree",
        "",
        *disagreement_table(),
    ]
    for category in dict.fromkeys(case.category for case in cases):
        lines += [f"## {category[:1].upper()}{category[1:]}", ""]
        for case in cases:
            if case.category == category:
                lines += case_section(case, computed[case.id])
    return "\n".join(lines).rstrip() + "\n"


def _beyond_rounding(entry: Expected, value: float) -> float:
    deviation = entry.deviation(value)
    return 0.0 if deviation < ROUNDING * (1.0 if entry.relative else abs(entry.value)) else deviation


def _in_terms(entry: Expected, value: float) -> str:
    return f"{100.0 * value:.2g} %" if entry.relative else f"{value:.2g} {entry.unit}"


if __name__ == "__main__":
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
