"""Kill whole commands at random moments and see whether anything is lost or half written.

Usage: python studies/interruptions/kills.py COUNT [FIRST]    runs number FIRST to FIRST + COUNT - 1

Every command writes over outputs of an earlier run. After a kill each output must be whole, the earlier or
the new one, the inputs must be untouched, and after one more run nothing hidden may be left. A command runs
in a copy of this process that has imported and compiled all it needs, so that most kills meet its work and
not its start. An estimate and a calibrated machine are made once and killed while they are written: before
that there is nothing to lose. The number of a run is its seed. One line of ``results/kills.jsonl`` each; a
run that was stopped goes on where it was.
"""

from __future__ import annotations

import asyncio
import hashlib
import io
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import cache, partial
from pathlib import Path

import numpy as np
from pyarrow.parquet import read_table
from scipy.io import loadmat
from tests.published import bearing, published, value

from rotordrop import Machine, Tracked, estimate_drop, read_document, read_record
from rotordrop.cli.app import run
from rotordrop.errors import RotordropError
from rotordrop.estimate.estimate import Estimate
from rotordrop.files import hdf5_is_sealed, write_json
from rotordrop.ledger.book import read_log
from rotordrop.machine import example_path, load_machine
from rotordrop.machine.saving import save_machine
from rotordrop.record.examples import example_record_path
from rotordrop.study.summary import load_results
from rotordrop.web import child
from rotordrop.web.running import result_folder, write_state
from rotordrop.web.workspace import Workspace, receive
from rotordrop_bench.cli.app import run as run_bench

RESULTS = Path(__file__).parent / "results" / "kills.jsonl"
HERE = Path(__file__).parent
COMMANDS = {
    "look": "look {record} machine.toml --report out.html --json out.json",
    "check": "check machine.toml --report out.html --json out.json",
    "init": "init out.toml --force",
    "profile": "profile {record} -o out.toml",
    "simulate": "simulate machine.toml --speed 60Hz --duration 0.02s -o out.h5 --json out.json",
    "log allow": "log allow out.db --machine LP-400 --drops {number} --source contract",
    "log add": "log add out.db drop.json",
    "study": "study run study.toml --folder study --threads 1",
    "coast-down": "coast-down machine.toml --speed 0.3Hz --until 0.6s --reduction quick -o coast.h5",
    "share": "look {record} machine.toml --share shared.h5 --licence CC0-1.0",
    "bench": "synthesize machine.toml --speed 60Hz --duration 0.3s --seed {number} -o hidden",
    "estimate": "estimate",
    "calibrate": "calibrate",
    "page": "page",
}
"""What is killed; ``page`` is a job of the page, from the upload to the result of a look."""
ESTIMATED = ("e.json", "e.h5", "e.nc", "e.csv", "e.mat", "e.parquet")
STUDY = """machine = "machine.toml"
drops = 12
shard = 2
duration = "10 ms"
reduction = "quick"
vary.speed = {uniform = ["60 Hz", "200 Hz"]}
"""


def whole(path: Path) -> bool:
    """Whether a file is complete by its kind."""
    if "page" in path.parts:
        return True  # told as a whole by `lost`
    try:
        if path.suffix == ".json" and path.parent.name != "claims":
            read_document(path)
        elif path.suffix in (".html", ".toml", ".csv", ".sha256"):
            text = path.read_text()
            return text.rstrip().endswith("</html>") if path.suffix == ".html" else text.endswith("\n")
        elif path.suffix in (".h5", ".nc"):
            return hdf5_is_sealed(path, "")
        elif path.suffix in READ:
            READ[path.suffix](path)
    except (OSError, ValueError, RotordropError):
        return False
    return True


READ: dict[str, Callable[[Path], object]] = {
    ".mat": loadmat,
    ".parquet": read_table,
    ".npz": lambda path: dict(np.load(path)),
}


def lost(folder: Path) -> list[str]:
    """What of a study, a log and the jobs of the page is not what was written."""
    found = []
    readers: list[tuple[Path, Callable[[], object]]] = [
        (folder / "study" / "plan.json", lambda: load_results(folder / "study")),
        (folder / "out.db", lambda: read_log(folder / "out.db")),
    ]
    if (folder / "page" / "jobs").is_dir():
        for job in Workspace(folder / "page").jobs():
            readers.append((job.path, job.read))
            readers.append((job.path, partial(job.file, "record")))
            readers.append((job.path, partial(result_folder, job, "look")))
    for path, read in readers:
        try:
            if path.exists():
                read()
        except RotordropError as error:
            found.append(str(error))
    return found


def _look_on_the_page(record: str) -> int:
    """One job, in this process: made, sent, looked at; the oldest goes."""
    space = Workspace(Path("page"))
    space.prepare()
    for old in space.jobs()[1:]:
        old.remove()
    job = space.new_job("drop", {})

    async def body() -> AsyncIterator[bytes]:
        yield Path(record).read_bytes()

    asyncio.run(receive(space, job, "record", record, None, body()))
    options = {"gap": "300 um", "speed": "60 Hz"}
    write_state(job, "look", {"state": "running", "run": os.urandom(8).hex(), "options": options})
    child.main(str(job.path), "look")
    return 0


