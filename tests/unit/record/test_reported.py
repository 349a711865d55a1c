"""What users of other programs reported is read rightly, or asked with the answer to give."""

import re

import numpy as np
import pytest
from tests.unit.record.reported import MICRONS, REPORTED, TIME, turns

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.record import open_record


@pytest.mark.parametrize("reported", REPORTED, ids=lambda one: one.kind)
def test_a_reported_file_is_read_or_asked_about(reported, tmp_path):
    if reported.file.endswith("xlsx"):
        pytest.importorskip("openpyxl")
    path = reported.written(tmp_path)
    if reported.question:
        with pytest.raises(RecordError, match=reported.question):
            open_record(path, None, profile=Profile())
        return
    record, arranged = open_record(path, None, profile=Profile())
    labels = [label.removeprefix("table/") for label in arranged.channels.values()]
    assert labels == list(reported.names)
    kept = slice(None) if reported.kept == () else reported.kept
    expected = MICRONS[kept] if reported.values is None else reported.values
    count = len(expected)
    assert 0 <= len(record.time) - count <= 1
    apart = np.abs(1e6 * record.signals[:count] - expected)
    np.testing.assert_array_less(apart, reported.off)
    start = TIME[kept][0] if reported.start is None else reported.start
    step = reported.step
    np.testing.assert_allclose(
        record.time[:count], start + step * np.arange(count), rtol=0.0, atol=reported.late
    )
    assert (0 if record.missing is None else int(record.missing.sum())) == reported.missing
    said = (*record.notes, *record.warnings, *arranged.notes)
    if reported.turning:
        read = record.time <= record.speed_time[-1]
        apart = record.speed[read] / (2 * np.pi) - turns(record.time[read])
        np.testing.assert_array_less(np.abs(apart), 0.02)
    assert any(re.search(reported.said, words) for words in said), said
