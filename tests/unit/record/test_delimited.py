"""Text recordings: every layout, clocks that were rounded, and what is said about a broken one."""

import numpy as np
import pytest

from rotordrop import example_machine, read_record
from rotordrop.errors import RecordError
from rotordrop.evidence.quality.recorder import check_clock
from rotordrop.record.profile import Clock, Profile, TextLayout

NAMES = ["S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B"]
COUNT, STEP = 60, 5e-5
READINGS = np.round(
    np.array([8.18, -6.98, -16.85, -16.31])
    + np.outer(np.arange(COUNT), [-0.73, 0.21, 1.57, -3.25])
    + np.random.default_rng(0).normal(0.0, 0.3, (COUNT, 4)),
    2,
)
TIME = np.arange(-4, COUNT - 4) * STEP
SPEED_HZ = 60.0


def rows(first, *, speed="60.00", scale=1.0, digits=2):
    """Fields of every sample: what stands in front, the readings, the speed."""
    return [[*first(i), *(f"{scale * v:.{digits}f}" for v in READINGS[i]), speed] for i in range(COUNT)]


def text_of(head, separator, first, **more):
    """A head and the rows below it, each behind its entry of the first column."""
    table = rows(lambda i: [str(first[i])], **more)
    return "\n".join([head, *(separator.join(row) for row in table)]) + "\n"


COLUMNS = ("Time [s]", *(f"{n} [um]" for n in NAMES), "Speed [Hz]")
HEAD = ("# AMB controller event recorder;firmware 4.2.1", "# fs [Hz]: 20000;pre-trigger [s]: 0.0002")
RECORDER = text_of("\n".join([*HEAD, ";".join(COLUMNS)]), ";", [f"{t:.5f}" for t in TIME])
WITHOUT_TIME = text_of(
    '"Start","2019-10-16T13:42:07.250000Z"\n"dt (s)",0.00005000\n"Trigger sample",4\n'
    '"Channel","S_NDE_A","S_NDE_B","S_DE_A","S_DE_B","N"\n"Unit","um","um","um","um","Hz"\n"Sample",1,2,3,4,5',
    *(",", range(COUNT)),
    digits=3,
)
VOLTS = text_of(
    "# raw sensor voltages, sensitivity 8.000 mV/um all channels, offset 0 V\n# Speed in rpm (hold)\n"
    + "\t".join(["Time_ms", *(f"{n}_V" for n in NAMES), "Speed_rpm"]),
    *("\t", [f"{1e3 * t:.3f}" for t in TIME]),
    scale=8e-3,
    digits=5,
    speed="3600.00",
)
LAYOUTS = {"recorder": RECORDER, "without time": WITHOUT_TIME, "volts": VOLTS}


@pytest.fixture
def write(tmp_path):
    def put(text, name="drop.csv"):
        path = tmp_path / name
        path.write_bytes(text.encode())
        return path

    return put


@pytest.mark.parametrize("text", LAYOUTS.values(), ids=LAYOUTS)
def test_every_layout_gives_the_same_record(text, write, machine):
    record = read_record(write(text), machine)
    assert record.channel_names == tuple(NAMES)
    np.testing.assert_allclose(record.signals, READINGS * 1e-6, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.time, TIME, rtol=0, atol=1e-12)
    assert record.sampling_rate == pytest.approx(20000.0, rel=1e-9)
    np.testing.assert_allclose(record.speed, 2 * np.pi * SPEED_HZ, rtol=2e-5)
    assert not record.warnings


def test_layouts_that_lack_names_or_voltages_take_them_from_elsewhere(write, machine):
    path = write(VOLTS.split("\n", 1)[1])
    np.testing.assert_allclose(read_record(path, machine).signals, READINGS * 1e-6, rtol=0, atol=1e-9)
    record = read_record(write(VOLTS.replace("8.000 mV/um", "7.870 mV/um")), machine)
    np.testing.assert_allclose(record.signals, READINGS * 1e-6 * 8.0 / 7.87, rtol=0, atol=1e-9)
    assert any("7.87 mV/µm" in words and "8.00 mV/µm" in words for words in record.warnings)
    record = read_record(write(VOLTS.replace("offset 0 V", "offset -0.4 V")), machine)
    np.testing.assert_allclose(record.signals, (READINGS + 50.0) * 1e-6, rtol=0, atol=1e-9)
    path = write(RECORDER.split("\n", 3)[3])
    with pytest.raises(RecordError, match=r"no row names the 6 columns \(there is no header\)"):
        read_record(path, machine)
    record = read_record(path, machine, profile=Profile(text=TextLayout(names=COLUMNS)))
    np.testing.assert_allclose(record.signals, READINGS * 1e-6, rtol=0, atol=1e-9)


def test_sampling_interval_by_profile(write, machine):
    text = WITHOUT_TIME.replace('"dt (s)",0.00005000\n', "").replace('"Trigger sample",4\n', "")
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


@pytest.mark.parametrize("cut", [3, 12, 25])
def test_a_truncated_file_keeps_the_intact_rows_and_says_so(cut, write, machine):
    record = read_record(write(RECORDER[:-cut]), machine)
    assert len(record.time) == COUNT - 1
    assert any("truncated" in words and f"{COUNT - 1} complete rows" in words for words in record.warnings)


