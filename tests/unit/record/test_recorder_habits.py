"""What recorders write: every habit is read rightly, or refused with the way out."""

import gzip
import io
import tracemalloc

import numpy as np
import pytest
from tests.unit.record.every_format import as_comtrade
from tests.unit.record.test_delimited import COUNT, NAMES, READINGS, STEP, rows

from rotordrop import check_record, read_record
from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile, SpeedSource, TextLayout
from rotordrop.record.readers import read_recording


def table(first, *, separator=";", names=None, extra=()):
    """Lines of a recording: what stands in front of the readings is given for every row."""
    head = names or ["Time [s]", *(f"{name} [um]" for name in NAMES), "Speed [Hz]"]
    body = [[*row, *(word for _, word in extra)] for row in rows(first)]
    return "\n".join(map(separator.join, [[*head, *(name for name, _ in extra)], *body])) + "\n"


def seconds(i):
    return [f"{i * STEP:.5f}"]


def time_of_day(i):
    return [f"23:59:59.{999_000 + 50 * i:06d}" if i < 20 else f"00:00:00.{50 * (i - 20):06d}"]


COUNTER = "fs = 20000 Hz\n" + table(
    lambda i: [str(i)], names=["Sample", *(f"{n} [um]" for n in NAMES), "Speed [Hz]"]
)
WAYS = {
    "text columns with commas": table(seconds, separator=",", extra=[("Note", '"a, b"')]),
    "time of day, on after midnight": table(time_of_day),
    "no last line end": table(seconds).rstrip("\n"),
    "rate without a time column": "fs = 20000 Hz\n"
    + table(lambda i: [], names=[*(f"{n} [um]" for n in NAMES), "Speed [Hz]"]),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_habit_gives_the_same_record(way, machine, tmp_path):
    path = tmp_path / "drop.log"
    path.write_text(WAYS[way], encoding="utf-8", newline="")
    record = read_record(path, machine)
    np.testing.assert_allclose(record.signals, READINGS * 1e-6, rtol=0, atol=1e-12)
    np.testing.assert_allclose(record.time, np.arange(COUNT) * STEP, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.speed, 120 * np.pi, rtol=1e-6)
    assert record.warnings == ()


@pytest.mark.parametrize("damaged", [1, 2, 20, 35])
@pytest.mark.parametrize("wrong", ["?", "1_0", "٣", "0x1"])
def test_a_damaged_row_at_the_start_is_no_header(damaged, wrong, machine, tmp_path):
    lines = table(seconds).split("\n")
    for row in range(1, damaged + 1):
        lines[row] = lines[row].replace(";", f";{wrong}", 1)
    path = tmp_path / "drop.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(RecordError, match=r"line 2\b|no columns of num|no channel 'S_NDE_A'|not a number"):
        read_record(path, machine)


def test_missing_rows_and_endless_lines_are_told(machine, tmp_path):
    lines = COUNTER.split("\n")
    path = tmp_path / "drop.csv"
    path.write_text("\n".join(lines[:20] + lines[23:]))
    record = read_record(path, machine)
    assert len(record.time) == COUNT - 3
    found = check_record(record, machine)
    assert next(finding.kind for finding in found if finding.severity == "stop") == "dropped block"
    assert "3 samples are missing" in found[0].message
    path.write_text("a;b\n" + "1;" * 1_000_000)
    with pytest.raises(RecordError, match=r"line 2 has 2000000 characters"):
        read_recording(path, Profile())


@pytest.mark.parametrize("header", ["9" * 20_000, "x" + " " * 20_000 + "[um]", "(" * 20_000 + "um"])
def test_endless_headers_cost_nothing(header, machine, tmp_path):
    path = tmp_path / "drop.csv"
    path.write_text(f"# {header}\n" + table(seconds).replace("Time [s]", header[:15_000], 1))
    with pytest.raises(RecordError):
        read_record(path, machine)


BY_PROFILE = Profile(text=TextLayout(names=tuple(NAMES)), speed=SpeedSource(constant="60 Hz"))


def test_arrays_that_are_damaged_or_dangerous_are_refused(tmp_path):
    np.save(tmp_path / "evil.npy", np.array([object(), None], dtype=object), allow_pickle=True)
    with pytest.raises(RecordError, match=r"holds Python objects, which are not unpacked"):
        read_recording(tmp_path / "evil.npy", Profile())
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**15, 4)})
    (tmp_path / "bomb.npy").write_bytes(head.getvalue() + bytes(64))
    with pytest.raises(RecordError, match=r"declares 32000000000000000 bytes and 64 are present"):
        read_recording(tmp_path / "bomb.npy", BY_PROFILE)
    # Brackets that do not close ended in a traceback of the tokenizer.
    np.save(tmp_path / "drop.npy", READINGS)
    content = (tmp_path / "drop.npy").read_bytes()
    (tmp_path / "drop.npy").write_bytes(content.replace(b"(60, 4), }", b"((60, 4,  "))
    with pytest.raises(RecordError, match=r"is no intact NPY array"):
        read_recording(tmp_path / "drop.npy", BY_PROFILE)


