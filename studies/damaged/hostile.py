"""Hostile files: made to exhaust memory or time, or to lead elsewhere. What a command makes of them.

Usage: python studies/damaged/hostile.py          every case, one after the other
       python studies/damaged/hostile.py NAME...  cases whose names begin so
       python studies/damaged/hostile.py summary

Every case is a process of its own, as a user starts it: ``look`` for a record, ``check`` for a machine file.
Told are its exit status, processor time (user and system, children too), wall time, the peak memory of the
largest process (as ``/usr/bin/time -v`` gives it) and the most that all its processes held together.
"""

from __future__ import annotations

import gzip
import io
import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from tests.unit.record.every_format import NAMES, READINGS, SPEED, TIME, written

from rotordrop.machine import example_path

RESULTS = Path(__file__).parent / "results" / "hostile.jsonl"
LIMIT_S, LIMIT_MB = 5.0, 500.0
GIVEN_UP_S = 60.0

Make = Callable[[Path], Path]
HEAD = ",".join(["Time [s]", *(f"{name} [um]" for name in NAMES), "Speed [Hz]"])


def _put(folder: Path, name: str, content: bytes) -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def _gzip(folder: Path, name: str, piece: bytes, times: int) -> Path:
    path = folder / name
    with gzip.open(path, "wb", compresslevel=1) as packed:
        for _ in range(times):
            packed.write(piece)
    return path


def _nested_gzip(folder: Path) -> Path:
    content = _gzip(folder, "a.csv.gz", bytes(2**20), 200).read_bytes()
    for _ in range(3):
        content = gzip.compress(content)
    return _put(folder, "drop.csv.gz.gz.gz.gz", content)


def _sparse(folder: Path, name: str, size: int = 20 * 2**30) -> Path:
    path = folder / name
    with path.open("wb") as stream:
        stream.truncate(size)
    return path


def _link(folder: Path, target: str) -> Path:
    path = folder / "drop.csv"
    path.symlink_to(target)
    return path


def _pipe(folder: Path) -> Path:
    path = folder / "drop.csv"
    os.mkfifo(path)
    return path


def _socket(folder: Path) -> Path:
    import socket

    path = folder / "drop.csv"
    socket.socket(socket.AF_UNIX).bind(str(path))
    return path


def _csv(folder: Path, head: str) -> Path:
    rows = [f"{t:.4f}," + ",".join(map(str, row)) for t, row in zip(TIME, READINGS, strict=True)]
    text = "\n".join([head, *(f"{row},{speed}" for row, speed in zip(rows, SPEED, strict=True))])
    return _put(folder, "drop.csv", text.encode())


def _hdf5(folder: Path, fill: Callable[[h5py.File], object], name: str = "drop.h5") -> Path:
    path = folder / name
    with h5py.File(path, "w", libver="latest") as file:
        fill(file)
    return path


def _channels(file: h5py.File, **wanted: Any) -> None:
    for name in ("time", *NAMES, "speed"):
        file.create_dataset(name, **wanted)


def _deep(file: h5py.File) -> None:
    group = file
    for _ in range(3000):
        group = group.create_group("g")


def _virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout(shape=(2**40,), dtype="f8")
    layout[:] = h5py.VirtualSource("drop.h5", "v", shape=(2**40,))
    file.create_virtual_dataset("v", layout)


def _attribute(file: h5py.File, name: str, value: Any) -> None:
    for channel in ("time", *NAMES, "speed"):
        values = TIME if channel == "time" else SPEED
        file.create_dataset(channel, data=values).attrs[name] = value


def _texts(file: h5py.File) -> None:
    made = file.create_dataset("notes", shape=(2000,), dtype=h5py.string_dtype())
    made[:] = ["x" * 100_000] * 2000


def _matlab(folder: Path, elements: bytes) -> Path:
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return _put(folder, "drop.mat", head + elements)


def _matrix(rows: int, columns: int, stored: bytes) -> bytes:
    flags = struct.pack("<IIII", 6, 8, 6, 0)
    shape = struct.pack("<IIii", 5, 8, rows, columns)
    name = struct.pack("<II8s", 1, 5, b"S_NDE")
    body = flags + shape + name + struct.pack("<II", 9, min(rows * columns * 8, 2**32 - 1)) + stored
    return struct.pack("<II", 14, min(len(body) + rows * columns * 8, 2**32 - 1)) + body


