"""Does the suite notice a fault? Draw faults from the lines that the commands execute, and try each one.

    python tools/mutate.py follow [FOLDER ...]   # which lines the commands, which functions the tests run
    python tools/mutate.py draw                  # 150 faults into tests/mutation/mutants.json
    python tools/mutate.py try [--survivors] [--package NAME] [--count N] [--only N ...] [--tests FILE ...]

A fault is drawn from a line that `estimate` (both methods), `calibrate` or `waterfall` executes. It is put
into a copy of the package and tried against the tests that run the faulty function, the nearest and quickest
first, until one fails; it survives when all of them pass, or the limit of processor time is reached. Kernels
run as plain Python first and are compiled anew only for what survives that. Every outcome is kept at once: a
run that was stopped goes on where it was. An outcome counts as long as the function is as it was; a survivor
that no test can catch has its reason in tests/mutation/equivalent.json.

What `follow` finds lies in build/mutation; it takes as long as the suite. All runs use one core.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import fcntl
import hashlib
import importlib
import json
import math
import multiprocessing
import os
import resource
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parent))

from mutations import MODULE, Mutation, drawn, every  # noqa: E402  after the environment

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "rotordrop"
KEPT = ROOT / "tests" / "mutation" / "mutants.json"
WORK = ROOT / "build" / "mutation"
SEED = 2026
WANTED = dict.fromkeys(("evidence", "replay", "track", "twin", "spectrum"), 26)
OTHERS = 20
LIMIT = 60.0
"""Processor time for a fault [s]."""

COMPILING = 100.0
"""What is added where kernels are compiled anew [s]."""

WITH_KERNELS = ("physics", "rotor", "simulate", "track")
INTERPRETED = ("physics", "rotor", "simulate")
"""Folders of tests that are also followed with the kernels as plain Python."""

LONGEST_INTERPRETED = 5.0
"""What a test may take to be used with the kernels as plain Python [s]."""

MADE_ONCE = 6.0
"""What the fixtures of a test may cost [s]; more was the compiler."""

KERNEL_DECORATORS = {"kernel", "lean_kernel", "inner_kernel"}
PRELOADED = (
    "pytest",
    "numpy",
    "numba",
    "scipy.special",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
    "pydantic",
    "pint",
    "h5py",
    "hypothesis",
    "typer",
    "rich.console",
    "plotly.graph_objects",
)


# --- what runs


def follow(folders: list[str]) -> None:
    """Follow the commands and the tests, each in its own process; what is there already stays."""
    WORK.mkdir(parents=True, exist_ok=True)
    if not folders:
        in_child(follow_commands)
    for folder in folders or test_folders():
        in_child(follow_tests, folder, False)
        if Path(folder).name in INTERPRETED:
            in_child(follow_tests, folder, True)


def test_folders() -> list[str]:
    unit = sorted(path for path in (ROOT / "tests" / "unit").iterdir() if any(path.glob("test_*.py")))
    return [str(path.relative_to(ROOT)) for path in [*unit, ROOT / "tests" / "validation"]]


def in_child(function: Any, *arguments: Any) -> None:
    process = multiprocessing.get_context("spawn").Process(target=function, args=arguments)
    process.start()
    process.join()


def follow_commands() -> None:
    from executed import lines_of_the_commands

    with_sources(ROOT)
    with tempfile.TemporaryDirectory() as folder:
        lines = lines_of_the_commands(PACKAGE, Path(folder), lambda text: print(text, flush=True))
    (WORK / "lines.json").write_text(json.dumps(lines))


def follow_tests(folder: str, interpreted: bool) -> None:
    if interpreted:
        os.environ["NUMBA_DISABLE_JIT"] = "1"
    from executed import TestMap

    with_sources(ROOT)
    os.chdir(ROOT)
    pytest = importlib.import_module("pytest")
    followed = TestMap(PACKAGE, LONGEST_INTERPRETED if interpreted else 0.0)
    code = pytest.main(["-q", "-p", "no:cacheprovider", "--durations=30", folder], plugins=[followed])
    found = followed.passed()
    print(f"{folder}: exit code {code}, {len(found)} of {len(followed.tests)} tests", flush=True)
    functions = sorted(set().union(*(test["ran"] for test in found.values())))
    number = {name: i for i, name in enumerate(functions)}
    tests = {
        name: {**test, "ran": sorted(number[function] for function in test["ran"])}
        for name, test in found.items()
    }
    path = WORK / f"{'interpreted' if interpreted else 'compiled'}-{Path(folder).name}.json"
    path.write_text(json.dumps({"functions": functions, "tests": tests}))


def with_sources(tree: Path) -> None:
    sys.path[:0] = [str(tree / "src"), str(tree / "bench" / "src"), str(tree)]
    os.environ["PYTHONPATH"] = f"{tree / 'src'}{os.pathsep}{tree}"
    sys.dont_write_bytecode = True


# --- the draw


def executed_faults(lines: dict[str, list[int]]) -> Iterator[Mutation]:
    """Faults on executed lines; constants of a module count where an executed line names them."""
    ran = {name: set(found) for name, found in lines.items()}
    trees = {name: ast.parse((PACKAGE / name).read_text(encoding="utf-8")) for name in ran}
    named = {
        word
        for name, tree in trees.items()
        for node in ast.walk(tree)
        if getattr(node, "lineno", 0) in ran[name]
        for word in (getattr(node, "id", None), getattr(node, "attr", None))
        if word
    }
    bodies = {name: dict(function_bodies(tree)) for name, tree in trees.items()}
    for fault in every(PACKAGE):
        body = bodies.get(fault.file, {}).get(fault.function)
        if fault.file not in ran or fault.function == MODULE:
            continue
        if body is None:
            reached = fault.function.removeprefix(MODULE).strip().split(".")[-1] in named
        elif fault.line < body.start:  # the default of an argument
            reached = not ran[fault.file].isdisjoint(body)
        else:
            reached = not ran[fault.file].isdisjoint(range(fault.start[0], fault.end[0] + 1))
        if reached:
            yield fault


def function_bodies(tree: ast.AST, outer: str = "") -> Iterator[tuple[str, range]]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            yield outer + node.name, range(node.body[0].lineno, (node.end_lineno or 0) + 1)
            yield from function_bodies(node, f"{outer}{node.name}.<locals>.")
        elif isinstance(node, ast.ClassDef):
            yield from function_bodies(node, f"{outer}{node.name}.")
        else:
            yield from function_bodies(node, outer)


def draw(seed: int) -> None:
    """Write the sample; outcomes stay where fault and function are as they were."""
    lines = json.loads((WORK / "lines.json").read_text())
    known = {entry["mutant"]: entry for entry in kept_entries()}
    chosen = drawn(executed_faults(lines), WANTED, OTHERS, seed)
    entries = []
    for fault in chosen:
        entry = {"mutant": fault.key, "place": fault.place, "digest": fault.digest}
        before = known.get(fault.key, {})
        if before.get("digest") == fault.digest and "caught" in before:
            entry |= {name: before[name] for name in ("caught", "by", "seconds")}
        entries.append(entry)
    keep(entries, seed)
    old = sum("caught" in entry for entry in entries)
    print(f"{len(entries)} faults drawn, {old} of them tried before")


def kept_entries() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(KEPT.read_text())["mutants"] if KEPT.exists() else []
    return found


def keep(entries: list[dict[str, Any]], seed: int) -> None:
    text = json.dumps({"seed": seed, "mutants": entries}, indent=1, ensure_ascii=False)
    fresh = KEPT.with_suffix(".new")
    fresh.write_text(text + "\n", encoding="utf-8")
    fresh.replace(KEPT)


# --- the tests for a fault


@dataclass(frozen=True)
class Tests:
    """What is known of the tests of one way to run the kernels."""

    ran: dict[str, set[str]]
    """Functions of each test, as file:name."""

    seconds: dict[str, float]
    """Processor time with its fixtures, as far as they are not compilation."""

    @staticmethod
    def followed(way: str) -> Tests:
        ran, seconds = {}, {}
        for path in sorted(WORK.glob(f"{way}-*.json")):
            found = json.loads(path.read_text())
            for name, test in found["tests"].items():
                ran[name] = {found["functions"][i] for i in test["ran"]}
                seconds[name] = test["seconds"] + min(test["whole"] - test["seconds"], MADE_ONCE)
        return Tests(ran, seconds)

    def for_fault(self, fault: Mutation, functions: set[str]) -> list[str]:
        """Tests that run one of the functions, near and quick ones first.

        Where none is known to (it ran while the tests were read), those of the files that name it, else of
        the package.
        """
        own = f"tests/unit/{fault.package}/"
        chosen = [name for name, ran in self.ran.items() if ran & functions]
        if not chosen:
            word = fault.function.split(".")[-1].split(" ")[-1]
            files = {name.split("::")[0] for name in self.ran}
            naming = {file for file in files if word in (ROOT / file).read_text(encoding="utf-8")}
            chosen = [name for name in self.ran if name.split("::")[0] in naming]
        return self._ordered(chosen or [name for name in self.ran if name.startswith(own)], own)

    def _ordered(self, names: list[str], own: str) -> list[str]:
        def weight(name: str) -> float:
            return (0.05 + self.seconds[name]) * (1.0 if name.startswith(own) else 4.0)

        quick = sorted((name for name in names if weight(name) < 2.0), key=weight)
        files: dict[str, list[str]] = {}
        for name in sorted((name for name in names if weight(name) >= 2.0), key=weight):
            files.setdefault(name.split("::")[0], []).append(name)  # one after another: they share fixtures
        return quick + [name for group in files.values() for name in group]


def functions_of(fault: Mutation) -> set[str]:
    """The function of a fault as the tests' map names it; for a constant, the functions that name it."""
    if not fault.function.startswith(MODULE):
        inside = f"{fault.file}:{fault.function}"
        found = {inside}
        for tree_name, name in functions_naming({fault.function}):  # a class, for a field of it
            if name == fault.function or name.startswith(f"{fault.function}."):
                found.add(f"{tree_name}:{name}")
        return found
    constant = fault.function.removeprefix(MODULE).strip()
    words = {constant}
    tree = ast.parse((PACKAGE / fault.file).read_text(encoding="utf-8"))
    for node in tree.body:  # constants made from it
        if isinstance(node, ast.Assign | ast.AnnAssign) and names_in(node) & words:
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            words.add(ast.unparse(target))
    return {f"{file}:{name}" for file, name in functions_naming(words)}