@pytest.mark.parametrize(
    ("text", "name", "encoding", "said"),
    [
        (" \n ", "drop.csv", "", r"drop.csv is blank \(3 bytes\)"),
        ("no numbers\nat all\nhere\n", "drop.csv", "", r"no columns of numbers .*line 3 reads 'here'"),
        (RECORDER, "drop.csv", "utf-9", r"cannot be read as utf-9"),
        ("a", "drop.xyz", "", r"no reader for 'xyz'; known are .*csv.*tdms"),
        (
            "Time [s];S_NDE_A [um]\n",
            "drop.csv",
            "",
            r"line 1\) reads 'Time \[s\];S_NDE_A \[um\]': a header without",
        ),
    ],
)
def test_what_is_no_table_is_refused(text, name, encoding, said, write, machine):
    rules = Profile(text=TextLayout(encoding=encoding)) if encoding else None
    with pytest.raises(RecordError, match=said):
        read_record(write(text, name=name), machine, profile=rules)


def test_a_missing_file_is_refused(tmp_path, machine):
    with pytest.raises(RecordError, match=r"nowhere.csv does not exist"):
        read_record(tmp_path / "nowhere.csv", machine)
    with pytest.raises(RecordError, match=r"is a folder"):
        read_record(tmp_path, machine)


def read(path, stamps, decimals=3, counted=None):
    machine = example_machine("lp400")
    names = [sensor.name for sensor in machine.sensors]
    motion = 1e2 * np.sin(
        np.outer(np.arange(len(stamps)) if counted is None else counted, [0.11, 0.12, 0.13, 0.14])
    )
    rows = [
        ",".join([f"{stamp:.{decimals}f}", *(f"{value:.3f}" for value in values)])
        for stamp, values in zip(stamps, motion, strict=True)
    ]
    header = ",".join(["time [s]", *(f"{name} [um]" for name in names)])
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_record(path, machine)


@pytest.mark.parametrize(("step", "phase"), [(1e-3, 0.5), (0.4e-3, 0.1), (0.05e-3, 0.0), (0.7e-3, 0.3)])
def test_stamps_rounded_to_their_step_show_the_even_clock(tmp_path, step, phase):
    true = 50.0 + (np.arange(3000) + phase) * step
    # Half of the last place is rounded up or down as the last bit of the number falls.
    stamps = np.round(true + 1e-9 * np.random.default_rng(3).standard_normal(3000), 3)
    assert np.mean(np.diff(stamps) == 0.0) > 0.05
    record = read(tmp_path / "tail.csv", stamps)
    assert record.sampling_rate == pytest.approx(1.0 / step, rel=2e-5)
    assert record.time == pytest.approx(true, abs=0.06e-3 + 1e-3 * step)
    assert any("time stamps are rounded" in note for note in record.notes)
    assert [found for found in check_clock(record, drop=False) if found.severity == "stop"] == []


def test_rates_and_repeated_stamps_are_those_of_the_time_column(tmp_path):
    """One stamp in 3000, at 63.032 s, was refused as a clock that does not go on."""
    true = 62.0 + np.arange(3000) / 1000.3
    stamps = np.round(true, 3)
    assert np.count_nonzero(np.diff(stamps) == 0.0) == 1
    record = read(tmp_path / "tail.csv", stamps)
    assert record.sampling_rate == pytest.approx(1000.3, rel=2e-4)
    assert record.time == pytest.approx(true, abs=0.7e-3)
    assert [found for found in check_clock(record, drop=False) if found.severity == "stop"] == []
    # Stamps of five decimals at 19.9 kHz step by 50 and 60 microseconds; the median says 20 kHz.
    true = np.arange(8000) / 19900.0
    stamps = np.round(true, 5)
    assert np.median(np.diff(stamps)) == pytest.approx(50e-6)
    record = read(tmp_path / "drop.csv", stamps, decimals=5)
    assert record.sampling_rate == pytest.approx(19900.0, rel=2e-5)
    assert record.time == pytest.approx(true, abs=6e-6)


ROWS = np.arange(3000)
EVEN = 50.0 + 1e-3 * ROWS


@pytest.mark.parametrize(
    "rows",
    [
        np.insert(ROWS, 1500, 1500),
        np.sort(np.concatenate([ROWS, ROWS[1000:1040]])),
        np.delete(ROWS, np.arange(1000, 1040)),
    ],
)
def test_rows_twice_or_missing_are_still_told(rows, tmp_path):
    record = read(tmp_path / "tail.csv", EVEN[rows], counted=rows)
    assert any(found.severity == "stop" for found in check_clock(record, drop=False))
    assert not any("rounded" in note for note in record.notes)


def test_a_single_missing_row_is_no_rounding(tmp_path):
    record = read(tmp_path / "tail.csv", np.delete(EVEN, 1200))
    assert np.max(np.diff(record.time)) > 1.9e-3 and record.sampling_rate == pytest.approx(1000.0)
