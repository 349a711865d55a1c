"""The rest at the end of a record."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.rest import settled_tail


def test_a_tail_of_its_own_is_settled_throughout(tail, machine):
    found = settled_tail(tail, machine)
    assert (found.start, found.end) == (tail.time[0], tail.time[-1])
    np.testing.assert_allclose(found.mean, np.mean(tail.signals, axis=0), atol=1e-12)
    assert found.swing[1, 0] > 4 * found.swing[1, 1]


def test_a_turning_shaft_is_not_at_standstill(whole_drop, machine):
    with pytest.raises(
        RecordError,
        match=r"drop_060 does not reach standstill: the shaft still turns at 47.7 Hz .* ends at 2 s",
    ):
        settled_tail(whole_drop, machine)


def test_a_whirling_shaft_without_speed_is_not_at_rest(whole_drop, machine):
    silent = replace(whole_drop.window(0.1, 0.6), speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(
        RecordError,
        match=r"still moves by \d+ µm peak to peak in the last 0.1 s, more than 50 % of the nominal",
    ):
        settled_tail(silent, machine)


def test_the_rest_is_found_behind_the_motion(whole_drop, tail, machine):
    """Two seconds of drop, then the tail: the rest begins where the speed has gone."""
    every = whole_drop.signals[::20]
    time = np.arange(len(every) + len(tail.time)) * 1e-3
    signals = np.vstack([every, tail.signals])
    stop = time[len(every)]
    joined = replace(
        tail, time=time, signals=signals, speed=None, speed_time=np.array([0.0, stop - 0.01, stop, time[-1]]),
        speed_readings=np.array([300.0, 300.0, 0.0, 0.0]),
    )  # fmt: skip
    found = settled_tail(joined, machine)
    assert stop - 0.01 <= found.start <= stop + 0.11
    np.testing.assert_allclose(found.mean, np.mean(tail.signals, axis=0), atol=0.5e-6)
