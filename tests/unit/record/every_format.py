"""One small recording, written in every format by hand or by the format's own library."""

from __future__ import annotations

import gzip
import io
import struct
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from rotordrop.machine import example_machine
from rotordrop.record.profile import Clock, Profile, SpeedSource, TextLayout
from rotordrop.record.record import Record, save_record

COUNT, STEP = 240, 2e-4
MACHINE = example_machine("lp400")
NAMES = [sensor.name for sensor in MACHINE.sensors]
_random = np.random.default_rng(7)
_fall = np.clip(np.arange(COUNT) * STEP - 0.02, 0.0, 0.009)[:, None] ** 2 * 4.9
READINGS = np.round(
    1e6 * _fall * np.array([-0.7, -0.7, -0.7, -0.7])
    + 8.0 * np.sin(377.0 * STEP * np.arange(COUNT)[:, None] + np.arange(4))
    + _random.normal(0.0, 0.4, (COUNT, 4)),
    2,
)
"""Displacements [µm]: an orbit, a fall of 0.2 mm, a rest."""

TIME = np.arange(COUNT) * STEP - 0.02
SPEED = np.round(60.0 + _random.normal(0.0, 0.02, COUNT), 3)

BY_PROFILE = Profile(
    full_scale="500 um",
    unit="um",
    time=Clock(step="200 us", start="-20 ms"),
    text=TextLayout(names=tuple(NAMES)),
    speed=SpeedSource(constant="60 Hz"),
)
"""What WAV and a bare matrix do not say."""


def record() -> Record:
    """The recording in memory."""
    turning = 2.0 * np.pi * SPEED
    return Record(
        time=TIME,
        signals=READINGS * 1e-6,
        sensors=MACHINE.sensors,
        sampling_rate=1.0 / STEP,
        speed=turning,
        speed_time=TIME,
        speed_readings=turning,
    )


def _table(separator: str, decimal: str, count: bool = False) -> bytes:
    names = ["Sample" if count else "Time [s]", *(f"{n} [um]" for n in NAMES), "Speed [Hz]"]
    lines = ["Sampling rate: 5000 Hz"] * count + [separator.join(names)]
    for i in range(COUNT):
        first = str(i) if count else f"{TIME[i]:.4f}"
        fields = [first, *(f"{v:.2f}" for v in READINGS[i]), f"{SPEED[i]:.3f}"]
        lines.append(separator.join(fields).replace(".", decimal))
    return ("\n".join(lines) + "\n").encode()


def _mat(path: Path, packed: bool) -> None:
    columns = {f"{name}_um": READINGS[:, i] for i, name in enumerate(NAMES)}
    scipy.io.savemat(path, {"t": TIME, "speed_Hz": SPEED} | columns, do_compression=packed)


def _mat_73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        columns = {f"{name}_um": READINGS[:, i] for i, name in enumerate(NAMES)}
        for name, values in ({"t": TIME, "speed_Hz": SPEED} | columns).items():
            file.create_dataset(name, data=np.atleast_2d(values)).attrs["MATLAB_class"] = np.bytes_("double")
    content = bytearray(path.read_bytes())
    content[:512] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(508, b" ") + b"\x00\x02IM"
    path.write_bytes(content)


def as_tdms(record: Record, path: Path, *, without: tuple[str, ...] = ()) -> None:
    """Two groups with the clock of each, `without` some of its properties."""
    nptdms = pytest.importorskip("nptdms")

    def channel(group: str, name: str, values: np.ndarray, unit: str, start: float, step: float) -> object:
        properties = {
            "wf_increment": step,
            "wf_start_offset": start,
            "wf_start_time": np.datetime64("2019-10-16"),
            "unit_string": unit,
        }
        properties = {key: value for key, value in properties.items() if key not in without}
        return nptdms.ChannelObject(group, name, values, properties=properties)

    objects = [
        channel(
            "Displacement", name, record.signals[:, i] * 1e6, "um", record.time[0], 1.0 / record.sampling_rate
        )
        for i, name in enumerate(record.channel_names)
    ]
    step = float(np.median(np.diff(record.speed_time)))
    objects.append(
        channel("Speed", "ShaftSpeed", record.speed_readings / (2 * np.pi), "Hz", record.speed_time[0], step)
    )
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.RootObject({"name": "drop"}), *objects])


def as_uff(record: Record, path: Path, binary: bool = True) -> None:
    """Dataset 58 as the format prescribes, written by hand: an independent counterpart of the reader."""
    pytest.importorskip("pyuff")
    count, step = len(record.time), 1.0 / record.sampling_rate
    parts = []
    for i, name in enumerate(record.channel_names):
        kind = (
            f"{58:6d}b{1:6d}{2:6d}{11:12d}{8 * count:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
            if binary
            else f"{58:6d}{'':74}"
        )
        lines = [f"{-1:6d}", kind, *(f"{text:<80}" for text in (name, "drop", "NONE", "NONE", "NONE"))]
        lines.append(f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10}{1:10d}{1:4d} {'NONE':>10}{0:10d}{0:4d} ")
        lines.append(f"{4:10d}{count:10d}{1:10d}{record.time[0]:13.5e}{step:13.5e}{0.0:13.5e}")
        for what, label, unit in (
            (17, "Time", "s"),
            (8, "Displacement", "m"),
            (0, "NONE", "NONE"),
            (0, "NONE", "NONE"),
        ):
            lines.append(f"{what:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}")
        parts.append(("\n".join(lines) + "\n").encode())
        values = record.signals[:, i]
        if binary:
            parts.append(values.astype("<f8").tobytes())
        else:
            rows = [values[k : k + 4] for k in range(0, count, 4)]
            parts.append("".join("".join(f"{v:20.11e}" for v in row) + "\n" for row in rows).encode())
        parts.append(f"{-1:6d}\n".encode())
    path.write_bytes(b"".join(parts))


