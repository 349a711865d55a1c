"""Does the suite notice wrong physics? Run 100 faults, one at a time, against a part of the suite.

    python tools/mutate.py [--count 100] [--seed 2020] [--first 0] [--last 100] [--only-survivors]

The kernels run as plain Python, so nothing is compiled: the part of the suite takes well under a minute.
Every fault is put into a temporary copy of the tree; the working tree is never touched. A fault is caught
when a test fails or does not end in time. Results are kept in tests/mutation/mutants.json as they come, so a
run can be continued; a survivor needs a justification in tests/mutation/equivalent.json.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import multiprocessing
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "1"
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

from mutations import Mutation, sample  # noqa: E402  after the environment

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "tests" / "mutation" / "mutants.json"
SEED = 2020
TIME_LIMIT = 150.0
SUITE = {
    "simulation": [
        "tests/unit/simulation/test_right_hand_side.py",
        "tests/unit/simulation/test_levitation.py",
        "tests/unit/simulation/test_power_balance.py",
    ],
    "physics": ["tests/unit/physics"],
    "model": ["tests/unit/model"],
}
PRELOADED = (
    "pytest",
    "numpy",
    "numba",
    "scipy.special",
    "scipy.linalg",
    "scipy.optimize",
    "pydantic",
    "pint",
    "hypothesis",
)


def ordered_suite(file: str) -> list[str]:
    """The part of the suite, the tests of the faulty package first."""
    own = file.split("/")[0]
    names = [own, *(name for name in SUITE if name != own)]
    return [path for name in names for path in SUITE[name] if (ROOT / path).exists()]


def copy_tree(target: Path) -> None:
    """What the tests need, without caches."""
    ignore = shutil.ignore_patterns("__pycache__", "*.pyc", "_build")
    for name in ("src", "tests", "docs"):
        if (ROOT / name).exists():
            shutil.copytree(ROOT / name, target / name, ignore=ignore)
    shutil.copy(ROOT / "pyproject.toml", target / "pyproject.toml")


def run_suite(tree: str, paths: list[str], answer: Any) -> None:
    """Run the tests in the copy; answers with the exit code and the first failure."""
    os.chdir(tree)
    sys.path.insert(0, str(Path(tree) / "src"))
    sys.dont_write_bytecode = True
    failed = FirstFailure()
    with (
        Path(os.devnull).open("w") as nothing,
        contextlib.redirect_stdout(nothing),
        contextlib.redirect_stderr(nothing),
    ):
        pytest = importlib.import_module("pytest")
        code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", *paths], plugins=[failed])
    package = importlib.import_module("rotordrop")
    assert str(package.__file__).startswith(tree), package.__file__
    answer.send((int(code), failed.name))


class FirstFailure:
    """Remembers the first test that failed."""

    name = ""

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed and not self.name:
            self.name = report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed and not self.name:
            self.name = report.nodeid


def tried(tree: Path, paths: list[str]) -> dict[str, Any]:
    """Outcome of the suite in the copy as it stands."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    began = time.monotonic()
    process = context.Process(target=run_suite, args=(str(tree), paths, sender))
    process.start()
    sender.close()
    answered = receiver.poll(TIME_LIMIT)
    try:
        code, name = receiver.recv() if answered else (None, "the time limit")
    except EOFError:
        code, name = -1, "the end of the process"
    process.kill()
    process.join()
    return {"caught": code != 0, "by": name, "seconds": round(time.monotonic() - began, 1)}


def with_fault(mutation: Mutation, tree: Path) -> dict[str, Any]:
    """Outcome for one fault; the copy is as before afterwards."""
    path = tree / "src" / "rotordrop" / mutation.file
    source = path.read_text(encoding="utf-8")
    path.write_text(mutation.applied(source), encoding="utf-8")
    try:
        return {"mutant": mutation.name, **tried(tree, ordered_suite(mutation.file))}
    finally:
        path.write_text(source, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--last", type=int, default=None)
    parser.add_argument("--only-survivors", action="store_true")
    parser.add_argument("--list", action="store_true", help="print the faults and stop")
    options = parser.parse_args()
    faults = sample(ROOT / "src" / "rotordrop", options.count, options.seed)
    if options.list:
        print("\n".join(fault.name for fault in faults))
        return
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    known = {entry["mutant"]: entry for entry in kept.get("mutants", [])}
    for module in PRELOADED:
        importlib.import_module(module)
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder).resolve()
        copy_tree(tree)
        clean = tried(tree, ordered_suite("simulation/_rhs.py"))
        if clean["caught"]:
            sys.exit(f"The suite fails without any fault: {clean['by']}. Mend that first.")
        print(f"without a fault the suite passes in {clean['seconds']} s", flush=True)
        for number, fault in enumerate(faults[options.first : options.last], start=options.first):
            before = known.get(fault.name)
            if before and (before["caught"] or not options.only_survivors):
                continue
            entry = with_fault(fault, tree)
            known[fault.name] = entry
            word = "caught" if entry["caught"] else "SURVIVED"
            print(f"{number:3d} {word} {entry['seconds']:5.1f} s {fault.name} [{entry['by']}]", flush=True)
            keep(faults, known, clean["seconds"], options.seed)


def keep(faults: list[Mutation], known: dict[str, Any], seconds: float, seed: int) -> None:
    """Write what is known of the present sample."""
    entries = [known[fault.name] for fault in faults if fault.name in known]
    listed = [
        {"mutant": e["mutant"], "caught": e["caught"], "by": e["by"], "seconds": e["seconds"]}
        for e in entries
    ]
    summary = {
        "seed": seed,
        "suite_seconds": seconds,
        "tried": len(entries),
        "caught": sum(e["caught"] for e in entries),
        "mutants": listed,
    }
    RESULTS.write_text(json.dumps(summary, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