@pytest.mark.parametrize("suffix", ["csv", "csv.gz", "h5", "mat", "tdms", "uff", "wav", "npy", "npz", "cfg"])
def test_a_file_too_large_for_memory_is_refused_before_it_is_read(tmp_path, suffix):
    path = tmp_path / f"drop.{suffix}"
    with path.open("wb") as stream:
        stream.truncate(20 * 2**30)
    with pytest.raises(RecordError, match=rf"drop\.{suffix} has 21\.5 GB, at most 1\.07 GB are read; export"):
        read_recording(path, Profile())


def test_what_is_no_text_is_refused_by_its_beginning(tmp_path):
    path = tmp_path / "drop.csv"
    with path.open("wb") as stream:
        stream.write(b"time,a\n")
        stream.truncate(2**30)
    tracemalloc.start()
    with pytest.raises(RecordError, match=r"drop\.csv is not a text file: character 8 is a zero byte"):
        read_recording(path, Profile())
    path.write_bytes(b"1" * 20_000_000)
    with pytest.raises(RecordError, match=r"line 1 has more than 1000000 characters; no row"):
        read_recording(path, Profile())
    path.write_bytes(b'"' + b"1,\n" * 2_000_000)
    with pytest.raises(
        RecordError, match=r"2000000 lines of 3\.0 characters in the mean; a row of two numbers"
    ):
        read_recording(path, Profile())
    assert tracemalloc.get_traced_memory()[1] < 30e6
    tracemalloc.stop()


def test_gzip_of_any(machine, tmp_path):
    path = tmp_path / "drop.csv.gz"
    path.write_bytes(gzip.compress(table(seconds).encode())[:-9])
    with pytest.raises(RecordError, match=r"drop\.csv\.gz cannot be unpacked: .*copy it again"):
        read_record(path, machine)
    path.write_bytes(gzip.compress(bytes(40 * 2**20)))
    with pytest.raises(RecordError, match=r"drop\.csv\.gz claims \d+ samples .*exhaust.*at most 34 MB"):
        read_record(path, machine)


WITH_SPEED = np.column_stack([READINGS, np.full(COUNT, 60.0)])


@pytest.mark.parametrize("key", ["Samples", "Number of samples", "Anzahl Messwerte", "Record length"])
def test_rows_missing_at_the_end_show_by_the_length_the_header_declares(key, machine, tmp_path):
    """Cut behind a whole row, a text shows no damage by itself."""
    lines = table(seconds).split("\n")
    path = tmp_path / "drop.csv"
    path.write_text("\n".join([f"{key}: {COUNT}", *lines]))
    assert read_record(path, machine).warnings == ()
    path.write_text("\n".join([f"{key}: {COUNT}", *lines[:-9]]) + "\n")
    (told,) = read_record(path, machine).warnings
    assert f"declares {COUNT} samples and {COUNT - 8} are present" in told


@pytest.mark.parametrize(
    ("revision", "stamp", "day"),
    [
        (",1999", "01/03/2026", "2026-03-01"),
        (",2013", "01/03/2026", "2026-03-01"),
        (",1991", "03/01/2026", "2026-03-01"),
        ("", "03/01/26", "2026-03-01"),
        ("", "03/14/98", "1998-03-14"),
        (",1999", "03/14/2026", "2026-03-14"),
    ],
)
def test_the_revision_of_a_configuration_says_which_day_a_date_is(revision, stamp, day, machine, tmp_path):
    """IEEE C37.111: the month first in 1991, which need not be named, and the day first since 1999."""
    as_comtrade(tmp_path / "drop.cfg", "ASCII", WITH_SPEED, 20_000, 5e-4)
    text = (tmp_path / "drop.cfg").read_text().replace(",1999", revision).replace("16/10/2019", stamp)
    (tmp_path / "drop.cfg").write_text(text)
    record = read_record(tmp_path / "drop.cfg", machine)
    assert record.event_date == f"{day}T13:42:07.000500"
    assert not any("leaves open" in note for note in record.notes)


def test_a_configuration_with_a_damaged_rate(machine, tmp_path):
    as_comtrade(tmp_path / "drop.cfg", "ASCII", WITH_SPEED, 20_000, 5e-4, -1.5)
    text = (tmp_path / "drop.cfg").read_text()
    (tmp_path / "drop.cfg").write_text(text.replace("20000,60", "20000,6°", 1), encoding="latin-1")
    with pytest.raises(RecordError, match=r"line \d+: .*the configuration is damaged"):
        read_record(tmp_path / "drop.cfg", machine)
    (tmp_path / "drop.cfg").write_text(text.replace("20000,60", "26000,60", 1))
    (told,) = read_record(tmp_path / "drop.cfg", machine).warnings
    assert "0.00226923 s by the sampling rates and 0.00295 s by their time stamps" in told
