"""Single faults, made from the syntax tree: what a person gets wrong in an equation or in passing it on.

A comparison the wrong way round, a factor 2, an index off by one, a sign, two arguments swapped, a term
forgotten, an exponent, sine for cosine. Messages, annotations, docstrings and progress bars are left alone.
"""

from __future__ import annotations

import ast
import hashlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

SWAPPED_CALLS = {
    "sin": "cos",
    "cos": "sin",
    "max": "min",
    "min": "max",
    "maximum": "minimum",
    "minimum": "maximum",
    "any": "all",
    "all": "any",
    "argmax": "argmin",
    "argmin": "argmax",
    "tan": "sin",
    "atan": "tan",
    "ellipk": "ellipe",
    "ellipe": "ellipk",
}
REVERSED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.LtE: ast.GtE,
    ast.Gt: ast.Lt,
    ast.GtE: ast.LtE,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
EITHER_WAY = {"max", "min", "maximum", "minimum", "hypot", "isclose", "allclose", "array_equal", "zip", "dot"}
"""Calls that say the same with their arguments swapped."""

OF_THE_LANGUAGE = {"isinstance", "getattr", "hasattr", "cast", "TypeVar", "range"}
"""Calls in which swapped arguments are no fault of thought."""

PROGRESS = {"tell", "progress", "report"}
"""Calls that only move a progress bar."""

MODULE = "<module>"


@dataclass(frozen=True, kw_only=True)
class Mutation:
    """One fault: where, of which kind, and what it makes of the source.

    `key` tells the fault without file and line, so that it outlives moves: the function, the expression and
    what becomes of it, counted where a function holds the same expression twice. `digest` is that of the
    function as it is, without docstring and layout.
    """

    file: str
    line: int
    function: str
    kind: str
    before: str
    after: str
    start: tuple[int, int]
    end: tuple[int, int]
    digest: str
    number: int = 0

    def applied(self, source: str) -> str:
        """The source of the file with the fault in it; the columns of the tree count bytes."""
        lines = [line.encode() for line in source.splitlines(keepends=True)]
        (first, left), (last, right) = self.start, self.end
        head = b"".join(lines[: first - 1]) + lines[first - 1][:left]
        tail = lines[last - 1][right:] + b"".join(lines[last:])
        below = "\n" * (last - first)  # machine code is cached by line numbers
        return (head + f"({self.after}{below})".encode() + tail).decode()

    @property
    def package(self) -> str:
        return self.file.split("/")[0]

    @property
    def key(self) -> str:
        again = f" (no. {self.number + 1})" if self.number else ""
        return f"{self.function}: {self.kind}: {self.before} → {self.after}{again}"

    @property
    def place(self) -> str:
        return f"{self.file}:{self.line}"


def drawn(
    mutations: Iterable[Mutation],
    wanted: Mapping[str, int],
    others: int,
    seed: int,
    *,
    of_a_function: int = 2,
) -> list[Mutation]:
    """A fixed sample: so many of each package, so many of all other packages together.

    Within a package kinds take turns. Each fault has its place in the queue by a hash of seed and key: the
    sample of a changed package is the old one but for what changed.
    """
    strata: dict[str, list[Mutation]] = {name: [] for name in [*wanted, ""]}
    for mutation in mutations:
        strata[mutation.package if mutation.package in wanted else ""].append(mutation)
    chosen: list[Mutation] = []
    for name, count in [*wanted.items(), ("", others)]:
        chosen += _of_a_package(strata[name], count, seed, of_a_function)
    return sorted(chosen, key=lambda m: (m.file, m.start, m.kind, m.after))


def _of_a_package(faults: list[Mutation], count: int, seed: int, of_a_function: int) -> list[Mutation]:
    queues: dict[str, list[Mutation]] = {}
    for fault in sorted(faults, key=lambda m: hashlib.sha256(f"{seed} {m.key}".encode()).hexdigest()):
        queues.setdefault(fault.kind, []).append(fault)
    chosen: list[Mutation] = []
    taken: Counter[tuple[str, str]] = Counter()
    while len(chosen) < count and any(queues.values()):
        for kind in sorted(queues):
            while queues[kind] and len(chosen) < count:
                fault = queues[kind].pop(0)
                if taken[fault.file, fault.function] < of_a_function:
                    taken[fault.file, fault.function] += 1
                    chosen.append(fault)
                    break
    return chosen


