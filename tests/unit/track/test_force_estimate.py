"""The force on a rotor from its motion alone, for rotors that other equations have moved."""

import re
from dataclasses import replace

import numpy as np
import pytest

from rotordrop import Known, Record, estimate_force, example_machine
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UsageError
from rotordrop.machine import loads_machine
from rotordrop.rotor.suspension import spring

RATE = 8000.0
COUNT = 1000
INERTIA, POLAR = 0.12, 0.003
MAGNET, BEARING, SENSOR, STATOR = 0.08, 0.16, 0.24, 0.4
STIFFNESS, DAMPING, SPEED = 4e4, 20.0, 125.0

EXACT = {"gain": Known(value=1.0), "offset": Known(value=0.0)}
SHAFT = 800.0 * np.pi / 4.0 * 0.03**2 * STATOR
"""Mass of the shaft of the rig [kg]."""
RIG = f"""
name = "rig"
speed = {{ nominal = "{SPEED} rad/s" }}
[rotor]
material = "light"
node_positions = {{ unit = "m", values = [0, {MAGNET}, {BEARING}, {SENSOR}, {STATOR}] }}
sections = [{{ nodes = [1, 5], outer_diameter = "30 mm" }}]
materials = {{ light = {{ youngs_modulus = "690 GPa", poisson_ratio = 0.3, density = "800 kg/m^3" }} }}
discs = [{{ node = 4, mass = "1 kg", polar_inertia = "{POLAR - SHAFT * 0.03**2 / 8.0} kg m^2", \
diametral_inertia = "{INERTIA - SENSOR**2 - SHAFT * (STATOR**2 / 3.0 + 0.03**2 / 16.0)} kg m^2" }}]
[[ambs]]
name = "joint"
node = 1
stiffness = "1e9 N/m"
damping = "1e4 N s/m"
[[ambs]]
name = "bearing"
node = 3
stiffness = "{STIFFNESS} N/m"
damping = "{DAMPING} N s/m"
[[touchdown_bearings]]
name = "stator"
node = 5
air_gap = "1 mm"
bore_radius = "16 mm"
bearing = {{ ball_diameter = "5 mm", ball_count = 8, pitch_diameter = "40 mm", contact_angle = "15 deg", \
preload = "10 N", arrangement = "single" }}
contact = {{ stiffness = "1e8 N/m^1.111" }}
friction = {{ dynamic = 0.1 }}
support = {{ mass = "2 kg", stiffness = "1e7 N/m", damping = "2000 N s/m" }}
"""


@pytest.fixture(scope="module")
def rig():
    """A rigid rotor that swings about a joint, held by one spring with a damper."""
    return loads_machine(RIG)


def pull(time):
    """Force of a magnet on the rotor [N], shape (N, 2)."""
    grown = 30.0 * np.sin(np.pi * np.clip(time / 0.12, 0.0, 1.0)) ** 2
    return np.column_stack([grown, 0.3 * grown])


def knock(time):
    """Force of a stator on the rotor [N], shape (N, 2): one half sine of 3 ms."""
    pulse = np.where(np.abs(time - 0.0625) < 0.0015, np.cos(np.pi * (time - 0.0625) / 0.003), 0.0)
    return np.column_stack([-16.0 * pulse, -12.0 * pulse])