def _packed_matlab(folder: Path) -> Path:
    count = 40_000_000
    body = zlib.compressobj(9)
    packed = body.compress(_matrix(count, 1, b""))
    packed += b"".join(body.compress(bytes(2**20)) for _ in range(count * 8 // 2**20 + 1)) + body.flush()
    return _matlab(folder, struct.pack("<II", 15, len(packed)) + packed)


def _wav(folder: Path, form: tuple[int, ...], said: int) -> Path:
    head = struct.pack("<HHIIHH", *form)
    body = b"WAVEfmt " + struct.pack("<I", 16) + head + b"data" + struct.pack("<I", said) + bytes(4000)
    whole = 2**32 - 1 if said > len(body) else len(body)
    return _put(folder, "drop.wav", b"RIFF" + struct.pack("<I", whole) + body)


def _tdms(folder: Path, old: int, new: int, size: int) -> Path:
    content = written("TDMS", folder).read_bytes()
    kind = {4: "<I", 8: "<Q"}[size]
    return _put(folder, "drop.tdms", content.replace(struct.pack(kind, old), struct.pack(kind, new)))


def _uff(folder: Path, old: str, new: str, binary: bool = False) -> Path:
    content = written("UFF binary" if binary else "UFF text", folder).read_bytes()
    assert old.encode() in content
    return _put(folder, "drop.uff", content.replace(old.encode(), new.encode()))


def _comtrade(folder: Path, old: str, new: str, kind: str = "ASCII") -> Path:
    path = written(f"COMTRADE {kind}", folder).with_suffix(".cfg")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return path


def _npy(folder: Path, shape: str, dtype: str = "'<f8'", name: str = "drop.npy") -> Path:
    head = f"{{'descr': {dtype}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    return _put(folder, name, b"\x93NUMPY\x02\x00" + struct.pack("<I", len(head)) + head + bytes(800))


def _npz(folder: Path, megabytes: int) -> Path:
    path = folder / "drop.npz"
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (megabytes * 2**17,)}
    )
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("t.npy", "w", force_zip64=True) as member,
    ):
        member.write(head.getvalue())
        for _ in range(megabytes):
            member.write(bytes(2**20))
    return path


def _many_members(folder: Path, name: str) -> Path:
    path = folder / name
    with zipfile.ZipFile(path, "w") as archive:
        for i in range(30_000):
            archive.writestr(f"m{i}.npy", b"")
    return path


def _workbook(folder: Path, member: str, text: bytes, times: int) -> Path:
    source, path = written("Excel", folder), folder / "bomb.xlsx"
    with (
        zipfile.ZipFile(source) as old,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as new,
    ):
        for entry in old.infolist():
            content = old.read(entry)
            if entry.filename != member:
                new.writestr(entry, content)
                continue
            at = content.index(b"<row") if b"<row" in content else len(content)
            with new.open(member, "w", force_zip64=True) as stream:
                stream.write(content[:at])
                for _ in range(times):
                    stream.write(text)
                stream.write(content[at:])
    return path


def _laughs(folder: Path) -> Path:
    entities = '<!ENTITY a0 "ha">' + "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 12))
    source, path = written("Excel", folder), folder / "laughs.xlsx"
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for entry in old.infolist():
            text = old.read(entry).decode()
            if "sheet1" in entry.filename:
                text = f"<!DOCTYPE x [{entities}]>" + text.replace("<v>", "<v>&a11;", 1)
            new.writestr(entry.filename, text)
    return path


def _machine(folder: Path, old: str, new: str) -> Path:
    text = Path(example_path("lp400")).read_text()
    assert old in text, old
    for beside in Path(example_path("lp400")).parent.glob("*.csv"):
        shutil.copy(beside, folder)
    return _put(folder, "machine.toml", text.replace(old, new, 1).encode())


def _repro(folder: Path, name: str) -> Path:
    """A file that ended or held up its library, as found; its folder is given by ROTORDROP_REPRO."""
    return Path(shutil.copy(Path(os.environ["ROTORDROP_REPRO"]) / name, folder))


