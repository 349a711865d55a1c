"""One small recording, written in every format by hand or by the format's own library."""

import gzip
import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
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


def _mat_structures(path: Path) -> None:
    """One structure per channel, as several recorders export."""
    said = {"unit": "um", "dt": STEP, "t0": TIME[0]}
    entries = [said | {"name": name, "data": READINGS[:, i]} for i, name in enumerate(NAMES)]
    scipy.io.savemat(path, {"channels": np.array(entries, dtype=object)})


def _mat_73(path: Path) -> None:
    """HDF5 behind 512 bytes of its own, a structure, text as numbers."""
    with h5py.File(path, "w", userblock_size=512) as file:
        columns = {f"{name}_um": READINGS[:, i] for i, name in enumerate(NAMES)}
        columns |= {"t": TIME, "speed_Hz": SPEED, "note": [ord(sign) for sign in "LP-400"]}
        for name, values in columns.items():
            item = file.create_dataset(f"drop/{name}", data=np.atleast_2d(values).T)
            item.attrs["MATLAB_class"] = np.bytes_("char" if name == "note" else "double")
    content = bytearray(path.read_bytes())
    content[:512] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(508, b" ") + b"\x00\x02IM"
    path.write_bytes(content)


def as_tdms(record: Record, path: Path, *, without: tuple[str, ...] = ()) -> None:
    """Two groups with the clock of each, `without` some of its properties."""
    import nptdms

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


def universal(
    channels: Mapping[str, np.ndarray],
    start: float,
    step: float,
    *,
    unit: str = "m",
    time: str = "s",
    binary: str = "",
    padded: bool = True,
    single: bool = False,
) -> bytes:
    """Dataset 58 as the format prescribes, by hand: an independent counterpart of the reader.

    Text with the digits of double or single precision, or ``binary`` of the order "<" or ">".
    """
    parts, (digits, across) = [], ("13.5e", 6) if single else ("20.11e", 4)
    for k, (name, values) in enumerate(channels.items(), start=1):
        count, order = len(values), {"<": 1, ">": 2}.get(binary, 0)
        more = f"b{order:6d}{2:6d}{11:12d}{8 * count:12d}{0:6d}{0:6d}{0:12d}{0:12d}" if binary else ""
        lines = [f"{-1:6d}", f"{58:6d}{more}", name, "NONE", "04-May-23 10:45:47", "Throughput -1", "NONE"]
        lines += [f"{1:5d}{0:10d}{k:5d}{0:10d} {'NONE':>10}{k:10d}{1:4d} {'NONE':>10}{0:10d}{0:4d}"]
        kind = 2 if single and not binary else 4
        lines += [f"{kind:10d}{count:10d}{1:10d}{start:13.5e}{step:13.5e}{0.0:13.5e}"]
        axes = ((17, "Time", time), (8, "Displacement", unit), (0, "NONE", "NONE"), (0, "NONE", "NONE"))
        lines += [f"{what:10d}{0:5d}{0:5d}{0:5d} {label:<20} {of:<20}" for what, label, of in axes]
        rows = (values[i : i + across] for i in range(0, count, across))
        text = "".join("".join(f"{v:{digits}}" for v in row) + "\n" for row in rows)
        width = 80 if padded else 0
        parts.append("".join(f"{line:<{width}}\n" for line in lines).encode("latin-1"))
        parts.append(values.astype(f"{binary}f8").tobytes() if binary else text.encode())
        parts.append(f"{f'{-1:6d}':<{width}}\n".encode())
    return b"".join(parts)


def as_uff(record: Record, path: Path, binary: str = "<") -> None:
    """A record as universal file."""
    channels = dict(zip(record.channel_names, record.signals.T, strict=True))
    path.write_bytes(universal(channels, record.time[0], 1.0 / record.sampling_rate, binary=binary))


