"""Text recordings: every layout the recorders write, and what is said about a broken one."""

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.record.profile import Clock, Profile, SpeedSource, TextLayout
from rotordrop.record.readers.text import is_number
from rotordrop.record.record import read_record
from rotordrop.record.recording import split_unit

TIME = np.arange(-4, 16) * 5e-5
READINGS = np.array([[8.18, -6.98, -16.85, -16.31]]) + np.arange(20)[:, None] * np.array(
    [[-0.73, 0.2, 1.5, -3.25]]
)
SPEED_HZ = 60.0


def rows(separator, decimal, time, scale=1.0, digits=2, speed=SPEED_HZ):
    lines = []
    for i in range(len(TIME)):
        fields = [
            *([] if time is None else [time(i)]),
            *(f"{scale * v:.{digits}f}" for v in READINGS[i]),
            f"{speed:.2f}",
        ]
        lines.append(separator.join(fields).replace(".", decimal))
    return lines


NAMES = ["S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B"]


def recorder():
    head = [
        "# AMB controller event recorder;firmware 4.2.1",
        "# Machine: LP-400;fs [Hz]: 20000;pre-trigger [s]: 0.0002",
    ]
    names = ";".join(["Time [s]", *(f"{n} [um]" for n in NAMES), "Speed [Hz]"])
    return "\n".join([*head, names, *rows(";", ".", lambda i: f"{TIME[i]:.5f}")]) + "\n", "utf-8"


def german():
    head = [
        "Messung;LP-400 Auslauf",
        "Abtastrate;20000,0;Hz",
        "",
        ";".join(["Zeit", *NAMES, "Drehzahl"]),
        "s;µm;µm;µm;µm;Hz",
    ]
    return "\r\n".join([*head, *rows(";", ",", lambda i: f"{TIME[i]:.5f}")]) + "\r\n", "latin-1"


def without_time():
    head = ['"Start","2019-10-16T13:42:07.250000Z"', '"dt (s)",0.00005000', '"Trigger sample",4']
    head += [
        ",".join(f'"{n}"' for n in ["Channel", *NAMES, "N"]),
        '"Unit","um","um","um","um","Hz"',
        '"Sample",1,2,3,4,5',
    ]
    return "\n".join([*head, *rows(",", ".", str, digits=3)]) + "\n", "utf-8"


def volts():
    head = [
        "# raw sensor voltages, sensitivity 8.000 mV/um all channels, offset 0 V",
        "# Speed in rpm (hold)",
    ]
    names = "\t".join(["Time_ms", *(f"{n}_V" for n in NAMES), "Speed_rpm"])
    body = rows("\t", ".", lambda i: f"{1e3 * TIME[i]:.3f}", scale=8e-3, digits=5, speed=3600.0)
    return "\n".join([*head, names, *body]) + "\n", "utf-8"


def with_dates():
    start = np.datetime64("2019-10-16T13:42:07.250000")
    names = ",".join(["Timestamp", *(f"{n} (um)" for n in NAMES), "Speed (Hz)"])
    body = rows(",", ".", lambda i: str(start + np.timedelta64(50 * i, "us")))
    body = [line.replace("07.25,", "07.250000,") for line in body]
    return "\n".join([names, *body]) + "\n", "utf-16"


def in_millimetres():
    names = "|".join(["t [ms]", *(f"{n} [mm]" for n in NAMES), "Speed [rad/s]"])
    speed = 2 * np.pi * SPEED_HZ
    body = rows("|", ".", lambda i: f"{1e3 * TIME[i]:.3f}", scale=1e-3, digits=5, speed=speed)
    return "\n".join([names, *body]) + "\n", "utf-8"


LAYOUTS = [recorder, german, without_time, volts, with_dates, in_millimetres]