FULL = {"shape": (2**17,), "dtype": "f8"}
CASES: dict[str, Make] = {
    "gzip: 1 GB of rows": lambda f: _gzip(f, "drop.csv.gz", b"0,0,0,0,0,0\n" * 87_382, 1024),
    "gzip: 4 GB of zeros": lambda f: _gzip(f, "drop.csv.gz", bytes(2**22), 1024),
    "gzip: one line of 250 MB": lambda f: _gzip(f, "drop.csv.gz", b"1" * 2**20, 250),
    "gzip: 250 MB of line ends": lambda f: _gzip(f, "drop.csv.gz", b"\n" * 2**20, 250),
    "gzip: 240 MB of rows": lambda f: _gzip(f, "drop.csv.gz", b"0,0,0,0,0,0\n" * 87_382, 240),
    "gzip: 240 MB of separators": lambda f: _gzip(f, "drop.csv.gz", b"," * 2**20, 240),
    "gzip: nested": _nested_gzip,
    "gzip: HDF5 of zeros": lambda f: _gzip(f, "drop.h5.gz", bytes(2**22), 1024),
    "gzip: NPY of 250 MB": lambda f: _gzip(f, "drop.npy.gz", bytes(2**20), 250),
    "zip: NPZ of 4 GB": lambda f: _npz(f, 4096),
    "zip: NPZ of 250 MB": lambda f: _npz(f, 250),
    "zip: 30,000 members": lambda f: _many_members(f, "drop.npz"),
    "zip: workbook of 30,000 members": lambda f: _many_members(f, "drop.xlsx"),
    "zip: workbook, sheet of 2 GB": lambda f: _workbook(f, "xl/worksheets/sheet1.xml", b" " * 2**20, 2048),
    "zip: workbook, 200 MB of rows": lambda f: _workbook(
        f, "xl/worksheets/sheet1.xml", b'<row><c t="n"><v>1</v></c></row>' * 2**15, 200
    ),
    "zip: workbook, entities": _laughs,
    "sparse: CSV of 20 GB": lambda f: _sparse(f, "drop.csv"),
    "sparse: TXT of 20 GB": lambda f: _sparse(f, "drop.txt"),
    "sparse: gzip of 20 GB": lambda f: _sparse(f, "drop.csv.gz"),
    "sparse: HDF5 of 20 GB": lambda f: _sparse(f, "drop.h5"),
    "sparse: MAT of 20 GB": lambda f: _sparse(f, "drop.mat"),
    "sparse: WAV of 20 GB": lambda f: _sparse(f, "drop.wav"),
    "sparse: TDMS of 20 GB": lambda f: _sparse(f, "drop.tdms"),
    "sparse: UFF of 20 GB": lambda f: _sparse(f, "drop.uff"),
    "sparse: NPY of 20 GB": lambda f: _sparse(f, "drop.npy"),
    "sparse: NPZ of 20 GB": lambda f: _sparse(f, "drop.npz"),
    "sparse: workbook of 20 GB": lambda f: _sparse(f, "drop.xlsx"),
    "sparse: COMTRADE of 20 GB": lambda f: _sparse(f, "drop.cfg"),
    "sparse: machine of 20 GB": lambda f: _sparse(f, "machine.toml"),
    "link: in a circle": lambda f: _link(f, "drop.csv"),
    "link: dangling": lambda f: _link(f, "nowhere.csv"),
    "link: /dev/zero": lambda f: _link(f, "/dev/zero"),
    "link: a folder": lambda f: _link(f, "."),
    "device: /dev/zero": lambda _: Path("/dev/zero"),
    "device: /dev/random": lambda _: Path("/dev/random"),
    "device: /dev/null": lambda _: Path("/dev/null"),
    "device: standard input": lambda _: Path("/dev/stdin"),
    "device: memory of the process": lambda _: Path("/proc/self/mem"),
    "pipe": _pipe,
    "socket": _socket,
    "folder": lambda f: f,
    "HDF5: 2^60 samples, nothing stored": lambda f: _hdf5(
        f, lambda file: _channels(file, shape=(2**60,), dtype="i1", chunks=(1024,))
    ),
    "HDF5: 6 channels of 512 MB": lambda f: _hdf5(
        f, lambda file: _channels(file, shape=(2**26,), dtype="f8", chunks=(2**20,), compression="gzip")
    ),
    "HDF5: 6 channels of 8 MB, nothing stored": lambda f: _hdf5(
        f, lambda file: _channels(file, shape=(2**20,), dtype="f8", chunks=(2**16,), compression="gzip")
    ),
    "HDF5: 6 channels of 40 MB, nothing stored": lambda f: _hdf5(
        f, lambda file: _channels(file, shape=(5 * 2**20,), dtype="f8", chunks=(2**16,), compression="gzip")
    ),
    "HDF5: a chunk of 2 GB": lambda f: _hdf5(
        f, lambda file: _channels(file, shape=(2**28,), dtype="i8", chunks=(2**28,), compression="gzip")
    ),
    "HDF5: 32 axes": lambda f: _hdf5(
        f, lambda file: _channels(file, shape=(2,) * 32, dtype="i1", chunks=(1,) * 31 + (2,))
    ),
    "HDF5: 20,000 data sets": lambda f: _hdf5(
        f, lambda file: [file.create_dataset(f"d{i}", data=np.zeros(10)) for i in range(20_000)]
    ),
    "HDF5: 3,000 groups deep": lambda f: _hdf5(f, _deep),
    "HDF5: groups in a circle": lambda f: _hdf5(
        f, lambda file: file.create_group("a").__setitem__("b", file["/"])
    ),
    "HDF5: virtual of itself": lambda f: _hdf5(f, _virtual),
    "HDF5: external storage /dev/zero": lambda f: _hdf5(
        f, lambda file: _channels(file, **FULL, external=[("/dev/zero", 0, h5py.h5f.UNLIMITED)])
    ),
    "HDF5: external link /etc/passwd": lambda f: _hdf5(
        f, lambda file: file.__setitem__("time", h5py.ExternalLink("/etc/passwd", "/"))
    ),
    "HDF5: 200 MB of texts": lambda f: _hdf5(f, _texts),
    "HDF5: attribute of 8 MB": lambda f: _hdf5(f, lambda file: _attribute(file, "unit", "m" * 2**23)),
    "HDF5: unit m**9**9**9**9": lambda f: _hdf5(f, lambda file: _attribute(file, "unit", "m**9**9**9**9")),
    "HDF5: rate 1e300": lambda f: _hdf5(f, lambda file: _attribute(file, "sampling_rate", 1e300)),
    "MATLAB: 2^31 rows": lambda f: _matlab(f, _matrix(2**31 - 1, 1, bytes(800))),
    "MATLAB: 2^31 rows and columns": lambda f: _matlab(f, _matrix(2**31 - 1, 2**31 - 1, bytes(800))),
    "MATLAB: 320 MB packed": _packed_matlab,
    "MATLAB: element of 4 GB": lambda f: _matlab(f, struct.pack("<II", 14, 2**32 - 1) + bytes(64)),
    "MATLAB: ends its library": lambda f: _repro(f, "segv_scipy_loadmat.mat"),
    "HDF5: holds up its library": lambda f: _repro(f, "hang_attribute_heap_zeroed.h5"),
    "WAV: 4 GB said": lambda f: _wav(f, (1, 4, 5000, 40_000, 8, 16), 2**32 - 1),
    "WAV: 65,535 channels": lambda f: _wav(f, (1, 65_535, 5000, 40_000, 65_534, 16), 4000),
    "WAV: no channel": lambda f: _wav(f, (1, 0, 5000, 40_000, 0, 16), 4000),
    "WAV: rate 0": lambda f: _wav(f, (1, 4, 0, 0, 8, 16), 4000),
    "WAV: rate 4 GHz": lambda f: _wav(f, (1, 4, 2**32 - 1, 0, 8, 16), 4000),
    "WAV: 65,535 bits": lambda f: _wav(f, (1, 1, 5000, 0, 8191, 65_535), 4000),
    "TDMS: 2^60 values": lambda f: _tdms(f, len(TIME), 2**60, 8),
    "TDMS: 2^31 values": lambda f: _tdms(f, len(TIME), 2**31, 8),
    "TDMS: 2^32 objects": lambda f: _tdms(f, 7, 2**32 - 1, 4),
    "UFF: 2^31 points": lambda f: _uff(f, f"{4:10d}{len(TIME):10d}", f"{4:10d}{2**31 - 1:10d}"),
    "UFF: 9,999,999,999 points": lambda f: _uff(f, f"{4:10d}{len(TIME):10d}", f"{4:10d}{9_999_999_999:10d}"),
    "UFF: binary, 9 GB said": lambda f: _uff(f, f"{8 * len(TIME):12d}", f"{9 * 10**9:12d}", binary=True),
    "UFF: step 0": lambda f: _uff(f, f"{2e-4:13.5e}", f"{0.0:13.5e}"),
    "COMTRADE: 999,999 channels": lambda f: _comtrade(f, "5,5A,0D", "999999,999999A,0D"),
    "COMTRADE: 1e15 samples": lambda f: _comtrade(f, "5000,240", "5000,1000000000000000"),
    "COMTRADE: binary, 1e15 samples": lambda f: _comtrade(f, "5000,240", "5000,1000000000000000", "binary"),
    "COMTRADE: 1e9 rates": lambda f: _comtrade(f, "50\n1\n", "50\n1000000000\n"),
    "COMTRADE: rate 1e300": lambda f: _comtrade(f, "5000,240", "1e300,240"),
    "NPY: 2^60 values": lambda f: _npy(f, "(1152921504606846976,)"),
    "NPY: header of brackets": lambda f: _npy(f, "(" * 100_000 + ")" * 100_000),
    "NPY: header of powers": lambda f: _npy(f, "(9**9**9**9,)"),
    "NPY: objects": lambda f: _npy(f, "(10,)", "'|O'"),
    "NPY: 100,000 fields": lambda f: _npy(f, "(1,)", str([(f"f{i}", "<f8") for i in range(100_000)])),
    "NPY: item of 2 GB": lambda f: _npy(f, "(10,)", "'|S2147483647'"),
    "CSV: unit m**9**9**9**9": lambda f: _csv(f, HEAD.replace("[um]", "[m**9**9**9**9]")),
    "CSV: unit of powers": lambda f: _csv(f, HEAD.replace("[um]", "[(9**9**9**9)m]")),
    "CSV: unit of 1e6 letters": lambda f: _csv(f, HEAD.replace("[um]", f"[{'m' * 1_000_000}]")),
    "CSV: unit of 20,000 brackets": lambda f: _csv(f, HEAD.replace("[um]", f"[{'(' * 20_000}m]")),
    "CSV: name of 1e6 blanks": lambda f: _csv(f, HEAD.replace("S_NDE_A", "S" + " " * 1_000_000 + "A")),
    "CSV: header of 200,000 digits": lambda f: _csv(f, f"Sensitivity: {'1' * 200_000}\n{HEAD}"),
    "CSV: 200,000 header lines": lambda f: _csv(f, "# x: 1 um/V\n" * 200_000 + HEAD),
    "CSV: 1e6 columns": lambda f: _put(f, "drop.csv", (b"1," * 1_000_000 + b"1\n") * 3),
    "CSV: 50 MB in one line": lambda f: _put(f, "drop.csv", b"1" * 50_000_000),
    "CSV: 50 MB in quotes": lambda f: _put(f, "drop.csv", b'"' + b"1,\n" * 16_000_000),
    "CSV: numbers of 100,000 digits": lambda f: _put(
        f, "drop.csv", HEAD.encode() + b"\n" + (b",".join([b"1" * 100_000] * 6) + b"\n") * 80
    ),
    "machine: length 24 m**9**9**9**9": lambda f: _machine(f, '"0.25 mm"', '"24 m**9**9**9**9"'),
    "machine: length of 1e6 letters": lambda f: _machine(f, '"0.25 mm"', f'"24 {"m" * 1_000_000}"'),
    "machine: 1e9 elements": lambda f: _put(
        f, "machine.toml", b'name = "x"\n[rotor]\n[[rotor.sections]]\nlength = "1 m"\nelements = 1000000000\n'
    ),
    "machine: number of 5,000 digits": lambda f: _machine(f, "node = 30", f"node = {'9' * 5000}"),
    "machine: 100,000 brackets": lambda f: _put(f, "machine.toml", b"x = " + b"[" * 100_000),
    "machine: 100,000 tables": lambda f: _put(f, "machine.toml", b"x = " + b"{a=" * 100_000),
    "machine: key of 20,000 parts": lambda f: _put(f, "machine.toml", b"a." * 20_000 + b"a = 1"),
    "machine: 1e6 keys": lambda f: _put(
        f, "machine.toml", b"".join(b"k%d = 1\n" % i for i in range(1_000_000))
    ),
    "machine: shaft table /dev/zero": lambda f: _machine(f, "lp400_shaft.csv", "/dev/zero"),
    "machine: shaft table of 20 GB": lambda f: _machine(
        _sparse(f, "s.csv").parent, "lp400_shaft.csv", "s.csv"
    ),
    "machine: /dev/zero": lambda _: Path("/dev/zero"),
}


