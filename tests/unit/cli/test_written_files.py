"""Every file that the program writes and reads again: damaged, it ends in a sentence and never silently.

Whoever makes the program write another file is asked for a row here by the last test.
"""

import ast
import json
import os
import re
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import h5py
import numpy as np
import pytest
from tests.no_file import NO_FILE, in_time, on_posix
from tests.published import bearing, published, value
from tests.unit.ledger.test_ledger import DROP
from tests.unit.study.test_study import study_with

import rotordrop
from rotordrop import (
    DropCase,
    example_machine,
    load_machine,
    load_result,
    read_document,
    read_drop,
    save_machine,
    simulate_drop,
)
from rotordrop.cli.app import run
from rotordrop.errors import DamagedFileError, RotordropError
from rotordrop.files import clear_of_no_file, new_hdf5, write_json
from rotordrop.jobs.runner import publish as publish_result
from rotordrop.jobs.runner import result_folder, state_of, write_state
from rotordrop.jobs.traces import open_traces, write_traces
from rotordrop.jobs.workspace import Job, Workspace
from rotordrop.ledger import add_drop
from rotordrop.ledger.book import allow, read_log
from rotordrop.machine.ross_files import read_ross, write_ross
from rotordrop.record.profile import Profile, load_profile, save_profile
from rotordrop.record.readers import read_recording
from rotordrop.record.record import write_hdf5
from rotordrop.record.recording import Channel, Recording
from rotordrop.simulate.case import CoastDownCase
from rotordrop.simulate.coast_down import simulate_coast_down
from rotordrop.simulate.coast_down_file import (
    load_checkpoint,
    load_coast_down,
    part_path,
    save_checkpoint,
    write_coast_down,
    write_part,
)
from rotordrop.study.folder import Shard, open_folder, publish, study_of
from rotordrop.study.quantities import columns_of
from rotordrop.study.summary import load_results
from rotordrop.watch.kept import STATUS_FILE, Arrived, Kept, status_of

SOURCE = Path(rotordrop.__file__).parent


@dataclass(frozen=True)
class Written:
    """A kind of file: who writes it, how one is made, and what reads it."""

    by: tuple[str, ...]
    make: Callable[[Path], Path]
    read: Callable[[Path], Any]
    sealed: bool = True
    """Whether a digest lets nothing pass that was changed."""


def _into(name, write):
    """Makes a file of a name by what writes it to a path."""

    def make(folder):
        write(folder / name)
        return folder / name

    return make


_machine = _into("m.toml", lambda path: save_machine(example_machine("small"), path))
_ross = _into("rotor.toml", lambda path: write_ross(example_machine("small").rotor, path))
PROFILE = Profile(channels={"NDE_A": "S1", "NDE_B": "S2"}, sensitivity="8 mV/um")


def _recording():
    time = np.arange(400) / 5000.0
    turning = 1e-5 * np.sin(2 * np.pi * 60 * time)
    channels = [
        Channel(name=name, label=name, unit="m", values=turning + shift, time=time)
        for shift, name in zip((0.0, 1e-5), ("S1", "S2"), strict=True)
    ]
    return Recording(channels=tuple(channels), metadata={}, notes=(), warnings=())


_hdf5 = _into("drop.h5", lambda path: write_hdf5(_recording(), path))


@cache
def _dropped():
    case = DropCase(speed=377.0, duration=2e-3, output_step=1e-4, reduction="quick")
    return simulate_drop(example_machine("lp400"), case)


def _coast_down(folder):
    case = CoastDownCase(speed=1.0, duration=0.6, reduction="quick")
    machine = example_machine("lp400").with_values({"speed.aero_linear": 0.1, "speed.aero_quadratic": 0.0})
    simulate_coast_down(machine, case, output=folder / "c.h5")
    return folder / "c.h5"


def _part(folder):
    samples = {name: np.arange(12.0) for name in ("speed", "displacement")}
    write_part(part_path(folder, 0), samples, np.zeros((2, 3)))
    return part_path(folder, 0)


@cache
def _coasted():
    with TemporaryDirectory() as folder:
        return load_coast_down(_coast_down(Path(folder)))


def _joined(part):
    """What a coast-down that has ended makes of its parts."""
    write_coast_down(_coasted(), "d" * 64, part.parent, 1, part.parent / "joined.h5")
    with h5py.File(part.parent / "joined.h5") as joined:
        return {name: joined[name][()].tolist() for name in ("speed", "displacement", "contact_log")}


def _checkpoint(folder):
    save_checkpoint(folder, "d" * 64, {"state": np.arange(50.0), "time": np.array(0.5)})
    return next(folder.iterdir())


