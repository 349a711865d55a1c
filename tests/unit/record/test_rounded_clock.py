"""A clock whose stamps were rounded to their step is an even clock; rows twice or missing are none."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.evidence.quality.recorder import check_clock
from rotordrop.machine import example_machine
from rotordrop.record.record import read_record


def read(path, stamps, decimals=3):
    machine = example_machine("lp400")
    names = [sensor.name for sensor in machine.sensors]
    motion = 1e2 * np.sin(np.outer(np.arange(len(stamps)), [0.11, 0.12, 0.13, 0.14]))
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


def test_a_clock_a_trifle_faster_than_its_stamps_repeats_one_of_them(tmp_path):
    """One stamp in 3000, at 63.032 s, was refused as a clock that does not go on."""
    true = 62.0 + np.arange(3000) / 1000.3
    stamps = np.round(true, 3)
    assert np.count_nonzero(np.diff(stamps) == 0.0) == 1
    record = read(tmp_path / "tail.csv", stamps)
    assert record.sampling_rate == pytest.approx(1000.3, rel=2e-4)
    assert record.time == pytest.approx(true, abs=0.7e-3)
    assert [found for found in check_clock(record, drop=False) if found.severity == "stop"] == []


def test_a_rate_is_the_slope_of_the_time_column(tmp_path):
    """Stamps of five decimals at 19.9 kHz step by 50 and 60 microseconds; the median says 20 kHz."""
    true = np.arange(8000) / 19900.0
    stamps = np.round(true, 5)
    assert np.median(np.diff(stamps)) == pytest.approx(50e-6)
    record = read(tmp_path / "drop.csv", stamps, decimals=5)
    assert record.sampling_rate == pytest.approx(19900.0, rel=2e-5)
    assert record.time == pytest.approx(true, abs=6e-6)


def test_a_single_missing_row_is_no_rounding(tmp_path):
    stamps = np.delete(50.0 + 1e-3 * np.arange(3000), 1200)
    record = read(tmp_path / "tail.csv", stamps)
    assert np.max(np.diff(record.time)) > 1.9e-3 and record.sampling_rate == pytest.approx(1000.0)


def test_a_row_that_stands_twice_is_no_rounding(tmp_path):
    machine = example_machine("lp400")
    names = [sensor.name for sensor in machine.sensors]
    lines = [",".join(["time [s]", *(f"{name} [um]" for name in names)])]
    for k in range(3000):
        values = ",".join(f"{100.0 * np.sin(0.1 * k + c):.3f}" for c in range(len(names)))
        lines += [f"{50.0 + 1e-3 * k:.3f},{values}"] * (2 if k == 1500 else 1)
    (tmp_path / "tail.csv").write_text("\n".join(lines) + "\n")
    found = check_clock(read_record(tmp_path / "tail.csv", machine), drop=False)
    assert any(one.severity == "stop" and "after sample" in one.message for one in found)


@pytest.mark.parametrize("fault", ["twice", "missing"])
def test_rows_twice_or_missing_are_still_told(tmp_path, fault):
    even = 50.0 + 1e-3 * np.arange(3000)
    if fault == "twice":
        stamps = np.sort(np.concatenate([even, even[1000:1040]]))
    else:
        stamps = np.delete(even, np.arange(1000, 1040))
    record = read(tmp_path / "tail.csv", stamps)
    assert any(found.severity == "stop" for found in check_clock(record, drop=False))
    assert not any("rounded" in note for note in record.notes)