def judged(name: str, folder: Path) -> dict[str, Any]:
    """Give one hostile file to the program."""
    path = CASES[name](folder)
    verb = ["check", str(path)] if "machine" in name else ["look", str(path), "--gap", "250um"]
    program = [sys.executable, "-m", "rotordrop", *verb]
    said = folder / "said"
    begun = time.perf_counter()
    with said.open("wb") as out:
        child = subprocess.Popen(
            program, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
        )
        together = 0.0
        while (ended := os.wait4(child.pid, os.WNOHANG))[0] == 0:
            together = max(together, _held(child.pid))
            if time.perf_counter() - begun > GIVEN_UP_S:
                os.killpg(child.pid, signal.SIGKILL)
            time.sleep(0.01)
    _, status, usage = ended
    words = said.read_text(errors="replace")
    return {
        "name": name,
        "bytes": path.lstat().st_size,
        "exit": os.waitstatus_to_exitcode(status),
        "wall_s": round(time.perf_counter() - begun, 2),
        "processor_s": round(usage.ru_utime + usage.ru_stime, 2),
        "largest_MB": round(usage.ru_maxrss / 1024),
        "together_MB": round(together),
        "traceback": "Traceback" in words,
        "said": words.replace(str(folder), "").strip()[:300],
    }


def _held(process: int) -> float:
    """Memory that a process and its children hold now [MB]."""
    total = 0.0
    for number in [process, *_children(process)]:
        with suppress(OSError, IndexError, ValueError):
            pages = int(Path(f"/proc/{number}/statm").read_text().split()[1])
            total += pages * os.sysconf("SC_PAGESIZE") / 2**20
    return total