def as_wav(path: Path, readings: np.ndarray, rate: int, bits: int = 16) -> None:
    """Whole numbers of four channels [µm]; the full scale is 500 µm."""
    counts = np.rint(readings / 500.0 * 2 ** (bits - 1)).astype(np.int64).ravel()
    data = b"".join(int(count).to_bytes(bits // 8, "little", signed=True) for count in counts)
    form = struct.pack("<HHIIHH", 1, 4, rate, rate * bits // 2, bits // 2, bits)
    body = b"WAVEfmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", len(data)) + data
    path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)


def as_comtrade(
    path: Path,
    kind: str,
    table: np.ndarray,
    rate: int,
    before: float,
    offset: float = 0.0,
    *,
    names: Sequence[str] = NAMES,
    step: float = 0.01,
    revision: int = 1999,
) -> None:
    """Four channels [µm] and the speed [Hz] in steps, begun `before` [s] the trigger."""
    lines = [f"Station,Recorder,{revision}", "5,5A,0D"]
    for number, name in enumerate([*names, "Speed"], start=1):
        unit = "Hz" if name == "Speed" else "um"
        lines.append(f"{number},{name},,,{unit},{step},{offset},0,-32767,32767,1,1,P")
    stamps = ["16/10/2019,13:42:07.000000", f"16/10/2019,13:42:{7 + before:09.6f}"]
    lines += ["50", "1", f"{rate},{len(table)}", *stamps, kind, "1"]
    lines += ["0,0", "B,3"] * (revision == 2013)
    path.with_suffix(".cfg").write_text("\r\n".join(lines) + "\r\n")
    counts, apart = np.rint((table - offset) / step).astype(int), 10**6 // rate
    if kind == "ASCII":
        rows = [f"{i + 1},{apart * i}," + ",".join(map(str, row)) for i, row in enumerate(counts)]
        path.with_suffix(".dat").write_text("\r\n".join(rows) + "\r\n\x1a")
        return
    sign = {"BINARY": "h", "BINARY32": "i", "FLOAT32": "f"}[kind]
    packed = [struct.pack(f"<II5{sign}", i + 1, apart * i, *row) for i, row in enumerate(counts)]
    path.with_suffix(".dat").write_bytes(b"".join(packed))


def _comtrade(path: Path, kind: str) -> None:
    as_comtrade(path, kind, np.column_stack([READINGS, SPEED]), 5000, 0.02)


def _xlsx(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["Time [s]", *(f"{name} [um]" for name in NAMES), "Speed [Hz]"])
    for i in range(COUNT):
        book.active.append([float(TIME[i]), *READINGS[i].tolist(), float(SPEED[i])])
    book.save(path)


def _npy(path: Path) -> None:
    columns = {f"{name}_um": READINGS[:, i] for i, name in enumerate(NAMES)} | {"speed_Hz": SPEED}
    np.save(path, np.rec.fromarrays([TIME, *columns.values()], names=["t", *columns]))


def _npz(path: Path) -> None:
    np.savez(path, t=TIME, speed_Hz=SPEED, **{f"{name}_um": READINGS[:, i] for i, name in enumerate(NAMES)})


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
    "COMTRADE BINARY32": ("cfg", lambda path: _comtrade(path, "BINARY32")),
    "COMTRADE FLOAT32": ("cfg", lambda path: _comtrade(path, "FLOAT32")),
    "WAV": ("wav", lambda path: as_wav(path, READINGS, 5000)),
    "WAV 24": ("wav", lambda path: as_wav(path, READINGS, 5000, 24)),
    "WAV 32": ("wav", lambda path: as_wav(path, READINGS, 5000, 32)),
    "NPY": ("npy", lambda path: np.save(path, READINGS)),
    "NPY fields": ("npy", _npy),
    "NPZ": ("npz", _npz),
    "HDF5": ("h5", lambda path: save_record(record(), path)),
    "HDF5 gzip": ("h5", _hdf5_packed),
    "MAT plain": ("mat", lambda path: _mat(path, packed=False)),
    "MAT packed": ("mat", lambda path: _mat(path, packed=True)),
    "MAT structures": ("mat", _mat_structures),
    "MAT 7.3": ("mat", _mat_73),
    "TDMS": ("tdms", lambda path: as_tdms(record(), path)),
    "UFF text": ("uff", lambda path: as_uff(record(), path, binary="")),
    "UFF binary": ("uff", lambda path: as_uff(record(), path)),
    "Excel": ("xlsx", _xlsx),
}
"""Suffix and writer of every format by its name."""

CARRIES = {"WAV": 500e-6 / 2**15, "WAV 24": 500e-6 / 2**23, "WAV 32": 500e-6 / 2**31} | {
    f"COMTRADE {kind}": 0.01e-6 for kind in ("binary", "ASCII", "cfg", "BINARY32", "FLOAT32")
}
"""Steps in which a format carries the readings [m]; the others carry them whole."""

WITHOUT_SPEED = ("UFF text", "UFF binary", "MAT structures")
BY_HAND = ("WAV", "WAV 24", "WAV 32", "NPY")
"""Formats that say neither speed nor unit: `BY_PROFILE` does."""


def written(name: str, folder: Path) -> Path:
    """Write the recording in a format and give its path."""
    suffix, write = WRITERS[name]
    path = folder / f"drop.{suffix}"
    write(path)
    return path
