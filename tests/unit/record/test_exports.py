"""Exports of many makers are read without an option, or with one question that names the way out."""

import numpy as np
import pytest
from tests.unit.record.exports import EXPORTS, SPEED, TIME

from rotordrop.errors import RecordError
from rotordrop.record.arrangement import arrangement_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers import read_recording
from rotordrop.record.record import open_record

ASKED = [export for export in EXPORTS if export.question]
READ = [export for export in EXPORTS if not export.question]


def named(export):
    return f"{export.maker}, {export.form}"


def test_the_table_is_as_large_as_the_documentation_says():
    assert (len(EXPORTS), len(READ)) == (41, 37)
    assert len({export.maker for export in EXPORTS}) >= 8


@pytest.mark.parametrize("export", READ, ids=named)
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


@pytest.mark.parametrize("export", ASKED, ids=named)
def test_what_an_export_does_not_say_is_asked_with_the_answer_to_give(export, tmp_path):
    path = export.written(tmp_path)
    with pytest.raises(RecordError, match=export.question):
        open_record(path, None, profile=Profile())