def _children(process: int) -> list[int]:
    with suppress(OSError):
        mine = Path(f"/proc/{process}/task/{process}/children").read_text().split()
        return [int(one) for one in mine] + [more for one in mine for more in _children(int(one))]
    return []


def lines() -> dict[str, dict[str, Any]]:
    """Latest result of every case."""
    told = RESULTS.read_text().splitlines() if RESULTS.is_file() else []
    return {line["name"]: line for line in map(json.loads, told)}


def summary() -> None:
    """Print what missed the limits, and the worst of the rest."""
    found = list(lines().values())
    beyond = [
        one
        for one in found
        if one["traceback"]
        or one["exit"] < 0
        or one["processor_s"] > LIMIT_S
        or one["together_MB"] > LIMIT_MB
    ]
    for one in beyond:
        print(one)
    print(
        f"{len(found)} files: {sum(one['exit'] not in (0,) for one in found)} refused, {len(beyond)} beyond "
        f"{LIMIT_S:g} s of processor time or {LIMIT_MB:g} MB or ended badly; most "
        f"{max(one['processor_s'] for one in found)} s, {max(one['together_MB'] for one in found)} MB"
    )
    print("read:", ", ".join(one["name"] for one in found if one["exit"] == 0))


def main() -> None:
    """Run what the command line says; what is there already is not run again unless it is named."""
    if sys.argv[1:] == ["summary"]:
        summary()
        return
    done = lines()
    wanted = [
        name for name in CASES if (name.startswith(tuple(sys.argv[1:])) if sys.argv[1:] else name not in done)
    ]
    RESULTS.parent.mkdir(exist_ok=True)
    with RESULTS.open("a") as out:
        for name in wanted:
            with tempfile.TemporaryDirectory() as folder:
                out.write(json.dumps(judged(name, Path(folder))) + "\n")
                out.flush()


if __name__ == "__main__":
    main()
