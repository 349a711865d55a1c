"""Two drops in one file come apart with every sample of theirs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.evidence.paths import split_drops
from rotordrop.machine import example_machine, example_path
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import read_record, save_record


@pytest.fixture(scope="module")
def single():
    return read_record(example_record_path("lp400_drop_060"), example_machine("lp400")).window(-0.25, 0.6)


@pytest.fixture(scope="module")
def twice(single):
    """A drop, the rotor lifted within 0.3 s, floating, and such a drop again."""
    level, rest = (
        single.signals[0],
        single.signals[-1],
    )  # no step where the parts meet: samples would be missing
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


def test_each_drop_has_its_samples_and_its_levitated_part(single, twice):
    first, second = split_drops(twice)
    count = len(single.time)
    assert np.array_equal(first.signals, twice.signals[: len(first.time)])
    assert abs(len(first.time) - count) < 0.16 * single.sampling_rate
    assert np.array_equal(second.signals[-count:], twice.signals[-count:])
    assert second.time[-1] == twice.time[-1]
    before = second.time[-count] - second.time[0]  # half of the lift
    assert 0.0 <= before < 0.16
    assert (first.metadata["split_from"], second.metadata["split_from"]) == (
        "record, drop 1 of 2",
        "record, drop 2 of 2",
    )
    assert len(split_drops(first)) == 1
    assert len(split_drops(second)) == 1
    assert all(part.speed_time[0] >= part.time[0] for part in (first, second))


def test_a_single_drop_stays_whole(single):
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
    assert (
        run(["look", str(tmp_path / "parts" / "both_drop1.h5"), machine, "--split", str(tmp_path / "no")])
        == 0
    )
    assert "holds one drop; nothing to split" in capsys.readouterr().out
    assert not (tmp_path / "no").exists()