@pytest.fixture
def write(tmp_path):
    def put(text, name="drop.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(text.encode(encoding))
        return path

    return put


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_record(layout, write, machine):
    text, encoding = layout()
    record = read_record(write(text, encoding=encoding), machine)
    assert record.channel_names == tuple(NAMES)
    np.testing.assert_allclose(record.signals, READINGS * 1e-6, rtol=0, atol=1e-9)
    start = 0.0 if layout is with_dates else TIME[0]
    np.testing.assert_allclose(record.time - start, np.arange(20) * 5e-5, rtol=0, atol=1e-12)
    assert record.sampling_rate == pytest.approx(20000.0, rel=1e-9)
    np.testing.assert_allclose(record.speed, 2 * np.pi * SPEED_HZ, rtol=2e-5)
    assert not record.warnings


def test_the_hash_is_that_of_the_file(write, machine):
    import hashlib

    path = write(recorder()[0])
    assert read_record(path, machine).sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_sensitivity_of_the_machine_file_is_used_where_the_recording_gives_none(write, machine):
    text, _ = volts()
    path = write(text.split("\n", 1)[1])
    np.testing.assert_allclose(read_record(path, machine).signals, READINGS * 1e-6, rtol=0, atol=1e-9)


def test_two_sensitivities_that_disagree_are_reported(write, machine):
    text, _ = volts()
    record = read_record(write(text.replace("8.000 mV/um", "7.870 mV/um")), machine)
    np.testing.assert_allclose(record.signals, READINGS * 1e-6 * 8.0 / 7.87, rtol=0, atol=1e-9)
    assert any("7.87 mV/µm" in words and "8.00 mV/µm" in words for words in record.warnings)


def test_a_voltage_offset_in_the_comment_is_taken_off(write, machine):
    text, _ = volts()
    record = read_record(write(text.replace("offset 0 V", "offset -0.4 V")), machine)
    np.testing.assert_allclose(record.signals, (READINGS + 50.0) * 1e-6, rtol=0, atol=1e-9)


def test_a_header_without_names_is_refused_and_a_profile_helps(write, machine):
    body = "\n".join(rows(";", ".", lambda i: f"{TIME[i]:.5f}")) + "\n"
    path = write(body)
    with pytest.raises(RecordError, match=r"no row names the 6 columns \(there is no header\)"):
        read_record(path, machine)
    names = ("Time [s]", *(f"{n} [um]" for n in NAMES), "Speed [Hz]")
    record = read_record(path, machine, profile=Profile(text=TextLayout(names=names)))
    np.testing.assert_allclose(record.signals, READINGS * 1e-6, rtol=0, atol=1e-9)


def test_sampling_interval_by_profile(write, machine):
    text, _ = without_time()
    text = text.replace('"dt (s)",0.00005000\n', "").replace('"Trigger sample",4\n', "")
    path = write(text)
    with pytest.raises(
        RecordError, match=r"no time column among Channel, S_NDE_A, .* and no sampling interval"
    ):
        read_record(path, machine)
    record = read_record(path, machine, profile=Profile(time=Clock(step="50 us", start="-0.2 ms")))
    np.testing.assert_allclose(record.time, TIME, rtol=0, atol=1e-12)
    plain = read_record(path, machine, profile=Profile(time=Clock(step="50 us")))
    assert plain.time[0] == 0.0
    assert any("counts from the first sample" in note for note in plain.notes)


def test_a_header_without_readings_is_told_as_that(write, machine):
    with pytest.raises(RecordError, match=r"line 1\) reads 'Time \[s\];S_NDE_A \[um\]': a header without"):
        read_record(write("Time [s];S_NDE_A [um]\n"), machine)


def test_wrong_column_count_names_line_and_counts(write, machine):
    lines = recorder()[0].split("\n")
    lines[9] = lines[9].rsplit(";", 1)[0]
    with pytest.raises(
        RecordError, match=r"drop.csv, line 10: 5 columns where 6 are expected .*1 such lines"
    ):
        read_record(write("\n".join(lines)), machine)


def test_something_that_is_no_number_names_line_and_column(write, machine):
    lines = recorder()[0].split("\n")
    lines[9] = lines[9].replace("8.98", "broken").replace("-5.78", "broken")
    assert "broken" in lines[9]
    with pytest.raises(RecordError, match=r"line 10, column 'S_NDE_B \[um\]': 'broken' is not a number"):
        read_record(write("\n".join(lines)), machine)


@pytest.mark.parametrize("blank", ["", "NaN", "--", "n/a"])
def test_a_missing_sample_becomes_nan(blank, write, machine):
    lines = recorder()[0].split("\n")
    fields = lines[9].split(";")
    fields[2] = blank
    lines[9] = ";".join(fields)
    record = read_record(write("\n".join(lines)), machine)
    assert np.isnan(record.signals[6, 1])
    assert np.isfinite(record.signals).sum() == record.signals.size - 1


@pytest.mark.parametrize("cut", [3, 12, 25])
def test_a_truncated_file_keeps_the_intact_rows_and_says_so(cut, write, machine):
    text = recorder()[0]
    record = read_record(write(text[:-cut]), machine)
    assert len(record.time) == 19
    assert any("truncated" in words and "19 complete rows" in words for words in record.warnings)


def test_an_empty_file_is_refused(write, machine):
    with pytest.raises(RecordError, match=r"drop.csv is empty \(0 bytes\)"):
        read_record(write(""), machine)


def test_a_blank_file_is_refused(write, machine):
    with pytest.raises(RecordError, match=r"drop.csv is blank \(3 bytes\)"):
        read_record(write(" \n "), machine)


def test_a_file_that_is_no_text_is_refused(write, machine):
    with pytest.raises(RecordError, match=r"not a text file: character 3 is a zero byte"):
        read_record(write("ab\x00cd" * 50), machine)


def test_prose_is_refused(write, machine):
    with pytest.raises(RecordError, match=r"no columns of numbers .*line 3 reads 'here'"):
        read_record(write("no numbers\nat all\nhere\n"), machine)


def test_an_unknown_encoding_is_refused(write, machine):
    with pytest.raises(RecordError, match=r"cannot be read as utf-9"):
        read_record(write(recorder()[0]), machine, profile=Profile(text=TextLayout(encoding="utf-9")))


def test_a_missing_file_is_refused(tmp_path, machine):
    with pytest.raises(RecordError, match=r"nowhere.csv does not exist"):
        read_record(tmp_path / "nowhere.csv", machine)
    with pytest.raises(RecordError, match=r"is a folder"):
        read_record(tmp_path, machine)


def test_an_unknown_format_is_refused(write, machine):
    with pytest.raises(RecordError, match=r"no reader for 'xyz'; known are .*csv.*tdms"):
        read_record(write("a", name="drop.xyz"), machine)


def test_speed_by_hand(write, machine):
    text, _ = recorder()
    text = "\n".join(
        line.rsplit(";", 1)[0] if ";" in line and line[0] != "#" else line for line in text.split("\n")
    )
    path = write(text)
    assert read_record(path, machine).speed is None
    record = read_record(path, machine, profile=Profile(speed=SpeedSource(constant="3600 rpm")))
    np.testing.assert_allclose(record.speed, 120 * np.pi)
    assert "speed given by hand: 3600 rpm" in record.notes


@pytest.mark.parametrize(
    ("written", "name", "label", "unit"),
    [
        ("S_A [um]", "S_A", "S_A", "um"),
        ("S_A (µm)", "S_A", "S_A", "um"),
        ("S_A_V", "S_A", "S_A_V", "V"),
        ("S_DE_A", "S_DE_A", "S_DE_A", ""),
        ("Speed_rpm", "Speed", "Speed_rpm", "rpm"),
        ("Drehzahl [U/min]", "Drehzahl", "Drehzahl", "rpm"),
        ("Kraft [kN]", "Kraft", "Kraft", "kN"),
    ],
)
def test_units_in_column_names(written, name, label, unit):
    assert split_unit(written) == (name, label, unit)


@pytest.mark.parametrize(
    ("text", "decimal", "expected"),
    [
        ("0,27", ",", True),
        ("0.27", ",", False),
        ("0,27", ".", False),
        ("-1e-5", ".", True),
        ("1_000", ".", False),
        ("", ".", False),
    ],
)
def test_a_number_has_one_decimal_sign(text, decimal, expected):
    assert is_number(text, decimal) is expected
