"""Steps of the look at a record, each against what is known of its input."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.errors import RecordError
from rotordrop.evidence.paths import split_drops
from rotordrop.evidence.rest import settled_tail
from rotordrop.machine import example_machine, example_path
from rotordrop.record.record import read_record, save_record
from rotordrop.record.sandbox import MEMORY, UNPACKED_PER_BYTE, refuse_bomb


def test_what_a_small_file_may_unpack_to_fits_five_times_into_the_memory_of_its_reader():
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


def test_rest_is_found_behind_the_motion_and_not_where_the_shaft_turns(tail, machine, whole_drop):
    found = settled_tail(tail, machine)
    assert (found.start, found.end) == (tail.time[0], tail.time[-1])
    np.testing.assert_allclose(found.mean, np.mean(tail.signals, axis=0), atol=1e-12)
    assert found.swing[1, 0] > 4 * found.swing[1, 1]
    with pytest.raises(
        RecordError,
        match=r"drop_060 does not reach standstill: the shaft still turns at 47.7 Hz .* ends at 2 s",
    ):
        settled_tail(whole_drop, machine)
    silent = replace(whole_drop.window(0.1, 0.6), speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(
        RecordError,
        match=r"still moves by \d+ µm peak to peak in the last 0.1 s, more than 50 % of the nominal",
    ):
        settled_tail(silent, machine)
    # Two seconds of drop, then the tail: the rest begins where the speed has gone.
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


@pytest.fixture(scope="module")
def single(whole_drop):
    return whole_drop.window(-0.25, 0.6)


@pytest.fixture(scope="module")
def twice(single):
    """A drop, the rotor lifted within 0.3 s, floating, and such a drop again."""
    level, rest = single.signals[0], single.signals[-1]  # no step between: samples would be missing
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 6000))
    lift = rest + np.outer(share, level - rest) + np.random.default_rng(4).normal(0.0, 0.5e-6, (6000, 4))
    # equal samples would be a block that was written twice
    again = single.signals + np.random.default_rng(5).normal(0.0, 0.05e-6, single.signals.shape)
    signals = np.concatenate([single.signals, lift, again])
    time = single.time[0] + np.arange(len(signals)) / single.sampling_rate
    speed = np.full(40, single.speed_readings[0])
    when = np.linspace(time[0], time[-1], 40)
    return replace(
        single, time=time, signals=signals, speed=None, speed_time=when, speed_readings=speed, path=None
    )


def test_drops_of_one_file_come_apart_and_one_stays_whole(single, twice):
    first, second = split_drops(twice)
    count = len(single.time)
    assert np.array_equal(first.signals, twice.signals[: len(first.time)])
    assert abs(len(first.time) - count) < 0.16 * single.sampling_rate
    assert np.array_equal(second.signals[-count:], twice.signals[-count:])
    assert second.time[-1] == twice.time[-1]
    before = second.time[-count] - second.time[0]  # half of the lift
    assert 0.0 <= before < 0.16
    split = [part.metadata["split_from"] for part in (first, second)]
    assert split == ["record, drop 1 of 2", "record, drop 2 of 2"]
    assert len(split_drops(first)) == len(split_drops(second)) == 1
    assert all(part.speed_time[0] >= part.time[0] for part in (first, second))
    (same,) = split_drops(single)
    assert same is single


def test_the_verb_writes_one_record_each_and_estimate_says_so(twice, tmp_path, capsys):
    machine = str(example_path("lp400"))
    save_record(twice, tmp_path / "both.h5")
    assert run(["estimate", machine, str(tmp_path / "both.h5")]) == 3
    assert "rotordrop look RECORD MACHINE --split FOLDER" in capsys.readouterr().err
    assert run(["look", str(tmp_path / "both.h5"), machine, "--split", str(tmp_path / "parts")]) == 0
    assert sorted(path.name for path in (tmp_path / "parts").iterdir()) == ["both_drop1.h5", "both_drop2.h5"]
    again = read_record(tmp_path / "parts" / "both_drop2.h5", example_machine("lp400"))
    assert np.array_equal(again.signals, split_drops(twice)[1].signals)
    one = str(tmp_path / "parts" / "both_drop1.h5")
    assert run(["look", one, machine, "--split", str(tmp_path / "no")]) == 0
    assert "holds one drop; nothing to split" in capsys.readouterr().out
    assert not (tmp_path / "no").exists()
