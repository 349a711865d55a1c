"""Wrong physics on purpose: single faults generated from the syntax tree of the kernels and the model.

A fault is one a person makes when writing an equation: a sign, a factor 2, an exponent, a unit, a comparison
the wrong way round, sine for cosine, a term forgotten. Index arithmetic, messages, annotations and docstrings
are left alone: what breaks there is no physics.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SOURCES = (
    "physics/*.py",
    "model/assembly.py",
    "model/reduction.py",
    "model/parameters.py",
    "simulation/_rhs.py",
    "simulation/levitation.py",
)
LEFT_OUT = {"_compile.py", "__init__.py"}

SWAPPED_CALLS = {
    "sin": "cos",
    "cos": "sin",
    "max": "min",
    "min": "max",
    "maximum": "minimum",
    "minimum": "maximum",
    "tan": "sin",
    "atan": "tan",
    "hypot": "maximum",
    "ellipk": "ellipe",
    "ellipe": "ellipk",
}
REVERSED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE}
UNIT_FACTORS = ("1000.0", "0.001", "6.283185307179586")


@dataclass(frozen=True, kw_only=True)
class Mutation:
    """One fault: where, of which kind, and what it makes of the source."""

    file: str
    line: int
    kind: str
    before: str
    after: str
    start: tuple[int, int]
    end: tuple[int, int]

    def applied(self, source: str) -> str:
        """The source of the file with the fault in it; the columns of the tree count bytes."""
        lines = [line.encode() for line in source.splitlines(keepends=True)]
        (first, left), (last, right) = self.start, self.end
        head = b"".join(lines[: first - 1]) + lines[first - 1][:left]
        tail = lines[last - 1][right:] + b"".join(lines[last:])
        return (head + f"({self.after})".encode() + tail).decode()

    @property
    def name(self) -> str:
        """One line that tells the fault."""
        return f"{self.file}:{self.line} {self.kind}: {self.before} → {self.after}"


def sample(package: Path, count: int, seed: int) -> list[Mutation]:
    """A fixed sample of faults: kinds take turns, each drawn at random from all its places."""
    by_kind: dict[str, list[Mutation]] = {}
    for mutation in every(package):
        by_kind.setdefault(mutation.kind, []).append(mutation)
    source = random.Random(seed)
    for kind in sorted(by_kind):
        source.shuffle(by_kind[kind])
    chosen: list[Mutation] = []
    while len(chosen) < count and any(by_kind.values()):
        for kind in sorted(by_kind):
            if by_kind[kind] and len(chosen) < count:
                chosen.append(by_kind[kind].pop())
    return sorted(chosen, key=lambda m: (m.file, m.start, m.kind, m.after))


def every(package: Path) -> Iterator[Mutation]:
    """All faults of all source files."""
    for pattern in SOURCES:
        for path in sorted(package.glob(pattern)):
            if path.name not in LEFT_OUT:
                yield from of_file(path, path.relative_to(package).as_posix())


def of_file(path: Path, name: str) -> Iterator[Mutation]:
    """All faults of one source file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    seen = set()
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        indices = _index_names(function)
        for node in _arithmetic(function, indices):
            for kind, replacement in _faults(node):
                mutation = Mutation(
                    file=name,
                    line=node.lineno,
                    kind=kind,
                    before=ast.unparse(node),
                    after=ast.unparse(replacement),
                    start=(node.lineno, node.col_offset),
                    end=(node.end_lineno or 0, node.end_col_offset or 0),
                )
                key = (mutation.start, mutation.end, mutation.after)
                if key not in seen:
                    seen.add(key)
                    yield mutation


def _index_names(function: ast.FunctionDef) -> set[str]:
    """Names of integers that count or point: loop variables, lengths, and what follows from them."""
    names = {a.arg for a in function.args.args if a.annotation and ast.unparse(a.annotation) == "int"}
    for node in ast.walk(function):
        if isinstance(node, ast.For | ast.comprehension):
            called = ast.unparse(node.iter)
            if called.startswith(("range(", "enumerate(")):
                target = node.target.elts[0] if isinstance(node.target, ast.Tuple) else node.target
                names.add(ast.unparse(target))
    for _ in range(3):
        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and _is_index(node.value, names):
                names |= {ast.unparse(target) for target in node.targets}
    return names


