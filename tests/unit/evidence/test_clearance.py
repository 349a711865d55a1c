"""The lift check finds the circle it was made from, within its interval."""

import json

import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import RecordError
from rotordrop.evidence.clearance import measure_clearance, wear_between
from rotordrop.machine import example_path, load_machine
from rotordrop.record.record import Record, save_record
from rotordrop.rotor.parameters import build_drop_model, sag_of_model
from rotordrop.rotor.statics import bearing_load_shares

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


def straight_ways(rng, gap, places, short):
    """From place to place at the wall by straight ways, as a hand takes them; one push falls short of it."""
    angle = 2.0 * np.pi * np.arange(places) / places + rng.uniform(0, 6)
    corners = gap * np.column_stack([np.cos(angle), np.sin(angle)])
    corners[0] *= 1.0 - short / gap
    pieces = []
    for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        s = np.linspace(0.0, 1.0, int(0.3 * RATE))[:, None]
        pieces += [
            np.repeat(one[None], int(0.4 * RATE), axis=0),
            one + (other - one) * s**2 * (3.0 - 2.0 * s),
        ]
    path = np.vstack(pieces)
    return path + rng.normal(0.0, 0.5e-6, path.shape)


@pytest.mark.parametrize(("places", "short"), [(6, 0.0), (8, 0.0), (8, 30e-6), (10, 12e-6)])
def test_straight_ways_between_the_places_are_not_the_wall(lp400, places, short):
    rng = np.random.default_rng(places)
    path = straight_ways(rng, 250e-6, places, short)
    for found in measure_clearance(record_of_paths([path, path], lp400)):
        assert found.interval_90[0] <= 250e-6 <= found.interval_90[1]
        assert found.gap == pytest.approx(250e-6, abs=0.5e-6)


def test_a_quarter_of_the_round_is_enough_and_less_refused(lp400):
    rng = np.random.default_rng(2)
    angle = np.linspace(0.0, 2.5 * np.pi, int(12 * RATE))
    aside = np.angle(np.exp(1j * (angle - 2.0)))
    radius = 250e-6 - 60e-6 * np.exp(-0.5 * (aside / 0.6) ** 2) * (angle < 2.0 * np.pi)
    path = np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]
    path += rng.normal(0.0, 0.5e-6, path.shape)
    for found in measure_clearance(record_of_paths([path, path], lp400)):
        assert found.gap == pytest.approx(250e-6, abs=0.5e-6)
    path = np.zeros((int(4 * RATE), 2)) + 1e-6
    with pytest.raises(RecordError, match=r"did not move|dead"):
        measure_clearance(record_of_paths([path, path], lp400))
    rng = np.random.default_rng(0)
    path = pushed(rng, 250e-6, 0.0)
    path = path[path[:, 1] < 50e-6]
    with pytest.raises(RecordError, match=r"not between .*° and .*; push it round the whole bearing"):
        measure_clearance(record_of_paths([path, path], lp400))


def test_wear_is_the_difference_with_its_interval(lp400):
    rng = np.random.default_rng(5)
    before = measure_clearance(record_of_paths([pushed(rng, 250e-6, 0.0)] * 2, lp400))
    after = measure_clearance(record_of_paths([pushed(rng, 262e-6, [0.0, -12e-6])] * 2, lp400))
    for wear in wear_between(before, after):
        assert wear.growth == pytest.approx(12e-6, abs=1e-6)
        assert wear.interval_90[0] > 11e-6
        np.testing.assert_allclose(wear.moved, [0.0, -12e-6], atol=1.5e-6)


@pytest.mark.parametrize("push", [0.7, 1.0, 1.6])
def test_a_wall_that_gives_way_to_the_push_is_not_taken_for_the_gap(lp400, push):
    loads = push * bearing_load_shares(lp400)
    # springs in series: contact law K x**n, support; what the balls give way comes from their own numbers
    gone = [
        (load / float(b.contact.stiffness)) ** (1.0 / float(b.contact.exponent))
        + load / float(b.support.stiffness)
        + numbers_of(b).deflection(float(load))[0]
        for b, load in zip(lp400.touchdown_bearings, loads, strict=True)
    ]
    position = np.asarray(lp400.rotor.node_positions)
    at = position[[b.node - 1 for b in lp400.touchdown_bearings]]
    sensed = position[[node - 1 for node in dict.fromkeys(s.node for s in lp400.sensors)]]
    angle = np.repeat(np.arange(8) * np.pi / 4.0, int(0.5 * RATE))
    round_ = np.column_stack([np.cos(angle), np.sin(angle)])
    line = np.polynomial.Polynomial.fit(at, 250e-6 + np.array(gone), 1)
    rng = np.random.default_rng(1)
    paths = [radius * round_ + rng.normal(0.0, 0.5e-6, round_.shape) for radius in line(sensed)]
    record = record_of_paths(paths, lp400)
    for found, beyond in zip(measure_clearance(record, machine=lp400), gone, strict=True):
        assert found.radius == pytest.approx(250e-6 + beyond, abs=0.5e-6)
        low, high = found.interval_90
        assert low <= 250e-6 <= high
        assert found.gap == pytest.approx(250e-6, abs=0.7 * beyond + 0.5e-6)
    for found in measure_clearance(record):
        assert found.interval_90[0] > 250e-6, "without a machine the hole is measured, push included"


def test_the_command_writes_the_machine_file(lp400, tmp_path, capsys):
    rng = np.random.default_rng(3)
    for name, gap in (("before.h5", 280e-6), ("after.h5", 300e-6)):
        record = record_of_paths([pushed(rng, gap, 0.0)] * 2, lp400)
        save_record(record, tmp_path / name)
    files = [str(tmp_path / name) for name in ("before.h5", "after.h5", "new.toml", "out.json")]
    machine = str(example_path("lp400"))
    assert run(["clearance", *files[:2], "--machine", machine, "-o", files[2], "--json", files[3]]) == 0
    measured = load_machine(files[2]).bearing("NDE").air_gap
    sag = np.asarray(sag_of_model(build_drop_model(lp400)).total)[0]
    assert measured.value == pytest.approx(300e-6 - sag, abs=1e-6)
    assert measured.source == "lift check after.h5"
    assert measured.interval_90 is not None
    told = json.loads((tmp_path / "out.json").read_text())["wear"]
    assert [entry["bearing"] for entry in told] == ["NDE", "DE"]
    assert run(["clearance", files[0], "-o", files[2]]) == 64
    assert "give --machine too" in capsys.readouterr().err