def _estimate(path):
    peaks = {"peak_force_N": value(3300.0, 3200.0, 3400.0), "peak_stress_Pa": value(1.5e9)}
    content = published(machine="m", bearings={"NDE": bearing(peaks)}).as_json()
    write_json(path, content, sealed=True)


def _document(folder):
    assert run(["check", str(_machine(folder)), "--json", str(folder / "check.json")]) == 0
    return folder / "check.json"


def _log(folder):
    for digest in "abc":
        add_drop(folder / "drops.db", replace(DROP, sha256=digest * 64))
    allow(folder / "drops.db", "LP-400", "2026", drops=12, source="contract")
    return folder / "drops.db"


def _study(part):
    def make(folder):
        study = study_with()
        place = open_folder(study, folder / "study")
        width = len(columns_of(study.machine))
        for number in range(study.shards):
            drops = study.drops_of(number)
            values = np.arange(len(drops) * width, dtype=float).reshape(-1, width)
            varied, reasons = study.values(drops.start, drops.stop), ("",) * len(drops)
            shard = Shard(first=drops.start, varied=varied, numbers=values, reasons=reasons)
            publish(place, study, number, shard)
        return place.path / part

    return make


def _numbers(path):
    folder = next(parent for parent in path.parents if parent.name == "study")
    found = load_results(folder)
    return study_of(folder).digest, [values.tolist() for values in found.numbers.values()]


def _job(part):
    def make(folder):
        space = Workspace(folder)
        space.prepare()
        job = space.new_job("drop", {})
        made = job.path / "look.made"
        made.mkdir()
        clock = np.arange(2000.0)
        write_traces(made, "motion", clock, {"x0": np.sin(clock)})
        write_json(made / "page.json", {"traces": {"name": "motion"}})
        write_json(made / "document.json", {"record": "x"}, sealed=True)
        publish_result(job, "look", "0" * 16, made, job.digests())
        write_state(job, "look", {"state": "done", "run": "0" * 16})
        return job.path / part

    return make


def _looked(path):
    """What the page shows of a job: its file, its state, its result, its histories."""
    job = Job(next(parent for parent in path.parents if parent.parent.name == "jobs"))
    state = state_of(job, "look")
    if state["state"] == "failed":
        raise RotordropError(state["error"])
    folder = result_folder(job, "look")
    traces = open_traces(folder, "motion", ("x0",))
    return job.read()["name"], state, (folder / "page.json").read_text(), float(np.sum(traces.values))


def _watched(folder):
    arrived = Arrived.at(_hdf5(folder))
    kept = Kept(Workspace(folder / "kept"))
    kept.prepare()
    return kept.job(kept.take(arrived)).path / STATUS_FILE


def _told(path):
    """What a watcher knows of a record that it took."""
    told = status_of(Job(path.parent))
    if told["outcome"] == "failed":
        raise RotordropError(told["why"])
    return told


