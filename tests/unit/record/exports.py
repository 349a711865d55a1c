"""One recording as the recorders of many makers export it, written by hand after their documents."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import scipy.io
from tests.unit.record import every_format

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


@dataclass(frozen=True)
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
    Export("NI", "LVM, no X column", "a.lvm", labview("No")),
    Export("NI", "LVM, one X column", "a.lvm", labview("One")),
    Export("NI", "LVM, many X columns", "a.lvm", labview("Multi")),
    Export("NI", "LVM, decimal comma", "a.lvm", labview("No", decimal=",")),
    Export("NI", "LVM, commas between", "a.lvm", labview("One", separator=",")),
    Export("NI", "LVM, comments", "a.lvm", labview("One", comments=True)),
    Export(
        "NI",
        "LVM, segments, the first of one row",
        "a.lvm",
        labview("No", segments=(range(1), range(1, COUNT))),
    ),
    Export(
        "NI",
        "LVM, no head",
        "a.lvm",
        _rows(VOLTS, separator="\t").encode(),
        question=r"no row names the 5 columns .*name them in the profile, text\.names = ",
    ),
    Export("NI", "TDMS", "a.tdms", _tdms),
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


BY_NUMBER = {"names": COUNTED, "planes": ("plane 1", "plane 2")}
CHANNELS, LETTERS = ([f"Channel {sign}" for sign in signs] for signs in ("1234", "ABCD"))
NUMBERED = BY_NUMBER | {"names": CHANNELS}
VISION = ("x-axis,1,2,3,4\nsecond,Volt,Volt,Volt,Volt\n" + _rows(VOLTS)).encode()
MSO5000 = ("Time(s),CH1(V),CH2(V),CH3(V),CH4(V),\n" + _rows(VOLTS, behind=[""])).encode()
LECROY = (
    "LECROYHDO6104,12345,Waveform\nSegments,1,SegmentSize,60\nSegment,TrigTime,TimeSinceSegment1\n"
    "#1,04-May-2023 10:45:47,0\nTime,Ampl\n" + _rows(VOLTS[:, :1])
).encode()
ONE = r"holds 1 channel that can be displacements .*it has Ampl in \?; export the displacements"
SCOPES = [
    Export("Tektronix", "head beside the readings", "a.csv", _tektronix_beside(), **BY_NUMBER),
    Export("Tektronix", "labels", "a.csv", _tektronix(TAGS)),
    Export("Tektronix", "no labels", "a.csv", _tektronix([""] * 4), **BY_NUMBER),
    Export("Keysight", "InfiniiVision", "a.csv", VISION, **BY_NUMBER),
    Export("Keysight", "Infiniium", "a.csv", _keysight_infiniium(), **NUMBERED),
    Export("LeCroy", "one trace", "a.csv", LECROY, question=ONE),
    Export("Rigol", "sequence, start and increment", "a.csv", _rigol(), **BY_NUMBER),
    Export("Rigol", "MSO5000", "a.csv", MSO5000, **BY_NUMBER),
    Export("Pico", "channels A to D", "a.csv", _pico(names=LETTERS), **NUMBERED | {"names": LETTERS}),
    Export("Pico", "semicolons, decimal comma", "a.csv", _pico(";", ",")),
    Export("Pico", "text, millivolts", "a.txt", _pico("\t", milli=True), unit="mV", values=VOLTS * 1e3),
    Export("Yokogawa", "HResolution", "a.csv", _yokogawa()),
    Export("Yokogawa", "no blank column", "a.csv", _yokogawa("none")),
    Export("Yokogawa", "decimal comma", "a.csv", _yokogawa("", ",")),
    Export("Yokogawa", "SampleRate", "a.csv", _yokogawa(key="SampleRate")),
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
    *, last_end: bool = True, names: Sequence[str] = TAGS, unit: str = "um", **form: object
) -> bytes:
    """Dataset 58 for every channel, in single precision where it is text."""
    channels = dict(zip(names, MICRONS.T, strict=False))
    content = every_format.universal(channels, START, STEP, unit=unit, single=True, **form)
    return content if last_end else content.rstrip()


def comtrade(kind: str, *, single: bool) -> Callable[[Path], None]:
    """Configuration and samples, side by side or in one file."""

    def write(path: Path) -> None:
        table, form = np.column_stack([MICRONS, SPEED]), {"names": TAGS, "step": 0.001, "revision": 2013}
        every_format.as_comtrade(path, kind, table, round(1 / STEP), 1e-3, **form)
        if not single:
            return
        text, data = path.with_suffix(".cfg").read_bytes().decode(), path.with_suffix(".dat").read_bytes()
        size = "" if kind == "ASCII" else f": {len(data)}"
        head = f"--- file type: CFG ---\r\n{text}--- file type: INF ---\r\n\r\n--- file type: HDR ---\r\n\r\n"
        head += f"--- file type: DAT {kind}{size} ---\r\n"
        path.write_bytes(head.encode() + data)

    return write


OF_MICRONS = {"unit": "um", "values": MICRONS}
TURNING, IN_MIL = (
    {"speed": True, "unit": unit, "values": MICRONS / k} for unit, k in (("um", 1), ("mil", 25.4))
)
COUNTED_TAGS = [f"{k}:{name}" for k, name in enumerate(TAGS, start=1)]
RUNNERS = {"names": [f"Läufer {name}" for name in TAGS], "planes": ("Läufer NDE", "Läufer DE")}
ABROAD = universal(unit="µm", names=RUNNERS["names"])
TOGETHER, APART = (partial(_testlab, together=one) for one in (True, False))
SIEMENS = [
    Export("Siemens", "Testlab MAT, channels together", "a.mat", TOGETHER, COUNTED_TAGS, **TURNING),
    Export("Siemens", "Testlab MAT, channels apart", "a.mat", APART, **TURNING),
    Export("Siemens", "Testlab MAT, mil", "a.mat", partial(APART, label="mil", factor=1 / 25.4e-6), **IN_MIL),
    Export("Siemens", "UFF58, padded lines", "a.uff", universal(), **OF_MICRONS),
    Export(
        "Siemens",
        "UFF58, last line without end",
        "a.unv",
        universal(padded=False, last_end=False),
        **OF_MICRONS,
    ),
    Export("Siemens", "UFF58, non-ASCII head", "a.uff", ABROAD, **RUNNERS, **OF_MICRONS),
    Export("Siemens", "UFF58, big-endian", "a.uff", universal(binary=">"), **OF_MICRONS),
    Export("Siemens", "COMTRADE cff, ASCII", "a.cff", comtrade("ASCII", single=True), **TURNING),
    Export("Siemens", "COMTRADE cff, binary", "a.cff", comtrade("BINARY32", single=True), **TURNING),
    Export("Siemens", "COMTRADE cfg and dat", "a.cfg", comtrade("ASCII", single=False), **TURNING),
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


KKS = ("10MKA11CY011", "10MKA11CY012", "10MKA21CY011", "10MKA21CY012")
SPOKEN = ("Lager 1 horizontal", "Lager 1 vertikal", "Lager 2 horizontal", "Lager 2 vertikal")
TAGGED = [f"Ch{k} {tag}" for k, tag in enumerate(API, start=1)]
POINT = r"holds 1 channel that can be displacements .*it has VE-101X in um; export the"
SCALE = r"does not tell it: say what it is with 'rotordrop profile .*a\.wav --full-scale"
WAVE = partial(every_format.as_wav, readings=MICRONS, rate=20_000)
BENTLY, API_PLANES, KKS_PLANES = "Bently Nevada", ("VE-101", "VE-102"), ("10MKA11CY01", "10MKA21CY01")
ROOMS = {"names": SPOKEN, "planes": ("Lager 1", "Lager 2")}
MONITORS = [
    Export(BENTLY, "API 670 tags, status", "a.csv", _monitor(TAGGED), TAGGED, planes=API_PLANES, **IN_MIL),
    Export(BENTLY, "KKS tags", "a.csv", _monitor(KKS), KKS, planes=KKS_PLANES, **IN_MIL),
    Export(BENTLY, "System 1, one point", "a.csv", _system1(), ["VE-101X"], question=POINT),
    Export("HBK", "German words for the axes", "a.txt", _monitor(SPOKEN, unit="µm"), **ROOMS, **TURNING),
    Export("HBK", "catman", "a.txt", _catman(), **TURNING),
    Export("Dewesoft", "text", "a.txt", _dewesoft(), **TURNING),
    Export("OROS", "WAV", "a.wav", WAVE, question=SCALE),
]

EXPORTS = [*NI, *SCOPES, *SIEMENS, *MONITORS]
"""All of them."""
