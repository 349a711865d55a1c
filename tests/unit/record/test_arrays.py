"""Records from arrays and tables in memory: the same as from a file, and clear refusals."""

import math

import numpy as np
import pytest

from rotordrop import Record, example_machine
from rotordrop.errors import RecordError, UsageError

MACHINE = example_machine("paper")
NAMES = [sensor.name for sensor in MACHINE.sensors]
COUNT = 200
MICRONS = np.arange(COUNT * len(NAMES), dtype=float).reshape(COUNT, -1)


def test_columns_in_the_order_of_the_sensors_become_metres():
    record = Record.from_arrays(MACHINE, "20 kHz", MICRONS, unit="um", start="-1 ms")
    assert record.channel_names == tuple(NAMES)
    assert record.sampling_rate == pytest.approx(20e3)
    assert record.time[0] == pytest.approx(-1e-3)
    np.testing.assert_allclose(record.reading(NAMES[2]), 1e-6 * MICRONS[:, 2])
    assert record.measured_speed is None


def test_names_units_and_speed_of_every_channel():
    time = np.arange(COUNT) * 0.05
    signals = {name: MICRONS[:, k] for k, name in reversed(list(enumerate(NAMES)))}
    units = dict.fromkeys(NAMES, "um") | {NAMES[0]: "mm"}
    rpm = np.linspace(3600.0, 3500.0, COUNT)
    record = Record.from_arrays(MACHINE, time, signals, unit=units, time_unit="ms", speed=(rpm, "rpm"))
    np.testing.assert_allclose(record.reading(NAMES[0]), 1e-3 * MICRONS[:, 0])
    np.testing.assert_allclose(record.reading(NAMES[1]), 1e-6 * MICRONS[:, 1])
    assert record.speed[0] == pytest.approx(2.0 * math.pi * 60.0)
    assert not record.speed_by_hand


def test_a_speed_given_by_hand_is_one():
    record = Record.from_arrays(MACHINE, "20 kHz", MICRONS, unit="um", speed="60 Hz")
    assert record.speed_by_hand
    assert record.speed[0] == pytest.approx(2.0 * math.pi * 60.0)


def test_a_table_is_read_as_the_file_of_the_same_columns_would_be():
    pandas = pytest.importorskip("pandas")
    columns = {f"{name} [um]": MICRONS[:, k] for k, name in enumerate(NAMES)}
    table = pandas.DataFrame(
        {
            "time [ms]": np.arange(COUNT) * 0.05,
            **columns,
            "Drehzahl [1/min]": np.full(COUNT, 3600.0),
            "state": "OK",
        }
    )
    record = Record.from_dataframe(MACHINE, table)
    np.testing.assert_allclose(record.signals, 1e-6 * MICRONS)
    assert record.sampling_rate == pytest.approx(20e3)
    assert record.speed[0] == pytest.approx(2.0 * math.pi * 60.0)
    bare = pandas.DataFrame(MICRONS, columns=NAMES, index=pandas.Index(np.arange(COUNT) * 5e-5, name="t [s]"))
    np.testing.assert_allclose(Record.from_dataframe(MACHINE, bare, unit="um").signals, 1e-6 * MICRONS)
    stamped = bare.set_index(pandas.date_range("2026-01-01", periods=COUNT, freq="50us"))
    np.testing.assert_allclose(
        Record.from_dataframe(MACHINE, stamped, unit="um").time, record.time, atol=1e-12
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"speed": 60}, r"speed is 60; expected a text such as '60 Hz', or readings with their unit"),
        ({"speed": "60"}, "'60' has no unit; a speed needs one"),
        ({"unit": ""}, r"the unit of \w+ is ''; say it, for example unit='um'"),
        ({"time": np.arange(10.0)}, r"time has the shape \(10,\) and the signals have 200 samples"),
        ({"time_unit": "h"}, "time_unit is 'h'; expected one of s, ms, us, min"),
        (
            {"signals": MICRONS[:, :3]},
            r"signals have the shape \(200, 3\); expected \(samples, 4\), one column",
        ),
        ({"signals": {NAMES[0]: MICRONS[:, 0]}}, f"no channel for .*{NAMES[1]}|{NAMES[1]}"),
    ],
)
def test_what_does_not_fit_is_named(arguments, message):
    given = {"time": np.arange(COUNT) * 5e-5, "signals": MICRONS, "unit": "um"} | arguments
    with pytest.raises((RecordError, UsageError), match=message):
        Record.from_arrays(MACHINE, **given)


def test_a_table_whose_index_only_counts_has_no_time():
    pandas = pytest.importorskip("pandas")
    with pytest.raises(RecordError, match="no column 'time' and its index only counts rows"):
        Record.from_dataframe(MACHINE, pandas.DataFrame(MICRONS, columns=NAMES), unit="um")


def test_a_record_is_shown_in_one_line():
    assert repr(Record.from_arrays(MACHINE, "20 kHz", MICRONS, unit="um")) == (
        f"<Record record: 0.00995 s at 20000 Hz, {', '.join(NAMES)}, no speed>"
    )
