"""One recording as the recorders of many makers export it, written by hand after their documents."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.io

COUNT, STEP, START = 60, 5e-5, -1e-3
TIME = START + STEP * np.arange(COUNT)
MICRONS = np.round(
    np.array([8.18, -6.98, -16.85, -16.31])
    + np.outer(np.arange(COUNT), [-0.73, 0.21, 1.57, -3.25])
    + np.random.default_rng(3).normal(0.0, 0.3, (COUNT, 4)),
    2,
)
VOLTS = np.round(8e-3 * MICRONS, 6)
SPEED = np.round(60.0 + 0.01 * np.sin(np.arange(COUNT)), 3)

TAGS = ("NDE X", "NDE Y", "DE X", "DE Y")
API = ("VE-101X", "VE-101Y", "VE-102X", "VE-102Y")
COUNTED = ("CH1", "CH2", "CH3", "CH4")


@dataclass(frozen=True, kw_only=True)
class Export:
    """One file and what it says."""

    maker: str
    form: str
    file: str
    content: bytes | Callable[[Path], None]
    """What it holds, or what writes it and the files beside it."""
    names: Sequence[str] = TAGS
    unit: str = "V"
    values: np.ndarray = field(default_factory=lambda: VOLTS)
    speed: bool = False
    planes: tuple[str, ...] = ("NDE", "DE")
    question: str = ""
    """What is asked where the file does not say it, as a pattern."""

    def written(self, folder: Path) -> Path:
        """Write it and give its path."""
        path = folder / self.file
        if callable(self.content):
            self.content(path)
        else:
            path.write_bytes(self.content)
        return path


def _rows(
    table: np.ndarray,
    *,
    separator: str = ",",
    decimal: str = ".",
    first: Callable[[int], Sequence[str]] = lambda i: [f"{TIME[i]:.6e}"],
    digits: int = 6,
    end: str = "\n",
    behind: Sequence[str] = (),
) -> str:
    lines = [
        separator.join([*first(i), *(f"{v:.{digits}f}" for v in row), *behind]).replace(".", decimal)
        for i, row in enumerate(table)
    ]
    return end.join(lines) + end


# ---- National Instruments: the writer of LabVIEW


def labview(
    columns: str,
    *,
    separator: str = "\t",
    decimal: str = ".",
    comments: bool = False,
    segments: Sequence[range] = (range(COUNT),),
    names: Sequence[str] = TAGS,
    unit: str = "Volts",
    gap: float = 0.0,
) -> bytes:
    """A file with a head and segments, each with its own head; `columns` is No, One or Multi."""
    sign = {"\t": "Tab", ",": "Comma"}[separator]
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", f"Separator\t{sign}"]
    head += [f"Decimal_Separator\t{decimal}", "Multi_Headings\tYes", f"X_Columns\t{columns}"]
    head += ["Time_Pref\tRelative", "Operator\tlab", "Date\t2023/05/04", "Time\t10:45:47.0352557312499836422"]
    lines = [line.replace("\t", separator) for line in [*head, "***End_of_Header***", ""]]
    multi = columns == "Multi"
    for number, part in enumerate(segments):

        def spread(key: str, value: str) -> str:
            cells = [cell for _ in names for cell in ([value, ""] if multi else [value])]
            return separator.join([key, *(cells[:-1] if multi else cells)])

        clock = 47.0 + (START + STEP * part[0] + gap if number else 0.0)
        lines += [spread("Channels", "").rstrip(separator) + f"{separator}{len(names)}"]
        lines += [spread("Samples", str(len(part))), spread("Date", "2023/05/04")]
        lines += [spread("Time", f"10:45:{clock:.10f}".replace(".", decimal)), spread("Y_Unit_Label", unit)]
        lines += [
            spread("X_Dimension", "Time"),
            spread("X0", f"{START if not number else 0.0:.16E}".replace(".", decimal)),
        ]
        lines += [spread("Delta_X", f"{STEP:.6E}".replace(".", decimal)), f"***End_of_Header***{separator}"]
        titles = [cell for name in names for cell in (["X_Value", name] if multi else [name])]
        lines.append(separator.join([*([] if multi else ["X_Value"]), *titles, "Comment"]))
        for i in part:
            x = f"{(START if not number else -STEP * part[0]) + STEP * i:.8f}"
            cells = [f"{v:.6f}" for v in VOLTS[i, : len(names)]]
            fields = {
                "No": ["", *cells],
                "One": [x, *cells],
                "Multi": [field for cell in cells for field in (x, cell)],
            }[columns]
            row = separator.join(fields).replace(".", decimal)
            lines.append(row + (f"{separator}looks odd" if comments and i % 7 == 3 else ""))
        lines.append("")
    return ("\r\n".join(lines) + "\r\n").encode("latin-1")


def _tdms(path: Path) -> None:
    import nptdms

    clock = {"wf_increment": STEP, "wf_start_offset": START, "wf_start_time": np.datetime64("2023-05-04")}
    objects = [
        nptdms.ChannelObject("drop", name, VOLTS[:, i], properties=clock | {"unit_string": "Volts"})
        for i, name in enumerate(TAGS)
    ]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.RootObject({"name": "drop"}), *objects])


NI = [
    Export(maker="NI", form="LVM, no X column", file="a.lvm", content=labview("No")),
    Export(maker="NI", form="LVM, one X column", file="a.lvm", content=labview("One")),
    Export(maker="NI", form="LVM, many X columns", file="a.lvm", content=labview("Multi")),
    Export(maker="NI", form="LVM, decimal comma", file="a.lvm", content=labview("No", decimal=",")),
    Export(maker="NI", form="LVM, commas between", file="a.lvm", content=labview("One", separator=",")),
    Export(maker="NI", form="LVM, comments", file="a.lvm", content=labview("One", comments=True)),
    Export(
        maker="NI",
        form="LVM, segments that follow",
        file="a.lvm",
        content=labview("No", segments=(range(25), range(25, COUNT))),
    ),
    Export(
        maker="NI",
        form="LVM, no head",
        file="a.lvm",
        content=_rows(VOLTS, separator="\t").encode(),
        question=r"no row names the 5 columns .*name them in the profile, text\.names = ",
    ),
    Export(maker="NI", form="TDMS", file="a.tdms", content=_tdms),
]


# ---- oscilloscopes


def _tektronix_beside() -> bytes:
    """The head stands beside the first readings, one group of five columns for each channel."""
    head = ["Record Length,60,Points", "Sample Interval,5.000000e-05,s", "Trigger Point,20,Samples", ",,"]
    head += ["Source,{},", "Vertical Units,V,", "Vertical Scale,5.0e-01,", "Vertical Offset,0.0,"]
    head += ["Horizontal Units,s,", "Horizontal Scale,2.5e-03,", "Pt Fmt,Y,", "Yzero,0.0,"]
    head += [
        "Probe Atten,1.0,",
        "Model Number,TDS2024,",
        "Serial Number,C0123,",
        "Firmware Version,FV:v24.26,",
    ]
    lines = []
    for i in range(COUNT):
        groups = [
            f"{(head[i] if i < len(head) else ',,').format(name)},{TIME[i]:.12f},{VOLTS[i, k]:.6f}"
            for k, name in enumerate(COUNTED)
        ]
        lines.append(",".join(groups) + ",")
    return ("\r\n".join(lines) + "\r\n").encode()


def _tektronix(labels: Sequence[str]) -> bytes:
    head = ["Model,MSO46", "Firmware Version,1.28.6", "", "Waveform Type,ANALOG", "Point Format,Y"]
    head += ["Horizontal Units,s", "Horizontal Scale,0.0004", "Horizontal Delay,0.0", "Sample Interval,5e-05"]
    head += [f"Record Length,{COUNT}", "Gating,0.0% to 100.0%", "Probe Attenuation,1,1,1,1"]
    head += ["Vertical Units,V,V,V,V", "Vertical Offset,0,0,0,0", "Vertical Scale,0.5,0.5,0.5,0.5"]
    head += ["Vertical Position,0,0,0,0", ",,,,", ",,,,", f"Label,{','.join(labels)}", "TIME,CH1,CH2,CH3,CH4"]
    return ("\n".join(head) + "\n" + _rows(VOLTS)).encode()


def _keysight_infiniium() -> bytes:
    head = ["Revision:,0", "Type:,Raw Data", "Start:,0", f"Points:,{COUNT}", "Count or Segments:,1"]
    head += ["XDispRange:,4e-3", f"XDispOrg:,{START}", f"XInc:,{STEP}", f"XOrg:,{START}", "XUnits:,Second"]
    head += ["YUnits:,Volt,Volt,Volt,Volt", "Frame:,DSOS104A:MY56310105", "Date:,04 MAY 2023", "Data:"]
    head += ["Time,Channel 1,Channel 2,Channel 3,Channel 4"]
    return ("\r\n".join(head) + "\r\n" + _rows(VOLTS, end="\r\n")).encode()


def _yokogawa(first: str = "", decimal: str = ".", key: str = "HResolution") -> bytes:
    separator = ";" if decimal == "," else ","

    def line(name: str, *values: str) -> str:
        return separator.join([f'"{name:<12}"', *values])

    names = [f'"{name:<8}"' for name in TAGS]
    per = {"HResolution": f"{STEP:.9E}", "SampleRate": "20000.000"}[key].replace(".", decimal)
    head = [line("Header Size", "16"), line("Model Name", '"DL850EV"'), line("Comment", '""')]
    head += [line("BlockNumber", "1"), line("TraceName", *names), line("BlockSize", *[str(COUNT)] * 4)]
    head += [line("VUnit", *['"V"'] * 4), line(key, *[per] * 4)]
    head += [line("HOffset", *[f"{START:.6E}".replace(".", decimal)] * 4), line("HUnit", *['"s"'] * 4)]
    head += [line("Date", '"2023/05/04"'), line("Time", '"10:45:47.00"'), ""]
    body = _rows(VOLTS, separator=separator, decimal=decimal, first=lambda i: [] if first == "none" else [""])
    return ("\r\n".join(head) + "\r\n" + body).encode()


def _pico(
    separator: str = ",", decimal: str = ".", names: Sequence[str] = TAGS, milli: bool = False
) -> bytes:
    units = ["(ms)", *(["(mV)"] if milli else ["(V)"]) * 4]
    scale = 1e3 if milli else 1.0
    body = _rows(
        VOLTS * scale,
        separator=separator,
        decimal=decimal,
        first=lambda i: [f"{1e3 * TIME[i]:.8f}"],
        digits=3 if milli else 6,
    )
    return "\n".join([separator.join(["Time", *names]), separator.join(units), "", body]).encode()


def _rigol() -> bytes:
    head = f"X,CH1,CH2,CH3,CH4,Start,Increment,\nSequence,Volt,Volt,Volt,Volt,{START:.6e},{STEP:.6e}\n"
    return (head + _rows(VOLTS, first=lambda i: [str(i)], behind=[""])).encode()


SCOPES = [
    Export(
        maker="Tektronix",
        form="head beside the readings",
        file="a.csv",
        content=_tektronix_beside(),
        names=COUNTED,
        planes=("plane 1", "plane 2"),
    ),
    Export(maker="Tektronix", form="labels", file="a.csv", content=_tektronix(TAGS)),
    Export(
        maker="Tektronix",
        form="no labels",
        file="a.csv",
        content=_tektronix([""] * 4),
        names=COUNTED,
        planes=("plane 1", "plane 2"),
    ),
    Export(
        maker="Keysight",
        form="InfiniiVision",
        file="a.csv",
        content=("x-axis,1,2,3,4\nsecond,Volt,Volt,Volt,Volt\n" + _rows(VOLTS)).encode(),
        names=COUNTED,
        planes=("plane 1", "plane 2"),
    ),
    Export(
        maker="Keysight",
        form="Infiniium",
        file="a.csv",
        content=_keysight_infiniium(),
        names=[f"Channel {k}" for k in range(1, 5)],
        planes=("plane 1", "plane 2"),
    ),
    Export(
        maker="LeCroy",
        form="one trace",
        file="a.csv",
        content=(
            "LECROYHDO6104,12345,Waveform\nSegments,1,SegmentSize,60\nSegment,TrigTime,TimeSinceSegment1\n"
            "#1,04-May-2023 10:45:47,0\nTime,Ampl\n" + _rows(VOLTS[:, :1])
        ).encode(),
        question=r"holds 1 channel that can be displacements .*it has Ampl in \?; export the displacements",
    ),
    Export(
        maker="Rigol",
        form="sequence, start and increment",
        file="a.csv",
        content=_rigol(),
        names=COUNTED,
        planes=("plane 1", "plane 2"),
    ),
    Export(
        maker="Rigol",
        form="MSO5000",
        file="a.csv",
        content=("Time(s),CH1(V),CH2(V),CH3(V),CH4(V),\n" + _rows(VOLTS, behind=[""])).encode(),
        names=COUNTED,
        planes=("plane 1", "plane 2"),
    ),
    Export(
        maker="Pico",
        form="channels A to D",
        file="a.csv",
        content=_pico(names=[f"Channel {letter}" for letter in "ABCD"]),
        names=[f"Channel {letter}" for letter in "ABCD"],
        planes=("plane 1", "plane 2"),
    ),
    Export(maker="Pico", form="semicolons, decimal comma", file="a.csv", content=_pico(";", ",")),
    Export(
        maker="Pico",
        form="text, millivolts",
        file="a.txt",
        content=_pico("\t", milli=True),
        unit="mV",
        values=VOLTS * 1e3,
    ),
    Export(maker="Yokogawa", form="HResolution", file="a.csv", content=_yokogawa()),
    Export(maker="Yokogawa", form="no blank column", file="a.csv", content=_yokogawa("none")),
    Export(maker="Yokogawa", form="decimal comma", file="a.csv", content=_yokogawa("", ",")),
    Export(maker="Yokogawa", form="SampleRate", file="a.csv", content=_yokogawa(key="SampleRate")),
]


# ---- Siemens: Simcenter Testlab, SIPROTEC


def _signal(names: Sequence[str], values: np.ndarray, label: str, factor: float) -> dict[str, object]:
    return {
        "x_values": {
            "start_value": START,
            "increment": STEP,
            "number_of_values": float(len(values)),
            "quantity": {"label": "s", "unit_transformation": {"factor": 1.0}},
        },
        "y_values": {
            "values": values,
            "quantity": {"label": label, "unit_transformation": {"factor": factor, "log_reference": 1.0}},
        },
        "function_record": {
            "name": np.array(names, dtype=object) if len(names) > 1 else names[0],
            "type": "Throughput",
            "primary_channel": {"name": "Time"},
        },
    }


def _testlab(path: Path, *, together: bool, label: str = "µm", factor: float = 1e6) -> None:
    metres, names = MICRONS * 1e-6, [f"{k}:{name}" for k, name in enumerate(TAGS, start=1)]
    content = (
        {"Signal_0": _signal(names, metres, label, factor)}
        if together
        else {f"Signal_{k}": _signal([TAGS[k]], metres[:, k], label, factor) for k in range(4)}
    )
    turning = _signal(["Tacho"], SPEED * 2 * np.pi, "rpm", 60 / (2 * np.pi))
    scipy.io.savemat(path, content | {f"Signal_{len(content)}": turning})


def universal(
    *,
    binary: str = "",
    padded: bool = True,
    last_end: bool = True,
    names: Sequence[str] = TAGS,
    unit: str = "um",
) -> bytes:
    """Dataset 58 for every channel; `binary` is "<" or ">"."""
    parts: list[bytes] = []
    for k, name in enumerate(names):
        order = {"<": 1, ">": 2}.get(binary, 0)
        kind = (
            f"{58:6d}b{order:6d}{2:6d}{11:12d}{8 * COUNT:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
            if binary
            else f"{58:6d}"
        )
        lines = [f"{-1:6d}", kind, name, "NONE", "04-May-23 10:45:47", "Throughput -1", "NONE"]
        lines.append(
            f"{1:5d}{0:10d}{k + 1:5d}{0:10d} {'NONE':>10}{k + 1:10d}{1:4d} {'NONE':>10}{0:10d}{0:4d}"
        )
        lines.append(f"{4 if binary else 2:10d}{COUNT:10d}{1:10d}{START:13.5e}{STEP:13.5e}{0.0:13.5e}")
        for what, label, of in (
            (17, "Time", "s"),
            (8, "Displacement", unit),
            (0, "NONE", "NONE"),
            (0, "NONE", "NONE"),
        ):
            lines.append(f"{what:10d}{0:5d}{0:5d}{0:5d} {label:<20} {of:<20}")
        parts.append("".join(f"{line:<80}\n" if padded else f"{line}\n" for line in lines).encode("latin-1"))
        values = MICRONS[:, k]
        text = "".join("".join(f"{v:13.5e}" for v in values[i : i + 6]) + "\n" for i in range(0, COUNT, 6))
        parts.append(values.astype(f"{binary}f8").tobytes() if binary else text.encode())
        parts.append(f"{f'{-1:6d}':<80}\n".encode() if padded else f"{-1:6d}\n".encode())
    content = b"".join(parts)
    return content if last_end else content.rstrip()


def comtrade(kind: str, *, single: bool) -> Callable[[Path], None]:
    """Configuration and samples, side by side or in one file."""

    def write(path: Path) -> None:
        lines = ["Machine hall,REC1,2013", "5,5A,0D"]
        for k, name in enumerate([*TAGS, "Speed"], start=1):
            lines.append(
                f"{k},{name},,,{'Hz' if k == 5 else 'um'},{0.001 if k == 5 else 0.01},0,0,-32767,32767,1,1,P"
            )
        lines += [
            "50",
            "1",
            f"{1 / STEP:.0f},{COUNT}",
            "04/05/2023,10:45:47.000000",
            "04/05/2023,10:45:47.001000",
        ]
        lines += [kind, "1", "0,0", "B,3"]
        counts = np.rint(np.column_stack([MICRONS * 100, SPEED * 1000])).astype(int)
        if kind == "ASCII":
            rows = [f"{i + 1},{50 * i}," + ",".join(map(str, row)) for i, row in enumerate(counts)]
            data = ("\r\n".join(rows) + "\r\n").encode()
        else:
            data = b"".join(struct.pack("<II5i", i + 1, 50 * i, *row) for i, row in enumerate(counts))
        text = "\r\n".join(lines) + "\r\n"
        if not single:
            path.write_text(text)
            path.with_suffix(".dat").write_bytes(data)
            return
        size = "" if kind == "ASCII" else f": {len(data)}"
        head = f"--- file type: CFG ---\r\n{text}--- file type: INF ---\r\n\r\n--- file type: HDR ---\r\n\r\n"
        head += f"--- file type: DAT {kind}{size} ---\r\n"
        path.write_bytes(head.encode() + data)

    return write


ROUNDED = np.array([[float(f"{v:.5e}") for v in row] for row in MICRONS])
OF_MICRONS = {"unit": "um", "values": MICRONS}
SIEMENS = [
    Export(
        maker="Siemens",
        form="Testlab MAT, channels together",
        file="a.mat",
        content=lambda path: _testlab(path, together=True),
        names=[f"{k}:{name}" for k, name in enumerate(TAGS, start=1)],
        speed=True,
        **OF_MICRONS,
    ),
    Export(
        maker="Siemens",
        form="Testlab MAT, channels apart",
        file="a.mat",
        content=lambda path: _testlab(path, together=False),
        speed=True,
        **OF_MICRONS,
    ),
    Export(
        maker="Siemens",
        form="Testlab MAT, mil",
        file="a.mat",
        content=lambda path: _testlab(path, together=False, label="mil", factor=1 / 25.4e-6),
        unit="mil",
        values=MICRONS / 25.4,
        speed=True,
    ),
    Export(maker="Siemens", form="UFF58, padded lines", file="a.uff", content=universal(), **OF_MICRONS),
    Export(
        maker="Siemens",
        form="UFF58, last line without end",
        file="a.unv",
        content=universal(padded=False, last_end=False),
        **OF_MICRONS,
    ),
    Export(
        maker="Siemens",
        form="UFF58, non-ASCII head",
        file="a.uff",
        content=universal(unit="µm", names=[f"Läufer {name}" for name in TAGS]),
        names=[f"Läufer {name}" for name in TAGS],
        planes=("Läufer NDE", "Läufer DE"),
        **OF_MICRONS,
    ),
    Export(
        maker="Siemens", form="UFF58, big-endian", file="a.uff", content=universal(binary=">"), **OF_MICRONS
    ),
    Export(
        maker="Siemens",
        form="COMTRADE cff, ASCII",
        file="a.cff",
        content=comtrade("ASCII", single=True),
        speed=True,
        **OF_MICRONS,
    ),
    Export(
        maker="Siemens",
        form="COMTRADE cff, binary",
        file="a.cff",
        content=comtrade("BINARY32", single=True),
        speed=True,
        **OF_MICRONS,
    ),
    Export(
        maker="Siemens",
        form="COMTRADE cfg and dat",
        file="a.cfg",
        content=comtrade("ASCII", single=False),
        speed=True,
        **OF_MICRONS,
    ),
]


# ---- vibration monitoring and data loggers


def _monitor(names: Sequence[str], *, unit: str = "mil", encoding: str = "latin-1") -> bytes:
    """A German export with five lines of head, a decimal comma, the speed in 1/min and a status column."""
    scale = 1.0 / 25.4 if unit == "mil" else 1.0
    head = [
        "Anlage;Kompressor K-1",
        "Erstellt;04.05.2023 10:45:47",
        "Abtastrate;20000;Hz",
        "Trigger;Abschaltung",
        "",
    ]
    head.append(";".join(["Zeit [s]", *(f"{name} [{unit}]" for name in names), "Drehzahl [1/min]", "Status"]))
    body = "\r\n".join(
        ";".join(
            [f"{TIME[i]:.5f}", *(f"{v:.8f}" for v in MICRONS[i] * scale), f"{60 * SPEED[i]:.2f}", "0"]
        ).replace(".", ",")
        for i in range(COUNT)
    )
    return ("\r\n".join(head) + "\r\n" + body + "\r\n").encode(encoding)


def _dewesoft() -> bytes:
    head = ["Data export file", "File name : drop_0001.dxd", "Start time : 5/4/2023 10:45:47.000"]
    head += [
        "Number of channels : 5",
        "Sample rate : 20000 Hz",
        "Store type : fast on trigger",
        "Comments : ",
        "",
    ]
    head.append("\t".join(["Time (s)", *(f"{name} (µm)" for name in TAGS), "Speed (rpm)"]))
    body = _rows(np.column_stack([MICRONS, 60 * SPEED]), separator="\t", digits=3)
    return ("\n".join(head) + "\n" + body).encode("utf-8-sig")


def _catman() -> bytes:
    head = ["HBM catman AP", "Number of channels\t6", "Sample rate [Hz]\t20000", ""]
    head.append("\t".join(["Time  1 - default sample rate", *TAGS, "Speed"]))
    head.append("\t".join(["s", *["µm"] * 4, "1/min"]))
    body = _rows(np.column_stack([MICRONS, 60 * SPEED]), separator="\t", digits=3)
    return ("\r\n".join(head) + "\r\n" + body).encode("latin-1")


def _system1() -> bytes:
    head = ["Machine Name,K-1", "Point Name,VE-101X", "Wf Amp,51.063", "Number of Revs,16", "X-Axis Unit,ms"]
    head += [
        "Y-Axis Unit,µm",
        "Sample Speed, 3600 rpm",
        "Sample Status,Valid",
        "Timestamp,5/4/2023 10:45:47 AM",
    ]
    head += ["Variable,Disp Wf(128X/16revs).KPH", "X-Axis Value,Y-Axis Value"]
    return ("\n".join(head) + "\n" + _rows(MICRONS[:, :1], first=lambda i: [f"{1e3 * TIME[i]:.3f}"])).encode()


def _wav(path: Path) -> None:
    counts = np.rint(MICRONS / 500.0 * 2**15).astype("<i2").tobytes()
    form = struct.pack("<HHIIHH", 1, 4, 20_000, 160_000, 8, 16)
    body = (
        b"WAVEfmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", len(counts)) + counts
    )
    path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)


KKS = ("10MKA11CY011", "10MKA11CY012", "10MKA21CY011", "10MKA21CY012")
SPOKEN = ("Lager 1 horizontal", "Lager 1 vertikal", "Lager 2 horizontal", "Lager 2 vertikal")
IN_MIL = {"unit": "mil", "values": MICRONS / 25.4, "speed": True}
MONITORS = [
    Export(
        maker="Bently Nevada",
        form="API 670 tags with counters, status",
        file="a.csv",
        content=_monitor([f"Ch{k} {tag}" for k, tag in enumerate(API, start=1)]),
        names=[f"Ch{k} {tag}" for k, tag in enumerate(API, start=1)],
        planes=("VE-101", "VE-102"),
        **IN_MIL,
    ),
    Export(
        maker="Bently Nevada",
        form="KKS tags",
        file="a.csv",
        content=_monitor(KKS),
        names=KKS,
        planes=("10MKA11CY01", "10MKA21CY01"),
        **IN_MIL,
    ),
    Export(
        maker="Bently Nevada",
        form="System 1, one point",
        file="a.csv",
        content=_system1(),
        names=["VE-101X"],
        question=r"holds 1 channel that can be displacements .*it has VE-101X in um; export the",
    ),
    Export(
        maker="HBK",
        form="German words for the axes",
        file="a.txt",
        content=_monitor(SPOKEN, unit="µm"),
        names=SPOKEN,
        planes=("Lager 1", "Lager 2"),
        speed=True,
        **OF_MICRONS,
    ),
    Export(maker="HBK", form="catman", file="a.txt", content=_catman(), speed=True, **OF_MICRONS),
    Export(maker="Dewesoft", form="text", file="a.txt", content=_dewesoft(), speed=True, **OF_MICRONS),
    Export(
        maker="OROS",
        form="WAV",
        file="a.wav",
        content=_wav,
        names=[f"channel {k}" for k in range(1, 5)],
        question=r"does not tell it: say what it is with 'rotordrop profile a\.wav --full-scale",
    ),
]

EXPORTS = [*NI, *SCOPES, *SIEMENS, *MONITORS]
"""All of them."""