def swung(*, knocked=False, unbalance=0.0, noise=0.3e-6):
    """What two sensors in one plane read of the rig: tilts of a pendulum by Runge and Kutta."""
    fine = 10
    time = np.arange((COUNT - 1) * 2 * fine + 1) / (2 * fine * RATE)
    moment = MAGNET * pull(time) + (STATOR * knock(time) if knocked else 0.0)
    spun = np.column_stack([np.cos(SPEED * time + 1.0), np.sin(SPEED * time + 1.0)])
    moment = moment + SENSOR * unbalance * SPEED**2 * spun
    swirl = SPEED * POLAR * np.array([[0.0, 1.0], [-1.0, 0.0]])

    def rate(y, m):
        pushed = m - BEARING**2 * (STIFFNESS * y[:2] + DAMPING * y[2:]) - swirl @ y[2:]
        return np.concatenate([y[2:], pushed / INERTIA])

    y, path, h = np.array([1e-3, -5e-4, 0.0, 0.05]), [], 1.0 / (fine * RATE)
    for i in range((COUNT - 1) * fine + 1):
        if i % fine == 0:
            path.append(y[:2])
        if i == (COUNT - 1) * fine:
            break
        a, b, c = moment[2 * i], moment[2 * i + 1], moment[2 * i + 2]
        k1 = rate(y, a)
        k2 = rate(y + 0.5 * h * k1, b)
        k3 = rate(y + 0.5 * h * k2, b)
        k4 = rate(y + h * k3, c)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    sensors = (
        Sensor(name="right", node=4, angle="0 deg", **EXACT),
        Sensor(name="down", node=4, angle="90 deg", polarity=-1, **EXACT),
    )
    signals = SENSOR * np.array(path) * np.array([1.0, -1.0])
    signals += noise * np.random.default_rng(5).standard_normal(signals.shape)
    return Record(time=np.arange(COUNT) / RATE, signals=signals, sensors=sensors, sampling_rate=RATE)


