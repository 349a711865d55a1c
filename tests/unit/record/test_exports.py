"""Exports of makers and files that users reported are read without an option, or asked about."""

import re

import numpy as np
import pytest
from tests.unit.record import reported
from tests.unit.record.exports import EXPORTS, SPEED, TIME
from tests.unit.record.reported import REPORTED

from rotordrop.errors import RecordError
from rotordrop.record.arrangement import arrangement_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers import read_recording
from rotordrop.record.record import open_record

READ = [export for export in EXPORTS if not export.question]
REPORTED_READ = [one for one in REPORTED if not one.question]
ASKED = {f"{one.maker}, {one.form}": one for one in EXPORTS if one.question}
ASKED |= {one.kind: one for one in REPORTED if one.question}


def test_the_table_is_as_large_as_the_documentation_says():
    assert (len(EXPORTS), len(READ)) == (41, 37)
    assert len({export.maker for export in EXPORTS}) >= 8


@pytest.mark.parametrize("export", READ, ids=lambda one: f"{one.maker}, {one.form}")
def test_an_export_is_read_without_an_option(export, tmp_path):
    if export.file.endswith("tdms"):
        pytest.importorskip("nptdms")
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
    if one.file.endswith("xlsx"):
        pytest.importorskip("openpyxl")
    with pytest.raises(RecordError, match=one.question):
        open_record(one.written(tmp_path), None, profile=Profile())


@pytest.mark.parametrize("one", REPORTED_READ, ids=lambda one: one.kind)
def test_a_reported_file_is_read(one, tmp_path):
    if one.file.endswith("xlsx"):
        pytest.importorskip("openpyxl")
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