def every(package: Path) -> Iterator[Mutation]:
    """All faults of all source files of the package."""
    for path in sorted(package.rglob("*.py")):
        yield from of_file(path, path.relative_to(package).as_posix())


def of_file(path: Path, name: str) -> Iterator[Mutation]:
    """All faults of one source file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    seen: set[tuple[tuple[int, int], tuple[int, int], str]] = set()
    twins: Counter[str] = Counter()
    for function, digest, node in _expressions(tree):
        for kind, replacement in _faults(node):
            mutation = Mutation(
                file=name,
                line=node.lineno,
                function=function,
                kind=kind,
                before=ast.unparse(node),
                after=ast.unparse(replacement),
                start=(node.lineno, node.col_offset),
                end=(node.end_lineno or 0, node.end_col_offset or 0),
                digest=digest,
            )
            spot = (mutation.start, mutation.end, mutation.after)
            if spot not in seen and mutation.before != mutation.after:
                seen.add(spot)
                yield replace(mutation, number=twins[mutation.key])
                twins[mutation.key] += 1


def digest_of(node: ast.AST) -> str:
    """Digest of a piece of code as it runs: docstring, comments and layout do not count."""
    copy = ast.parse(ast.unparse(node))
    for inner in ast.walk(copy):
        body = getattr(inner, "body", None)
        if isinstance(body, list) and body and _is_text(body[0]):
            inner.body = body[1:] or [ast.Pass()]  # type: ignore[attr-defined]
    return hashlib.sha256(ast.unparse(copy).encode()).hexdigest()[:12]


def _is_text(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _expressions(tree: ast.Module) -> Iterator[tuple[str, str, ast.expr]]:
    """Every expression that can go wrong, with the innermost function it is in and the digest of that."""

    def inside(node: ast.AST, name: str, digest: str) -> Iterator[tuple[str, str, ast.expr]]:
        for child in _computing(node):
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                outer = (
                    ""
                    if name.startswith(MODULE)
                    else f"{name}." + "<locals>." * isinstance(node, ast.FunctionDef)
                )
                yield from inside(child, outer + child.name, digest_of(child))
            elif isinstance(child, ast.Assign | ast.AnnAssign) and isinstance(node, ast.Module):
                target = child.targets[0] if isinstance(child, ast.Assign) else child.target
                yield from inside(child, f"{MODULE} {ast.unparse(target)}", digest_of(child))
            else:
                if isinstance(child, ast.expr):
                    yield name, digest, child
                yield from inside(child, name, digest)

    yield from inside(tree, MODULE, "")


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    """Children of a node that compute something: no text, no annotation, no error, no index by itself."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, ast.Raise | ast.JoinedStr | ast.Assert):
                continue
            if isinstance(child, ast.stmt) and _is_text(child):
                continue
            if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                continue
            if isinstance(child, ast.Call) and _called(child) in PROGRESS:
                continue
            yield child


def _called(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else ast.unparse(call.func)


def _faults(node: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    if type(node) in _FAULTS_OF:
        yield from _FAULTS_OF[type(node)](node)


def _unary(node: ast.UnaryOp) -> Iterator[tuple[str, ast.expr]]:
    if isinstance(node.op, ast.Not):
        yield "comparison", node.operand
    elif isinstance(node.op, ast.USub) and not _is_count(node.operand):
        yield "sign", node.operand


def _joined(node: ast.BoolOp) -> Iterator[tuple[str, ast.expr]]:
    yield "comparison", ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)


def _constant(node: ast.Constant) -> Iterator[tuple[str, ast.expr]]:
    if isinstance(node.value, float) and node.value not in (0.0, 1.0):
        yield "factor", ast.Constant(2.0 * node.value)
        yield "factor", ast.Constant(0.5 * node.value)


def _compared(node: ast.Compare) -> Iterator[tuple[str, ast.expr]]:
    operator = REVERSED[type(node.ops[0])]()
    yield "comparison", ast.Compare(node.left, [operator, *node.ops[1:]], node.comparators)
    if _is_count(node.comparators[0]):
        more = _one_more(node.comparators[0])
        yield "off by one", ast.Compare(node.left, node.ops, [more, *node.comparators[1:]])


def _is_count(node: ast.AST | None) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) is int


def _one_more(node: ast.expr) -> ast.expr:
    assert isinstance(node, ast.Constant)
    return ast.Constant(node.value + 1)


