"""Steps of the look at a record, each against what is known of its input."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.events import first_sample
from rotordrop.evidence.paths import where_floating
from rotordrop.evidence.quality.motion import strongest_line
from rotordrop.record.sandbox import MEMORY, UNPACKED_PER_BYTE, refuse_bomb

RATE = 5000.0


def test_a_rotor_is_far_where_any_plane_says_so() -> None:
    far = np.zeros((10, 2), dtype=np.bool_)
    assert first_sample(far) == 9
    far[6:, 0], far[8:, 1] = True, True
    assert first_sample(far) == 6
    assert first_sample(far[:, ::-1]) == 6


@pytest.mark.parametrize(
    ("height", "away", "floating"), [(0.0, 0.45, True), (0.0, 0.6, False), (0.3, 0.59, True)]
)
def test_a_rotor_floats_within_half_the_gap_or_twice_its_own_height(
    height: float, away: float, floating: bool
) -> None:
    """And never beyond 0.7 of the gap from where it floated."""
    gap = 300e-6
    levitated = np.array([0.0, height * gap])
    position = np.tile(levitated, (4000, 1))
    position[2000:, 0] = away * gap
    path: Any = SimpleNamespace(gap=gap, levitated=levitated, position=position)
    found = where_floating([path], RATE)
    assert found[:2000].all() and found[2000:].all() == floating
    high: Any = SimpleNamespace(gap=gap, levitated=np.array([0.0, 0.6 * gap]), position=position.copy())
    high.position[:] = high.levitated + np.array([0.75 * gap, 0.0])
    assert not where_floating([high], RATE).any()


@pytest.mark.parametrize(("over_median", "found"), [(25.0, False), (90.0, True)])
def test_a_line_stands_out_at_fifty_times_the_median_power(over_median: float, found: bool) -> None:
    """Four channels with noise and a tone; its size is set by the power in their sum."""
    dice = np.random.default_rng(3)
    time = np.arange(5000) / RATE
    noise = dice.standard_normal((5000, 4))
    tone = np.cos(2.0 * np.pi * 300.3 * time)[:, None]
    window = np.hanning(5000)[:, None]

    def ratio(size: float) -> float:
        part = noise + size * tone
        part = part / part.std(axis=0)
        power = np.sum(np.abs(np.fft.rfft(window * part, 40000, axis=0)) ** 2, axis=1)
        return float(power.max() / np.median(power))

    sizes = np.linspace(0.0, 1.0, 101)
    size = sizes[int(np.argmin([abs(ratio(s) - over_median) for s in sizes]))]
    assert ratio(size) == pytest.approx(over_median, rel=0.2)
    record: Any = SimpleNamespace(time=time, signals=noise + size * tone, sampling_rate=RATE)
    line = strongest_line(record, 2.0)
    assert (line is not None) == found
    if line is not None:
        assert line[0] == pytest.approx(300.3, abs=0.2) and line[1] == pytest.approx(1.0)


def test_what_a_small_file_may_unpack_to_fits_five_times_into_the_memory_of_its_reader() -> None:
    """As the library holds it and as it is handed over; a large file may hold 200 times its size."""
    fifth = MEMORY // 5 // 8
    refuse_bomb(fifth, 1000, "small.mat")
    with pytest.raises(
        RecordError, match=rf"small\.mat claims {fifth + 1} samples in 1000 bytes; it is damaged"
    ):
        refuse_bomb(fifth + 1, 1000, "small.mat")
    size = MEMORY
    refuse_bomb(UNPACKED_PER_BYTE * size // 8, size, "large.mat")
    with pytest.raises(RecordError, match=r"large\.mat claims"):
        refuse_bomb(UNPACKED_PER_BYTE * size // 8 + 1, size, "large.mat")
