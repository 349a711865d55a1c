"""The size of every room of the house against the numbers of ``rooms.toml``, which only fall.

A room has two numbers. *Lines* are those of Python as ``ruff format`` leaves them; *code* are these without
docstrings, blanks and comments. What is not Python counts as its bytes / 100 in lines; JavaScript, HTML, CSS,
TOML and JSON count so in code too.

``python tools/rooms.py`` names each room that stands above its numbers, and then ends with 1. ``--write``
lowers the file to what stands, and takes a room that rises where the total does not: code moves between
rooms. ``--write --raise`` takes every rise.
"""

import argparse
import ast
import subprocess
import sys
import tomllib
from pathlib import Path, PurePosixPath

FILE = "rooms.toml"
CODE = {".py", ".js", ".html", ".css", ".toml", ".json"}
DATA = ("uplot.", "plotly-", "elements/catalog/")
"""Parts of the paths of foreign scripts and of tables of makers, which count as data."""

HEADER = """\
# What each room may hold at most: [lines, code]. tools/rooms.py says how they count, and fails above them.
# Whoever makes a room smaller lowers its numbers in the same commit: python tools/rooms.py --write
"""


def room_of(path: str) -> str:
    """Return the room of a path of the repository."""
    parts = PurePosixPath(path).parts
    suffix = PurePosixPath(path).suffix
    if suffix == ".md" or parts[0] == "docs":
        return "documents"
    if parts[0] in ("studies", "tools", "benchmarks"):
        return "studies"
    if suffix not in CODE or any(part in path for part in DATA):
        return "rest"
    if parts[:2] == ("src", "rotordrop"):
        return f"src.{parts[2]}" if len(parts) > 3 else "src.top"
    if parts[0] == "tests" or parts[:2] == ("bench", "tests"):
        return "tests"
    return "bench" if parts[0] == "bench" else "rest"


def code_lines(source: str) -> int:
    """Return how many lines of Python are no docstring, blank or comment."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            lines[node.lineno - 1 : node.end_lineno] = [""] * (node.end_lineno - node.lineno + 1)
    return sum(bool(line.strip()) and not line.lstrip().startswith("#") for line in lines)


def measured(root: Path) -> dict[str, tuple[int, int]]:
    """Return lines and code of each room of the checkout at ``root``."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=root, capture_output=True, text=True, check=True
    ).stdout
    sums: dict[str, list[float]] = {}
    for path in listed.split("\0"):
        file = root / path
        if path == FILE or not file.is_file():
            continue
        name = room_of(path)
        room = sums.setdefault(name, [0.0, 0.0])
        if file.suffix == ".py":
            source = file.read_text(encoding="utf-8")
            room[0] += len(source.splitlines())
            room[1] += code_lines(source)
        else:
            room[0] += file.stat().st_size / 100
            room[1] += file.stat().st_size / 100 if file.suffix in CODE and name != "rest" else 0
    return {name: (round(lines), round(code)) for name, (lines, code) in sorted(sums.items())}


def main() -> int:
    """Compare what stands with the file, or write the file; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parents[1])
    parser.add_argument("--write", action="store_true", help="lower the file to what stands")
    parser.add_argument(
        "--raise", dest="rises", action="store_true", help="with --write: take what rises too"
    )
    given = parser.parse_args()
    stands = measured(given.root)
    file = given.root / FILE
    limits = tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    above = [
        f"{name}: {now[at]} {kind}, at most {limits.get(name, (0, 0))[at]}"
        for name, now in stands.items()
        for at, kind in enumerate(("lines", "lines of code"))
        if now[at] > limits.get(name, (0, 0))[at]
    ]
    rise = [
        sum(now[at] for now in stands.values()) - sum(most[at] for most in limits.values()) for at in (0, 1)
    ]
    if given.write and (given.rises or not above or max(rise) <= 0):
        rooms = "".join(f'"{name}" = [{lines}, {code}]\n' for name, (lines, code) in stands.items())
        file.write_text(HEADER + rooms, encoding="utf-8")
        return 0
    for line in above:
        print(line)
    return 1 if above else 0


if __name__ == "__main__":
    sys.exit(main())
