"""What is cut out of a record, and how its channels come to one clock."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.machine import example_machine
from rotordrop.record.event_date import event_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers import read_recording
from rotordrop.record.record import record_of
from rotordrop.record.recording import Channel, Recording


def test_a_window_holds_the_samples_at_its_bounds_whatever_their_rounding(drop):
    step = 1.0 / drop.sampling_rate
    first, last = 100, 5000
    for off in (-1e-6 * step, 0.0, 1e-6 * step):
        cut = drop.window(drop.time[first] + off, drop.time[last] + off)
        np.testing.assert_array_equal(cut.time, drop.time[first : last + 1])
        np.testing.assert_array_equal(cut.signals, drop.signals[first : last + 1])
    later = drop.window(drop.time[first] + 0.5 * step, drop.time[last] - 0.5 * step)
    np.testing.assert_array_equal(later.time, drop.time[first + 1 : last])


@pytest.mark.parametrize(
    ("metadata", "date"),
    [
        ({"start": "2019-10-16T13:42:07.250000Z"}, "2019-10-16T13:42:07.250000Z"),
        ({"Trigger_Time": "16.10.2019 13:42"}, "2019-10-16T13:42"),
        ({"start": "trigger", "date": "2019-10-16"}, "2019-10-16"),
        ({"machine": "LP 400"}, ""),
        ({"start": "-0.12", "Datum": "24.11.2026 13:05"}, "2026-11-24T13:05"),
        ({"Datum": "3.4.2026", "Uhrzeit": "13:05:06,5"}, "2026-04-03T13:05:06.500000"),
        ({"Datum/Uhrzeit": "24. November 2026, 13:05 Uhr"}, "2026-11-24T13:05"),
        ({"Datum": "1. März 2026"}, "2026-03-01"),
        ({"Date": "11/24/2026 1:05 PM"}, "2026-11-24T13:05"),
        ({"Date": "24/11/2026"}, "2026-11-24"),
        ({"Date": "2026/11/24 13:05"}, "2026-11-24T13:05"),
        ({"Recorded at": "Nov 24, 2026 12:05:07 am"}, "2026-11-24T00:05:07"),
        ({"date": "24-Nov-2026", "time": "13:05:06+01:00"}, "2026-11-24T13:05:06+01:00"),
        ({"date": "04 MAY 2023"}, "2023-05-04"),
        ({"Datum": "31.02.2026"}, ""),
        ({"Date": "24.11.26"}, ""),
        ({"Date": "03/04/2026"}, ""),
        ({"Date": "10.20.30.40"}, ""),
    ],
)
def test_the_date_of_the_event_comes_from_the_header(drop, metadata, date):
    assert replace(drop, metadata=metadata).event_date == date


@pytest.mark.parametrize("text", ["03/04/2026 13:05", "24.11.26"])
def test_a_date_that_leaves_the_day_open_is_left_out_and_named(text):
    recording = replace(_unequal(1), metadata={"Datum": text})
    record = record_of(recording, example_machine("lp400").sensors)
    assert record.event_date == ""
    assert any(
        f"the date {text!r} behind 'datum' leaves open which day it is" in note for note in record.notes
    )


@pytest.mark.parametrize(
    ("head", "date"),
    [
        ("Datum: 24.11.2026 13:05", "2026-11-24T13:05"),
        ("Datum;24.11.2026;13:05:06", "2026-11-24T13:05:06"),
        ("# Date: Nov 24, 2026 1:05 PM", "2026-11-24T13:05"),
        ("Messung 24.11.2026 13:05;Anlage 4711", "2026-11-24T13:05"),
        ("Kalibriert: 24.11.2026", ""),
        ("Datum: 03/04/2026", ""),
    ],
)
def test_the_date_of_the_event_is_read_from_the_head_of_a_table(tmp_path, head, date):
    rows = [f"{0.001 * k:.3f};{k % 7},5;{k % 5},25" for k in range(30)]
    file = tmp_path / "drop.csv"
    file.write_text("\n".join([head, "Zeit [s];X [um];Y [um]", *(row.replace(".", ",") for row in rows)]))
    recording = read_recording(file, Profile())
    assert event_of(recording.metadata)[0] == date


def _unequal(times, shift=0.0):
    """Four sensors, the first two sampled `times` as fast as the others."""
    channels = []
    for number, name in enumerate(("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")):
        rate = 10_000.0 * (times if number < 2 else 1)
        time = np.arange(round(0.2 * rate)) / rate + (shift if number < 2 else 0.0)
        values = np.sin(2.0 * np.pi * 60.0 * time + number)
        channels.append(Channel(name=name, label=name, unit="um", values=values, time=time))
    return Recording(channels=tuple(channels))


@pytest.mark.parametrize("times", [2, 5])
def test_channels_of_several_rates_come_to_the_slowest_with_samples_as_they_were_read(times):
    recording = _unequal(times)
    record = record_of(recording, example_machine("lp400").sensors)
    assert record.sampling_rate == 10_000.0
    assert np.array_equal(record.signals[:, 0], 1e-6 * recording.channels[0].values[::times])
    assert np.array_equal(record.signals[:, 3], 1e-6 * recording.channels[3].values)
    assert [note for note in record.notes if f"every {times}th sample is used" in note] != []


@pytest.mark.parametrize(("times", "shift"), [(1.5, 0.0), (2, 20e-6)])
def test_channels_whose_clocks_never_meet_are_refused(times, shift):
    with pytest.raises(RecordError, match="sampled together"):
        record_of(_unequal(times, shift), example_machine("lp400").sensors)
