"""Deliberate mistakes in a recording, as they happen between sensor and file, or in the machine file."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.signal import butter, lfilter, sosfilt

from rotordrop.arrays import Array
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop_bench.rotors import ROTORS, bench_rotor

Random = np.random.Generator
Spoil = Callable[[Record, Machine, Random], tuple[Record, Machine]]


def spoiled(record: Record, machine: Machine, fault: str, name: str) -> tuple[Record, Machine]:
    """A record and its machine file with a mistake from `FAULTS`.

    Place, channel and sign are drawn; they follow from the names of fault and drop.
    """
    return FAULTS[fault](record, machine, np.random.default_rng(zlib.crc32(f"{fault} {name}".encode())))


def _readings(change: Callable[[Array, Record, Random], Array | None]) -> Spoil:
    """Change the readings, in place or by new ones."""

    def spoil(record: Record, machine: Machine, random: Random) -> tuple[Record, Machine]:
        signals = record.signals.copy()
        changed = change(signals, record, random)
        signals = np.ascontiguousarray(signals if changed is None else changed)
        return replace(record, signals=signals), machine

    return spoil


def _changed(signals: Array, where: tuple[Any, Any], value: Any) -> Array:
    signals[where] = value
    return signals


def _swapped(s: Array, record: Record, random: Random) -> Array:
    """The channels of the first plane are exchanged."""
    first = [i for i, sensor in enumerate(record.sensors) if sensor.node == record.sensors[0].node]
    return _changed(s, (slice(None), first), s[:, first[::-1]])


def _ends_swapped(s: Array, record: Record, random: Random) -> Array:
    nodes = [sensor.node for sensor in record.sensors]
    return s[:, np.argsort([nodes[::-1].index(node) for node in nodes], kind="stable")]


def _columns(record: Record, random: Random, which: str) -> list[int]:
    """One channel, those of one end or all."""
    column = int(random.integers(len(record.sensors)))
    node = record.sensors[column].node
    near = [c for c, one in enumerate(record.sensors) if one.node == node]
    return {"one": [column], "end": near, "all": list(range(len(record.sensors)))}[which]


def _place(record: Record, random: Random, count: int, since: float = 0.0, until: float = 0.2) -> int:
    """A sample between two record times, from which `count` samples are there."""
    first, last = np.searchsorted(record.time, [since, until])
    return int(random.integers(first, min(last, len(record.time) - count - 1)))


def _block(count: int, value: float | None, which: str = "one") -> Spoil:
    """A block holds a value, or its first reading for None."""

    def change(s: Array, record: Record, random: Random) -> None:
        at, columns = _place(record, random, count), _columns(record, random, which)
        s[at : at + count, columns] = s[at, columns] if value is None else value

    return _readings(change)


def _each(make: Callable[..., Array], which: str = "all", **how: Any) -> Spoil:
    """Change the readings (N, C) of some channels by a function of readings, record, generator and how."""

    def change(s: Array, record: Record, random: Random) -> None:
        columns = _columns(record, random, which)
        s[:, columns] = make(s[:, columns], record, random, **how)

    return _readings(change)


def _clipped(s: Array, record: Record, random: Random, share: float, noise: float = 0.0) -> Array:
    level = np.mean(s[record.time < -0.02], axis=0)
    reach = share * np.max(np.abs(s - level), axis=0)
    return np.clip(s, level - reach, level + reach) + random.normal(0.0, noise, s.shape)


def _saturated(s: Array, record: Record, random: Random, level: float) -> Array:
    limit = level * float(np.max(np.abs(s)))
    return limit * np.tanh(s / limit)


def _spikes(count: int, size: float) -> Spoil:
    def change(s: Array, record: Record, random: Random) -> None:
        at = random.choice(np.arange(10, len(s) - 10), count, replace=False)
        s[at, _columns(record, random, "one")[0]] += size * random.choice([-1.0, 1.0], count)

    return _readings(change)


def _low_pass(s: Array, record: Record, random: Random, corner: float) -> Array:
    level = np.mean(s[:200], axis=0)
    sections = butter(2, corner, fs=record.sampling_rate, output="sos")
    return np.asarray(level + sosfilt(sections, s - level, axis=0))


def _coupled(s: Array, record: Record, random: Random, corner: float) -> Array:
    upper, lower = butter(1, corner, btype="high", fs=record.sampling_rate)
    return np.asarray(lfilter(upper, lower, s - np.mean(s[:50], axis=0), axis=0))


def _drifted(s: Array, record: Record, random: Random, by: float) -> Array:
    return np.asarray(s + by * (record.time - record.time[0])[:, None])


def _hum(s: Array, record: Record, random: Random, size: float, at: float) -> Array:
    return np.asarray(s + size * np.sin(2 * np.pi * at * record.time)[:, None])


def _lost(lasts: float, since: float = 0.0, until: float = 0.2) -> Spoil:
    """All channels lose samples (from 1 on) or seconds; the clock runs on."""

    def spoil(record: Record, machine: Machine, random: Random) -> tuple[Record, Machine]:
        count = int(lasts) if lasts >= 1 else round(lasts * record.sampling_rate)
        at, left = _place(record, random, count, since, until), len(record.time) - count
        signals = np.delete(record.signals, np.s_[at : at + count], axis=0)
        speed = None if record.speed is None else record.speed[:left]
        return replace(record, signals=signals, time=record.time[:left], speed=speed), machine

    return spoil


def _twice(s: Array, record: Record, random: Random) -> Array:
    count = int(5e-3 * record.sampling_rate)
    at = _place(record, random, 2 * count)
    return np.vstack([s[: at + count], s[at:-count]])


def _clock(change: Callable[..., Array], rate: float = 1.0, **how: Any) -> Spoil:
    """Change the times of the readings, and the rate by a factor; the speed keeps to the new clock."""

    def spoil(record: Record, machine: Machine, random: Random) -> tuple[Record, Machine]:
        assert record.speed_time is not None
        time = change(record.time.copy(), record, random, **how)
        moved = np.interp(record.speed_time, record.time, time)
        rated = record.sampling_rate * rate
        return replace(record, time=time, sampling_rate=rated, speed_time=moved), machine

    return spoil


def _faster(factor: float) -> Spoil:
    return _clock(lambda t, r, _: t[0] + (t - t[0]) / factor, factor)


def _stepped(time: Array, record: Record, random: Random, samples: int) -> Array:
    time[_place(record, random, 10) :] += samples / record.sampling_rate
    return time


def _uneven(time: Array, record: Record, random: Random) -> Array:
    return np.asarray(time + 0.1 / record.sampling_rate * random.normal(0.0, 1.0, len(time)))


def _late(by: float, which: str = "one") -> Spoil:
    """Some channels are late [s]; the record begins as much later."""

    def make(s: Array, record: Record, random: Random) -> Array:
        return np.column_stack([np.interp(record.time - by, record.time, column) for column in s.T])

    def spoil(record: Record, machine: Machine, random: Random) -> tuple[Record, Machine]:
        changed, _ = _each(make, which)(record, machine, random)
        return changed.window(float(record.time[0]) + by, np.inf), machine

    return spoil


def _speed(change: Callable[[Array, Array], Array] | None) -> Spoil:
    """Change the speed readings at their times; None takes them away."""

    def spoil(record: Record, machine: Machine, random: Random) -> tuple[Record, Machine]:
        if change is None:
            return replace(record, speed=None, speed_time=None, speed_readings=None), machine
        assert record.speed_readings is not None and record.speed_time is not None
        read = change(record.speed_readings.copy(), record.speed_time)
        speed = np.interp(record.time, record.speed_time, read)
        return replace(record, speed_readings=read, speed=speed), machine

    return spoil


def _tacho_lost(read: Array, when: Array) -> Array:
    read[5::7] *= 0.5
    return read


def _turned(s: Array, record: Record, random: Random) -> None:
    own, turn = _columns(record, random, "end"), np.radians(20.0) * random.choice([-1.0, 1.0])
    c, sine = np.cos(turn), np.sin(turn)
    s[:, own] = s[:, own] @ np.array([[c, sine], [-sine, c]])


def _crossed(s: Array, record: Record, random: Random) -> Array:
    """The first channels of the first and last plane are exchanged."""
    nodes = [one.node for one in record.sensors]
    pair = [0, nodes.index(nodes[-1])]
    return _changed(s, (slice(None), pair), s[:, pair[::-1]])


def _part(since: float, until: float) -> Spoil:
    return lambda record, machine, random: (record.window(since, until), machine)


def _again(record: Record, machine: Machine, random: Random) -> tuple[Record, Machine]:
    """The rotor is lifted and dropped again."""
    once, count = record.signals, int(0.1 * record.sampling_rate)
    ramp = np.linspace(0.0, 1.0, count)[:, None]
    lift = once[-1] * (1.0 - ramp) + once[0] * ramp + random.normal(0.0, 0.4e-6, (count, once.shape[1]))
    signals = np.vstack([once, lift, once + random.normal(0.0, 0.2e-6, once.shape)])
    assert record.speed_readings is not None
    time = record.time[0] + np.arange(len(signals)) / record.sampling_rate
    read, held = (np.full(count, record.speed_readings[0]) for count in (len(time[::200]), len(time)))
    twice = {"signals": signals, "time": time, "speed": held, "speed_time": time[::200]}
    return replace(record, **twice, speed_readings=read), machine


def _file(change: Callable[[Machine], Machine]) -> Spoil:
    """A wrong machine file; the channels keep their names and order."""
    return lambda record, machine, random: (record, change(machine))


def _ambs_exchanged(machine: Machine) -> Machine:
    first, *middle, last = machine.ambs
    return machine.changed(ambs=(first.changed(node=last.node), *middle, last.changed(node=first.node)))


def _sensors_exchanged(machine: Machine) -> Machine:
    nodes = [one.node for one in machine.sensors]
    swap = {min(nodes): max(nodes), max(nodes): min(nodes)}
    return machine.changed(sensors=tuple(one.changed(node=swap[one.node]) for one in machine.sensors))


def _no_disc(machine: Machine) -> Machine:
    """Without the heaviest disc."""
    discs = sorted(machine.rotor.discs, key=lambda disc: float(disc.mass))[:-1]
    return machine.changed(rotor=machine.rotor.changed(discs=tuple(discs)))


def _gaps_doubled(machine: Machine) -> Machine:
    gaps = {
        f"{one.name}.air_gap": Known(value=2.0 * float(one.air_gap)) for one in machine.touchdown_bearings
    }
    return machine.with_values(gaps)


def _next_rotor(machine: Machine) -> Machine:
    """The file of the rotor with the next larger mass, with channels named alike."""
    every = list(ROTORS)  # in rising order of mass
    mass = build_rotor_fe(machine).total_mass
    apart = [abs(np.log(build_rotor_fe(bench_rotor(name)).total_mass / mass)) for name in every]
    mine = int(np.argmin(apart))
    other = bench_rotor(every[mine + 1 if mine + 1 < len(every) else mine - 1])
    named = zip(other.sensors, machine.sensors, strict=True)
    return other.changed(
        sensors=tuple(a.changed(name=b.name, angle=b.angle, polarity=b.polarity) for a, b in named)
    )


FAULTS: dict[str, Spoil] = {
    "inverted polarity": _readings(lambda s, r, _: _changed(s, (slice(None), 0), -s[:, 0])),
    "swapped ends": _readings(_ends_swapped),
    "swapped axes": _readings(_swapped),
    "mil taken for micrometre": _readings(lambda s, r, _: 25.4 * s),
    "clipping": _readings(lambda s, r, _: np.clip(s, *(0.6 * np.max(np.abs(s)) * np.array([-1.0, 1.0])))),
    "dead channel": _readings(lambda s, r, _: _changed(s, (slice(None), -1), s[0, -1])),
    "missing sample": _readings(lambda s, r, _: _changed(s, (len(s) // 2, 0), np.nan)),
    "20 samples NaN in all": _block(20, np.nan, "all"),
    "1 sample infinite": _block(1, np.inf),
    "channel dead, 0.2 µm noise": _each(lambda s, r, d: s[0] + d.normal(0.0, 0.2e-6, s.shape), "one"),
    "6 samples stuck": _block(6, None),
    "20 samples stuck": _block(20, None),
    "200 samples stuck": _block(200, None),
    "20 samples stuck in all": _block(20, None, "all"),
    "4 zeros in one channel": _block(4, 0.0),
    "512 zeros in one channel": _block(512, 0.0),
    "64 zeros in all": _block(64, 0.0, "all"),
    "clipped at 80 %": _each(_clipped, share=0.8),
    "clipped at 50 %": _each(_clipped, share=0.5),
    "clipped at 70 %, 0.2 µm noise": _each(_clipped, share=0.7, noise=0.2e-6),
    "saturates softly at 1.0 × the largest": _each(_saturated, level=1.0),
    "saturates softly at 1.5 × the largest": _each(_saturated, level=1.5),
    "1 spike of 100 µm": _spikes(1, 100e-6),
    "10 spikes of 50 µm": _spikes(10, 50e-6),
    "steps of 2 µm": _each(lambda s, r, d: 2e-6 * np.round(s / 2e-6)),
    "AC coupling 3 Hz": _each(_coupled, corner=3.0),
    "low-pass 100 Hz": _each(_low_pass, corner=100.0),
    "low-pass 400 Hz": _each(_low_pass, corner=400.0),
    "hum 10 µm, 50 Hz": _each(_hum, size=10e-6, at=50.0),
    "steps of 8 µm": _each(lambda s, r, d: 8e-6 * np.round(s / 8e-6)),
    "AC coupling 1 Hz": _each(_coupled, corner=1.0),
    "hum 100 µm, 60 Hz": _each(_hum, size=100e-6, at=60.0),
    "drift of one by 100 µm/s": _each(_drifted, "one", by=100e-6),
    "drift of all by 100 µm/s": _each(_drifted, by=100e-6),
    "noise 10 µm in one": _each(lambda s, r, d: s + d.normal(0.0, 10e-6, s.shape), "one"),
    "noise 5 µm in all": _each(lambda s, r, d: s + d.normal(0.0, 5e-6, s.shape)),
    "1 sample lost": _lost(1),
    "5 samples lost": _lost(5),
    "5 samples lost in the first 5 ms": _lost(5, 2e-3, 5e-3),
    "5 samples lost before the drop": _lost(5, -0.04, -0.02),
    "20 ms lost": _lost(20e-3),
    "5 ms there twice": _readings(_twice),
    "jitter of 0.1 samples in the clock": _clock(_uneven),
    "clock 20 samples back": _clock(_stepped, samples=-20),
    "clock 20 samples on": _clock(_stepped, samples=20),
    "ms as s": _clock(lambda t, r, _: 1e3 * t, 1e-3),
    "rate + 2 %": _faster(1.02),
    "rate + 10 %": _faster(1.1),
    "rate doubled": _faster(2.0),
    "rate halved": _faster(0.5),
    "channel 0.3 ms late": _late(0.3e-3),
    "channel 1 ms late": _late(1e-3),
    "end 1 ms late": _late(1e-3, "end"),
    "speed missing": _speed(None),
    "speed zero": _speed(lambda read, when: 0.0 * read),
    "speed dies at the drop": _speed(lambda read, when: np.where(when < 0.0, read, 0.0)),
    "speed negative": _speed(lambda read, when: -read),
    "rpm as Hz": _speed(lambda read, when: 60.0 * read),
    "Hz as rad/s": _speed(lambda read, when: read / (2.0 * np.pi)),
    "two pulses per turn": _speed(lambda read, when: 2.0 * read),
    "speed + 3 %": _speed(lambda read, when: 1.03 * read),
    "tacho pulses lost": _speed(_tacho_lost),
    "axes exchanged in all planes": _readings(lambda s, r, _: s[:, [1, 0, 3, 2]]),
    "all channels inverted": _each(lambda s, r, _: -s),
    "a channel of both ends exchanged": _readings(_crossed),
    "sensors of an end turned by 20°": _readings(_turned),
    "gain of one + 20 %": _each(lambda s, r, _: 1.2 * s, "one"),
    "gain of one − 20 %": _each(lambda s, r, _: 0.8 * s, "one"),
    "gain of an end + 20 %": _each(lambda s, r, _: 1.2 * s, "end"),
    "gain of all + 20 %": _each(lambda s, r, _: 1.2 * s),
    "gain of all − 20 %": _each(lambda s, r, _: 0.8 * s),
    "begins 30 ms after the drop": _part(0.03, np.inf),
    "no drop": _part(-np.inf, -0.01),
    "second drop": _again,
    "ends 50 ms after the drop": _part(-np.inf, 0.05),
    "file: AMB nodes exchanged": _file(_ambs_exchanged),
    "file: sensor nodes exchanged": _file(_sensors_exchanged),
    "file: the next larger rotor": _file(_next_rotor),
    "file: heaviest disc missing": _file(_no_disc),
    "file: gaps × 2": _file(_gaps_doubled),
}
"""Mistakes, the plain ones first; nothing here knows how the gate finds them."""
PLAIN = 7
"""Mistakes that have no size: of the first or last channel, or of all."""