VERBS = ("look", "estimate", "waterfall", "check")
PAGES = (*(f"jobs.results:write_{verb}" for verb in VERBS), "jobs.work:_channels")
STUDY, JOBS, RUN, COAST = "study.folder:", "jobs.", f"look.{'0' * 16}/", "simulate.coast_down_file:"
WRITTEN = {
    "machine": Written(
        ("machine.saving:save_machine", "cli._output:deliver_text"), _machine, load_machine, sealed=False
    ),
    "rotor of ROSS": Written(("machine.ross_files:write_ross",), _ross, read_ross, sealed=False),
    "profile": Written(
        ("record.profile:save_profile",),
        _into("p.toml", lambda path: save_profile(PROFILE, path)),
        load_profile,
        sealed=False,
    ),
    "record, HDF5": Written(("record.record:write_hdf5",), _hdf5, partial(read_recording, profile=Profile())),
    "drop": Written(("simulate.result:save",), _into("drop.h5", lambda p: _dropped().save(p)), load_result),
    "coast-down": Written((f"{COAST}write_coast_down",), _coast_down, load_coast_down),
    "part of a coast-down": Written((f"{COAST}write_part",), _part, _joined),
    "checkpoint": Written(
        ("simulate.coast_down_file:save_checkpoint",),
        _checkpoint,
        lambda p: load_checkpoint(p.parent, "d" * 64),
    ),
    "estimate": Written(
        ("estimate.estimate:save",), _into("e.json", _estimate), lambda p: read_drop(p).as_json()
    ),
    "document": Written(("cli._output:deliver",), _document, read_document),
    "log": Written((), _log, read_log),
    "shard": Written((f"{STUDY}publish",), _study("shards/000001.npy"), _numbers),
    "plan": Written((f"{STUDY}open_folder",), _study("plan.json"), _numbers),
    "machine of a study": Written((f"{STUDY}open_folder",), _study("machine.toml"), _numbers),
    "job": Written((f"{JOBS}workspace:write", f"{JOBS}workspace:new_job"), _job("job.json"), _looked),
    "state": Written((f"{JOBS}runner:write_state",), _job("look.state.json"), _looked),
    "result": Written((f"{JOBS}runner:publish",), _job("look.result.json"), _looked),
    "trace": Written((f"{JOBS}traces:write_traces",), _job(f"{RUN}motion.values.npy"), _looked),
    "watched record": Written(("watch.kept:take", "watch.kept:keep_status"), _watched, _told),
    "page": Written(PAGES, _job(f"{RUN}page.json"), _looked),
}
NEVER_READ = {
    "physics._numba:save_overload": "the compiler's own objects, compiled again where they do not load",
    "report.page:write_page": "for people",
    "cli._terminal:open_streams": "the null device",
    "examples.__init__:copy_example": "what the package brings, read as a machine and a record",
    "estimate.histories:_csv": "a table for other programs",
    "estimate.histories:_mat": "for MATLAB",
    "estimate.histories:_parquet": "for other programs",
    "estimate.histories:_hdf5": "for other programs",
    "spectrum.coast_down:write_findings": "for other programs",
    "study.summary:save_results": "for other programs",
    "study.summary:_save_parquet": "for other programs",
    "jobs.workspace:token": "whatever is no token is replaced by one",
    "web.desk:receive": "what was sent; its digest stands in the job",
    "jobs.runner:_begin": "makes room for the number of a process",
    "jobs.child:main": "the number of a process; whatever is none is passed over",
    "record.readers.__init__:read_gzip": "a temporary copy",
    "watch.kept:put": "what arrived; its digest stands in the job",
    "watch.kept:quarantine": "for people",
}


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_damaged_file_ends_in_a_sentence_and_never_silently(kind, tmp_path):
    entry = WRITTEN[kind]
    file = entry.make(tmp_path)
    whole, expected = file.read_bytes(), entry.read(file)
    for what, damaged in _damaged(whole, kind):
        file.write_bytes(damaged)
        try:
            found = entry.read(file)
        except RotordropError as refusal:
            assert len(str(refusal)) > 20, what
            assert file.name in str(refusal) or kind == "part of a coast-down", (what, str(refusal))
        else:
            assert not entry.sealed or repr(found) == repr(expected), f"{what} of {kind} was silent"
    file.write_bytes(whole)
    assert repr(entry.read(file)) == repr(expected)