def _wav(path: Path) -> None:
    counts = np.rint(READINGS / 500.0 * 2**15).astype("<i2").tobytes()
    form = struct.pack("<HHIIHH", 1, 4, 5000, 40_000, 8, 16)
    body = b"WAVEfmt " + struct.pack("<I", len(form)) + form
    body += b"data" + struct.pack("<I", len(counts)) + counts
    path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)


def _comtrade(path: Path, kind: str) -> None:
    lines = ["Station,Recorder,1999", "5,5A,0D"]
    for number, name in enumerate([*NAMES, "Speed"], start=1):
        unit = "Hz" if name == "Speed" else "um"
        lines.append(f"{number},{name},,,{unit},0.01,0,0,-32767,32767,1,1,P")
    stamps = ["16/10/2019,13:42:07.000000", "16/10/2019,13:42:07.020000"]
    lines += ["50", "1", f"5000,{COUNT}", *stamps, kind, "1"]
    path.with_suffix(".cfg").write_text("\r\n".join(lines) + "\r\n")
    counts = np.rint(np.column_stack([READINGS, SPEED]) * 100).astype(int)
    if kind == "ASCII":
        rows = [f"{i + 1},{200 * i}," + ",".join(map(str, row)) for i, row in enumerate(counts)]
        path.with_suffix(".dat").write_text("\r\n".join(rows) + "\r\n")
    else:
        rows_b = [struct.pack("<II5h", i + 1, 200 * i, *row) for i, row in enumerate(counts)]
        path.with_suffix(".dat").write_bytes(b"".join(rows_b))


def _xlsx(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["Time [s]", *(f"{name} [um]" for name in NAMES), "Speed [Hz]"])
    for i in range(COUNT):
        book.active.append([float(TIME[i]), *READINGS[i].tolist(), float(SPEED[i])])
    book.save(path)


def _npz(path: Path) -> None:
    np.savez(path, t=TIME, speed_Hz=SPEED, **{f"{name}_um": READINGS[:, i] for i, name in enumerate(NAMES)})


def _npy(path: Path) -> None:
    held = io.BytesIO()
    np.save(held, READINGS)
    path.write_bytes(held.getvalue())


def _hdf5_packed(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, values, unit in [
            *((name, READINGS[:, i], "um") for i, name in enumerate(NAMES)),
            ("speed", SPEED, "Hz"),
        ]:
            made = file.create_dataset(name, data=values, chunks=(60,), compression="gzip", fletcher32=True)
            made.attrs["unit"] = unit
        file.create_dataset("time", data=TIME).attrs["unit"] = "s"


WRITERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "CSV comma": ("csv", lambda path: path.write_bytes(_table(",", "."))),
    "CSV German": ("csv", lambda path: path.write_bytes(_table(";", ","))),
    "TXT counter": ("txt", lambda path: path.write_bytes(_table("\t", ".", count=True))),
    "CSV gzip": ("csv.gz", lambda path: path.write_bytes(gzip.compress(_table(",", "."), mtime=0))),
    "COMTRADE ASCII": ("dat", lambda path: _comtrade(path, "ASCII")),
    "COMTRADE binary": ("dat", lambda path: _comtrade(path, "BINARY")),
    "COMTRADE cfg": ("cfg", lambda path: _comtrade(path, "ASCII")),
    "WAV": ("wav", _wav),
    "NPY": ("npy", _npy),
    "NPZ": ("npz", _npz),
    "HDF5": ("h5", lambda path: save_record(record(), path)),
    "HDF5 gzip": ("h5", _hdf5_packed),
    "MAT plain": ("mat", lambda path: _mat(path, packed=False)),
    "MAT packed": ("mat", lambda path: _mat(path, packed=True)),
    "MAT 7.3": ("mat", _mat_73),
    "TDMS": ("tdms", lambda path: as_tdms(record(), path)),
    "UFF text": ("uff", lambda path: as_uff(record(), path, binary=False)),
    "UFF binary": ("uff", lambda path: as_uff(record(), path, binary=True)),
    "Excel": ("xlsx", _xlsx),
}
"""Suffix and writer of every format by its name."""

NEEDS = {"TDMS": "nptdms", "UFF text": "pyuff", "UFF binary": "pyuff", "Excel": "openpyxl"}
"""Packages beyond those always there."""

CARRIES = {
    "WAV": 500e-6 / 2**15,
    "COMTRADE binary": 0.01e-6,
    "COMTRADE ASCII": 0.01e-6,
    "COMTRADE cfg": 0.01e-6,
}
"""Steps in which a format carries the readings [m]; the others carry them whole."""

WITHOUT_SPEED = ("UFF text", "UFF binary")
BY_HAND = ("WAV", "NPY")
"""Formats that say neither speed nor unit: `BY_PROFILE` does."""


def written(name: str, folder: Path) -> Path:
    """Write the recording in a format and give its path."""
    suffix, write = WRITERS[name]
    path = folder / f"drop.{suffix}"
    write(path)
    return path