def _sliced(node: ast.Subscript) -> Iterator[tuple[str, ast.expr]]:
    """Bounds of slices; an index by itself is left alone."""
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    for place, part in enumerate(parts):
        if not isinstance(part, ast.Slice):
            continue
        for moved in _moved(part):
            whole = [*parts[:place], moved, *parts[place + 1 :]]
            index = ast.Tuple(whole, ast.Load()) if isinstance(node.slice, ast.Tuple) else moved
            yield "off by one", ast.Subscript(node.value, index, ast.Load())


def _moved(part: ast.Slice) -> Iterator[ast.Slice]:
    for name in ("lower", "upper"):
        bound = getattr(part, name)
        new: ast.expr | None = None
        if _is_count(bound):
            new = _one_more(bound)
        elif isinstance(bound, ast.UnaryOp) and isinstance(bound.op, ast.USub) and _is_count(bound.operand):
            new = ast.UnaryOp(ast.USub(), _one_more(bound.operand))
        elif bound is not None and not isinstance(bound, ast.Constant):
            new = ast.BinOp(bound, ast.Add(), ast.Constant(1))
        if new is not None:
            changed = {"lower": part.lower, "upper": part.upper, name: new}
            yield ast.Slice(changed["lower"], changed["upper"], part.step)


def _binary(node: ast.BinOp) -> Iterator[tuple[str, ast.expr]]:
    left, operator, right = node.left, node.op, node.right
    if isinstance(operator, ast.Add | ast.Sub):
        if any(_joins(side) for side in (left, right)):
            return
        if _is_count(right):
            yield "off by one", ast.BinOp(left, operator, _one_more(right))
            return
        other = ast.Sub() if isinstance(operator, ast.Add) else ast.Add()
        yield "sign", ast.BinOp(left, other, right)
        yield "term", left
        yield "term", right
    elif isinstance(operator, ast.Mult | ast.Div):
        other = ast.Div() if isinstance(operator, ast.Mult) else ast.Mult()
        yield "factor", ast.BinOp(left, other, right)
        yield "factor", ast.BinOp(ast.Constant(2.0), ast.Mult(), node)
    elif isinstance(operator, ast.Pow):
        yield "exponent", ast.BinOp(left, operator, ast.BinOp(right, ast.Add(), ast.Constant(1)))
        yield "exponent", ast.BinOp(left, operator, ast.BinOp(ast.Constant(0.5), ast.Mult(), right))
    elif isinstance(operator, ast.MatMult):
        yield "sign", ast.UnaryOp(ast.USub(), node)


def _joins(node: ast.expr) -> bool:
    """Whether a side of a sum is text or a list."""
    if isinstance(node, ast.BinOp):
        return _joins(node.left) or _joins(node.right)
    return isinstance(node, ast.List | ast.Tuple | ast.ListComp | ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _call(node: ast.Call) -> Iterator[tuple[str, ast.expr]]:
    function, name = node.func, _called(node)
    if name == "range" and _is_count(node.args[-1]):
        yield "off by one", ast.Call(function, [*node.args[:-1], _one_more(node.args[-1])], [])
    if name == "sqrt":
        yield "exponent", node.args[0]
    if name == "exp":
        yield "sign", ast.Call(function, [ast.UnaryOp(ast.USub(), node.args[0])], [])
    if name == "abs":
        yield "sign", node.args[0]
    if name in SWAPPED_CALLS and (node.args or isinstance(function, ast.Attribute)):
        if isinstance(function, ast.Attribute):
            other: ast.expr = ast.Attribute(function.value, SWAPPED_CALLS[name], ast.Load())
        else:
            other = ast.Name(SWAPPED_CALLS[name], ast.Load())
        yield "function", ast.Call(other, node.args, node.keywords)
    plain = [argument for argument in node.args if not isinstance(argument, ast.Starred | ast.Constant)]
    if name not in EITHER_WAY | OF_THE_LANGUAGE and plain == node.args:
        for i in range(len(plain) - 1):
            swapped = [*plain[:i], plain[i + 1], plain[i], *plain[i + 2 :]]
            yield "swapped arguments", ast.Call(function, swapped, node.keywords)


_FAULTS_OF: dict[type[ast.expr], Callable[[Any], Iterator[tuple[str, ast.expr]]]] = {
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.BoolOp: _joined,
    ast.Compare: _compared,
    ast.Call: _call,
    ast.Subscript: _sliced,
    ast.Constant: _constant,
}