def _damaged(whole, kind):
    random = np.random.default_rng(list(kind.encode()))
    found = []
    for bit in random.integers(0, 8 * len(whole), 20).tolist():
        raw = bytearray(whole)
        raw[bit // 8] ^= 1 << bit % 8
        found.append((f"bit {bit}", bytes(raw)))
    for at in random.integers(0, len(whole), 5).tolist():
        found.append((f"zeros at {at}", whole[:at] + bytes(min(64, len(whole) - at)) + whole[at + 64 :]))
        found.append((f"cut at {at}", whole[:at]))
        found.append((f"lost at {at}", whole[:at] + whole[at + 16 :]))
    found += [("empty", b""), ("a list", b"[]"), ("a table", b"{}"), ("noise", random.bytes(3000))]
    found += [("other text", b"\xff\xfe" * 40), ("deep", b"[" * 100_000)]
    return found


OF_A_PERSON = ("machine", "rotor of ROSS", "profile", "estimate")
"""Texts that a person names and may give through a pipe, as in ``rotordrop check <(make-machine)``."""


@on_posix
@pytest.mark.parametrize("kind", [kind for kind in WRITTEN if kind not in OF_A_PERSON])
def test_what_is_no_file_is_named_and_keeps_nobody_waiting(kind, tmp_path):
    file = WRITTEN[kind].make(tmp_path)
    file.unlink()
    for thing in NO_FILE.values():
        thing(file)
        with in_time(), pytest.raises(RotordropError, match=re.escape(file.name)):
            WRITTEN[kind].read(file)
        clear_of_no_file(file)


@on_posix
@pytest.mark.parametrize("thing", NO_FILE)
@pytest.mark.parametrize(
    ("kind", "place"),
    [
        ("part of a coast-down", "part-000000.h5"),
        ("machine of a study", "study/machine.toml"),
        ("plan", "study/plan.json"),
        ("log", "drops.db"),
        ("log", "drops.db-journal"),
        ("log", "drops.db-wal"),
    ],
)
def test_what_is_no_file_where_one_is_written_is_named(kind, place, thing, tmp_path):
    file = tmp_path / place
    file.parent.mkdir(exist_ok=True)
    NO_FILE[thing](file)
    with in_time():
        try:
            WRITTEN[kind].make(tmp_path)
        except RotordropError as refusal:
            assert file.name in str(refusal)
        else:
            assert thing == "link that leads nowhere" and file.is_file()


@pytest.mark.parametrize("kind", ["drop", "coast-down", "estimate", "plan"])
def test_a_file_of_another_version_is_refused_in_words(kind, tmp_path):
    entry = WRITTEN[kind]
    file = entry.make(tmp_path)
    if file.suffix == ".h5":
        written = file.rename(tmp_path / "written.h5")
        with h5py.File(written) as old, new_hdf5(file) as content:
            content.attrs.update({**old.attrs, "format": re.sub(r"\d+$", "999", old.attrs["format"])})
    else:
        told = json.loads(file.read_text())
        told["format"] = told["format"] + 1 if isinstance(told["format"], int) else f"{told['format']}9"
        write_json(file, told, sealed=True)
    before = file.read_bytes()
    with pytest.raises(RotordropError, match=r"999|format|version"):
        entry.read(file)
    assert file.read_bytes() == before


@pytest.mark.parametrize("kind", ["estimate", "document", "drop", "coast-down"])
def test_a_file_that_was_changed_by_hand_says_so_and_the_way_out(kind, tmp_path):
    entry = WRITTEN[kind]
    file = entry.make(tmp_path)
    expected = repr(entry.read(file))
    if file.suffix == ".h5":
        with h5py.File(file, "a") as content:
            content.attrs["machine_name"] = "another"
        with pytest.raises(DamagedFileError, match=r"was changed after rotordrop wrote it; simulate the"):
            entry.read(file)
        return
    told = json.loads(file.read_text())
    # another program may write the same values in its own way
    file.write_text(json.dumps(dict(reversed(told.items()))))
    assert len(repr(entry.read(file))) == len(expected)
    file.write_text(json.dumps({**told, "machine": "another"}))
    changed = r"was changed: .*give it as .*rotordrop|give it as a command wrote"
    with pytest.raises(DamagedFileError, match=changed):
        entry.read(file)
    del told["document_sha256"]
    file.write_text(json.dumps({**told, "machine": "another"}))
    if kind == "estimate":  # the way out that the sentence names
        assert "another" in repr(entry.read(file))
    else:
        with pytest.raises(DamagedFileError, match="give it as a command wrote it with --json"):
            entry.read(file)


def _make_on_a_full_disk(kind, folder):
    """Make a file where none may have more than 40 bytes; this process ends with what came of it."""
    import resource

    ended = 4
    try:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (40, 40))
        WRITTEN[kind].make(folder)
        ended = 5
    except RotordropError as error:
        ended = 0 if re.search(r"cannot|full|too large", str(error), re.IGNORECASE) else 3
    finally:
        os._exit(ended)


@pytest.mark.skipif(sys.platform != "linux", reason="the system limits the size of files")
@pytest.mark.parametrize("kind", WRITTEN)
def test_a_disk_that_is_full_ends_in_a_sentence_and_leaves_nothing_half_written(kind, tmp_path):
    (tmp_path / "whole").mkdir()
    (tmp_path / "full").mkdir()
    whole = WRITTEN[kind].make(tmp_path / "whole")  # compiles and computes what needs to be
    if (child := os.fork()) == 0:
        _make_on_a_full_disk(kind, tmp_path / "full")
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    left = [file for file in (tmp_path / "full").rglob("*") if file.is_file()]
    assert [file for file in left if file.name == whole.name and file.suffix != ".db"] == []
    assert [file for file in left if file.name.startswith(".")] == []


WRITERS = set("write_json write_text atomic_path atomic_folder new_hdf5 write_bytes File savez".split())


def test_every_function_that_writes_a_file_is_told_here():
    """Who writes a file that is read again has a row above, with its reader."""
    writing = set()
    for source in SOURCE.rglob("*.py"):
        if source.name in ("files.py", "every_format.py"):
            continue
        module = ".".join(source.relative_to(SOURCE).with_suffix("").parts)
        for function in ast.walk(ast.parse(source.read_text())):
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
                calls = [node for node in ast.walk(function) if isinstance(node, ast.Call)]
                if any(_writes(call) for call in calls):
                    writing.add(f"{module}:{function.name}")
    told = {name for entry in WRITTEN.values() for name in entry.by} | set(NEVER_READ)
    assert writing - told == set(), "these write files that nobody damages"
    assert told - writing == set(), "these write none any more"


def _writes(call):
    name = getattr(call.func, "attr", getattr(call.func, "id", ""))
    if name == "File":
        return any(isinstance(one, ast.Constant) and one.value in ("w", "a") for one in call.args)
    if name == "open":
        return any(isinstance(one, ast.Constant) and str(one.value) in ("wb", "w") for one in call.args)
    return name in WRITERS
