"""Forms of files and faults of recorders that users of other programs reported, made from one motion."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat
from tests.unit.record.every_format import universal
from tests.unit.record.exports import Export

COUNT, STEP, START = 1200, 1e-4, -0.05
TIME = START + STEP * np.arange(COUNT)
NAMES = ("NDE X", "NDE Y", "DE X", "DE Y")
COUNTED = ("CH1", "CH2", "CH3", "CH4")
FORMS = np.array([-0.7, 0.9, -0.8, 0.75])


def motion(time: np.ndarray) -> np.ndarray:
    """Displacements [µm]: an orbit of 8 µm, a fall of 0.2 mm, a rest."""
    fell = np.clip(time, 0.0, 7e-3)[:, None] ** 2 * 4.9e6
    return fell * FORMS + 8.0 * np.sin(377.0 * time[:, None] + np.arange(4))


def turns(time: np.ndarray) -> np.ndarray:
    """Speed [Hz] at times [s]."""
    return 60.0 - 30.0 * (time - START)


MICRONS = np.round(motion(TIME) + np.random.default_rng(7).normal(0.0, 0.3, (COUNT, 4)), 2)
DATE = 1_773_480_413


@dataclass(frozen=True)
class Reported:
    """One file and what is read of it, or asked."""

    kind: str
    content: bytes | Callable[[Path], object]
    names: tuple[str, ...] = NAMES
    file: str = "a.csv"
    values: np.ndarray | None = None
    """Readings [µm], those of `MICRONS` at the times of the record where they are left out."""
    kept: object = ()
    """Samples of the motion that the record holds, all where it is left out."""
    start: float | None = None
    """Time of the first one [s]; that of the motion where it is left out."""
    off: float = 0.011
    """Most that a reading may be off [µm]."""
    late: float = 2e-8
    """Most that a time may be off [s]."""
    missing: int = 0
    """Readings that nobody made."""
    said: str = ""
    """What is noted or warned of, as a pattern."""
    question: str = ""
    """What is asked, as a pattern."""
    step: float = STEP
    """Time between samples [s]."""
    turning: bool = False
    """Whether the record holds the speed of `turns`."""

    written = Export.written


def table(
    names=NAMES,
    unit="um",
    values=MICRONS,
    *,
    times=tuple(f"{t:.4f}" for t in TIME),
    time="Time [s]",
    separator=",",
    digits=2,
    change=None,
) -> bytes:
    """A table with a row of names, whose fields `change` may change: row, column -> field."""
    head = [time, *(f"{name} [{unit}]" if unit else name for name in names)]
    rows = [[t, *(f"{v:.{digits}f}" for v in row)] for t, row in zip(times, values, strict=True)]
    for (row, column), field in (change or {}).items():
        rows[row][column] = field
    return ("\n".join(separator.join(row) for row in [head, *rows]) + "\n").encode()


def own_times(apart: float) -> bytes:
    """A column of times before each channel, read `apart` [s] after the one before."""
    clocks = [TIME + k * apart for k in range(4)]
    values = np.column_stack([motion(clock)[:, k] for k, clock in enumerate(clocks)])
    head = ",".join(f"{name}_time [s],{name} [um]" for name in NAMES)
    rows = [",".join(f"{clocks[k][i]:.7f},{values[i, k]:.4f}" for k in range(4)) for i in range(COUNT)]
    return "\n".join([head, *rows, ""]).encode()


def beside(first: str, second: str) -> bytes:
    """Two captures side by side, the second 5 ms later, each behind its own times."""
    late = motion(TIME + 5e-3)[:, 2:]
    head = f"{first},NDE X [um],NDE Y [um],{second},DE X [um],DE Y [um]"
    rows = zip(TIME, motion(TIME)[:, :2], late, strict=True)
    lines = [f"{t:.4f},{a:.4f},{b:.4f},{t + 5e-3:.4f},{c:.4f},{d:.4f}" for t, (a, b), (c, d) in rows]
    return "\n".join([head, *lines, ""]).encode()


def polar(head: str, unit: float) -> bytes:
    """Radius and angle of both planes."""
    planes = [MICRONS[:, k] + 1j * MICRONS[:, k + 1] for k in (0, 2)]
    rows = np.column_stack([TIME, *(one for xy in planes for one in (abs(xy), np.angle(xy) / unit))])
    return "\n".join([head, *(",".join(f"{v:.5f}" for v in row) for row in rows), ""]).encode()


def below(name: str) -> bytes:
    """A table for each point, one below the other."""
    heads = (f"{name.format(n)}\nX (ms),Y (um){',' * name.endswith(',')}\n" for n in NAMES)
    end = ",\n" if name.endswith(",") else "\n"
    rows = ("".join(f"{1e3 * t:.4f},{v}{end}" for t, v in zip(TIME, w, strict=True)) for w in MICRONS.T)
    return "\n".join(map("".join, zip(heads, rows, strict=True))).encode()


def scope(path: Path) -> None:
    """Muxed signals of Simulink: structure with time."""
    signals = [{"values": MICRONS[:, k : k + 2], "label": f"{n} [um]"} for n, k in (("NDE", 0), ("DE", 2))]
    savemat(path, {"S": {"time": TIME, "signals": np.array(signals, dtype=object)}})


def dspace(path: Path) -> None:
    """X and Y of ControlDesk, each with its name and samples."""
    named = zip(NAMES, MICRONS.T, strict=True)
    found = [{"Name": f"Model/Sensors/{n}", "Unit": "um", "Data": v} for n, v in named]
    savemat(path, {"d": {"X": {"Name": "Time", "Data": TIME}, "Y": np.array(found, dtype=object)}})


def hdf5(**attributes) -> Callable[[Path], None]:
    """Whole numbers with attributes, and a clock beside them."""

    def write(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file.create_dataset("time", data=TIME).attrs["units"] = "s"
            factor = next((v for k, v in attributes.items() if k in ("scale_factor", "gain")), 1.0)
            for name, values in zip(NAMES, MICRONS.T, strict=True):
                item = file.create_dataset(name, data=np.rint(values / factor).astype(np.int16))
                item.attrs.update({"units": "um", **attributes})

    return write


def grouped(path: Path, form: str) -> None:
    """A group for each plane or channel, by the form of its names."""
    with h5py.File(path, "w") as file:
        for name, values in zip(NAMES, MICRONS.T, strict=True):
            item = file.create_dataset(form.format(*name.split()), data=values)
            item.attrs.update({"unit": "um", "dt": STEP, "t0": START})


def matrix(path: Path, unit: object = "um") -> None:
    with h5py.File(path, "w") as file:
        item = file.create_dataset("data", data=MICRONS.T)
        item.attrs.update({"channel_names": [n.encode() for n in NAMES], "fs": 1.0 / STEP, "unit": unit})


def compound(path: Path) -> None:
    with h5py.File(path, "w") as file:
        rows = np.rec.fromarrays([1e6 * TIME, *MICRONS.T, 60.0 * turns(TIME)], names=["t_us", *NAMES, "rpm"])
        file.create_dataset("table", data=np.asarray(rows)).attrs["displacement_unit"] = "um"


def workbook(*rows: list[object]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import openpyxl

        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        book.create_sheet("DE").append([1.0])
        book.save(path)

    return write


def universal_in_mm(time: str = "s", per_second: float = 1.0) -> bytes:
    """Lengths in mm by dataset 164, without a label."""
    factors = "".join(f"{v:25.17E}" for v in (1e3, 1.0, 1.0))
    units = f"{-1:6d}\n{164:6d}\n{5:10d}mm (milli-newton)   {2:10d}\n{factors}\n{273.15:25.17E}\n{-1:6d}\n"
    channels, clock = dict(zip(NAMES, 1e-3 * MICRONS.T, strict=True)), (per_second * START, per_second * STEP)
    return units.encode() + universal(channels, *clock, unit="NONE", time=time, padded=False)


def twincat() -> bytes:
    def line(key: str, *values: str) -> str:
        return "\t".join(part for value in values for part in (key, value))

    head = ["Name\tScope Project_AutoSave\t", "File\tdrop.csv\t", "", line("Name", *NAMES)]
    head += [line("SymbolComment", *[""] * 4), line("Data-Type", *["REAL64"] * 4)]
    head += [line("SampleTime[ms]", *["0.1"] * 4), line("SymbolName", *(f"GVL.{n}" for n in NAMES))]
    head += [line("Unit", *["µm"] * 4), ""]
    rows = ["\t".join(f"{i}\t{v:.2f}" for v in row) for i, row in enumerate(MICRONS)]
    return ("\r\n".join([*head, *rows, "EOF"]) + "\r\n").encode()


def hioki() -> bytes:
    head = ['"File name","WAVE0001.CSV","V1.00"', '"Start trigger time","\'10-06-30 15:53:03"']
    head += ['"CH","CH1","CH2","CH3","CH4","LA1","LA2",', '"Mode","DC","DC","DC","DC","LOGIC","LOGIC",']
    head += ['"Scaling","On","On","On","On","-","-",']
    head += ['"Time","CH1[um]","CH2[um]","CH3[um]","CH4[um]","LA1","LA2",']
    rows = [
        f"{t:.9E},{','.join(f'{v:.5E}' for v in row)},{int(t < 0)},1,"
        for t, row in zip(TIME, MICRONS, strict=True)
    ]
    return "\n".join([*head, *rows, ""]).encode()


def two_rates(path: Path) -> None:
    """COMTRADE, 10 kHz, then 5 kHz from sample 801 on."""
    lines = ["STATION,1,1999", "4,4A,0D"]
    lines += [f"{k},{name},,,um,0.01,0,0,-32767,32767,1,1,P" for k, name in enumerate(NAMES, start=1)]
    lines += ["50", "2", "10000,800", "5000,1000", "14/03/2026,09:26:53.000000", "14/03/2026,09:26:53.050000"]
    path.write_text("\n".join([*lines, "ASCII", "1", ""]))
    read = [*range(801), *range(802, COUNT, 2)]
    rows = [
        f"{k},{round(1e6 * (TIME[i] - START))},{','.join(f'{round(100 * v)}' for v in MICRONS[i])}"
        for k, i in enumerate(read, start=1)
    ]
    path.with_suffix(".dat").write_text("\n".join(rows[:1000]) + "\n")


def few_digits() -> bytes:
    stamps = [f"{t:.1e}" for t in np.round(TIME, 9) + 0.0]
    rows = [f"{t},{','.join(f'{v:.2f}' for v in row)}" for t, row in zip(stamps, MICRONS, strict=True)]
    return "\n".join(["X,CH1,CH2,CH3,CH4", "Second,um,um,um,um", *rows, ""]).encode()


def fortran() -> bytes:
    rows = [
        "  ".join(f"{v:.6E}".replace("E", "D") for v in (t, *(1e-6 * row)))
        for t, row in zip(TIME, MICRONS, strict=True)
    ]
    return "\n".join(["# TIME NDE_X NDE_Y DE_X DE_Y", "# s m m m m", *rows, ""]).encode()


def melted() -> bytes:
    rows = [f"{n},{TIME[i]:.4f},{MICRONS[i, k]}" for i in range(COUNT) for k, n in enumerate(NAMES)]
    return "\n".join(["Tag,time,value", *rows, ""]).encode()


def of_matlab(path: Path) -> None:
    """A table, as scipy sees it: the parts of an object of MATLAB."""
    with h5py.File(path, "w", userblock_size=512) as file:
        item = file.create_dataset("drop", data=np.arange(6, dtype=np.uint32)[None])
        item.attrs.update({"MATLAB_class": np.bytes_("table"), "MATLAB_object_decode": np.int32(3)})
    content = bytearray(path.read_bytes())
    content[:512] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(508, b" ") + b"\x00\x02IM"
    path.write_bytes(content)


def counts_with_lists(path: Path) -> None:
    """Counts, channels × samples, and lists of what each channel has."""
    gain, offset = np.array([0.01, 0.01, 0.02, 0.02, 0.005]), np.array([0.0, 0.0, -50.0, -50.0, 40.0])
    table = np.column_stack([MICRONS, turns(TIME)])
    with h5py.File(path, "w") as file:
        item = file.create_dataset("acq/samples", data=np.rint((table - offset) / gain).astype(np.int16).T)
        item.attrs.update({"channel_names": [*NAMES, "SPEED"], "units": [*["um"] * 4, "Hz"], "gain": gain})
        item.attrs.update({"offset": offset, "sample_rate_hz": 1.0 / STEP, "trigger_sample": 500})


def pandas_fixed(path: Path) -> None:
    """A data frame in the fixed format, its index the time, a unit with a slash."""
    names = [*(f"{n} [um]".encode() for n in NAMES), b"speed [rad/s]"]
    with h5py.File(path, "w") as file:
        group = file.create_group("drop")
        group.create_dataset("axis0", data=names)
        group.create_dataset("axis1", data=TIME).attrs.update({"kind": "float", "name": "time [s]"})
        group.create_dataset("block0_items", data=names)
        table = np.column_stack([MICRONS, 2.0 * np.pi * turns(TIME)])
        group.create_dataset("block0_values", data=table)


def dewesoft(path: Path) -> None:
    """A clock for each channel, its word in the middle of the name; the speed is read every 5 ms."""
    own = {f"Data1_{n.replace(' ', '_')}_um": v[:, None] for n, v in zip(NAMES, MICRONS.T, strict=True)}
    clocks = {name.replace("Data1_", "Data1_time_"): TIME[:, None] for name in own}
    slow = {"Data1_time_n_rpm": TIME[::50, None], "Data1_n_rpm": 60.0 * turns(TIME[::50, None])}
    savemat(path, own | clocks | slow | {"Sample_rate": 1.0 / STEP})


def per_trace(*, ends: bool) -> bytes:
    """Steps in the head for each trace, as Yokogawa has them; rows may end where the slow one has ended."""
    head = ["TraceName," + ",".join((*NAMES, "SPEED")), "VUnit,um,um,um,um,rpm"]
    head += [
        f"HResolution,{','.join([f'{STEP:.1E}'] * 4)},5.0E-03",
        "HOffset" + f",{START}" * 5,
        "HUnit" + ",s" * 5,
    ]
    slow = [f",{60.0 * t:.3f}" for t in turns(TIME[::50])] + ["" if ends else ","] * COUNT
    rows = [",".join(["", *(f"{v:.2f}" for v in row)]) + n for row, n in zip(MICRONS, slow, strict=False)]
    return "\n".join([*head, *rows, ""]).encode()


def peaks() -> bytes:
    """The least and the greatest reading of each two samples under one time."""
    pairs = MICRONS.reshape(-1, 2, 4)
    values = np.stack([pairs.min(axis=1), pairs.max(axis=1)], axis=1).reshape(-1, 4)
    return table(values=values, times=[f"{t:.4f}" for t in np.repeat(TIME[::2], 2)])


def sheets(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    speed = [[float(t), float(turns(t))] for t in TIME[::50]]
    for title, head, rows in (
        ("NDE", ["X [um]", "Y [um]"], [row[:3] for row in ROWS]),
        ("DE", ["X [um]", "Y [um]"], [[row[0], *row[3:]] for row in ROWS]),
        ("n", ["Speed [Hz]"], speed),
    ):
        sheet = book.create_sheet(title)
        for row in [["Time [s]", *head], *rows]:
            sheet.append(row)
    book.save(path.with_suffix(".xlsx"))
    path.with_suffix(".xlsx").rename(path)


def with_speed(times: list[str]) -> bytes:
    lines = table(times=times).decode().splitlines()
    ends = ["n/(1/min)", *(f"{60.0 * t:.3f}" for t in turns(TIME))]
    return "\n".join([*(f"{line},{end}" for line, end in zip(lines, ends, strict=True)), ""]).encode()


AFTER = slice(300, None)
LIST = b"".join(b"CH%d,%s,5,Off,um\n" % (k, n.encode()) for k, n in enumerate(NAMES, start=1))
NUMBERS, COUNTS = [str(i) for i in range(COUNT)], {"values": 50 * MICRONS - 50, "digits": 0}
ROWS = [[float(t), *map(float, row)] for t, row in zip(TIME, MICRONS, strict=True)]

FROM_TRIGGER = [str(i - 500) for i in range(COUNT)]
PLANES = tuple(f"{n[:-2]} {n[-1]}" for n in NAMES)
LINES = table().splitlines(keepends=True)
SLOW = [row[:-1] + (b",60\n" if k < 12 else b",\n") for k, row in enumerate(LINES[1:])]
REPORTED = [
    *(
        Reported(
            f"{code} for no value",
            table(change={(100, 2): code}),
            missing=1,
            said=r"1 of 1200 samples of NDE Y are missing, the first at -0\.04 s",
            off=1.0,
        )
        for code in ("", *"9.91E+37 9.9E34 1E+30 1E+12 -9999 32767 -- n/a INVALID **** inf -∞ 1e999".split())
    ),
    Reported(
        "two missing readings",
        table(change={(100, 2): "", (101, 2): "NaN"}),
        missing=2,
        off=1.5,
        said="2 of 1200 samples of NDE Y are missing",
    ),
    Reported(
        "a long gap while it levitates",
        table(change={(k, 1): "" for k in range(200, 300)}),
        kept=AFTER,
        said=r"100 samples are missing from -0\.03 s on; read from -0\.02 s to 0\.0699 s",
    ),
    Reported(
        "lost rows",
        b"\n".join([*table().split(b"\n")[:100], *table().split(b"\n")[103:]]),
        missing=12,
        off=2.5,
        said="3 of 1200 samples of NDE X, NDE Y, DE X, DE Y are missing",
    ),
    Reported(
        "a clock set back",
        table(times=[f"{t - (i > 99):.4f}" for i, t in enumerate(TIME)]),
        said=r"the clock steps back by 1\.00 s after -0\.0401 s",
    ),
    Reported(
        "one wrong stamp",
        table(change={(100, 0): f"{TIME[100] - 0.01:.4f}"}),
        said=r"the clock steps back by 9\.90 ms after -0\.0401 s",
    ),
    Reported(
        "a clock set forward",
        table(times=[f"{t + (i >= 300):.4f}" for i, t in enumerate(TIME)]),
        kept=AFTER,
        start=TIME[300] + 1.0,
        said="10000 samples are missing .*; read from",
    ),
    *(
        Reported(
            f"a time for each channel, {1e6 * apart:g} µs apart",
            own_times(apart),
            values=motion(TIME[int(np.ceil(3 * apart / STEP - 1e-6)) :]),
            off=off,
            start=START + STEP * np.ceil(3 * apart / STEP - 1e-6),
            said="begin up to .* apart; each is read by",
        )
        for apart, off in ((5e-3, 1e-3), (3e-4, 1e-3), (12.5e-6, 1.0))
    ),
    *(
        Reported(f"packed by {attributes}", hdf5(**attributes), file="a.h5", off=off)
        for attributes, off in (
            ({"scale_factor": 0.5, "add_offset": 0.0}, 0.26),
            ({"scale_factor": 2.0}, 1.01),
            ({"gain": 0.02}, 0.011),
        )
    ),
    Reported("whole numbers", hdf5(), file="a.h5", off=0.51, said="NDE X holds whole numbers, taken as um"),
    Reported(
        "two factors",
        hdf5(scale_factor=0.5, gain=0.1),
        file="a.h5",
        question=r"has several factors, scale_factor = 0\.5, gain = 0\.1; keep the one",
    ),
    *(
        Reported(f"names that count, {names[0]}", table(names), names=names)
        for names in (
            tuple(f"{word}{k}" for k in range(first, first + 4))
            for word, first in (("Sensor", 1), ("Displacement ", 1), ("Ax", 1), ("Dev1/ai", 0), ("CH", 1))
        )
    ),
    Reported(
        "names that count, an axial one behind",
        table((*COUNTED, "CH5"), values=np.column_stack([MICRONS, MICRONS[:, 0]])),
        names=COUNTED,
        said="not looked at: CH5",
    ),
    Reported("one name for all", table(("X",) * 4, ""), question=r"channel 'X 1' has no unit; name it"),
    Reported(
        "names counted by pandas",
        table(("Weg [um]", "Weg [um].1", "Weg [um].2", "Weg [um].3"), ""),
        names=("Weg 1", "Weg 2", "Weg 3", "Weg 4"),
    ),
    *(Reported(f"in {unit}", table(unit=unit)) for unit in ("мкм", "Âµm", "?m", "\ufffdm", "µm", "micron")),
    Reported("in thou", table(unit="thou", values=MICRONS / 25.4, digits=4), off=0.01),
    *(
        Reported(
            f"in {unit}",
            table(unit=unit),
            question=r"is in .*, which is neither a length nor a voltage; name its unit in .*: \[units\]",
        )
        for unit in ("um pk-pk", "%", "p.u.", "counts")
    ),
    Reported(
        "a sensitivity as the unit", table(unit="V (200 mV/mil)", values=MICRONS * 0.2 / 25.4, digits=6)
    ),
    Reported("times of two digits", few_digits(), names=COUNTED, late=1e-5, said="rounded"),
    Reported("exponents D", fortran(), file="a.txt", names=("NDE_X", "NDE_Y", "DE_X", "DE_Y")),
    Reported("logic channels", hioki(), names=COUNTED),
    Reported("a table of HDF5", compound, file="a.h5", turning=True),
    Reported("a matrix of HDF5", matrix, file="a.h5", start=0.0),
    Reported("a unit for each column", partial(matrix, unit=[b"um"] * 4), file="a.h5", start=0.0),
    Reported("muxed signals", scope, ("NDE 1", "NDE 2", "DE 1", "DE 2"), file="a.mat"),
    Reported("X and Y of dSPACE", dspace, tuple(f"d.Y({k}).Data" for k in range(1, 5)), file="a.mat"),
    *(
        Reported(
            f"clocks {first!r} and {second!r}",
            beside(first, second),
            values=motion(TIME[50:]),
            start=START + 5e-3,
            said="begin up to 5.00 ms apart",
        )
        for first, second in (("A [s]", "B [s]"), ("Time 1", "Time 2"), ("Abszisse [s]",) * 2, ("",) * 2)
    ),
    Reported(
        "rows of settings",
        LINES[0] + b"hw=Clock,hw=A,hw=B,hw=A,hw=B\nFilter=,DC,DC,DC,OFF\n" + b"".join(LINES[1:]),
    ),
    Reported(
        "counts below a list of channels",
        b"; Rate: 10 kS/s\n; Pretrigger: 500 samples\n; Ch\tName\tUnit\tScale\tOffset\n"
        + b"".join(f"; {k}\t{n}\tum\t0.02\t{k}\n".encode() for k, n in enumerate(NAMES, start=1))
        + b"".join(
            b"\t".join(b"%d" % round(50 * (v - k)) for k, v in enumerate(row, start=1)) + b"\n"
            for row in MICRONS
        ),
        file="a.txt",
        said="times the factors",
    ),
    Reported(
        "values alone",
        b"\n".join(b",".join(b"%.2f" % v for v in row) for row in MICRONS),
        question=r"text\.names = .*with \[time\] step",
    ),
    Reported("signs apart", table().replace(b",-", b",-   ")),
    Reported("bars", table(separator="|")),
    Reported("two bytes a character", table().decode().encode("utf-16")),
    Reported(
        "quotes between blanks",
        re.sub(rb"[^,\n]+", rb'"\g<0>"', table([f"{n}[um]" for n in COUNTED], "", time="t[s]")).replace(
            b",", b" "
        ),
        file="a.txt",
        names=COUNTED,
    ),
    Reported(
        "a comma in the seconds",
        table(time="Zeit", separator=";", times=[f"14.03.2026 09:26:53,{i:04d}" for i in range(COUNT)]),
        start=0.0,
    ),
    Reported(
        "a field too few",
        b"".join([*LINES[:90], LINES[90].replace(b",", b" ", 1), *LINES[91:]]),
        question="line 91: 4 columns where 5 are expected.*repair the line or export again",
    ),
    Reported("a head of %", fortran().replace(b"#", b"%"), ("NDE_X", "NDE_Y", "DE_X", "DE_Y"), file="a.txt"),
    Reported("pages", b"".join([*LINES[:601], b"\nPage 2\n", LINES[0], *LINES[601:]])),
    *(
        Reported(f"points below each other, {name}", below(name), question=question)
        for name, question in (
            ("Point Name,{},", ""),
            ("Point Name: {}", ""),
            ("Point", "tables of one time; export again as one table"),
        )
    ),
    *(
        Reported(head, polar(head, unit), ("R1 X", "R1 Y", "R2 X", "R2 Y"), question=question, said="angles")
        for head, unit, question in (
            ("t,R1 [um],Phi1 [deg],R2 [um],Phi2 [deg]", np.pi / 180, ""),
            ("t,R1_um,Phi1_rad,R2_um,Phi2_rad", 1.0, ""),
            ("t,A Amp [um],A Phase [deg],B Amp [um],B Phase [deg]", 1.0, "A Phase, B Phase may be those of"),
            ("t,A Mag,A Phase,B Mag,B Phase", 1.0, r"one 'radius \[um\]' and one 'angle"),
        )
    ),
    Reported(
        "a slow column without its times",
        b"".join([LINES[0][:-1], b",Speed [Hz]\n", *SLOW]),
        said="left out, 'Speed' ends in row 12 of 1200",
    ),
    Reported("units of dataset 164", universal_in_mm(), file="a.uff"),
    Reported("abscissa in ms", universal_in_mm("ms", 1e3), file="a.uff"),
    *(
        Reported(
            form, partial(grouped, form=form), file="a.h5", names=[form.format(*n.split()) for n in NAMES]
        )
        for form in ("{}/{}", "{} {}/data")
    ),
    *(
        Reported(form, table([form.format(n) for n in NAMES], "", time="in s"), names)
        for form, names in (("{} in um", NAMES), ("{}.um", [f"{n}.um" for n in NAMES]))
    ),
    *(
        Reported(
            f"thousands without decimals, {decimal}",
            table(
                unit="nm",
                separator=";",
                times=[f"{t:.4f}".replace(".", decimal) for t in TIME],
                change={
                    (i, k + 1): f"{1e3 * v:,.0f}".replace(",", sign) for (i, k), v in np.ndenumerate(MICRONS)
                },
            ),
        )
        for decimal, sign in (".,", ",.")
    ),
    *(
        Reported(f"{head!r} above, {below[:9]!r} below", head + table(**given) + below, **said)
        for head, given, below, said in (
            (b"# Sensitivity: -8 mV/um\n", {"unit": "V", "values": -8e-3 * MICRONS, "digits": 6}, b"", {}),
            (b"# X: 8 mV/um\n# Y: 7 mV/um\n", {"unit": "V"}, b"", {"question": "several .*= .V .8.00 mV/µm"}),
            (b"Sample Rate: 10,000 Hz\nPreTrigger,500\n", {"time": "No", "times": NUMBERS}, b"", {}),
            (b"Fs: 10000 Hz\nPre-trigger samples,500\n", {"time": "No", "times": FROM_TRIGGER}, b"", {}),
            (b"Factor,,.02,.02,.02,.02\nOffset,,1,1,1,1\n", COUNTS, b"", {"said": "times the factors"}),
            *(
                (head.encode(), {}, b"", {"said": f"speed of the head of the file: {key} = "})
                for head, key in (
                    ("Speed (rpm),3600\n", r"Speed \(rpm\)"),
                    ("RPM: 3600\n", "RPM"),
                    ("Rotor speed = 60 Hz\n", "Rotor speed"),
                    ("# Drehzahl 3600 U/min\n", "Drehzahl"),
                    ("Nominal Speed,3600,rpm\n", "Nominal Speed"),
                    ("Vitesse de rotation (tr/min) : 3600\n", r"Vitesse de rotation \(tr/min\)"),
                )
            ),
            *(
                (head, {}, b"", {"said": "has no one speed with a unit: "})
                for head in (
                    b"RPM: 3.600\n",
                    b"Speed,20,kHz\n",
                    b"Speed: 3600 rpm\nNominal speed: 3000 rpm\n",
                )
            ),
            (b"CH,Signal name,Range,Filter\n" + LIST, {"names": COUNTED}, b"", {"names": NAMES}),
            (b"", {"time": "No", "times": NUMBERS}, b"", {"question": "no sampling interval"}),
            (b"", {}, b"Max,1,2,3,4\nMin,0,0,0,0\n", {"said": "below the rows: 'Max 1 2 3 4'"}),
            (b"", {}, b"\nGroup,2\nn,1\n1,2\n", {"said": "below the rows: 'Group 2'"}),
            (b"", {}, b"\nGroup,2\n" + table(), {"question": "export again as one table"}),
        )
    ),
    Reported(
        "merged cells",
        workbook(
            ["Drop test"],
            ["Time", "NDE", None, "DE", None],
            [None, "X", "Y", "X", "Y"],
            ["s", "µm", "µm", "µm", "µm"],
            *ROWS,
        ),
        file="a.xlsx",
    ),
    Reported(
        "numbers as text, decimal comma",
        workbook(
            ["Time [s]", *(f"{n} [um]" for n in NAMES)],
            *([f"{v:.4f}".replace(".", ",") for v in row] for row in ROWS),
        ),
        file="a.xlsx",
        said=r"\(left out: 'DE'\)",
    ),
    Reported(
        "a remark in a sheet",
        workbook(["Time [s]", *(f"{n} [um]" for n in NAMES), "Remark"], *ROWS[:-1], [*ROWS[-1], "hit"]),
        file="a.xlsx",
        said="left out, no numbers: Remark",
    ),
    Reported("index and value pairs", twincat(), start=0.0, said="below the rows: 'EOF'"),
    Reported(
        "two rates",
        two_rates,
        file="a.cfg",
        kept=slice(0, COUNT, 2),
        step=2 * STEP,
        late=2e-7,
        said="sampled at 10000 Hz and, from .* s on, at 5000 Hz",
    ),
    *(
        Reported(
            f"stamps in {name}", table(time=name, times=[form(i) for i in range(COUNT)]), start=0.0, late=1e-9
        )
        for name, form in (
            ("time_ns", lambda i: f"{DATE * 10**9 + i * 10**5}"),
            ("timestamps", lambda i: f"{DATE * 10**3 + i // 10}.{i % 10}"),
            ("timestamp", lambda i: f"{DATE + i // 10000}.{i % 10000:04d}"),
            ("Time", lambda i: f"2026/03/14 09:26:53.{i:04d}"),
            ("Date Time", lambda i: f"3/14/2026 9:26:53.{i:04d} PM"),
            ("Zeit", lambda i: f"14.03.2026 09:26:53:{i:04d}"),
        )
    ),
    Reported(
        "days since 1900",
        table(time="Time", times=[f"{45999.3930556 + STEP * i / 86400:.12f}" for i in range(COUNT)]),
        start=0.0,
        late=1e-7,
    ),
    Reported(
        "stamps of whole seconds",
        table(time="Time", times=["14.03.2026 09:26:53"] * COUNT),
        question=r"\(its stamps stand still, they are coarser than the samples\) and no sampling interval",
    ),
    Reported("one value a row", melted(), question="one value a row: its column 'Tag' names 4"),
    Reported("a table of MATLAB", of_matlab, file="a.mat", question="objects .MATLAB table. that only"),
    *(
        Reported(kind, begin + bytes(60), file="a.dat", question=f"of the format {kind}")
        for kind, begin in (
            ("ZIP, which is not read; unpack it", b"PK\x03\x04"),
            ("imc FAMOS", b"|CF,2,1,1;"),
            ("XML", b"<?xml "),
            ("DADiSP", b"DATASET X"),
        )
    ),
    Reported("HDF5 by another name", hdf5(scale_factor=0.02), file="a.dat"),
    Reported(
        "more rows than declared",
        lambda path: (two_rates(path), path.write_text(path.read_text().replace("5000,1000", "5000,900"))),
        file="a.cfg",
        question=r"declares 900 samples and 1000 are present, 100 more",
    ),
    *(
        Reported(
            f"{head!r} in the head", head + table(time="No", times=NUMBERS, names=names, unit=unit), said=said
        )
        for head, names, unit, said in (
            (b"# sampling time Ts = 100 us\n# Trigger position: 500\n", NAMES, "um", ""),
            (b"XInc:,1.0E-04\nStart:,0\nXOrg:,-5.0E-02\nXUnits:,second\n", NAMES, "um", ""),
            (b"Sample Rate: 10 kS/s\nXOffset: -50 ms\n", [f"{n}/um" for n in NAMES], "", ""),
            ("Fs: 10 kHz\nPoint de d\u00e9clenchement : 500\n".encode(), NAMES, "um", ""),
            ("Fs: 10 kHz\nPr\u00e9-d\u00e9clenchement : 50 ms\n".encode(), NAMES, "um", ""),
            (b"# Fs 10 kHz\nPretrigger: 500 samples\nTriggerpunkt,500\n", NAMES, "um", ""),
            (b"Interval;0.1 ms\nPretrig,50,ms\n".replace(b";", b","), NAMES, "um", ""),
            (b"Fs: 10 kHz\nTstart: -0.05\nXOffset: 7 div\n", NAMES, "um", "not used.*XOffset = 7 div"),
        )
    ),
    *(
        Reported(
            f"{' '.join(clock)} beside a matrix",
            partial(savemat, mdict={"data": MICRONS, "labels": NAMES, "units": ["um"] * 4} | clock),
            file="a.mat",
        )
        for clock in (
            {"isi": 0.1, "isi_units": "ms", "start_sample": -50.0},
            {"Tinterval": STEP, "Tstart": START},
            {"srate": 1.0 / STEP, "pretrigger_samples": 500.0},
            {"srate": 1.0 / STEP, "TriggerIndex": 501.0},
        )
    ),
    Reported("counts with lists", counts_with_lists, file="a.h5", turning=True),
    Reported("a frame of pandas", pandas_fixed, [f"{n} [um]" for n in NAMES], file="a.h5", turning=True),
    Reported(
        "a clock in the middle of a name",
        dewesoft,
        [f"Data1_{n.replace(' ', '_')}_um" for n in NAMES],
        file="a.mat",
        turning=True,
    ),
    Reported("a slower trace", per_trace(ends=False), turning=True),
    Reported("rows that end early", per_trace(ends=True), turning=True),
    Reported(
        "speed on a clock set back",
        with_speed([f"{t - (i > 99):.4f}" for i, t in enumerate(TIME)]),
        said="the clock steps back",
        turning=True,
    ),
    Reported(
        "ticks of 8 bits",
        b"Ts: 0.1 ms\nPre-trigger: 50 ms\n" + table(time="tick", times=[str(i % 256) for i in range(COUNT)]),
    ),
    Reported(
        "peak detection",
        peaks(),
        values=MICRONS.reshape(-1, 2, 4).min(axis=1) / 2 + MICRONS.reshape(-1, 2, 4).max(axis=1) / 2,
        said="pairs, the least and the greatest .* 600 samples",
        step=2 * STEP,
    ),
    *(
        Reported(f"{file}, a sheet for each plane", sheets, PLANES, file=file, turning=True)
        for file in ("a.xlsx", "a.csv")
    ),
    Reported(
        "thousands of France",
        table(
            unit="nm",
            separator="\t",
            times=[f"{t:.4f}".replace(".", ",") for t in TIME],
            change={
                (i, k + 1): f"{1e3 * v:,.1f}".replace(",", "\u202f").replace(".", ",")
                for (i, k), v in np.ndenumerate(MICRONS)
            },
        ),
        file="a.txt",
    ),
    Reported(
        "commas in numbers and between them", table().replace(b".", b","), question="10 fields under 5 names"
    ),
    *(
        Reported(f"durations as {form(-0.05)}", table(time="Time", times=[form(t) for t in TIME]))
        for form in (
            lambda t: f"{t:.4f} sec",
            lambda t: f"{'-' if t < 0 else '+'}00:00:00.{round(abs(t) * 1e4):04d}",
            lambda t: (
                f"{-1 if t < 0 else 0} days +{'23:59:59' if t < 0 else '00:00:00'}.{round(1e4 * (t % 1)):04d}"
            ),
        )
    ),
]
"""All of them; `studies` and tests take them from here."""