def functions_naming(words: set[str]) -> Iterator[tuple[str, str]]:
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if any(word.split(".")[-1] in text for word in words):
            yield from (
                (path.relative_to(PACKAGE).as_posix(), name)
                for name, node in functions_in(ast.parse(text))
                if names_in(node) & words or any(name.startswith(f"{word}.") for word in words)
            )


def functions_in(tree: ast.AST, outer: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            yield outer + node.name, node
            yield from functions_in(node, f"{outer}{node.name}.<locals>.")
        elif isinstance(node, ast.ClassDef):
            yield from functions_in(node, f"{outer}{node.name}.")
        else:
            yield from functions_in(node, outer)


def names_in(node: ast.AST) -> set[str]:
    found = (getattr(n, "id", None) or getattr(n, "attr", None) for n in ast.walk(node))
    return {name for name in found if name}


# --- trying a fault


def kernel_names(fault: Mutation) -> set[str]:
    """The kernel a fault lies in and all that it is compiled into; empty for what is not compiled."""
    calls: dict[str, set[str]] = {}
    own = ""
    for folder in WITH_KERNELS:
        for path in (PACKAGE / folder).glob("*.py"):
            for name, node in functions_in(ast.parse(path.read_text(encoding="utf-8"))):
                if any(names_in(d) & KERNEL_DECORATORS for d in node.decorator_list):
                    calls[name] = names_in(node)
                    if (path.relative_to(PACKAGE).as_posix(), name) == (fault.file, fault.function):
                        own = name
    affected = {own} if own else set()
    for _ in calls:
        affected |= {name for name, used in calls.items() if used & affected}
    return affected


class Progress:
    """A pytest plugin in the child: runs the chosen tests, or files, in their order and tells the parent."""

    def __init__(self, order: list[str], pipe: Any) -> None:
        self.place = {name: i for i, name in enumerate(order)}
        self.pipe = pipe
        self.failed = ""

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        places = {item: self._place_of(item.nodeid) for item in items}
        items[:] = sorted((item for item in items if places[item] >= 0), key=lambda item: places[item])

    def _place_of(self, nodeid: str) -> int:
        return self.place.get(nodeid, self.place.get(nodeid.split("::")[0], -1))

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.pipe.send(("test", nodeid))

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid


def run_tests(tree: str, order: list[str], way: str, cache: str, pipe: Any) -> None:
    """In the child: run the tests in the copy; machine code is taken from the cache as it is."""
    os.chdir(tree)
    with_sources(Path(tree))
    compiler = importlib.import_module("numba.core.config")
    compiler.DISABLE_JIT = int(way == "interpreted")  # type: ignore[attr-defined]
    os.environ["NUMBA_DISABLE_JIT"] = str(int(way == "interpreted"))
    caching = importlib.import_module("numba.core.caching")
    for locator in vars(caching).values():
        if isinstance(locator, type) and hasattr(locator, "get_source_stamp"):
            locator.get_source_stamp = lambda self: (0.0, 0)  # type: ignore[attr-defined]
    importlib.import_module("rotordrop.physics._compile").cache_folder = lambda *_: cache  # type: ignore[attr-defined]
    files = list(dict.fromkeys(name.split("::")[0] for name in order))
    watched = Progress(order, pipe)
    with (
        Path(os.devnull).open("w") as nothing,
        contextlib.redirect_stdout(nothing),
        contextlib.redirect_stderr(nothing),
    ):
        pytest = importlib.import_module("pytest")
        code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", *files], plugins=[watched])
    package = importlib.import_module("rotordrop")
    own = str(package.__file__).startswith(tree)
    pipe.send(("end", (int(code), watched.failed)) if own else ("alien", package.__file__))


def outcome(
    tree: Path, order: list[str], tests: Tests, way: str, cache: Path, limit: float, compiling: float = 0.0
) -> dict[str, Any]:
    """Run the tests against the copy as it stands; a test that takes ten times its time has failed."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=run_tests, args=(str(tree), order, way, str(cache), sender))
    process.start()
    sender.close()
    current, since, done = "", 0.0, 0
    try:
        while True:
            used = processor_time(process.pid or 0)
            usual = tests.seconds.get(current, 0.0)
            if current and used - since > 20.0 + 10.0 * usual + compiling:
                return {"caught": True, "by": f"the time limit of {current}", "seconds": round(used, 1)}
            if used > limit:
                return {"caught": False, "by": f"{done} tests in the time", "seconds": round(used, 1)}
            if not receiver.poll(0.2):
                continue
            kind, content = receiver.recv()
            if kind == "alien":
                raise RuntimeError(f"the tests ran on {content}, not on the copy in {tree}")
            if kind == "end":
                code, failed = content
                name = failed or f"{len(order)} tests"
                return {"caught": code not in (0, 5), "by": name, "seconds": round(used, 1)}
            current, since, done = content, used, done + 1
    except EOFError:
        return {"caught": True, "by": f"the end of the process in {current}", "seconds": 0.0}
    finally:
        process.kill()
        process.join()


def processor_time(pid: int) -> float:
    """Processor time of a process and of those it waited for [s]."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        return sum(int(field) for field in fields[11:15]) / os.sysconf("SC_CLK_TCK")
    return 0.0


def kernels_digest() -> str:
    """Digest of all files that may hold kernels."""
    digest = hashlib.sha256()
    for folder in WITH_KERNELS:
        for path in sorted((PACKAGE / folder).glob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:12]


class Copies:
    """One copy of the tree after another, always in the same place: machine code is cached by path."""

    def __init__(self, folder: Path) -> None:
        self.clean, self.tree = folder / "clean", folder / "tree"
        self.cache, self.other_cache = folder / f"cache-{kernels_digest()}", folder / "other_cache"
        self.warm = folder / f"warm-{kernels_digest()}"
        self.cache.mkdir(exist_ok=True)
        shutil.rmtree(self.clean, ignore_errors=True)
        ignore = shutil.ignore_patterns("__pycache__", "*.pyc", "_build")
        for name in ("src", "bench", "tests", "docs", "tools", "studies", "benchmarks"):
            if (ROOT / name).exists():
                shutil.copytree(ROOT / name, self.clean / name, ignore=ignore)
        for path in ROOT.iterdir():
            if path.is_file():
                shutil.copy2(path, self.clean / path.name)

    def fresh(self, fault: Mutation | None = None) -> Path:
        shutil.rmtree(self.tree, ignore_errors=True)
        shutil.copytree(self.clean, self.tree, copy_function=os.link)
        if fault is not None:
            path = self.tree / "src" / "rotordrop" / fault.file
            source = path.read_text(encoding="utf-8")
            path.unlink()
            path.write_text(fault.applied(source), encoding="utf-8")
        return self.tree

    def cache_without(self, kernels: set[str]) -> Path:
        """The cached machine code but for that of some kernels."""
        shutil.rmtree(self.other_cache, ignore_errors=True)
        shutil.copytree(self.cache, self.other_cache)
        for path in self.other_cache.rglob("*.nb?"):
            if path.name.split("-")[0].split(".")[-1] in kernels:
                path.unlink()
        return self.other_cache


def attempt(
    fault: Mutation, copies: Copies, compiled: Tests, interpreted: Tests, limit: float
) -> dict[str, Any]:
    functions, kernels = functions_of(fault), kernel_names(fault)
    tree = copies.fresh(fault)
    spent = 0.0
    if kernels:
        order = interpreted.for_fault(fault, functions)
        if interpreted.ran.get(order[0] if order else "", set()) & functions:
            found = outcome(tree, order, interpreted, "interpreted", copies.cache, limit)
            if found["caught"]:
                return found
            spent = found["seconds"]
    cache = copies.cache_without(kernels) if kernels else copies.cache
    order = compiled.for_fault(fault, functions)
    compiling = COMPILING if kernels else 0.0
    found = outcome(tree, order, compiled, "compiled", cache, limit + compiling, compiling)
    return found | {"seconds": round(found["seconds"] + spent, 1)}


def attempt_with(files: list[str], fault: Mutation, copies: Copies, limit: float) -> dict[str, Any]:
    """Try a fault against whole files of tests, whatever is known of what they run."""
    kernels = kernel_names(fault)
    cache = copies.cache_without(kernels) if kernels else copies.cache
    compiling = COMPILING if kernels else 0.0
    nothing = Tests({}, {})
    return outcome(
        copies.fresh(fault), files, nothing, "compiled", cache, limit + compiling, compiling + limit
    )


def warm(copies: Copies, compiled: Tests) -> None:
    """Fill the cache of machine code, and see that the tests pass where there is no fault."""
    kept = [name for name in compiled.ran if name.startswith(("tests/unit/track/", "tests/unit/replay/"))]
    pass_without_fault(kept, copies, compiled)


def pass_without_fault(tests: list[str], copies: Copies, known: Tests) -> None:
    """What fails without a fault catches nothing."""
    found = outcome(copies.fresh(), tests, known, "compiled", copies.cache, math.inf, math.inf)
    print(f"without a fault: {found}", flush=True)
    if found["caught"]:
        sys.exit("The tests fail without any fault. Mend that first.")


def try_all(options: argparse.Namespace) -> None:
    entries = kept_entries()
    seed = json.loads(KEPT.read_text())["seed"]
    faults = {fault.key: fault for fault in every(PACKAGE)}
    compiled, interpreted = Tests.followed("compiled"), Tests.followed("interpreted")
    for module in PRELOADED:
        importlib.import_module(module)
    folder = Path(tempfile.gettempdir()) / f"rotordrop-faults-{os.getuid()}"
    folder.mkdir(exist_ok=True)
    alone = (folder / "lock").open("w")
    fcntl.flock(alone, fcntl.LOCK_EX)  # one run at a time: the copies lie in one place
    copies = Copies(folder)
    if options.tests:
        pass_without_fault(options.tests, copies, compiled)
    elif not copies.warm.exists():
        warm(copies, compiled)
        copies.warm.touch()
    tried = 0
    for number, entry in enumerate(entries):
        fault = faults.get(entry["mutant"])
        if fault is None or (options.package and fault.package != options.package):
            continue
        if options.only and number not in options.only:
            continue
        stale = fault.digest != entry["digest"]
        again = options.survivors and not entry.get("caught", False)
        if ("caught" in entry and not stale and not again) or tried == options.count:
            continue
        tried += 1
        if options.tests:
            found = attempt_with(options.tests, fault, copies, options.limit)
        else:
            found = attempt(fault, copies, compiled, interpreted, options.limit)
        entry.update(place=fault.place, digest=fault.digest, **found)
        word = "caught" if entry["caught"] else "SURVIVED"
        print(
            f"{number:3d} {word} {entry['seconds']:5.1f} s {fault.place} {fault.key} [{entry['by']}]",
            flush=True,
        )
        keep(entries, seed)
    print(table(entries))


def table(entries: Iterable[dict[str, Any]]) -> str:
    rows: dict[str, list[int]] = {}
    for entry in entries:
        package = entry["place"].split("/")[0]
        row = rows.setdefault(package if package in WANTED else "others", [0, 0, 0])
        row[0] += 1
        row[1] += "caught" in entry
        row[2] += entry.get("caught", False)
    return "\n".join(
        f"{name}: {c} of {t} tried caught, {n} drawn" for name, (n, t, c) in sorted(rows.items())
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("follow").add_argument("folders", nargs="*")
    verbs.add_parser("draw").add_argument("--seed", type=int, default=SEED)
    trying = verbs.add_parser("try")
    trying.add_argument("--survivors", action="store_true", help="those that nothing has caught, again")
    trying.add_argument("--package", help="only faults of this package")
    trying.add_argument("--only", nargs="*", type=int, help="only the faults of these numbers")
    trying.add_argument("--tests", nargs="*", help="against these files of tests, and not all that run it")
    trying.add_argument("--count", type=int, default=-1, help="stop after so many")
    trying.add_argument("--limit", type=float, default=LIMIT, help="processor time for a fault [s]")
    options = parser.parse_args()
    if options.verb == "follow":
        follow(options.folders)
    elif options.verb == "draw":
        draw(options.seed)
    else:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        try_all(options)


if __name__ == "__main__":
    main()
