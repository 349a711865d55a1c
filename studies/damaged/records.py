"""Damage small recordings of every format and see what the program makes of them.

Usage: python studies/damaged/records.py FORMAT COUNT [FIRST]  random damage from number FIRST on
       python studies/damaged/records.py FORMAT cut         cut after every byte, 1000 at a time
       FORMAT may be all; "HDF5 of others" is HDF5 without the digest that this program puts
       behind its own
       python studies/damaged/records.py summary

Number and format are the seed of a damage. A block of 250 that is in ``results/records.jsonl`` is not made
again. The libraries of binary formats run in this process, which is forked for every block: a file that ends
or holds up one is then read as a user would, through the child process of the program, and the block goes on
behind it.
"""

from __future__ import annotations

import gzip
import io
import json
import multiprocessing
import queue
import sys
import tempfile
import time
import traceback
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from tests.unit.record import every_format
from tests.unit.record.every_format import BY_HAND, BY_PROFILE, MACHINE, WRITERS, written

from rotordrop.errors import RecordError
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.recorder import check_blocks, check_clock
from rotordrop.record.record import Record, read_record
from rotordrop.record.sandbox import Content

BLOCK = 250
CUT_ROWS = 60
"""Rows of the recording that is cut after every byte."""

HANG_S = 5.0
RESULTS = Path(__file__).parent / "results" / "records.jsonl"
KINDS = ("bits", "cut", "deleted", "twice", "zeroed", "header", "pushed in", "swapped")
TEXTS = ("CSV comma", "CSV German", "TXT counter", "COMTRADE ASCII", "UFF text")
PACKED = ("CSV gzip", "NPZ", "Excel")
"""Formats whose rows are lines, and those with a checksum over what is packed."""
SEAL = 48
WRITERS["HDF5 of others"] = ("h5", lambda path: _of_others(path))


def _of_others(path: Path) -> None:
    """The HDF5 of this program as others write it."""
    content = written("HDF5", path.parent).read_bytes()
    path.write_bytes(content[:-SEAL] if content[-SEAL:].startswith(b"rotordrop sha256") else content)