def _is_index(node: ast.expr, names: set[str]) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_index(node.left, names) and _is_index(node.right, names)
    text = ast.unparse(node)
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int)
    return text in names or ".shape[" in text or text.startswith(("len(", "np.size("))


def _arithmetic(node: ast.AST, indices: set[str]) -> Iterator[ast.expr]:
    """Expressions that compute a physical value, outermost first."""
    for name, value in ast.iter_fields(node):
        if name in ("slice", "annotation", "returns", "decorator_list", "args") and not isinstance(
            node, ast.Call
        ):
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(
                child, ast.Raise | ast.JoinedStr | ast.FunctionDef
            ):
                continue
            if isinstance(child, ast.Call) and ast.unparse(child.func) in (
                "range",
                "np.zeros",
                "np.empty",
                "len",
            ):
                continue
            if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
                continue
            if isinstance(child, ast.BinOp) and _is_index(child, indices):
                continue
            if isinstance(child, ast.expr):
                yield child
            yield from _arithmetic(child, indices)


def _faults(node: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    if isinstance(node, ast.BinOp):
        yield from _binary(node)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "sign", node.operand
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in REVERSED:
        operator = REVERSED[type(node.ops[0])]()
        yield "comparison", ast.Compare(node.left, [operator, *node.ops[1:]], node.comparators)
    elif isinstance(node, ast.Call):
        yield from _call(node)
    elif isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value not in (0.0, 1.0):
        yield "factor", ast.Constant(2.0 * node.value)
        yield "factor", ast.Constant(0.5 * node.value)


def _binary(node: ast.BinOp) -> Iterator[tuple[str, ast.expr]]:
    left, operator, right = node.left, node.op, node.right
    if isinstance(operator, ast.Add | ast.Sub):
        other = ast.Sub() if isinstance(operator, ast.Add) else ast.Add()
        yield "sign", ast.BinOp(left, other, right)
        yield "term", left
        yield "term", right
    elif isinstance(operator, ast.Mult | ast.Div):
        other = ast.Div() if isinstance(operator, ast.Mult) else ast.Mult()
        yield "factor", ast.BinOp(left, other, right)
        yield "factor", ast.BinOp(ast.Constant(2.0), ast.Mult(), node)
        for factor in UNIT_FACTORS:
            yield "unit", ast.BinOp(node, ast.Mult(), ast.Constant(float(factor)))
    elif isinstance(operator, ast.Pow):
        yield "exponent", ast.BinOp(left, operator, ast.BinOp(right, ast.Add(), ast.Constant(1)))
        yield "exponent", ast.BinOp(left, operator, ast.BinOp(ast.Constant(0.5), ast.Mult(), right))
    elif isinstance(operator, ast.MatMult):
        yield "sign", ast.UnaryOp(ast.USub(), node)


def _call(node: ast.Call) -> Iterator[tuple[str, ast.expr]]:
    function = node.func
    name = function.attr if isinstance(function, ast.Attribute) else ast.unparse(function)
    if name == "sqrt":
        yield "exponent", node.args[0]
    if name == "exp":
        yield "sign", ast.Call(function, [ast.UnaryOp(ast.USub(), node.args[0])], [])
    if name == "abs":
        yield "sign", node.args[0]
    if name in SWAPPED_CALLS and not (name in ("max", "min") and len(node.args) < 2):
        if isinstance(function, ast.Attribute):
            other: ast.expr = ast.Attribute(function.value, SWAPPED_CALLS[name], ast.Load())
        else:
            other = ast.Name(SWAPPED_CALLS[name], ast.Load())
        if name != "hypot" or ast.unparse(function).startswith("np."):
            yield "function", ast.Call(other, node.args, node.keywords)
