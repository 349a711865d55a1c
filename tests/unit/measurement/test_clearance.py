"""The lift check finds the circle it was made from, within its interval."""

import json

import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.errors import RecordError
from rotordrop.machine import example_machine, example_path, load_machine
from rotordrop.measurement.clearance import measure_clearance, wear_between
from rotordrop.measurement.record import Record
from rotordrop.measurement.writers import recording_of, write_hdf5

RATE = 2000.0


def pushed(rng, gap, centre, *, directions=None, dirt=0.0, noise=0.5e-6, slack=True):
    """Path (N, 2) of a shaft in a round hole: pushed into some directions, or rolled round the wall."""
    if directions is None:
        angle = np.linspace(0.0, 4 * np.pi, int(8 * RATE)) + rng.uniform(0, 7)
        radius = np.full(len(angle), gap)
        if slack:  # not all the way at the wall
            radius -= 0.4 * gap * (np.sin(3.3 * angle) > 0.8)
    else:
        places = np.repeat(np.arange(directions) * 2 * np.pi / directions, int(0.5 * RATE))
        angle = places + rng.uniform(0, 7)
        radius = np.full(len(angle), gap)
    radius = radius - dirt * np.exp(-0.5 * (np.angle(np.exp(1j * (angle - 1.0))) / 0.1) ** 2)
    path = np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None] + centre
    if directions is not None:  # from one push to the next through the middle
        step = int(0.5 * RATE)
        for k in range(step, len(path), step):
            path[k : k + step // 5] = np.linspace(path[k - 1], centre, step // 5)
    return path + rng.normal(0.0, noise, path.shape)


def record_of_paths(paths, machine):
    """A record of the machine's sensors with the same path in both planes of a shaft that does not tilt."""
    angles = np.array([float(sensor.angle) for sensor in machine.sensors])
    nodes = list(dict.fromkeys(sensor.node for sensor in machine.sensors))
    signals = np.column_stack(
        [
            paths[nodes.index(sensor.node)] @ np.array([np.cos(a), np.sin(a)])
            for sensor, a in zip(machine.sensors, angles, strict=True)
        ]
    )
    time = np.arange(len(signals)) / RATE
    return Record(time=time, signals=signals, sensors=machine.sensors, sampling_rate=RATE)


@pytest.fixture(scope="module")
def lp400():
    return example_machine("lp400")


def test_the_interval_holds_the_true_radius_as_often_as_it_says(lp400):
    held, wide, count = 0, [], 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        gap, centre = rng.uniform(150e-6, 400e-6), rng.normal(0.0, 40e-6, 2)
        way = {0: {}, 1: {"directions": 8}, 2: {"directions": 6}, 3: {"dirt": 10e-6}}[seed % 4]
        path = pushed(rng, gap, centre, noise=rng.uniform(0.3e-6, 2e-6), **way)
        for found in measure_clearance(record_of_paths([path, path], lp400)):
            count += 1
            held += found.interval_90[0] <= gap <= found.interval_90[1]
            wide.append(found.interval_90[1] - found.interval_90[0])
            assert found.gap == pytest.approx(gap, abs=2.5e-6)
            np.testing.assert_allclose(found.centre, centre, rtol=0, atol=4e-6)
    assert held / count >= 0.85
    assert np.median(wide) < 3e-6, "intervals that say nothing would hold everything"


def test_wear_is_the_difference_with_its_interval(lp400):
    rng = np.random.default_rng(5)
    before = measure_clearance(record_of_paths([pushed(rng, 250e-6, 0.0)] * 2, lp400))
    after = measure_clearance(record_of_paths([pushed(rng, 262e-6, [0.0, -12e-6])] * 2, lp400))
    for wear in wear_between(before, after):
        assert wear.growth == pytest.approx(12e-6, abs=1e-6)
        assert wear.interval_90[0] > 11e-6
        np.testing.assert_allclose(wear.moved, [0.0, -12e-6], atol=1.5e-6)


def test_half_a_round_is_refused_with_what_is_missing(lp400):
    rng = np.random.default_rng(0)
    path = pushed(rng, 250e-6, 0.0)
    path = path[path[:, 1] < 50e-6]
    with pytest.raises(RecordError, match=r"not between .*° and .*; push it round the whole bearing"):
        measure_clearance(record_of_paths([path, path], lp400))


def test_the_command_writes_the_machine_file(lp400, tmp_path, capsys):
    rng = np.random.default_rng(3)
    for name, gap in (("before.h5", 280e-6), ("after.h5", 300e-6)):
        record = record_of_paths([pushed(rng, gap, 0.0)] * 2, lp400)
        write_hdf5(recording_of(record.time, record.signals, record.channel_names), tmp_path / name)
    files = [str(tmp_path / name) for name in ("before.h5", "after.h5", "new.toml", "out.json")]
    machine = str(example_path("lp400"))
    assert run(["clearance", *files[:2], "--machine", machine, "-o", files[2], "--json", files[3]]) == 0
    told = capsys.readouterr().out
    assert "NDE: grown by +20.0 µm" in told.replace("+19.9", "+20.0").replace("+20.1", "+20.0")
    measured = load_machine(files[2]).bearing("NDE").air_gap
    assert measured.value == pytest.approx(300e-6, abs=1e-6)
    assert measured.source == "lift check after.h5"
    assert measured.interval_90 is not None
    told = json.loads((tmp_path / "out.json").read_text())["wear"]
    assert [entry["bearing"] for entry in told] == ["NDE", "DE"]
    assert run(["clearance", files[0], "-o", files[2]]) == 64
    assert "give --machine too" in capsys.readouterr().err
