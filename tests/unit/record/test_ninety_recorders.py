"""Ninety ways to write one record as text: each is read rightly, or refused with the way out."""

import itertools

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.record.record import read_record

NAMES = ["S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B"]
COUNT, STEP = 60, 5e-5
READINGS = np.round(
    np.array([8.18, -6.98, -16.85, -16.31])
    + np.outer(np.arange(COUNT), [-0.73, 0.21, 1.57, -3.25])
    + np.random.default_rng(0).normal(0.0, 0.3, (COUNT, 4)),
    2,
)
SIGNS = [(s, d) for s, d in itertools.product((";", ",", "\t", "|", " "), (".", ",")) if s != d]


def number(value, digits, decimal):
    return f"{value:.{digits}f}".replace(".", decimal)


def rows(separator, decimal, first, *, speed="60.00", middle=(), scale=1.0, digits=2):
    """Fields of every sample: what stands in front, the readings, the speed, what stands behind."""
    return [
        [
            *first(i),
            *(number(scale * value, digits, decimal) for value in READINGS[i]),
            *middle,
            speed.replace(".", decimal),
        ]
        for i in range(COUNT)
    ]


def seconds(decimal, factor=1.0, digits=5):
    return lambda i: [number(factor * i * STEP, digits, decimal)]


def lined(separator, head, body, end="\n"):
    return end.join(separator.join(row) for row in [*head, *body]) + end


def plain(separator, decimal):
    names = ["Time[s]", *(f"{name}[um]" for name in NAMES), "Speed[Hz]"]
    return lined(separator, [names], rows(separator, decimal, seconds(decimal))).encode()


def slashed(separator, decimal):
    names = ["t / ms", *(f"{name} / µm" for name in NAMES), "n / min^-1"]
    names = [name.replace(" / ", "_") for name in names] if separator == " " else names
    names[-1] = "n[1/min]" if separator == " " else names[-1]
    body = rows(separator, decimal, seconds(decimal, 1e3, 2), speed="3600.00")
    return lined(separator, [names], body).encode()


def unit_row(separator, decimal):
    head = [["Time", *NAMES, "Speed"], ["(s)", *["(µm)"] * 4, "(Hz)"]]
    return lined(separator, head, rows(separator, decimal, seconds(decimal)), "\r\n").encode("latin-1")


def counted(separator, decimal):
    head = ["Recorder: type 7", "Sampling rate: 20000 Hz", "Comment: drop test"]
    names = ["Sample", *(f"{name}[um]" for name in NAMES), "Speed[Hz]"]
    body = rows(separator, decimal, lambda i: [str(i)])
    return ("\r\n".join(head) + "\r\n" + lined(separator, [names], body, "\r\n")).encode()


def stamped(separator, decimal):
    def stamp(i):
        micro = 999_000 + 50 * i
        return [f"2019-10-16T13:42:{7 + micro // 10**6:02d}.{micro % 10**6:06d}Z"]

    names = ["Timestamp", *(f"{name}(um)" for name in NAMES), "Speed(Hz)"]
    return lined(separator, [names], rows(separator, decimal, stamp)).encode("utf-8-sig")


def german(separator, decimal):
    def stamp(i):
        micro = 999_000 + 50 * i
        comma = "," if separator != "," else "."
        return ["16.10.2019", f"13:42:{7 + micro // 10**6:02d}{comma}{micro % 10**6:06d}"]

    names = ["Datum", "Uhrzeit", *(f"{name}[µm]" for name in NAMES), "Status", "Drehzahl[U/min]"]
    body = rows(separator, decimal, stamp, middle=("OK",), speed="3600.00")
    return lined(separator, [names], body).encode("latin-1")


def trailing(separator, decimal):
    names = ["Time[s]", *(f"{name}[mm]" for name in NAMES), "Speed[rad/s]"]
    body = rows(separator, decimal, seconds(decimal), speed="376.99112", scale=1e-3, digits=5)
    return lined(separator, [[*names, ""]], [[*row, ""] for row in body]).encode()


def shuffled(separator, decimal):
    names = ["Speed[Hz]", "Time[s]", *(f"{name}[um]" for name in NAMES[::-1]), "Temp[degC]"]
    body = [
        ["60", *seconds(decimal)(i), *(number(v, 2, decimal) for v in READINGS[i, ::-1]), "21"]
        for i in range(COUNT)
    ]
    return lined(separator, [names], body).encode("utf-16")


def in_volts(separator, decimal):
    names = ["Time[s]", *(f"{name}[V]" for name in NAMES), "Speed[Hz]"]
    body = rows(separator, decimal, seconds(decimal), scale=8e-3, digits=6)
    return ("# Sensitivity: 8 mV/um\n" + lined(separator, [names], body)).encode()


def quoted(separator, decimal):
    names = ["Time[s]", *(f"{name}[um]" for name in NAMES), "Speed[Hz]"]
    table = [[f'"{field}"' for field in row] for row in [names, *rows(separator, decimal, seconds(decimal))]]
    return ("\n".join(separator.join(row) for row in table) + "\n\nEnd of recording\n").encode()


HABITS = [plain, slashed, unit_row, counted, stamped, german, trailing, shuffled, in_volts, quoted]


def refusal(habit, separator):
    """What is said where it is refused: a footer below the rows, a key of two words among blanks."""
    if habit is quoted:
        return r"line 62: \d columns where 6 are expected.*repair the line or export again"
    if habit is counted and separator == " ":
        return r'no sampling interval; name it in the profile, time.channel = "..." or time.step'
    return None


@pytest.mark.parametrize("habit", HABITS, ids=lambda habit: habit.__name__)
@pytest.mark.parametrize(("separator", "decimal"), SIGNS)
def test_no_way_of_writing_is_read_wrongly(habit, separator, decimal, machine, tmp_path):
    path = tmp_path / "drop.txt"
    path.write_bytes(habit(separator, decimal))
    if way_out := refusal(habit, separator):
        with pytest.raises(RecordError, match=way_out):
            read_record(path, machine)
        return
    record = read_record(path, machine)
    np.testing.assert_allclose(record.signals, READINGS * 1e-6, rtol=0, atol=1e-12)
    np.testing.assert_allclose(record.time - record.time[0], np.arange(COUNT) * STEP, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.speed, 120 * np.pi, rtol=1e-6)
    assert record.warnings == ()
