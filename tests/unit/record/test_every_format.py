"""The same samples through every format are the same record, to the last bit the format carries."""

import numpy as np
import pytest
from tests.unit.record.every_format import (
    BY_HAND,
    BY_PROFILE,
    CARRIES,
    COUNT,
    MACHINE,
    NEEDS,
    READINGS,
    SPEED,
    TIME,
    WITHOUT_SPEED,
    WRITERS,
    written,
)

from rotordrop.errors import RecordError
from rotordrop.record.record import read_record


def read(path, name):
    return read_record(path, MACHINE, profile=BY_PROFILE if name in BY_HAND else None)


@pytest.fixture(params=WRITERS)
def name(request):
    if request.param in NEEDS:
        pytest.importorskip(NEEDS[request.param])
    return request.param


def test_readings_are_those_written_to_the_last_bit(name, tmp_path):
    """A reading in micrometres times 1e-6 is rounded once; a format with steps is off by half of one."""
    record = read(written(name, tmp_path), name)
    off = np.abs(record.signals - READINGS * 1e-6)
    assert np.all(off <= 0.5 * CARRIES.get(name, 0.0) + np.spacing(np.abs(READINGS * 1e-6)))
    np.testing.assert_allclose(record.time - record.time[0], TIME - TIME[0], rtol=0, atol=2e-9)
    if name in WITHOUT_SPEED:
        assert record.speed_readings is None
    elif name not in BY_HAND:
        assert len(record.speed_readings) == COUNT
        step = 2 * np.pi * 0.005 if name in CARRIES else 1e-12 * 400
        np.testing.assert_allclose(record.speed_readings, 2 * np.pi * SPEED, rtol=0, atol=1.01 * step)


@pytest.mark.parametrize("kept", [0.03, 0.2, 0.5, 0.8, 0.97])
def test_a_file_that_was_cut_says_so(name, kept, tmp_path):
    path = written(name, tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    try:
        record = read(path, name)
    except RecordError as error:
        assert str(path.parent) in str(error) or path.stem in str(error)
    else:
        assert record.warnings, "fewer samples than were written, without a word"