def _rows(content: bytes, random: np.random.Generator) -> bytes:
    """A text with one row lost, twice, exchanged, merged or turned, or with one digit or word in it."""
    lines = content.split(b"\n")
    way, at, other = int(random.integers(7)), *random.integers(len(lines) // 2, len(lines) - 1, 2).tolist()
    sign = next(sign for sign in (b"\t", b";", b",", b" ") if sign in lines[at])
    cells = lines[at].split(sign)
    if way == 0:
        del lines[at]
    elif way == 1:
        lines.insert(at, lines[at])
    elif way == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif way == 3:
        lines[at : at + 2] = [b"".join(lines[at : at + 2])]
    elif way == 4:
        lines[at] = sign.join(cells[1:] + cells[:1])
    elif way == 5:
        digits = [i for i, letter in enumerate(lines[at]) if 48 <= letter <= 57]
        row = bytearray(lines[at])
        row[digits[int(random.integers(len(digits)))]] = int(random.integers(48, 58))
        lines[at] = bytes(row)
    else:
        cells[int(random.integers(len(cells)))] = b"n/a"
        lines[at] = sign.join(cells)
    return b"\n".join(lines)


def _below_the_checksum(content: bytes, seed: int) -> bytes:
    """A packed file whose content was damaged before it was packed."""
    if content[:2] == b"\x1f\x8b":
        return gzip.compress(damaged(gzip.decompress(content), seed, "")[1])
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        parts = [part for part in old.infolist() if part.file_size]
        hit = parts[seed % len(parts)].filename
        for part in parts:
            inner = old.read(part)
            new.writestr(part.filename, damaged(inner, seed, "")[1] if part.filename == hit else inner)
    return made.getvalue()


def damaged(content: bytes, seed: int, name: str) -> tuple[str, bytes]:
    """Damage a file of a format in one of the ways that it has."""
    random = np.random.default_rng(seed)
    kinds = (*KINDS, *["rows"] * (name in TEXTS), *["below the checksum"] * (name in PACKED))
    kind = kinds[int(random.integers(len(kinds)))]
    if kind == "rows":
        return kind, _rows(content, random)
    if kind == "below the checksum":
        return kind, _below_the_checksum(content, seed)
    return kind, _bytes(content, kind, random)


def _bytes(content: bytes, kind: str, random: np.random.Generator) -> bytes:
    """A file with bytes that are others, lost, there twice, zero or elsewhere."""
    data = bytearray(content)
    at = int(random.integers(len(data)))
    length = int(np.exp(random.uniform(0.0, np.log(max(len(data) // 4, 2)))))
    if kind == "bits":
        for _ in range(int(random.integers(1, 9))):
            data[int(random.integers(len(data)))] ^= 1 << int(random.integers(8))
    elif kind == "cut":
        del data[at:]
    elif kind == "deleted":
        del data[at : at + length]
    elif kind == "twice":
        data[at:at] = data[at : at + length]
    elif kind == "zeroed":
        data[at : at + length] = bytes(len(data[at : at + length]))
    elif kind == "pushed in":
        data[at:at] = random.bytes(length)
    elif kind == "swapped":
        data[at : at + 2 * length] = data[at + length : at + 2 * length] + data[at : at + length]
    else:
        for _ in range(int(random.integers(1, 9))):
            data[int(random.integers(min(len(data), 512)))] = int(random.integers(256))
    return bytes(data)


def _plain(path: Path, kind: str) -> Content:
    """Unpack in this process what the program unpacks in a child."""
    content: Content = import_module(f"rotordrop.record.readers.{kind}").unpacked(path)
    return content


def outcome(path: Path, whole: Record, name: str) -> tuple[str, float]:
    """What became of a file, and by how much values changed unseen [m]."""
    profile = BY_PROFILE if name in BY_HAND else None
    try:
        record = read_record(path, MACHINE, profile=profile)
    except RecordError:
        return "refused", 0.0
    except Exception:
        return "traceback: " + traceback.format_exc().strip().splitlines()[-1][:120], 0.0
    if len(record.time) == len(whole.time):
        change = float(np.nanmax(np.abs(record.signals - whole.signals), initial=0.0))
        speed = record.speed is None or np.array_equal(record.speed, np.asarray(whole.speed))
        if change == 0.0 and np.array_equal(record.time, whole.time) and speed:
            return "identical", 0.0
    if record.warnings:
        return "warned", 0.0
    found = check_clock(record, drop=False) + check_channels(record)
    if not found:
        found = check_blocks(record)
    if found:
        return "gate", 0.0
    if len(record.time) != len(whole.time):
        return "silent: count of samples", abs(len(record.time) - len(whole.time)) * 1.0
    if not np.array_equal(record.time, whole.time):
        return "silent: time", change
    return ("silent: values", change) if change > 0.0 else ("silent: speed", 0.0)


def _work(name: str, jobs: list[tuple[int, str, bytes]], folder: Path, answers: Any) -> None:
    """Read the damaged files of a block one after the other, telling before each."""
    for module in ("hdf5", "matlab", "tdms", "uff", "excel"):
        reader = import_module(f"rotordrop.record.readers.{module}")
        if hasattr(reader, "unpack"):
            reader.unpack = _plain  # type: ignore[attr-defined]
    path, whole = _seed(name, folder)
    for number, kind, content in jobs:
        answers.put((number, kind, "begun", 0.0, 0.0))
        path.write_bytes(content)
        begun = time.perf_counter()
        said, change = outcome(path, whole, name)
        answers.put((number, kind, said, change, time.perf_counter() - begun))
    answers.put(None)


def _seed(name: str, folder: Path) -> tuple[Path, Record]:
    path = written(name, folder)
    profile = BY_PROFILE if name in BY_HAND else None
    whole = read_record(path, MACHINE, profile=profile)
    assert np.allclose(whole.signals, every_format.READINGS * 1e-6, atol=1e-8)
    return path, whole


def judged(name: str, jobs: list[tuple[int, str, bytes]]) -> Iterator[tuple[int, str, str, float]]:
    """Outcome of every damaged file; a worker that dies or hangs is replaced behind the file that did it."""
    context = multiprocessing.get_context("fork")
    while jobs:
        with tempfile.TemporaryDirectory() as folder:
            answers: Any = context.Queue()
            worker = context.Process(target=_work, args=(name, jobs, Path(folder), answers))
            worker.start()
            at = None
            while True:
                try:
                    answer = answers.get(timeout=HANG_S * 4 if at is None else HANG_S)
                except queue.Empty:
                    break
                if answer is None:
                    at, jobs = None, []
                    break
                number, kind, said, change, _ = answer
                at = number
                if said != "begun":
                    yield number, kind, said, change
                    jobs = jobs[1:]
            worker.kill()
            worker.join()
            if jobs and at is not None:
                yield _as_a_user(name, jobs[0], Path(folder))
                jobs = jobs[1:]
            elif jobs:
                raise SystemExit(f"{name}: the worker did not begin")


def _as_a_user(name: str, job: tuple[int, str, bytes], folder: Path) -> tuple[int, str, str, float]:
    """Read a file that ended or held up the library, through the program's own child process."""
    number, kind, content = job
    path, whole = _seed(name, folder)
    path.write_bytes(content)
    begun = time.perf_counter()
    said, change = outcome(path, whole, name)
    took = time.perf_counter() - begun
    return (
        number,
        kind,
        f"library ended or hung, program: {said}, {'hang' if took > 60 else 'in time'}",
        change,
    )


def run(name: str, jobs: list[tuple[int, str, bytes]], label: str) -> None:
    """Judge a block and add one line to the results."""
    counts: Counter[str] = Counter()
    changes: list[tuple[int, str, float]] = []
    for number, kind, said, change in judged(name, jobs):
        counts[f"{kind}|{said}"] += 1
        if said.startswith(("silent", "traceback", "library")):
            changes.append((number, said, change))
    line = {"format": name, "block": label, "files": len(jobs), "counts": dict(counts), "told": changes}
    RESULTS.parent.mkdir(exist_ok=True)
    with RESULTS.open("a") as out:
        out.write(json.dumps(line) + "\n")


def lines() -> list[dict[str, Any]]:
    """Results so far."""
    return [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.is_file() else []


def summary() -> None:
    """Print outcomes by format and by kind, and the sizes of silent changes."""
    total: Counter[str] = Counter()
    for name in WRITERS:
        mine: Counter[str] = Counter()
        for line in lines():
            if line["format"] == name:
                for key, count in line["counts"].items():
                    mine[key.split("|")[1].split(":")[0] if "traceback" in key else key.split("|")[1]] += (
                        count
                    )
        total += mine
        print(f"{name:16} {sum(mine.values()):6} {dict(mine)}")
    by_kind: dict[str, Counter[str]] = {}
    for line in lines():
        for key, count in line["counts"].items():
            kind, said = key.split("|")
            by_kind.setdefault(kind, Counter())[said] += count
    for kind, counts in by_kind.items():
        print(f"{kind:20} {sum(counts.values()):6} {dict(counts)}")
    sizes = [c for line in lines() for _, said, c in line["told"] if said.startswith("silent: values")]
    print(f"all {sum(total.values())} {dict(total)}")
    if sizes:
        um = 1e6 * np.array(sizes)
        above = (
            f"{int(np.sum(um > 5.0))} above 5 um, {int(np.sum(um > 50.0))} above 50, largest {um.max():.0f}"
        )
        print(f"silent values: {len(um)}, median {np.median(um):.3g} um, {above}")


def _shorten(rows: int) -> None:
    """Let the recording that is written be the beginning of the usual one."""
    every_format.COUNT = rows
    for name in ("READINGS", "TIME", "SPEED"):
        setattr(every_format, name, getattr(every_format, name)[:rows])


def run_format(name: str, wanted: str, first: int) -> None:
    """Judge what is missing of a format."""
    there = {(line["format"], line["block"]) for line in lines()}
    if wanted == "cut":
        _shorten(CUT_ROWS)
    rows = every_format.COUNT
    with tempfile.TemporaryDirectory() as folder:
        content = _seed(name, Path(folder))[0].read_bytes()
    if wanted == "cut":
        starts = range(0, len(content), 1000)
        blocks = {f"cut {rows} rows {a}": range(a, min(a + 1000, len(content))) for a in starts}
    else:
        blocks = {
            f"{a}": range(a, min(a + BLOCK, first + int(wanted)))
            for a in range(first, first + int(wanted), BLOCK)
        }
    for label, numbers in blocks.items():
        if (name, label) in there:
            continue
        if label.startswith("cut"):
            run(name, [(i, "every byte", content[:i]) for i in numbers], label)
        else:
            base = zlib.crc32(name.encode())
            run(name, [(i, *damaged(content, (base << 20) + i, name)) for i in numbers], label)


def main() -> None:
    """Run what the command line says."""
    if sys.argv[1] == "summary":
        summary()
        return
    for name in WRITERS if sys.argv[1] == "all" else (sys.argv[1],):
        run_format(name, sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 0)


if __name__ == "__main__":
    main()