def away_from_the_ends(record):
    """The record less a tenth at either end."""
    return slice(len(record.time) // 10, -len(record.time) // 10)


def test_the_force_that_pulls_a_rotor_is_found_from_its_motion(rig):
    record = swung()
    found = estimate_force(rig, record, nodes=[2])
    part, true = away_from_the_ends(record), pull(record.time)
    error = found.force[part, 0] - true[part]
    assert np.sqrt(np.mean(error**2)) < 0.02 * true.max()
    assert 0.8 < np.mean(np.abs(error) < 1.6449 * found.sigma[part, 0]) <= 1.0
    assert found.taken_as_exact == tuple(
        f"ambs.{name}.{value}" for name in ("joint", "bearing") for value in ("stiffness", "damping")
    )
    at_magnet = record.along * record.directions.sum(axis=1) * MAGNET / SENSOR
    np.testing.assert_allclose(found.displacement[part, 0], at_magnet[part], atol=1e-6)


def test_a_knock_is_found_where_the_force_of_the_magnet_is_known(rig):
    record = swung(knocked=True)
    for bandwidth in (None, 300.0, 600.0):
        found = estimate_force(
            rig, record, nodes=[5], known_forces={2: pull(record.time)}, bandwidth=bandwidth
        )
        near = np.abs(record.time - 0.0625) < 0.004
        impulse = found.force[near, 0].sum(axis=0) / RATE
        true = knock(record.time).sum(axis=0) / RATE
        assert np.hypot(*(impulse - true)) < 0.02 * np.hypot(*true), (bandwidth, impulse, true)
        assert found.bandwidth == bandwidth or 50.0 < found.bandwidth < 1300.0


FREE = re.sub(r"discs = .*\n", "", RIG.replace("690 GPa", "2e5 GPa").replace("800 kg", "10610 kg")).replace(
    f"[0, {MAGNET}, {BEARING}, {SENSOR}, {STATOR}]", "[0, 0.04, 0.08, 0.12, 0.16]"
)
"""A rigid rotor of 1.2 kg that nothing holds; node 3 is its middle."""


def bounced(stiffness, restitution, height, rate, noise):
    """Readings of both planes and force on the middle of a rotor that falls on a Hertz contact [N].

    Three impacts in 32 ms, damped after Flores 2011; midpoint rule in a twentieth of a sample.
    """
    mass = 10610.0 * np.pi / 4.0 * 0.03**2 * 0.16
    count, fine = round(0.032 * rate), 20
    step, y, v, struck = 1.0 / (fine * rate), height, 0.0, 0.0

    def pushed(y, v):
        depth = max(-y, 0.0)
        damped = 1.0 - 1.6 * (1.0 - restitution) / restitution * v / max(struck, 1e-6)
        return max(stiffness * depth**1.5 * damped, 0.0)

    path, force = np.empty(count), np.empty(count)
    for i in range(count * fine):
        if i % fine == 0:
            path[i // fine], force[i // fine] = y, pushed(y, v)
        struck = 0.0 if y > 0.0 else struck or -v
        half = 0.5 * step * (pushed(y, v) / mass - 9.81)
        y, v = y + step * (v + half), v + step * (pushed(y + 0.5 * step * v, v + half) / mass - 9.81)
    across = noise * np.random.default_rng(3).standard_normal((count, 4))
    return np.column_stack([0.0 * path, path - height] * 2) + across, force


@pytest.mark.parametrize(
    ("stiffness", "restitution", "height", "rate", "noise"),
    [(2.46e8, 0.76, 2.2e-4, 20e3, 0.5e-6), (2e9, 0.76, 2.2e-4, 20e3, 0.5e-6), (2e9, 0.6, 4e-4, 40e3, 0.3e-6)],
)
def test_the_band_holds_the_force_inside_sharp_impacts(stiffness, restitution, height, rate, noise):
    signals, force = bounced(stiffness, restitution, height, rate, noise)
    sensors = tuple(
        Sensor(name=f"{n} {a}", node=n, angle=f"{a} deg", **EXACT) for n in (2, 4) for a in (0, 90)
    )
    time = np.arange(len(signals)) / rate
    record = Record(time=time, signals=signals, sensors=sensors, sampling_rate=rate)
    found = estimate_force(loads_machine(FREE), record, nodes=[3], held="free-free")
    part = away_from_the_ends(record)
    inside = np.zeros(len(force), dtype=bool)
    inside[part] = force[part] > 0.0
    held = np.abs(found.force[:, 0, 1] - force) < 1.6449 * found.sigma[:, 0, 1]
    assert 0.75 < held[inside].mean() < 0.99
    assert found.force[part, 0, 1].max() == pytest.approx(force[part].max(), rel=0.05)
    first = slice(*(np.flatnonzero(inside)[0] + np.array([-20, round(6e-3 * rate)])))
    assert found.force[first, 0, 1].sum() == pytest.approx(force[first].sum(), rel=7e-3)


def test_the_band_holds_what_nobody_knows_of_machine_and_unbalance(rig):
    record, part = swung(), None
    part = away_from_the_ends(record)
    true = pull(record.time)[part]

    def held(machine, seen):
        found = estimate_force(machine, seen, nodes=[2], bandwidth=60.0)
        return float(np.mean((found.lower[part, 0] <= true) & (true <= found.upper[part, 0])))

    stiff = 1.08 * STIFFNESS
    ranged = Known(value=stiff, status="guess", range=(0.85 * stiff, 1.15 * stiff))
    assert held(rig.with_values({"ambs.bearing.stiffness": stiff}), record) < 0.5
    assert held(rig.with_values({"ambs.bearing.stiffness": ranged}), record) > 0.9

    shaken = swung(unbalance=2e-5)
    assert held(rig, shaken) < 0.6
    text = f'{RIG}\n[[unbalances]]\nnode = 4\namount = "20 g mm"\nphase = "0 deg"\n'
    assert held(loads_machine(text), shaken) > 0.85

    loose = tuple(
        one.model_copy(
            update={
                "gain": Known(value=0.98, interval_90=(0.94, 1.02)),
                "offset": Known(value=20e-6, standard_error=20e-6),
            }
        )
        for one in record.sensors
    )
    assert held(rig, replace(record, sensors=loose)) > 0.85


def test_springs_beside_the_file_hold_the_rotor_too(rig):
    record = swung()
    whole = estimate_force(rig, record, nodes=[2], bandwidth=60.0)
    half = rig.with_values({"ambs.bearing.stiffness": 0.5 * STIFFNESS})
    both = estimate_force(half, record, nodes=[2], supports=[spring(3, 0.5 * STIFFNESS)], bandwidth=60.0)
    np.testing.assert_allclose(both.force, whole.force, atol=1e-3)
    crossed = [spring(3, [[0.0, 4e3], [-4e3, 0.0]])]
    other = estimate_force(rig, record, nodes=[2], supports=crossed, bandwidth=60.0)
    # k x at the bearing, seen from the magnet, less what it was without
    x, y = (record.along * record.directions.sum(axis=1) * BEARING / SENSOR).T
    pushed = 4e3 * np.column_stack([y, -x]) * BEARING / MAGNET
    part = away_from_the_ends(record)
    np.testing.assert_allclose((other.force - whole.force)[part, 0], pushed[part], atol=0.3)


def test_a_free_rotor_that_falls_is_pushed_by_nothing():
    machine = example_machine("small")
    rate, count = 20_000.0, 400
    time = np.arange(count) / rate
    fall = -0.5 * 9.81 * time**2
    signals = np.column_stack([fall * np.sin(float(one.angle)) * one.polarity for one in machine.sensors])
    signals += 0.3e-6 * np.random.default_rng(1).standard_normal(signals.shape)
    record = Record(time=time, signals=signals, sensors=machine.sensors, sampling_rate=rate)
    found = estimate_force(machine.model_copy(update={"unbalances": ()}), record, held="free-free")
    weight = machine.rotor.mass * 9.81
    part = away_from_the_ends(record)
    assert found.nodes == tuple(bearing.node for bearing in machine.touchdown_bearings)
    assert np.abs(found.force[part].sum(axis=1)).mean() < 0.1 * weight


def test_missing_readings_are_bridged(rig):
    record = swung()
    gappy = record.signals.copy()
    gappy[500:505], gappy[300:310, 1] = np.nan, np.nan
    whole = estimate_force(rig, record, nodes=[2], bandwidth=60.0)
    found = estimate_force(rig, replace(record, signals=gappy), nodes=[2], bandwidth=60.0)
    np.testing.assert_allclose(found.force, whole.force, atol=0.3)


def test_what_cannot_be_found_is_refused_with_the_way_out(rig):
    record = swung()
    with pytest.raises(UsageError, match=r"nodes = \[2, 9\]; expected different nodes of the rotor, 1 to 5"):
        estimate_force(rig, record, nodes=[2, 9])
    with pytest.raises(
        UsageError, match=r"2 sensors do not distinguish the forces at nodes \[2, 5\].*at most 1"
    ):
        estimate_force(rig, record, nodes=[2, 5])
    with pytest.raises(UsageError, match=r"bandwidth is 5000 Hz; 0\.125 s at 8000 Hz allow 8 to 1333 Hz"):
        estimate_force(rig, record, nodes=[2], bandwidth=5000.0)
    with pytest.raises(
        UsageError, match=r"the known force at node 5 has the shape \(3, 2\); expected \(1000, 2\)"
    ):
        estimate_force(rig, record, nodes=[2], known_forces={5: np.zeros((3, 2))})
    with pytest.raises(UsageError, match=r"held is 'springs'; expected one of free-free, AMBs"):
        estimate_force(rig, record, nodes=[2], held="springs")
    guessed = loads_machine(RIG.replace(f'damping = "{DAMPING} N s/m"', ""))
    with pytest.raises(UsageError, match=r"ambs\.bearing\.damping is left out of the machine file"):
        estimate_force(guessed, record, nodes=[2])
    with pytest.raises(
        RecordError, match=r"the record has 17 samples; a force is estimated from 64 to 20000"
    ):
        estimate_force(rig, record.window(0.0, 0.002), nodes=[2])
    time = record.time.copy()
    time[500:] += 1e-4
    with pytest.raises(RecordError, match=r"the samples lie 0\.000125 to 0\.000225 s apart"):
        estimate_force(rig, replace(record, time=time), nodes=[2])