def _called(words: list[str], record: str) -> int:
    if words == ["page"]:
        return _look_on_the_page(record)
    if words == ["estimate"]:
        for name in ESTIMATED:
            _estimated().save(name)
        _estimated().report("e.html")
        _estimated().data("e")
        return 0
    if words == ["calibrate"]:
        save_machine(_calibrated(), "calibrated.toml")
        return 0
    if words[0] == "synthesize":
        return run_bench(words)
    if words[:2] == ["log", "add"]:
        drop = published(record_sha256=os.urandom(32).hex(), bearings={"DE": bearing(PEAKS)}).as_json()
        write_json("drop.json", drop, sealed=True)
    return run(words)


PEAKS = {"peak_force_N": value(3300.0), "peak_stress_Pa": value(1.5e9)}


@cache
def _calibrated() -> Machine:
    return load_machine(HERE / "lp400_calibrated.toml")


@cache
def _estimated() -> Estimate:
    record = read_record(example_record_path("lp400_drop_060"), _calibrated())
    tail = read_record(example_record_path("lp400_drop_060_tail"), _calibrated())
    return estimate_drop(_calibrated(), record, tail, method=Tracked(quick=True))


def _start(words: list[str], record: str) -> int:
    """Run a command in a copy of this process with a group of its own; its number."""
    number = os.fork()
    os.setpgid(number, number)  # both do it: on a busy machine either may be the first to need the group
    if number:
        return number
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    os._exit(_called(words, record))


def _ended(number: int) -> bool:
    return os.waitpid(number, os.WNOHANG)[0] == number


def _folder(path: Path) -> tuple[list[Path], str]:
    source = Path(example_path("lp400"))
    for extra in source.parent.glob(f"{source.stem}*"):
        shutil.copy(extra, path / extra.name.replace(f"{source.stem}.toml", "machine.toml"))
    record = path / "record.h5"
    shutil.copy(example_record_path("lp400_drop_060"), record)
    machine = path / "machine.toml"
    machine.write_text(machine.read_text() + "\n")
    save_machine(
        load_machine(machine).with_values({"speed.aero_linear": 0.1, "speed.aero_quadratic": 0.0}), machine
    )
    (path / "study.toml").write_text(STUDY)
    return [machine, record, path / "study.toml"], record.name


def _hashes(paths: list[Path]) -> list[str]:
    return [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]


def one(
    number: int, folder: Path, inputs: list[Path], record: str, took: dict[str, float]
) -> dict[str, object]:
    """Kill one command and look at what is there."""
    name = list(COMMANDS)[number % len(COMMANDS)]
    words = COMMANDS[name].format(record=record, number=number + 1).split()
    if number % 3 == 0:  # two of three find what the one before left, and go on with it
        shutil.rmtree(folder / "study", ignore_errors=True)
    shutil.rmtree(folder / "coast.h5.partial", ignore_errors=True)
    if name not in took:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            if code := _called(words, record):
                raise SystemExit(f"{name} ends with {code}")
            shutil.rmtree(folder / "study", ignore_errors=True)
            begun = time.perf_counter()
            _called(words, record)
        took[name] = time.perf_counter() - begun
    before = _hashes(inputs)
    dice = random.Random(number)
    running = _start(words, record)
    time.sleep(dice.uniform(0.02, 1.05) * took[name])
    ended = _ended(running)
    if not ended:
        os.killpg(running, signal.SIGKILL)
        os.waitpid(running, 0)
    files = [path for path in folder.rglob("*") if path.is_file() and path not in inputs]
    shown = [path for path in files if not path.name.startswith(".")]
    return {
        "number": number,
        "command": name,
        "killed": not ended,
        "broken": [path.name for path in shown if not whole(path)] + lost(folder),
        "inputs kept": before == _hashes(inputs),
        "hidden": len(files) - len(shown),
    }


def main() -> None:
    """Run what is missing and print the sums."""
    RESULTS.parent.mkdir(exist_ok=True)
    lines = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.is_file() else []
    took: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name, RESULTS.open("a") as out:
        folder = Path(name)
        inputs, record = _folder(folder)
        os.chdir(folder)
        first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
        there = {line["number"] for line in lines}
        for number in sorted(set(range(first, first + int(sys.argv[1]))) - there):
            line = one(number, folder, inputs, record, took)
            lines.append(line)
            out.write(json.dumps(line) + "\n")
            out.flush()
    print(Counter((line["command"], line["killed"]) for line in lines))
    broken = [line for line in lines if line["broken"] or not line["inputs kept"]]
    print(f"{len(lines)} runs, {sum(line['killed'] for line in lines)} killed, broken: {broken}")


if __name__ == "__main__":
    main()
