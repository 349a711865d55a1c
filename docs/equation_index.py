"""Read the docstrings of ``rotordrop.physics`` and list its equations for the documentation.

Nothing is imported: the sources are parsed. The architecture test uses the same reading to insist on a unit
and a source in every public function.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PHYSICS = Path(__file__).resolve().parent.parent / "src" / "rotordrop" / "physics"

_SOURCE = re.compile(r"\bSource:\s+(?P<text>.+?)(?=\s*(?:\n\s*\n|\Z)|\.\s+[A-Z])", re.DOTALL)
_UNIT = re.compile(r"\[[^\]\s][^\]]*\](?!_)|\bUnit of the values\b|\bSI values\b")
_NUMBER = re.compile(r"eqs?\.?\s*\(?(\d+)")


@dataclass(frozen=True, kw_only=True)
class Equation:
    """One public function of ``rotordrop.physics`` and what its docstring says."""

    module: str
    function: str
    line: int
    first_sentence: str
    source: str | None
    has_unit: bool
    without_unit: tuple[str, ...]
    caveats: tuple[str, ...]

    @property
    def order(self) -> tuple[int, str]:
        """Place in the index: by equation number of the paper, then by name."""
        number = _NUMBER.search(self.source or "")
        paper = number is not None and "Neisi" in (self.source or "")
        return (int(number.group(1)) if number and paper else 1000, self.function)


def equations(folder: Path = PHYSICS) -> list[Equation]:
    """List the public functions of the physics package in the order of the paper's equations."""
    found = [equation for file in sorted(folder.glob("*.py")) for equation in _of_file(file)]
    return sorted(found, key=lambda equation: equation.order)


def _of_file(file: Path) -> Iterator[Equation]:
    if file.name.startswith("_"):
        return
    tree = ast.parse(file.read_text(encoding="utf-8"))
    module_text = ast.get_docstring(tree) or ""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            text = ast.get_docstring(node) or ""
            yield Equation(
                module=f"rotordrop.physics.{file.stem}",
                function=node.name,
                line=node.lineno,
                first_sentence=_sentence(text),
                source=_source(text),
                has_unit=bool(_UNIT.search(text)),
                without_unit=tuple(_without_unit(text)),
                caveats=_caveats(text) + _caveats(module_text),
            )


def _source(text: str) -> str | None:
    match = _SOURCE.search(text)
    return " ".join(match.group("text").split()).rstrip(".") if match else None


def _without_unit(text: str) -> Iterator[str]:
    """Name the floats and arrays of the sections "Parameters" and "Returns" that state no unit."""
    for section in re.findall(r"^(?:Parameters|Returns)\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.M | re.S):
        for entry in re.split(r"\n(?=\S)", section.strip()):
            head = entry.split("\n", 1)[0]
            if re.search(r"\b(float|ndarray|array)\b", head) and not _UNIT.search(entry):
                yield head


def _sentence(text: str) -> str:
    first = " ".join(text.split("\n\n")[0].split())
    return first.rstrip(".")


def _caveats(text: str) -> tuple[str, ...]:
    flat = " ".join(text.split())
    return tuple(
        match.group().strip()
        for match in re.finditer(r"(Differs from the paper|Not validated):.+?(?=\.\s+[A-Z]|\.?$)", flat)
    )


def index_page(folder: Path = PHYSICS) -> str:
    """Write the index as a Markdown page."""
    rows = [_row(equation) for equation in equations(folder)]
    return "\n".join(
        [
            "# Equation index",
            "",
            "Every function of `rotordrop.physics`, in the order of the paper's equations; generated from",
            "the docstrings. Neisi 2020 is the paper named on the [first page](../index.md).",
            "",
            "| source | function | what it gives |",
            "|---|---|---|",
            *rows,
            "",
        ]
    )


def _row(equation: Equation) -> str:
    text = equation.first_sentence + "".join(f". *{caveat}*" for caveat in equation.caveats)
    name = f"{{py:func}}`~{equation.module}.{equation.function}`"
    return f"| {_plain(equation.source or '')} | {name} | {_plain(text)} |"


def _plain(text: str) -> str:
    return re.sub(r"``?([^`]+)``?", r"`\1`", text).replace("|", "\\|")
