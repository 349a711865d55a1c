"""Exports of makers and files that users reported are read without an option, or asked about.

The same samples through every format are the same record, to the last bit the format carries.
"""

import re

import numpy as np
import pytest
from tests.unit.record import every_format as every
from tests.unit.record import reported
from tests.unit.record.exports import EXPORTS, SPEED, TIME
from tests.unit.record.reported import REPORTED

from rotordrop.errors import RecordError
from rotordrop.record.arrangement import arrangement_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers import read_recording
from rotordrop.record.record import open_record, read_record

READ = [export for export in EXPORTS if not export.question]
REPORTED_READ = [one for one in REPORTED if not one.question]
ASKED = {f"{one.maker}, {one.form}": one for one in EXPORTS if one.question}
ASKED |= {one.kind: one for one in REPORTED if one.question}


def test_the_table_is_as_large_as_the_documentation_says():
    assert (len(EXPORTS), len(READ)) == (41, 37)
    assert len({export.maker for export in EXPORTS}) >= 8


@pytest.mark.parametrize("export", READ, ids=lambda one: f"{one.maker}, {one.form}")
def test_an_export_is_read_without_an_option(export, tmp_path):
    recording = read_recording(export.written(tmp_path), Profile())
    assert recording.warnings == ()
    channels = {channel.name: channel for channel in recording.channels}
    assert list(channels)[: len(export.names)] == list(export.names)
    for column, name in enumerate(export.names):
        assert channels[name].unit == export.unit
        scale = np.max(np.abs(export.values))
        np.testing.assert_allclose(channels[name].values, export.values[:, column], rtol=0, atol=2e-6 * scale)
        np.testing.assert_allclose(channels[name].time, TIME, rtol=0, atol=2e-8)
    if export.speed:
        (speed,) = (channel for channel in recording.channels if channel.unit in ("Hz", "rpm"))
        turns = speed.values / (60.0 if speed.unit == "rpm" else 1.0)
        np.testing.assert_allclose(turns, SPEED, rtol=1e-5)
    arranged = arrangement_of(recording, Profile())
    assert tuple(dict.fromkeys(sensor.bearing for sensor in arranged.sensors)) == export.planes
    assert list(arranged.channels.values()) == [channels[name].label for name in export.names]


@pytest.mark.parametrize("one", ASKED.values(), ids=ASKED)
def test_what_a_file_does_not_say_is_asked_with_the_answer_to_give(one, tmp_path):
    with pytest.raises(RecordError, match=one.question):
        open_record(one.written(tmp_path), None, profile=Profile())


@pytest.mark.parametrize("one", REPORTED_READ, ids=lambda one: one.kind)
def test_a_reported_file_is_read(one, tmp_path):
    record, arranged = open_record(one.written(tmp_path), None, profile=Profile())
    labels = [label.removeprefix("table/") for label in arranged.channels.values()]
    assert labels == list(one.names)
    kept = slice(None) if one.kept == () else one.kept
    expected = reported.MICRONS[kept] if one.values is None else one.values
    count = len(expected)
    assert 0 <= len(record.time) - count <= 1
    apart = np.abs(1e6 * record.signals[:count] - expected)
    np.testing.assert_array_less(apart, one.off)
    start = reported.TIME[kept][0] if one.start is None else one.start
    np.testing.assert_allclose(
        record.time[:count], start + one.step * np.arange(count), rtol=0.0, atol=one.late
    )
    assert (0 if record.missing is None else int(record.missing.sum())) == one.missing
    said = (*record.notes, *record.warnings, *arranged.notes)
    if one.turning:
        read = record.time <= record.speed_time[-1]
        apart = record.speed[read] / (2 * np.pi) - reported.turns(record.time[read])
        np.testing.assert_array_less(np.abs(apart), 0.02)
    assert any(re.search(one.said, words) for words in said), said


def read_by_name(path, name):
    return read_record(path, every.MACHINE, profile=every.BY_PROFILE if name in every.BY_HAND else None)


@pytest.mark.parametrize("name", every.WRITERS)
def test_readings_are_those_written_to_the_last_bit(name, tmp_path):
    """A reading in micrometres times 1e-6 is rounded once; a format with steps is off by half of one."""
    record = read_by_name(every.written(name, tmp_path), name)
    off = np.abs(record.signals - every.READINGS * 1e-6)
    assert np.all(off <= 0.5 * every.CARRIES.get(name, 0.0) + np.spacing(np.abs(every.READINGS * 1e-6)))
    np.testing.assert_allclose(record.time - record.time[0], every.TIME - every.TIME[0], rtol=0, atol=2e-9)
    if name in every.WITHOUT_SPEED:
        assert record.speed_readings is None
    elif name not in every.BY_HAND:
        assert len(record.speed_readings) == every.COUNT
        step = 2 * np.pi * 0.005 if name in every.CARRIES else 1e-12 * 400
        np.testing.assert_allclose(record.speed_readings, 2 * np.pi * every.SPEED, rtol=0, atol=1.01 * step)


@pytest.mark.parametrize("name", every.WRITERS)
@pytest.mark.parametrize("kept", [0.03, 0.2, 0.5, 0.8, 0.97])
def test_a_file_that_was_cut_says_so(name, kept, tmp_path):
    path = every.written(name, tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    try:
        record = read_by_name(path, name)
    except RecordError as error:
        assert str(path.parent) in str(error) or path.stem in str(error)
    else:
        assert record.warnings, "fewer samples than were written, without a word"
